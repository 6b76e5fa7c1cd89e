"""What the machine allows, and what an iteration asks of it (Williams et al. 2009)."""
