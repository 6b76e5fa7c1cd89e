"""What the workflow plans: from nothing, for one figure, after edits, with faults."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from checkout import Checkout, copy_repository

from pdrom.pipeline.graph import Graph
from pdrom.pipeline.running import hold
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.tables import declared
from pdrom.verification.subject import Subject
from places import MICRO_MANUSCRIPT, MICRO_RESULTS

MICRO = {
    "scenes": ["spring_oop", "strain_oop", "bar_release"],
    "methods": ["deim", "block-deim"],
    "ranks": [4, "full"],
    "heldout_ranks": ["full"],
    "coarsen": {"resolution": 0.25, "frames": 0.05},
    "sensitivity": {"perturbations": [1e-10], "seeds": [1]},
    "subspace": {"scenes": ["strain_oop"], "sizes": [4], "tolerances": [1e-2]},
}
# Folders of results that belong to no single scene.
SHARED = (
    "tables", "figures", "paper", "hard_cases", "guard", "offline", "frame_times", "roofline",
)  # fmt: skip
MICRO_FILE = "micro.yaml"
DAY_NS = 86_400 * 10**9
MICRO_ARGUMENTS = ("--configfile", MICRO_FILE)


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy in which nothing was ever run."""
    return copy_repository(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="module")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy whose micro study counts as finished."""
    checkout = copy_repository(tmp_path_factory.mktemp("finished"))
    (checkout.folder / MICRO_FILE).write_text(yaml.safe_dump(MICRO), encoding="utf-8")
    checkout.count_as_finished(*MICRO_ARGUMENTS)
    return checkout


@pytest.fixture
def finished(finished_once: Checkout) -> Iterator[Checkout]:
    """The finished copy; edits of the test are taken back."""
    folders = [finished_once.folder / name for name in ("src", "config", "workflow")]
    files = [p for f in folders for p in f.rglob("*") if p.suffix in (".py", ".yaml")]
    before = {path: (path.read_bytes(), path.stat()) for path in files}
    yield finished_once
    for path, (content, stat) in before.items():
        if path.read_bytes() != content:
            path.write_bytes(content)
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def test_the_graph_of_the_plan_is_snakemakes(
    finished: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = finished.snakemake("-n", "--summary", *MICRO_ARGUMENTS)
    rows = [line.split("\t") for line in done.stdout.splitlines() if "\t" in line]
    monkeypatch.chdir(finished.folder)
    plan = Subject.of([MICRO_FILE], []).plan
    needed = Graph(plan, MICRO_MANUSCRIPT).needed([MICRO_MANUSCRIPT])
    # columns: file, date, rule, log
    assert {(file, job.rule, job.log) for job in needed for file in job.outputs} == {
        (row[0], row[2], row[3]) for row in rows[1:]
    }


def test_a_fresh_clone_plans_the_whole_study(clean: Checkout) -> None:
    done = clean.snakemake("-n")
    assert done.returncode == 0, done.stderr
    log = done.stdout + done.stderr
    assert "Nothing to be done" not in log
    assert "Manuscript paper/main.pdf" in log
    total = int(re.search(r"^total +(\d+)$", log, re.MULTILINE)[1])
    assert total > 100
    told = rf"pdrom: {total} jobs, about \d+ min on 1 core, about \d+ min of processor time"
    assert re.fullmatch(told, done.stdout.splitlines()[-1])


def test_another_snakemake_is_told_where_the_package_is(clean: Checkout, tmp_path: Path) -> None:
    """One that has all packages of the lock file, but not this project's."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path], check=True)
    locked = Path(sysconfig.get_path("purelib"))
    own = tmp_path / locked.relative_to(sys.prefix)
    (own / "locked.pth").write_text(f"{locked}\n", encoding="utf-8")
    shutil.move(clean.folder / "src", clean.folder / "moved")
    try:
        done = clean.looks("-n", python=tmp_path / "bin" / "python")
    finally:
        shutil.move(clean.folder / "moved", clean.folder / "src")
    assert "has no package pdrom: use ./reproduce, or .venv/bin/snakemake" in only_line(done)


def test_the_default_target_is_the_manuscript_with_declared_and_figures(clean: Checkout) -> None:
    planned = clean.planned()
    figures = declarations()
    wanted = {f"results/tables/{name}.csv" for name in declared()}
    wanted |= {f"results/figures/{name}.{kind}" for name in figures for kind in ("pdf", "png")}
    assert wanted | {"paper/main.pdf"} <= planned


