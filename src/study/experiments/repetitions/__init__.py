"""Reduced runs: repeated, with one choice changed, or with bases computed from rounding errors."""
