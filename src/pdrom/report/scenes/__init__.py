"""Artifacts of a single scene, in the study or outside it, beside the study's own."""
