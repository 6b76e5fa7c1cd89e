"""Plan of a study for the workflow rules: file names, parameters and code fingerprints."""

import logging
import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, SceneError
from pdrom.reduction.subspace.exported import DOUBLES, require_known
from study.article.build import article
from study.artifact.logs import planning_log
from study.artifact.paths import LIVE_MODEL
from study.experiments.kit.declaration import experiments
from study.experiments.live import LARGEST
from study.figures.kit.declaration import declarations
from study.live.page import live_page
from study.paper.build import paper, paper_inputs
from study.pipeline.contents import labels_of
from study.pipeline.folders import DEFAULT, Folders
from study.pipeline.paper import check_texts
from study.pipeline.resolve import Job, Resolver
from study.pipeline.scenes import not_taken, require_scenes
from study.pipeline.study import Study
from study.pipeline.values import scaled_methods
from study.tables import declared
from study.tables.claims.rules import load_claims

log = logging.getLogger(__name__)


def check_subspaces(study: Study) -> None:
    """Warn of scenes without position subspaces; ConfigurationError if the settings need them."""
    outside = {
        name: effects
        for name, config in {**study.scenes, **study.online}.items()
        if (effects := not_taken(config))
    }
    settings = study.settings
    asking = {
        "subspace.scenes": settings.subspace.scenes,
        "scaling.scenes": settings.scaling.scenes,
        "online.scenes": settings.online.scenes,
        "alternatives.scenes": settings.alternatives.scenes,
    }
    for key, scenes in asking.items():
        for name in scenes:
            if name in outside:
                raise ConfigurationError(
                    f"{key}: scene '{name}' has the effect '{outside[name][0]}', which no position "
                    "subspace takes"
                )
    for name, effects in outside.items():
        log.warning(
            "%s: no position subspaces, since none takes the effect '%s'",
            name,
            "', '".join(effects),
        )


def check_live(study: Study) -> None:
    """Raise ConfigurationError for a scene whose models the live page cannot represent or load."""
    for name in (labels["scene"] for labels in labels_of(study, LIVE_MODEL)):
        try:
            require_known(study.scene(name))
        except SceneError as error:
            raise ConfigurationError(f"live.scenes: {error}") from error
        size = _live_bytes(study, name)
        if size > LARGEST:
            raise ConfigurationError(
                f"live.scenes: scene '{name}' takes at least {size / 1e6:.1f} MB of models on "
                f"{study.vertices[name]} vertices, allowed are {LARGEST / 1e6:.1f}: choose fewer "
                f"modes (live.sizes = {list(study.settings.live.sizes)})"
            )


def _live_bytes(study: Study, name: str) -> float:
    """Least size in bytes of a scene's model file: its vertices, masses and bases in base 64."""
    settings, vertices = study.settings, study.vertices[name]
    section = settings.subspace if name in study.scenes else settings.online
    sizes = [k for k in settings.live.sizes if k in section.sizes and "pod" in section.bases]
    entries = [vertices * (k + 4) for k in sizes]  # modes and four affine columns
    bases = sum(count * (8 if count <= DOUBLES else 4) for count in entries)
    return (vertices * 32 + bases) * 4 / 3  # written in base 64


OF_STUDY = Folders()


def load_plan(
    config: dict[str, Any],
    root: Path,
    files: Sequence[str | Path] = (),
    folders: Folders = OF_STUDY,
    quiet: bool = False,
) -> "Plan":
    """Return the plan of ``config``, checked before any job starts.

    Parameters
    ----------
    files : configuration files, named in error messages
    quiet : whether warnings are dropped, see `study.artifact.logs.planning_log`

    Raises
    ------
    PdromError
        The configuration is faulty.
    """
    names = [os.path.relpath(path, root) for path in files] or [DEFAULT]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    others = ", ".join(sorted({*names} - {DEFAULT})) or "the command line"
    with planning_log(quiet):
        plan = Plan(Study.load(config, root, source, others), folders)
        plan.check()
    return plan


class Plan(Resolver):
    """Jobs, files and settings of a study that the workflow rules need."""

    def __init__(self, study: Study, folders: Folders = OF_STUDY) -> None:
        super().__init__(study, folders.results)
        self.root = study.root
        self.settings = study.settings
        self.documents = folders.documents
        self.experiments = experiments()
        self.tables = declared()

    def check(self) -> None:
        """Read every file that the configuration names, so that faults show before any job."""
        settings = self.settings
        load_claims(self.root / "config" / "claims.yaml", settings.claim_sets)
        named = {
            "ladder.scenes": settings.ladder.scenes,
            "live.scenes": settings.live.scenes,
            "subspace.scenes": settings.subspace.scenes,
            "scaling.scenes": settings.scaling.scenes,
            "stability.scenes": settings.stability.scenes,
        }
        for place, scenes in named.items():
            require_scenes(self.root, scenes, place)
        check_subspaces(self.study)
        check_live(self.study)
        check_texts(self.study)
        scaled_methods(self.study, {})
        for table in self.tables.values():
            try:
                self.job(table)
            except ConfigurationError as error:
                raise ConfigurationError(f"table {table.name} reads {error}") from error
        self.fixed  # noqa: B018 : resolving all jobs checks every figure and text

    @property
    def measured(self) -> list[str]:
        """Paths of all files that the study's experiments write."""
        places = [place for made in self.experiments.values() for place in made.writes.values()]
        return [
            place.at(self.results, **labels)
            for place in places
            for labels in labels_of(self.study, place)
        ]

    @cached_property
    def fixed(self) -> dict[str, list[Job]]:
        """Jobs of tables, figures, pages and manuscript, by the name of their log folder."""
        return {
            "tables": [self.job(table) for table in self.tables.values()],
            "figures": [self.job(figure) for figure in declarations().values()],
            "article": [self.job(live_page), self.job(article)],
            # the configuration determines where the manuscript's PDFs lie
            "paper": [self.job(paper_inputs), replace(self.job(paper), outputs=self.documents)],
        }

    @property
    def made(self) -> list[str]:
        """Paths of all files that the jobs of `fixed` write."""
        jobs = [job for jobs in self.fixed.values() for job in jobs]
        return [path for job in jobs for path in job.outputs.values()]

    @property
    def table_paths(self) -> list[str]:
        """Paths of the CSV files of all tables."""
        return [job.outputs["table"] for job in self.fixed["tables"]]

    @property
    def figures(self) -> list[str]:
        """Paths of the PDF files of all figures."""
        return [job.outputs["pdf"] for job in self.fixed["figures"]]
