"""Beginning and end of a frame for all vertices, each in one pass over them.

Rows of four (x, y, z, 0), flat: the iterate ``y``, the prediction ``s``. ``inertia`` (N,) is M/h^2,
kg/s^2, ``time_step`` h, s.
"""

import numpy as np

from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH


@compiled(nogil=True)
def predict(positions, velocities, acceleration, time_step):
    """q + h v + h^2 a as rows of four, flat, with h = ``time_step``.

    ``positions`` q and ``velocities`` v are (N, 3), ``acceleration`` a too, or (1, 3) for all.
    """
    s, square = np.empty(WIDTH * len(positions)), time_step**2
    for i in range(len(positions)):
        own = i if len(acceleration) > 1 else 0
        for axis in range(3):
            moved = positions[i, axis] + time_step * velocities[i, axis]
            s[WIDTH * i + axis] = moved + square * acceleration[own, axis]
        s[WIDTH * i + 3] = 0.0
    return s


@compiled(nogil=True)
def weighted(inertia, s):
    """(M/h^2) s as rows of four, flat as s is; ``inertia`` is M/h^2 (N,)."""
    result = np.empty(len(s))
    for i in range(len(inertia)):
        for lane in range(WIDTH):
            result[WIDTH * i + lane] = inertia[i] * s[WIDTH * i + lane]
    return result


@compiled(nogil=True)
def end(y, before, time_step, positions, velocities):
    """Write ``positions`` and ``velocities`` (N, 3) at the end of a frame.

    From ``y``, rows of four, flat, the positions ``before`` (N, 3) and ``time_step``.
    """
    for i in range(len(before)):
        for axis in range(3):
            positions[i, axis] = y[WIDTH * i + axis]
            velocities[i, axis] = (positions[i, axis] - before[i, axis]) / time_step


@inner
def inertia_energy(y, s, inertia):
    """1/2 |(M/h^2)^1/2 (y - s)|^2 of rows of four, flat; ``inertia`` is M/h^2 (N,)."""
    energy = 0.0
    for i in range(len(inertia)):
        square = 0.0
        for axis in range(3):
            square += (y[WIDTH * i + axis] - s[WIDTH * i + axis]) ** 2
        energy += inertia[i] * square
    return 0.5 * energy
