"""Maps of alpha over beta and gamma (figures, colours, colour bars): measured, estimated, nine-term fit, depth-only.

A map is a panel with gamma (direction of motion) across and beta (attack angle) up, both from -90 to 90 degrees, and
alpha_z or alpha_x (N/cm^3), or a number made of it, as colour. An alpha table has a row for each measured direction of
a medium, with ``beta_deg``, ``gamma_deg`` and ``alpha_z_N_per_cm3``, ``alpha_x_N_per_cm3``; NaN where no run could be
used. Where its directions lie on a grid, each row is a cell of the map, else a dot. `component`, or `c`: ``z`` or
``x``.

Three parts: the figures; tables as grids; and what is drawn in one map. Arrays over a map have shape (beta, gamma).

`Results` is a campaign with its tables; `results[medium]` has those of one medium, such as ``alpha`` (a row a
direction).
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit import conventions
from rftfit.figures import labels, style
from rftfit.figures.plates import stress_runs
from rftfit.figures.registry import figure, greek, when
from rftfit.measure.alpha import directions
from rftfit.model.fourier import TERMS, evaluate
from rftfit.model.profiles import DepthOnlyProfile, TableProfile
from rftfit.model.symmetry import WIDEST_DEG

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy.typing as npt
    import pandas as pd
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray
    from rftfit.results import Results

    Model = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
    """Function of beta and gamma, rad, that returns alpha_z and alpha_x, N/cm^3."""


# The figures


SIDE_CM = 2.95
"""Side of one map, cm: both angles run from -90 to 90 degrees."""

PITCH_CM = 4.08
"""Distance from one map to the next in a row, cm, with room for the colour bar and its numbers."""

LEFT_CM, ROW_CM, TOP_CM, BOTTOM_CM = 1.25, SIDE_CM + 0.95, 1.0, 0.85
"""Left edge of the first map, height of a row of maps, room above the first row and below the last one, cm."""


_MAPS_CAPTION = (
    "Measured alpha over attack angle beta and direction gamma, and half of the interval of alpha. "
    "Red pushes up or toward +x, blue opposite. Good: smooth from cell to cell, but for a step near gamma = 0."
)


@figure(
    "alpha_maps",
    reads=("alpha/{laboratory}.csv",),
    settings=("fit",),
    # a single medium has a figure of its own
    media=when(lambda campaign: campaign.of_role("laboratory")[1:]),
    paper="Fig. S4",
    section="Force profiles",
    caption=_MAPS_CAPTION,
)
def plot_alpha_maps(results: Results) -> Figure:
    """Draw maps of the measured alpha of all laboratory media."""
    return _draw_maps(results, results.joined("alpha/{medium}.csv", results.laboratory), "measured")


@figure(
    "alpha_maps",
    reads=("alpha/{medium}.csv",),
    settings=("fit", "figures", "table"),
    media=lambda campaign: campaign.of_role("laboratory")[:1],
    paper="Figs. 2C and 2D",
    section="Force profiles",
    caption=lambda results, medium: (
        greek(_MAPS_CAPTION)
        + " Circles: runs of the stress figure." * bool(_shown_runs(results, medium))
    ),
)
def plot_alpha_maps_of_one(results: Results, medium: str) -> Figure:
    """Draw maps of the measured alpha of one medium, with small plates and, as circles, the runs of the stress figure."""
    shown_runs = _shown_runs(results, medium)
    # entries of the legend for the marks that are added below
    plate = style.line("black", linewidth=1.5), style.line("black", marker=">", linestyle="")
    entries: dict[str, Any] = {"plate and its motion": plate}
    if shown_runs:
        entries["run of the stress figure"] = style.dots("black", 6, markerfacecolor="none")
    page = _draw_maps(results, results[medium].alpha, "measured", entries)
    # the first axes of the page are its maps: alpha_z, its half width, alpha_x, its half width
    for axes in page.axes[:4:2]:
        _add_plates(axes)
        for run in shown_runs:
            # a pull stands in the table at other angles than in the run sheet
            beta, gamma = run.beta_deg, run.gamma_deg
            if run.direction == "extraction":
                beta, gamma, _ = conventions.file_extraction(beta, gamma)
            axes.plot(gamma, beta, "o", markersize=6, markerfacecolor="none", color="black")
    widen_for_marks(page)
    return page


def _shown_runs(results: Results, medium: str) -> list[Run]:
    """Return the runs of a medium that the figure of stress against depth shows; none for a table of alpha."""
    campaign, table = results.campaign, results.config.table
    names = [] if table is not None and table.holds == "alpha" else stress_runs(campaign)
    return [run for name in names if (run := campaign.by_id[name]).medium == medium]


def _media_with_few_pushes(campaign: Campaign) -> tuple[str, ...]:
    """List the media that were pushed in one to nineteen directions, such as natural sands: these get an estimated map."""
    pushes = {
        (run.medium, run.beta_deg, run.gamma_deg, run.direction)
        for run in campaign.runs
        if run.kind == "plate"
    }
    direction_counts = Counter(medium for medium, *_ in pushes)
    # a map of measured alpha in fewer directions shows little
    enough = 20
    return tuple(name for name in campaign.media_with_runs if 0 < direction_counts[name] < enough)


def _without_map(results: Results, _: str) -> Sequence[str]:
    """Say why no medium with few pushes has an estimated map; empty where one has."""
    if _media_with_estimated_map(results):
        return ()
    reasons = (results.map_reason(name) for name in _media_with_few_pushes(results.campaign))
    return ("no map was estimated", *dict.fromkeys(filter(None, reasons)))


def _media_with_estimated_map(results: Results) -> list[str]:
    """List the media with few pushes whose map could be estimated."""
    media = _media_with_few_pushes(results.campaign)
    return [name for name in media if len(results.map_table(name))]


@figure(
    "estimated_maps",
    reads=("maps/{media}.csv", "alpha/{media}.csv"),
    settings=("fit",),
    media=when(_media_with_few_pushes),
    section="Force profiles",
    caption=(
        "alpha in all directions of media with few pushes (circles), estimated by the shape that known media share, "
        "and the half width of the interval of alpha. Good: narrow where elements of a body move."
    ),
    lacking=_without_map,
)
def plot_estimated_maps(results: Results) -> Figure:
    """Draw maps of the estimated alpha of media with few pushes, one row a medium, their pushes as circles."""
    media = _media_with_estimated_map(results)
    tables = results.joined("maps/{medium}.csv", tuple(media))
    page = _draw_maps(
        results, tables, "estimated", {"pushed": style.line(marker="o", linestyle="", **_PUSHED)}
    )
    # the first axes of the page are its maps, in each row: alpha_z, its half width, alpha_x, its half width
    for row, name in enumerate(media):
        for axes in page.axes[4 * row : 4 * row + 4 : 2]:
            add_pushes(axes, results[name].alpha)
    widen_for_marks(page)
    return page


_PUSHED: style.Look = {"color": "black", "markersize": 4, "markerfacecolor": "white"}
"""Look of the mark of a direction that was pushed."""


def add_pushes(axes: Axes, alpha: pd.DataFrame) -> None:
    """Mark the directions of an alpha table that were pushed and gave alpha, on a map that was estimated from them."""
    pushed = alpha.dropna(subset=["alpha_z_N_per_cm3"])
    axes.plot(pushed["gamma_deg"], pushed["beta_deg"], "o", zorder=3, **_PUSHED)


def _draw_maps(
    results: Results, tables: pd.DataFrame, origin: str, entries: Mapping[str, Artist] | None = None
) -> Figure:
    """Draw maps of alpha and of the half widths of its interval, one row a medium: those of z, then those of x.

    Measured cells are drawn as they are (the gamma grid is not uniform), with the zero contour interpolated between
    them; directions that lie on no grid are dots over an interpolated surface.

    `tables`: Alpha tables of all media, one below the other, with a column ``medium``. `origin`: ``measured`` or
    ``estimated``, for the heads. `entries`: Entries of the legend for marks that the caller adds to the page.
    """
    heads = []
    # half widths below 0.05 are in thousandths: four digits after the point would run into the next map
    scales = {c: 1e3 if labels.alpha_half_width(tables, c).max() < 0.05 else 1 for c in "zx"}
    for c in "zx":
        unit = f"{'10$^{-3}$ ' * (scales[c] > 1)}{style.PER_CM3}"
        half_width_head = (
            f"half width of the {style.level(results)} interval\nof $\\alpha_{c}$ ({unit})"
        )
        heads += [f"{origin}\n{style.alpha_label(c)}", half_width_head]
    media = [str(medium) for medium in tables["medium"].unique()]
    page, axes_of_maps = _new_page(results, media, heads)
    for medium, row_of_axes in zip(media, axes_of_maps, strict=True):
        table = tables[tables["medium"] == medium]
        # alpha_z and alpha_x at `middles`; None where cells are drawn
        interpolated = None
        if not lies_on_grid(table):
            interpolated = TableProfile.from_table(table).alpha(*middles())
        for index, c in enumerate("zx"):
            name = f"alpha_{c}_N_per_cm3"
            alpha_axes, half_width_axes = row_of_axes[2 * index : 2 * index + 2]
            # `surface`: beta and gamma, degrees, and alpha on them, for the zero contour
            if interpolated is None:
                surface = cells_of_map(table, name)
            else:
                surface = _FINE, _FINE, interpolated[index]
                limits = colours(table[name].to_numpy(float), signed=True)
                add_surface(alpha_axes, interpolated[index], limits)
            add_bar(page, alpha_axes, add_table(alpha_axes, table, table[name], signed=True), c)
            add_signs(alpha_axes, c, *surface)
            half_width = scales[c] * labels.alpha_half_width(table, c)
            cells = add_table(half_width_axes, table, half_width, signed=False)
            add_bar(page, half_width_axes, cells)
    add_legend(page, entries)
    return page


def _add_plates(axes: Axes) -> None:
    """Draw small plates at representative angles, each with the direction in which it moves, to show what the angles mean."""
    gamma, beta = np.reshape(np.meshgrid([-67.5, -22.5, 22.5, 67.5], [-60.0, 0.0, 60.0]), (2, -1))
    b, g = np.radians(beta), np.radians(gamma)
    half_plate = 0.17 * style.CM
    # of matplotlib's arrows: lengths in inches, directions on paper; a plate is an arrow without a head
    arrow: style.Look = {"units": "inches", "scale_units": "inches", "scale": 1, "angles": "uv"}
    plate = 2 * half_plate * np.cos(b), -2 * half_plate * np.sin(b)
    no_head: style.Look = dict.fromkeys(("headwidth", "headlength", "headaxislength"), 0)
    axes.quiver(gamma, beta, *plate, pivot="mid", width=0.016, **no_head, **arrow)
    moved = np.stack(conventions.direction(g)) * 1.6 * half_plate
    head: style.Look = {"headwidth": 7, "headlength": 7, "headaxislength": 6}
    axes.quiver(gamma, beta, *moved, width=0.006, **head, **arrow)


def has_holes(table: pd.DataFrame, column: str) -> bool:
    """Return True if any direction of an alpha table has no number in a column."""
    return bool(table[column].isna().any())


def _without_fit(results: Results, _: str) -> Sequence[str]:
    """Say why no medium has a nine-term fit by the configured method; empty where one has."""
    fits = labels.of_method(results, "coefficients.csv")
    reasons = why_no_fit(results, fits, "value_N_per_cm3")
    return (f"no nine-term fit by {results.config.fourier.method}", *reasons) if reasons else ()


@figure(
    "fit_maps",
    reads=("alpha/{laboratory}.csv", "coefficients.csv"),
    settings=("fourier",),
    media=when(lambda campaign: campaign.of_role("laboratory")),
    section="Force profiles",
    caption=(
        "The nine-term Fourier fit by {method}, and measured minus fit. Good: what is left is small beside alpha."
    ),
    lacking=_without_fit,
)
def plot_fit_maps(results: Results) -> Figure:
    """Draw maps of the nine-term alpha, each beside measured minus fit."""
    method = results.config.fourier.method
    models = {
        medium: partial(evaluate, kept_coefficients(results, medium))
        for medium in results.laboratory
    }
    return _draw_models(results, models, f"nine-term fit ({method})", "measured minus fit")


def _depth_only(results: Results, medium: str) -> DepthOnlyProfile:
    """Make the depth-only profile of a medium, the baseline that knows no angles, from its measured table."""
    return DepthOnlyProfile.of(TableProfile.from_table(results[medium].alpha))


def _without_depth_only(results: Results, medium: str) -> Sequence[str]:
    """Say why a medium has no depth-only model; empty where it has one."""
    profile = _depth_only(results, medium)
    if np.isfinite(profile.values).all():
        return ()
    return f"{results.titles[medium]}: no depth-only model", profile.reason


@figure(
    "depth_only_maps",
    reads=("alpha/{medium}.csv",),
    media=lambda campaign: campaign.of_role("laboratory")[:1],
    paper="Fig. S1",
    section="Force profiles",
    caption=(
        "alpha of the depth-only model in {medium}, made from measured pushes straight down, up and sideways; "
        "beside it what the model misses, since it knows depth and projected area but no angle."
    ),
    lacking=_without_depth_only,
)
def plot_depth_only_maps(results: Results, medium: str) -> Figure:
    """Draw maps of the depth-only alpha, each beside measured minus depth-only."""
    profile = _depth_only(results, medium)
    heads = "depth-only", "measured minus depth-only"
    return _draw_models(results, {medium: profile.alpha}, *heads)


_BELOW: dict[str, Any] = {"color": "black", "linestyle": "", "marker": ".", "markersize": 1.5}
"""Look of a direction in which less was measured than a model gives, as a grey print does not show the sign."""


def _draw_models(
    results: Results, models: Mapping[str, Model], name: str, residual_name: str
) -> Figure:
    """Draw maps of a model, one row a medium, each beside the map of measured minus model.

    `models`: Function of beta and gamma, rad, that returns alpha_z and alpha_x, by medium. `name`, `residual_name`:
    Heads of the two sorts of maps. A dot marks where less was measured than the model gives.
    """
    heads = [f"{head}\n{style.alpha_label(c)}" for c in "zx" for head in (name, residual_name)]
    page, axes_of_maps = _new_page(results, list(models), heads)
    more_in_legend: dict[str, Any] = {}
    for (medium, model), row_of_axes in zip(models.items(), axes_of_maps, strict=True):
        surfaces, table = model(*middles()), results[medium].alpha
        for index, c in enumerate("zx"):
            model_axes, residual_axes = row_of_axes[2 * index : 2 * index + 2]
            add_bar(page, model_axes, add_surface(model_axes, surfaces[index]), c)
            add_signs(model_axes, c, _FINE, _FINE, surfaces[index])
            column = f"alpha_{c}_N_per_cm3"
            residual = table[column] - model(*directions(table))[index]
            add_bar(page, residual_axes, add_table(residual_axes, table, residual, signed=True))
            below = table[residual < 0]
            residual_axes.plot(below["gamma_deg"], below["beta_deg"], clip_on=False, **_BELOW)
            if len(below):
                more_in_legend["measured lies below"] = style.line(**_BELOW)
    add_legend(page, more_in_legend)
    return page


def why_no_fit(results: Results, fits: pd.DataFrame, column: str) -> list[str]:
    """Say for every medium why its fit has no number in a column; empty where any medium has one.

    `fits`: Rows of a table of fits, with ``medium`` and ``reason``. Used by all figures that need nine terms or zeta.
    """
    if fits[column].notna().any():
        return []
    rows = fits.drop_duplicates("medium")
    titles = results.campaign.titles
    reasons = [
        f"{titles.get(medium, medium)}: {reason}"
        for medium, reason in zip(rows["medium"], rows["reason"], strict=True)
    ]
    return reasons or ["no laboratory medium"]


def kept_coefficients(results: Results, medium: str) -> FloatArray:
    """Return the nine coefficients by the configured method, shape (9,) in the order of `TERMS`, N/cm^3.

    0 for a term that the fit dropped; all NaN without a fit. `medium`: Or `GENERIC`, whose coefficients have no unit.
    """
    table = labels.of_method(results, "coefficients.csv")
    rows = table[table["medium"] == medium].set_index("coefficient")
    values = rows["value_N_per_cm3"].where(rows["kept"].astype(bool), 0.0)
    return values.reindex(list(TERMS)).to_numpy(float)


_FINE = np.arange(-89.5, 90, 1.0)
"""Angles of `middles`, degrees."""


def middles() -> tuple[FloatArray, FloatArray]:
    """Return beta and gamma, rad, at the middles of all cells of 1 degree; each of shape (180, 180), rows by beta."""
    beta, gamma = np.meshgrid(np.radians(_FINE), np.radians(_FINE), indexing="ij")
    return beta, gamma


def _new_page(
    results: Results, media: Sequence[str], heads: Sequence[str]
) -> tuple[Figure, list[list[Axes]]]:
    """Make a page of empty maps, a row a medium and a column a head. Returns the page, and the axes of its maps by row.

    `heads`: Heads of the columns, which may have two lines.
    """
    page = style.new_figure(style.DOUBLE_CM, TOP_CM + len(media) * ROW_CM + BOTTOM_CM)
    for column, head in enumerate(heads):
        middle = LEFT_CM + column * PITCH_CM + SIDE_CM / 2
        style.text_cm(page, middle, 0.2, head, ha="center", va="top", fontsize=7)
    axes_of_maps = []
    for row, medium in enumerate(media):
        name, name_cm = style.medium_label(results, medium), TOP_CM + 0.34 + row * ROW_CM
        style.text_cm(page, LEFT_CM, name_cm, name, va="bottom", fontsize=7, weight="bold")
        row_of_axes = []
        for column in range(len(heads)):
            left, top = LEFT_CM + column * PITCH_CM, TOP_CM + 0.4 + row * ROW_CM
            row_of_axes.append(style.axes_cm(page, left, top, SIDE_CM, SIDE_CM))
            angle_axes(row_of_axes[-1], column == 0, row == len(media) - 1)
        axes_of_maps.append(row_of_axes)
    return page, axes_of_maps


# Tables of alpha as grids: cells, their edges, and a finer grid between them


LIMIT_DEG = 90.0
"""End of the measured region on both sides, in both angles, degrees."""


def pivot(table: pd.DataFrame, column: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arrange one column of a medium's alpha table as a grid.

    Returns ascending beta and gamma, degrees, and the numbers of the column, shape (beta, gamma), NaN where the table
    has no such direction. A row for beta = 90 degrees is repeated at -90, which is the same plate. Raises ValueError
    for a direction that stands in the table twice.
    """
    # rounded: a printed 18.43 and the exact angle are the same cell
    rounded = table.assign(beta=table["beta_deg"].round(2), gamma=table["gamma_deg"].round(2))
    if rounded.duplicated(["beta", "gamma"]).any():
        raise ValueError(f"{column}: a cell (beta, gamma) appears twice in the table of one medium")
    # pivot_table would drop directions without a number
    grid = rounded.pivot(index="beta", columns="gamma", values=column)  # noqa: PD010
    beta, gamma, numbers = (part.to_numpy(float) for part in (grid.index, grid.columns, grid))
    if beta[-1] == LIMIT_DEG and -LIMIT_DEG not in beta:
        # a plate at beta = -90 degrees is the same plate as at 90
        return np.append(-LIMIT_DEG, beta), gamma, np.concatenate([numbers[-1:], numbers])
    return beta, gamma, numbers


