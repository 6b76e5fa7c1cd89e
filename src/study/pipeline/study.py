"""The study: scenes, methods and settings of one configuration, and the files it makes.

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

    The type of a section, with its default values, is declared in the module of the experiment
    that it configures. Defaults of keys without a section are declared here. The key ``study``
    names the folder of the results.
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
    recorded: bool = True  # whether tables also get stored results of config/extended.yaml
    study: str | None = None

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        for key, values in self:
            if isinstance(values, tuple) and len(set(values)) < len(values):
                raise ValueError(f"{key} = {list(values)}: an entry is given twice")
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
        # an own study runs no large scenes of the full study
        others = {*self._full.online.scenes} if self.is_alone else ()
        online = [name for name in settings.online.scenes if name not in others]
        self.online = {name: self.scene(name) for name in online}
        self.methods: dict[str, MethodSpec] = self.named_methods(settings.methods, "methods")

    def value(self, key: str) -> Any:
        """Value of a dotted ``key`` of the configuration; ConfigurationError if there is none."""
        return part_of(self.settings, key.split("."), key)

    @cached_property
    def every_method(self) -> dict[str, MethodSpec]:
        """Name of each method in config/methods.yaml -> its specification."""
        return load_methods(self.root / "config" / "methods.yaml")

    def scene(self, name: str) -> SceneConfig:
        """Return any scene by ``name``, in the study or not; its title is replaced by its name.

        Jobs then do not depend on titles, which tables and figures read from `titles`. Raises
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
        """Whether the settings are those of config/default.yaml."""
        return self.settings == self._full

    @property
    def is_own(self) -> bool:
        """Whether the study has no scene in common with config/default.yaml."""
        return not {*self.settings.scenes} & {*self._full.scenes}

    @property
    def is_alone(self) -> bool:
        """Whether an own study leaves out what concerns others' scenes: it decides no claims."""
        return self.is_own and not self.settings.claim_sets

    @property
    def experiments(self) -> list[tuple[str, str]]:
        """Pairs (scene, reduced constraint group), in configuration order."""
        return [(name, group) for name, scene in self.scenes.items() for group in scene.reduce]

    def mesh_of(self, scene: str) -> str:
        """Identifier of the mesh of ``scene``."""
        return self.scene(scene).mesh.identifier

    @property
    def meshes(self) -> dict[str, MeshConfig]:
        """Identifier of each mesh of the study's scenes -> configuration of the mesh."""
        return {scene.mesh.identifier: scene.mesh for scene in self.scenes.values()}

    def mesh(self, identifier: str) -> MeshConfig:
        """Configuration of mesh ``identifier``, which a scene of config/scenes or the study has."""
        return self.meshes.get(identifier) or self.every_mesh[identifier]

    @cached_property
    def every_mesh(self) -> dict[str, MeshConfig]:
        """Identifier -> configuration, for meshes of scenes in config/scenes and in the study."""
        names = scene_kit.scene_names(self.root)
        meshes = [
            scene_kit.read_scene(self.root, name, self.settings.coarsen).mesh for name in names
        ]
        return {mesh.identifier: mesh for mesh in meshes} | self.meshes

    def basis(self, identifier: str) -> BasisSpec:
        """Specification of the basis ``identifier``, from the first method that uses it."""
        method = next(m for m in self.methods.values() if m.basis_id == identifier)
        return BasisSpec(**{key: getattr(method, key) for key in BasisSpec.model_fields})

    def named_methods(self, names: Iterable[str], key: str) -> dict[str, MethodSpec]:
        """Map ``names``, which ``key`` lists, to methods; ConfigurationError for an unknown one."""
        known = self.every_method
        for name in names:
            if name not in known:
                raise ConfigurationError(f"{key}: unknown method '{name}'{choices(name, known)}")
        return {name: known[name] for name in names}


def part_of(value: Any, parts: Iterable[str], key: str) -> Any:
    """Attribute ``value.a.b`` for ``parts`` ("a", "b"); ConfigurationError if it is missing."""
    for part in parts:
        if not hasattr(value, part):
            known = choices(part, getattr(type(value), "model_fields", ()))
            raise ConfigurationError(f"the key '{key}': unknown{known}")
        value = getattr(value, part)
    return value


Labels = dict[str, str]


def labels_of(study: Study, place: paths.Place) -> list[Labels]:
    """Labels (scene, group ...) of every file of the study with the pattern of ``place``."""
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
    """Scenes of the study that are also in ``listed``, in the order of the study."""
    return [scene for scene in study.scenes if scene in {*listed}]


def _with_subspaces(study: Study) -> list[str]:
    """Scenes with models in position subspaces: configured ones, else all that allow them."""
    section = study.settings.subspace
    if not (section.bases and section.sizes):
        return []
    takes = [name for name, scene in study.scenes.items() if not scene_kit.not_taken(scene)]
    return _held(study, section.scenes or takes)


# Kinds of files with results of reduced models whose vertex positions lie in a subspace.
MODELS = (
    paths.SUBSPACES, paths.SUBSPACES_TRAIN, paths.SUBSPACES_HELDOUT, paths.SUBSPACES_SECONDS,
)  # fmt: skip
# Kind of file -> function that returns the scenes for which a study makes it; for files of several
# mesh sizes, a mapping scene -> factors that multiply the number of vertices along a mesh's side.
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
# Kind of file -> function that tells whether a study makes it for a scene and a reduced group.
GROUPS: dict[paths.Place, Callable[[Study, str, str], bool]] = {
    paths.REPETITIONS: lambda study, scene, group: any(
        scene in cell.scenes for cell in study.settings.repetitions.cells
    ),
    paths.NOISE: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.NOISE_RUNS: lambda study, scene, group: study.settings.noise.cases.get(scene) == group,
    paths.LADDER: lambda study, scene, group: scene in study.settings.ladder.scenes,
}
