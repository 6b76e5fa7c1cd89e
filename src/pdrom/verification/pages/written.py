"""``./reproduce pages``: everything for readers that is written from declarations."""

import sys
from pathlib import Path

from pdrom.core.errors import PdromError
from pdrom.pipeline.tracked import write_tracked
from pdrom.report.codecheck import FILE as CODECHECK
from pdrom.report.codecheck import codecheck
from pdrom.report.document import figures_page
from pdrom.tables import declared
from pdrom.tables.kit.document import document
from pdrom.verification.claim_map.pages import claim_pages


def pages() -> dict[Path, str]:
    """Content of each file by its place in the project, the working directory."""
    tables = declared().values()
    return {
        Path("docs/figures.md"): figures_page(),
        Path("docs/tables.md"): document(tables),
        CODECHECK: codecheck(tables),
        **claim_pages(Path()),
    }


def main() -> None:
    """Write what is out of date, and say so."""
    try:
        made = pages().items()
        old = [path for path, text in made if not path.is_file() or path.read_text("utf-8") != text]
        for path, text in made:
            if path in old:
                write_tracked(path, text.encode())
    except PdromError as error:
        sys.exit(f"pdrom: {error}")
    sys.stdout.write(f"written: {', '.join(map(str, old)) or 'nothing, all are up to date'}\n")


if __name__ == "__main__":
    main()
