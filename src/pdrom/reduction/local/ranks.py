"""Basis sizes of the reruns."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

Rank = Annotated[int, Field(ge=1, le=100_000)] | Literal["full"]


def resolve_ranks(ranks: Sequence[Rank], rank: int) -> list[int]:
    """``ranks`` ascending, "full" replaced by the numerical ``rank`` (left out if 0)."""
    full = [rank] if "full" in ranks and rank > 0 else []
    return sorted({*(int(r) for r in ranks if r != "full"), *full})
