"""Figures of forces on legs: in one medium, in all media, divided by zeta, and errors of their peaks.

Tables of forces are those of `rftfit.figures.leg_panels`: a row for each angle theta of a leg in a medium, predicted or
measured. A profile is what alpha a prediction used: ``table`` (measured), ``map``, ``fourier`` (nine terms),
``generic`` (scaled by zeta), ``depth_only``. `c` or `component`: ``z`` (vertical, lift) or ``x`` (horizontal, thrust).
Each predicted force has an interval by the errors of alpha, axle and arc; a wider one adds the error of the force model
itself.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium.
"""

from __future__ import annotations

import itertools
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import labels, leg_panels, style
from rftfit.figures.leg_panels import PROFILE_LOOKS, PROFILE_TITLES, matching_rows
from rftfit.figures.maps import why_no_fit
from rftfit.figures.registry import figure, when
from rftfit.figures.traces import with_end_names
from rftfit.forces.peaks import STEEP

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.campaign.load import Campaign
    from rftfit.conventions import FloatArray
    from rftfit.figures.traces import Row
    from rftfit.results import Results


def _media_with_legs(campaign: Campaign) -> tuple[str, ...]:
    """List the laboratory media in which legs were turned."""
    return campaign.with_legs("laboratory")


# One medium, by every model


DRAWN_PROFILES = ("table", "map", "fourier", "depth_only")
"""Profiles whose predictions the figure of one medium shows."""

_FORCE_LABELS = r"vertical force $F_z$ (N)", r"horizontal force $F_x$ (N)"
"""Labels of the rows of z and of x."""


def _legs_caption(results: Results, medium: str) -> str:
    """Write the caption, with the insets where depth-only predicts a curve."""
    insets = ""
    if medium in labels.predicted_by(results).get("depth_only", ()):
        insets = " Insets: the same with the depth-only model."
    return (
        f"Forces on the legs turned through {results.titles[medium]}: dots measured, lines predicted.{insets} "
        "Good: lines run through the dots, and the dots lie in the palest band."
    )


@figure(
    "legs",
    reads=("predicted.csv", "legs/{media}.csv"),
    settings=("fit", "intruders"),
    media=lambda campaign: _media_with_legs(campaign)[:1],
    paper="Figs. 3D to 3F",
    section="Legs",
    caption=_legs_caption,
)
def plot_legs(results: Results, medium: str) -> Figure:
    """Draw F_z and F_x on each leg in one medium against theta, measured and predicted, below a sketch of the leg."""
    predicted, measured = (
        matching_rows(table, medium=medium) for table in leg_panels.read_curves(results)
    )
    shapes = results.config.legs
    page, panels = style.panels((3.3, 6.1, 6.1), len(shapes))
    page.suptitle(style.plain(results[medium].title), x=0.01, ha="left", weight="bold")
    for i, (leg, shape) in enumerate(shapes.items()):
        sketch, *force_axes = panels[:, i]
        tag = f"{'ABC'[i]}  " if len(shapes) <= 3 else ""
        sketch.set_title(tag + leg_panels.leg_title(leg), loc="left")
        leg_panels.add_sketch(sketch, shape)
        predicted_curves = matching_rows(predicted, leg=leg)
        measured_curve = matching_rows(measured, leg=leg)
        for axes, component in zip(force_axes, "zx", strict=True):
            leg_panels.theta_axes(axes, is_last_row=component == "x")
            _draw_models(axes, predicted_curves, measured_curve, component)
    for axes, label in zip(panels[1:, 0], _FORCE_LABELS, strict=True):
        axes.set_ylabel(label)
    style.legend(
        page, _make_model_entries(results, predicted, measured), handlelength=2.4, columnspacing=1.1
    )
    return page


