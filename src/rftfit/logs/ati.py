"""ATI force transducers: through an NI DAQ card (text with a rate), and Net F/T (numbered packets, quoted csv).

In both the time follows from a count over a rate, which the file or the option ``rate_Hz`` states: of rows, or of
packets by their sequence number (RDT Sequence), so that a lost packet leaves a gap.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rftfit.logs.base import LogError, PacketCount
from rftfit.logs.text import ReadingPlan, TextReader
from rftfit.table.numbers import number_of
from rftfit.table.parse import Kind, Layout
from rftfit.table.text import cells_of, decode_first_lines, text_head, unique_names
from rftfit.table.units import canonical_unit

# name of a column, and reasons of the ledger for a row that is dropped and for packets that are missing
SEQUENCE = "RDT Sequence"
STATUS = "the transducer reports an error or saturation (status is not 0x0)"
LOST = "lost packets (gap in the RDT sequence)"
# beginning of the row of names of Net F/T, and of the first line of NI DAQ
_HEADER = "Status (hex), RDT Sequence"
_LABEL = "first line indicates sampling freq"


class AtiDaqReader(TextReader):
    """Three lines of header (a label, the names, the settings, first of which is the rate), then numbers."""

    name = "ati-daq"
    description = "ATI transducer through NI DAQ, text; time is the row over the sampling frequency"
    takes = ("rate_Hz",)
    evidence = "its first line, which says what the line of settings holds"

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        lines = decode_first_lines(text_head(head), 1)
        return bool(lines) and lines[0].text.strip(' "').casefold().startswith(_LABEL)

    def plan(self, head: bytes) -> ReadingPlan:
        """Read the names and the rate from the three lines of header; raises ValueError where they lack."""
        lines = decode_first_lines(head, 3)
        if len(lines) < 3 or not lines[2].whole:
            raise ValueError("the file ends within its three lines of header: cut short?")
        header_cells = [cell.strip() for cell in lines[1].text.split(",")]
        while header_cells and not header_cells[-1]:
            header_cells.pop()
        names = unique_names(header_cells)
        setting = lines[2].text.split(",")[0]
        rate = self.rate or number_of(setting)
        if not 0 < rate < 1e9:
            raise ValueError(
                f"found the sampling frequency {setting!r} in line 3; allowed: a number above "
                "0, in Hz, there or as options: {rate_Hz: ...} in the config"
            )

        def derive(
            columns: dict[str, np.ndarray], line_numbers: np.ndarray
        ) -> dict[str, np.ndarray]:
            """Add the time, s."""
            return {"time": line_numbers / rate, **columns}

        source = "the config" if self.rate else "line 3"
        notes = [f"time is the row number / {rate:g} Hz ({source})"]
        repeated = sorted({name for name in header_cells if header_cells.count(name) > 1})
        notes += [f"the name {name} stands more than once in line 2" for name in repeated]
        return ReadingPlan(Layout(names), {}, lines[2].stop, derive, notes=tuple(notes))


class AtiNetftReader(TextReader):
    """Net F/T: a preamble of settings, a row of names, quoted cells, one line a packet."""

    name = "ati-netft"
    description = "ATI Net F/T Java demo; time is the RDT sequence over the sample rate"
    takes = ("rate_Hz",)
    evidence = "its preamble (RDT Sample Rate) and the row of names that begins with Status (hex)"

    def detect(self, head: bytes) -> bool:
        """Return whether a file is in this dialect, judged by its first 64 kB."""
        return any(
            line.text.startswith(_HEADER) for line in decode_first_lines(text_head(head), 40)
        )

    def plan(self, head: bytes) -> ReadingPlan:
        """Read preamble and row of names: rate, units, and which columns are read.

        Raises ValueError for a header that is cut, `LogError` for one without a rate.
        """
        settings: dict[str, str] = {}
        for line in decode_first_lines(head, 40):
            if line.text.startswith(_HEADER):
                break
            key, _, value = line.text.partition(":")
            settings[key.strip().casefold()] = value.strip()
        else:
            raise ValueError(f"no row of names that begins with {_HEADER!r}: cut in its header?")
        names = unique_names(cells_of(line.text.replace(", ", ","), ",") or [])
        if SEQUENCE not in names:
            raise ValueError(f"no column {SEQUENCE!r}, found {', '.join(names)}: it gives the time")
        rate = self.rate or number_of(settings.get("rdt sample rate", ""))
        if not 0 < rate < 1e9:
            raise _rate_refusal(settings, has_data=bool(head[line.stop :].strip()))
        packets = PacketCount(LOST)
        status = names[0]
        # the RDT Sequence replaces times
        kinds: list[Kind] = ["skip" if name.startswith("Time") else "number" for name in names[1:]]

        def derive(
            columns: dict[str, np.ndarray], line_numbers: np.ndarray
        ) -> dict[str, np.ndarray]:
            """Add the time, s, and make True of a status without error; rows with another one are dropped."""
            time = packets.follow(columns[SEQUENCE], line_numbers) / rate
            return {"time": time, **columns, status: columns[status] == "0x0"}

        key_of_unit = {"F": "force units", "T": "torque units"}
        units = {
            letter: canonical_unit(settings.get(key, "")) for letter, key in key_of_unit.items()
        }
        source = "the config" if self.rate else "the preamble"
        return ReadingPlan(
            Layout(names, tuple[Kind, ...](["label", *kinds]), quote=True),
            # Fx is a force and Tx a torque; a name such as F/T Sequence is neither
            {name: units.get(name[:1], "") for name in names if "/" not in name},
            line.stop,
            derive,
            packets,
            keep=frozenset({status, SEQUENCE}),
            not_good=STATUS,
            notes=(
                f"time is {SEQUENCE} / {rate:g} Hz ({source})",
                f"recording started: {settings.get('start time') or 'not stated'}",
            ),
        )


def _rate_refusal(settings: Mapping[str, str], *, has_data: bool) -> LogError:
    """Make the error, to be raised, for a preamble without a sample rate.

    `settings`: Key, to value, of the preamble. `has_data`: Whether anything stands below the header.
    """
    rate = settings.get("rdt sample rate") or "nothing"
    unit = settings.get("force units") or "nothing"
    refusal = (
        f"found RDT Sample Rate: {rate} and Force Units: {unit}; the program had not reached the "
        "transducer when it was started, so neither time nor force can be had. Record it again, or, "
        "if you know both, set options: {rate_Hz: ...} and the unit of each column in the config."
    )
    if has_data:
        return LogError("rate", refusal)
    return LogError("header_only", f"{refusal} There is no data below the header either.")
