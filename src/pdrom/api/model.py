"""Reduced models from `pdrom.api.train`, which run scenes and can be saved and loaded."""

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Annotated, Any, Literal

import h5py
import numpy as np
import pandas as pd
from pydantic import Field, FiniteFloat

from pdrom.api import files
from pdrom.api.records import Run
from pdrom.core import store
from pdrom.core.errors import ConfigurationError, NotReducibleError, StorageError
from pdrom.core.provenance import made_by
from pdrom.core.yamlfile import ConfigModel, shown, validate
from pdrom.model.constraints.base import GroupConfig
from pdrom.model.dynamics.stepper import FrameReport, State, Stepper
from pdrom.model.mesh.selection import Selection, select_vertices
from pdrom.model.mesh.types import store_mesh, stored_mesh
from pdrom.model.runs import BLOWUP_EXTENT
from pdrom.model.scene import Scene, SceneConfig
from pdrom.reduction.rerun import rerun
from pdrom.reduction.sampling.model import ProjectionModel
from pdrom.reduction.subspace import model as subspaces
from pdrom.reduction.subspace.ecsw import Samples
from pdrom.reduction.subspace.exported import export_page
from pdrom.reduction.subspace.interpolation import SubspaceLocalStep
from pdrom.reduction.subspace.model import SubspaceModel
from pdrom.reduction.subspace.space import ReducedSpace, reduced_state
from pdrom.reduction.timing import Variant, measure
from pdrom.view.page import LIVE, page_of, require_page, view_of

FORMAT = 1  # version of the file of a model
BUSY = 1.25  # ratio of wall time to processor time above which other programs count as running
OnFrame = Callable[[int, FrameReport], None]


def silent(frame: int, report: FrameReport) -> None:
    """Do nothing after a frame."""


@dataclass(frozen=True)
class Training:
    """Settings and cost of the training of a model.

    trajectories : names of the training trajectories
    converged : whether their frames were solved to convergence
    tolerance : sampling tolerance: bound of the relative residual of the training equations; None
        without sampling
    residual : relative residual of the sampled groups, the largest; None without sampling
    seconds : time of the training, s
    solver : default solver of the model, see `Model.run`
    """

    trajectories: tuple[str, ...]
    converged: bool
    tolerance: float | None
    residual: float | None
    seconds: float
    solver: str = "local_global"

    def __str__(self) -> str:
        solved = "converged frames" if self.converged else "the scene's iterations"
        text = f"trained on {', '.join(self.trajectories)} ({solved}) in {self.seconds:.3g} s"
        if self.tolerance is None or self.residual is None:
            return text
        missed = f", violates the tolerance {self.tolerance:g}" * (self.residual > self.tolerance)
        return f"{text}, residual {self.residual:.2g}{missed}"


