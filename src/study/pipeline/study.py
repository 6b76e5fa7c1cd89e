"""Check the scenes, methods and settings of a configuration, and list the files that it makes.

Most kinds of files exist for every scene, constraint group and method of the study. Kinds of files
that exist only for some of these are listed at the end of the module.
"""

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, SceneName, read_yaml, validate
from pdrom.model.held_out import MOTIONS
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.scene import SceneConfig
from pdrom.reduction.method import BasisSpec, MethodSpec, load_methods
from study.artifact import paths
from study.experiments.alternatives.experiment import Alternatives
from study.experiments.error_budget import Budget
from study.experiments.frame_times import FrameTimes
from study.experiments.hard_cases.outcomes import HardCases
from study.experiments.iterations import IterationCounts
from study.experiments.kit.base import Rank
from study.experiments.references import Reference
from study.experiments.repetitions.experiment import RepetitionSection
from study.experiments.repetitions.ladder import LadderSection
from study.experiments.repetitions.noise import Noise
from study.experiments.sensitivity import Sensitivity
from study.experiments.stability import Stability
from study.experiments.subspaces import Live, Online, Subspace
from study.experiments.timing import Scaling, Timing
from study.pipeline import scenes as scene_kit
from study.pipeline.folders import DEFAULT


class StudySettings(ConfigModel):
    """Content of config/default.yaml, with changes by ``--configfile`` and ``--config``.

    The module of an experiment declares the type and the default values of its section. Defaults of
    keys without a section are declared here. The key ``study`` names the folder of the results.
    """

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]
    ranks: Annotated[tuple[Rank, ...], Field(min_length=1)] = (6, 10, 20, "full")
    coarsen: scene_kit.Coarsen = scene_kit.Coarsen()
    claim_sets: dict[str, tuple[SceneName, ...]] = Field(default_factory=dict)
    sensitivity: Sensitivity = Sensitivity()
    reference: Reference = Reference()
    error_budget: Budget = Budget()
    iterations: IterationCounts = IterationCounts()
    timing: Timing = Timing()
    frame_times: FrameTimes = FrameTimes()
    subspace: Subspace = Subspace()
    scaling: Scaling = Scaling()
    stability: Stability = Stability()
    noise: Noise = Noise()
    ladder: LadderSection = LadderSection()
    repetitions: RepetitionSection = RepetitionSection()
    hard_cases: HardCases = HardCases()
    online: Online = Online()
    live: Live = Live()
    alternatives: Alternatives = Alternatives()
    recorded: bool = True  # True: tables also get stored results of config/extended.yaml
    study: str | None = None

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        for key, values in self:
            if isinstance(values, tuple) and len(set(values)) < len(values):
                raise ValueError(f"{key} = {list(values)}: an entry occurs twice; remove one")
        return self


class Study:
    """A study: checked settings, with the scenes and methods that the settings name."""

    def __init__(
        self,
        config: dict[str, Any],
        root: Path,
        source: str = f"configuration ({DEFAULT})",
        configuration: str = DEFAULT,
    ) -> None:
        """Build all scenes of the merged configuration ``config`` from files below ``root``.

        Error messages begin with ``source``; the manuscript shows the name ``configuration``.
        Raises ConfigurationError (with file, key, value, allowed values) if a setting is wrong.
        """
        self.root, self.configuration = root, configuration
        self.settings = settings = validate(StudySettings, config, source)
        self.titles: dict[str, str] = {}  # name of a scene -> title, for tables and figures
        self.sizes: dict[str, tuple[int, int]] = {}  # scene -> numbers of vertices and elements
        self._known: dict[str, SceneConfig] = {}
        self.scenes = {name: self.scene(name) for name in settings.scenes}
        # a user's study (`is_alone`) runs no large scenes of the full study
        others = {*self._full.online.scenes} if self.is_alone else ()
        online = [name for name in settings.online.scenes if name not in others]
        self.online = {name: self.scene(name) for name in online}
        self.methods: dict[str, MethodSpec] = self.named_methods(settings.methods, "methods")

    def value(self, key: str) -> Any:
        """Return the value of a dotted ``key``; ConfigurationError if the key does not exist."""
        return part_of(self.settings, key.split("."), key)

    @cached_property
    def every_method(self) -> dict[str, MethodSpec]:
        """Name of each method in config/methods.yaml -> its specification."""
        return load_methods(self.root / "config" / "methods.yaml")

    def scene(self, name: str) -> SceneConfig:
        """Return any scene by ``name``, in the study or not, with its name in place of its title.

        So jobs do not depend on titles, which tables and figures read from `titles`. Raises
        ConfigurationError if the file of the scene is missing or faulty.
        """
        if name not in self._known:
            config, self.sizes[name] = scene_kit.checked_scene(
                self.root, name, self.settings.coarsen
            )
            self.titles[name] = config.title
            self._known[name] = config.model_copy(update={"title": name})
        return self._known[name]

    def only(self, scene: str) -> "Study":
        """Return a copy of the study with only ``scene``, which need not be in this study."""
        single = copy(self)
        single.scenes = {scene: self.scene(scene)}
        return single

    @cached_property
    def _full(self) -> StudySettings:
        path = self.root / DEFAULT
        return validate(StudySettings, read_yaml(path), str(path))

    @property
    def is_full(self) -> bool:
        """True if the settings are those of config/default.yaml."""
        return self.settings == self._full

    @property
    def is_own(self) -> bool:
        """True for a user's study, which has no scene of config/default.yaml."""
        return not {*self.settings.scenes} & {*self._full.scenes}

    @property
    def is_alone(self) -> bool:
        """True for a user's study without claims, which leaves out all about other scenes."""
        return self.is_own and not self.settings.claim_sets

    @property
    def experiments(self) -> list[tuple[str, str]]:
        """Pairs (scene, reduced constraint group), in configuration order."""
        return [(name, group) for name, scene in self.scenes.items() for group in scene.reduce]

    def mesh_of(self, scene: str) -> str:
        """Return the identifier of the mesh of ``scene``."""
        return self.scene(scene).mesh.identifier

    @property
    def meshes(self) -> dict[str, MeshConfig]:
        """Identifier of each mesh of the study's scenes -> configuration of the mesh."""
        return {scene.mesh.identifier: scene.mesh for scene in self.scenes.values()}

    def mesh(self, identifier: str) -> MeshConfig:
        """Return the configuration of a mesh, used by a scene of the study or of config/scenes."""
        return self.meshes.get(identifier) or self.every_mesh[identifier]

    @cached_property
    def every_mesh(self) -> dict[str, MeshConfig]:
        """Identifier -> configuration, for meshes of all scenes in config/scenes or the study."""
        names = scene_kit.scene_names(self.root)
        meshes = [
            scene_kit.read_scene(self.root, name, self.settings.coarsen).mesh for name in names
        ]
        return {mesh.identifier: mesh for mesh in meshes} | self.meshes

    def basis(self, identifier: str) -> BasisSpec:
        """Return the specification of a basis, taken from the first method that uses it."""
        method = next(m for m in self.methods.values() if m.basis_id == identifier)
        return BasisSpec(**{key: getattr(method, key) for key in BasisSpec.model_fields})

    def named_methods(self, names: Iterable[str], key: str) -> dict[str, MethodSpec]:
        """Map ``names``, which ``key`` lists, to methods; ConfigurationError if one is unknown."""
        known = self.every_method
        for name in names:
            if name not in known:
                raise ConfigurationError(f"{key}: unknown method '{name}'{choices(name, known)}")
        return {name: known[name] for name in names}


