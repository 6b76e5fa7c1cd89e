"""Experiments: functions that run models and write files of results, a module per subject."""
