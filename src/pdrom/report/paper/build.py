"""Rules of the manuscript: tables -> macros, TeX tables, bibliography -> PDF."""

from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError

from pdrom.core.errors import StorageError
from pdrom.core.machine import Machine
from pdrom.core.store import read_table, read_text, require_intact, write_text
from pdrom.core.yamlfile import describe
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
    data["machine"] = _machine_table(Path(machine))
    outputs = {"macros.tex": macros(text, data)}
    outputs |= {f"{name}.tex": make(data) for name, make in TEX_TABLES.items()}
    outputs["main.bbl"] = bibliography(text, Path(references))
    for name, content in outputs.items():
        write_text(content, Path(folder) / name)


def _machine_table(path: Path) -> pd.DataFrame:
    """One row; versions of libraries as ``version_NAME``."""
    try:
        record = Machine.model_validate_json(read_text(path))
    except ValidationError as error:
        raise StorageError(f"{path}: {describe(error, Machine)}") from error
    versions = {f"version_{name}": version for name, version in record.libraries.items()}
    architectures = ", ".join(sorted({k.architecture for k in record.kernels if k.architecture}))
    plain = record.model_dump(exclude={"libraries", "kernels"})
    return pd.DataFrame([{**plain, **versions, "kernels": architectures}])


def build(source: str, figures: list[str], inputs: list[str], output: str) -> None:
    """Build the PDF of the manuscript from its figures and what `write_inputs` wrote."""
    results = [Path(path) for path in (*figures, *inputs)]
    for path in results:
        require_intact(path)
    build_pdf(Path(source), Path(output), sorted({path.parent for path in results}))
