"""Command line of pdrom as ``python -m pdrom``."""

from pdrom.command.main import main

main()
