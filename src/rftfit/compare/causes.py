"""Tables `causes`, `axes`, `misplaced` of a medium: errors that runs share, other axes, runs in wrong rows of the sheet.

The models are in `rftfit.compare.joint`, `axes` and `misplaced`; here their runs are selected and their results written
as rows. A *cause* and its kind, group, place, share and size are those of `rftfit.compare.joint.Cause`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.columns import LABELS
from rftfit.campaign.sheet import Run
from rftfit.compare.axes import axes_evidence
from rftfit.compare.joint import (
    ALL,
    FROM_RUN,
    HOLDER,
    KINDS,
    LEAST_GAIN,
    WINDOW,
    Cause,
    FoundCause,
    JointModel,
    RunSlopes,
    Scan,
    find_causes,
)
from rftfit.compare.misplaced import find_misplaced
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import alpha_columns
from rftfit.measure.slopes import NORMAL_95
from rftfit.measure.verdict_words import FEWEST_RUNS, MIXED_UP, NO_RUNS
from rftfit.outputs.dictionary import columns_of
from rftfit.store.chosen import chosen

TOLD, NOT_SEEN, NOT_CHECKED = "told", "not seen", "not checked"
"""Verdicts on a cause: the runs have it; they would show it and do not; they would not show it."""

TOO_WIDE = "too-wide"
"""Reason why a cause that is not seen was not checked, beside `NO_RUNS` and `MIXED_UP`: only an unlikely size would be."""

CAUSE_COLUMNS = columns_of("causes/{medium}.csv")
AXES_COLUMNS = ["medium", "axes", "log_bayes_factor"]
"""Columns of the table of `axes_evidence`: a row for each mistake with axes."""
_CHOSEN = chosen("compare", "causes")


def compare_all_runs(
    fits: pd.DataFrame,
    medium: str,
    sheet: Mapping[str, Run],
    angle_deg: float,
    tolerance_deg: float = TOLERANCE_DEG,
) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Find causes that the runs of a medium share, likelier axes, and runs in wrong rows of the sheet.

    Returns tables of the columns `CAUSE_COLUMNS`, `AXES_COLUMNS` and `MISPLACED_COLUMNS`. Of fewer than `FEWEST_RUNS`
    runs no cause is judged. `fits`: table of fits of the medium. `sheet`: runs of the medium by run_id. `angle_deg`:
    standard deviation of the angles of a run. `tolerance_deg`: difference of each angle up to which runs are of one
    direction.
    """
    runs, run_ids = _select_runs(fits, sheet, tolerance_deg)
    # without any force there is nothing to compare
    can_be_compared = bool(np.any(runs.alpha))
    if runs.size < FEWEST_RUNS or not can_be_compared:
        rows = [_unchecked_row(kind, NO_RUNS) for kind in KINDS]
    else:
        causes_found, scan = find_causes(JointModel(runs, (angle_deg, angle_deg)))
        rows = [
            *(_row_of_cause(cause, run_ids) for cause in causes_found),
            *rows_of_scan(scan, causes_found),
        ]
    causes = pd.DataFrame(rows, columns=CAUSE_COLUMNS).assign(medium=medium)
    evidence = axes_evidence(runs) if can_be_compared else {}
    axes = [(medium, *name_and_factor) for name_and_factor in evidence.items()]
    misplaced = find_misplaced(runs, run_ids, sheet, medium)
    return causes, pd.DataFrame(axes, columns=AXES_COLUMNS), misplaced


def labels_of(runs: Sequence[Run]) -> dict[str, npt.NDArray[np.str_]]:
    """Return the labels of runs, see `RunSlopes`: intruder, and the columns `LABELS` of the run sheet."""
    return {
        name: np.array([str(getattr(run, name)) for run in runs]) for name in ("intruder", *LABELS)
    }


def _select_runs(
    fits: pd.DataFrame, sheet: Mapping[str, Run], tolerance_deg: float
) -> tuple[RunSlopes, list[str]]:
    """Select the runs that have alpha in both components, in the order of the run sheet; returned with their run_ids.

    `fits`: table of fits. `sheet`: runs of the medium by run_id; rows of fits without one are left out.
    """
    is_measured = np.isfinite(alpha_columns(fits)).all(axis=0)
    good = fits[is_measured & fits["run_id"].isin([*sheet]).to_numpy(bool)]
    rows = np.array([sheet[run_id].row for run_id in good["run_id"]], dtype=int)
    good = good.iloc[np.argsort(rows, kind="stable")]
    run_ids = good["run_id"].astype(str).tolist()
    runs = RunSlopes(
        good["beta_deg"].to_numpy(float),
        good["gamma_deg"].to_numpy(float),
        np.stack(alpha_columns(good)),
        np.nan_to_num(alpha_columns(good, "_se")),
        good["mirrored"].to_numpy(bool),
        np.arange(len(good)),
        labels_of([sheet[run_id] for run_id in run_ids]),
        tolerance_deg,
    )
    return runs, run_ids


