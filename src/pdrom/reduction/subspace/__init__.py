"""Position subspaces q = B z: columns B, reduced system, and weighted sampling of elements."""
