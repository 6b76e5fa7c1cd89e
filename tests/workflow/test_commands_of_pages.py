"""Commands of pages and configurations are executed, planned with -n, or left out by name."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml
from checkout import Checkout, copy_repository, write_sheet

from pdrom.core.store import write_text
from places import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "config" / "README.md"]
PAGES += sorted((ROOT / "docs").rglob("*.md"))
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
# In the comments of a configuration.
ABOVE = re.compile(r"^#   (\./reproduce .*)", re.MULTILINE)
INLINE = re.compile(r"`((?:\./reproduce|\.venv/bin/\w+) [^`]+)`")
COMMENT = re.compile(r"\s+#.*|\s*&&.*")  # the first of the commands that && joins

# Commands that cannot be executed here, and the reasons.
LEFT_OUT = {
    r"--executor|executor-plugin|workflow/profiles|sinfo|sbatch": "needs a cluster: tests/machines",
    r"[A-Z]{4}": "words in capitals stand for others",
    r"^\./reproduce test": "the tests themselves",
    r"^\.ci/run": "runs the tests itself",
    r"^\.venv/bin/(ruff|snakefmt|mypy)": "executed by .ci/run",
    r"^\./reproduce --report": "executed by test_report.py",
    r"^\./reproduce (verify|bundle)": "needs a study; has tests of its own",
    r"^\./reproduce (figure [^8]|reduced_reruns)": "planned by test_contents.py",
    r"rest_shapes|mesh_sizes|rest_lengths|leverage": "recipes, executed by test_recipes.py",
    r"^(docker|(sh |bash )?tests/)": "makes a machine of its own",
}


def commands(start: str) -> list[str]:
    """Commands of all pages with this beginning, without those that are left out."""
    found: dict[str, None] = {}
    for page in [*PAGES, *sorted((ROOT / "config").glob("*.yaml"))]:
        text = page.read_text(encoding="utf-8").replace("\\\n", " ")
        lines = [line for block in BLOCK.findall(text) for line in block.splitlines()]
        for line in [*lines, *INLINE.findall(text), *ABOVE.findall(text)]:
            command = COMMENT.sub("", line).strip()
            if command:
                found[command] = None
    kept = [c for c in found if not any(re.search(pattern, c) for pattern in LEFT_OUT)]
    return [c for c in kept if c.startswith(start)]


def test_every_command_is_executed_or_left_out_by_name():
    ways = ("./reproduce", "pdrom ", ".venv/bin/pdrom", ".venv/bin/snakemake")
    assert [c for c in commands("") if not c.startswith((*ways, "find "))] == []


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A copy with the scene and the study that the pages add."""
    made = copy_repository(tmp_path_factory.mktemp("commands"))
    text = (ROOT / "docs" / "adding.md").read_text(encoding="utf-8")
    scene = re.findall(r"```yaml\n(name: my_sheet.*?)```", text, re.DOTALL)[0]
    study = re.findall(r"```yaml\n(scenes: \[my_sheet.*?)```", text, re.DOTALL)[0]
    config = made.folder / "config"
    (config / "mine.yaml").write_text(study, encoding="utf-8")
    for name in yaml.safe_load(study)["scenes"]:
        own = scene.replace("my_sheet", name)
        (config / "scenes" / f"{name}.yaml").write_text(own, encoding="utf-8")
    mesh = config / "scenes" / yaml.safe_load(scene)["mesh"]["path"]
    mesh.parent.mkdir(exist_ok=True)
    write_sheet(mesh)
    shutil.copy(ROOT / "CITATION.cff", made.folder)
    return made


def run(checkout: Checkout, module: str, *words: str, cwd: Path | None = None) -> None:
    """Run a module of the copy, which has to succeed; no browser is opened."""
    own = {"BROWSER": "true", "NUMBA_CACHE_DIR": str(ROOT / ".cache" / "numba")}
    done = checkout.looks(*words, program=("-m", module), cwd=cwd, **own)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("command", commands("./reproduce"))
def test_every_command_of_the_pages_can_be_planned(command, checkout):
    words = shlex.split(command)[1:]
    if words[:1] in (["run"], ["--help"]):
        pytest.skip("the script itself: test_reproduce_script.py")
    # after the names of a figure or a scene, before the hyphens that open targets
    planned = ["-n", *words] if "--" in words else [*words, "-n"]
    run(checkout, "study.pipeline.front", *planned)


@pytest.mark.slow
def test_the_command_line_works_in_the_order_of_its_page(tmp_path, checkout):
    write_sheet(tmp_path / "sheet.obj")
    (tmp_path / "config").symlink_to(checkout.folder / "config")
    shown = commands("pdrom ")
    assert len(shown) > 4
    for words in (("new", "pulled.yaml", "--mesh", "sheet.obj"), ("run", "pulled.yaml")):
        run(checkout, "pdrom", *words, cwd=tmp_path)  # the scene that the reader has written
    for command in shown:
        run(checkout, "pdrom", *shlex.split(command)[1:], cwd=tmp_path)


@pytest.mark.parametrize("command", commands("find "))
def test_checksums_are_compared(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("paper").mkdir()
    Path("results").mkdir()
    write_text("a result\n", "results/x.txt")
    assert subprocess.getoutput(command) == ""
    Path("results/x.txt").write_text("another one\n", encoding="utf-8")
    assert "x.txt" in subprocess.getoutput(command)
