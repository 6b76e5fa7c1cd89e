"""Shared code of all packages: errors, storage of results, configuration, registries."""
