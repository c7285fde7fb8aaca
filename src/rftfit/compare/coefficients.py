"""Rows of `coefficients.csv` and `penetration.csv`: the nine terms beside the printed ones, zeta and chi, natural sands.

A `MediumFit` is nine terms of one medium by one method (`rftfit.model.scaling`): `full` with all terms, `used`
fitted again with the kept ones alone, `draws` of `used` within the errors of alpha, shape (draws, 9), each in N/cm^3 in
the order of `TERMS`. zeta is alpha_z(0,
90 deg) by the fit; chi is alpha_z(0, 90 deg) as measured over zeta.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.measure.alpha import alpha_columns, cell_down, column, directions
from rftfit.measure.errors import shares
from rftfit.measure.flags import Flags, quoted, reason_columns, reason_of, remark
from rftfit.model import scaling
from rftfit.model.draws import interval
from rftfit.model.fourier import TERMS, TERMS_Z, evaluate
from rftfit.outputs.dictionary import columns_of
from rftfit.reference import MEDIA, coefficients

COEFFICIENT_COLUMNS = columns_of("coefficients.csv")
PENETRATION_COLUMNS = columns_of("penetration.csv")


def coefficient_rows(fit: scaling.MediumFit) -> pd.DataFrame:
    """Make a row of `COEFFICIENT_COLUMNS` for each coefficient of one fit, with its interval and the printed number.

    A dropped term shows its value in the full fit and ``kept`` False; where it is used, it counts
    as 0.
    """
    level, published_as = fit.config.fit.confidence, fit.config.media[fit.medium].published_as
    published = coefficients(published_as) if published_as in MEDIA else {}
    # standard error, ends of the interval, and value without flagged cells; none of a dropped term
    spread = [fit.draws.std(axis=0, ddof=1), *interval(fit.draws, level), fit.without_flagged]
    se, lo, hi, without = np.where(fit.keep, spread, np.nan)
    misfit_z, misfit_x = _misfit(fit)
    columns = {
        "method": fit.method,
        "medium": fit.medium,
        "coefficient": TERMS,
        "value_N_per_cm3": np.where(fit.keep, fit.used, fit.full),
        "se": se,
        "lo": lo,
        "hi": hi,
        "relative_to_A00": np.abs(fit.full / fit.full[0]),
        "kept": fit.keep,
        "published": [published.get(term, np.nan) for term in TERMS],
        "misfit_rms_N_per_cm3": [misfit_z if term in TERMS_Z else misfit_x for term in TERMS],
        "without_flagged": without,
    }
    return pd.DataFrame(columns | reason_columns(fit.why))


def _misfit(fit: scaling.MediumFit) -> tuple[float, float]:
    """Root mean square of table minus fit, z and x, N/cm^3, NaN without a fit.

    No interval of a coefficient contains it: it is what nine terms cannot describe.
    """
    if fit.reason:
        return np.nan, np.nan
    pairs = zip(alpha_columns(fit.table), evaluate(fit.used, *directions(fit.table)), strict=True)
    z, x = (float(np.sqrt(np.nanmean((alpha - fitted) ** 2))) for alpha, fitted in pairs)
    return z, x


def generic_rows(group: list[scaling.MediumFit]) -> pd.DataFrame:
    """Make the rows of M0, the mean over several media of their coefficients over zeta; `group`: fits by one method.

    Columns `COEFFICIENT_COLUMNS`, with the numbers that the paper prints where the media are those of the paper.
    """
    method, config = group[0].method, group[0].config
    m0 = scaling.generic(np.stack([fit.used for fit in group]))
    draws = scaling.generic(np.stack([fit.draws for fit in group], axis=1))
    lo, hi = scaling.generic_interval(group, config.fit.confidence)
    # Table S2 averages the paper's five media; a campaign of others has nothing to compare with
    published_media = {config.media[fit.medium].published_as for fit in group}
    of_paper = method == scaling.AS_PRINTED and published_media >= {*MEDIA}
    published = coefficients(scaling.GENERIC) if of_paper else {}
    columns = {
        "method": method,
        "medium": scaling.GENERIC,
        "coefficient": TERMS,
        "value_N_per_cm3": m0,
        "se": draws.std(axis=0, ddof=1),
        "lo": lo,
        "hi": hi,
        "relative_to_A00": np.abs(m0 / m0[0]),
        "kept": m0 != 0,
        "published": [published.get(term, np.nan) for term in TERMS],
    }
    # neither a misfit nor flagged cells
    return pd.DataFrame(columns | reason_columns([])).reindex(columns=COEFFICIENT_COLUMNS)


def penetration_row(fit: scaling.MediumFit) -> dict[str, object]:
    """Make the row of vertical penetration of a medium: as measured and as fitted, chi and zeta (as in Table S3).

    Columns `PENETRATION_COLUMNS`; chi and zeta have intervals by the draws.
    """
    push = cell_down(fit.table, fit.config.grid.angle_tolerance_deg)
    row: dict[str, object] = {"method": fit.method, "medium": fit.medium} | _alpha_z_of(push)
    # name, unit in the name of the column, value, draws
    for name, unit, value, draws in (
        ("alpha_z_fit", "_N_per_cm3", fit.zeta, fit.zeta_draws),
        (
            "chi",
            "",
            np.nan if fit.reason else float(scaling.chi_of(fit.alpha_z, fit.used)),
            scaling.chi_of(fit.alpha_z_draws, fit.draws),
        ),
        ("zeta", "", fit.zeta, fit.zeta_draws),
    ):
        lo, hi = interval(draws, fit.config.fit.confidence)
        row |= {f"{name}{unit}": value, f"{name}_lo{unit}": lo, f"{name}_hi{unit}": hi}
    row["zeta_without_flagged"] = float(scaling.vertical_penetration(fit.without_flagged))
    row["zeta_errors"] = shares(fit.zeta_errors)
    missing = [remark("no-push")] if push is None else []
    return row | reason_columns(fit.why or missing)


def _alpha_z_of(push: pd.Series[Any] | None) -> dict[str, object]:
    """Return alpha_z(0, 90 deg) as measured, with its interval, from its row of the alpha table; NaN where it has none."""
    return {
        f"alpha_z_measured{end}_N_per_cm3": np.nan if push is None else push[column("z", end)]
        for end in ("", "_lo", "_hi")
    }


def sand_row(
    table: pd.DataFrame, reference: scaling.Reference, config: Config, flags: Flags
) -> dict[str, object]:
    """Make the row of vertical penetration of a natural sand: zeta by the scaling routine, or the reason why not.

    A sand has one penetration test and no fit: zeta is alpha_z(0, 90 deg) over the mean chi of the reference media.
    `table`, `flags`: Alpha table and flags of the sand.
    """
    method = scaling.routine(config.fourier.method, printed=reference.printed)
    row: dict[str, object] = {"method": method, "medium": table["medium"].iloc[0]}
    cell = cell_down(table, config.grid.angle_tolerance_deg)
    if cell is None:
        return row | reason_columns([remark("no-push")])
    row |= _alpha_z_of(cell)
    level = config.fit.confidence
    try:
        scaled = scaling.scale_new_medium(*scaling.alpha_of_test(cell, level), reference.chi, level)
    except ValueError as error:
        return row | reason_columns(reason_of({**cell}) or [quoted(error, "no-zeta")])
    names = ("chi", "chi_lo", "chi_hi", "zeta", "zeta_lo", "zeta_hi")
    pooled = [flag for flag in flags.of_cell_alone({**cell}) if flag.code == "pooled-plates"]
    reason = reason_columns([*reference.remarks, *pooled])
    return row | {name: getattr(scaled, name) for name in names} | reason
