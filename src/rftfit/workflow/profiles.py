"""Stages of the force model: symmetry, Fourier fit, scaling."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column, grid
from rftfit.model.draws import interval
from rftfit.model.fourier import TERMS, evaluate, select_bic
from rftfit.model.scaling import (
    AS_PRINTED,
    GENERIC,
    MediumFit,
    Reference,
    fit_media,
    generic,
    generic_interval,
    reference_of,
    routine,
    scale_new_medium,
)
from rftfit.model.symmetry import extend, symmetrise
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA
from rftfit.reference import coefficients as published_coefficients

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.results import Results


# --- Stage 4: the symmetry extension of the alpha tables to all intrusion angles.


SYMMETRY_COLUMNS = ["medium", "beta_deg", "gamma_deg", column("z"), column("x")]


def symmetry(results: Results) -> pd.DataFrame:
    """Symmetrise the alpha table of every laboratory medium and extend it to all gamma, deg."""
    import pandas as pd

    parts = []
    for medium in results.laboratory:
        table = results.alpha_table(medium)
        pair = symmetrise(grid(table, column("z")), grid(table, column("x")))
        gamma, alpha_z, alpha_x = extend(np.radians(GAMMA_DEG), *pair)
        beta_deg, gamma_deg = np.meshgrid(BETA_DEG, np.degrees(gamma), indexing="ij")
        columns = (medium, beta_deg.ravel(), gamma_deg.ravel(), alpha_z.ravel(), alpha_x.ravel())
        parts.append(pd.DataFrame(dict(zip(SYMMETRY_COLUMNS, columns, strict=True))))
    nothing = pd.DataFrame(columns=SYMMETRY_COLUMNS)
    return pd.concat(parts, ignore_index=True) if parts else nothing


# --- Stage 5: nine-term fits of every medium by every method, and which terms matter.


COEFFICIENT_COLUMNS = ["method", "medium", "coefficient", "value_N_per_cm3", "se", "lo", "hi", "relative_to_A00",
           "kept", "kept_by_bic", "published", "misfit_rms_N_per_cm3", "reason"]  # fmt: skip
TERM_COLUMNS = ["medium", "term", "kept_by_bic", "one_of_the_nine"]


def fourier(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Fit the nine terms to the alpha table of every laboratory medium.

    Returns coefficients with intervals, and which harmonics an information criterion keeps.
    """
    import pandas as pd

    tables = {medium: results[medium].alpha for medium in results.laboratory}
    bic = {medium: _bic(table) for medium, table in tables.items()}
    rows = [
        row
        for fit in fit_media(list(tables.values()), results.config)
        for row in coefficient_rows(fit, results.config, tables[fit.medium], bic[fit.medium])
    ]
    listed = [
        {"medium": medium, "term": term, "kept_by_bic": kept, "one_of_the_nine": term in TERMS}
        for medium, selection in bic.items()
        for term, kept in selection.items()
    ]
    return pd.DataFrame(rows, columns=COEFFICIENT_COLUMNS), pd.DataFrame(
        listed, columns=TERM_COLUMNS
    )


def _bic(table: pd.DataFrame) -> dict[str, bool | None]:
    beta, gamma = np.radians(BETA_DEG), np.radians(GAMMA_DEG)
    return select_bic(beta, gamma, grid(table, column("z")), grid(table, column("x")))


def coefficient_rows(
    fit: MediumFit, config: Config, table: pd.DataFrame, bic: dict[str, bool | None]
) -> list[dict[str, object]]:
    """One row per coefficient of one fit.

    `table`: Alpha table of the medium. `bic`: Term to whether the information criterion keeps it,
    where that can be told. Returns A dropped term shows its value in the full fit and ``kept``
    False; where it is used, it counts as 0.
    """
    lo, hi = interval(fit.draws, config.fit.confidence)
    published_as = config.media[fit.medium].published_as
    published = published_coefficients(published_as) if published_as in MEDIA else {}
    misfit = _misfit(fit, table)
    return [
        {
            "method": fit.method,
            "medium": fit.medium,
            "coefficient": term,
            "value_N_per_cm3": fit.used[i] if fit.keep[i] else fit.full[i],
            "se": fit.draws[:, i].std(ddof=1) if fit.keep[i] else np.nan,
            "lo": lo[i] if fit.keep[i] else np.nan,
            "hi": hi[i] if fit.keep[i] else np.nan,
            "relative_to_A00": abs(fit.full[i] / fit.full[0]),
            "kept": bool(fit.keep[i]),
            "kept_by_bic": bic[term],
            "published": published.get(term, np.nan),
            "misfit_rms_N_per_cm3": misfit[0 if term in TERMS[:5] else 1],
            "reason": fit.reason,
        }
        for i, term in enumerate(TERMS)
    ]


