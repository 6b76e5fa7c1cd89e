"""Jobs that start from a process in which the libraries are loaded already.

A job's interpreter needs about a second to load NumPy, SciPy, pandas and numba, and a study has
hundreds of jobs. One server process loads them once; each job is a fork of it. The workflow starts
scripts by `client.py`, which asks the server for a fork, hands over its streams, environment and
folder, and ends as the fork ends. Where no server answers (a platform without safe forks), the
client becomes the plain interpreter itself.
"""

from pdrom.pipeline.warm.start import interpreter, start_server

__all__ = ["interpreter", "start_server"]
