"""Runs of the full-order model."""
