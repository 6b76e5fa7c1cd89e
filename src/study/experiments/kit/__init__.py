"""Help experiments to read settings, measure times, and store runs and reductions."""
