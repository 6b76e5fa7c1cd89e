"""The step loop of projective dynamics with its global system and Anderson acceleration."""
