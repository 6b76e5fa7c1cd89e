"""The questions that the study asks, one module each."""
