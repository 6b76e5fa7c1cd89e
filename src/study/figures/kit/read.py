"""Read result files for figures: runs, and sampled entries of projections."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import StorageError
from pdrom.core.store import open_hdf5
from pdrom.reduction.sampling.reduction import Sampling
from pdrom.view.frames import frame_numbers
from pdrom.view.mesh_render import Colour
from pdrom.view.panels import RunPanel


def positions_at(
    path: str, fractions: tuple[float, ...], end: int | None = None
) -> tuple[list[int], np.ndarray]:
    """Read frame numbers and positions (n, N, 3) m of a run at ``fractions`` of its frames.

    ``path`` is the file of the run, ``end`` the frame of fraction 1 (None: the last frame). Raises
    StorageError if the file is missing or holds positions that are not finite.
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
    """Reduced run with basis size r, in the group ``label`` of the HDF5 file ``path``.

    full : whether r is the numerical rank of the snapshots
    marked : whether r exceeds this rank, so that there is no run
    blowup_frame : frame at which the run blew up; -1 if it did not blow up
    every : distance of the stored frames 0, every, 2 every, ...
    """

    path: str
    label: str
    r: int
    full: bool
    marked: bool
    blowup_frame: int
    every: int = 1

    @property
    def title(self) -> str:
        """Text that states the basis size."""
        return f"r = {self.r} (full rank)" if self.full else f"r = {self.r}"

    def at(self, frame: int) -> tuple[int, np.ndarray] | None:
        """Read number and positions (N, 3) m of the last finite frame up to ``frame``, or None."""
        with open_hdf5(self.path) as file:
            stored = file[self.label]["positions"]
            for entry in range(min(frame // self.every, len(stored) - 1), -1, -1):
                positions = np.asarray(stored[entry], dtype=float)
                if np.isfinite(positions).all():
                    return entry * self.every, positions
        return None

    def panel(self, frame: int, colour: Colour) -> RunPanel:
        """Return a panel of the run at ``frame``, with a message if it failed or did not start."""
        if self.marked:
            remark = "not run: r exceeds\nthe numerical rank"
            return RunPanel(self.title, colour, None, remark=remark)
        blew_up = 0 <= self.blowup_frame < frame
        failure = f"blew up at frame {self.blowup_frame}" if blew_up else None
        found = self.at(frame)
        if found is None:
            return RunPanel(self.title, colour, None, failure or "no finite positions")
        entry, positions = found
        drawn = f"drawn: frame {entry}" if entry else "drawn: initial state"
        return RunPanel(self.title, colour, positions, failure, drawn if failure else None)


def rerun_infos(path: str, inside: str = "") -> list[RerunInfo]:
    """Read the reduced runs in the HDF5 file ``path``, or in its group ``inside``, by r."""
    with open_hdf5(path) as file:
        return [
            RerunInfo(
                path=path,
                label=f"{inside}/{label}",
                r=int(group.attrs["r"]),
                full=bool(group.attrs.get("full", False)),
                marked=bool(group.attrs["marked"]),
                blowup_frame=int(group.attrs.get("blowup_frame", -1)),
                every=int(group.attrs.get("every", 1)),
            )
            for label, group in file[f"/{inside}"].items()
            if "marked" in group.attrs
        ]


def choose_ranks(infos: list[RerunInfo], wanted: tuple[int | str, ...]) -> list[RerunInfo]:
    """Select runs by sizes ``wanted`` ("full": the rank), in this order; all if none match."""
    chosen = [i for rank in wanted for i in infos if (i.full if rank == "full" else i.r == rank)]
    return list(dict.fromkeys(chosen)) or infos


def read_samplings(path: str) -> dict[int, Sampling]:
    """Map each basis size r in the file ``path``, ascending, to its sampled elements."""
    with open_hdf5(path) as file:
        return {
            int(label.removeprefix("r")): Sampling(group["entries"][...], group["elements"][...])
            for label, group in file.items()
        }
