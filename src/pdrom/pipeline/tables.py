"""Pages of the tables, docs/tables.md and codecheck.yml: ``python -m pdrom.pipeline.tables``."""

from pathlib import Path

from pdrom.report.codecheck import FILE as CODECHECK
from pdrom.report.codecheck import codecheck
from pdrom.tables import declared
from pdrom.tables.kit.document import document

if __name__ == "__main__":
    Path("docs/tables.md").write_text(document(declared().values()), encoding="utf-8")
    CODECHECK.write_text(codecheck(declared().values()), encoding="utf-8")
