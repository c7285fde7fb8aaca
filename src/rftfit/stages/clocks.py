"""Quality figure of a medium whose clocks are estimated: from the estimates' own details."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.errors import InputError
from rftfit.report.clocks import draw_clocks
from rftfit.report.saving import save
from rftfit.stages.figures import base_of
from rftfit.stages.ingest import ingest_traces

if TYPE_CHECKING:
    from pathlib import Path


def figure_clocks(config: Path, medium: str, png: Path) -> None:
    """Draw how the clocks of each run of a medium were brought together.

    Parameters
    ----------
    config : Path
        Its ``clock.method`` is ``estimate``.
    medium : str
    png : Path
        Written; pdf and svg beside it.

    Raises
    ------
    RftfitError
        If the campaign is not valid, no run has an estimate, or a file cannot be written.
    """
    campaign = load_campaign(config)
    try:
        drawn = draw_clocks(ingest_traces(campaign, medium)[0])
    except ValueError as error:
        raise InputError(f"{medium}: {error}; is clock.method estimate?") from error
    save(drawn, base_of(png))
