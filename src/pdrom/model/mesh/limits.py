"""Limits on the cost of reading a mesh file."""

import math
import os
from dataclasses import dataclass, fields

from pdrom.core.errors import ConfigurationError

# A cloth of this size needs about 1 GB while its operators are built.
MAX_VERTICES = 1_000_000
VARIABLE = "PDROM_MESH_LIMITS"
MAX_FACTOR = 1000.0


@dataclass(frozen=True)
class MeshLimits:
    """Limits on one mesh file; `mesh_limits` returns those in force.

    file_bytes : size of the file
    seconds : processor time to read it
    deadline : seconds after which a reader is ended that waits instead of computing; also the limit
        of time where a process has none. Far above ``seconds``, so that a busy machine does not
        decide which meshes are read.
    memory : bytes of address space of the process that reads it
    vertices, cells : size of the mesh inside
    """

    file_bytes: int = 500_000_000
    seconds: int = 10
    deadline: int = 100
    memory: int = 1_000_000_000
    vertices: int = MAX_VERTICES
    cells: int = 6 * MAX_VERTICES


def mesh_limits() -> MeshLimits:
    """The limits, multiplied by the environment variable PDROM_MESH_LIMITS if it is set.

    Raises
    ------
    ConfigurationError
        The variable is no number from 1 to 1000.
    """
    text = os.environ.get(VARIABLE, "1")
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 1.0 <= factor <= MAX_FACTOR:
        raise ConfigurationError(
            f"environment variable {VARIABLE} = '{text}': a number from 1 to {MAX_FACTOR:g} is "
            "required"
        )
    plain = MeshLimits()
    return MeshLimits(**{f.name: int(factor * getattr(plain, f.name)) for f in fields(plain)})
