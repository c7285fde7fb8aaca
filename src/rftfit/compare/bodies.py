"""What the force model gets wrong on a leg, learned from measured legs of a campaign or of the paper.

A prediction for the same leg in another medium then has a smaller error (`rftfit.forces.body_error`).
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from rftfit.campaign.problems import choose
from rftfit.errors import InputError
from rftfit.forces.body_error import BodyError
from rftfit.forces.contacts import Contact, learn_body_error
from rftfit.forces.motion import rotation
from rftfit.forces.outlines import model_leg
from rftfit.model.maps import estimate_map
from rftfit.model.profiles import Profile
from rftfit.model.shapes import published_shapes
from rftfit.reference import LEGS, MEDIA, load

if TYPE_CHECKING:
    from rftfit.results import Results

PUBLISHED = "published"
"""Word of a command for the legs of Fig. S5, in place of a folder of results."""

READING_PERCENT = 2.0
"""Standard error of a force that is read from the drawing of a published leg, % of the largest of its curve."""


@cache
def published_body_error(leg: str) -> BodyError:
    """Learn what the model gets wrong on a published leg, from Fig. S5 and the maps of Table S5.

    `leg`: one of `LEGS`. Cached, as the maps take seconds.
    """
    choose("leg", leg, LEGS)
    curves, alpha = load("fig_s5"), load("table_s5")
    # measured forces on the leg, and the map of the medium by which they are predicted
    measurements = []
    for medium in MEDIA:
        rows = curves[(curves["medium"] == medium) & (curves["leg"] == leg)]
        largest = float(rows[["force_z_N", "force_x_N"]].abs().max().max())
        motion = rotation(rows["theta_deg"].to_numpy(float))
        contact = Contact(
            model_leg(leg), motion, rows, READING_PERCENT / 100 * largest, name=medium
        )
        pushes = alpha[alpha["medium"] == medium]
        medium_map = estimate_map(pushes, published_shapes(), name=medium)
        measurements.append((contact, medium_map.profile))
    return learn_body_error(measurements)


def campaign_body_error(results: Results, leg: str) -> BodyError:
    """Learn what the model gets wrong on a leg of a campaign, from its measured curves and the maps of its media.

    `leg`: name of a leg of the config. Raises InputError where no medium has measured forces on it.
    """
    choose("leg", leg, tuple(results.config.legs), f"in {results.root}")
    measurements: list[tuple[Contact, Profile]] = []
    for name in results.laboratory:
        medium = results[name]
        contact = medium.contact(leg)
        profile = medium.profile("map")
        if contact is not None and not profile.reason:
            measurements.append((contact, profile))
    if not measurements:
        raise InputError(f"{results.root}: no medium with a map has measured forces on {leg}")
    return learn_body_error(measurements)
