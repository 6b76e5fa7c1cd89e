"""Full-order runs of hard cases."""

from collections.abc import Callable

import numpy as np

from pdrom.hardcases.case import HardCase
from pdrom.hardcases.record import Record, record
from pdrom.hardcases.roundoff import Roundoff
from pdrom.scene import Scene


def full_order(
    case: HardCase, scene: Scene, observe: Callable[[int, np.ndarray], None] | None = None
) -> Record:
    """Run ``scene``, made by ``case``, from its start; ``observe`` sees every last iterate."""
    loop = scene.stepper()
    return record(scene, loop, case.start(scene), Roundoff(scene, loop), observe=observe)
