"""Every reduction in the hard cases."""

import logging
from pathlib import Path
from typing import Annotated

import pandas as pd
from pydantic import AfterValidator, Field

from pdrom.core.errors import choices
from pdrom.core.store import write_table
from pdrom.core.yamlfile import ConfigModel, shown
from pdrom.reduction.method import MethodSpec
from study.artifact.paths import HARD_CASES, File
from study.artifact.reads import ProjectFiles, Setting
from study.experiments.hard_cases.catalogue import CASES, MESHES, modules_of, reducible_cases
from study.experiments.hard_cases.outcomes import Expectation, rows, surprise
from study.experiments.kit.declaration import experiment

log = logging.getLogger(__name__)

COLUMNS = [
    "case", "method", "bounded_projections", "k", "r", "gain", "frames", "finite", "blowup_frame",
    "max_extent", "objective_rise", "outcome", "why",
]  # fmt: skip


def _known(case: str) -> str:
    if case not in reducible_cases():
        raise ValueError(f"unknown case {shown(case, 60)}{choices(case, reducible_cases())}")
    return case


class HardCases(ConfigModel):
    """Section ``hard_cases``: the cases, all that are not slow if empty.

    expected : by reduction, where it fails and why; one not named never fails
    """

    cases: tuple[Annotated[str, AfterValidator(_known)], ...] = ()
    expected: dict[str, Expectation] = Field(default_factory=dict)

    @property
    def modules(self) -> list[str]:
        """Places of the effects of the cases."""
        return modules_of(self.cases or reducible_cases())


@experiment(
    "Hard cases of every reduction",
    reads={
        "meshes": ProjectFiles(tuple(f"config/scenes/meshes/{name}" for name in MESHES)),
        "every_method": Setting("every_method"),
        "asked": Setting("hard_cases"),
    },
    writes={"cases": HARD_CASES},
)
def hard_cases(
    meshes: list[Path],
    every_method: dict[str, MethodSpec],
    asked: HardCases,
    cases: File,
) -> None:
    """Put every reduction through the cases; log what contradicts the expectations.

    The cases find the ``meshes`` themselves.
    """
    found = []
    for name in asked.cases or reducible_cases():
        for row in rows(CASES[name], every_method, asked.expected):
            found.append(row)
            contradiction = surprise(row["outcome"], name, asked.expected.get(row["method"]))
            if contradiction:
                log.warning("%s, %s: %s", name, row["method"], contradiction)
        log.info("%s: done", name)
    whole = dict.fromkeys(["k", "r", "frames", "blowup_frame"], "Int64")
    write_table(pd.DataFrame(found, columns=COLUMNS).astype(whole), cases.path)