def cells_of_map(table: pd.DataFrame, column: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Arrange one column as `pivot` does, with rows and columns of NaN in gaps that are too wide to interpolate.

    A cell reaches half way to its neighbours; without the NaN, cells beside a gap would cover it as if it were
    measured.
    """
    *angles, numbers = pivot(table, column)
    for axis, lines in enumerate(angles):
        # angles inside all gaps along this axis
        inserted = [np.zeros(0)]
        for low, high in pairwise(lines):
            if high - low > WIDEST_DEG:
                steps = int(np.ceil((high - low) / (WIDEST_DEG / 2)))
                inserted.append(np.linspace(low, high, steps + 1)[1:-1])
        new_lines = np.concatenate(inserted)
        places = np.searchsorted(lines, new_lines)
        angles[axis] = np.insert(lines, places, new_lines)
        numbers = np.insert(numbers, places, np.nan, axis=axis)
    beta, gamma = angles
    return beta, gamma, numbers


def lies_on_grid(table: pd.DataFrame) -> bool:
    """Return True if the directions of one medium fill a grid: at least half of all pairs of its betas and gammas.

    Then each row of its table can be drawn as a cell; scattered directions are drawn as dots.
    """
    lines = [table[f"{angle}_deg"].round(2).nunique() for angle in ("beta", "gamma")]
    return 2 * len(table) >= lines[0] * lines[1]


def edges(centres: npt.ArrayLike) -> FloatArray:
    """Return the borders of cells, shape (n + 1,), degrees: midway between the n measured angles, not beyond +-90 degrees.

    `centres`: Ascending. The outer cells are as wide to both sides; a single one is 10 degrees wide.
    """
    centres = np.asarray(centres, dtype=float)
    if centres.size == 1:
        return np.array([centres[0] - 5.0, centres[0] + 5.0])
    middles = (centres[1:] + centres[:-1]) / 2
    ends = 2 * centres[[0, -1]] - middles[[0, -1]]
    borders = np.array([ends[0], *middles, ends[1]], dtype=float)
    return borders.clip(-LIMIT_DEG, LIMIT_DEG)


_FINE_DEG = 2.5
"""Widest step of a grid on which the zero contour is drawn, degrees."""


def _refine_angles(centres: FloatArray) -> FloatArray:
    """Return the measured angles with further ones between them, at most `_FINE_DEG` apart."""
    counts = np.ceil(np.diff(centres) / _FINE_DEG).astype(int)
    finer = [
        np.linspace(low, high, count, endpoint=False)
        for (low, high), count in zip(pairwise(centres), counts, strict=True)
    ]
    return np.concatenate([*finer, centres[-1:]])


def refine(
    beta_deg: FloatArray, gamma_deg: FloatArray, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Interpolate `values`, shape (beta, gamma), bilinearly onto a finer grid through the measured angles.

    The contour of zero over coarse cells would be a jagged line. Returns beta, gamma (degrees) and values of the finer
    grid; values are NaN beside a missing cell.
    """
    beta, gamma = _refine_angles(beta_deg), _refine_angles(gamma_deg)
    along_gamma = np.array([np.interp(gamma, gamma_deg, row) for row in values])
    return beta, gamma, np.array([np.interp(beta, beta_deg, column) for column in along_gamma.T]).T


def along_motion(component: str, gamma_deg: FloatArray, alpha: FloatArray) -> FloatArray:
    """Multiply a component of the force by that of the velocity: positive where alpha does not oppose the motion.

    Such a force would drive the plate; it occurs where the plate is inclined, and the maps hatch it. `alpha`: Component
    `component`, shape (beta, gamma). The product is zero where the velocity has no such component.
    """
    vx, vz = conventions.direction(np.radians(gamma_deg))
    velocity = vz if component == "z" else vx
    # cos(90 deg) is 6e-17 in floating point: such a velocity has no direction
    velocity = np.where(np.abs(velocity) < 1e-9, 0.0, velocity)
    return alpha * velocity


# One map: cells or a continuous surface, zero contour, shading, colour bar


def angle_axes(axes: Axes, name_beta: bool = True, name_gamma: bool = True) -> None:
    """Set limits and ticks of a map's axes, gamma across and beta up.

    `name_beta`, `name_gamma`: Write label and numbers of this axis; False inside of a row or column of maps.
    """
    axes.set(xlim=(-90, 90), ylim=(-90, 90), xticks=range(-90, 91, 45), yticks=range(-90, 91, 30))
    labelled_axes = (
        (axes.xaxis, r"$\gamma$ (degrees)", name_gamma),
        (axes.yaxis, r"$\beta$ (degrees)", name_beta),
    )
    for axis, name, is_labelled in labelled_axes:
        axis.set_major_formatter("{x:.0f}")
        axis.set_tick_params(labelleft=is_labelled, labelbottom=is_labelled)
        if is_labelled:
            axis.set_label_text(name)


def widen_for_marks(page: Figure) -> None:
    """Widen all maps of a page by a free margin if a mark on any of them lies near +-90 degrees, where it would be cut."""
    # without the colour bars
    maps = [axes for axes in page.axes if axes.get_xlim() == (-LIMIT_DEG, LIMIT_DEG)]
    # sizes of the angles of all marks; a first mark at 0, 0, since there may be none
    marked = np.abs(
        np.concatenate(
            [np.zeros((1, 2)), *(line.get_xydata() for axes in maps for line in axes.lines)]
        )
    )
    margin_deg = 8.0
    if np.nanmax(marked) + margin_deg > LIMIT_DEG:
        ends = -LIMIT_DEG - margin_deg, LIMIT_DEG + margin_deg
        for axes in maps:
            axes.set(xlim=ends, ylim=ends)


_MISSING: dict[str, Any] = {"facecolor": "#d0d0d0", "edgecolor": "#808080", "hatch": "xxxxxx"}
"""Look of a cell whose runs gave no number."""


def _add_cells(axes: Axes, table: pd.DataFrame, column: str, signed: bool) -> ScalarMappable:
    """Draw the cells of a column; those whose runs gave no number are grey and hatched. Returns what `add_bar` needs.

    `signed`: As for `colours`.
    """
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    beta_deg, gamma_deg, values = cells_of_map(table, column)
    # True for directions with a row in the table, with a number or without
    has_runs = np.isfinite(cells_of_map(table.assign(runs=1.0), "runs")[2])
    rows, columns = edges(beta_deg), edges(gamma_deg)
    mesh = axes.pcolormesh(columns, rows, np.ma.masked_invalid(values), **colours(values, signed))
    corners = [(0, 0), (0, 1), (1, 1), (1, 0), (0, 0)]
    missing = [
        Path([(columns[j + right], rows[i + up]) for up, right in corners], closed=True)
        for i, j in np.argwhere(has_runs & ~np.isfinite(values))
    ]
    if missing:  # one patch: hatching is slow
        axes.add_patch(PathPatch(Path.make_compound_path(*missing), linewidth=0, **_MISSING))
    return mesh


def add_table(
    axes: Axes, table: pd.DataFrame, values: pd.Series[float], signed: bool
) -> ScalarMappable:
    """Draw a number of each row of an alpha table: as cells where the directions lie on a grid, else as dots; a cross for NaN.

    `values`: The numbers, with the index of `table`. `signed`: As for `colours`. Returns what `add_bar` needs for the
    colour bar.
    """
    if lies_on_grid(table):
        return _add_cells(axes, table.assign(shown=values), "shown", signed)
    measured_cells, empty_cells = table[values.notna()], table[values.isna()]
    axes.plot(empty_cells["gamma_deg"], empty_cells["beta_deg"], "x", color="#606060", markersize=3)
    return axes.scatter(
        measured_cells["gamma_deg"],
        measured_cells["beta_deg"],
        c=values.dropna(),
        s=16,
        edgecolors="black",
        linewidths=0.4,
        zorder=3,
        clip_on=False,
        **colours(np.asarray(values, dtype=float), signed),
    )


def add_surface(
    axes: Axes, values: FloatArray, limits: dict[str, Any] | None = None
) -> ScalarMappable:
    """Draw a continuous signed function, given at `middles`, shape (180, 180); returns what `add_bar` needs.

    `limits`: As `colours` returns them, of measured dots that are drawn over it; None: its own.
    """
    return axes.imshow(
        values,
        extent=(-90, 90, -90, 90),
        origin="lower",
        interpolation="nearest",
        aspect="auto",
        **limits or colours(values, signed=True),
    )


def colours(values: FloatArray, signed: bool) -> dict[str, Any]:
    """Choose a colour map and its limits, as options of matplotlib's functions: by the largest of the finite values.

    `signed`: True for a diverging map, symmetric about zero; False for one that begins at zero.
    """
    finite = np.abs(values[np.isfinite(values)])
    top = float(finite.max(initial=0.0)) or 1.0
    if signed:
        return {"cmap": style.DIVERGING, "vmin": -top, "vmax": top}
    return {"cmap": style.SEQUENTIAL, "vmin": 0.0, "vmax": top}


_SHADING = "////"
"""Hatching where alpha does not oppose the motion."""


def add_signs(
    axes: Axes, component: str, beta_deg: FloatArray, gamma_deg: FloatArray, alpha: FloatArray
) -> None:
    """Draw the zero contour, and hatch where alpha, interpolated, does not oppose the motion.

    `alpha`: Component `component` of alpha, shape (beta, gamma), at ascending `beta_deg` and `gamma_deg`. Draws nothing
    for a single row or column, between which there is no contour.
    """
    if min(alpha.shape) < 2:
        return
    if np.diff(beta_deg).max() > _FINE_DEG or np.diff(gamma_deg).max() > _FINE_DEG:
        beta_deg, gamma_deg, alpha = refine(beta_deg, gamma_deg, alpha)
    finite = alpha[np.isfinite(alpha)]
    if finite.size == 0:
        return
    # positive where alpha does not oppose the motion
    push = np.ma.masked_invalid(along_motion(component, gamma_deg, alpha))
    # a smaller product is zero but for rounding errors, and must not be shaded
    tolerance, highest = 1e-9 * float(np.abs(finite).max()), float(push.max())
    if highest > tolerance:
        axes.contourf(
            gamma_deg,
            beta_deg,
            push,
            colors="none",
            levels=[tolerance, highest * 1.01],
            hatches=[_SHADING],
        )
    if finite.min() < 0 < finite.max():
        alpha = np.ma.masked_invalid(alpha)
        axes.contour(gamma_deg, beta_deg, alpha, levels=[0.0], colors="black", linewidths=0.9)


_ARROWS = {
    "z": "\N{UPWARDS ARROW}\N{DOWNWARDS ARROW}",
    "x": "\N{RIGHTWARDS ARROW}\N{LEFTWARDS ARROW}",
}
"""Arrows for the direction of a force at the upper and the lower end of a colour bar."""


def add_bar(figure: Figure, axes: Axes, mappable: ScalarMappable, component: str = "") -> None:
    """Add a colour bar at the right of a map, in axes of its own, the last ones of the figure.

    `mappable`: What a function that draws a map returned. `component`: ``z`` or ``x`` draws arrows of the force at the
    ends of the bar; empty: none.
    """
    from matplotlib.ticker import MaxNLocator

    box = axes.get_position()
    width = box.width / SIDE_CM
    bar_axes = figure.add_axes((box.x1 + 0.08 * width, box.y0, 0.18 * width, box.height))
    bar = figure.colorbar(mappable, cax=bar_axes)
    # matplotlib draws its strip by an image as large as the figure, and a pdf keeps one for each bar: draw a small image
    if bar.solids is not None:
        bar.solids.remove()
    lowest, highest = bar_axes.get_ylim()
    strip = np.linspace(lowest, highest, 256)[:, None]
    extent = (*bar_axes.get_xlim(), lowest, highest)
    bar_axes.imshow(
        strip,
        mappable.get_cmap(),
        extent=extent,
        origin="lower",
        aspect="auto",
        vmin=lowest,
        vmax=highest,
    )
    bar.locator = MaxNLocator(5)
    bar.update_ticks()
    bar.outline.set_linewidth(0.4)
    bar_axes.tick_params(labelsize=5.5, pad=1)
    ends = (0.985, "top"), (0.015, "bottom")
    for arrow, (y, alignment) in zip(_ARROWS.get(component, ""), ends, strict=False):
        bar_axes.text(
            0.5,
            y,
            arrow,
            transform=bar_axes.transAxes,
            va=alignment,
            ha="center",
            fontsize=5,
            color="white",
            weight="bold",
        )


def add_legend(figure: Figure, more: Mapping[str, Any] | None = None) -> None:
    """Add the legend below the maps: contour, shading and hatched cells, each where a map has it, and the entries `more`.

    Call it when the maps are drawn: what they show is read from their artists.
    """
    from matplotlib.contour import ContourSet

    artists = [artist for axes in figure.axes for artist in axes.collections]
    contours = [artist for artist in artists if isinstance(artist, ContourSet)]
    entries: dict[str, Any] = {}
    # `add_signs` draws the zero contour as lines, and the hatching as a filled contour
    is_filled = {contour.filled for contour in contours}
    if False in is_filled:
        entries["zero contour (interpolated)"] = style.line("black", linewidth=0.9)
    if True in is_filled:
        entries["does not oppose the motion"] = style.patch(
            linewidth=0.3, facecolor="white", edgecolor="#222222", hatch=_SHADING * 2
        )
    if any(axes.patches for axes in figure.axes):
        entries["no usable run"] = style.patch(linewidth=0.3, **_MISSING)
    style.legend(figure, entries | dict(more or {}), borderaxespad=0.3, columnspacing=2.0)
