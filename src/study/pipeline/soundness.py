"""Check that NumPy and SciPy calculate correctly on this machine, with the kernels that jobs use.

``./reproduce`` runs this check before it accepts a new environment. A linear algebra library can be
broken on a processor for some shapes of matrices, and can end the process without a message. The
name of each calculation is therefore printed before it is made.
"""

import faulthandler
import sys
from collections.abc import Iterator
from itertools import product
from typing import Any

from pdrom.core.environment import settle

# Test matrices: numbers of rows (of one element up to a whole group) and columns (basis sizes).
ROWS = (1, 2, 3, 4, 6, 9, 12, 27, 48, 96, 100, 256, 300, 900, 1000, 2700)
COLUMNS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 25, 32, 50)
# Allowed error divided by max(1, largest expected entry); rounding errors are far smaller.
TOLERANCE = 1e-9


def main() -> None:
    """Make all test `calculations`; if one fails or crashes, the last line of output names it."""
    faulthandler.enable()
    settle()
    for what in calculations():
        sys.stdout.write(f"{what}\n")
        sys.stdout.flush()


def calculations() -> Iterator[str]:
    """Yield the name of each test calculation, before it is made, so that it is printed first."""
    import numpy as np
    import scipy.linalg

    random = np.random.default_rng(1)
    for rows, columns in product(ROWS, COLUMNS):
        x = random.standard_normal((rows, columns))
        # reference product for comparison; einsum calls no linear algebra library here
        gram = np.einsum("ij,ik->jk", x, x)
        where = f"with X of {rows} x {columns}"
        yield f"numpy: X.T @ (2 * X) {where}"
        compare(x.T @ (2 * x), 2 * gram)
        yield f"numpy: X.T @ X {where}"
        compare(x.T @ x, gram)
        yield f"scipy: X.T @ X {where}"
        compare(scipy.linalg.blas.dgemm(1.0, x, x, trans_a=True), gram)
        yield f"scipy: pivoted QR factors {where}"
        q, r, order = scipy.linalg.qr(x, mode="economic", pivoting=True)
        compare(q @ r, x[:, order])
        for name, linalg in (("numpy", np.linalg), ("scipy", scipy.linalg)):
            yield f"{name}: singular values {where}"
            left, values, right = linalg.svd(x, full_matrices=False)
            compare((left * values) @ right, x)
            yield f"{name}: solution of a system of {columns} unknowns"
            regular = gram + rows * np.eye(columns)
            compare(regular @ linalg.solve(regular, x.T), x.T)


def compare(found: Any, expected: Any) -> None:
    """Exit if ``found`` and ``expected`` differ by more than `TOLERANCE` or are not finite."""
    import numpy as np

    if not np.abs(found - expected).max() <= TOLERANCE * max(np.abs(expected).max(), 1.0):
        sys.exit("a wrong result")


if __name__ == "__main__":
    main()
