"""Mesh files, which a separate process reads with limits on time and memory."""

import hashlib
import io
import json
import logging
import os
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import astuple, dataclass
from functools import lru_cache
from pathlib import Path
from pkgutil import get_data

import numpy as np

from pdrom.core.errors import ConfigurationError, MeshError
from pdrom.core.yamlfile import shown
from pdrom.model.mesh import reader
from pdrom.model.mesh.checks import mesh_of
from pdrom.model.mesh.types import Mesh

log = logging.getLogger(__name__)

# Limit: the operators of a cloth with this many vertices need about 1 GB of memory.
MAX_VERTICES = 1_000_000
VARIABLE = "PDROM_MESH_LIMITS"
MAX_FACTOR = 1000.0


@dataclass(frozen=True)
class MeshLimits:
    """Limits for reading one mesh file; `mesh_limits` returns those that apply.

    seconds : processor time of the process that reads the file
    deadline : elapsed seconds after which this process is ended, if it waits or the platform has no
        limits of processor time; long enough that the machine's load does not change the result
    memory : bytes of address space of this process
    """

    file_bytes: int = 500_000_000
    seconds: int = 10
    deadline: int = 100
    memory: int = 1_000_000_000
    vertices: int = MAX_VERTICES
    cells: int = 6 * MAX_VERTICES


def mesh_limits() -> MeshLimits:
    """Return the limits, multiplied by the environment variable PDROM_MESH_LIMITS if it is set.

    Raises ConfigurationError if the variable is not a number from 1 to 1000.
    """
    text, required = os.environ.get(VARIABLE, "1"), f"a number from 1 to {MAX_FACTOR:g} is required"
    with suppress(ValueError):
        if 1.0 <= (factor := float(text)) <= MAX_FACTOR:
            return MeshLimits(*(int(factor * limit) for limit in astuple(MeshLimits())))
    raise ConfigurationError(f"environment variable {VARIABLE} = '{text}': {required}")


# Modules of the process that reads a file, and the script that imports them from their texts.
MODULES = ("raw", "surfaces", "grids", "reader")
START = """
import json, sys, types
above = ("pdrom", "pdrom.model", "pdrom.model.mesh")
sys.modules |= {name: types.ModuleType(name) for name in above}
for name, text in json.loads(sys.argv.pop(1)).items():
    module = types.ModuleType(name)
    setattr(sys.modules[above[-1]], name, module)
    exec(compile(text, f"{name}.py", "exec"), module.__dict__)
sys.exit(module.main(*sys.argv[1:]))
"""
ADVICE = f"{VARIABLE}=2 in the environment doubles the limits"


def read_mesh_file(path: Path) -> Mesh:
    """Return the mesh of triangles or tetrahedra in the file ``path``, in a format of `READERS`.

    Log a warning with the number of polygons if the file has some, which are split into triangles.
    MeshError if the file is missing, unreadable, of another format, exceeds a limit of
    `mesh_limits`, or has other cells, or both triangles and tetrahedra.
    """
    try:
        if not path.is_file():
            raise MeshError(f"{path}: no such mesh file (looked in {path.parent.resolve()})")
        if path.suffix.lower() not in reader.READERS:
            raise MeshError(
                f"{path}: the format is none of {', '.join(reader.READERS)}; "
                f"try `meshio convert {path.name} {path.stem}.vtu`"
            )
        limits = mesh_limits()
        if path.stat().st_size > limits.file_bytes:
            raise MeshError(f"{path}: larger than {limits.file_bytes} bytes; {ADVICE}")
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:  # for example a file name that is too long
        raise MeshError(f"{shown(str(path), 60)}: cannot be read ({error.strerror})") from error
    points, cells, remark = _arrays(path, digest, limits)
    if remark:
        log.warning("%s: %s", path, remark)
    return mesh_of(points.copy(), cells, str(path))


@lru_cache(maxsize=8)
def _arrays(path: Path, digest: str, limits: MeshLimits) -> tuple[np.ndarray, np.ndarray, str]:
    """Return points, cells, remark of a file; cached, with ``digest`` and ``limits`` in the key."""
    numbers = (limits.seconds, limits.memory, limits.vertices, limits.cells)
    # -P: modules in the working folder shadow none of these; texts as this process imports them
    texts = {name: (get_data(__package__, f"{name}.py") or b"").decode() for name in MODULES}
    command = [sys.executable, "-P", "-X", "utf8", "-W", "ignore", "-c", START, json.dumps(texts)]
    command += [str(path), *map(str, numbers)]
    # allow one thread per linear algebra library: more threads, unused here, would reserve memory
    single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    try:
        ended = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=limits.deadline,
            env=os.environ | single,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise MeshError(f"{path}: not read after {limits.deadline:g} s; {ADVICE}") from error
    except OSError as error:
        raise MeshError(f"{path}: the reader does not start ({error.strerror})") from error
    if ended.returncode:
        raise MeshError(f"{path}: {_fault(ended, limits)}")
    pipe = io.BytesIO(ended.stdout)
    points, cells = np.load(pipe, allow_pickle=False), np.load(pipe, allow_pickle=False)
    points.flags.writeable = cells.flags.writeable = False
    return points, cells, pipe.read().decode()


def _fault(ended: subprocess.CompletedProcess[bytes], limits: MeshLimits) -> str:
    """Return a message with the reason why the reading process ``ended`` without a mesh."""
    status = ended.returncode
    if status == reader.REFUSED:
        return ended.stdout.decode(errors="replace")
    if status == reader.NO_MEMORY:
        return f"not a readable mesh in {limits.memory / 1e9:g} GB of memory; {ADVICE}"
    if status == -getattr(signal, "SIGXCPU", 0):
        time = f"{limits.seconds} s of processor time"
        return f"not a readable mesh in {time}: truncated, or very large; {ADVICE}"
    if status < 0:
        return f"the reader was ended by signal {-status} ({signal.strsignal(-status)})"
    lines = ended.stderr.decode(errors="replace").split("\n")
    last = next((line for line in reversed(lines) if line.strip()), "no error message")
    return f"the reader failed with status {status}: {last[:200]}"
