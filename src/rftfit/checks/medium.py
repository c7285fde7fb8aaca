"""Do all checks of a medium in their order, and make from their outcomes its faults and the marks beside its name."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from graphlib import TopologicalSorter
from typing import Any, get_args

import pandas as pd

from rftfit.campaign.config import CheckName, MediumSettings
from rftfit.campaign.load import Campaign
from rftfit.checks.declared import CHECKS, WAITS, Check, MediumMeasurements
from rftfit.measure.flags import Flags, Remark, remark
from rftfit.measure.verdict_words import ACCEPTED, DOUBTFUL, FAILED, NOT_CHECKED, UNUSABLE


def check_medium(
    campaign: Campaign,
    medium: str,
    tables: Mapping[str, pd.DataFrame],
    copies: Mapping[str, Collection[str]],
    flags: Flags,
) -> list[Check]:
    """Do every check on one medium, and return the outcomes in the order of the config.

    A failure becomes "not checked" if a check before it failed, as it would only repeat this failure, and "accepted" if
    the config accepts it with a reason.

    `tables`, `copies`, `flags`: See `MediumMeasurements`.
    """
    settings = campaign.config.media[medium]
    sheet = {run.run_id: run for run in campaign.runs_of(medium)}
    measured = MediumMeasurements(campaign.config, settings, sheet, tables, copies, flags)
    outcomes: dict[CheckName, Check] = {}
    # start with the order of the config, so that the order of imports changes nothing
    waits_for = {name: CHECKS[name].after for name in get_args(CheckName)}
    for name in TopologicalSorter(waits_for).static_order():
        outcome = outcomes[name] = CHECKS[name].check(measured)
        # only a failure has an effect
        failed_before = [before for before in CHECKS[name].after if outcomes[before].effect]
        if failed_before and outcome.verdict != NOT_CHECKED:
            # flags of single runs are kept
            outcomes[name] = replace(
                Check.skip(name, WAITS, first=failed_before[0]), flags=outcome.flags
            )
        elif outcome.verdict == FAILED and (why := settings.accept.get(name)):
            outcomes[name] = replace(outcome, verdict=ACCEPTED, why_accepted=why)
    return [outcomes[name] for name in get_args(CheckName)]


def faults_of(checks: pd.DataFrame) -> str:
    """Describe the faults of a medium, ``a and b``; `checks`: rows of failed checks in the table of checks."""
    rows = zip(checks["check"], checks["code"], checks["found"], strict=True)
    return " and ".join(
        found if CHECKS[check].quotes_found else CHECKS[check].fault_of(code)
        for check, code, found in rows
    )


def marks_of(checks: pd.DataFrame, media: Mapping[str, MediumSettings]) -> dict[str, list[Remark]]:
    """Return the marks of each medium that fails a check, which are shown wherever the medium appears.

    A mark is a remark: one for all checks that make the medium unusable, one for those that make it doubtful, and one
    for each failure that the config accepts. `checks`: Table of checks of all media. `media`: Their sections of the
    config.
    """
    marks_of_media = {}
    for medium, rows in checks.groupby("medium", sort=False):
        marks = []
        for effect in (UNUSABLE, DOUBTFUL):
            failed = rows[rows["effect"] == effect]
            if len(failed):
                marks.append(remark(effect, faults=faults_of(failed)))
        # the reason comes from the present config, which may be newer than the table
        accept: dict[Any, str] = media[str(medium)].accept
        for check, row in rows[rows["verdict"] == ACCEPTED].groupby("check", sort=False):
            why = accept.get(check, "")
            marks.append(remark(ACCEPTED, fault=faults_of(row), why=why))
        if marks:
            marks_of_media[str(medium)] = marks
    return marks_of_media