def part_of(value: Any, parts: Iterable[str], key: str) -> Any:
    """Return ``value.a.b`` for ``parts`` ("a", "b"); ConfigurationError if it does not exist."""
    for part in parts:
        if not hasattr(value, part):
            known = choices(part, getattr(type(value), "model_fields", ()))
            raise ConfigurationError(f"key '{key}': unknown{known}")
        value = getattr(value, part)
    return value


Labels = dict[str, str]


def labels_of(study: Study, place: paths.Place) -> list[Labels]:
    """Return the labels (scene, group ...) of every file of the kind ``place`` in the study."""
    names = place.labels
    scenes = SCENES[place](study) if place in SCENES else study.scenes
    known: Iterable[Labels] = [{}]
    if place == paths.HARD_CASES and study.is_alone:
        known = ()
    elif names == ["mesh"]:
        known = ({"mesh": mesh} for mesh in study.meshes)
    elif "group" in names:
        known = (
            {"scene": scene, "group": group, "method": name, "basis": method.basis_id}
            for scene, group in study.experiments
            if place not in GROUPS or GROUPS[place](study, scene, group)
            for name, method in study.methods.items()
        )
    elif "factor" in names and isinstance(scenes, Mapping):
        held = [scene for scene in scenes if scene in study.scenes or scene in study.online]
        known = ({"scene": name, "factor": f"{x:g}"} for name in held for x in scenes[name])
    elif "scene" in names:
        known = ({"scene": name, "run": run} for name in scenes for run in ("train", *MOTIONS))
    found = [{label: labels[label] for label in names} for labels in known]
    return list({tuple(labels.items()): labels for labels in found}.values())


def _held(study: Study, listed: Iterable[str]) -> list[str]:
    """Return the scenes of the study that are also in ``listed``, in the order of the study."""
    return [scene for scene in study.scenes if scene in {*listed}]


def _with_subspaces(study: Study) -> list[str]:
    """Return the scenes with position subspaces: the configured ones, or else all suitable ones."""
    section = study.settings.subspace
    if not (section.bases and section.sizes):
        return []
    takes = [name for name, scene in study.scenes.items() if not scene_kit.not_taken(scene)]
    return _held(study, section.scenes or takes)


# Kinds of files about reduced models whose vertex positions lie in a subspace.
MODELS = (
    paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
)  # fmt: skip
# Kind of file -> function that returns the scenes for which a study makes the file. If it exists
# for several mesh sizes, a mapping scene -> factors of the number of vertices along a mesh's side.
SCENES: dict[paths.Place, Callable[[Study], Iterable[str]]] = {
    **dict.fromkeys((*MODELS, paths.ERROR_BUDGET), _with_subspaces),
    paths.SCALING: lambda study: study.settings.scaling.scenes,
    paths.BREAK_EVEN_SIZED: lambda study: study.settings.scaling.scenes,
    paths.ALTERNATIVES: lambda study: study.settings.alternatives.scenes,
    paths.ALTERNATIVE_TIMES: lambda study: study.settings.alternatives.scenes,
    paths.ONLINE: lambda study: study.online,
    paths.ONLINE_MODELS: lambda study: study.online,
    # scenes listed in section `live` for which the study makes models in position subspaces
    paths.LIVE_MODEL: lambda study: [
        scene
        for scene in study.settings.live.scenes
        if scene in {*_with_subspaces(study), *study.online}
    ],
    paths.STABILITY: lambda study: _held(study, study.settings.stability.scenes),
}
# Kind of file -> function that returns whether a study makes the file for a scene and a group.
GROUPS: dict[paths.Place, Callable[[Study, str, str], bool]] = {
    paths.REPETITIONS: lambda study, scene, group: any(
        scene in cell.scenes for cell in study.settings.repetitions.cells
    ),
    paths.NOISE: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.NOISE_RUNS: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.LADDER: lambda study, scene, group: scene in study.settings.ladder.scenes,
}
