"""Plan a study: find the jobs of every artifact (function declared to make files).

The workflow turns each `Job` (files, settings, fingerprint of its code) into a job of Snakemake.
"""

import logging
import os
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pdrom.core.errors import ConfigurationError, SceneError, choices
from pdrom.core.provenance import ORIGIN, provenance
from pdrom.reduction.subspace.exported import require_known
from study.article.build import article
from study.artifact.artifact import Artifact, make, modules_in, recorded
from study.artifact.logs import warnings_to
from study.artifact.paths import FIGURE, FIGURE_PICTURE, LIVE_MODEL, PAPER_INPUT, TABLE, Place
from study.artifact.reads import Labels, Paths, listed
from study.artifact.text import require_typeset
from study.experiments.kit.base import experiments
from study.figures.kit.declaration import Declaration, declarations
from study.live.page import live_page
from study.paper.build import paper, paper_inputs
from study.paper.textables import TEX_TABLES
from study.paper.textables import reads as tables_of
from study.pipeline.fingerprint import digest, fingerprint
from study.pipeline.folders import DEFAULT, Folders
from study.pipeline.scenes import not_taken, require_scenes
from study.pipeline.study import Study, labels_of, part_of
from study.pipeline.values import DERIVED, scaled_methods
from study.tables import declared
from study.tables.claims.rules import load_claims
from study.tables.kit.declaration import Table

log = logging.getLogger(__name__)


def check_subspaces(study: Study) -> None:
    """Warn of scenes that position subspaces cannot represent; refuse them in their sections."""
    outside = {
        name: effects
        for name, config in {**study.scenes, **study.online}.items()
        if (effects := not_taken(config))
    }
    for key in ("subspace", "scaling", "online", "alternatives"):
        for name in getattr(study.settings, key).scenes:
            if name in outside:
                raise ConfigurationError(
                    f"{key}.scenes: scene '{name}' has the effect '{outside[name][0]}', which "
                    "position subspaces cannot represent"
                )
    for name, effects in outside.items():
        words = "', '".join(effects)
        log.warning("%s: no position subspaces: they cannot represent the effect '%s'", name, words)


def check_live(study: Study) -> None:
    """Raise ConfigurationError if the live web page cannot run the models of a scene."""
    for name in (labels["scene"] for labels in labels_of(study, LIVE_MODEL)):
        try:
            require_known(study.scene(name))
        except SceneError as error:
            raise ConfigurationError(f"live.scenes: {error}") from error


def check_texts(study: Study) -> None:
    """Raise ConfigurationError if a method or claim has characters that cannot be typeset."""
    folder = study.root / "config"
    for name, method in study.methods.items():
        require_typeset(method.title, f"{folder / 'methods.yaml'}: {name}.title")
    for name, claim in load_claims(folder / "claims.yaml").items():
        require_typeset(claim.model_dump(mode="json"), f"{folder / 'claims.yaml'}: {name}")
    require_typeset(study.settings.ladder.model_dump(mode="json"), "ladder")


@dataclass(frozen=True)
class Job:
    """A job: an artifact (function that makes files), with all arguments of its function.

    labels : scene, group ... in the output paths, such as {"scene": "bar_release"}
    inputs, outputs : parameter of the function -> paths of files
    settings : parameter of the function -> JSON data
    content : checksum of hand-edited inputs, because dates of files do not show if they changed
    code : fingerprint (hash) of the code that the job runs
    """

    artifact: Artifact
    labels: dict[str, str]
    inputs: dict[str, Paths]
    outputs: dict[str, str]
    settings: dict[str, Any]
    content: str
    code: str

    def make(self, outputs: Mapping[str, str]) -> None:
        """Run the job in this process; write its files to ``outputs`` (parameter -> path)."""
        own = ("settings", "labels", "code", "content", "inputs")
        make(self.artifact.address, outputs=outputs, **{name: getattr(self, name) for name in own})

    def origin(self, path: str, digests: Iterable[str]) -> dict[str, str]:
        """Return the origin to be stored with the output ``path`` if `results` have ``digests``."""
        job = (self.artifact, self.settings, self.labels, self.code, self.content)
        with recorded(*job, digests):
            said = provenance(path)
        return {key: said[key] for key in ORIGIN}

    @cached_property
    def results(self) -> list[str]:
        """Paths of the job's inputs that other jobs make."""
        return self.artifact.paths(self.inputs, edited=False)

    @property
    def files(self) -> list[str]:
        """All input paths of the job."""
        return [path for paths in self.inputs.values() for path in listed(paths)]


