"""What a job's settings are made of: one value for each name that an experiment may ask for.

A name that is not listed here is a key of the configuration.
"""

from collections.abc import Callable, Mapping
from typing import Any

from pdrom.pipeline.study import Study

Labels = Mapping[str, str]


def provide(study: Study, name: str, labels: Labels) -> Any:
    """Value of a field of a job's settings, for the job with these ``labels``."""
    if name in PROVIDERS:
        return PROVIDERS[name](study, labels)
    return getattr(study.settings, name)


def _scene(study: Study, labels: Labels) -> Any:
    return study.scene(labels["scene"])


PROVIDERS: dict[str, Callable[[Study, Labels], Any]] = {
    "scene": _scene,
}
