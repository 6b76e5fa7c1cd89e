"""Anderson acceleration with a coarse level: a trained position subspace with sampled elements.

A plain iteration is slow for deformations that are stiff in the system matrix A and soft in the
objective. Its image G(y) is therefore corrected in the span of columns V with V^T A V = 1: the
component g = V^T A (G(y) - y) of its step is replaced by the step z that minimises the objective of
y + V z, in which sampled elements stand for all elements. This is the full approximation scheme
(Brandt 1977) with one additive smoothing step: -g is the exact gradient in the span, so that
z = g = 0 where y solves the frame, whatever the samples are. The corrected map is accelerated; an
iterate that raises the objective is replaced by the last image without correction.
"""

import numpy as np
from scipy import linalg

from pdrom.core.errors import SceneError
from pdrom.model.compiled.arithmetic import add, add_scaled, constant
from pdrom.model.compiled.functions import compiled
from pdrom.model.compiled.rows import WIDTH, at, load, store, unflat
from pdrom.model.constraints.local_kernel import LocalPass
from pdrom.model.dynamics.acceleration import Anderson, combine, forget, refuse
from pdrom.model.dynamics.frames import inertia_energy, weighted
from pdrom.model.dynamics.sweeps import sweep
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.model import Samples, SubspaceModel
from study.experiments.alternatives.solvers.projective import WINDOW
from study.experiments.alternatives.solvers.substeps import (
    Alternative,
    Substeps,
    add_projections,
    begin,
    end,
)

INNER = 10  # iterations in the span, with Anderson acceleration


class TwoLevel(Alternative):
    """Plain iterations and corrections in the subspace of a ``model`` of the scene.

    Raises
    ------
    SceneError
        The scene has several groups, or `Alternative` refuses it.
    """

    name = "two-level"

    def __init__(self, scene: Scene, substeps: int, iterations: int, model: SubspaceModel) -> None:
        self._model = model
        super().__init__(scene, substeps, iterations)

    def _prepare(self, scene: Scene) -> None:
        if len(scene.groups) != 1:
            raise SceneError(f"scene '{scene.config.name}': method '{self.name}' takes one group")
        columns, group = self._model.columns, scene.groups[0]
        system = self.space.system
        # the correction is zero at vertices that are fixed in any frame
        free = columns.B[:, columns.free]
        image = system.matrix @ free
        factor = linalg.cholesky(free.T @ image, lower=True)
        span, image = (linalg.solve_triangular(factor, a.T, lower=True) for a in (free, image))
        chosen = self._model.samples[group.name]
        assert isinstance(chosen, Samples)
        self._group, self._vertices = group.restricted(chosen.elements, chosen.factors)
        rows = span[:, self._vertices].T
        inertia = (span * (scene.masses / self.time_step**2)) @ span.T
        inverse = linalg.inv(inertia + rows.T @ (self._group.system_matrix() @ rows))
        assert self._group.local_kernel is not None
        self._sampled = LocalPass([self._group.local_kernel])
        self._matrices = tuple(
            np.ascontiguousarray(m) for m in (span.T, image, rows, inverse @ rows.T, inverse)
        )
        self._history, self._inner = Anderson(WINDOW), Anderson(WINDOW)
        self._inner.begin_frame(np.zeros((len(span), WIDTH)))

    def _advance(self, part: Substeps) -> None:
        y = unflat(part.y)
        self._history.begin_frame(part.y.reshape(-1, WIDTH))
        self._group.begin_frame(y[self._vertices])
        tables = self._sampled.first, self._sampled.preparing, self._sampled.second
        coarse = (*self._matrices, self._vertices, tables, self._inner.history)
        inertia = self.space.system.inertia
        _advance(*part, inertia, self.tables, self._factor(part), self._history.history, coarse)


@compiled(nogil=True)
def _advance(
    y, v, acceleration, step, substeps, iterations, fixed, targets, inertia, tables, factor,
    history, coarse,
):  # fmt: skip
    panels, vertices, loads, work = factor
    before, s, rhs = np.empty(len(y)), np.empty(len(y)), np.empty(len(y))
    plain = np.empty(len(y))
    for _ in range(substeps):
        begin(y, v, acceleration, step, fixed, targets, before, s)
        base = weighted(inertia, s)
        forget(history)
        for k in range(iterations):
            rhs[:] = base
            objective = add_projections(tables, y, rhs) + inertia_energy(y, s, inertia)
            # a corrected image may raise the objective, even the first one
            if refuse(history, y, objective, 0):
                y[:] = plain
                continue
            sweep(panels, vertices, loads, work, rhs, y)
            if k < iterations - 1:
                plain[:] = y
                _correct(coarse, history[0], y)
                combine(history, y)
        end(y, before, step, v)


@compiled(nogil=True)
def _correct(coarse, start, image):
    """Replace the step from ``start`` to ``image`` in the span by the sampled minimiser's step."""
    span, duals, rows, steps, inverse, vertices, tables, history = coarse
    size, sampled = WIDTH * span.shape[1], WIDTH * len(vertices)
    step, x, at_start = np.zeros(size), np.empty(sampled), np.zeros(sampled)
    _add_product(duals, image - start, step)
    for i in range(len(vertices)):
        x[WIDTH * i : WIDTH * (i + 1)] = start[WIDTH * vertices[i] : WIDTH * (vertices[i] + 1)]
    add_projections(tables, x, at_start)
    first, z, moved, forces = np.zeros(size), np.empty(size), np.empty(sampled), np.empty(sampled)
    _add_product(inverse, step, first)
    z[:] = first
    forget(history)
    for _ in range(INNER):
        refuse(history, z, np.nan)  # accepts the iterate, since its objective is unknown
        moved[:] = x
        _add_product(rows, z, moved)
        forces[:] = 0.0
        add_projections(tables, moved, forces)
        forces -= at_start
        z[:] = first
        _add_product(steps, forces, z)
        combine(history, z)
    z -= step
    _add_product(span, z, image)


@compiled(nogil=True)
def _add_product(matrix, x, out):
    """Add ``matrix`` (m, n) times ``x``, n rows of four, to ``out``, m rows of four, all flat."""
    m, n = matrix.shape
    numbers = matrix.reshape(-1)
    for i in range(m):
        # two independent sums, which the processor overlaps
        even, odd = load(out, WIDTH * i), constant(0.0)
        for k in range(0, n - 1, 2):
            even = add_scaled(even, at(numbers, n * i + k), load(x, WIDTH * k))
            odd = add_scaled(odd, at(numbers, n * i + k + 1), load(x, WIDTH * (k + 1)))
        if n % 2:
            even = add_scaled(even, at(numbers, n * i + n - 1), load(x, WIDTH * (n - 1)))
        store(out, WIDTH * i, add(even, odd))
