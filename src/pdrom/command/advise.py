"""``pdrom advise SCENE``: what a scene does not need, and what fits an error and a time."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from pdrom.command.base import Command, Status
from pdrom.core.paths import RESULTS
from pdrom.core.project import checkout

if TYPE_CHECKING:
    import pandas as pd


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text}: a number above zero is required")
    return value


def declare(parser: argparse.ArgumentParser) -> None:
    """Add to ``parser`` the scene, the wishes, and where results lie."""
    parser.add_argument("scene", metavar="SCENE", help="name of a scene, or its file")
    parser.add_argument(
        "--error", metavar="E", type=_positive, help="largest relative error allowed"
    )
    parser.add_argument(
        "--ms", metavar="T", type=_positive, help="longest time of a frame allowed, ms"
    )
    parser.add_argument(
        "--results", metavar="FOLDER", default=str((checkout() or Path()) / RESULTS),
        help="folder of measured results (%(default)s)",
    )  # fmt: skip


def perform(arguments: argparse.Namespace) -> Status:
    """Read the tables that hold the scene of ``arguments`` and say what follows from them."""
    from pdrom.report.advice import on_asks, on_choices, on_effects, on_resolution

    scene, folder = _name(arguments.scene), arguments.results
    effects = _rows(folder, "effects_contribution", scene)
    lines = [f"{scene}: effects", *on_effects(effects)]
    fits = True
    if arguments.error is not None or arguments.ms is not None:
        lines.append(f"{scene}: {_wish(arguments.error, arguments.ms)}")
        asked = _rows(folder, "asks", scene, required=False)
        asked = asked[asked.asked <= arguments.error] if arguments.error and len(asked) else asked
        if arguments.error is not None and arguments.ms is None and len(asked):
            found, fits = on_asks(asked)
        else:
            points = _rows(folder, "accuracy_cost", scene)
            found, fits = on_choices(points, arguments.error, arguments.ms)
        lines += found
        if arguments.ms is not None:
            scaling = _rows(folder, "scaling", scene, required=False)
            own = points[(points.method == "full") & (points.position_basis == "full")]
            lines += on_resolution(scaling, int(own.iterations.iloc[0]), arguments.ms)
    sys.stdout.write("\n".join(lines) + "\n")
    return Status.DONE if fits else Status.NOTHING_FITS


def _name(asked: str) -> str:
    """Name of a scene; a scene's file is read, so that its faults are reported."""
    from pdrom.core.yamlfile import read_yaml, validate
    from pdrom.model.scene import SceneConfig

    path = Path(asked)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        return path.stem
    return validate(SceneConfig, read_yaml(path), asked).name


def _wish(error: float | None, ms: float | None) -> str:
    parts = [] if error is None else [f"an error of at most {error:g}"]
    parts += [] if ms is None else [f"at most {ms:g} ms a frame"]
    return f"for {' and '.join(parts)}"


def _rows(folder: str, name: str, scene: str, required: bool = True) -> "pd.DataFrame":
    """The scene's rows of a table of the study, else of the scene's own.

    Raises
    ------
    StorageError
        Neither is there, or holds the scene.
    """
    from pdrom.core.errors import StorageError, choices
    from pdrom.core.paths import SCENE_TABLE, TABLE
    from pdrom.core.store import read_table

    empty, known = None, list[str]()
    for place in (
        TABLE.at(folder, name=name),
        SCENE_TABLE.at(folder, scene=scene, name=name),
    ):
        if Path(place).exists():
            table = read_table(place)
            empty = table[:0]
            known += [name for name in table.scene.unique() if name not in known]
            rows = table[table.scene == scene] if len(table) else table
            if len(rows):
                return rows
    if not required:
        import pandas as pd

        return pd.DataFrame() if empty is None else empty
    raise StorageError(
        f"{scene}: {folder} holds no measurements of it (table {name})"
        f"{choices(scene, known) if known else ''}; --results names another, "
        f"./reproduce scene {scene} advice makes them, for a scene in config/scenes"
    )


COMMAND = Command(
    "Say which effects of a scene do nothing, and what fits an error and a time per frame",
    "pdrom advise cloth_all_oop --error 1e-2 --ms 1",
    declare,
    perform,
)
