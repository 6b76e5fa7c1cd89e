"""Cause faults in the jobs of a sandbox, see `sandbox.Sandbox.run`.

Python imports this module at its start. ``PDROM_FAULT`` is ``kind:pattern``. A fault occurs when a
result is complete and about to be renamed, if its temporary file (not its checksum) matches the
pattern: the process is killed ("kill"), gets a full disk ("full"), waits for a slow disk ("slow")
or waits until its folder contains a file `release` ("hold").
"""

import errno
import os
import re
import signal
import time

_kind, _, _pattern = os.environ.get("PDROM_FAULT", "").partition(":")
_fsync = os.fsync


def _faulty_fsync(descriptor):
    number = descriptor if isinstance(descriptor, int) else descriptor.fileno()
    name = os.readlink(f"/proc/self/fd/{number}")
    if re.search(_pattern, name) and not name.endswith(".blake2b"):
        if _kind == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if _kind == "full":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        if _kind == "hold":
            while not os.path.exists("release"):
                time.sleep(0.05)
        else:
            time.sleep(3)
    _fsync(descriptor)


if _kind:
    os.fsync = _faulty_fsync
