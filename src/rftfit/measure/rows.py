"""Why a row of a log is not used: the same short list from the first stage to the ledger."""

from __future__ import annotations

from enum import IntEnum


class Why(IntEnum):
    """Reason of one row, small enough to be kept for every sample; `GOOD` rows may be used."""

    GOOD = 0
    MOTION_GAP = 1
    NO_MOTION = 2
    SATURATED = 3
    NO_TARE = 4
    APPROACH = 5
    PAUSE = 6
    ELSEWHERE = 7
    ABOVE = 8
    BOTTOM = 9
    WALL = 10
    STARTUP = 11
    NONLINEAR = 12
    YIELDED = 13

    @property
    def text(self) -> str:
        """What the ledger says."""
        return _TEXT[self]


_TEXT = {
    Why.GOOD: "",
    Why.MOTION_GAP: "gap in the motion log",
    Why.NO_MOTION: "outside the motion log",
    Why.SATURATED: "transducer saturated",
    Why.NO_TARE: "outside the tare's range",
    Why.APPROACH: "approach",
    Why.PAUSE: "pause at the surface",
    Why.ELSEWHERE: "before or after the stroke",
    Why.ABOVE: "outside the window: plate not wholly submerged",
    Why.BOTTOM: "outside the window: too near the bottom",
    Why.WALL: "outside the window: too near a wall",
    Why.STARTUP: "outside the window: start of the stroke, force still building up",
    Why.NONLINEAR: "outside the window: beyond the linear regime",
    Why.YIELDED: "force beyond that of the push against something rigid: depth not known",
}
