"""contents.md: what a finished study holds, for readers of its results.

Every claim, figure, table and section with the command that makes it and what this took, then the
captions of the figures and the columns of the tables.
"""

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import pandas as pd

from study.paper.document import figures_page
from study.tables import declared
from study.tables.kit.document import document

HEAD = """\
# Contents

Written by the run of {configuration}.
Minutes are processor time from nothing, empty where a job was not measured by this run.

| kind | name | command | minutes | as published | beyond |
|---|---|---|---|---|---|
"""


def contents(made: pd.DataFrame, root: Path = Path()) -> str:
    """Text of the page from the rows of `claim_map`; ``root`` has the manuscript's source."""
    lines = (_line(row) for row in made.to_dict("records"))
    head = HEAD.format(configuration=made.configuration.iloc[0])
    return "\n".join(
        [head + "\n".join(lines) + "\n", figures_page(root), document(declared().values())]
    )


def _line(row: dict[Hashable, Any]) -> str:
    minutes = "" if pd.isna(row["minutes"]) else f"{row['minutes']:.1f}"
    verdicts = ["" if pd.isna(row[k]) else row[k] for k in ("verdict", "verdict_beyond")]
    cells = (row["kind"], row["name"], f"`{row['command']}`", minutes, *verdicts)
    return f"| {' | '.join(cells)} |"
