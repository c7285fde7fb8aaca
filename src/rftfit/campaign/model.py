"""What every section of the configuration is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64)]


class Model(BaseModel):
    """A section of the configuration: unknown keys are errors, values never change."""

    # strict: "24" in quotes or `yes` is no number, and the user should hear of it
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
