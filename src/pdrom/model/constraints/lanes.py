"""Elements packed in blocks of `LANES` elements (structure of arrays) for vectorised loops.

A lane is the place of one element in a block. The k numbers of each element are stored in a flat
array as [block][number][lane]: number i of element e is entry
``(e // LANES * k + i) * LANES + e % LANES``. The last block is filled up with copies of the last
element. The working array of a kernel has this layout with a single block. Functions of one lane
are inlined into the loop over lanes and select between values instead of branching. Fast-math is
off, so that the result of an element does not depend on its lane.
"""

import numpy as np

from pdrom.model.compiled import rows
from pdrom.model.compiled.functions import inner
from pdrom.model.compiled.rows import at

LANES = 32

# SMALLEST is added to a scale so that its reciprocal does not overflow
SMALLEST = 1e-300


def lane_function(function):
    """Compile a ``function`` of one element: inlined, without checks for division by zero."""
    return inner(function, forceinline=True)


def blocks(elements: int) -> int:
    """Return the number of blocks of `LANES` elements for this number of ``elements``."""
    return -(-elements // LANES)


def pack(numbers: np.ndarray) -> np.ndarray:
    """Return the k numbers of e elements, (e, k), as flat array [block][number][lane] (see top)."""
    e, k = numbers.shape
    padding = np.repeat(numbers[-1:], blocks(e) * LANES - e, axis=0)
    padded = np.concatenate([numbers, padding]).reshape(blocks(e), LANES, k)
    return rows.copied(np.ascontiguousarray(padded.transpose(0, 2, 1)).ravel())


def workspace(numbers: int) -> np.ndarray:
    """Return a flat working array of zeros for one block: ``numbers`` values per element."""
    return rows.zeros(numbers * LANES)


@lane_function
def take(packed, numbers, elements, start, out):
    """Copy the packed numbers of ``elements[start:start + LANES]`` to the block ``out``.

    ``packed``, from `pack`, has k = ``numbers`` per element. If fewer than `LANES` elements are
    left, copies of the last one fill the block.
    """
    last = elements.shape[0] - 1
    for lane in range(LANES):
        e = elements[min(start + lane, last)]
        base = e // LANES * numbers * LANES + e % LANES
        for i in range(numbers):
            out[i * LANES + lane] = at(packed, base + i * LANES)


@lane_function
def load(work, first, lane):
    """Return the numbers ``first`` to ``first + 2`` of the element in a ``lane`` of ``work``."""
    return (
        at(work, first * LANES + lane),
        at(work, (first + 1) * LANES + lane),
        at(work, (first + 2) * LANES + lane),
    )


@lane_function
def save(work, first, lane, vector):
    """Write ``vector`` to numbers ``first`` to ``first + 2`` of the element in a ``lane``."""
    work[first * LANES + lane] = vector[0]
    work[(first + 1) * LANES + lane] = vector[1]
    work[(first + 2) * LANES + lane] = vector[2]


@lane_function
def load_matrix(work, first, lane):
    """Return nine numbers from ``first`` on, of the element in a ``lane``, as three vectors."""
    return load(work, first, lane), load(work, first + 3, lane), load(work, first + 6, lane)


@lane_function
def save_matrix(work, first, lane, matrix):
    """Write the three vectors of ``matrix`` to ``work``, in the places that `load_matrix` reads."""
    save(work, first, lane, matrix[0])
    save(work, first + 3, lane, matrix[1])
    save(work, first + 6, lane, matrix[2])


@lane_function
def unmarked(work, mark):
    """Return for how many elements of ``work`` the number at index ``mark`` is zero, as float."""
    left = 0.0
    for lane in range(LANES):
        left += 1.0 if work[mark * LANES + lane] == 0.0 else 0.0
    return left


@lane_function
def dot(a, b):
    """Return the inner product of two vectors ``a`` and ``b`` of three numbers."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@lane_function
def cross(a, b):
    """Return the vector product of ``a`` and ``b``."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@lane_function
def scaled(s, a):
    """Return the product s a of a number and a vector."""
    return (s * a[0], s * a[1], s * a[2])


@lane_function
def mix(s, a, t, b):
    """Return the linear combination s a + t b of two vectors."""
    return (s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2])


@lane_function
def mix3(r, a, s, b, t, c):
    """Return the linear combination r a + s b + t c of three vectors."""
    return (
        r * a[0] + s * b[0] + t * c[0],
        r * a[1] + s * b[1] + t * c[1],
        r * a[2] + s * b[2] + t * c[2],
    )


@lane_function
def choose(condition, a, b):
    """Return vector a if the condition holds, else vector b."""
    return (a[0] if condition else b[0], a[1] if condition else b[1], a[2] if condition else b[2])


@lane_function
def square_distance(a, b):
    """Return the squared distance of two points a and b."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@lane_function
def absolute_sum(a):
    """Return |a_0| + |a_1| + |a_2|; not finite if a component is not, or if it overflows."""
    return abs(a[0]) + abs(a[1]) + abs(a[2])


@lane_function
def clamp(x, low, high):
    """Return the number x, limited to the interval [low, high]."""
    x = low if x < low else x
    return high if x > high else x


@lane_function
def perpendicular(a):
    """Return a unit vector orthogonal to the unit vector a; equal a give equal results."""
    x, y, z = abs(a[0]), abs(a[1]), abs(a[2])
    first = x <= y and x <= z
    second = not first and y <= z
    # the cross product a x e_k, where component k of a is the smallest in magnitude
    turned = choose(
        first, (0.0, a[2], -a[1]), choose(second, (-a[2], 0.0, a[0]), (a[1], -a[0], 0.0))
    )
    return scaled(1.0 / np.sqrt(dot(turned, turned)), turned)
