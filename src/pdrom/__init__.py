"""Simulate elastic bodies with projective dynamics, and reduce the local step by POD and DEIM.

Data flow in one direction: scene -> mesh -> constraints -> full-order run -> snapshots -> basis
-> sampling -> reduced run -> tables -> figures -> paper.
"""

__version__ = "0.2.0"
