"""The names of the project, and words in code font that name nothing of it."""

import re
from collections.abc import Collection, Iterator
from contextlib import suppress
from fnmatch import filter as matching
from functools import cache
from pkgutil import resolve_name
from typing import Any

from snakemake.cli import get_argument_parser

from pdrom.command.main import parser
from pdrom.core.yamlfile import read_yaml
from places import CONFIG, ROOT, tracked
from study.pipeline.study import StudySettings
from study.tables import declared
from study.verification import command
from study.verification.subject import options_parser

# Other programs, with their words and options.
PROGRAMS = re.compile(
    r"(\.ci/run|apt|b2sum|docker|find|g\+\+|git|head|meshio|nohup|pip|sacct|tail|tmux|uv"
    r"|\./reproduce (test|run pip)|\.venv/bin/(ruff|snakefmt|mypy))\b"
)
OTHERS = {
    # of SLURM, Python, pandas, JavaScript, OpenBLAS
    "--qos", "--slurm-status-command", "MinJobAge", "cancelled", "slurm_account",
    "slurm_partition", "multiprocessing", "NaN", "fetch", "tanh", "Node.js", "Zen",
    # names that readers choose or code composes
    "config/scenes/my_sheet.yaml", "config/mine.yaml", "config/scenes/meshes/sheet.obj", "t.csv",
    "train_frames", "heldout_frames", "pulled.yaml",
}  # fmt: skip
WRITTEN = re.compile(r"\.(py|js|smk|tex|ya?ml|toml|sh|css|lock|rst)$|^(config|docs|src|tests)/")
WORD = re.compile(r"(?<![\w-])--[a-z][\w-]+|(?<![\\\w.-])[.\w{}*-]*[\w}](?:/[.\w{}*-]+)*")
# A complete span; the part before a colon, an equals sign or a bracket; an item in brackets.
NAME = re.compile(
    r"^[A-Za-z_][\w-]+$|(?<![\\\w.-])[A-Za-z_][\w-]+(?=[:=(])"
    r"|(?:(?<=[({,])|(?<=: ))\s*[\w-]+\s*(?=[,)}])"
)


def keys(content: dict[str, Any], above: str = "") -> Iterator[str]:
    """Keys of a configuration, with their sections."""
    for key, value in content.items():
        yield above + key
        yield from keys(value, f"{above}{key}.") if isinstance(value, dict) else ()


@cache
def names() -> set[str]:
    """Options, keys, endings of paths, and words of the code without comments and docstrings."""
    found = {*OTHERS, *(f"{name}.csv" for name in declared())}
    settings = StudySettings.model_validate(read_yaml(CONFIG / "default.yaml"))
    found |= {*keys(settings.model_dump(by_alias=True))}
    (commands,) = (a.choices for a in parser()._actions if a.choices)
    for name, own in commands.items():
        found |= {f"pdrom {name} {option}" for option in ("", *own._option_string_actions)}
    runs = (get_argument_parser(), command.parser(), options_parser("bundle", ""))
    found |= {o for one in (*runs, *commands.values()) for o in one._option_string_actions}
    for path in tracked():
        inside = path.relative_to(ROOT)
        parts = [part.parts for part in (inside, *inside.parents)]
        found |= {"/".join(p[first:]) for p in parts for first in range(len(p))} | {path.stem}
        written = path.suffix in (".py", ".smk", ".yaml", ".yml") and inside.parts[0] != "tests"
        if written or path.name in ("reproduce", "preamble.tex", "conftest.py"):
            text = re.sub(r"(^|\s)[#%].*|\"{3}(.|\n)*?\"{3}", "", path.read_text("utf-8"))
            found |= {*re.findall(r"\w[\w-]*", text), *re.findall(r"[\w./-]*\w", text)}
    return found


@cache
def resolved(word: str) -> bool:
    """Whether the word is a module of the project or a name that a module defines."""
    with suppress(ImportError, AttributeError):
        return word.startswith(("pdrom.", "study.")) and resolve_name(word) is not word
    return False


def known(word: str, own: Collection[str] = ()) -> bool:
    """Whether the project or the page has the name; capitals, braces and letters match any text."""
    if word in names() or word in own or re.fullmatch(r"\w\d*(\.\w)?|[\d.].*", word):
        return True
    pattern = re.sub(r"\{\w+\}|(?<![A-Z_])[A-Z]{4,}(?![A-Z_])", "*", word)
    if "*" in pattern and matching(names(), pattern):
        return True
    head, *parts = word.split("/")
    if parts and not WRITTEN.search(word):  # a run makes it
        return known(head, own) and all(known(p, own) or known(p.split(".")[0], own) for p in parts)
    return "." in word and (word.split(".")[0] in own or resolved(word))


def gone(span: str, own: Collection[str] = ()) -> Iterator[str]:
    """Words of a span that look like names but do not exist; ``own``: names defined on the page."""
    called = re.match(r"(?:\.venv/bin/|\./reproduce run )?(pdrom [a-z]\S*)", span)
    prefix = f"{called[1]} " if called else ""
    if prefix and prefix not in names():
        yield span
    if PROGRAMS.match(span) or (" " in span and "..." in span and span[0] not in "{\\"):
        return  # a message is compared with the sources
    words = [word for word in WORD.findall(span) if re.search(r"^--|/|\w\.", word)]
    yield from (w for w in words if w.startswith("--") and prefix + w not in names())
    yield from (w for w in words if not (prefix or w.startswith("--") or known(w, own)))
    yield from (w for w in map(str.strip, NAME.findall(span)) if not known(w, own))
