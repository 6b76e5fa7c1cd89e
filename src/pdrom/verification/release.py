"""``./reproduce release``: the archive of `pdrom.verification.bundle`, of a version that is ready.

The version stands in ``pdrom.__version__``; the citation and the list of changes have to name it.
"""

import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from pdrom import __version__
from pdrom.core.yamlfile import read_yaml
from pdrom.verification.bundle import bundle, git
from pdrom.verification.status import Status, ended

CHANGES, CITATION = Path("CHANGELOG.md"), Path("CITATION.cff")
UNRELEASED = "Unreleased"
SECTION = re.compile(r"^## (\S+).*\n((?:(?!## ).*\n?)*)", re.MULTILINE)


def unready(root: Path) -> Iterator[str]:
    """Reasons for which the sources below ``root`` are no release, each with what to do.

    Raises
    ------
    ConfigurationError
        There is no git or no clone, or a file is missing.
    """
    sections = dict(SECTION.findall((root / CHANGES).read_text(encoding="utf-8")))
    if __version__ not in sections:
        yield f"{CHANGES} has no heading '## {__version__}': name the changes of this version"
    if sections.get(UNRELEASED, "").strip():
        yield f"{CHANGES} has changes under '## {UNRELEASED}': move them below their version"
    cited = read_yaml(root / CITATION)["version"]
    if cited != __version__:
        yield f"{CITATION} names version {cited}, pdrom.__version__ {__version__}: make them equal"
    changed = git(root, "status", "--porcelain").decode().splitlines()
    if changed:
        files = ", ".join(line[3:] for line in changed)
        yield f"files that are in no commit: {files}; commit or remove them"


def release(arguments: Sequence[str]) -> int:
    """Do `bundle` of the ``arguments``, or print every reason against a release."""
    reasons = list(unready(Path()))
    for reason in reasons:
        sys.stderr.write(f"pdrom: release: {reason}\n")
    return Status.FAULTY if reasons else bundle(arguments)


if __name__ == "__main__":
    sys.exit(ended(lambda: release(sys.argv[1:])))
