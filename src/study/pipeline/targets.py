"""Targets on the command line: figures by number or name, tables and files; help if misspelt."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, StorageError, choices, suggestion
from study.artifact import paths
from study.artifact.paths import RESULTS, Place
from study.figures.kit.declaration import declarations
from study.paper.figure_numbers import SUPPLEMENT, figure_numbers
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.scenes import read_scene, scene_names

WORD = "figure"
PREPRINT = "preprint:"


def figure_arguments(arguments: Sequence[str]) -> list[str]:
    """Options and targets for Snakemake, from the ``arguments`` that follow the word ``figure``.

    A number counts in the paper, one with an S before it in the supplement, ``preprint:NUMBER`` in
    the preprint; every figure has its name, too. A target reads ``figure NAME`` (one word), which
    `Names` turns into its file.

    Raises
    ------
    ConfigurationError
        No figure was named, or there is no such one.
    """
    named = list(takewhile(lambda word: not word.startswith("-"), arguments))
    options = [word for word in arguments[len(named) :] if word != "--"]
    numbers = figure_numbers(Path())
    by_place = {n.manuscript: name for name, n in numbers.items() if n.manuscript}
    known = {number: by_place[number] for number in sorted(by_place, key=_order)}
    known |= {f"{PREPRINT}{n.preprint}": name for name, n in numbers.items() if n.preprint}
    known |= {name: name for name in numbers}
    if not named:
        raise ConfigurationError(f"{WORD}: its number or name is missing{choices('', known)}")
    for word in named:
        if word not in known:
            raise ConfigurationError(f"{WORD} {word}: there is none{choices(word, known)}")
    return [*options, "--", *(f"{WORD} {known[word]}" for word in named)]


def _order(number: str) -> tuple[bool, int]:
    """Key of a number for sorting: the paper's, then the supplement's."""
    return number.startswith(SUPPLEMENT), int(number.removeprefix(SUPPLEMENT))


def described(target: str) -> str:
    """A target with both numbers, if it is a figure that has one; else the target itself."""
    word, _, name = target.partition(" ")
    return f"{WORD} {figure_numbers(Path())[name].label(name)}" if word == WORD else target


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
        word, _, name = target.partition(" ")
        alone = word == WORD and name in self.figures
        name = name if alone else target
        found = [paths.FIGURE.at(folders.results, name=name)] if name in self.figures else []
        if name in self.tables and not alone:
            found.append(paths.TABLE.at(folders.results, name=name))
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

    def check(self, targets: Iterable[str], rules: Sequence[Any]) -> None:
        """ConfigurationError with a suggestion for a target that none of Snakemake's rules makes.

        ``targets`` are those of the command line.
        """
        own = {rule.name for rule in rules if not rule.has_wildcards()}
        for target in targets:
            if target in own:
                continue
            named = any(rule.name == target for rule in rules)
            if named or not any(rule.is_producer(target) for rule in rules):
                raise ConfigurationError(f"target '{target}': {self._unknown(target, own)}")
            for place in paths.PLACES:
                self._check_labels(place, target)

    def _check_labels(self, place: Place, target: str) -> None:
        try:
            labels = place.file(target).labels
        except StorageError:
            return  # no file of that kind
        if place.at(self.results, **labels) != target:
            return
        for label, value in labels.items():
            allowed = list(self.labels[label](labels)) if label in self.labels else [value]
            if value not in allowed:
                hint = suggestion(value, allowed)
                raise ConfigurationError(f"target '{target}': unknown {label} '{value}'{hint}")

    def _unknown(self, target: str, own: set[str]) -> str:
        scenes = self.labels["scene"]({})
        if target in scenes:
            example = paths.FULL_ORDER.at(self.results, scene=target, run="train")
            return f"a scene; name one of its files, as {example}"
        names = [*self.names.figures, *self.names.tables, *own, *scenes]
        return (
            f"nothing makes it{suggestion(target, self.files if '/' in target else names)}; "
            f"targets are names of figures and tables, and files below {self.results}"
        )


def known(plan: Plan) -> Known:
    """Collect the names and files of a plan's study."""
    study = plan.study

    def mesh(scene: str) -> str:
        return read_scene(study.root, scene, study.settings.changes).mesh.identifier

    return Known(
        results=plan.results,
        files=[*plan.table_paths, *plan.figures, *plan.measured],
        names=Names(declarations(), plan.tables),
        labels={
            "scene": lambda labels: {*scene_names(study.root), *study.scenes},
            "group": lambda labels: study.scene(labels["scene"]).reduce,
            "method": lambda labels: study.methods,
            "basis": lambda labels: {spec.basis_id for spec in study.methods.values()},
            "mesh": lambda labels: {*map(mesh, scene_names(study.root)), *study.meshes},
        },
    )
