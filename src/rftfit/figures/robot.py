"""Figures of the robot: speed over stride frequency and curvature, forces in mid-stance, motion over two strides.

A run has a stride frequency (Hz) and a leg curvature R'/r (1: c-leg, 0: flat, -1: reversed). Tables of a sweep, by
name:

- ``speed``: a row for each simulated run, with its profile, starting phase, ``speed_cm_per_s`` (NaN if not steady) and
  ``outcome``;
- ``errors``: a row for each measured condition on each profile: measured and simulated speed, and whether the robot's
  unknown lengths were calibrated on it;
- ``optimum``: for each frequency on a profile the curvature of the fastest legs.

Groups of elements are the plates of the body by name and the legs of each phase, ``tripod_1``, ``tripod_2``. `looks`
gives colour and marker by curvature, or colour and dashes by group.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures import labels, style
from rftfit.figures.leg_panels import PROFILE_TITLES
from rftfit.figures.registry import figure, when
from rftfit.robot.sweep import MOTION, is_at_condition

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.results import Results

    _Draw = Callable[[Results, str], Figure]

FREQUENCY_LABEL = "stride frequency (Hz)"
CURVATURE_LABEL = r"leg curvature $R'/r$ (dimensionless)"
SPEED_LABEL = "speed (cm/s)"
"""Labels of axes."""

SWEEPS = ("robot", "robot_full")
"""Folders of the reduced sweep, which every run makes, and of the paper's whole one (``rftfit sweep``)."""

SIMULATED_ROBOT = "simulated robot"
"""Stamp of figures that show the simulated robot alone."""


def _describe_simulated_in_speeds(results: Results) -> str:
    """Say what is simulated in a figure that shows published or tracked speeds beside those of the simulated robot."""
    return "simulated robot and tracks" if _has_tracks(results) else SIMULATED_ROBOT


def _describe_simulated_in_motion(results: Results) -> str:
    """Say what is simulated in a figure of the robot's motion; it shows strides of tracks, too, where there are any."""
    has_strides = len(results.table("robot/strides.csv")) > 0
    return "simulated robot and tracks" if has_strides else SIMULATED_ROBOT


def _has_tracks(results: Results) -> bool:
    """Return True if measured speeds are from marker tracks of the campaign; else they are the published ones."""
    robot = results.config.robot
    return robot is not None and robot.runs is not None


def sweep_figure(name: str, reads: Sequence[str], **fields: Any) -> Callable[[_Draw], _Draw]:
    """Declare a figure that is drawn for each of `SWEEPS`; returns a decorator of a function of results and sweep.

    `reads`: Names of tables in the folder of the sweep. `fields`: Further fields of `DeclaredFigure`.
    """

    def declare(draw: _Draw) -> _Draw:
        """Declare the figure once for each sweep, the paper's whole one on demand."""
        for sweep in SWEEPS:
            # the figure is named and drawn for its sweep, as others are for a medium
            draw_sweep = figure(
                f"{{medium}}_{name}",
                reads=tuple(f"{{medium}}/{table}" for table in reads),
                media=lambda campaign, sweep=sweep: (sweep,) if campaign.robot_medium else (),
                on_demand=sweep == "robot_full",
                section="Robot",
                settings=("robot",),
                stamped=_describe_simulated_in_speeds,
                **fields,
            )(draw)
        return draw_sweep

    return declare


def beside_points(caption: str, good: str) -> Callable[[Results, str], str]:
    """Make a function that writes the caption, with the sentence `good` where the figure shows measured speeds."""

    def caption_of(results: Results, sweep: str) -> str:
        """Write the caption of the figure of a sweep."""
        measured = results.table(f"{sweep}/errors.csv")["measured_cm_per_s"]
        return f"{caption} {good}" if measured.notna().any() else caption

    return caption_of


# Speed against stride frequency and against curvature


_NO_SPEED = ("there is no simulated speed to draw",)
"""What is lacking, as `DeclaredFigure.lacking` returns it."""


@sweep_figure(
    "speed",
    reads=("speed.csv", "errors.csv"),
    paper="Fig. 4C",
    caption=beside_points(
        "The robot's mean forward speed against stride frequency, simulated with the measured \N{GREEK SMALL LETTER ALPHA} (lines).",
        "Bars beside: what the errors of \N{GREEK SMALL LETTER ALPHA} and of the legs' arc leave open. "
        "Good: lines through the points.",
    ),
    lacking=lambda results, sweep: (
        () if len(_read_on_measured_table(results, sweep, "speed")[0]) else _NO_SPEED
    ),
)
def plot_speed(results: Results, sweep: str) -> Figure:
    """Draw speed against stride frequency, simulated on the profile of the measured table.

    Without any measured condition only simulated curves are drawn, at seven curvatures.
    """
    speeds, errors = _read_on_measured_table(results, sweep, "speed", "errors")
    looks = _choose_looks(speeds, errors)
    page, ((axes,),) = style.panels([8.0])
    _draw_frequency_panel(axes, speeds, errors, looks)
    axes.set(ylim=_speed_range(speeds, errors), xlabel=FREQUENCY_LABEL, ylabel=SPEED_LABEL)
    axes.set_title(PROFILE_TITLES["table"], loc="left", fontsize=7.5)
    style.legend(page, _make_speed_entries(looks, speeds, errors), **_legend_title(results, errors))
    return page


