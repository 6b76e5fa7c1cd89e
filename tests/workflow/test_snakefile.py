"""Plans of the workflow: from nothing, for one figure, after edits, with faults.

A start of Snakemake takes seconds, so that each plan answers several questions.
"""

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
import sandbox
import yaml
from checkout import Checkout, Made, copy_repository, only_line
from sandbox import MICRO_FILE

from places import MICRO_MANUSCRIPT, MICRO_RESULTS
from study.figures.kit.declaration import declarations
from study.pipeline.running import hold
from study.tables import declared

MICRO = sandbox.MICRO | {
    "scenes": ["spring_oop", "strain_oop", "bar_release"],
    "methods": ["deim", "block-deim"],
    "ranks": [4, "full"],
    "subspace": {"scenes": ["strain_oop"], "sizes": [4], "tolerances": [1e-2]},
}
# Folders of results that belong to no single scene.
SHARED = ("tables", "figures", "paper", "article", "hard_cases", "frame_times")
KINDS = ("pdf", "png")  # files of a figure, for pages and for the report
EDITED = ("workflow", "config", "paper", "src", "Snakefile", MICRO_FILE)
DAY_NS = 86_400 * 10**9
MICRO_ARGUMENTS = ("--configfile", MICRO_FILE)
SPRING, SCRIPT = "src/pdrom/model/constraints/spring.py", "workflow/scripts/artifact.py"
OUTSIDE = f"{MICRO_RESULTS}/fom/bar140/train.h5"
PAGE = f"{MICRO_RESULTS}/article/live.html"
ARTICLE = f"{MICRO_RESULTS}/article/index.html"
TARGETS = (MICRO_MANUSCRIPT, PAGE, ARTICLE, OUTSIDE)


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    return copy_repository(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="module")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy whose micro study counts as finished."""
    checkout = copy_repository(tmp_path_factory.mktemp("finished"))
    (checkout.folder / MICRO_FILE).write_text(yaml.safe_dump(MICRO), encoding="utf-8")
    checkout.count_as_finished(*MICRO_ARGUMENTS)
    checkout.count_as_finished(*MICRO_ARGUMENTS, "--", OUTSIDE)
    return checkout


@pytest.fixture(scope="module")
def plan(finished_once: Checkout) -> dict[str, Made]:
    """Files of the finished study and their inputs, before any edit."""
    rows = finished_once.summary(*MICRO_ARGUMENTS, "--", *TARGETS)
    assert {row.plan for row in rows} == {"no update"}, "nothing to be done"
    return {row.file: row for row in rows}


def needed(plan: dict[str, Made], *targets: str) -> set[str]:
    """Files that must be made for the targets, with the targets."""
    found: set[str] = set()
    waiting = list(targets)
    while waiting:
        made = plan.get(waiting.pop())
        if made is not None and made.file not in found:
            found |= {m.file for m in plan.values() if (m.rule, m.log) == (made.rule, made.log)}
            waiting += made.inputs
    return found


@pytest.fixture
def finished(finished_once: Checkout, plan: dict[str, Made]) -> Iterator[Checkout]:
    """The finished copy; edits, new files and dates of a test are undone."""
    parts = (*EDITED, "results")
    before = {p: (p.read_bytes(), p.stat()) for p in finished_once.files(*parts)}
    yield finished_once
    for path in set(finished_once.files(*parts)) - set(before):
        path.unlink()
    for path, (content, stat) in before.items():
        if path.read_bytes() != content:
            path.write_bytes(content)
        os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def test_a_fresh_clone_plans_the_complete_study_during_a_run_and_starts_none(clean, monkeypatch):
    """It plans tables, figures and finally the manuscript. This process holds the lock."""
    monkeypatch.chdir(clean.folder)
    descriptor = hold()
    done = clean.snakemake("-n")
    refused = only_line(clean.snakemake("results/fom/bar140/train.h5").stderr)
    os.close(descriptor)
    assert f"another run (process {os.getpid()} on " in refused
    assert done.returncode == 0, done.stderr
    log = done.stdout + done.stderr
    assert "Paper paper/main.pdf" in log
    total = int(re.search(r"^total +(\d+)$", log, re.MULTILINE)[1])
    assert total > 100
    assert re.search(r"^pdrom: expected time: about \d+ min, 1 core$", log, re.MULTILINE)
    missing = re.findall(r"Missing output files: ([^;\n]*)", log)
    made = {path for files in missing for path in files.split(", ")}
    wanted = {f"results/tables/{name}.csv" for name in declared()}
    wanted |= {f"results/figures/{name}.{kind}" for name in declarations() for kind in KINDS}
    assert wanted | {"paper/main.pdf", "paper/supplement.pdf"} <= made


def test_one_figure_needs_only_its_inputs(clean):
    figure = "results/figures/spring_runs.pdf"
    planned = clean.planned(figure)
    assert {p for p in planned if _stage(p) == "figures"} == {figure, figure[:-3] + "png"}
    stages = {_stage(path) for path in planned} - {"figures", "meshes"}
    assert stages == {
        "fom", "converged", "snapshots", "pod", "sampling", "reruns", "sensitivity",
        "contributions",
    }  # fmt: skip
    assert _scenes(p for p in planned if _stage(p) in stages) == {"spring_stretch", "spring_twist"}


def test_a_scene_outside_the_study_is_run_if_its_file_is_requested(plan):
    made = needed(plan, OUTSIDE)
    (mesh,) = (path for path in made if _stage(path) == "meshes")
    assert _below(mesh)[1].startswith("bar_")
    assert _scenes(made - {mesh}) == {"bar140"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("-n", "figure_scalign"), "did you mean 'figure_scaling'?"),
        (("--config", 'scenes=["../x"]'), "configuration (config/default.yaml): scenes.0 = '../x'"),
    ],
)
def test_a_file_that_no_rule_makes_is_refused(arguments, words, clean):
    assert words in only_line(clean.snakemake(*arguments).stderr)
    assert not (clean.folder / "results").exists()


def test_options_of_snakemake_work_as_its_manual_says(clean, tmp_path):
    assert clean.looks("--lint").returncode == 0
    (tmp_path / "config.yaml").write_text("cores: 1\ndry-run: true\n")
    target = ("--", "results/fom/bar140/train.h5")
    said = clean.looks("--profile", str(tmp_path), *target)
    assert said.returncode == 0, said.stderr
    assert "fom" in clean.looks("--list-rules").stdout.splitlines()
    for option in ("--dag", "--rulegraph"):
        done = clean.snakemake(option, *target)
        assert done.stdout.startswith("digraph"), done.stderr
        assert len(re.findall(r'label = "(?:fom|mesh)', done.stdout)) == 2


TEMPLATE = "__use_yte__: templates are not allowed"


@pytest.mark.parametrize(
    ("path", "own", "words"),
    [
        ("config/default.yaml", False, f"config/default.yaml: {TEMPLATE}"),
        ("own.yaml", True, f"own.yaml: {TEMPLATE}"),
        ("none.yaml", True, "none.yaml: no such configuration file"),
    ],
)
def test_a_broken_file_ends_the_command_with_one_line(finished, path, own, words):
    """A file that Snakemake reads, one that the plan reads, those that ``./reproduce`` checks.

    `bad_input.test_bad_input` tests all other faults without a process.
    """
    if path != "none.yaml":
        with open(finished.folder / path, "a", encoding="utf-8") as file:
            file.write("\n__use_yte__: true\n")
    program, asked = ("study.pipeline.front", ("--configfile", path)) if own else ("snakemake", ())
    done = finished.snakemake(*asked, program=("-m", program))
    (finished.folder / "own.yaml").unlink(missing_ok=True)
    assert done.returncode != 0
    assert only_line(done.stdout + done.stderr).startswith(f"pdrom: {words}")


ENTRY = '    {\n        "fall": "pdrom.model.effects.forces:Gravity",\n'


def test_changed_texts_and_dates_rerun_no_job(finished):
    """Neither does another number of cores, a new name of an effect, or one that no scene lists.

    All sources are newer than the results; then all results are newer than the current time.
    """
    finished.edit(SPRING, '"""Edge springs:', '"""Springs along edges:')
    finished.edit(SPRING, "    # edges are scaled, so that ", "    # edges are divided, so that ")
    finished.edit(SCRIPT, "    make(", "    # the job\n    make(")
    poke = "src/pdrom/model/effects/poke.py"
    finished.edit(poke, "self._order[turn : ", "self._order[0 + turn : ")
    finished.edit("src/pdrom/model/effects/__init__.py", "    {\n", ENTRY)
    finished.register(*SELECTION)
    for late in (EDITED, ("results",)):
        for path in finished.files(*late):
            stat = path.stat()
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 3 * DAY_NS))
        assert finished.planned("--cores", "3", *MICRO_ARGUMENTS) == set()


def replanned(checkout: Checkout, *edit: str) -> set[str]:
    """Files that are made again after an edit: file, old text, new text."""
    checkout.edit(*edit)
    return checkout.planned(*MICRO_ARGUMENTS)


def test_an_edit_of_the_script_reruns_every_job(finished, plan):
    old, new = "code=snakemake.params.code", "code=str(snakemake.params.code)"
    wanted = [needed(plan, target) for target in (MICRO_MANUSCRIPT, PAGE, ARTICLE)]
    assert replanned(finished, SCRIPT, old, new) == set[str]().union(*wanted)


@pytest.mark.parametrize(
    ("edit", "scene"),
    [
        ((SPRING, "LOW, HIGH = 1e-280", "LOW, HIGH = 1e-281"), "spring_oop"),
        (("config/scenes/strain_oop.yaml", "  - {effect: floor}\n", ""), "strain_oop"),
    ],
    ids=["kernel", "effect that was listed"],
)
def test_an_edit_of_a_scene_reruns_that_scene_and_the_files_made_from_it(finished, edit, scene):
    planned = replanned(finished, *edit)
    per_scene = {p for p in planned if _stage(p) not in SHARED}
    assert _scenes(per_scene) == {scene}
    stages = {"fom", "snapshots", "pod", "sampling", "reruns", "sensitivity", "timings"}
    assert {_stage(p) for p in per_scene} >= stages
    assert MICRO_MANUSCRIPT in planned


CLAIMS = ("claims", "claims_sensitivity", "claims_tests", "replication")
MAP = "src/study/figures/stability_map.py"


@pytest.mark.parametrize(
    ("edit", "files"),
    [
        (
            ("config/claims.yaml", "threshold: 0.7", "threshold: 0.71"),
            {f"tables/{name}.csv" for name in CLAIMS},
        ),
        ((MAP, "at nearly every basis size", "at most sizes"), set()),
    ],
    ids=["threshold of a claim", "caption"],
)
def test_an_edit_of_a_text_reruns_only_files_that_show_it_and_the_manuscript(finished, edit, files):
    planned = replanned(finished, *edit)
    others = {path for path in planned if _stage(path) not in ("paper", "article")}
    assert others == {f"{MICRO_RESULTS}/{file}" for file in files}
    assert MICRO_MANUSCRIPT in planned


# Registry, entry, module and its code.
SELECTION = (
    "src/pdrom/reduction/method.py", "first:First", "pdrom.reduction.sampling.first",
    '''"""The first blocks."""

import numpy as np

from pdrom.reduction.sampling.deim import Selection


class First(Selection):
    def one_a_mode(self, v, size, ranks):
        return {r: np.arange(min(r, len(v) // size)) for r in ranks}
''',
)  # fmt: skip


def _below(path: str) -> list[str]:
    """Parts of a path below the results of its study."""
    inside = f"{MICRO_RESULTS}/" if path.startswith(MICRO_RESULTS) else "results/"
    return path.removeprefix(inside).split("/")


def _stage(path: str) -> str:
    """Folder below the results, "paper" for the manuscript."""
    return _below(path)[0]


def _scenes(paths: Iterable[str]) -> set[str]:
    return {Path(_below(path)[1]).stem.removesuffix("_scores") for path in paths}
