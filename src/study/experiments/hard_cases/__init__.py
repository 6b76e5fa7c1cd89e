"""Hard cases: scenes with extreme input, and properties that every run of them must have."""
