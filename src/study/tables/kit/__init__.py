"""Helpers for tables: declarations, shared columns, functions that join experiment results."""
