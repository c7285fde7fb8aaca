"""Ours beside the paper's: every published number that this chain can meet, with a verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.profile.reference_media import routine
from rftfit.store import read_csv, write_csv
from rftfit.validate.leg_claims import leg_claims
from rftfit.validate.robot import robot_claims
from rftfit.validate.slips import slips
from rftfit.validate.tables import compare_alpha, compare_coefficients, compare_penetration

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.validate.comparison import Item


def reproduction(
    config: Path,
    alpha: list[Path],
    coefficients: Path,
    penetration: Path,
    errors: Path,
    legs: list[Path],
    reproduction: Path,
    robot_errors: list[Path] | None = None,
    robot_optimum: list[Path] | None = None,
) -> None:
    """Write the reproduction table.

    Parameters
    ----------
    config : Path
    alpha : list of Path
    coefficients, penetration, errors : Path
        Read: tables of the earlier stages.
    legs : list of Path
        Read: measured leg curves.
    reproduction : Path
        Written: `item, where, paper, ours, lo, hi, verdict, why`.
    robot_errors, robot_optimum : list of Path, optional
        Read: tables of the robot, where the campaign has one.

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    import pandas as pd

    settings = load_campaign(config).config
    published = {
        name: medium.published_as
        for name, medium in settings.media.items()
        if medium.published_as is not None
    }
    tables = {str(t["medium"].iloc[0]): t for t in (read_csv(path) for path in alpha)}
    values = read_csv(coefficients)
    items: list[Item] = []
    items += compare_alpha(tables, published)
    items += compare_coefficients(values, published)
    scaled = read_csv(penetration)
    items += compare_penetration(scaled, published)
    measured = pd.concat([read_csv(path) for path in legs], ignore_index=True)
    printed = (scaled["method"] == routine(settings.fourier.method, printed=True)).any()
    chi_of = "the published" if printed else "this campaign's"
    items += leg_claims(read_csv(errors), measured, chi_of)
    for compared, best in zip(robot_errors or [], robot_optimum or [], strict=True):
        items += robot_claims(read_csv(compared), read_csv(best))
    items += slips()
    write_csv(pd.DataFrame([item.row() for item in items]), reproduction)
