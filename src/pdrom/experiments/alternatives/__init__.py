"""What one could take in place of projective dynamics, on the axes of error and time."""
