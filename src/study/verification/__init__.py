"""Compare the results of the last run with the expected results (``./reproduce verify``)."""
