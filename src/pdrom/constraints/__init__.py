"""Constraint groups of projective dynamics, one a module, loaded through `pdrom.effects.EFFECTS`."""
