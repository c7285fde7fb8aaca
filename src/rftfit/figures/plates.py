"""Stress against depth: chosen runs (Fig. 2B), all media, plates of several sizes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from rftfit import conventions
from rftfit.conventions import FloatArray
from rftfit.errors import InputError, NothingToDraw
from rftfit.figures import leg_panels, style

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Mapping, Sequence
    from typing import Protocol

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    Row = Mapping[Hashable, Any]

    class _Named(Protocol):
        @property
        def name(self) -> str: ...


# --- Traces of single runs, ready to be drawn: as filed, split at gaps, thinned without losing spikes.


DrawnTrace = dict[str, FloatArray]
"""Samples of one run by column."""

DIRECTIONS = ("extraction", "horizontal", "intrusion")
"""Directions of plate runs, in the order of their filed gamma."""


def filed(traces: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """Turn the horizontal stress of extractions as their alpha_x is turned when it is filed.

    `traces`: Samples in the lab frame with ``run_id`` and stress columns. `fits`: With ``run_id,
    direction``. Returns A copy, so that every trace lies along ``alpha * depth`` of its row in
    `fits`.
    """
    # a sheet may number its runs; a number read from one file is not one read from another
    pulled = fits.loc[fits["direction"] == "extraction", "run_id"].astype(str)
    sign = conventions.file_extraction(0.0, 0.0)[2]
    factor = np.where(traces["run_id"].astype(str).isin(pulled), sign, 1.0)
    names = [name for name in traces.columns if name.endswith("_x_N_per_cm2")]
    return traces.assign(**{name: traces[name].to_numpy(float) * factor for name in names})


def by_run(traces: pd.DataFrame, columns: Iterable[str]) -> dict[str, DrawnTrace]:
    """Take the samples of each run as arrays.

    `traces`: Rows of one run need not be together, but are in time order. `columns`: Those to
    take; a column that is not there is left out. Returns by run, by column.
    """
    ids, code = np.unique(traces["run_id"].astype(str).to_numpy(str), return_inverse=True)
    order = np.argsort(code, kind="stable")
    cuts = np.flatnonzero(np.diff(code[order])) + 1
    parts: dict[str, list[FloatArray]] = {}
    for name in columns:
        if name in traces.columns:
            parts[name] = np.split(traces[name].to_numpy(float)[order], cuts)
    return {str(run): {name: parts[name][i] for name in parts} for i, run in enumerate(ids)}


def thin(x: FloatArray, y: FloatArray, points: int = 80) -> list[FloatArray]:
    """Polylines of at most about `points` points: smallest and largest sample of each stretch.

    Taking the extremes instead of every n-th sample keeps spikes and the width of the noise.

    `x`, `y`: shape (n,); Samples in time order. Returns shape (m, 2): One polyline for each
    stretch between missing samples.
    """
    good = np.isfinite(x) & np.isfinite(y)
    if not good.any():
        return []
    place = np.flatnonzero(good)
    lines = []
    for part in np.split(place, np.flatnonzero(np.diff(place) > 1) + 1):
        bins = max(1, points * part.size // (2 * place.size))
        if part.size > 2 * bins:
            width = part.size // bins
            bins = part.size // width  # so that less than one stretch is left over
            body = part[: bins * width].reshape(bins, width)
            rows = np.arange(bins)
            low = body[rows, y[body].argmin(axis=1)]
            high = body[rows, y[body].argmax(axis=1)]
            rest = part[bins * width :]
            part = np.unique(np.concatenate([part[:1], low, high, rest, part[-1:]]))  # noqa: PLW2901
        lines.append(np.column_stack([x[part], y[part]]))
    return lines


def nice(value: float) -> float:
    """Smallest of 1, 2 or 5 times a power of ten that is not below a value.

    `value`: Positive.
    """
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in (1, 2, 5, 10) if step * decade >= 0.999 * value))


def span(trace: DrawnTrace) -> tuple[float, float]:
    """Round stresses at the bottom and the top of a panel; zero is always inside.

    Returns `low`, `high`: N/cm^2. The smaller side has at least a fifth of the larger one.
    """
    stresses = [trace[name] for name in trace if name.endswith("_N_per_cm2")]
    every = np.concatenate(stresses) if stresses else np.zeros(1)
    every = every[np.isfinite(every)]
    low, high = (nice(max(side, 1e-3)) for side in (-every.min(initial=0), every.max(initial=0)))
    # less than 0.05 N/cm^2 would blow up mere noise
    most = max(low, high, 0.05)
    return (-max(low, most / 5), most) if high >= low else (-most, max(high, most / 5))


def trouble(fit: Mapping[Hashable, Any]) -> str:
    """Say what is wrong with a run, in few words; empty if nothing is.

    `fit`: Row of the fit table.
    """
    parts = [str(fit[name]) for name in ("reason", "flags") if isinstance(fit[name], str)]
    text = "; ".join(part for part in parts if part)
    if not text and not np.isfinite([fit[f"alpha_{c}_N_per_cm3"] for c in "zx"]).all():
        return "no alpha"
    return text


# --- Stress against depth of chosen runs with their fits (Fig. 2B).


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
        value = style.number(alpha, 4)
        if np.isfinite(alpha):
            value += f" \N{PLUS-MINUS SIGN} {style.number((high - low) / 2, 4)}"
        lines.append(rf"$\alpha_{c}$ = {value} {style.PER_CM3}")
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

    `traces`: Tared samples in the lab frame: ``run_id, depth_cm, stress_z_N_per_cm2,
    stress_x_N_per_cm2, in_window``. `fits`: Fit table. `run_ids`: At least one. `confidence`:
    Level of the intervals in `fits`.
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
        raise NothingToDraw("no run was chosen for the figure of stress against depth")
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
        angles = (style.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
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
            axes.set_ylabel(f"stress ({style.PER_CM2})")
    _legend(figure, _LEGEND_COLUMNS[across], f"{100 * confidence:.4g} %")
    return figure


# --- Stress against depth in all media at a few angles, with the line through zero and its interval.


(
    _LINEARITY_LEFT_CM,
    _LINEARITY_SIDE_CM,
    _LINEARITY_PITCH_CM,
    _LINEARITY_TOP_CM,
    _LINEARITY_ROW_CM,
) = 1.5, 2.5, 3.48, 2.15, 3.0
_SKETCH_CM = 1.25
_FIT = (0, (4, 2))
_SAND = "#efe6d2"
_WORDS = {"z": "vertical stress\n$\\sigma_z$", "x": "horizontal stress\n$\\sigma_x$"}


def runs_of_cells(alpha: pd.DataFrame, cells: Iterable[tuple[float, float]]) -> set[str]:
    """Name the runs behind cells of alpha tables.

    `cells`: Beta and gamma as filed, degrees.
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

    `traces`: Tared samples as filed: ``run_id, depth_cm, stress_z_N_per_cm2, stress_x_N_per_cm2,
    in_window``. `fits`: Fit tables of all media. `alpha`: Alpha tables of all media; they give the
    order of the media. `cells`: Beta and gamma as filed, degrees; gamma 0 is a horizontal run.
    `titles`: Names of the media. `confidence`: Level of the intervals in the tables.
    """
    media = [str(name) for name in alpha["medium"].unique()]
    if not media or not cells:
        raise NothingToDraw("there is no medium whose stress could be drawn against depth")
    looks = style.medium_looks(media)
    names = ["depth_cm", "stress_z_N_per_cm2", "stress_x_N_per_cm2", "in_window"]
    samples = by_run(traces, names)
    rows = {str(row["run_id"]): row for row in fits.to_dict("records")}
    width = _LINEARITY_LEFT_CM + (len(cells) - 1) * _LINEARITY_PITCH_CM + _LINEARITY_SIDE_CM + 0.25
    figure = style.new_figure(
        max(width, style.SINGLE_CM), _LINEARITY_TOP_CM + 2 * _LINEARITY_ROW_CM + 1.45
    )
    for i, (beta, gamma) in enumerate(cells):
        left = _LINEARITY_LEFT_CM + i * _LINEARITY_PITCH_CM
        _sketch(
            style.axes_cm(figure, left, 0.62, _LINEARITY_SIDE_CM, _SKETCH_CM), beta, gamma, i == 0
        )
        head = rf"$\beta$ = {style.degrees(beta)}, $\gamma$ = {style.degrees(gamma)}"
        style.text_cm(figure, left, 0.5, f"{'ABCDEFGH'[i % 8]}  {head}", va="bottom", fontsize=6.5)
        own = _rows_at(alpha, beta, gamma)
        for j, c in enumerate("zx"):
            height = _LINEARITY_ROW_CM - 0.35
            axes = style.axes_cm(
                figure, left, _LINEARITY_TOP_CM + j * _LINEARITY_ROW_CM, _LINEARITY_SIDE_CM, height
            )
            axes.axhline(0, color="#808080", linewidth=0.4)
            drawn = [
                _draw_medium(axes, c, gamma == 0, own.get(medium), looks[medium], samples, rows)
                for medium in media
            ]
            lost = [medium for medium, good in zip(media, drawn, strict=True) if not good]
            _finish(axes, [style.title_of(name, titles) for name in lost], any(drawn))
            axes.tick_params(labelbottom=j == 1)
            if j == 1:
                axes.set_xlabel("depth (cm)")
            if i == 0:
                axes.set_ylabel(f"{_WORDS[c]} ({style.PER_CM2})")
                axes.yaxis.set_label_coords(-0.8 / _LINEARITY_SIDE_CM, 0.5)
    _linearity_legend(figure, looks, titles, f"{100 * confidence:.4g} %")
    return figure


def _sketch(axes: Axes, beta_deg: float, gamma_deg: float, frame: bool) -> None:
    """Plate and direction of motion below the free surface, seen from the side."""
    beta, gamma = np.radians([beta_deg, gamma_deg])
    tangent = 0.5 * np.array([np.cos(beta), -np.sin(beta)])
    velocity = 0.85 * np.array([-np.cos(gamma), -np.sin(gamma)])
    axes.axhspan(-1, 0.8, color=_SAND, linewidth=0)
    axes.axhline(0.8, color="#8a7443", linewidth=0.6)
    axes.plot(*np.stack([-tangent, tangent], axis=1), color="black", linewidth=1.8)
    half = 1.05 * _LINEARITY_SIDE_CM / _SKETCH_CM
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
        axes.text(end[0] + 0.08, end[1] + 0.08, name, fontsize=leg_panels.NOTE_PT)
    axes.set(xlim=(-half, half), ylim=(-1.0, 1.1))
    axes.set_axis_off()


def _draw_medium(
    axes: Axes, c: str, flat: bool, row: Row | None, look: tuple[str, str],
    samples: Mapping[str, DrawnTrace], fits: Mapping[str, Row],
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


def _draw_trace(axes: Axes, trace: DrawnTrace, name: str, colour: str) -> None:
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
            fontsize=leg_panels.NOTE_PT, color=style.MARK, transform=axes.transAxes,
        )  # fmt: skip
    if not some:
        axes.set(xticks=[], yticks=[])
        return
    axes.set_xlim(0, max(axes.get_xlim()[1], 1.0))
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))


def _linearity_legend(
    figure: Figure,
    looks: Mapping[str, tuple[str, str]],
    titles: Mapping[str, str] | None,
    level: str,
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: dict[str, Line2D | Patch] = {
        style.title_of(medium, titles): Line2D([], [], color=colour, marker=marker, markersize=4)
        for medium, (colour, marker) in looks.items()
    }
    entries["fit through zero"] = Line2D([], [], color="black", linestyle=_FIT, linewidth=0.6)
    entries[f"{level} interval"] = Patch(facecolor="#888888", alpha=0.5)
    figure.legend(
        list(entries.values()), list(entries), loc="lower center", columnspacing=1.2,
        ncols=4 if figure.get_size_inches()[0] > 12 * style.CM else 2, borderaxespad=0.2,
    )  # fmt: skip


# --- Stress over depth of repeated penetrations, one panel a plate, with the fit through zero.


_COLOURS = tuple(
    style.OKABE_ITO[name] for name in ("blue", "vermillion", "bluish green", "reddish purple")
)
_PANEL_CM, _GAP_CM, _PLATES_LEFT_CM, _PLATES_TOP_CM = 4.9, 0.5, 1.5, 0.9


@style.styled
def draw_plates(
    stress: Mapping[str, tuple[FloatArray, FloatArray]],
    runs: Mapping[str, Sequence[_Named]],
    alphas: Mapping[str, tuple[float, float, float]],
    sizes: Mapping[str, float],
) -> Figure:
    """Draw the stress of every run within its window and alpha of each plate.

    `stress`: By run: cm, N/cm^2, within the window. `runs`: By plate: its runs, each with a
    ``name``. `alphas`: By plate, with the ends of its 95 % interval, N/cm^3. `sizes`: cm.
    """
    width = _PLATES_LEFT_CM + len(runs) * (_PANEL_CM + _GAP_CM) + 0.3
    height = _PLATES_TOP_CM + _PANEL_CM + 2.6
    figure = style.new_figure(width, height)
    names = {run.name for own in runs.values() for run in own}
    tallest = max(float(stress[name][1].max()) for name in names)
    deepest = max(float(stress[name][0].max()) for name in names)
    for place, (plate, own) in enumerate(runs.items()):
        left = _PLATES_LEFT_CM + place * (_PANEL_CM + _GAP_CM)
        axes = style.axes_cm(figure, left, _PLATES_TOP_CM, _PANEL_CM, _PANEL_CM)
        for index, run in enumerate(own):
            axes.plot(
                *stress[run.name], ".", markersize=2.5, color=_COLOURS[index % len(_COLOURS)],
                label=run.name,
            )  # fmt: skip
        alpha, lo, hi = alphas[plate]
        depth = np.array([0.0, deepest])
        axes.plot(depth, alpha * depth, color="black", linewidth=0.9, label="fit through zero")
        axes.fill_between(depth, lo * depth, hi * depth, color="0.85", linewidth=0)
        axes.set_xlim(0, deepest * 1.03)
        axes.set_ylim(0, tallest * 1.08)
        axes.set_title(f"{sizes[plate]:g} cm plate", fontsize=9)
        axes.set_xlabel("depth (cm)")
        if place:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("vertical stress (N/cm$^2$)")
        axes.legend(fontsize=6.5, loc="upper left", frameon=False)
    text = (
        "Grey: 95 % interval of alpha. Good: runs of one plate on top of each other; proportional to "
        "depth:\nalong the line; independent of the plate: the same line in each panel."
    )
    figure.text(0.02, 0.25 / height, text, fontsize=7.5, va="bottom")
    return figure
