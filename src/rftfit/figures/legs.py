"""Forces on legs: in one medium, in all media, over zeta, and errors of their peaks."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import NullLocator

from rftfit.errors import InputError, NothingToDraw
from rftfit.figures import leg_panels, style
from rftfit.figures.leg_panels import add_sketch, sketched
from rftfit.model.scaling import routines

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.campaign.config import Leg
    from rftfit.figures.maps import FloatArray

    Row = Mapping[Hashable, Any]


# --- Force on the legs in one medium against theta, measured and by every model (Figs. 3D to 3F).


PROFILES = ("table", "fourier", "depth_only")
_LEFT_CM, _GAP_CM, _RIGHT_CM, _TOP_CM = 1.05, 0.85, 0.2, 0.85
_SKETCH_CM, _PANEL_CM, _BETWEEN_CM = 2.75, 4.3, 0.3
_BEYOND = 2.5
"""A baseline that is larger than all else by this factor would flatten the rest: it is cut off."""

_FORCE_LABELS = {"z": r"vertical force $F_z$ (N)", "x": r"horizontal force $F_x$ (N)"}


@style.styled
def draw_legs(
    predicted: pd.DataFrame,
    measured: pd.DataFrame,
    medium: str,
    titles: Mapping[str, str] | None = None,
    legs: Mapping[str, Leg] | None = None,
    profiles: Sequence[str] = PROFILES,
    confidence: float = 0.95,
) -> Figure:
    """Draw F_z and F_x on each leg in one medium against theta, measured and predicted (Fig. 3D-F).

    Above each column the leg is drawn in the sand. Every panel has its own range of forces. Where
    the depth-only model is far above all others it is cut off and its peak is written in the panel.

    `predicted`: Predicted curves with intervals (``results/predicted``). `measured`: Measured,
    tared curves (``results/legs``). `titles`: Names of the media. `legs`: Legs of the config, in
    the order in which they are drawn; by default the paper's three and any others in the tables.
    `profiles`: Keys of `curves.PROFILE_LOOKS`. `confidence`: Level of the intervals in
    `predicted`.
    """
    unknown = [name for name in profiles if name not in leg_panels.PROFILE_LOOKS]
    if unknown:
        raise InputError(
            f"no profile {unknown[0]!r} to draw; there are {', '.join(leg_panels.PROFILE_LOOKS)}"
        )
    predicted, measured = (leg_panels.rows_of(t, medium=medium) for t in (predicted, measured))
    if predicted.empty and measured.empty:
        raise NothingToDraw(f"no leg was measured in or predicted for medium {medium!r}")
    names = leg_panels.leg_order((predicted, measured), None if legs is None else list(legs))
    shapes = sketched(legs)
    space = style.DOUBLE_CM - _LEFT_CM - _RIGHT_CM - (len(names) - 1) * _GAP_CM
    width = min(space / len(names), 8.0)
    total = _LEFT_CM + len(names) * width + (len(names) - 1) * _GAP_CM + _RIGHT_CM
    body = _TOP_CM + _SKETCH_CM + 2 * _PANEL_CM + 2 * _BETWEEN_CM
    figure = style.new_figure(max(total, style.SINGLE_CM), body + 1.45)
    style.text_cm(figure, 0.15, 0.12, style.title_of(medium, titles), va="top", weight="bold")
    for column, leg in enumerate(names):
        left = _LEFT_CM + column * (width + _GAP_CM)
        tag = f"{chr(ord('D') + column)}  " if len(names) <= 3 else ""
        style.text_cm(figure, left, _TOP_CM - 0.08, tag + leg_panels.leg_title(leg), va="bottom")
        sketch = style.axes_cm(figure, left, _TOP_CM, width, _SKETCH_CM)
        add_sketch(sketch, shapes.get(leg))
        for row, component in enumerate("zx"):
            top = _TOP_CM + _SKETCH_CM + _BETWEEN_CM + row * (_PANEL_CM + _BETWEEN_CM)
            axes = style.axes_cm(figure, left, top, width, _PANEL_CM)
            leg_panels.theta_axes(axes, name=row == 1)
            _draw_panel(
                axes, leg_panels.rows_of(predicted, leg=leg), leg_panels.rows_of(measured, leg=leg),
                component, profiles,
            )  # fmt: skip
            if column == 0:
                axes.set_ylabel(_FORCE_LABELS[component])
    _legend(figure, profiles, f"{100 * confidence:.4g} %")
    return figure


def _draw_panel(
    axes: Axes, predicted: pd.DataFrame, measured: pd.DataFrame, component: str,
    profiles: Sequence[str],
) -> None:  # fmt: skip
    column = f"force_{component}_N"
    notes, seen = [], []
    if leg_panels.has_force(measured, component):
        theta, force = leg_panels.broken(measured, column)
        axes.plot(theta, force, "o", color=leg_panels.MEASURED, markersize=1.3, markeredgewidth=0)
        seen.append(force)
    else:
        notes.append("not measured" + leg_panels.why_missing(measured))
    baseline = np.zeros(1)
    for profile in profiles:
        rows = leg_panels.rows_of(predicted, profile=profile)
        if not leg_panels.has_force(rows, component):
            title = leg_panels.PROFILE_TITLES[profile]
            notes.append(f"{title}: no prediction{leg_panels.why_missing(rows)}")
            continue
        colour, line, _ = leg_panels.PROFILE_LOOKS[profile]
        leg_panels.add_predicted(axes, rows, component, colour, line)
        force = rows[[column, f"force_{component}_lo_N", f"force_{component}_hi_N"]].to_numpy(float)
        if profile == "depth_only":
            baseline = force.ravel()
        else:
            seen.append(force.ravel())
    largest = max((float(np.nanmax(np.abs(force))) for force in seen), default=0.0)
    if seen and float(np.nanmax(np.abs(baseline))) > _BEYOND * largest:
        rows = leg_panels.rows_of(predicted, profile="depth_only")
        at = int(np.nanargmax(np.abs(rows[column].to_numpy(float))))
        peak, theta_deg = (float(rows[name].iloc[at]) for name in (column, "theta_deg"))
        place = f"{style.number(peak, 1)} N at {style.degrees(theta_deg)}"
        notes.append(f"depth-only: beyond this panel, {place}")
    else:
        seen.append(baseline)
    leg_panels.force_range(axes, seen, notes)


def _legend(figure: Figure, profiles: Sequence[str], level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {
        "measured": Line2D(
            [], [], color=leg_panels.MEASURED, marker="o", markersize=2, linestyle=""
        )
    }
    for profile in profiles:
        colour, line, _ = leg_panels.PROFILE_LOOKS[profile]
        label = f"predicted, {leg_panels.PROFILE_TITLES[profile]}"
        entries[label] = Line2D([], [], color=colour, linestyle=line)
    entries[f"{level} interval of a prediction"] = Patch(facecolor="#888888", alpha=0.4)
    across = len(entries) if figure.get_figwidth() > 12 * style.CM else 2
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.4,
        columnspacing=1.1, borderaxespad=0.2,
    )  # fmt: skip


# --- Force on the legs in several media, one row of panels per medium (Figs. S5 and S12).


_LEG_MEDIA_LEFT_CM, _LEG_MEDIA_GAP_CM, _LEG_MEDIA_RIGHT_CM, _LEG_MEDIA_TOP_CM = 1.5, 0.75, 0.2, 0.4
_LEG_MEDIA_PANEL_CM, _PITCH_CM = 3.05, 3.75
_PALE = {"z": style.OKABE_ITO["sky blue"], "x": style.OKABE_ITO["orange"]}
_LINES: dict[str, Any] = {"z": "-", "x": (0, (4, 1.2))}


@style.styled
def draw_leg_media(
    predicted: pd.DataFrame,
    measured: pd.DataFrame,
    media: Sequence[str] | None = None,
    titles: Mapping[str, str] | None = None,
    legs: Sequence[str] | None = None,
    profile: str = "table",
    confidence: float = 0.95,
) -> Figure:
    """Draw F_z and F_x on every leg in every medium, measured and predicted (Figs. S5, S12).

    Every panel has its own range of forces; its peak lifts stand above it.

    `predicted`: Predicted curves with intervals (``results/predicted``). `measured`: Measured,
    tared curves (``results/legs``). `media`: Rows of the figure; by default all media of the
    tables that have this profile or a measured leg. `titles`: Names of the media. `legs`: Columns;
    by default all of the tables, the paper's three first. `profile`: ``table`` (Fig. S5),
    ``generic`` (Fig. S12), ``fourier`` or ``depth_only``. `confidence`: Level of the intervals in
    `predicted`.
    """
    if profile not in leg_panels.PROFILE_LOOKS:
        raise InputError(
            f"no profile {profile!r} to draw; there are {', '.join(leg_panels.PROFILE_LOOKS)}"
        )
    predicted = leg_panels.rows_of(predicted, profile=profile)
    tables = (predicted, measured)
    if media is None:
        media = list(dict.fromkeys(str(name) for t in tables for name in t["medium"].unique()))
    if not media:
        raise NothingToDraw("there is no medium whose legs could be drawn")
    chosen = [table[table["medium"].isin(list(media))] for table in tables]
    names = leg_panels.leg_order(chosen, legs)
    space = (
        style.DOUBLE_CM
        - _LEG_MEDIA_LEFT_CM
        - _LEG_MEDIA_RIGHT_CM
        - (len(names) - 1) * _LEG_MEDIA_GAP_CM
    )
    width = min(space / len(names), 7.2)
    total = (
        _LEG_MEDIA_LEFT_CM
        + len(names) * width
        + (len(names) - 1) * _LEG_MEDIA_GAP_CM
        + _LEG_MEDIA_RIGHT_CM
    )
    figure = style.new_figure(
        max(total, style.SINGLE_CM),
        _LEG_MEDIA_TOP_CM + len(media) * _PITCH_CM + (1.5 if total > 12 else 2.1),
    )
    for column, leg in enumerate(names):
        left = _LEG_MEDIA_LEFT_CM + column * (width + _LEG_MEDIA_GAP_CM)
        style.text_cm(
            figure, left + width / 2, 0.1, leg_panels.leg_title(leg), ha="center", va="top",
            weight="bold",
        )  # fmt: skip
        for row, medium in enumerate(media):
            top = _LEG_MEDIA_TOP_CM + 0.35 + row * _PITCH_CM
            axes = style.axes_cm(figure, left, top, width, _LEG_MEDIA_PANEL_CM)
            leg_panels.theta_axes(axes, name=row == len(media) - 1)
            ours, theirs = (leg_panels.rows_of(t, medium=medium, leg=leg) for t in tables)
            _leg_media_draw_panel(axes, ours, theirs)
            axes.set_title(_peaks(ours, theirs), fontsize=5, loc="left", pad=2)
            if column == 0:
                axes.set_ylabel("force (N)")
                axes.yaxis.set_label_coords(-0.72 / width, 0.5)
                middle = top + _LEG_MEDIA_PANEL_CM / 2
                style.text_cm(
                    figure, 0.12, middle, style.title_of(medium, titles), rotation=90,
                    ha="left", va="center", weight="bold", fontsize=6.5,
                )  # fmt: skip
    _leg_media_legend(figure, profile, f"{100 * confidence:.4g} %", 3 if total > 12 else 2)
    return figure


def _leg_media_draw_panel(axes: Axes, predicted: pd.DataFrame, measured: pd.DataFrame) -> None:
    seen, notes = [], []
    missing = [c for c in "zx" if not leg_panels.has_force(measured, c)]
    if missing:
        notes.append(f"{_what(missing)}not measured{leg_panels.why_missing(measured)}")
    unpredicted = [c for c in "zx" if not leg_panels.has_force(predicted, c)]
    if unpredicted:
        notes.append(f"{_what(unpredicted)}no prediction{leg_panels.why_missing(predicted)}")
    for c in "zx":
        if c not in missing:
            theta, force = leg_panels.broken(measured, f"force_{c}_N")
            axes.plot(theta, force, "o", color=_PALE[c], markersize=1.5, markeredgewidth=0)
            seen.append(force)
    for c in "zx":
        if c not in unpredicted:
            leg_panels.add_predicted(axes, predicted, c, style.COMPONENT_COLOURS[c], _LINES[c])
            names = [f"force_{c}_{part}N" for part in ("", "lo_", "hi_")]
            seen.append(predicted[names].to_numpy(float).ravel())
    leg_panels.force_range(axes, seen, notes)


def _what(components: list[str]) -> str:
    return "" if len(components) == 2 else f"$F_{components[0]}$: "


def _peaks(predicted: pd.DataFrame, measured: pd.DataFrame) -> str:
    """Largest lift of both curves, the predicted one with its interval."""
    seen, ours = leg_panels.peak(measured), leg_panels.peak(predicted)
    told = [f"measured {_three(seen)}"] if np.isfinite(seen) else []
    if np.isfinite(ours):
        force = predicted["force_z_N"].to_numpy(float)
        row = predicted.iloc[int(np.nanargmax(force))]
        low, high = float(row["force_z_lo_N"]), float(row["force_z_hi_N"])
        span = f" ({_three(low)}\N{EN DASH}{_three(high)})" if np.isfinite(low) and low >= 0 else ""
        told.append(f"predicted {_three(ours)}{span}")
    return "peak $F_z$ (N): " + ", ".join(told) if told else ""


def _three(value: float) -> str:
    """Write about three digits, with their zeros."""
    digits = 2 if abs(value) < 10 else 1 if abs(value) < 100 else 0
    return style.number(value, digits)


def _leg_media_legend(figure: Figure, profile: str, level: str, across: int) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {}
    words = {"z": "vertical force $F_z$", "x": "horizontal force $F_x$"}
    for c, word in words.items():
        how: dict[str, Any] = {"marker": "o", "markersize": 2, "linestyle": ""}
        entries[f"{word}, measured"] = Line2D([], [], color=_PALE[c], **how)
        line = Line2D([], [], color=style.COMPONENT_COLOURS[c], linestyle=_LINES[c])
        entries[f"{word}, predicted ({leg_panels.PROFILE_TITLES[profile]})"] = line
    entries[f"{level} interval of a prediction"] = Patch(facecolor="#888888", alpha=0.4)
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.4,
        columnspacing=1.2, borderaxespad=0.2,
    )  # fmt: skip


# --- Forces on the legs over zeta, all media together, with the generic prediction (Fig. S8).


(
    _GENERIC_FORCES_LEFT_CM,
    _GENERIC_FORCES_GAP_CM,
    _GENERIC_FORCES_RIGHT_CM,
    _GENERIC_FORCES_TOP_CM,
) = 1.1, 0.8, 0.2, 0.5
_GENERIC_FORCES_PANEL_CM, _GENERIC_FORCES_BETWEEN_CM = 4.6, 0.35
_GENERIC_FORCES_LINES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.2)),
    (0, (1, 0.9)),
    (0, (5, 1, 1, 1)),
    (0, (2.5, 1)),
)


@style.styled
def draw_generic_forces(
    predicted: pd.DataFrame,
    measured: pd.DataFrame,
    penetration: pd.DataFrame,
    media: Sequence[str] | None = None,
    method: str = "lsq",
    titles: Mapping[str, str] | None = None,
    legs: Sequence[str] | None = None,
    confidence: float = 0.95,
) -> Figure:
    """Draw measured F / zeta of all media on each leg against theta, with the generic one (Fig. S8).

    Where one profile stands for all media, all curves fall on the generic one. Zeta counts as known
    for the measured curves. The generic curve is the mean over media of their scaled prediction
    over zeta (one and the same curve), its band the widest of their intervals.

    `predicted`: Predicted curves with profile ``generic`` (``results/predicted``). `measured`:
    Measured, tared curves (``results/legs``). `penetration`: With ``method, medium, zeta``
    (dimensionless, the number of N/cm^3). `media`: By default those with a row of this method: the
    laboratory media. Natural sands are looked up under `rftfit.model.scaling.routines`. `method`:
    ``lsq`` or ``dft-index``. `titles`: Names of the media. `legs`: Columns; by default all of the
    tables, the paper's three first. `confidence`: Level of the intervals in `predicted`.
    """
    zetas = _zetas(penetration, method, media)
    tables = [t[t["medium"].isin(list(zetas))] for t in (predicted, measured)]
    tables[0] = leg_panels.rows_of(tables[0], profile="generic")
    names = leg_panels.leg_order(tables, legs)
    space = (
        style.DOUBLE_CM
        - _GENERIC_FORCES_LEFT_CM
        - _GENERIC_FORCES_RIGHT_CM
        - (len(names) - 1) * _GENERIC_FORCES_GAP_CM
    )
    width = min(space / len(names), 7.5)
    total = (
        _GENERIC_FORCES_LEFT_CM
        + len(names) * width
        + (len(names) - 1) * _GENERIC_FORCES_GAP_CM
        + _GENERIC_FORCES_RIGHT_CM
    )
    across = 4 if total > 12 else 2
    lines = -(-(len(zetas) + 2) // across)
    figure = style.new_figure(
        max(total, style.SINGLE_CM),
        _GENERIC_FORCES_TOP_CM
        + 2 * _GENERIC_FORCES_PANEL_CM
        + _GENERIC_FORCES_BETWEEN_CM
        + 0.95
        + 0.34 * lines,
    )
    for column, leg in enumerate(names):
        left = _GENERIC_FORCES_LEFT_CM + column * (width + _GENERIC_FORCES_GAP_CM)
        for row, component in enumerate("zx"):
            top = _GENERIC_FORCES_TOP_CM + row * (
                _GENERIC_FORCES_PANEL_CM + _GENERIC_FORCES_BETWEEN_CM
            )
            axes = style.axes_cm(figure, left, top, width, _GENERIC_FORCES_PANEL_CM)
            leg_panels.theta_axes(axes, name=row == 1)
            ours, theirs = (leg_panels.rows_of(t, leg=leg) for t in tables)
            _generic_forces_draw_panel(axes, ours, theirs, component, zetas, titles)
            if row == 0:
                axes.set_title(leg_panels.leg_title(leg), weight="bold")
            if column == 0:
                axes.set_ylabel(rf"$F_{component}$ / $\zeta$ (N)")
                axes.yaxis.set_label_coords(-0.65 / width, 0.5)
    _generic_forces_legend(figure, zetas, titles, f"{100 * confidence:.4g} %", across)
    return figure


def _zetas(penetration: pd.DataFrame, method: str, media: Sequence[str] | None) -> dict[str, float]:
    names = (method, *routines(method))
    tables = [penetration[penetration["method"] == name] for name in names]
    if media is None:
        media = [str(name) for name in tables[0]["medium"]]
    if not media:
        raise NothingToDraw(f"there is no medium with a zeta of method {method!r} to draw")
    found: dict[str, float] = {}
    for medium in media:
        values = [float(z) for t in tables for z in t.loc[t["medium"] == medium, "zeta"]]
        good = [z for z in values if np.isfinite(z) and z > 0]
        found[medium] = good[0] if good else float("nan")
    if not np.isfinite(list(found.values())).any():
        raise NothingToDraw(f"no medium has a zeta of method {method!r}: forces cannot be scaled")
    return found


def _generic_forces_draw_panel(
    axes: Axes,
    predicted: pd.DataFrame,
    measured: pd.DataFrame,
    component: str,
    zetas: Mapping[str, float],
    titles: Mapping[str, str] | None,
) -> None:
    seen: list[FloatArray] = []
    missing = []
    generic = _generic(predicted, component, zetas)
    if generic is not None:
        theta, force, low, high = generic
        axes.fill_between(theta, low, high, color="#bdbdbd", linewidth=0)
        axes.plot(theta, force, color="black", linewidth=1.6)
        seen += [force, low, high]
    looks = style.medium_looks(zetas)
    for i, (medium, zeta) in enumerate(zetas.items()):
        rows = leg_panels.rows_of(measured, medium=medium)
        if np.isfinite(zeta) and leg_panels.has_force(rows, component):
            theta, force = leg_panels.broken(rows, f"force_{component}_N")
            line = _GENERIC_FORCES_LINES[i % len(_GENERIC_FORCES_LINES)]
            axes.plot(theta, force / zeta, color=looks[medium][0], linestyle=line, linewidth=0.9)
            seen.append(force / zeta)
        else:
            missing.append(style.title_of(medium, titles))
    notes = ["no generic prediction"] if generic is None else []
    if len(missing) == len(zetas):
        notes.append("not measured in any medium")
    elif missing:
        notes.append(f"no curve: {'; '.join(missing)}")
    leg_panels.force_range(axes, seen, notes)


def _generic(
    predicted: pd.DataFrame, component: str, zetas: Mapping[str, float]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Theta, and the scaled prediction over zeta with the ends of the widest interval."""
    names = [f"force_{component}_{part}N" for part in ("", "lo_", "hi_")]
    rows = predicted[predicted["medium"].map(dict(zetas)).notna()]
    rows = rows[np.isfinite(rows[names[0]].to_numpy(float))]
    if rows.empty:
        return None
    scale = rows["medium"].map(dict(zetas)).to_numpy(float)
    scaled = rows.assign(**{name: rows[name].to_numpy(float) / scale for name in names})
    by_theta = scaled.groupby("theta_deg", sort=True)[names].agg(["mean", "min", "max"])
    ends = zip(names, ("mean", "min", "max"), strict=True)
    force, low, high = (by_theta[end].to_numpy(float) for end in ends)
    return by_theta.index.to_numpy(float), force, low, high


