"""What the user of the command sees of broken input: one line, a failure, no traceback, no job.

A sample of the corpus through Snakemake itself, and files that Snakemake could not even read
through ``./reproduce``.
"""

from pathlib import Path

import pytest
from checkout import Checkout, copy_repository
from sandbox import MICRO_FILE, Sandbox

from bad_input.cases import CASES
from bad_input.project import make_project

SAMPLE = (
    "template that runs code",
    "misspelt key of a section",
    "run that no disk holds",
    "mesh of mixed cells",
    "link out of the project",
    "claim about an unknown column",
)
BY_NAME = {case.name: case for case in CASES}


def only_line(output: str, program: str = "pdrom") -> str:
    """The one line that says what is wrong."""
    assert "Traceback" not in output
    assert "Job stats" not in output
    (line,) = [line for line in output.splitlines() if line.startswith(f"{program}: ")]
    assert output.splitlines()[-1] == line
    return line


@pytest.mark.parametrize("name", SAMPLE)
def test_broken_input_of_the_corpus(name: str, tmp_path: Path) -> None:
    checkout = copy_repository(tmp_path)
    make_project(tmp_path, BY_NAME[name].changes)
    done = checkout.snakemake("-n")
    assert done.returncode != 0
    line = only_line(done.stderr.strip())
    missing = [p for p in BY_NAME[name].parts if not any(q in line for q in p.split("|"))]
    assert missing == [], line


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """A repository with the small project."""
    folder = tmp_path_factory.mktemp("small")
    checkout = copy_repository(folder)
    make_project(folder, {})
    return checkout


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("ranks=six", ("config/default.yaml", "ranks = 'six'", "valid list")),
        ("coarsen={resolution: many}", ("coarsen.resolution = 'many'", "valid number")),
        ("scenes=[../../etc/passwd]", ("scenes.0 = '../../etc/passwd'", "a small letter")),
        ("rnaks=[3]", ("unknown key 'rnaks'", "did you mean 'ranks'?")),
    ],
)
def test_settings_of_the_command_line(
    setting: str, expected: tuple[str, ...], small: Checkout
) -> None:
    done = small.snakemake("-n", "--config", setting)
    assert done.returncode != 0
    line = only_line(done.stderr.strip())
    assert [part for part in expected if part not in line] == [], line


@pytest.fixture(scope="module")
def sandbox(tmp_path_factory: pytest.TempPathFactory) -> Sandbox:
    """A folder in which nothing was run."""
    return Sandbox.make(tmp_path_factory.mktemp("sandbox") / "run")


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no such configuration file"),
        (b"", "a mapping of keys is required, found nothing"),
        (b"- small\n", "a mapping of keys is required, found ['small']"),
        (b"\xff\xfe\x00\x01" * 9, "not valid YAML"),
        (b"a: 1\n\tb: 2\n", "not valid YAML"),
        (b"scenes: !!python/object/apply:os.system [id]\n", "could not determine a constructor"),
        (b"ranks: [4]\nranks: [5]\n", "key 'ranks' is given twice"),
        (b"__use_yte__: true\n", "templates are not allowed"),
    ],
)
def test_a_broken_file_of_the_user(content: bytes | None, expected: str, sandbox: Sandbox) -> None:
    """As ``./reproduce --configfile FILE``; Snakemake itself shows a traceback for some of them."""
    sandbox.path(MICRO_FILE).unlink(missing_ok=True)
    if content is not None:
        sandbox.path(MICRO_FILE).write_bytes(content)
    status, output = sandbox.run()
    assert status != 0
    line = only_line(output.strip())
    assert line.startswith(f"pdrom: {MICRO_FILE}: ")
    assert expected in line
