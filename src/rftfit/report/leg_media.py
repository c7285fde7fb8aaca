"""Force on the legs in several media, one row of panels per medium (Figs. S5 and S12)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.errors import InputError
from rftfit.report import curves, labels, style

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEFT_CM, _GAP_CM, _RIGHT_CM, _TOP_CM = 1.5, 0.75, 0.2, 0.4
_PANEL_CM, _PITCH_CM = 3.05, 3.75
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

    Parameters
    ----------
    predicted : pandas.DataFrame
        Predicted curves with intervals (``results/predicted``).
    measured : pandas.DataFrame
        Measured, tared curves (``results/legs``).
    media : sequence of str, optional
        Rows of the figure; by default all media of the tables that have this profile or a
        measured leg.
    titles : mapping of str to str, optional
        Names of the media.
    legs : sequence of str, optional
        Columns; by default all of the tables, the paper's three first.
    profile : str
        ``table`` (Fig. S5), ``generic`` (Fig. S12), ``fourier`` or ``depth_only``.
    confidence : float
        Level of the intervals in `predicted`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If the profile is not known, or there is no medium to draw.
    """
    if profile not in curves.PROFILE_LOOKS:
        raise InputError(
            f"no profile {profile!r} to draw; there are {', '.join(curves.PROFILE_LOOKS)}"
        )
    predicted = curves.rows_of(predicted, profile=profile)
    tables = (predicted, measured)
    if media is None:
        media = list(dict.fromkeys(str(name) for t in tables for name in t["medium"].unique()))
    if not media:
        raise InputError("there is no medium whose legs could be drawn")
    chosen = [table[table["medium"].isin(list(media))] for table in tables]
    names = curves.leg_order(chosen, legs)
    space = style.DOUBLE_CM - _LEFT_CM - _RIGHT_CM - (len(names) - 1) * _GAP_CM
    width = min(space / len(names), 7.2)
    total = _LEFT_CM + len(names) * width + (len(names) - 1) * _GAP_CM + _RIGHT_CM
    figure = style.new_figure(
        max(total, style.SINGLE_CM),
        _TOP_CM + len(media) * _PITCH_CM + (1.5 if total > 12 else 2.1),
    )
    for column, leg in enumerate(names):
        left = _LEFT_CM + column * (width + _GAP_CM)
        style.text_cm(
            figure, left + width / 2, 0.1, curves.leg_title(leg), ha="center", va="top",
            weight="bold",
        )  # fmt: skip
        for row, medium in enumerate(media):
            top = _TOP_CM + 0.35 + row * _PITCH_CM
            axes = style.axes_cm(figure, left, top, width, _PANEL_CM)
            curves.theta_axes(axes, name=row == len(media) - 1)
            ours, theirs = (curves.rows_of(t, medium=medium, leg=leg) for t in tables)
            _draw_panel(axes, ours, theirs)
            axes.set_title(_peaks(ours, theirs), fontsize=5, loc="left", pad=2)
            if column == 0:
                axes.set_ylabel("force (N)")
                axes.yaxis.set_label_coords(-0.72 / width, 0.5)
                middle = top + _PANEL_CM / 2
                style.text_cm(
                    figure, 0.12, middle, labels.title_of(medium, titles), rotation=90,
                    ha="left", va="center", weight="bold", fontsize=6.5,
                )  # fmt: skip
    _legend(figure, profile, f"{100 * confidence:.4g} %", 3 if total > 12 else 2)
    return figure


def _draw_panel(axes: Axes, predicted: pd.DataFrame, measured: pd.DataFrame) -> None:
    seen, notes = [], []
    missing = [c for c in "zx" if not curves.has_force(measured, c)]
    if missing:
        notes.append(f"{_what(missing)}not measured{curves.why_missing(measured)}")
    unpredicted = [c for c in "zx" if not curves.has_force(predicted, c)]
    if unpredicted:
        notes.append(f"{_what(unpredicted)}no prediction{curves.why_missing(predicted)}")
    for c in "zx":
        if c not in missing:
            theta, force = curves.broken(measured, f"force_{c}_N")
            axes.plot(theta, force, "o", color=_PALE[c], markersize=1.5, markeredgewidth=0)
            seen.append(force)
    for c in "zx":
        if c not in unpredicted:
            curves.add_predicted(axes, predicted, c, style.COMPONENT_COLOURS[c], _LINES[c])
            names = [f"force_{c}_{part}N" for part in ("", "lo_", "hi_")]
            seen.append(predicted[names].to_numpy(float).ravel())
    curves.force_range(axes, seen, notes)


def _what(components: list[str]) -> str:
    return "" if len(components) == 2 else f"$F_{components[0]}$: "


def _peaks(predicted: pd.DataFrame, measured: pd.DataFrame) -> str:
    """Largest lift of both curves, the predicted one with its interval."""
    seen, ours = curves.peak(measured), curves.peak(predicted)
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
    return labels.number(value, digits)


def _legend(figure: Figure, profile: str, level: str, across: int) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {}
    words = {"z": "vertical force $F_z$", "x": "horizontal force $F_x$"}
    for c, word in words.items():
        how: dict[str, Any] = {"marker": "o", "markersize": 2, "linestyle": ""}
        entries[f"{word}, measured"] = Line2D([], [], color=_PALE[c], **how)
        line = Line2D([], [], color=style.COMPONENT_COLOURS[c], linestyle=_LINES[c])
        entries[f"{word}, predicted ({curves.PROFILE_TITLES[profile]})"] = line
    entries[f"{level} interval of a prediction"] = Patch(facecolor="#888888", alpha=0.4)
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.4,
        columnspacing=1.2, borderaxespad=0.2,
    )  # fmt: skip
