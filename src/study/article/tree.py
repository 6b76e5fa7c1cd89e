"""Edit pandoc's syntax tree: make nodes, number sections and figures, resolve references."""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

from pdrom.core.errors import PaperError
from study.article.latex import ORIGIN

Node = dict[str, Any]  # a node of the syntax tree, or the whole tree


def attributes(identifier: str = "", classes: str = "", **keys: str) -> list[Any]:
    """Return attributes of a node: ``classes`` separated by spaces, ``keys`` with "_" for "-"."""
    return [identifier, classes.split(), [[k.replace("_", "-"), v] for k, v in keys.items()]]


def boxed(
    kind: str, content: list[Node], identifier: str = "", classes: str = "", **keys: str
) -> Node:
    """Return a "Span" or "Div" (``kind``) around ``content``; other arguments: see `attributes`."""
    return {"t": kind, "c": [attributes(identifier, classes, **keys), content]}


def words(text: str) -> list[Node]:
    """Return a list of nodes for plain ``text``."""
    return [{"t": "Str", "c": text}]


def link(inlines: list[Node], address: str, classes: str = "") -> Node:
    """Return the node of a link to an ``address`` whose shown nodes are ``inlines``.

    If ``inlines`` are a formula, its text becomes the title of the link, for screen readers.
    """
    formula = all(node["t"] == "Math" for node in inlines)
    title = re.sub(r"\\cdot ?|[{}\\]", lambda m: "·" if "cdot" in m[0] else "", plain(inlines))
    return {"t": "Link", "c": [attributes("", classes), inlines, [address, title * formula]]}


def plain(node: Any) -> str:
    """Return the text of a node, or of a list of nodes, without formatting."""
    if isinstance(node, list):
        return "".join(map(plain, node))
    if not isinstance(node, dict):
        return ""
    kind, content = node.get("t"), node.get("c")
    if kind in ("Space", "SoftBreak", "LineBreak"):
        return " "
    if kind == "Str":
        return str(content)
    return str(node["c"][1]) if kind in ("Math", "Code") else plain(content)


def changed(node: Any, visit: Callable[[Node], Any]) -> Any:
    """Replace each node by the node or list that ``visit`` returns; None keeps the node."""
    if isinstance(node, list):
        made: list[Any] = []
        for each in node:
            new = changed(each, visit)
            many = isinstance(each, dict) and isinstance(new, list)
            made += new if many else [new]
        return made
    if not isinstance(node, dict):
        return node
    new = visit(node) if "t" in node else None
    return {k: changed(v, visit) for k, v in node.items()} if new is None else new


_LABEL = re.compile(r"\\label\{([^{}]*)\}")
_EQUATION = re.compile(r"\\begin\{(equation|align)\}")
_CLAIM = re.compile(r"(\W*)(C\d+)\b(.*)")
_COLOUR = re.compile(r"color: (ok\w+)")
PARAGRAPH = 4  # heading level that pandoc gives to LaTeX's \paragraph


@dataclass
class Labels:
    """Counters of figures, tables etc. of one document, and the numbers of all TeX labels.

    prefix, page : prefix of all numbers, such as "S", and file name of the document's page
    numbers : TeX label -> (number, page)
    """

    prefix: str
    page: str
    numbers: dict[str, tuple[str, str]]
    counts: Counter[str] = field(default_factory=Counter)
    sections: list[int] = field(default_factory=list)

    def next(self, kind: str, label: str = "") -> str:
        """Return the next number of a ``kind`` (figure, table ...); store it under ``label``."""
        self.counts[kind] += 1
        return self.note(label, f"{self.prefix}{self.counts[kind]}")

    def section(self, level: int, label: str) -> str:
        """Return the number of the next section of a ``level`` and store it under ``label``."""
        self.sections = [*self.sections, *[0] * level][:level]
        self.sections[-1] += 1
        return self.note(label, self.prefix + ".".join(map(str, self.sections)))

    def note(self, label: str, number: str) -> str:
        """Store ``number`` and this page under a ``label`` that is not empty; return ``number``."""
        if label:
            self.numbers[label] = (number, self.page)
        return number


def numbered(tree: Node, labels: Labels, shown: Callable[[str, Node], Node]) -> Node:
    """Number sections, figures, tables, equations and theorems of ``tree``; lay them out for HTML.

    ``labels`` receive the numbers of TeX labels; ``shown`` replaces the name and node of a figure.
    """

    def visit(node: Node) -> Any:
        kind, content = node["t"], node.get("c", [])
        if kind == "Header" and content[0] < PARAGRAPH:
            level, attribute, inlines = content
            number = labels.section(level, attribute[0])
            return {"t": kind, "c": [level, attribute, [*words(f"{number}\u2002"), *inlines]]}
        if kind == "Figure":
            name = re.sub(r"^fig:", "", content[0][0])
            number = labels.next("figure", content[0][0])
            return shown(name, _captioned(node, f"Figure {number}."))
        if kind == "Div" and content[1] and content[1][0]["t"] == "Table":
            return _table(content[0][0], content[1][0], labels)
        if kind == "Div" and content[0][0] == "refs":
            title = {"t": "Header", "c": [1, attributes("references"), words("References")]}
            return [title, node]
        if kind == "Div" and (which := {"theorem", "proposition"} & set(content[0][1])):
            # pandoc's number in the theorem's heading lacks the document's prefix: replace it
            content[1][0]["c"][0]["c"][-1]["c"] = labels.next(which.pop(), content[0][0])
        if kind == "Math" and content[0]["t"] == "DisplayMath":
            return _equation(node, labels)
        return None

    return changed(tree, visit)


