"""Checks of a medium: whether its numbers can be believed, and if not, why."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import get_args

import pandas as pd

from rftfit.campaign.config import CheckName
from rftfit.campaign.load import Campaign
from rftfit.checks import axes, channels, runs, shared, surface
from rftfit.checks.declared import CHECKS, Check, MediumMeasurements
from rftfit.measure.flags import Flags
from rftfit.measure.verdict_words import ACCEPTED, FAILED, NOT_CHECKED

IN_ORDER: dict[CheckName, Callable[[MediumMeasurements], Check]] = {
    "channels": channels.check_channels,
    "rods": runs.check_rods,
    "drift": runs.check_drift,
    "work": axes.check_work,
    "axes": shared.check_axes,
    "symmetry": axes.check_symmetry,
    "up_down": axes.check_up_down,
    "surface": surface.check_surface,
    "linearity": surface.check_linearity,
    "steadiness": runs.check_steadiness,
    "repeats": runs.check_repeats,
    "shared": shared.check_shared,
    "same_logs": runs.check_logs,
    "size": runs.check_size,
}
"""All checks; those that others wait for come first."""


def check_medium(
    campaign: Campaign,
    medium: str,
    tables: Mapping[str, pd.DataFrame],
    copies: Mapping[str, Collection[str]],
    flags: Flags,
) -> list[Check]:
    """Do every check on one medium; what the config accepts is not failed."""
    settings = campaign.config.media[medium]
    sheet = {run.run_id: run for run in campaign.runs_of(medium)}
    measured = MediumMeasurements(campaign.config, settings, sheet, tables, copies, flags)
    outcomes: dict[CheckName, Check] = {}
    for name, check in IN_ORDER.items():
        outcome = outcomes[name] = check(measured)
        failed_before = [
            prior_check for prior_check in CHECKS[name].after if outcomes[prior_check].effect
        ]
        if failed_before and outcome.verdict != NOT_CHECKED:
            # the flags of single runs stay
            outcomes[name] = replace(
                Check.skip(name, "waits", first=failed_before[0]), flags=outcome.flags
            )
        elif outcome.verdict == FAILED and (why := settings.accept.get(name)):
            outcomes[name] = replace(outcome, verdict=ACCEPTED, why_accepted=why)
    return [outcomes[name] for name in get_args(CheckName)]
