"""Entry indices and element indices, kept apart."""

from dataclasses import dataclass

import numpy as np

from pdrom.core.errors import SamplingError


@dataclass(frozen=True)
class Sampling:
    """Entries and elements that a method evaluates online.

    entries : indices into the vectorised projection (length 3 e p), in order of selection; for
        "joint" rows the x entry of each row stands for the row
    elements : indices of the elements that must be evaluated for them, unique, in order of need
    """

    entries: np.ndarray
    elements: np.ndarray

    @classmethod
    def of_entries(
        cls, entries: np.ndarray, rows_per_element: int, elements: int, repeats: bool = False
    ) -> "Sampling":
        """Sampling of entries; SamplingError for one out of range or, unless allowed, repeated.

        Parameters
        ----------
        entries : (m,) indices of a vectorised projection of all ``elements``
        rows_per_element : p
        repeats : whether an entry may come twice
        """
        entries = np.asarray(entries, dtype=np.int64)
        size = 3 * rows_per_element
        if len(entries) == 0 or entries.min() < 0 or entries.max() >= size * elements:
            raise SamplingError(
                f"entries {entries[:5].tolist()}...: allowed are 0 to {size * elements - 1}"
            )
        if not repeats and len(np.unique(entries)) < len(entries):
            raise SamplingError(f"{len(entries)} entries, some of them repeated")
        touched = entries // size
        first = np.sort(np.unique(touched, return_index=True)[1])
        return cls(entries, touched[first])

    @classmethod
    def of_elements(cls, elements: np.ndarray, rows_per_element: int, total: int) -> "Sampling":
        """Sampling of all 3p entries of ``elements`` (m,) of ``total``, p ``rows_per_element``."""
        elements = np.asarray(elements, dtype=np.int64)
        size = 3 * rows_per_element
        entries = (size * elements[:, None] + np.arange(size)).ravel()
        return cls.of_entries(entries, rows_per_element, total)
