"""Verdicts on the preprint's claims by the rules of config/claims.yaml.

A claim gets two verdicts: "published" for the preprint's variants and scenes, "beyond" for sound
variants. A test compares a metric over chosen table rows with a threshold. Tests with ``decides``
give the verdict; the other tests are only reported in its reason.
"""
