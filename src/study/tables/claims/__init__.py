"""Verdicts on the preprint's claims, by rules of config/claims.yaml that code evaluates.

A claim is decided twice, as published and beyond, each time by tests: a metric over chosen rows of
the tables, compared with a threshold. Tests marked ``decides`` give the verdict, the others stand
beside it in the reason.
"""
