"""Experiments: functions that run models and write files of results, by subject."""