def test_one_figure_needs_no_more_than_its_own_inputs(clean: Checkout) -> None:
    """No table of the whole study, and of the scenes only the two that it draws."""
    figure = "results/figures/spring_runs.pdf"
    planned = clean.planned(figure)
    assert {p for p in planned if _stage(p) == "figures"} == {figure, figure[:-3] + "png"}
    stages = {_stage(path) for path in planned} - {"figures", "meshes"}
    assert stages == {
        "fom", "snapshots", "pod", "sampling", "reruns", "sensitivity", "contributions",
    }  # fmt: skip
    scenes = {_below(p)[1].removesuffix(".csv") for p in planned if _stage(p) in stages}
    assert scenes == {"spring_stretch", "spring_twist"}


def only_line(done: subprocess.CompletedProcess[str]) -> str:
    """The one line that says why nothing was planned."""
    assert done.returncode != 0
    assert "Traceback" not in done.stdout + done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("pdrom: ")]
    return line


def test_a_scene_outside_the_study_is_run_for_its_own_file(clean: Checkout) -> None:
    target = "results/fom/bar140/train.h5"
    mesh, run = sorted(clean.planned(target), reverse=True)
    assert mesh.startswith("results/meshes/bar_")
    assert run == target


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("results/tabels/scaling.csv", "did you mean 'results/tables/scaling.csv'?"),
        ("results/fom/bar_relaese/train.h5", "did you mean 'bar_release'?"),
        ("figure_scalign", "did you mean 'figure_scaling'?"),
    ],
)
def test_a_misspelt_target_gets_a_suggestion(target: str, words: str, clean: Checkout) -> None:
    assert words in only_line(clean.snakemake("-n", target))


def test_a_report_of_no_results_is_refused(clean: Checkout) -> None:
    line = only_line(clean.snakemake("--report", "report.html"))
    assert "report: this configuration has no paper/main.pdf" in line


def test_one_run_at_a_time_and_plans_beside_it(
    clean: Checkout, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(clean.folder)
    descriptor = hold()
    try:
        line = only_line(clean.snakemake("results/fom/bar140/train.h5"))
        assert f"another run (process {os.getpid()} on " in line
        assert clean.planned("results/fom/bar140/train.h5")
    finally:
        os.close(descriptor)


def test_nothing_to_do_when_finished(finished: Checkout) -> None:
    done = finished.snakemake("-n", *MICRO_ARGUMENTS)
    assert "Nothing to be done" in done.stdout + done.stderr


def test_another_number_of_cores_reruns_nothing(finished: Checkout) -> None:
    assert finished.planned("--cores", "3", *MICRO_ARGUMENTS) == set()


def test_comments_and_docstrings_rerun_nothing(finished: Checkout) -> None:
    spring = "src/pdrom/model/constraints/spring.py"
    finished.edit(spring, '"""Edge springs:', '"""Springs along edges:')
    finished.edit(spring, "    # scaled: ", "    # divided: ")
    script = "workflow/scripts/experiment.py"
    finished.edit(script, "settings = ", "# what it depends on\nsettings = ")
    assert finished.planned(*MICRO_ARGUMENTS) == set()


def test_a_clock_that_ran_back_reruns_nothing(finished: Checkout) -> None:
    """All sources are younger than the results, or all of them younger than now."""
    parts = ("workflow", "config", "paper", "src", "Snakefile", MICRO_FILE)
    sources = [p for part in parts for p in _files(finished.folder / part)]
    results = _files(finished.folder / "results")
    before = {path: path.stat() for path in (*sources, *results)}
    try:
        for late in (sources, results):
            for path in late:
                stat = before[path]
                os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + 3 * DAY_NS))
            assert finished.planned(*MICRO_ARGUMENTS) == set()
    finally:
        for path, stat in before.items():
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def _files(path: Path) -> list[Path]:
    return [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]


def test_an_edited_script_reruns_what_it_makes(finished: Checkout) -> None:
    finished.edit("workflow/scripts/paper.py", "list(snakemake.input.figures)", "[]")
    assert finished.planned(*MICRO_ARGUMENTS) == {MICRO_MANUSCRIPT}


def test_a_kernel_reruns_the_scenes_that_use_it_and_what_follows(finished: Checkout) -> None:
    finished.edit(
        "src/pdrom/model/constraints/spring.py", "LOW, HIGH = 1e-280", "LOW, HIGH = 1e-281"
    )
    planned = finished.planned(*MICRO_ARGUMENTS)
    per_scene = {p for p in planned if _stage(p) not in SHARED}
    assert {Path(_below(p)[1]).stem for p in per_scene} == {"spring_oop"}
    stages = {"fom", "snapshots", "pod", "sampling", "reruns", "sensitivity", "timings"}
    assert {_stage(p) for p in per_scene} >= stages
    assert MICRO_MANUSCRIPT in planned


