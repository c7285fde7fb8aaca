"""Figures of stress on plates against depth: in single runs, and in all media at a few angles; which runs are shown.

Stress is tared force over the area of one face, N/cm^2; alpha its slope over depth through zero, N/cm^3. `c`:
Component, ``z`` (vertical) or ``x`` (horizontal). A cell is a direction (beta, gamma) of a medium with its row of the
table of alpha, the mean of its runs.

`Results` is a campaign with its tables; `results[medium]` has those of one medium, such as ``alpha`` (a row a
direction), ``fits`` (a row a plate run).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit import conventions
from rftfit.errors import InputError
from rftfit.figures import style
from rftfit.figures.registry import figure, when
from rftfit.figures.traces import (
    STRESS_SETTINGS,
    alpha_with_interval,
    by_run,
    cell_of_run,
    describe_alpha,
    draw_run,
    draw_thin,
    measures_x,
    stress_of,
)
from rftfit.measure.alpha import cell_at

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.campaign.load import Campaign
    from rftfit.figures.traces import Row, Trace
    from rftfit.results import Results

# Single runs with their fits


_LEGS_COLOUR = style.OKABE_ITO["bluish green"]
"""Colour of the depths that legs reach."""

PUSH = (30.0, 45.0)
"""Beta and gamma, degrees, of the push in the paper's figure; its pull is filed under the negative angles."""


def stress_runs(campaign: Campaign) -> list[str]:
    """Choose the runs that are shown, by run_id: those the config names, or a push and its pull near `PUSH`.

    Empty where no plate moved up or down. Raises InputError for names in ``figures.stress_runs`` that cannot be shown.
    Maps mark the same runs.
    """
    chosen = campaign.config.figures.stress_runs
    if chosen:
        message_head = "config, figures.stress_runs: found"
        if unknown := ", ".join(name for name in chosen if name not in campaign.by_id):
            raise InputError(f"{message_head} {unknown}; allowed: run_id of the run sheet")
        horizontal = [name for name in chosen if campaign.by_id[name].direction == "horizontal"]
        if horizontal:
            allowed = "horizontal runs at one depth; allowed: intrusions and extractions"
            raise InputError(f"{message_head} {', '.join(horizontal)}, {allowed}")
        return list(chosen)
    # run_id of the first intrusion and extraction at each pair of angles, in the first medium that has any
    runs_by_angles: dict[tuple[float, float], dict[str, str]] = {}
    for medium in campaign.config.media:
        for run in campaign.runs_of(medium):
            if run.kind == "plate" and run.direction != "horizontal":
                runs = runs_by_angles.setdefault((run.beta_deg, run.gamma_deg), {})
                runs.setdefault(run.direction, run.run_id)
        if runs_by_angles:
            break
    else:
        return []

    def rank(angles: tuple[float, float]) -> tuple[int, float]:
        """Rank a pair of angles: push and pull before a single run, then by the distance from `PUSH`; least is best."""
        return -len(runs_by_angles[angles]), math.dist(angles, PUSH)

    nearest = runs_by_angles[min(runs_by_angles, key=rank)]
    # intrusion before extraction
    return [nearest[direction] for direction in sorted(nearest, reverse=True)]