def _read_on_measured_table(results: Results, sweep: str, *names: str) -> list[pd.DataFrame]:
    """Read tables of a sweep by name, only rows of runs on the profile of the measured table."""
    tables = [results.table(f"{sweep}/{name}.csv") for name in names]
    return [table[table["profile"] == "table"] for table in tables]


@sweep_figure(
    "profiles",
    reads=("speed.csv", "errors.csv"),
    paper="Fig. S13",
    caption=beside_points(
        "The robot's mean forward speed by force profile (rows), against stride frequency (left) and leg curvature "
        "(right).",
        "Good: lines through the points.",
    ),
    lacking=lambda results, sweep: () if len(results.table(f"{sweep}/speed.csv")) else _NO_SPEED,
)
def plot_profiles(results: Results, sweep: str) -> Figure:
    """Draw speed against stride frequency (left) and against curvature (right), one row a profile, all with one range."""
    speed, errors = (results.table(f"{sweep}/{name}.csv") for name in ("speed", "errors"))
    names = list(dict.fromkeys(speed["profile"]))
    looks, limits = _choose_looks(speed, errors), _speed_range(speed, errors)
    page, panels = style.panels([6.0] * len(names), 2, style.DOUBLE_CM)
    for name, (frequency_axes, curvature_axes) in zip(names, panels, strict=True):
        speed_rows, error_rows = (table[table["profile"] == name] for table in (speed, errors))
        _draw_frequency_panel(frequency_axes, speed_rows, error_rows, looks)
        _draw_curvature_panel(curvature_axes, speed_rows, error_rows)
        for axes, label in ((frequency_axes, FREQUENCY_LABEL), (curvature_axes, CURVATURE_LABEL)):
            axes.set_ylim(*limits)
            style.name_below(axes, label, name == names[-1])
        frequency_axes.set_ylabel(SPEED_LABEL)
        frequency_axes.set_title(
            PROFILE_TITLES.get(name, style.plain(name)), loc="left", fontsize=7.5
        )
    entries = _make_speed_entries(looks, speed, errors)
    style.legend(page, entries, **_legend_title(results, errors))
    return page


_MARKERS = "osD^vP*X<>"
"""Markers of curvatures, in ascending order."""

_BACK, _FLAT, _AHEAD = ("#0B3C6F", "#9CC9EA"), "#444444", ("#F2B27A", "#9E2A00")
"""Colours of reversed legs, from the strongest curvature to the weakest, of flat legs, and of c-legs, from the weakest."""


def curvature_looks(curvatures: Sequence[float]) -> dict[float, tuple[str, str]]:
    """Choose colour and marker of each curvature: blue for reversed legs, red for c-legs, darker for stronger curvature."""
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    ordered = sorted(set(curvatures))
    colours = {0.0: _FLAT}
    for sign, ends in ((-1, _BACK), (1, _AHEAD)):
        same_sign = [curvature for curvature in ordered if curvature * sign > 0]
        ramp = LinearSegmentedColormap.from_list("", ends)
        # places on the ramp; a single curvature stands in its middle
        shares = np.linspace(0, 1, len(same_sign)) if len(same_sign) > 1 else [0.5]
        colours |= dict(zip(same_sign, map(to_hex, ramp(shares)), strict=True))
    markers = itertools.cycle(_MARKERS)
    return {curvature: (colours[curvature], next(markers)) for curvature in ordered}


def _choose_looks(speed: pd.DataFrame, errors: pd.DataFrame) -> dict[float, tuple[str, str]]:
    """Choose looks for the curvatures that were measured; without any, for seven curvatures of the sweep."""
    curvatures = sorted(set(errors["curvature_times_R"]) or set(speed["curvature_times_R"]))
    if errors.empty and len(curvatures) > 7:
        curvatures = [curvatures[int(i)] for i in np.linspace(0, len(curvatures) - 1, 7).round()]
    return curvature_looks(curvatures)


def _speed_range(speed: pd.DataFrame, errors: pd.DataFrame) -> tuple[float, float]:
    """Return the range of the axis of speed, cm/s, that holds all simulated and measured speeds."""
    simulated, measured = speed["speed_cm_per_s"], errors["measured_cm_per_s"]
    # where no run was steady, zero stands in for the speeds
    lowest, *highest = np.nan_to_num([simulated.min(), simulated.max(), measured.max()])
    return float(min(-1.0, lowest * 1.05)), float(max(highest) * 1.06) or 1.0


