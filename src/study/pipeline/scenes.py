"""Scenes of config/scenes, changed as a study configures, and built to detect faults before a run.

A configuration can also derive variants of scenes: other meshes, weights and initial velocities.
"""

from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.yamlfile import ConfigModel, SceneName, named, read_yaml, validate
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects import EFFECTS
from pdrom.model.effects.base import Seed, effect_config
from pdrom.model.mesh.config import MeshFile
from pdrom.model.scene import Scene, SceneConfig
from study.experiments.kit.base import varied

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0, le=1e12, allow_inf_nan=False)]


class GivenOnce(ConfigModel):
    """Base class of settings that rejects lists with repeated entries."""

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        for key, values in self:
            if isinstance(values, tuple) and len(set(values)) < len(values):
                raise ValueError(f"{key} = {list(values)}: an entry is given twice")
        return self


class Coarsen(ConfigModel):
    """Factors for the mesh resolution (vertices along a side) and for all frame numbers."""

    resolution: Fraction = 1.0
    frames: Fraction = 1.0

    def of(self, scene: SceneConfig) -> SceneConfig:
        """Return ``scene`` with fewer vertices and frames."""
        return scene if self == Coarsen() else scene.coarsened(self.resolution, self.frames)


class Replicate(ConfigModel):
    """Changes that turn every scene into a new sample, on which rules fixed before are tested.

    frames_factor : stretches handles, pins and schedules in time; below 1 the motion is faster
    kick : speed of random initial velocities, m/s, along the axes of the held-out motions
    seed : seed of these velocities; it is also added to the seeds of the held-out motions
    """

    frames_factor: Annotated[float, Field(ge=0.1, le=10.0)] = 1.0
    kick: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0
    seed: Seed = 0

    def of(self, scene: SceneConfig) -> SceneConfig:
        """Return ``scene`` at another speed, with other initial velocities and held-out seeds."""
        if self == Replicate():
            return scene
        effects = [effect.with_frames_scaled(self.frames_factor) for effect in scene.effects]
        held_out = scene.held_out
        if self.kick:
            kick = {"effect": "kick", "speed": self.kick, "seed": self.seed}
            effects.append(effect_config(kick | {"axes": held_out.kick_axes}, len(effects)))
        held_out = held_out.model_copy(update={"seed": (held_out.seed + self.seed) % 2**63})
        return scene.model_copy(update={"effects": tuple(effects), "held_out": held_out})


Change = Coarsen | Replicate


def scene_names(root: Path) -> list[str]:
    """Names of all scenes with a file in config/scenes below ``root``, sorted."""
    return sorted(path.stem for path in (root / "config" / "scenes").glob("*.yaml"))


def require_scenes(root: Path, names: Iterable[str], key: str) -> None:
    """Raise ConfigurationError, which names ``key``, if a scene of ``names`` has no file."""
    known = scene_names(root)
    for name in names:
        if name not in known:
            raise ConfigurationError(f"{key}: unknown scene '{name}'{choices(name, known)}")


def load_bound_scene(root: Path, name: str, *changes: Change) -> Scene:
    """Return scene ``name`` of ``root`` with ``changes``, built on its mesh to detect every fault.

    Raises
    ------
    ConfigurationError
        The scene or its held-out variant is faulty; the message names file and fault.
    """
    return bind(root, read_scene(root, name, *changes), str(scene_file(root, name)))


def bind(root: Path, scene: SceneConfig, source: str) -> Scene:
    """Return ``scene``, built on its mesh; error messages begin with ``source``.

    Raises
    ------
    ConfigurationError
        The scene or its held-out variant is faulty; the message names the fault.
    """
    try:
        mesh = scene.mesh.build(root)
        bound = Scene.build(scene, mesh)
        # the held-out variant has equal constraint groups, so that only its other effects are built
        heldout = scene.heldout_variant()
        other = tuple(e for e in heldout.effects if not isinstance(e, GroupConfig))
        Scene.build(heldout.model_copy(update={"effects": other}), mesh)
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error
    bound.log_holds()
    bound.log_contacts()
    return bound


def read_scene(root: Path, name: str, *changes: Change) -> SceneConfig:
    """Return the configuration of scene ``name`` below ``root``, with ``changes``; builds no mesh.

    The path of a mesh file becomes relative to ``root``. Raises ConfigurationError for a fault.
    """
    require_scenes(root, [name], "scenes")
    path = scene_file(root, name)
    scene = validate(SceneConfig, named(read_yaml(path), name), str(path))
    if scene.name != name:
        raise ConfigurationError(f"{path}: name = '{scene.name}', required: '{name}', as the file")
    if isinstance(scene.mesh, MeshFile):
        folder = path.parent.relative_to(root).as_posix()
        scene = scene.model_copy(update={"mesh": scene.mesh.below(folder)})
    for change in changes:
        scene = change.of(scene)
    return scene


def scene_file(root: Path, name: str) -> Path:
    """Path of the file of scene ``name`` below ``root``."""
    return root / "config" / "scenes" / f"{name}.yaml"


def not_taken(scene: SceneConfig) -> list[str]:
    """Names of the effects of a scene that a position subspace cannot represent."""
    return [e.effect for e in scene.effects if not EFFECTS.load(e.effect).in_subspace]


class Variants(GivenOnce):
    """Section ``variants``: variants of every scene, by every combination of the lists.

    resolutions : factors for the number of vertices along each side of the mesh
    stiffness_ratios : factors for the weights of the reduced groups
    seeds : seeds of random initial velocities of at most `kick`, m/s
    """

    scenes: tuple[SceneName, ...] = ()
    resolutions: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0,)
    stiffness_ratios: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0,)
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1,)
    kick: Annotated[float, Field(gt=0.0, le=1e3)] = 0.5

    def of(self, read: Callable[[str], SceneConfig]) -> Iterator[SceneConfig]:
        """Yield every variant of the scenes; ``read`` returns the configuration of a scene by name.

        The variant's name contains its factors: ``strain_oop_m1p5_w0p01_s3`` has 1.5 times the
        vertices along a side, 0.01 times the weight, and random initial velocities with seed 3.
        """
        lists = (self.resolutions, self.stiffness_ratios, self.seeds)
        for scene, factor, ratio, seed in product(map(read, self.scenes), *lists):
            h, frames = scene.time_step, scene.frames
            stiff = varied(scene, h, ratio, h * frames, (frames, frames))
            kick = {"effect": "kick", "speed": self.kick, "seed": seed}
            yield stiff.model_copy(
                update={
                    "name": f"{scene.name}_m{_word(factor)}_w{_word(ratio)}_s{seed}",
                    "title": f"{scene.title}; mesh x {factor:g}, weight x {ratio:g}, start {seed}",
                    "mesh": scene.mesh.coarsened(factor),
                    "effects": (*stiff.effects, effect_config(kick, len(stiff.effects))),
                }
            )


def _word(number: float) -> str:
    """Number as part of a scene's name: ``p`` replaces the point, ``m`` the minus sign."""
    return f"{number:g}".replace(".", "p").replace("-", "m").replace("+", "")
