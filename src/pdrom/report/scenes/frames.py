"""Four frames of a scene: the full-order run, and below it each reduced run."""

from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure

from pdrom.report.figures.kit import style
from pdrom.report.figures.kit.camera import Camera
from pdrom.report.figures.kit.panels import RunPanel, shared_window
from pdrom.report.figures.kit.read import frame_numbers
from pdrom.report.figures.kit.run_rows import Row, draw_rows
from pdrom.report.scenes.picture import panel_of, shown_runs, title_of, write_picture
from pdrom.report.viewer.runs import ViewedRun, ViewedScene

INSTANTS = (0.25, 0.5, 0.75, 1.0)  # of the run
CAMERA = Camera(30.0, 20.0)
NO_LIMIT = 100.0  # inches: the picture need not fit on a page


def frames(scene: ViewedScene, pdf: Path, png: Path) -> None:
    """Write the picture of ``scene`` to ``pdf`` and ``png``."""
    write_picture(_draw, scene, "frames", pdf=pdf, png=png)


def _draw(scene: ViewedScene) -> Figure:
    """One row per run; the grey outline in the rows of reduced runs is the full-order run."""
    numbers = frame_numbers(INSTANTS, len(scene.positions) - 1)
    full = scene.positions[numbers].astype(float)
    reference = [
        RunPanel(_instant(scene, frame), style.FULL_ORDER, q, reference=True).seen_by(CAMERA)
        for frame, q in zip(numbers, full, strict=True)
    ]
    labels = [f"{style.words(scene.name)}\nfull order"]
    labels += [title_of(scene, run) for run in shown_runs(scene)]
    every = [reference, *([_panel(run, f) for f in numbers] for run in shown_runs(scene))]
    windows = [
        shared_window(CAMERA, q, [panels[i] for panels in every]) for i, q in enumerate(full)
    ]
    rows = [
        Row(label, scene.mesh, panels, windows, full)
        for label, panels in zip(labels, every, strict=True)
    ]
    return draw_rows(rows, CAMERA, NO_LIMIT)


def _instant(scene: ViewedScene, frame: int) -> str:
    """Label of a frame; one past the scene's horizon says so: there no run can be judged."""
    past = scene.horizon is not None and frame > scene.horizon
    return f"frame {frame}, past horizon" if past else f"frame {frame}"


def _panel(run: ViewedRun, frame: int) -> RunPanel:
    panel, last = panel_of(run, frame).seen_by(CAMERA), len(run.positions) - 1
    drawn = f"drawn: frame {last}" if last else "drawn: initial state"
    remark = drawn if panel.failure else f"relative error {run.error[frame - 1]:.1g}"
    return replace(panel, remark=remark if frame else None)
