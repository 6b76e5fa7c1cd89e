"""Meshes: generators, files, configuration, checks, and selections of vertices."""
