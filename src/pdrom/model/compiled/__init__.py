"""Compilation and caching of functions with Numba, and vectors (rows) of four numbers."""
