"""Checks of single runs, and of runs beside each other: rods, drift, steadiness, repeats, copies, size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rftfit.campaign.config import UNIT_AREA
from rftfit.measure.alpha import cell_at, column
from rftfit.measure.flags import remark
from rftfit.measure.ledger import RowStatus
from rftfit.measure.levels import FEW_RUNS, MODES, median_of_runs
from rftfit.measure.samples import split_runs
from rftfit.measure.verdicts import MOST_NAMED, Check, Measured, flags_on, rows_of

SURE = 3.7
"""Standard errors of one of several numbers that are looked at together."""

_ROD_ALONE, _ROD_CLEAR, _ROD_FORCE = 1.5, 3.0, 0.1
"""A rod over its plate and rod: in a run that is clear by force, as a share of the medium's median; in any run."""


def check_rods(measured: Measured) -> Check:
    """Whether rods alone feel less than plates on their rods do."""
    tares, sheet = measured.tables["tares"], measured.sheet
    plates = [run.run_id for run in sheet.values() if run.kind == "plate"]
    table = tares[(tares["tare_run"] != "") & tares["run_id"].isin(plates)]
    tare, force = (table[name].to_numpy(float) for name in ("tare_rms_N", "force_rms_N"))
    known = np.isfinite(tare) & (force > 0)
    if not known.any():
        return Check.skipped("rods", "no plate run has a tare")
    ratio = np.where(known, tare / np.where(known, force, 1), np.nan)
    # forces of the weakest directions are little more than the noise of their zeros
    clear = tare - force > _ROD_FORCE * np.nanmedian(np.fmax(tare, force))
    wrong = (ratio == 1) | (ratio >= np.where(clear, _ROD_ALONE, _ROD_CLEAR))
    stronger = table["run_id"][wrong]
    found = f"the force on a rod alone is {np.nanmedian(ratio):.3g} times that on plate and rod (median of {known.sum()} runs)"
    if wrong.any():
        found = f"in {wrong.sum()} of {known.sum()} runs the force on a rod alone is larger than on plate and rod"
    allowed = f"a ratio below {_ROD_ALONE:g} in each run ({_ROD_CLEAR:g} where forces are weak), and not 1"
    sentence = (
        f"Logs of plates and rods look exchanged, or are the same ({found}: {rows_of(stronger, sheet)}): "
        "look at the logs, kind and tare_run of these runs."
    )
    flags = flags_on(stronger, "rod-stronger")
    return Check.judged("rods", not wrong.any(), found, allowed, sentence, flags)


_DRIFT, _DRIFT_ALONE = 0.015, 0.15


def check_drift(measured: Measured) -> Check:
    """Whether the zero drifts already while the intruder rests in air before its stroke."""
    from scipy.special import ndtr, stdtrit

    runs, tares = measured.tables["runs"], measured.tables["tares"]
    table = runs.merge(tares[["run_id", "force_rms_N"]], on="run_id")
    trend = table[["zero_trend_z_N", "zero_trend_x_N"]].to_numpy(float).T
    force = table["force_rms_N"].to_numpy(float)
    known = np.isfinite(trend).all(axis=0) & (force > 0)
    if known.sum() < FEW_RUNS:
        return Check.skipped("drift", f"fewer than {FEW_RUNS} runs rest in air at one end alone")
    table, trend, typical = table[known], trend[:, known], float(np.median(force[known]))
    middle, se = np.array([median_of_runs(part) for part in trend]).T
    # few runs hardly tell their own scatter: Student's t at the same level
    limit = stdtrit(known.sum() - 1, ndtr(SURE)) * se
    off = np.abs(trend - middle[:, None])
    # where most runs drift alike it is all of them, else those that stand out
    common = (np.abs(middle) > limit) & (np.abs(middle) > _DRIFT * typical)
    spread = 1.4826 * np.median(off, axis=1)[:, None]
    alone = (off > MODES * spread) & (off > _DRIFT_ALONE * np.maximum(force[known], typical))
    alone = alone.any(axis=0)
    worst = int(np.abs(middle).argmax())
    found = (
        f"a drift at rest before the strokes that would move F_{'zx'[worst]} by {middle[worst]:+.2g} N until their "
        f"middle (median of {known.sum()} runs)"
    )
    allowed = f"{max(_DRIFT * typical, float(limit[worst])):.2g} N of either sign"
    which = table["run_id"] if common.any() else table.loc[alone, "run_id"]
    if alone.any() and not common.any():
        found = f"{alone.sum()} of {known.sum()} runs drift at rest before their strokes"
        allowed = "no run that drifts more than the others and than 15 % of the force"
    sentence = (
        f"The zero of the force drifts ({found}: {rows_of(which, measured.sheet)}): let the transducer warm up, "
        "record a rest in air after the stroke too, or state transducer.drift_N_per_min."
    )
    return Check.judged(
        "drift", which.empty, found, allowed, sentence, flags_on(which, "zero-drifts")
    )


