"""Constraint groups of projective dynamics and the compiled kernels of their projections."""
