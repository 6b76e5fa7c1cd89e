"""A user's wish for the error of a run, and how errors are measured."""

from typing import Annotated, Literal, get_args

import numpy as np
from pydantic import Field

from pdrom.core.errors import ConfigurationError, choices
from pdrom.core.yamlfile import ConfigModel, shown

Quantity = Literal["position", "velocity"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)


class Ask(ConfigModel):
    """Largest relative error of a run against its implicit step, solved to convergence.

    error : 0.01 is one per cent
    quantity : whose error it is, over all frames
    """

    error: Annotated[float, Field(gt=0.0, lt=1.0)]
    quantity: Quantity = "position"

    def __str__(self) -> str:
        plural = {"position": "positions", "velocity": "velocities"}
        return f"{100 * self.error:g} % of the {plural[self.quantity]}"


def read_ask(wish: object, source: str = "error") -> Ask:
    """Read a wish: an `Ask`, a number, or text such as "0.01" or "velocity=0.05".

    Raises
    ------
    ConfigurationError
        Naming ``source``: no number above 0 and below 1, or an unknown quantity.
    """
    if isinstance(wish, Ask):
        return wish
    quantity, given, number = str(wish).rpartition("=")
    if given and quantity not in QUANTITIES:
        raise ConfigurationError(
            f"{source}: unknown quantity {shown(quantity, 60)}{choices(quantity, QUANTITIES)}"
        )
    try:
        error = float(number)
    except ValueError:
        error = float("nan")
    if isinstance(wish, bool) or not 0.0 < error < 1.0:
        raise ConfigurationError(
            f"{source} = {shown(wish, 60)}: a number above 0 and below 1 is required, such as 0.01 "
            "or velocity=0.05"
        )
    return Ask.model_validate({"error": error, **({"quantity": quantity} if given else {})})


def relative_error(run: np.ndarray, reference: np.ndarray, quantity: Quantity) -> float:
    """Error of a ``run`` over the motion of its ``reference``, both positions (F + 1, N, 3) m.

    ``quantity`` says of what: positions, or velocities, which are differences of the ends of
    frames: the step loop has no others. Infinite where the run is not finite; zero where nothing
    moves and nothing is wrong.
    """
    moved, wrong = reference - reference[0], run - reference
    if quantity == "velocity":
        moved, wrong = np.diff(moved, axis=0), np.diff(wrong, axis=0)
    size, error = float(np.linalg.norm(moved)), float(np.linalg.norm(wrong))
    if not np.isfinite(error):
        return np.inf
    return error / size if size > 0.0 else (np.inf if error > 0.0 else 0.0)
