"""Snapshots of the projections of a constraint group: choice of frames, reading and storing."""

import os
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pdrom.core.errors import SnapshotError
from pdrom.core.store import open_hdf5, require_finite, write_hdf5
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.dynamics.stepper import State
from pdrom.model.scene import Scene

SPLITS = ("train", "test", "heldout")


def training_frames(frames: int, count: int) -> np.ndarray:
    """Choose training frames (count,) int64: even numbers, spread evenly over ``frames``."""
    even = np.arange(0, frames, 2)
    return even[np.round(np.linspace(0, len(even) - 1, count)).astype(np.int64)]


def test_frames(frames: int) -> np.ndarray:
    """Return test frames (n,) int64: all odd numbers among ``frames`` frames."""
    return np.arange(1, frames, 2)


def stored_frames(frames: int, count: int) -> np.ndarray:
    """Return the training and test frames of a run of ``frames`` frames, ascending."""
    return np.sort(np.concatenate([training_frames(frames, count), test_frames(frames)]))


def row_masses(group: ConstraintGroup, masses: np.ndarray) -> np.ndarray:
    """Compute the lumped mass (e p,) kg of each operator row from vertex ``masses`` (N,) kg.

    Every vertex divides its mass equally among the elements that contain it; each row has the mass
    of its element.
    """
    element = touched_vertices(group)
    valence = np.asarray(element.sum(axis=0)).ravel()
    share = np.divide(masses, valence, out=np.zeros_like(masses), where=valence > 0)
    return np.repeat(element @ share, group.rows_per_element)


def touched_vertices(group: ConstraintGroup) -> sparse.csr_array:
    """Return a matrix (e, N): 1 where the operator of an element uses a vertex, else 0."""
    rows = group.rows_per_element
    touches = (group.S != 0).astype(np.float64)
    return (sum(touches[row::rows] for row in range(rows)) != 0).astype(np.float64)


def recorded(
    scene: Scene, group: str, state: State, frames: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run the full-order model of ``scene`` from ``state``; return positions and projections.

    Of the first ``frames`` frames (None: all) these are (F + 1, N, 3) m, (F, e p, 3) of the last
    local step of the constraint ``group`` (e elements of p rows), and (F,) norms of its errors.
    """
    loop, positions = scene.stepper(track_objective=False), [state.positions]
    own, projections, roundoff = loop.local_step(group), list[np.ndarray](), list[float]()

    def watch(y: np.ndarray) -> None:
        projections.append(own.project(y))
        roundoff.append(own.roundoff(y))

    for frame in range(scene.config.frames if frames is None else frames):
        state, _ = loop.step(state, frame, watch)
        positions.append(state.positions)
    return np.stack(positions), np.stack(projections), np.array(roundoff)


@dataclass(frozen=True)
class SnapshotSet:
    """Snapshots (n, e p, 3) of a group of e elements with p rows.

    ``train`` and ``test`` are frames of the training trajectory, ``heldout`` those of a test
    trajectory. ``roundoff`` is the Frobenius norm of the rounding errors of ``train``.
    """

    train: np.ndarray
    test: np.ndarray
    heldout: np.ndarray
    frames: dict[str, np.ndarray]
    row_mass: np.ndarray
    elements: int
    rows_per_element: int
    roundoff: float


def collect(
    training_run: str | os.PathLike[str],
    heldout_run: str | os.PathLike[str],
    group: ConstraintGroup,
    masses: np.ndarray,
    train: np.ndarray,
) -> SnapshotSet:
    """Read snapshots of ``group`` from a training trajectory and a test trajectory.

    Raises SnapshotError if a set is empty, lacks a training frame, or is not finite.

    training_run, heldout_run : files of full-order runs: training and test trajectory
    masses : (N,) kg, masses of the vertices
    train : (n,) numbers of the training frames, ascending
    """
    p, frames, roundoff = _read(training_run, group.name)
    held, held_frames, _ = _read(heldout_run, group.name)
    is_train = np.isin(frames, train)
    odd = frames % 2 == 1
    if not odd.any() or not len(train) or np.count_nonzero(is_train) < len(train):
        raise SnapshotError(
            f"{training_run}: snapshots of '{group.name}': stored are {len(frames)} frames, "
            f"{np.count_nonzero(is_train)} of {len(train)} train frames and {odd.sum()} test frames"
        )
    return SnapshotSet(
        train=p[is_train],
        test=p[odd],
        heldout=held,
        frames={"train": frames[is_train], "test": frames[odd], "heldout": held_frames},
        row_mass=row_masses(group, masses),
        elements=group.elements,
        rows_per_element=group.rows_per_element,
        roundoff=float(np.linalg.norm(roundoff[is_train])),
    )


def _read(path: str | os.PathLike[str], group: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with open_hdf5(path) as file:
        store = file[f"snapshots/{group}"]
        p, frames, roundoff = (store[name][...] for name in ("p", "frames", "roundoff"))
    if len(p) == 0:
        raise SnapshotError(f"{path}: group '{group}' has no snapshots")
    return require_finite(f"{path}: snapshots of '{group}'", p, SnapshotError), frames, roundoff


def save_snapshots(snapshots: SnapshotSet, path: str | os.PathLike[str]) -> None:
    """Write ``snapshots`` to ``path`` (datasets train, test, heldout, <split>_frames, row_mass)."""
    with write_hdf5(path) as file:
        for split in SPLITS:
            file[split] = getattr(snapshots, split)
            file[f"{split}_frames"] = snapshots.frames[split]
        file["row_mass"] = snapshots.row_mass
        file["row_mass"].attrs["unit"] = "kg"
        for name in ("elements", "rows_per_element", "roundoff"):
            file.attrs[name] = getattr(snapshots, name)


def load_snapshots(path: str | os.PathLike[str]) -> SnapshotSet:
    """Read the file ``path`` that `save_snapshots` wrote; StorageError if it is damaged."""
    with open_hdf5(path) as file:
        return SnapshotSet(
            **{split: file[split][...] for split in SPLITS},
            frames={split: file[f"{split}_frames"][...] for split in SPLITS},
            row_mass=file["row_mass"][...],
            elements=int(file.attrs["elements"]),
            rows_per_element=int(file.attrs["rows_per_element"]),
            roundoff=float(file.attrs["roundoff"]),
        )
