"""Read result files for figures: positions of runs, indices of sampled projection entries."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5


def frame_numbers(fractions: tuple[float, ...], frames: int) -> list[int]:
    """Indices of frames (0 to ``frames``) at ``fractions`` of a run, without repetition."""
    return list(dict.fromkeys(round(fraction * frames) for fraction in fractions))


def positions_at(
    path: str, fractions: tuple[float, ...], end: int | None = None
) -> tuple[list[int], np.ndarray]:
    """Frame numbers and positions (n, N, 3) m of a run at ``fractions`` of its frames.

    Raises StorageError if the file is missing or holds positions that are not finite.

    Parameters
    ----------
    path : file of the run
    end : frame that counts as the end of the run; None for its last frame
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
    """Reduced run of one basis size r in a result file.

    label : path of the run's group in the HDF5 file
    full : whether r is the numerical rank of the snapshots
    marked : whether r exceeds that rank, so that nothing ran
    blowup_frame : frame at which the run blew up, -1 if it did not
    entries : number of stored frames, including the initial state
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
    """Reduced runs in the HDF5 file ``path``, or in its group ``inside``, ascending in r."""
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
    """Select runs by basis sizes ``asked`` ("full": the rank), in that order; all if none match."""
    chosen: dict[str, RerunInfo] = {}
    for rank in asked:
        for info in infos:
            if info.full if rank == "full" else info.r == rank:
                chosen.setdefault(info.label, info)
    return list(chosen.values()) or infos


def rerun_positions(path: str, info: RerunInfo, frame: int) -> tuple[int, np.ndarray] | None:
    """Index and positions (N, 3) m of the last finite frame up to ``frame``; None without any.

    The run that ``info`` describes is in the file ``path``; it has fewer frames if it blew up.
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
    """Indices of the entries of projections, and of their elements, sampled for r modes."""

    r: int
    entries: np.ndarray
    elements: np.ndarray


def read_samplings(path: str) -> list[SamplingView]:
    """Sampled entries and elements for each basis size r in the file ``path``, ascending in r."""
    with open_hdf5(path) as file:
        views = [
            SamplingView(int(label[1:]), group["entries"][...], group["elements"][...])
            for label, group in file.items()
            if _is_size(label)
        ]
    return sorted(views, key=lambda view: view.r)
