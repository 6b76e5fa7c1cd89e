"""Figures of manuscript and report, one module each; see `study.figures.kit.declaration`.

Every plan imports them, so that they load no plotting library before one is drawn.
"""
