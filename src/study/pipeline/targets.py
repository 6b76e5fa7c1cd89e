"""Targets on the command line: figures, tables and files, with help for misspelt ones."""

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

from pdrom.core.errors import ConfigurationError, StorageError
from study.artifact import paths
from study.artifact.paths import RESULTS, Place
from study.figures.kit.declaration import declarations
from study.pipeline.figure_command import WORD
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.scenes import read_scene, scene_names
from study.tables import declared

FIGURE = re.compile(rf"{WORD} (\w+)")


class Rule(Protocol):
    """Interface of a rule of Snakemake."""

    name: str

    def has_wildcards(self) -> bool:
        """Whether it makes many files by one pattern."""
        ...

    def is_producer(self, requested_output: str) -> bool:
        """Whether it makes a file of the name ``requested_output``."""
        ...


@dataclass(frozen=True)
class Names:
    """Names of figures and tables, which stand for their files."""

    figures: Collection[str]
    tables: Collection[str]

    def files(self, target: str, folders: Folders) -> list[str]:
        """Files in ``folders`` to make for a ``target``; itself unless it is a name.

        A file below ``results`` is the study's own, wherever that has its results; ``figure NAME``
        stands for that figure alone.
        """
        figure = FIGURE.fullmatch(target)
        if figure and figure[1] in self.figures:
            return [paths.FIGURE.at(folders.results, name=figure[1])]
        found = [paths.FIGURE.at(folders.results, name=target)] if target in self.figures else []
        if target in self.tables:
            found.append(paths.TABLE.at(folders.results, name=target))
        return found or [_own(target, folders)]


def _own(target: str, folders: Folders) -> str:
    for document, file in Folders().documents.items():
        if target == file:
            return folders.documents[document]
    inside = target.startswith(f"{RESULTS}/") and not target.startswith(f"{RESULTS}/studies/")
    return folders.results + target.removeprefix(RESULTS) if inside else target


@dataclass(frozen=True)
class Known:
    """Names and files of a study, to judge a target by.

    files : files of the study, for suggestions
    labels : what a label of a file may be (scene, group ...), by the labels before it
    """

    results: str
    files: Sequence[str]
    names: Names
    labels: dict[str, Callable[[dict[str, str]], Iterable[str]]]

    def check(self, targets: Iterable[str], rules: Sequence[Rule]) -> None:
        """ConfigurationError for the first of ``targets`` that no one of ``rules`` makes.

        It comes with a suggestion.
        """
        for target in targets:
            named = [rule for rule in rules if rule.name == target]
            if named and not named[0].has_wildcards():
                continue
            producers = [] if named else [r for r in rules if r.is_producer(target)]
            if not producers:
                raise ConfigurationError(self._unknown(target, rules))
            self._check_labels(target)

    def _check_labels(self, target: str) -> None:
        for place in paths.PLACES:
            labels = self._labels(place, target)
            for label, value in labels.items():
                allowed = list(self.labels[label](labels)) if label in self.labels else [value]
                if value not in allowed:
                    raise ConfigurationError(
                        f"target '{target}': unknown {label} '{value}'{_suggestion(value, allowed)}"
                    )

    def _labels(self, place: Place, target: str) -> dict[str, str]:
        """Labels of a target, none if it is no file of that kind."""
        try:
            labels = place.file(target).labels
        except StorageError:
            return {}
        return labels if place.at(self.results, **labels) == target else {}

    def _unknown(self, target: str, rules: Sequence[Rule]) -> str:
        own = {rule.name for rule in rules if not rule.has_wildcards()}
        names = [*self.names.figures, *self.names.tables, *own]
        scenes = self.labels["scene"]({})
        if target in scenes:
            example = paths.FULL_ORDER.at(self.results, scene=target, run="train")
            return f"target '{target}': a scene; name one of its files, as {example}"
        allowed = self.files if "/" in target else [*names, *scenes]
        return (
            f"target '{target}': nothing makes it{_suggestion(target, allowed)}; targets are names "
            f"of figures and tables, and files below {self.results}"
        )


def _suggestion(value: str, allowed: Iterable[str]) -> str:
    close = get_close_matches(value, sorted(set(allowed)), n=1)
    return f", did you mean '{close[0]}'?" if close else ""


def known(plan: Plan) -> Known:
    """Collect the names and files of a plan's study."""
    study, names = plan.study, Names(declarations(), declared())

    def mesh(scene: str) -> str:
        return read_scene(study.root, scene, study.settings.changes).mesh.identifier

    return Known(
        results=plan.results,
        files=[*plan.table_paths, *plan.figures, *plan.measured],
        names=names,
        labels={
            "scene": lambda labels: {*scene_names(study.root), *study.scenes},
            "group": lambda labels: study.scene(labels["scene"]).reduce,
            "method": lambda labels: study.methods,
            "basis": lambda labels: {spec.basis_id for spec in study.methods.values()},
            "mesh": lambda labels: {*map(mesh, scene_names(study.root)), *study.meshes},
        },
    )
