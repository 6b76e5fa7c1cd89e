"""Rule alternatives: errors against both references, and the tables of the rows."""

import numpy as np
import pandas as pd
import pytest

from builders import make_scene
from pdrom.core.errors import ConfigurationError
from pdrom.core.paths import File
from pdrom.core.store import read_table
from pdrom.core.yamlfile import validate
from pdrom.experiments.alternatives import experiment
from pdrom.experiments.alternatives.settings import Alternatives, Comparison
from pdrom.tables.alternatives import alternatives
from pdrom.tables.reduction_pays import reduction_pays
from pdrom.tables.winners import winners

EFFECTS = (
    {"effect": "gravity"},
    {"effect": "pins", "select": "left"},
    {"effect": "spring", "weight": 1e4},
)
STEPS = {
    "projective": ((1, 5), (1, 2000), (8, 1)),
    "newton": ((1, 20),),
    "explicit": ((1, 1), (64, 1)),
    "ecsw": ((1, 10), (4, 2)),
    "ecsw-anderson": ((1, 10),),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    mesh = {"kind": "cloth", "rows": 6, "columns": 5, "plane": "xz"}
    scene = make_scene(*EFFECTS, mesh=mesh, frames=8, held_out={"kick": 0.5})
    path = tmp_path_factory.mktemp("alternatives") / "x1.csv"
    settings = experiment.Options(
        scene=scene.config,
        alternatives=Comparison(
            compared=6,
            stiffness={"test": (1.0, 4.0)},
            steps=STEPS,
            modes=(4,),
            frames=2,
            warmup=0,
            repeats=1,
        ),
        blowup_extent=100.0,
    )
    out = File(str(path), {"scene": "test", "factor": "1"})
    experiment.alternatives(sources=[], settings=settings, out=out)
    return path


def test_rows_of_a_scene(written):
    table = read_table(written)
    assert table.columns.tolist() == experiment.COLUMNS
    reduced = table.trained_on.notna()
    # a reduction is trained twice
    assert len(table) == 2 * (1 + sum(map(len, STEPS.values())) + 3)
    assert table[reduced].groupby("trained_on").size().to_dict() == {
        "converged": 6,
        "own iterations": 6,
    }
    table = table[table.trained_on != "converged"]
    case = table[table.stiffness == 1.0].set_index(["method", "substeps", "iterations"])
    # many iterations end at the implicit step, many explicit steps in continuous time
    assert case.error_implicit["newton", 1, 20] < 1e-4
    assert case.error_implicit["projective", 1, 2000] < 1e-4
    assert case.error_continuous["explicit", 64, 1] < 1e-3
    own = table[(table.method == "converged") & (table.stiffness == 1.0)].iloc[0]
    assert own.error_implicit == 0.0
    assert own.error_continuous > 1e-3
    assert case.error_continuous["newton", 1, 20] == pytest.approx(own.error_continuous, rel=1e-2)
    assert case.elements_sampled["ecsw", 1, 10] > 0
    timed = table[table.method != "converged"]
    assert (timed.ms_per_frame > 0.0).all()


def test_a_finer_mesh_has_the_mass_of_the_scene():
    config = make_scene(*EFFECTS, mesh={"kind": "cloth", "rows": 6, "columns": 5}).config
    finer = experiment.sized(config, 2.0, 10.0)
    mesh = finer.mesh.build(experiment.Path())
    assert finer.vertex_mass * mesh.vertices == pytest.approx(30 * config.vertex_mass)
    weights = [getattr(effect, "weight", None) for effect in finer.effects]
    assert weights == [None, None, 1e5]


def test_tables_of_the_rows(written):
    table = alternatives([File(str(written), {"scene": "test", "factor": "1"})])
    found = winners(table, [1.0, 1e-3, 1e-12])
    assert len(found) == 2 * (3 + 2)
    assert len(winners(alternatives([]), [0.1])) == 0
    strict = found[(found.limit == 1e-3) & (found.reference == "continuous")]
    assert (strict.method == "explicit").all()
    assert len(reduction_pays(found)) == 2 * (3 + 2)
    assert len(reduction_pays(found[:0])) == 0
    assert found[found.limit == 1e-12].method.isna().all()


def test_winners_are_the_cheapest_that_reach_the_error():
    rows = pd.DataFrame(
        [
            ("a", 1.0, 0.05), ("b", 2.0, 0.005), ("a", 3.0, 0.004), ("ecsw", 0.5, 0.02),
            ("c", 0.1, np.nan), ("converged", np.nan, 0.0),
        ],
        columns=["method", "ms_per_frame", "error_implicit"],
    ).assign(
        trained_on=lambda t: t.method.map({"ecsw": "own iterations"}),
        scene="s", vertices=9, stiffness=1.0, substeps=1, iterations=1,
        error_continuous=lambda t: t.error_implicit, reference_error=1e-2,
        ms_low=lambda t: 0.9 * t.ms_per_frame, ms_high=lambda t: 1.2 * t.ms_per_frame,
    )  # fmt: skip
    found = winners(rows, [0.1, 0.01]).set_index(["reference", "limit"])
    loose, strict = found.loc[("implicit", 0.1)], found.loc[("implicit", 0.01)]
    assert (loose.method, loose.second, loose.margin, loose.reduced_speedup) == ("a", "b", 2.0, 2.0)
    assert loose.reduced_speedup_low == pytest.approx(0.9 * 1.0 / (1.2 * 0.5))
    assert loose.reduced_speedup_high == pytest.approx(1.2 * 1.0 / (0.9 * 0.5))
    assert (strict.method, strict.second, strict.margin) == ("b", "a", 1.5)
    assert pd.isna(strict.reduced_ms)
    # the motion in continuous time is not known well enough for the smaller error
    assert ("continuous", 0.1) in found.index
    assert ("continuous", 0.01) not in found.index
    assert strict.reduced_error == 0.02


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"steps": {"newtn": [[1, 1]]}}, "unknown method 'newtn'.*newton"),
        ({"steps": {"newton": [[0, 1]]}}, "newton"),
        ({"stiffness": {"s": [0.0]}}, "stiffness"),
    ],
)
def test_faulty_settings_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        validate(Alternatives, changes, "here")


