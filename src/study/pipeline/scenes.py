"""Read scenes from config/scenes, change them as a study configures, and check that they build."""

import io
import logging
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Annotated

from pydantic import Field

from pdrom.core.errors import ConfigurationError, PdromError, choices
from pdrom.core.store.checksum import digest_of
from pdrom.core.yamlfile import ConfigModel, named, read_yaml, validate
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.effects import EFFECTS
from pdrom.model.mesh.config import MeshFile
from pdrom.model.mesh.files import VARIABLE
from pdrom.model.scene import Scene, SceneConfig
from study.artifact.artifact import modules_in
from study.artifact.logs import warnings_to
from study.pipeline.fingerprint import fingerprint, memory

Fraction = Annotated[float, Field(gt=0.0, le=1.0)]


class Coarsen(ConfigModel):
    """Factors that multiply the vertices along a mesh's side, and all numbers of frames."""

    resolution: Fraction = 1.0
    frames: Fraction = 1.0

    def of(self, scene: SceneConfig) -> SceneConfig:
        """Return ``scene`` with fewer vertices and frames."""
        return scene if self == UNCHANGED else scene.coarsened(self.resolution, self.frames)


UNCHANGED = Coarsen()


def scene_names(root: Path) -> list[str]:
    """List the names of all scenes with a file in config/scenes below ``root``, sorted."""
    return sorted(path.stem for path in (root / "config" / "scenes").glob("*.yaml"))


def require_scenes(root: Path, names: Iterable[str], key: str) -> None:
    """Raise ConfigurationError, which names ``key``, if a scene in ``names`` has no file."""
    known = scene_names(root)
    for name in names:
        if name not in known:
            raise ConfigurationError(f"{key}: unknown scene '{name}'{choices(name, known)}")


def checked_scene(
    root: Path, name: str, coarsen: Coarsen = UNCHANGED
) -> tuple[SceneConfig, tuple[int, int]]:
    """Check scene ``name`` below ``root`` by building it, and log its warnings.

    The scene is not built again if an earlier command has built it with equal code, files and
    limits of meshes. Returns its configuration and its numbers of vertices and elements.
    """
    config, own = read_scene(root, name, coarsen), io.StringIO()

    def build() -> tuple[int, int, list[str]]:
        with warnings_to(own, "%(message)s"):
            scene = load_bound_scene(root, name, coarsen)
        elements = sum(group.elements for group in scene.groups)
        return scene.mesh.vertices, elements, own.getvalue().splitlines()

    mesh = ""
    if isinstance(config.mesh, MeshFile) and (file := root / config.mesh.path).is_file():
        with suppress(OSError):  # ignore an unreadable file here: `build` reports it
            mesh = f"{digest_of(file)} {os.environ.get(VARIABLE)}"
    code = fingerprint(__name__, *sorted({*modules_in(config)}))
    vertices, elements, texts = memory().get(build, code, config.model_dump_json(), mesh)
    for text in texts if not own.getvalue() else ():  # `build` logs them if it is called
        logging.getLogger(__name__).warning("%s", text)
    return config, (vertices, elements)


def load_bound_scene(root: Path, name: str, coarsen: Coarsen = UNCHANGED) -> Scene:
    """Read scene ``name`` below ``root``, apply ``coarsen``, and build it on its mesh."""
    scene, source = read_scene(root, name, coarsen), scene_file(root, name)
    try:
        mesh = scene.mesh.build(root)
        bound = Scene.build(scene, mesh)
        # the scene of the test trajectory has the same constraint groups: build its other effects
        heldout = scene.heldout_variant()
        other = tuple(e for e in heldout.effects if not isinstance(e, GroupConfig))
        Scene.build(heldout.model_copy(update={"effects": other}), mesh)
    except PdromError as error:
        raise ConfigurationError(f"{source}: {error}") from error
    bound.log_holds()
    bound.log_contacts()
    return bound


def read_scene(root: Path, name: str, coarsen: Coarsen = UNCHANGED) -> SceneConfig:
    """Read the configuration of scene ``name`` below ``root`` and apply ``coarsen``.

    No mesh is built. The path of a mesh file becomes relative to ``root``.
    """
    require_scenes(root, [name], "scenes")
    path = scene_file(root, name)
    scene = validate(SceneConfig, named(read_yaml(path), name), str(path))
    if scene.name != name:
        raise ConfigurationError(f"{path}: name = '{scene.name}', required: '{name}' (file name)")
    _ = scene.count  # raises an error if the scene has no number of iterations
    if isinstance(scene.mesh, MeshFile):
        folder = path.parent.relative_to(root).as_posix()
        scene = scene.model_copy(update={"mesh": scene.mesh.below(folder)})
    return coarsen.of(scene)


def scene_file(root: Path, name: str) -> Path:
    """Return the path of the file of scene ``name`` below ``root``."""
    return root / "config" / "scenes" / f"{name}.yaml"


def not_taken(scene: SceneConfig) -> list[str]:
    """List the names of a scene's effects that position subspaces cannot represent."""
    return [e.effect for e in scene.effects if not EFFECTS.load(e.effect).in_subspace]
