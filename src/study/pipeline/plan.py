"""The plan that the workflow rules ask: file names, parameters and code fingerprints."""

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
    """Say which scenes go without subspaces; ConfigurationError if one is asked for."""
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
    """ConfigurationError for a scene that the page with running models cannot hold."""
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
    """Size of the vertices, masses and bases of a scene in the file of its models."""
    settings, vertices = study.settings, study.vertices[name]
    section = settings.subspace if name in study.scenes else settings.online
    sizes = [k for k in settings.live.sizes if k in section.sizes and "pod" in section.bases]
    entries = [vertices * (k + 4) for k in sizes]  # four affine columns come with the modes
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


class Plan(Resolver):
    """Everything that depends on the configuration and is needed to write the rules."""

    def __init__(self, study: Study, folders: Folders = OF_STUDY) -> None:
        super().__init__(study, folders.results)
        self.root = study.root
        self.settings = study.settings
        self.documents = folders.documents
        self.experiments = experiments()
        self.tables = declared()

    def check(self) -> None:
        """Read every file of the configuration, so that a fault shows early."""
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
        self.fixed  # noqa: B018 : every figure and text is checked

    @property
    def measured(self) -> list[str]:
        """Every file that an experiment of the study writes."""
        places = [place for made in self.experiments.values() for place in made.writes.values()]
        return [
            place.at(self.results, **labels)
            for place in places
            for labels in labels_of(self.study, place)
        ]

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