@figure(
    "stress_of_runs",
    reads=(
        "tared/{media}.parquet",
        "windows/{media}.parquet",
        "fits/{media}.csv",
        "alpha/{media}.csv",
    ),
    settings=(*STRESS_SETTINGS, "figures"),
    media=when(lambda campaign: campaign.media_with_samples() and stress_runs(campaign)),
    paper="Fig. 2B",
    section="Measurement",
    caption=(
        "Stress against depth of single runs, each with its own line, and alpha as in the tables (+-: half of its interval). "
        "Good: the stress is straight over the shaded depths, which were fitted."
    ),
)
def plot_stress_of_runs(results: Results) -> Figure:
    """Draw stress against depth of chosen intrusions and extractions, one panel per run.

    If none of them has a fit, the first run in order of names that has one stands in.
    """
    campaign = results.campaign
    chosen = stress_runs(campaign)
    samples: dict[str, Trace] = {}
    fits: dict[str, Row] = {}
    for medium in {campaign.by_id[run].medium for run in chosen}:
        samples |= by_run(stress_of(results, medium))
        fits |= {row["run_id"]: row for row in results[medium].fits.to_dict("records")}
    fitted_runs = sorted(fits.keys() & samples.keys())
    slanted = [run for run in fitted_runs if fits[run]["direction"] != "horizontal"]
    # a run that was refused has no fit or samples to draw
    drawn_runs = [run for run in chosen if run in slanted] or slanted[:1]
    if not drawn_runs:
        reasons = [f"{run}: {fits[run]['reason']}" for run in chosen if run in fits]
        return style.missing("no run has a tared stroke to draw against depth", reasons)
    most_in_row = 4
    page, panels = style.panels_in_rows(len(drawn_runs), most_in_row, 5.4, 4.5)
    # depth of the tip of each leg that hangs straight down; the deepest is marked at the head of each panel
    tips_cm = [leg.max_length_cm - leg.hip_height_cm for leg in campaign.config.legs.values()]
    deepest = max(tips_cm, default=0.0)
    for i, (run, axes) in enumerate(zip(drawn_runs, panels, strict=True)):
        fit = fits[run]
        draw_run(axes, samples[run], fit)
        beta, gamma = (style.degrees(float(fit[f"{name}_deg"])) for name in ("beta", "gamma"))
        head = [style.plain(run), f"{fit['direction']}, $\\beta$ = {beta}, $\\gamma$ = {gamma}"]
        cell = cell_of_run(results[campaign.by_id[run].medium].alpha, run)
        head += [describe_alpha(fit, c, samples[run], cell) for c in "zx"]
        axes.set_title("\n".join(head), loc="left", fontsize=6, pad=4)
        if deepest:
            ends, transform = [0, min(deepest, axes.get_xlim()[1])], axes.get_xaxis_transform()
            axes.fill_between(ends, 0.96, 1, color=_LEGS_COLOUR, linewidth=0, transform=transform)
        axes.margins(y=0.06)
        if i + most_in_row >= len(drawn_runs):
            axes.set_xlabel("depth (cm)")
        if i % most_in_row == 0:
            axes.set_ylabel(f"stress ({style.PER_CM2})")
    any_x = any(measures_x(samples[run]) for run in drawn_runs)
    names = {"z": r"vertical $\sigma_z$"} | ({"x": r"horizontal $\sigma_x$"} if any_x else {})
    entries = {name: style.line(style.COMPONENT_COLOURS[c]) for c, name in names.items()}
    for c, dashes in zip(names, ("-", "--"), strict=False):
        entries[rf"fit of $\sigma_{c}$ through zero"] = style.line("black", linestyle=dashes)
    entries["fit window"] = style.patch(facecolor=style.WINDOW)
    if deepest:
        entries["depths of legs"] = style.patch(facecolor=_LEGS_COLOUR)
    style.legend(page, entries, borderaxespad=0.3)
    return page


# All media at a few angles


CELLS = ((0.0, 90.0), (30.0, 45.0), (90.0, 0.0), (-30.0, -45.0), (0.0, -90.0))
"""Directions in the paper's figure: beta and gamma as filed, degrees; gamma 0 is a horizontal run."""

# looks of the line of a fit, and of the point at its end or at the depth of a horizontal run
_FIT_LOOK: style.Look = {"color": "black", "linestyle": style.DASHES["dashed"], "linewidth": 0.6}
_POINT: style.Look = {"markeredgecolor": "white", "markersize": 4, "markeredgewidth": 0.3}
_STRESS_LABELS = {"z": "vertical stress\n$\\sigma_z$", "x": "horizontal stress\n$\\sigma_x$"}


