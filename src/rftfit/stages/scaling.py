"""Stage 6: zeta, chi and the generic M0 of the reference media; zeta of the natural sands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import column
from rftfit.profile.bootstrap import interval
from rftfit.profile.fourier import TERMS
from rftfit.profile.media_fits import (
    AS_PRINTED,
    MediumFit,
    fit_media,
    generic_interval,
    reference_of,
)
from rftfit.profile.reference_media import GENERIC, Reference, routine
from rftfit.profile.scaling import generic, scale_new_medium
from rftfit.reference import coefficients as published_coefficients
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config

COLUMNS = [
    "method", "medium",
    *(f"alpha_z_{name}{end}_N_per_cm3" for name in ("measured", "fit") for end in ("", "_lo", "_hi")),
    *(f"{name}{end}" for name in ("chi", "zeta") for end in ("", "_lo", "_hi")),
    "reason",
]  # fmt: skip
"""Of the penetration table."""


def scaling(
    config: Path, alpha: list[Path], sands: list[Path], media_coefficients: Path,
    coefficients: Path, penetration: Path,
) -> None:  # fmt: skip
    """Scale the media onto one another.

    Natural sands are scaled with the campaign's own media; where fewer than two of these have a
    usable grid, with the published five, as the table says.

    Parameters
    ----------
    config : Path
    alpha, sands : list of Path
        Read: alpha tables of the laboratory media and of the natural sands.
    media_coefficients : Path
        Read: coefficients of the media, from the Fourier stage.
    coefficients, penetration : Path
        Written: the same with M0 added (as Table S2), and (0, 90 deg) with zeta and chi (as
        Table S3).

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    import pandas as pd

    settings = load_campaign(config).config
    fits = fit_media([read_csv(path) for path in alpha], settings)
    groups: dict[str, list[MediumFit]] = {}
    for fit in fits:
        if not fit.reason:
            groups.setdefault(fit.method, []).append(fit)
    media = read_csv(media_coefficients)
    parts = [media]
    rows = [_penetration_row(fit, settings) for fit in fits]
    for method, group in groups.items():
        parts.append(_generic_rows(method, group, settings))
    reference = reference_of(fits, settings)
    rows += [_sand_row(read_csv(path), reference, settings) for path in sands]
    write_csv(pd.concat(parts, ignore_index=True)[list(media.columns)], coefficients)
    write_csv(pd.DataFrame(rows, columns=COLUMNS), penetration)


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
