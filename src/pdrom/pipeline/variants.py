"""Scenes that a configuration makes out of others: finer meshes, other weights, other starts."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Annotated, Self

from pydantic import Field, model_validator

from pdrom.core.names import SceneName
from pdrom.core.yamlfile import ConfigModel
from pdrom.experiments.kit.variation import varied
from pdrom.model.effects.base import Seed
from pdrom.model.effects.entries import effect_config
from pdrom.model.scene import SceneConfig

Positive = Annotated[float, Field(gt=0.0, le=1e12, allow_inf_nan=False)]


class Variants(ConfigModel):
    """Section ``variants``: every combination of the lists, of every scene.

    resolutions : factors of the vertices along each side of the mesh
    stiffness_ratios : factors of the weights of the reduced groups
    seeds : random starts by `kick`, the largest speed of a vertex in m/s
    """

    scenes: tuple[SceneName, ...] = ()
    resolutions: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0,)
    stiffness_ratios: Annotated[tuple[Positive, ...], Field(min_length=1)] = (1.0,)
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = (1,)
    kick: Annotated[float, Field(gt=0.0, le=1e3)] = 0.5

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        for key in ("scenes", "resolutions", "stiffness_ratios", "seeds"):
            values = getattr(self, key)
            if len(set(values)) < len(values):
                raise ValueError(f"{key} = {list(values)}: an entry is given twice")
        return self

    def of(self, read: Callable[[str], SceneConfig]) -> Iterator[SceneConfig]:
        """Every variant; ``read`` gives the configuration of a scene.

        The name says what differs: ``strain_oop_m1p5_w0p01_s3`` has 1.5 times the vertices along a
        side, a hundredth of the weight, and the start of seed 3.
        """
        for name in self.scenes:
            scene = read(name)
            for factor, ratio, seed in product(self.resolutions, self.stiffness_ratios, self.seeds):
                yield self._variant(scene, factor, ratio, seed)

    def _variant(self, scene: SceneConfig, factor: float, ratio: float, seed: int) -> SceneConfig:
        h, frames = scene.time_step, scene.frames
        stiff = varied(scene, h, ratio, h * frames, (frames, frames))
        kick = {"effect": "kick", "speed": self.kick, "seed": seed}
        return stiff.model_copy(
            update={
                "name": f"{scene.name}_m{_word(factor)}_w{_word(ratio)}_s{seed}",
                "title": f"{scene.title}; mesh x {factor:g}, weight x {ratio:g}, start {seed}",
                "mesh": scene.mesh.coarsened(factor),
                "effects": (*stiff.effects, effect_config(kick, len(stiff.effects))),
            }
        )


def _word(number: float) -> str:
    """A number as part of a scene's name."""
    return f"{number:g}".replace(".", "p").replace("-", "m").replace("+", "")
