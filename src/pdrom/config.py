"""The study: which scenes, methods and settings one run of the pipeline covers."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from pdrom.effects.base import Seed
from pdrom.errors import ConfigurationError, PdromError, choices
from pdrom.fom.solvers import SOLVERS
from pdrom.method import MethodSpec, load_methods
from pdrom.scene import SCENE_NAME, Scene, SceneConfig
from pdrom.yamlfile import ConfigModel, read_yaml, validate

Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]
Fraction = Annotated[float, Field(gt=0.0, le=1.0)]
SceneName = Annotated[str, Field(pattern=SCENE_NAME)]
Count = Annotated[int, Field(ge=1, le=100_000)]


class _Model(ConfigModel):
    """Base of the sections of a study."""


class Coarsen(_Model):
    """Factors on mesh resolution (vertices along a side) and on every frame number."""

    resolution: Fraction = 1.0
    frames: Fraction = 1.0


class Sweep(_Model):
    """Basis sizes of the reconstruction error: all up to ``dense_to``, then every ``step``-th."""

    dense_to: Count = 20
    step: Count = 5

    def ranks(self, largest: int) -> list[int]:
        """Sizes 1 .. ``largest``, which is always among them."""
        dense = range(1, min(self.dense_to, largest) + 1)
        coarse = range(self.dense_to + self.step, largest + 1, self.step)
        return sorted({*dense, *coarse, largest} - {0})


class Sensitivity(_Model):
    """Perturbed full-order runs (EXPERIMENTS section 5); sizes relative to the extent."""

    perturbations: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (1e-12, 1e-10, 1e-8)
    reference: Annotated[float, Field(gt=0.0, lt=1.0)] = 1e-10
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1, 2, 3)
    threshold: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1e-3

    @model_validator(mode="after")
    def _reference_is_run(self) -> Self:
        if self.reference not in self.perturbations:
            raise ValueError(f"reference = {self.reference}: must be one of the perturbations")
        return self


class Timing(_Model):
    """Protocol of the timing jobs: ``frames`` of each run, warm, interleaved, median.

    The slow implementations of the full-order run are timed over fewer frames.
    """

    frames: Count = 15
    warmup: Annotated[int, Field(ge=0, le=1000)] = 1
    repeats: Annotated[int, Field(ge=1, le=1000)] = 5
    numpy_frames: Count = 4
    interpreted_frames: Count = 1


class Subspace(_Model):
    """Position subspaces: scenes, kinds of basis, numbers of modes, tolerances of the sampling."""

    scenes: tuple[SceneName, ...] = ()
    bases: tuple[Literal["pod", "skinning"], ...] = ("pod", "skinning")
    sizes: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = (10, 20, 40)
    tolerances: tuple[Annotated[float, Field(gt=0.0, lt=1.0)], ...] = (3e-2, 1e-2, 1e-3)


class StudySettings(_Model):
    """Content of config/default.yaml, possibly overridden by --configfile."""

    scenes: Annotated[tuple[SceneName, ...], Field(min_length=1)]
    methods: Annotated[tuple[str, ...], Field(min_length=1)]
    ranks: Annotated[tuple[Rank, ...], Field(min_length=1)] = (6, 10, 20, "full")
    heldout_ranks: tuple[Rank, ...] = ("full",)
    sweep: Sweep = Sweep()
    solver: str = "cholespy"
    blowup_extent: Annotated[float, Field(gt=1.0, le=1e12)] = 100.0
    coarsen: Coarsen = Coarsen()
    sensitivity: Sensitivity = Sensitivity()
    timing: Timing = Timing()
    subspace: Subspace = Subspace()

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

    @property
    def experiments(self) -> list[tuple[str, str]]:
        """(scene, group) pairs whose group is reduced, in configuration order."""
        return [(name, group) for name, scene in self.scenes.items() for group in scene.reduce]

    def mesh_of(self, scene: str) -> str:
        """Identifier of a scene's mesh."""
        return self.scenes[scene].mesh.identifier

    @property
    def meshes(self) -> dict[str, Any]:
        """Mesh configurations by identifier."""
        return {scene.mesh.identifier: scene.mesh for scene in self.scenes.values()}


def load_scene(root: Path, name: str, coarsen: Coarsen | None = None) -> SceneConfig:
    """Configuration of scene ``name``, see `load_bound_scene`."""
    return load_bound_scene(root, name, coarsen).config


def load_bound_scene(root: Path, name: str, coarsen: Coarsen | None = None) -> Scene:
    """Scene ``name`` from config/scenes, coarsened, and built to find every fault early.

    Raises
    ------
    ConfigurationError
        Naming the file and the fault; also for faults of the held-out variant.
    """
    path = root / "config" / "scenes" / f"{name}.yaml"
    require_scenes(root, [name], "scenes")
    scene = validate(SceneConfig, read_yaml(path), str(path))
    if scene.name != name:
        raise ConfigurationError(f"{path}: name = '{scene.name}', required: '{name}', as the file")
    if coarsen is not None and coarsen != Coarsen():
        scene = scene.coarsened(coarsen.resolution, coarsen.frames)
    try:
        mesh = scene.mesh.build(root)
        Scene.build(scene.held_out_variant(), mesh)
        return Scene.build(scene, mesh)
    except PdromError as error:
        raise ConfigurationError(f"{path}: {error}") from error


def require_scenes(root: Path, names: Iterable[str], key: str) -> None:
    """ConfigurationError, which ``key`` opens, for a name without a file in config/scenes."""
    known = sorted(path.stem for path in (root / "config" / "scenes").glob("*.yaml"))
    for name in names:
        if name not in known:
            raise ConfigurationError(f"{key}: unknown scene '{name}'{choices(name, known)}")


def _named_methods(root: Path, names: tuple[str, ...]) -> dict[str, MethodSpec]:
    path = root / "config" / "methods.yaml"
    methods = load_methods(path)
    for name in names:
        if name not in methods:
            raise ConfigurationError(f"methods: unknown method '{name}'{choices(name, methods)}")
    return {name: methods[name] for name in names}
