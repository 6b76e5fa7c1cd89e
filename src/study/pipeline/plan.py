"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

import os
import sys
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pdrom.core.errors import ConfigurationError, PdromError
from study.artifact.artifact import Artifact
from study.artifact.logs import planning_log
from study.artifact.paths import TABLE
from study.artifact.reads import Labels
from study.experiments.kit.declaration import experiments
from study.live.page import live_page
from study.pipeline.contents import paths_of
from study.pipeline.figures import FigureJob, figure_jobs
from study.pipeline.folders import Folders
from study.pipeline.full import FULL_STUDY
from study.pipeline.paper import PaperJobs, check_texts, paper_jobs
from study.pipeline.resolve import Job, Resolver
from study.pipeline.scenes import require_scenes
from study.pipeline.study import Study, StudySettings
from study.pipeline.subspace_scenes import check_live, check_subspaces
from study.pipeline.values import scaled_methods
from study.tables import declared
from study.tables.claims import load_claims

OF_STUDY = Folders()


def load_plan(
    config: dict[str, Any],
    root: Path,
    files: Sequence[str | Path] = (),
    folders: Folders = OF_STUDY,
    quiet: bool = False,
) -> "Plan":
    """Plan of ``config``; a faulty one ends the process with one line, before any job.

    Parameters
    ----------
    files : where the configuration came from, for the messages
    quiet : whether warnings are dropped, see `study.artifact.logs.planning_log`
    """
    names = [os.path.relpath(path, root) for path in files] or [FULL_STUDY]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    try:
        others = ", ".join(sorted({*names} - {FULL_STUDY})) or "the command line"
        with planning_log(quiet):
            plan = Plan(Study.load(config, root, source), folders, others)
            plan.check()
        return plan
    except PdromError as error:
        sys.exit(f"pdrom: {error}")


class Plan:
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(
        self, study: Study, folders: Folders = OF_STUDY, configuration: str = FULL_STUDY
    ) -> None:
        self.study = study
        self.root = study.root
        self.results = folders.results
        self.documents = folders.documents
        self.configuration = configuration
        self.experiments = experiments()
        self.tables = declared()
        self._resolver = Resolver(study, folders.results)

    @property
    def settings(self) -> StudySettings:
        """Checked settings of the study."""
        return self.study.settings

    def job(self, artifact: Artifact, labels: Labels = MappingProxyType({})) -> Job:
        """Job of an experiment or table, ``artifact``, with these ``labels``."""
        return self._resolver.job(artifact, labels)

    def check(self) -> None:
        """Read every file of the configuration, so that a fault shows early."""
        folder = self.root / "config"
        load_claims(folder / "claims.yaml", self.settings.claim_sets)
        self._check_scenes(folder)
        check_subspaces(self.study)
        check_live(self.study)
        self.figure_jobs  # noqa: B018 : every figure and text is checked
        check_texts(self.study)
        scaled_methods(self.study, {})
        self._check_tables()

    def _check_scenes(self, folder: Path) -> None:
        settings = self.settings
        named = {
            "ladder.scenes": settings.ladder.scenes,
            "live.scenes": settings.live.scenes,
            "subspace.scenes": settings.subspace.scenes,
            "scaling.scenes": tuple(settings.scaling.scenes),
            "stability.scenes": settings.stability.scenes,
        }
        for place, scenes in named.items():
            require_scenes(self.root, scenes, place)

    def _check_tables(self) -> None:
        for table in self.tables.values():
            try:
                self.job(table)
            except ConfigurationError as error:
                raise ConfigurationError(f"table {table.name} reads {error}") from error

    # Tables, figures and manuscript ---------------------------------------------------------

    @property
    def table_paths(self) -> list[str]:
        """File of every table."""
        return [TABLE.at(self.results, name=name) for name in self.tables]

    @property
    def measured(self) -> list[str]:
        """Every file that an experiment of the study writes."""
        places = [place for made in self.experiments.values() for place in made.writes.values()]
        return [path for place in places for path in paths_of(self.study, place, self.results)]

    @cached_property
    def figure_jobs(self) -> dict[str, FigureJob]:
        """Every figure by name."""
        return figure_jobs(self.study, self.results)

    @property
    def figures(self) -> list[str]:
        """PDF of every figure."""
        return [figure.pdf for figure in self.figure_jobs.values()]

    @property
    def fixed(self) -> dict[str, list[Job]]:
        """Jobs of tables, figures, page and manuscript by the folder of their logs, in order."""
        return {
            "tables": [self.job(table) for table in self.tables.values()],
            "figures": [figure.job for figure in self.figure_jobs.values()],
            "article": [self.page, self.paper.article],
            "paper": [self.paper.inputs, self.paper.manuscript],
        }

    @property
    def page(self) -> Job:
        """The page on which models run."""
        return self.job(live_page)

    @cached_property
    def paper(self) -> PaperJobs:
        """The manuscript."""
        return paper_jobs(
            self.study, self.figure_jobs, self.configuration, self.results, self.documents
        )
