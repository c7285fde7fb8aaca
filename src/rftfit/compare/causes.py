"""Tables of what the joint model says of a medium: what its runs share, and whether its axes are as given."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.columns import LABELS
from rftfit.campaign.sheet import Run
from rftfit.compare.axes import axes_evidence
from rftfit.compare.joint import (
    ALL,
    FROM_RUN,
    HOLDER,
    KINDS,
    WINDOW,
    Cause,
    Found,
    JointModel,
    RunSlopes,
    Scan,
    find_causes,
)
from rftfit.compare.misplaced import find_misplaced
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import column
from rftfit.measure.verdict_words import FEWEST_RUNS, NO_RUNS
from rftfit.outputs.dictionary import columns_of

TOLD, NOT_SEEN, NOT_CHECKED = "told", "not seen", "not checked"
MIXED_UP, TOO_WIDE = "mixed-up", "too-wide"
"""Why a cause cannot be checked, beside `NO_RUNS`: its runs are those of other directions; only an unlikely size would be seen."""

CAUSE_COLUMNS = columns_of("causes/{medium}.csv")
AXES_COLUMNS = ["medium", "axes", "log_bayes_factor"]
_NORMAL_95 = 1.959963984540054
_WIDER_GAIN, _WIDER_OTHER = 1.2, 1.5
"""Errors of causes that are told scatter so many times as much as stated, since place and kind are chosen by the data too."""


def compare_all_runs(
    fits: pd.DataFrame,
    medium: str,
    sheet: Mapping[str, Run],
    angle_deg: float,
    tolerance_deg: float = TOLERANCE_DEG,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Look for what the runs of a medium share, for other axes, and for runs in wrong rows of the sheet.

    Returns tables of the columns `CAUSE_COLUMNS`, `AXES_COLUMNS` and `MISPLACED_COLUMNS`.

    `angle_deg`: Standard deviation of the angles of a run. `tolerance_deg`: Difference of each angle up to which runs are of
    one direction.
    """
    runs, run_ids = _run_slopes(fits, sheet, tolerance_deg)
    if runs.size < FEWEST_RUNS or not np.any(runs.alpha):
        rows = [_unchecked_row(kind, NO_RUNS) for kind in KINDS]
        causes = pd.DataFrame(rows, columns=CAUSE_COLUMNS).assign(medium=medium)
    else:
        told, scan = find_causes(JointModel(runs, (angle_deg, angle_deg)))
        causes = pd.DataFrame(
            [*(_told_row(cause, run_ids) for cause in told), *_rows_of_scan(scan, told)],
            columns=CAUSE_COLUMNS,
        ).assign(medium=medium)
    evidence = axes_evidence(runs) if runs.size and np.any(runs.alpha) else {}
    axes = [
        {"medium": medium, "axes": name, "log_bayes_factor": evidence[name]} for name in evidence
    ]
    misplaced = find_misplaced(runs, run_ids, sheet, medium)
    return causes, pd.DataFrame(axes, columns=AXES_COLUMNS), misplaced


def rows_of_model(model: JointModel) -> pd.DataFrame:
    """What a model without a fit would see: rows of `CAUSE_COLUMNS`, or those of too few runs."""
    if model.runs.size < FEWEST_RUNS:
        return pd.DataFrame(
            [_unchecked_row(kind, NO_RUNS) for kind in KINDS], columns=CAUSE_COLUMNS
        )
    return pd.DataFrame(_rows_of_scan(model.scan(), []), columns=CAUSE_COLUMNS)


def _run_slopes(
    fits: pd.DataFrame, sheet: Mapping[str, Run], tolerance_deg: float
) -> tuple[RunSlopes, list[str]]:
    """Runs that have both slopes, in the order of the run sheet."""
    names = [column(c) for c in "zx"]
    is_measured = np.isfinite(fits[names].to_numpy(float)).all(axis=1)
    good = fits[is_measured & fits["run_id"].isin([*sheet]).to_numpy(bool)]
    rows = np.array([sheet[run_id].row for run_id in good["run_id"]], dtype=int)
    good = good.iloc[np.argsort(rows, kind="stable")]
    run_ids = good["run_id"].astype(str).tolist()
    labels = {
        name: np.array([str(getattr(sheet[run_id], name)) for run_id in run_ids])
        for name in ("intruder", *LABELS)
    }
    errors = [column(c, "_se") for c in "zx"]
    runs = RunSlopes(
        good["beta_deg"].to_numpy(float),
        good["gamma_deg"].to_numpy(float),
        good[names].to_numpy(float).T,
        np.nan_to_num(good[errors].to_numpy(float).T),
        good["mirrored"].to_numpy(bool),
        np.arange(len(good)),
        labels,
        tolerance_deg,
    )
    return runs, run_ids


