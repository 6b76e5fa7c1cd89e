"""A plan names exactly the results that are missing, damaged or from another job."""

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import checksum_path
from pdrom.core.store.checksum import damaged_set_aside
from small_scene import SCENE, run_jobs, small_study
from study.artifact.artifact import recorded
from study.artifact.paths import BASIS, CONTRIBUTIONS, HELDOUT, SENSITIVITY, SNAPSHOTS, TRAIN
from study.pipeline.folders import Folders
from study.pipeline.plan import Plan
from study.pipeline.study import Study, labels_of
from study.pipeline.unfit import CHANGED, DAMAGED, FOREIGN, MISSING, STALE, Checked, faults, needed

RESULTS, JOBS = "results/studies/s", ("mesh", "fom", "sensitivity", "snapshots", "pod")
SCENES, GROUP = (SCENE, "small"), "spring"
RUN, SNAPSHOT, ROWS = (
    place.at(RESULTS, scene=SCENE, group=GROUP) for place in (TRAIN, SNAPSHOTS, SENSITIVITY)
)
FOLLOWING = {SNAPSHOT, ROWS, CONTRIBUTIONS.at(RESULTS, scene=SCENE)}  # are made from `RUN`


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return small_study(tmp_path_factory.mktemp("made"))


@pytest.fixture(scope="module")
def made(study):
    """A folder with all results of two scenes, from their meshes to bases."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(study.root)
        for scene in SCENES:
            run_jobs(study, RESULTS, JOBS, scene)
    return study.root


@pytest.fixture
def plan(made, study, tmp_path, monkeypatch):
    """A copy of the folder that a test may damage, as the working folder, and its plan."""
    monkeypatch.chdir(shutil.copytree(made, tmp_path / "copy"))
    return Plan(study, Folders(RESULTS))


def targets(study: Study) -> list[str]:
    kinds, only = (BASIS, SENSITIVITY), [study.only(scene) for scene in SCENES]
    return [
        kind.at(RESULTS, **labels) for kind in kinds for s in only for labels in labels_of(s, kind)
    ]


def unfit(plan: Plan) -> dict[str, str]:
    return faults(plan, targets(plan.study))


def flip(path: Path) -> None:
    """Change one bit and keep size and date."""
    stat, content = path.stat(), bytearray(path.read_bytes())
    content[-9] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def other(path: Path) -> Path:
    """The file of the same kind of the other scene."""
    return Path(str(path).replace(f"/{SCENE}", "/small"))


def copy_with_checksum(path: Path) -> None:
    shutil.copy2(other(path), path)
    if path.suffix == ".csv":
        shutil.copy2(checksum_path(other(path)), checksum_path(path))


def link(path: Path) -> None:
    path.unlink()
    path.symlink_to(other(path).absolute())


def lose_checksum(path: Path) -> None:
    if path.suffix == ".h5":
        path.write_bytes(bytes(2048) + path.read_bytes()[2048:])
    else:
        checksum_path(path).unlink()


DAMAGES = {
    "lost": (Path.unlink, MISSING),
    "flipped": (flip, DAMAGED),
    "cut": (lambda path: path.write_bytes(path.read_bytes()[:-30]), DAMAGED),
    "without checksum": (lose_checksum, DAMAGED),
    "dead link": (lambda path: (path.unlink(), path.symlink_to("nowhere")), DAMAGED),
    "link": (link, FOREIGN),
    "copy": (copy_with_checksum, FOREIGN),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_the_plan_names_the_damaged_file_and_its_reader_renames_it(damage, plan):
    """The file is made again, and so are the files that follow, because a run contains times."""
    assert unfit(plan) == {}
    do, fault = DAMAGES[damage]
    for name in (RUN, SNAPSHOT):
        do(Path(name))
        assert unfit(plan) == {name: fault}
        jobs = needed(plan, targets(plan.study))
        reader = next(job for job in jobs.values() if name in job.results)
        with damaged_set_aside(), pytest.raises(StorageError, match=name):
            reader.make(reader.outputs)
        assert unfit(plan) == {name: MISSING}
        jobs[name].make(jobs[name].outputs)
        assert set(unfit(plan)) == (FOLLOWING if name == RUN else set())
        for path in unfit(plan):
            jobs[path].make(jobs[path].outputs)


def test_results_of_another_run_of_older_code_or_of_other_inputs_are_noticed(plan):
    heldout = HELDOUT.at(RESULTS, scene=SCENE)
    shutil.copy2(RUN, heldout)
    assert unfit(plan) == {heldout: FOREIGN}
    jobs = needed(plan, targets(plan.study))
    for code, fault in {"0ld": {CHANGED}, jobs[RUN].code: {STALE}}.items():
        replace(jobs[RUN], code=code).make(jobs[RUN].outputs)
        assert set(unfit(plan).values()) == fault
    for path in unfit(plan):
        jobs[path].make(jobs[path].outputs)
    assert unfit(plan) == {}
    job = jobs[SNAPSHOT]
    with recorded(job.artifact, job.settings, job.labels, job.code, job.content, ["other inputs"]):
        job.artifact.perform(job.settings, job.inputs, job.outputs)
    assert unfit(plan) == {SNAPSHOT: STALE}


def test_bytes_are_compared_again_only_after_a_change_or_found_damage(plan, monkeypatch):
    for damaged in (5, [], [[], 5], [[], {"digest": ""}]):
        Path(RESULTS, ".checked.json").write_text(json.dumps({RUN: damaged}))
        assert unfit(plan) == {}
    monkeypatch.setattr("study.pipeline.unfit.check_file", None)
    assert unfit(plan) == {}
    checked = Checked(RESULTS)
    checked.distrust([RUN])
    checked.save()
    assert unfit(plan) == {RUN: DAMAGED}
