"""``./reproduce bundle``: one archive of the last commit and, in ``published``, of the results.

Equal commits and results give equal bytes: files are sorted, and dated as results are.
"""

import gzip
import io
import os
import subprocess
import sys
import tarfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from pdrom import __version__
from pdrom.core.errors import ConfigurationError
from pdrom.core.store import atomic_path
from study.artifact import paths
from study.pipeline.commandline import one_line
from study.pipeline.manifest import read_manifest
from study.verification.files import verify_files
from study.verification.subject import Status, Subject, options_parser, say

ARCHIVE = f"pdrom-{__version__}"


def bundle(arguments: Sequence[str]) -> Status:
    """Write the archive if all files of the study are intact, else print which ones are not."""
    chosen = options_parser("bundle", __doc__).parse_args(arguments)
    subject = Subject.of(chosen.configfile, chosen.config)
    status = verify_files(subject)
    if status is not Status.HOLDS:
        return status
    folder = Path(subject.results)
    names = [*read_manifest(subject.results).files, paths.MANIFEST.pattern]
    small = {n: folder / n for n in names if not n.endswith(".h5")}  # no HDF5: a run makes it again
    results = {os.path.normpath(f"published/results/{name}"): p for name, p in small.items()}
    target = folder / f"{ARCHIVE}.tar.gz"
    write_archive(Path(), results, target)
    say(f"{target}: {target.stat().st_size / 1e6:.1f} MB")
    return Status.HOLDS


def write_archive(root: Path, results: Mapping[str, Path], target: Path) -> None:
    """Write a gzipped tar archive of the last commit of ``root`` and of ``results`` to ``target``.

    ``results`` maps names in the archive to paths of files.
    """
    date = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    if changed := _git(root, "status", "--porcelain", "--untracked-files=no").decode():
        names = ", ".join(line[3:] for line in changed.splitlines())
        raise ConfigurationError(f"bundle: changes that are in no commit: {names}; commit them")
    made = io.BytesIO(_git(root, "archive", f"--prefix={ARCHIVE}/", "HEAD"))
    with tarfile.open(fileobj=made, mode="a") as archive:
        for name, path in sorted(results.items()):
            entry = tarfile.TarInfo(f"{ARCHIVE}/{name}")
            entry.size, entry.mtime = path.stat().st_size, date
            with open(path, "rb") as content:
                archive.addfile(entry, content)
    with atomic_path(target) as temporary:
        temporary.write_bytes(gzip.compress(made.getvalue(), mtime=date))


def _git(root: Path, *words: str) -> bytes:
    try:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        fault = "bundle: git lists the sources, and there is no git or no clone here"
        raise ConfigurationError(fault) from error


if __name__ == "__main__":
    with one_line():
        sys.exit(bundle(sys.argv[1:]))
