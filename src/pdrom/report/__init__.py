"""Figures, manuscript and viewers for readers."""
