"""What captions say about the measurement: runs, rows, slopes, cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.page import tables
from rftfit.page.tables import leg_name, row_fates, run_fates, value
from rftfit.report.captions.words import chosen, escaped, half_widths, quantile, rst

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.page.page import PageInputs
    from rftfit.report.captions.words import Row


def summary(inputs: PageInputs, medium: str = "", role: str = "") -> list[Row]:
    """Rows of the page's first table: runs used and dropped, zeta, chi, peak errors, worst flag.

    `medium`: This one alone. `role`: Media of this role alone.
    """
    rows = []
    for row in tables.summary(inputs):
        if medium in ("", row["key"]) and role in ("", row["role"]):
            peaks = {leg_name(leg): error for leg, error in row["peaks"].items()}
            rows.append(escaped(row | {"peaks": peaks}))
    return rows


def fates(inputs: PageInputs) -> Row:
    """Count runs and rows used and dropped, and name the dropped runs with their reasons.

    Returns ``runs_used, runs_dropped, rows_used, rows_dropped, dropped``.
    """
    used, dropped = run_fates(inputs.ledger)
    rows = {"used": 0, "dropped": 0}
    for found in row_fates(inputs.ledger):
        rows[str(found["fate"])] += int(str(found["rows"]))
    return {
        "runs_used": sum(used.values()),
        "runs_dropped": len(dropped),
        "rows_used": rows["used"],
        "rows_dropped": rows["dropped"],
        "dropped": [{"run_id": rst(run.run_id), "reasons": rst(run.reasons)} for run in dropped],
    }


def slopes(inputs: PageInputs, medium: str = "", role: str = "") -> Row:
    """Sum up the plate runs of a medium, or of all media of one role.

    Returns ``runs, good`` (with an alpha)``, half`` (median half width of the intervals,
    N/cm^3)``, slanted`` (runs that change depth)``, bend, bend_most`` (median and 95th percentile
    of the departure of a parabola from the line at the end of the window, in vertical stress,
    %)``, doubts`` (runs flagged as not linear).
    """
    own = chosen(inputs.fits, inputs, medium, role)
    if own.empty:
        return dict.fromkeys(("runs", "good", "slanted", "doubts"), 0) | dict.fromkeys(
            ("half", "bend", "bend_most"), value(None)
        )
    bend = 100 * np.abs(own["nonlinear_z_ratio"].to_numpy(float))
    return {
        "runs": len(own),
        "good": int(own["alpha_z_N_per_cm3"].notna().sum()),
        "half": quantile(half_widths(own), 0.5, 4),
        "slanted": int(np.isfinite(bend).sum()),
        "bend": quantile(bend, 0.5, 1),
        "bend_most": quantile(bend, 0.95, 1),
        "doubts": int(own["flags"].map(lambda flag: "not linear" in str(flag)).sum()),
    }


def slopes_of(inputs: PageInputs, runs: Iterable[str]) -> list[Row]:
    """Slopes of runs with the half widths of their intervals.

    Returns ``run_id, beta, gamma`` (as filed, degrees)``, z, x`` (N/cm^3).
    """
    own = inputs.fits[inputs.fits["run_id"].astype(str).isin(list(runs))]
    half = half_widths(own)
    rows = []
    for i, row in enumerate(own.to_dict("records")):
        found = {"run_id": rst(str(row["run_id"]))}
        found |= {name: value(row[f"{name}_deg"], 0) for name in ("beta", "gamma")}
        for c, width in zip("zx", half[:, i], strict=True):
            margin = f" \N{PLUS-MINUS SIGN} {value(width, 4)}" if np.isfinite(width) else ""
            found[c] = value(row[f"alpha_{c}_N_per_cm3"], 4) + margin
        rows.append(found)
    return rows


def cells(inputs: PageInputs, medium: str = "", role: str = "laboratory") -> list[Row]:
    """Sum up alpha tables.

    Returns ``title, good, all`` (cells)``, low, high`` (extremes of alpha_z, N/cm^3)``, half``
    (median half width of the intervals, N/cm^3).
    """
    media = inputs.config.media
    rows = []
    for name in inputs.media:
        if medium not in ("", name) or role not in ("", media[name].role):
            continue
        table = inputs.alpha[name]
        alpha = table["alpha_z_N_per_cm3"].to_numpy(float)
        rows.append(
            {
                "title": rst(media[name].title),
                "good": int(np.isfinite(alpha).sum()),
                "all": len(table),
                "low": quantile(alpha, 0.0, 3),
                "high": quantile(alpha, 1.0, 3),
                "half": quantile(half_widths(table), 0.5, 4),
            }
        )
    return rows
