"""``pdrom reduce --error``: what is said of a run, whatever became of it, and its exit code."""

from pathlib import Path

import numpy as np
import pytest

from builders import SMALL
from pdrom.api import FullRun, RequestedRun, load_scene
from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.reduction.requested.run import Outcome, Request

COMMAND = ["reduce", "small.yaml", "--run", "small.h5", "--error", "0.05"]


@pytest.fixture
def full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FullRun:
    """A training run that is read from small.h5, of a scene in the folder of the command."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(SMALL)
    found = FullRun(load_scene("small.yaml"), np.zeros((5, 30, 3)), np.ones(4), {})
    monkeypatch.setattr("pdrom.api.load", lambda *_: found)
    return found


def done(full: FullRun, error: float | None = None, **changes) -> RequestedRun:
    """A run of four frames within its tolerance, but for the ``changes`` of its outcome."""
    outcome = {
        "positions": full.positions, "frames": 4, "limit": "", "expected": 0.031, "estimate": None,
        "level": "ecsw, k = 20, tau = 0.01, K = 10", "reduced": True, "failed": [],
        "checks": [0, 2], "seconds": 0.1, "full_ms": 8.0,
    }  # fmt: skip
    made = Outcome(**(outcome | changes))
    return RequestedRun(full.scene, Request(error=0.05), made, np.full(4, 2.0), 1.5, error)


SLOW = "the iterations converge too slowly after it"


@pytest.mark.parametrize(
    ("changes", "words", "status"),
    [
        ({}, "implicit step: met, by a reduction\n", Status.DONE),
        ({"reduced": False}, "met, by the full order only\n", Status.DONE),
        (
            {"frames": 2, "limit": SLOW},
            f"met up to frame 2 of 4, by a reduction ({SLOW})\n",
            Status.DONE,
        ),
        ({"frames": 1, "limit": SLOW}, "met up to frame 1 of 4", Status.NOTHING_FITS),
        ({"frames": 0}, ": refused (nothing meets it for sure); run in", Status.NOTHING_FITS),
        (
            {"frames": 0, "positions": np.full((5, 30, 3), np.nan)},
            ": blew up, with the full order, too\n",
            Status.NOTHING_FITS,
        ),
        ({"estimate": 0.02, "error": 0.011}, "estimated 0.02, reached 0.011\n", Status.DONE),
        ({"failed": ["a"]}, "K = 10, after a; 2 frames checked\n", Status.DONE),
    ],
)
def test_what_became_of_a_run(full, monkeypatch, capsys, changes, words, status):
    monkeypatch.setattr("pdrom.api.reduce", lambda *_, **__: done(full, **changes))
    monkeypatch.setattr("pdrom.api.save", lambda *_: None)
    assert run(COMMAND) == status
    said = capsys.readouterr().out
    assert said.startswith(
        "small_requested.h5: 5 % of the positions against the converged implicit"
    )
    assert words in said
    assert "\n  error: expected at most 0.031" in said
    assert said.endswith(
        "2.00 ms a frame, 8.00 in the cheapest full order that meets it; choosing took 1.5 s, "
        "as long as 750 frames\n"
    )


def test_a_training_run_is_a_full_order_run(full, monkeypatch, capsys):
    monkeypatch.setattr("pdrom.api.load", lambda *_: done(full))
    assert run(COMMAND) == Status.FAULTY
    assert capsys.readouterr().err == "pdrom: small.h5: no full-order run (pdrom run makes one)\n"