def _row_of_cause(found_cause: FoundCause, run_ids: list[str]) -> dict[str, Any]:
    """Make the row, of `CAUSE_COLUMNS`, of a cause that was found; `run_ids`: of all runs, in the order of its share.

    A cause is shared by the runs with a positive share. Sizes are stated as in `_as_change`.
    """
    cause = found_cause.cause
    # the data chose the cause, too, so the interval is wider than for a cause that was asked for
    wider = _CHOSEN.told_gain_wider if cause.kind == "gain" else _CHOSEN.told_wider
    size, size_lo, size_hi = _change_with_interval(cause, found_cause.size, wider * found_cause.se)
    shared_by = [run_id for run_id, share in zip(run_ids, cause.share, strict=True) if share > 0]
    inseparable = [
        f"{rival.kind} {rival.group} {rival.place}".strip() for rival in found_cause.inseparable
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
        "times_error": found_cause.errors_beyond,
        "reason": "",
        "inseparable": "; ".join(inseparable),
    }


def _change_with_interval(cause: Cause, size: float, se: float) -> tuple[float, float, float]:
    """Return a size as people state it (`_as_change`) and the ends of its 95 % interval, which includes what is no fault.

    `size`, `se`: of the cause in the joint model, and its standard error.
    """
    half_width = math.hypot(NORMAL_95 * se, _size_without_fault(cause))
    middle, *ends = (_as_change(cause, size + sign * half_width) for sign in (0, -1, 1))
    return middle, min(ends), max(ends)


def _size_without_fault(cause: Cause) -> float:
    """Return the size that a cause of all runs may have without a fault, by the medium or the mount; 0 for others."""
    if cause.spread_of_media:
        return NORMAL_95 * cause.spread_of_media
    return cause.tolerated if cause.group == ALL else 0.0


def rows_of_scan(scan: Scan, causes_found: Iterable[FoundCause] = ()) -> list[dict[str, Any]]:
    """Make a row for each kind and group that was not found: not seen, or not checked; in the columns `CAUSE_COLUMNS`.

    Steps, windows and holders have one row for all their places, with the median of the least sizes that would be seen.
    `scan`: scores after the causes that were found are removed.
    """
    kinds_found = {(shared.cause.kind, shared.cause.group) for shared in causes_found}
    # indices of the candidates of each row
    candidates: dict[tuple[str, str, str], list[int]] = {}
    for number, cause in enumerate(scan.causes):
        if (cause.kind, cause.group) not in kinds_found:
            place = "" if cause.group in (FROM_RUN, WINDOW, HOLDER) else cause.place
            candidates.setdefault((cause.kind, cause.group, place), []).append(number)
    rows = []
    for (kind, group, place), numbers in candidates.items():
        first = scan.causes[numbers[0]]
        # checked where it can be at half of its places or more
        is_checked = 2 * scan.checked[numbers].sum() >= len(numbers)
        if is_checked:
            verdict, reason = NOT_SEEN, ""
            shown = [number for number in numbers if scan.checked[number]]
        else:
            is_mixed_up = 2 * scan.mixed_up[numbers].sum() >= len(numbers)
            verdict, reason = NOT_CHECKED, MIXED_UP if is_mixed_up else TOO_WIDE
            shown = numbers
        row = _unchecked_row(kind, reason) | {
            "group": group,
            "place": place,
            "verdict": verdict,
            "least_seen": _as_change(first, float(np.median(scan.least_seen[shown]))),
        }
        if len(numbers) == 1:
            row["n_runs"] = int(np.count_nonzero(first.share > 0))
            row["size"], row["size_lo"], row["size_hi"] = _change_with_interval(
                first, scan.size[numbers[0]], scan.se[numbers[0]]
            )
        rows.append(row)
    return rows


def _unchecked_row(kind: str, reason: str) -> dict[str, Any]:
    """Make a row without numbers, for a cause of all runs that was not checked."""
    names = {"kind": kind, "group": ALL, "place": "", "run_ids": "", "inseparable": ""}
    verdict = {"verdict": NOT_CHECKED, "n_runs": 0, "reason": reason, "unit": KINDS[kind].unit}
    return names | verdict


def _as_change(cause: Cause, size: float) -> float:
    """State a gain as a ratio less 1: of its runs to the others, or of a trend's last run to the first.

    Below -1 the force is reversed. Other sizes are returned as they are.
    """
    if not cause.is_gain:
        return float(size)
    # the share of a cause is 1/2 in its runs and -1/2 in the others
    ratio = (1 + size / 2) / max(1 - size / 2, LEAST_GAIN)
    return float((-ratio if cause.reversed_side else ratio) - 1)