def test_a_threshold_of_a_claim_reruns_verdicts_and_manuscript_only(finished: Checkout) -> None:
    finished.edit("config/claims.yaml", "threshold: 0.7", "threshold: 0.71")
    planned = finished.planned(*MICRO_ARGUMENTS)
    assert MICRO_MANUSCRIPT in planned
    others = {p for p in planned if _stage(p) != "paper"}
    figure = {f"{MICRO_RESULTS}/figures/claims_sensitivity.{kind}" for kind in ("pdf", "png")}
    tables = {
        f"{MICRO_RESULTS}/tables/{name}.csv"
        for name in ("claims", "claims_sensitivity", "claims_tests")
    }
    assert others == tables | figure


def test_a_caption_rerenders_its_figure_and_the_manuscript_only(finished: Checkout) -> None:
    source = "src/pdrom/report/figures/singular_values.py"
    finished.edit(source, 'Decay of the singular values"', 'Singular values"')
    planned = finished.planned(*MICRO_ARGUMENTS)
    figure = {f"{MICRO_RESULTS}/figures/singular_values.{kind}" for kind in ("pdf", "png")}
    assert {path for path in planned if _stage(path) != "paper"} == figure
    assert MICRO_MANUSCRIPT in planned


def test_a_scene_reruns_alone(finished: Checkout) -> None:
    finished.edit("config/scenes/strain_oop.yaml", "weight: 1.0e+7", "weight: 2.0e+7")
    planned = finished.planned(*MICRO_ARGUMENTS)
    per_scene = {p for p in planned if _stage(p) not in SHARED}
    assert {Path(_below(p)[1]).stem for p in per_scene} == {"strain_oop"}


def test_a_removed_effect_reruns_the_scene_that_listed_it(finished: Checkout) -> None:
    """And an edited one that no scene of this study lists, none."""
    finished.edit("config/scenes/strain_oop.yaml", "  - {effect: floor}\n", "")
    finished.edit("src/pdrom/model/effects/poke.py", "phase == 0", "phase <= 0")
    planned = finished.planned(*MICRO_ARGUMENTS)
    per_scene = {p for p in planned if _stage(p) not in SHARED}
    assert {Path(_below(p)[1]).stem for p in per_scene} == {"strain_oop"}


SCENE = "config/scenes/spring_oop.yaml"
SELECTION = '''"""The first blocks."""

import numpy as np

from pdrom.reduction.sampling.selection import Selection


class First(Selection):
    def one_a_mode(self, v, size, ranks):
        return {r: np.arange(min(r, len(v) // size)) for r in ranks}
'''
EFFECT = '''"""Nothing at all."""

from pdrom.model.effects.gravity import Gravity


class Nothing(Gravity):
    pass
'''


def _registered(checkout: Checkout, registry: str, entry: str, module: str, code: str) -> Path:
    """Register ``entry`` (a name and a class) of a new module, before the first one."""
    name, attribute = entry.split(":")
    path = checkout.folder / "src" / Path(*module.split(".")).with_suffix(".py")
    path.write_text(code, encoding="utf-8")
    checkout.edit(registry, "    {\n", f'    {{\n        "{name}": "{module}:{attribute}",\n')
    return path


def test_registering_an_effect_reruns_nothing(finished: Checkout) -> None:
    module = "pdrom.model.effects.nothing"
    registry = "src/pdrom/model/effects/__init__.py"
    path = _registered(finished, registry, "nothing:Nothing", module, EFFECT)
    try:
        assert finished.planned(*MICRO_ARGUMENTS) == set()
    finally:
        path.unlink()


def test_registering_a_selection_reruns_the_methods_that_use_it(finished: Checkout) -> None:
    module = "pdrom.reduction.sampling.first"
    registry = "src/pdrom/reduction/selections.py"
    path = _registered(finished, registry, "first:First", module, SELECTION)
    try:
        assert finished.planned(*MICRO_ARGUMENTS) == set()
        # one method of the study takes it
        finished.edit(
            "config/methods.yaml",
            "rows: element, selection: greedy, solve: qr}",
            "rows: element, selection: first, solve: qr}",
        )
        planned = finished.planned(*MICRO_ARGUMENTS)
    finally:
        path.unlink()
    assert {p for p in planned if _stage(p) == "reruns"}
    assert {Path(p).stem for p in planned if _stage(p) == "sampling"} == {"block-deim"}
    assert not {p for p in planned if _stage(p) in ("fom", "pod", "sensitivity")}