def _make_model_entries(
    results: Results, predicted: pd.DataFrame, measured: pd.DataFrame
) -> dict[str, Any]:
    """Make the entries of the legend for the curves of several models that are drawn in `plot_legs`.

    `predicted`, `measured`: Forces on all legs in the medium.
    """
    entries: dict[str, Any] = {}
    if any(leg_panels.has_force(measured, c) for c in "zx"):
        entries["measured"] = style.dots(leg_panels.MEASURED, 2, markeredgewidth=0)
    colours = []
    for profile in DRAWN_PROFILES:
        rows = matching_rows(predicted, profile=profile)
        if not any(leg_panels.has_force(rows, c) for c in "zx"):
            continue
        colour, line, _ = PROFILE_LOOKS[profile]
        inset_note = " (inset)" if profile == "depth_only" else ""
        title = f"predicted by {PROFILE_TITLES[profile]}{inset_note}"
        entries[title] = style.line(colour, linestyle=line)
        colours.append(colour)
    if colours:
        entries[leg_panels.name_of_interval(results)] = style.bands(colours)
    profile = _profile_with_both_bands(predicted)
    rows = matching_rows(predicted, profile=profile)
    if any(leg_panels.has_model_error(rows, c) for c in "zx"):
        name = f"{PROFILE_TITLES[profile]}, with the model's own error"
        entries[name] = style.band(style.WIDER_OPACITY, PROFILE_LOOKS[profile][0])
    return entries


def _profile_with_both_bands(predicted: pd.DataFrame) -> str:
    """Choose the profile whose interval with the model's own error is drawn, too: one alone, so that bands stay readable.

    The map if there is one, since it stands in where the table has holes.
    """
    return "map" if predicted["profile"].eq("map").any() else "table"


def _draw_models(axes: Axes, predicted: pd.DataFrame, measured: pd.DataFrame, c: str) -> None:
    """Draw component `c` of the force on a leg: measured, and predicted by all profiles; by depth-only in an inset.

    `predicted`, `measured`: Forces on this leg. The inset has a range of its own, as depth-only forces may be far
    larger.
    """
    notes, drawn_forces = [], []
    dots: style.Look = {"color": leg_panels.MEASURED, "markeredgewidth": 0}
    measured_curve = leg_panels.with_gaps(measured, f"force_{c}_N")
    if leg_panels.has_force(measured, c):
        axes.plot(*measured_curve, "o", markersize=1.3, **dots)
        drawn_forces.append(measured_curve[1])
    else:
        notes.append("not measured" + leg_panels.why_missing(measured))
    baseline = matching_rows(predicted, profile="depth_only")
    for profile in DRAWN_PROFILES:
        rows = matching_rows(predicted, profile=profile)
        if profile == "map" and rows.empty:
            continue  # a medium that was pushed in every direction needs no map
        if not leg_panels.has_force(rows, c):
            reason = leg_panels.why_missing(rows)
            notes.append(f"{PROFILE_TITLES[profile]}: no prediction{reason}")
        elif profile != "depth_only":
            model = "band" if profile == _profile_with_both_bands(predicted) else ""
            colour, line, _ = PROFILE_LOOKS[profile]
            drawn_forces.append(leg_panels.add_predicted(axes, rows, c, colour, line, model=model))
    has_inset = leg_panels.has_force(baseline, c)
    # shares of the panel that the inset covers, and the labels below it
    wide, high, labels_high = 0.36, 0.27, 0.12
    # what the notes and curves must leave free (`leg_panels.force_range`)
    room = (high + labels_high, 1 - wide) if has_inset and drawn_forces else (0, 1)
    leg_panels.force_range(axes, drawn_forces, notes, room)
    if has_inset:
        small = axes.inset_axes((0.98 - wide, 0.98 - high, wide, high))
        small.plot(*measured_curve, "o", markersize=0.9, **dots)
        leg_panels.add_predicted(small, baseline, c, *PROFILE_LOOKS["depth_only"][:2])
        small.set(xlim=leg_panels.THETA_DEG, xticks=[-90, 0, 90])
        style.ticks(small.yaxis, 3)
        small.tick_params(labelsize=5, pad=1, length=1.5)
        small.set_xlabel(r"$\theta$ (deg)", fontsize=5, labelpad=0.5)
        small.set_ylabel(f"$F_{c}$ (N)", fontsize=5, labelpad=0.5)


