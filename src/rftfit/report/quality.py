"""Quality sheets: every plate run of a medium as a small panel, bad ones marked, on A3 paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import style
from rftfit.report.drawing import FIT, LEFT, STRESS, WINDOW, Sheet
from rftfit.report.runs import by_run, filed, trouble
from rftfit.report.sheet import lay_out

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_COLUMNS = [
    "depth_cm", "path_cm", "in_window",
    *(f"{name}_{c}_N_per_cm2" for name, c in STRESS),
]  # fmt: skip


def _legend(sheet: Sheet) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    names = {
        ("stress", "z"): "tared vertical stress (z)",
        ("stress", "x"): "tared horizontal stress (x)",
        ("tare", "z"): "rod tare as stress (z)",
        ("tare", "x"): "rod tare as stress (x)",
    }
    entries: dict[str, Line2D | Patch] = {
        name: Line2D([], [], color=STRESS[key][0], linewidth=1.2) for key, name in names.items()
    }
    entries["fit through zero"] = Line2D([], [], color=FIT[0], linewidth=0.8, linestyle=(0, (5, 4)))
    entries["fit window"] = Patch(facecolor=WINDOW)
    entries["flagged or without alpha"] = Patch(
        facecolor="none", edgecolor=style.MARK, linewidth=1.4
    )
    place = (LEFT / sheet.paper[0], 0.12 / sheet.paper[1])
    sheet.figure.legend(
        list(entries.values()), list(entries), loc="lower left", bbox_to_anchor=place,
        ncols=len(entries), fontsize=7.5, borderaxespad=0, columnspacing=1.3,
    )  # fmt: skip
    text = (
        f"Across each panel: depth from 0 to {sheet.reach[0]:g} cm (horizontal runs: path from 0 to "
        f"{sheet.reach[1]:g} cm). Up: stress, from the panel's bottom to its top as written in it. "
        "α in N/cm³. "  # noqa: RUF001
        "Extractions as filed."
    )
    sheet.axes.text(LEFT, -sheet.paper[1] + 1.05, text, fontsize=7.5, va="center")


@style.styled
def _notes(fits: pd.DataFrame) -> str:
    """List the notes on runs, each with the number of runs that carry it."""
    if "note" not in fits.columns:
        return ""
    counts = fits["note"].replace("", np.nan).dropna().value_counts().sort_index()
    return "; ".join(f"{count} runs: {note}" for note, count in counts.items())


def draw_quality(traces: pd.DataFrame, fits: pd.DataFrame, medium_title: str) -> list[Figure]:
    """Draw the quality sheets of one medium: a panel for each plate run, ordered by beta and gamma.

    Each panel shows the tared stress, the rod's tare as stress, the fit window and the fit; its
    vertical scale is its own and printed in it. A run that is flagged or has no alpha has
    a red frame and says why. Extractions are drawn as filed (`rftfit.report.runs.filed`).

    Parameters
    ----------
    traces : pandas.DataFrame
        Samples in the lab frame, in time order within a run: ``run_id, depth_cm,
        stress_z_N_per_cm2, stress_x_N_per_cm2, tare_z_N_per_cm2, tare_x_N_per_cm2, in_window``
        and, for horizontal runs, ``path_cm``. A run of `fits` without samples has an empty panel.
    fits : pandas.DataFrame
        Fit table of the medium.
    medium_title : str

    Returns
    -------
    list of matplotlib.figure.Figure
        Pages of at most 15 by 7 runs; repeated runs stand on pages of their own.
    """
    fits = fits.assign(run_id=fits["run_id"].astype(str))
    samples = by_run(filed(traces, fits), _COLUMNS)
    rows = fits.drop_duplicates("run_id").set_index("run_id", drop=False)
    flat = set(rows.index[rows["direction"] == "horizontal"])
    depth = rows["depth_from_cm"].astype(float)
    for run in flat & set(samples):
        finite = samples[run]["depth_cm"][np.isfinite(samples[run]["depth_cm"])]
        if np.isnan(depth[run]) and finite.size:
            depth[run] = float(np.median(finite))
    ends = {True: [1.0], False: [1.0]}
    for run, trace in samples.items():
        values = trace["path_cm" if run in flat and "path_cm" in trace else "depth_cm"]
        ends[run in flat].append(float(values[np.isfinite(values)].max(initial=0.0)))
    reach = float(np.ceil(max(ends[False]))), float(np.ceil(max(ends[True])))
    pages = lay_out(rows.reset_index(drop=True), depth)
    fit_of = {str(fit["run_id"]): fit for fit in rows.to_dict("records")}
    marked = sum(bool(trouble(fit)) for fit in fit_of.values())
    title = f"{medium_title}: {len(rows)} plate runs, {marked} marked"
    figures = []
    for i, page in enumerate(pages):
        sheet = Sheet(page, reach)
        for run, place in page.places.items():
            sheet.panel(place, samples.get(run, {}), fit_of[run])
        sheet.empty_places()
        _legend(sheet)
        figures.append(
            sheet.finish(
                title + (f" (page {i + 1} of {len(pages)})" if pages[1:] else ""), _notes(rows)
            )
        )
    return figures
