"""Methods that solve the same scenes, with the same energies, as projective dynamics."""
