"""What the report page is made from: the tables of a run, its configuration, its provenance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.report.page.provenance import Provenance, provenance_of
from rftfit.report.page.robot import RobotTables, read_robot_tables
from rftfit.store import read_csv

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config


@dataclass(frozen=True)
class PageInputs:
    """Everything that the page shows; columns of the tables as in ``docs/architecture.md``.

    Parameters
    ----------
    config : Config
    alpha : mapping of str to pandas.DataFrame
        Alpha table by medium, natural sands too.
    coefficients, penetration, reproduction, ledger : pandas.DataFrame
    runs, fits : pandas.DataFrame
        Of all media. A medium's own run table gives its flags, so `runs` has a column ``medium``.
    legs : pandas.DataFrame
        Measured leg curves of all media.
    predicted, leg_errors, sands, sand_correction : pandas.DataFrame
        Of the trials.
    provenance : Provenance
    robot : RobotTables, optional
        None where the campaign has no robot.
    """

    config: Config
    alpha: Mapping[str, pd.DataFrame]
    coefficients: pd.DataFrame
    penetration: pd.DataFrame
    reproduction: pd.DataFrame
    ledger: pd.DataFrame
    runs: pd.DataFrame
    fits: pd.DataFrame
    legs: pd.DataFrame
    predicted: pd.DataFrame
    leg_errors: pd.DataFrame
    sands: pd.DataFrame
    sand_correction: pd.DataFrame
    provenance: Provenance
    robot: RobotTables | None = None

    @property
    def media(self) -> list[str]:
        """Media that have an alpha table, in the order of the configuration."""
        return [name for name in self.config.media if name in self.alpha]

    @property
    def titles(self) -> dict[str, str]:
        """Title of every medium of the configuration, as the user wrote it."""
        return {name: medium.title for name, medium in self.config.media.items()}


def read_inputs(
    config: Path,
    *,
    alpha: Sequence[Path],
    coefficients: Path,
    penetration: Path,
    reproduction: Path,
    ledger: Path,
    runs: Sequence[Path],
    fits: Sequence[Path],
    legs: Sequence[Path],
    predicted: Sequence[Path],
    leg_errors: Path,
    sands: Path,
    sand_correction: Path,
    code: str,
    digests: Mapping[str, str],
    robot: Sequence[Path] = (),
) -> PageInputs:
    """Read the tables of a run.

    Parameters
    ----------
    config : Path
    alpha, fits, legs : sequence of Path
        One per medium.
    runs : sequence of Path
        One per medium, named after it (``runs/<medium>.csv``).
    predicted : sequence of Path
        One, or one per medium.
    coefficients, penetration, reproduction, ledger, leg_errors, sands : Path
    sand_correction : Path
    code : str
        Digest of the program's source, for the provenance.
    digests : mapping of str to str
        Of settings and run sheet, for the provenance.
    robot : sequence of Path, optional
        See `rftfit.report.page.robot.read_robot_tables`.

    Returns
    -------
    PageInputs

    Raises
    ------
    RftfitError
        If the campaign is not valid or a table cannot be read.
    """
    campaign = load_campaign(config)
    tables = [read_csv(path) for path in alpha]
    return PageInputs(
        config=campaign.config,
        alpha={str(table["medium"].iloc[0]): table for table in tables if len(table)},
        coefficients=read_csv(coefficients),
        penetration=read_csv(penetration),
        reproduction=read_csv(reproduction),
        ledger=read_csv(ledger),
        # the run tables do not say their medium, their names do
        runs=_joined([read_csv(path).assign(medium=path.stem) for path in runs]),
        fits=_joined([read_csv(path) for path in fits]),
        legs=_joined([read_csv(path) for path in legs]),
        predicted=_joined([read_csv(path) for path in predicted]),
        leg_errors=read_csv(leg_errors),
        sands=read_csv(sands),
        sand_correction=read_csv(sand_correction),
        provenance=provenance_of(code, digests),
        robot=read_robot_tables(robot),
    )


def _joined(tables: Sequence[pd.DataFrame]) -> pd.DataFrame:
    import pandas as pd

    filled = [table for table in tables if len(table)]
    return pd.concat(filled, ignore_index=True) if filled else pd.DataFrame()
