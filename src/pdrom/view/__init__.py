"""Pictures of runs, and a self-contained HTML page that shows them in a browser."""
