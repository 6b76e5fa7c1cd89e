"""Plan of a configuration: its contents, where results lie, and what has to run."""
