"""Outcomes that are expected of reductions in the hard cases (config/hard_cases.yaml)."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import ConfigModel, read_yaml, validate
from study.experiments.hard_cases.catalogue import CASES

HOLDS, NOTHING, NOT_TAKEN = "holds", "nothing to reduce", "not taken"
FAILURES = ("refused", "singular", "blow-up", "distorted", "objective rises", "momentum changes")


class Expectation(ConfigModel):
    """Cases in which a reduction fails, and why.

    fails : cases in which it must fail
    may_fail : cases in which round-off decides whether it fails
    """

    why: Annotated[str, Field(min_length=20)]
    fails: tuple[str, ...] = ()
    may_fail: tuple[str, ...] = ()


def load_expectations(path: Path) -> dict[str, Expectation]:
    """Content of ``path``, config/hard_cases.yaml, by reduction; one not named never fails.

    Raises
    ------
    ConfigurationError
        An unknown key or case, or a case in both lists.
    """
    content = read_yaml(path)
    if not isinstance(content, dict):
        raise ConfigurationError(f"{path}: a mapping of reductions is required")
    expected = {n: validate(Expectation, e, f"{path}: '{n}'") for n, e in content.items()}
    for name, entry in expected.items():
        listed = [*entry.fails, *entry.may_fail]
        unknown = sorted(set(listed) - set(CASES))
        if unknown:
            raise ConfigurationError(f"{path}: '{name}': unknown case '{unknown[0]}'")
        if len(set(listed)) < len(listed):
            raise ConfigurationError(f"{path}: '{name}': a case is listed twice")
    return expected


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
