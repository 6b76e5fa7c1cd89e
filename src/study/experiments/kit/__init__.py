"""Helpers of experiments: settings, measurement, and runs that several experiments need."""
