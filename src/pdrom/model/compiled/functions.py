"""How the compiled functions of the model are compiled and kept."""

from functools import cached_property
from pathlib import Path
from zlib import crc32

from numba import cfunc, njit


def _checksum() -> str:
    """Of the sources of all compiled functions."""
    model = Path(__file__).parents[1]
    folders = ("compiled", "constraints", "dynamics")
    sources = sorted(path for folder in folders for path in model.glob(f"{folder}/*.py"))
    return f"{crc32(b''.join(path.read_bytes() for path in sources)):08x}"


# numba's cache looks at the file of a function only, not at those of what it inlines: without the
# checksum in its name a function would stay as it was when another file is edited
_SOURCES = _checksum()


def compiled(function=None, **options):
    """Compile and keep a function: without division checks, without fast-math unless asked for."""
    if function is None:
        return lambda wrapped: compiled(wrapped, **options)
    function.__qualname__ += f"_{_SOURCES}"
    return njit(cache=True, error_model="numpy", **options)(function)


class Callback:
    """A function that other compiled code calls by its address; compiled at the first question.

    Attributes
    ----------
    function, signature : what is compiled
    """

    def __init__(self, function, signature):
        function.__qualname__ += f"_{_SOURCES}"
        self.function, self.signature = function, signature

    @cached_property
    def _compiled(self):
        return cfunc(self.signature, cache=True, error_model="numpy")(self.function)

    @property
    def address(self):
        """Where the compiled function begins."""
        return self._compiled.address
