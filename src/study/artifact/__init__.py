"""Artifacts (functions declared to make files of the study): declarations, paths and logs."""
