"""ATI Net F/T: what its Java demo program records, one line a packet."""

from __future__ import annotations

import csv
from copy import copy
from typing import TYPE_CHECKING

from rftfit.logs.base import LogError
from rftfit.logs.layout import Kind, Layout
from rftfit.logs.lines import lines_of, readable
from rftfit.logs.textlog import Plan, TextReader, rate_option
from rftfit.logs.timing import PacketCount
from rftfit.logs.unitwords import unique, unit_word

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

SEQUENCE = "RDT Sequence"
STATUS = "the transducer reports an error or saturation (status is not 0x0)"
LOST = "lost packets (gap in the RDT sequence)"
_HEADER = "Status (hex), RDT Sequence"


class AtiNetftReader(TextReader):
    """A preamble of settings, a row of names, quoted cells; values are in the unit it names."""

    name = "ati-netft"
    evidence = "its preamble (RDT Sample Rate) and the row of names that begins with Status (hex)"

    def __init__(self) -> None:
        self._rate: float | None = None

    def describe(self) -> str:
        """Return one line on which program writes such files."""
        return "ATI Net F/T Java demo; time is the RDT sequence over the sample rate"

    def detect(self, head: bytes) -> bool:
        """Tell from the first 64 kB of a file whether it is of this dialect.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        bool
        """
        return any(line.text.startswith(_HEADER) for line in lines_of(readable(head), 40))

    def with_options(self, options: Mapping[str, object]) -> AtiNetftReader:
        """Return the reader with ``rate_Hz``, for files whose program did not know it.

        Parameters
        ----------
        options : mapping of str to object

        Returns
        -------
        AtiNetftReader

        Raises
        ------
        ValueError
            If there is another option, or the rate is not positive.
        """
        reader = copy(self)
        reader._rate = rate_option(options, self.name)
        return reader

    def plan(self, head: bytes) -> Plan:
        """Read preamble and row of names.

        Parameters
        ----------
        head : bytes

        Returns
        -------
        Plan

        Raises
        ------
        ValueError
            If the row of names or the sample rate is missing.
        """
        settings: dict[str, str] = {}
        for line in lines_of(head, 40):
            if line.text.startswith(_HEADER):
                break
            key, _, value = line.text.partition(":")
            settings[key.strip().casefold()] = value.strip()
        else:
            raise ValueError(f"no row of names that begins with {_HEADER!r}: cut in its header?")
        names = unique(next(csv.reader([line.text], skipinitialspace=True)))
        if SEQUENCE not in names:
            raise ValueError(f"no column {SEQUENCE!r}, found {', '.join(names)}: it gives the time")
        units = {
            "F": unit_word(settings.get("force units", "")),
            "T": unit_word(settings.get("torque units", "")),
        }
        start = line.stop
        rate = self._rate or _number(settings.get("rdt sample rate", ""))
        if rate <= 0:
            code = "rate" if head[start:].strip() else "header_only"
            end = " There is no data below the header either." if code == "header_only" else ""
            raise LogError(code, _no_rate(settings) + end)
        packets = PacketCount()

        def derive(columns: dict[str, np.ndarray], index: np.ndarray) -> dict[str, np.ndarray]:
            return {"time": packets.follow(columns[SEQUENCE], index) / rate, **columns}

        source = "the config" if self._rate else "the preamble"
        note = f"time is {SEQUENCE} / {rate:g} Hz ({source})"
        return Plan(
            Layout(names, tuple(map(_kind, names)), quote=True, same="0x0"),
            {
                name: units.get(name[:1], "")
                for name in names
                if name[:1] in "FT" and "/" not in name
            },
            start,
            derive,
            packets,
            LOST,
            keep=frozenset({names[0], SEQUENCE}),
            drop=frozenset({names[0]}),
            same=(names[0], STATUS),
            notes=(note, f"recording started: {settings.get('start time') or 'not stated'}"),
        )


def _kind(name: str) -> Kind:
    if name.startswith("Status"):
        return "same"
    return "skip" if name.startswith("Time") else "number"


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0


def _no_rate(settings: Mapping[str, str]) -> str:
    rate = settings.get("rdt sample rate") or "nothing"
    unit = settings.get("force units") or "nothing"
    return (
        f"found RDT Sample Rate: {rate} and Force Units: {unit}; the program had not reached the "
        "transducer when it was started, so neither time nor force can be had. Record it again, or, "
        "if you know both, set options: {rate_Hz: ...} and the unit of each column in the config."
    )