# All media, one row each


_LINES: dict[str, Any] = {"z": style.DASHES["solid"], "x": style.DASHES["dashed"]}
_DOTTED: dict[str, Any] = dict.fromkeys("zx", style.DASHES["dotted"])
"""Dashes by component of a predicted force, and of one by the depth-only model."""

_CURVES: dict[str, Any] = {
    "reads": ("predicted.csv", "legs/{media}.csv", "leg_errors.csv"),
    "settings": ("fit",),
}
"""Fields of the declarations of figures with one row a medium."""


@figure(
    "legs_by_medium",
    **_CURVES,
    media=when(lambda campaign: _media_with_legs(campaign)[1:]),
    paper="Fig. S5",
    section="Legs",
    caption=(
        "Forces on the legs in the laboratory media. Good: lines, predicted, run through the dots. Bands: the interval of the force at each "
        "angle; that of the peak is in the table."
    ),
)
def plot_legs_by_medium(results: Results) -> Figure:
    """Draw F_z and F_x on every leg in every laboratory medium, measured and predicted."""
    return _draw_media(results, results.laboratory, "table")


@figure(
    "legs_depth_only",
    **_CURVES,
    media=when(lambda campaign: _media_with_legs(campaign)[1:]),
    paper="Fig. S2",
    section="Legs",
    caption=(
        "Measured forces on the legs (dots) beside the depth-only model (dotted), the baseline, which knows depth and "
        "projected area but no angle. It has steps where an element turns from pushing down to moving up."
    ),
)
def plot_legs_depth_only(results: Results) -> Figure:
    """Draw measured F_z and F_x on every leg in every laboratory medium beside the depth-only model."""
    return _draw_media(results, results.laboratory, "depth_only")


@figure(
    "legs_in_sands",
    **_CURVES,
    media=when(lambda campaign: campaign.with_legs("natural_sand")),
    paper="Fig. S12",
    section="Natural sands",
    caption=(
        "Forces on the legs in the natural sands, predicted from the pushes into each. Good: lines run through the dots. "
        "Dotted: the paper's scaling routine."
    ),
)
def plot_legs_in_sands(results: Results) -> Figure:
    """Draw F_z and F_x on every leg in every natural sand, measured and predicted."""
    return _draw_media(results, results.sands, "map", "generic")


_SECOND_PROFILE: dict[str, Any] = {"linestyle": style.DASHES["dotted"], "linewidth": 0.8}
"""Look of a force by the second profile of a figure."""


def _draw_media(
    results: Results, media: Sequence[str], profile: str, second_profile: str = ""
) -> Figure:
    """Draw forces by one profile with intervals and, dotted, by a second one if there is one; one row of panels a medium.

    `profile`, `second_profile`: Keys of profiles; empty for no second one.
    """
    predicted, measured = (
        table[table["medium"].isin(list(media))] for table in leg_panels.read_curves(results)
    )
    tables = [
        matching_rows(predicted, profile=profile),
        measured,
        matching_rows(predicted, profile=second_profile),
    ]
    peaks = matching_rows(results.table("leg_errors.csv"), profile=profile)
    lines = _DOTTED if profile == "depth_only" else _LINES
    names = leg_panels.leg_order(tables[:2])
    page, panels = style.panels([4.0] * len(media), len(names))
    any_withheld = False
    for leg, axes in zip(names, panels[0], strict=True):
        axes.set_title(leg_panels.leg_title(leg), weight="bold", loc="left")
    for medium, row in zip(media, panels, strict=True):
        row[0].set_ylabel("force (N)")
        # aligns the labels of all rows; align_ylabels would take as long as drawing the panels
        row[0].yaxis.set_label_coords(-0.14, 0.5)
        style.name_row(row[0], style.plain(results[medium].title))
        for leg, axes in zip(names, row, strict=True):
            leg_panels.theta_axes(axes, is_last_row=medium == media[-1])
            tables_of_leg = [matching_rows(table, medium=medium, leg=leg) for table in tables]
            peak_rows = matching_rows(peaks, medium=medium, leg=leg)
            # `STEEP`: the force changes with the attack angle faster than the interval of alpha between pushes allows; this
            # withholds the interval of the peak, and so that along the curve
            is_steep = [STEEP in codes.split() for codes in peak_rows["reason_code"]]
            withheld = {*peak_rows.loc[is_steep, "component"]}
            _draw_leg(axes, tables_of_leg, lines, withheld)
            any_withheld |= bool(withheld)
    profiles = profile, second_profile
    entries = _make_component_entries(results, tables, lines, profiles, any_withheld)
    style.legend(page, entries, handlelength=2.4)
    return page


