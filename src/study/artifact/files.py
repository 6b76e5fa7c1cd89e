"""Artifacts whose function looks after its own files: many of them, or in places that may vary."""

from collections.abc import Mapping
from typing import Any

from study.artifact.artifact import Artifact


class Files(Artifact):
    """An artifact whose function gets as ``outputs`` the paths that it writes, by name."""

    def perform(
        self, settings: Mapping[str, Any], inputs: Mapping[str, Any], outputs: Mapping[str, str]
    ) -> None:
        """Write all of them."""
        self.function(**self.read(settings, inputs), outputs=outputs)
