"""``./reproduce bundle``: one archive with sources and results, for publication.

The sources lie as they do in the repository, so that the archive reproduces the study without git.
The results lie in ``published``, where no run takes them for its own::

    pdrom-0.1.0/...                         what git tracks
    pdrom-0.1.0/published/results/...       manifest, crate, tables, figures
    pdrom-0.1.0/published/paper/main.pdf    and supplement.pdf
    pdrom-0.1.0/published/paper/source/...  for plain pdflatex, in one folder

Equal sources and results give equal bytes: files are sorted, and dated as results are.
"""

import argparse
import gzip
import io
import os
import subprocess
import sys
import tarfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from pdrom import __version__
from pdrom.core import paths
from pdrom.core.errors import ConfigurationError
from pdrom.core.store import atomic_path
from pdrom.pipeline.crate import COPIES, published
from pdrom.pipeline.manifest import Manifest, read_manifest
from pdrom.verification.files import verify_files
from pdrom.verification.status import Status, ended, say
from pdrom.verification.subject import Subject

NAME = f"pdrom-{__version__}"


@dataclass(frozen=True)
class Member:
    """A file of the archive."""

    name: str
    content: bytes
    executable: bool = False


def bundle(arguments: Sequence[str]) -> Status:
    """Write the archive of a finished study; say what is missing of an unfinished one.

    Raises
    ------
    ConfigurationError
        Git does not know the sources, or they are not those of a commit.
    """
    asked = parser().parse_args(arguments)
    subject = Subject.of(asked.configfile, asked.config)
    status = verify_files(subject)
    if status is not Status.HOLDS:
        return status
    manifest = read_manifest(subject.results)
    missing = list(unfinished(subject, manifest))
    if missing:
        say(f"not there, or made by other code: {', '.join(missing)}")
        say(f"the study is not finished; finish it by {subject.command()}")
        return Status.MISSING
    members = [*sources(Path()), *results(subject, manifest), *paper(subject)]
    target = Path(subject.results, f"{NAME}.tar.gz")
    size = write_archive(members, target)
    say(f"{target}: {len(members)} files, {size / 1e6:.1f} MB")
    return Status.HOLDS


def unfinished(subject: Subject, manifest: Manifest) -> Iterator[str]:
    """Results of ``subject`` that ``manifest`` does not list as today's code makes them.

    These are tables, figures and the manuscript.
    """
    plan, folders = subject.plan, subject.folders
    jobs = [job for jobs in plan.fixed.values() for job in jobs]
    wanted = {path: job.code for job in jobs for path in job.outputs.values()}
    for path, code in wanted.items():
        entry = manifest.files.get(os.path.relpath(path, folders.results))
        if entry is None or entry.code_sha256 != code:
            yield path
    if not Path(paths.CRATE.at(folders.results)).is_file():
        yield paths.CRATE.at(folders.results)


def sources(root: Path) -> Iterator[Member]:
    """Files that git tracks in the folder ``root``, as in the last commit."""
    changed = git(root, "status", "--porcelain", "--untracked-files=no").decode()
    if changed:
        files = ", ".join(line[3:] for line in changed.splitlines())
        raise ConfigurationError(f"bundle: changes that are in no commit: {files}; commit them")
    for name in git(root, "ls-files", "-z").decode().split("\0"):
        path = root / name
        if name and path.is_file():
            yield Member(name, path.read_bytes(), os.access(path, os.X_OK))


def results(subject: Subject, manifest: Manifest) -> Iterator[Member]:
    """Everything that the crate of ``subject`` and its ``manifest`` names, with the crate."""
    folder = Path(subject.results)
    names = [each.name for each in published(subject.plan, subject.folders, manifest)]
    copies = [p for p in (folder / COPIES).rglob("*") if p.is_file() and p.name[0] != "."]
    names += [str(path.relative_to(folder)) for path in copies]
    names += [paths.MANIFEST.pattern, paths.CRATE.pattern]
    for name in names:
        inside = os.path.normpath(PurePosixPath("published", paths.RESULTS, name))
        yield Member(inside, (folder / name).read_bytes())


def paper(subject: Subject) -> Iterator[Member]:
    """Source of the manuscript of ``subject`` with all that it reads, in one folder."""
    plan = subject.plan
    files = [Path(path) for path in (*plan.paper.files, *plan.figures)]
    sources = [Path(path) for path in plan.paper.sources]
    named = {path.name: path for path in files}
    named |= {str(path.relative_to(sources[0].parent)): path for path in sources}
    for name, path in named.items():
        yield Member(f"published/paper/source/{name}", path.read_bytes())


def write_archive(members: Sequence[Member], target: Path) -> int:
    """Write ``members`` to a gzipped tar archive ``target``; return its size in bytes."""
    date = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    with (
        atomic_path(target) as temporary,
        open(temporary, "wb") as handle,
        gzip.GzipFile("", "wb", 9, handle, mtime=date) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive,
    ):
        for member in sorted(members, key=lambda each: each.name):
            entry = tarfile.TarInfo(f"{NAME}/{member.name}")
            entry.size, entry.mtime = len(member.content), date
            entry.mode = 0o755 if member.executable else 0o644
            archive.addfile(entry, io.BytesIO(member.content))
    return target.stat().st_size


def parser() -> argparse.ArgumentParser:
    """Parser of the arguments after the word ``bundle``."""
    made = argparse.ArgumentParser(
        prog="./reproduce bundle",
        description="One archive of the sources and of the results of a finished study.",
    )
    made.add_argument("--configfile", nargs="+", default=[], metavar="FILE")
    made.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE")
    return made


def git(root: Path, *arguments: str) -> bytes:
    """Output of git with ``arguments`` in ``root``; ConfigurationError without git or a clone."""
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        fault = "bundle: git lists the sources, and there is no git or no clone here"
        raise ConfigurationError(fault) from error
    return done.stdout


if __name__ == "__main__":
    sys.exit(ended(lambda: bundle(sys.argv[1:])))
