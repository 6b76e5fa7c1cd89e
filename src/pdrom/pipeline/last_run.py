"""The configuration of the last run, which the report is to show."""

import json
from pathlib import Path

from pdrom.core.store import atomic_path
from pdrom.pipeline.commandline import CommandLine, options

RECORD = Path(".snakemake/last_run.json")


def remember(command: CommandLine) -> None:
    """Note which configuration runs."""
    text = json.dumps({"configfiles": command.configfiles, "settings": command.settings})
    with atomic_path(RECORD) as path:
        path.write_text(text + "\n", encoding="utf-8")


def recall() -> list[str]:
    """Options that name the configuration of the last run; none of the default one or of no run."""
    try:
        record = json.loads(RECORD.read_text(encoding="utf-8"))
        return options(map(str, record["configfiles"]), map(str, record["settings"]))
    except (OSError, ValueError, KeyError, TypeError):
        return []
