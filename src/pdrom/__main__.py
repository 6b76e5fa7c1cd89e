"""``python -m pdrom``: the command line."""

from pdrom.command.main import main

main()