_OPEN_ENDS = ["simulated_from_alpha_lo_cm_per_s", "simulated_from_alpha_hi_cm_per_s"]
_OPEN_COLOUR = "black"
_OPEN: dict[str, Any] = {"linewidth": 1.4}
"""Columns and look of the bar beside a point: the range of the simulated speed that the errors of alpha leave open."""

_RING: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7.5}
_RING |= {"markerfacecolor": "none", "markeredgewidth": 0.9}
"""Look of the ring around a point whose motion over time has a figure of its own."""


def _draw_frequency_panel(
    axes: Axes, speed: pd.DataFrame, errors: pd.DataFrame, looks: Mapping[float, tuple[str, str]]
) -> None:
    """Draw speed against stride frequency, a curve a curvature, with measured points and their errors.

    `speed`, `errors`: Rows of one profile. Beside each measured point a bar shows what the errors of alpha and of the
    legs' arc leave open of the simulated speed; hollow points are those on which the robot was calibrated.
    """
    for curvature, (colour, marker) in looks.items():
        rows = speed[np.isclose(speed["curvature_times_R"], curvature)]
        # frequency and speed, shape (k, 2); no curve without such runs
        curves = [*_average_speeds(rows, "speed_cm_per_s").values()][:1]
        # each curve begins at zero: while its legs rest, the robot rests
        x, y = np.vstack([np.zeros((1, 2)), *curves]).T
        axes.plot(x, y, color=colour, linestyle=_dashes_of(curvature), linewidth=1.0, zorder=2)
        _mark_tipped(axes, rows, "frequency_Hz", colour)
        error_rows = errors[np.isclose(errors["curvature_times_R"], curvature)]
        ends = error_rows[_OPEN_ENDS].to_numpy(float).T
        # at the right of the point, which would hide it
        beside_points_Hz = error_rows["frequency_Hz"] + 0.09
        axes.vlines(beside_points_Hz, *ends, color=_OPEN_COLOUR, zorder=4, **_OPEN)
        for calibrated, fill in (("no", colour), ("yes", "white")):
            points = error_rows[error_rows["calibrated"] == calibrated]
            if points.empty:
                continue
            axes.errorbar(
                points["frequency_Hz"],
                points["measured_cm_per_s"],
                yerr=points["measured_sd_cm_per_s"].fillna(0),
                fmt=marker,
                color=colour,
                markersize=3.4,
                markerfacecolor=fill,
                zorder=3,
                markeredgewidth=0.7,
                elinewidth=0.6,
                capsize=1.2,
            )
    ringed = _select_drawn_over_time(errors)
    axes.plot(ringed["frequency_Hz"], ringed["measured_cm_per_s"], color="black", **_RING)
    axes.set_xlim(0, 5.15)


def _dashes_of(curvature: float) -> Any:
    """Choose the dashes for a leg: in a grey print the colours of a leg, its reverse and a flat leg look alike."""
    if curvature == 0:
        return style.DASHES["dash-dotted"]
    return style.DASHES["dashed" if curvature < 0 else "solid"]


def _average_speeds(table: pd.DataFrame, column: str) -> dict[float, FloatArray]:
    """Average a column of speeds, cm/s, over the starting phases: curvature to rows (frequency in Hz, mean), shape (k, 2).

    The mean is over steady runs; NaN where none is. Without frequency 0, at which the robot rests.
    """
    phases = table[table["frequency_Hz"] > 0].groupby(["curvature_times_R", "frequency_Hz"])
    mean = phases[column].mean().reset_index("frequency_Hz")
    by_curvature: Any = mean.groupby("curvature_times_R")
    return {float(curvature): rows.to_numpy(float) for curvature, rows in by_curvature}


def _mark_tipped(axes: Axes, speed: pd.DataFrame, along: str, colour: Any) -> None:
    """Draw a cross at speed zero for each condition at which the robot turned upside down.

    `speed`: Rows of simulated runs. `along`: Column of the horizontal axis.
    """
    positions = sorted(set(speed.loc[speed["outcome"] == "tipped", along]))
    if positions:
        axes.plot(
            positions,
            np.zeros(len(positions)),
            "x",
            color=colour,
            markersize=3,
            zorder=4,
            clip_on=False,
        )


def interpolate_speed(frequencies: FloatArray, speeds: FloatArray, at_Hz: float) -> float | None:
    """Interpolate the speed at one frequency, from speed zero at frequency zero; None where its neighbours are far apart.

    Measured frequencies differ from leg to leg, but speed against curvature needs a common one. `frequencies` (Hz,
    ascending), `speeds`: Of one curvature, shape (k,). None also beyond the last frequency.
    """
    x, y = np.append(0.0, frequencies), np.append(0.0, speeds)
    # index of the first frequency that is not below `at_Hz`
    above = int(np.searchsorted(x, at_Hz - 1e-6))
    if above == x.size:
        return None
    is_measured_there = x[above] - at_Hz <= 1e-6
    widest_Hz = 1.25
    if x[above] - x[above - 1] > widest_Hz and not is_measured_there:
        return None
    return float(np.interp(at_Hz, x, y))


