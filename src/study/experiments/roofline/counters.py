"""Floating-point operations that compiled code executes, counted while it runs.

The function is compiled once more, with a counter in every basic block of its LLVM code. What the
blocks hold, lane by lane, times how often each one ran is what was executed: idle lanes included,
whatever the compiler left out not.
"""

import ctypes
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from llvmlite import binding as llvm
from numba import cfunc
from numba.core import config

from pdrom.model.compiled.functions import Callback

_FUNCTION = re.compile(r"^define .* \{$")
_LABEL = re.compile(r"^[^\s;][^ ]*:")
_PHI = re.compile(r"^\s*%\S+ = (?:phi|landingpad) ")
_TYPE = r"(?:<(?P<lanes>\d+) x double>|double)"
_ARITHMETIC = re.compile(rf"= (?P<name>f(?:add|sub|mul|div)) (?:[a-z]+ )*{_TYPE} ")
_CALL = re.compile(rf" call (?:[a-z]+ )*{_TYPE} @llvm\.(?P<name>sqrt|fmuladd|fma)\.")
# of each instruction: sums and products, divisions, square roots
_COUNTS = {
    "fadd": (1, 0, 0), "fsub": (1, 0, 0), "fmul": (1, 0, 0), "fmuladd": (2, 0, 0), "fma": (2, 0, 0),
    "fdiv": (0, 1, 0), "sqrt": (0, 0, 1),
}  # fmt: skip
_TABLE = "pdrom_block_counts"


@dataclass(frozen=True)
class Operations:
    """Sums and products (a product with a sum is two), divisions, square roots of doubles."""

    flops: float
    divisions: float
    roots: float


class Counted(Callback):
    """A callback that counts what it executes."""

    def __init__(self, callback: Callback) -> None:
        self.function, self.signature = callback.function, callback.signature
        plain = cfunc(self.signature, error_model="numpy")(self.function)
        lines, contents = _with_counters(plain.inspect_llvm().splitlines())
        module = llvm.parse_assembly("\n".join(lines))
        # the compiler's own target: the instructions were chosen for it
        features = config.CPU_FEATURES
        machine = llvm.Target.from_default_triple().create_target_machine(
            cpu=config.CPU_NAME or llvm.get_host_cpu_name(),
            features=llvm.get_host_cpu_features().flatten() if features is None else features,
            opt=2,
        )
        # the engine owns the code and the counters
        self._engine = llvm.create_mcjit_compiler(module, machine)
        self._engine.finalize_object()
        self._contents = np.array(contents, dtype=np.int64).reshape(-1, 3)
        table = ctypes.c_int64 * len(contents)
        place = self._engine.get_global_value_address(_TABLE)
        self._ran = np.ctypeslib.as_array(table.from_address(place))
        self._address = self._engine.get_function_address(plain.native_name)

    @property
    def address(self) -> int:
        return self._address

    def reset(self) -> None:
        """Set all counts to zero."""
        self._ran[:] = 0

    @property
    def operations(self) -> Operations:
        """Operations executed since `reset`."""
        return Operations(*(float(total) for total in self._ran @ self._contents))


def _with_counters(lines: list[str]) -> tuple[list[str], list[list[int]]]:
    """The module with a counter in each basic block, and what the blocks hold."""
    written: list[str] = []
    contents: list[list[int]] = []
    waiting = False  # for the end of a block's phi instructions
    for line in lines:
        begins = _FUNCTION.match(line) is not None
        label = _LABEL.match(line) is not None and bool(contents)
        inside = line.startswith("  ")
        if waiting and inside and not _PHI.match(line):
            written += _count(len(contents) - 1)
            waiting = False
        if (begins or label) and not (label and waiting):
            contents.append([0, 0, 0])
            waiting = True
        written.append(line)
        for lanes, name in _operations(line):
            contents[-1] = [a + lanes * b for a, b in zip(contents[-1], _COUNTS[name], strict=True)]
    written.append(f"@{_TABLE} = global [{len(contents)} x i64] zeroinitializer")
    return written, contents


def _operations(line: str) -> Iterator[tuple[int, str]]:
    found = _ARITHMETIC.search(line) or _CALL.search(line)
    if found is not None:
        yield int(found["lanes"] or 1), found["name"]


def _count(block: int) -> list[str]:
    """Instructions that add one to the counter of a block."""
    name, place = f"%{_TABLE}.{block}", f"ptr getelementptr (i64, ptr @{_TABLE}, i64 {block})"
    return [
        f"  {name}.before = load i64, {place}, align 8",
        f"  {name}.after = add i64 {name}.before, 1",
        f"  store i64 {name}.after, {place}, align 8",
    ]
