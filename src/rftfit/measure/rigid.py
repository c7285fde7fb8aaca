"""The campaign's push against something rigid, read and turned into a curve."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rftfit.errors import InputError
from rftfit.logs.base import Log
from rftfit.measure.compliance import compliance_of
from rftfit.measure.ingest import read_force, read_motion
from rftfit.measure.pair import load_pairs
from rftfit.measure.placing import find_clock, without_repeats

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run
    from rftfit.measure.compliance import Compliance


def find_compliance(campaign: Campaign, like: Run) -> Compliance:
    """Read the push against something rigid that the config names.

    Parameters
    ----------
    campaign : Campaign
    like : Run
        Any run of the campaign: what its logs look like, the rigid push's do too.

    Returns
    -------
    Compliance

    Raises
    ------
    InputError
        If its logs cannot be used, or show no yielding.
    """
    config = campaign.config
    named = config.rigid_contact
    assert named is not None
    run = replace(
        like, run_id="rigid contact", direction="intrusion", force_log=named.force_log,
        motion_log=named.motion_log, surface_z_mm=None, gamma_deg=90.0,
    )  # fmt: skip
    (_, pair), *_ = load_pairs(campaign, [run])
    if not isinstance(pair.force, Log) or not isinstance(pair.motion, Log):
        raise InputError(f"rigid_contact: {'; '.join(pair.problems)}")
    try:
        lift, time, line = read_force(config, without_repeats(config, pair.force))
        motion = read_motion(config, run, pair.motion)
        clock, _ = find_clock(config, run, time, line, lift[0], motion)
        on_motion = clock.motion_time(time)
        inside = (on_motion >= motion.time[0]) & (on_motion <= motion.time[-1])
        depth = -motion.at(on_motion[inside])[1]
        return compliance_of(depth, lift[0][inside], config.transducer.precision_N)
    except ValueError as error:
        raise InputError(f"rigid_contact, {named.force_log}: {error}") from error
