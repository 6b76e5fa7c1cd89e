"""Tables of a scene that ``pdrom advise`` reads, with the columns of the study's."""

from collections.abc import Mapping

from pdrom.core.paths import CONTRIBUTIONS, EFFECTS, ITERATIONS, LEFT_OUT, TIMINGS
from pdrom.core.store import read_table, write_table
from pdrom.report.scenes.results import SceneResults
from pdrom.tables.accuracy_cost import accuracy_cost
from pdrom.tables.effects_contribution import effects_contribution
from pdrom.tables.kit.one_time import NOT_TIMED


def make(results: SceneResults, outputs: Mapping[str, str]) -> None:
    """Write what each effect does, and errors and times of every setting."""
    effects = effects_contribution(
        [results.file(CONTRIBUTIONS)],
        results.table("sensitivity"),
        results.settings["sensitivity.reference"],
        results.settings["sensitivity.threshold"],
        read_table(results.file(EFFECTS).path),
        read_table(results.file(LEFT_OUT).path),
    )
    write_table(effects, outputs["effects"])
    costs = accuracy_cost(
        results.table("reduced_reruns"),
        [results.file(TIMINGS)],
        NOT_TIMED,
        [results.file(ITERATIONS)],
        {results.scene: int(results.settings["iterations"])},
    )
    write_table(costs, outputs["costs"])
