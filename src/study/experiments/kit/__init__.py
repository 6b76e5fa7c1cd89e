"""Helpers of experiments: settings, measurement, runs that only experiments make."""
