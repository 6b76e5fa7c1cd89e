"""Alternatives to projective dynamics for the same energy and the same scenes."""
