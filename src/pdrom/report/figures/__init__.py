"""Figures of manuscript and report, one module each: what a figure is, reads and lets choose.

Every module of this package declares one figure, ``FIGURE``, and loads no plotting library. It is
drawn by the module of `drawings` with the same name unless it names another; `kit` holds what
figures share.
"""
