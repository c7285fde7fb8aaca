"""Faults that can be put into a campaign by name, for tests and for teaching."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rftfit.campaign.config import Config
    from rftfit.lab.plan import Run
    from rftfit.lab.rig import Recording

FAULTS: dict[str, str] = {
    "gap": "1.5 s in the middle of the stroke are missing from the force log",
    "saturated": "one second of the stroke is stuck at the range of the vertical channel",
    "missing_tare": "both logs of the run's tare are missing; the sheet still names them",
    "truncated": "the force log is cut off in mid-row, after about two thirds",
    "wrong_unit": "the force log is in lbf and says so, against the config (N where that has lbf)",
    "never_touches": "the arm's path stays above the surface (plates and rods)",
    "duplicated_rows": "60 rows of the force log's stroke appear twice each",
    "time_reversed": "60 rows of the force log's stroke are in reverse order",
    "nan_cells": "every second of 60 rows of the stroke has nan in all force columns",
    "header_only": "the force log ends after its header row",
    "empty": "the force log has no bytes",
    "wrong_delimiter": "the force log has semicolons and decimal commas",
    "missing_log": "the force log is missing; the sheet still names it",
    "wrong_medium_tare": "the sheet's tare_run is the same run's tare in another medium",
    "flipped_beta": "the motion log shows -beta instead of beta (beta not 0 or 90 degrees)",
}
"""Name and what it does. Each is put into the run named, or into its entry of `DEFAULT_RUNS`."""

DEFAULT_RUNS: dict[str, str] = {
    "gap": "bp00_g90_in",
    "saturated": "bp00_g72_in",
    "missing_tare": "bp30_g45_in",
    "truncated": "bp30_g90_in",
    "wrong_unit": "bm30_g90_in",
    "never_touches": "bp00_g45_in",
    "duplicated_rows": "bp60_g45_in",
    "time_reversed": "bp60_g56_in",
    "nan_cells": "bp60_g72_in",
    "header_only": "bm60_g34_in",
    "empty": "bm60_g45_in",
    "wrong_delimiter": "bm60_g56_in",
    "missing_log": "bm60_g72_in",
    "wrong_medium_tare": "bp90_g45_in",
    "flipped_beta": "bm30_g45_in",
}
"""Run of the first medium that gets the fault where none is named; its first plate run if absent."""

_ROWS = 60


@dataclass(frozen=True)
class Fault:
    """A fault that is put into the campaign.

    Attributes
    ----------
    name : str
        Key of `FAULTS`.
    run_id : str
        The run it was asked for.
    changed : str
        run_id of the run whose files or sheet row it changes: the tare's for ``missing_tare``.
    other_tare : str
        The tare_run that the sheet names in place of the right one; empty for other faults.
    """

    name: str
    run_id: str
    changed: str
    other_tare: str = ""

    def __str__(self) -> str:
        where = self.run_id if self.changed == self.run_id else f"{self.run_id} (in {self.changed})"
        return f"{self.name}: {where}: {FAULTS[self.name]}"


def _known(word: str, what: str, allowed: Sequence[str]) -> None:
    if word not in allowed:
        near = difflib.get_close_matches(word, allowed, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        listing = f": allowed are {', '.join(allowed)}" if len(allowed) <= len(FAULTS) else ""
        raise InputError(f"no {what} {word!r}{listing}{hint}")


def _other_tare(run: Run, runs: Mapping[str, Run]) -> str:
    ending = run.tare_run.removeprefix(run.medium)
    for other in runs.values():
        if run.kind == "plate" and other.medium != run.medium and other.run_id.endswith(ending):
            return other.run_id
    raise InputError(
        f"fault wrong_medium_tare: {run.run_id} has no tare of another medium among these runs; "
        "name a plate run and re-enact at least two media of its kind"
    )


def resolve(asked: Sequence[str], runs: Mapping[str, Run], first_medium: str) -> list[Fault]:
    """Find the run of each fault asked for.

    Parameters
    ----------
    asked : sequence of str
        ``NAME`` or ``NAME:run_id``.
    runs : mapping of str to Run
        All runs by run_id.
    first_medium : str
        Where faults without a run go.

    Returns
    -------
    list of Fault

    Raises
    ------
    InputError
        If there is no such fault or run, or the fault cannot be put into that run.
    """
    found = []
    for text in asked:
        name, _, run_id = text.partition(":")
        _known(name, "fault", list(FAULTS))
        if not run_id:
            run_id = f"{first_medium}_{DEFAULT_RUNS[name]}"
            if run_id not in runs:
                own = (r for r in runs.values() if r.medium == first_medium and r.kind == "plate")
                run_id = next((run.run_id for run in own), run_id)
        _known(run_id, f"run for the fault {name}:", list(runs))
        run = runs[run_id]
        if name == "flipped_beta" and run.beta_deg in (None, 0.0, 90.0):
            raise InputError(f"fault flipped_beta: {run_id} looks the same with -beta")
        if name == "never_touches" and run.leg:
            raise InputError(f"fault never_touches: {run_id} is a leg; name a plate or rod run")
        changed = (run.tare_run or run_id) if name == "missing_tare" else run_id
        other = _other_tare(run, runs) if name == "wrong_medium_tare" else ""
        found.append(Fault(name, run_id, changed, other))
    return found


def damage_recording(names: Sequence[str], recording: Recording, config: Config) -> Recording:
    """Apply those faults that change what was recorded.

    Parameters
    ----------
    names : sequence of str
        Faults of this run; others than gap, saturated, duplicated_rows, time_reversed, nan_cells
        and flipped_beta are passed over.
    recording : Recording
    config : Config

    Returns
    -------
    Recording
    """
    first, last = np.flatnonzero(recording.stroke)[[0, -1]]
    middle = int(first + last) // 2
    channels = recording.channels_N.copy()
    rows = np.arange(len(channels))
    block = slice(middle, middle + _ROWS)
    if "saturated" in names:
        column = int(config.transducer.axes.z[2]) - 1
        stuck = slice(middle - 50, middle + 50)
        sign = -1 if config.transducer.axes.z[0] == "-" else 1
        channels[stuck, column] = sign * config.transducer.range_N[column]
    if "nan_cells" in names:
        channels[middle : middle + _ROWS : 2] = np.nan
    if "time_reversed" in names:
        rows[block] = rows[block][::-1].copy()
    if "duplicated_rows" in names:
        rows = np.repeat(rows, np.where(np.isin(rows, rows[block]), 2, 1))
    if "gap" in names:
        rows = rows[(rows < middle - 75) | (rows >= middle + 75)]
    return replace(
        recording,
        force_time_s=recording.force_time_s[rows],
        arm_moving=recording.arm_moving[rows],
        channels_N=channels[rows],
        stroke=recording.stroke[rows],
        angle_deg=-recording.angle_deg if "flipped_beta" in names else recording.angle_deg,
    )


def damage_text(names: Sequence[str], text: str) -> str | None:
    """Apply those faults that change the force log's text.

    Parameters
    ----------
    names : sequence of str
        Faults of this run; others than truncated, header_only, empty, wrong_delimiter, missing_log
        and missing_tare are passed over.
    text : str

    Returns
    -------
    str or None
        None: no such file.
    """
    if "missing_log" in names or "missing_tare" in names:
        return None
    if "empty" in names:
        return ""
    comments = text[: text.index("time_s")]
    table = text[len(comments) :]
    if "header_only" in names:
        table = table[: table.index("\n") + 1]
    if "truncated" in names:
        # the cut falls four characters before a line's end
        table = table[: table.index("\n", 2 * len(table) // 3) - 4]
    if "wrong_delimiter" in names:
        table = table.replace(",", ";").replace(".", ",")
    return comments + table
