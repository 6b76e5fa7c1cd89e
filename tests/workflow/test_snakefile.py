"""What the workflow plans: from nothing, for one figure, after edits, and with a faulty configuration."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from .conftest import Checkout

MICRO = {
    "scenes": ["spring_oop", "strain_oop", "bar_release"],
    "methods": ["deim", "block-deim"],
    "ranks": [4, "full"],
    "heldout_ranks": ["full"],
    "coarsen": {"resolution": 0.25, "frames": 0.05},
    "sensitivity": {"perturbations": [1e-10], "seeds": [1]},
    "subspace": {"scenes": ["strain_oop"], "sizes": [4], "tolerances": [1e-2]},
}
MICRO_FILE = "micro.yaml"
MICRO_ARGUMENTS = ("--configfile", MICRO_FILE)


@pytest.fixture(scope="module")
def clean(
    checkout_in: Callable[[Path], Checkout], tmp_path_factory: pytest.TempPathFactory
) -> Checkout:
    """A copy in which nothing was ever run."""
    return checkout_in(tmp_path_factory.mktemp("clean"))


@pytest.fixture(scope="module")
def finished_once(
    checkout_in: Callable[[Path], Checkout], tmp_path_factory: pytest.TempPathFactory
) -> Checkout:
    """A copy whose micro study counts as finished.

    Empty files stand for the results; ``--touch`` makes Snakemake record code, parameters and
    inputs of every job, which is all that it looks at when it plans.
    """
    checkout = checkout_in(tmp_path_factory.mktemp("finished"))
    (checkout.folder / MICRO_FILE).write_text(yaml.safe_dump(MICRO), encoding="utf-8")
    for name in checkout.planned(*MICRO_ARGUMENTS):
        path = checkout.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    done = checkout.snakemake("--touch", "--forceall", *MICRO_ARGUMENTS)
    assert done.returncode == 0, done.stderr
    return checkout


@pytest.fixture
def finished(finished_once: Checkout) -> Iterator[Checkout]:
    """The finished copy; edits of the test are taken back."""
    folders = [finished_once.folder / name for name in ("src", "config")]
    files = [p for f in folders for p in f.rglob("*") if p.suffix in (".py", ".yaml")]
    before = {path: (path.read_bytes(), path.stat()) for path in files}
    yield finished_once
    for path, (content, stat) in before.items():
        if path.read_bytes() != content:
            path.write_bytes(content)
            _set_time(path, stat.st_mtime_ns)


def _set_time(path: Path, nanoseconds: int) -> None:
    import os

    os.utime(path, ns=(nanoseconds, nanoseconds))
