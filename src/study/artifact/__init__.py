"""Artifacts of the study (files made by a declared function): declarations, paths and logs."""