def _generic_forces_legend(
    figure: Figure,
    zetas: Mapping[str, float],
    titles: Mapping[str, str] | None,
    level: str,
    across: int,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    looks = style.medium_looks(zetas)
    entries: dict[str, Line2D | Patch] = {}
    for i, (medium, zeta) in enumerate(zetas.items()):
        line = Line2D(
            [],
            [],
            color=looks[medium][0],
            linestyle=_GENERIC_FORCES_LINES[i % len(_GENERIC_FORCES_LINES)],
        )
        entries[rf"{style.title_of(medium, titles)} ($\zeta$ = {style.number(zeta)})"] = line
    entries["generic prediction"] = Line2D([], [], color="black", linewidth=1.6)
    entries[f"{level} interval of it"] = Patch(facecolor="#bdbdbd")
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.6,
        columnspacing=1.2, borderaxespad=0.2,
    )  # fmt: skip


# --- Predicted over measured peak lift of every model, leg and medium, with intervals.


(
    _MEDIA_OVERVIEW_LEFT_CM,
    _MEDIA_OVERVIEW_RIGHT_CM,
    _MEDIA_OVERVIEW_TOP_CM,
    _ROW_CM,
    _MEDIA_OVERVIEW_BETWEEN_CM,
) = 2.8, 0.25, 0.5, 0.54, 0.6
_BANDS = {33.0: "#ececec", 10.0: "#cfcfcf"}
"""Errors that the paper states, percent, and their shades."""

