"""Helpers for figures: their declaration, their options, and the drawing of elements."""
