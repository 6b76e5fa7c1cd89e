"""Make the manuscript: files that its source includes (numbers, tables ...), then its PDFs."""

import json
import logging
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pybtex.backends.latex import Backend
from pybtex.database import parse_file
from pybtex.errors import set_strict_mode
from pybtex.exceptions import PybtexError
from pybtex.style.formatting.unsrt import Style
from pydantic import BaseModel, ConfigDict, ValidationError

from pdrom.core.errors import PaperError, StorageError
from pdrom.core.store import read_table, read_text, require_intact, write_text
from pdrom.core.yamlfile import describe
from study.artifact.artifact import Artifact
from study.artifact.paths import FIGURE, MACHINE, PAPER_INPUT, TABLE, File
from study.artifact.reads import Every, ProjectFile, Setting, SourcesOf
from study.artifact.text import replaced
from study.experiments.machine import Record
from study.figures.kit.declaration import declarations
from study.paper.macros import decisions, defined, provenance
from study.paper.numbers import (
    HIDDEN,
    NUMBERS_FILE,
    Entries,
    entries,
    names_of,
    number_of,
    unexpected,
)
from study.paper.source import DOCUMENTS, documents
from study.paper.tex import build_pdfs
from study.paper.textables import TEX_TABLES, reads, tex_table
from study.tables import declared
from study.tables.effects_cost import unreliable

log = logging.getLogger(__name__)

PAGES = {"main": 12, "supplement": 25}  # largest allowed number of pages of each document


