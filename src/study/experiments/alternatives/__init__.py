"""Comparison of methods that solve the same scenes: error against time per frame."""
