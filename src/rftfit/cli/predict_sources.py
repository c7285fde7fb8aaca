"""Which profile `rftfit predict` takes, from print or from one penetration test, with its spread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.profile.base import Profile
    from rftfit.profile.reference_media import Reference
    from rftfit.profile.scaling import Scaled

PROFILES = ("table", "fourier", "generic", "depth_only")


@dataclass(frozen=True)
class FurtherMedium:
    """A medium that is known by its zeta alone, and the media it was scaled from.

    Parameters
    ----------
    scaled : Scaled
    reference : Reference
    """

    scaled: Scaled
    reference: Reference


@dataclass(frozen=True)
class Source:
    """A profile, and what its intervals come from.

    Parameters
    ----------
    name : str
        For people: which profile of which medium.
    profile : Profile
    spread : Profile, FurtherMedium or None
        A stack of draws of the profile; or the reference media, whose scatter is that of one
        further medium; None where no error is known (published tables).
    """

    name: str
    profile: Profile
    spread: Profile | FurtherMedium | None = None


def choose(option: str, word: str, allowed: Sequence[str], more: str = "") -> str:
    """Check a word of the command line.

    Parameters
    ----------
    option : str
        Its option, with the dashes.
    word : str
    allowed : sequence of str
    more : str, optional
        Said after the allowed words.

    Returns
    -------
    str
        The same word.

    Raises
    ------
    InputError
        If it is not allowed; with the nearest word that is.
    """
    from rftfit.campaign.problems import did_you_mean, listed, shown

    if word in allowed:
        return word
    nearest = did_you_mean(word, allowed)
    hint = f"; did you mean '{nearest}'?" if nearest else ""
    raise InputError(
        f"{option}: found '{shown(word)}'; allowed: {listed(allowed)}{hint}{more and f' ({more})'}"
    )


def from_print(medium: str, kind: str) -> Source:
    """Profile of a published medium.

    Parameters
    ----------
    medium : str
    kind : str
        One of `PROFILES`: Table S5 interpolated; the coefficients of Table S2; its printed zeta
        times its generic coefficients; the depth-only model with three cells of Table S5.

    Returns
    -------
    Source
        Without a spread: the tables are printed without errors.

    Raises
    ------
    InputError
        If there is no such medium.
    """
    from rftfit.profile.depth_only import DepthOnlyProfile
    from rftfit.profile.fourier import as_array
    from rftfit.profile.nine_terms import FourierProfile, scaled_generic
    from rftfit.profile.table import TableProfile
    from rftfit.reference import MEDIA, coefficients

    choose(
        "--medium",
        medium,
        MEDIA,
        "published media; --results DIR for those of a campaign, --alpha for one penetration test",
    )
    if kind == "fourier":
        name = f"published Table S2, {medium}"
        return Source(name, FourierProfile(as_array(coefficients(medium)), name))
    if kind == "generic":
        zeta = coefficients(medium)["zeta"]
        name = f"published Table S2, zeta of {medium} ({zeta:g}) times generic"
        return Source(name, scaled_generic(zeta, as_array(coefficients("generic")), name))
    table = TableProfile.published(medium)
    if kind == "depth_only":
        return Source(f"depth-only, from Table S5, {medium}", DepthOnlyProfile.of(table))
    return Source(f"published Table S5, {medium}", table)


def from_test(reference: Reference, alpha: float, se: float, confidence: float) -> Source:
    """Profile of a medium known by one vertical penetration test: as `rftfit scale`.

    Parameters
    ----------
    reference : Reference
        Where chi and the generic coefficients come from.
    alpha, se : float
        alpha_z(0, 90 deg) and its standard error, N/cm^3.
    confidence : float

    Returns
    -------
    Source

    Raises
    ------
    InputError
        If alpha is not positive or its error negative.
    """
    from rftfit.cli.scale_intervals import scale_from
    from rftfit.profile.nine_terms import scaled_generic

    try:
        scaled = scale_from(reference, alpha, se, confidence)
    except ValueError as error:
        raise InputError(str(error)) from error
    name = (
        f"generic times zeta = {scaled.zeta:.4f} "
        f"({scaled.zeta_lo:.4f} to {scaled.zeta_hi:.4f}), from alpha_z(0, 90 deg) = "
        f"{alpha:g} N/cm^3 (se {se:g}) with {reference.name}"
    )
    profile = scaled_generic(scaled.zeta, reference.m0, name)
    return Source(name, profile, FurtherMedium(scaled, reference))
