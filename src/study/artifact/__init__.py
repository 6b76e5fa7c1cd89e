"""Declare artifacts (functions that make files of the study), with paths of files and logs."""
