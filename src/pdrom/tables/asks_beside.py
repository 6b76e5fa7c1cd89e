"""Table asks_beside: runs that are asked for an error, beside other ways to keep to one."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.model.held_out import FIRST
from pdrom.tables.kit.declaration import compared, integer, number, table, text, timed


@table(
    title="Ways to keep to an error, in time over that of the full order",
    columns=(
        text(
            "way",
            "asked: checked run; full order: the cheapest, plain or accelerated, by the same rule; "
            "hindsight: the fastest that keeps to it, on one motion; chosen: model by its estimate "
            "(table model_choice); fall-back: of the guard (table guard)",
        ),
        compared("exact", number("error", "largest relative error of the positions allowed")),
        integer("runs", "scenes times motions, scenes (chosen), reductions times alarms"),
        compared("share", integer("answers", "of these, promised or found, and judged")),
        compared("share", integer("broken", "of these, errors above the one allowed")),
        compared(
            "error",
            number(
                "worst",
                "largest error over the one allowed, against the converged step; of chosen and "
                "fall-back against the scene's own run",
            ),
        ),
        timed(number("over_own", "median time of answers over that of the own iterations")),
        timed(number("over_own_most", "largest one")),
    ),
    reads={
        "asks": TableOf("asks"),
        "choices": TableOf("model_choice"),
        "guard": TableOf("guard"),
        "frame_times": TableOf("frame_times"),
    },
)
def asks_beside(
    asks: pd.DataFrame, choices: pd.DataFrame, guard: pd.DataFrame, frame_times: pd.DataFrame
) -> pd.DataFrame:
    """A row for each way and each error of the table ``asks``; all other tables by their names."""
    if asks.empty:
        return asks
    parts = [
        *_asked(asks[asks.judged.astype(bool)]),
        ("chosen", _chosen(choices, frame_times)),
        ("fall-back", _fallen_back(guard, asks.asked.unique())),
    ]
    return pd.DataFrame(
        [_row(way, rows) for way, part in parts for _, rows in part.groupby("error", sort=False)]
    )


def _asked(rows: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Runs of the table asks, with the full order and the best choice of each."""
    for way, reached, ms in (
        ("asked", rows.error, rows.ms_per_frame),
        ("full order", rows.full_error, rows.full_ms),
    ):
        yield way, _part(rows.asked, rows.promised, reached, over=ms / rows.own_ms)
    first = rows[rows.motion == FIRST]
    # nothing is known of its error but that it keeps to the ask
    unknown = pd.Series(float("nan"), first.index)
    over = first.oracle_ms / first.own_ms
    yield "hindsight", _part(first.asked, over.notna(), unknown, over)


def _chosen(choices: pd.DataFrame, frame_times: pd.DataFrame) -> pd.DataFrame:
    """Models chosen by their estimates; the larger of the errors on the motions counts."""
    full = choices.scene.map(frame_times.set_index("scene").ms_per_frame)
    reached = choices[["relative_error_within_horizon", "error_heldout"]].max(axis=1)
    return _part(choices.tolerance, choices.found, reached, over=choices.ms_per_frame / full)


def _fallen_back(guard: pd.DataFrame, errors: Sequence[float]) -> pd.DataFrame:
    rows = guard[guard.action == "fall-back"]
    each = rows.merge(pd.Series(errors, name="error"), how="cross")
    reached = each.relative_error
    return _part(each.error, reached.notna(), reached, over=each.relative_cost)


def _part(
    error: pd.Series, answers: pd.Series, reached: pd.Series, over: pd.Series
) -> pd.DataFrame:
    return pd.DataFrame(
        {"error": error, "answers": answers.astype(bool), "reached": reached, "over": over}
    )


def _row(way: str, rows: pd.DataFrame) -> dict[str, Any]:
    answers = rows[rows.answers]
    return {
        "way": way,
        "error": rows.error.iloc[0],
        "runs": len(rows),
        "answers": len(answers),
        "broken": int((answers.reached > answers.error).sum()),
        "worst": (answers.reached / answers.error).max(),
        "over_own": answers.over.median(),
        "over_own_most": answers.over.max(),
    }
