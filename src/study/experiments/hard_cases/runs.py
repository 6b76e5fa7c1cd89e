"""Full-order runs of hard cases."""

from collections.abc import Callable

import numpy as np

from pdrom.model.scene import Scene
from study.experiments.hard_cases.case import HardCase
from study.experiments.hard_cases.record import Record, record
from study.experiments.hard_cases.roundoff import Roundoff


def full_order(
    case: HardCase, scene: Scene, observe: Callable[[int, np.ndarray], None] | None = None
) -> Record:
    """Run ``scene``, made by ``case``, from its start; ``observe`` sees every last iterate."""
    loop = scene.stepper()
    return record(scene, loop, case.start(scene), roundoff=Roundoff(scene, loop), observe=observe)
