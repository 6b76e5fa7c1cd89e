"""docs/claim_map.md and the README's table: every entry, its command, the expected verdicts."""

import re

from pdrom.report.figures.kit.catalogue import declarations
from pdrom.tables import declared
from pdrom.tables.claims import load_claims
from pdrom.verification.claim_map.entries import entries
from pdrom.verification.claim_map.pages import PAGE, README, claim_pages, expected_verdicts
from places import CONFIG, ROOT


def test_every_claim_figure_and_table_has_a_line():
    page = claim_pages(ROOT)[PAGE]
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
    text = claim_pages(ROOT)[README]
    for name in load_claims(CONFIG / "claims.yaml"):
        assert re.search(rf"^\| {name}: .*`\./reproduce [a-z_0-9 :]+` \|", text, re.MULTILINE), name
    for figure in declarations().values():
        assert figure.number is None or f"`./reproduce figure preprint:{figure.number}`" in text


def test_verdicts_are_those_of_the_expected_tables():
    readme = claim_pages(ROOT)[README]
    verdicts = expected_verdicts(ROOT)
    assert set(verdicts) == set(load_claims(CONFIG / "claims.yaml"))
    for name, (published, beyond) in verdicts.items():
        assert re.search(rf"^\| {name}: .* \| {published} \| {beyond} \|", readme, re.MULTILINE), (
            name
        )
