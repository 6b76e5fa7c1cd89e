"""Words for what the operating system refused."""

import errno
import os
import re


def reason(error: OSError) -> str:
    """Words of the operating system for ``error``; HDF5 hides the number in a long text."""
    hidden = re.search(r"errno = (\d+)", str(error))
    number = error.errno or (int(hidden[1]) if hidden else 0)
    return os.strerror(number) if number in errno.errorcode else " ".join(str(error).split())[:200]
