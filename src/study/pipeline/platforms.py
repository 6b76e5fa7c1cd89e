"""Check that the locked packages have wheels for this machine, before anything is downloaded.

``./reproduce`` runs this file with the system's Python before any package is installed: it may
import only the standard library.
"""

import platform
import sys

OLDEST, NEWEST = (3, 11), (3, 13)


def obstacle(system: str, processor: str, python: tuple[int, int], libc: str) -> str | None:
    """Return the reason why packages cannot be installed, with a remedy; None if they can.

    ``libc`` is "glibc", or "" for musl and for systems other than Linux.
    """
    if not OLDEST <= python <= NEWEST:
        package = "immutables has no wheel for it" if python > NEWEST else "it is too old"
        version, oldest, newest = (".".join(map(str, each)) for each in (python, OLDEST, NEWEST))
        return f"Python {version}: {package}; set PYTHON to one from {oldest} to {newest}"
    if system == "Darwin" and processor == "x86_64":
        return (
            "macOS on Intel: llvmlite has no wheel for it; use a Mac with Apple's processor or "
            "Linux in a container or a virtual machine"
        )
    if system == "Linux" and libc != "glibc":
        return (
            "Linux without glibc: llvmlite has no wheel for it; use a distribution with glibc, "
            "or a container of one (python:3.12-slim)"
        )
    known = {"Linux": ("x86_64", "aarch64"), "Darwin": ("arm64",)}
    if processor not in known.get(system, ()):
        return (
            f"{system} on {processor}: there are wheels for Linux on x86_64 and "
            "aarch64 and for macOS on arm64 only; use one of these"
        )
    return None


if __name__ == "__main__":
    libc = platform.libc_ver()[0] if platform.system() == "Linux" else ""
    # exit with an error message if there is an obstacle, else with status 0
    sys.exit(obstacle(platform.system(), platform.machine(), sys.version_info[:2], libc))
