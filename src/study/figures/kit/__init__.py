"""Helpers for figures: declaration of figures, and drawing of elements."""
