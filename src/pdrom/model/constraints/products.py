"""Nearest singular values with a product in a range, for volume and area constraints.

Given s_1 >= s_2 >= |s_3|, the nearest t_i > 0 with product c satisfy t_i (t_i - s_i) = m with a
Lagrange multiplier m. With the unknown t = t_3, m = t (t - s_3), t_1 and t_2 are the larger roots
of their equations, and a single equation remains (for areas without t_2):

    f(t) = t t_1(t) t_2(t) - c = 0

If the product of the s_i is below c, there is one solution. If it is far above c (more than six
times for three equal values), there are several: that with the largest t shrinks all values, that
with the smallest t mainly the last one. As f is convex near the largest and concave near the
smallest t, Newton's iteration converges monotonically to the largest from above and to the smallest
from below; the result is that nearer to the s_i. Bouaziz et al. 2014, app. A, start from s_i only.

Values are divided by the larger of s_1 and c^(1/3), so that neither huge nor tiny ones overflow.
"""

import numpy as np

from pdrom.model.constraints.lanes import LANES, SMALLEST, lane_function, load, save

# offsets in the working array: singular values (input, then result) and intermediate numbers
VALUES, SCALE, TARGET, LARGEST, LEAST, MARK, SIZE = 0, 3, 4, 5, 6, 7, 8
STEPS = 60
# state of one element: still iterating; converged or diverged; its product was already in the range
_OPEN, _CLOSED, _INSIDE = 1.0, 0.0, 2.0
# Iteration for t (see top) ends at a step up to LAST_STEP * t; |f| up to ROUNDOFF * c counts as 0.
LAST_STEP, ROUNDOFF = 1e-15, 1e-10


@lane_function
def _partner(t, s, last):
    """Return t_i(t), the larger root x of x (x - s_i) = t (t - s_3), and dx/dt; ``last``: s_3."""
    square = s * s + 4.0 * t * (t - last)
    root = np.sqrt(square if square > 0.0 else 0.0)
    return 0.5 * (s + root), (2.0 * t - last) / root if root > 0.0 else 1.0


@lane_function
def _product(t, values, solid):
    """Return t t_1 t_2 for ``values`` s_i, its derivative by t, t_1, t_2 (which is 1 for areas)."""
    first, first_slope = _partner(t, values[0], values[2])
    second, second_slope = _partner(t, values[1], values[2])
    second = second if solid else 1.0
    second_slope = second_slope if solid else 0.0
    slope = first * second + t * (first_slope * second + first * second_slope)
    return t * first * second, slope, first, second


@lane_function
def _start(work, low, high, solid):
    """Scale s_i, set initial t (symbols: see module); return how many may have several t."""
    low_root = low ** (1.0 / 3.0) if solid else np.sqrt(low)
    high_root = high ** (1.0 / 3.0) if solid else np.sqrt(high)
    several = 0.0
    for lane in range(LANES):
        s = load(work, VALUES, lane)
        product = s[1] * s[2] * s[0]
        below, above = product < low, product > high
        bound, root = (low, low_root) if below else (high, high_root)
        scale = s[0] if s[0] > root else root
        inverse = 1.0 / scale
        target = bound * inverse * inverse * (inverse if solid else 1.0)
        # raise a tiny target to SMALLEST, negligible compared with the scaled singular values
        target = target if target > SMALLEST else SMALLEST
        first, second = s[0] * inverse, s[1] * inverse if solid else 1.0
        # bounds on the unknown t if values must grow: t_1 >= s_1, t_2 >= s_2, t_1 >= t_2 >= t
        least = target / (first * second)
        largest = root * inverse
        other = np.sqrt(target / first) if solid else least
        largest = other if other < largest else largest
        largest = least if least < largest else largest
        far = above and product >= 2.0 * bound
        save(work, VALUES, lane, (first, second, s[2] * inverse))
        work[SCALE * LANES + lane] = scale
        work[TARGET * LANES + lane] = target
        work[LARGEST * LANES + lane] = largest if below else s[2] * inverse
        work[LEAST * LANES + lane] = least if far else 0.0
        work[MARK * LANES + lane] = _OPEN if below or above else _INSIDE
        several += 1.0 if far else 0.0
    return several


@lane_function
def _advance(work, place, side, solid):
    """Do a Newton step for the unknown t (at offset ``place``) of each element of the block, from
    above the solution (``side`` 1) or below (-1); return how many elements need another step."""
    left = 0.0
    for lane in range(LANES):
        t, target = work[place * LANES + lane], work[TARGET * LANES + lane]
        mark = work[MARK * LANES + lane]
        product, slope, _, _ = _product(t, load(work, VALUES, lane), solid)
        excess = side * (product - target)
        step = excess / slope
        ahead = slope > 0.0 and excess >= -ROUNDOFF * target and step > LAST_STEP * t
        new = t - side * step
        going = mark == _OPEN and ahead and new >= 0.0
        work[place * LANES + lane] = new if going else t
        closed = _CLOSED if mark == _OPEN else mark
        work[MARK * LANES + lane] = _OPEN if going else closed
        left += 1.0 if going else 0.0
    return left


