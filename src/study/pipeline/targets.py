"""Targets (results requested on the command line): translation to paths of files, and checks.

A target is the number or name of a figure, the name of a table or of a rule, or a path.
"""

import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, choices, suggestion
from study.artifact import paths
from study.figures.kit.declaration import declarations
from study.paper.source import SUPPLEMENT, figure_numbers
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.scenes import scene_names
from study.pipeline.study import Study
from study.tables import declared

PREPRINT = "preprint:"


def figure_files(words: Sequence[str]) -> list[str]:
    """Return the default paths of the figures that ``words`` name; they are printed, too.

    A figure is given by its name, its number in the paper (``3``), in the supplement (``S3``) or in
    the preprint (``preprint:3``).
    """
    numbers, figures, found = figure_numbers(Path()), declarations(), []
    known = {number: name for name, number in numbers.items()}
    known |= {f"{PREPRINT}{f.number}": name for name, f in figures.items() if f.number}
    known |= {name: name for name in figures}
    if not words:
        raise ConfigurationError(f"figure: its number or name is missing{choices('', known)}")
    for word in words:
        if word not in known:
            raise ConfigurationError(f"figure {word}: there is none{choices(word, known)}")
        name = known[word]
        number = numbers.get(name, "")
        document = "supplement" if number.startswith(SUPPLEMENT) else "main"
        places = {f"{document}.pdf": number, "the preprint": figures[name].number}
        label = ", ".join(f"figure {n} of {place}" for place, n in places.items() if n)
        found.append(paths.FIGURE.at(paths.RESULTS, name=name))
        sys.stderr.write(f"reproduce: figure {name} ({label or 'in no document'}): {found[-1]}\n")
    return found


def files(target: str, folders: Folders) -> list[str]:
    """Return the paths in ``folders`` for a ``target``: the name of a figure or table, or a path.

    A path below ``results`` becomes a path in the results folder of this study. A name stands for
    figure and table if both have it.
    """
    kinds = ((paths.FIGURE, declarations()), (paths.TABLE, declared()))
    found = [place.at(folders.results, name=target) for place, names in kinds if target in names]
    found += [folders.documents[d] for d, file in Folders().documents.items() if target == file]
    inside, others = f"{paths.RESULTS}/", f"{paths.RESULTS}/studies/"
    if target.startswith(inside) and not target.startswith(others):
        found += [folders.results + target.removeprefix(paths.RESULTS)]
    return found or [target]


def check_targets(plan: Plan, targets: Iterable[str], rules: Sequence[Any]) -> None:
    """Raise ConfigurationError if none of Snakemake's ``rules`` makes one of ``targets``."""
    own = {rule.name for rule in rules if not rule.has_wildcards()}
    for target in targets:
        if target in own:
            continue
        if not any(rule.is_producer(target) for rule in rules):
            raise ConfigurationError(f"target '{target}': {_unknown(plan, target, own)}")
        for _, labels in paths.labels_in(target, plan.results):
            for label, allowed in _allowed(plan.study, labels):
                if label in labels and labels[label] not in allowed:
                    what = f"unknown {label} '{labels[label]}'{suggestion(labels[label], allowed)}"
                    raise ConfigurationError(f"target '{target}': {what}")


def _allowed(study: Study, labels: Mapping[str, str]) -> Iterator[tuple[str, Collection[str]]]:
    """Yield the labels of a path that are restricted, scenes first, with their allowed values."""
    yield "scene", {*scene_names(study.root), *study.scenes}
    yield "method", study.methods
    yield "basis", {spec.basis_id for spec in study.methods.values()}
    yield "mesh", study.every_mesh if "mesh" in labels else ()
    yield "group", study.scene(labels["scene"]).reduce if "group" in labels else ()


def _unknown(plan: Plan, target: str, rules: Collection[str]) -> str:
    """Return why ``target`` is unknown, for a message; suggestions may be names of ``rules``."""
    if Path(target).stem in {**declared(), **declarations()}.keys() - {*plan.figures, *plan.tables}:
        return "it is about scenes that this configuration does not have"
    known = plan.own_files if "/" in target else [*plan.figures, *plan.tables, *rules]
    return (
        f"nothing makes it{suggestion(target, known)}; targets are names of figures and tables, "
        f"and files, as {paths.FULL_ORDER.at(plan.results, scene='SCENE', run='train')}"
    )
