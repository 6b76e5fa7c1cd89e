"""Hard cases: scenes with extreme input, and the properties that their runs must have."""
