"""Machine code of the largest kernels by target: a benchmark without a clock.

./reproduce run python tests/benchmarks/machine_code.py [TARGET ...]

A target is a name that LLVM knows; this machine need not be able to run its code. Counted are the
instructions of a kernel's functions as they stand (loops once), those on vectors, vectors that are
kept on the stack, and gathers: reads of one number a lane.
"""

import os
import re
import subprocess
import sys

TARGETS = ("haswell", "skylake", "cascadelake", "icelake-server", "znver3")
KERNELS = ("spring", "triangle_strain", "tetrahedron", "volume", "area")

_INSTRUCTION = re.compile(r"^\t[a-z]", re.MULTILINE)
_VECTOR = re.compile(r"^\tv.*%[yz]mm", re.MULTILINE)
_SPILL = re.compile(r"^\tvmov[aud].*%[yz]mm\d+, -?\d*\(%r[sb]p\)", re.MULTILINE)
_GATHER = re.compile(r"^\tvp?gather", re.MULTILINE)


def counts(kernel: str) -> tuple[int, ...]:
    """Instructions, those on vectors, spills and gathers of a kernel for this process's target."""
    from importlib import import_module

    from numba import cfunc

    callback = import_module(f"pdrom.model.constraints.{kernel}")._accumulate
    plain = cfunc(callback.signature, error_model="numpy")(callback.function)
    code = plain._library.get_asm_str()
    return tuple(len(p.findall(code)) for p in (_INSTRUCTION, _VECTOR, _SPILL, _GATHER))


def main(targets: tuple[str, ...]) -> None:
    """Print a table of all kernels and targets; each target has a process of its own."""
    heads = ("kernel", "target", "instructions", "on vectors", "spilled vectors", "gathers")
    sys.stdout.write(f"| {' | '.join(heads)} |\n{'|---' * len(heads)}|\n")
    sys.stdout.flush()
    for target in targets:
        environment = {**os.environ, "NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": ""}
        command = [sys.executable, __file__, "--counts"]
        subprocess.run(command, env=environment, check=True)


if __name__ == "__main__":
    if sys.argv[1:] == ["--counts"]:
        for name in KERNELS:
            row = (name, os.environ["NUMBA_CPU_NAME"], *counts(name))
            sys.stdout.write(f"| {' | '.join(map(str, row))} |\n")
    else:
        main(tuple(sys.argv[1:]) or TARGETS)