def _told_row(told_cause: Found, run_ids: list[str]) -> dict[str, Any]:
    cause = told_cause.cause
    size, size_lo, size_hi = describe_change(told_cause)
    shared_by = [run_id for run_id, share in zip(run_ids, cause.share, strict=True) if share > 0]
    inseparable = [
        f"{rival.kind} {rival.group} {rival.place}".strip() for rival in told_cause.inseparable
    ]
    return {
        "kind": cause.kind,
        "group": cause.group,
        "place": cause.place,
        "verdict": TOLD,
        "n_runs": len(shared_by),
        "run_ids": " ".join(shared_by),
        "size": size,
        "size_lo": size_lo,
        "size_hi": size_hi,
        "unit": KINDS[cause.kind].unit,
        "times_error": told_cause.times,
        "least_seen": math.nan,
        "reason": "",
        "inseparable": "; ".join(inseparable),
    }


def describe_change(told_cause: Found) -> tuple[float, float, float]:
    """Size of a cause as people state it, and its 95 % interval."""
    wider = _WIDER_GAIN if told_cause.cause.kind == "gain" else _WIDER_OTHER
    half = math.hypot(_NORMAL_95 * wider * told_cause.se, _own_of_medium(told_cause.cause))
    low, high = (_as_change(told_cause.cause, told_cause.size + sign * half) for sign in (-1, 1))
    return _as_change(told_cause.cause, told_cause.size), low, high


def _own_of_medium(cause: Cause) -> float:
    """Size of a cause of all runs that a medium and an ordinary mount may have of themselves: nothing tells it from more."""
    if cause.of_media:
        return _NORMAL_95 * cause.of_media
    return cause.tolerated if cause.group == ALL else 0.0


def _rows_of_scan(scan: Scan, told: Iterable[Found]) -> list[dict[str, Any]]:
    """A row of each kind and group that was not told; of steps, windows and holders, the median of their places."""
    told_kinds = {(told_cause.cause.kind, told_cause.cause.group) for told_cause in told}
    places: dict[tuple[str, str, str], list[int]] = {}
    for number, cause in enumerate(scan.causes):
        if (cause.kind, cause.group) not in told_kinds:
            place = "" if cause.group in (FROM_RUN, WINDOW, HOLDER) else cause.place
            places.setdefault((cause.kind, cause.group, place), []).append(number)
    rows = []
    for (kind, group, place), numbers in places.items():
        checked = scan.checked[numbers]
        # at most places it can be checked, or it counts as not checked
        verdict = NOT_SEEN if 2 * checked.sum() >= len(numbers) else NOT_CHECKED
        shown = [number for number in numbers if scan.checked[number]] or numbers
        if verdict == NOT_CHECKED:
            shown = numbers
        least = float(np.median(scan.least_seen[shown]))
        alone = scan.causes[numbers[0]]
        reason = ""
        if verdict == NOT_CHECKED:
            reason = MIXED_UP if 2 * scan.mixed_up[numbers].sum() >= len(numbers) else TOO_WIDE
        row = _unchecked_row(kind, reason) | {
            "group": group,
            "place": place,
            "verdict": verdict,
            "n_runs": int(np.count_nonzero(alone.share > 0)) if len(numbers) == 1 else 0,
            "least_seen": _as_change(alone, least),
        }
        if len(numbers) == 1:
            size = scan.size[numbers[0]]
            half = math.hypot(_NORMAL_95 * scan.se[numbers[0]], _own_of_medium(alone))
            row["size"] = _as_change(alone, size)
            row["size_lo"], row["size_hi"] = (
                _as_change(alone, size + sign * half) for sign in (-1, 1)
            )
        rows.append(row)
    return rows


def _unchecked_row(kind: str, reason: str) -> dict[str, Any]:
    numbers = dict.fromkeys(("size", "size_lo", "size_hi", "times_error", "least_seen"), math.nan)
    texts = {"group": ALL, "place": "", "run_ids": "", "inseparable": ""}
    verdict = {"kind": kind, "verdict": NOT_CHECKED, "n_runs": 0, "reason": reason}
    return numbers | texts | verdict | {"unit": KINDS[kind].unit}


def _as_change(cause: Cause, size: float) -> float:
    """A gain of runs as the ratio to the other runs less 1; of a trend, of the last run to the first."""
    if cause.kind not in ("gain", "gain-x"):
        return float(size)
    # the share of a cause is 1/2 in its runs and -1/2 in the others
    return float((1 + size / 2) / max(1 - size / 2, 0.05) - 1)
