"""The manuscript as web pages: its text, with links from each number to its table."""
