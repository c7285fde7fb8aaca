"""Checks of rods, drift of the zero, steadiness of level runs, repeats and runs apart, copied logs, size of alpha.

Six checks, each with its sentences above it; they read the tables of `MediumMeasurements`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.columns import LABELS
from rftfit.campaign.config import UNIT_AREA
from rftfit.checks.declared import (
    MOST_NAMED,
    SOUND_ALPHA,
    SOUND_LOGS,
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    describe_rows,
    flags_on,
)
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.alpha import alpha_columns, cell_down, column
from rftfit.measure.errors import spread_of_beds
from rftfit.measure.flags import Remark, format_remarks, remark
from rftfit.measure.ledger import RowStatus
from rftfit.measure.levels import FEW_RUNS, MODES, median_of_runs, sd_by_median
from rftfit.measure.rods import estimate_share_too_much
from rftfit.measure.samples import split_runs
from rftfit.measure.slopes import student_limit, student_quantile
from rftfit.measure.verdict_words import DOUBTFUL, FAILED, MAP, NOT_CHECKED, PAIR, REPEATS, UNUSABLE
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "runs")

SURE: float = _CHOSEN.sure
"""Standard errors that a number must exceed to be a fault, where several numbers are tested together."""


_OTHER_RODS_ALLOWED = "{most:.0%} of either sign"
_OTHER_RODS_FAULT = "the rods of the rod runs bear another force than those of the plates"

_RODS_ALLOWED = "a ratio below {alone:g} in each run ({clear:g} where forces are weak), and not 1"


@declare_check(
    "rods",
    title="rods",
    effect=UNUSABLE,
    good="the force on rods is smaller than on plates",
    fault="the force on rods is as large as on plates",
    after=("sheet", "channels"),
    outcomes={
        "rods": Sentences(
            "the force on a rod alone is {ratio:.3g} times that on plate and rod (median of {size} runs)",
            _RODS_ALLOWED,
        ),
        "rods-stronger": Sentences(
            "in {count} of {size} runs the force on a rod alone is larger than on plate and rod",
            _RODS_ALLOWED,
            "logs of plates and rods look exchanged, or are the same ({found}: {rows}): look at the logs, kind and "
            "tare_run of these runs.",
        ),
        "rods-other": Sentences(
            "{share:.0%} ({low:.0%} to {high:.0%}) of the force on the rods alone is not in the runs with plates",
            _OTHER_RODS_ALLOWED,
            "the rods of the rod runs look larger, or deeper in the bed, than those of the plates ({found}): look whether they "
            "are the same rods, and at tare_run.",
            _OTHER_RODS_FAULT,
        ),
        "rods-other-small": Sentences(
            "the force on the rods in the runs with plates is {share:.0%} ({low:.0%} to {high:.0%}) above that on the rods alone",
            _OTHER_RODS_ALLOWED,
            "the rods of the rod runs look smaller, or less deep in the bed, than those of the plates ({found}): look whether "
            "they are the same rods, and at tare_run.",
            _OTHER_RODS_FAULT,
        ),
        "rods-no-tare": Sentences("no plate run has a tare"),
    },
)
def check_rods(measured: MediumMeasurements) -> Check:
    """Check that the force on a rod alone is smaller than that on plate and rod, and that both have the same rods.

    The force on the rod alone, the tare, is subtracted: logs that were exchanged would give a force of the wrong sign.
    Forces are root mean squares over the stroke, N: ``tare_rms_N`` and ``force_rms_N`` of the table of tares.
    """
    tares, sheet = measured.tables["tares"], measured.sheet
    plates = [run.run_id for run in sheet.values() if run.kind == "plate"]
    table = tares[(tares["tare_run"] != "") & tares["run_id"].isin(plates)]
    tare, force = (table[name].to_numpy(float) for name in ("tare_rms_N", "force_rms_N"))
    has_tare = np.isfinite(tare) & (force > 0)
    if not has_tare.any():
        return Check.skip("rods", "rods-no-tare")
    ratio = np.where(has_tare, tare / np.where(has_tare, force, 1), np.nan)
    # in the weakest directions forces hardly exceed the noise of their zeros, so a larger ratio is allowed
    is_clear = tare - force > _CHOSEN.rod_force * np.nanmedian(np.fmax(tare, force))
    # a ratio of exactly 1: the log of the plate is that of the rod
    is_wrong = (ratio == 1) | (ratio >= np.where(is_clear, _CHOSEN.rod_alone, _CHOSEN.rod_clear))
    stronger = table["run_id"][is_wrong]
    limits: dict[str, Any] = {"alone": _CHOSEN.rod_alone, "clear": _CHOSEN.rod_clear}
    if stronger.empty:
        other_rods = _judge_other_rods(measured)
        return other_rods or Check.judge(
            "rods", True, ratio=np.nanmedian(ratio), size=has_tare.sum(), **limits
        )
    return Check.judge(
        "rods",
        False,
        flags_on(stronger, "rod-stronger"),
        code="rods-stronger",
        count=len(stronger),
        size=has_tare.sum(),
        rows=describe_rows(stronger, sheet),
        **limits,
    )


def _judge_other_rods(measured: MediumMeasurements) -> Check | None:
    """Fail the medium if the force on rods alone differs from that of the rods with plates; else return None.

    None also where the difference would have to be large to be seen. What is judged is the share of the tares that
    should not have been subtracted; below 0, too little was.
    """
    tables = measured.tables
    fits, tared, windows = (tables[name] for name in ("fits", "tared", "windows"))
    too_much = estimate_share_too_much(fits, tared, windows, measured.tolerance_deg)
    if too_much is None:
        return None
    share, se, dof = too_much
    most = _CHOSEN.other_rods + student_limit(_CHOSEN.other_rods_sure, dof) * se
    largest_most = _CHOSEN.too_much_seen if share > 0 else _CHOSEN.missing_seen
    if abs(share) <= most or most > largest_most:
        return None
    half_width = float(student_quantile(measured.config.fit.confidence, dof)) * se
    low, high = share - half_width, share + half_width
    code = "rods-other" if share > 0 else "rods-other-small"
    if share < 0:
        share, low, high = -share, -high, -low
    return Check.judge("rods", False, code=code, share=share, low=low, high=high, most=most)


_DRIFT_CAUSE = (
    "the zero of the force drifts ({found}: {rows}): let the transducer warm up, record a rest in air after the "
    "stroke too, or state transducer.drift_N_per_min."
)


@declare_check(
    "drift",
    title="drift of the zero",
    effect=DOUBTFUL,
    good="the zero of the force stays where it is",
    fault="the zero of the force drifts",
    after=("sheet", "channels", "rods"),
    outcomes={
        "drift": Sentences(
            "a drift at rest before the strokes that would move F_{axis} by {newtons:+.2g} N until their middle (median "
            "of {size} runs)",
            "{most:.2g} N of either sign",
            _DRIFT_CAUSE,
        ),
        "drift-alone": Sentences(
            "{count} of {size} runs drift at rest before their strokes",
            "no run that drifts more than the others and than {share:.0f} % of the force",
            _DRIFT_CAUSE,
        ),
        "drift-between": Sentences(
            "the zero of F_{axis} after the stroke is {newtons:+.2g} N from that before it (median of {size} runs)",
            "{most:.2g} N of either sign",
            "the zero of the force drifts or jumps within the strokes ({found}): in between it is a straight line, which nothing "
            "shows it to be. Let the transducer warm up, and look at cables that the stroke bends.",
        ),
        "drift-steady": Sentences(
            "the zero of F_{axis} after the stroke is {newtons:+.2g} N from that before it (median of {size} runs)",
            "{most:.2g} N of either sign",
        ),
        "drift-few": Sentences("fewer than {fewest} runs rest in air"),
    },
)
def check_drift(measured: MediumMeasurements) -> Check:
    """Check that the zero neither drifts at rest in air before a stroke nor differs after it.

    Runs that rest in air at both ends show the change of the zero, ``zero_change_z_N``; others only its trend before
    the stroke, ``zero_trend_z_N``, both of the table of runs. A fault by either fails the medium.
    """
    runs, tares = measured.tables["runs"], measured.tables["tares"]
    table = runs.merge(tares[["run_id", "force_rms_N"]], on="run_id")
    across_strokes = _judge_change_of_zero(table)
    at_rest = _judge_trend_at_rest(measured, table)
    if across_strokes is None or at_rest.verdict == FAILED:
        return at_rest
    # the change of the zero counts if it fails, or alone
    return across_strokes if at_rest.verdict == NOT_CHECKED or across_strokes.effect else at_rest


def _select_zeros(
    table: pd.DataFrame, quantity: str
) -> tuple[pd.DataFrame, FloatArray, FloatArray]:
    """Select the k runs with a force, and with the ``change`` or the ``trend`` of their zero.

    `table`: Table of runs, with ``force_rms_N``, the rms of the force. Returns their rows, this quantity of z and x, N,
    shape (2, k), and the rms of their force, N, (k,).
    """
    zeros = table[[f"zero_{quantity}_{c}_N" for c in "zx"]].to_numpy(float).T
    force = table["force_rms_N"].to_numpy(float)
    is_known = np.isfinite(zeros).all(axis=0) & (force > 0)
    return table[is_known], zeros[:, is_known], force[is_known]


def _judge_change_of_zero(table: pd.DataFrame) -> Check | None:
    """Judge the change of the zero over the strokes; None where too few runs rest in air at both ends.

    The component with the larger median change is judged. `table`: As in `_select_zeros`.
    """
    table, change, force = _select_zeros(table, "change")
    if len(table) < FEW_RUNS:
        return None
    typical = float(np.median(force))
    size = np.median(np.abs(change), axis=1)
    worst = int(size.argmax())
    newtons = float(np.median(change[worst]))
    # the median size counts, as drifts to both sides are as bad as one to the same side; the sign is that of the median
    newtons = math.copysign(float(size[worst]), newtons)
    most_N = _CHOSEN.change_of_zero * typical
    values: dict[str, Any] = {"axis": "zx"[worst], "newtons": newtons, "size": len(table)}
    if abs(newtons) <= most_N:
        return Check.judge("drift", True, code="drift-steady", most=most_N, **values)
    drifting = table["run_id"][np.abs(change[worst]) > most_N]
    flags = flags_on(drifting, "zero-changes")
    return Check.judge("drift", False, flags, code="drift-between", most=most_N, **values)


def _judge_trend_at_rest(measured: MediumMeasurements, table: pd.DataFrame) -> Check:
    """Judge the trend of the zero at rest before the strokes, for runs that rest in air at one end only.

    A trend is the force that it would add until the middle of the stroke, N. A trend that all runs have in common is a
    fault of all; else a run is at fault that drifts clearly more than the others. `table`: As in `_select_zeros`.
    """
    table, trend, force = _select_zeros(table, "trend")
    if len(table) < FEW_RUNS:
        return Check.skip("drift", "drift-few", fewest=FEW_RUNS)
    typical = float(np.median(force))
    # of z and x, shape (2,)
    middle, se = np.array([median_of_runs(trends) for trends in trend]).T
    limit = student_limit(SURE, len(table) - 1) * se
    # a common drift is a fault of all runs; else only runs that clearly drift more than the others are
    common = (np.abs(middle) > limit) & (np.abs(middle) > _CHOSEN.drift * typical)
    deviation = np.abs(trend - middle[:, None])
    is_outlier = deviation > MODES * sd_by_median(deviation)[:, None]
    is_large = deviation > _CHOSEN.drift_of_one * np.maximum(force, typical)
    alone = (is_outlier & is_large).any(axis=0)
    worst = int(np.abs(middle).argmax())
    drifting = table["run_id"] if common.any() else table.loc[alone, "run_id"]
    flags = flags_on(drifting, "zero-drifts")
    values: dict[str, Any] = {"size": len(table), "rows": describe_rows(drifting, measured.sheet)}
    if alone.any() and not common.any():
        values |= {"count": alone.sum(), "share": 100 * _CHOSEN.drift_of_one}
        return Check.judge("drift", False, flags, code="drift-alone", **values)
    values |= {"axis": "zx"[worst], "newtons": middle[worst]}
    most_N = max(_CHOSEN.drift * typical, float(limit[worst]))
    return Check.judge("drift", drifting.empty, flags, most=most_N, **values)


@declare_check(
    "steadiness",
    title="horizontal runs",
    effect=DOUBTFUL,
    good="horizontal runs are steady",
    fault="horizontal runs are not steady",
    after=SOUND_LOGS,
    outcomes={
        "steadiness": Sentences(
            "stress changes by {change} over the steady part (of {size} runs)",
            "{most} of either sign",
            "horizontal runs are not steady ({found}): look at fit.horizontal_skip_cm, at the distance to the walls, and "
            "whether the plate goes deeper or piles up the bed.",
        ),
        "steadiness-few": Sentences("fewer than {fewest} horizontal runs"),
    },
)
def check_steadiness(measured: MediumMeasurements) -> Check:
    """Check that the stress of horizontal runs is constant over the part that is averaged.

    A wall, a pile of grains or a plate that goes deeper makes it grow. The median over runs of the relative change is
    judged, for the component with the larger force.
    """
    fits, tared = measured.tables["fits"], measured.tables["tared"]
    good = measured.tables["windows"]["why"].to_numpy() == RowStatus.GOOD
    rows_by_run = split_runs(tared)
    # run_ids of level runs
    level = fits.loc[(fits["direction"] == "horizontal") & (fits["n_points"] > 0), "run_id"]
    changes = []
    for rows in (rows_by_run[name] for name in level if name in rows_by_run):
        steady = tared.iloc[rows][good[rows]]
        if len(steady) < _CHOSEN.fewest_samples:
            continue
        force_z_x = steady[["force_z_N", "force_x_N"]].to_numpy(float).T
        force = force_z_x[np.abs(force_z_x.mean(axis=1)).argmax()]
        path = steady["path_cm"].to_numpy(float)
        off = path - path.mean()
        if off.any() and force.mean():
            # slope of the force along the path, times its length, relative to the mean force
            changes.append(off @ force / (off @ off) * np.ptp(path) / force.mean())
    change, se = median_of_runs(np.array(changes))
    if math.isnan(change):
        return Check.skip("steadiness", "steadiness-few", fewest=FEW_RUNS)
    most_change = max(_CHOSEN.trend, student_limit(_CHOSEN.trend_sure, len(changes) - 1) * se)
    return Check.judge(
        "steadiness",
        abs(change) <= most_change,
        change=_format_ratio(change),
        most=_format_ratio(most_change),
        size=len(changes),
    )


def _format_ratio(ratio: float) -> str:
    """Format a ratio in percent; above 10, as after exchanged axes, as a plain number."""
    return f"{100 * ratio:.1f} %" if abs(ratio) <= 10 else f"{ratio:.3g}"


@declare_check(
    "repeats",
    title="repeats",
    effect=DOUBTFUL,
    good="each run agrees with the others",
    fault="single runs disagree with the others",
    after=(*SOUND_ALPHA, "symmetry", "surface"),
    needed=True,
    outcomes={
        "repeats": Sentences(
            "{count} of {size} runs {differ} from the others, the most by {most_spreads:.1f} times the spread",
            "no run differs; a difference below {median:.0%} of the largest alpha (median; at most {most:.0%}) is not "
            "detected",
            "{found} ({values} N/cm^3; {rows}): {opposite}look at the medium, the unit, the angles and the logs of these runs{exchanged}. "
            "{together}{pairs}They are used; exclude what is a mistake, and check again: more runs may then stand apart.",
        ),
        "repeats-single": Sentences(
            "none of {size} runs differs from the map of all others; no direction was pushed twice",
            "no run differs; a difference below {median:.0%} of the largest alpha (median; at most {most:.0%}) is not "
            "detected",
        ),
        "repeats-wide": Sentences(
            "repeats of a direction differ by {spread:.0%} (standard deviation along their force, {dof} degrees of freedom), at least by "
            "{low:.0%}",
            "{wide:.0%}, or less than can be told from {usual:.0%}",
            "{found}: prepare each bed in one way, and look for wet sand, another plate or runs in wrong rows. Where beds do "
            "differ so much, accept it with the reason.",
            "repeats of a direction differ more than ordinary beds do",
        ),
        "repeats-few": Sentences(
            "too few runs to estimate how much runs differ: push a direction twice at least"
        ),
        "repeats-blind": Sentences(
            "single runs may be wrong by {median:.0%} of the largest alpha (median) without being seen, since the runs differ so much "
            "from one another or from the shape of known media: {cure}"
        ),
    },
)
def check_repeats(measured: MediumMeasurements) -> Check:
    """Check that alpha of each run agrees with its repeats, or else with the map of all other runs.

    By the table ``peers`` (`rftfit.compare.peers`): `apart` is True for a run that differs, `times_spread` by how much,
    `seen_from_ratio` the least difference that would be seen. Without such a run, repeats must not scatter more than
    ordinary beds do.
    """
    peers = measured.tables["peers"]
    compared = peers[np.isfinite(peers["times_spread"].to_numpy(float))]
    if compared.empty:
        return Check.skip("repeats", "repeats-few")
    count, seen_from = int(compared["apart"].sum()), compared["seen_from_ratio"]
    are_single = (compared["beside"] == MAP).all()
    values: dict[str, Any] = {
        "count": count,
        "size": len(compared),
        "differ": "differs" if count == 1 else "differ",
        "most_spreads": compared["times_spread"].max(),
        "median": seen_from.median(),
        "most": seen_from.max(),
    }
    if count:
        return _fail_by_apart(compared, measured, values)
    if (wide := _judge_spread(measured)) is not None:
        return wide
    if seen_from.median() > _CHOSEN.blind:
        cure = remark("repeat-twice" if are_single else "repeat-more")
        return Check.skip("repeats", "repeats-blind", median=seen_from.median(), cure=cure)
    return Check.judge(
        "repeats", True, code="repeats-single" if are_single else "repeats", **values
    )


_BESIDE = {PAIR: "other run of its direction"}
"""What a run is compared with, as sentences name it where that is not the word in the table of peers."""


def _fail_by_apart(
    compared: pd.DataFrame, measured: MediumMeasurements, values: Mapping[str, Any]
) -> Check:
    """Fail the medium by the runs that stand apart, with a flag on each and hints at their common cause.

    `compared`: Rows of the table of peers that could be compared. `values`: Those of the sentences on what was found.
    """
    sheet, is_apart = measured.sheet, compared["apart"].to_numpy(bool)
    apart, not_apart = compared[is_apart], compared[~is_apart]
    # of two runs that differ from each other, the one farther from the map of all others comes first
    off = np.hypot(apart["off_z_ratio"].fillna(0.0), apart["off_x_ratio"].fillna(0.0))
    ranked = apart.assign(off=off).sort_values(["times_spread", "off"], ascending=False)
    described = map(_describe_beside_others, ranked.head(MOST_NAMED).to_dict("records"))
    runs_apart = set(apart["run_id"])
    opposite = {
        c: runs for c, runs in _find_opposite(compared, measured).items() if runs & runs_apart
    }
    opposite_remarks = [
        str(remark(f"opposite-{c}", count=len(runs), rows=describe_rows(runs, sheet)))
        for c, runs in opposite.items()
    ]
    of_one_cause = set[str]().union(*opposite.values()) or runs_apart
    exchanged = ""
    if len(apart) == 1 and (run := _find_exchanged(apart.iloc[0], not_apart)):
        exchanged = str(remark("exchanged-with", run=run, rows=describe_rows([run], sheet)))
    return Check.judge(
        "repeats",
        False,
        [
            remark("apart", run_id=run, beside=_BESIDE.get(beside, beside), times=times)
            for run, beside, times in apart[["run_id", "beside", "times_spread"]].to_numpy()
        ],
        **values,
        values=format_remarks(described),
        rows=describe_rows(runs_apart, sheet),
        opposite="".join(opposite_remarks),
        together=_describe_together(of_one_cause, compared["run_id"], measured),
        pairs=_describe_open_sides(apart, compared, measured.tolerance_deg),
        exchanged=exchanged,
    )


def _find_exchanged(run: pd.Series[Any], others: pd.DataFrame) -> str:
    """Return the run_id of the run that may be exchanged with one that is apart; empty where none is, or several may be.

    At the angles of the other each of the two must differ less from the others there than a run that is apart does.
    `run`: row of the table of peers; `others`: rows of the runs that are not apart.
    """

    def misfit(runs: Any, places: Any) -> Any:
        """Difference of `runs` from the others at the angles of `places`, in units of what stands apart there."""
        # alpha_x of a pull is filed with the other sign
        turn = np.where((runs["gamma_deg"] < 0) == (places["gamma_deg"] < 0), 1.0, -1.0)
        off_z = runs[column("z")] - places["others_z_N_per_cm3"]
        off_x = turn * runs[column("x")] - places["others_x_N_per_cm3"]
        seen_from = places["seen_from_ratio"] * largest
        return np.hypot(np.nan_to_num(off_z), np.nan_to_num(off_x)) / seen_from

    largest = max(np.nanmax(np.abs(others[[column("z"), column("x")]].to_numpy(float))), 0.0)
    of_both = np.maximum(misfit(run, others), misfit(others, run))
    fitting = others["run_id"][of_both < 1]
    return str(fitting.iloc[0]) if len(fitting) == 1 else ""


def _describe_open_sides(apart: pd.DataFrame, compared: pd.DataFrame, tolerance_deg: float) -> str:
    """Say of runs that are apart from one other run, or from two, that these may be the wrong ones; empty otherwise.

    `apart`: rows of the table of peers, of runs that are apart; `compared`: of all runs.
    """
    sentences = [str(remark("one-of-pair"))] if apart["beside"].eq(PAIR).any() else []
    direction = number_rows(compared, tolerance_deg)
    for run_id in apart["run_id"][apart["beside"].eq(REPEATS) & apart["n_others"].eq(2)]:
        is_repeat = (direction == direction[compared["run_id"] == run_id]) & (
            compared["run_id"] != run_id
        )
        both = " and ".join(compared["run_id"][is_repeat])
        # level pushes of another depth have the direction, but are no repeats
        if np.count_nonzero(is_repeat) == 2:
            sentences.append(str(remark("one-of-three", run=run_id, others=both)))
    return "".join(sentences)


def _find_opposite(compared: pd.DataFrame, measured: MediumMeasurements) -> dict[str, set[str]]:
    """Find runs with about the opposite force of the others, as by a turned cable; run_ids by component, z or x.

    Alpha of the run and of the others must be clear: beyond the standard error and what ordinary beds differ by across
    the force. `compared`: rows of the table of peers.
    """
    fits = measured.tables["fits"].set_index("run_id")
    rows = compared[compared["run_id"].isin(fits.index)]
    if rows.empty:
        return {}
    alpha = np.array(alpha_columns(rows))
    size = np.hypot(*np.nan_to_num(alpha))
    runs = {}
    for c, of_runs in zip("zx", alpha, strict=True):
        others = rows[f"others_{c}_N_per_cm3"].to_numpy(float)
        fit_se = fits.loc[rows["run_id"], column(c, "_se")].to_numpy(float)
        least = SURE * np.hypot(np.nan_to_num(fit_se), _CHOSEN.across * size)
        is_clear = np.minimum(np.abs(of_runs), np.abs(others)) > least
        is_opposite = np.abs(of_runs + others) < _CHOSEN.opposite * np.abs(of_runs - others)
        runs[c] = set(rows["run_id"][is_clear & is_opposite])
    return runs


def _describe_together(
    run_ids: set[str], compared_ids: Iterable[str], measured: MediumMeasurements
) -> str:
    """Describe where runs lie together: most of a stretch of rows, or all with one label; empty if nowhere.

    Together they hint at a cause: a day, a plate, a cable. `run_ids`: These runs. `compared_ids`: All runs that were
    compared.
    """
    if len(run_ids) < _CHOSEN.fewest_together:
        return ""
    sheet = measured.sheet
    compared_runs = sorted((sheet[run_id] for run_id in compared_ids), key=lambda run: run.row)
    # indices of the runs among the compared ones, in the order of the sheet
    places = [place for place, run in enumerate(compared_runs) if run.run_id in run_ids]
    # stretches that begin and end with such runs, and of which these are more than a half: their number, both ends
    stretches = [
        (last - first + 1, places[first], places[last])
        for first, last in combinations(range(len(places)), 2)
        if 2 * (last - first + 1) > places[last] - places[first] + 1
    ]
    remarks = []
    count, start, end = max(stretches, default=(0, 0, 0))
    size = end - start + 1
    if count >= _CHOSEN.fewest_together and size < len(compared_runs):
        first, last = compared_runs[start].row, compared_runs[end].row
        remarks.append(remark("together-rows", count=count, size=size, first=first, last=last))
    for name in LABELS:
        labels = {str(getattr(sheet[run_id], name)) for run_id in run_ids}
        if len(labels) > 1 or labels == {""}:
            continue
        if any(str(getattr(run, name)) not in labels for run in compared_runs):
            remarks.append(remark("together-label", column=name, label=labels.pop()))
    return str(remark("together", where=", ".join(map(str, remarks)))) if remarks else ""


def _judge_spread(measured: MediumMeasurements) -> Check | None:
    """Fail the medium if repeats scatter more than ordinary beds, though no run differs clearly; else return None.

    None also where the repeats are too few to tell. The scatter is that along the force, relative to alpha.
    """
    from scipy.special import chdtri

    fits = measured.tables["fits"]
    runs = fits.iloc[np.flatnonzero(np.isfinite(alpha_columns(fits)).any(axis=0))]
    if runs.empty:
        return None
    number = number_rows(runs, measured.tolerance_deg)
    alpha, se = np.stack(alpha_columns(runs)), np.stack(alpha_columns(runs, "_se"))
    groups = [(alpha[:, number == first], se[:, number == first]) for first in np.unique(number)]
    scatter = spread_of_beds(groups).scatter
    if scatter is None:
        return None
    spread, dof = scatter.relative()[0], scatter.dof
    # lower end of the interval of the spread, by the distribution of chi-square
    low = spread * math.sqrt(dof / float(chdtri(dof, 1 - _CHOSEN.sure_of_spread)))
    if spread <= _CHOSEN.wide or low <= _CHOSEN.usual_at_most:
        return None
    return Check.judge(
        "repeats",
        False,
        code="repeats-wide",
        spread=spread,
        low=low,
        dof=round(dof),
        wide=_CHOSEN.wide,
        usual=_CHOSEN.usual_at_most,
    )


def _describe_beside_others(row: dict[Any, Any]) -> Remark:
    """Say alpha of a run and that by the others, for the component that differs more; `row`: of the table of peers."""
    c = "zx"[abs(row["off_x_ratio"]) > abs(row["off_z_ratio"])]
    others = row[f"others_{c}_N_per_cm3"]
    return remark(
        "alpha-beside", run=row["run_id"], component=c, alpha=row[column(c)], others=others
    )


@declare_check(
    "same_logs",
    title="copied logs",
    effect=UNUSABLE,
    good="no log or run is there twice",
    fault="a log or run is there twice",
    outcomes={
        "same_logs": Sentences("no {what} is there twice", "each {what} once"),
        "same_logs-copied": Sentences(
            "{count} runs have the readings of others: {first}",
            "each {what} once",
            "copies of a {what} are no repeats ({found}): look {where}, and leave out the copies.",
        ),
        "same_logs-few": Sentences("no run has enough readings to tell a copy by"),
        "same_logs-table": Sentences(
            "no run has enough readings to tell a copy by: a table of alpha, or of few depths"
        ),
    },
)
def check_logs(measured: MediumMeasurements) -> Check:
    """Check that no two runs have the same readings, or the same noise, under two names: copies are no repeats."""
    sheet, copies = measured.sheet, measured.copies
    of_table = any(run.intruder == UNIT_AREA for run in sheet.values())
    if not copies:
        return Check.skip("same_logs", "same_logs-table" if of_table else "same_logs-few")
    record_kind = "run" if of_table else "log"
    where_to_look = "at these runs in the table" if of_table else "at force_log of these runs"
    # plates at 90 and -90 degrees are the same: a table may state them under both angles
    copied = [
        run_id
        for run_id, run in sheet.items()
        if any(abs(run.beta_deg - sheet[copy].beta_deg) != 180 for copy in copies.get(run_id, ()))
    ]
    if not copied:
        return Check.judge("same_logs", True, what=record_kind)
    return Check.judge(
        "same_logs",
        False,
        [remark("same-readings", run_id=run, runs=", ".join(copies[run])) for run in copied],
        code="same_logs-copied",
        count=len(copied),
        first=f"{copied[0]} and {', '.join(copies[copied[0]])}",
        what=record_kind,
        where=where_to_look,
    )


_SIZE_FOUND = "alpha_z(0, 90) = {alpha:.3g} N/cm^3"
_SIZE_ALLOWED = "{low:g} to {high:g} N/cm^3"


@declare_check(
    "size",
    title="size of the force",
    effect=UNUSABLE,
    good="alpha is as large as expected",
    fault="alpha is not as large as expected",
    after=SOUND_LOGS,
    outcomes={
        "size": Sentences(
            _SIZE_FOUND,
            _SIZE_ALLOWED,
            "the scale of the force or the size of the plate looks wrong: {found}, {whose} has {allowed}: look at the "
            "unit of the force and at the size of the plate.",
        ),
        "size-unstated": Sentences(
            f"{_SIZE_FOUND}; expected_alpha of the medium is not stated",
            _SIZE_ALLOWED,
            "the scale of the force was not checked: a wrong unit passes unless expected_alpha is stated.",
        ),
        "size-no-cell": Sentences("no alpha at (0, 90) deg"),
    },
)
def check_size(measured: MediumMeasurements) -> Check:
    """Check that alpha_z(0, 90 deg) is as large as the config states, or else as large as in any granular medium.

    Only a wrong unit or size of the plate makes all alpha wrong by one factor. Where the config states nothing, a medium
    within the wide limits counts as not checked, not as passed.
    """
    expected = measured.medium.expected_alpha
    cell = cell_down(measured.tables["alpha"], measured.tolerance_deg)
    alpha = math.nan if cell is None else float(cell[column("z")])
    if math.isnan(alpha):
        return Check.skip("size", "size-no-cell")
    # N/cm^3
    low, high = expected or (_CHOSEN.alpha_from, _CHOSEN.alpha_to)
    inside = low <= abs(alpha) <= high
    values: dict[str, Any] = {"alpha": alpha, "low": low, "high": high}
    if inside and not expected:
        return Check.skip("size", "size-unstated", **values)
    whose = "expected_alpha" if expected else "any granular medium"
    return Check.judge("size", inside, whose=whose, **values)