def _table(label: str, node: Node, labels: Labels) -> Node:
    """Return the table ``node`` in a region that can be scrolled, below its caption."""

    def headed(node: Node) -> Node | None:
        """Return a formula followed by its TeX for screen readers; None for any other node."""
        return boxed("Span", [node, _heard(plain(node))]) if node["t"] == "Math" else None

    content = _captioned(node, f"Table {labels.next('table', label)}.")["c"]
    head = changed(content[3], headed)
    for cell in (cell for row in head[1] for cell in row[1]):
        cell[4] = cell[4] if plain(cell[4]).strip() else [{"t": "Plain", "c": [_heard("row")]}]
    table = {"t": "Table", "c": [content[0], [None, []], content[2], head, *content[4:]]}
    region = {"role": "region", "tabindex": "0", "aria_label": plain(content[1])[:80]}
    caption = boxed("Div", content[1][1], "", "caption")
    return boxed("Div", [caption, boxed("Div", [table], "", "scroll", **region)], label)


def _heard(text: str) -> Node:
    return boxed("Span", words(text), "", "heard")


def _captioned(node: Node, opening: str) -> Node:
    """Return a figure or table with ``opening`` (such as "Table 3.") before its caption."""
    attribute, (short, blocks), *others = node["c"]
    strong, first = {"t": "Strong", "c": words(opening)}, blocks[0]["c"] if blocks else []
    opened = {"t": "Plain", "c": [strong, {"t": "Space"}, *first]}
    return {"t": node["t"], "c": [attribute, [short, [opened, *blocks[1:]]], *others]}


def _equation(node: Node, labels: Labels) -> Node:
    """Return a display formula with its number, or one number per line of ``align``."""
    kind, tex = node["c"]
    found = _EQUATION.search(tex)
    lines = [] if found is None else [tex] if found[1] == "equation" else tex.split(r"\\")
    names = [named[1] if (named := _LABEL.search(line)) else "" for line in lines]
    marks = [
        boxed("Span", words(f"({labels.next('equation', name)})"), name, "number") for name in names
    ]
    math = {"t": "Math", "c": [kind, _LABEL.sub("", tex)]}
    numbers = boxed("Span", marks, "", "numbers")
    return boxed("Span", [math, numbers], "", "equation", tabindex="0")


def resolved(tree: Node, labels: Mapping[str, tuple[str, str]], pages: Mapping[str, str]) -> Node:
    """Turn references, values, names of claims and tables into links; put headings in line.

    ``labels``: TeX label -> (number, page); ``pages``: name of a claim or table -> address.
    Raises PaperError if the text refers to a missing label.
    """

    def visit(node: Node) -> Any:
        kind, content = node["t"], node.get("c", [])
        if kind == "Link":
            return _resolved_link(node, labels)
        if kind == "Str" and (found := _CLAIM.fullmatch(content)) and found[2] in pages:
            here = link(words(found[2]), pages[found[2]], "claim")
            return [*words(found[1]), here, *words(found[3])]
        if kind == "Code" and content[1] in pages:
            return link([node], pages[content[1]])
        if kind == "Span" and (colour := _COLOUR.search(str(content[0][2]))):
            return boxed(kind, changed(content[1], visit), "", colour[1])
        return None

    found = changed(tree, visit)
    return {**found, "blocks": _run_in(found["blocks"])}


def _run_in(blocks: list[Node]) -> list[Node]:
    """Replace each heading of a paragraph by bold words at the beginning of the paragraph."""
    made: list[Node] = []
    heading: list[Node] = []
    for block in blocks:
        if block["t"] == "Header" and block["c"][0] >= PARAGRAPH:
            heading = [{"t": "Strong", "c": block["c"][2]}, {"t": "Space"}]
            continue
        if heading and block["t"] == "Para":
            block = {"t": "Para", "c": [*heading, *block["c"]]}
        elif heading:
            made.append({"t": "Para", "c": heading})
        made.append(block)
        heading = []
    return made


def _resolved_link(node: Node, labels: Mapping[str, tuple[str, str]]) -> Node | None:
    attribute, inlines, (address, _) = node["c"]
    if address.startswith(ORIGIN):
        key = bytes.fromhex(address.removeprefix(ORIGIN)).decode()
        # the key has the name of a table, and filters of the rows that the page of the table shows
        table, _, rows = key.partition("|")
        place = re.sub(r'[% "<>#]', lambda sign: quote(sign[0]), rows)
        return link(inlines, f"tables/{table}.html" + (f"#{place}" if place else ""), "val")
    keys = dict(attribute[2])
    if "reference" not in keys:
        return None
    label = keys["reference"]
    if label not in labels:
        raise PaperError(f"manuscript: the text refers to label {label}, which does not exist")
    number, page = labels[label]
    shown = f"({number})" if keys["reference-type"] == "eqref" else number
    return link(words(shown), f"{page}#{label}")
