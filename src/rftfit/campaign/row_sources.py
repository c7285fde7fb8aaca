"""What a row of the run sheet says of its logs: which rows and which columns are those of the run."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal, get_args

from rftfit.campaign.config import AnyLog, Column, ForceLog, ForceQuantity, MotionQuantity
from rftfit.campaign.problems import unknown_word

LogKind = Literal["force", "motion"]

_QUANTITIES = {"force": get_args(ForceQuantity), "motion": get_args(MotionQuantity)}


def read_assignments(text: str) -> dict[str, str]:
    """Read ``name=value; name=value``; raises ValueError if it is written in another way."""
    assignments: dict[str, str] = {}
    for item in filter(str.strip, text.split(";")):
        name, equals, value = (cell.strip() for cell in item.partition("="))
        if not (name and equals and value):
            raise ValueError(f"found {item.strip()!r}")
        if name in assignments:
            raise ValueError(f"found {name} twice")
        assignments[name] = value
    return assignments


def read_columns(text: str, log: LogKind) -> dict[str, str]:
    """Read the columns of a log, quantity by quantity; raises ValueError for an unknown quantity."""
    columns = read_assignments(text)
    for quantity in columns:
        if quantity not in _QUANTITIES[log]:
            raise ValueError(unknown_word("quantity", quantity, _QUANTITIES[log]))
    return columns


def source_of_row(source: AnyLog, where: str, columns: str) -> AnyLog:
    """Return how a log is written, with what a row of the run sheet says in place of the config."""
    if not where and not columns:
        return source
    kind: LogKind = "force" if isinstance(source, ForceLog) else "motion"
    changed: dict[str, object] = {}
    if where:
        changed["where"] = {
            name: [word.strip() for word in words.split(",")]
            for name, words in _assignments(where).items()
        }
    if columns:
        columns_of_row: dict[str, Column] = {}
        for quantity, name in read_columns(columns, kind).items():
            stated = source.columns.get(quantity)  # type: ignore[call-overload]
            as_given = name if not name.isdigit() else int(name)
            if stated is None or stated.column is None:
                columns_of_row[quantity] = Column(column=as_given)
            else:
                columns_of_row[quantity] = stated.model_copy(
                    update={"column": as_given, "plus": None}
                )
        every: dict[Any, Column] = {**source.columns, **columns_of_row}
        changed["columns"] = every
    return source.model_copy(update=changed)


_assignments = lru_cache(256)(read_assignments)
