"""Stages that complete and scale alpha, one function a rule: symmetry, Fourier fit (nine terms), scaling.

A stage takes `Results`, the access to the tables of earlier stages, and returns the tables that its rule writes, in the
order of the rule. Alpha is stress per depth (N/cm^3) of a plate at the angle beta that moves along gamma, upward (alpha_z)
and forward (alpha_x). Laboratory media were pushed in many directions, natural sands only straight down.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from rftfit.compare.coefficients import (
    COEFFICIENT_COLUMNS,
    PENETRATION_COLUMNS,
    coefficient_rows,
    generic_rows,
    penetration_row,
    sand_row,
)
from rftfit.measure.alpha import alpha_columns, column, directions
from rftfit.measure.flags import MARKS
from rftfit.model.scaling import MediumFit, fit_media, reference_of
from rftfit.model.symmetry import torus
from rftfit.results import Results

SYMMETRY_COLUMNS = ["medium", "beta_deg", "gamma_deg", column("z"), column("x"), *MARKS]


def symmetry(results: Results) -> pd.DataFrame:
    """Complete the alpha table of every laboratory medium by symmetry: one row a direction, columns `SYMMETRY_COLUMNS`.

    A plate turned by 180 deg is the same plate, and a push seen from behind (mirrored in x) has the same alpha_z and the
    opposite alpha_x. So a table over half of the directions gives all of them.
    """
    tables = []
    for medium in results.laboratory:
        table = results.alpha_table(medium)
        grid = torus(*directions(table))
        alpha = grid.complete(*alpha_columns(table))
        # the marks of a medium are the same in all rows
        marks = (next(iter(table[name]), "") for name in MARKS)
        columns = (medium, np.degrees(grid.beta), np.degrees(grid.gamma), *alpha, *marks)
        tables.append(pd.DataFrame(dict(zip(SYMMETRY_COLUMNS, columns, strict=True))))
    return pd.concat(tables or [pd.DataFrame(columns=SYMMETRY_COLUMNS)], ignore_index=True)


def fourier(results: Results) -> pd.DataFrame:
    """Fit the nine Fourier terms of alpha (paper, Table S2) to the table of every laboratory medium, by each method.

    Returns a row for each method, medium and coefficient, with its interval.
    """
    fits = fit_media([results[medium].alpha for medium in results.laboratory], results.config)
    tables = [coefficient_rows(fit) for fit in fits]
    no_row = pd.DataFrame(columns=COEFFICIENT_COLUMNS)
    return results.marked(pd.concat(tables or [no_row], ignore_index=True))


def scaling(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scale the media onto one another, by which one push straight down is enough for a further medium.

    The nine terms of a medium are zeta M0: zeta is its fitted alpha_z(0, 90 deg), and M0, the generic profile, the mean of
    the media over their zeta. chi is measured over fitted alpha_z(0, 90 deg). Natural sands are scaled by the laboratory
    media of the campaign, or by the published five where fewer than two of the campaign's media have a usable grid; the
    table says which. Returns two tables: the coefficients with the generic ones, M0, added (as Table S2), and
    alpha_z(0, 90 deg) with zeta and chi (as Table S3).
    """
    config = results.config
    fits = fit_media([results[medium].alpha for medium in results.laboratory], config)
    # the generic profile of each method is made from the usable media alone
    usable_fits: dict[str, list[MediumFit]] = {}
    for fit in fits:
        if fit.counts:
            usable_fits.setdefault(fit.method, []).append(fit)
    coefficients_of_media = results.table("fourier/media.csv")
    tables = [coefficients_of_media, *(generic_rows(group) for group in usable_fits.values())]
    # the media that the natural sands are scaled by
    reference = reference_of(fits, config.fourier.method)
    rows = [penetration_row(fit) for fit in fits]
    sands = [results[medium] for medium in results.sands]
    rows += [sand_row(sand.alpha, reference, config, sand.flags) for sand in sands]
    coefficients = pd.concat(tables, ignore_index=True)[list(coefficients_of_media.columns)]
    return coefficients, results.marked(pd.DataFrame(rows, columns=PENETRATION_COLUMNS))
