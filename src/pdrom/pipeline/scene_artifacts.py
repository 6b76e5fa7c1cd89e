"""Rules of a single scene's artifacts."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from pdrom.core.paths import SUBSPACES, TIMINGS, VIEWER
from pdrom.pipeline.contents import paths_of
from pdrom.pipeline.figures import holdings_of
from pdrom.pipeline.fingerprint import digest, fingerprint
from pdrom.pipeline.scenes import require_scenes
from pdrom.pipeline.study import Study
from pdrom.report.scenes.catalogue import ARTIFACTS, PAGE, SceneArtifact, module
from pdrom.report.scenes.job import SceneOrder

VIEWED = 4  # scenes of the viewer where the configuration names none
MAKER = "pdrom.report.scenes.job"


@dataclass(frozen=True)
class ViewerJob:
    """Job of the viewer."""

    inputs: list[str]
    orders: list[dict[str, Any]]
    page: str
    log: str
    content: str
    code: str


class SceneArtifacts:
    """Rules of the artifacts of any scene that has a file; ``results`` is the results folder."""

    def __init__(self, study: Study, results: str) -> None:
        self._study, self._results = study, results
        self._order = cache(self._made_order)

    def outputs(self, artifact: SceneArtifact) -> dict[str, str]:
        """Paths with the scene's label in braces."""
        return {name: place.rule(self._results) for name, place in artifact.outputs.items()}

    def log(self, name: str) -> str:
        """Log file with the scene's label in braces."""
        return f"{self._results}/logs/scenes/{{scene}}_{name}.log"

    def inputs(self, artifact: SceneArtifact) -> Callable[[Any], list[str]]:
        """Files that an artifact reads, by the job's scene."""

        def of_wildcards(wildcards: Any) -> list[str]:
            study = self._study.only(wildcards.scene)
            return [f for place in artifact.reads for f in paths_of(study, place, self._results)]

        return of_wildcards

    def params(self, name: str) -> dict[str, Any]:
        """Parameters of an artifact."""
        return {
            "order": lambda wildcards: self._order(name, wildcards.scene),
            "content": digest(self._study.root, *ARTIFACTS[name].sources),
            "code": fingerprint(MAKER, module(name)),
        }

    @property
    def viewer(self) -> "ViewerJob":
        """The viewer of several scenes, with the times of their runs."""
        chosen = self._study.settings.viewer.scenes or tuple(self._study.scenes)[:VIEWED]
        require_scenes(self._study.root, chosen, "viewer.scenes")
        reads = (*ARTIFACTS["viewer"].reads, TIMINGS)
        studies = [self._study.only(scene) for scene in chosen]
        return ViewerJob(
            inputs=[f for s in studies for p in reads for f in paths_of(s, p, self._results)],
            orders=[self._order("viewer", scene) for scene in chosen],
            page=VIEWER.at(self._results),
            log=f"{self._results}/logs/viewer.log",
            content=digest(self._study.root, *PAGE),
            code=fingerprint(MAKER, module("viewer")),
        )

    def _made_order(self, name: str, scene: str) -> dict[str, Any]:
        section = self._study.settings.sensitivity
        order = SceneOrder(
            name=name,
            scene=scene,
            folder=self._results,
            holdings=holdings_of(self._study.only(scene)),
            title=self._study.scene(scene).title,
            ranks=self._study.settings.viewer.ranks,
            settings={
                "sensitivity.reference": section.reference,
                "sensitivity.threshold": section.threshold,
                "time_step": self._study.scene(scene).time_step,
                "iterations": self._study.scene(scene).iterations,
            },
            subspaces=bool(paths_of(self._study.only(scene), SUBSPACES, self._results)),
            effects=self._study.scene(scene).effects,
        )
        return order.model_dump(mode="json")
