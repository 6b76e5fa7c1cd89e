"""Syntax tree of pandoc: its nodes, and the article in it, numbered and linked."""

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

from pdrom.core.errors import PaperError
from study.article.latex import ORIGIN

Node = dict[str, Any]  # and the whole tree


def attributes(identifier: str = "", classes: str = "", **keys: str) -> list[Any]:
    """Attributes of a node: its ``identifier``, ``classes`` in a string, and further ``keys``."""
    return [identifier, classes.split(), [[k.replace("_", "-"), v] for k, v in keys.items()]]


def boxed(
    kind: str, content: list[Node], identifier: str = "", classes: str = "", **keys: str
) -> Node:
    """A Span or a Div (``kind``) around ``content``, see `attributes`."""
    return {"t": kind, "c": [attributes(identifier, classes, **keys), content]}


def words(text: str) -> list[Node]:
    """Plain text as inline nodes."""
    return [{"t": "Str", "c": text}]


def link(inlines: list[Node], address: str, classes: str = "") -> Node:
    """Make a link around ``inlines`` to an ``address``, of some ``classes``.

    One of a formula alone has it as its title, too, which screen readers read.
    """
    formula = all(node["t"] == "Math" for node in inlines)
    title = re.sub(r"\\cdot ?|[{}\\]", lambda m: "·" if "cdot" in m[0] else "", plain(inlines))
    return {"t": "Link", "c": [attributes("", classes), inlines, [address, title * formula]]}


def plain(node: Any) -> str:
    """Text of a node without its marks."""
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
    """Return a tree in which ``visit`` has replaced nodes; it returns None to leave one.

    A replaced node is not looked into. A list of nodes replaces one among others.
    """
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
PARAGRAPH = 4  # level of a heading that opens a paragraph


@dataclass
class Labels:
    """Numbers of labels, and the pages that they are on."""

    prefix: str
    page: str
    numbers: dict[str, tuple[str, str]]
    counts: Counter[str] = field(default_factory=Counter)

    def next(self, kind: str, label: str = "") -> str:
        """Number of the next figure, table ... (``kind``); a ``label`` will stand for it."""
        self.counts[kind] += 1
        return self.note(label, f"{self.prefix}{self.counts[kind]}")

    def section(self, level: int, label: str) -> str:
        """Number of the next section of a ``level``; a ``label`` will stand for it."""
        self.counts[f"level{level}"] += 1
        for deeper in range(level + 1, PARAGRAPH):
            self.counts[f"level{deeper}"] = 0
        parts = [str(self.counts[f"level{above}"]) for above in range(1, level + 1)]
        return self.note(label, self.prefix + ".".join(parts))

    def note(self, label: str, number: str) -> str:
        """Let a label stand for a number."""
        if label:
            self.numbers[label] = (number, self.page)
        return number


def numbered(tree: Node, labels: Labels, shown: Callable[[str, Node], Node]) -> Node:
    """Number sections, figures, tables, equations and theorems of ``tree``, and lay them out.

    Parameters
    ----------
    labels : gets the number of every label
    shown : makes of a figure's name and its node, with the number in its caption, what is shown
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
            # pandoc's heading has the name and a number without prefix
            content[1][0]["c"][0]["c"][-1]["c"] = labels.next(which.pop(), content[0][0])
        if kind == "Math" and content[0]["t"] == "DisplayMath":
            return _equation(node, labels)
        return None

    return changed(tree, visit)


def _table(label: str, node: Node, labels: Labels) -> Node:
    """A table that scrolls, below its caption, which does not."""

    def headed(node: Node) -> Node | None:
        """A formula in a head, with its letters for those who listen."""
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
    """A figure or a table whose caption opens with its number."""
    attribute, (short, blocks), *others = node["c"]
    words_of_caption = blocks[0]["c"] if blocks else []
    strong = {"t": "Strong", "c": words(opening)}
    opened = {"t": "Plain", "c": [strong, {"t": "Space"}, *words_of_caption]}
    return {"t": node["t"], "c": [attribute, [short, [opened, *blocks[1:]]], *others]}


def _equation(node: Node, labels: Labels) -> Node:
    """An equation beside its number; one of several lines has a number for each."""
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


def resolved(tree: Node, labels: Mapping[str, tuple[str, str]], claims: Mapping[str, Any]) -> Node:
    """Give references their numbers, numbers and claims their links; open paragraphs in bold.

    Parameters
    ----------
    labels : number and page of each
    claims : by name; the text names them

    Raises
    ------
    PaperError
        The text refers to a label that no document has.
    """

    def visit(node: Node) -> Any:
        kind, content = node["t"], node.get("c", [])
        if kind == "Link":
            return _resolved_link(node, labels)
        if kind == "Str" and (found := _CLAIM.fullmatch(content)) and found[2] in claims:
            here = link(words(found[2]), f"claims.html#{found[2]}", "claim")
            return [*words(found[1]), here, *words(found[3])]
        if kind == "Span" and (colour := _COLOUR.search(str(content[0][2]))):
            return boxed(kind, changed(content[1], visit), "", colour[1])
        return None

    found = changed(tree, visit)
    return {**found, "blocks": _run_in(found["blocks"])}


def _run_in(blocks: list[Node]) -> list[Node]:
    """Headings of paragraphs as the bold words that these begin with."""
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
        # the rows that a key names (`study.paper.macros`) on the table's page
        table, _, rows = key.partition("|")
        place = re.sub(r'[% "<>#]', lambda sign: quote(sign[0]), rows)
        return link(inlines, f"tables/{table}.html" + (f"#{place}" if place else ""), "val")
    keys = dict(attribute[2])
    if "reference" not in keys:
        return None
    label = keys["reference"]
    if label not in labels:
        raise PaperError(f"manuscript: no label {label}, which the text refers to")
    number, page = labels[label]
    shown = f"({number})" if keys["reference-type"] == "eqref" else number
    return link(words(shown), f"{page}#{label}")
