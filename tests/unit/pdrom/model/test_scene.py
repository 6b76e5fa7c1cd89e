"""Scenes contain exactly the listed effects; each fault has one clear message.

Masses are equal, by selection, or by density, and runs use them. Weights by selection apply to the
elements inside, in energies, systems and runs.
"""

import numpy as np
import pytest

from builders import GRAVITY, GROUPS, TOP, make_scene
from pdrom.core.store import open_hdf5
from pdrom.model.dynamics.stepper import State
from pdrom.model.runs import run, trajectory
from places import ROOT
from study.pipeline.scenes import Coarsen, read_scene

SPRING = {"effect": "spring", "weight": 1e5}


def test_unlisted_groups_leave_no_matrix_entry():
    """The system matrix is the sum of inertia and the listed groups, entry by entry."""
    scene = make_scene(SPRING)
    both = make_scene(SPRING, {"effect": "strain", "weight": 1e5})
    matrix = scene.system_with("supernodal").matrix
    expected = scene.groups[0].system_matrix().toarray()
    expected += np.diag(scene.masses / scene.config.time_step**2)
    assert np.array_equal(matrix.toarray(), expected)
    assert not np.array_equal(both.system_with("supernodal").matrix.toarray(), expected)
    assert scene.forces == scene.boundaries == scene.contacts == scene.starts == []


def test_only_needed_snapshots_are_stored_as_projections_of_the_last_iterate(tmp_path):
    """Reference: the frames are computed again and projected at the last local iterate."""
    scene = make_scene(GRAVITY, TOP, SPRING, {"effect": "strain", "weight": 1e5}, frames=5)
    run(scene, tmp_path / "run.h5", {"strain": np.array([0, 3])})
    seen, strain = [], scene.group("strain")
    loop, state = scene.stepper(), scene.initial_state()
    for frame in range(4):
        state, _ = loop.step(state, frame, lambda y: seen.append(strain.project(y)))
    with open_hdf5(tmp_path / "run.h5") as file:
        assert set(file) == {"positions", "velocities", "objective", "timings", "snapshots"}
        assert set(file["snapshots"]) == {"strain"}
        assert file["positions"].shape == (6, scene.mesh.vertices, 3)
        assert np.array_equal(file["snapshots/strain/p"], [seen[0], seen[3]])


def test_coarsening_scales_every_frame_number():
    scene = read_scene(ROOT, "cloth_all", Coarsen(resolution=0.5, frames=0.25))
    assert (scene.mesh.rows, scene.frames) == (10, 60)
    pins = [e for e in scene.effects if e.effect == "pins"]
    assert [(p.start, p.until) for p in pins] == [(0, 15), (0, 5), (15, 35), (35, None)]
    assert scene.reduce["spring"].train == 25


def test_explicit_drag_beyond_its_stability_limit_is_refused():
    """Free flight multiplies the velocity by 1 - c h: it decays for c h < 2 only (h = 0.016 s)."""
    scene = make_scene(SPRING, {"effect": "damping", "rate": 124.9}, frames=1)
    points = scene.mesh.points
    after, _ = scene.stepper().step(State(points.copy(), np.ones_like(points)), 0)
    assert np.abs(after.velocities).max() < 1.0
    with pytest.raises(ValueError, match="allowed are rates below 125"):
        make_scene(SPRING, {"effect": "damping", "rate": 125.0})


def test_later_entries_change_the_vertices_that_they_select():
    entries = [{"select": "top", "vertex_mass": 5.0}, {"select": [0], "vertex_mass": 7.0}]
    scene = make_scene(SPRING, vertex_mass=3.0, masses=entries)
    top = scene.mesh.points[:, 1] == scene.mesh.points[:, 1].max()
    expected = np.where(top, 5.0, 3.0)
    expected[0] = 7.0
    assert np.array_equal(scene.masses, expected)


@pytest.mark.parametrize(
    ("effect", "mesh"),
    [
        ("spring", {"kind": "cloth", "rows": 6, "columns": 5, "extent": 2.0}),
        ("tetrahedron_strain", {"kind": "bar", "nx": 4, "ny": 3, "nz": 3, "extent": 2.0}),
    ],
)
def test_a_density_gives_masses_by_area_or_volume_of_the_rest_shape(effect, mesh):
    """Total mass is density times area or volume; inner vertices have more mass than corners."""
    scene = make_scene({"effect": effect, "weight": 1.0}, mesh=mesh, masses=[{"density": 0.25}])
    sides = np.ptp(scene.mesh.points, axis=0)
    assert scene.masses.sum() == pytest.approx(0.25 * np.prod(sides[sides > 1e-9]))
    assert scene.masses.max() > 1.5 * scene.masses.min()


BOX = {"kind": "plane", "point": [0.1, 0, 0], "normal": [-1, 0, 0]}


def scene_with(group, *factors, weight=1e4):
    return make_scene(
        {"effect": group, "weight": weight, "factors": list(factors)}, mesh=GROUPS[group]
    )


@pytest.mark.parametrize("group", GROUPS)
def test_factors_multiply_weights_of_selected_elements_and_no_others(group):
    """A factor for all elements gives the run of the multiplied weight, in compiled kernels."""
    plain, changed = scene_with(group), scene_with(group, {"select": BOX, "factor": 7.0})
    inside = changed.mesh.points[:, 0] <= 0.1 + 1e-6
    elements = inside[plain.groups[0].element_vertices(plain.mesh)].all(axis=1)
    ratio = changed.groups[0].weights / plain.groups[0].weights
    assert 0 < elements.sum() < len(elements)
    assert ratio == pytest.approx(np.where(elements, 7.0, 1.0))
    every = scene_with(group, {"select": {"kind": "component"}, "factor": 4.0})
    start = 0.1 * np.random.default_rng(5).standard_normal(every.mesh.points.shape)
    runs = [trajectory(s, perturbation=start) for s in (every, scene_with(group, weight=4e4))]
    assert np.array_equal(*runs)