def _make_component_entries(
    results: Results,
    tables: Sequence[pd.DataFrame],
    lines: Mapping[str, Any],
    profiles: tuple[str, str],
    any_withheld: bool,
) -> dict[str, Any]:
    """Make the entries of the legend for the curves of two components that are drawn.

    `tables`, `lines`: As for `_draw_leg`. `profiles`: The profile, and the second one. `any_withheld`: True where a
    curve is drawn without its interval.
    """
    predicted, measured, second_predicted = tables
    entries: dict[str, Any] = {}
    for c, word in (("z", "vertical force $F_z$"), ("x", "horizontal force $F_x$")):
        if leg_panels.has_force(measured, c):
            dots = style.dots(style.PALE_COLOURS[c], 2, markeredgewidth=0)
            entries[f"{word}, measured"] = dots
        if leg_panels.has_force(predicted, c):
            line = style.line(style.COMPONENT_COLOURS[c], linestyle=lines[c])
            entries[f"{word}, predicted by {PROFILE_TITLES[profiles[0]]}"] = line
        if leg_panels.has_force(second_predicted, c):
            line = style.line(style.COMPONENT_COLOURS[c], **_SECOND_PROFILE)
            entries[f"{word}, by {PROFILE_TITLES[profiles[1]]}"] = line
    colours = [style.COMPONENT_COLOURS[c] for c in "zx" if leg_panels.has_force(predicted, c)]
    if colours:
        name = f"{leg_panels.name_of_interval(results)} at each angle"
        name += "; none where that of the peak is withheld" * any_withheld
        entries[name] = style.bands(colours)
    edges = [
        style.line(style.COMPONENT_COLOURS[c], linestyle=lines[c], **leg_panels.MODEL_EDGE)
        for c in "zx"
        if leg_panels.has_model_error(predicted, c)
    ]
    if edges:
        entries["with the model's own error"] = tuple(edges)
    return entries


def _draw_leg(
    axes: Axes, tables: Sequence[pd.DataFrame], lines: Mapping[str, Any], withheld: Collection[str]
) -> None:
    """Draw the forces on one leg in one medium.

    `tables`: Rows predicted, measured, and predicted by the second profile. `lines`: Dashes by component. `withheld`:
    Components whose interval of alpha is not known.
    """
    predicted, measured, second_predicted = tables
    drawn_forces, notes = [], []
    for table, lack in ((measured, "not measured"), (predicted, "no prediction")):
        missing = [c for c in "zx" if not leg_panels.has_force(table, c)]
        if missing:
            component = "" if len(missing) == 2 else f"$F_{missing[0]}$: "
            notes.append(f"{component}{lack}{leg_panels.why_missing(table)}")
    for c in "zx":
        if leg_panels.has_force(measured, c):
            theta, force = leg_panels.with_gaps(measured, f"force_{c}_N")
            axes.plot(
                theta, force, "o", color=style.PALE_COLOURS[c], markersize=1.5, markeredgewidth=0
            )
            drawn_forces.append(force)
    for c in "zx":
        colour = style.COMPONENT_COLOURS[c]
        if leg_panels.has_force(predicted, c):
            has_band = c not in withheld
            drawn_forces.append(
                leg_panels.add_predicted(
                    axes, predicted, c, colour, lines[c], model="edges", of_alpha=has_band
                )
            )
        if leg_panels.has_force(second_predicted, c):
            theta, force = leg_panels.with_gaps(second_predicted, f"force_{c}_N")
            axes.plot(theta, force, color=colour, **_SECOND_PROFILE)
            drawn_forces.append(force)
    leg_panels.force_range(axes, drawn_forces, notes)


