"""Figure of the generic profile beside the media over zeta: coefficients, maps, and alpha over zeta.

Zeta of a medium is its fitted alpha_z straight down on a flat plate, N/cm^3. The generic profile M0 is the mean over
media of their nine coefficients over zeta, so it has no unit. In tables of coefficients it stands as the medium
`GENERIC`.

`Results` is a campaign with its tables; `results[medium]` has those of one medium, such as ``alpha`` (a row a
direction).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.figures import labels, maps, style
from rftfit.figures.maps import kept_coefficients, middles, why_no_fit
from rftfit.figures.registry import figure, when
from rftfit.figures.traces import with_end_names
from rftfit.measure.alpha import column, directions
from rftfit.model.fourier import evaluate
from rftfit.model.scaling import GENERIC

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rftfit.conventions import FloatArray
    from rftfit.results import Results

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
"""The nine terms of the Fourier fit as the paper writes them, by their name in tables."""

_WITH_ENDS = ["value_N_per_cm3", "lo", "hi"]
"""Columns of the table of coefficients: a coefficient and the ends of its interval."""


def _read_tables(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Read the coefficients of all media (a row a term) and the table with ``zeta`` of each medium, by the configured method.

    Zeta is NaN everywhere where there is no generic profile.
    """
    rows, scaled = (labels.of_method(results, f"{n}.csv") for n in ("coefficients", "penetration"))
    # the generic profile is the mean of the usable media: without a usable medium there is none
    has_generic = (rows["medium"] == GENERIC).any()
    return rows, scaled if has_generic else scaled.assign(zeta=np.nan)


def _lacking(results: Results, _: str) -> Sequence[str]:
    """Say why no generic profile is the mean of two media or more; empty where one is."""
    rows, scaled = _read_tables(results)
    nothing = f"no generic profile by {results.config.fourier.method}"
    if reasons := why_no_fit(results, scaled, "zeta"):
        return nothing, *reasons
    if rows["medium"].nunique() > 2:
        return ()
    return nothing, "one medium alone has nine terms: the mean of several is the generic profile"


@figure(
    "generic_profile",
    reads=("alpha/{laboratory}.csv", "coefficients.csv", "penetration.csv"),
    settings=("fourier",),
    media=when(lambda campaign: campaign.of_role("laboratory")),
    paper="Figs. S6 (above) and S7 (below, left)",
    section="Force profiles",
    caption=(
        "Coefficients of the media over zeta (marks, with intervals), and their mean M0 (black); below, alpha of M0, "
        "and alpha over zeta against it. Good: the media lie together."
    ),
    lacking=_lacking,
)
def plot_generic_profile(results: Results) -> Figure:
    """Draw the media scaled onto the generic profile: coefficients above; maps of M0 and alpha against it below.

    The intervals take zeta as known: only the errors of the coefficients, or of alpha, are divided by it.
    """
    method = results.config.fourier.method
    rows, scaled = _read_tables(results)
    generic = kept_coefficients(results, GENERIC)
    zetas = dict(zip(scaled["medium"], scaled["zeta"].astype(float), strict=True))
    media = [str(medium) for medium in rows["medium"].unique() if medium != GENERIC]
    zetas = {medium: zetas.get(medium, np.nan) for medium in media}
    page = style.new_figure(style.DOUBLE_CM, 12.7)
    coefficient_axes = style.axes_cm(page, 1.25, 1.35, style.DOUBLE_CM - 1.75, 5.1)
    is_dropped = not rows["kept"].all()
    head = f"coefficients of each medium over its $\\zeta$, and their mean ({method})"
    head += "; hollow: term not kept" * is_dropped
    coefficient_axes.set_title(head, loc="left")
    _draw_coefficients(coefficient_axes, results, rows, zetas)
    beta, gamma = middles()
    angles_deg = np.degrees(beta[:, 0])
    surfaces = evaluate(generic, beta, gamma)
    side_cm, top_cm = maps.SIDE_CM, 8.1
    for i, component in enumerate("zx"):
        axes = style.axes_cm(page, 1.25 + i * maps.PITCH_CM, top_cm, side_cm, side_cm)
        maps.angle_axes(axes, name_beta=i == 0)
        axes.set_title(rf"generic $\alpha_{component}$ (dimensionless)")
        maps.add_bar(page, axes, maps.add_surface(axes, surfaces[i]), component)
        maps.add_signs(axes, component, angles_deg, angles_deg, surfaces[i])
        axes = style.axes_cm(page, 10.55 + i * 4.45, top_cm, side_cm, side_cm)
        _draw_collapse(axes, component, results, zetas, generic)
    maps.add_legend(page)
    return page


