"""Runs of pandoc, the program that a wheel brings along, without a network."""

import json
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from pdrom.core.errors import PaperError

LIMIT = 300.0  # seconds; a definition that expands to itself never ends
Tree = dict[str, Any]


def parsed(text: str, files: Mapping[str, str], references: Path) -> Tree:
    r"""Pandoc's syntax tree of a LaTeX source ``text``, with its bibliography.

    Parameters
    ----------
    files : what the source reads by ``\input``, by name
    references : BibTeX

    Raises
    ------
    PaperError
        Pandoc is not installed, or refuses the source.
    """
    with tempfile.TemporaryDirectory(prefix="pdrom-pandoc-") as folder:
        for name, content in {**files, "article.tex": text}.items():
            Path(folder, name).write_text(content, encoding="utf-8")
        words = ["-f", "latex", "-t", "json", "--citeproc", "-M", "link-citations=true"]
        words += ["--bibliography", str(references.resolve()), "article.tex"]
        tree: Tree = json.loads(_run(words, folder, ""))
        return tree


def page(tree: Tree, template: Path, variables: Mapping[str, str]) -> str:
    """HTML of ``tree`` by a ``template`` with ``variables``; PaperError as in `parsed`.

    Formulas are MathML, a table of contents comes first.
    """
    words = ["-f", "json", "-t", "html5", "--mathml", "--wrap=none", "--toc", "--toc-depth=2"]
    words += ["--standalone", "--shift-heading-level-by=1", f"--template={template.resolve()}"]
    words += [word for name, value in variables.items() for word in ("-V", f"{name}={value}")]
    return _run(words, None, json.dumps(tree))


def _run(words: Sequence[str], folder: str | None, given: str) -> str:
    spec = find_spec("pypandoc")
    program = Path(spec.origin or "").parent / "files" / "pandoc" if spec else None
    if program is None or not program.is_file():
        raise PaperError("no pandoc: the package pypandoc-binary of requirements.lock is missing")
    command = [str(program), "--quiet", *words]
    try:
        done = subprocess.run(
            command, input=given, cwd=folder, capture_output=True, encoding="utf-8",
            timeout=LIMIT, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise PaperError(f"pandoc does not end within {LIMIT:g} s") from error
    if done.returncode != 0:
        raise PaperError(f"pandoc: {' '.join(done.stderr.split())[:300]}")
    return done.stdout
