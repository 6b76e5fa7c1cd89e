"""Hard cases: scenes at the edge of what may happen, what must hold."""
