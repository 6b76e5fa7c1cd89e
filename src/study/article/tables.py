"""Pages of the tables: each holds its table as packed CSV, which a script shows and sorts."""

import base64
import gzip
from collections.abc import Mapping
from html import escape
from pathlib import Path

import pandas as pd

from pdrom.view.page import filled
from study.artifact.paths import RESULTS, TABLE
from study.figures.kit.declaration import declarations
from study.tables import declared
from study.tables.kit.declaration import QUANTITIES

NOT_JUDGED = ("timed", "skipped")
FACTS = {
    "study": "Settings of the study that its text states",
    "methods": "Methods of the configuration",
    "scenes": "Scenes of the configuration",
    "machine": "The machine that the study ran on",
}


def table_page(name: str, csv: bytes, template: str) -> str:
    """HTML of table ``name`` (``csv``) by ``template``: its command, tolerance of every column."""
    table = declared().get(name)
    columns = "".join(
        f"<tr data-column='{c.name}'><th scope=row>{c.name}</th>"
        f"<td>{escape(c.meaning)}</td><td>{escape(c.unit)}</td>"
        f"<td>{c.quantity}: {escape(QUANTITIES[c.quantity])}</td>"
        f"<td>{'not judged' if c.quantity in NOT_JUDGED else f'{c.within:g}'}</td></tr>"
        for c in (table.columns if table else ())
    )
    packed = gzip.compress(csv, 9, mtime=0)
    parts = {
        "NAME": name,
        "TITLE": escape(table.title if table else FACTS[name]),
        "COMMAND": escape(f"./reproduce {argument(name)}"),
        "COLUMNS": columns
        or "<tr><td colspan=5>facts of the configuration, compared with nothing</td></tr>",
        "DATA": base64.b64encode(packed).decode(),
    }
    return filled(template, parts)


def argument(name: str) -> str:
    """Argument of ./reproduce that makes table ``name``; facts come with the text's numbers."""
    if name in FACTS:
        return "paper_inputs"
    return TABLE.at(RESULTS, name=name) if name in declarations() else name


def contents(files: list[str], facts: Mapping[str, pd.DataFrame]) -> dict[str, bytes]:
    """CSV of every table by name: results, which are ``files``, and ``facts``."""
    found = {Path(path).stem: Path(path).read_bytes() for path in files}
    plain = {name: facts[name].to_csv(index=False, lineterminator="\n").encode() for name in FACTS}
    return found | plain


def list_page(names: list[str], template: str) -> str:
    """HTML by ``template`` with a line for each table of ``names``."""
    known = declared()
    items = "".join(
        f"<li><a href='tables/{name}.html'><code>{name}</code></a> "
        f"{escape(known[name].title if name in known else FACTS[name])}</li>"
        for name in names
    )
    return filled(template, {"TITLE": "Tables", "BODY": f"<ul>{items}</ul>"})
