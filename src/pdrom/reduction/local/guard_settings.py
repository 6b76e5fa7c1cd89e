"""Settings of the guard (section ``guard`` of config/default.yaml)."""

from typing import Annotated, Literal

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel

Action = Literal["none", "report", "stop", "fall-back"]
Margin = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class GuardSettings(ConfigModel):
    """What a reduced run does when it leaves the trained range, and where that range ends.

    action : "none" watches nothing, "report" logs and counts, "stop" ends the run, "fall-back"
        repeats the frame with full projections
    margin : how far the coefficients may lie outside the box that the training snapshots span, as
        a fraction of the box's diagonal
    extent : multiple of the largest bounding box of the training run
    rise : relative rise of the objective over the second half of a frame's iterations
    """

    action: Action = "report"
    margin: Margin = 0.1
    extent: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 1.5
    rise: Margin = 0.1
