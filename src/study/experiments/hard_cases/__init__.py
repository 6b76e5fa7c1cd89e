"""Hard cases: scenes with extreme input, and how reductions fare in them."""
