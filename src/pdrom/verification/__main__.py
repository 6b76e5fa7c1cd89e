"""``python -m pdrom.verification ARGS...``: what ``./reproduce verify ARGS...`` starts."""

import sys

from pdrom.core.errors import PdromError
from pdrom.core.logs import INTERRUPTED
from pdrom.verification.command import verify
from pdrom.verification.status import Status


def main() -> int:
    """The exit code; faulty input ends with one line."""
    try:
        return verify(sys.argv[1:])
    except PdromError as error:
        sys.stderr.write(f"pdrom: {error}\n")
        return Status.FAULTY
    except KeyboardInterrupt:
        sys.stderr.write("pdrom: interrupted\n")
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
