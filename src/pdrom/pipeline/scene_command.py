"""``./reproduce scene NAME [KIND ...]`` and ``./reproduce viewer``: jobs of scenes, then pictures.

The jobs are Snakemake's; what they made is drawn by ``pdrom draw`` and ``pdrom view``.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import SUBSPACES, TIMINGS
from pdrom.pipeline.commandline import CommandLine, merged, options
from pdrom.pipeline.contents import paths_of
from pdrom.pipeline.folders import DEFAULT, folders
from pdrom.pipeline.scenes import require_scenes, scene_names
from pdrom.pipeline.study import Study
from pdrom.report.scenes.kinds import KINDS, RUNS, require_kinds
from pdrom.report.scenes.results import SceneResults

VIEWED = 4  # scenes of the viewer where the configuration names none


@dataclass(frozen=True)
class SceneOrder:
    """Jobs and pictures of a command about scenes.

    arguments : options and targets for ``./reproduce``
    drawing : arguments of ``pdrom``, which draws what was made
    draws : whether there is something to draw: jobs are not only planned or listed
    """

    arguments: list[str]
    drawing: list[str]
    draws: bool


def scene_order(arguments: Sequence[str], root: Path = Path()) -> SceneOrder:
    """Jobs and pictures that ``arguments``, ``scene`` or ``viewer`` and words after it, ask for.

    Raises
    ------
    ConfigurationError
        No name, no such scene or kind, or a fault of the configuration.
    """
    word, *rest = arguments
    asked = list(takewhile(lambda argument: not argument.startswith("-"), rest))
    others = [argument for argument in rest[len(asked) :] if argument != "--"]
    command = CommandLine.parse(others)
    named = options(command.configfiles, command.settings)
    results = folders(command.configfiles, command.settings).results
    if word == "viewer":
        if asked:
            raise ConfigurationError(f"viewer {asked[0]}: it takes no names (key viewer.scenes)")
        scenes = viewer_scenes(root, command.configfiles, command.settings)
        places = {*RUNS, TIMINGS}
        drawing = ["view", *scenes, "--out", f"{results}/viewer/index.html", *named]
    else:
        if not asked:
            known = ", ".join(scene_names(root))
            raise ConfigurationError(f"scene: the name of a scene is missing (known: {known})")
        scenes = asked[:1]
        require_scenes(root, scenes, "scene")
        kinds = require_kinds(asked[1:], f"scene {scenes[0]}")
        places = {place for kind in kinds for place in KINDS[kind].reads}
        drawing = ["draw", *scenes, "--as", *kinds, "--out", f"{results}/scenes", *named]
    study = study_of(root, scenes, command.configfiles, command.settings)
    only = [study.only(scene) for scene in scenes]
    files = sorted(
        {file for one in only for place in places for file in paths_of(one, place, results)}
    )
    return SceneOrder([*others, "--", *files], drawing, not command.looks_only)


def viewer_scenes(root: Path, configfiles: Iterable[str], settings: Iterable[str]) -> list[str]:
    """Scenes of the viewer: those that the configuration names, else its first ones."""
    whole = merged(root / DEFAULT, configfiles, settings)
    scenes = (whole.get("viewer") or {}).get("scenes") or whole["scenes"][:VIEWED]
    require_scenes(root, scenes, "viewer.scenes")
    return list(scenes)


def study_of(
    root: Path, scenes: Sequence[str], configfiles: Iterable[str], settings: Iterable[str]
) -> Study:
    """Study of some ``scenes``, which need not be named by its configuration.

    Raises
    ------
    ConfigurationError
        There is no such scene, or the configuration is faulty.
    """
    require_scenes(root, scenes, "scene")
    whole = merged(root / DEFAULT, configfiles, settings)
    return Study.load({**whole, "scenes": list(scenes)}, root)


def scene_results(study: Study, scene: str, results: str) -> SceneResults:
    """Results of a ``scene`` of ``study`` below the folder ``results``."""
    section = study.settings.sensitivity
    return SceneResults(
        folder=results,
        scene=study.scene(scene).model_copy(update={"title": study.titles[scene]}),
        methods={name: method.title for name, method in study.methods.items()},
        reference=section.reference,
        threshold=section.threshold,
        ranks=study.settings.viewer.ranks,
        subspaces=bool(paths_of(study.only(scene), SUBSPACES, results)),
    )
