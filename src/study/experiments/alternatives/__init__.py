"""Alternatives to projective dynamics, on the axes of error and time."""
