"""Figures of manuscript and report, one module for each subject.

The modules import the plotting library only when they draw: planning a run imports them, too.
"""