_TICKS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
_PEAKS = {"z": "peak lift", "x": "peak horizontal force"}


@style.styled
def draw_peak_errors(
    errors: pd.DataFrame,
    component: str = "z",
    media: Sequence[str] | None = None,
    titles: Mapping[str, str] | None = None,
    legs: Sequence[str] | None = None,
    confidence: float = 0.95,
) -> Figure:
    """Draw predicted over measured peak force, one panel per leg, one row per medium.

    The axis is logarithmic in the ratio, so that a tenth and ten times too much are alike far off,
    and its ticks say the error in percent of the measured peak.

    `errors`: ``results/leg_errors.csv``. `component`: Peak lift or peak horizontal force. `media`:
    Rows; by default all of the table. `titles`: Names of the media. `legs`: Panels; by default all
    of the table, the paper's three first. `confidence`: Level of the intervals in `errors`.
    """
    rows = errors[errors["component"] == component]
    if media is None:
        media = [str(medium) for medium in rows["medium"].unique()]
    if not media:
        raise NothingToDraw(f"no leg errors of component {component!r} to draw")
    names = leg_panels.leg_order([rows], legs)
    found = set(rows["profile"])
    profiles = [profile for profile in leg_panels.PROFILE_LOOKS if profile in found]
    ratios = _ratios(rows)
    height = len(media) * _ROW_CM
    total = _MEDIA_OVERVIEW_TOP_CM + len(names) * (height + _MEDIA_OVERVIEW_BETWEEN_CM) + 1.75
    figure = style.new_figure(style.SINGLE_CM, total)
    low, high = _span(ratios)
    for i, leg in enumerate(names):
        top = _MEDIA_OVERVIEW_TOP_CM + i * (height + _MEDIA_OVERVIEW_BETWEEN_CM)
        width = style.SINGLE_CM - _MEDIA_OVERVIEW_LEFT_CM - _MEDIA_OVERVIEW_RIGHT_CM
        axes = style.axes_cm(figure, _MEDIA_OVERVIEW_LEFT_CM, top, width, height)
        _prepare(axes, (low, high), [style.title_of(name, titles) for name in media])
        axes.set_title(leg_panels.leg_title(leg), weight="bold", loc="left")
        for place, medium in enumerate(media):
            own = ratios[(ratios["medium"] == medium) & (ratios["leg"] == leg)]
            _draw_row(axes, place, {str(r["profile"]): r for r in own.to_dict("records")}, profiles)
        axes.tick_params(labelbottom=i == len(names) - 1)
        if i == len(names) - 1:
            axes.set_xlabel(f"error of the predicted {_PEAKS[component]} (% of measured)")
    _media_overview_legend(figure, profiles, f"{100 * confidence:.4g} %")
    return figure


