"""How the logs of a campaign are written: dialect, text format, and which column is which quantity."""

from __future__ import annotations

import codecs
from typing import Annotated, Any, Generic, Literal, TypeVar

from pydantic import BeforeValidator, Field, field_validator, model_validator

from rftfit.campaign.model import Model, Positive

ForceQuantity = Literal["time", "arm_moving", "F1", "F2", "F3", "T1", "T2", "T3"]
MotionQuantity = Literal["time", "x", "z", "angle"]
QUANTITIES = ("time", "arm_moving", "F1", "F2", "F3", "T1", "T2", "T3", "x", "z", "angle")
"""What a column of a log can be; T1 to T3 are read and not used by the chain."""

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=64)]
Unit = Literal[
    "N", "mN", "kN", "lbf", "N m", "N mm", "um", "mm", "cm", "m", "in", "deg", "rad",
    "s", "ms", "us", "ns", "min", "h",
]  # fmt: skip
Q = TypeVar("Q", bound=str)


class TextFormat(Model):
    """Any delimited text, described; the file is then read by the dialect ``delimited``."""

    delimiter: Literal[",", ";", "tab", "blank", "bar"] = Field(
        default=",",
        description="what stands between cells; blank: any number of blanks and tabs; bar: the vertical bar",
    )
    decimal: Literal[".", ","] = Field(default=".", description="decimal mark of the numbers")
    skip_lines: int = Field(
        default=0, ge=0, le=1000, description="lines in front of the row of names, or of the data"
    )
    names: bool = Field(
        default=True,
        description="whether a row of names follows; else columns go by number, from 1",
    )
    units: bool = Field(default=False, description="whether a row of units follows that")
    comment: str = Field(
        default="",
        max_length=8,
        description="lines that begin with this are no data, for example #",
    )
    encoding: str = Field(
        default="", description="of the names; default: UTF-8, or else Windows-1252"
    )
    rate_Hz: Positive | None = Field(
        default=None, description="rows a second, where no column holds the time, Hz"
    )

    @field_validator("encoding")
    @classmethod
    def _known(cls, name: str) -> str:
        try:
            codecs.lookup(name or "utf-8")
        except LookupError:
            raise ValueError(
                f"no encoding is called {name!r}; common ones: utf-8, cp1252, latin-1, shift_jis"
            ) from None
        return name


class Column(Model):
    """The column of a quantity."""

    column: str | Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="its name as rftfit inspect shows it, or its number, from 1"
    )
    unit: Unit | None = Field(
        default=None, description="its unit; needed where the file states none"
    )
    factor: float = Field(
        default=1.0, description="multiplied onto the values, for example -1 where down is positive"
    )
    constant: float | None = Field(
        default=None, description="value of a quantity that no column holds and that stays the same"
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> Column:
        if (self.column is None) == (self.constant is None):
            raise ValueError("needs either a column or a constant")
        if self.factor == 0:
            raise ValueError("a factor of 0 would erase the column")
        return self


def _short(value: Any) -> Any:
    """Turn a bare name or number into a column."""
    plain = isinstance(value, str | int) and not isinstance(value, bool)
    return {"column": value} if plain else value


Chosen = Annotated[Column, BeforeValidator(_short, json_schema_input_type=Column | str | int)]


class Source(Model, Generic[Q]):
    """How one kind of log is written."""

    dialect: Name | None = Field(
        default=None, description="default: the campaign's; delimited where `text` is given"
    )
    text: TextFormat | None = Field(
        default=None, description="the format, for the dialect delimited"
    )
    options: dict[Name, str | int | float | bool] = Field(
        default={}, description="what the dialect can be told, see its documentation"
    )
    columns: dict[Q, Chosen] = Field(
        default={}, description="quantity: column; default: the columns are named by the quantities"
    )

    @model_validator(mode="after")
    def _text_is_delimited(self) -> Source[Q]:
        if self.text is not None and self.dialect not in (None, "delimited"):
            raise ValueError(f"`text` goes with the dialect delimited, found {self.dialect}")
        if self.text is None and self.dialect == "delimited":
            raise ValueError("the dialect delimited needs `text`, the description of the format")
        return self


class ForceLog(Source[ForceQuantity]):
    """How force logs are written."""


class MotionLog(Source[MotionQuantity]):
    """How motion logs are written."""


AnyLog = ForceLog | MotionLog
