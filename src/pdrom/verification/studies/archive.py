"""Results out of an archive of ``./reproduce bundle``; nothing is written beside them."""

import re
import shutil
import tarfile
import zlib
from gzip import BadGzipFile
from pathlib import Path, PurePosixPath

from pdrom.core.errors import StorageError

# Members that are read: records, tables, pictures of figures.
READ = re.compile(
    r"[^/]+/published/results/(m(?:anifest|achine)\.json|tables/\w+\.csv|figures/\w+\.png)"
)
LARGEST = 2_000_000_000  # bytes of all members; the archive of the full study has 60 MB


def unpack(archive: Path, folder: Path) -> None:
    """Write the members of ``archive`` that are read as a folder of results.

    Raises
    ------
    StorageError
        It is no archive, is cut off or too large, or has a member that leads out of it.
    """
    size = 0
    try:
        with tarfile.open(archive, "r:gz") as members:
            for member in members:
                _require_inside(archive, member)
                size += member.size
                if size > LARGEST:
                    raise StorageError(f"{archive}: more than {LARGEST / 1e9:g} GB when unpacked")
                read, content = READ.fullmatch(member.name), members.extractfile(member)
                if read and content:
                    target = folder / read[1]
                    target.parent.mkdir(exist_ok=True)
                    with open(target, "wb") as copy:
                        shutil.copyfileobj(content, copy)
    except (tarfile.TarError, EOFError, BadGzipFile, zlib.error, ValueError) as error:
        fault = " ".join(str(error).split())
        raise StorageError(f"{archive}: no archive of results, or cut off ({fault})") from error


def _require_inside(archive: Path, member: tarfile.TarInfo) -> None:
    name = PurePosixPath(member.name)
    if name.is_absolute() or ".." in name.parts or not (member.isfile() or member.isdir()):
        fault = "a member that is no plain file inside it"
        raise StorageError(f"{archive}: {member.name!r}: {fault}; nothing of it is read")