def _interpolate_speeds(curves: Mapping[float, FloatArray], at_Hz: float) -> FloatArray:
    """Return rows (curvature, speed) at one frequency, shape (k, 2), from the `curves` of `_average_speeds`.

    A curvature without neighbours near enough has no row; speed is NaN where no run is steady.
    """
    speed_rows = [
        (curvature, interpolate_speed(rows[:, 0], rows[:, 1], at_Hz))
        for curvature, rows in curves.items()
    ]
    return np.array([row for row in speed_rows if row[1] is not None], dtype=float).reshape(-1, 2)


READ_HZ = (1.0, 2.0, 3.0, 4.0, 5.0)
"""Frequencies at which speed is drawn against curvature."""

_HZ_MARKERS = "osD^v"
"""Markers of `READ_HZ`."""


def _draw_curvature_panel(axes: Axes, speed: pd.DataFrame, errors: pd.DataFrame) -> None:
    """Draw speed against curvature at `READ_HZ`: simulated lines, measured points; rows of one profile.

    The paper measured at other frequencies for each leg, so all speeds are read off between them.
    """
    from matplotlib import colormaps

    colours = colormaps[style.SEQUENTIAL](np.linspace(0.02, 0.8, len(READ_HZ)))
    measured_rows = errors[errors["measured_cm_per_s"].notna()]
    simulated, measured = (
        _average_speeds(speed, "speed_cm_per_s"),
        _average_speeds(measured_rows, "measured_cm_per_s"),
    )
    tipped = speed[speed["outcome"] == "tipped"]
    for colour, marker, hz in zip(colours, _HZ_MARKERS, READ_HZ, strict=True):
        curve = _interpolate_speeds(simulated, hz)
        axes.plot(*curve.T, color=colour, linewidth=1.0)
        tipped_at_hz = tipped[np.isclose(tipped["frequency_Hz"], hz)]
        _mark_tipped(axes, tipped_at_hz, "curvature_times_R", colour)
        # hollow: speeds of two frequencies can be alike
        axes.plot(
            *_interpolate_speeds(measured, hz).T,
            marker,
            color=colour,
            markersize=4,
            zorder=3,
            markerfacecolor="none",
            markeredgewidth=0.9,
        )
        finite_speeds = curve[np.isfinite(curve[:, 1]), 1]
        if len(finite_speeds):
            axes.text(1.08, finite_speeds[-1], f"{hz:g} Hz", va="center", fontsize=6, color=colour)
    axes.set_xlim(-1.06, 1.42)
    axes.set_xticks(np.arange(-1, 1.01, 0.5))


def _legend_title(results: Results, errors: pd.DataFrame) -> style.Look:
    """Return the title of the legend, which says what lines and points are, as options of `style.legend`."""
    explanations = ["lines: simulated"]
    if not errors.empty:
        explanations.append(f"points: {_describe_origin_of_points(results)}")
    if (errors["calibrated"] == "yes").any():
        explanations.append("hollow: the model was calibrated on it")
    return {"title": "; ".join(explanations), "handlelength": 1.8}


def _describe_origin_of_points(results: Results) -> str:
    """Say where the measured speeds are from."""
    if not _has_tracks(results):
        return "published speeds"
    if results.campaign.reenacted:
        return "marker tracks simulated from published speeds, mean and s.d. of trials"
    return "measured, mean and s.d. of trials"


def _make_speed_entries(
    looks: Mapping[float, tuple[str, str]], speeds: pd.DataFrame, errors: pd.DataFrame
) -> dict[str, Any]:
    """Make the entries of the legend for the colours, lines and points that are drawn by `_draw_frequency_panel`.

    `looks`: Colour and marker by curvature. Each mark has an entry only if it is drawn.
    """
    entries: dict[str, Any] = {}
    for curvature, (colour, marker) in looks.items():
        # shown with the marker where there is one
        marked = style.line(
            colour,
            linestyle=_dashes_of(curvature),
            marker="" if errors.empty else marker,
            markersize=3.4,
        )
        entries[f"$R'/r$ = {style.format_number(curvature, 2)}"] = marked
    if len(_select_drawn_over_time(errors)):
        entries["motion drawn over time"] = style.line("black", **_RING | {"markersize": 6})
    if errors[_OPEN_ENDS].notna().all(axis=1).any():
        entries["left open by the errors of alpha and arc"] = style.line(_OPEN_COLOUR, **_OPEN)
    tipped = speeds.loc[speeds["outcome"] == "tipped", "curvature_times_R"].to_numpy(float)
    tipped_colours = [
        colour for curvature, (colour, _) in looks.items() if np.isclose(tipped, curvature).any()
    ]
    if tipped_colours:
        entries["turned upside down"] = tuple(
            style.dots(colour, 3, marker="x") for colour in tipped_colours
        )
    return entries


