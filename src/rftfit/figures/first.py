"""Pictures of the page's first screen: a map of alpha, and peaks of legs or, without legs, residuals of fits.

Each is one small panel. Functions with the name of a caption or of what is lacking serve the declaration above a figure
(`rftfit.figures.registry`): they get `Results` and a name of a medium, which is empty here.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags`` (doubts on runs).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.compare.legs import WITHIN_PERCENT
from rftfit.figures import leg_panels, maps, style
from rftfit.figures.labels import PROFILE_NAMES, usable_media
from rftfit.figures.plates import stress_runs
from rftfit.figures.registry import figure, greek, when
from rftfit.figures.traces import STRESS_SETTINGS, by_run, draw_thin, stress_of, with_end_names
from rftfit.measure.verdict_words import NOT_CHECKED

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.results import Results


def _new_panel(title: str) -> tuple[Figure, Axes]:
    """Make a figure of one panel, its letters large enough to be read at the size of the page's first screen."""
    page = style.new_figure(7.0, 6.7)
    side_cm = 4.35
    axes = style.axes_cm(page, 1.25, 0.75, side_cm, side_cm)
    axes.set_title(title, pad=5)
    axes.tick_params(labelsize=7)
    return page, axes


def best_measured_medium(results: Results) -> tuple[str, pd.DataFrame, str]:
    """Choose the medium whose map is shown: the one pushed in most directions, among usable media if there are any.

    With four directions or more on a grid its measured alpha is shown, else the estimated map of the first medium, in
    this order, that has one. Returns its name; the table of alpha or of the map, empty where there is neither; and
    ``measured`` or ``estimated``.
    """
    media = usable_media(results, results.media) or results.media
    direction_counts = {
        name: int(results[name].alpha["alpha_z_N_per_cm3"].notna().sum()) for name in media
    }
    ranked = sorted(direction_counts, key=direction_counts.__getitem__, reverse=True)
    alpha = results[ranked[0]].alpha
    # fewer directions make no map
    fewest_for_map = 4
    if direction_counts[ranked[0]] >= fewest_for_map and maps.lies_on_grid(alpha):
        return ranked[0], alpha, "measured"
    for name in ranked:
        if len(table := results.map_table(name)):
            return name, table, "estimated"
    return ranked[0], alpha[:0], "estimated"


def _map_caption(results: Results, _: str) -> str:
    """Write the caption of the map: signs of the colours, and what good data look like.

    Of an estimated map there is no good or bad, but its pushes are marked.
    """
    signs = (
        "Red: the medium pushes the plate up; blue: it pulls it down. "
        "Hatched: the force does not oppose the vertical motion."
    )
    _, table, origin = best_measured_medium(results)
    if origin == "measured":
        holes = " Crossed grey: no usable run." * maps.has_holes(table, "alpha_z_N_per_cm3")
        gamma = table.loc[table["alpha_z_N_per_cm3"].notna(), "gamma_deg"]
        # the force on a level push is much smaller than on a push a few degrees into the medium
        step = ", but for a step near gamma = 0" * bool(gamma.min() <= 0 < gamma.max())
        return f"{signs}{holes} Good: smooth from cell to cell{step}."
    return f"Estimated from the pushes (circles) and the shape of known media. {signs}"


@figure(
    "first_map",
    reads=("alpha/{media}.csv", "maps/{media}.csv"),
    section="summary",
    caption=_map_caption,
    lacking=lambda results, _: (
        () if len(best_measured_medium(results)[1]) else ("no medium has an alpha to draw",)
    ),
)
def plot_first_map(results: Results) -> Figure:
    """Draw alpha_z of the medium that was pushed in most directions, or its estimate, with the pushes marked.

    With the zero contour, and hatched where the force does not oppose the motion.
    """
    medium, table, origin = best_measured_medium(results)
    page, axes = _new_panel(
        f"{style.medium_label(results, medium)}: {origin} {style.alpha_label('z')}"
    )
    maps.angle_axes(axes)
    values = table["alpha_z_N_per_cm3"]
    maps.add_bar(page, axes, maps.add_table(axes, table, values, signed=True))
    # the last axes are those of the colour bar
    page.axes[-1].tick_params(labelsize=6)
    if maps.lies_on_grid(table):
        maps.add_signs(axes, "z", *maps.cells_of_map(table, "alpha_z_N_per_cm3"))
    if origin == "estimated":
        maps.add_pushes(axes, results[medium].alpha)
        maps.widen_for_marks(page)
    return page


