"""The wheel: what it carries, and that it trains a model where there is no checkout."""

import subprocess
import sys
import sysconfig
from pathlib import Path
from zipfile import ZipFile

import pytest

from builders import SMALL
from places import CONFIG, ROOT


def call(*command: object, folder: Path, **environment: str) -> str:
    """Output of a command that must succeed, with no variable but ``environment``."""
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the project, built from the packages of the lock file alone."""
    folder = tmp_path_factory.mktemp("wheel")
    options = ["--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", folder]
    call(sys.executable, "-m", "pip", "wheel", *options, ROOT, folder=folder)
    (path,) = folder.glob("*.whl")
    return path


def test_it_carries_the_package_and_the_files_that_it_reads(wheel: Path) -> None:
    with ZipFile(wheel) as archive:
        names = set(archive.namelist())
        for name in ("methods.yaml", "words.yaml", "new_scene.txt"):
            assert archive.read(f"pdrom/config/{name}") == (CONFIG / name).read_bytes()
    source = ROOT / "src"
    own = {str(p.relative_to(source)) for p in (source / "pdrom").rglob("*") if p.is_file()}
    assert {name for name in own if "__pycache__" not in name and "egg-info" not in name} <= names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"pdrom"}


@pytest.mark.slow
def test_installed_elsewhere_it_trains_a_model(wheel: Path, tmp_path: Path) -> None:
    environment, folder = tmp_path / "environment", tmp_path / "elsewhere"
    call(sys.executable, "-m", "venv", "--without-pip", environment, folder=tmp_path)
    python = environment / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index"]
    call(*pip, wheel, folder=tmp_path)
    # the other packages are those of the lock file; the path of the checkout, which a file there
    # names, is not followed
    script = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(call(python, "-c", script, folder=tmp_path).strip())
    (packages / "locked.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")

    folder.mkdir()
    (folder / "small.yaml").write_text(SMALL, encoding="utf-8")
    pdrom, home = environment / "bin" / "pdrom", {"HOME": str(tmp_path)}
    script = "import pdrom; print(pdrom.__file__)"
    assert call(python, "-c", script, folder=folder).startswith(str(environment))
    call(pdrom, "new", "sheet", folder=folder, **home)
    assert "`pdrom show scene`" in (folder / "sheet.yaml").read_text("utf-8").splitlines()[0]
    assert call(pdrom, "show", "scene", folder=folder, **home).startswith("scene: ")
    said = call(pdrom, "train", "small.yaml", "--method", "gappy", "--r", 2, folder=folder, **home)
    assert "small.model.h5: a model of 'small' (spring, " in said
