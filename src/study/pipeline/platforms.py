"""Machines that the locked packages have wheels for, known before anything is downloaded.

``./reproduce`` runs this file by its path with the machine's own Python, before any package is
there: only the standard library may be imported.
"""

import platform
import sys
from dataclasses import dataclass

OLDEST, NEWEST = (3, 11), (3, 13)


@dataclass(frozen=True)
class Machine:
    """Machine for the choice of wheels: ``libc`` is "glibc" or "" (musl, or no Linux)."""

    system: str
    processor: str
    python: tuple[int, int]
    libc: str

    @classmethod
    def here(cls) -> "Machine":
        """Machine and Python of this process."""
        libc = platform.libc_ver()[0] if platform.system() == "Linux" else ""
        return cls(platform.system(), platform.machine(), sys.version_info[:2], libc)

    def obstacle(self) -> str | None:
        """Reason why the packages cannot be installed, with the remedy; None where they can."""
        version = ".".join(map(str, self.python))
        if not OLDEST <= self.python <= NEWEST:
            package = "immutables has no wheel for it" if self.python > NEWEST else "it is too old"
            return (
                f"Python {version}: {package}; set PYTHON to one from {_text(OLDEST)} to "
                f"{_text(NEWEST)}"
            )
        if self.system == "Darwin" and self.processor == "x86_64":
            return (
                "macOS on Intel: llvmlite has no wheel for it; use a Mac with Apple's processor or "
                "Linux in a container or a virtual machine"
            )
        if self.system == "Linux" and self.libc != "glibc":
            return (
                "Linux without glibc: llvmlite has no wheel for it; use a distribution with glibc, "
                "or a container of one (python:3.12-slim)"
            )
        known = {"Linux": ("x86_64", "aarch64"), "Darwin": ("arm64",)}
        if self.processor not in known.get(self.system, ()):
            return (
                f"{self.system} on {self.processor}: there are wheels for Linux on x86_64 and "
                "aarch64 and for macOS on arm64 only; use one of these"
            )
        return None


def main() -> None:
    """Say why this machine gets no packages, if it gets none."""
    obstacle = Machine.here().obstacle()
    if obstacle:
        sys.exit(obstacle)


def _text(version: tuple[int, int]) -> str:
    return ".".join(map(str, version))


if __name__ == "__main__":
    main()