def _ratios(rows: pd.DataFrame) -> pd.DataFrame:
    """Peak and its interval over the measured peak; NaN where that is no positive number."""
    measured = rows["peak_measured_N"].to_numpy(float)
    with np.errstate(divide="ignore", invalid="ignore"):
        peak, *ends = (
            rows[f"peak_predicted_{part}N"].to_numpy(float) / measured
            for part in ("", "lo_", "hi_")
        )
    # a negative peak turns its interval round
    low, high = np.sort(np.stack(ends), axis=0)
    good = [np.where(np.isfinite(r) & (r > 0), r, np.nan) for r in (peak, low, high)]
    return rows.assign(ratio=good[0], ratio_lo=good[1], ratio_hi=good[2])


def _span(ratios: pd.DataFrame) -> tuple[float, float]:
    every = ratios[["ratio", "ratio_lo", "ratio_hi"]].to_numpy(float)
    found = [0.6, 1.6, *every[np.isfinite(every)].tolist()]
    return min(found) / 1.15, max(found) * 1.15


def _prepare(axes: Axes, span: tuple[float, float], media: Sequence[str]) -> None:
    axes.set_xscale("log")
    for percent, shade in _BANDS.items():
        axes.axvspan(1 - percent / 100, 1 + percent / 100, color=shade, linewidth=0, zorder=0)
    axes.axvline(1, color="black", linewidth=0.5, zorder=0.5)
    ticks = [tick for tick in _TICKS if span[0] <= tick <= span[1]]
    names = [f"{100 * (t - 1):+.0f}" if t != 1 else "0" for t in ticks]
    axes.set_xticks(ticks, [name.replace("-", "\N{MINUS SIGN}") for name in names])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(xlim=span, ylim=(len(media) - 0.5, -0.5))
    axes.set_yticks(range(len(media)), media)
    axes.tick_params(axis="y", length=0)
    for edge in np.arange(len(media) - 1) + 0.5:
        axes.axhline(edge, color="#b0b0b0", linewidth=0.3, zorder=0.5)


