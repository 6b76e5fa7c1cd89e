"""``python -m study.verification ARGS...``: what ``./reproduce verify ARGS...`` starts."""

import sys

from study.verification.command import verify
from study.verification.status import ended

if __name__ == "__main__":
    sys.exit(ended(lambda: verify(sys.argv[1:])))
