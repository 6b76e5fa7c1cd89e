"""Verdicts on the preprint's claims by the rules of config/claims.yaml.

A claim gets two verdicts: "published" for the preprint's variants of the method and its scenes,
"beyond" for the improved method and well-posed scenes. A test compares a metric of rows of a table
with a threshold. Tests with ``decides`` determine the verdict; other tests are only reported.
"""
