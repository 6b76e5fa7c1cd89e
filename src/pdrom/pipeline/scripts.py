"""Scripts of the workflow count by what they say, not by their dates.

Snakemake runs every job again whose script is younger than its results, as all scripts are after a
wrong clock or a copy. Here the code of a script, without comments, is a parameter of its rule.
"""

import ast
from hashlib import sha256
from pathlib import Path
from typing import Any

from snakemake.settings.types import RerunTrigger

FOLDER = Path("workflow/scripts")


def track_scripts(workflow: Any) -> None:
    """Give the rules of Snakemake's workflow their scripts as parameters, in place of dates."""
    for rule in workflow.rules:
        if rule.script:
            rule.set_params(script=_digest(FOLDER / Path(rule.script).name))
    # the settings that it is computed from come after the rules were read
    type(workflow).rerun_triggers = property(_triggers)


def _triggers(workflow: Any) -> frozenset[RerunTrigger]:
    return frozenset(workflow.dag_settings.rerun_triggers) - {RerunTrigger.CODE}


def _digest(script: Path) -> str:
    tree = ast.parse(script.read_text(encoding="utf-8"))
    return sha256(ast.dump(tree).encode()).hexdigest()[:16]
