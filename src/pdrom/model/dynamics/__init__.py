"""The step loop of projective dynamics, its global system and its acceleration."""