def _select_conditions(
    table: pd.DataFrame, conditions: Sequence[tuple[float, float]]
) -> pd.DataFrame:
    """Select the rows at the curvature (R'/r) and near the frequency (Hz) of any of some conditions."""
    pairs = zip(table["curvature_times_R"], table["frequency_Hz"], strict=True)
    is_selected = [is_at_condition(conditions, *pair) for pair in pairs]
    selected: pd.DataFrame = table[np.array(is_selected, dtype=bool)]
    return selected


def _select_drawn_over_time(errors: pd.DataFrame) -> pd.DataFrame:
    """Select rows with a measured speed whose condition has a figure of the motion over time."""
    return _select_conditions(errors.dropna(subset="measured_cm_per_s"), MOTION)


def _tabulate_speeds(results: Results, sweep: str) -> pd.DataFrame:
    """Tabulate simulated speeds on the measured table: a row for each frequency with a best curvature, a column a curvature.

    A cell is the mean over starting phases, cm/s, NaN where no run is steady.
    """
    speeds, best = _read_on_measured_table(results, sweep, "speed", "optimum")
    grid = speeds[np.isin(speeds["frequency_Hz"], best["frequency_Hz"].to_numpy(float))]
    return grid.pivot_table(
        values="speed_cm_per_s", index="frequency_Hz", columns="curvature_times_R"
    )


def _without_steady_run(results: Results, sweep: str) -> Sequence[str]:
    """Say why there is no speed over curvature; empty where there is one."""
    if not _tabulate_speeds(results, sweep).empty:
        return ()
    speeds = _read_on_measured_table(results, sweep, "speed")[0]
    reason, *_ = [*speeds["reason"].value_counts().index, "no run of the sweep"]
    return f"{labels.name_of('table')}: no run of the sweep has a steady speed", str(reason)


@sweep_figure(
    "curvature",
    reads=("speed.csv", "optimum.csv", "errors.csv"),
    paper="Fig. 4D",
    caption=beside_points(
        "The robot's mean forward speed against leg curvature (1: c-leg, 0: flat, -1: reversed). Right: over "
        "curvature and frequency, the fastest curvature in white.",
        "Good: lines through the points.",
    ),
    lacking=_without_steady_run,
)
def plot_curvature(results: Results, sweep: str) -> Figure:
    """Draw speed against curvature (left); as a map over curvature and frequency, with the fastest curvature (right).

    On the profile of the measured table. Bars at the fastest curvature: the range within which starting phases, and
    reading a top off so many points, leave it.
    """
    speed_rows, best, error_rows = _read_on_measured_table(
        results, sweep, "speed", "optimum", "errors"
    )
    best = best.sort_values("frequency_Hz")
    table = _tabulate_speeds(results, sweep)
    page, ((curvature_axes, map_axes),) = style.panels([8.0], 2, style.DOUBLE_CM)
    _draw_curvature_panel(curvature_axes, speed_rows, error_rows)
    curvature_axes.set_ylim(*_speed_range(speed_rows, error_rows))
    curvature_axes.set(xlabel=CURVATURE_LABEL, ylabel=SPEED_LABEL)
    points = "; points: measured, read between frequencies" * bool(len(error_rows))
    curvature_axes.set_title(f"lines: simulated{points}", loc="left", fontsize=6.5)
    # the map needs a speed in every cell
    complete = table.dropna(axis="columns")
    image = map_axes.pcolormesh(
        complete.columns.to_numpy(float),
        complete.index.to_numpy(float),
        complete.to_numpy(float),
        cmap=style.SEQUENTIAL,
        shading="nearest",
        vmin=0,
    )
    best_curvature = best["best_curvature_times_R"]
    lengths = best_curvature - best["reading_lo"], best["reading_hi"] - best_curvature
    map_axes.errorbar(
        best_curvature,
        best["frequency_Hz"],
        xerr=[length.clip(lower=0) for length in lengths],
        fmt="o-",
        color="white",
        markersize=3,
        linewidth=0.8,
        elinewidth=0.8,
        capsize=1.5,
        markeredgecolor="black",
        markeredgewidth=0.4,
    )
    map_axes.set(xlim=(-1.04, 1.04), xlabel=CURVATURE_LABEL, ylabel=FREQUENCY_LABEL)
    map_axes.set_title("simulated; white: fastest curvature", loc="left", fontsize=6.5)
    page.colorbar(image, ax=map_axes, aspect=20, pad=0.02, label=SPEED_LABEL)
    return page


# The robot in mid-stance, the force on every element of the standing tripod


_STANCE = {"body": "#444444", "other tripod": "#9a9a9a", "standing tripod": style.OKABE_ITO["blue"]}
"""Colours of the robot's parts in mid-stance."""


