"""The study: which scenes, methods and settings one run of the pipeline covers."""

from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.names import SceneName
from pdrom.core.yamlfile import ConfigModel, validate
from pdrom.experiments.ladder_spec import LadderSpec, load_ladder
from pdrom.experiments.sensitivity import Sensitivity
from pdrom.experiments.subspace_ablation_spec import AblationSpec, load_ablation
from pdrom.model.dynamics.solvers import SOLVERS
from pdrom.model.effects.base import Seed
from pdrom.model.mesh.config import MeshConfig
from pdrom.model.scene import Scene, SceneConfig
from pdrom.pipeline.scenes import (
    Coarsen,
    load_bound_scene,
    load_scene,
    read_scene,
    scene_names,
)
from pdrom.reduction.local.guard_settings import GuardSettings
from pdrom.reduction.method import MethodSpec, load_methods
from pdrom.reduction.subspace.specs import HrpdSpec, InterpolationSpec

Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]
Count = Annotated[int, Field(ge=1, le=100_000)]


class _Model(ConfigModel):
    """Base of the sections of a study."""


class Sweep(_Model):
    """Basis sizes of the reconstruction error: all up to ``dense_to``, then every ``step``-th."""

    dense_to: Count = 20
    step: Count = 5

    def ranks(self, largest: int) -> list[int]:
        """Sizes 1 .. ``largest``, which is always among them."""
        dense = range(1, min(self.dense_to, largest) + 1)
        coarse = range(self.dense_to + self.step, largest + 1, self.step)
        return sorted({*dense, *coarse, largest} - {0})


class IterationSweep(_Model):
    """Full-order runs with K in ``counts``, against one whose every frame is converged.

    A frame is converged when one more iteration moves no vertex by more than ``tolerance`` times
    the extent; ``limit`` bounds the evaluations it may take. Every K runs with Anderson
    acceleration over ``anderson_window`` iterates, too (0: no such runs).
    """

    counts: tuple[Annotated[int, Field(ge=1, le=10_000)], ...] = (1, 2, 5, 10, 20, 40)
    anderson_window: Annotated[int, Field(ge=0, le=50)] = 5
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-8
    limit: Annotated[int, Field(ge=2)] = 4000


class Timing(_Model):
    """Protocol of the timing jobs: ``frames`` of each run, warm, interleaved, median.

    The slow implementations of the full-order run are timed over fewer frames, the interpreted one
    over fewer iterations, too. ``breakeven`` are the sizes r of the reduced local steps that are
    timed alone, in ``breakeven_repeats`` short repeats.
    """

    frames: Annotated[int, Field(ge=1)] = 15
    warmup: Annotated[int, Field(ge=0)] = 1
    repeats: Annotated[int, Field(ge=1)] = 5
    numpy_frames: Annotated[int, Field(ge=1)] = 4
    interpreted_frames: Annotated[int, Field(ge=1)] = 1
    interpreted_iterations: Annotated[int, Field(ge=1)] = 2
    breakeven: tuple[Rank, ...] = (5, 10, 20, 40, 60, 80, "full")
    breakeven_repeats: Annotated[int, Field(ge=5)] = 30
    frames: Count = 15
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Annotated[int, Field(ge=1, le=1000)] = 5
    numpy_frames: Count = 4
    interpreted_frames: Count = 1


class Subspace(_Model):
    """Position subspaces: scenes, kinds of basis, numbers of modes, tolerances of the sampling.

    At the ``interpolated_sizes`` the projections are interpolated, too: by ``hrpd`` (None leaves it
    out), and on the snapshot basis by every method of ``interpolations``.
    """

    scenes: tuple[SceneName, ...] = ()
    bases: tuple[Literal["pod", "skinning"], ...] = ("pod", "skinning")
    sizes: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = (10, 20, 40)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (3e-2, 1e-2, 1e-3)
    interpolated_sizes: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = ()
    hrpd: HrpdSpec | None = None
    interpolations: dict[str, InterpolationSpec] = Field(default_factory=dict)


class SizedBreakEven(_Model):
    """Reduced local steps timed alone on every mesh size: methods, sizes r, short repeats.

    Bases come from the first ``training_frames`` frames.
    """

    methods: tuple[str, ...] = ("deim-joint", "block-deim")
    sizes: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = (5, 10, 20, 40, 80)
    training_frames: Annotated[int, Field(ge=3, le=1000)] = 84
    repeats: Annotated[int, Field(ge=1)] = 20


