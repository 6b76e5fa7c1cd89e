"""Numbers of mesh files, in text or binary: counted, so that a truncated file is rejected."""

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

# Kinds of cells, by VTK's numbers; others are rejected.
VERTEX, LINE, TRIANGLE, POLYGON, QUAD, TETRA = 1, 3, 5, 7, 9, 10
# Names of numbers in .ply, .vtk (without "unsigned_") and .vtu, in small letters -> NumPy types.
_NUMPY = ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")
_NAMES = "int8 uint8 int16 uint16 int32 uint32 int64 uint64 float32 float64"
TYPES = dict(zip(_NAMES.split(), _NUMPY, strict=True))
_NAMES = "char uchar short ushort int uint long ulong float double vtktypeint64 vtkidtype"
TYPES |= dict(zip(_NAMES.split(), (*_NUMPY, "i8", "i4"), strict=True))
END = rb"[ \t]*(?:\r?\n|\r)"
Field = tuple[str, int]
"""NumPy type, without byte order, and length of one part of a row of numbers."""
Part = tuple[str, int, Callable[[int], int]]
"""Type of a field, the earlier field that determines its length, and length as a function of it."""


class RefusedError(ValueError):
    """Error for a file that is not read; its message is for the user."""


class UnreadableError(RefusedError):
    """Error for a file that is not valid in its format."""

    def __init__(self, why: str) -> None:
        super().__init__(f"not a readable mesh ({why})")


class CutError(UnreadableError):
    """Error for a truncated file, which stops before the end of its mesh."""

    def __init__(self, why: str) -> None:
        super().__init__(f"truncated: {why}")


class Found(NamedTuple):
    """Points (N, 2 or 3) of a file, kinds (E,) and sizes (E,) of its cells, and their corners.

    ``sizes`` are numbers of corners; ``corners`` are indices from 0, one cell after another.
    """

    points: np.ndarray
    kinds: np.ndarray
    sizes: np.ndarray
    corners: np.ndarray


def found(points: np.ndarray, cells: Sequence[tuple[int, np.ndarray]]) -> Found:
    """Return the content of a file with ``cells``, blocks of a kind and corners (n, corners)."""
    counts = [len(rows) for _, rows in cells]
    kinds = np.repeat(np.array([kind for kind, _ in cells], np.int64), counts)
    sizes = np.repeat(np.array([rows.shape[1] for _, rows in cells], np.int64), counts)
    flat = np.concatenate([np.empty(0), *(rows.ravel() for _, rows in cells)])
    return Found(points, kinds, sizes, whole(flat, "corners"))


def unified(text: bytes, comments: bool = False) -> bytes:
    """Return ``text`` with ends of lines as ``\\n``, and without ``comments`` after #."""
    text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return re.sub(rb"#[^\n]*", b"", text) if comments else text


def begin(content: bytes) -> str:
    """Return a remark with the first line of a file."""
    line = content.strip()[:40].splitlines() or [b""]
    return f"the file begins with '{line[0].decode(errors='replace')}'"


def require_once(names: Sequence[bytes]) -> None:
    """Raise UnreadableError if two of the ``names`` of sections are the same in any case."""
    for name in names:
        if [other.upper() for other in names].count(name.upper()) > 1:
            raise UnreadableError(f"{name.decode(errors='replace')} appears twice")


