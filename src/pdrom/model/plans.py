"""Section ``reduce`` of a scene: the groups that are reduced, and a requested tolerance."""

from typing import Annotated, Any

from pydantic import Field

from pdrom.core.yamlfile import ConfigModel


class ReductionPlan(ConfigModel):
    """Experiments on one group: how many training snapshots its basis gets."""

    train: Annotated[int, Field(ge=2, le=100_000)]


def with_requested_error(keys: Any) -> Any:
    """Separate ``reduce.error``, the requested tolerance of the scene, from the groups' plans.

    ``keys`` are those of a scene file as read, and come back unchanged where none is requested.
    """
    plans = keys.get("reduce") if isinstance(keys, dict) else None
    if not isinstance(plans, dict) or "error" not in plans:
        return keys
    groups = {name: plan for name, plan in plans.items() if name != "error"}
    return {**keys, "reduce": groups, "requested_error": plans["error"]}
