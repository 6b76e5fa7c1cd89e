"""A hard case: a scene, what must hold in it, and its bounds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pdrom.core.yamlfile import validate
from pdrom.model.dynamics.stepper import State
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.types import Mesh
from pdrom.model.scene import Scene, SceneConfig


def at_rest(scene: Scene) -> State:
    """The state that the scene itself starts from."""
    return scene.initial_state()


@dataclass(frozen=True)
class Recipe:
    """A scene that is built when it is called: what `build` takes, the mesh by a function."""

    mesh: Callable[[], Mesh]
    effects: tuple[dict, ...]
    settings: dict
    masses: Callable[[Mesh], np.ndarray] | None = None

    def __call__(self) -> Scene:
        mesh = self.mesh()
        masses = None if self.masses is None else self.masses(mesh)
        return build(mesh, *self.effects, masses=masses, **self.settings)

    @property
    def modules(self) -> list[str]:
        """Places of the effects (for the code fingerprint), "module:attribute"."""
        return sorted({EFFECTS[effect["effect"]] for effect in self.effects})


@dataclass(frozen=True)
class HardCase:
    """A scene that is hard for a named reason, and what must hold in it.

    scene : builds the scene; a case that must be refused raises here
    why : what makes it hard
    holds : names of the checks that its full-order run must pass (module `checks`)
    start : the state before the first frame
    bound : largest extent that is no blow-up, over that of start, rest and handles
    slow : left to the slow tests
    """

    name: str
    scene: Recipe
    why: str
    holds: tuple[str, ...]
    start: Callable[[Scene], State] = at_rest
    bound: float = 2.0
    slow: bool = False


def build(
    mesh: Mesh,
    *effects: dict[str, Any],
    frames: int = 30,
    masses: np.ndarray | None = None,
    **settings: Any,
) -> Scene:
    """Scene of ``effects`` on ``mesh``, with so many ``frames``.

    ``masses`` (N,) kg replace equal ones, ``settings`` are further keys of `SceneConfig`.
    """
    config = validate(
        SceneConfig,
        {
            "name": "hard_case",
            "title": "hard case",
            "mesh": {"kind": "file", "path": "generated"},
            "frames": frames,
            "effects": list(effects),
            **settings,
        },
        "hard case",
    )
    return Scene.build(config, mesh, masses=masses)
