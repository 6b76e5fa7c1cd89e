"""A title is no physical setting: who edits one makes nothing again but what prints it."""

from pathlib import Path

from bad_input.project import SCENE, STUDY, load_project, make_project
from study.pipeline.contents import labels_of

# with a page of models, which prints titles
LIVE = "live: {scenes: [small]}\nsubspace: {scenes: [small], sizes: [2]}\n"


def changed(root: Path, old: str, new: str) -> set[str]:
    """Names of what is made again when one text of the scene's file is another one."""

    def jobs() -> dict[tuple, tuple]:
        plan = load_project(root)
        made = {
            (name, *labels.values()): plan.job(experiment, labels)
            for name, experiment in plan.experiments.items()
            for labels in labels_of(plan.study, next(iter(experiment.writes.values())))
        }
        made |= {(job.artifact.name,): job for jobs in plan.fixed.values() for job in jobs}
        return {key: (job.inputs, job.settings, job.content, job.code) for key, job in made.items()}

    before, scene = jobs(), root / SCENE
    text = scene.read_text()
    assert old in text
    scene.write_text(text.replace(old, new))
    after = jobs()
    assert before.keys() == after.keys()
    return {key[0] for key in before if before[key] != after[key]}


def test_an_edited_title_plans_only_what_prints_it(tmp_path: Path) -> None:
    root = make_project(tmp_path, {})
    (root / STUDY).write_text((root / STUDY).read_text() + LIVE)
    assert changed(root, "title: A small sheet", "title: Another one") == {"live"}


def test_an_edited_weight_plans_the_simulation(tmp_path: Path) -> None:
    root = make_project(tmp_path, {})
    found = changed(root, "weight: 1.0e+5", "weight: 2.0e+5")
    assert {"fom", "timing", "sensitivity"} <= found
    assert "mesh" not in found