def _misfit(fit: MediumFit, table: pd.DataFrame) -> tuple[float, float]:
    """Root mean square of table minus fit, z and x: what no interval of a coefficient contains."""
    if fit.reason:
        return np.nan, np.nan
    beta, gamma = np.radians(BETA_DEG)[:, None], np.radians(GAMMA_DEG)[None, :]
    model = evaluate(fit.used, beta, gamma)
    rest = [grid(table, column(c)) - part for c, part in zip("zx", model, strict=True)]
    return float(np.sqrt(np.nanmean(rest[0] ** 2))), float(np.sqrt(np.nanmean(rest[1] ** 2)))


# --- Stage 6: zeta, chi and the generic M0 of the reference media; zeta of the natural sands.


PENETRATION_COLUMNS = [
    "method", "medium",
    *(f"alpha_z_{name}{end}_N_per_cm3" for name in ("measured", "fit") for end in ("", "_lo", "_hi")),
    *(f"{name}{end}" for name in ("chi", "zeta") for end in ("", "_lo", "_hi")),
    "reason",
]  # fmt: skip
"""Of the penetration table."""


def scaling(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scale the media onto one another.

    Natural sands are scaled with the campaign's own media; where fewer than two of these have a
    usable grid, with the published five, as the table says. Returns the coefficients with M0 added
    (as Table S2), and (0, 90 deg) with zeta and chi (as Table S3).
    """
    import pandas as pd

    settings = results.config
    fits = fit_media([results[medium].alpha for medium in results.laboratory], settings)
    groups: dict[str, list[MediumFit]] = {}
    for fit in fits:
        if not fit.reason:
            groups.setdefault(fit.method, []).append(fit)
    media = results.table("fourier/media.csv")
    parts = [media]
    rows = [_penetration_row(fit, settings) for fit in fits]
    for method, group in groups.items():
        parts.append(_generic_rows(method, group, settings))
    reference = reference_of(fits, settings)
    rows += [_sand_row(results[medium].alpha, reference, settings) for medium in results.sands]
    coefficients = pd.concat(parts, ignore_index=True)[list(media.columns)]
    return coefficients, pd.DataFrame(rows, columns=PENETRATION_COLUMNS)


def _generic_rows(method: str, group: list[MediumFit], config: Config) -> pd.DataFrame:
    import pandas as pd

    m0 = generic(np.stack([fit.used for fit in group]))
    draws = generic(np.stack([fit.draws for fit in group], axis=1))
    lo, hi = generic_interval(group, config.fit.confidence)
    # Table S2 averages the paper's five media; a campaign of others has nothing to compare with
    paper = {fit.medium for fit in group} >= {
        name for name, medium in config.media.items() if medium.role == "laboratory"
    } and method == AS_PRINTED
    published = published_coefficients(GENERIC) if paper else {}
    return pd.DataFrame(
        {
            "method": method,
            "medium": GENERIC,
            "coefficient": list(TERMS),
            "value_N_per_cm3": m0,
            "se": draws.std(axis=0, ddof=1),
            "lo": lo,
            "hi": hi,
            "relative_to_A00": np.abs(m0 / m0[0]),
            "kept": m0 != 0,
            "kept_by_bic": None,
            "published": [published.get(term, np.nan) for term in TERMS],
            "misfit_rms_N_per_cm3": np.nan,
            "reason": "",
        }
    )


def _penetration_row(fit: MediumFit, config: Config) -> dict[str, object]:
    level = config.fit.confidence
    chi = fit.alpha_z / fit.zeta if not fit.reason else np.nan
    row: dict[str, object] = {"method": fit.method, "medium": fit.medium}
    for name, value, draws in (
        ("alpha_z_measured", fit.alpha_z, fit.alpha_z_draws),
        ("alpha_z_fit", fit.zeta, fit.zeta_draws),
        ("chi", chi, fit.alpha_z_draws / fit.zeta_draws),
        ("zeta", fit.zeta, fit.zeta_draws),
    ):
        lo, hi = interval(draws, level)
        unit = "_N_per_cm3" if name.startswith("alpha") else ""
        row |= {f"{name}{unit}": value, f"{name}_lo{unit}": lo, f"{name}_hi{unit}": hi}
    return row | {"reason": fit.reason}


def _sand_row(table: pd.DataFrame, reference: Reference, config: Config) -> dict[str, object]:
    """Zeta of a natural sand by the scaling routine."""
    method = routine(config.fourier.method, printed=reference.printed)
    row: dict[str, object] = {"method": method, "medium": table["medium"].iloc[0]}
    cell = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].iloc[0]
    for quantity in ("", "_lo", "_hi"):
        row[f"alpha_z_measured{quantity}_N_per_cm3"] = cell[column("z", quantity)]
    try:
        scaled = scale_new_medium(
            float(cell[column("z")]),
            float(cell[column("z", "_se")]),
            reference.chi,
            reference.m0,
            config.fit.confidence,
        )
    except ValueError as error:
        return row | {"reason": str(cell["reason"]) or str(error)}
    return row | {
        "chi": scaled.chi, "chi_lo": scaled.chi_lo, "chi_hi": scaled.chi_hi,
        "zeta": scaled.zeta, "zeta_lo": scaled.zeta_lo, "zeta_hi": scaled.zeta_hi,
        "reason": reference.note,
    }  # fmt: skip