class Scaling(_Model):
    """Cost against mesh size: factors on the vertices along a side for each scene.

    ``training_frames`` frames train ``method`` with r modes (only the local step reduced) and
    energy-conserving sampling to ``tolerance`` with k modes; ``frames`` are timed.
    """

    scenes: dict[str, tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...]] = Field(
        default_factory=dict
    )
    method: str = "block-deim"
    r: Annotated[int, Field(ge=1, le=1000)] = 10
    k: Annotated[int, Field(ge=1, le=1000)] = 20
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-2
    training_frames: Annotated[int, Field(ge=3, le=1000)] = 16
    frames: Annotated[int, Field(ge=1)] = 10
    warmup: Annotated[int, Field(ge=0)] = 1
    repeats: Annotated[int, Field(ge=1)] = 9
    breakeven: SizedBreakEven = SizedBreakEven()


class Stability(_Model):
    """Short runs over the time step and over the stiffness of the reduced groups.

    The bases and samplings are those of the scene's own setting.

    scenes, ranks : where, and basis sizes, as far as the study holds them; position subspaces run
        at their largest size
    time_steps : h in seconds, beside the scene's own
    stiffness_ratios : factors on the weights of the reduced groups, beside 1
    duration : seconds of simulated time, within ``min_frames`` and ``max_frames``
    wrong : relative error above which a run is finite but wrong
    left : multiple of the full-order run's largest extent above which a run has left the scene
    """

    scenes: tuple[str, ...] = ()
    ranks: tuple[Rank, ...] = ()
    time_steps: tuple[Annotated[float, Field(gt=0.0, le=10.0)], ...] = ()
    stiffness_ratios: tuple[Annotated[float, Field(gt=0.0, le=1e8)], ...] = ()
    duration: Annotated[float, Field(gt=0.0)] = 1.0
    min_frames: Annotated[int, Field(ge=2)] = 30
    max_frames: Annotated[int, Field(ge=2)] = 160
    wrong: Annotated[float, Field(gt=0.0)] = 0.1
    left: Annotated[float, Field(gt=1.0)] = 2.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.max_frames < self.min_frames:
            raise ValueError(
                f"max_frames = {self.max_frames}: at least min_frames = {self.min_frames}"
            )
        return self


class GuardCase(_Model):
    """A reduction on which the guard is tried, if the study holds scene, method and size."""

    scene: str
    method: str
    r: Rank


class Guard(GuardSettings):
    """Guard of the reruns, and ``cases`` that compare its actions, each timed ``repeats`` times."""

    cases: tuple[GuardCase, ...] = ()
    repeats: Annotated[int, Field(ge=1)] = 3

    @property
    def watching(self) -> GuardSettings:
        """The settings of the guard alone."""
        return GuardSettings.model_validate(
            self.model_dump(include=set(GuardSettings.model_fields))
        )


class HardCases(_Model):
    """Hard cases of the reductions (all that are not slow if empty), matrices a class."""

    cases: tuple[str, ...] = ()
    matrices: Annotated[int, Field(ge=1, le=10_000)] = 40


class Online(_Model):
    """Large scenes: their names, kinds of basis, numbers of modes, tolerances of the sampling."""

    scenes: tuple[str, ...] = ()
    bases: tuple[Literal["pod", "skinning"], ...] = ("pod",)
    sizes: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = (20,)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (1e-2,)


class Offline(_Model):
    """Sizes of the offline algorithms that are timed beside pyMOR's, on random matrices.

    POD of ``rows`` x ``snapshots``, interpolation with ``r`` modes of it, non-negative least
    squares with ``elements`` columns and ``equations`` rows to ``tolerance``.
    """

    rows: Annotated[int, Field(ge=10, le=10_000_000)] = 100_000
    snapshots: Annotated[int, Field(ge=2, le=5000)] = 200
    r: Annotated[int, Field(ge=1, le=5000)] = 200
    elements: Annotated[int, Field(ge=10, le=10_000_000)] = 100_000
    equations: Annotated[int, Field(ge=2, le=20_000)] = 1000
    tolerance: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-3
    seed: Seed = 0

    @model_validator(mode="after")
    def _modes_exist(self) -> Self:
        if self.r > min(self.snapshots, self.rows):
            raise ValueError(f"r = {self.r}: at most snapshots = {self.snapshots} and rows")
        return self


