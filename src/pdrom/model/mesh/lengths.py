"""Lengths in metres, as settings of the model have them."""

from typing import Annotated

from pydantic import Field

# Sums and squares of lengths within these limits neither overflow nor lose every digit.
MIN_LENGTH, MAX_LENGTH = 1e-6, 1e6
Length = Annotated[float, Field(ge=-MAX_LENGTH, le=MAX_LENGTH)]
PositiveLength = Annotated[float, Field(ge=MIN_LENGTH, le=MAX_LENGTH)]
