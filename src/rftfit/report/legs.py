"""Force on the legs in one medium against theta, measured and by every model (Figs. 3D to 3F)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.errors import InputError
from rftfit.report import curves, labels, style
from rftfit.report.leg_sketch import add_sketch, sketched

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.campaign.config import Leg

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

    Parameters
    ----------
    predicted : pandas.DataFrame
        Predicted curves with intervals (``results/predicted``).
    measured : pandas.DataFrame
        Measured, tared curves (``results/legs``).
    medium : str
    titles : mapping of str to str, optional
        Names of the media.
    legs : mapping of str to Leg, optional
        Legs of the config, in the order in which they are drawn; by default the paper's three and
        any others in the tables.
    profiles : sequence of str
        Keys of `curves.PROFILE_LOOKS`.
    confidence : float
        Level of the intervals in `predicted`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If a profile is not known or neither table has the medium.
    """
    unknown = [name for name in profiles if name not in curves.PROFILE_LOOKS]
    if unknown:
        raise InputError(
            f"no profile {unknown[0]!r} to draw; there are {', '.join(curves.PROFILE_LOOKS)}"
        )
    predicted, measured = (curves.rows_of(t, medium=medium) for t in (predicted, measured))
    if predicted.empty and measured.empty:
        raise InputError(f"no leg was measured in or predicted for medium {medium!r}")
    names = curves.leg_order((predicted, measured), None if legs is None else list(legs))
    shapes = sketched(legs)
    space = style.DOUBLE_CM - _LEFT_CM - _RIGHT_CM - (len(names) - 1) * _GAP_CM
    width = min(space / len(names), 8.0)
    total = _LEFT_CM + len(names) * width + (len(names) - 1) * _GAP_CM + _RIGHT_CM
    body = _TOP_CM + _SKETCH_CM + 2 * _PANEL_CM + 2 * _BETWEEN_CM
    figure = style.new_figure(max(total, style.SINGLE_CM), body + 1.45)
    style.text_cm(figure, 0.15, 0.12, labels.title_of(medium, titles), va="top", weight="bold")
    for column, leg in enumerate(names):
        left = _LEFT_CM + column * (width + _GAP_CM)
        tag = f"{chr(ord('D') + column)}  " if len(names) <= 3 else ""
        style.text_cm(figure, left, _TOP_CM - 0.08, tag + curves.leg_title(leg), va="bottom")
        sketch = style.axes_cm(figure, left, _TOP_CM, width, _SKETCH_CM)
        add_sketch(sketch, shapes.get(leg))
        for row, component in enumerate("zx"):
            top = _TOP_CM + _SKETCH_CM + _BETWEEN_CM + row * (_PANEL_CM + _BETWEEN_CM)
            axes = style.axes_cm(figure, left, top, width, _PANEL_CM)
            curves.theta_axes(axes, name=row == 1)
            _draw_panel(
                axes, curves.rows_of(predicted, leg=leg), curves.rows_of(measured, leg=leg),
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
    if curves.has_force(measured, component):
        theta, force = curves.broken(measured, column)
        axes.plot(theta, force, "o", color=curves.MEASURED, markersize=1.3, markeredgewidth=0)
        seen.append(force)
    else:
        notes.append("not measured" + curves.why_missing(measured))
    baseline = np.zeros(1)
    for profile in profiles:
        rows = curves.rows_of(predicted, profile=profile)
        if not curves.has_force(rows, component):
            title = curves.PROFILE_TITLES[profile]
            notes.append(f"{title}: no prediction{curves.why_missing(rows)}")
            continue
        colour, line, _ = curves.PROFILE_LOOKS[profile]
        curves.add_predicted(axes, rows, component, colour, line)
        force = rows[[column, f"force_{component}_lo_N", f"force_{component}_hi_N"]].to_numpy(float)
        if profile == "depth_only":
            baseline = force.ravel()
        else:
            seen.append(force.ravel())
    largest = max((float(np.nanmax(np.abs(force))) for force in seen), default=0.0)
    if seen and float(np.nanmax(np.abs(baseline))) > _BEYOND * largest:
        rows = curves.rows_of(predicted, profile="depth_only")
        at = int(np.nanargmax(np.abs(rows[column].to_numpy(float))))
        peak, theta_deg = (float(rows[name].iloc[at]) for name in (column, "theta_deg"))
        place = f"{labels.number(peak, 1)} N at {labels.degrees(theta_deg)}"
        notes.append(f"depth-only: beyond this panel, {place}")
    else:
        seen.append(baseline)
    curves.force_range(axes, seen, notes)


def _legend(figure: Figure, profiles: Sequence[str], level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {
        "measured": Line2D([], [], color=curves.MEASURED, marker="o", markersize=2, linestyle="")
    }
    for profile in profiles:
        colour, line, _ = curves.PROFILE_LOOKS[profile]
        label = f"predicted, {curves.PROFILE_TITLES[profile]}"
        entries[label] = Line2D([], [], color=colour, linestyle=line)
    entries[f"{level} interval of a prediction"] = Patch(facecolor="#888888", alpha=0.4)
    across = len(entries) if figure.get_figwidth() > 12 * style.CM else 2
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.4,
        columnspacing=1.1, borderaxespad=0.2,
    )  # fmt: skip
