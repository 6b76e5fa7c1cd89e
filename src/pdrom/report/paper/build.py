"""Rules of the manuscript: tables -> macros, TeX tables, bibliography -> PDF."""

import json
from pathlib import Path
from typing import Any

import pandas as pd

from pdrom.core.store import atomic_path, read_table
from pdrom.report.paper.bibliography import bibliography
from pdrom.report.paper.macros import macros
from pdrom.report.paper.tex import build_pdf
from pdrom.report.paper.textables import TEX_TABLES


def write_inputs(
    source: str,
    references: str,
    tables: list[str],
    machine: str,
    facts: dict[str, list[dict[str, Any]]],
    folder: str,
) -> None:
    """Write macros.tex, the TeX tables and main.bbl into ``folder``.

    Parameters
    ----------
    facts : further tables from the configuration (scenes, methods, study), as lists of rows
    """
    text = Path(source).read_text(encoding="utf-8")
    data = {Path(path).stem: read_table(path) for path in tables}
    data |= {name: pd.DataFrame(rows) for name, rows in facts.items()}
    record = json.loads(Path(machine).read_text(encoding="utf-8"))
    libraries = {f"version_{k}": v for k, v in record.pop("libraries").items()}
    data["machine"] = pd.DataFrame([{**record, **libraries}])
    outputs = {"macros.tex": macros(text, data)}
    outputs |= {f"{name}.tex": make(data) for name, make in TEX_TABLES.items()}
    outputs["main.bbl"] = bibliography(text, Path(references))
    for name, content in outputs.items():
        with atomic_path(Path(folder) / name) as path:
            path.write_text(content, encoding="utf-8")


def build(source: str, figures: str, inputs: str, output: str) -> None:
    """Build the PDF of the manuscript."""
    build_pdf(Path(source), Path(output), [Path(figures), Path(inputs)])
