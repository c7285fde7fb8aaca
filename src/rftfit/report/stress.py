"""Stress against depth of chosen runs with their fits (Fig. 2B)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit.errors import InputError
from rftfit.report import labels, style
from rftfit.report.runs import by_run, filed

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.report.runs import FloatArray

_ACROSS = 4
_LEGEND_COLUMNS = {1: 2, 2: 2, 3: 3, 4: 6}
_SIDE_CM, _PITCH_CM, _ROW_CM, _LEFT_CM, _TOP_CM = 3.1, 4.1, 4.9, 1.45, 1.15


def _draw_run(axes: Axes, trace: dict[str, FloatArray], fit: Mapping[Hashable, Any]) -> None:
    depth, window = trace["depth_cm"], trace["in_window"] > 0
    if window.any():
        axes.axvspan(depth[window].min(), depth[window].max(), color="#e6e6e6", linewidth=0)
    axes.axhline(0, color="#808080", linewidth=0.4)
    for c in "zx":
        colour = style.COMPONENT_COLOURS[c]
        axes.plot(depth, trace[f"stress_{c}_N_per_cm2"], color=colour, linewidth=0.6, alpha=0.75)
        alpha, low, high = (float(fit[f"alpha_{c}_{part}N_per_cm3"]) for part in ("", "lo_", "hi_"))
        if np.isfinite(alpha):
            end = float(np.nanmax(depth))
            axes.fill_between([0, end], [0, low * end], [0, high * end], color=colour, alpha=0.35)
            style_of = "-" if c == "z" else "--"
            axes.plot([0, end], [0, alpha * end], style_of, color="black", linewidth=0.8)


def _note(fit: Mapping[Hashable, Any]) -> str:
    lines = []
    for c in "zx":
        alpha, low, high = (float(fit[f"alpha_{c}_{part}N_per_cm3"]) for part in ("", "lo_", "hi_"))
        value = labels.number(alpha, 4)
        if np.isfinite(alpha):
            value += f" \N{PLUS-MINUS SIGN} {labels.number((high - low) / 2, 4)}"
        lines.append(rf"$\alpha_{c}$ = {value} {labels.PER_CM3}")
    return "\n".join(lines)


def _legend(figure: Figure, columns: int, level: str) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    z, x = (style.COMPONENT_COLOURS[c] for c in "zx")
    entries = {
        r"vertical $\sigma_z$": Line2D([], [], color=z),
        r"horizontal $\sigma_x$": Line2D([], [], color=x),
        r"fit of $\sigma_z$ through zero": Line2D([], [], color="black"),
        r"fit of $\sigma_x$ through zero": Line2D([], [], color="black", linestyle="--"),
        f"{level} interval": Patch(facecolor="#888888", alpha=0.5),
        "fit window": Patch(facecolor="#e6e6e6"),
    }
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=columns, borderaxespad=0.3,
        columnspacing=1.2,
    )  # fmt: skip


@style.styled
def draw_stress(
    traces: pd.DataFrame, fits: pd.DataFrame, run_ids: Sequence[str], confidence: float = 0.95
) -> Figure:
    """Draw stress against depth of chosen intrusions and extractions, one panel per run (Fig. 2B).

    The fit window is shaded; the line through zero and the interval of its slope are drawn from
    the row of `fits`. An extraction is drawn as it is filed: its horizontal stress is turned.

    Parameters
    ----------
    traces : pandas.DataFrame
        Tared samples in the lab frame: ``run_id, depth_cm, stress_z_N_per_cm2,
        stress_x_N_per_cm2, in_window``.
    fits : pandas.DataFrame
        Fit table.
    run_ids : sequence of str
        At least one.
    confidence : float
        Level of the intervals in `fits`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        If a run is not in the fit table, has no samples, or is horizontal (its depth is one number).
    """
    names = ["depth_cm", "stress_z_N_per_cm2", "stress_x_N_per_cm2", "in_window"]
    chosen = traces[traces["run_id"].astype(str).isin(list(run_ids))]
    samples = by_run(filed(chosen, fits), names)
    rows = {str(fit["run_id"]): fit for fit in fits.to_dict("records")}
    for run in run_ids:
        if run not in rows:
            raise InputError(f"run {run!r} cannot be drawn: it is not in the fit table")
        if run not in samples:
            raise InputError(f"run {run!r} cannot be drawn: it has no samples")
        if rows[run]["direction"] == "horizontal":
            raise InputError(
                f"run {run!r} cannot be drawn against depth: it is horizontal, at one depth; "
                "choose intrusions and extractions"
            )
    if not run_ids:
        raise InputError("no run was chosen for the figure of stress against depth")
    across = min(len(run_ids), _ACROSS)
    down = -(-len(run_ids) // _ACROSS)
    # one run alone gets the width of two
    side = _SIDE_CM + (_PITCH_CM if across == 1 else 0)
    width = _LEFT_CM + max(across - 1, 1) * _PITCH_CM + _SIDE_CM + 0.4
    lines = -(-6 // _LEGEND_COLUMNS[across])
    figure = style.new_figure(width, down * _ROW_CM + 0.3 + 0.33 * lines)
    for i, run in enumerate(run_ids):
        row, column = divmod(i, _ACROSS)
        left, top = _LEFT_CM + column * _PITCH_CM, _TOP_CM + row * _ROW_CM
        axes = style.axes_cm(figure, left, top, side, _SIDE_CM)
        fit = rows[run]
        _draw_run(axes, samples[run], fit)
        angles = (labels.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        beta, gamma = angles
        style.text_cm(
            figure, left, top - 0.1,
            f"{fit['direction']}, $\\beta$ = {beta}, $\\gamma$ = {gamma}\n{_note(fit)}",
            va="bottom", fontsize=6,
        )  # fmt: skip
        axes.set_xlim(0, None)
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
        axes.margins(y=0.06)
        if row == down - 1 or i + _ACROSS >= len(run_ids):
            axes.set_xlabel("depth (cm)")
        if column == 0:
            axes.set_ylabel(f"stress ({labels.PER_CM2})")
    _legend(figure, _LEGEND_COLUMNS[across], f"{100 * confidence:.4g} %")
    return figure