def _draw_coefficients(
    axes: Axes, results: Results, coefficients: pd.DataFrame, zetas: Mapping[str, float]
) -> None:
    """Draw the coefficients of each medium over its zeta, and those of the generic profile, a column a term; adds a legend.

    `coefficients`: Of all media and `GENERIC`, a row a term; ``kept`` is False for a term that the fit dropped.
    `zetas`: Zeta by medium, N/cm^3.
    """
    looks = style.medium_looks(zetas)
    terms = [term for term in TERM_LABELS if term in set(coefficients["coefficient"])]
    x_of_term = {term: float(i) for i, term in enumerate(terms)}
    axes.axhline(0, color="black", linewidth=0.4)
    rows = coefficients[coefficients["medium"] == GENERIC]
    x_generic = rows["coefficient"].map(x_of_term).to_numpy(float)
    value, low, high = rows[_WITH_ENDS].to_numpy(float).T
    # an interval narrower than this has no height on the page
    least_height = 0.004 * float(np.ptp(np.append(value, 0.0)))
    is_wide = high - low > least_height
    if is_wide.any():
        bars = x_generic[is_wide], (high - low)[is_wide], 0.84, low[is_wide]
        axes.bar(*bars, color="#cccccc", linewidth=0, label="interval of $M_0$")
    ends = x_generic - 0.42, x_generic + 0.42
    axes.hlines(value, *ends, color="black", linewidth=1.2, label="generic $M_0$", zorder=1.5)
    for i, (medium, zeta) in enumerate(zetas.items()):
        rows = coefficients[coefficients["medium"] == medium]
        x = rows["coefficient"].map(x_of_term).to_numpy(float)
        # the media stand side by side in the column of the term
        x = x + 0.7 * ((i + 0.5) / len(zetas) - 0.5)
        colour, marker = looks[medium]
        value, low, high = rows[_WITH_ENDS].to_numpy(float).T / zeta
        axes.vlines(x, low, high, color=colour, linewidth=0.8)
        is_kept = rows["kept"].to_numpy(bool)
        look: style.Look = {"marker": marker, "linestyle": "", "color": colour, "markersize": 4}
        axes.plot(x[is_kept], value[is_kept], label=style.medium_label(results, medium), **look)
        axes.plot(x[~is_kept], value[~is_kept], markerfacecolor="white", **look)
    for edge in range(1, len(terms)):
        axes.axvline(edge - 0.5, color=style.GREY, linewidth=0.3)
    axes.set_xticks(list(x_of_term.values()), [TERM_LABELS[term] for term in terms], fontsize=7)
    axes.set(xlim=(-0.6, len(terms) - 0.4), ylabel=r"coefficient / $\zeta$ (dimensionless)")
    entries = axes.get_legend_handles_labels()
    axes.figure.legend(*entries, loc="upper center", ncols=4, borderaxespad=0.2)


def _draw_collapse(
    axes: Axes, c: str, results: Results, zetas: Mapping[str, float], generic: FloatArray
) -> None:
    """Draw measured alpha over zeta against generic alpha, one component: media that differ by zeta alone fall on one line.

    `c`: Component, ``z`` or ``x``. `zetas`: Zeta by medium, N/cm^3. `generic`: The nine coefficients of the generic
    profile.
    """
    looks = style.medium_looks(zetas)
    # all numbers on both axes, for their range
    ends: list[float] = []
    for medium, zeta in zetas.items():
        rows = results[medium].alpha
        model = evaluate(generic, *directions(rows))["zx".index(c)]
        value, low, high = rows[with_end_names(column(c))].to_numpy(float).T / zeta
        colour, marker = looks[medium]
        axes.vlines(model, low, high, color=colour, linewidth=0.5)
        axes.plot(model, value, marker, color=colour, markersize=1.8, markeredgewidth=0)
        ends += [*model[np.isfinite(model)], *value[np.isfinite(value)]]
    diagonal = [min(ends), max(ends)] if ends else [-1.0, 1.0]
    margin = 0.05 * (diagonal[1] - diagonal[0]) or 1.0
    axes.plot(diagonal, diagonal, color="black", linewidth=0.6, zorder=0)
    limits = diagonal[0] - margin, diagonal[1] + margin
    axes.set(xlim=limits, ylim=limits)
    axes.set_xlabel(rf"generic $\alpha_{c}$ (dimensionless)")
    axes.set_ylabel(f"measured $\\alpha_{c}$ / $\\zeta$\n(dimensionless)")
    axes.set_title("line: media alike", fontsize=6)
    axes.set_aspect("equal")
