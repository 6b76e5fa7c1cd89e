"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

import os
import sys
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from pdrom.core.errors import PdromError
from pdrom.core.logs import planning_log
from pdrom.core.paths import RESULTS
from pdrom.experiments.hard_cases.expectations import load_expectations
from pdrom.pipeline.figures import FigureJob, figure_jobs
from pdrom.pipeline.fingerprint import fingerprint
from pdrom.pipeline.full import FULL_STUDY
from pdrom.pipeline.jobs import Jobs, digest
from pdrom.pipeline.paper import PaperJob, check_texts, paper_job
from pdrom.pipeline.scenes import require_scenes
from pdrom.pipeline.study import Study, StudySettings
from pdrom.pipeline.subspace_scenes import check_subspaces
from pdrom.pipeline.tables import Tables
from pdrom.reduction.method import MethodSpec
from pdrom.tables.claims import load_claims


def load_plan(
    config: dict[str, Any],
    root: Path,
    files: Sequence[str | Path] = (),
    results: str = RESULTS,
    quiet: bool = False,
) -> "Plan":
    """Plan of a configuration; a faulty one ends the process with one line, before any job.

    Parameters
    ----------
    files : where the configuration came from, for the messages
    results : folder of its results
    quiet : whether warnings are dropped, see `pdrom.core.logs.planning_log`
    """
    names = [os.path.relpath(path, root) for path in files] or [FULL_STUDY]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    try:
        others = ", ".join(sorted({*names} - {FULL_STUDY})) or "the command line"
        with planning_log(quiet):
            plan = Plan(Study.load(config, root, source), results, others)
            plan.check()
        return plan
    except PdromError as error:
        sys.exit(f"pdrom: {error}")


class Plan:
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(
        self, study: Study, results: str = RESULTS, configuration: str = FULL_STUDY
    ) -> None:
        self.study = study
        self.root = study.root
        self.results = results
        self.configuration = configuration
        self.jobs = Jobs(study, results)
        self.tables = Tables(study, results)

    @property
    def settings(self) -> StudySettings:
        """Checked settings of the study."""
        return self.study.settings

    def check(self) -> None:
        """Read every file of the configuration, so that a fault shows early."""
        folder = self.root / "config"
        load_claims(folder / "claims.yaml")
        load_expectations(folder / "hard_cases.yaml")
        self._check_scenes(folder)
        check_subspaces(self.study)
        self.figure_jobs  # noqa: B018 : every figure and text is checked
        check_texts(self.study)
        self.jobs.check()

    def _check_scenes(self, folder: Path) -> None:
        settings = self.settings
        named = {
            f"{folder / 'ladder.yaml'}: scenes": self.study.ladder.scenes,
            f"{folder / 'subspace_ablation.yaml'}: scenes": self.study.ablation.scenes,
            "subspace.scenes": settings.subspace.scenes,
            "scaling.scenes": tuple(settings.scaling.scenes),
            "stability.scenes": settings.stability.scenes,
            "guard.cases": tuple(case.scene for case in settings.guard.cases),
        }
        for place, scenes in named.items():
            require_scenes(self.root, scenes, place)

    # Parameters -----------------------------------------------------------------------------

    def digest(self, *paths: str) -> str:
        """See `pdrom.pipeline.jobs.digest`."""
        return digest(self.root, *paths)

    def method_spec(self, method: str) -> dict[str, Any]:
        """Plain specification of a method."""
        return self._method(method).model_dump(mode="json")

    def _method(self, method: str) -> MethodSpec:
        return self.study.methods[method]

    # Figures and manuscript -----------------------------------------------------------------

    @cached_property
    def figure_jobs(self) -> dict[str, FigureJob]:
        """Every figure by name."""
        return figure_jobs(self.study, self.results)

    @property
    def figures(self) -> list[str]:
        """PDF of every figure."""
        return [job.pdf for job in self.figure_jobs.values()]

    @cached_property
    def paper(self) -> PaperJob:
        """The manuscript."""
        captions = {name: job.tex for name, job in self.figure_jobs.items()}
        return paper_job(self.study, captions, self.configuration, self.results)

    # Resources ------------------------------------------------------------------------------

    def resources(self, kind: str) -> dict[str, Any]:
        """Memory (MB) and minutes that a job without a scene asks a cluster for."""
        request = self.study.costs.request(kind)
        return {"mem_mb": request.memory_mb, "runtime": request.minutes}

    def seconds(self, rule: str, labels: Mapping[str, str]) -> float:
        """Expected processor time of a job, by the measured jobs of the full study."""
        cost = self.study.costs.cost
        if rule in {experiment.name for experiment in self.jobs.experiments}:
            return cost(rule, self.jobs.size(labels), labels.get("method")).seconds
        others = {"table": rule.endswith("_table"), "paper": rule.startswith("paper")}
        return cost(next((kind for kind, held in others.items() if held), "figure")).seconds

    # Code -----------------------------------------------------------------------------------

    def code(self, *modules: str) -> str:
        """Fingerprint of the code that a job runs; a change of it reruns the job."""
        return fingerprint(*modules)
