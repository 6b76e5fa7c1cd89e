"""``python -m pdrom.verification ARGS...``: what ``./reproduce verify ARGS...`` starts."""

import sys

from pdrom.verification.command import verify
from pdrom.verification.status import ended

if __name__ == "__main__":
    sys.exit(ended(lambda: verify(sys.argv[1:])))
