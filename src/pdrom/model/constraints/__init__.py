"""Constraint groups of projective dynamics, one a module (see `pdrom.model.effects`)."""
