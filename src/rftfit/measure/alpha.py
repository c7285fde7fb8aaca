"""From fits of runs to the table alpha(beta, gamma) of one medium, with the spread between runs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.fits import COMPONENTS, Row
from rftfit.measure.slopes import (
    GIVEN_DOF,
    Spread,
    combine_dof,
    mean_of_repeats,
    spread_of_runs,
    student_quantile,
)
from rftfit.reference import BETA_DEG, GAMMA_DEG

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from rftfit.conventions import FloatArray


ANGLE_TOLERANCE_DEG = 0.05

SAME_DEPTH_CM = 0.1
"""Horizontal runs closer in depth than this were meant for one depth."""

QUANTITIES = ("", "_se", "_lo", "_hi")


def column(component: str, quantity: str = "") -> str:
    """Name of a column of alpha: component ``z`` or ``x``, one of `QUANTITIES`."""
    return f"alpha_{component}{quantity}_N_per_cm3"


def alpha_table(
    fits: pd.DataFrame, medium: str, confidence: float, depths: int, run_to_run: float | None = None
) -> pd.DataFrame:
    """Combine the fits of one medium into the 7 x 13 grid of Table S5.

    A cell with several runs gets their mean. The cells beta = -90 and +90 degrees are one and the
    same plate and share their runs. A horizontal cell is the zero-intercept fit through the
    steady-state means at the depths of its runs (design section 2). What differs from run to run
    enters every interval as far as it is known: pooled from the repeats of the sheet, else as
    stated; column `spread` says which. A cell without a number has a reason.

    `fits`: Of `fit_medium`. `confidence`: Level of the intervals. `depths`: Number of depths that a
    horizontal cell should have. `run_to_run`: Stated standard deviation of alpha, N/cm^3.
    """
    import pandas as pd

    records = sorted(fits.to_dict("records"), key=lambda row: str(row["run_id"]))
    beta_deg = np.array([row["beta_deg"] for row in records], dtype=float)
    gamma_deg = np.array([row["gamma_deg"] for row in records], dtype=float)
    spreads = {c: spread_of_runs(_repeats(records, c), run_to_run) for c in COMPONENTS}
    rows = []
    for beta in BETA_DEG:
        off_beta = np.abs((beta_deg - beta + 90) % 180 - 90)
        for gamma in GAMMA_DEG:
            near = (off_beta < ANGLE_TOLERANCE_DEG) & (
                np.abs(gamma_deg - gamma) < ANGLE_TOLERANCE_DEG
            )
            here = [records[index] for index in np.flatnonzero(near)]
            cell = _cell(here, bool(gamma == 0), confidence, depths, spreads)
            rows.append({"medium": medium, "beta_deg": beta, "gamma_deg": gamma, **cell})
    return pd.DataFrame(rows)


def _repeats(records: list[Row], component: str) -> list[tuple[FloatArray, FloatArray]]:
    """Group the runs of one cell, and of one depth where it is horizontal."""
    groups: dict[tuple[float, float], list[Row]] = {}
    for run in records:
        if math.isfinite(run[column(component)]):
            # -90 and 90 degrees are one plate
            beta = round(float(run["beta_deg"]), 1)
            key = (abs(beta) if abs(beta) == 90 else beta, round(float(run["gamma_deg"]), 1))
            groups.setdefault(key, []).append(run)
    return [
        _parts(group, component)[:2]
        for (_, gamma), runs in groups.items()
        for group in (_by_depth(runs) if gamma == 0 else [runs])
    ]


def _by_depth(runs: list[Row]) -> list[list[Row]]:
    """Part horizontal runs by the depth they were made at; none is reached exactly."""
    parts: list[list[Row]] = []
    for run in sorted(runs, key=lambda row: float(row["depth_from_cm"])):
        if not parts or run["depth_from_cm"] - parts[-1][-1]["depth_from_cm"] > SAME_DEPTH_CM:
            parts.append([])
        parts[-1].append(run)
    return parts


def _cell(
    runs: list[Row], horizontal: bool, confidence: float, depths: int, spreads: dict[str, Spread]
) -> dict[str, float | int | str]:
    names = [column(component, quantity) for component in COMPONENTS for quantity in QUANTITIES]
    cell: dict[str, float | int | str] = dict.fromkeys(names, math.nan)
    good = [run for run in runs if math.isfinite(run[column("z")])]
    flags = [f"{run['run_id']}: {run['flags']}" for run in runs if run["flags"]]
    reasons = [f"{run['run_id']}: {run['reason']}" for run in runs if run["reason"]]
    n_depths = len(_by_depth(good)) if horizontal else depths
    if not runs:
        reasons.append("no run")
    elif good and n_depths < 2 <= depths:
        # one depth cannot show that stress is proportional to depth
        reasons.append(f"only {n_depths} of {depths} depths")
    elif good:
        if n_depths < depths:
            flags.append(f"{n_depths} of {depths} depths")
        for component in COMPONENTS:
            spread = spreads[component]
            if horizontal:
                alpha, se, dof = _through_depths(good, component, spread)
            else:
                alpha, se, dof = mean_of_repeats(*_parts(good, component), spread)
            half = float(student_quantile(confidence, dof)) * se
            values = (alpha, se, alpha - half, alpha + half)
            cell.update({column(component, quantity): value
                         for quantity, value in zip(QUANTITIES, values, strict=True)})  # fmt: skip
    return cell | {
        "n_runs": len(good),
        "run_ids": " ".join(run["run_id"] for run in good),
        **{f"run_to_run_{c}_N_per_cm3": spreads[c].deviation for c in COMPONENTS},
        "spread": spreads["z"].source,
        "flags": "; ".join(flags),
        "reason": "; ".join(reasons),
    }


def _parts(runs: list[Row], component: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    names = (column(component), column(component, "_se"), f"alpha_{component}_dof")
    alpha, se, dof = (np.array([run[name] for run in runs], dtype=float) for name in names)
    return alpha, se, dof


def _through_depths(runs: list[Row], component: str, spread: Spread) -> tuple[float, float, float]:
    """Zero-intercept fit through the mean stress at each depth."""
    alpha, se, dof = _parts(runs, component)
    depth = np.array([(run["depth_from_cm"] + run["depth_to_cm"]) / 2 for run in runs])
    share = depth**2 / float(depth @ depth)
    # a start-up moves all depths the same way, so its parts add up before they are squared
    startup = np.array([run.get(f"alpha_{component}_startup_N_per_cm3", 0.0) for run in runs])
    own = np.maximum(se**2 - startup**2, 0) * share**2
    parts = np.concatenate(
        [own, [spread.variance * float(share @ share), float(share @ startup) ** 2]]
    )
    dofs = np.concatenate([dof, [spread.dof, GIVEN_DOF]])
    return float(share @ alpha), math.sqrt(float(parts.sum())), float(combine_dof(parts, dofs))


def grid(table: pd.DataFrame, name: str) -> FloatArray:
    """One column of an alpha table over the grid (7, 13): rows by beta, columns by gamma, increasing."""
    ordered = table.sort_values(["beta_deg", "gamma_deg"])
    shape: Sequence[int] = (BETA_DEG.size, GAMMA_DEG.size)
    return ordered[name].to_numpy(float).reshape(shape)
