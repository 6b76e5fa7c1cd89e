"""Helpers for tables: declaration of a table, shared columns, joining of experiment results."""
