"""Drawings: ``draw(results, options)`` returns a matplotlib figure."""
