"""Picture of four frames of a scene: a row for the full-order run, below it one per other run."""

from dataclasses import replace
from pathlib import Path

from pdrom.core.store import MARK, atomic_path
from pdrom.model.constraints.base import ConstraintGroup
from pdrom.model.effects import EFFECTS
from pdrom.view import style
from pdrom.view.artists import Figure
from pdrom.view.camera import Camera, obstacles, rotation_to, up_of
from pdrom.view.page import ViewedRun, ViewedScene
from pdrom.view.panels import Row, RunPanel, draw_rows, shared_window
from pdrom.view.read import frame_numbers
from pdrom.view.text import plain_words

INSTANTS = (0.25, 0.5, 0.75, 1.0)  # fractions of the run
CAMERA = Camera(30.0, 20.0)
NO_LIMIT = 100.0  # inches, largest height of the picture
SHOWN = 20  # largest number of modes r that a picture shows


def write_frames(scene: ViewedScene, png: Path) -> None:
    """Write the picture of ``scene`` to ``png``."""
    with style.look(), atomic_path(png, with_checksum=False) as temporary:
        metadata = {"Software": MARK.decode()}
        _draw(scene).savefig(temporary, format="png", dpi=150, metadata=metadata)


def shown_runs(scene: ViewedScene) -> list[ViewedRun]:
    """One run per group and method of ``scene``: the largest with r <= `SHOWN`, or the smallest."""
    pairs = dict.fromkeys((run.group, run.method) for run in scene.runs)
    every = [scene.sizes(*pair) for pair in pairs]
    return [([run for run in sizes if run.r <= SHOWN] or sizes[:1])[-1] for sizes in every]


def _draw(scene: ViewedScene) -> Figure:
    """Draw one row per run; the grey outline in reduced rows is the full-order run."""
    # the scene and its obstacles, the largest first, are turned so that y is up
    turn, found = rotation_to(up_of(scene.effects)), obstacles(scene.positions, scene.effects)
    bodies = [replace(body, points=body.points @ turn) for body in found]
    runs = tuple(replace(run, positions=run.positions @ turn) for run in scene.runs)
    scene = replace(scene, positions=scene.positions @ turn, runs=runs)
    numbers = frame_numbers(INSTANTS, len(scene.positions) - 1)
    full = scene.positions[numbers].astype(float)
    reference = [
        RunPanel(f"frame {frame}", style.FULL_ORDER, q, reference=True).seen_by(CAMERA)
        for frame, q in zip(numbers, full, strict=True)
    ]
    labels = [f"{style.words(scene.name)}\n{scene.first}"]
    for run in shown_runs(scene):
        group = f"{style.words(run.group)}\n" if len(scene.groups) > 1 else ""
        labels.append(group + plain_words(run.title) + (f"\nr = {run.r}" if run.r else ""))
    every = [reference, *([_panel(run, f) for f in numbers] for run in shown_runs(scene))]
    windows = [
        shared_window(CAMERA, q, [panels[i] for panels in every]) for i, q in enumerate(full)
    ]
    with_bodies = [[replace(p, obstacles=bodies) for p in panels] for panels in every]
    rows = [
        Row(label, scene.mesh, row, windows, full, CAMERA)
        for label, row in zip(labels, with_bodies, strict=True)
    ]
    return draw_rows(rows, NO_LIMIT)


def _panel(run: ViewedRun, frame: int) -> RunPanel:
    """Panel of ``run`` at ``frame``; of a run that ended earlier, its last frame and the reason."""
    last, failure, remark = len(run.positions) - 1, None, None
    if frame > last:
        failure = "ended" if run.blowup_frame is None else f"blew up at frame {run.blowup_frame}"
        remark = f"drawn: frame {last}" if last else "drawn: initial state"
    elif frame:
        remark = f"relative error {run.error[frame - 1]:.1g}"
    positions = run.positions[min(frame, last)].astype(float)
    # the colour of a constraint group by its index in `EFFECTS`; the first for unknown names
    groups = [name for name in EFFECTS if issubclass(EFFECTS.load(name), ConstraintGroup)]
    looks, place = style.GROUP_LOOKS, groups.index(run.group) if run.group in groups else 0
    colour = style.surface_colour(looks[place % len(looks)][0])
    return RunPanel("", colour, positions, failure, remark).seen_by(CAMERA)
