"""Settings of the guard (section ``guard`` of config/default.yaml)."""

from typing import Annotated, Literal

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel

Action = Literal["none", "report", "stop", "fall-back"]
AlarmName = Literal["trained-range", "estimate"]
Threshold = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Margin = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class GuardSettings(ConfigModel):
    """Alarm of a reduced run, and the reaction to it.

    action : "none" watches nothing, "report" logs and counts, "stop" ends the run, "fall-back"
        repeats the frame with full projections
    alarm : the run leaves the "trained-range", see `pdrom.reduction.local.trained_range`, or the
        "estimate" of its error exceeds the threshold, see `pdrom.reduction.local.estimate_alarm`
    threshold : largest estimate, relative to the motion, that is no alarm
    margin : how far the coefficients may lie outside the box that the training snapshots span, as
        a fraction of the box's diagonal
    extent : multiple of the largest bounding box of the training run
    rise : relative rise of the objective over the second half of a frame's iterations
    """

    action: Action = "report"
    alarm: AlarmName = "trained-range"
    threshold: Threshold = 0.12
    margin: Margin = 0.1
    extent: Annotated[float, Field(ge=1.0, allow_inf_nan=False)] = 1.5
    rise: Margin = 0.1
