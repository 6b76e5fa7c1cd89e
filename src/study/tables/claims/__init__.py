"""Verdicts on the preprint's claims by the rules of config/claims.yaml.

A claim gets two verdicts: "published" is about the preprint's variants of the method and its
scenes, "beyond" about numerically sound variants. A test compares a metric of rows of a table with
a threshold. Tests with ``decides`` determine the verdict; others are only reported.
"""
