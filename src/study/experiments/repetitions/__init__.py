"""Repeat reduced runs, change one choice of a method, or use bases made of rounding errors."""
