"""What is known of a medium, in whichever form it is given, as the profile by which forces are predicted."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from rftfit.model.profile_file import read_profile
from rftfit.model.profiles import KnownMedium, Profile
from rftfit.model.scaling import ScaledMedium
from rftfit.model.shapes import scale

ALLOWED = (
    "what rftfit.scale, estimate_map, published_medium or read_profile return, a medium of rftfit.open(...), a "
    "profile, or the path of a profile file"
)
"""Forms in which a medium may be given, for messages."""


def profile_of(
    medium: KnownMedium | str | Path, is_enough: Callable[[Profile], bool] | None = None
) -> Profile:
    """Return the profile of a medium; a path is read as a profile file.

    `is_enough`: whether a table has a number in every direction that is asked for; by a medium of a campaign with a table
    that has not, the map predicts. Raises TypeError for what is no medium.
    """
    if isinstance(medium, str | Path):
        return read_profile(medium)
    if not isinstance(medium, KnownMedium):
        raise TypeError(f"found {type(medium).__name__} for a medium; allowed: {ALLOWED}")
    profile = medium.as_profile(is_enough)
    if isinstance(medium, ScaledMedium):
        profile.beside = partial(_profile_of_push, medium.alpha_z, medium.alpha_z_se)
    return profile


def _profile_of_push(alpha: float, se: float) -> Profile:
    # of the routine an error that is not known is 0
    return scale(alpha, se or None).profile
