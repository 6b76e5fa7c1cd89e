"""Do the locked packages have wheels where `study.pipeline.platforms` says so, and only there?

Usage: python tests/machines/wheels.py (the resolver `uv` is on the PATH; nothing is installed)

One line for each platform and Python; the status is 1 where the wheels and the module disagree.
"""

import shutil
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

from study.pipeline.platforms import obstacle

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ("requirements.lock", "requirements-cluster.lock")
PYTHONS = ((3, 11), (3, 12), (3, 13), (3, 14))
# Machines without their Python: uv's name, and what they say of themselves.
PLATFORMS = {
    "x86_64-unknown-linux-gnu": ("Linux", "x86_64", "glibc"),
    "aarch64-unknown-linux-gnu": ("Linux", "aarch64", "glibc"),
    "x86_64-unknown-linux-musl": ("Linux", "x86_64", ""),
    "aarch64-apple-darwin": ("Darwin", "arm64", ""),
    "x86_64-apple-darwin": ("Darwin", "x86_64", ""),
}


def missing(platform: str, python: tuple[int, int], lock: str, folder: str) -> str:
    """What uv says of a lock file that cannot be installed from wheels there; nothing if it can."""
    command = ["uv", "pip", "install", "--dry-run", "--no-deps", "--require-hashes"]
    command += ["--only-binary", ":all:", "--target", folder, "--python-platform", platform]
    command += ["--python-version", ".".join(map(str, python)), "-r", lock]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return ""
    said = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
    return next((line.strip() for line in said if "Wheels are required" in line), said[-1].strip())


def main() -> None:
    """Ask for every platform."""
    if shutil.which("uv") is None:
        sys.exit("wheels: uv is missing on the PATH")
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        for (platform, (system, processor, libc)), python in product(PLATFORMS.items(), PYTHONS):
            refusal = obstacle(system, processor, python, libc)
            found = [text for lock in LOCKS if (text := missing(platform, python, lock, folder))]
            agree = bool(refusal) == bool(found)
            wrong += not agree
            state = "refused" if refusal else "supported"
            what = "; ".join([*([refusal] if refusal else []), *found]) or "all wheels are there"
            name = f"{platform}, Python {python[0]}.{python[1]}"
            sys.stdout.write(f"{'' if agree else 'DISAGREE '}{name}: {state}: {what}\n")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
