"""Comparison of projective dynamics with alternatives: error against time per frame."""
