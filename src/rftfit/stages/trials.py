"""Stage 7: the force model on trial, against the measured legs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.config import Leg
from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import column
from rftfit.profile.media_fits import MediumFit, fit_media, reference_of
from rftfit.store import read_csv, write_csv
from rftfit.validate.leg_errors import leg_errors
from rftfit.validate.predictions import laboratory_candidates, leg_prediction, sand_prediction

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config

COLUMNS = ["medium", "leg", "profile", "theta_deg", "force_z_N", "force_z_lo_N", "force_z_hi_N",
           "force_x_N", "force_x_lo_N", "force_x_hi_N", "moment_N_cm", "reason"]  # fmt: skip


def trials(
    config: Path, alpha: list[Path], sands: list[Path], legs: list[Path],
    predicted: Path, errors: Path,
) -> None:  # fmt: skip
    """Predict the force on every leg in every medium, and compare with what was measured.

    Parameters
    ----------
    config : Path
    alpha, sands, legs : list of Path
        Read: alpha tables of laboratory media and of sands, measured leg curves.
    predicted, errors : Path
        Written: curves with intervals, and how far they are from the measured ones.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    import pandas as pd

    settings = load_campaign(config).config
    tables = [read_csv(path) for path in alpha]
    fits = [f for f in fit_media(tables, settings) if f.method == settings.fourier.method]
    curves = [laboratory_curves(table, fits, settings) for table in tables]
    beds = [read_csv(path) for path in sands]
    curves += [sand_curves(table, fits, settings) for table in beds]
    everything = pd.concat(curves, ignore_index=True)[COLUMNS]
    write_csv(everything, predicted)
    measured = pd.concat([read_csv(path) for path in legs], ignore_index=True)
    spread = {str(t["medium"].iloc[0]): bed_spread(t) for t in (*tables, *beds)}
    compared = leg_errors(measured, everything, spread, settings.fit.confidence)
    # a curve from the published media says so in this table too
    names = [str(t["medium"].iloc[0]) for t in beds]
    silent = compared["medium"].isin(names) & (compared["reason"] == "")
    compared.loc[silent, "reason"] = reference_of(fits, settings).note
    write_csv(compared, errors)


def bed_spread(table: pd.DataFrame) -> float:
    """Relative spread of forces from one prepared bed of a medium to the next.

    A bed is looser or denser as a whole: its spread is that of alpha_z(0, 90 deg), relative.

    Parameters
    ----------
    table : pandas.DataFrame
        Alpha table of the medium.

    Returns
    -------
    float
        0 where the spread is not known.
    """
    cell = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].iloc[0]
    ratio = float(cell.get("run_to_run_z_N_per_cm3", 0.0)) / float(cell[column("z")])
    return ratio if ratio > 0 else 0.0


def _legs(config: Config) -> dict[str, Leg]:
    return {name: item for name, item in config.intruders.items() if isinstance(item, Leg)}


def laboratory_curves(table: pd.DataFrame, fits: list[MediumFit], config: Config) -> pd.DataFrame:
    """Predict the force on all legs in one medium that was measured over the grid.

    Parameters
    ----------
    table : pandas.DataFrame
        Its alpha table.
    fits : list of MediumFit
        Of all laboratory media, by the config's method.
    config : Config

    Returns
    -------
    pandas.DataFrame
        Columns `COLUMNS`.
    """
    import pandas as pd

    medium = str(table["medium"].iloc[0])
    own = next(fit for fit in fits if fit.medium == medium)
    reference = [fit for fit in fits if not fit.reason]
    parts = [
        leg_prediction(candidate, leg, config).assign(
            medium=medium, leg=name, profile=candidate.name
        )
        for candidate in laboratory_candidates(table, own, reference, config)
        for name, leg in _legs(config).items()
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=COLUMNS)


def sand_curves(table: pd.DataFrame, fits: list[MediumFit], config: Config) -> pd.DataFrame:
    """Predict the force on all legs in one natural sand from its penetration test.

    Parameters
    ----------
    table : pandas.DataFrame
        Its alpha table.
    fits : list of MediumFit
        Of the laboratory media; with fewer than two usable ones the published five serve.
    config : Config

    Returns
    -------
    pandas.DataFrame
        Columns `COLUMNS`; empty where the test gives no number, which the penetration table says.
    """
    import pandas as pd

    medium = str(table["medium"].iloc[0])
    reference = reference_of(fits, config)
    try:
        parts = [
            sand_prediction(table, reference, leg, config).assign(
                medium=medium, leg=name, profile="generic"
            )
            for name, leg in _legs(config).items()
        ]
    except ValueError:
        parts = []
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=COLUMNS)
