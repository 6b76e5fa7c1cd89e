"""Helpers for figures: declaration of figures and of their options, and drawing of elements."""