def numbers(text: bytes, what: str) -> np.ndarray:
    """Return the numbers in ``text``; UnreadableError, beginning with ``what``, for other text."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, sep=" ") if text.strip() else np.empty(0)
        except (DeprecationWarning, ValueError) as error:
            raise UnreadableError(f"{what}: something other than numbers") from error


def whole(values: np.ndarray, what: str) -> np.ndarray:
    """Return ``values`` as int64; UnreadableError, beginning with ``what``, for other values."""
    broken = values.dtype.kind == "f" and not (np.floor(values) == values).all()
    if broken or np.abs(values).max(initial=0) >= 2**53:
        raise UnreadableError(f"{what} that are not whole numbers")
    return values.astype(np.int64)


def check_end(text: bytes, last: float, vertices: int) -> None:
    """Raise `CutError` if ``text`` ends with ``last``, which may be the first digits of a number.

    An index is complete if one more digit would exceed the number of ``vertices`` (0: no index).
    """
    ended = vertices and last % 1 == 0 and (last == 0 or 10 * abs(last) > vertices)
    if not ended and not text[-1:].isspace():
        raise CutError("the last line may be incomplete (if it is not, add an end of line)")


_LINE = re.compile(rb"\s*([^\r\n]*)(?:\r?\n|\r|\Z)")
_WORD = re.compile(rb"^[ \t]*(?!(?:nan|inf)\b)[a-z$]", re.M | re.I)


class Source:
    """Read lines and numbers of a file in turn: binary with byte order "<" or ">", or text ("").

    In a text, numbers up to the next line that begins with a word are read together, as float64.
    """

    def __init__(self, content: bytes, order: str, start: int = 0) -> None:
        self.order, self.content, self._next = order, content, start
        if not order and b"\r" in content:
            self.content, self._next = unified(content[start:]), 0
        self._numbers, self._at = np.empty(0), 0  # numbers of a text, before `_next`

    def line(self) -> bytes:
        """Return the next line that is not blank, stripped; b"" at the end of the file."""
        if self._at < len(self._numbers):
            raise UnreadableError("more numbers than announced")
        line = _LINE.match(self.content, self._next)
        assert line is not None
        self._next = line.end()
        return line[1].strip()

    def skip(self, end: bytes) -> None:
        """Continue after the next ``end``, or at the end of the file."""
        place = self.content.find(end, self._next)
        self._next = len(self.content) if place < 0 else place + len(end)

    def rows(self, count: int, *fields: Field) -> list[np.ndarray]:
        """Return each of the ``fields`` of ``count`` rows as an array (count, length)."""
        block = self._ahead(count, fields)
        columns = [block[name] for name in block.dtype.names or ()]
        if self.order:
            self._next += block.nbytes
            return columns
        self._at += block.nbytes // 8
        return [
            column.astype(kind) if kind[0] == "f" else whole(column, "indices")
            for column, (kind, _) in zip(columns, fields, strict=True)
        ]

    def values(self, count: int, kind: str) -> np.ndarray:
        """Return ``count`` numbers (count,) of a type of `TYPES`; skip values of type "string"."""
        for _ in range(count if kind == "string" else 0):  # a line, or bytes after their number
            if not self.order:
                self.skip(b"\n")
                continue
            size = 8 >> (self.content[self._next] >> 6)  # bytes of the number, in its first bits
            length = int.from_bytes(self.content[self._next : self._next + size], "big")
            self._next += size + length % (1 << 8 * size - 2)
        if kind == "string":
            return np.empty(0)
        return self.rows(count, (TYPES[kind.lower().replace("unsigned_", "u")], 1))[0].ravel()

    def ragged(self, count: int, *parts: Field | Part) -> Iterator[list[np.ndarray]]:
        """Yield `rows` of ``count`` rows of different lengths, in blocks of equal ones."""
        keys = {part[1] for part in parts if len(part) == 3}
        while count:
            fields = list[Field]()
            for kind, length, *of in parts:
                fields.append((kind, of[0](self._peek(fields[: length + 1])) if of else length))
            size, same = 1, np.ones(1, dtype=bool)
            while same.all() and size < (most := min(count, self._there(fields))):
                size = min(8 * size, most)
                block = self._ahead(size, fields)
                each = [block[f"f{key}"][:, 0] for key in keys]
                same = np.all([np.ones(size), *(key == key[0] for key in each)], axis=0)
            size = size if same.all() else int(same.argmin())
            yield self.rows(size, *fields)
            count -= size

    def lists(self, count: int) -> list[np.ndarray]:
        """Return ``count`` lists of indices, each after its length, as blocks (n, length)."""
        return [rows for _, rows in self.ragged(count, ("i4", 1), ("i4", 0, int))]

    def _peek(self, fields: Sequence[Field]) -> int:
        """Return the count in the last of the ``fields`` of the next row."""
        value = self._ahead(1, fields)[f"f{len(fields) - 1}"][0, 0]
        if not 0 <= value < 2**31:
            raise UnreadableError(f"a count of {value} is not possible")
        return int(value)

    def check_end(self, vertices: int) -> None:
        """Raise `CutError` if the last number read ends a text and may be truncated."""
        place = (self._at, self._next)
        if not self.order and place == (len(self._numbers), len(self.content)):
            check_end(self.content, self._numbers[-1], vertices)

    def _kind(self, fields: Sequence[Field]) -> np.dtype:
        kinds = [(self.order + kind if self.order else "f8", (n,)) for kind, n in fields]
        return np.dtype([(f"f{i}", *kind) for i, kind in enumerate(kinds)])

    def _there(self, fields: Sequence[Field]) -> int:
        if not self.order and self._at == len(self._numbers):
            word = _WORD.search(self.content, self._next)
            end = word.start() if word else len(self.content)
            self._numbers = numbers(self.content[self._next : end], "numbers")
            self._next, self._at = end, 0
        left = len(self.content) - self._next if self.order else self._numbers[self._at :].nbytes
        return left // max(1, self._kind(fields).itemsize)

    def _ahead(self, count: int, fields: Sequence[Field]) -> np.ndarray:
        """Return the next ``count`` rows (count,) without consuming them."""
        if count == 0:
            return np.empty(0, self._kind(fields))
        there = self._there(fields)
        if not 0 <= count <= there:
            raise CutError(f"{there} rows of numbers instead of {count}")
        data, at = (self.content, self._next) if self.order else (self._numbers, 8 * self._at)
        return np.ndarray(count, self._kind(fields), data, at)