@figure(
    "linearity",
    reads=(
        "tared/{laboratory}.parquet",
        "windows/{laboratory}.parquet",
        "fits/{laboratory}.csv",
        "alpha/{laboratory}.csv",
    ),
    settings=(*STRESS_SETTINGS, "fit", "grid"),
    media=when(lambda campaign: campaign.media_with_samples("laboratory")),
    section="Measurement",
    caption=(
        "Is stress in proportion to depth? Lines are alpha times depth; samples outside the window of the fit are "
        "faint. Good: samples lie along their line."
    ),
)
def plot_linearity(results: Results) -> Figure:
    """Draw stress against depth, one column per direction of `nearest_cells` and one colour per medium.

    Rows of panels: a sketch of the plate, vertical stress, horizontal stress. Each panel has the samples of the runs
    behind the cell, and alpha of the cell as a line; a medium without such a run is named in the panel.
    """
    media = results.laboratory
    alpha = results.joined("alpha/{medium}.csv", media)
    cells = nearest_cells(alpha)
    tolerance_deg = results.config.grid.angle_tolerance_deg
    rows_of_cells = [_rows_by_medium(alpha, *cell, tolerance_deg) for cell in cells]
    # only runs of these cells are drawn
    run_ids = {
        run for rows in rows_of_cells for row in rows.values() for run in row["run_ids"].split()
    }
    samples: dict[str, Trace] = {}
    for medium in media:
        stress = stress_of(results, medium)
        samples |= by_run(stress[stress["run_id"].isin(run_ids)])
    fits = results.joined("fits/{medium}.csv", media)
    fits_of_cells = fits[fits["run_id"].isin(run_ids)]
    fit_of_run = {row["run_id"]: row for row in fits_of_cells.to_dict("records")}
    looks = style.medium_looks(media)
    drawn_media: set[str] = set()
    page, panels = style.panels((2.0, 3.5, 3.5), len(cells), 3.7)
    for c, axes in zip("zx", panels[1:, 0], strict=True):
        axes.set_ylabel(f"{_STRESS_LABELS[c]} ({style.PER_CM2})")
    page.align_ylabels(panels[1:, 0])
    for i, ((beta, gamma), rows_by_medium) in enumerate(zip(cells, rows_of_cells, strict=True)):
        sketch, *stress_axes = panels[:, i]
        _draw_sketch(sketch, beta, gamma, i == 0)
        head = rf"$\beta$ = {style.degrees(beta)}, $\gamma$ = {style.degrees(gamma)}"
        sketch.set_title(f"{'ABCDE'[i]}  {head}", loc="left", fontsize=6.5)
        for c, axes in zip("zx", stress_axes, strict=True):
            style.zero_line(axes)
            media_without_run = []
            for medium in media:
                row = rows_by_medium.get(medium)
                if row and np.isfinite(alpha_with_interval(row, c)[0]):
                    _draw_cell(axes, c, row, looks[medium], samples, fit_of_run)
                    drawn_media.add(medium)
                else:
                    media_without_run.append(style.medium_label(results, medium))
            _finish_axes(axes, media_without_run, len(media_without_run) < len(media))
            style.name_below(axes, "depth (cm)", c == "x")
    drawn_looks = {medium: look for medium, look in looks.items() if medium in drawn_media}
    if not drawn_looks:
        return page
    entries = {
        style.medium_label(results, medium): style.line(colour, marker=marker, **_POINT)
        for medium, (colour, marker) in drawn_looks.items()
    }
    entries["fit through zero"] = style.line(**_FIT_LOOK)
    name = f"{style.level(results)} interval of alpha"
    style.legend(page, entries | {name: style.bands(colour for colour, _ in drawn_looks.values())})
    return page


def nearest_cells(alpha: pd.DataFrame) -> list[tuple[float, float]]:
    """Find for each direction of `CELLS` the nearest one of the campaign; each only once, in the order of `CELLS`.

    `alpha`: Table of alpha of all media; `CELLS` themselves where it is empty. Returns pairs of beta and gamma,
    degrees.
    """
    angles = alpha[["beta_deg", "gamma_deg"]].to_numpy(float)
    if not len(angles):
        return list(CELLS)
    distances = np.array([np.hypot(*(angles - cell).T) for cell in CELLS])
    cells = [(float(beta), float(gamma)) for beta, gamma in angles[distances.argmin(axis=1)]]
    return list(dict.fromkeys(cells))


