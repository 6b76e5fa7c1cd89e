"""Helpers for figures: declaration, reading of results, labels, drawing of elements."""
