"""Forces on the legs over zeta, all media together, with the generic prediction (Fig. S8)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.errors import InputError
from rftfit.profile.reference_media import routines
from rftfit.report import curves, labels, style

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.grid import FloatArray

_LEFT_CM, _GAP_CM, _RIGHT_CM, _TOP_CM = 1.1, 0.8, 0.2, 0.5
_PANEL_CM, _BETWEEN_CM = 4.6, 0.35
_LINES: tuple[Any, ...] = ("-", (0, (5, 1.2)), (0, (1, 0.9)), (0, (5, 1, 1, 1)), (0, (2.5, 1)))


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

    Parameters
    ----------
    predicted : pandas.DataFrame
        Predicted curves with profile ``generic`` (``results/predicted``).
    measured : pandas.DataFrame
        Measured, tared curves (``results/legs``).
    penetration : pandas.DataFrame
        With ``method, medium, zeta`` (dimensionless, the number of N/cm^3).
    media : sequence of str, optional
        By default those with a row of this method: the laboratory media. Natural sands are
        looked up under `rftfit.profile.reference_media.routines`.
    method : str
        ``lsq`` or ``dft-index``.
    titles : mapping of str to str, optional
        Names of the media.
    legs : sequence of str, optional
        Columns; by default all of the tables, the paper's three first.
    confidence : float
        Level of the intervals in `predicted`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no medium to draw, or none of them has a zeta.
    """
    zetas = _zetas(penetration, method, media)
    tables = [t[t["medium"].isin(list(zetas))] for t in (predicted, measured)]
    tables[0] = curves.rows_of(tables[0], profile="generic")
    names = curves.leg_order(tables, legs)
    space = style.DOUBLE_CM - _LEFT_CM - _RIGHT_CM - (len(names) - 1) * _GAP_CM
    width = min(space / len(names), 7.5)
    total = _LEFT_CM + len(names) * width + (len(names) - 1) * _GAP_CM + _RIGHT_CM
    across = 4 if total > 12 else 2
    lines = -(-(len(zetas) + 2) // across)
    figure = style.new_figure(
        max(total, style.SINGLE_CM), _TOP_CM + 2 * _PANEL_CM + _BETWEEN_CM + 0.95 + 0.34 * lines
    )
    for column, leg in enumerate(names):
        left = _LEFT_CM + column * (width + _GAP_CM)
        for row, component in enumerate("zx"):
            top = _TOP_CM + row * (_PANEL_CM + _BETWEEN_CM)
            axes = style.axes_cm(figure, left, top, width, _PANEL_CM)
            curves.theta_axes(axes, name=row == 1)
            ours, theirs = (curves.rows_of(t, leg=leg) for t in tables)
            _draw_panel(axes, ours, theirs, component, zetas, titles)
            if row == 0:
                axes.set_title(curves.leg_title(leg), weight="bold")
            if column == 0:
                axes.set_ylabel(rf"$F_{component}$ / $\zeta$ (N)")
                axes.yaxis.set_label_coords(-0.65 / width, 0.5)
    _legend(figure, zetas, titles, f"{100 * confidence:.4g} %", across)
    return figure


def _zetas(penetration: pd.DataFrame, method: str, media: Sequence[str] | None) -> dict[str, float]:
    names = (method, *routines(method))
    tables = [penetration[penetration["method"] == name] for name in names]
    if media is None:
        media = [str(name) for name in tables[0]["medium"]]
    if not media:
        raise InputError(f"there is no medium with a zeta of method {method!r} to draw")
    found: dict[str, float] = {}
    for medium in media:
        values = [float(z) for t in tables for z in t.loc[t["medium"] == medium, "zeta"]]
        good = [z for z in values if np.isfinite(z) and z > 0]
        found[medium] = good[0] if good else float("nan")
    if not np.isfinite(list(found.values())).any():
        raise InputError(f"no medium has a zeta of method {method!r}: forces cannot be scaled")
    return found


def _draw_panel(
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
        rows = curves.rows_of(measured, medium=medium)
        if np.isfinite(zeta) and curves.has_force(rows, component):
            theta, force = curves.broken(rows, f"force_{component}_N")
            line = _LINES[i % len(_LINES)]
            axes.plot(theta, force / zeta, color=looks[medium][0], linestyle=line, linewidth=0.9)
            seen.append(force / zeta)
        else:
            missing.append(labels.title_of(medium, titles))
    notes = ["no generic prediction"] if generic is None else []
    if len(missing) == len(zetas):
        notes.append("not measured in any medium")
    elif missing:
        notes.append(f"no curve: {'; '.join(missing)}")
    curves.force_range(axes, seen, notes)


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


def _legend(
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
        line = Line2D([], [], color=looks[medium][0], linestyle=_LINES[i % len(_LINES)])
        entries[rf"{labels.title_of(medium, titles)} ($\zeta$ = {labels.number(zeta)})"] = line
    entries["generic prediction"] = Line2D([], [], color="black", linewidth=1.6)
    entries[f"{level} interval of it"] = Patch(facecolor="#bdbdbd")
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.6,
        columnspacing=1.2, borderaxespad=0.2,
    )  # fmt: skip