# All media over zeta, with the generic prediction


def _without_zeta(results: Results, _: str) -> Sequence[str]:
    """Say why forces cannot be compared over zeta by the configured method (``fourier.method``); empty where they can.

    Two laboratory media with a zeta are needed.
    """
    penetration = labels.of_method(results, "penetration.csv")
    if reasons := why_no_fit(results, penetration, "zeta"):
        method = results.config.fourier.method
        return f"no zeta by {method}, so forces cannot be scaled", *reasons
    if len({*penetration.dropna(subset="zeta")["medium"]} & {*results.laboratory}) > 1:
        return ()
    return ("one medium alone has a zeta: over it the forces are the generic ones themselves",)


@figure(
    "forces_over_zeta",
    reads=("predicted.csv", "legs/{media}.csv", "penetration.csv"),
    settings=("fit", "fourier"),
    media=when(_media_with_legs),
    paper="Fig. S8",
    section="Legs",
    caption=(
        "Measured forces over zeta in the laboratory media. Good: all curves fall together, on the black generic "
        "prediction. Together but off it: the scaling holds, and the nine terms do not."
    ),
    lacking=_without_zeta,
)
def plot_forces_over_zeta(results: Results) -> Figure:
    """Draw measured force over zeta of all laboratory media on each leg against theta, with the generic prediction.

    Zeta is taken as exact. The generic curve is the mean over media of the scaled prediction over zeta, which is the
    same curve in each; its band is the widest of the intervals of the media.
    """
    penetration = labels.of_method(results, "penetration.csv").set_index("medium")
    positive_zeta: Any = penetration["zeta"].where(penetration["zeta"] > 0).astype(float)
    zetas: dict[str, float] = positive_zeta.to_dict()
    predicted, measured = (
        table[table["medium"].isin(list(zetas))] for table in leg_panels.read_curves(results)
    )
    predicted = matching_rows(predicted, profile="generic")
    names = leg_panels.leg_order((predicted, measured))
    page, panels = style.panels((5.3, 5.3), len(names))
    for leg, column in zip(names, panels.T, strict=True):
        column[0].set_title(leg_panels.leg_title(leg), weight="bold")
        for component, axes in zip("zx", column, strict=True):
            leg_panels.theta_axes(axes, is_last_row=component == "x")
            generic = _generic_curve(matching_rows(predicted, leg=leg), component, zetas)
            _draw_scaled(axes, results, generic, matching_rows(measured, leg=leg), component, zetas)
    for component, axes in zip("zx", panels[:, 0], strict=True):
        axes.set_ylabel(rf"$F_{component}$ / $\zeta$ (N)")
    style.legend(page, style.list_labelled(page), handlelength=2.6)
    return page


def _choose_line_looks(media: Iterable[str]) -> dict[str, style.Look]:
    """Choose colour and dashes of the curve of each medium, in the order of `media`."""
    dashes = itertools.cycle(style.DASHES.values())
    return {
        medium: {"color": colour, "linestyle": next(dashes)}
        for medium, (colour, _) in style.medium_looks(media).items()
    }


