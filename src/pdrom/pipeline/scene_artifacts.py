"""What the rules of a single scene's artifacts need from a study."""

from collections.abc import Callable
from functools import cache
from typing import Any

from pdrom.pipeline.figures import holdings_of
from pdrom.pipeline.fingerprint import fingerprint
from pdrom.pipeline.holdings import paths_of
from pdrom.pipeline.study import Study
from pdrom.report.scenes.catalogue import SceneArtifact, module
from pdrom.report.scenes.job import SceneOrder

MAKER = "pdrom.report.scenes.job"


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
        """What an artifact depends on, beside the dates of its files."""
        return {
            "order": lambda wildcards: self._order(name, wildcards.scene),
            "code": fingerprint(MAKER, module(name)),
        }

    def _made_order(self, name: str, scene: str) -> dict[str, Any]:
        section = self._study.settings.sensitivity
        order = SceneOrder(
            name=name,
            scene=scene,
            folder=self._results,
            holdings=holdings_of(self._study.only(scene)),
            settings={
                "sensitivity.reference": section.reference,
                "sensitivity.threshold": section.threshold,
                "time_step": self._study.scene(scene).time_step,
            },
        )
        return order.model_dump(mode="json")
