"""Tare: the force of rod and mount, or of a leg in air, interpolated and subtracted at equal position.

A plate is pushed on a rod, which the medium resists too. A *tare run* repeats the motion with the rod alone (kind
``rod``), or turns the leg in air (kind ``leg_air``); column ``tare_run`` of the run sheet names it. `tare_medium`
subtracts its force at equal position (the *abscissa*: depth, path or theta), which leaves the force of the medium on
the plate or leg.

``stroke`` is the samples of one run, arrays of shape (n,) by column: ``depth_cm``, ``x_cm``, ``path_cm`` (length since
the start), ``angle_deg``, ``force_z_N``, ``force_x_N``, ``why`` (`RowStatus`: GOOD, or why the sample must not be
used).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import BoolArray, FloatArray
from rftfit.measure.flags import REASON, Remark, reason_cells, reason_of, remark
from rftfit.measure.lab_frame import lacks_force_x
from rftfit.measure.ledger import DROPPED, USED, Ledger, RowStatus, StatusArray
from rftfit.measure.samples import StrokeColumns, join_runs, stack_components, strokes

TARE_KINDS = ("rod", "leg_air")
"""Kinds of the runs that are tares of others."""
_TARED_COLUMNS = (
    "depth_cm",
    "x_cm",
    "path_cm",
    "angle_deg",
    "force_z_N",
    "force_x_N",
    "tare_z_N",
    "tare_x_N",
    "why",
)
"""Columns of the table of tared samples, besides ``run_id``."""
TARE_COLUMNS = [
    "run_id",
    "tare_run",
    "abscissa",
    "valid_from",
    "valid_to",
    "force_rms_N",
    "tare_rms_N",
    *REASON,
]
"""Columns of the table of tares.

Tare and its abscissa; the range of that in which it is known; root mean squares of the force before the tare was
subtracted and of the tare; the reason why there is none.
"""


def tare_medium(
    campaign: Campaign, medium: str, traces: pd.DataFrame, status: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Subtract the tares of one medium, from the traces and the table of runs of the ingest stage.

    Returns the table of samples with granular force and tare; the table of tares, with a row for each plate or leg run
    (range of its tare, or the reason why it has none) and for each unusable tare; and a ledger with the rows of the
    tare runs and of runs without a tare, and the flags of the runs.
    """
    ledger = Ledger()
    runs = {run.run_id: run for run in campaign.runs_of(medium)}
    strokes_of_runs = strokes(traces)
    tare_runs = [name for name in strokes_of_runs if runs[name].kind in TARE_KINDS]
    tares = {name: _tare_of(runs[name], strokes_of_runs.pop(name), ledger) for name in tare_runs}
    why_refused = {
        row["run_id"]: reason_of(row)
        for row in status.filter(["run_id", *REASON]).to_dict("records")
    }
    may_lack_tare = campaign.numbers or campaign.config.fit.missing_tare != "refuse"
    tared_strokes: dict[str, StrokeColumns] = {}
    rows = [
        _make_row(runs[name], "", None, None, [tare])
        for name, tare in tares.items()
        if isinstance(tare, Remark)
    ]
    for name, stroke in strokes_of_runs.items():
        run = runs[name]
        tare = tares.get(run.tare_run)
        if isinstance(tare, Tare):
            tared = _subtract_tare(run, stroke, tare, ledger)
        elif may_lack_tare and not run.tare_run:
            tared = stroke | dict.fromkeys(("tare_z_N", "tare_x_N"), np.zeros(stroke["why"].size))
        else:
            why = _why_no_tare(run, tare, why_refused.get(run.tare_run, ()))
            reason = remark("tare-missing", why=why)
            good = int(np.count_nonzero(stroke["why"] == RowStatus.GOOD))
            ledger.add(run, run.force_log, DROPPED, good, reason)
            rows.append(_make_row(run, run.tare_run, None, None, [reason]))
            continue
        tared_strokes[name] = tared
        if campaign.holds_tare(run):
            ledger.flag(run, remark("no-tare"))
        if lacks_force_x(campaign.config, run):
            ledger.flag(run, remark("no-force-x"))
        reasons = _why_no_curve(tared["why"]) if run.kind == "leg" else ()
        rows.append(_make_row(run, run.tare_run, tare, tared, reasons))
    return (
        join_runs(tared_strokes, _TARED_COLUMNS),
        pd.DataFrame(rows, columns=TARE_COLUMNS),
        ledger,
    )


def _make_row(
    run: Run,
    tare_run: str,
    tare: Tare | Remark | None,
    tared: StrokeColumns | None,
    reasons: Sequence[Remark],
) -> tuple[object, ...]:
    """Make the row of a run in the table of tares, in the order of `TARE_COLUMNS`.

    `tare`: That was subtracted, or why there is none; None: none is needed. `tared`: Its tared stroke; None without
    one.
    """
    valid_range = (np.nan, np.nan)
    if isinstance(tare, Tare):
        valid_range = (tare.position[0], tare.position[-1])
    sizes = (np.nan, np.nan) if tared is None else _rms_forces(tared)
    return (run.run_id, tare_run, abscissa_of(run), *valid_range, *sizes, *reason_cells(reasons))


