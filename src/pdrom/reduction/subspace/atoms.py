"""Held vertices, split into the smallest sets that are always held together."""

from collections.abc import Sequence

import numpy as np

from pdrom.model.effects.base import Boundary


def atoms(boundaries: Sequence[Boundary], vertices: int) -> list[np.ndarray]:
    """Disjoint sets of vertices whose union is everything that is ever held.

    Two vertices share an atom if the same units of the boundaries hold them; a unit is then a union
    of atoms, and holding it fixes whole atoms.
    """
    units = [unit for boundary in boundaries for unit in boundary.units()]
    if not units:
        return []
    member = np.zeros((vertices, len(units)), dtype=bool)
    for column, unit in enumerate(units):
        member[unit, column] = True
    held = np.flatnonzero(member.any(axis=1))
    _, inverse = np.unique(member[held], axis=0, return_inverse=True)
    inverse = inverse.ravel()
    sets = [held[inverse == label] for label in range(inverse.max() + 1)]
    return sorted(sets, key=lambda s: int(s[0]))
