"""How far bounded projections can carry a run.

However many local/global iterations a frame has, its end obeys

    (M + h^2 K) q_{n+1} - 2 M q_n + M q_{n-1} = h^2 (S^T W p_n + f),    K = S^T W S,

with the projections p_n of the last iteration, held vertices eliminated. The p_n are bounded (rest
lengths, clamped singular values), and so is whatever replaces them linearly. Let e be the
difference of two runs whose projections differ by d_n, with F = S^T W d and

    reach  >=  | F_n |_{K^+}    for all n,

which is the size |e|_K = |S e|_W of the static answer to F. Then, as long as no contact acts,

* |e_n|_K <= sqrt(n) reach, whatever is pinned, released or moved meanwhile. With u = e_{n+1} - e_n
  the energy 1/2 |u|_M^2 + h^2/2 |e|_K^2 gains at most h^2 (u^T F - 1/2 |u|_K^2) in a frame, which
  is at most h^2/2 |F|_{K^+}^2; holding a vertex only takes energy out;
* for ever |e_n|_K <= growth reach while the held vertices stay the same. In the modes of (K, M) the
  recursion has the poles cos(t) exp(+-i t), tan t = h omega, inside the unit circle, and answers a
  unit static input by sin(t) cos(t)^m |sin((m+1) t)| after m frames; growth is the sum over m of
  the largest of them. One mode has at most cot(t / 2). A mode with omega = 0 gets no force.

Two vertices are then apart by at most |e|_K times the square root of their compliance (the
effective resistance of the mesh between them).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg

from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.space import VertexSpace
from pdrom.model.dynamics.stepper import State, Stepper
from pdrom.model.scene import Scene

# Eigenvalues of K below this fraction of the largest one are zero.
ZERO = 1e-12
# Frames whose answers are summed one by one; the rest is bounded in closed form.
SUMMED = 20_000


def largest_projections(group: ConstraintGroup, points: np.ndarray) -> np.ndarray | None:
    """Bound (e,) of | p_e |_F over all states; None for a group that names no bounded manifold.

    Parameters
    ----------
    points : (N, 3) m, the rest shape
    """
    if group.manifold == "clamped":
        largest = float(group.kernel_parameters()[-1])
        return np.full(group.elements, np.sqrt(min(group.rows_per_element, 3)) * largest)
    if group.manifold in ("length", "half sphere"):
        rest = (group.S @ points).reshape(group.elements, -1)
        return np.linalg.norm(rest, axis=1)
    return None


def held_sets(scene: Scene) -> list[np.ndarray]:
    """Vertices that are held, ascending, in each stretch of frames with the same ones."""
    sets: list[np.ndarray] = []
    for frame in range(scene.config.frames):
        held = [b.held(frame) for b in scene.boundaries if b.active(frame)]
        union = np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.int64)
        if not sets or not np.array_equal(sets[-1], union):
            sets.append(union)
    return sets


@dataclass(frozen=True)
class Compliance:
    """What a scene's stiffness makes of forces, see the module.

    inverse : (N, N) m/N, K^+ with the held vertices eliminated if they are always the same ones;
        without elimination otherwise
    growth : factor of |e|_K over the frames of the scene
    lasting : the same for ever, with the vertices that are held last
    bounded : whether vertices that nothing connects cannot move apart
    """

    inverse: np.ndarray
    growth: float
    lasting: float
    bounded: bool

    @classmethod
    def of(cls, scene: Scene) -> "Compliance":
        """Compliance of a scene (dense: N of a few thousand at most)."""
        stiffness = sum(g.system_matrix() for g in scene.groups).toarray()
        sets, frames = held_sets(scene), scene.config.frames
        always, last = len(sets) == 1, sets[-1]
        kept = _free(len(stiffness), last if always else np.empty(0, dtype=np.int64))
        inverse = np.zeros_like(stiffness)
        inverse[np.ix_(kept, kept)], modes = _pseudo_inverse(stiffness[np.ix_(kept, kept)])
        free = _free(len(stiffness), last)
        # the masses of a scene are all the same
        tangents = scene.config.time_step * np.sqrt(
            _positive(stiffness[np.ix_(free, free)]) / scene.masses[0]
        )
        growth = np.sqrt(frames)
        if always:
            growth = min(growth, _growth(np.arctan(tangents), frames))
        lasting = _growth(np.arctan(tangents), None)
        # beside the translations nothing may be free to drift when holds change
        bounded = always or modes >= len(stiffness) - 1
        return cls(inverse, float(growth), lasting, bounded)

    @cached_property
    def softest(self) -> float:
        """Largest compliance between two vertices, m/N; inf where two may drift apart."""
        if not self.bounded:
            return np.inf
        own = np.diag(self.inverse)
        return float((own[:, None] + own[None, :] - 2.0 * self.inverse).max())


def _free(vertices: int, held: np.ndarray) -> np.ndarray:
    return np.setdiff1d(np.arange(vertices), held)


def _positive(matrix: np.ndarray) -> np.ndarray:
    values = linalg.eigvalsh(matrix) if len(matrix) else np.empty(0)
    return values[values > ZERO * values.max(initial=0.0)]


def _pseudo_inverse(matrix: np.ndarray) -> tuple[np.ndarray, int]:
    """K^+ and the rank of K."""
    if len(matrix) == 0:
        return matrix, 0
    values, vectors = linalg.eigh(matrix)
    kept = values > ZERO * values[-1]
    return (vectors[:, kept] / values[kept]) @ vectors[:, kept].T, int(kept.sum())


def _growth(angles: np.ndarray, frames: int | None) -> float:
    """Sum of the largest answers of the modes after m = 0, 1, ... frames; None: of all m."""
    if len(angles) == 0:
        return 0.0
    c, s = np.cos(angles), np.sin(angles)
    total, power = 0.0, s.copy()
    softest = int(np.argmax(c))
    # from this m on the softest mode has the largest bound sin(t) cos(t)^m
    alone = int(np.ceil((c[softest] / s[softest]) ** 2))
    summed = min(alone, SUMMED) if frames is None else min(frames, SUMMED)
    for m in range(summed):
        total += float(np.max(power * np.abs(np.sin((m + 1) * angles))))
        power *= c
    if frames is None:
        # beyond, the largest over all angles is below m^-1/2 until the softest mode takes over
        total += 2.0 * max(np.sqrt(alone) - np.sqrt(summed), 0.0)
        total += float(s[softest] * c[softest] ** alone / (1.0 - c[softest]))
    elif frames > summed:
        total = np.inf
    return total


class ConstantProjections:
    """A local step whose projections never change: S^T W p, (N, 3) N."""

    def __init__(self, name: str, force: np.ndarray) -> None:
        self.name, self._force = name, force

    def begin_frame(self, q: np.ndarray) -> None:
        """Nothing depends on the frame."""

    def accumulate(self, y: np.ndarray, rhs: np.ndarray) -> float:
        """Add the force; the energy is unknown: nan."""
        rhs += self._force
        return float("nan")


def linear_extent(scene: Scene, force: np.ndarray) -> float:
    """Largest extent, in rest extents, of the scene's run with constant projections, no contact.

    Parameters
    ----------
    force : (N, 3) N, S^T W p of all groups
    """
    space = VertexSpace(scene.system, scene.forces, scene.boundaries)
    steps = [ConstantProjections("constant", force)]
    loop = Stepper(space, scene.config.time_step, 1, steps, track_objective=False)
    state: State = scene.initial_state()
    largest = float(np.ptp(state.positions, axis=0).max())
    for frame in range(scene.config.frames):
        state, _ = loop.step(state, frame)
        largest = max(largest, float(np.ptp(state.positions, axis=0).max()))
    return largest / scene.mesh.extent
