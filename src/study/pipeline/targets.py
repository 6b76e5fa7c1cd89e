"""Find the files of targets, which are the results that a command line requests.

A target is the number or name of a figure, the name of a table or of a rule, or a path.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError, choices, suggestion
from study.artifact import paths
from study.figures.kit.declaration import declarations
from study.paper.source import figure_numbers
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
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
        fault = "no figure has this number or name"
        raise ConfigurationError(f"figure '{word}': {fault}{choices(word, known)}")
    return paths.FIGURE.at(paths.RESULTS, name=known[word])


def files(target: str, folders: Folders) -> list[str]:
    """Return the paths in ``folders`` for a ``target``: the name of a figure or table, or a path.

    A path below ``results`` becomes a path in the results folder of this study. If a figure and a
    table have the same name, the name stands for both.
    """
    kinds = ((paths.FIGURE, declarations()), (paths.TABLE, declared()))
    found = [place.at(folders.results, name=target) for place, names in kinds if target in names]
    found += [folders.documents[d] for d, file in Folders().documents.items() if target == file]
    inside, others = f"{paths.RESULTS}/", f"{paths.RESULTS}/studies/"
    if target.startswith(inside) and not target.startswith(others):
        found += [folders.results + target.removeprefix(paths.RESULTS)]
    return found or [target]


def check_targets(plan: Plan, targets: Iterable[str], rules: Iterable[Any]) -> None:
    """Raise ConfigurationError for a target that none of Snakemake's ``rules`` makes."""
    for target in targets:
        if not any(target == rule.name or rule.is_producer(target) for rule in rules):
            known = [*plan.own_files, *plan.figures, *plan.tables, *(rule.name for rule in rules)]
            fault = f"target '{target}': no file, figure or table of this study has this name"
            near = suggestion(target, known) or " (./reproduce --help explains targets)"
            raise ConfigurationError(f"{fault}{near}")
