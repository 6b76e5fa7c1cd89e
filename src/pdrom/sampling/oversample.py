"""More elements than modes (oversampling), where the sampled basis is weakest."""

import numpy as np
from scipy import linalg


def extend_elements(v: np.ndarray, size: int, elements: np.ndarray, count: int) -> np.ndarray:
    """``elements`` followed by others, ``count`` in all (or as many as there are).

    The gain of the interpolation is 1 / sigma_min of the sampled rows of the basis ``v``
    (size e, r). Each step takes the element with the largest norm in the direction of the smallest
    right singular vector, which bounds the growth of sigma_min (cf. GappyPOD+E, Peherstorfer,
    Drmac and Gugercin 2020, sect. 4, where the gap to the next singular value enters, too).
    """
    blocks = v.reshape(-1, size, v.shape[1])
    chosen = [int(e) for e in elements]
    gram = np.einsum("esk,esl->kl", blocks[chosen], blocks[chosen])
    while len(chosen) < min(count, len(blocks)):
        weakest = linalg.eigh(gram, subset_by_index=(0, 0))[1][:, 0]
        strength = np.einsum("es,es->e", blocks @ weakest, blocks @ weakest)
        strength[chosen] = -1.0
        new = int(np.argmax(strength))
        chosen.append(new)
        gram += blocks[new].T @ blocks[new]
    return np.array(chosen, dtype=np.int64)
