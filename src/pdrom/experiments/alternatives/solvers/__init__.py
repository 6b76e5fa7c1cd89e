"""What one could take in place of projective dynamics for the same energy and the same scenes."""
