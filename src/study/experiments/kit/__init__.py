"""Helpers of experiments: settings, measurement of times, and files of runs and reductions."""
