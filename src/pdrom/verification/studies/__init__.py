"""``./reproduce compare A B``: two studies side by side, as a page and an exit code."""
