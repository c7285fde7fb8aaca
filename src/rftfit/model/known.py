"""One function that turns a medium, in any of its forms, into the profile by which forces are predicted.

A medium of a campaign has a measured table of alpha and a map, which estimates alpha in all directions.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from rftfit.model.maps import scale
from rftfit.model.profile_file import read_profile
from rftfit.model.profiles import KnownMedium, Profile
from rftfit.model.scaling import ScaledMedium

ALLOWED = (
    "what rftfit.scale, estimate_map, published_medium or read_profile return, a medium of rftfit.open(...), a "
    "profile, or the path of a profile file"
)
"""Forms of a medium that are accepted, as a text for messages."""


def profile_of(
    medium: KnownMedium | str | Path, is_enough: Callable[[Profile], bool] | None = None
) -> Profile:
    """Return the profile of a medium; a path is read as a profile file. Raises TypeError for anything else.

    `is_enough`: function that returns True if a table has a number in every direction that is needed, as of a body in
    its motion. If the table of a medium of a campaign has not, the profile of its map is returned. Default: a table
    with holes is not enough.
    """
    if isinstance(medium, str | Path):
        return read_profile(medium)
    if not isinstance(medium, KnownMedium):
        raise TypeError(f"found {type(medium).__name__} for a medium; allowed: {ALLOWED}")
    profile = medium.as_profile(is_enough)
    if isinstance(medium, ScaledMedium):
        # forces by the map of the same push are shown beside those of nine terms
        profile.beside = partial(_profile_of_push, medium.alpha_z, medium.alpha_z_se)
    return profile


def _profile_of_push(alpha: float, se: float) -> Profile:
    """Return the profile of the map from one push straight down: `alpha` is alpha_z(0, 90 deg), `se` its error, N/cm^3."""
    # a standard error of 0 means that it is not known
    return scale(alpha, se or None).profile
