"""The manuscript as web pages, with a link from each number to the table rows behind it."""
