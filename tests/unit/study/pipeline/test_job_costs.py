"""Expected times at the beginning of a run; records of times and verdicts in git."""

import re
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml

from pdrom.core.errors import ConfigurationError
from pdrom.core.store import write_table
from places import ROOT
from study.artifact.logs import Usage
from study.experiments.kit.base import experiments
from study.experiments.machine import Units
from study.pipeline import tracked
from study.pipeline.run import expected_seconds
from study.pipeline.scenes import Coarsen
from study.pipeline.summary import minutes
from study.pipeline.tracked import COLUMNS, COSTS, costs, updated
from study.tables import declared
from study.tables.claims.claims import COMMITS, MEASURED, RECORDED, RULES, claims, replication
from study.tables.claims.rules import load_claims

TABLE = pd.read_csv(ROOT / COSTS).set_index("kind")
PROFILE = yaml.safe_load((ROOT / "workflow/profiles/slurm/config.yaml").read_text("utf-8"))
# Memory in addition to that of a job: two processes of Snakemake, each with the plan, and the
# process that jobs are forked from.
ABOVE_S, ABOVE_MB = 60.0, 1000
# Factor for slower machines.
ROOM = 2.0


def plan(**coarsen: float) -> SimpleNamespace:
    """A stub of a plan."""
    return SimpleNamespace(
        study=SimpleNamespace(root=ROOT, settings=SimpleNamespace(coarsen=Coarsen(**coarsen))),
        results="results/studies/logs",
    )


def say(results: Path, log: str, processor: float, wall: float = 0.0, memory: float = 0.0) -> None:
    path = results / "logs" / log
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"date INFO pdrom: {Usage(wall, processor, memory)}\n", encoding="utf-8")


@pytest.mark.parametrize(
    ("log", "kind"),
    [("fom/sheet.log", "fom"), ("hard_cases.log", "hard_cases"), ("tables/payoff.log", "tables")],
)
def test_the_expected_time_of_a_job_is_that_of_its_kind_on_similar_meshes(log, kind):
    place = f"results/studies/logs/logs/{log}"
    assert expected_seconds(plan())(place) == TABLE.seconds[kind]
    coarse = expected_seconds(plan(resolution=0.5))
    assert coarse(place) == TABLE.coarse_seconds[kind]
    # a kind that was not measured has the median
    unknown = "results/studies/logs/logs/never_seen/a.log"
    assert expected_seconds(plan())(unknown) == TABLE.seconds.median()


def test_pages_state_the_recorded_times_with_their_unit():
    pages = ("README.md", "docs/running.md")
    readme, running = ((ROOT / page).read_text("utf-8") for page in pages)
    times = pd.read_csv(ROOT / "config/reference/run_times.csv").set_index("study")
    units = Units(**times.loc["full", list(Units.model_fields)])
    for text in (readme, running):
        assert f"{times.cpu['full']} (unit {units.unit_s:.3f} s" in text
    assert f"{times.wall_s['full'] / 60:.0f} minutes" in readme
    for study in times.itertuples():
        assert minutes(study.wall_s) in running
        assert minutes(study.processor_s) in running


def test_every_experiment_has_a_recorded_time_and_every_claim_a_recorded_verdict():
    for _, record in pd.read_csv(ROOT / RECORDED).groupby("replication"):
        assert record.claim.tolist() == list(load_claims(ROOT / RULES))
    assert set(experiments()) <= set(TABLE.index)
    assert (TABLE > 0.0).all().drop("longest_s").all()


def test_costs_are_read_from_the_logs_of_two_runs(tmp_path):
    full, coarse = tmp_path / "full", tmp_path / "coarse"
    say(full, "fom/a.log", 3.0, wall=4.0, memory=210.0)
    say(full, "fom/b.log", 5.0, wall=3.0, memory=250.4)
    say(full, "frame_times.log", 7.0, wall=8.0, memory=200.0)
    say(coarse, "fom/a.log", 0.5)
    say(coarse, "frame_times.log", 0.25)
    (full / "logs" / "fom" / "failed.log").write_text("ERROR pdrom: no\n", encoding="utf-8")
    table = costs(str(full), str(coarse))
    assert list(table.columns) == COLUMNS
    assert table.to_numpy().tolist() == [
        ["fom", 4.0, 0.5, 4.0, 250],
        ["frame_times", 7.0, 0.25, 8.0, 200],
    ]


