"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pdrom.core.errors import ConfigurationError
from study.article.build import article
from study.artifact.artifact import Artifact
from study.artifact.logs import planning_log
from study.artifact.reads import Labels
from study.experiments.kit.declaration import experiments
from study.figures.kit.declaration import declarations
from study.live.page import live_page
from study.paper.build import paper, paper_inputs
from study.pipeline.contents import paths_of
from study.pipeline.folders import DEFAULT, Folders
from study.pipeline.paper import check_texts
from study.pipeline.resolve import Job, Resolver
from study.pipeline.scenes import require_scenes
from study.pipeline.study import Study, StudySettings
from study.pipeline.subspace_scenes import check_live, check_subspaces
from study.pipeline.values import scaled_methods
from study.tables import declared
from study.tables.claims.rules import load_claims

OF_STUDY = Folders()


def load_plan(
    config: dict[str, Any],
    root: Path,
    files: Sequence[str | Path] = (),
    folders: Folders = OF_STUDY,
    quiet: bool = False,
) -> "Plan":
    """Plan of ``config``, checked before any job.

    Parameters
    ----------
    files : where the configuration came from, for the messages
    quiet : whether warnings are dropped, see `study.artifact.logs.planning_log`

    Raises
    ------
    PdromError
        It is faulty.
    """
    names = [os.path.relpath(path, root) for path in files] or [DEFAULT]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    others = ", ".join(sorted({*names} - {DEFAULT})) or "the command line"
    with planning_log(quiet):
        plan = Plan(Study.load(config, root, source, others), folders)
        plan.check()
    return plan


class Plan:
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(self, study: Study, folders: Folders = OF_STUDY) -> None:
        self.study = study
        self.root = study.root
        self.results = folders.results
        self.documents = folders.documents
        self.experiments = experiments()
        self.tables = declared()
        self._resolver = Resolver(study, folders.results)

    @property
    def settings(self) -> StudySettings:
        """Checked settings of the study."""
        return self.study.settings

    def job(self, artifact: Artifact, labels: Labels = MappingProxyType({})) -> Job:
        """Job of an ``artifact`` with these ``labels``."""
        return self._resolver.job(artifact, labels)

    def check(self) -> None:
        """Read every file of the configuration, so that a fault shows early."""
        folder = self.root / "config"
        load_claims(folder / "claims.yaml", self.settings.claim_sets)
        self._check_scenes(folder)
        check_subspaces(self.study)
        check_live(self.study)
        check_texts(self.study)
        scaled_methods(self.study, {})
        self._check_tables()
        self.fixed  # noqa: B018 : every figure and text is checked

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

    @property
    def measured(self) -> list[str]:
        """Every file that an experiment of the study writes."""
        places = [place for made in self.experiments.values() for place in made.writes.values()]
        return [path for place in places for path in paths_of(self.study, place, self.results)]

    @cached_property
    def fixed(self) -> dict[str, list[Job]]:
        """Jobs of tables, figures, pages and manuscript by the folder of their logs, in order."""
        return {
            "tables": [self.job(table) for table in self.tables.values()],
            "figures": [self.job(figure) for figure in declarations().values()],
            "article": [self.job(live_page), self.job(article)],
            # the manuscript lies where the configuration has it
            "paper": [self.job(paper_inputs), replace(self.job(paper), outputs=self.documents)],
        }

    @property
    def made(self) -> list[str]:
        """Every file of `fixed`."""
        jobs = [job for jobs in self.fixed.values() for job in jobs]
        return [path for job in jobs for path in job.outputs.values()]

    @property
    def table_paths(self) -> list[str]:
        """File of every table."""
        return [job.outputs["table"] for job in self.fixed["tables"]]

    @property
    def figures(self) -> list[str]:
        """PDF of every figure."""
        return [job.outputs["pdf"] for job in self.fixed["figures"]]