def _generic_curve(predicted: pd.DataFrame, c: str, zetas: Mapping[str, float]) -> list[FloatArray]:
    """Return theta, degrees, the generic force over zeta, and the ends of its widest interval; empty without prediction.

    An interval that is not known where the force is largest is left out: its pieces elsewhere would look like a narrow
    one. `predicted`: Forces by the generic profile on one leg, in all media. `zetas`: Zeta by medium, NaN for none. All
    four arrays have shape (angles,).
    """
    names = with_end_names(f"force_{c}_N")
    scaled = predicted[names].div(predicted["medium"].map(dict(zetas)), axis="index")
    scaled = scaled.dropna(subset=names[0]).join(predicted["theta_deg"])
    if scaled.empty:
        return []
    aggregates = dict(zip(names, ("mean", "min", "max"), strict=True))
    by_theta = scaled.groupby("theta_deg").agg(aggregates)
    force, low, high = by_theta.to_numpy(float).T
    if not np.isfinite((high - low)[np.abs(force).argmax()]):
        low, high = np.full((2, len(force)), np.nan)
    return [by_theta.index.to_numpy(float), force, low, high]


def _draw_scaled(
    axes: Axes,
    results: Results,
    generic: list[FloatArray],
    measured: pd.DataFrame,
    component: str,
    zetas: Mapping[str, float],
) -> None:
    """Draw one component of measured force over zeta of each medium on one leg, and the generic curve with its band.

    `generic`: As `_generic_curve` returns it. `measured`: Forces on this leg. `zetas`: zeta by medium, NaN for none.
    What is drawn gets its label for the legend.
    """
    drawn_forces: list[FloatArray] = []
    unmeasured = []
    for medium, line_look in _choose_line_looks(zetas).items():
        zeta, title = zetas[medium], style.medium_label(results, medium)
        rows = matching_rows(measured, medium=medium)
        if np.isfinite(zeta) and leg_panels.has_force(rows, component):
            theta, force = leg_panels.with_gaps(rows, f"force_{component}_N")
            label = rf"{title} ($\zeta$ = {style.format_number(zeta)})"
            axes.plot(theta, force / zeta, linewidth=0.9, label=label, **line_look)
            drawn_forces.append(force / zeta)
        else:
            unmeasured.append(title)
    if generic:
        theta, force, low, high = generic
        # below the curves of the media, and behind them in the legend
        black: style.Look = {"color": "black", "linewidth": 1.6, "zorder": 1.9}
        axes.plot(theta, force, label="generic prediction", **black)
        label = f"{style.level(results)} interval of it" * bool(np.isfinite(low).any())
        axes.fill_between(theta, low, high, color="#bdbdbd", linewidth=0, label=label)
        drawn_forces += [force, low, high]
    notes = [] if generic else ["no generic prediction"]
    if len(unmeasured) == len(zetas):
        notes.append("not measured in any medium")
    elif unmeasured:
        notes.append(f"no curve: {'; '.join(unmeasured)}")
    leg_panels.force_range(axes, drawn_forces, notes)


# Predicted over measured peak lift of every model, leg and medium


_BANDS = {33.0: "#ececec", 10.0: "#bdbdbd"}
"""Errors that the paper states, percent, and their shades."""


def _without_peaks(results: Results, _: str) -> Sequence[str]:
    """Say that no peak is both measured and predicted; empty where one is."""
    table = results.table("leg_errors.csv")
    has_both_peaks = table[["peak_measured_N", "peak_predicted_N"]].notna().all(axis=1)
    return () if has_both_peaks.any() else ("no leg was measured in or predicted for any medium",)


