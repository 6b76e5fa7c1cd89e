"""A scene's runs for ParaView: one file a frame (VTU), and a collection with their times (PVD)."""

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from pdrom.core.paths import FULL_ORDER, MESH
from pdrom.core.store import atomic_path, open_hdf5, seal_path
from pdrom.model.mesh.types import Mesh, load_mesh
from pdrom.report.scenes.loaded import LoadedRun, reduced
from pdrom.report.scenes.results import SceneResults

NAME = "frame_{:05d}.vtu"


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write the frames beside the collection, which is written last."""
    collection = Path(outputs["collection"])
    mesh, runs = load_mesh(results.path(MESH, results.scene)), reduced(results)
    with open_hdf5(results.path(FULL_ORDER, results.scene)) as file:
        positions, velocities = file["positions"][...], file["velocities"][...]
    names = [NAME.format(frame) for frame in range(len(positions))]
    for frame, name in enumerate(names):
        data = point_data(positions, velocities[frame], runs, frame)
        _write(mesh, positions[frame], data, collection.with_name(name))
    _remove_others(collection.parent, set(names))
    _write_collection(collection, names, results.settings["time_step"])


def point_data(
    positions: np.ndarray, velocity: np.ndarray, runs: list[LoadedRun], frame: int
) -> dict[str, np.ndarray]:
    """Data of each vertex in a frame, (N, 3) float32 each.

    Velocity (m/s) and displacement from the start (m) of the full-order run; for each reduced run
    the vector from the full order to it (m), by which ParaView warps the one into the other, NaN
    where it had ended.
    """
    now = positions[frame]
    data = {"velocity": velocity, "displacement": now - positions[0]}
    for run in runs:
        ended = frame >= len(run.positions)
        data[run.name] = np.full_like(now, np.nan) if ended else run.positions[frame] - now
    return {name: np.asarray(values, dtype=np.float32) for name, values in data.items()}


def _write(mesh: Mesh, points: np.ndarray, data: dict[str, np.ndarray], path: Path) -> None:
    volume = len(mesh.tetrahedra) > 0
    cells = [("tetra", mesh.tetrahedra) if volume else ("triangle", mesh.triangles)]
    with atomic_path(path) as temporary:
        meshio.Mesh(points, cells, point_data=data).write(temporary, file_format="vtu")


def _remove_others(folder: Path, kept: set[str]) -> None:
    """Frames of an earlier, longer run."""
    for path in folder.glob("frame_*.vtu"):
        if path.name not in kept:
            seal_path(path).unlink(missing_ok=True)
            path.unlink()


def _write_collection(path: Path, names: list[str], time_step: float) -> None:
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    for frame, name in enumerate(names):
        time = f"{frame * time_step:.9g}"
        ElementTree.SubElement(collection, "DataSet", timestep=time, part="0", file=name)
    ElementTree.indent(root)
    with atomic_path(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
