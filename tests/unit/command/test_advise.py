"""pdrom advise: from tables of the study or of the scene, with an exit code for each outcome."""

import pandas as pd
import pytest

from pdrom.command.base import Status
from pdrom.command.main import run
from pdrom.core.paths import SCENE_TABLE, TABLE
from pdrom.core.store import write_table

EFFECTS = pd.DataFrame(
    {
        "scene": "sheet", "effect": ["spring", "floor"], "moved": [None, 0.0],
        "sensitivity_floor": 1e-8, "above_floor": [None, False], "acting_frames": [5, 0],
        "own_ms": [0.1, 0.01], "saved_ms": None,
    }
)  # fmt: skip
COSTS = pd.DataFrame(
    {
        "scene": "sheet", "group": [None, "spring"], "method": ["full", "pod"],
        "position_basis": "full", "k": None,
        "r": [None, 10], "iterations": 10, "relative_error_within_horizon": [0.0, 0.005],
        "ms_per_frame": [0.5, 0.7],
    }
)  # fmt: skip


@pytest.fixture(params=["study", "scene"])
def results(request, tmp_path) -> str:
    """A folder of results that holds the scene among others, or as one of its own."""
    for name, table in (("effects_contribution", EFFECTS), ("accuracy_cost", COSTS)):
        own = SCENE_TABLE.at(str(tmp_path), scene="sheet", name=name)
        path = TABLE.at(str(tmp_path), name=name) if request.param == "study" else own
        if request.param == "scene":
            write_table(table.assign(scene="other"), TABLE.at(str(tmp_path), name=name))
        write_table(table, path)
    return str(tmp_path)


def test_the_effects_are_told_without_a_wish(results, capsys):
    assert run(["advise", "config/scenes/sheet.yaml", "--results", results]) == Status.DONE
    said = capsys.readouterr().out
    assert said.startswith("sheet: effects\nsensitivity floor 1e-08")
    assert "floor: exerts no force" in said
    assert "iterations K" not in said


@pytest.mark.parametrize(
    ("wish", "status"),
    [
        (["--error", "0.01", "--ms", "1"], Status.DONE),
        (["--error", "0.01"], Status.DONE),
        (["--ms", "0.1"], Status.NOTHING_FITS),
    ],
)
def test_a_wish_is_kept_or_not(results, capsys, wish, status):
    assert run(["advise", "sheet", *wish, "--results", results]) == status
    said = capsys.readouterr().out
    assert "full order, K = 10: error 0, 0.5 ms" in said
    assert ("nothing measured is as fast; fastest: full order" in said) != (status == Status.DONE)
    assert ("not measured for this scene" in said) == ("--ms" in wish)


def test_what_was_not_measured_names_the_command(results, capsys):
    assert run(["advise", "elsewhere", "--results", results]) == Status.FAULTY
    said = capsys.readouterr().err
    assert "holds no measurements of it (table effects_contribution)" in said
    assert "./reproduce scene elsewhere advice" in said


@pytest.mark.parametrize("wish", [["--error", "0"], ["--ms", "-1"], ["--error", "small"]])
def test_wishes_are_numbers_above_zero(results, capsys, wish):
    with pytest.raises(SystemExit) as ended:
        run(["advise", "sheet", *wish, "--results", results])
    assert ended.value.code == 2
    capsys.readouterr()


def test_a_misspelt_scene_gets_a_suggestion_and_nothing_is_moved(results, tmp_path, capsys):
    assert run(["advise", "shet", "--results", results]) == Status.FAULTY
    told = capsys.readouterr().err
    if (tmp_path / "scenes").exists():  # the scene's own tables are not read by another name
        assert "holds no measurements of it" in told
    else:
        assert "(allowed: sheet), did you mean 'sheet'?" in told
    for path in tmp_path.rglob("*.blake2b"):
        path.unlink()
    before = sorted(tmp_path.rglob("*"))
    assert run(["advise", "sheet", "--results", results]) == Status.FAULTY
    assert "its checksum" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_misspelt_key_of_a_scenes_file_gets_a_suggestion(results, tmp_path, capsys):
    path = tmp_path / "sheet.yaml"
    path.write_text("name: sheet\ntitle: Sheet\nframe: 3\n", encoding="utf-8")
    assert run(["advise", str(path), "--results", results]) == Status.FAULTY
    assert "did you mean 'frames'?" in capsys.readouterr().err


ASKS = pd.DataFrame(
    {
        "scene": "sheet", "motion": ["kick", "heldout"] * 2, "asked": [0.1, 0.1, 0.01, 0.01],
        "promised": [True, True, True, False], "broken": False, "error": [0.02, 0.05, 0.004, 0.03],
        "last_step": ["ecsw", "ecsw", "full order", "full order"], "ms_per_frame": [0.1, 0.2, 1, 1],
        "full_ms": [0.5, 0.5, 1.0, 1.0],
    }
)  # fmt: skip


def test_an_error_alone_is_answered_from_runs_that_were_asked(results, capsys):
    write_table(ASKS, TABLE.at(results, name="asks"))
    assert run(["advise", "sheet", "--error", "0.2", "--results", results]) == Status.DONE
    said = capsys.readouterr().out
    assert "--error 0.1, tried on 2" in said
    assert "ecsw: error 0.02 to 0.05, 0.1 to 0.2 ms a frame, full order 0.5 (2 of 2" in said
    asked = ["advise", "sheet", "--error", "0.05", "--results", results]
    assert run(asked) == Status.NOTHING_FITS
    assert "no promise on 1 motions" in capsys.readouterr().out
