"""The manuscript as a page: its text, and where each of its numbers comes from."""
