"""Table asks_cost: what asked errors cost, by size of the ask, beside what else there is."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from pdrom.artifact.reads import TableOf
from pdrom.tables.kit.declaration import compared, integer, number, table, text, timed

LARGE = 2000  # vertices from which on a scene counts as large


@table(
    title="Promises kept and broken, and their time over that of the full order",
    columns=(
        text("scenes", "large: of at least 2,000 vertices; small: the others"),
        compared("exact", number("asked", "largest relative error asked for")),
        integer("asks", "scenes times motions"),
        compared("share", integer("promised", "of these, runs that say that they keep to it")),
        compared(
            "share", integer("judged", "of these, with frames enough to tell whether it holds")
        ),
        compared("share", integer("broken", "of these, runs whose error is above the ask")),
        compared("share", integer("reduced", "judged promises kept with a reduction")),
        compared("share", integer("full_broken", "promises that the full order alone would break")),
        compared("error", number("worst", "largest error of a judged promise over the ask")),
        timed(number("over_full", "median time over the cheapest full order of the same promise")),
        timed(number("over_full_most", "largest one")),
        timed(number("over_own", "median time over the scene's own iterations")),
        timed(number("over_own_most", "largest one")),
        timed(number("full_over_own", "median time of that cheapest full order, likewise")),
        timed(number("oracle_over_own", "median time of the best choice by hindsight, likewise")),
    ),
    reads={"asks": TableOf("asks")},
)
def asks_cost(asks: pd.DataFrame) -> pd.DataFrame:
    """A row for each size of scene and each ask of the table ``asks``."""
    return pd.DataFrame(list(_rows(asks)))


def _rows(asks: pd.DataFrame) -> Iterator[dict[str, Any]]:
    large = asks.vertices >= LARGE
    for name, part in (("small", asks[~large]), ("large", asks[large])):
        for asked, own in part.groupby("asked", sort=False):
            promised = own[own.promised.astype(bool)]
            judged = promised[promised.judged.astype(bool)]
            yield {
                "scenes": name,
                "asked": asked,
                "asks": len(own),
                "promised": len(promised),
                "judged": len(judged),
                "broken": int(judged.broken.sum()),
                "reduced": int((judged.reduced & ~judged.broken).sum()),
                "full_broken": int((judged.full_error > judged.asked).sum()),
                "worst": (judged.error / judged.asked).max(),
                "over_full": (promised.ms_per_frame / promised.full_ms).median(),
                "over_full_most": (promised.ms_per_frame / promised.full_ms).max(),
                "over_own": (promised.ms_per_frame / promised.own_ms).median(),
                "over_own_most": (promised.ms_per_frame / promised.own_ms).max(),
                "full_over_own": (promised.full_ms / promised.own_ms).median(),
                "oracle_over_own": (promised.oracle_ms / promised.own_ms).median(),
            }
