"""Web pages of tables, and of the claims with their rules, tests, outcomes and history."""

import base64
import gzip
from collections.abc import Mapping
from html import escape

import pandas as pd

from pdrom.view.page import filled
from study.artifact.paths import RESULTS, TABLE
from study.figures.kit.declaration import declarations
from study.tables import declared
from study.tables.claims.metrics import METRICS
from study.tables.claims.rules import ClaimRule, TestRule
from study.tables.kit.declaration import QUANTITIES, TOLERANCES

FACTS = {
    "study": "Settings of the study that its text states",
    "methods": "Methods of the configuration",
    "scenes": "Scenes of the configuration",
    "machine": "The machine that the study ran on",
}


def table_page(name: str, csv: bytes, template: str) -> str:
    """HTML page of table ``name`` from its ``csv``: data, command, tolerance of each column."""
    table = declared().get(name)
    columns = "".join(
        f"<tr data-column='{c.name}'><th scope=row>{c.name}</th>"
        f"<td>{escape(c.meaning)}</td><td>{escape(c.unit)}</td>"
        f"<td>{c.quantity}: {escape(QUANTITIES[c.quantity])}</td>"
        f"<td>{f'{c.within:g}' if c.quantity in TOLERANCES else 'not judged'}</td></tr>"
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
    """Argument of ./reproduce that makes table ``name``; facts belong to ``paper_inputs``."""
    if name in FACTS:
        return "paper_inputs"
    return TABLE.at(RESULTS, name=name) if name in declarations() else name


def list_page(names: list[str], template: str) -> str:
    """HTML page by ``template`` with a link and the title of each table in ``names``."""
    known = declared()
    items = "".join(
        f"<li><a href='tables/{name}.html'><code>{name}</code></a> "
        f"{escape(known[name].title if name in known else FACTS[name])}</li>"
        for name in names
    )
    return filled(template, {"TITLE": "Tables", "BODY": f"<ul>{items}</ul>"})


PARTS = {"published": "As published", "beyond": "Beyond"}


def claims_page(
    claims: Mapping[str, ClaimRule],
    tests: pd.DataFrame,
    verdicts: pd.DataFrame,
    pages: Mapping[str, str],
    template: str,
) -> str:
    """HTML page by ``template`` of all ``claims``, given as rules by name.

    Parameters
    ----------
    pages : page of each figure that the documents contain, by the figure's name
    """
    found, body = verdicts.set_index("claim"), ""
    for name, rule in claims.items():
        mine, verdict, shown = tests[tests.claim == name], found.loc[name], rule.figure_or_table
        place = f"{pages[shown]}#fig:{shown}" if shown in pages else f"tables/{shown}.html"
        history = "".join(
            f"<li>{c.date} ({'results were known' if c.after_data else 'before any result'}): "
            f"{escape(c.reason)}</li>"
            for c in rule.changes
        )
        body += (
            f"<section aria-labelledby='{name}'><h2 id='{name}'>{name}: {escape(rule.paper)}</h2>"
            f"<p>{escape(rule.text)} <small>{escape(rule.source)}, section {escape(rule.section)}, "
            f"figures: {escape(rule.shown)}. Qualifiers: {escape(rule.qualifiers)}.</small></p>"
            f"<p><strong>As published: {escape(verdict.verdict)}. "
            f"Beyond: {escape(verdict.verdict_beyond)}.</strong> Last "
            f"<code>./reproduce verify</code>: <span data-verified='claim {name}'>not yet</span>. "
            f"Command: <code>./reproduce claims</code>. Shown in <a href='{place}'>{shown}</a>.</p>"
            f"{''.join(_tests(name, part, getattr(rule, part), mine) for part in PARTS)}"
            f"<h3>History of the rules</h3><ul>{history}</ul>"
            f"<p><small>Rules: <code>config/claims.yaml</code>, "
            f"fingerprint {rule.fingerprint}.</small></p></section>"
        )
    return filled(template, {"TITLE": "Claims", "BODY": body})


def _tests(name: str, part: str, rules: tuple[TestRule, ...], tests: pd.DataFrame) -> str:
    rows = "<tr><th>test</th><th>rule</th><th>rows that satisfy it</th><th>found</th></tr>"
    for rule, row in zip(rules, tests[tests.part == part].itertuples(), strict=True):
        aside = "" if rule.decides else " (beside the verdict)"
        place = f"tables/claims_tests.html#claim={name}|part={part}|satisfied"
        values = f"{row.least:.2g} to {row.most:.2g}, median {row.median:.2g}: " if row.of else ""
        rows += (
            f"<tr><td>{escape(rule.what)}{aside}</td><td>{_rule(rule)}</td>"
            f"<td><a class=val href='{place}'>{row.satisfied} of {row.of}</a></td>"
            f"<td>{values}{escape(row.verdict)}</td></tr>"
        )
    label = f"Tests of {name}, {part}"
    return (
        f"<h3>{PARTS[part]}</h3><div class=scroll tabindex=0 role=region aria-label='{label}'>"
        f"<table>{rows}</table></div>"
    )


def _rule(rule: TestRule) -> str:
    table = METRICS[rule.metric].table
    where = "; ".join(
        f"{column}: {', '.join(map(str, values))}" for column, values in rule.where.items()
    )
    sign = {">=": "at least", "<=": "at most"}[rule.compare]
    margin = f"; ratios within a factor {rule.factor:g} decide nothing" if rule.timed else ""
    return (
        f"<code>{rule.metric}</code> of <a href='tables/{table}.html'>{table}</a>"
        f"{f' ({escape(where)})' if where else ''} {sign} {rule.threshold:g}, "
        f"in {rule.share:.0%} of the rows{margin}; <code>./reproduce {argument(table)}</code>"
    )
