"""Experiments of the study, one module for each question that the study answers."""
