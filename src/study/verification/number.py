"""Show the table cells behind a number of the manuscript (``./reproduce number NAME``)."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from pdrom.core.errors import ConfigurationError, suggestion
from pdrom.core.store import read_table, read_text
from study.artifact.paths import PAPER_INPUT, TABLE
from study.paper.build import NUMBERS
from study.paper.numbers import entries
from study.pipeline.commandline import one_line
from study.verification.subject import Subject, options_parser, say


def number(arguments: Sequence[str]) -> None:
    """Print value, table, column and rows of a number of the manuscript, from the last run."""
    parser = options_parser("number", "Show the table cells behind a number of the manuscript.")
    parser.add_argument("name", help="name of the number in paper/numbers.yaml")
    chosen = parser.parse_args(arguments)
    subject = Subject.of(chosen.configfile, chosen.config)
    found = json.loads(read_text(Path(PAPER_INPUT.at(subject.results, name=NUMBERS))))["numbers"]
    if chosen.name not in found:
        near = suggestion(chosen.name, found) or "; paper/numbers.yaml lists the numbers"
        raise ConfigurationError(f"the manuscript has no number '{chosen.name}'{near}")
    made, entry = found[chosen.name], entries(Path("paper"))[chosen.name]
    say(f"{chosen.name}: {made['text']} (unrounded: {made['value']})")
    taken = f", {made['take']} of {len(made['rows'])} rows" if made["take"] else ""
    say(f"table {made['table']}, column {made['column']}{taken}")
    path = Path(TABLE.at(subject.results, name=made["table"]))
    if path.is_file():  # tables about the configuration and the machine have no file
        columns = list(dict.fromkeys([*entry.rows, made["column"]]))
        rows = read_table(path).iloc[made["rows"]][columns]
        say(rows.rename(index=lambda row: row + 1).to_string())


if __name__ == "__main__":
    with one_line():
        number(sys.argv[1:])