def _rows_by_medium(
    alpha: pd.DataFrame, beta_deg: float, gamma_deg: float, tolerance_deg: float
) -> dict[str, Row]:
    """Select the row of each medium in one direction, by medium; without media that were not pushed there.

    `alpha`: Table of alpha of all media. `tolerance_deg`: By how much the angles may differ.
    """
    cells = {
        str(medium): cell_at(table, beta_deg, gamma_deg, tolerance_deg)
        for medium, table in alpha.groupby("medium")
    }
    return {medium: cell.to_dict() for medium, cell in cells.items() if cell is not None}


def _draw_sketch(axes: Axes, beta_deg: float, gamma_deg: float, frame: bool) -> None:
    """Draw a plate and its direction of motion below the free surface, from the side, as a sketch of both angles.

    The plate is 1 long; its tangent is (cos beta, -sin beta). `frame`: Draw the axes of the lab, too.
    """
    beta, gamma = np.radians([beta_deg, gamma_deg])
    half_plate = 0.5 * np.array([np.cos(beta), -np.sin(beta)])
    velocity = 0.85 * np.stack(conventions.direction(gamma))
    style.draw_sand(axes, -1, 0.8)
    axes.plot(*np.stack([-half_plate, half_plate], axis=1), color="black", linewidth=1.8)
    half_width = 2.1
    if frame:
        style.draw_frame(axes, 0.12 - half_width, -0.88, 0.55)
    arrow_style = style.ARROW | {"arrowstyle": "-|>", "color": style.MARK}
    axes.annotate("", xy=(velocity[0], velocity[1]), xytext=(0, 0), arrowprops=arrow_style)
    axes.set(xlim=(-half_width, half_width), ylim=(-1.0, 1.1), aspect="equal")
    axes.set_axis_off()


def _draw_cell(
    axes: Axes,
    c: str,
    row: Row,
    look: tuple[str, str],
    samples: Mapping[str, Trace],
    fits: Mapping[str, Row],
) -> None:
    """Draw one component of stress in one direction and medium: the samples of its runs, alpha times depth, and its interval.

    `row`: Row of the table of alpha. `look`: Colour and marker. `samples`, `fits`: Samples and rows of fits by run_id.
    A horizontal run stays at one depth: it is a point with its interval instead of a curve.
    """
    alpha, low, high = alpha_with_interval(row, c)
    colour, marker = look
    is_horizontal = row["gamma_deg"] == 0
    # greatest depth of each run, cm: the line is drawn to the deepest
    ends = []
    for run in row["run_ids"].split():
        fit, trace = fits[run], samples.get(run)
        ends.append(float(fit["depth_to_cm"]))
        if is_horizontal:
            depth = (float(fit["depth_from_cm"]) + float(fit["depth_to_cm"])) / 2
            mean, stress_low, stress_high = (value * depth for value in alpha_with_interval(fit, c))
            axes.vlines(depth, stress_low, stress_high, color=colour, linewidth=1.0)
            axes.plot(depth, mean, marker, color=colour, **_POINT)
        elif trace is not None:
            inside = trace["in_window"] > 0
            for shown, opacity in ((~inside, 0.3), (inside, 0.9)):
                stress = np.where(shown, trace[f"stress_{c}_N_per_cm2"], np.nan)
                draw_thin(
                    axes, trace["depth_cm"], stress, 300, color=colour, linewidth=0.6, alpha=opacity
                )
    end = np.nanmax(ends) if np.isfinite(ends).any() else 1.0
    style.draw_band(axes, [0, end], [0, low * end], [0, high * end], colour)
    axes.plot([0, end], [0, alpha * end], **_FIT_LOOK)
    if not is_horizontal:
        axes.plot(end, alpha * end, marker, zorder=4, color=colour, **_POINT)


def _finish_axes(axes: Axes, media_without_run: list[str], any_drawn: bool) -> None:
    """Write which media have no run in a panel, by title, and set its ticks; no ticks where nothing is drawn."""
    if media_without_run:
        style.write_note(axes, "\n".join(["no usable run:", *media_without_run]))
    if not any_drawn:
        axes.set(xticks=[], yticks=[])
        return
    axes.set_xlim(0, max(axes.get_xlim()[1], 1.0))
    style.ticks(axes.xaxis, 5, integer=True)
    style.ticks(axes.yaxis, 4, steps=[1, 2, 2.5, 5, 10])