@figure(
    "peak_errors",
    reads=("leg_errors.csv",),
    settings=("fit",),
    media=when(lambda c: c.with_legs("laboratory") + c.with_legs("natural_sand")),
    section="Legs",
    caption=(
        "Error of the predicted peak lift. Shaded: what the paper states, 10 % (c-leg, four media) and 33 % (all). "
        "No bar: no interval of alpha, for a reason in leg_errors.csv. Good: points inside the shades."
    ),
    lacking=_without_peaks,
)
def plot_peak_errors(results: Results) -> Figure:
    """Draw predicted over measured peak lift, one panel per leg, one row per medium, on a logarithmic axis.

    A ratio of 2 is an error of +100 %, and lies as far from no error as a ratio of 1/2.
    """
    table = results.table("leg_errors.csv")
    ratios = _ratios(table[table["component"] == "z"])
    media = [medium for medium in results.config.media if medium in {*ratios["medium"]}]
    names = leg_panels.leg_order([ratios])
    profiles = [profile for profile in PROFILE_LOOKS if profile in {*ratios["profile"]}]
    shown_ratios = np.append(ratios[_RATIO_NAMES].to_numpy(float), [0.6, 1.6])
    span = float(np.nanmin(shown_ratios)) / 1.15, float(np.nanmax(shown_ratios)) * 1.15
    page, panels = style.panels([0.95 * len(media) + 1.9], len(names))
    for leg, axes in zip(names, panels[0], strict=True):
        _prepare_panel(axes, span, [style.medium_label(results, name) for name in media])
        axes.tick_params(labelleft=leg == names[0])
        axes.set_xlabel("error of the predicted peak lift (%)")
        axes.set_title(leg_panels.leg_title(leg), weight="bold", loc="left")
        for row, medium in enumerate(media):
            rows = ratios[(ratios["medium"] == medium) & (ratios["leg"] == leg)]
            by_profile = rows.set_index("profile").to_dict("index")
            _draw_row(
                axes, row, {name: by_profile[name] for name in profiles if name in by_profile}
            )
    entries: dict[str, Any] = {}
    for profile in profiles:
        colour, _, marker = PROFILE_LOOKS[profile]
        look = style.line(colour, marker=marker, markersize=3.4, markeredgewidth=0)
        entries[PROFILE_TITLES[profile]] = look
    for percent, shade in reversed(_BANDS.items()):
        entries[f"within {percent:.0f} %"] = style.patch(facecolor=shade)
    has_no_low_end = (
        ratios["ratio"].notna() & ratios["ratio_lo"].isna() & ratios["ratio_hi"].notna()
    )
    if has_no_low_end.any():
        cut_profiles = set(ratios.loc[has_no_low_end, "profile"])
        colours = [PROFILE_LOOKS[profile][0] for profile in profiles if profile in cut_profiles]
        entries["interval goes below \N{MINUS SIGN}100 %"] = tuple(
            style.line(colour, **_CONTINUES) for colour in colours
        )
    title = f"bars: {leg_panels.name_of_interval(results)}; axes: logarithmic in predicted over measured"
    style.legend(page, entries, title=title)
    return page


_RATIO_NAMES = ["ratio", "ratio_lo", "ratio_hi"]
"""Columns that `_ratios` adds to those of ``results/leg_errors.csv``: predicted over measured peak, ends of its interval."""


