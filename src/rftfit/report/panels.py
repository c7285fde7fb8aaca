"""One map over the angles: cells or a continuous surface, zero contour, shading, colour bar."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from rftfit.report import style
from rftfit.report.grid import FloatArray, along_motion, edges, refine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

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

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    row, column : int
    outer : (bool, bool)
        Whether the map names beta at its left, and gamma below.

    Returns
    -------
    matplotlib.axes.Axes
    """
    left, top = LEFT_CM + column * PITCH_CM, TOP_CM + 0.4 + row * ROW_CM
    axes = style.axes_cm(figure, left, top, SIDE_CM, SIDE_CM)
    angle_axes(axes, *outer)
    return axes


def angle_axes(axes: Axes, name_beta: bool = True, name_gamma: bool = True) -> None:
    """Limits, ticks and names of a map's axes.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    name_beta, name_gamma : bool
        Whether that axis carries its name and numbers.
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

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    beta_deg, gamma_deg : numpy.ndarray, shapes (n,) and (m,)
    values : numpy.ndarray, shape (n, m)
    signed : bool
        Diverging colours about zero; else colours from zero up.

    Returns
    -------
    matplotlib.cm.ScalarMappable
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

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    values : numpy.ndarray, shape (n, m)
        At the middles of n by m equal cells, beta and gamma ascending.

    Returns
    -------
    matplotlib.cm.ScalarMappable
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

    Parameters
    ----------
    values : numpy.ndarray
    signed : bool

    Returns
    -------
    dict
        ``cmap``, ``vmin``, ``vmax``.
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

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    component : {"z", "x"}
    beta_deg, gamma_deg : numpy.ndarray, shapes (n,) and (m,)
    alpha : numpy.ndarray, shape (n, m)
        N/cm^3; interpolated between the cells.
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
    """Add a colour bar at the right of a map; its unit stands in the head of the column.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    axes : matplotlib.axes.Axes
    drawn : matplotlib.cm.ScalarMappable
    """
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

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    signs : bool
        Whether there is a zero contour and shading.
    missing : bool
        Whether any cell is missing.
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
