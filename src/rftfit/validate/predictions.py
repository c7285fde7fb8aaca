"""Predicted force on the legs of one medium by every profile, each with its interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alpha import column
from rftfit.predict.outline import leg_outline
from rftfit.predict.rotation import THETA_DEG, sweep, sweep_draws
from rftfit.profile.bootstrap import alpha_draws, interval
from rftfit.profile.depth_only import DepthOnlyProfile
from rftfit.profile.new_medium import with_interval
from rftfit.profile.nine_terms import FourierProfile, scaled_generic
from rftfit.profile.scaling import generic, scale_new_medium
from rftfit.profile.table import TableProfile

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.config import Config, Leg
    from rftfit.conventions import FloatArray
    from rftfit.predict.forces import Forces
    from rftfit.profile.base import Profile
    from rftfit.profile.media_fits import MediumFit
    from rftfit.profile.reference_media import Reference

PROFILES = ("table", "fourier", "generic", "depth_only")


@dataclass(frozen=True)
class Candidate:
    """A profile and its draws.

    Parameters
    ----------
    name : str
        One of `PROFILES`.
    profile : Profile
    draws : Profile
        The same with a leading axis of draws.
    """

    name: str
    profile: Profile
    draws: Profile


def laboratory_candidates(
    table: pd.DataFrame, own: MediumFit, reference: list[MediumFit], config: Config
) -> list[Candidate]:
    """Make the profiles of a medium that was measured over the grid.

    The draws carry the errors of alpha of this medium and, for the generic profile, of all.

    Parameters
    ----------
    table : pandas.DataFrame
        Its alpha table.
    own : MediumFit
        Its nine-term fit.
    reference : list of MediumFit
        Fits that M0 is the mean of; at least one.
    config : Config

    Returns
    -------
    list of Candidate
        In the order of `PROFILES`; those that need a fit only where there is one.
    """
    settings = config.fourier
    measured = TableProfile.from_table(table)
    many = TableProfile(*alpha_draws(table, settings.draws, settings.seed, config.fit.confidence))
    found = [
        Candidate("table", measured, many),
        Candidate("depth_only", DepthOnlyProfile.of(measured), DepthOnlyProfile.of(many)),
    ]
    if not own.reason:
        m0 = generic(np.stack([fit.used for fit in reference]))
        m0_draws = generic(np.stack([fit.draws for fit in reference], axis=1))
        found += [
            Candidate("fourier", FourierProfile(own.used), FourierProfile(own.draws)),
            Candidate(
                "generic", scaled_generic(own.zeta, m0), scaled_generic(own.zeta_draws, m0_draws)
            ),
        ]
    return sorted(found, key=lambda candidate: PROFILES.index(candidate.name))


def leg_prediction(candidate: Candidate, leg: Leg, config: Config) -> pd.DataFrame:
    """Force on a turning leg against theta, with the interval that the errors of alpha give.

    Parameters
    ----------
    candidate : Candidate
    leg : Leg
    config : Config

    Returns
    -------
    pandas.DataFrame
        One row per degree; columns as in docs/architecture.md without medium, leg and profile.
    """
    outline, rate = leg_outline(leg), config.arm.leg_speed_rad_per_s
    best = sweep(candidate.profile, outline, None, leg.hip_height_cm, rate)
    many = sweep_draws(candidate.draws, outline, None, leg.hip_height_cm, rate)
    ends = [interval(draws, config.fit.confidence) for draws in (many.force_z_N, many.force_x_N)]
    return _frame(best, ends[0], ends[1])


def sand_prediction(
    table: pd.DataFrame, reference: Reference, leg: Leg, config: Config
) -> pd.DataFrame:
    """Force on a turning leg in a medium known by one penetration test.

    The interval is that for one further medium: the scatter of chi and of the profiles between the
    reference media, and the error of the test.

    Parameters
    ----------
    table : pandas.DataFrame
        Its alpha table, of which only (0, 90 deg) is used.
    reference : Reference
        Of at least two media.
    leg : Leg
    config : Config

    Returns
    -------
    pandas.DataFrame
        As `leg_prediction`; `reason` says where the published media serve as reference.

    Raises
    ------
    ValueError
        If there is no such test or there are fewer than two reference media.
    """
    cell = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].iloc[0]
    m0, level = reference.m0, config.fit.confidence
    scaled = scale_new_medium(
        float(cell[column("z")]), float(cell[column("z", "_se")]), reference.chi, m0, level
    )
    outline, rate = leg_outline(leg), config.arm.leg_speed_rad_per_s
    best = sweep(FourierProfile(scaled.zeta * m0), outline, None, leg.hip_height_cm, rate)
    unit = sweep(FourierProfile(m0), outline, None, leg.hip_height_cm, rate)
    each = sweep_draws(FourierProfile(reference.scaled), outline, None, leg.hip_height_cm, rate)
    z = with_interval(scaled, unit.force_z_N, each.force_z_N, level)
    x = with_interval(scaled, unit.force_x_N, each.force_x_N, level)
    frame = _frame(best, z[1:], x[1:])
    return frame if best.reason else frame.assign(reason=reference.note)


def _frame(
    best: Forces, z: tuple[FloatArray, FloatArray], x: tuple[FloatArray, FloatArray]
) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(
        {
            "theta_deg": THETA_DEG,
            "force_z_N": best.force_z_N,
            "force_z_lo_N": z[0],
            "force_z_hi_N": z[1],
            "force_x_N": best.force_x_N,
            "force_x_lo_N": x[0],
            "force_x_hi_N": x[1],
            "moment_N_cm": best.moment_N_cm,
            "reason": best.reason,
        }
    )
