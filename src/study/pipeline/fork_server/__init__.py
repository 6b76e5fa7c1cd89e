"""Jobs that start from a process in which the libraries are loaded already.

A job's interpreter needs about a second to load NumPy, SciPy, pandas and numba, and a study has
hundreds of jobs. One server process loads them once; each job is a fork of it. The workflow starts
scripts by `client.py`, which asks the server for a fork, hands over its streams, environment and
folder, and ends as the fork ends. Where no server answers (a platform without safe forks, a server
that was killed), the client becomes the plain interpreter itself (`alone.py`).

No job outlives its run, whichever process is killed: the server ends the forks of a client or of a
run that is gone, the system ends those of a server that is gone, the client what they had started,
and a plain interpreter waits for the end of its run.
"""

from study.pipeline.fork_server.start import hold_pipe, interpreter, start_server

__all__ = ["hold_pipe", "interpreter", "start_server"]