OF_STUDY = Folders()
# Table -> settings; if all of them are empty in a user's study, the table would have no row.
NEEDED = {"speedups": ("subspace_cases", "projection_cases", "large_scenes")}


def load_plan(
    config: dict[str, Any],
    files: Sequence[str | Path] = (),
    folders: Folders = OF_STUDY,
    quiet: bool = False,
) -> "Plan":
    """Return the checked plan of ``config``; PdromError that names ``files`` if it is faulty."""
    names = [os.path.relpath(path) for path in files] or [DEFAULT]
    source = f"configuration ({', '.join(sorted(set(names)))})"
    others = ", ".join(sorted({*names} - {DEFAULT})) or "the command line"
    with warnings_to(None if quiet else sys.stderr):
        plan = Plan(Study(config, Path(), source, others), folders)
        plan.check()
    return plan


class Plan:
    """Jobs and files of a study; also finds paths and settings for the inputs of artifacts."""

    def __init__(self, study: Study, folders: Folders = OF_STUDY) -> None:
        self.study, self.folders, self.results = study, folders, folders.results
        self._jobs: dict[tuple[str, ...], Job] = {}
        self.experiments = experiments()

    @cached_property
    def tables(self) -> dict[str, Table]:
        """Tables of the study by name."""
        return {name: table for name, table in declared().items() if self.holds(table)}

    @cached_property
    def figures(self) -> dict[str, Declaration]:
        """Figures of the study by name."""
        return {name: figure for name, figure in declarations().items() if self.holds(figure)}

    def check(self) -> None:
        """Check the configuration and the files that it names, before any job starts."""
        settings = self.study.settings
        load_claims(self.study.root / "config" / "claims.yaml", settings.claim_sets)
        for key in ("ladder", "live", "subspace", "scaling", "stability"):
            require_scenes(self.study.root, getattr(settings, key).scenes, f"{key}.scenes")
        check_subspaces(self.study)
        check_live(self.study)
        check_texts(self.study)
        scaled_methods(self.study, {})
        self.fixed  # noqa: B018 : computing this property checks every figure and text

    @cached_property
    def fixed(self) -> dict[str, list[Job]]:
        """Subfolder of logs -> jobs for the study as a whole (tables, figures, manuscript ...)."""
        return {
            "tables": [self.job(table) for table in self.tables.values()],
            "figures": [self.job(figure) for figure in self.figures.values()],
            "article": [self.job(page) for page in (live_page, article) if self.holds(page)],
            # the paths of the manuscript's PDFs depend on the configuration
            "paper": [
                self.job(paper_inputs),
                replace(self.job(paper), outputs=self.folders.documents),
            ],
        }

    def holds(self, artifact: Artifact) -> bool:
        """Return whether the study has data for ``artifact`` (table, figure, page).

        A user's study (`Study.is_alone`) lacks data for tables about claims, and for artifacts that
        first read a kind of file that it does not have. All other studies have all data.
        """
        if not self.study.is_alone:
            return True
        first = next(iter(artifact.files.values()))
        needed = NEEDED.get(artifact.name)
        return (
            "rules" not in artifact.reads
            and bool(first.paths(self, {"figure": artifact.name}))
            and (needed is None or any(self.value(key, {}) for key in needed))
        )

    @property
    def absent(self) -> str:
        """Message that counts the outputs that a user's study leaves out; empty for others."""
        kinds = Counter(name.partition("_")[0] for name in self.left_out)
        told = f"left out: {kinds['picture']} figures, {kinds['table']} tables, the claims and the "
        return f"{told}hard cases, which need scenes of {DEFAULT}" if self.study.is_alone else ""

    @cached_property
    def left_out(self) -> set[str]:
        """Outputs of manuscript and article that need tables or figures that the study lacks."""
        tables = declared().keys() - self.tables.keys()
        tex = {name for name in TEX_TABLES if tables & {*tables_of(name)}}
        pictures = {f"picture_{name}" for name in declarations().keys() - self.figures.keys()}
        return {*tex, *pictures, *(f"table_{name}" for name in tables), *({"claims"} & tables)}

    @property
    def made(self) -> list[str]:
        """Paths of all tables, figures and documents (files that the jobs in `fixed` write)."""
        jobs = [job for jobs in self.fixed.values() for job in jobs]
        return [path for job in jobs for path in job.outputs.values()]

    @cached_property
    def own_files(self) -> set[str]:
        """Paths of all files that a complete run of the study makes."""
        places = [place for made in self.experiments.values() for place in made.writes.values()]
        return {*self.made, *(path for place in places for path in self.files(place, {}))}

    def job(self, artifact: Artifact, labels: Labels = MappingProxyType({})) -> Job:
        """Return the job of ``artifact`` for the scene, group ... in ``labels``."""
        own = {name: labels[name] for name in artifact.labels}
        key = (artifact.rule, *own.values())
        if key not in self._jobs:
            known = {**own, "figure": artifact.name}  # the name selects the figure's scenes
            settings = artifact.settings(self, known)
            inputs = {k: read.paths(self, known) for k, read in artifact.files.items()}
            content = artifact.paths(inputs, edited=True)
            self._jobs[key] = Job(
                artifact,
                own,
                inputs,
                {
                    name: place.at(self.results, **own)
                    for name, place in artifact.writes.items()
                    if artifact not in (paper_inputs, article) or name not in self.left_out
                },
                artifact.plain(settings),
                digest(self.study.root, *content) if content else "",
                fingerprint(artifact.function.__module__, *sorted(set(modules_in(settings)))),
            )
        return self._jobs[key]

    # Declared inputs (`Sources`) find their paths and values by the following methods.

    def file(self, place: Place, labels: Labels) -> str:
        """Return the path of the file of the kind ``place`` for scene, group ... in ``labels``.

        If ``labels`` lack mesh or basis, use the scene's mesh and the method's basis.
        """
        found = dict(labels)
        if "mesh" in place.labels and "mesh" not in found:
            found["mesh"] = self.study.mesh_of(found["scene"])
        if "basis" in place.labels and "basis" not in found:
            found["basis"] = self.study.methods[found["method"]].basis_id
        return place.at(self.results, **{name: found[name] for name in place.labels})

    def files(self, place: Place, labels: Labels) -> list[str]:
        """Return the study's paths of the kind ``place`` whose labels agree with ``labels``."""
        study = self.study.only(labels["scene"]) if "scene" in labels else self.study
        if place in (TABLE, FIGURE, FIGURE_PICTURE):
            names: Iterable[str] = self.tables if place == TABLE else self.figures
            return [place.at(self.results, name=name) for name in names]
        if place == PAPER_INPUT:
            return list(self.job(paper_inputs).outputs.values())
        return [
            place.at(self.results, **held)
            for held in labels_of(study, place)
            if all(held[name] == labels[name] for name in held.keys() & labels.keys())
        ]

    def table(self, name: str) -> Paths:
        """Return the path of a table, [] if the study lacks it; ConfigurationError if unknown."""
        if name not in declared():
            raise ConfigurationError(f"'{name}': unknown{choices(name, declared())}")
        return TABLE.at(self.results, name=name) if self.holds(declared()[name]) else []

    def value(self, key: str, labels: Labels) -> Any:
        """Return setting ``key`` ("a.b"), configured or computed (`DERIVED`; "made": rules)."""
        head, *parts = key.split(".")
        if head == "made":
            pages = [live_page.name] if self.holds(live_page) else []
            found: list[Artifact] = [*self.tables.values(), *self.figures.values()]
            return [*(made.rule for made in found), *pages]
        if head not in DERIVED:
            return self.study.value(key)
        return part_of(DERIVED[head](self.study, labels), parts, key)