def test_steps_that_cost_too_much_are_left_out():
    asked = Comparison(work={"newton": 200, "converged": 100}, steps=STEPS)
    assert asked.pairs("newton", 10) == [(1, 20)]
    assert asked.pairs("newton", 11) == []
    assert asked.pairs("explicit", 10**6) == [(1, 1), (64, 1)]
    assert asked.pairs("xpbd", 1) == []
    assert asked.affords("converged", 100)
    assert not asked.affords("converged", 101)


def test_weights_vary_on_the_own_mesh_only():
    asked = Comparison(stiffness={"s": (1.0, 100.0)})
    assert asked.factors("s", 1.0) == (1.0, 100.0)
    assert asked.factors("s", 2.0) == asked.factors("other", 1.0) == (1.0,)


def test_the_size_from_which_a_reduction_pays():
    rows = pd.DataFrame(
        {
            "vertices": [100, 400, 10_000],
            "limit": 0.1,
            "plain_ms": [2.0, 8.0, 200.0],
            "reduced_ms": [1.0, 1.0, 1.0],
            "reduced_speedup": [0.25, 0.5, 50.0],
            "ms_per_frame": [0.25, 0.5, 50.0],
            "reduced_speedup_low": [0.2, 0.4, 40.0],
            "reduced_speedup_high": [0.3, 0.6, 60.0],
            # what is trained on the scene's own iterations is slower
            "own_ms": [1.0, 2.0, 2.0],
        }
    )
    strict = rows.assign(limit=0.01, reduced_speedup=[0.5, np.nan, 3.0], plain_ms=np.nan)
    never = rows.assign(limit=0.001, reduced_speedup=[3.0, 2.0, np.nan])
    always = rows.assign(limit=0.5, reduced_speedup=[2.0, 2.0, 2.0])
    both = pd.concat([never, always, strict, rows]).assign(
        scene="s", stiffness=1.0, reference="implicit"
    )
    found = reduction_pays(both).set_index("limit")
    assert found.loc[0.1, ["smallest", "largest", "from_plain", "from_best"]].tolist() == [
        100, 10_000, 100, 10_000,
    ]  # fmt: skip
    # a straight line in both logarithms
    crossing = 400 * (10_000 / 400) ** (np.log(2.0) / np.log(100.0))
    assert found.breaks_even[0.1] == pytest.approx(crossing)
    assert (found.from_best_own[0.1], found.speedup_own[0.1]) == (10_000, 25.0)
    assert (found.speedup_low[0.1], found.speedup_high[0.1]) == (40.0, 60.0)
    assert found.from_best[0.01] == 10_000
    assert pd.isna(found.from_plain[0.01])
    assert pd.isna(found.breaks_even[0.01])
    assert pd.isna(found.from_best[0.001])
    assert found.from_best[0.5] == 100
    assert pd.isna(found.breaks_even[0.5])
