"""Grammar of artifacts: what the study makes, by a function under a declaration of its reads."""
