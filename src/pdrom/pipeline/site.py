"""``./reproduce docs``: the pages for readers as a site with search, in the folder ``site``.

README and the pages that it leads to are copied with their folders, so that links hold; MkDocs,
which is no part of the environment, is installed beside it from `requirements-docs.lock`.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from pdrom.core.errors import ConfigurationError

LOCK = Path("requirements-docs.lock")
TOOLS, PAGES = Path(".cache/site/tools"), Path(".cache/site/pages")
START = Path("README.md")
LINK = re.compile(r"\]\(([^)#:\s]+)[^):]*\)")


def collect(root: Path, target: Path) -> list[Path]:
    """Copy README and every file that it leads to into ``target``; their paths below ``root``.

    Raises
    ------
    ConfigurationError
        A link leads to no file of the project.
    """
    shutil.rmtree(target, ignore_errors=True)
    found, waiting = [START], [START]
    while waiting:
        page = waiting.pop()
        for linked in _links(root, page):
            if linked not in found:
                found.append(linked)
                waiting += [linked] if linked.suffix == ".md" else []
    for path in found:
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(root / path, target / path)
    return found


def _links(root: Path, page: Path) -> Iterator[Path]:
    """Files of the project that a page links to."""
    for link in LINK.findall((root / page).read_text(encoding="utf-8")):
        linked = (root / page.parent / link).resolve()
        if not (linked.is_file() and linked.is_relative_to(root.resolve())):
            raise ConfigurationError(f"{page}: the link {link} leads to no file of the project")
        yield linked.relative_to(root.resolve())


def install() -> Path:
    """Make the environment of MkDocs, unless it is that of the lock file; its Python.

    Raises
    ------
    ConfigurationError
        It cannot be installed.
    """
    python, stamp = TOOLS / "bin" / "python", TOOLS / LOCK.name
    if stamp.is_file() and stamp.read_bytes() == LOCK.read_bytes():
        return python
    sys.stderr.write("reproduce: installing MkDocs (once)\n")
    pip = ["-m", "pip", "install", "--quiet", "--require-hashes", "--no-deps", "--only-binary"]
    pip += [":all:", "--disable-pip-version-check", "-r", str(LOCK)]
    for command in ([sys.executable, "-m", "venv", "--clear", str(TOOLS)], [str(python), *pip]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
            raise ConfigurationError(f"docs: MkDocs cannot be installed ({last})")
    shutil.copy(LOCK, stamp)
    return python


def main() -> int:
    """Build the site; the exit code of MkDocs, for which a warning is a fault."""
    try:
        python = install()
        collect(Path(), PAGES)
    except ConfigurationError as error:
        sys.stderr.write(f"pdrom: {error}\n")
        return 1
    return subprocess.run([python, "-m", "mkdocs", "build", "--strict", "--clean"]).returncode


if __name__ == "__main__":
    sys.exit(main())
