"""Maps of alpha over the angles (Figs. 2C, 2D, S4) and of the nine-term fit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from rftfit import conventions
from rftfit.figures import style

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure


# --- Tables of alpha as grids over the angles: cells, their edges, and a finer grid between them.


FloatArray = npt.NDArray[np.float64]

LIMIT_DEG = 90.0
"""The measured region ends at +-90 degrees in both angles."""


def pivot(table: pd.DataFrame, column: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One column of the alpha table of one medium as a grid.

    `table`: With ``beta_deg``, ``gamma_deg`` and `column`, one row per cell. Returns `beta_deg` of
    shape (n,). Returns `gamma_deg` of shape (m,): Both ascending. Returns `values` of shape (n,
    m): NaN where the table has no row or no value.
    """
    # a printed 18.43 and the exact angle are one and the same cell
    beta = table["beta_deg"].to_numpy(float).round(2)
    gamma = table["gamma_deg"].to_numpy(float).round(2)
    rows, row = np.unique(beta, return_inverse=True)
    columns, place = np.unique(gamma, return_inverse=True)
    if np.unique(row * columns.size + place).size < row.size:
        raise ValueError(f"{column}: a cell (beta, gamma) appears twice in the table of one medium")
    values = np.full((rows.size, columns.size), np.nan)
    values[row, place] = table[column].to_numpy(float)
    return rows, columns, values


def half_width(table: pd.DataFrame, component: str) -> pd.Series[float]:
    """Half the width of the interval of alpha_z or alpha_x.

    `table`: Alpha table. Returns N/cm^3.
    """
    high = table[f"alpha_{component}_hi_N_per_cm3"].astype(float)
    return (high - table[f"alpha_{component}_lo_N_per_cm3"].astype(float)) / 2


def edges(centres: npt.ArrayLike) -> FloatArray:
    """Borders of the cells: midway between the measured angles, ending at +-90 degrees.

    `centres`: shape (n,); Ascending, degrees. Returns shape (n + 1,).
    """
    centres = np.asarray(centres, dtype=float)
    if centres.size == 1:
        return np.array([centres[0] - 5.0, centres[0] + 5.0])
    middle = (centres[1:] + centres[:-1]) / 2
    first, last = 2 * centres[0] - middle[0], 2 * centres[-1] - middle[-1]
    return np.concatenate([[max(first, -LIMIT_DEG)], middle, [min(last, LIMIT_DEG)]])


def _weights(centres: FloatArray, fine: FloatArray) -> FloatArray:
    place = np.clip(np.searchsorted(centres, fine, side="right") - 1, 0, centres.size - 2)
    share = (fine - centres[place]) / (centres[place + 1] - centres[place])
    weights = np.zeros((fine.size, centres.size))
    rows = np.arange(fine.size)
    weights[rows, place] = 1 - share
    weights[rows, place + 1] += share
    return weights


