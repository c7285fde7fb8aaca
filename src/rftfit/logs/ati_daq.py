"""ATI transducers through an NI DAQ card: text without a time column."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

from rftfit.logs.layout import Kind, Layout
from rftfit.logs.lines import lines_of, readable
from rftfit.logs.textlog import Plan, TextReader, rate_option
from rftfit.logs.unitwords import unique

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

_NUMBER: Kind = "number"
_LABEL = "first line indicates sampling freq"


class AtiDaqReader(TextReader):
    """A label, the names, one line of settings of which the first is the rate, then numbers."""

    name = "ati-daq"
    evidence = "its first line, which says what the line of settings holds"

    def __init__(self) -> None:
        self._rate: float | None = None

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "ATI transducer through NI DAQ, text; time is the row over the sampling frequency"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
        """
        lines = lines_of(readable(head), 1)
        return bool(lines) and lines[0].text.strip(' "').casefold().startswith(_LABEL)

    def with_options(self, options: Mapping[str, object]) -> AtiDaqReader:
        """Return the reader with ``rate_Hz`` in place of the file's own.

        Parameters
        ----------
        options : mapping of str to object

        Returns
        -------
        AtiDaqReader

        Raises
        ------
        ValueError
            If there is another option, or the rate is not positive.
        """
        reader = copy(self)
        reader._rate = rate_option(options, self.name)
        return reader

    def plan(self, head: bytes) -> Plan:
        """Read names and settings.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        Plan

        Raises
        ------
        ValueError
            If either is missing or the sampling frequency is not positive.
        """
        lines = lines_of(head, 3)
        if len(lines) < 3 or not lines[2].whole:
            raise ValueError("the file ends within its three lines of header: cut short?")
        given = [cell.strip() for cell in lines[1].text.split(",")]
        while given and not given[-1]:
            given.pop()
        names = unique(given)
        settings = lines[2].text.split(",")
        try:
            rate = self._rate or float(settings[0])
        except ValueError:
            rate = 0.0
        if not 0 < rate < 1e9:
            raise ValueError(
                f"found the sampling frequency {settings[0]!r} in line 3; allowed: a number above "
                "0, in Hz, there or as options: {rate_Hz: ...} in the config"
            )

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            return {"time": index / rate, **columns}

        source = "the config" if self._rate else "line 3"
        notes = [f"time is the row number / {rate:g} Hz ({source})"]
        twice = sorted({name for name in given if given.count(name) > 1})
        notes += [f"the name {name} stands more than once in line 2" for name in twice]
        return Plan(
            Layout(names, tuple(_NUMBER for _ in names)),
            {},
            lines[2].stop,
            derive,
            notes=tuple(notes),
        )
