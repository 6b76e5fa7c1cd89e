"""Two studies compared: what both have is judged, the rest is named."""

import numpy as np
import pytest

from pdrom.core.paths import TABLE
from pdrom.core.store import write_table
from pdrom.verification.lines import Outcome
from pdrom.verification.studies.findings import Findings
from pdrom.verification.studies.sides import Side

OTHER = "3" * 64


@pytest.fixture
def compared(tmp_path):
    """Findings about two folders, and the outcome of each line."""

    def compare(a, b):
        findings = Findings(*(Side.read(folder, tmp_path) for folder in (a, b)))
        return findings, {(line.kind, line.name): line for line in findings.lines()}

    return compare


def test_columns_of_one_side_are_named(study, frames, compared):
    ladder, shares = frames["ladder"], frames["local_share"]
    older = {
        "ladder": ladder.drop(
            columns="error_norm" if "error_norm" in ladder else ladder.columns[-1]
        ),
        "local_share": shares.assign(digits=1.0),
    }
    findings, lines = compared(study("a", older), study("b", code=OTHER))
    assert lines["table", "ladder"].outcome is Outcome.REPRODUCED
    assert findings.left["ladder"] == [f"column(s) of B only: {ladder.columns[-1]}"]
    assert findings.left["local_share"] == ["column(s) of A only: digits"]


def test_rows_of_one_side_differ_between_like_studies_only(study, frames, compared):
    fewer = {"ladder": frames["ladder"].head(30)}
    findings, lines = compared(study("a", fewer), study("b"))
    assert findings.alike
    assert lines["table", "ladder"].outcome is Outcome.DIFFERS
    findings, lines = compared(study("c", fewer), study("d", code=OTHER))
    assert lines["table", "ladder"].outcome is Outcome.REPRODUCED
    [left] = findings.left["ladder"]
    assert left.startswith("10 rows of B only, as scene ")


def test_a_difference_in_what_both_have_is_found_beside_other_rows(study, frames, compared):
    ladder = frames["ladder"].copy()
    place = ladder.columns.get_loc("condition")
    ladder.iloc[3, place] = ladder.iloc[3, place] * 1.5
    _, lines = compared(study("a", {"ladder": ladder.head(30)}), study("b", code=OTHER))
    [detail] = lines["table", "ladder"].details
    assert "condition" in detail
    assert "off by 0.33" in detail


def test_rows_that_a_column_of_one_side_tells_apart_are_not_confused(study, frames, compared):
    """Each row of the older table has three of the newer one: none of them is its partner."""
    runs = frames["reduced_reruns"].head(6)
    newer = runs.loc[runs.index.repeat(3)].assign(motion=list("abc") * 6)
    newer["relative_error_within_horizon"] *= 1 + np.arange(len(newer))
    both = {"reduced_reruns": runs}, {"reduced_reruns": newer}
    findings, lines = compared(study("a", both[0]), study("b", both[1], code=OTHER))
    assert lines["table", "reduced_reruns"].details == ()
    assert "24 rows that the common columns do not tell apart" in findings.left["reduced_reruns"]


def test_a_flag_that_names_a_row_is_an_outcome_between_unlike_studies(study, frames, compared):
    spectra = frames["singular_values"].copy()
    spectra.loc[2, "above_roundoff"] = not spectra.above_roundoff[2]
    findings, lines = compared(study("a"), study("b", {"singular_values": spectra}, code=OTHER))
    [detail] = lines["table", "singular_values"].details
    assert "above_roundoff: expected" in detail
    assert findings.left["singular_values"] == []


def test_tables_of_one_side_and_unknown_ones_are_named(study, frames, compared):
    a, b = study("a"), study("b", code=OTHER)
    for folder, name in ((a, "noise"), (a, "of_another_version"), (b, "of_another_version")):
        write_table(frames["ladder"], TABLE.at(str(folder), name=name))
    _, lines = compared(a, b)
    assert str(lines["table", "noise"]) == "table noise: not there, in B"
    assert lines["table", "of_another_version"].text == "unknown to this version"
    assert Outcome.DIFFERS not in {line.outcome for line in lines.values()}


def test_cells_of_another_kind_are_not_judged(study, frames, compared):
    words = {"ladder": frames["ladder"].assign(condition="large")}
    _, lines = compared(study("a"), study("b", words, code=OTHER))
    assert lines["table", "ladder"].outcome is Outcome.NOT_COMPARABLE
    assert "column 'condition' is no number" in lines["table", "ladder"].text
    assert lines["figure", "ladder"].outcome is Outcome.NOT_COMPARABLE


def test_verdicts_differ_unless_they_rest_on_times(study, frames, compared):
    claims = frames["claims"]
    timed, other = claims.claim.eq("C11"), claims.claim.eq("C3")
    changed = claims.assign(
        verdict_beyond=claims.verdict_beyond.mask(timed | other, "does not hold")
    )
    findings, lines = compared(
        study("a"), study("b", {"claims": changed.drop(index=0)}, code=OTHER)
    )
    assert lines["claim", "C3"].outcome is Outcome.DIFFERS
    assert lines["claim", "C11"].outcome is Outcome.NOT_COMPARABLE
    assert lines["claim", "C1"].text == "in B"
    assert lines["claim", "C2"].outcome is Outcome.REPRODUCED
    assert "springs" in findings.claims["C2"]


def test_a_figure_follows_its_tables_else_the_bytes_of_what_it_draws(study, frames, compared):
    a = study("a")
    worse = {"ladder": frames["ladder"].assign(condition=2 * frames["ladder"].condition)}
    for folder, ladder, floor in (
        (study("same"), Outcome.REPRODUCED, Outcome.REPRODUCED),
        (study("drawn otherwise", grey=7), Outcome.REPRODUCED, Outcome.REPRODUCED),
        (study("same picture", raw="2\n"), Outcome.REPRODUCED, Outcome.REPRODUCED),
        (study("others", worse, raw="2\n", grey=7), Outcome.DIFFERS, Outcome.NOT_COMPARABLE),
    ):
        _, lines = compared(a, folder)
        found = lines["figure", "ladder"].outcome, lines["figure", "sensitivity_floor"].outcome
        assert found == (ladder, floor), folder
    assert ("figure", "noise_runs") not in lines
