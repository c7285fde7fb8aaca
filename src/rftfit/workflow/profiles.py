"""Stages of the force model: symmetry, Fourier fit, scaling."""

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
    """Complete the alpha table of every laboratory medium by symmetry, one row a direction."""
    parts = []
    for medium in results.laboratory:
        table = results.alpha_table(medium)
        grid = torus(*directions(table))
        alpha = grid.complete(*alpha_columns(table))
        # the marks of a medium are the same in all rows
        marks = (next(iter(table[name]), "") for name in MARKS)
        columns = (medium, np.degrees(grid.beta), np.degrees(grid.gamma), *alpha, *marks)
        parts.append(pd.DataFrame(dict(zip(SYMMETRY_COLUMNS, columns, strict=True))))
    return pd.concat(parts or [pd.DataFrame(columns=SYMMETRY_COLUMNS)], ignore_index=True)


def fourier(results: Results) -> pd.DataFrame:
    """Fit the nine terms to the alpha table of every laboratory medium; return the coefficients with intervals."""
    fits = fit_media([results[medium].alpha for medium in results.laboratory], results.config)
    parts = [coefficient_rows(fit) for fit in fits]
    no_row = pd.DataFrame(columns=COEFFICIENT_COLUMNS)
    return results.marked(pd.concat(parts or [no_row], ignore_index=True))


def scaling(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scale the media onto one another.

    Natural sands are scaled by the laboratory media of the campaign, or by the published five where fewer than two of
    the campaign's media have a usable grid; the table says which. Returns two tables: the coefficients with the generic
    ones, M0, added (as Table S2), and alpha_z(0, 90 deg) with zeta and chi (as Table S3).
    """
    config = results.config
    fits = fit_media([results[medium].alpha for medium in results.laboratory], config)
    # the generic profile of each method is made from the usable media alone
    usable_fits: dict[str, list[MediumFit]] = {}
    for fit in fits:
        if fit.counts:
            usable_fits.setdefault(fit.method, []).append(fit)
    media = results.table("fourier/media.csv")
    parts = [media, *(generic_rows(group) for group in usable_fits.values())]
    reference = reference_of(fits, config.fourier.method)
    rows = [penetration_row(fit) for fit in fits]
    sands = [results[medium] for medium in results.sands]
    rows += [sand_row(sand.alpha, reference, config, sand.flags) for sand in sands]
    coefficients = pd.concat(parts, ignore_index=True)[list(media.columns)]
    return coefficients, results.marked(pd.DataFrame(rows, columns=PENETRATION_COLUMNS))
