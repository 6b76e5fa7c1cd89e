"""Export of a scene's runs to ParaView: a VTU file per frame, and a PVD file with the times."""

from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np

from pdrom.core.store import MARK, atomic_path, require_own
from pdrom.view.frames import shown_runs
from pdrom.view.page import ViewedScene

NAME = "frame_{:05d}.vtu"


def vtk(scene: ViewedScene, collection: Path) -> None:
    """Write the frames of ``scene`` into the folder of the PVD file ``collection``, then that file.

    Raises
    ------
    StorageError
        A frame cannot be written, or would replace a file from outside pdrom.
    """
    names = [NAME.format(frame) for frame in range(len(scene.positions))]
    earlier = sorted(collection.parent.glob("frame_*.vtu"))
    for path in (collection, *earlier):
        require_own(path)
    volume, mesh = len(scene.mesh.tetrahedra) > 0, scene.mesh
    cells = [("tetra", mesh.tetrahedra) if volume else ("triangle", mesh.triangles)]
    for frame, name in enumerate(names):
        data = point_data(scene, frame)
        with atomic_path(collection.with_name(name), with_checksum=False) as temporary:
            written = meshio.Mesh(scene.positions[frame], cells, point_data=data)
            written.write(temporary, file_format="vtu")
            _mark(temporary)
    for path in earlier:  # of a longer run
        if path.name not in names:
            path.unlink()
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    series = ElementTree.SubElement(root, "Collection")
    for frame, name in enumerate(names):
        time = f"{frame * scene.time_step:.9g}"
        ElementTree.SubElement(series, "DataSet", timestep=time, part="0", file=name)
    ElementTree.indent(root)
    with atomic_path(collection, with_checksum=False) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
        _mark(temporary)


def point_data(scene: ViewedScene, frame: int) -> dict[str, np.ndarray]:
    """Data of each vertex of ``scene`` in a ``frame``, (N, 3) float32 each.

    Velocity (m/s, where it was stored) and displacement from the start (m) of the full-order run;
    for each reduced run the difference of its positions from the full order (m), by which ParaView
    can warp the full-order mesh, NaN after the run's end.
    """
    now = scene.positions[frame]
    data = {} if scene.velocities is None else {"velocity": scene.velocities[frame]}
    data["displacement"] = now - scene.positions[0]
    for run in shown_runs(scene):
        ended = frame >= len(run.positions)
        apart = np.full_like(now, np.nan) if ended else run.positions[frame] - now
        data[f"{run.group} {run.method} r={run.r}"] = apart
    return {name: np.asarray(values, dtype=np.float32) for name, values in data.items()}


def _mark(path: Path) -> None:
    """Append the comment by which `require_own` recognises the XML file ``path``."""
    with open(path, "ab") as file:
        file.write(b"\n<!-- " + MARK + b" -->\n")
