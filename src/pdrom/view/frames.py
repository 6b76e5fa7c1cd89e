"""Files that show a scene's runs: a picture of four frames, and files for ParaView.

The picture has a row for the full-order run and below it one for each reduced run. For ParaView
there is a VTU file per frame, and a PVD file with the times.
"""

from dataclasses import replace
from pathlib import Path
from textwrap import wrap
from xml.etree import ElementTree

import numpy as np

from pdrom.core.store import MARK, atomic_path
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.camera import Camera, obstacles, rotation_to, up_of
from pdrom.view.page import ViewedRun, ViewedScene
from pdrom.view.panels import Row, RunPanel, draw_rows, shared_window

INSTANTS = (0.25, 0.5, 0.75, 1.0)  # times of the pictures, as fractions of the run
CAMERA = Camera(30.0, 20.0)
NAME, FRAMES = "frame_{:05d}.vtu", "frame_*.vtu"
LABEL = 24  # characters of a line in the label of a row


def frame_numbers(fractions: tuple[float, ...], frames: int) -> list[int]:
    """Return indices of frames (0 to ``frames``) at ``fractions`` of a run, without repetition."""
    return list(dict.fromkeys(round(fraction * frames) for fraction in fractions))


def write_frames(scene: ViewedScene, png: Path) -> None:
    """Write the picture of ``scene`` to ``png``."""
    with style.look(), atomic_path(png, with_checksum=False) as temporary:
        metadata = {"Software": MARK.decode()}
        _draw(scene).savefig(temporary, format="png", dpi=150, metadata=metadata)


def _draw(scene: ViewedScene) -> Figure:
    """Draw one row of pictures per run; grey outlines in reduced runs show the full-order run."""
    # the scene and its obstacles are turned so that y points up
    turn, found = rotation_to(up_of(scene.effects)), obstacles(scene.positions, scene.effects)
    bodies = [replace(body, points=body.points @ turn) for body in found]
    runs = tuple(replace(run, positions=run.positions @ turn) for run in scene.runs)
    scene = replace(scene, positions=scene.positions @ turn, runs=runs)
    numbers = frame_numbers(INSTANTS, len(scene.positions) - 1)
    full = scene.positions[numbers].astype(float)
    reference = [
        RunPanel(f"frame {frame}", style.FULL_ORDER, q, reference=True)
        for frame, q in zip(numbers, full, strict=True)
    ]
    own = "\n".join(wrap(style.plain_words(scene.method), LABEL))
    labels = [f"{style.words(scene.name)}\n{own}"]
    labels += ["\n".join(wrap(style.plain_words(run.title), LABEL)) for run in scene.runs]
    every = [reference, *([_panel(i, run, f) for f in numbers] for i, run in enumerate(scene.runs))]
    windows = [
        shared_window(CAMERA, q, [panels[i] for panels in every]) for i, q in enumerate(full)
    ]
    rows = [
        Row(label, scene.mesh, [replace(p, obstacles=bodies) for p in row], windows, full, CAMERA)
        for label, row in zip(labels, every, strict=True)
    ]
    return draw_rows(rows, row_limit=np.inf)


def _panel(number: int, run: ViewedRun, frame: int) -> RunPanel:
    """Return the panel of reduced run ``number`` at ``frame``, or at its last frame if it ended."""
    last, failure, remark = len(run.positions) - 1, None, None
    if frame > last:
        failure = "ended" if run.blowup_frame is None else f"blew up at frame {run.blowup_frame}"
        remark = f"drawn: frame {last}" if last else "drawn: initial state"
    elif frame:
        remark = f"relative error {run.error[frame - 1]:.1g}"
    positions = run.positions[min(frame, last)].astype(float)
    colour = style.surface_colour(style.GROUP_LOOKS[number % len(style.GROUP_LOOKS)][0])
    return RunPanel("", colour, positions, failure, remark)


def vtk(scene: ViewedScene, collection: Path) -> None:
    """Write ``scene`` for ParaView: the PVD file ``collection``, frames as VTU files in its folder.

    Replaces all files with names of frames in this folder. StorageError if one cannot be written.
    """
    import meshio

    names = [NAME.format(frame) for frame in range(len(scene.positions))]
    volume, mesh = len(scene.mesh.tetrahedra) > 0, scene.mesh
    cells = [("tetra", mesh.tetrahedra) if volume else ("triangle", mesh.triangles)]
    for frame, name in enumerate(names):
        data = point_data(scene, frame)
        with atomic_path(collection.with_name(name), with_checksum=False) as temporary:
            written = meshio.Mesh(scene.positions[frame], cells, point_data=data)
            written.write(temporary, file_format="vtu")
            _mark(temporary)
    for path in collection.parent.glob(FRAMES):
        if path.name not in names:  # of a longer run written earlier
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
    """Return data of each vertex of ``scene`` in a ``frame``, (N, 3) float32 each.

    Displacement from the initial state (m) of the full-order run; for each reduced run its
    positions minus those of the full-order run (m), NaN after the reduced run's end.
    """
    now = scene.positions[frame]
    data = {"displacement": now - scene.positions[0]}
    for run in scene.runs:
        ended = frame >= len(run.positions)
        apart = np.full_like(now, np.nan) if ended else run.positions[frame] - now
        data[run.title] = apart
    return {name: np.asarray(values, dtype=np.float32) for name, values in data.items()}


def _mark(path: Path) -> None:
    """Append the comment by which `require_own` knows that pdrom made the XML file ``path``."""
    with open(path, "ab") as file:
        file.write(b"\n<!-- " + MARK + b" -->\n")
