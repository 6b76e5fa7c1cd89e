"""Figures of the page: pictures, PDF files where they are small, and what made them."""

import io
import shutil
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

from pdrom.core.store import atomic_path, require_intact
from study.article.tree import Node, attributes, link, plain, words
from study.artifact.reads import TableOf
from study.figures.kit.declaration import declarations

# Bytes: a larger picture loses what nobody sees; a larger PDF is left to the command.
LOSSLESS, COPIED = 150_000, 200_000
MANY = 4  # keys of options that say what is drawn


def write_picture(png: Path, out: Path) -> tuple[int, int]:
    """Write the picture ``png`` of a figure as WebP ``out``; return width and height, pixels."""
    require_intact(png)
    with Image.open(png) as image:
        drawn = image.convert("RGB")
    packed = io.BytesIO()
    drawn.save(packed, "WEBP", lossless=True, method=3)
    if packed.tell() > LOSSLESS:
        packed = io.BytesIO()
        drawn.save(packed, "WEBP", quality=85, method=4)
    with atomic_path(out) as temporary:
        temporary.write_bytes(packed.getvalue())
    return drawn.size


def copy_pdf(pdf: Path, out: Path) -> bool:
    """Copy a figure's ``pdf`` to ``out`` where it is small; whether it is."""
    require_intact(pdf)
    small = pdf.stat().st_size <= COPIED
    if small:
        with atomic_path(out) as temporary:
            shutil.copyfile(pdf, temporary)
    return small


def shown_figure(
    name: str, node: Node, size: tuple[int, int], with_pdf: bool, pages: Mapping[str, str]
) -> Node:
    """A figure with its picture, the caption as its words, its command, data, PDF and kin.

    Parameters
    ----------
    node : of the figure in the syntax tree
    size : of the picture, pixels
    with_pdf : whether its PDF lies beside the page
    pages : of the figures that stand in the documents, by name
    """
    attribute, caption, _ = node["c"]
    inlines = [attributes("", "", width=str(size[0]), height=str(size[1]), loading="lazy")]
    alternative = words(plain(caption[1]).strip())
    image = {"t": "Image", "c": [*inlines, alternative, [f"figures/{name}.webp", ""]]}
    lines = {"t": "Div", "c": [attributes("", "origin"), [_para(_origin(name, with_pdf, pages))]]}
    return {"t": "Figure", "c": [attribute, [caption[0], [*caption[1], lines]], [_para([image])]]}


def _para(inlines: list[Node]) -> Node:
    return {"t": "Plain", "c": inlines}


def _origin(name: str, with_pdf: bool, pages: Mapping[str, str]) -> list[Node]:
    declared = declarations()[name]
    tables = [read.name for read in declared.reads.values() if isinstance(read, TableOf)]
    made = [*words("Command: "), {"t": "Code", "c": [attributes(), f"./reproduce figure {name}"]}]
    made += words(". Data: " if tables else ". Drawn from the runs themselves")
    for place, table in enumerate(tables):
        made += [*words(", " if place else ""), link(words(table), f"tables/{table}.html")]
    made += words(". ")
    if with_pdf:
        made += [link(words("PDF"), f"figures/{name}.pdf"), *words(". ")]
    for place, other in enumerate(_kin(name, pages)):
        made += words(", " if place else "Other scenes: ")
        made.append(link(words(other), f"{pages[other]}#fig:{other}", "kin"))
    if made[-1]["t"] == "Link":
        made += words(".")
    mark = {
        "t": "Span",
        "c": [attributes("", "", data_verified=f"figure {name}"), words("not yet")],
    }
    return [*made, *words(" Last verification: "), mark, *words(".")]


def _kin(name: str, pages: Mapping[str, str]) -> list[str]:
    """Names of figures that show the same of other scenes.

    They share the type of their options, where that has many keys, or their name.
    """
    listed = declarations()
    mine = listed[name].options
    return [
        other
        for other, declared in listed.items()
        if other in pages
        and other != name
        and (
            (declared.options is mine and len(mine.model_fields) >= MANY)
            or other.startswith(f"{name}_")
            or name.startswith(f"{other}_")
        )
    ]
