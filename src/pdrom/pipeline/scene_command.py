"""``./reproduce scene NAME [ARTIFACT ...] [OPTIONS]``: what is made of one scene, as targets."""

from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.paths import RESULTS
from pdrom.pipeline.scenes import require_scenes, scene_names
from pdrom.report.scenes.catalogue import ARTIFACTS, default_files


def scene_arguments(arguments: Sequence[str], root: Path = Path()) -> list[str]:
    """Options and targets for Snakemake, from what follows the word ``scene``.

    Without names of artifacts it is what is made by default.

    Raises
    ------
    ConfigurationError
        No name, or no such scene or artifact.
    """
    words = list(takewhile(lambda word: not word.startswith("-"), arguments))
    options = [word for word in arguments[len(words) :] if word != "--"]
    if not words:
        known = ", ".join(scene_names(root))
        raise ConfigurationError(f"scene: the name of a scene is missing (known: {known})")
    name, *asked = words
    require_scenes(root, [name], "scene")
    for artifact in asked:
        if artifact not in ARTIFACTS:
            known = choices(artifact, ARTIFACTS)
            raise ConfigurationError(f"scene {name}: nothing is called '{artifact}'{known}")
    made = [file for artifact in asked for file in ARTIFACTS[artifact].files(RESULTS, name)]
    return [*options, "--", *(made or default_files(RESULTS, name))]
