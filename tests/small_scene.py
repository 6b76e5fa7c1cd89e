"""A small project with a scene outside the study, and jobs of a scene that run in this process."""

from collections.abc import Iterable
from pathlib import Path

from bad_input.project import SMALL_SCENE, make_project
from pdrom.core.yamlfile import read_yaml
from study.experiments.kit.base import experiments
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.study import Study, labels_of

SCENE = "own"
CHANGES = {
    "ranks": [2, "full"],
    "sensitivity": {"perturbations": [1e-10], "seeds": [1]},
    "iterations": {"counts": [1, 2]},
    "subspace": {"bases": ["pod"], "sizes": [2], "tolerances": [1e-2]},
    "timing": {"frames": 2, "repeats": 1, "breakeven": [2], "breakeven_repeats": 5},
}


def small_study(root: Path) -> Study:
    """Study of the small project, with a scene in addition to those that it lists."""
    make_project(root, {})
    own = SMALL_SCENE.replace("name: small", f"name: {SCENE}")
    (root / "config" / "scenes" / f"{SCENE}.yaml").write_text(own, encoding="utf-8")
    config = read_yaml(root / "config" / "default.yaml")
    return Study({**config, **CHANGES}, root)


def run_jobs(study: Study, results: str, names: Iterable[str], scene: str) -> None:
    """Run every job of these experiments for a scene, in this process, as the workflow does."""
    plan = Plan(study, Folders(results))
    for name in names:
        made = experiments()[name]
        kind = max(made.writes.values(), key=lambda place: len(place.labels))
        for labels in labels_of(study.only(scene), kind):
            job = plan.job(made, labels)
            job.make(job.outputs)
