"""Rates of the machine, and the work of an iteration (Williams et al. 2009)."""
