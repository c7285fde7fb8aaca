"""Whether the channels of a file were sampled at the same times, as the columns of one log must be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from rftfit.logs.base import LogError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

SAME_S = 1e-6
"""Times closer than this are the same, s: files state the start of a channel to the microsecond."""


class MixedClocksError(LogError):
    """A log whose channels have clocks of their own; `groups`: the channels that share one."""

    def __init__(
        self, path: Path, found: str, groups: Sequence[Sequence[str]], rows: int = 0
    ) -> None:
        super().__init__(
            "clocks",
            f"{path}: its channels were not sampled at the same times, and a log has one time: found "
            f"{found}. Name those of one clock under force_log.columns and those of the other under "
            "motion_log.columns, or export them on one clock",
            rows,
        )
        self.groups = groups


class ChannelClock(NamedTuple):
    """When the samples of a channel were taken, s; the start is NaN where the file does not say."""

    start: float
    step: float

    def same(self, other: ChannelClock, samples: int) -> bool:
        """Tell whether so many samples of two channels were taken at the same times."""
        unknown = math.isnan(self.start) and math.isnan(other.start)
        apart = 0.0 if unknown else abs(self.start - other.start)
        return apart + samples * abs(self.step - other.step) <= SAME_S


def common_clock(
    path: Path,
    clocks: Mapping[str, ChannelClock],
    samples: int,
    *,
    others: Iterable[str] = (),
    rows: int = 0,
) -> ChannelClock:
    """Return the clock that all channels share, or refuse the log; `others` are looked at elsewhere."""
    groups: list[list[str]] = []
    for name, clock in clocks.items():
        same = (group for group in groups if clocks[group[0]].same(clock, samples))
        group = next(same, None)
        if group is None:
            groups.append([name])
        else:
            group.append(name)
    if len(groups) == 1:
        return clocks[groups[0][0]]
    zero = min((c.start for c in clocks.values() if not math.isnan(c.start)), default=0.0)
    found = "; ".join(
        f"{name!r} from {round(clock.start - zero, 6):.12g} s, every {clock.step:.9g} s"
        for name, clock in clocks.items()
    )
    unclear = [list(others)] if others else []
    raise MixedClocksError(path, found, [*groups, *unclear], rows)
