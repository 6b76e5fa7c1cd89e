"""What a configuration holds, and where its results lie."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

from pydantic import BaseModel, ConfigDict

if TYPE_CHECKING:
    from pdrom.pipeline.study import Study


# Output of the paper's published code, drawn beside ours and never used as our result.
PUBLISHED = Path("config/reference/published_code")


class SceneHolding(BaseModel):
    """A scene that was run: its mesh and the groups that are reduced in it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    mesh: str
    groups: tuple[str, ...]


class MethodHolding(BaseModel):
    """A method that was run: its title, the basis that it uses, and what it samples."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str
    basis: str
    rows: Literal["all", "scalar", "joint", "element"]


class Holdings(BaseModel):
    """Scenes and methods of a configuration; plain data, so that a rule can hand it on."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    scenes: dict[str, SceneHolding]
    reductions: dict[str, MethodHolding]

    @classmethod
    def of_study(cls, study: "Study") -> Self:
        """Holdings of a checked study."""
        scenes = {
            name: SceneHolding(mesh=study.mesh_of(name), groups=tuple(scene.reduce))
            for name, scene in study.scenes.items()
        }
        reductions = {
            name: MethodHolding(title=method.title, basis=method.basis_id, rows=method.rows)
            for name, method in study.methods.items()
        }
        return cls(scenes=scenes, reductions=reductions)

    def experiments(
        self, scenes: tuple[str, ...], groups: tuple[str, ...] = ()
    ) -> list[tuple[str, str]]:
        """(scene, group) pairs that exist, in the order asked for; empty tuples mean all."""
        pairs = []
        for scene in scenes or tuple(self.scenes):
            held = self.scenes[scene].groups if scene in self.scenes else ()
            pairs += [(scene, g) for g in (groups or held) if g in held]
        return pairs

    def first(
        self, scenes: tuple[str, ...], groups: tuple[str, ...], methods: tuple[str, ...]
    ) -> tuple[str, str, str] | None:
        """First experiment and first method that exist, (scene, group, method); None if none do."""
        experiments, held = self.experiments(scenes, groups), self.methods(methods)
        return (*experiments[0], held[0]) if experiments and held else None

    def methods(self, asked: tuple[str, ...]) -> list[str]:
        """Methods that exist, in the order asked for; an empty tuple means all."""
        return [m for m in (asked or tuple(self.reductions)) if m in self.reductions]

    def title(self, method: str) -> str:
        """Title of a method; its name where it is not held."""
        return self.reductions[method].title if method in self.reductions else method


class Sources:
    """Paths of the results that figures read.

    Parameters
    ----------
    results : folder of the results
    published : folder with the published code's own output (CSV), or None
    """

    def __init__(
        self,
        results: str | os.PathLike[str],
        holdings: Holdings,
        published: str | os.PathLike[str] | None = None,
    ) -> None:
        self.root = Path(results)
        self.holdings = holdings
        self.published = Path(published) if published else None

    def title(self, scene: str, group: str) -> str:
        """Title of an experiment; the group is named only where the scene reduces several."""
        several = len(self.holdings.scenes[scene].groups) > 1
        name = scene.replace("_", " ")
        return f"{name}: {group.replace('_', ' ')}" if several else name

    def mesh(self, scene: str) -> Path:
        """Rest mesh of a scene."""
        return self.root / "meshes" / f"{self.holdings.scenes[scene].mesh}.h5"

    def run(self, scene: str) -> Path:
        """Full-order training run."""
        return self.root / "fom" / scene / "train.h5"

    def snapshots(self, scene: str, group: str) -> Path:
        """Snapshot matrices of a group."""
        return self.root / "snapshots" / scene / f"{group}.h5"

    def basis(self, scene: str, group: str, method: str) -> Path:
        """POD basis that ``method`` uses."""
        name = f"{self.holdings.reductions[method].basis}.h5"
        return self.root / "pod" / scene / group / name

    def sampling(self, scene: str, group: str, method: str) -> Path:
        """Entries and elements that ``method`` selects."""
        return self.root / "sampling" / scene / group / f"{method}.h5"

    def rerun(self, scene: str, group: str, method: str) -> Path:
        """Reduced runs, one group of the file per basis size."""
        return self.root / "reruns" / scene / group / f"{method}.h5"

    def table(self, name: str) -> Path:
        """CSV table of the study."""
        return self.root / "tables" / f"{name}.csv"
