"""One line of the reproduction table, and how its verdict comes about."""

from __future__ import annotations

import math
from dataclasses import dataclass

SAME, DIFFERS, INCONSISTENT = "same", "differs", "paper inconsistent"


@dataclass(frozen=True)
class Item:
    """A published number beside ours.

    Parameters
    ----------
    item : str
        What is compared, with its unit.
    where : str
        Table, figure or text of the paper.
    paper : float or str
        As printed.
    ours : float or str
        From this campaign.
    lo, hi : float
        Our 95 % interval; NaN if there is none.
    verdict : str
        `SAME`, `DIFFERS` or `INCONSISTENT`.
    why : str
        One line.
    """

    item: str
    where: str
    paper: float | str
    ours: float | str
    lo: float
    hi: float
    verdict: str
    why: str

    def row(self) -> dict[str, float | str]:
        """Return the item as a row of the table.

        Returns
        -------
        dict
        """
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def compare(
    item: str, where: str, paper: float, ours: float, tolerance: float,
    interval: tuple[float, float] = (math.nan, math.nan), note: str = "",
) -> Item:  # fmt: skip
    """Compare two numbers: the same within a stated tolerance, or within our interval.

    Parameters
    ----------
    item, where : str
    paper, ours : float
    tolerance : float
        Difference that rounding and repeatability explain.
    interval : tuple of float, optional
        Our interval.
    note : str, optional
        Put behind the reason.

    Returns
    -------
    Item
        Differs, with that reason, where ours is not a number.
    """
    lo, hi = interval
    if not math.isfinite(ours):
        verdict, why = DIFFERS, "no number in this campaign"
    elif abs(ours - paper) <= tolerance:
        verdict, why = SAME, f"within {tolerance:g}"
    elif lo <= paper <= hi:
        verdict, why = SAME, "within our interval"
    else:
        verdict, why = DIFFERS, f"off by {ours - paper:+.3g}, allowed {tolerance:g}"
    return Item(item, where, paper, ours, lo, hi, verdict, f"{why}; {note}" if note else why)
