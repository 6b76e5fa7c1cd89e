"""Drift of two full-order runs that should be the same (docs/study.md).

What a run does when its start moves by 1e-10 of the extent bounds what any reduced model can be
blamed for. Beside the start, the solver (another order of summation), the number of iterations and
the time step are changed, and each effect is left out.
"""

import numpy as np
import pandas as pd

from pdrom.model.dynamics.solvers import solver_class
from pdrom.model.dynamics.system import DEFAULT_SOLVER
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene, SceneConfig

COLUMNS = ["scene", "perturbation", "seed", "frame", "relative_difference"]
# A run is repeated with the first of these that it does not use itself.
OTHER_SOLVERS = ("splu", "splu-columns")


def relative_difference(other: np.ndarray, base: np.ndarray) -> np.ndarray:
    """Per-frame difference of ``other`` from ``base``, trajectories (F + 1, N, 3), relative, (F,).

    || Q'_f - Q_f ||_F over the root mean square of || Q_f - Q_0 ||_F over the run: one
    normalisation for all frames, so that a slow start is not divided by nothing.
    """
    frames = len(base) - 1
    difference = np.linalg.norm((other - base)[1:].reshape(frames, -1), axis=1)
    motion = np.linalg.norm((base[1:] - base[0]).reshape(frames, -1), axis=1)
    return difference / np.sqrt(np.mean(motion**2))


def perturbation_field(scene: Scene, size: float, seed: int) -> np.ndarray:
    """Random directions by ``seed``, of length ``size`` times the extent of ``scene``, (N, 3) m."""
    field = np.random.default_rng(seed).standard_normal((scene.mesh.vertices, 3))
    return size * scene.mesh.extent * field / np.linalg.norm(field, axis=1, keepdims=True)


def heldout_floor(heldout: Scene, motion: str, size: float, seeds: tuple[int, ...]) -> pd.DataFrame:
    """Rows of a held-out motion, whose horizon is its own; its name stands as perturbation.

    ``size`` and ``seeds`` of the starts of ``heldout`` as in `perturbation_field`.
    """
    base = trajectory(heldout)
    runs = [trajectory(heldout, perturbation_field(heldout, size, seed)) for seed in seeds]
    return pd.concat(
        _rows(heldout, motion, seed, relative_difference(run, base))
        for seed, run in zip(seeds, runs, strict=True)
    )


def sensitivities(
    scene: Scene, perturbations: tuple[float, ...], seeds: tuple[int, ...]
) -> pd.DataFrame:
    """Table of `COLUMNS` for ``scene``: ``perturbations`` of the start by ``seeds``, and others.

    The others are another solver, 4 K iterations, half the time step, and no effect of one name
    (label `without`); the only constraint group cannot be left out.
    """
    base = trajectory(scene)
    parts = []
    for size in perturbations:
        for seed in seeds:
            other = trajectory(scene, perturbation_field(scene, size, seed))
            parts.append(_rows(scene, f"{size:g}", seed, relative_difference(other, base)))
    variants = {"solver": _other_solver, "iterations x4": _more_iterations, "h/2": _half_step}
    for label, variant in variants.items():
        parts.append(_rows(scene, label, 0, relative_difference(variant(scene), base)))
    for effect in removable(scene.config):
        other = trajectory(_fresh(scene, effects=scene.config.effects_without(effect)))
        parts.append(_rows(scene, without(effect), 0, relative_difference(other, base)))
    return pd.concat(parts, ignore_index=True)


def without(effect: str) -> str:
    """Label of the runs without an effect."""
    return f"without {effect}"


def removable(config: SceneConfig) -> list[str]:
    """Names of the effects of ``config`` without which the scene still is one, each once."""
    names = dict.fromkeys(e.effect for e in config.effects)
    return [name for name in names if config.groups != [name]]


def _fresh(scene: Scene, **changes: object) -> Scene:
    """The scene bound again with changes of its configuration."""
    return Scene.build(scene.config.model_copy(update=changes), scene.mesh)


def _rows(scene: Scene, label: str, seed: int, values: np.ndarray) -> pd.DataFrame:
    frames = np.arange(len(values))
    row = (scene.config.name, label, seed, frames, values)
    return pd.DataFrame(dict(zip(COLUMNS, row, strict=True)))


def _other_solver(scene: Scene) -> np.ndarray:
    own = solver_class(DEFAULT_SOLVER)
    other = next(name for name in OTHER_SOLVERS if solver_class(name) is not own)
    return trajectory(scene, system=scene.system_with(other))


def _more_iterations(scene: Scene) -> np.ndarray:
    return trajectory(_fresh(scene, iterations=4 * scene.config.iterations))


def _half_step(scene: Scene) -> np.ndarray:
    config = scene.config
    halved = _fresh(
        scene,
        time_step=0.5 * config.time_step,
        frames=2 * config.frames,
        effects=tuple(e.with_frames_scaled(2.0) for e in config.effects),
    )
    return trajectory(halved)[::2]
