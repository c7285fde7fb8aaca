"""Tare: the force of rod and mount, or of a leg in air, subtracted at equal position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.measure.flags import REASON, Remark, reason_cells, reason_of, remark
from rftfit.measure.lab_frame import lacks_force_x
from rftfit.measure.ledger import DROPPED, USED, Ledger, RowStatus
from rftfit.measure.samples import StrokeColumns, join_runs, strokes

TARE_KINDS = ("rod", "leg_air")
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


def tare_medium(
    campaign: Campaign, medium: str, traces: pd.DataFrame, status: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Subtract the tares of one medium, from the traces and the table of runs of the ingest stage.

    Returns the granular force and tare of every sample of a stroke; the tare of every plate or leg
    run, its valid range or why there is none, and tares that are none; the rows of the tare
    runs and of runs without a tare, and flags of the runs.
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
        _row(runs[name], "", None, None, [tare])
        for name, tare in tares.items()
        if isinstance(tare, Remark)
    ]
    for name, stroke in strokes_of_runs.items():
        run = runs[name]
        tare = tares.get(run.tare_run)
        if isinstance(tare, Tare):
            tared = _tared(run, stroke, tare, ledger)
        elif may_lack_tare and not run.tare_run:
            nothing = np.zeros(stroke["why"].size)
            tared = stroke | {"tare_z_N": nothing, "tare_x_N": nothing}
        else:
            why = _why_no_tare(run, tare, why_refused.get(run.tare_run, ()))
            reason = remark("tare-missing", why=why)
            good = int(np.count_nonzero(stroke["why"] == RowStatus.GOOD))
            ledger.add(run, run.force_log, DROPPED, good, reason)
            rows.append(_row(run, run.tare_run, None, None, [reason]))
            continue
        tared_strokes[name] = tared
        if campaign.holds_tare(run):
            ledger.flag(run, remark("no-tare"))
        if lacks_force_x(campaign.config, run):
            ledger.flag(run, remark("no-force-x"))
        reasons = _why_no_curve(tared["why"]) if run.kind == "leg" else ()
        rows.append(_row(run, run.tare_run, tare, tared, reasons))
    return (
        join_runs(tared_strokes, _TARED_COLUMNS),
        pd.DataFrame(rows, columns=TARE_COLUMNS),
        ledger,
    )


def _row(
    run: Run,
    tare_run: str,
    tare: Tare | Remark | None,
    tared: StrokeColumns | None,
    reasons: Sequence[Remark],
) -> tuple[object, ...]:
    """Row of a run in the table of tares; `tared`: None where there is no granular force."""
    valid_range = (np.nan, np.nan)
    if isinstance(tare, Tare):
        valid_range = (tare.position[0], tare.position[-1])
    sizes = (np.nan, np.nan) if tared is None else _sizes(tared)
    return (run.run_id, tare_run, abscissa_of(run), *valid_range, *sizes, *reason_cells(reasons))


@dataclass(frozen=True)
class Tare:
    """Force z, x (2, n), N, to be subtracted at equal position; it never extrapolates.

    `abscissa`: what equal position means, ``depth_cm``, ``path_cm`` (horizontal runs) or ``angle_deg``;
    `position` (n,) increases, in its unit. A step wider than `longest_step` is a hole, not to be bridged.
    """

    abscissa: str
    position: FloatArray
    force: FloatArray
    longest_step: float

    @classmethod
    def from_samples(cls, abscissa: str, position: FloatArray, force: FloatArray) -> Tare:
        """Make a tare from at least two samples of a stroke, in any order."""
        order = np.argsort(position, kind="stable")
        position = position[order]
        # ten ordinary steps: wider than any jitter, narrower than any hole worth the name
        typical = (position[-1] - position[0]) / (position.size - 1)
        return cls(abscissa, position, force[:, order], 10 * float(typical))

    def covers(self, position: FloatArray) -> np.ndarray:
        """Tell at which positions the tare is known: not outside its range, not in holes of its log."""
        inside = (position >= self.position[0]) & (position <= self.position[-1])
        next_index = np.clip(np.searchsorted(self.position, position), 1, self.position.size - 1)
        step = self.position[next_index] - self.position[next_index - 1]
        return np.asarray(inside & (step <= self.longest_step))

    def force_at(self, position: FloatArray) -> FloatArray:
        """Force z, x of the tare, N, linear between its samples, NaN where not known: shape (2, m)."""
        force = np.stack(
            [np.interp(position, self.position, component) for component in self.force]
        )
        return np.where(self.covers(position), force, np.nan)


def abscissa_of(run: Run) -> str:
    """Position at which a tare is subtracted: theta of legs, path of horizontal strokes, else depth."""
    if run.direction == "rotation":
        return "angle_deg"
    return "path_cm" if run.direction == "horizontal" else "depth_cm"


def _sizes(stroke: StrokeColumns) -> tuple[float, float]:
    """Root mean square of the force before the tare was subtracted, and of the tare, N."""
    good = stroke["why"] == RowStatus.GOOD
    if not good.any():
        return np.nan, np.nan
    force, tare = (_stack_components(stroke, quantity)[:, good] for quantity in ("force", "tare"))
    return float(np.sqrt(np.mean((force + tare) ** 2))), float(np.sqrt(np.mean(tare**2)))


def _stack_components(stroke: StrokeColumns, quantity: str) -> FloatArray:
    """Force z and x, or those of the tare, N, shape (2, n)."""
    return np.stack([stroke[f"{quantity}_{c}_N"] for c in "zx"])


def _tare_of(run: Run, stroke: StrokeColumns, ledger: Ledger) -> Tare | Remark:
    """Make a tare of a run, or say why it is none."""
    good = stroke["why"] == RowStatus.GOOD
    abscissa, good_samples = abscissa_of(run), int(np.count_nonzero(good))
    if good_samples < 2:
        reason = remark("tare-empty", tare=run.run_id, count=good_samples)
        ledger.add(run, run.force_log, DROPPED, good_samples, reason)
        return reason
    ledger.add(run, run.force_log, USED, good_samples, remark("tare"))
    return Tare.from_samples(
        abscissa, stroke[abscissa][good], _stack_components(stroke, "force")[:, good]
    )


def _why_no_curve(why: np.ndarray) -> tuple[Remark, ...]:
    """Why the tared stroke of a leg has no sample to use; empty if it has."""
    counts = np.bincount(why, minlength=1)
    if counts[RowStatus.GOOD]:
        return ()
    return (remark("no-sample", why=remark(RowStatus(int(counts.argmax())).code)),)


def _why_no_tare(run: Run, tare: Remark | None, refused: tuple[Remark, ...]) -> Remark:
    """Why a run has no tare; `tare`: why the one that it names is none, if it has a stroke."""
    if not run.tare_run:
        return remark("tare-not-named")
    if tare is not None:
        return tare
    why = refused[0] if refused else remark("no-stroke")
    return remark("tare-unusable", tare=run.tare_run, why=why)


def _tared(run: Run, stroke: StrokeColumns, tare: Tare, ledger: Ledger) -> StrokeColumns:
    """Granular force of a stroke; rows the tare does not cover are marked and counted."""
    z, x = tare.force_at(stroke[tare.abscissa])
    untared = (stroke["why"] == RowStatus.GOOD) & np.isnan(z)
    why = np.where(untared, np.int8(RowStatus.UNTARED), stroke["why"])
    ledger.add_rows(run, why[untared], "")
    force = {"force_z_N": stroke["force_z_N"] - z, "force_x_N": stroke["force_x_N"] - x}
    return stroke | force | {"tare_z_N": z, "tare_x_N": x, "why": why}
