"""Reduced runs: the reduced local step and the rerun of a scene with it."""
