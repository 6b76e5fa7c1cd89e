"""Contents of a configuration that figures draw; plain data for a job."""

from collections.abc import Iterator
from typing import Self

from pydantic import BaseModel, ConfigDict

from study.artifact.paths import Place
from study.figures.kit.options import Names, Options


class _Plain(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SceneHolding(_Plain):
    """A scene that was run: its mesh and the groups that are reduced in it."""

    mesh: str
    groups: Names


class MethodHolding(_Plain):
    """A method that was run: its title, the basis that it uses, and what it samples."""

    title: str
    basis: str
    rows: str


class GroupHolding(_Plain):
    """A constraint group, as its class describes it.

    place : its place among all groups, which decides its colour
    cells : what its elements are: vertex, edge, triangle or tetrahedron
    unit : of a projection; empty where it has none
    """

    place: int
    cells: str
    unit: str = ""


class Holdings(_Plain):
    """Scenes, methods and constraint groups of a configuration."""

    scenes: dict[str, SceneHolding]
    methods: dict[str, MethodHolding]
    groups: dict[str, GroupHolding]

    def experiments(self, options: Options) -> list[tuple[str, str]]:
        """(scene, group) pairs of ``options`` that exist, in the order asked for."""
        groups = options.names("groups")
        return [
            (scene, group)
            for scene in self._scenes(options)
            for group in (groups or self.scenes[scene].groups)
            if group in self.scenes[scene].groups
        ]

    def reductions(self, options: Options) -> list[str]:
        """Methods of ``options`` that exist, in the order asked for."""
        return [m for m in (options.names("methods") or tuple(self.methods)) if m in self.methods]

    def first(self, options: Options) -> tuple[str, str, str] | None:
        """First experiment and method of ``options`` that exist, (scene, group, method)."""
        experiments, held = self.experiments(options), self.reductions(options)
        return (*experiments[0], held[0]) if experiments and held else None

    def chosen(self, options: Options) -> Self:
        """The part that these options ask for."""
        methods = self.reductions(options)
        return self.model_copy(
            update={
                "scenes": {scene: self.scenes[scene] for scene in self._scenes(options)},
                "methods": {method: self.methods[method] for method in methods},
            }
        )

    def files(self, place: Place, options: Options, results: str, first: bool) -> Iterator[str]:
        """Paths of ``place`` below ``results`` for scenes, groups and methods of ``options``.

        With ``first`` they are those of the first of each.
        """
        experiments, methods = self.experiments(options), self.reductions(options)
        if first:
            experiments, methods = experiments[:1], methods[:1]
        for scene, group in experiments:
            for method in methods:
                yield self.path(place, results, scene, group, method)

    def path(
        self, place: Place, results: str, scene: str, group: str = "", method: str = ""
    ) -> str:
        """Path of the file of ``place`` below ``results``.

        Labels (``scene``, ``group``, ``method``) that its kind does not have may stay away.
        """
        basis = self.methods[method].basis if method else ""
        labels = {"scene": scene, "group": group, "method": method, "basis": basis}
        return place.at(results, mesh=self.scenes[scene].mesh, run="train", **labels)

    def _scenes(self, options: Options) -> list[str]:
        return [s for s in (options.names("scenes") or tuple(self.scenes)) if s in self.scenes]
