"""Readers of result files for figures: positions of runs and samplings."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5


def frame_numbers(fractions: tuple[float, ...], frames: int) -> list[int]:
    """Entries of ``positions`` (0 .. frames) at fractions of a run, without repetition."""
    return list(dict.fromkeys(round(fraction * frames) for fraction in fractions))


def positions_at(
    path: str, fractions: tuple[float, ...], end: int | None = None
) -> tuple[list[int], np.ndarray]:
    """Frame numbers and positions (n, N, 3) m of a run at fractions of it, or of its first frames.

    Parameters
    ----------
    path : file of the run
    end : last of these frames; None for all

    Raises
    ------
    StorageError
        The file is missing or holds positions that are not finite.
    """
    with open_hdf5(path) as file:
        data = file["positions"]
        last = len(data) - 1
        frames = frame_numbers(fractions, last if end is None else min(end, last))
        chosen = np.stack([data[frame] for frame in frames])
    if not np.isfinite(chosen).all():
        raise StorageError(f"{path}: positions of a full-order run are not finite")
    return frames, chosen


@dataclass(frozen=True)
class RerunInfo:
    """One basis size of a file of reduced runs.

    marked : the size exceeds the numerical rank, nothing ran
    blowup_frame : frame at which the run blew up, -1 if it did not
    entries : stored positions, the initial ones included
    """

    label: str
    r: int
    full: bool
    marked: bool
    blowup_frame: int
    entries: int

    @property
    def title(self) -> str:
        """Text that states the basis size."""
        return f"r = {self.r} (full rank)" if self.full else f"r = {self.r}"


def rerun_infos(path: str, inside: str = "") -> list[RerunInfo]:
    """Basis sizes in a file ``path`` of reduced runs, or in its group ``inside``, ascending."""
    with open_hdf5(path) as file:
        infos = []
        for label, group in file[f"/{inside}"].items():
            if not _is_size(label):
                continue
            attrs, marked = group.attrs, bool(group.attrs["marked"])
            info = RerunInfo(
                label=f"{inside}/{label}",
                r=int(attrs["r"]),
                full=bool(attrs.get("full", False)),
                marked=marked,
                blowup_frame=-1 if marked else int(attrs["blowup_frame"]),
                entries=len(group["positions"]) if "positions" in group else 0,
            )
            infos.append(info)
    return sorted(infos, key=lambda info: (info.r, info.full))


def _is_size(label: str) -> bool:
    return label.startswith("r") and label[1:].isdigit()


def choose_ranks(infos: list[RerunInfo], asked: tuple[int | str, ...]) -> list[RerunInfo]:
    """Select the runs of ``infos`` with the sizes ``asked``, in this order; all if none match."""
    chosen: dict[str, RerunInfo] = {}
    for rank in asked:
        for info in infos:
            if info.full if rank == "full" else info.r == rank:
                chosen.setdefault(info.label, info)
    return list(chosen.values()) or infos


def rerun_positions(path: str, info: RerunInfo, frame: int) -> tuple[int, np.ndarray] | None:
    """Last finite positions (N, 3) m up to entry ``frame``, and their entry; None without any.

    The run is ``info`` in the file ``path``.

    A run that blew up holds fewer entries than the full-order run.
    """
    with open_hdf5(path) as file:
        data = file[info.label]["positions"] if info.entries else ()
        for entry in range(min(frame, len(data) - 1), -1, -1):
            positions = np.asarray(data[entry], dtype=float)
            if np.isfinite(positions).all():
                return entry, positions
    return None


@dataclass(frozen=True)
class SamplingView:
    """Entries and elements that a method selected for one basis size r."""

    r: int
    entries: np.ndarray
    elements: np.ndarray


def read_samplings(path: str) -> list[SamplingView]:
    """Selections of all basis sizes in the file ``path``, ascending in r."""
    with open_hdf5(path) as file:
        views = [
            SamplingView(int(label[1:]), group["entries"][...], group["elements"][...])
            for label, group in file.items()
            if _is_size(label)
        ]
    return sorted(views, key=lambda view: view.r)
