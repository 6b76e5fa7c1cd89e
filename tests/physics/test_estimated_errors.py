"""What an estimate below the threshold says of the true error: the triangle inequality."""

from dataclasses import dataclass

import numpy as np
import pytest

from builders import make_scene
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.basis import compute_basis
from pdrom.reduction.local.guard import GuardRecord
from pdrom.reduction.local.guard_settings import Action, GuardSettings
from pdrom.reduction.local.guarded import Trained, guarded_rerun
from pdrom.reduction.method import load_methods
from pdrom.reduction.rerun import Rerun
from pdrom.reduction.sampling import Reduction, select
from pdrom.reduction.subspace.companion import CompanionSpec, companion_model, companion_run
from places import CONFIG

FRAMES, THRESHOLD = 30, 0.015


@dataclass(frozen=True)
class Swing:
    """A sheet that swings, its springs reduced, and an auxiliary model that is not exact either."""

    scene: Scene
    reference: np.ndarray
    trained: Trained
    own: np.ndarray
    """|| Q' - Q_fom ||_F of each frame of the auxiliary model Q', m"""

    def run(self, method: str, action: Action) -> tuple[Rerun, GuardRecord]:
        group, spec = self.scene.groups[0], load_methods(CONFIG / "methods.yaml")[method]
        snapshots = np.stack([group.project(q) for q in self.reference[1:]])
        basis = compute_basis(snapshots, np.ones(snapshots.shape[1]), 0.0, 1, spec)
        reduction = Reduction(basis, select(basis, spec, 4), spec, 4)
        asked = GuardSettings(action=action, alarm="estimate", threshold=THRESHOLD)
        return guarded_rerun(
            self.scene, self.scene.system, "spring", reduction, self.reference, 1e3, asked,
            self.trained,
        )  # fmt: skip


@pytest.fixture(scope="module")
def swing() -> Swing:
    scene = make_scene(
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        {"effect": "spring", "weight": 1e4},
        mesh={"kind": "cloth", "rows": 7, "columns": 6, "plane": "xz"},
        frames=FRAMES,
        iterations=6,
    )
    reference = trajectory(scene, track_objective=False)
    frames = np.arange(0, FRAMES, 2)
    asked = CompanionSpec(modes=3, tolerance=1e-2, frames=10)
    companion = companion_model(scene, reference[1:][frames], frames, asked)
    own = np.linalg.norm(companion_run(scene, companion) - reference, axis=(1, 2))[1:]
    assert own.max() > 0.0
    return Swing(scene, reference, Trained.on(reference, companion), own)


@pytest.mark.parametrize("method", ["pod", "gappy", "block-deim", "deim", "deim-joint"])
@pytest.mark.parametrize("action", ["report", "stop", "fall-back"])
def test_the_error_exceeds_the_estimate_by_no_more_than_the_companions_own(swing, method, action):
    """Root mean squares over the frames of the run, over the motion of the training run."""
    outcome, seen = swing.run(method, action)
    scale = np.sqrt(outcome.frames) * swing.trained.motion
    error = np.linalg.norm(outcome.difference) / scale
    own = np.linalg.norm(swing.own[: outcome.frames]) / scale
    assert abs(error - seen.estimate) <= own * (1.0 + 1e-9)
    if action == "stop":
        # every frame but the last one was no alarm
        kept = outcome.frames - int(seen.stopped)
        error = np.linalg.norm(outcome.difference[:kept])
        bound = THRESHOLD * np.sqrt(kept) * swing.trained.motion + np.linalg.norm(swing.own[:kept])
        assert error <= bound * (1.0 + 1e-9)


def test_the_methods_differ(swing):
    """Runs of both sorts are among those above: with an alarm and without."""
    counts = {method: swing.run(method, "report")[1].count for method in ("pod", "deim-joint")}
    assert counts["pod"] == 0 < counts["deim-joint"]
