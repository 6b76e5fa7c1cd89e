"""pdrom: can POD + DEIM take over the local step of projective dynamics?

Data flow, one direction only: scene -> mesh -> constraints -> full-order run -> snapshots -> basis
-> sampling -> reduced run -> tables -> figures -> paper.
"""

__version__ = "0.2.0"
