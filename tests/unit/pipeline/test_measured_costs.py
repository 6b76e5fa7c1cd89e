"""The measured jobs of the cost model come out of the logs of a run."""

from pathlib import Path

import pytest

from pdrom.core.errors import PdromError
from pdrom.core.usage import Usage
from pdrom.pipeline.costs import COLUMNS, CostModel
from pdrom.pipeline.measured_costs import measured_costs
from pdrom.pipeline.plan import Plan
from pdrom.pipeline.study import Study
from places import ROOT

CONFIG = {
    "scenes": ["spring_oop"],
    "methods": ["deim"],
    "coarsen": {"resolution": 0.25, "frames": 0.05},
}


@pytest.fixture
def plan(tmp_path: Path) -> Plan:
    return Plan(Study.load(CONFIG, ROOT), str(tmp_path))


def say(plan: Plan, name: str, seconds: float, memory: float) -> None:
    """The log of a job that has ended well."""
    path = Path(plan.results, "logs", name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"date INFO pdrom: {Usage(seconds, seconds, memory)}\n", encoding="utf-8")


def test_every_log_that_says_it_is_a_row(plan: Plan) -> None:
    say(plan, "fom/spring_oop_train.log", 3.0, 210.0)
    say(plan, "reruns/spring_oop_spring_deim.log", 7.0, 250.0)
    say(plan, "tables/budget.log", 0.5, 200.0)
    table = measured_costs(plan, "paper.pdf")
    assert list(table.columns) == COLUMNS
    assert list(table.kind) == ["fom", "reruns", "table"]
    assert list(table.seconds) == [3.0, 7.0, 0.5]
    assert list(table.memory_mb) == [210, 250, 200]
    assert table.method[1] == "deim"
    assert (table.vertices[0], table.frames[0]) == (25, plan.study.scenes["spring_oop"].frames)
    model, size = CostModel(table), plan.study.size("spring_oop")
    assert model.cost("fom", size).seconds == pytest.approx(3.0)
    assert model.cost("reruns", size, "deim").seconds == pytest.approx(7.0)


def test_without_a_run_it_says_so(plan: Plan) -> None:
    with pytest.raises(PdromError, match="run the study first"):
        measured_costs(plan, "paper.pdf")