def refine(
    beta_deg: FloatArray, gamma_deg: FloatArray, values: FloatArray, step_deg: float = 2.5
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bilinear interpolation onto a finer grid.

    `beta_deg`, `gamma_deg`: Ascending, at least two each. `values`: shape (n, m). `step_deg`:
    Largest step of the finer grid; the measured angles are among its lines. Returns `beta_deg`,
    `gamma_deg`, `values`: NaN wherever a missing cell takes part.
    """
    fine = []
    for centres in (beta_deg, gamma_deg):
        parts = [
            np.linspace(a, b, int(np.ceil((b - a) / step_deg)), endpoint=False)
            for a, b in pairwise(centres)
        ]
        fine.append(np.concatenate([*parts, centres[-1:]]))
    left, right = _weights(beta_deg, fine[0]), _weights(gamma_deg, fine[1]).T
    missing = np.isnan(values)
    result = left @ np.where(missing, 0.0, values) @ right
    result[left @ missing @ right > 1e-9] = np.nan
    return fine[0], fine[1], result


def along_motion(component: str, gamma_deg: FloatArray, alpha: FloatArray) -> FloatArray:
    """Force component times velocity component: positive where alpha does not oppose the motion.

    `gamma_deg`: shape (m,). `alpha`: shape (n, m); N/cm^3. Returns shape (n, m): N/cm^3; zero
    where that component of the velocity is zero.
    """
    vx, vz = conventions.direction(np.radians(gamma_deg))
    velocity = vz if component == "z" else vx
    # cos(90 deg) is 6e-17 in floating point: such a velocity has no direction
    velocity = np.where(np.abs(velocity) < 1e-9, 0.0, velocity)
    return alpha * velocity


# --- One map over the angles: cells or a continuous surface, zero contour, shading, colour bar.


SIDE_CM = 2.95
"""Side of one map: both angles run from -90 to 90 degrees."""

PITCH_CM = 4.08
"""From one map to the next in a row, colour bar and its numbers included."""

LEFT_CM = 1.25
ROW_CM = SIDE_CM + 0.95
TOP_CM = 1.0
BOTTOM_CM = 0.85

_SHADING = "////"
_MISSING = "xxxxxx"
_STRIP = 256


def empty_map(figure: Figure, row: int, column: int, outer: tuple[bool, bool]) -> Axes:
    """Axes of one map of a figure made of rows of maps.

    `outer`: Whether the map names beta at its left, and gamma below.
    """
    left, top = LEFT_CM + column * PITCH_CM, TOP_CM + 0.4 + row * ROW_CM
    axes = style.axes_cm(figure, left, top, SIDE_CM, SIDE_CM)
    angle_axes(axes, *outer)
    return axes


def angle_axes(axes: Axes, name_beta: bool = True, name_gamma: bool = True) -> None:
    """Limits, ticks and names of a map's axes.

    `name_beta`, `name_gamma`: Whether that axis carries its name and numbers.
    """
    axes.set(xlim=(-90, 90), ylim=(-90, 90), xticks=range(-90, 91, 45), yticks=range(-90, 91, 30))
    for axis, name, shown in (
        (axes.xaxis, r"$\gamma$ (degrees)", name_gamma),
        (axes.yaxis, r"$\beta$ (degrees)", name_beta),
    ):
        axis.set_major_formatter(lambda value, _: f"{value:.0f}".replace("-", "\N{MINUS SIGN}"))
        axis.set_tick_params(labelleft=shown, labelbottom=shown)
        if shown:
            axis.set_label_text(name)


def add_cells(
    axes: Axes, beta_deg: FloatArray, gamma_deg: FloatArray, values: FloatArray, signed: bool
) -> ScalarMappable:
    """Draw measured cells; missing ones are grey and hatched.

    `values`: shape (n, m). `signed`: Diverging colours about zero; else colours from zero up.
    """
    rows, columns = edges(beta_deg), edges(gamma_deg)
    mesh = axes.pcolormesh(columns, rows, np.ma.masked_invalid(values), **colours(values, signed))
    for i, j in np.argwhere(~np.isfinite(values)):
        axes.add_patch(
            Rectangle(
                (columns[j], rows[i]),
                columns[j + 1] - columns[j],
                rows[i + 1] - rows[i],
                facecolor="#d0d0d0",
                edgecolor="#808080",
                hatch=_MISSING,
                linewidth=0,
            )
        )
    return mesh


def add_surface(axes: Axes, values: FloatArray) -> ScalarMappable:
    """Draw a continuous signed function over the whole square from -90 to 90 degrees.

    `values`: shape (n, m); At the middles of n by m equal cells, beta and gamma ascending.
    """
    return axes.imshow(
        values,
        extent=(-90, 90, -90, 90),
        origin="lower",
        interpolation="nearest",
        aspect="auto",
        **colours(values, signed=True),
    )


def colours(values: FloatArray, signed: bool) -> dict[str, Any]:
    """Colour map and limits: symmetric about zero for signed values, else from zero.

    Returns ``cmap``, ``vmin``, ``vmax``.
    """
    finite = np.abs(values[np.isfinite(values)])
    top = float(finite.max(initial=0.0)) or 1.0
    if signed:
        return {"cmap": style.DIVERGING, "vmin": -top, "vmax": top}
    return {"cmap": style.SEQUENTIAL, "vmin": 0.0, "vmax": top}


def add_signs(
    axes: Axes, component: str, beta_deg: FloatArray, gamma_deg: FloatArray, alpha: FloatArray
) -> None:
    """Draw the zero contour, and shade where alpha does not oppose the motion.

    `alpha`: shape (n, m); N/cm^3; interpolated between the cells.
    """
    if min(alpha.shape) < 2 or not np.isfinite(alpha).any():
        return
    beta_deg, gamma_deg, alpha = refine(beta_deg, gamma_deg, alpha)
    finite = alpha[np.isfinite(alpha)]
    if finite.size == 0:
        return
    masked = np.ma.masked_invalid(alpha)
    push = np.ma.masked_invalid(along_motion(component, gamma_deg, alpha))
    # below this it is zero to rounding, which must not be shaded
    least, most = 1e-9 * float(np.abs(finite).max()), float(push.max())
    if most > least:
        axes.contourf(
            gamma_deg, beta_deg, push, levels=[least, most * 1.01], colors="none",
            hatches=[_SHADING],
        )  # fmt: skip
    if finite.min() < 0 < finite.max():
        axes.contour(gamma_deg, beta_deg, masked, levels=[0.0], colors="black", linewidths=0.9)


def add_bar(figure: Figure, axes: Axes, drawn: ScalarMappable) -> None:
    """Add a colour bar at the right of a map; its unit stands in the head of the column."""
    box = axes.get_position()
    width = box.width / SIDE_CM
    place = figure.add_axes((box.x1 + 0.09 * width, box.y0, 0.13 * width, box.height))
    bar = figure.colorbar(drawn, cax=place)
    # matplotlib's own strip is drawn through an image of the whole figure, and a pdf keeps all of them
    if bar.solids is not None:
        bar.solids.remove()
    lowest, highest = place.get_ylim()
    place.imshow(
        np.linspace(lowest, highest, _STRIP)[:, None],
        extent=(*place.get_xlim(), lowest, highest), origin="lower", aspect="auto",
        cmap=drawn.get_cmap(), vmin=lowest, vmax=highest,
    )  # fmt: skip
    bar.locator = MaxNLocator(5)
    bar.update_ticks()
    bar.outline.set_linewidth(0.4)
    place.tick_params(labelsize=5.5, pad=1)


def add_legend(figure: Figure, signs: bool, missing: bool) -> None:
    """Explain contour, shading and hatching at the foot of the figure.

    `signs`: Whether there is a zero contour and shading. `missing`: Whether any cell is missing.
    """
    entries: list[tuple[Any, str]] = []
    if signs:
        shading = Patch(facecolor="white", edgecolor="#222222", hatch=_SHADING * 2, linewidth=0.3)
        entries += [
            (Line2D([], [], color="black", linewidth=0.9), "zero contour (interpolated)"),
            (shading, "does not oppose the motion"),
        ]
    if missing:
        grey = Patch(facecolor="#d0d0d0", edgecolor="#808080", hatch=_MISSING, linewidth=0.3)
        entries.append((grey, "no usable run"))
    if entries:
        figure.legend(
            [entry[0] for entry in entries],
            [entry[1] for entry in entries],
            loc="lower center",
            ncols=len(entries),
            borderaxespad=0.3,
        )


# --- Maps of alpha over the angles (Figs. 2C, 2D, S4) and of the nine-term fit (Fig. S6).


Evaluate = Callable[[Mapping[str, float], FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""The nine-term formula: coefficients, beta, gamma (rad) to alpha_z, alpha_x."""

_COMPONENTS = ("z", "x")


def middles(count: int = 180) -> tuple[FloatArray, FloatArray]:
    """Angles at the middles of equal cells over the square from -90 to 90 degrees.

    `count`: Cells along each side. Returns `beta`, `gamma` of shape (count, count): Radians, beta
    along the rows.
    """
    angles = np.radians(-90 + (np.arange(count) + 0.5) * 180 / count)
    beta, gamma = np.meshgrid(angles, angles, indexing="ij")
    return beta, gamma


def kept_coefficients(coefficients: pd.DataFrame, method: str, medium: str) -> dict[str, float]:
    """Coefficients of one fit, dropped terms as zero.

    `coefficients`: Long coefficient table. `method`: ``lsq`` or ``dft-index``. `medium`: A medium,
    or ``generic``. Returns N/cm^3; dimensionless for ``generic``.
    """
    rows = coefficients[(coefficients["method"] == method) & (coefficients["medium"] == medium)]
    if rows.empty:
        raise ValueError(f"the coefficient table has no fit {method!r} of medium {medium!r}")
    values = rows["value_N_per_cm3"].astype(float).where(rows["kept"].astype(bool), 0.0)
    return dict(zip(rows["coefficient"].astype(str), values, strict=True))


def _frame(media: int) -> Figure:
    height = TOP_CM + media * ROW_CM + BOTTOM_CM
    return style.new_figure(style.DOUBLE_CM, height)


def _heads(figure: Figure, heads: list[str]) -> None:
    for column, head in enumerate(heads):
        middle = LEFT_CM + column * PITCH_CM + SIDE_CM / 2
        style.text_cm(figure, middle, 0.2, head, ha="center", va="top", fontsize=7)


def _name(figure: Figure, row: int, name: str) -> None:
    top = TOP_CM + 0.34 + row * ROW_CM
    style.text_cm(figure, LEFT_CM, top, name, va="bottom", fontsize=7, weight="bold")


@style.styled
def draw_maps(
    tables: pd.DataFrame, titles: Mapping[str, str] | None = None, confidence: float = 0.95
) -> Figure:
    """Draw maps of the measured alpha_z and alpha_x of one or several media (Figs. 2C, 2D, S4).

    Each map shows the cells as measured (the gamma grid is not uniform), the zero contour between
    them, and shading where the component does not oppose its own motion; beside it stands the half
    width of its interval. Missing cells are grey and hatched.

    `tables`: Alpha tables of the media, one under the other; one row of maps per medium, in that
    order. `titles`: Names of the media. `confidence`: Level of the intervals in the table.
    """
    media = [str(medium) for medium in tables["medium"].unique()]
    if not media:
        raise ValueError("the alpha table is empty: there is nothing to draw")
    figure = _frame(len(media))
    heads, missing = [], False
    for c in _COMPONENTS:
        level = f"{100 * confidence:.4g} %"
        half = f"half width of the {level} interval\nof $\\alpha_{c}$ (10$^{{-3}}$ {style.PER_CM3})"
        heads += [f"measured\n{style.alpha_label(c)}", half]
    _heads(figure, heads)
    for row, medium in enumerate(media):
        table = tables[tables["medium"] == medium]
        _name(figure, row, style.title_of(medium, titles))
        last = row == len(media) - 1
        for index, c in enumerate(_COMPONENTS):
            beta, gamma, alpha = pivot(table, f"alpha_{c}_N_per_cm3")
            axes = empty_map(figure, row, 2 * index, (index == 0, last))
            add_bar(figure, axes, add_cells(axes, beta, gamma, alpha, signed=True))
            add_signs(axes, c, beta, gamma, alpha)
            # in thousandths: four digits after the point would run into the next map
            width = 1e3 * pivot(table.assign(half=half_width(table, c)), "half")[2]
            axes = empty_map(figure, row, 2 * index + 1, (False, last))
            add_bar(figure, axes, add_cells(axes, beta, gamma, width, signed=False))
            missing |= bool(np.isnan(alpha).any() or np.isnan(width).any())
    add_legend(figure, signs=True, missing=missing)
    return figure


@style.styled
def draw_fit_maps(
    tables: pd.DataFrame,
    coefficients: pd.DataFrame,
    evaluate: Evaluate,
    method: str = "lsq",
    titles: Mapping[str, str] | None = None,
) -> Figure:
    """Draw maps of the nine-term alpha (Fig. S6), each beside measured minus fit.

    `tables`: Alpha tables of the media, one under the other. `coefficients`: Long coefficient
    table; terms that are not kept count as zero. `evaluate`: `rftfit.model.fourier.evaluate`.
    `method`: ``lsq`` or ``dft-index``. `titles`: Names of the media.
    """
    media = [str(medium) for medium in tables["medium"].unique()]
    if not media:
        raise ValueError("the alpha table is empty: there is nothing to draw")
    figure = _frame(len(media))
    heads, missing = [], False
    for c in _COMPONENTS:
        label = style.alpha_label(c)
        heads += [f"nine-term fit ({method})\n{label}", f"measured minus fit\n{label}"]
    _heads(figure, heads)
    fine_beta, fine_gamma = middles()
    fine_deg = np.degrees(fine_beta[:, 0])
    for row, medium in enumerate(media):
        table = tables[tables["medium"] == medium]
        fit = kept_coefficients(coefficients, method, medium)
        surfaces = evaluate(fit, fine_beta, fine_gamma)
        _name(figure, row, style.title_of(medium, titles))
        last = row == len(media) - 1
        for index, c in enumerate(_COMPONENTS):
            axes = empty_map(figure, row, 2 * index, (index == 0, last))
            add_bar(figure, axes, add_surface(axes, surfaces[index]))
            add_signs(axes, c, fine_deg, fine_deg, surfaces[index])
            beta, gamma, alpha = pivot(table, f"alpha_{c}_N_per_cm3")
            at = np.meshgrid(np.radians(beta), np.radians(gamma), indexing="ij")
            left_over = alpha - evaluate(fit, at[0], at[1])[index]
            axes = empty_map(figure, row, 2 * index + 1, (False, last))
            mesh = add_cells(axes, beta, gamma, left_over, signed=True)
            add_bar(figure, axes, mesh)
            missing |= bool(np.isnan(alpha).any())
    add_legend(figure, signs=True, missing=missing)
    return figure
