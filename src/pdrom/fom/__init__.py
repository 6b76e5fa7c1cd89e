"""The full-order model: global system, step loop, run."""
