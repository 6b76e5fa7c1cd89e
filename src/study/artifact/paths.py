"""Define all paths in a results folder; no other module defines paths of results.

A `Place` is a kind of file. Its path has wildcards for scene, group, method ..., whose values are
called labels. The pipeline chooses a results folder for each configuration.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pdrom.core.errors import StorageError

RESULTS = "results"

# Name of a wildcard in the paths of results -> regular expression for its values.
LABELS = {
    "mesh": r"[A-Za-z0-9_.-]+", "scene": r"[a-z][a-z0-9_]*", "run": r"train|heldout|kick|stiffness",
    "group": r"[a-z_]+", "basis": r"[a-z0-9-]+", "method": r"[a-z0-9-]+", "factor": r"[0-9.]+",
    "name": r"[A-Za-z0-9_.]+",
}  # fmt: skip
_LABEL = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class Place:
    """A kind of file; ``pattern`` is its path in the results folder, with wildcards in braces."""

    pattern: str

    def at(self, results: str, **labels: str) -> str:
        """Return the path of the file in the folder ``results`` for scene etc. in ``labels``."""
        return f"{results}/{self.pattern.format(**labels)}"

    def where(self, **labels: str) -> "Place":
        """Return this kind of file with the values ``labels`` in place of their wildcards."""
        pattern = self.pattern
        for label, value in labels.items():
            pattern = pattern.replace(f"{{{label}}}", value)
        return Place(pattern)

    @property
    def labels(self) -> list[str]:
        """Names of the wildcards (scene, group ...) in the pattern."""
        return _LABEL.findall(self.pattern)

    def file(self, path: str) -> "File":
        """Return ``path`` as a `File`; StorageError if the path does not fit the pattern."""
        found = self._expression.search(path)
        if found is None:
            raise StorageError(f"{path}: the path does not fit '{self.pattern}'")
        return File(path, found.groupdict())

    def paths(self, sources: Any, labels: Mapping[str, str]) -> str:
        """Return the path of this kind of file for a job's ``labels``; ``sources`` is the plan."""
        return str(sources.file(self, labels))

    def content(self, paths: Any) -> "File":
        """Return the `File` at the path ``paths``, as an artifact's function receives its input."""
        return self.file(str(paths))

    @cached_property
    def _expression(self) -> re.Pattern[str]:
        texts = _LABEL.split(self.pattern)  # every second text is the name of a wildcard
        texts[::2] = map(re.escape, texts[::2])
        texts[1::2] = [f"(?P<{label}>{LABELS[label]})" for label in texts[1::2]]
        return re.compile(rf"(?:^|/){''.join(texts)}$")


@dataclass(frozen=True)
class File:
    """A file: its path, and the values of the path's wildcards (labels), as ``file["scene"]``."""

    path: str
    labels: dict[str, str]

    def __getitem__(self, label: str) -> str:
        return self.labels[label]


MESH = Place("meshes/{mesh}.h5")
FULL_ORDER = Place("fom/{scene}/{run}.h5")
TRAIN = FULL_ORDER.where(run="train")
HELDOUT = FULL_ORDER.where(run="heldout")
KICK = FULL_ORDER.where(run="kick")
STIFFNESS = FULL_ORDER.where(run="stiffness")
CONVERGED = Place("converged/{scene}/{run}.h5")
REFERENCES = Place("converged/{scene}.csv")
ERROR_BUDGET = Place("error_budget/{scene}.csv")
SENSITIVITY = Place("sensitivity/{scene}.csv")
CONTRIBUTIONS = Place("contributions/{scene}.csv")
ITERATIONS = Place("iterations/{scene}.csv")
SNAPSHOTS = Place("snapshots/{scene}/{group}.h5")
BASIS = Place("pod/{scene}/{group}/{basis}.h5")
SAMPLING = Place("sampling/{scene}/{group}/{method}.h5")
RECONSTRUCTION = Place("sampling/{scene}/{group}/{method}.csv")
RERUNS = Place("reruns/{scene}/{group}/{method}.h5")
RERUNS_TRAIN = Place("reruns/{scene}/{group}/{method}.csv")
RERUNS_HELDOUT = Place("reruns/{scene}/{group}/{method}_heldout.csv")
SUBSPACES = Place("subspaces/{scene}/models.h5")
SUBSPACES_TRAIN = Place("subspaces/{scene}/models.csv")
SUBSPACES_HELDOUT = Place("subspaces/{scene}/models_heldout.csv")
SUBSPACES_SECONDS = Place("seconds/{scene}.csv")
LADDER = Place("ladder/{scene}/{group}.csv")
REPETITIONS = Place("repetitions/{scene}/{group}.csv")
NOISE = Place("noise/{scene}/{group}.csv")
NOISE_RUNS = Place("noise/{scene}/{group}.h5")
STABILITY = Place("stability/{scene}.csv")
TIMINGS = Place("timings/{scene}.csv")
BREAK_EVEN = Place("breakeven/{scene}.csv")
BREAK_EVEN_SIZED = Place("breakeven/{scene}/x{factor}.csv")
EFFECTS = Place("effects/{scene}.csv")
LEFT_OUT = Place("left_out/{scene}.csv")
SCALING = Place("scaling/{scene}/x{factor}.csv")
ONLINE = Place("online/{scene}.csv")
ONLINE_MODELS = Place("online/{scene}.h5")
FRAME_TIMES = Place("frame_times/times.csv")
PROJECTION_SECONDS = Place("frame_times/projection_seconds.csv")
ALTERNATIVES = Place("alternatives/{scene}/x{factor}.csv")
ALTERNATIVE_TIMES = Place("alternatives/{scene}/x{factor}_times.csv")
HARD_CASES = Place("hard_cases/cases.csv")
MACHINE = Place("machine.json")
MANIFEST = Place("manifest.json")
TABLE = Place("tables/{name}.csv")
FIGURE = Place("figures/{name}.pdf")
FIGURE_PICTURE = Place("figures/{name}.png")
PAPER_INPUT = Place("paper/{name}")
LIVE_MODEL = Place("article/live/{scene}.js")
ARTICLE = Place("article/{name}")
LIVE_PAGE = Place("article/live.html")


def labels_in(
    path: str, results: str, places: Iterable[Place]
) -> Iterator[tuple[Place, dict[str, str]]]:
    """Yield each of ``places`` whose pattern fits ``path``, with labels as {"scene": "bar140"}."""
    for place in places:
        if path.startswith(f"{results}/{place.pattern.partition('{')[0]}"):
            with suppress(StorageError):
                labels = place.file(path).labels
                if place.at(results, **labels) == path:
                    yield place, labels