def _draw_row(axes: Axes, place: int, own: Mapping[str, Row], profiles: Sequence[str]) -> None:
    missing, points = [], []
    drawn = [profile for profile in profiles if profile in own]
    for i, profile in enumerate(drawn):
        ratio, low, high = (float(own[profile][n]) for n in ("ratio", "ratio_lo", "ratio_hi"))
        if not np.isfinite(ratio):
            missing.append(leg_panels.PROFILE_TITLES[profile])
            continue
        if np.isfinite(high) and not np.isfinite(low):
            low = axes.get_xlim()[0]  # an interval that includes zero has no end on this axis
        points += [ratio, low, high]
        colour, _, marker = leg_panels.PROFILE_LOOKS[profile]
        y = place + 0.74 * ((i + 0.5) / len(drawn) - 0.5)
        axes.hlines(y, low, high, color=colour, linewidth=1.0)
        axes.plot(ratio, y, marker, color=colour, markersize=2.9, markeredgewidth=0)
    if not missing and drawn:
        return
    if points:
        told = f"no value: {', '.join(missing)}"
    else:
        told = "no value" + _why(own[drawn[0]]) if drawn else "nothing predicted"
    # on the side where more room is left
    first, last = axes.get_xlim()
    found = [point for point in points if np.isfinite(point)] or [first]
    right = last / max(found) >= min(found) / first
    axes.text(
        0.985 if right else 0.015, place, "\n".join(textwrap.wrap(told, 52)),
        ha="right" if right else "left", va="center", fontsize=5, color=style.MARK,
        transform=axes.get_yaxis_transform(),
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )  # fmt: skip


def _why(row: Row) -> str:
    reason = row.get("reason")
    return f": {style.plain(reason)}" if isinstance(reason, str) and reason else ""


def _media_overview_legend(figure: Figure, profiles: Sequence[str], level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {}
    for profile in profiles:
        colour, _, marker = leg_panels.PROFILE_LOOKS[profile]
        entries[f"{leg_panels.PROFILE_TITLES[profile]}"] = Line2D(
            [], [], color=colour, marker=marker, markersize=2.6
        )
    for percent, shade in reversed(_BANDS.items()):
        entries[f"within {percent:.0f} %"] = Patch(facecolor=shade)
    entries[f"bars: {level} interval"] = Line2D([], [], linestyle="")
    figure.legend(
        list(entries.values()),
        list(entries),
        loc="lower center",
        ncols=3,
        columnspacing=1.2,
        borderaxespad=0.2,
    )
