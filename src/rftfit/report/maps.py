"""Maps of alpha over the angles (Figs. 2C, 2D, S4) and of the nine-term fit (Fig. S6)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from rftfit.report import labels, panels, style
from rftfit.report.grid import FloatArray, half_width, pivot

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Evaluate = Callable[[Mapping[str, float], FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""The nine-term formula: coefficients, beta, gamma (rad) to alpha_z, alpha_x."""

_COMPONENTS = ("z", "x")


def middles(count: int = 180) -> tuple[FloatArray, FloatArray]:
    """Angles at the middles of equal cells over the square from -90 to 90 degrees.

    Parameters
    ----------
    count : int
        Cells along each side.

    Returns
    -------
    beta, gamma : numpy.ndarray, shape (count, count)
        Radians, beta along the rows.
    """
    angles = np.radians(-90 + (np.arange(count) + 0.5) * 180 / count)
    beta, gamma = np.meshgrid(angles, angles, indexing="ij")
    return beta, gamma


def kept_coefficients(coefficients: pd.DataFrame, method: str, medium: str) -> dict[str, float]:
    """Coefficients of one fit, dropped terms as zero.

    Parameters
    ----------
    coefficients : pandas.DataFrame
        Long coefficient table.
    method : str
        ``lsq`` or ``dft-index``.
    medium : str
        A medium, or ``generic``.

    Returns
    -------
    dict of str to float
        N/cm^3; dimensionless for ``generic``.

    Raises
    ------
    ValueError
        If the table has no such fit.
    """
    rows = coefficients[(coefficients["method"] == method) & (coefficients["medium"] == medium)]
    if rows.empty:
        raise ValueError(f"the coefficient table has no fit {method!r} of medium {medium!r}")
    values = rows["value_N_per_cm3"].astype(float).where(rows["kept"].astype(bool), 0.0)
    return dict(zip(rows["coefficient"].astype(str), values, strict=True))


def _frame(media: int) -> Figure:
    height = panels.TOP_CM + media * panels.ROW_CM + panels.BOTTOM_CM
    return style.new_figure(style.DOUBLE_CM, height)


def _heads(figure: Figure, heads: list[str]) -> None:
    for column, head in enumerate(heads):
        middle = panels.LEFT_CM + column * panels.PITCH_CM + panels.SIDE_CM / 2
        style.text_cm(figure, middle, 0.2, head, ha="center", va="top", fontsize=7)


def _name(figure: Figure, row: int, name: str) -> None:
    top = panels.TOP_CM + 0.34 + row * panels.ROW_CM
    style.text_cm(figure, panels.LEFT_CM, top, name, va="bottom", fontsize=7, weight="bold")


@style.styled
def draw_maps(
    tables: pd.DataFrame, titles: Mapping[str, str] | None = None, confidence: float = 0.95
) -> Figure:
    """Draw maps of the measured alpha_z and alpha_x of one or several media (Figs. 2C, 2D, S4).

    Each map shows the cells as measured (the gamma grid is not uniform), the zero contour between
    them, and shading where the component does not oppose its own motion; beside it stands the half
    width of its interval. Missing cells are grey and hatched.

    Parameters
    ----------
    tables : pandas.DataFrame
        Alpha tables of the media, one under the other; one row of maps per medium, in that order.
    titles : mapping of str to str, optional
        Names of the media.
    confidence : float
        Level of the intervals in the table.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the table is empty or a cell appears twice.
    """
    media = [str(medium) for medium in tables["medium"].unique()]
    if not media:
        raise ValueError("the alpha table is empty: there is nothing to draw")
    figure = _frame(len(media))
    heads, missing = [], False
    for c in _COMPONENTS:
        level = f"{100 * confidence:.4g} %"
        half = (
            f"half width of the {level} interval\nof $\\alpha_{c}$ (10$^{{-3}}$ {labels.PER_CM3})"
        )
        heads += [f"measured\n{labels.alpha_label(c)}", half]
    _heads(figure, heads)
    for row, medium in enumerate(media):
        table = tables[tables["medium"] == medium]
        _name(figure, row, labels.title_of(medium, titles))
        last = row == len(media) - 1
        for index, c in enumerate(_COMPONENTS):
            beta, gamma, alpha = pivot(table, f"alpha_{c}_N_per_cm3")
            axes = panels.empty_map(figure, row, 2 * index, (index == 0, last))
            panels.add_bar(figure, axes, panels.add_cells(axes, beta, gamma, alpha, signed=True))
            panels.add_signs(axes, c, beta, gamma, alpha)
            # in thousandths: four digits after the point would run into the next map
            width = 1e3 * pivot(table.assign(half=half_width(table, c)), "half")[2]
            axes = panels.empty_map(figure, row, 2 * index + 1, (False, last))
            panels.add_bar(figure, axes, panels.add_cells(axes, beta, gamma, width, signed=False))
            missing |= bool(np.isnan(alpha).any() or np.isnan(width).any())
    panels.add_legend(figure, signs=True, missing=missing)
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

    Parameters
    ----------
    tables : pandas.DataFrame
        Alpha tables of the media, one under the other.
    coefficients : pandas.DataFrame
        Long coefficient table; terms that are not kept count as zero.
    evaluate : callable
        `rftfit.profile.fourier.evaluate`.
    method : str
        ``lsq`` or ``dft-index``.
    titles : mapping of str to str, optional
        Names of the media.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the alpha table is empty, or a medium in it has no fit of that method.
    """
    media = [str(medium) for medium in tables["medium"].unique()]
    if not media:
        raise ValueError("the alpha table is empty: there is nothing to draw")
    figure = _frame(len(media))
    heads, missing = [], False
    for c in _COMPONENTS:
        label = labels.alpha_label(c)
        heads += [f"nine-term fit ({method})\n{label}", f"measured minus fit\n{label}"]
    _heads(figure, heads)
    fine_beta, fine_gamma = middles()
    fine_deg = np.degrees(fine_beta[:, 0])
    for row, medium in enumerate(media):
        table = tables[tables["medium"] == medium]
        fit = kept_coefficients(coefficients, method, medium)
        surfaces = evaluate(fit, fine_beta, fine_gamma)
        _name(figure, row, labels.title_of(medium, titles))
        last = row == len(media) - 1
        for index, c in enumerate(_COMPONENTS):
            axes = panels.empty_map(figure, row, 2 * index, (index == 0, last))
            panels.add_bar(figure, axes, panels.add_surface(axes, surfaces[index]))
            panels.add_signs(axes, c, fine_deg, fine_deg, surfaces[index])
            beta, gamma, alpha = pivot(table, f"alpha_{c}_N_per_cm3")
            at = np.meshgrid(np.radians(beta), np.radians(gamma), indexing="ij")
            left_over = alpha - evaluate(fit, at[0], at[1])[index]
            axes = panels.empty_map(figure, row, 2 * index + 1, (False, last))
            mesh = panels.add_cells(axes, beta, gamma, left_over, signed=True)
            panels.add_bar(figure, axes, mesh)
            missing |= bool(np.isnan(alpha).any())
    panels.add_legend(figure, signs=True, missing=missing)
    return figure
