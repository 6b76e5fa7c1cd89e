"""Outcomes that are expected of reductions in the hard cases."""

from typing import Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from pdrom.core.errors import choices
from pdrom.core.yamlfile import ConfigModel, shown
from study.experiments.hard_cases.catalogue import CASES

HOLDS, NOTHING, NOT_TAKEN = "holds", "nothing to reduce", "not taken"
FAILURES = ("refused", "singular", "blow-up", "distorted", "objective rises", "momentum changes")


def _known(case: str) -> str:
    if case not in CASES:
        raise ValueError(f"unknown case {shown(case, 60)}{choices(case, CASES)}")
    return case


Cases = tuple[Annotated[str, AfterValidator(_known)], ...]


class Expectation(ConfigModel):
    """Cases in which a reduction fails, and why.

    fails : cases in which it must fail
    may_fail : cases in which round-off decides whether it fails
    """

    why: Annotated[str, Field(min_length=20)]
    fails: Cases = ()
    may_fail: Cases = ()

    @model_validator(mode="after")
    def _listed_once(self) -> Self:
        listed = [*self.fails, *self.may_fail]
        for case in listed:
            if listed.count(case) > 1:
                raise ValueError(f"case '{case}' is listed twice")
        return self


def surprise(outcome: str, case: str, expected: Expectation | None) -> str:
    """Contradiction of an ``outcome`` of ``case`` to what is ``expected``, "" if there is none."""
    failed = outcome in FAILURES
    must = expected is not None and case in expected.fails
    may = expected is not None and case in expected.may_fail
    if failed and not (must or may):
        return f"{outcome}, but no entry expects a failure"
    if must and not failed:
        return f"{outcome}, but the entry expects a failure"
    return ""
