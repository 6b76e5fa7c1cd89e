"""Measurements that git keeps: expected tables, costs of jobs."""

from pathlib import Path

from pdrom.core.store import atomic_path


def write_tracked(path: Path, content: bytes) -> None:
    """Write a file that git keeps: whole or not at all, without a checksum beside it."""
    with atomic_path(path, sealed=False) as temporary:
        temporary.write_bytes(content)