@lane_function
def _distance(t, values, target, solid):
    """Return the squared distance of s_i (``values``) from t_1, t_2, t; inf unless f(t) = 0."""
    product, _, first, second = _product(t, values, solid)
    m = t * (t - values[2])
    a, b = m / (first + SMALLEST), m / (second + SMALLEST) if solid else 0.0
    solved = abs(product - target) <= ROUNDOFF * target
    return a * a + b * b + (t - values[2]) ** 2 if solved else np.inf


@lane_function
def _finish(work, solid):
    """Write the unscaled t_1, t_2, t to `VALUES`, for the t whose values are nearer to the s_i."""
    for lane in range(LANES):
        values, target = load(work, VALUES, lane), work[TARGET * LANES + lane]
        t, other = work[LARGEST * LANES + lane], work[LEAST * LANES + lane]
        nearer = other > 0.0 and (
            _distance(other, values, target, solid) < _distance(t, values, target, solid)
        )
        t = other if nearer else t
        _, _, first, second = _product(t, values, solid)
        inside, scale = work[MARK * LANES + lane] == _INSIDE, work[SCALE * LANES + lane]
        save(
            work, VALUES, lane,
            (
                scale * (values[0] if inside else first),
                (scale * (values[1] if inside else second)) if solid else 1.0,
                scale * (values[2] if inside else t),
            ),
        )  # fmt: skip


@lane_function
def nearest_block(work, low, high, solid):
    """Replace the values of a block by the nearest ones with a product in [low, high], low > 0.

    work : `SIZE` numbers per lane; at `VALUES` s_1 >= s_2 >= |s_3|, or for areas s_1, 1, s_3 with
        s_1 >= s_3 >= 0, where the 1 is not changed; values that are not finite give nan
    solid : whether there are three values (volume) instead of two (area)
    """
    several = _start(work, low, high, solid)
    for _ in range(STEPS):
        if _advance(work, LARGEST, 1.0, solid) == 0.0:
            break
    if several > 0.0:
        # elements that may have several solutions t (see top): find the smallest, from below
        for lane in range(LANES):
            mark = work[MARK * LANES + lane]
            again = mark == _CLOSED and work[LEAST * LANES + lane] > 0.0
            work[MARK * LANES + lane] = _OPEN if again else mark
        for _ in range(STEPS):
            if _advance(work, LEAST, -1.0, solid) == 0.0:
                break
    _finish(work, solid)


def reference_nearest(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return the nearest values (e, 2 or 3) with a product in [low, high], by bisection with NumPy.

    If several solutions are possible, each is bracketed on a grid, and the nearest is returned.
    """
    product = values.prod(axis=1)
    bound = np.clip(product, low, high)
    found = values.copy()
    one = (product < low) | ((product > high) & (product < 2.0 * bound))
    last, root = values[one, -1], bound[one] ** (1.0 / values.shape[1])
    start = np.where(product[one] < low, 0.0, 0.5 * last)
    found[one] = _bisected(start, np.maximum(root, last), values[one], bound[one])
    for e in np.flatnonzero((product > high) & ~one):
        found[e] = _nearest_of_several(values[e], float(bound[e]))
    return found


def _values_at(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (n, 2 or 3): t_1, t_2 (not for areas) and ``t`` (n,), see top; ``values`` are s_i."""
    others, last = values[:, :-1], values[:, -1]
    square = np.square(others) + 4.0 * (t * (t - last))[:, None]
    return np.column_stack([0.5 * (others + np.sqrt(np.maximum(square, 0.0))), t])


def _bisected(
    below: np.ndarray, above: np.ndarray, values: np.ndarray, target: np.ndarray
) -> np.ndarray:
    """Bisect t from ``below`` to ``above`` (n,); return `_values_at` t, with product ``target``."""
    for _ in range(120):
        middle = 0.5 * (below + above)
        small = _values_at(middle, values).prod(axis=1) < target
        below, above = np.where(small, middle, below), np.where(small, above, middle)
    return _values_at(above, values)


def _nearest_of_several(values: np.ndarray, target: float) -> np.ndarray:
    last = values[-1]
    smallest = min(target / values[:-1].prod(), last)
    grid = np.union1d(np.geomspace(smallest, last, 500), np.linspace(smallest, last, 500))
    same = np.tile(values, (len(grid), 1))
    # the product at t = grid[0] exceeds ``target`` only by rounding errors, hence small[0]
    small = _values_at(grid, same).prod(axis=1) < target
    small[0] = True
    crossed = np.flatnonzero(small[:-1] & ~small[1:])
    found = _bisected(grid[crossed], grid[crossed + 1], same[crossed], np.array(target))
    return found[np.argmin(np.square(found - values).sum(axis=1))]