def _split_by_run(table: pd.DataFrame) -> list[tuple[tuple[float, float], pd.DataFrame]]:
    """Split a table of samples or elements by run: (curvature, frequency) of each, c-leg first, with its rows."""
    runs = table.groupby(["curvature_times_R", "frequency_Hz"])
    return [((float(k), float(f)), rows) for (k, f), rows in reversed([*runs])]


def _run_name(curvature: float, frequency: float) -> str:
    """Name a run by its leg, of curvature R'/r, and its stride frequency, Hz."""
    names = {1.0: "c-leg", 0.0: "flat leg", -1.0: "reversed c-leg"}
    leg = names.get(curvature, f"R'/r = {style.format_number(curvature, 2)}")
    return f"{leg}, {frequency:g} Hz"


@figure(
    "robot_stance",
    reads=("robot/stances.csv",),
    media=when(lambda campaign: campaign.robot_medium),
    section="Robot",
    stamped=lambda results: SIMULATED_ROBOT,  # noqa: ARG005
    paper="Fig. 4A",
    caption=(
        "One tripod of the simulated robot below its hips, with the force on every element. "
        "Good: the arrows lean forward, the way the robot runs, and are longest deep in the medium."
    ),
    lacking=lambda results, _: (
        ()
        if len(results.table("robot/stances.csv"))
        else ("there is no simulated run of the robot to draw",)
    ),
)
def plot_robot_stance(results: Results) -> Figure:
    """Draw the elements of the robot in mid-stance with the forces on one tripod, one panel a run.

    Mid-stance: the legs of the first tripod hang straight down (`rftfit.robot.motion.stance_of`).
    """
    from matplotlib.collections import LineCollection

    stances = results.table("robot/stances.csv")
    runs = _split_by_run(stances)
    page, (panels,) = style.panels([5.9], len(runs), 9.2)
    # one scale of arrows for all panels
    pushes = stances.loc[stances["group"] == "tripod_1", ["force_x_N", "force_z_N"]]
    strongest = float(np.hypot(*pushes.to_numpy(float).T).max())
    longest_cm = 3.0
    cm_per_N = longest_cm / strongest if strongest > 0 else 0.0
    for axes, (run, elements) in zip(panels, runs, strict=True):
        axes.set(xlim=(-12.9, 12.9), ylim=(-5.5, 9.5), aspect="equal")
        style.draw_sand(axes, -5.5)
        legs, standing = elements["group"].str.startswith("tripod"), elements["group"] == "tripod_1"
        parts = {"body": ~legs, "other tripod": legs & ~standing, "standing tripod": standing}
        for name, rows in parts.items():
            ends = elements.loc[rows, ["x1_cm", "z1_cm", "x2_cm", "z2_cm"]].to_numpy(float)
            axes.add_collection(
                LineCollection(
                    list(ends.reshape(-1, 2, 2)),
                    colors=_STANCE[name],
                    linewidths=1.7,
                    capstyle="round",
                )
            )
        positions = elements.loc[standing, ["at_x_cm", "at_z_cm"]].to_numpy(float)
        forces = elements.loc[standing, ["force_x_N", "force_z_N"]].to_numpy(float)
        # an arrow of less than 1 % of the longest cannot be seen
        is_loaded = np.hypot(*forces.T) > 0.01 * strongest
        axes.quiver(
            *positions[is_loaded].T,
            *(cm_per_N * forces[is_loaded]).T,
            zorder=3,
            angles="xy",
            scale_units="xy",
            scale=1,
            width=0.0022,
            headwidth=4,
            headlength=5,
            color=style.OKABE_ITO["vermillion"],
        )
        axes.set_title(_run_name(*run), loc="left", fontsize=7.5)
        axes.plot([-12, -10], [-4.9, -4.9], color="black", linewidth=1)
        axes.text(-11, -4.7, "2 cm", ha="center", va="bottom", fontsize=6)
        arrow = {"arrowstyle": "->", "linewidth": 0.7}
        axes.annotate("", xy=(-7, 8.6), xytext=(-11, 8.6), arrowprops=arrow)
        axes.text(-6.7, 8.6, "runs this way", va="center", fontsize=6)
        axes.set_axis_off()
    entries = {name: style.line(_STANCE[name], linewidth=1.7) for name in reversed(_STANCE)}
    longest = f"force on an element, the longest arrow {1000 * strongest:.0f} mN"
    arrow_colour = style.OKABE_ITO["vermillion"]
    arrow_entry = (style.line(arrow_colour), style.dots(arrow_colour, 3, marker=">"))
    style.legend(page, entries | {longest: arrow_entry})
    return page


# Motion and forces over two strides


# a table of motion has a row for each sample of the last two strides of each run, as `rftfit.robot.motion.tail_of` makes
# it, with forces in columns such as force_z_tripod_1_N

