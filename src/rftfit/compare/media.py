"""Comparison of two media, sessions or campaigns: finds the runs that are asked for, and tests whether they differ.

A medium with runs is a `_Side`, compared by its runs (`rftfit.compare.contrast`). One that is a profile file, a published
medium or an estimate has no runs: it is a *named profile*, a pair of name and profile with draws of alpha, and the
sizes of both are compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from rftfit import reference
from rftfit.campaign.presence import config_of
from rftfit.campaign.problems import choose
from rftfit.compare.contrast import (
    Comparison,
    NoCommonDirection,
    RunSet,
    compare_run_sets,
    errors_detected,
)
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.measure.errors import errors_of
from rftfit.measure.flags import format_remarks
from rftfit.measure.slopes import normal_quantile, student_p
from rftfit.model.known import profile_of
from rftfit.model.maps import Map, published_map
from rftfit.model.profiles import KnownMedium, Profile
from rftfit.results import Medium, open_results


def compare_media(
    a: KnownMedium | str | Path, b: KnownMedium | str | Path, confidence: float = 0.95
) -> Comparison:
    """Tell whether two media, two sessions or two folders of results differ, in size and in shape.

    Single runs in common directions are compared; without a common direction, or where one of the media has no runs, the
    sizes of the two maps.

    Parameters
    ----------
    a, b : Medium, Map, TableProfile, str or Path
        A medium of the campaign in the current folder, ``FOLDER:MEDIUM`` of another one, ``FOLDER`` if it has one
        medium, or one of these with ``@LABEL``: its runs with this label in the column `session` of the run sheet;
        ``published:MEDIUM``. Or an object with draws of alpha, which `scale`, `estimate_map` or `read_profile` return,
        or the path of a profile file.
    confidence : float, optional
        Level of the intervals.

    Returns
    -------
    Comparison
        Ratio of sizes B/A and difference of shape with intervals and p values, the least differences that would have
        been detected, and the directions.

    Raises
    ------
    InputError
        If there is no such medium, both are the same runs, their forces are opposite, or one has neither runs nor draws.
    TypeError
        If A or B is no medium.

    Examples
    --------
    >>> import rftfit
    >>> comparison = rftfit.compare_media("poppy_LP@monday", "poppy_LP@friday")  # doctest: +SKIP
    >>> print(comparison.sentence)  # doctest: +SKIP
    """
    profiles_without_runs = [_find_profile(source) for source in (a, b)]
    if any(profiles_without_runs):
        profiles = [
            profile or _estimate_profile(source)
            for source, profile in zip((a, b), profiles_without_runs, strict=True)
        ]
        return _compare_sizes(profiles, confidence, "not both have runs")
    side_a, side_b = (_find_side(source) for source in (a, b))
    if side_a.campaign == side_b.campaign:
        shared = set(side_a.fits["run_id"]) & set(side_b.fits["run_id"])
        if shared:
            raise InputError(f"A and B share {len(shared)} runs; allowed: two sets of runs")
    sides = [side_a, side_b]
    if side_a.name == side_b.name:
        sides = [replace(side, name=f"{Path(side.campaign).name}:{side.name}") for side in sides]
    try:
        comparison = compare_run_sets(sides[0].make_run_set(), sides[1].make_run_set(), confidence)
    except NoCommonDirection as error:
        if side_a.label or side_b.label:
            raise
        profiles = [(side.name, side.medium.map().profile) for side in sides]
        comparison = _compare_sizes(profiles, confidence, str(error))
    notes = [
        f"{side.name} is {format_remarks(marks)}"
        for side in sides
        if (marks := side.medium.results.marks.get(side.medium.name, []))
    ]
    return replace(comparison, notes=(*notes, *comparison.notes))


@dataclass(frozen=True)
class _Side:
    """A medium of a campaign, or its runs of one session.

    `name`: as it was asked for. `label`: name of the session in the run sheet; empty: all runs.
    """

    name: str
    medium: Medium
    label: str = ""

    @property
    def campaign(self) -> str:
        """Folder of the campaign."""
        return str(self.medium.results.root.resolve())

    @property
    def fits(self) -> pd.DataFrame:
        """Rows of the table of fits of the runs that are compared."""
        fits = self.medium.fits
        if not self.label:
            return fits
        runs = self.medium.results.campaign.runs_of(self.medium.name)
        labels = pd.Series({run.run_id: run.session for run in runs}, dtype=object)
        return with_label(fits, labels, self.label)

    def make_run_set(self) -> RunSet:
        """Return the runs with the errors that all of them share, as the test of two sets of runs needs them."""
        # errors of all runs of the medium: they show the surface better than those of a session
        # alone
        config = self.medium.results.config
        errors, surface = errors_of(self.medium.fits, config)
        return RunSet(
            self.name,
            self.fits,
            surface_cm=surface.session,
            turn_deg=errors.turn_deg,
            rod_percent=errors.tare_percent,
            campaign=self.campaign,
            medium=self.medium.name,
            tolerance_deg=config.grid.angle_tolerance_deg,
        )


def with_label(fits: pd.DataFrame, labels: pd.Series[str], label: str) -> pd.DataFrame:
    """Select the fits of runs with a label of a session; raises InputError if no run has it.

    `labels`: label of each run, by run_id.
    """
    of_runs = fits["run_id"].map(labels).fillna("")
    stated = sorted({*of_runs} - {""})
    choose("session", label, stated, "labels of these runs in the column session of the run sheet")
    return fits[of_runs == label]


PUBLISHED = "published:"
"""Prefix of a published medium, as in ``published:poppy_LP``."""


def _find_profile(source: KnownMedium | str | Path) -> tuple[str, Profile] | None:
    """Return name and profile of a medium that is stated otherwise than by runs of a campaign; None for others.

    `source`: as A or B of `compare_media`.
    """
    if isinstance(source, Medium):
        return None
    name = str(source)
    if not isinstance(source, str | Path) or Path(source).is_file():
        profile = profile_of(source)
        if not isinstance(source, str | Path):
            name = (source.name if isinstance(source, Map) else "") or profile.name
        return name, profile
    if name.startswith(PUBLISHED):
        published = name.removeprefix(PUBLISHED)
        medium = choose("medium", published, reference.MEDIA, "published media")
        return name, published_map(medium).profile
    return None


def _estimate_profile(source: KnownMedium | str | Path) -> tuple[str, Profile]:
    """Return name and map of a medium of a campaign, which is compared with a medium without runs.

    Raises InputError for a session, of which there is no map.
    """
    side = _find_side(source)
    if side.label:
        raise InputError(
            f"{side.name}: a session is compared by its runs, and the other medium has none; allowed: the medium without "
            "'@', whose map is compared"
        )
    return side.name, side.medium.map().profile


def _find_side(source: KnownMedium | str | Path) -> _Side:
    """Find a medium of a campaign, or its session after ``@``; `source`: as A or B of `compare_media`."""
    if isinstance(source, Medium):
        return _Side(source.name, source)
    name = str(source)
    medium_name, label = name, ""
    if not Path(name).is_dir() and "@" in name:
        medium_name, _, label = name.rpartition("@")
        if not label:
            raise InputError(f"found '{name}'; allowed: a label of the run sheet after '@'")
    return _Side(name, _find_medium(medium_name), label)


def _find_medium(name: str) -> Medium:
    """Find the medium with a name without '@': FOLDER:MEDIUM, MEDIUM of the current folder, or FOLDER, in this order.

    Raises InputError that says what is allowed.
    """
    folder, _, medium = name.rpartition(":")
    if folder and Path(folder).is_dir():
        results = open_results(folder)
        return results[choose("medium", medium, results.media, f"in {folder}")]
    # a campaign need not be in the current folder
    config: Path | None = None
    with suppress(InputError):
        config = config_of(".")
    current = open_results(config) if config else None
    if current is not None and name in current.media:
        return current[name]
    if Path(name).is_dir():
        results = open_results(name)
        if len(results.media) == 1:
            return results[results.media[0]]
        listed = ", ".join(f"{name}:{medium}" for medium in results.media) or "no medium there"
        raise InputError(f"{name}: {len(results.media)} media; allowed: {listed}")
    if current is None:
        raise InputError(
            f"found '{name}', but the current folder is no campaign; allowed: FOLDER:MEDIUM, FOLDER of a campaign "
            f"with one medium, a profile file with errors (rftfit export), or {PUBLISHED}MEDIUM"
        )
    return current[choose("medium", name, current.media, "or FOLDER:MEDIUM of another campaign")]


def _compare_sizes(
    profiles: Sequence[tuple[str, Profile]], confidence: float, why: str
) -> Comparison:
    """Compare the sizes of two media by draws of their alpha.

    `profiles`: name and profile of each. `why`: reason why the runs are not compared.
    """
    (name_a, _), (name_b, _) = profiles
    log_size_a, log_size_b = (_log_sizes_of_draws(*named) for named in profiles)
    # the draws of both come from the same random numbers: differences draw by draw would not be
    # independent
    se = math.hypot(float(log_size_a.std(ddof=1)), float(log_size_b.std(ddof=1)))
    log_ratio = float(log_size_b.mean() - log_size_a.mean())
    half_width = normal_quantile(confidence) * se
    return Comparison(
        a=name_a,
        b=name_b,
        ratio=math.exp(log_ratio),
        ratio_lo=math.exp(log_ratio - half_width),
        ratio_hi=math.exp(log_ratio + half_width),
        size_p=float(student_p(log_ratio / se, math.inf)),
        least_ratio=math.exp(errors_detected(math.inf) * se),
        notes=(f"{why}; the sizes are those of the maps",),
        confidence=confidence,
    )


def _log_sizes_of_draws(name: str, profile: Profile) -> FloatArray:
    """Return the logarithm of the root mean square of alpha over the published directions, shape (draws,).

    Raises `InputError` for a profile that has no draws, or no number in one of these directions.
    """
    allowed = (
        f"allowed: a medium of a campaign, what rftfit.scale or estimate_map return, {PUBLISHED}MEDIUM, or a profile file with "
        "errors (rftfit export --profile map)"
    )
    if not isinstance(profile.spread, Profile):
        cause = (
            "its tables state no errors"
            if profile.spread is None
            else "its interval comes from the scatter between media, not from draws of this one"
        )
        raise InputError(f"{name}: {cause}, so no difference can be told from chance; {allowed}")
    beta, gamma = np.meshgrid(np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG))
    alpha = np.stack(profile.spread.alpha(beta.ravel(), gamma.ravel()))
    if np.isnan(alpha).any():
        raise InputError(
            f"{name}: its size is compared over all published directions, and it has no alpha or no error in some; {allowed}"
        )
    return np.asarray(0.5 * np.log((alpha**2).mean(axis=(0, -1))))
