"""The configuration files that Snakemake merges, checked before it reads them.

Snakemake would take the last of two equal keys without a word, run code that a file asks for
(``__use_yte__``), and show a traceback for a file that is no text.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pdrom.core.errors import ConfigurationError
from pdrom.core.yamlfile import read_yaml, shown

TEMPLATE_KEY = "__use_yte__"


def check_files(paths: Iterable[str | Path]) -> None:
    """Read every file; ConfigurationError for one that is no plain mapping of keys."""
    for path in map(Path, paths):
        content = read_yaml(path)
        if not isinstance(content, dict):
            found = "nothing" if content is None else shown(content, 60)
            raise ConfigurationError(f"{path}: a mapping of keys is required, found {found}")
        if TEMPLATE_KEY in content:
            raise ConfigurationError(f"{path}: {TEMPLATE_KEY}: templates are not allowed")


def merged(default: Path, configfiles: Iterable[str], settings: Iterable[str]) -> dict[str, Any]:
    """The whole configuration, as Snakemake merges it.

    Parameters
    ----------
    default : file of the full study
    configfiles : files of ``--configfile``, in order
    settings : ``key=value`` pairs of ``--config``

    Raises
    ------
    ConfigurationError
        A file is missing or no mapping.
    """
    # late: Snakemake's jobs import this module, too
    from snakemake.cli import parse_config
    from snakemake.settings.types import ConfigSettings
    from snakemake.utils import update_config

    files = list(map(Path, configfiles))
    check_files([default, *files])
    whole = dict(read_yaml(default))
    given = ConfigSettings(config=parse_config(tuple(settings)), configfiles=files)
    update_config(whole, given.overwrite_config)
    return whole


def check_or_exit(*paths: str | Path) -> None:
    """`check_files`; a fault ends the process with one line."""
    try:
        check_files(paths)
    except ConfigurationError as error:
        sys.exit(f"pdrom: {error}")
