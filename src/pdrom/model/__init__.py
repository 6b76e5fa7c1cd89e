"""The full-order model: meshes, effects, constraint groups and the step loop."""
