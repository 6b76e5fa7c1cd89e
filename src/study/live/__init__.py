"""The page on which reduced models run, and what draws runs in a browser."""
