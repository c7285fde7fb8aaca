"""Figures of the measurement chain: each function one figure, as png, pdf and svg."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.errors import InputError
from rftfit.profile.fourier import evaluate
from rftfit.report.generic import draw_generic
from rftfit.report.maps import draw_fit_maps, draw_maps
from rftfit.report.missing import draw_missing
from rftfit.report.quality import draw_quality
from rftfit.report.saving import save
from rftfit.report.stress import draw_stress
from rftfit.report.tare import draw_tare
from rftfit.stages.chosen import stress_runs
from rftfit.stages.samples import stress_samples
from rftfit.store import read_csv, read_parquet

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign


def base_of(png: Path) -> Path:
    """Path of a figure without its ending; a point in a medium's name is part of the name.

    Parameters
    ----------
    png : Path

    Returns
    -------
    Path
    """
    return png.with_name(png.name.removesuffix(".png"))


def _titles(campaign: Campaign) -> dict[str, str]:
    return {name: medium.title for name, medium in campaign.config.media.items()}


def _tables(paths: list[Path]) -> pd.DataFrame:
    import pandas as pd

    return pd.concat([read_csv(path) for path in paths], ignore_index=True)


def figure_stress(
    config: Path, tared: list[Path], windows: list[Path], fits: list[Path], png: Path
) -> None:
    """Draw stress against depth of the runs that the config names (Fig. 2B).

    Parameters
    ----------
    config : Path
    tared, windows, fits : list of Path
        Read: of the media that these runs belong to, in one order.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If a run has no samples or a result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    samples = pd.concat(
        [
            stress_samples(campaign, read_parquet(one), read_parquet(other))
            for one, other in zip(tared, windows, strict=True)
        ],
        ignore_index=True,
    )
    table = _tables(fits)
    chosen = stress_runs(campaign)
    known = set(samples["run_id"])
    # a run that was refused has nothing to draw; the quality sheet and the ledger say why
    drawn = [name for name in chosen if name in known] or sorted(known)[:1]
    if not drawn:
        raise InputError(f"none of the runs {', '.join(chosen)} has a tared stroke to draw")
    save(draw_stress(samples, table, drawn, campaign.config.fit.confidence), base_of(png))


def figure_maps(config: Path, alpha: list[Path], png: Path) -> None:
    """Draw maps of measured alpha and of its intervals (Figs. 2C, 2D, S4).

    Parameters
    ----------
    config : Path
    alpha : list of Path
        Read: alpha tables, drawn in this order.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    figure = draw_maps(_tables(alpha), _titles(campaign), campaign.config.fit.confidence)
    save(figure, base_of(png))


def figure_fit(config: Path, alpha: list[Path], coefficients: Path, png: Path) -> None:
    """Draw the nine-term fits and what they leave over (Fig. S6).

    Parameters
    ----------
    config : Path
    alpha : list of Path
    coefficients : Path
        Read: alpha tables and coefficients.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    method = campaign.config.fourier.method
    values = read_csv(coefficients)
    if not has_fit(values, method, "value_N_per_cm3"):
        figure = draw_missing(f"no nine-term fit by {method}", why_no_fit(values, method))
    else:
        figure = draw_fit_maps(_tables(alpha), values, evaluate, method, _titles(campaign))
    save(figure, base_of(png))


def figure_generic(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path, png: Path
) -> None:
    """Draw the media scaled onto the generic profile (Fig. S7).

    Parameters
    ----------
    config : Path
    alpha : list of Path
    coefficients, penetration : Path
        Read: alpha tables, coefficients with M0, zeta.
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
        figure = draw_missing(f"no generic profile by {method}", why_no_fit(scaled, method))
    else:
        figure = draw_generic(
            read_csv(coefficients), scaled, _tables(alpha), evaluate, method, _titles(campaign)
        )
    save(figure, base_of(png))


def has_fit(table: pd.DataFrame, method: str, column: str) -> bool:
    """Whether any laboratory medium could be fitted.

    Parameters
    ----------
    table : pandas.DataFrame
        Coefficients or penetration.
    method : str
        Of the fit.
    column : str
        Whose number tells.

    Returns
    -------
    bool
    """
    return bool(table.loc[table["method"] == method, column].notna().any())


def why_no_fit(table: pd.DataFrame, method: str) -> list[str]:
    """Say of every laboratory medium why it could not be fitted.

    Parameters
    ----------
    table : pandas.DataFrame
        Coefficients or penetration.
    method : str
        Of the fit.

    Returns
    -------
    list of str
    """
    rows = table[table["method"] == method].drop_duplicates("medium")
    return [f"{m}: {why}" for m, why in zip(rows["medium"], rows["reason"], strict=True)]


def quality(config: Path, medium: str, tared: Path, windows: Path, fits: Path, png: Path) -> None:
    """Draw the quality sheet of one medium: every plate run with its tare, window and fit.

    Parameters
    ----------
    config : Path
    medium : str
    tared, windows, fits : Path
        Read: from the tare and slope stages.
    png : Path
        Written, with pdf and svg beside it; further pages as ``<name>_page2`` and so on.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    campaign = load_campaign(config)
    samples = stress_samples(campaign, read_parquet(tared), read_parquet(windows))
    title = campaign.config.media[medium].title
    for number, figure in enumerate(draw_quality(samples, read_csv(fits), title), start=1):
        base = base_of(png)
        save(figure, base if number == 1 else base.with_name(f"{base.name}_page{number}"))


def figure_tare(config: Path, medium: str, tared: Path, tares: Path, png: Path) -> None:
    """Draw the tare of the medium's deepest slanted plate run, with its valid range.

    Parameters
    ----------
    config : Path
    medium : str
    tared, tares : Path
        Read: from the tare stage.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If no run has a tare or the result cannot be written.
    """
    campaign = load_campaign(config)
    samples = read_parquet(tared)
    table = read_csv(tares)
    known = table[(table["abscissa"] == "depth_cm") & table["valid_to"].notna()]
    if known.empty:
        raise InputError(f"{medium}: no plate run has a tare to draw")
    deepest = known.sort_values(["valid_to", "run_id"], ascending=[False, True]).iloc[0]
    part = samples[(samples["run_id"] == deepest["run_id"]).to_numpy()]
    frame = part[["depth_cm"]].assign(
        force_z_N=part["tare_z_N"], force_x_N=part["tare_x_N"], valid=part["tare_z_N"].notna()
    )
    title = f"{campaign.config.media[medium].title}: tare {deepest['tare_run']}"
    save(draw_tare(frame, title), base_of(png))
