"""A small project whose scene lies outside the study, with all results that are drawn of it."""

from collections.abc import Iterator
from pathlib import Path

from bad_input.project import SMALL_SCENE, make_project
from pdrom.core.yamlfile import read_yaml
from pdrom.experiments.kit.declaration import experiments
from pdrom.model.held_out import MOTIONS
from pdrom.pipeline.resolve import Resolver
from pdrom.pipeline.study import Study

SCENE = "own"
NEEDED = (
    "mesh",
    "fom",
    "sensitivity",
    "snapshots",
    "pod",
    "reruns",
    "subspaces",
    "iterations",
    "timing",
)
CHANGES = {
    "ranks": [2, "full"],
    "sensitivity": {"perturbations": [1e-10], "seeds": [1]},
    "iterations": {"counts": [1, 2]},
    "subspace": {"bases": ["pod"], "sizes": [2], "tolerances": [1e-2]},
    "timing": {"frames": 2, "repeats": 1, "breakeven": [2], "breakeven_repeats": 5},
}


def small_study(root: Path) -> Study:
    """Study of the small project, with a scene beside those that it lists."""
    make_project(root, {})
    own = SMALL_SCENE.replace("name: small", f"name: {SCENE}")
    (root / "config" / "scenes" / f"{SCENE}.yaml").write_text(own, encoding="utf-8")
    config = read_yaml(root / "config" / "default.yaml")
    return Study.load({**config, **CHANGES}, root)


def run_jobs(study: Study, results: str) -> None:
    """Every job that the scene's artifacts need, in this process, as the workflow runs them."""
    resolver = Resolver(study, results)
    for name in NEEDED:
        for labels in _labels(study, name):
            job = resolver.job(experiments()[name], labels)
            job.make(job.outputs)


def _labels(study: Study, name: str) -> Iterator[dict[str, str]]:
    only = study.only(SCENE)
    match name:
        case "mesh":
            yield {"mesh": study.mesh_of(SCENE)}
        case "fom":
            yield from ({"scene": SCENE, "run": run} for run in ("train", *MOTIONS))
        case "sensitivity" | "iterations" | "subspaces" | "timing":
            yield {"scene": SCENE}
        case "snapshots":
            yield from ({"scene": s, "group": g} for s, g in only.experiments)
        case "pod":
            bases = {method.basis_id for method in study.methods.values()}
            found = [(s, g, b) for s, g in only.experiments for b in sorted(bases)]
            yield from ({"scene": s, "group": g, "basis": b} for s, g, b in found)
        case "reruns":
            found = [(s, g, m) for s, g in only.experiments for m in study.methods]
            yield from ({"scene": s, "group": g, "method": m} for s, g, m in found)
