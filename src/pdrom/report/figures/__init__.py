"""Figures of manuscript and report, one module each; see `pdrom.report.figures.kit.declaration`.

Every plan imports them, so that they load no plotting library before one is drawn.
"""
