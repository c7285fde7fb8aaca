"""Stage 5: nine-term fits of every medium by every method, and which terms matter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import column, grid
from rftfit.profile.bootstrap import interval
from rftfit.profile.fourier import TERMS, evaluate
from rftfit.profile.media_fits import MediumFit, fit_media
from rftfit.profile.selection import select_bic
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA
from rftfit.reference import coefficients as published_coefficients
from rftfit.store import read_csv, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config


COLUMNS = ["method", "medium", "coefficient", "value_N_per_cm3", "se", "lo", "hi", "relative_to_A00",
           "kept", "kept_by_bic", "published", "misfit_rms_N_per_cm3", "reason"]  # fmt: skip
TERM_COLUMNS = ["medium", "term", "kept_by_bic", "one_of_the_nine"]


def fourier(config: Path, alpha: list[Path], coefficients: Path, terms: Path) -> None:
    """Fit the nine terms to the alpha table of every laboratory medium.

    Parameters
    ----------
    config : Path
    alpha : list of Path
        Read: alpha tables.
    coefficients, terms : Path
        Written: coefficients with intervals, and which harmonics an information criterion keeps;
        without rows where no medium was measured over the grid.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    tables = [read_csv(path) for path in alpha]
    bic = {str(table["medium"].iloc[0]): _bic(table) for table in tables}
    rows = []
    for fit in fit_media(tables, campaign.config):
        table = next(t for t in tables if t["medium"].iloc[0] == fit.medium)
        rows += coefficient_rows(fit, campaign.config, table, bic[fit.medium])
    write_csv(pd.DataFrame(rows, columns=COLUMNS), coefficients)
    listed = [
        {"medium": medium, "term": term, "kept_by_bic": kept, "one_of_the_nine": term in TERMS}
        for medium, selection in bic.items()
        for term, kept in selection.items()
    ]
    write_csv(pd.DataFrame(listed, columns=TERM_COLUMNS), terms)


def _bic(table: pd.DataFrame) -> dict[str, bool]:
    beta, gamma = np.radians(BETA_DEG), np.radians(GAMMA_DEG)
    return select_bic(beta, gamma, grid(table, column("z")), grid(table, column("x")))


def coefficient_rows(
    fit: MediumFit, config: Config, table: pd.DataFrame, bic: dict[str, bool]
) -> list[dict[str, object]]:
    """One row per coefficient of one fit.

    Parameters
    ----------
    fit : MediumFit
    config : Config
    table : pandas.DataFrame
        Alpha table of the medium.
    bic : dict of str to bool
        Term to whether the information criterion keeps it.

    Returns
    -------
    list of dict
        A dropped term shows its value in the full fit and ``kept`` False; where it is used, it
        counts as 0.
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
