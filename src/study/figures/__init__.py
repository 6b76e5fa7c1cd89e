"""Figures of the paper and its supplement, one module for each subject.

Planning a run imports these modules, so they import the plotting library only when they draw.
"""
