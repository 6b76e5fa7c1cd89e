"""Meshes: generators, files, checks, vertex selections."""
