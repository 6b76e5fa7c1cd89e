"""Nodes of pandoc's syntax tree: making them, reading them, replacing them."""

import re
from collections.abc import Callable
from typing import Any

Node = dict[str, Any]


def attributes(identifier: str = "", classes: str = "", **keys: str) -> list[Any]:
    """Attributes of a node: its ``identifier``, ``classes`` in a string, and further ``keys``."""
    return [identifier, classes.split(), [[k.replace("_", "-"), v] for k, v in keys.items()]]


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


def content_of(node: Node) -> Any:
    """Content of a node, None of one without any."""
    return node.get("c")


def plain(node: Any) -> str:
    """Text of a node without its marks."""
    if isinstance(node, list):
        return "".join(map(plain, node))
    if not isinstance(node, dict):
        return ""
    kind, content = node.get("t"), content_of(node)
    if kind in ("Space", "SoftBreak", "LineBreak"):
        return " "
    if kind == "Str":
        return str(content)
    return str(content[1]) if kind in ("Math", "Code") else plain(content)


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