def test_a_selection_reruns_the_methods_that_use_it(finished: Checkout) -> None:
    """In the full order and in other methods it has no say."""
    greedy = "src/pdrom/reduction/sampling/pivoted_qr.py"
    finished.edit(greedy, "for r in ranks}", "for r in sorted(ranks)}")
    planned = finished.planned(*MICRO_ARGUMENTS)
    assert not {p for p in planned if _stage(p) in ("sampling", "reruns", "fom", "pod")}
    greedy = "src/pdrom/reduction/sampling/greedy.py"
    finished.edit(greedy, "for r in ranks}", "for r in sorted(ranks)}")
    planned = finished.planned(*MICRO_ARGUMENTS)
    methods = {Path(p).stem for p in planned if _stage(p) == "sampling"}
    assert methods == {"deim", "block-deim"}
    assert not {p for p in planned if _stage(p) in ("fom", "pod")}


FAULTS = {
    "unknown key of the study": (
        "config/default.yaml", "methods: [pod,", "sovler: splu\nmethods: [pod,",
        ("config/default.yaml", "unknown key 'sovler'", "allowed: scenes, methods"),
    ),
    "unknown key of a scene": (
        SCENE, "frames: 220", "frames: 220\nfriction: 1",
        (SCENE, "unknown key 'friction'", "allowed: name, title, mesh"),
    ),
    "wrong type": (
        SCENE, "frames: 220", "frames: many",
        (SCENE, "frames = 'many'", "valid integer"),
    ),
    "pin that selects nothing": (
        SCENE, "select: left", "select: []",
        (SCENE, "pins", "selects no vertex"),
    ),
    "unknown side": (
        SCENE, "select: left", "select: middle",
        (SCENE, "pins", "middle", "left, right, bottom, top, back, front"),
    ),
    "unknown group": (
        SCENE, "effect: spring, weight: 1.0e+6", "effect: rubber, weight: 1.0e+6",
        (SCENE, "effects[3]", "'rubber'", "allowed: ", "tetrahedron_strain"),
    ),
    "unknown group to reduce": (
        SCENE, "  spring: {train: 100}", "  strain: {train: 100}",
        (SCENE, "reduce.strain", "allowed: spring"),
    ),
    "no basis vector": (
        "config/default.yaml", "methods: [pod,", "ranks: [0, 10, full]\nmethods: [pod,",
        ("config/default.yaml", "ranks.0", "= 0", "greater than or equal to 1"),
    ),
    "negative weight": (
        SCENE, "weight: 1.0e+6", "weight: -1.0",
        (SCENE, "spring", "weight = -1.0", "greater than"),
    ),
    "missing mesh file": (
        SCENE, "{kind: cloth, rows: 20, columns: 20, plane: xz}", "{kind: file, path: no.obj}",
        (SCENE, "no.obj", "no such"),
    ),
    "unknown scene": (
        "config/default.yaml", "  - cloth_all\n", "  - cloth_some\n",
        ("scenes", "'cloth_some'", "allowed: ", "bar_release"),
    ),
    "unknown method": (
        "config/default.yaml", "methods: [pod,", "methods: [pood,",
        ("methods", "'pood'", "allowed: pod"),
    ),
    "unknown selection": (
        "config/methods.yaml", "selection: pivoted-qr", "selection: pivoted-rq",
        ("config/methods.yaml", "qdeim", "pivoted-rq", "allowed: greedy, pivoted-qr, s-opt",
         "did you mean 'pivoted-qr'"),
    ),
    "impossible combination": (
        "config/methods.yaml", "rows: element, selection: greedy, solve: qr",
        "rows: element, selection: greedy, solve: square",
        ("config/methods.yaml", "block-deim", "allowed are qr, tikhonov"),
    ),
}  # fmt: skip


# The corpus of bad input has these faults without Snakemake; some are tried with it in every run.
QUICK = ("unknown scene", "wrong type", "missing mesh file")


@pytest.mark.parametrize(
    "fault",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in FAULTS],
)
def test_a_faulty_configuration_ends_with_one_line_before_any_job(
    fault: str, clean: Checkout
) -> None:
    path, old, new, expected = FAULTS[fault]
    original = (clean.folder / path).read_text(encoding="utf-8")
    try:
        clean.edit(path, old, new)
        done = clean.snakemake()
    finally:
        (clean.folder / path).write_text(original, encoding="utf-8")
    assert done.returncode != 0
    assert "Traceback" not in done.stdout + done.stderr
    assert "Job stats" not in done.stdout + done.stderr
    assert not (clean.folder / "results").exists()
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("pdrom:")]
    assert [part for part in expected if part not in line] == [], line


def _below(path: str) -> list[str]:
    """Parts of a path below the results of its study."""
    inside = f"{MICRO_RESULTS}/" if path.startswith(MICRO_RESULTS) else "results/"
    return path.removeprefix(inside).split("/")


def _stage(path: str) -> str:
    """Folder below the results, "paper" for the manuscript."""
    return _below(path)[0]
