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
    whole, part = np.divmod(np.asarray(stamps, dtype=np.int64), _NS)
    seconds: FloatArray = whole + part / _NS
    return seconds


class PacketCount:
    """Numbers that an instrument gives its packets, made continuous over a wrap at 2^32.

    Attributes
    ----------
    missing : int
        Numbers passed over so far.
    """

    def __init__(self) -> None:
        self.missing = 0
        self._last: float | None = None
        self._count = 0.0
        self._highest = 0.0

    def follow(self, numbers: FloatArray) -> FloatArray:
        """Go on with the next packets.

        Parameters
        ----------
        numbers : numpy.ndarray, shape (n,)
            Whole numbers, in the order in which they came.

        Returns
        -------
        numpy.ndarray, shape (n,)
            Counted from the first packet of the file, which is 0.
        """
        if numbers.size == 0:
            return numbers
        if self._last is None:
            self._last = float(numbers[0])
        # the shorter way round: 4294967295 is followed by 0
        steps = (np.diff(numbers, prepend=self._last) + 2.0**31) % 2.0**32 - 2.0**31
        count: FloatArray = self._count + np.cumsum(steps)
        highest = np.maximum.accumulate(np.concatenate([[self._highest], count]))
        leaps = np.diff(highest)
        # a packet that comes late was counted as missing when it was passed over
        late = int(np.count_nonzero(steps < 0))
        self.missing = max(self.missing + int((leaps[leaps > 1] - 1).sum()) - late, 0)
        self._last, self._count = float(numbers[-1]), float(count[-1])
        self._highest = float(highest[-1])
        return count
