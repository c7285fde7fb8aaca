"""Figures of single runs from recording to result: one run of each kind, a tare, the clocks and the surface.

Three figures: `plot_protocol` shows how force becomes stress and slope; `plot_tare` the force on rod and mount alone,
which is subtracted; `plot_clocks` how the clocks of force and motion log were set against each other, by pushes
straight down. The stroke of a run is its motion through the medium, from which stress is taken; the pause is a rest at
the surface.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags``, ``legs`` (measured
forces).

`c`: Component, ``z`` (vertical, lift) or ``x`` (horizontal). `Ingested` is one run with its time series in the lab
frame, `Alignment` the estimate of its clock offset with the curves behind it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit import conventions
from rftfit.compare.legs import measured_peak
from rftfit.figures import leg_panels, style
from rftfit.figures.plates import PUSH
from rftfit.figures.registry import figure
from rftfit.figures.traces import (
    STRESS_SETTINGS,
    by_run,
    cell_of_run,
    describe_alpha,
    draw_run,
    draw_thin,
    stress_of,
)
from rftfit.measure.flags import remark
from rftfit.measure.slopes import NORMAL_95

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray
    from rftfit.figures.traces import Row, Trace
    from rftfit.measure.alignment import Alignment
    from rftfit.measure.clocks import ClockFit
    from rftfit.measure.surface import Surface
    from rftfit.measure.trace import Trace as Ingested
    from rftfit.results import Results


# One run of each kind, as recorded, with its tare and its result


_RECORDED = ("time_s", "depth_cm", "x_cm", "angle_deg", "force_z_N", "force_x_N")
_CURVE = ("theta_deg", "force_z_N", "force_x_N")
"""Columns of a recording, and of the result of a run of a leg, that the figure shows. Force: of the medium on the body."""

_PHASES: dict[str, style.Look] = {
    "pause": {"facecolor": "#f3e3b3", "edgecolor": "#a08c4a", "hatch": "//////", "linewidth": 0},
    "stroke": {"facecolor": style.WINDOW, "linewidth": 0},
}
"""Shade of each phase; hatched, since in a grey print the two are alike."""


@dataclass(frozen=True)
class PanelColumn:
    """One column of `plot_protocol`: a run, and all that its three panels show.

    `kind`: Direction of the run: ``intrusion``, ``extraction``, ``horizontal``, or ``rotation`` of a leg.
    `about`: Which body moved, and how: the second line of the heading.
    `run`: The recording in the lab frame, its zero subtracted; ``time_s`` is 0 where the stroke begins.
    `tare`: The recording of the rod alone or of the leg in air, with the columns of `run`; empty if lost.
    `phases`: First and last time of ``pause`` and ``stroke``, s.
    `result`: Tared stress of a plate, with the sign in which it is filed, or force on a leg against ``theta_deg``.
    `fit`: Row of the fit table; empty for a leg.
    `cell`: Row of the table of alpha to which the run belongs; empty for a leg.
    """

    kind: str
    about: str
    run: Trace
    tare: Trace
    phases: dict[str, tuple[float, float]]
    result: Trace
    fit: Row
    cell: Row


def columns_of(results: Results, medium: str) -> list[PanelColumn]:
    """Choose one run of each kind that gave a result, and collect what its column of the figure shows.

    Intrusion, extraction, horizontal run and rotation of a leg, in this order; a kind without such a run has no column.
    """
    samples = results.table(f"traces/{medium}.parquet")
    run_ids = samples["run_id"].astype(str)
    fits, leg_curves = results[medium].fits, results[medium].legs
    stress = by_run(stress_of(results, medium))
    columns = []
    plates = _choose_plate_runs(results.campaign, fits, set(stress))
    for run in (*plates, *_choose_leg_run(results.campaign, medium, leg_curves)):
        trace, phases = _read_recording(samples[run_ids == run.run_id])
        if not trace:
            continue
        tare, _ = _read_recording(samples[run_ids == run.tare_run])
        curve = leg_curves[leg_curves["run_id"] == run.run_id]
        result = stress.get(run.run_id, {name: curve[name].to_numpy(float) for name in _CURVE})
        fit = next(iter(fits[fits["run_id"] == run.run_id].to_dict("records")), {})
        cell = cell_of_run(results[medium].alpha, run.run_id)
        columns.append(
            PanelColumn(run.direction, _describe_run(run), trace, tare, phases, result, fit, cell)
        )
    return columns


def _choose_plate_runs(
    campaign: Campaign, fits: pd.DataFrame, runs_with_stress: set[str]
) -> Iterator[Run]:
    """Choose for each direction, among the runs with stress and alpha, the one nearest to the angles of `PUSH` and its pull.

    `fits`: A row for each run. `runs_with_stress`: Their ids. Yields at most one run for each direction.
    """
    beta, gamma = PUSH
    target_angles = {
        "intrusion": (beta, gamma),
        "extraction": conventions.file_extraction(beta, gamma)[:2],
        "horizontal": (beta, 0.0),
    }
    finite = fits[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]].notna().all(axis=1)
    usable = fits[finite & fits["run_id"].isin(runs_with_stress)]
    for direction, angles_deg in target_angles.items():
        fits_of_direction = usable[usable["direction"] == direction]
        differences = fits_of_direction[["beta_deg", "gamma_deg"]] - np.array(angles_deg)
        # among equally near runs the deepest: its forces are largest
        order = fits_of_direction.assign(
            distance_deg=differences.abs().sum(axis=1).round(1),
            depth=fits_of_direction["depth_to_cm"].round(1),
        ).sort_values(["distance_deg", "depth", "run_id"], ascending=[True, False, True])
        for run_id in order["run_id"].head(1):
            yield campaign.by_id[str(run_id)]


def _choose_leg_run(campaign: Campaign, medium: str, curves: pd.DataFrame) -> Iterator[Run]:
    """Choose a run of the measured leg that the configuration names first; yields none where no leg was measured.

    `curves`: Forces on legs, with ``run_id``.
    """
    run_ids = set(curves.loc[curves["force_z_N"].notna(), "run_id"])
    runs = [run for run in campaign.runs_of(medium) if run.kind == "leg" and run.run_id in run_ids]
    order = list(campaign.config.intruders)
    yield from sorted(runs, key=lambda run: (order.index(run.intruder), run.run_id))[:1]


def _read_recording(samples: pd.DataFrame) -> tuple[Trace, dict[str, tuple[float, float]]]:
    """Return the recording of one run, its time counted from the begin of the stroke, and the phases of `PanelColumn`.

    `samples`: Rows of the table of traces of this run; both results are empty for none.
    """
    if samples.empty:
        return {}, {}
    trace = {name: samples[name].to_numpy(float) for name in _RECORDED}
    phase = samples["phase"].astype(str).to_numpy()
    # without a stroke, time is counted from the first sample
    begin = int(np.argmax(phase == "stroke"))
    trace["time_s"] = trace["time_s"] - trace["time_s"][begin]
    times = {name: trace["time_s"][phase == name] for name in _PHASES}
    phases = {
        name: (float(time.min()), float(time.max())) for name, time in times.items() if time.size
    }
    return trace, phases


def _describe_run(run: Run) -> str:
    """Describe the body and the motion of a run, for the heading: leg, or angles of a plate.

    An extraction has also the angles under which it stands in tables and maps.
    """
    if run.kind == "leg":
        return f"{leg_panels.leg_title(run.intruder)}, swept through the medium"
    beta = rf"$\beta$ = {style.degrees(run.beta_deg)}"
    if run.direction == "horizontal":
        return f"{beta}, {style.format_number(run.depth_cm, 2)} cm deep"
    if run.direction == "intrusion":
        return rf"{beta}, $\gamma$ = {style.degrees(run.gamma_deg)}"
    filed_angles = conventions.file_extraction(run.beta_deg, run.gamma_deg)[:2]
    return f"{beta}, in the maps at ({', '.join(map(style.degrees, filed_angles))})"


@figure(
    "protocol",
    reads=(
        "traces/{medium}.parquet",
        "tared/{medium}.parquet",
        "windows/{medium}.parquet",
        "fits/{medium}.csv",
        "alpha/{medium}.csv",
        "legs/{medium}.csv",
    ),
    settings=STRESS_SETTINGS,
    media=lambda campaign: campaign.media_with_logs("laboratory")[:1],
    section="Measurement",
    caption=(
        "How a force becomes a slope in {medium}, one run of each kind in a column: position, force, result (+-: half of "
        "the interval of alpha in the tables). Good: the dashed force is small, and stress is straight over the shaded window."
    ),
)
def plot_protocol(results: Results, medium: str) -> Figure:
    """Draw runs of several kinds from recording to result, one column each (`columns_of`).

    Panels from top to bottom: position and force against time, as recorded, with the tare beside; then stress against
    depth with its fit, or the force on a leg against its angle.
    """
    columns = columns_of(results, medium)
    if not columns:
        message = "no run of which recording and result could be drawn"
        return style.missing(f"{results.titles[medium]}: {message}")
    page, panels = style.panels((3.3, 4.2, 4.5), len(columns), 4.5)
    page.align_ylabels(panels[:, 0])
    page.suptitle(style.plain(results[medium].title), x=0.01, ha="left", weight="bold")
    small: style.Look = {"loc": "left", "fontsize": style.NOTE_PT}
    for i, column in enumerate(columns):
        position_axes, force_axes, result_axes = panels[:, i]
        style.name_column(position_axes, f"{'ABCD'[i]}  {column.kind}")
        position_axes.set_title(column.about, **small)
        _draw_position(position_axes, column)
        _draw_forces(force_axes, column)
        position_axes.sharex(force_axes)
        position_axes.tick_params(labelbottom=False)
        force_axes.set_xlabel("time since stroke began (s)")
        if i == 0:
            force_axes.set_ylabel("force on intruder (N)")
        if column.kind == "rotation":
            result_axes.set_title(_draw_leg(result_axes, column), **small)
            result_axes.set_ylabel("force, tare taken off (N)")
        else:
            result_axes.set_title(_draw_plate(result_axes, column), **small)
            result_axes.set_ylabel(f"stress ({style.PER_CM2})" if i == 0 else "")
    colours, tares = style.COMPONENT_COLOURS, style.PALE_COLOURS
    entries: dict[str, Any] = {}
    if any(column.kind != "rotation" for column in columns):
        entries["height $z$; below: fit, vertical"] = style.line("black")
        entries["distance $x$; below: fit, horizontal"] = style.line("black", linestyle="--")
    any_tare = any(column.tare for column in columns)
    for c, word in (("z", "vertical"), ("x", "horizontal")):
        entries[f"{word}, run"] = style.line(colours[c])
        if any_tare:
            entries[f"{word}, tare"] = style.line(tares[c], linestyle=style.DASHES["short"])
    phase_names = {"pause": "pause", "stroke": "stroke; below: window of the fit"}
    for phase, name in phase_names.items():
        if any(phase in column.phases for column in columns):
            entries[name] = style.patch(**_PHASES[phase])
    style.legend(page, entries)
    return page


def _shade_phases(axes: Axes, column: PanelColumn) -> None:
    """Shade the times of pause and stroke, and draw the line of zero."""
    for name, times in column.phases.items():
        axes.axvspan(*times, **_PHASES[name])
    style.zero_line(axes)


def _draw_position(axes: Axes, column: PanelColumn) -> None:
    """Draw the angle of a leg, or height (minus depth) and distance x of a plate, against time since the stroke began."""
    _shade_phases(axes, column)
    run, time = column.run, column.run["time_s"]
    if column.kind == "rotation":
        draw_thin(axes, time, run["angle_deg"], color="black")
        axes.set_yticks(range(-90, 91, 90))
        axes.set_ylabel(r"$\theta$ (degrees)")
        return
    for values, dashes in ((-run["depth_cm"], "-"), (run["x_cm"], "--")):
        draw_thin(axes, time, values, color="black", linestyle=dashes, linewidth=0.9)
    style.ticks(axes.yaxis, 5, integer=True)
    axes.set_ylabel("position (cm)", labelpad=1)


def _draw_forces(axes: Axes, column: PanelColumn) -> None:
    """Draw the forces of the run and of its tare against time, both counted from the begin of their strokes."""
    _shade_phases(axes, column)
    if not column.tare:
        style.write_note(axes, "no tare")
    looks = (
        (column.tare, style.PALE_COLOURS, style.DASHES["short"]),
        (column.run, style.COMPONENT_COLOURS, "-"),
    )
    for trace, colours, dashes in looks:
        for c in "zx" if trace else "":
            draw_thin(
                axes,
                trace["time_s"],
                trace[f"force_{c}_N"],
                color=colours[c],
                linestyle=dashes,
                linewidth=0.6,
            )
    time = column.run["time_s"]
    axes.set_xlim(np.nanmin(time), np.nanmax(time))
    style.ticks(axes.xaxis, 5, integer=True)
    style.ticks(axes.yaxis, 5)


def _draw_plate(axes: Axes, column: PanelColumn) -> str:
    """Draw the stress of a plate with its fit. Returns alpha in words, for the heading."""
    trace = column.result
    draw_run(axes, trace, column.fit)
    axes.set_xlabel("distance travelled (cm)" if column.kind == "horizontal" else "depth (cm)")
    style.ticks(axes.yaxis, 5)
    return "\n".join(describe_alpha(column.fit, c, trace, column.cell) for c in "zx")


def _draw_leg(axes: Axes, column: PanelColumn) -> str:
    """Draw the force on a leg, its tare taken off, against its angle. Returns the peaks in words, for the heading.

    A component without any number is named instead of its peak.
    """
    style.zero_line(axes)
    notes = []
    theta = column.result["theta_deg"]
    for c in "zx":
        force = column.result[f"force_{c}_N"]
        axes.plot(theta, force, ".", color=style.COMPONENT_COLOURS[c], markersize=1.4)
        note = f"no force $F_{c}$"
        is_finite = np.isfinite(force)
        if is_finite.any():
            peak = measured_peak(theta[is_finite], force[is_finite], c)
            peak_N, theta_peak = style.format_number(peak.force_N, 2), round(peak.theta_deg)
            note = rf"peak $F_{c}$ = {peak_N} N at $\theta$ = {style.degrees(theta_peak)}"
        notes.append(note)
    axes.set(xlim=leg_panels.THETA_DEG, xticks=range(-90, 91, 45), xlabel=leg_panels.THETA_LABEL)
    axes.xaxis.set_major_formatter("{x:.0f}")
    return "\n".join(notes)


# The tare: the force on rod and mount alone, and the depths where it may be subtracted


def _runs_with_tare(results: Results, medium: str) -> pd.DataFrame:
    """Select from the table of tares the plate runs with a tare over depth: a horizontal run has it over its path.

    ``valid_to`` is the depth to which the tare may be subtracted, cm; NaN where there is none.
    """
    tares = results.table(f"tares/{medium}.csv")
    return tares[(tares["abscissa"] == "depth_cm") & tares["valid_to"].notna()]


def _without_tare(results: Results, medium: str) -> Sequence[str]:
    """Say why no plate run of a medium has a tare to draw; empty where one has."""
    if len(_runs_with_tare(results, medium)):
        return ()
    without_reason = str(remark("no-tare"))
    if results.config.fit.missing_tare == "none":
        without_reason = "nothing to subtract (fit.missing_tare: none)"
    reasons = dict.fromkeys(results.table(f"tares/{medium}.csv")["reason"])
    sentences = [reason or without_reason for reason in reasons]
    return f"{results.titles[medium]}: no plate run has a tare to draw", *sentences


@figure(
    "tare",
    reads=("tared/{medium}.parquet", "tares/{medium}.csv"),
    settings=("fit",),
    media=lambda campaign: campaign.media_with_logs("laboratory")[:1],
    section="Measurement",
    caption=(
        "Force on rod and mount along the deepest path in {medium}, the tare within the shaded depths. "
        "Good: a small part of that on plate and rod (check: rods), and valid over the whole stroke."
    ),
    lacking=_without_tare,
)
def plot_tare(results: Results, medium: str) -> Figure:
    """Draw the tare of the medium's deepest slanted plate run against depth, its valid range shaded.

    The tare is the force on rod and mount alone at the same depth; it is known only as deep as the rod was pushed
    alone.
    """
    samples = results.table(f"tared/{medium}.parquet")
    runs_with_tare = _runs_with_tare(results, medium)
    deepest = runs_with_tare.sort_values(["valid_to", "run_id"], ascending=[False, True]).iloc[0]
    samples_of_run = samples[(samples["run_id"] == deepest["run_id"]).to_numpy()]
    depth = samples_of_run["depth_cm"].to_numpy(float)
    # a tare is NaN at depths that the rod alone did not reach
    valid = samples_of_run["tare_z_N"].notna().to_numpy() & np.isfinite(depth)
    page, ((axes,),) = style.panels([5.2])
    if valid.any():
        low, high = depth[valid].min(), depth[valid].max()
        axes.axvspan(low, high, color=style.WINDOW, linewidth=0, label="valid range")
    style.zero_line(axes)
    for c, name in (("z", "vertical"), ("x", "horizontal")):
        axes.plot(
            depth,
            samples_of_run[f"tare_{c}_N"].to_numpy(float),
            linewidth=0.7,
            color=style.COMPONENT_COLOURS[c],
            label=f"{name} $F_{c}$",
        )
    axes.set(xlabel="depth (cm)", ylabel="force on rod and mount (N)")
    if not valid.any():
        style.write_note(axes, "valid nowhere", 0.5, 0.5, ha="center", va="center")
    title = style.plain(f"{results[medium].title}: tare {deepest['tare_run']}")
    page.suptitle(title, x=0.01, ha="left", fontsize=7)
    style.legend(page, style.list_labelled(page))
    return page


# How well the clocks were aligned and the surface was found, from details of the estimates


_BLUE, _RED = (style.COMPONENT_COLOURS[c] for c in "zx")
"""Colours of what was measured, and of what was fitted to it or stands out."""


@figure(
    "clocks",
    reads=("runs/{medium}.csv", "clocks/{media}.parquet"),
    settings=(
        "raw",
        "dialect",
        "force_log",
        "motion_log",
        "transducer",
        "arm",
        "clock",
        "surface",
        "rigid_contact",
        "intruders",
        "fit",
    ),
    logs=True,
    media=lambda c: c.media_with_logs() if c.config.clock.method == "estimate" else (),
    section="Measurement",
    caption=(
        "Above: by how much each push straight down in {medium} puts the clocks apart from its session. Below: the "
        "push that differs most. Good: intervals (95 %) hold zero, one dot lies lowest, readings follow their curve."
    ),
)
def plot_clocks(results: Results, medium: str) -> Figure:
    """Draw how the clocks of force and motion were aligned for each push straight down in a medium; reads all its logs."""
    from rftfit.measure.alignment import Alignment
    from rftfit.measure.ingest import ingest_traces
    from rftfit.measure.session_clocks import align_pushes

    # no table keeps the curves behind the estimates, so the clocks are aligned once more
    alignment_by_run = {
        run.run_id: alignment for run, alignment in align_pushes(results.campaign, medium)
    }
    traces, *_ = ingest_traces(results.campaign, medium, results.session_clocks)
    aligned = [
        (trace, alignment)
        for trace in traces
        if isinstance(alignment := alignment_by_run.get(trace.run.run_id), Alignment)
    ]
    if not aligned:
        return style.missing(f"{results.titles[medium]}: no run whose clocks were estimated")
    return draw_clocks(aligned)


@style.styled()
def draw_clocks(pushes: Sequence[tuple[Ingested, Alignment]]) -> Figure:
    """Draw the clock offset of each push relative to its session, and below the alignment of the push that differs most.

    The offset is time of the motion log minus time of the force log, s. A session is a series of runs on the same
    clocks, whose offset is estimated from all its pushes. `pushes`: Trace and alignment of each; the one whose
    difference is largest relative to its interval is drawn below.

    First panel below: the share of the force's variance that no smooth function of depth explains, against the lag that
    was tried; dots are the offsets that were fitted, a line is the offset of the session. Second: force over depth at
    the estimated offset, and the smooth function. Third, where a surface was estimated: force beside the surface, and
    its model.
    """
    differences = np.array([_difference_s(trace, alignment) for trace, alignment in pushes])
    half_widths = np.array([NORMAL_95 * (alignment.clock.se_s or 0.0) for _, alignment in pushes])
    worst = int(np.argmax(np.abs(differences) / np.where(half_widths > 0, half_widths, 1.0)))
    trace, alignment = pushes[worst]
    page, panels = style.panels((4.6, 4.9), 3 if trace.surface else 2, 6.1)
    # a single panel takes the place of the first row
    offset_axes = panels[0, 0]
    offset_axes.set_subplotspec(offset_axes.get_gridspec()[0, :])
    for axes in panels[0, 1:]:
        axes.remove()
    _draw_offsets(offset_axes, differences, half_widths, worst)
    _draw_lags(panels[1, 0], alignment, -differences[worst])
    panels[1, 0].set_title(style.plain(trace.run.run_id), loc="left", fontweight="bold")
    panels[1, 1].set_title(_format_offset(alignment.clock), loc="left")
    _draw_lift(panels[1, 1], alignment)
    if trace.surface:
        _draw_contact(panels[1, 2], trace.surface)
    style.legend(page, style.list_labelled(page))
    return page


def _difference_s(trace: Ingested, alignment: Alignment) -> float:
    """Subtract from the clock offset of a push that of its session at the same moment, s.

    The offset of a session may drift, so it is taken at the moment to which the estimate of the push belongs.
    """
    reference_s = alignment.clock.reference_s
    session_offset_s = float(trace.clock.motion_time(np.array([reference_s]))[0]) - reference_s
    return alignment.clock.offset_s - session_offset_s


def _draw_offsets(axes: Axes, differences: FloatArray, half_widths: FloatArray, worst: int) -> None:
    """Draw the offset of each push from its session with its interval, s; mark the push that differs most, of index `worst`.

    `differences`, `half_widths`: Of each push and of its interval, s, shape (pushes,).
    """
    numbers = np.arange(1, len(differences) + 1)
    axes.axhline(0, color="black", linewidth=0.8, linestyle=":")
    low, high = differences - half_widths, differences + half_widths
    axes.vlines(numbers, low, high, color=_BLUE, linewidth=0.8)
    axes.plot(numbers, differences, "o", color=_BLUE, markersize=3, label="push; below: reading")
    axes.vlines(numbers[worst], low[worst], high[worst], color=_RED, linewidth=1.2)
    look: style.Look = {"color": _RED, "markersize": 4, "label": "push that differs most"}
    axes.plot(numbers[worst], differences[worst], "D", **look)
    axes.set_xlim(0.5, len(differences) + 0.5)
    style.ticks(axes.xaxis, 12, integer=True)
    axes.set(xlabel="push straight down (number)", ylabel="offset from session (s)")


def _format_offset(clock: ClockFit) -> str:
    """Write the offset of two clocks with its interval; whole hours, as of a time zone, stand apart.

    `clock`: ``offset_s`` is the whole offset, of which ``hours`` are whole hours; ``se_s`` its standard error, or None.
    """
    hours = f"{style.format_number(clock.hours, 0)} h " if clock.hours else ""
    seconds = style.format_number(clock.offset_s - 3600 * (clock.hours or 0))
    if clock.se_s is None:
        return f"clocks {hours}{seconds} s"
    half_width = style.format_number(NORMAL_95 * clock.se_s)
    return f"clocks {hours}{seconds} \N{PLUS-MINUS SIGN} {half_width} s (95 %)"


def _draw_lags(axes: Axes, alignment: Alignment, session_s: float) -> None:
    """Draw the variance of the force that no curve over depth explains, against the lag from the estimate.

    At the true offset force is a smooth function of depth, so the variance that is left has its minimum there. Dots are
    the ``candidates``, at which fits from several starts ended. `session_s`: Offset of the session minus that of the
    push, s.
    """
    limit_s = max(10.0, 1.2 * abs(session_s))
    lag = alignment.profile.lag - alignment.clock.offset_s
    is_near = np.abs(lag) <= limit_s
    percent = 100 * np.maximum(alignment.profile.unexplained, 1e-6)
    axes.axvline(session_s, color="black", linewidth=0.8, linestyle=":", label="session")
    label = "variance that no curve over depth explains"
    axes.semilogy(lag[is_near], percent[is_near], color=_BLUE, linewidth=0.9, label=label)
    offsets, shares = alignment.candidates
    near_offset = np.abs(offsets - alignment.clock.offset_s) <= limit_s
    fitted_s = (offsets - alignment.clock.offset_s)[near_offset]
    dots: style.Look = {"color": _RED, "markersize": 3, "label": "offsets tried to the end"}
    axes.plot(fitted_s, 100 * shares[near_offset], "o", **dots)
    axes.set(xlabel="lag from the estimate (s)", ylabel="unexplained variance (%)")
    axes.set_xlim(-limit_s, limit_s)
    axes.minorticks_off()


def _draw_lift(axes: Axes, alignment: Alignment) -> None:
    """Draw lift over the last 6 cm of depth, relative to its start, and the smooth function fitted to it."""
    # the first readings are in air
    start = float(np.median(alignment.force[:8]))
    is_deep = alignment.depth > alignment.depth.max() - 6
    curves = alignment.depth, alignment.force, alignment.fitted
    depth, force, fitted = (values[is_deep] for values in curves)
    _draw_lift_and_model(axes, depth, force - start, fitted - start)
    axes.set(xlabel="depth from the arm's zero (cm)", ylabel="lift (N)")


def _draw_lift_and_model(
    axes: Axes, depth: FloatArray, lift: FloatArray, fitted: FloatArray
) -> None:
    """Draw lift over depth as dots, and the function fitted to it as a line."""
    order = np.argsort(depth)
    axes.plot(depth, lift, "o", color=_BLUE, markersize=1, markeredgewidth=0)
    axes.plot(depth[order], fitted[order], color=_RED, linewidth=0.8, label="fitted")


def _draw_contact(axes: Axes, surface: Surface) -> None:
    """Draw lift over depth near the estimated surface, its model, and the interval (95 %) of the surface."""
    # depth below the estimated surface, cm
    depth = surface.depth - surface.depth_cm
    limit_cm = 0.6
    is_near = np.abs(depth) < limit_cm
    force, fitted = (curve[is_near] - surface.air_N for curve in (surface.force, surface.fitted))
    _draw_lift_and_model(axes, depth[is_near], force, fitted)
    lo, hi = surface.interval()
    ends = np.clip([lo - surface.depth_cm, hi - surface.depth_cm], -limit_cm, limit_cm)
    look: style.Look = {"color": _RED, "alpha": style.INTERVAL_OPACITY, "linewidth": 0}
    axes.axvspan(*ends, label="95 % interval of the surface", **look)
    axes.set_xlim(-limit_cm, limit_cm)
    half_width_mm = 10 * (hi - lo) / 2
    axes.set_title(f"surface \N{PLUS-MINUS SIGN} {half_width_mm:.2f} mm (95 %)", loc="left")
    axes.set(xlabel="depth below surface (cm)", ylabel="lift (N)")
