"""Tools of the figures: their declaration, what they read, and what draws."""
