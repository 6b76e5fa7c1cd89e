"""The ablation in position subspaces: its configuration, and a run on a small scene."""

import numpy as np
import pandas as pd
import pytest

from builders import make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.core.store import read_table, write_hdf5, write_table
from pdrom.core.yamlfile import read_yaml, validate
from pdrom.model.held_out import MOTIONS
from pdrom.model.mesh.types import save_mesh
from pdrom.model.runs.full_order import trajectory
from pdrom.model.scene import Scene
from pdrom.reduction.subspace.specs import InterpolationVariant
from places import ROOT
from study.artifact.paths import File
from study.experiments import subspace_ablation as experiment
from study.experiments.kit.settings import Horizon
from study.experiments.subspace_ablation import COLUMNS, Ablation, AblationFile
from study.tables.subspace_ablation import subspace_ablation

HORIZON = 30


def test_the_projects_ablation_changes_one_thing_at_a_time_first():
    """Up to the first combination a variant differs from the plain method in a single setting."""
    path = ROOT / "config" / "subspace_ablation.yaml"
    spec = validate(AblationFile, read_yaml(path), str(path))
    first, *others = spec.variants.items()
    assert first[1] == InterpolationVariant()
    for name, variant in others:
        assert len(variant.model_fields_set) == 1 + name.count("+"), name
    assert len(spec.cases()) == len(spec.modes) * len(spec.variants)
    assert {case.modes for _, case in spec.cases()} == set(spec.modes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("variants: {a: {modes: 5}}", "unknown key 'variants.a.modes'"),
        ("variants: {a: {states: guessed}}", "states"),
        ("variants: {}", "variants"),
        ("variants: {a: {}}\nranks: [3]", "ranks"),
    ],
)
def test_faults_of_the_file_are_named(tmp_path, text, message):
    path = tmp_path / "ablation.yaml"
    path.write_text(f"scenes: []\nsizes: [4]\nmodes: [6]\n{text}\n")
    with pytest.raises(ConfigurationError, match=message) as caught:
        validate(AblationFile, read_yaml(path), str(path))
    assert str(path) in str(caught.value)


@pytest.fixture(scope="module")
def rows(tmp_path_factory) -> pd.DataFrame:
    """Rows for a hanging sheet whose training motion has a horizon."""
    folder = tmp_path_factory.mktemp("ablation")
    scene = make_scene(
        {"effect": "strain", "weight": 1e6},
        {"effect": "gravity"},
        {"effect": "pins", "select": "left"},
        mesh={"kind": "cloth", "rows": 9, "columns": 8, "plane": "xz"},
        frames=60,
        reduce={"strain": {"train": 30}},
        held_out={"kick": 0.5, "kick_axes": ["y"], "seed": 3},
    )

    def file(name: str) -> File:
        return File(str(folder / name), {"scene": "test"})

    save_mesh(scene.mesh, folder / "mesh.h5")
    others = {m: Scene.build(scene.config.heldout_variant(m), scene.mesh) for m in MOTIONS}
    motions = {"train": scene, **others}
    for motion, bound in motions.items():
        with write_hdf5(folder / f"{motion}.h5") as stored:
            stored["positions"] = trajectory(bound)
    floor = [
        ("test", label, seed, frame, 1.0 if label == "1e-10" and frame >= HORIZON else 1e-9)
        for label in ("1e-10", *MOTIONS)
        for seed in (1, 2)
        for frame in range(60)
    ]
    columns = ["scene", "perturbation", "seed", "frame", "relative_difference"]
    write_table(pd.DataFrame(floor, columns=columns), folder / "sensitivity.csv")
    variants = Ablation(
        sizes=(8,),
        modes=(15,),
        variants={
            "plain": InterpolationVariant(),
            "refused": InterpolationVariant(refuse_above=1.01),
            "residual": InterpolationVariant(interpolates="residual"),
            "mended": InterpolationVariant(states="visited", oversampling=3),
        },
    )
    experiment.subspace_ablation(
        mesh=file("mesh.h5"),
        full_order=[File(str(folder / f"{motion}.h5"), {"run": motion}) for motion in motions],
        sensitivity=file("sensitivity.csv"),
        settings=experiment.Options(
            scene=scene.config,
            ablation=variants,
            horizon=Horizon(perturbation=1e-10, threshold=1e-3),
            blowup_extent=5.0,
        ),
        out=file("rows.csv"),
    )
    return read_table(folder / "rows.csv").set_index("variant", drop=False)


def test_every_variant_is_a_row_beside_the_full_projections(rows):
    assert set(rows.columns) == set(COLUMNS)
    assert rows.variant.tolist() == ["plain", "refused", "residual", "mended"]
    for column in ("relative_error_full_projections", "heldout_error_full_projections"):
        assert rows[column].nunique() == 1
        assert 0.0 < rows[column].iloc[0] < 0.1
    assert (rows.r == 15).all()
    assert rows.elements_sampled.dropna().astype(int).tolist() == [15, 15, 45]
    assert rows.gain["mended"] < rows.gain["plain"]


def test_a_refused_basis_has_not_run(rows):
    empty = ["elements_sampled", "gain", "finite", "max_extent", "relative_error_within_horizon"]
    assert rows.loc["refused", empty].isna().all()


def test_the_mended_method_is_as_good_as_the_full_projections(rows):
    mended = rows.loc["mended"]
    assert mended.finite
    limit = 1.5 * mended.relative_error_full_projections
    assert mended.relative_error_within_horizon < limit
    assert mended.heldout_error_within_horizon < 2.0 * mended.heldout_error_full_projections
    assert rows.relative_error_within_horizon["plain"] > limit


def test_a_run_that_leaves_the_scene_before_the_horizon_has_no_error(rows):
    residual = rows.loc["residual"]
    assert residual.max_extent > 5.0
    assert not residual.finite
    # it left after the horizon of the training motion; the held-out ones are judged to their ends
    assert residual.relative_error_within_horizon > 0.5
    assert np.isinf(residual.heldout_error_within_horizon)


def test_held_out_errors_are_those_of_three_motions(rows):
    found = rows.loc[
        "mended", ["heldout_error_low", "heldout_error_within_horizon", "heldout_error_high"]
    ]
    assert (found.astype(float).diff().iloc[1:] > 0.0).all()


def test_table_joins_the_scenes(tmp_path, rows):
    for scene in ("a", "b"):
        write_table(rows.assign(scene=scene), tmp_path / f"{scene}.csv")
    table = subspace_ablation([File(str(tmp_path / f"{scene}.csv"), {}) for scene in "ab"])
    assert table.scene.tolist() == ["a"] * 4 + ["b"] * 4
    assert len(subspace_ablation([])) == 0
    assert np.isnan(table.gain[1])
