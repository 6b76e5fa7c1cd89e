"""Code that all packages share; this module finds the project's folder and configuration files.

A wheel contains the configuration files in ``pdrom/config`` (listed in pyproject.toml), so that an
installed package needs no checkout.
"""

from importlib.resources import files
from pathlib import Path


def checkout() -> Path | None:
    """Return the folder of the checkout with this package; None for an installed package."""
    source = Path(__file__).resolve().parents[2]
    inside = source.name == "src" and (source.parent / "config").is_dir()
    return source.parent if inside else None


def config_file(name: str) -> Path:
    """Return the path of the configuration file ``name``, in the checkout or the package."""
    root = checkout() or Path(str(files("pdrom")))
    return root / "config" / name
