"""Position subspaces: columns, coordinates, reduced system, element sampling with weights."""
