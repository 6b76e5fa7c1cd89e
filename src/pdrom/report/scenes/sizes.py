"""Which basis size pictures of a scene show."""

from collections.abc import Sequence

from pdrom.report.figures.kit.read import RerunInfo

SHOWN = 20  # modes


def shown(infos: Sequence[RerunInfo]) -> RerunInfo | None:
    """The run of the largest size up to `SHOWN`, else of the smallest; None if none ran."""
    ran = [info for info in infos if not info.marked]
    small = [info for info in ran if info.r <= SHOWN]
    return small[-1] if small else next(iter(ran), None)
