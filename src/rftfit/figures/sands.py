"""Figure of the penetration of natural sands: stress against depth and the fit of its linear part.

A penetration test is a run of a flat plate straight down. Stress is in proportion to depth only to some depth, the
linear regime. Its line through zero is fitted twice, over a window of depth that is ``stated`` in the config, and over
one whose end was ``detected``; each fit is a row of ``results/sands.csv``.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import labels, style
from rftfit.figures.registry import figure, when
from rftfit.figures.traces import STRESS_SETTINGS, by_run, stress_of, with_end_names
from rftfit.measure.flags import has

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.figures.traces import Row, Trace
    from rftfit.results import Results

_FIT_COLUMNS = [*with_end_names("alpha_z_N_per_cm3"), "linear_to_cm"]
"""Columns of ``results/sands.csv``: alpha, the ends of its interval, and the end of the window of the fit."""

_FITS: dict[str, tuple[str, Any]] = {
    "stated": (style.OKABE_ITO["vermillion"], style.DASHES["dash-dotted"]),
    "detected": (style.OKABE_ITO["bluish green"], style.DASHES["dashed"]),
}
"""Colour and line of the fit over each window."""


@figure(
    "penetration",
    reads=("tared/{sands}.parquet", "windows/{sands}.parquet", "fits/{sands}.csv", "sands.csv"),
    settings=(*STRESS_SETTINGS, "fit"),
    media=when(lambda campaign: campaign.of_role("natural_sand")),
    paper="Fig. S11",
    section="Natural sands",
    caption=lambda results, _: (
        "A flat plate pushed down into each natural sand, fitted through zero over the linear regime. "
        f"Intervals, by each push alone: {labels.beds_of_intervals(results, results.sands)}. Good: the stress follows its line to the end of the window."
    ),
    lacking=lambda results, _: (
        ()
        if results.table("sands.csv")["alpha_z_N_per_cm3"].notna().any()
        else (
            "no penetration test has a slope",
            *dict.fromkeys(results.table("sands.csv")["reason"]),
        )
    ),
)
def plot_penetration(results: Results) -> Figure:
    """Draw the stress on a plate pushed straight down into each sand against depth, with its fits; one panel a sand."""
    table, media = results.table("sands.csv"), results.sands
    most_in_row = 3
    page, panels = style.panels_in_rows(len(media), most_in_row, 7.3, 6.1)
    for i, (medium, axes) in enumerate(zip(media, panels, strict=True)):
        # run_id to window (stated, detected) to the row of the fit
        fits_by_run: dict[str, dict[str, Row]] = {}
        for fit in table[table["medium"] == medium].to_dict("records"):
            fits_by_run.setdefault(str(fit["run_id"]), {})[str(fit["window"])] = fit
        runs = by_run(stress_of(results, medium))
        tests = list(fits_by_run.values()) or [{}]
        _draw_panel(axes, [trace for run, trace in runs.items() if run in fits_by_run], tests)
        axes.set_xlabel("depth (cm)")
        if i % most_in_row == 0:
            axes.set_ylabel(f"vertical stress $\\sigma_z$ ({style.PER_CM2})")
        axes.set_title(style.plain(results[medium].title), weight="bold", loc="left")
    entries: dict[str, Any] = style.list_labelled(page)
    with_interval = {*table.dropna(subset=_FIT_COLUMNS[1])["window"]}
    colours_of_bands = [colour for name, (colour, _) in _FITS.items() if name in with_interval]
    if colours_of_bands:
        entries[f"{style.level(results)} interval of alpha"] = style.bands(colours_of_bands)
    style.legend(page, entries, handlelength=2.2, borderaxespad=0.25)
    return page


def _draw_panel(axes: Axes, runs: Sequence[Trace], tests: Sequence[Mapping[str, Row]]) -> None:
    """Draw the penetration tests of one sand: measured stress over depth, and the fits with their intervals.

    `runs`: Samples of the tests, without those that were refused. `tests`: For each test its fits by window, ``stated``
    or ``detected``; one empty test where there is none. What is drawn gets its label for the legend.
    """
    # measured depth and stress of each test, shape (n, 2); depths inside the windows of all tests
    lines, depths_in_window = [], []
    for trace in runs:
        points = np.column_stack([trace["depth_cm"], trace["stress_z_N_per_cm2"]])
        is_drawn = np.isfinite(points).all(axis=1) & (points[:, 0] >= 0)
        lines.append(points[is_drawn])
        depths_in_window += [*points[is_drawn & (trace["in_window"] > 0), 0]]
        axes.plot(*lines[-1].T, color=style.COMPONENT_COLOURS["z"], linewidth=0.9, label="measured")
    depth, stress = np.concatenate([np.empty((0, 2)), *lines]).T
    nothing = "no stress in this test" if runs else "no penetration test"
    missing = [] if depth.size else [nothing]
    stated_cm = max(_number_of(fits.get("stated"), "linear_to_cm") for fits in tests)
    fit_ends = [_number_of(fit, "linear_to_cm") for fits in tests for fit in fits.values()]
    ends = [end for end in (*depth, *fit_ends) if np.isfinite(end)]
    max_depth = max(ends) if depth.size else 1.2 * max([*ends, 1.0])
    if np.isfinite(stated_cm):
        window = depths_in_window or [0, stated_cm]
        axes.axvspan(
            min(window), max(window), color=style.WINDOW, linewidth=0, label="stated window"
        )
    highest_stresses = [float(stress.max())] if stress.size else []
    drawn_fits: set[str] = set()
    for fits, (name, (colour, dashes)) in itertools.product(tests, _FITS.items()):
        alpha, low, high, to_cm = (_number_of(fits.get(name), key) for key in _FIT_COLUMNS)
        if not np.isfinite(alpha):
            continue
        drawn_fits.add(name)
        end = to_cm if np.isfinite(to_cm) else max_depth
        style.draw_band(axes, [0, end], [0, low * end], [0, high * end], colour)
        # beyond its window the line of the fit is thin
        for depths, width in (([0, end], 1.1), ([end, max_depth], 0.5)):
            stresses = alpha * np.array(depths)
            look: style.Look = {"color": colour, "linestyle": dashes, "linewidth": width}
            axes.plot(depths, stresses, label=f"fit through zero, {name}", **look)
        highest_stresses += [alpha * end, *([high * end] if np.isfinite(high) else [])]
        if name == "detected" and np.isfinite(to_cm) and not _is_linear_to_its_end(fits[name]):
            axes.axvline(to_cm, color=colour, linestyle=":", linewidth=0.9, label="detected end")
    fit_names = [name for name in _FITS if any(name in fits for fits in tests)]
    missing += [f"no fit over the {name} window" for name in fit_names if name not in drawn_fits]
    highest = 1.06 * max(highest_stresses) if highest_stresses else 1.0
    axes.set(xlim=(0, max_depth), ylim=(stress.min(initial=0.0), highest))
    style.ticks(axes.xaxis, 6, steps=[1, 2, 5, 10])
    if not highest_stresses:
        axes.set_yticks([])
    if missing:
        style.write_note(axes, "\n".join(missing))


def _is_linear_to_its_end(fit: Row) -> bool:
    """Return True if the test ended before its linear regime did, so that no end of the regime was detected."""
    return has(fit, "no-linear-end")


def _number_of(fit: Row | None, name: str) -> float:
    """Return a number of a fit, by its column; NaN where there is no fit over the window."""
    return float("nan") if fit is None else float(fit[name])
