"""What the rules of the variants and of the tolerances need."""

import os
import sys
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from pdrom.core.errors import PdromError
from pdrom.pipeline.fingerprint import fingerprint
from pdrom.pipeline.plan import Plan
from pdrom.verification.settings import PATH, load_settings
from pdrom.verification.variants import available


class VariantJobs:
    """Rules of the variants of a study: names, outputs, parameters.

    Parameters
    ----------
    configuration : configuration files of the study
    """

    def __init__(self, plan: Plan, configuration: Sequence[str | Path]) -> None:
        self._plan = plan
        self._configuration = [os.path.relpath(path, plan.root) for path in configuration]
        self._folder = f"{plan.results}/verification"

    def __iter__(self) -> Iterator[str]:
        return iter(self._variants)

    @property
    def tolerances(self) -> str:
        """The table of tolerances."""
        return f"{self._folder}/tolerances.csv"

    @property
    def derivation(self) -> dict[str, str]:
        """What the tolerances depend on beside the tables."""
        return {
            "content": self._plan.digest(str(PATH)),
            "code": fingerprint("pdrom.verification.derive"),
        }

    def title(self, variant: str) -> str:
        """A variant in words."""
        return variant.replace("_", " ")

    def outputs(self, variant: str) -> dict[str, str]:
        """Tables of a variant, by name."""
        return {name: f"{self._folder}/{variant}/{name}.csv" for name in self._plan.tables}

    def log(self, name: str) -> str:
        """Log file of a job."""
        return f"{self._plan.results}/logs/verification/{name}.log"

    def params(self, variant: str) -> dict[str, Any]:
        """What a variant's job is told."""
        return {
            "settings": self._variants[variant],
            "configuration": self._configuration,
            "folder": f"{self._folder}/{variant}/project",
            "code": fingerprint("pdrom.verification.variants"),
        }

    @cached_property
    def _variants(self) -> dict[str, dict[str, str]]:
        try:
            return available(load_settings(self._plan.root).variants, os.environ)
        except PdromError as error:
            sys.exit(f"pdrom: {error}")