_KINEMATICS = (
    ("velocity_x_cm_per_s", "forward speed\n(cm/s)"),
    ("z_cm", "height\n(cm)"),
    ("pitch_deg", "pitch, nose up\n(deg)"),
)
"""Columns of a table of motion that have a panel each, and their labels."""
_GROUPS: tuple[tuple[str, Any], ...] = (
    (style.OKABE_ITO["blue"], style.DASHES["solid"]),
    (style.OKABE_ITO["vermillion"], style.DASHES["dashed"]),
    ("#5C3A1E", style.DASHES["long"]),
    ("#666666", style.DASHES["dotted"]),
    (style.OKABE_ITO["reddish purple"], style.DASHES["dash-dotted"]),
    (style.OKABE_ITO["sky blue"], style.DASHES["solid"]),
)
"""Colours and dashes of the groups of elements, tripods first; more groups than these are not drawn."""

_MOTION_FIELDS: dict[str, Any] = {
    "reads": ("robot/motion.csv", "robot/strides.csv"),
    "media": when(lambda campaign: campaign.robot_medium),
    "section": "Robot",
    "stamped": _describe_simulated_in_motion,
}
"""Fields of the declarations of both figures over two strides."""


@figure(
    "robot_motion",
    paper="Fig. 4B",
    caption=(
        "The robot over two strides; dashed: its mean speed; grey: measured strides, if any. "
        "Forces are means over 10 ms; where the belly stands still, its friction jumps. "
        "Good: the second stride repeats the first."
    ),
    **_MOTION_FIELDS,
)
def plot_robot_motion(results: Results) -> Figure:
    """Draw motion and forces over two strides."""
    return draw_motion(results.table("robot/motion.csv"), results.table("robot/strides.csv"))


@figure(
    "robot_reaction",
    paper="Fig. S14",
    caption=(
        "Ground reaction on both tripods of legs without the body's plates, as means over 10 ms. "
        "Good: the tripods take turns, and each brakes first, if at all, and then pushes forward."
    ),
    **_MOTION_FIELDS,
)
def plot_robot_reaction(results: Results) -> Figure:
    """Draw vertical and horizontal ground reaction of both tripods over two strides, one column a run."""
    motion = results.table("robot/motion.csv")
    tripods = [name for name in group_names(motion) if name.startswith("tripod")]
    page, columns = _new_panels(motion, 2)
    looks = dict(zip(tripods, _GROUPS, strict=False))
    for motion_of_run, panels in columns:
        _draw_forces(panels, motion_of_run, looks)
    labels = "vertical force $F_z$\n(N)", "horizontal force $F_x$\n(N)"
    _finish_axes([panels for _, panels in columns], labels)
    style.legend(page, style.list_labelled(page), columnspacing=1.6)
    return page


@style.styled()
def draw_motion(motion: pd.DataFrame, measured: pd.DataFrame | None = None) -> Figure:
    """Draw motion and forces over two strides, one column a run.

    `motion`: Table of motion of one run or more. `measured`: Mean strides of tracks, speed against the share ``stride``
    of a stride, drawn beside the simulated speed; None: none.
    """
    page, columns = _new_panels(motion, len(_KINEMATICS) + 2)
    looks = dict(zip(group_names(motion), _GROUPS, strict=False))
    # groups whose curve could not be told from zero are named instead of drawn
    unseen = [group for group in looks if not _is_visible(motion, group)]
    looks = {group: looks[group] for group in looks if group not in unseen}
    for motion_of_run, panels in columns:
        run: Any = motion_of_run[["curvature_times_R", "frequency_Hz"]].iloc[0].tolist()
        time, mean = motion_of_run["time_s"].to_numpy(float), _mean_speed(motion_of_run)
        if measured is not None:
            for curve in _align_strides(motion_of_run, _select_conditions(measured, [run]), run[1]):
                panels[0].plot(time, curve, color="#9a9a9a", linewidth=0.9, label="measured")
        for axes, (name, _) in zip(panels, _KINEMATICS, strict=False):
            axes.plot(time, motion_of_run[name], color="black", linewidth=1)
        panels[0].axhline(mean, color="black", linewidth=0.6, linestyle=style.DASHES["dashed"])
        panels[0].set_title(f"{_run_name(*run)}: {mean:.3g} cm/s", fontsize=7)
        _draw_forces(panels[len(_KINEMATICS) :], motion_of_run, looks)
    labels = [*(label for _, label in _KINEMATICS), "lift by group\n(N)", "thrust by group\n(N)"]
    _finish_axes([panels for _, panels in columns], labels)
    entries = style.list_labelled(page)
    if "measured" in entries:
        entries = {"simulated": style.line("black")} | entries
    title = ""
    if unseen:
        names = ", ".join(map(_spaced_name, unseen))
        title = f"not drawn, force below {100 * _VISIBLE:g} % of the largest: {names}"
    style.legend(page, entries, columnspacing=1.6, title=title)
    return page