class Facts(BaseModel):
    """Contents of the manuscript that are not results of experiments.

    captions : name of a figure -> its title and caption as TeX
    part : name of the configuration if it is only a part of the full study, else None
    full_study : name of the default configuration (of this one if they share no scene)
    pages : name of a document -> largest allowed number of pages
    tables : name of a table about the configuration ("scenes", "methods", "study") -> its rows
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    captions: dict[str, str]
    part: str | None
    full_study: str
    pages: dict[str, int] = PAGES
    tables: dict[str, list[dict[str, Any]]]


def write_inputs(
    source: list[Path], references: Path, tables: list[File], machine: File, facts: Facts,
    made: list[str], outputs: Mapping[str, str],
) -> None:  # fmt: skip
    r"""Write macros.tex, figures.tex, TeX tables, bibliographies and the file `NUMBERS`.

    ``made`` has the names of the rules of all tables, figures and pages. `NUMBERS` (JSON) has the
    table cells from which each number ``\n`` is computed, the tables from which each TeX table is
    made, and a decision for each ``\known`` block: shown or dropped.
    """
    texts = documents(source[0].parent)
    whole = "".join(texts.values())
    data, times = shown_tables(tables)
    for name, frame in data.items():  # raises StorageError if a cell has not the type of its column
        declared()[name].checked(frame.reindex(columns=declared()[name].column_names))
    data |= fact_tables(Path(machine.path), facts)
    drawn = [name for name, figure in declarations().items() if figure.rule in made]
    asked = entries(source[0].parent)
    decided = {document: decisions(text, asked, data, drawn) for document, text in texts.items()}
    _require_expected(asked, data, facts)
    numbers = {name: number_of(name, asked, data) for name in names_of(whole)}
    known = provenance(decided, facts.part, facts.full_study, times)
    texts_of_numbers = {name: number.text for name, number in numbers.items()}
    written = {"macros": defined("n", texts_of_numbers) + known}
    written["figures"] = defined("caption", facts.captions)
    written |= {name: tex_table(name, data) for name in TEX_TABLES if name in outputs}
    for document, text in texts.items():
        written[document] = bibliography(text, references)
    origins = {
        "known": decided,
        "numbers": {name: number._asdict() for name, number in numbers.items()},
        "tables": {name: reads(name) for name in TEX_TABLES if name in outputs},
        "times": times,
    }
    written[Path(NUMBERS).stem] = json.dumps(origins, indent=1, allow_nan=False) + "\n"
    for name, content in written.items():
        write_text(content, outputs[name])


def _require_expected(asked: Entries, tables: Mapping[str, pd.DataFrame], facts: Facts) -> None:
    """Raise PaperError if a number does not satisfy its expectation in `NUMBERS_FILE`.

    Only numbers of the full study are checked. Numbers that depend on times may differ on other
    machines, so these only lead to a warning.
    """
    for name, found in unexpected(asked, tables).items() if facts.part is None else ():
        entry = asked[name]
        timed = declared()[entry.table].timing_columns if entry.table in declared() else ()
        if entry.column not in timed:
            raise PaperError(f"{NUMBERS_FILE}: {name}: {found}; change the sentence around it")
        log.warning(
            "%s: %s: %s; the text does not fit the times of this machine", NUMBERS_FILE, name, found
        )


TIMES = (
    r"\par\noindent\textcolor{okred}{The times of this run are unreliable: other programs used the "
    r"processor while they were measured. Times and speed-ups are left out here.}\par"
)


def shown_tables(tables: list[File]) -> tuple[dict[str, pd.DataFrame], str]:
    """Return name -> table, and `TIMES` if times are unreliable, else "".

    If they are unreliable, columns that depend on times are empty and listed in the attribute
    `HIDDEN`; cells about claims on times are empty, too, except the verdicts.
    """
    data = {table["name"]: read_table(table.path) for table in tables}
    if "frame_times" not in data or not unreliable(data["frame_times"]):
        return data, ""
    for name, frame in data.items():
        hidden = [c.name for c in declared()[name].columns if c.quantity == "timed"]
        data[name] = frame.assign(**dict.fromkeys(hidden, np.nan))
        data[name].attrs[HIDDEN] = hidden
        if "claim" in frame and "claims_tests" in data:
            tests = data["claims_tests"]
            on_times = frame.claim.isin(tests.claim[tests.margin.notna()])
            said = {c.name for c in declared()[name].columns if c.timed and c.kind != "integer"}
            kept = frame.columns.str.startswith(("verdict", "same", "answer"))
            data[name] = data[name].astype(dict.fromkeys(frame.select_dtypes(bool), object))
            data[name].loc[on_times, ~kept & frame.columns.isin(said)] = None
    return data, TIMES


def fact_tables(machine: Path, facts: Facts) -> dict[str, pd.DataFrame]:
    """Return name -> table: the tables of ``facts``, and "machine" from the file ``machine``.

    Table "machine" has one row: properties of the machine, versions of libraries (`version_NAME`).
    """
    tables = {name: pd.DataFrame(rows) for name, rows in facts.tables.items()}
    try:
        record = Record.model_validate_json(read_text(machine))
    except ValidationError as error:
        raise StorageError(f"{machine}: {describe(error, Record)}") from error
    row = record.model_dump(exclude={"libraries", "kernels", "units"})
    row |= {f"version_{name}": version for name, version in record.libraries.items()}
    architectures = {each["architecture"] for each in record.kernels} - {None}
    row["kernels"] = ", ".join(sorted(architectures))
    row |= {**record.units.model_dump(), "unit_s": record.units.unit_s}
    # names of processor and system may contain characters that TeX cannot typeset
    words = {key: replaced(value) for key, value in row.items() if isinstance(value, str)}
    return {**tables, "machine": pd.DataFrame([{**row, **words}])}


def build(
    source: list[Path], figures: list[File], inputs: list[File], facts: Facts,
    outputs: Mapping[str, str],
) -> None:  # fmt: skip
    """Build the PDFs of paper and supplement from the source and the files of `write_inputs`."""
    results = [Path(file.path) for file in (*figures, *inputs)]
    for path in results:
        require_intact(path)
    folder = source[0].parent
    made = {folder / f"{name}.tex": Path(outputs[name]) for name in DOCUMENTS}
    build_pdfs(made, sorted({path.parent for path in (*source[:3], *results)}), facts.pages)


_CITE = re.compile(r"\\cite\{([^}]*)\}")


def bibliography(source: str, references: Path) -> str:
    """Return a TeX bibliography of the works cited in ``source``, in the order of citation.

    Raises PaperError if the file ``references`` lacks a cited work, or a field of a work.
    """
    cited = [key.strip() for group in _CITE.findall(source) for key in group.split(",")]
    keys = list(dict.fromkeys(cited))
    set_strict_mode(False)
    try:
        entries = parse_file(str(references)).entries
        missing = [key for key in keys if key not in entries]
        if missing:
            raise PaperError(f"{references}: no entry for {', '.join(missing)}, cited in the text")
        formatted = list(Style().format_entries([entries[key] for key in keys]))
    except PybtexError as error:
        raise PaperError(f"{references}: {error}") from error
    backend = Backend(encoding="utf-8")
    lines = [r"\begin{thebibliography}{99}"]
    for entry in formatted:
        lines += [rf"\bibitem{{{entry.key}}}", entry.text.render(backend), ""]
    lines.append(r"\end{thebibliography}")
    return "\n".join(lines) + "\n"


REFERENCES = "paper/references.bib"
NUMBERS = "numbers.json"
FILES = (
    NUMBERS, "macros.tex", "figures.tex", *(f"{document}.bbl" for document in DOCUMENTS),
    *(f"{name}.tex" for name in TEX_TABLES),
)  # fmt: skip
paper_inputs = Artifact(
    "paper_inputs",
    "Numbers, tables and references of the manuscript",
    {
        "source": SourcesOf("manuscript"),
        "references": ProjectFile(REFERENCES),
        "tables": Every(TABLE),
        "machine": MACHINE,
        "facts": Setting("facts"),
        "made": Setting("made"),
    },
    {Path(name).stem: PAPER_INPUT.where(name=name) for name in FILES},
    write_inputs,
)
# The paths of the PDFs depend on the configuration; `Plan.fixed` sets them.
paper = Artifact(
    "paper",
    "Manuscript",
    {
        "source": SourcesOf("manuscript"),
        "figures": Every(FIGURE),
        "inputs": Every(PAPER_INPUT),
        "facts": Setting("facts"),
    },
    {},
    build,
)