_TREND, _SIGMAS = 0.10, 3.0
_FEWEST_SAMPLES = 30


def check_steadiness(measured: Measured) -> Check:
    """Whether the stress of horizontal runs stays the same over the part that is averaged."""
    fits, tared = measured.tables["fits"], measured.tables["tared"]
    good = measured.tables["windows"]["why"].to_numpy() == RowStatus.GOOD
    where = split_runs(tared)
    level = fits.loc[(fits["direction"] == "horizontal") & (fits["n_points"] > 0), "run_id"]
    changes = []
    for own in (where[name] for name in level if name in where):
        curve = tared.iloc[own][good[own]]
        force = curve[["force_z_N", "force_x_N"]].to_numpy(float).T
        force = force[np.abs(force.mean(axis=1)).argmax()]
        path = curve["path_cm"].to_numpy(float)
        if path.size >= _FEWEST_SAMPLES:
            off = path - path.mean()
            changes.append(off @ force / (off @ off) * np.ptp(path) / force.mean())
    change, se = median_of_runs(np.array(changes))
    if math.isnan(change):
        return Check.skipped("steadiness", f"fewer than {FEW_RUNS} horizontal runs")
    found = f"stress changes by {_percent(change)} over the steady part (of {len(changes)} runs)"
    most = max(_TREND, _SIGMAS * se)
    sentence = (
        f"Horizontal runs are not steady ({found}): look at fit.horizontal_skip_cm, at the distance "
        "to the walls, and whether the plate goes deeper or piles up the bed."
    )
    allowed = f"{_percent(most)} of either sign"
    return Check.judged("steadiness", abs(change) <= most, found, allowed, sentence)


def _percent(ratio: float) -> str:
    """A ratio in percent; one above 10, as of exchanged axes, as it is."""
    return f"{100 * ratio:.1f} %" if abs(ratio) <= 10 else f"{ratio:.3g}"


_BLIND = 0.4
"""Of the largest alpha: the least difference that would be seen is 0.13 to 0.17 (median) in the demonstration."""