class StudySettings(_Model):
    """Content of config/default.yaml, possibly overridden by --configfile."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]
    ranks: Annotated[tuple[Rank, ...], Field(min_length=1)] = (6, 10, 20, "full")
    heldout_ranks: tuple[Rank, ...] = ("full",)
    sweep: Sweep = Sweep()
    solver: str = "cholespy"
    threads: Literal[1, 2] = 1
    blowup_extent: Annotated[float, Field(gt=1.0)] = 100.0
    blowup_extent: Annotated[float, Field(gt=1.0, le=1e12)] = 100.0
    coarsen: Coarsen = Coarsen()
    sensitivity: Sensitivity = Sensitivity()
    iterations: IterationSweep = IterationSweep()
    timing: Timing = Timing()
    budgets: tuple[Annotated[float, Field(gt=0.0)], ...] = (0.1, 1.0, 10.0)
    subspace: Subspace = Subspace()
    scaling: Scaling = Scaling()
    offline: Offline = Offline()
    stability: Stability = Stability()
    guard: Guard = Guard()
    hard_cases: HardCases = HardCases()
    online: Online = Online()

    @model_validator(mode="after")
    def _known(self) -> Self:
        for key in ("scenes", "methods", "ranks"):
            values = getattr(self, key)
            if len(set(values)) < len(values):
                raise ValueError(f"{key} = {list(values)}: an entry is given twice")
        if self.solver not in SOLVERS:
            raise ValueError(f"solver = '{self.solver}': allowed are {', '.join(SOLVERS)}")
        return self

    @model_validator(mode="after")
    def _heldout_ranks_are_run(self) -> Self:
        """Samples exist for the ranks; those of the full rank always do."""
        for rank in self.heldout_ranks:
            if rank not in (*self.ranks, "full"):
                allowed = ", ".join(map(str, self.ranks))
                raise ValueError(f"heldout_ranks = {rank}: allowed are ranks ({allowed}) and full")
        return self


class Study:
    """Settings with the scenes and methods that they name, all checked."""

    def __init__(self, settings: StudySettings, root: Path) -> None:
        self.settings = settings
        self.root = root
        self.bound: dict[str, Scene] = {
            name: load_bound_scene(root, name, settings.coarsen) for name in settings.scenes
        }
        self.scenes: dict[str, SceneConfig] = {n: s.config for n, s in self.bound.items()}
        self.online: dict[str, SceneConfig] = {
            name: load_scene(root, name, settings.coarsen) for name in settings.online.scenes
        }
        self._others: dict[str, SceneConfig] = {}
        self.methods: dict[str, MethodSpec] = _named_methods(root, settings.methods)

    @classmethod
    def load(
        cls,
        config: dict[str, Any],
        root: Path | str = ".",
        source: str = "configuration (config/default.yaml)",
    ) -> "Study":
        """Study of a (merged) configuration; ``source`` opens the messages about it.

        Raises
        ------
        ConfigurationError
            Naming file, key, value and what is allowed, before anything is computed.
        """
        settings = validate(StudySettings, config, source)
        return cls(settings, Path(root))

    @cached_property
    def ladder(self) -> LadderSpec:
        """Ladder of config/ladder.yaml."""
        return load_ladder(self.root / "config" / "ladder.yaml")

    @cached_property
    def ablation(self) -> AblationSpec:
        """Ablation of config/subspace_ablation.yaml."""
        return load_ablation(self.root / "config" / "subspace_ablation.yaml")

    def scene(self, name: str) -> SceneConfig:
        """Configuration of a scene; of one outside the study, too, if it has a file.

        Raises
        ------
        ConfigurationError
            If there is no such scene, or it is faulty.
        """
        for held in (self.scenes, self.online, self._others):
            if name in held:
                return held[name]
        self._others[name] = load_scene(self.root, name, self.settings.coarsen)
        return self._others[name]

    def only(self, scene: str) -> "Study":
        """The same study of one scene, which need not be held."""
        single = copy(self)
        single.scenes = {scene: self.scene(scene)}
        return single

    @property
    def experiments(self) -> list[tuple[str, str]]:
        """(scene, group) pairs whose group is reduced, in configuration order."""
        return [(name, group) for name, scene in self.scenes.items() for group in scene.reduce]

    def mesh_of(self, scene: str) -> str:
        """Identifier of a scene's mesh."""
        return self.scene(scene).mesh.identifier

    @property
    def meshes(self) -> dict[str, MeshConfig]:
        """Mesh configurations by identifier."""
        return {scene.mesh.identifier: scene.mesh for scene in self.scenes.values()}

    def mesh(self, identifier: str) -> MeshConfig:
        """Configuration of a mesh; of one outside the study, too, if a scene has it.

        Raises
        ------
        ConfigurationError
            If no scene of config/scenes has it.
        """
        if identifier in self.meshes:
            return self.meshes[identifier]
        for name in scene_names(self.root):
            mesh = read_scene(self.root, name, self.settings.coarsen).mesh
            if mesh.identifier == identifier:
                return mesh
        raise ConfigurationError(f"no scene in config/scenes has the mesh '{identifier}'")


def _named_methods(root: Path, names: tuple[str, ...]) -> dict[str, MethodSpec]:
    path = root / "config" / "methods.yaml"
    methods = load_methods(path)
    for name in names:
        if name not in methods:
            raise ConfigurationError(f"methods: unknown method '{name}'{choices(name, methods)}")
    return {name: methods[name] for name in names}
