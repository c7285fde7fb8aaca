"""Workbooks in the layouts of Tables S5 and S2."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.reference import MEDIA
from rftfit.report.workbooks import write_alpha_workbook, write_coefficient_workbook
from rftfit.store import read_csv

if TYPE_CHECKING:
    from pathlib import Path


def workbooks(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path,
    alpha_tables: Path, coefficient_tables: Path,
) -> None:  # fmt: skip
    """Write the alpha tables and the coefficients as workbooks.

    Parameters
    ----------
    config : Path
    alpha : list of Path
    coefficients, penetration : Path
        Read: tables of the earlier stages.
    alpha_tables, coefficient_tables : Path
        Written (xlsx).

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    settings = load_campaign(config).config
    titles = {name: medium.title for name, medium in settings.media.items()}
    published = {
        name: medium.published_as
        for name, medium in settings.media.items()
        if medium.published_as in MEDIA
    }
    level = settings.fit.confidence
    tables = [read_csv(path) for path in alpha]
    write_alpha_workbook(
        {str(table["medium"].iloc[0]): table for table in tables}, alpha_tables, titles, level
    )
    write_coefficient_workbook(
        read_csv(coefficients), coefficient_tables,
        {name: key for name, key in published.items() if key} | {"generic": "generic"},
        read_csv(penetration), titles, level,
    )  # fmt: skip