def check_repeats(measured: Measured) -> Check:
    """Whether each run has the alpha that its repeats, or else all other runs, say it should have."""
    peers = measured.tables["peers"]
    known = peers[np.isfinite(peers["times_spread"].to_numpy(float))]
    if known.empty:
        return Check.skipped("repeats", "too few runs to estimate how much runs differ")
    apart = known[known["apart"].to_numpy(bool)]
    first = apart.sort_values("times_spread", ascending=False).to_dict("records")[:MOST_NAMED]
    values = "; ".join(map(_beside_others, first))
    found = (
        f"{len(apart)} of {len(known)} runs {'differs' if len(apart) == 1 else 'differ'} from the others, the most by "
        f"{known['times_spread'].max():.1f} times the spread"
    )
    sentence = (
        f"{found} ({values} N/cm^3; {rows_of(apart['run_id'], measured.sheet)}): look at the medium, the unit, the "
        "angles and the logs of these runs. They are used; exclude what is a mistake."
    )
    of_runs = zip(apart["run_id"].astype(str), apart["beside"], apart["times_spread"], strict=True)
    flags = [remark("apart", run_id=one, beside=by, times=times) for one, by, times in of_runs]
    seen = known["seen_from_ratio"]
    allowed = (
        f"no run differs; a difference below {seen.median():.0%} of the largest alpha "
        f"(median; at most {seen.max():.0%}) is not detected"
    )
    if apart.empty and seen.median() > _BLIND:
        words = (
            f"a difference below {seen.median():.0%} of the largest alpha (median) would not be seen, so far are the runs from one "
            "another or from the shape of known media: look for a wrong sign, angle or medium in the run sheet"
        )
        return Check.skipped("repeats", words)
    return Check.judged("repeats", apart.empty, found, allowed, sentence, flags)


def _beside_others(row: dict[Any, Any]) -> str:
    """Alpha of a run beside that of the others, of the component that is farther off."""
    c = "zx"[abs(row["off_x_ratio"]) > abs(row["off_z_ratio"])]
    return f"{row['run_id']}: {row[column(c)]:.3g} beside {row[f'others_{c}_N_per_cm3']:.3g}"


def check_logs(measured: Measured) -> Check:
    """Whether two runs have the same readings, or the same noise, under two names."""
    sheet, copies = measured.sheet, measured.copies
    of_table = any(run.intruder == UNIT_AREA for run in sheet.values())
    if not copies:
        why = "no run has enough readings to tell a copy by"
        return Check.skipped(
            "same_logs", f"{why}: a table of alpha, or of few depths" if of_table else why
        )
    what = "run" if of_table else "log"
    where = "at these runs in the table" if of_table else "at force_log of these runs"
    # a table may state the plate at 90 degrees, which is the one at -90, under both angles
    copied = []
    for name, run in sheet.items():
        others = (sheet[one] for one in copies.get(name, ()))
        copied += [name] * any(abs(run.beta_deg - one.beta_deg) != 180 for one in others)
    found = f"no {what} is there twice"
    if copied:
        first = f"{copied[0]} and {', '.join(copies[copied[0]])}"
        found = f"{len(copied)} runs have the readings of others: {first}"
    sentence = (
        f"Copies of a {what} are no repeats ({found}): look {where}, and leave out the copies."
    )
    flags = [remark("same-readings", run_id=one, runs=", ".join(copies[one])) for one in copied]
    return Check.judged("same_logs", not copied, found, f"each {what} once", sentence, flags)


_ALPHA_FROM, _ALPHA_TO = 0.01, 10.0


def check_size(measured: Measured) -> Check:
    """Whether alpha_z(0, 90 deg) is as large as stated; without that, what no medium is found."""
    expected = measured.medium.expected_alpha
    cell = cell_at(measured.tables["alpha"], 0, 90)
    value = math.nan if cell is None else float(cell[column("z")])
    if math.isnan(value):
        return Check.skipped("size", "no alpha at (0, 90) deg")
    low, high = expected or (_ALPHA_FROM, _ALPHA_TO)
    found, allowed = f"alpha_z(0, 90) = {value:.3g} N/cm^3", f"{low:g} to {high:g} N/cm^3"
    good, whose = low <= abs(value) <= high, "expected_alpha" if expected else "any granular medium"
    if good and not expected:
        words = "The scale of the force was not checked: a wrong unit passes unless expected_alpha is stated."
        return Check.skipped("size", found, allowed, words)
    sentence = (
        f"The scale of the force or the size of the plate looks wrong: {found}, {whose} has "
        f"{allowed}: look at the unit of the force and at the size of the plate."
    )
    return Check.judged("size", good, found, allowed, sentence)
