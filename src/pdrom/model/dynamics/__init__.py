"""The step loop of projective dynamics and its global system."""
