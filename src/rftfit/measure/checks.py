"""Checks of a medium: whether its numbers can be believed, and if not, why."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import get_args

import pandas as pd

from rftfit.campaign.config import CheckName
from rftfit.campaign.load import Campaign
from rftfit.measure import checks_axes, checks_channels, checks_runs, checks_shared, checks_surface
from rftfit.measure.flags import Flags
from rftfit.measure.verdict_words import ACCEPTED, FAILED, NOT_CHECKED
from rftfit.measure.verdicts import CHECKS, Check, MediumMeasurements

IN_ORDER: dict[CheckName, Callable[[MediumMeasurements], Check]] = {
    "channels": checks_channels.check_channels,
    "rods": checks_runs.check_rods,
    "drift": checks_runs.check_drift,
    "work": checks_axes.check_work,
    "axes": checks_shared.check_axes,
    "symmetry": checks_axes.check_symmetry,
    "up_down": checks_axes.check_up_down,
    "surface": checks_surface.check_surface,
    "linearity": checks_surface.check_linearity,
    "steadiness": checks_runs.check_steadiness,
    "repeats": checks_runs.check_repeats,
    "shared": checks_shared.check_shared,
    "same_logs": checks_runs.check_logs,
    "size": checks_runs.check_size,
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
