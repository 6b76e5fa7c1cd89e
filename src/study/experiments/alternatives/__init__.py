"""Compare methods that solve the same scenes by their error and their time per frame."""
