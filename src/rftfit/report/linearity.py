"""Stress against depth in all media at a few angles, with the line through zero and its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit.errors import InputError
from rftfit.report import curves, labels, style
from rftfit.report.runs import by_run, thin

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.runs import Trace

    Row = Mapping[Hashable, Any]

_LEFT_CM, _SIDE_CM, _PITCH_CM, _TOP_CM, _ROW_CM = 1.5, 2.5, 3.48, 2.15, 3.0
_SKETCH_CM = 1.25
_FIT = (0, (4, 2))
_SAND = "#efe6d2"
_WORDS = {"z": "vertical stress\n$\\sigma_z$", "x": "horizontal stress\n$\\sigma_x$"}


def runs_of_cells(alpha: pd.DataFrame, cells: Iterable[tuple[float, float]]) -> set[str]:
    """Name the runs behind cells of alpha tables.

    Parameters
    ----------
    alpha : pandas.DataFrame
    cells : iterable of (float, float)
        Beta and gamma as filed, degrees.

    Returns
    -------
    set of str
    """
    found: set[str] = set()
    for beta, gamma in cells:
        for row in _rows_at(alpha, beta, gamma).values():
            found |= set(_run_ids(row))
    return found


def _rows_at(alpha: pd.DataFrame, beta_deg: float, gamma_deg: float) -> dict[str, Row]:
    here = np.isclose(alpha["beta_deg"], beta_deg) & np.isclose(alpha["gamma_deg"], gamma_deg)
    return {str(row["medium"]): row for row in alpha[here].to_dict("records")}


def _run_ids(row: Row) -> list[str]:
    return row["run_ids"].split() if isinstance(row["run_ids"], str) else []


@style.styled
def draw_linearity(
    traces: pd.DataFrame,
    fits: pd.DataFrame,
    alpha: pd.DataFrame,
    cells: Sequence[tuple[float, float]],
    titles: Mapping[str, str] | None = None,
    confidence: float = 0.95,
) -> Figure:
    """Draw stress against depth, one column per cell and one colour per medium (after Fig. S2).

    Samples outside the window of the fit are drawn faint. A horizontal run is one point: its steady
    mean, with its interval, at its depth. The line is the cell's slope, through zero.

    Parameters
    ----------
    traces : pandas.DataFrame
        Tared samples as filed: ``run_id, depth_cm, stress_z_N_per_cm2, stress_x_N_per_cm2,
        in_window``.
    fits : pandas.DataFrame
        Fit tables of all media.
    alpha : pandas.DataFrame
        Alpha tables of all media; they give the order of the media.
    cells : sequence of (float, float)
        Beta and gamma as filed, degrees; gamma 0 is a horizontal run.
    titles : mapping of str to str, optional
        Names of the media.
    confidence : float
        Level of the intervals in the tables.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If there is no medium or no cell to draw.
    """
    media = [str(name) for name in alpha["medium"].unique()]
    if not media or not cells:
        raise InputError("there is no medium whose stress could be drawn against depth")
    looks = style.medium_looks(media)
    names = ["depth_cm", "stress_z_N_per_cm2", "stress_x_N_per_cm2", "in_window"]
    samples = by_run(traces, names)
    rows = {str(row["run_id"]): row for row in fits.to_dict("records")}
    width = _LEFT_CM + (len(cells) - 1) * _PITCH_CM + _SIDE_CM + 0.25
    figure = style.new_figure(max(width, style.SINGLE_CM), _TOP_CM + 2 * _ROW_CM + 1.45)
    for i, (beta, gamma) in enumerate(cells):
        left = _LEFT_CM + i * _PITCH_CM
        _sketch(style.axes_cm(figure, left, 0.62, _SIDE_CM, _SKETCH_CM), beta, gamma, i == 0)
        head = rf"$\beta$ = {labels.degrees(beta)}, $\gamma$ = {labels.degrees(gamma)}"
        style.text_cm(figure, left, 0.5, f"{'ABCDEFGH'[i % 8]}  {head}", va="bottom", fontsize=6.5)
        own = _rows_at(alpha, beta, gamma)
        for j, c in enumerate("zx"):
            height = _ROW_CM - 0.35
            axes = style.axes_cm(figure, left, _TOP_CM + j * _ROW_CM, _SIDE_CM, height)
            axes.axhline(0, color="#808080", linewidth=0.4)
            drawn = [
                _draw_medium(axes, c, gamma == 0, own.get(medium), looks[medium], samples, rows)
                for medium in media
            ]
            lost = [medium for medium, good in zip(media, drawn, strict=True) if not good]
            _finish(axes, [labels.title_of(name, titles) for name in lost], any(drawn))
            axes.tick_params(labelbottom=j == 1)
            if j == 1:
                axes.set_xlabel("depth (cm)")
            if i == 0:
                axes.set_ylabel(f"{_WORDS[c]} ({labels.PER_CM2})")
                axes.yaxis.set_label_coords(-0.8 / _SIDE_CM, 0.5)
    _legend(figure, looks, titles, f"{100 * confidence:.4g} %")
    return figure


def _sketch(axes: Axes, beta_deg: float, gamma_deg: float, frame: bool) -> None:
    """Plate and direction of motion below the free surface, seen from the side."""
    beta, gamma = np.radians([beta_deg, gamma_deg])
    tangent = 0.5 * np.array([np.cos(beta), -np.sin(beta)])
    velocity = 0.85 * np.array([-np.cos(gamma), -np.sin(gamma)])
    axes.axhspan(-1, 0.8, color=_SAND, linewidth=0)
    axes.axhline(0.8, color="#8a7443", linewidth=0.6)
    axes.plot(*np.stack([-tangent, tangent], axis=1), color="black", linewidth=1.8)
    half = 1.05 * _SIDE_CM / _SKETCH_CM
    arrows = [(np.zeros(2), velocity, style.MARK, "")]
    if frame:
        corner = np.array([0.12 - half, -0.88])
        arrows += [
            (corner, corner + 0.55 * np.array(axis), "black", name)
            for name, axis in (("$x$", (1, 0)), ("$z$", (0, 1)))
        ]
    for start, end, colour, name in arrows:
        axes.annotate(
            "", xy=(end[0], end[1]), xytext=(start[0], start[1]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 0.7, "shrinkA": 0,
                        "shrinkB": 0, "mutation_scale": 5},
        )  # fmt: skip
        axes.text(end[0] + 0.08, end[1] + 0.08, name, fontsize=curves.NOTE_PT)
    axes.set(xlim=(-half, half), ylim=(-1.0, 1.1))
    axes.set_axis_off()


def _draw_medium(
    axes: Axes, c: str, flat: bool, row: Row | None, look: tuple[str, str],
    samples: Mapping[str, Trace], fits: Mapping[str, Row],
) -> bool:  # fmt: skip
    colour, marker = look
    alpha, low, high = (
        np.nan if row is None else float(row[f"alpha_{c}_{part}N_per_cm3"])
        for part in ("", "lo_", "hi_")
    )
    if row is None or not np.isfinite(alpha):
        return False
    ends = []
    for run in _run_ids(row):
        fit, trace = fits[run], samples.get(run)
        ends.append(float(fit["depth_to_cm"]))
        if flat:
            _draw_mean(axes, c, fit, look)
        elif trace is not None:
            _draw_trace(axes, trace, f"stress_{c}_N_per_cm2", colour)
    end = np.nanmax(ends) if np.isfinite(ends).any() else 1.0
    axes.fill_between([0, end], [0, low * end], [0, high * end], color=colour, alpha=0.35)
    axes.plot([0, end], [0, alpha * end], color="black", linestyle=_FIT, linewidth=0.6)
    if not flat:
        axes.plot(end, alpha * end, marker, color=colour, markeredgecolor="white", markersize=4,
                  markeredgewidth=0.3, zorder=4)  # fmt: skip
    return True


def _draw_trace(axes: Axes, trace: Trace, name: str, colour: str) -> None:
    inside = trace["in_window"] > 0
    for chosen, strength in ((~inside, 0.3), (inside, 0.9)):
        stress = np.where(chosen, trace[name], np.nan)
        for line in thin(trace["depth_cm"], stress, 300):
            axes.plot(*line.T, color=colour, linewidth=0.6, alpha=strength)


def _draw_mean(axes: Axes, c: str, fit: Row, look: tuple[str, str]) -> None:
    alpha, low, high = (float(fit[f"alpha_{c}_{part}N_per_cm3"]) for part in ("", "lo_", "hi_"))
    depth = (float(fit["depth_from_cm"]) + float(fit["depth_to_cm"])) / 2
    axes.vlines(depth, low * depth, high * depth, color=look[0], linewidth=1.0)
    axes.plot(depth, alpha * depth, look[1], color=look[0], markeredgecolor="white",
              markersize=4, markeredgewidth=0.3)  # fmt: skip


def _finish(axes: Axes, missing: list[str], some: bool) -> None:
    if missing:
        axes.text(
            0.03, 0.97, "\n".join(["no usable run:", *missing]), va="top",
            fontsize=curves.NOTE_PT, color=style.MARK, transform=axes.transAxes,
        )  # fmt: skip
    if not some:
        axes.set(xticks=[], yticks=[])
        return
    axes.set_xlim(0, max(axes.get_xlim()[1], 1.0))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))


def _legend(
    figure: Figure,
    looks: Mapping[str, tuple[str, str]],
    titles: Mapping[str, str] | None,
    level: str,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {
        labels.title_of(medium, titles): Line2D([], [], color=colour, marker=marker, markersize=4)
        for medium, (colour, marker) in looks.items()
    }
    entries["fit through zero"] = Line2D([], [], color="black", linestyle=_FIT, linewidth=0.6)
    entries[f"{level} interval"] = Patch(facecolor="#888888", alpha=0.5)
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", columnspacing=1.2,
        ncols=4 if figure.get_size_inches()[0] > 12 * style.CM else 2, borderaxespad=0.2,
    )  # fmt: skip