@dataclass(frozen=True)
class Tare:
    """Force (z, x) to be subtracted at equal position; known only in the measured range.

    `abscissa`: Column that holds the position: ``depth_cm``, ``path_cm`` (horizontal runs) or ``angle_deg``.
    `position`: Increasing, in the unit of that column, shape (n,).
    `force`: N, shape (2, n).
    `longest_step`: Longest step of position over which the force is interpolated; a longer one is a hole.
    """

    abscissa: str
    position: FloatArray
    force: FloatArray
    longest_step: float

    @classmethod
    def from_samples(cls, abscissa: str, position: FloatArray, force: FloatArray) -> Tare:
        """Make a tare from at least two samples of a stroke, in any order; `position`, `force`: as the fields."""
        order = np.argsort(position, kind="stable")
        position = position[order]
        # ten ordinary steps: more than any jitter, less than a real hole
        typical = (position[-1] - position[0]) / (position.size - 1)
        return cls(abscissa, position, force[:, order], 10 * float(typical))

    def covers(self, position: FloatArray) -> BoolArray:
        """Return True for positions at which the tare is known: inside its range and not in a hole of its log."""
        inside = (position >= self.position[0]) & (position <= self.position[-1])
        # step of the tare between its samples on both sides of each position
        next_index = np.clip(np.searchsorted(self.position, position), 1, self.position.size - 1)
        step = self.position[next_index] - self.position[next_index - 1]
        return np.asarray(inside & (step <= self.longest_step))

    def force_at(self, position: FloatArray) -> FloatArray:
        """Force (z, x) of the tare at m positions, N, shape (2, m): linear between samples, NaN where not known."""
        force = np.stack(
            [np.interp(position, self.position, component) for component in self.force]
        )
        return np.where(self.covers(position), force, np.nan)


def abscissa_of(run: Run) -> str:
    """Column of the position at which a tare is subtracted: theta for legs, path for horizontal runs, else depth."""
    if run.direction == "rotation":
        return "angle_deg"
    return "path_cm" if run.direction == "horizontal" else "depth_cm"


def _rms_forces(stroke: StrokeColumns) -> tuple[float, float]:
    """Return the root mean square of the force before the tare was subtracted, and that of the tare, N."""
    good = stroke["why"] == RowStatus.GOOD
    if not good.any():
        return np.nan, np.nan
    force, tare = (stack_components(stroke, quantity)[:, good] for quantity in ("force", "tare"))
    return float(np.sqrt(np.mean((force + tare) ** 2))), float(np.sqrt(np.mean(tare**2)))


def _tare_of(run: Run, stroke: StrokeColumns, ledger: Ledger) -> Tare | Remark:
    """Make the tare of a tare run from its stroke, or return the reason why it cannot be used.

    Its good rows are entered into the ledger, as used for the tare or as dropped.
    """
    good = stroke["why"] == RowStatus.GOOD
    abscissa, good_samples = abscissa_of(run), int(np.count_nonzero(good))
    if good_samples < 2:
        reason = remark("tare-empty", tare=run.run_id, count=good_samples)
        ledger.add(run, run.force_log, DROPPED, good_samples, reason)
        return reason
    ledger.add(run, run.force_log, USED, good_samples, remark("tare"))
    return Tare.from_samples(
        abscissa, stroke[abscissa][good], stack_components(stroke, "force")[:, good]
    )


def _why_no_curve(why: StatusArray) -> tuple[Remark, ...]:
    """Return the reason why the tared stroke of a leg has no usable sample; empty if it has some.

    It is the most frequent of the reasons of its samples.
    """
    counts = np.bincount(why, minlength=1)
    if counts[RowStatus.GOOD]:
        return ()
    return (remark("no-sample", why=remark(RowStatus(int(counts.argmax())).code)),)


def _why_no_tare(run: Run, tare: Remark | None, refused: tuple[Remark, ...]) -> Remark:
    """Return the reason why a run has no tare.

    `tare`: Reason why the tare that the run names cannot be made from its stroke; None without a stroke.
    `refused`: Reasons why the tare run was refused.
    """
    if not run.tare_run:
        return remark("tare-not-named")
    if tare is not None:
        return tare
    why = refused[0] if refused else remark("no-stroke")
    return remark("tare-unusable", tare=run.tare_run, why=why)


def _subtract_tare(run: Run, stroke: StrokeColumns, tare: Tare, ledger: Ledger) -> StrokeColumns:
    """Subtract the tare from a stroke; return the stroke with the columns ``tare_z_N`` and ``tare_x_N``.

    Rows that the tare does not cover are marked as UNTARED, and entered into the ledger; their forces are NaN.
    """
    z, x = tare.force_at(stroke[tare.abscissa])
    untared = (stroke["why"] == RowStatus.GOOD) & np.isnan(z)
    why = np.where(untared, np.int8(RowStatus.UNTARED), stroke["why"])
    ledger.add_rows(run, why[untared], "")
    force = {"force_z_N": stroke["force_z_N"] - z, "force_x_N": stroke["force_x_N"] - x}
    return stroke | force | {"tare_z_N": z, "tare_x_N": x, "why": why}