@dataclass(frozen=True, eq=False)
class Model:
    """Reduced model, which runs scenes with the mesh and the constraint groups of its training.

    scene : first training scene
    reduced : model of the unknowns: coordinates of a position subspace, with sampled elements, or
        all vertices, with reduced projections of one group
    training : settings and cost of the training
    validation : table of trajectories: ``trajectory``, ``position_error``, ``deformation_error``,
        ``replay_error`` (position error of replaying the first training run), ``ms`` per frame,
        ``speedup`` over the full-order model, ``busy`` (times are unreliable, since other programs
        ran), ``blowup_frame`` (NaN: none)
    """

    scene: Scene
    reduced: SubspaceModel | ProjectionModel
    training: Training
    validation: pd.DataFrame

    def __repr__(self) -> str:
        own, errors = self.reduced, ""
        kept = own.columns.B if isinstance(own, SubspaceModel) else own.reduction.basis.V
        if count := len(self.validation):
            position, deformation = worst_errors(self.validation)
            solved = " converged" * self.training.converged
            errors = (
                f"largest errors against {count}{solved} full-order run{'s' * (count > 1)} "
                f"{position:.2g} (positions), {deformation:.2g} (deformation), "
            )
        return f"Model({self.title}: {self.training}, {errors}{kept.nbytes / 1e6:.2g} MB)"

    @property
    def title(self) -> str:
        """Training scene, number of modes and number of evaluated elements, in words."""
        total = sum(group.elements for group in self.scene.groups)
        used = f"{self.reduced.elements_evaluated(self.scene)} of {total} elements"
        return f"a model of '{self.scene.config.name}' ({self.reduced.title}, {used})"

    def run(
        self,
        scene: Scene,
        out: str | os.PathLike[str] | None = None,
        on_frame: OnFrame = silent,
        iterations: int | None = None,
        solver: str | None = None,
    ) -> Run:
        """Simulate ``scene`` with the model; a run that blows up ends early and is returned, too.

        scene : scene with the mesh and the constraint groups of the training; weights, masses,
            forces and the time step may differ; it holds only vertices held or declared in training
        out : file (HDF5) to write; None writes no file
        on_frame : called after each frame with its number, from 0, and the solver's report
        iterations : per frame; None: until convergence (Newton's method), or as in the scene
        solver : "newton" or "local_global" (as the full-order model); None: `Training.solver`

        Returns positions of all vertices, and milliseconds of each frame, including their
        computation. Raises PdromError if the scene has another mesh, other groups, other fixed
        vertices or an effect that the model cannot simulate, or if ``out`` cannot be written.
        """
        files.require_runnable(scene, out, on_frame)
        loop, start = self.loop(scene, iterations, solver)
        next(loop.run(start, range(1)))  # loads compiled code, outside the times of frames
        run = rerun(scene, loop, start, None, BLOWUP_EXTENT, self._lift(), on_frame)
        asked = f"{iterations} iterations" if iterations else ""
        method = ", ".join(filter(None, (self.title, asked, solver)))
        ended = run.blowup_frame
        found = Run(scene, run.positions, run.ms, method=method, blowup_frame=ended)
        if out is not None:
            files.save(found, out)
        return found

    def loop(
        self, scene: Scene, iterations: int | None = None, solver: str | None = None
    ) -> tuple[Stepper, State]:
        """Return the step loop of ``scene`` in the model's unknowns and the initial state."""
        require_same_mesh(self.scene, scene)
        asked = validate(_Asked, {"iterations": iterations, "solver": solver}, "model")
        newton = (asked.solver or self.training.solver) == "newton"
        count = asked.iterations or (subspaces.ALL if newton else None)
        scene = scene.iterated(count, scene.config.anderson_window) if count else scene
        if isinstance(self.reduced, SubspaceModel):
            subspaces.require_holds(scene, self.reduced.columns)
            return self.reduced.loop(scene, newton)
        if newton:
            raise ConfigurationError("model: only a position subspace allows solver = newton")
        return self.reduced.loop(scene)

    def view(self, path: str | os.PathLike[str], full: Run | None = None) -> None:
        """Write an HTML page (one file) that runs the model and lets a reader drag its handles.

        The page simulates the scene of the full-order run ``full``, shown as wires, or else the
        training scene. PdromError if the model has no position subspace, the page cannot simulate
        the scene, `run` refuses it, or the page is too large or cannot be written to ``path``.
        """
        require_page(files.output(path))
        own, scene, positions = self.reduced, self.scene, None
        if not isinstance(own, SubspaceModel):
            raise NotReducibleError(f"a page cannot run {self.title}: train without a method")
        if full is not None:
            scene, positions = files.require_run(full, "full").scene, full.positions
            if not full.full_order:
                raise ConfigurationError(f"full = {full.title}: a full-order run is required")
        self.loop(scene)  # raises the errors of `run`
        config, family = scene.config, "elements" if own.samples else "all"
        labels = {"family": family, "k": own.columns.modes, "tau": self.training.tolerance}
        content = export_page(scene, config.title, positions, [(labels, own)])
        entry = {"scene": config.name, "view": view_of(config.effects), "content": content}
        store.write_text(page_of(LIVE, [entry]), path, with_checksum=False)

    def _lift(self) -> Callable[[np.ndarray], np.ndarray]:
        """Return the map from unknowns of `loop` to positions (N, 3) m, for one thread."""
        if not isinstance(self.reduced, SubspaceModel):
            return self.reduced.positions
        output = self.reduced.output(float)
        return lambda z: output(z).copy()

    def start(
        self, scene: Scene, iterations: int | None = None, solver: str | None = None
    ) -> "Loop":
        """Begin a run of ``scene`` frame by frame; ``iterations`` and ``solver`` as in `run`."""
        files.require(Scene, scene, "scene", source="made by build_scene or load_scene")
        if not isinstance(self.reduced, SubspaceModel):
            raise ConfigurationError("start: this model has no position subspace; use run")
        return Loop(scene, *self.loop(scene, iterations, solver), self._lift())

    def speed(self, scene: Scene, repeats: int = 3) -> dict[str, Any]:
        """Time the model and the full-order model in turn on ``scene``, in this process.

        Return ``ms`` and ``full_ms`` per frame (means over all frames, each of its median repeat),
        their ratio ``speedup``, and ``busy``, whether other programs used the processor.
        """
        files.require_runnable(scene, None, silent)
        frames, lift = scene.config.frames, self._lift()
        own = Variant({}, *self.loop(scene), frames, output=lift, warm=1)
        loop = scene.stepper(track_objective=False)
        every = [own, Variant({}, loop, scene.initial_state(), frames, warm=1)]
        (ms, full), busy = timed(every, repeats)
        return {"ms": ms, "full_ms": full, "speedup": full / ms, "busy": busy}

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to the file ``path`` (HDF5), from which `load_model` reads it."""
        path = files.output(path)
        config = {"scene": self.scene.config.model_dump(mode="json")}
        with made_by("pdrom.api.Model.save", config), store.write_hdf5(path) as file:
            file.attrs.update(format=FORMAT, kind=type(self.reduced).__name__)
            store_mesh(self.scene.mesh, file.create_group("mesh"))
            _put(file, "masses", self.scene.masses, "kg")
            record = file.create_group("training")
            known = {name: v for name, v in vars(self.training).items() if v is not None}
            record["trajectories"] = list(known.pop("trajectories"))
            record.attrs.update(known)
            table = file.create_group("validation", track_order=True)
            for name, values in self.validation.items():
                _put(table, str(name), values.to_list(), "ms" if name == "ms" else "")
            own = file.create_group("model")
            if isinstance(self.reduced, ProjectionModel):
                self.reduced.store(own)
                return
            subspaces.store_columns(own.create_group("columns"), self.reduced.columns)
            subspaces.store_model(own, {}, self.reduced.samples)
            _export(self.scene, self.reduced, file.create_group("frame"))


class _Asked(ConfigModel):
    """Arguments of `Model.run` and `Loop.move`, with default values for validation."""

    iterations: Annotated[int, Field(ge=1, le=10_000)] | None = None
    solver: Literal["newton", "local_global"] | None = None
    hold: Selection = "x_min"
    displacement: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = (0.0, 0.0, 0.0)


class Loop:
    """Run of a scene, computed frame by frame; ``frame`` is the next frame's number, from 0.

    The run can continue beyond the scene's frames, and does not end if it blows up.
    """

    def __init__(
        self, scene: Scene, loop: Stepper, start: State, lift: Callable[..., np.ndarray]
    ) -> None:
        self._mesh, self._loop, self._state, self._lift = scene.mesh, loop, start, lift
        self.frame, self._selected = 0, dict[str, np.ndarray]()

    @property
    def positions(self) -> np.ndarray:
        """Positions (N, 3) m of all vertices after the last frame."""
        return self._lift(self._state.positions)

    def step(self) -> None:
        """Compute the next frame."""
        self._state, _ = self._loop.step(self._state, self.frame)
        self.frame += 1

    def move(self, hold: Any, displacement: Sequence[float]) -> None:
        """Move fixed vertices by ``displacement`` m; displacements of all calls add up.

        ``hold`` is the name of the effect that fixes them ("pins"), or their selection ("left").
        ConfigurationError unless it names exactly one hold of the next frame.
        """
        moves = {"displacement": np.asarray(displacement, dtype=object).tolist()}
        shift = np.array(validate(_Asked, moves, "move").displacement)
        active = [b for b in self._loop.space.boundaries if b.active(self.frame)]
        named = isinstance(hold, str)
        found = [b for b in active if named and hold in (b.boundary.name, b.boundary.side)]
        if not found:
            if (key := repr(hold)) not in self._selected:
                asked = validate(_Asked, {"hold": hold}, "move")
                self._selected[key] = select_vertices(self._mesh, asked.hold)
            found = [b for b in active if np.array_equal(b.vertices, self._selected[key])]
        if len(found) != 1:
            known = (f"{b.boundary.name} of {b.boundary.side or len(b.vertices)}" for b in active)
            fault = f"fits {len(found)} holds of frame {self.frame}, not 1 of: {', '.join(known)}"
            raise ConfigurationError(f"move: {shown(hold, 60)}: {fault}")
        found[0].shift = found[0].shift + shift


def require_same_mesh(own: Scene, other: Scene) -> None:
    """Raise ConfigurationError if ``other`` has another mesh or other groups than ``own``."""
    wanted, found = (
        {e.effect: e.model_dump(exclude={"weight", "factors"})
         for e in scene.config.effects if isinstance(e, GroupConfig)}
        for scene in (own, other)
    )  # fmt: skip
    faults = [
        f"{name}.{key} = {found[name][key]}; the training has {value}"
        for name, keys in wanted.items()
        for key, value in keys.items()
        if name in found and found[name][key] != value
    ]
    if set(wanted) != set(found):
        faults.append(f"groups {', '.join(found)}; the training has {', '.join(wanted)}")
    for name in ("points", "triangles", "tetrahedra"):
        if not np.array_equal(getattr(own.mesh, name), getattr(other.mesh, name)):
            faults += [f"its mesh is not that of the training ({own.mesh.vertices} vertices)"]
    if faults:
        raise ConfigurationError(f"scene '{other.config.name}': {faults[-1]}")


def worst_errors(validation: pd.DataFrame) -> list[float]:
    """Return the largest position and deformation error; inf if one of the runs blew up."""
    if validation.blowup_frame.notna().any():
        return [np.inf, np.inf]
    return [float(validation[f"{kind}_error"].max()) for kind in ("position", "deformation")]


def timed(variants: Sequence[Variant], repeats: int) -> tuple[list[float], bool]:
    """Return milliseconds per frame of each of ``variants``, and whether other programs ran."""
    wall, used = perf_counter(), process_time()
    spent = [row["ms_per_frame"] for row in measure(variants, 1, repeats)]
    return spent, perf_counter() - wall > BUSY * (process_time() - used)


def _put(file: h5py.Group, name: str, values: Any, unit: str) -> None:
    file[name] = values
    file[name].attrs["unit"] = unit


def _export(scene: Scene, model: SubspaceModel, file: h5py.Group) -> None:
    """Write the data for a frame of the training scene to ``file``, for other programs."""
    steps = {}
    for group in scene.groups:
        chosen = model.chosen(group)
        if not isinstance(chosen, Samples):
            return
        steps[group] = SubspaceLocalStep(group, model.columns, chosen.elements, chosen.factors)
    space = ReducedSpace(scene, model.columns, [step.matrix for step in steps.values()])
    start = reduced_state(scene, model.columns)
    fixed, targets, _ = space.fixed(0, start.positions)
    arrays: dict[str, tuple[Any, str]] = {
        "held": (fixed, ""), "targets": (targets, ""),
        "matrix": (space.matrix, "kg/s^2"), "inertia": (space.inertia_matrix, "kg/s^2"),
        "positions": (start.positions, ""), "velocities": (start.velocities, "1/s"),
    }  # fmt: skip
    for i, (constant, rate) in enumerate(space.forces):
        arrays |= {f"forces/{i}/constant": (constant, "1/s^2"), f"forces/{i}/rate": (rate, "1/s")}
    for group, step in steps.items():
        arrays[f"groups/{group.name}/strain"] = step.strain, "1"
        arrays[f"groups/{group.name}/weights"] = step.group.row_weights, "N/m"
    for name, (values, unit) in arrays.items():
        _put(file, name, values, unit)
    file.attrs.update(time_step=scene.config.time_step, iterations=scene.config.count)


def load_model(path: str | os.PathLike[str]) -> Model:
    """Read a model from the file ``path`` that `Model.save` wrote; its runs are equal bit for bit.

    StorageError if the file is missing, damaged or edited, has no model, or is from a newer pdrom.
    """
    path = files.file_path(path)
    with files.opened(path, "model") as file:
        if "model" not in file or "format" not in file.attrs:
            raise StorageError(f"{path}: contains no model; pdrom show lists its contents")
        if (version := int(file.attrs["format"])) > FORMAT:
            raise StorageError(f"{path}: format {version} requires a newer pdrom (this: {FORMAT})")
        return _model(file, json.loads(file.attrs["configuration"])["scene"], str(path))


def _model(file: h5py.File, config: dict[str, Any], source: str) -> Model:
    mesh, masses = stored_mesh(file["mesh"]), file["masses"][...]
    scene = Scene.build(validate(SceneConfig, config, source), mesh, masses)
    record, table, own = file["training"], file["validation"], file["model"]
    bounds = [record.attrs.get(name) for name in ("tolerance", "residual")]
    tolerance, residual = (None if bound is None else float(bound) for bound in bounds)
    training = Training(
        tuple(record["trajectories"].asstr()[...]), bool(record.attrs["converged"]), tolerance,
        residual, float(record.attrs["seconds"]), str(record.attrs["solver"]),
    )  # fmt: skip
    rows = {name: (t.asstr() if t.dtype.kind == "O" else t)[...] for name, t in table.items()}
    reduced: SubspaceModel | ProjectionModel
    if file.attrs["kind"] == ProjectionModel.__name__:
        reduced = ProjectionModel.stored(own)
    else:
        columns, samples = subspaces.stored_columns(own["columns"]), subspaces.stored_samples(own)
        reduced = SubspaceModel(columns, samples)
    return Model(scene, reduced, training, pd.DataFrame(rows))
