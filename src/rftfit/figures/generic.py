"""The scaled coefficients of all media beside the generic ones, and the generic maps (Fig. S7)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import maps, style
from rftfit.figures.maps import Evaluate, kept_coefficients, middles

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


GENERIC = "generic"

TERM_LABELS = {
    "A00": "$A_{0,0}$",
    "A10": "$A_{1,0}$",
    "B11": "$B_{1,1}$",
    "B01": "$B_{0,1}$",
    "Bm1": "$B_{-1,1}$",
    "C11": "$C_{1,1}$",
    "C01": "$C_{0,1}$",
    "Cm1": "$C_{-1,1}$",
    "D10": "$D_{1,0}$",
}
"""The nine terms as the paper writes them."""


def _zetas(penetration: pd.DataFrame, method: str, media: list[str]) -> dict[str, float]:
    rows = penetration[penetration["method"] == method].set_index("medium")["zeta"].astype(float)
    absent = [medium for medium in media if medium not in rows.index]
    if absent:
        raise ValueError(f"no zeta of method {method!r} for {', '.join(absent)}")
    return {medium: float(rows.loc[medium]) for medium in media}


def _coefficients(
    axes: Axes,
    coefficients: pd.DataFrame,
    zetas: dict[str, float],
    titles: Mapping[str, str] | None,
) -> None:
    looks = style.medium_looks(zetas)
    terms = [term for term in TERM_LABELS if term in set(coefficients["coefficient"])]
    place = {term: float(i) for i, term in enumerate(terms)}
    axes.axhline(0, color="black", linewidth=0.4)
    generic = coefficients[coefficients["medium"] == GENERIC]
    at = generic["coefficient"].map(place).to_numpy(float)
    value, low, high = (generic[name].to_numpy(float) for name in ("value_N_per_cm3", "lo", "hi"))
    axes.bar(
        at, high - low, 0.84, bottom=low, color="#cccccc", linewidth=0, label="generic, interval"
    )
    axes.hlines(value, at - 0.42, at + 0.42, color="black", linewidth=1.2, label="generic $M_0$")
    for i, (medium, zeta) in enumerate(zetas.items()):
        rows = coefficients[coefficients["medium"] == medium]
        x = rows["coefficient"].map(place).to_numpy(float)
        x = x + 0.7 * ((i + 0.5) / len(zetas) - 0.5)
        colour, marker = looks[medium]
        scaled, low, high = (
            rows[name].to_numpy(float) / zeta for name in ("value_N_per_cm3", "lo", "hi")
        )
        axes.vlines(x, low, high, color=colour, linewidth=0.8)
        kept = rows["kept"].to_numpy(bool)
        label = style.title_of(medium, titles)
        axes.plot(x[kept], scaled[kept], marker, color=colour, label=label)
        axes.plot(x[~kept], scaled[~kept], marker, color=colour, markerfacecolor="white")
    if not coefficients["kept"].to_numpy(bool).all():
        axes.plot([], [], "o", color="#555555", markerfacecolor="white", label="term not kept")
    axes.set_xticks(list(place.values()), [TERM_LABELS[term] for term in terms], fontsize=7)
    axes.set(xlim=(-0.6, len(terms) - 0.4), ylabel=r"coefficient / $\zeta$ (dimensionless)")
    axes.figure.legend(
        *axes.get_legend_handles_labels(), loc="upper center", ncols=4, borderaxespad=0.2
    )


def _collapse(
    axes: Axes,
    component: str,
    tables: pd.DataFrame,
    zetas: dict[str, float],
    generic: dict[str, float],
    evaluate: Evaluate,
) -> None:
    looks = style.medium_looks(zetas)
    ends: list[float] = []
    for medium, zeta in zetas.items():
        rows = tables[tables["medium"] == medium]
        angles = (np.radians(rows[f"{name}_deg"].to_numpy(float)) for name in ("beta", "gamma"))
        model = evaluate(generic, *angles)[0 if component == "z" else 1]
        columns = (f"alpha_{component}_{part}N_per_cm3" for part in ("", "lo_", "hi_"))
        value, low, high = (rows[name].to_numpy(float) / zeta for name in columns)
        colour, marker = looks[medium]
        axes.vlines(model, low, high, color=colour, linewidth=0.5)
        axes.plot(model, value, marker, color=colour, markersize=1.8, markeredgewidth=0)
        ends += [*model[np.isfinite(model)], *value[np.isfinite(value)]]
    first, last = (min(ends), max(ends)) if ends else (-1.0, 1.0)
    margin = 0.05 * (last - first) or 1.0
    axes.plot([first, last], [first, last], color="black", linewidth=0.6, zorder=0)
    axes.set(xlim=(first - margin, last + margin), ylim=(first - margin, last + margin))
    axes.set_xlabel(rf"generic $\alpha_{component}$ (dimensionless)")
    axes.set_ylabel(f"measured $\\alpha_{component}$ / $\\zeta$\n(dimensionless)")
    axes.set_title("line: perfect collapse", fontsize=6)
    axes.set_aspect("equal")


@style.styled
def draw_generic(
    coefficients: pd.DataFrame,
    penetration: pd.DataFrame,
    tables: pd.DataFrame,
    evaluate: Evaluate,
    method: str = "lsq",
    titles: Mapping[str, str] | None = None,
) -> Figure:
    """How far one generic profile, scaled by zeta, stands for all media (Fig. S7).

    Above: the coefficients of each medium divided by its zeta, with intervals (of the coefficient;
    zeta is taken as known), and the generic M0 as a bar with its interval. Below: the generic maps,
    and measured alpha / zeta against generic alpha with the line of perfect collapse.

    `coefficients`: Long coefficient table with medium ``generic``; terms not kept count as zero in
    the maps. `penetration`: With ``method, medium, zeta``. `tables`: Alpha tables of the media,
    one under the other. `evaluate`: `rftfit.model.fourier.evaluate`. `method`: ``lsq`` or ``dft-
    index``. `titles`: Names of the media.
    """
    rows = coefficients[coefficients["method"] == method]
    media = [str(name) for name in rows["medium"].unique() if name != GENERIC]
    generic = kept_coefficients(coefficients, method, GENERIC)
    zetas = _zetas(penetration, method, media)
    figure = style.new_figure(style.DOUBLE_CM, 12.7)
    top = style.axes_cm(figure, 1.25, 1.35, style.DOUBLE_CM - 1.45, 5.1)
    top.set_title(
        f"coefficients of each medium over its zeta, and their mean ({method})", loc="left"
    )
    _coefficients(top, rows, zetas, titles)
    beta, gamma = middles()
    angles = np.degrees(beta[:, 0])
    surfaces = evaluate(generic, beta, gamma)
    side, line = maps.SIDE_CM, 8.1
    for i, component in enumerate("zx"):
        axes = style.axes_cm(figure, 1.25 + i * 4.08, line, side, side)
        maps.angle_axes(axes, name_beta=i == 0)
        axes.set_title(rf"generic $\alpha_{component}$ (dimensionless)")
        maps.add_bar(figure, axes, maps.add_surface(axes, surfaces[i]))
        maps.add_signs(axes, component, angles, angles, surfaces[i])
        axes = style.axes_cm(figure, 10.55 + i * 4.45, line, side, side)
        _collapse(axes, component, tables, zetas, generic, evaluate)
    maps.add_legend(figure, signs=True, missing=False)
    return figure
