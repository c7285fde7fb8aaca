"""Penetration of the natural sands: stress against depth and the fit of its linear part (Fig. S11)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit.errors import NothingToDraw
from rftfit.figures import style

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LEFT_CM, _GAP_CM, _TOP_CM, _SIDE_CM, _ACROSS = 1.1, 0.75, 1.2, 5.1, 3
_FITS: dict[str, tuple[str, Any]] = {
    "stated": (style.OKABE_ITO["vermillion"], "-"),
    "detected": (style.OKABE_ITO["bluish green"], (0, (4, 1.2))),
}
"""Colour and line of the fit over each window."""


@style.styled
def draw_penetration(
    samples: pd.DataFrame,
    media_of: Mapping[str, str],
    sands: pd.DataFrame,
    media: Sequence[str] | None = None,
    titles: Mapping[str, str] | None = None,
    confidence: float = 0.95,
) -> Figure:
    """Draw the stress on a plate pushed straight down into each sand against depth (Fig. S11).

    The stated window is shaded; the zero-intercept fits over the stated and over the detected
    window are drawn with their intervals, solid or dashed inside their window and thinner beyond it;
    a vertical line marks the detected end of the linear regime.

    `samples`: ``run_id, depth_cm, stress_z_N_per_cm2, in_window``; ``in_window`` marks the samples
    of the fit over the stated window. `media_of`: Medium of each run that is drawn. `sands`:
    ``results/sands.csv``. `media`: Panels; by default those of `sands`, then others of `media_of`.
    `titles`: Names of the media. `confidence`: Level of the intervals in `sands`.
    """
    if media is None:
        media = list(dict.fromkeys([*map(str, sands["medium"]), *media_of.values()]))
    if not media:
        raise NothingToDraw("there is no natural sand whose penetration could be drawn")
    across = min(len(media), _ACROSS)
    down = -(-len(media) // _ACROSS)
    width = _LEFT_CM + across * (_SIDE_CM + _GAP_CM) - _GAP_CM + 0.25
    pitch = _SIDE_CM + 2.1
    figure = style.new_figure(
        max(width, style.SINGLE_CM), down * pitch + (0.5 if across > 1 else 1.2)
    )
    medium_of_sample = samples["run_id"].astype(str).map(dict(media_of))
    for i, medium in enumerate(media):
        row, column = divmod(i, _ACROSS)
        left, top = _LEFT_CM + column * (_SIDE_CM + _GAP_CM), _TOP_CM + row * pitch
        axes = style.axes_cm(figure, left, top, _SIDE_CM, _SIDE_CM)
        fits = {str(f["window"]): f for f in sands[sands["medium"] == medium].to_dict("records")}
        _draw_panel(axes, samples[medium_of_sample == medium], fits)
        axes.set_xlabel("depth (cm)")
        if column == 0:
            axes.set_ylabel(f"vertical stress $\\sigma_z$ ({style.PER_CM2})")
        style.text_cm(
            figure, left, top - 0.75, style.title_of(medium, titles), va="bottom", weight="bold"
        )
        style.text_cm(figure, left, top - 0.1, _note(fits), va="bottom", fontsize=5.5)
    _legend(figure, f"{100 * confidence:.4g} %", 6 if across == _ACROSS else 3 if across > 1 else 2)
    return figure


def _draw_panel(
    axes: Axes, samples: pd.DataFrame, fits: Mapping[str, Mapping[Hashable, Any]]
) -> None:
    names = ("depth_cm", "stress_z_N_per_cm2")
    finite = samples[np.isfinite(samples[list(names)].to_numpy(float)).all(axis=1)]
    missing = []
    if finite.empty:
        missing.append("no penetration test" if samples.empty else "no stress in this test")
    stated, detected = (_value(fits.get(name), "linear_to_cm") for name in _FITS)
    deepest = float(finite["depth_cm"].max()) if len(finite) else np.nan
    ends = [end for end in (deepest, stated, detected) if np.isfinite(end)]
    last = max(ends) if len(finite) else 1.2 * max([*ends, 1.0])
    inside = finite[finite["in_window"].astype(bool)]["depth_cm"]
    if len(inside):
        axes.axvspan(inside.min(), inside.max(), color="#e6e6e6", linewidth=0)
    elif np.isfinite(stated):
        axes.axvspan(0, stated, color="#e6e6e6", linewidth=0)
    for _, run in finite.groupby("run_id", sort=True):
        axes.plot(*(run[name] for name in names), color=style.COMPONENT_COLOURS["z"], linewidth=0.9)
    stress = finite[names[1]].to_numpy(float)
    top = [float(stress.max())] if stress.size else []
    for name, (colour, line) in _FITS.items():
        alpha, low, high = (
            _value(fits.get(name), key) for key in ("alpha_z_N_per_cm3", "lo", "hi")
        )
        if not np.isfinite(alpha):
            missing.append(f"no fit over the {name} window")
            continue
        window = stated if name == "stated" else detected
        end = window if np.isfinite(window) else last
        axes.fill_between(
            [0, end], [0, low * end], [0, high * end], color=colour, alpha=0.25, linewidth=0
        )
        axes.plot([0, end], [0, alpha * end], color=colour, linestyle=line, linewidth=1.1)
        axes.plot(
            [end, last], [alpha * end, alpha * last], color=colour, linestyle=line, linewidth=0.5
        )
        top.append(alpha * end)
    if np.isfinite(detected):
        axes.axvline(detected, color=_FITS["detected"][0], linestyle=":", linewidth=0.9)
    axes.set(xlim=(0, last), ylim=(min(0.0, *stress, 0.0), 1.06 * max(top) if top else 1.0))
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    if not top:
        axes.set_yticks([])
    if missing:
        axes.text(
            0.04, 0.96, "\n".join(missing), va="top", transform=axes.transAxes, color=style.MARK,
            fontsize=6, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1},
        )  # fmt: skip


def _value(row: Mapping[Hashable, Any] | None, name: str) -> float:
    return float("nan") if row is None else float(row[name])


def _note(fits: Mapping[str, Mapping[Hashable, Any]]) -> str:
    lines = []
    for name in _FITS:
        alpha, low, high, end = (
            _value(fits.get(name), key) for key in ("alpha_z_N_per_cm3", "lo", "hi", "linear_to_cm")
        )
        if np.isfinite(alpha):
            span = (
                f"{style.number(low)}\N{EN DASH}{style.number(high)}"
                if np.isfinite(low)
                else "no interval"
            )
            lines.append(
                f"{name}, {style.number(end, 2)} cm: "
                rf"$\alpha_z$ = {style.number(alpha)} ({span}) {style.PER_CM3}"
            )
    return "\n".join(lines)


def _legend(figure: Figure, level: str, across: int) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {
        "measured": Line2D([], [], color=style.COMPONENT_COLOURS["z"]),
        "stated window": Patch(facecolor="#e6e6e6"),
    }
    for name, (colour, line) in _FITS.items():
        entries[f"fit through zero, {name}"] = Line2D([], [], color=colour, linestyle=line)
    detected = _FITS["detected"][0]
    entries["detected end"] = Line2D([], [], color=detected, linestyle=":")
    entries[f"{level} interval"] = Patch(facecolor="#888888", alpha=0.4)
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", ncols=across, handlelength=2.2,
        columnspacing=1.2, borderaxespad=0.25,
    )  # fmt: skip
