"""Figures of manuscript and report, one module per subject; see `study.figures.kit.declaration`.

These modules import the plotting library only when drawing, as workflow planning imports them too.
"""