@pytest.mark.parametrize("kind", TABLE.index)
@pytest.mark.parametrize("attempt", [1, 2])
def test_the_cluster_profile_requests_more_than_any_recorded_job_needed(kind, attempt):
    """A rule whose name differs from its kind has the default request."""
    asked = PROFILE["default-resources"] | PROFILE["set-resources"].get(kind, {})
    memory, minutes = (eval(asked[key], {"attempt": attempt}) for key in ("mem_mb", "runtime"))
    assert memory >= attempt * (ABOVE_MB + TABLE.memory_mb[kind])
    assert 60.0 * minutes >= attempt * (ABOVE_S + ROOM * TABLE.longest_s[kind])
    assert set(PROFILE["set-resources"]) <= set(TABLE.index)


def verdicts(**columns: str) -> pd.DataFrame:
    made = pd.DataFrame({"claim": ["C1", "C5"], **dict.fromkeys(MEASURED, "holds"), **columns})
    return made.reindex(columns=claims.column_names)


def test_recorded_rows_have_no_times_and_are_outdated_if_code_changes(tmp_path, monkeypatch):
    (tmp_path / "config").symlink_to(ROOT / "config")
    monkeypatch.chdir(tmp_path)
    results = Path("results/studies/extended")
    for name in tracked.KEPT:
        row = {column: ["1"] for column in declared()[name].column_names}
        write_table(pd.DataFrame(row), results / f"tables/{name}.csv")
    made = updated("rows")
    assert "ms_per_frame" not in made["config/reference/recorded/alternatives.csv"]
    made[tracked.MADE].to_csv("made.csv", index=False)
    monkeypatch.setattr(tracked, "MADE", "made.csv")
    assert tracked.outdated_rows() is None
    monkeypatch.setattr(tracked, "fingerprint", lambda *modules: "changed")
    assert "study.pipeline.tracked rows" in str(tracked.outdated_rows())


@pytest.fixture
def record(tmp_path: Path) -> Path:
    """A recorded replication "first", and "second", which is not frozen yet, below `tmp_path`."""
    (tmp_path / "config/reference").mkdir(parents=True)
    for name in (*(ROOT / "config").glob("*.yaml"), ROOT / "config/scenes"):
        (tmp_path / "config" / name.name).symlink_to(name)
    write_table(claims.checked(verdicts()), tmp_path / "claims.csv")
    recorded = tracked.verdicts(tmp_path / "claims.csv").assign(replication="first")
    (folder := (tmp_path / RECORDED).parent).mkdir()
    recorded.to_csv(folder / "claims.csv", index=False)
    lines = "replication,frozen,recorded,code_frozen,code_recorded", "first,aa,,,", "second,bb,,,"
    (folder / "commits.csv").write_text("\n".join(lines))
    return folder


def test_a_changed_verdict_is_different_and_a_missing_one_undecidable(record: Path) -> None:
    recorded = pd.read_csv(record / "claims.csv")
    assert re.fullmatch(r"20\d\d-\d\d-\d\d", recorded.date[0])
    recorded.assign(rules=["00000000", recorded.rules[1]]).to_csv(record / "claims.csv")
    today = verdicts(verdict_beyond=["does not hold", "not tested"])
    files = ROOT / RULES, record / "claims.csv", record / "commits.csv"
    table = replication.checked(replication(today, *files))
    assert table.same.tolist() == [True, True, False, False]
    assert table.decidable.tolist() == [True, True, True, False]
    assert table.rules_unchanged.tolist() == [False, True, False, True]
    assert table.frozen.tolist() == ["aa"] * 4


@pytest.mark.parametrize(
    "change", [("fingerprint", lambda *_: "changed"), ("OTHERS", "config/tiny.yaml")]
)
def test_a_record_is_refused_if_code_or_a_scene_changed_after_it_was_frozen(
    record, tmp_path, monkeypatch, change
):
    monkeypatch.chdir(tmp_path)
    updated("frozen")[COMMITS].to_csv(COMMITS, index=False)
    made = tracked.replication(tmp_path / "claims.csv")
    assert made[RECORDED].replication.tolist() == 2 * ["first"] + 2 * ["second"]
    assert made[COMMITS].iloc[-1, -1] == made[COMMITS].iloc[-1, -2]
    monkeypatch.setattr(tracked, *change)
    with pytest.raises(ConfigurationError, match=r"csv: second: the frozen code '\w{16} \w{16}'"):
        tracked.replication(tmp_path / "claims.csv")
