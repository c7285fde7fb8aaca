"""From fits of runs to the table alpha(beta, gamma) of one medium, with the spread between runs."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.measure.fits import COMPONENTS, SEVERAL_PLATES, Row, flags_of_all, without
from rftfit.measure.slopes import (
    AS_PREPARED,
    GIVEN_DOF,
    OF_CELL,
    Spread,
    combine_dof,
    mean_of_repeats,
    spread_of_runs,
    student_quantile,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import pandas as pd

    from rftfit.campaign.config import Grid
    from rftfit.conventions import FloatArray


SAME_DIRECTION_DEG = 0.5
"""Farther than this in an angle, a cell is not the one that is looked for."""

SAME_DEPTH_CM = 0.1
"""Horizontal runs closer in depth than this were meant for one depth."""

NO_PUSH = "no run at (0, 90) deg, a level plate straight down"
"""Why a medium has no measured alpha_z(0, 90 deg): no chi, and no zeta by the scaling routine."""

POOLED_PLATES = "repeats are of different plates"

QUANTITIES = ("", "_se", "_lo", "_hi")


def column(component: str, quantity: str = "") -> str:
    """Name of a column of alpha: component ``z`` or ``x``, one of `QUANTITIES`."""
    return f"alpha_{component}{quantity}_N_per_cm3"


def alpha_table(
    fits: pd.DataFrame,
    medium: str,
    confidence: float,
    depths: int,
    run_to_run: float | None = None,
    grid: Grid | None = None,
) -> pd.DataFrame:
    """Combine the fits of one medium into its cells, one row each.

    Cells are the planned ones of the grid, or else the distinct directions of the runs. A cell with several runs gets their mean. Planned cells at beta = -90 and +90 degrees are one and
    the same plate and share their runs. A horizontal cell is the zero-intercept fit through the
    steady-state means at the depths of its runs (design section 2). What differs from run to run
    enters every interval as far as it is known: pooled from the repeats of the sheet, else as
    stated; column `spread` says which. A cell without a number has a reason.

    `fits`: Of `fit_medium`. `confidence`: Level of the intervals. `depths`: Number of depths that a
    horizontal cell should have. `run_to_run`: Stated standard deviation of alpha, N/cm^3. `grid`:
    Planned cells, and when two directions are the same.
    """
    import pandas as pd

    from rftfit.campaign.config import Grid

    records = sorted(fits.to_dict("records"), key=lambda row: str(row["run_id"]))
    angles = [(float(row["beta_deg"]), float(row["gamma_deg"])) for row in records]
    grid = grid or Grid()
    cells = list(grid.planned) or distinct(angles, grid)
    own = [
        [run for run, angle in zip(records, angles, strict=True) if grid.same(cell, angle)]
        for cell in cells
    ]
    spreads = {c: spread_of_runs(_repeats(own, c), run_to_run) for c in COMPONENTS}
    told = flags_of_all(fits)
    rows = []
    for (beta, gamma), here in zip(cells, own, strict=True):
        cell = _cell(here, gamma == 0, confidence, depths, spreads, told)
        rows.append({"medium": medium, "beta_deg": beta, "gamma_deg": gamma, **cell})
    if not rows:  # no plate run at all: the columns of a table all the same
        nothing = {"medium": medium, "beta_deg": math.nan, "gamma_deg": math.nan}
        return pd.DataFrame([nothing | _cell([], False, confidence, depths, spreads, ())])[:0]
    return pd.DataFrame(rows)


def distinct(angles: Sequence[tuple[float, float]], grid: Grid) -> list[tuple[float, float]]:
    """Gather directions that are the same within the tolerance of the grid, by beta, then gamma.

    Each is called by the angles that most of its runs have.
    """
    left = Counter(angles)
    cells = []
    while left:
        # the most frequent first: the arm's 44.98 belongs to the planned 45
        name = max(left, key=lambda angle: (left[angle], angle))
        # plates at -90 and 90 degrees are one: it is called 90
        cells.append((90.0, name[1]) if name[0] == -90 else name)
        left = Counter({angle: n for angle, n in left.items() if not grid.same(name, angle)})
    return sorted(cells)


def _repeats(cells: list[list[Row]], component: str) -> list[tuple[FloatArray, FloatArray]]:
    """Group the runs of each cell, and of each depth where they are horizontal.

    Runs of a cell that is planned twice, at beta = -90 and 90 degrees, count once.
    """
    seen: set[str] = set()
    groups = []
    for runs in cells:
        new = [run for run in runs
               if math.isfinite(run[column(component)]) and run["run_id"] not in seen]  # fmt: skip
        seen.update(str(run["run_id"]) for run in new)
        level = new and new[0]["gamma_deg"] == 0
        parts = _by_depth(new) if level and math.isfinite(new[0]["depth_from_cm"]) else [new]
        groups += [_parts(part, component)[:2] for part in parts if part]
    return groups


def _by_depth(runs: list[Row]) -> list[list[Row]]:
    """Part horizontal runs by the depth they were made at; none is reached exactly."""
    parts: list[list[Row]] = []
    for run in sorted(runs, key=lambda row: float(row["depth_from_cm"])):
        if not parts or run["depth_from_cm"] - parts[-1][-1]["depth_from_cm"] > SAME_DEPTH_CM:
            parts.append([])
        parts[-1].append(run)
    return parts


def _cell(
    runs: list[Row],
    horizontal: bool,
    confidence: float,
    depths: int,
    spreads: dict[str, Spread],
    told: tuple[str, ...],
) -> dict[str, float | int | str]:
    names = [column(component, quantity) for component in COMPONENTS for quantity in QUANTITIES]
    cell: dict[str, float | int | str] = dict.fromkeys(names, math.nan)
    good = [run for run in runs if math.isfinite(run[column("z")])]
    # a table may hold the stress at all depths of a level motion as one run
    horizontal &= all(run.get("direction", "horizontal") == "horizontal" for run in good)
    own = {run["run_id"]: without(run["flags"], told) for run in runs}
    # "; " stands between the flags of a cell
    flags = [f"{run}: {text.replace('; ', ', ')}" for run, text in own.items() if text]
    here = [flag for flag in told if any(flag in run["flags"].split("; ") for run in good)]
    plates = [flag.partition(",")[0] for flag in here if flag.endswith(SEVERAL_PLATES)]
    if len(plates) > 1:
        here = [flag for flag in here if not flag.endswith(SEVERAL_PLATES)]
        flags.append(f"{POOLED_PLATES}: {', '.join(plates)} (alpha may depend on the size)")
    flags += here
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
    source = spreads["z"].source
    if source == AS_PREPARED and len(good) > 1 and not horizontal:
        source = OF_CELL
    return cell | {
        "n_runs": len(good),
        "run_ids": " ".join(run["run_id"] for run in good),
        **{f"run_to_run_{c}_N_per_cm3": spreads[c].deviation for c in COMPONENTS},
        "spread": source,
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


def directions(table: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """Beta and gamma of the cells of an alpha table, rad, shape (n,)."""
    beta, gamma = (np.radians(table[f"{name}_deg"].to_numpy(float)) for name in ("beta", "gamma"))
    return beta, gamma


def both(table: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """alpha_z and alpha_x of the cells of an alpha table, N/cm^3, shape (n,)."""
    return table[column("z")].to_numpy(float), table[column("x")].to_numpy(float)


def rows_at(
    table: pd.DataFrame, beta_deg: npt.ArrayLike, gamma_deg: npt.ArrayLike
) -> npt.NDArray[np.intp]:
    """Row of an alpha table that is nearest to each direction, shape (k,); -1: none is near."""
    wanted = np.broadcast_arrays(np.atleast_1d(beta_deg), np.atleast_1d(gamma_deg))
    beta, gamma = (table[name].to_numpy(float) for name in ("beta_deg", "gamma_deg"))
    if not beta.size:
        return np.full(wanted[0].shape, -1)
    off = np.maximum(
        np.abs((beta - wanted[0][:, None] + 90) % 180 - 90), np.abs(gamma - wanted[1][:, None])
    )
    return np.where(off.min(axis=1) <= SAME_DIRECTION_DEG, off.argmin(axis=1), -1)


def cell_at(table: pd.DataFrame, beta_deg: float, gamma_deg: float) -> pd.Series[Any] | None:
    """Row of an alpha table for one direction; None where it has none."""
    row = int(rows_at(table, beta_deg, gamma_deg)[0])
    return None if row < 0 else table.iloc[row]
