"""What a configuration holds, where results lie, and what has to run."""
