"""``pdrom view RESULT ...``: a page to look at runs."""

import argparse
import sys
import webbrowser
from pathlib import Path

from pdrom.command.base import Command, Status, require_output
from pdrom.command.results import declare_results, files_of, viewed


def declare(parser: argparse.ArgumentParser) -> None:
    """Add to ``parser`` the runs, and the page to write."""
    declare_results(parser)
    parser.add_argument("--out", metavar="FILE", help="page to write; the first RESULT as .html")
    parser.add_argument("--open", action="store_true", help="open it in the browser")


def perform(arguments: argparse.Namespace) -> Status:
    """Write the page of the runs in ``arguments`` and say where it is."""
    from pdrom.report.viewer.page import write_page

    first = Path(arguments.results[0])
    out = Path(arguments.out or first.parent / f"{first.stem}.html")
    require_output(out, files_of(arguments.results))
    write_page(viewed(arguments), out)
    size = out.stat().st_size / 1e6
    sys.stdout.write(f"{out}: {size:.1f} MB; a browser opens it without a network\n")
    if arguments.open and not webbrowser.open(out.resolve().as_uri()):
        sys.stderr.write("pdrom: no browser was found; open the file by hand\n")
    return Status.DONE


COMMAND = Command(
    "Write a page on which runs are looked at",
    "pdrom view sheet_spring_gappy_20.h5 --open",
    declare,
    perform,
)
