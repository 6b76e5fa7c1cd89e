"""Times of the methods in new processes: ``python -m study.experiments.alternatives.processes``.

See `study.experiments.kit.fresh_process` for the reason.
"""

import pickle
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from pdrom.model.scene import Scene
from study.experiments.alternatives.candidates import Trained, candidates
from study.experiments.alternatives.settings import SETTING, Comparison
from study.experiments.kit.fresh_process import new_process
from study.experiments.kit.measurement import Variant, measure

MODULE = "study.experiments.alternatives.processes"
COLUMNS = ["scene", "factor", "stiffness", *SETTING, "process", "ms_per_frame"]


@dataclass(frozen=True)
class Case:
    """A scene in the motion that is timed, its labels, and the reductions of it."""

    labels: dict[str, object]
    scene: Scene
    models: tuple[Trained, ...]


def in_processes(cases: Sequence[Case], settings: Comparison) -> pd.DataFrame:
    """Rows of `COLUMNS`: a process after the other times all ``cases``."""
    with TemporaryDirectory() as folder:
        asked, answer = Path(folder, "cases.pickle"), Path(folder, "rows.pickle")
        asked.write_bytes(pickle.dumps((cases, settings)))
        parts = []
        for process in range(1, settings.processes + 1):
            new_process(MODULE, str(asked), str(answer), str(process))
            parts.append(pickle.loads(answer.read_bytes()))
    return pd.concat(parts, ignore_index=True)


def timed(cases: Sequence[Case], settings: Comparison, process: int) -> pd.DataFrame:
    """Time all candidates in the random order that the number of the ``process`` gives."""
    found = [
        ({**case.labels, **each.labels}, each)
        for case in cases
        for each in candidates(case.scene, case.models, settings)
    ]
    variants = [Variant(own, c.loop, c.start, c.steps * settings.frames) for own, c in found]
    order = np.random.default_rng(process).permutation(len(variants))
    measured = measure([variants[i] for i in order], settings.warmup, settings.repeats)
    rows = []
    for i in np.argsort(order):
        labels, candidate = found[order[i]]
        ms = candidate.steps * measured[i].frame
        rows.append({**labels, "process": process, "ms_per_frame": ms})
    return pd.DataFrame(rows, columns=COLUMNS)


def main(asked: str, answer: str, process: str) -> None:
    """Time what the file ``asked`` holds and write the rows to ``answer``."""
    cases, settings = pickle.loads(Path(asked).read_bytes())
    Path(answer).write_bytes(pickle.dumps(timed(cases, settings, int(process))))


if __name__ == "__main__":
    main(*sys.argv[1:])
