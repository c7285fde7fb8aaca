"""Time where a log has none, or has it as a count: rows at a rate, packets, nanoseconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

_NS = 1_000_000_000


def ns_to_s(stamps: np.ndarray) -> FloatArray:
    """Turn nanoseconds since 1970 into seconds.

    Parameters
    ----------
    stamps : numpy.ndarray of int64, shape (n,)

    Returns
    -------
    numpy.ndarray, shape (n,)
        s; float64 tells 0.2 microseconds apart at today's dates.
    """
    stamps = np.asarray(stamps, dtype=np.int64)
    whole = stamps // _NS
    seconds: FloatArray = whole + (stamps - whole * _NS) / _NS
    return seconds


class PacketCount:
    """Numbers that an instrument gives its packets, made continuous over a wrap at 2^32.

    Attributes
    ----------
    missing : int
        Numbers passed over so far that no line of the file can have had.
    """

    def __init__(self) -> None:
        self.missing = 0
        self._last: float | None = None
        self._place = 0
        self._count = 0.0
        self._highest = 0.0

    def follow(self, numbers: FloatArray, places: np.ndarray) -> FloatArray:
        """Go on with the next packets.

        Parameters
        ----------
        numbers : numpy.ndarray, shape (n,)
            Whole numbers, in the order in which they came.
        places : numpy.ndarray of int, shape (n,)
            Of their lines among the data lines of the file: a line between them that could not be
            read had a number of its own.

        Returns
        -------
        numpy.ndarray, shape (n,)
            Counted from the first packet of the file, which is 0.
        """
        if numbers.size == 0:
            return numbers
        if self._last is None:
            self._last, self._place = float(numbers[0]), int(places[0]) - 1
        steps = np.diff(numbers, prepend=self._last)
        if np.abs(steps).max() >= 2.0**31:
            # the shorter way round: 4294967295 is followed by 0
            steps = (steps + 2.0**31) % 2.0**32 - 2.0**31
        count: FloatArray = self._count + np.cumsum(steps)
        highest = np.maximum.accumulate(np.concatenate([[self._highest], count]))
        unread = np.diff(places, prepend=self._place) - 1
        passed = np.maximum(np.diff(highest) - 1 - unread, 0)
        # a packet that comes late was counted as missing when it was passed over
        late = int(np.count_nonzero(steps < 0))
        self.missing = max(self.missing + int(passed.sum()) - late, 0)
        self._last, self._count = float(numbers[-1]), float(count[-1])
        self._place = int(places[-1])
        self._highest = float(highest[-1])
        return count
