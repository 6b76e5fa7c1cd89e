"""Bytes and operations of an iteration, against those of a small scene by hand."""

import numpy as np
import pandas as pd
import pytest
from scipy import sparse

from builders import GROUPS, make_scene
from pdrom.core.store import read_table, write_table
from pdrom.model.mesh.types import save_mesh
from study.artifact.paths import File
from study.experiments.kit.effect_costs import effect_costs
from study.experiments.kit.names import GLOBAL, RIGHT
from study.experiments.roofline.experiment import Options, Roofline
from study.experiments.roofline.experiment import roofline as experiment
from study.experiments.roofline.gathers import KEPT, LINE, _missed, fetched, visits
from study.experiments.roofline.work import COLUMNS, VECTOR, work
from study.tables.kernels import kernels
from study.tables.roofline import WHOLE, roofline

EFFECTS = (
    {"effect": "gravity"},
    {"effect": "pins", "select": "left"},
    {"effect": "spring", "weight": 1e5},
    {"effect": "strain", "weight": 1e4},
)


def test_work_is_that_of_the_arrays():
    scene = make_scene(*EFFECTS)
    rows = pd.DataFrame(work(scene, scene.system, 2)).set_index("phase")
    assert rows.index.tolist() == ["spring", "strain", RIGHT, GLOBAL]
    n = scene.mesh.vertices
    assert rows.bytes["right-hand side"] == 2 * VECTOR * n
    # an edge: two corners of four bytes, weight and length; blocks are filled up
    blocks = -(-scene.group("spring").elements // 32)
    own = 32 * blocks * (2 * 4 + 2 * 8)
    # everything stays in the nearest cache: a line of positions is read once, one of the right-hand
    # side read and written once
    assert rows.bytes["spring"] == own + 3 * LINE * -(-n // 2)
    # two corners: gathered, then read and written
    assert rows.touches["spring"] == 32 * blocks * 2 * 3
    assert rows.divisions["strain"] > 0
    assert rows.roots["spring"] > 0
    state = scene.initial_state()
    fixed, _ = scene.space(scene.system).fixed(0, state.positions)
    panels, unknowns, _, _ = scene.system.eliminate(fixed).factor
    assert len(unknowns) == n - len(fixed)
    entries = len(panels[-1]) - len(unknowns)
    # forward and backward a product and a sum for each entry; a product and a difference each
    assert rows.flops[GLOBAL] == 4 * (4 * entries + 2 * len(unknowns))
    assert rows.bytes[GLOBAL] > 2 * panels[-1].nbytes


@pytest.mark.parametrize("name", GROUPS)
def test_every_corner_of_every_element_is_visited(name):
    group = make_scene({"effect": name, "weight": 1.0}, mesh=GROUPS[name]).groups[0]
    pieces = np.concatenate(visits(group))
    found = np.bincount(pieces, minlength=group.S.shape[1])
    corners = sparse.csr_array((np.ones(group.S.nnz), group.S.indices, group.S.indptr))
    rows = group.rows_per_element
    # an element's rows have the same vertices; the last block is filled up with its last element
    once = np.asarray((corners[::rows] != 0).sum(axis=0)).ravel()
    assert (found[: len(once)] >= once).all()
    assert len(pieces) < once.sum() + 32 * 4


def test_a_line_is_fetched_again_when_others_have_taken_its_place():
    lines = [("y", k) for k in range(KEPT + 1)]
    assert len(list(_missed(lines[:KEPT] * 3))) == KEPT
    assert len(list(_missed(lines * 3))) == 3 * (KEPT + 1)


def test_a_shuffled_mesh_fetches_more(rng):
    """The order of the vertices is what decides how far apart the corners of an element lie."""
    scene = make_scene(*EFFECTS[2:3], mesh={"kind": "cloth", "rows": 60, "columns": 60})
    group = scene.groups[0]
    ordered = fetched(group)
    new = rng.permutation(scene.mesh.vertices)
    packed = group.streamed[0]
    packed[:] = new[packed]
    assert min(fetched(group)) > 1.5 * max(ordered)


def test_solvers_that_are_not_compiled_have_no_work():
    scene = make_scene(*EFFECTS)
    rows = list(work(scene, scene.system_with("splu"), 1))
    assert [row["phase"] for row in rows] == ["spring", "strain", RIGHT]


@pytest.fixture
def made(tmp_path):
    """Tables roofline and kernels of one small scene and a finer mesh of it."""
    scene = make_scene(*EFFECTS)
    name = scene.config.name
    mesh = File(str(tmp_path / "mesh.h5"), {"mesh": scene.config.mesh.identifier})
    save_mesh(scene.mesh, mesh.path)
    rates, counts = (File(str(tmp_path / name), {}) for name in ("rates.csv", "work.csv"))
    section = Roofline(largest_mb=1, ms=0.01, repeats=2, frames=1)
    scenes, sizes = {name: scene.config}, {name: (1.0, 1.5)}
    settings = Options(every_scene=scenes, sizes=sizes, roofline=section, solver="supernodal")
    experiment(meshes=[mesh], settings=settings, rates=rates, work=counts)
    costs = File(str(tmp_path / "effects.csv"), {"scene": name})
    write_table(effect_costs(scene, scene.system, 1, 0, 2), costs.path)
    phases = roofline([rates], [counts], [costs], [])
    accuracy = pd.DataFrame({"group": ["spring", "spring"], "worst_over_condition": [1.0, 2.0]})
    return read_table(counts.path), phases, kernels(phases, accuracy)


def test_phases_are_divided_by_their_bounds(made):
    counted, phases, _ = made
    assert counted.columns.tolist() == COLUMNS
    assert counted.factor.tolist() == [1.0] * 4 + [1.5] * 4
    own, finer = phases[phases.factor == 1.0], phases[phases.factor == 1.5]
    assert own.phase.tolist() == ["spring", "strain", RIGHT, GLOBAL, WHOLE]
    np.testing.assert_allclose(own.share * own.measured_us, own.bound_us)
    assert own.bound_us.iloc[-1] == pytest.approx(own.bound_us.iloc[:-1].sum())
    # nobody timed the finer mesh
    assert finer.measured_us.isna().all()
    assert (finer.bound_us > own.bound_us.to_numpy()).all()


def test_kernels_have_their_cost_by_element(made):
    _, phases, table = made
    assert table.group.tolist() == ["spring", "spring", "strain", "strain"]
    assert table.worst_over_condition.tolist()[:2] == [2.0, 2.0]
    first = phases[phases.phase == "spring"].iloc[0]
    assert table.ns_per_element.iloc[0] == pytest.approx(1e3 * first.measured_us / first.elements)


def test_nothing_counted_gives_empty_tables():
    assert roofline([], [], [], []).empty
