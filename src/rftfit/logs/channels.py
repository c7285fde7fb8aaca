"""Whether the channels of a file were sampled at the same times, as the columns of one log must be."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.logs.base import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

SAME_S = 1e-6
"""Times closer than this are the same, s: files state the start of a channel to the microsecond."""


@dataclass(frozen=True)
class Clock:
    """When the samples of a channel were taken.

    `start`: Of the first one, s; NaN where the file does not say.
    `step`: s.
    """

    start: float
    step: float

    def same(self, other: Clock, samples: int) -> bool:
        """Tell whether two channels were sampled at the same times.

        `samples`: Over how many. Returns not where one of the starts is unknown.
        """
        unknown = math.isnan(self.start) and math.isnan(other.start)
        apart = 0.0 if unknown else abs(self.start - other.start)
        return apart + samples * abs(self.step - other.step) <= SAME_S


def one_clock(path: Path, clocks: Mapping[str, Clock], samples: int, rows: int = 0) -> Clock:
    """Return the clock that all channels of a log share.

    `clocks`: By channel; at least one. `samples`: Of each. `rows`: Of the file, for the ledger.
    """
    first, *others = clocks.values()
    if all(first.same(clock, samples) for clock in others):
        return first
    known = [clock.start for clock in clocks.values() if not math.isnan(clock.start)]
    zero = min(known, default=0.0)
    named = "; ".join(
        f"{name!r} from {round(clock.start - zero, 6):.12g} s, every {clock.step:.9g} s"
        for name, clock in clocks.items()
    )
    raise own_clocks(path, named, rows)


def own_clocks(path: Path, found: str, rows: int = 0) -> LogError:
    """Make the error of a log whose channels have clocks of their own.

    `found`: Those clocks. `rows`: Of the file, for the ledger.
    """
    return LogError(
        "clocks",
        f"{path}: its channels were not sampled at the same times, and a log has one time: found "
        f"{found}. Name those of one clock under force_log.columns and those of the other under "
        "motion_log.columns, or export them on one clock",
        rows,
    )
