"""Which runs a figure shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign


def stress_runs(campaign: Campaign) -> list[str]:
    """Choose the runs of the stress figure: those the config names, or the flat plate down and up.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    list of str

    Raises
    ------
    InputError
        If the config names a run that is not in the sheet, or the sheet has no plate run.
    """
    named = campaign.config.figures.stress_runs
    unknown = [name for name in named if name not in campaign.by_id]
    if unknown:
        raise InputError(
            f"config, figures.stress_runs: found {', '.join(unknown)}; allowed: run_id of the run sheet"
        )
    if named:
        return list(named)
    plates = [
        run
        for medium in campaign.config.media
        for run in campaign.runs_of(medium)
        if run.kind == "plate" and run.direction != "horizontal"
    ]
    if not plates:
        raise InputError("the run sheet has no slanted plate run to draw")
    first = plates[0].medium
    flat = [run.run_id for run in plates
            if run.medium == first and run.beta_deg == 0 and run.gamma_deg == 90]  # fmt: skip
    return flat or [plates[0].run_id]
