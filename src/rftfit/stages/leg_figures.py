"""Figures of legs and natural sands: each function one figure, as png, pdf and svg."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from rftfit.campaign.config import Leg
from rftfit.campaign.load import load_campaign
from rftfit.report.generic_forces import draw_generic_forces
from rftfit.report.leg_media import draw_leg_media
from rftfit.report.legs import draw_legs
from rftfit.report.media_overview import draw_peak_errors
from rftfit.report.missing import draw_missing
from rftfit.report.sands import draw_penetration
from rftfit.report.saving import save
from rftfit.stages.figures import base_of, has_fit, why_no_fit
from rftfit.stages.samples import stress_samples
from rftfit.store import read_csv, read_parquet

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.load import Campaign


def _titles(campaign: Campaign) -> dict[str, str]:
    return {name: medium.title for name, medium in campaign.config.media.items()}


def _of_role(campaign: Campaign, role: str) -> list[str]:
    there = set(campaign.media_with_runs)
    media = campaign.config.media
    return [name for name in media if name in there and media[name].role == role]


def _joined(paths: list[Path]) -> pd.DataFrame:
    return pd.concat([read_csv(path) for path in paths], ignore_index=True)


def figure_legs(config: Path, medium: str, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in one medium (Figs. 3 D to F).

    Parameters
    ----------
    config : Path
    medium : str
    predicted : Path
    legs : list of Path
        Read: predicted and measured curves.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    outlines = {n: leg for n, leg in campaign.config.intruders.items() if isinstance(leg, Leg)}
    level = campaign.config.fit.confidence
    figure = draw_legs(
        read_csv(predicted), _joined(legs), medium, _titles(campaign), outlines, confidence=level
    )
    save(figure, base_of(png))


def figure_leg_media(config: Path, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in all laboratory media (Fig. S5).

    Parameters
    ----------
    config : Path
    predicted : Path
    legs : list of Path
        Read: predicted and measured curves.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    figure = draw_leg_media(
        read_csv(predicted), _joined(legs), _of_role(campaign, "laboratory"), _titles(campaign),
        profile="table", confidence=campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_sand_legs(config: Path, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in the natural sands (Fig. S12).

    Parameters
    ----------
    config : Path
    predicted : Path
    legs : list of Path
        Read: predicted and measured curves.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    figure = draw_leg_media(
        read_csv(predicted), _joined(legs), _of_role(campaign, "natural_sand"), _titles(campaign),
        profile="generic", confidence=campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_penetration(
    config: Path, tared: list[Path], windows: list[Path], sands: Path, png: Path
) -> None:
    """Draw the penetration tests of the natural sands (Fig. S11).

    Parameters
    ----------
    config : Path
    tared, windows : list of Path
        Read: of the sands, in one order.
    sands : Path
        Read: slopes over the stated and the detected regime.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    samples = pd.concat(
        [
            stress_samples(campaign, read_parquet(one), read_parquet(other))
            for one, other in zip(tared, windows, strict=True)
        ],
        ignore_index=True,
    )
    table = read_csv(sands)
    media_of = dict(zip(table["run_id"], table["medium"], strict=True))
    tests = samples[samples["run_id"].isin(list(media_of))].reset_index(drop=True)
    figure = draw_penetration(
        tests, media_of, table, _of_role(campaign, "natural_sand"), _titles(campaign),
        campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_generic_forces(
    config: Path, predicted: Path, legs: list[Path], penetration: Path, png: Path
) -> None:
    """Draw the forces on legs over zeta, all media on one another (Fig. S8).

    Parameters
    ----------
    config : Path
    predicted : Path
    legs : list of Path
    penetration : Path
        Read: predicted and measured curves, zeta.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    method, scaled = campaign.config.fourier.method, read_csv(penetration)
    if not has_fit(scaled, method, "zeta"):
        what = f"no zeta by {method}, so forces cannot be scaled"
        figure = draw_missing(what, why_no_fit(scaled, method))
    else:
        figure = draw_generic_forces(
            read_csv(predicted), _joined(legs), scaled, method=method, titles=_titles(campaign),
            confidence=campaign.config.fit.confidence,
        )  # fmt: skip
    save(figure, base_of(png))


def figure_peak_errors(config: Path, errors: Path, png: Path) -> None:
    """Draw how far the predicted peak lifts are from the measured ones.

    Parameters
    ----------
    config : Path
    errors : Path
        Read: of the trials stage.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    figure = draw_peak_errors(
        read_csv(errors), titles=_titles(campaign), confidence=campaign.config.fit.confidence
    )
    save(figure, base_of(png))
