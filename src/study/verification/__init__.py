"""``./reproduce verify``: whether the results of the last run are the expected ones."""
