"""All iterations of a frame in one compiled loop, for local steps and solvers that are compiled."""

from collections.abc import Sequence
from typing import Any, TypeGuard

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.clock import clock, now
from pdrom.model.compiled.functions import compiled, inner
from pdrom.model.compiled.rows import WIDTH, write
from pdrom.model.constraints.local_kernel import LocalPass, add_part
from pdrom.model.dynamics.acceleration import NO_HISTORY, Anderson, combine, refuse
from pdrom.model.dynamics.frames import inertia_energy
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.dynamics.system import Elimination


class CompiledIterations:
    """The iterations of a step loop whose local steps all have a local kernel.

    Parameters
    ----------
    local_steps : objects with ``local_kernel``
    inertia : (N,) M / h^2
    acceleration : begun with each frame by the step loop
    """

    def __init__(
        self,
        local_steps: Sequence[Any],
        inertia: np.ndarray,
        acceleration: Anderson | None = None,
    ) -> None:
        local = self._pass = LocalPass([step.local_kernel for step in local_steps])
        self._inertia = inertia
        self._acceleration = acceleration
        # what every call hands to compiled code
        touched = local.touched
        self._tables = (local.first, local.preparing, local.second)
        self._second = (local.other, touched.start, touched.stop)
        self._clock = clock()

    def takes(self, elimination: object) -> TypeGuard[Elimination]:
        """Whether the system of an ``elimination`` is solved by compiled code, too."""
        return isinstance(elimination, Elimination) and elimination.factor is not None

    @property
    def compiled_arguments(self) -> tuple[Any, ...]:
        """Arguments of `all_iterations` that are the same for all frames."""
        return self._inertia, self._tables, self._second, self._clock

    def run(
        self,
        which: range,
        iterations: int,
        objective: np.ndarray,
        y: np.ndarray,
        s: np.ndarray,
        base: np.ndarray,
        elimination: Elimination,
        seconds: np.ndarray,
    ) -> None:
        """Do the iterations ``which`` of a frame's ``iterations`` K in place.

        Parameters
        ----------
        objective : (K,) receives the objective at the iterates; empty if it is not tracked
        y, base : (N, 3) views of rows of four: iterate, (M/h^2) s
        s : (N, 3) prediction
        elimination : the factored system, see `takes`
        seconds : (4,) times of the local and of the global steps are added to entries 1 and 2
        """
        history = NO_HISTORY if self._acceleration is None else self._acceleration.history
        tracked = len(objective) > 0 or history is not None
        right = rows.empty(WIDTH * len(y))
        iterate, start = rows.flat(y), rows.flat(base)
        prediction = rows.flat(s) if tracked else start
        all_iterations(
            (which.start, which.stop, iterations), iterate, prediction, start, right,
            self._inertia, self._tables, self._second, elimination.factor, history, objective,
            seconds, self._clock,
        )  # fmt: skip


@inner
def _second_part(kernels, y, other, start, stop):
    """The second parts of all local steps into an array of their own; their energy."""
    other[WIDTH * start : WIDTH * stop] = 0.0
    return add_part(kernels, y.ctypes.data, other.ctypes.data)


@compiled(nogil=True)
def all_iterations(
    which, y, s, base, rhs, inertia, tables, second, factor, history, objective,
    seconds, watch,
):  # fmt: skip
    """Do iterations of a frame in place, see `CompiledIterations.run`.

    Parameters
    ----------
    which : (first, end, iterations), those from ``first`` to before ``end`` of ``iterations``
    y, s, base, rhs : rows of four, flat: iterate, prediction, (M/h^2) s, working array
    inertia : (N,) M/h^2, kg/s^2
    tables, second : of the local steps, see `CompiledIterations.compiled_arguments`
    factor : of the system
    history : of the acceleration, `NO_HISTORY` without one: its code is then left out
    objective, seconds : as there
    watch : see `pdrom.model.compiled.clock`
    """
    first, end, iterations = which
    local, preparing, kernels = tables
    other, start, stop = second
    panels, vertices, loads, work = factor
    for k in range(first, end):
        before = now(watch)
        write(base, rhs)
        add_part(preparing, y.ctypes.data, rhs.ctypes.data)
        energy = add_part(local, y.ctypes.data, rhs.ctypes.data)
        if stop > start:
            energy += _second_part(kernels, y, other, start, stop)
            for i in range(WIDTH * start, WIDTH * stop):
                rhs[i] += other[i]
        between = now(watch)
        seconds[1] += between - before
        value = np.nan
        refused = False
        if len(objective):
            value = objective[k] = energy + inertia_energy(y, s, inertia)
            between = now(watch)
        if history is not None:
            if not len(objective):
                value = energy + inertia_energy(y, s, inertia)
            refused = refuse(history, y, value)
        if refused:
            if len(objective):
                objective[k] = objective[k - 1]
        else:
            sweep(panels, vertices, loads, work, rhs, y)
            # the last image stays as it is: its objective is known not to rise
            if history is not None and k < iterations - 1:
                combine(history, y)
        seconds[2] += now(watch) - between
    return 0.0
