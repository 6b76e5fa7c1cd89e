"""docs/claim_map.md and the README's table are what the declarations and the measurement say."""

import re

import pandas as pd
import pytest

from pdrom.core.errors import StorageError
from pdrom.core.store import write_table
from pdrom.report.figures.kit.catalogue import declarations
from pdrom.tables import declared
from pdrom.tables.claims import load_claims
from pdrom.verification.claim_map.entries import entries
from pdrom.verification.claim_map.measured import COLUMNS
from pdrom.verification.claim_map.pages import PAGE, README, load, main, pages
from places import CONFIG, ROOT

COMMAND = ".venv/bin/python -m pdrom.verification.claim_map.pages"


@pytest.mark.parametrize("place", [PAGE, README], ids=str)
def test_a_page_is_up_to_date(place):
    made = pages(ROOT, load(ROOT))[place]
    assert (ROOT / place).read_text(encoding="utf-8") == made, f"run {COMMAND}"


def test_every_claim_figure_and_table_has_a_line():
    page = pages(ROOT, {})[PAGE]
    claims = load_claims(CONFIG / "claims.yaml")
    assert [name for name in claims if f"| {name} |" not in page] == []
    assert [name for name in declarations() if f"| [{name}](figures.md) |" not in page] == []
    assert [name for name in declared() if f"(tables.md#{name}) |" not in page] == []


def test_every_section_with_numbers_has_a_line():
    texts = {p.stem: p.read_text("utf-8") for p in (ROOT / "paper" / "sections").glob("*.tex")}
    uses = {
        name: {table for table in declared() if rf"\val{{{table}|" in text}
        for name, text in texts.items()
    }
    listed = {e.name: set(e.rests_on) for e in entries(ROOT) if e.kind == "section"}
    assert {name: used for name, used in uses.items() if used} == {
        name: held for name, held in listed.items() if name in texts
    }


def test_the_readme_names_a_command_for_every_claim_and_every_figure_of_the_preprint():
    text = pages(ROOT, {})[README]
    for name in load_claims(CONFIG / "claims.yaml"):
        assert re.search(rf"^\| {name}: .*`\./reproduce [a-z_0-9 :]+` \|", text, re.MULTILINE), name
    for figure in declarations().values():
        assert figure.number is None or f"`./reproduce figure preprint:{figure.number}`" in text


def test_a_measurement_is_taken_over(tmp_path, monkeypatch):
    (tmp_path / "docs").mkdir()
    for name in ("README.md", "config", "paper"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "README.md").unlink()
    (tmp_path / "README.md").write_bytes((ROOT / "README.md").read_bytes())
    monkeypatch.chdir(tmp_path)
    row = dict.fromkeys(COLUMNS) | {
        "kind": "claim", "name": "C5", "verdict": "holds", "verdict_beyond": "does not hold",
        "configuration": "config/own.yaml", "machine": "a machine",
    }  # fmt: skip
    figure = row | {"kind": "figure", "name": "strain_runs", "minutes": 12.34, "memory": 512.0}
    table = pd.DataFrame([row, figure], columns=list(COLUMNS))
    write_table(table, "map.csv")
    main(["map.csv"])
    readme, page = (tmp_path / "README.md").read_text(), (tmp_path / PAGE).read_text()
    assert re.search(
        r"^\| C5: .* \| holds \| does not hold \| `./reproduce figure preprint:7` \| 12 \|$",
        readme,
        re.M,
    )
    assert "| `./reproduce figure preprint:7` | 12 | – | 512 | – |" in page
    assert "run of `config/own.yaml` on a machine" in page


def test_a_foreign_file_replaces_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_table(pd.DataFrame({"kind": ["claim"]}), "map.csv")
    with pytest.raises(StorageError, match="lacks the column"):
        main(["map.csv"])
    assert not (tmp_path / "results").exists()