def _align_strides(
    motion_of_run: pd.DataFrame, strides: pd.DataFrame, frequency: float
) -> list[FloatArray]:
    """Interpolate the measured speed of each track at the simulated moments, in the phase that fits the simulated speed best.

    A track does not say at which angle of the legs it begins. `frequency`: Stride frequency, Hz. `strides`: Mean stride
    of each track: speed against the share ``stride`` of its period. Returns speeds, cm/s, of the length of
    `motion_of_run`.
    """
    phase = motion_of_run["time_s"].to_numpy(float) * frequency
    simulated, best_curves = motion_of_run["velocity_x_cm_per_s"].to_numpy(float), []
    for _, track in strides.groupby("run_id"):
        stride, speeds = (track[name].to_numpy(float) for name in ("stride", "velocity_x_cm_per_s"))
        curves = [np.interp(phase + shift, stride, speeds, period=1.0) for shift in stride]
        best_curves.append(min(curves, key=lambda curve: np.square(curve - simulated).sum()))
    return best_curves


def _draw_forces(
    panels: Sequence[Axes], motion_of_run: pd.DataFrame, looks: Mapping[str, tuple[str, Any]]
) -> None:
    """Draw the forces on groups of elements in two panels: vertical and horizontal, labelled for the legend.

    `looks`: Colour and dashes by group.
    """
    for axes, component in zip(panels, "zx", strict=True):
        for group, (colour, dash) in looks.items():
            force = _average_force(motion_of_run, f"force_{component}_{group}_N")
            look: style.Look = {"color": colour, "linestyle": dash, "linewidth": 0.9}
            axes.plot(motion_of_run["time_s"], force, label=_spaced_name(group), **look)
        axes.axhline(0, color=style.GREY, linewidth=0.4, zorder=0)


_VISIBLE = 0.02
"""Largest force of a group relative to the largest of all groups below which its curve cannot be told from zero."""


def _is_visible(motion: pd.DataFrame, group: str) -> bool:
    """Return True if the force on a group can be told from zero on the scale of all groups and all runs."""
    forces = motion.filter(regex=r"^force_[xz]_\w+_N$").abs()
    forces_on_group = forces[[f"force_{component}_{group}_N" for component in "xz"]]
    return bool(forces_on_group.to_numpy().max() > _VISIBLE * forces.to_numpy().max())


def _average_force(motion_of_run: pd.DataFrame, name: str) -> pd.Series[float]:
    """Average a force over 10 ms about each sample: at zero speed it jumps from step to step.

    `name`: Its column, such as ``force_z_belly_N``.
    """
    time = motion_of_run["time_s"].to_numpy(float)
    half_window = int(0.01 / 2 / float(np.diff(time).mean())) if len(time) > 1 else 0
    return motion_of_run[name].rolling(2 * half_window + 1, center=True, min_periods=1).mean()


def group_names(motion: pd.DataFrame) -> list[str]:
    """List the groups of elements whose forces a table of motion holds: tripods first, then plates."""
    names = motion.filter(regex="^force_z_").columns.str[len("force_z_") : -len("_N")]
    return sorted(names, key=lambda name: not name.startswith("tripod"))


def _mean_speed(motion_of_run: pd.DataFrame) -> float:
    """Return the mean forward speed over a run, cm/s."""
    first, last = motion_of_run[["x_cm", "time_s"]].to_numpy(float)[[0, -1]]
    travelled_cm, duration_s = last - first
    return float(travelled_cm / duration_s)


def _new_panels(
    motion: pd.DataFrame, rows: int
) -> tuple[Figure, list[tuple[pd.DataFrame, list[Axes]]]]:
    """Make a page of `rows` panels a run, a column a run, c-leg first.

    Returns the page, and for each run its rows of `motion` in order of time and its panels from top to bottom.
    """
    runs = _split_by_run(motion)
    page, panels = style.panels([3.3] * rows, len(runs), 9.2)
    columns = []
    for axes, (run, motion_of_run) in zip(panels.T, runs, strict=True):
        axes[0].set_title(_run_name(*run), fontsize=7)
        columns.append((motion_of_run.sort_values("time_s"), list(axes)))
    return page, columns


def _finish_axes(columns: list[list[Axes]], labels: Sequence[str]) -> None:
    """Set one range for each row of panels, label rows at their left and columns with the axis of time below.

    `columns`: Panels of each run, from top to bottom. `labels`: Of the rows.
    """
    for row, label in enumerate(labels):
        ends = np.array([panels[row].get_ylim() for panels in columns])
        for panels in columns:
            panels[row].set_ylim(ends[:, 0].min(), ends[:, 1].max())
            panels[row].margins(x=0)
            is_last_row = row == len(labels) - 1
            panels[row].tick_params(labelleft=panels is columns[0], labelbottom=is_last_row)
        columns[0][row].set_ylabel(label)
        columns[0][row].yaxis.set_label_coords(-0.11, 0.5)
    for panels in columns:
        panels[-1].set_xlabel("time (s)")


def _spaced_name(group: str) -> str:
    """Return the name of a group of elements as people read it."""
    return group.replace("_", " ")
