"""Check that NumPy and SciPy calculate correctly on this machine, with the kernels that jobs use.

``./reproduce`` runs this check before it accepts a new environment. A linear algebra library can be
broken on a processor for some shapes of matrices, and can end the process without a message. The
shape of each matrix is therefore printed before the calculations.
"""

import faulthandler
import sys
from itertools import product

from pdrom.core.environment import settle

# Test matrices: numbers of rows (of one element up to a whole group) and columns (basis sizes).
ROWS = (1, 2, 3, 4, 6, 9, 12, 27, 48, 96, 100, 256, 300, 900, 1000, 2700)
COLUMNS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 25, 32, 50)
# Allowed error divided by max(1, largest expected entry); rounding errors are far smaller.
TOLERANCE = 1e-9


def main() -> None:
    """Calculate with matrices X of many shapes; the last line of output names the last shape."""
    faulthandler.enable()  # the stack of a crash has the line of the calculation
    settle()
    import numpy as np
    import scipy.linalg

    random = np.random.default_rng(1)
    for rows, columns in product(ROWS, COLUMNS):
        sys.stdout.write(f"NumPy or SciPy with X of {rows} x {columns}\n")
        sys.stdout.flush()
        x = random.standard_normal((rows, columns))
        gram = np.einsum("ij,ik->jk", x, x)  # calls no linear algebra library here
        regular = gram + rows * np.eye(columns)
        q, r, order = scipy.linalg.qr(x, mode="economic", pivoting=True)
        made = [(x.T @ (2 * x), 2 * gram), (x.T @ x, gram), (q @ r, x[:, order])]
        for linalg in (np.linalg, scipy.linalg):
            left, values, right = linalg.svd(x, full_matrices=False)
            made += [((left * values) @ right, x), (regular @ linalg.solve(regular, x.T), x.T)]
        for found, expected in made:
            if not np.abs(found - expected).max() <= TOLERANCE * max(np.abs(expected).max(), 1.0):
                sys.exit("a wrong result")


if __name__ == "__main__":
    main()
