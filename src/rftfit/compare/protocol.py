"""Rates a plan of runs before it is measured: how large an error must be that many runs share, to be seen in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.compare.causes import NOT_SEEN, labels_of, rows_of_scan
from rftfit.compare.joint import ALL, FROM_RUN, JointModel, RunSlopes, expected_alpha
from rftfit.measure.fits import filed_under
from rftfit.measure.flags import format_remarks, remark
from rftfit.measure.verdict_words import FEWEST_RUNS

NOISE = 0.02
"""Standard error of a run's slope that a usual log has, relative to the largest slope."""

NEEDED_CAUSES = {("gain", FROM_RUN): "repeat-first", ("turn", ALL): "push-mirror-image"}
"""Kind and group (`rftfit.compare.joint.Cause`) of the errors that a campaign must be able to show: a gain that changes
from one run on, and a turn of the mount in all runs. To the code of the remark on which runs would show it."""

LARGE = {"gain": 0.2, "turn": 5.0}
"""Sizes that must not stay unseen, a share and degrees: where only larger ones would be told, the cure is named too."""


class PlanPower(NamedTuple):
    """Least error shared by many runs that the planned runs of a medium show.

    `kind`, `group`: of the error, a key of `NEEDED_CAUSES`. `least_seen`: least size that is told with a probability of
    80 %, a share for a gain or degrees for a turn; NaN where it cannot be told.
    """

    medium: str
    kind: str
    group: str
    least_seen: float

    @property
    def sentence(self) -> str:
        """Sentence on the least error that is told, with the cure where this is not small enough."""
        cure = str(remark(NEEDED_CAUSES[self.kind, self.group]))
        if math.isnan(self.least_seen):
            return format_remarks([remark(f"plan-lacks-{self.kind}", cure=cure)])
        least = str(remark(f"least-{self.kind}", least=self.least_seen))
        if self.least_seen > LARGE[self.kind]:
            return format_remarks([remark("plan-tells-large", least=least, cure=cure)])
        return format_remarks([remark("plan-tells", least=least)])


def rate_plan(campaign: Campaign) -> list[PlanPower]:
    """Rate the plate runs of each medium that have no log yet, once for each of `NEEDED_CAUSES`.

    The joint model finds what it would see in a medium of the published shape, with noise of `NOISE` and beds of the
    assumed spread. So the runs alone decide: their directions, repeats, order and labels.
    """
    ratings = []
    for medium in campaign.media_with_runs:
        planned = campaign.plates_to_measure(medium)
        if not planned:
            continue
        least_seen = {
            (row["kind"], row["group"]): row["least_seen"]
            for row in scan_plan(planned)
            if row["verdict"] == NOT_SEEN
        }
        ratings += [
            PlanPower(medium, *cause, least_seen.get(cause, math.nan)) for cause in NEEDED_CAUSES
        ]
    return ratings


def scan_plan(planned: Sequence[Run]) -> list[dict[str, Any]]:
    """Return rows of the table of causes with the least size of each that these runs would show; none for few runs.

    `planned`: plate runs of one medium. Keys of a row: `rftfit.compare.causes.CAUSE_COLUMNS`.
    """
    if len(planned) < FEWEST_RUNS:
        return []
    filed = [filed_under(run) for run in planned]
    beta_deg, gamma_deg, side = np.array(filed, dtype=float).T
    alpha = expected_alpha(beta_deg, gamma_deg)
    runs = RunSlopes(
        beta_deg,
        gamma_deg,
        alpha,
        np.full_like(alpha, NOISE * float(np.abs(alpha).max())),
        side < 0,
        np.argsort(np.argsort([run.row for run in planned])),
        labels_of(planned),
    )
    return rows_of_scan(JointModel(runs).scan())