def _ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Divide the predicted peak and its interval by alpha by the measured peak; NaN where the ratio is no positive number.

    `rows`: Of ``results/leg_errors.csv``. Returns them with the columns `_RATIO_NAMES`.
    """
    measured = rows["peak_measured_N"].to_numpy(float)
    names = with_end_names("peak_predicted_N")
    with np.errstate(divide="ignore", invalid="ignore"):
        peak, *ends = rows[names].to_numpy(float).T / measured
    # a negative measured peak exchanges the ends of the interval
    ratios = np.array([peak, *np.sort(ends, axis=0)])
    # the axis is logarithmic
    ratios[~(np.isfinite(ratios) & (ratios > 0))] = np.nan
    return rows.assign(**dict(zip(_RATIO_NAMES, ratios, strict=True)))


def _set_error_axis(axes: Axes, span: tuple[float, float]) -> None:
    """Make x a logarithmic axis of predicted over measured peaks, with errors in percent at its ticks.

    `span`: Smallest and largest ratio. Errors that the paper states are shaded (`_BANDS`).
    """
    axes.set(xscale="log")
    for percent, shade in _BANDS.items():
        ends = 1 - percent / 100, 1 + percent / 100
        axes.axvspan(*ends, color=shade, linewidth=0, zorder=0)
    axes.axvline(1, color="black", linewidth=0.5, zorder=0.5)
    # ticks are placed outward from no error, at least as far apart as their numbers are wide
    width_pt = axes.get_window_extent().width * 72 / axes.figure.dpi
    # smallest distance of two ticks, as a logarithm of ratios: 15 points
    gap = np.log(span[1] / span[0]) * (15 / width_pt)
    ticks = [1.0]
    round_ratios = (0.05, 0.1, 0.2, 0.5, 2.0, 5.0, 10.0, 20.0, 50.0)
    for tick in sorted(round_ratios, key=lambda tick: abs(np.log(tick))):
        distance = min(abs(np.log(tick / placed_tick)) for placed_tick in ticks)
        if distance > gap and span[0] * np.exp(gap / 2) < tick < span[1] * np.exp(-gap / 2):
            ticks.append(tick)
    names = [f"{100 * (tick - 1):+.0f}" if tick != 1 else "0" for tick in ticks]
    axes.xaxis.set_ticks(ticks, [name.replace("-", "\N{MINUS SIGN}") for name in names])
    axes.xaxis.minorticks_off()
    axes.xaxis.set_tick_params(labelsize=5.5)
    axes.set(xlim=span)


def _prepare_panel(axes: Axes, span: tuple[float, float], media: Sequence[str]) -> None:
    """Set up the axes of one leg: errors from left to right, media from top to bottom.

    `span`: Smallest and largest ratio. `media`: Titles, in the order of the rows.
    """
    _set_error_axis(axes, span)
    axes.set(ylim=(len(media) - 0.5, -0.5))
    axes.set_yticks(range(len(media)), media)
    axes.tick_params(axis="y", length=0)
    for edge in np.arange(len(media) - 1) + 0.5:
        axes.axhline(edge, color="#b0b0b0", linewidth=0.3, zorder=0.5)


_CONTINUES: dict[str, Any] = {"marker": "<", "markersize": 3, "linestyle": "", "fillstyle": "none"}
_CONTINUES |= {"markeredgewidth": 0.6}
"""Look of the mark at the end of an axis where an interval continues beyond it."""


def _draw_row(axes: Axes, row: int, ratios: Mapping[str, Row]) -> None:
    """Draw the errors of one medium by all profiles in its row, and say which profile has no number.

    `row`: Number of the row from 0, its height on the axis. `ratios`: Rows of `_ratios` on one leg by profile, in the
    order of drawing.
    """
    # titles of profiles without a ratio; ratios and ends that are drawn
    missing, points = [], []
    for i, (profile, ratios_of_profile) in enumerate(ratios.items()):
        ratio, low, high = (float(ratios_of_profile[name]) for name in _RATIO_NAMES)
        if not np.isfinite(ratio):
            missing.append(PROFILE_TITLES[profile])
            continue
        colour, _, marker = PROFILE_LOOKS[profile]
        # the profiles share the height of the row
        y = row + 0.84 * ((i + 0.5) / len(ratios) - 0.5)
        if np.isfinite(high) and not np.isfinite(low):
            # an interval that includes zero has no end on this axis
            low = axes.get_xlim()[0] * 1.04
            axes.plot(low, y, color=colour, **_CONTINUES)
        points += [ratio, low, high]
        axes.hlines(y, low, high, color=colour, linewidth=1.0)
        axes.plot(ratio, y, marker, color=colour, markersize=3.4, markeredgewidth=0)
    if ratios and not missing:
        return
    message = "nothing predicted"
    if ratios:
        reason = next(iter(ratios.values())).get("reason")
        explanation = style.plain(reason) if isinstance(reason, str) else ""
        message = f"no value: {', '.join(missing) if points else explanation}".removesuffix(": ")
    # the message stands on the side with more free room
    axis_start, axis_end = axes.get_xlim()
    finite_points = [point for point in points if np.isfinite(point)] or [axis_start]
    # the axis is logarithmic: ratios of its ends to the outer points are the free room
    at_right = axis_end / max(finite_points) >= min(finite_points) / axis_start
    x, alignment = (0.985, "right") if at_right else (0.015, "left")
    note_look: style.Look = {"ha": alignment, "transform": axes.get_yaxis_transform()}
    lines = "\n".join(textwrap.wrap(message, 52))
    style.write_note(axes, lines, x, row, va="center", **note_look)
