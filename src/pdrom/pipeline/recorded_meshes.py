"""The winners on large meshes, kept from a finished run of ``config/alternatives.yaml``.

``./reproduce run python -m pdrom.pipeline.recorded_meshes`` writes the file of the table
`large_meshes` anew. The study takes too long for the default run, and its times are those of one
machine, so that the record names both.
"""

from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from pdrom.core.machine import machine
from pdrom.core.paths import TABLE
from pdrom.core.store import read_table
from pdrom.pipeline.folders import folders
from pdrom.pipeline.tracked import write_tracked
from pdrom.tables.large_meshes import RECORDED

STUDY = "config/alternatives.yaml"


def recorded_meshes(winners: Path, processor: str) -> pd.DataFrame:
    """The table winners with the machine and the day on which it was made.

    Raises
    ------
    StorageError
        The table is missing or damaged.
    """
    table = read_table(winners)
    day = datetime.fromtimestamp(winners.stat().st_mtime, UTC).date().isoformat()
    return table.assign(processor=processor, date=day)


def main() -> None:
    """Record the study in its own results folder."""
    winners = Path(TABLE.at(folders([STUDY], []).results, name="winners"))
    made = recorded_meshes(winners, machine().cpu)
    write_tracked(Path(RECORDED), made.to_csv(index=False).encode())


if __name__ == "__main__":
    main()
