"""Targets (results requested on the command line): translation to paths of files, and checks.

A target is the number or name of a figure, the name of a table or of a rule, or a path.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, choices, suggestion
from study.artifact import paths
from study.figures.kit.declaration import declarations
from study.paper.source import figure_numbers
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.scenes import scene_names
from study.pipeline.study import Study
from study.tables import declared

PREPRINT = "preprint:"


def figure_file(word: str) -> str:
    """Return the default path of a figure: by its name, or its number in a document.

    The number is that in the paper (``3``), the supplement (``S3``) or preprint (``preprint:3``).
    """
    figures = declarations()
    known = {number: name for name, number in figure_numbers(Path()).items()}
    known |= {f"{PREPRINT}{f.number}": name for name, f in figures.items() if f.number}
    known |= {name: name for name in figures}
    if word not in known:
        raise ConfigurationError(f"figure '{word}': there is none{choices(word, known)}")
    return paths.FIGURE.at(paths.RESULTS, name=known[word])


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
    for target in {*targets} - own:
        if not any(rule.is_producer(target) for rule in rules):
            known = [*plan.own_files, *plan.figures, *plan.tables, *own]
            raise ConfigurationError(
                f"target '{target}': nothing makes it in this study{suggestion(target, known)}; "
                "targets are names of figures and tables, and files, as "
                f"{paths.FULL_ORDER.at(plan.results, scene='SCENE', run='train')}"
            )
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