def _select_peaks(results: Results) -> pd.DataFrame:
    """Select measured peaks with those predicted by the measured table or, where the table gives none, by the map.

    Returns rows of ``leg_errors.csv`` in usable media, one for each medium, leg and component.
    """
    errors = results.table("leg_errors.csv")
    errors = errors[errors["medium"].isin(usable_media(results, results.media))]
    rows_with_error = errors[
        errors["peak_error_percent"].notna() & errors["profile"].isin(["table", "map"])
    ]
    # in the order of names "map" is before "table", so the last row is the better one
    return rows_with_error.sort_values("profile").drop_duplicates(
        ["medium", "leg", "component"], keep="last"
    )


def _peaks_caption(results: Results, _: str) -> str:
    """Write the caption of the peaks, with the profiles by which they were predicted."""
    shown_profiles = {*_select_peaks(results)["profile"]}
    shown = [name for profile, name in PROFILE_NAMES.items() if profile in shown_profiles]
    sources = ", or else by the ".join(shown) or PROFILE_NAMES["table"]
    return (
        f"Peak forces on legs, predicted by the {sources}, against measured. Bars: interval of alpha, axle "
        "and arc. Good: points on the line, inside the shade."
    )


@figure(
    "first_peaks",
    reads=("leg_errors.csv",),
    media=when(lambda c: c.with_legs("laboratory") + c.with_legs("natural_sand")),
    section="summary",
    caption=_peaks_caption,
    lacking=lambda results, _: (
        () if len(_select_peaks(results)) else ("no peak of a leg was measured and predicted",)
    ),
)
def plot_first_peaks(results: Results) -> Figure:
    """Draw the predicted peak of lift and of thrust on each leg in each medium against the measured one.

    Both axes are logarithmic and have the same range, so that points on the diagonal agree; the shade is what the paper
    states. A point is a leg in a medium: filled for lift, hollow for thrust, with the interval of the prediction as a
    bar.
    """
    rows = _select_peaks(results)
    page, axes = _new_panel("peak force on a leg")
    # measured, predicted, and the ends of the interval of the predicted one
    names = ["peak_measured_N", *with_end_names("peak_predicted_N")]
    # a negative measured peak is mirrored, so that it can stand on axes of logarithms
    signs = np.sign(rows[names[0]])
    rows = rows.assign(**{name: rows[name] * signs for name in names})
    all_peaks = rows[names].to_numpy(float)
    all_peaks = all_peaks[np.isfinite(all_peaks)]
    smallest = float(rows[names[:2]].abs().to_numpy(float).min())
    # an interval that reaches below a quarter of the smallest peak ends at the frame
    lowest = max(float(all_peaks[all_peaks > 0].min()), smallest / 4) / 1.4
    ends = np.array([lowest, float(all_peaks.max()) * 1.4])
    share = WITHIN_PERCENT / 100
    along = np.geomspace(ends[0], ends[1], 200)
    edges = (np.clip(factor * along, *ends) for factor in (1 - share, 1 + share))
    axes.fill_between(along, *edges, color=style.WINDOW, linewidth=0)
    axes.plot(ends, ends, color="black", linewidth=0.6)
    entries: dict[str, Any] = {}
    # one entry of the legend for each component, with the markers of all legs
    names_of_components = {"z": "lift (filled)", "x": "thrust (hollow)"}
    dots_of_components: dict[str, list[Any]] = {c: [] for c in names_of_components}
    for leg, (colour_name, marker) in leg_panels.leg_looks(leg_panels.leg_order([rows])).items():
        colour = style.OKABE_ITO[colour_name]
        entries[leg_panels.leg_title(leg)] = style.dots(colour, 4, marker=marker)
        for c, fill in (("z", colour), ("x", "white")):
            rows_of_leg = rows[(rows["leg"] == leg) & (rows["component"] == c)]
            measured, peak, low, high = rows_of_leg[names].to_numpy(float).T
            low = np.where(low < lowest, lowest, low)
            axes.vlines(measured, low, high, color=colour, linewidth=0.6, alpha=0.5)
            axes.plot(measured, peak, marker, color=colour, markersize=4, markerfacecolor=fill)
            if len(rows_of_leg):
                dot = style.dots(colour, 4, marker=marker, markerfacecolor=fill)
                dots_of_components[c].append(dot)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.set(xlabel="measured (N)", ylabel="predicted (N)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    for c, name in names_of_components.items():
        if dots_of_components[c]:
            entries[name] = tuple(dots_of_components[c])
    entries[f"within {WITHIN_PERCENT:g} %"] = style.patch(facecolor=style.WINDOW)
    style.legend(page, entries, fontsize=7)
    return page


def _lines_caption(results: Results, _: str) -> str:
    """Write the caption of the residuals; where no check judges linearity, name a run with a bend.

    A run whose stress is no straight line has the flag ``not-linear``; with few runs the check on all of them is not
    made.
    """
    medium = _medium_with_line(results)
    caption = greek(
        "Stress minus alpha times depth, of every run. Good: noise about zero, without a bend."
    )
    bent_runs = results[medium].flags.runs_with("not-linear")
    checks = results.checks
    is_linearity = (checks["medium"] == medium) & (checks["check"] == "linearity")
    reasons = checks.loc[is_linearity & (checks["verdict"] == NOT_CHECKED), "found"]
    if bent_runs and len(reasons):
        run_id, flag = next(iter(bent_runs.items()))
        caption += f" Bent: {run_id}, {flag}; no check judges it ({reasons.iloc[0]})."
    return caption


@figure(
    "first_lines",
    reads=("tared/{media}.parquet", "windows/{media}.parquet", "fits/{media}.csv"),
    settings=(*STRESS_SETTINGS, "fit", "figures"),
    media=when(
        lambda c: (
            not c.with_legs("laboratory") + c.with_legs("natural_sand")
            and c.media_with_samples() == c.media_with_runs
            and stress_runs(c)
        )
    ),
    section="summary",
    caption=_lines_caption,
    lacking=lambda results, _: (
        () if _medium_with_line(results) else ("no run has a line to compare its stress with",)
    ),
)
def plot_first_lines(results: Results) -> Figure:
    """Draw the stress of single runs minus alpha times depth, over the depths that were fitted: residuals of their lines.

    In percent of the largest stress of the medium; a bend shows that stress is not in proportion to depth.
    """
    medium = _medium_with_line(results)
    page, axes = _new_panel(
        f"residual of the vertical stress, {style.medium_label(results, medium)}"
    )
    table = results[medium].fits.set_index("run_id")
    fits = table.loc[table["direction"] != "horizontal", "alpha_z_N_per_cm3"].dropna()
    # depth and stress of each run inside its window, NaN outside of it
    curves = {}
    for run, trace in by_run(stress_of(results, medium)).items():
        inside = trace["in_window"] > 0
        if run in fits.index and inside.any():
            columns = trace["depth_cm"], trace["stress_z_N_per_cm2"]
            curves[run] = [np.where(inside, samples, np.nan) for samples in columns]
    # residuals are relative to the largest stress of all runs: of a run with little stress, noise would fill the panel
    largest_stresses = [float(np.nanmax(np.abs(stress))) for _, stress in curves.values()]
    largest_stress = max(largest_stresses, default=0.0) or 1.0
    look: style.Look = {"color": style.COMPONENT_COLOURS["z"], "linewidth": 0.6, "alpha": 0.6}
    for run, (depth, stress) in curves.items():
        percent = 100 * (stress - fits[run] * depth) / largest_stress
        draw_thin(axes, depth, percent, **look)
    style.zero_line(axes)
    axes.set(xlabel="depth (cm)", ylabel="residual (% of the largest stress)")
    return page


def _medium_with_line(results: Results) -> str:
    """Return the first medium with a run, not a horizontal one, that has a fitted line; empty where there is none.

    A horizontal run stays at one depth: its fit is no line over depth.
    """
    for name in usable_media(results, results.media) or results.media:
        fits = results[name].fits
        if (fits["alpha_z_N_per_cm3"].notna() & (fits["direction"] != "horizontal")).any():
            return name
    return ""
