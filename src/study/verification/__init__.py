"""``./reproduce verify``: comparison of the last run's results with the expected results."""
