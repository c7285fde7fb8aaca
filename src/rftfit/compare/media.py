"""Comparison of two media, sessions or campaigns: finds the runs that words mean, and tests whether they differ."""

from __future__ import annotations

import math
from collections.abc import Sequence
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
from rftfit.results import Medium, Results, open_results


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
    opened: dict[Path, Results] = {}
    if any(_is_without_runs(source) for source in (a, b)):
        drawn = [_find_drawn(source, opened) for source in (a, b)]
        return _compare_sizes(drawn, confidence, "not both have runs")
    sides = [_find_side(source, opened) for source in (a, b)]
    first, second = sides
    if first.campaign == second.campaign:
        shared = set(first.fits["run_id"]) & set(second.fits["run_id"])
        if shared:
            raise InputError(f"A and B share {len(shared)} runs; allowed: two sets of runs")
    if first.name == second.name:
        sides = [
            replace(side, name=f"{Path(side.campaign).name}:{side.name}")
            for side in (first, second)
        ]
    try:
        comparison = compare_run_sets(sides[0].make_run_set(), sides[1].make_run_set(), confidence)
    except NoCommonDirection as error:
        if any(side.label for side in sides):
            raise
        drawn = [(side.name, side.medium.map().profile) for side in sides]
        comparison = _compare_sizes(drawn, confidence, str(error))
    marks = [
        f"{side.name} is {format_remarks(marks)}"
        for side in sides
        if (marks := side.medium.results.marks.get(side.medium.name, []))
    ]
    return replace(comparison, notes=(*marks, *comparison.notes))


@dataclass(frozen=True)
class _Side:
    """A medium, or its runs of one session; `label`: name of the session, empty for all runs."""

    name: str
    medium: Medium
    label: str = ""

    @property
    def campaign(self) -> str:
        """Folder of the campaign."""
        return str(self.medium.results.root.resolve())

    @property
    def fits(self) -> pd.DataFrame:
        """Fits of the runs that are compared."""
        fits = self.medium.fits
        if not self.label:
            return fits
        runs = self.medium.results.campaign.runs_of(self.medium.name)
        labels = pd.Series({run.run_id: run.session for run in runs}, dtype=object)
        return with_label(fits, labels, self.label)

    def make_run_set(self) -> RunSet:
        """Return the runs with the errors that all of them share."""
        # errors of all runs of the medium: they show the surface better than those of a session
        # alone
        errors, surface = errors_of(self.medium.fits, self.medium.results.config)
        return RunSet(
            self.name,
            self.fits,
            surface.session,
            errors.turn_deg,
            errors.tare_percent,
            self.campaign,
            self.medium.name,
            self.medium.results.config.grid.angle_tolerance_deg,
        )


def with_label(fits: pd.DataFrame, labels: pd.Series[str], label: str) -> pd.DataFrame:
    """Select the fits of runs with a label; `labels`: label of each run, by run_id."""
    of_runs = fits["run_id"].map(labels).fillna("")
    stated = sorted({*of_runs} - {""})
    choose("session", label, stated, "labels of these runs in the column session of the run sheet")
    return fits[of_runs == label]


PUBLISHED = "published:"
"""Beginning of a word that means a published medium."""


def _is_without_runs(source: KnownMedium | str | Path) -> bool:
    """Tell whether a medium is stated otherwise than by runs of a campaign."""
    if isinstance(source, str | Path):
        return Path(source).is_file() or _is_published(source)
    return not isinstance(source, Medium)


def _is_published(source: KnownMedium | str | Path) -> bool:
    """Tell whether a word means a published medium; a file of this name comes first."""
    is_word = isinstance(source, str | Path) and str(source).startswith(PUBLISHED)
    return is_word and not Path(str(source)).is_file()


def _find_drawn(
    source: KnownMedium | str | Path, opened: dict[Path, Results]
) -> tuple[str, Profile]:
    """Find name and profile of a medium that is compared by draws of its alpha."""
    if isinstance(source, str) and source.startswith(PUBLISHED) and not Path(source).is_file():
        medium = choose(
            "medium", source.removeprefix(PUBLISHED), reference.MEDIA, "published media"
        )
        return source, published_map(medium).profile
    if _is_without_runs(source):
        profile = profile_of(source)
        name = str(source) if isinstance(source, str | Path) else profile.name
        if isinstance(source, Map) and source.name:
            name = source.name
        return name, profile
    side = _find_side(source, opened)
    if side.label:
        raise InputError(
            f"{side.name}: a session is compared by its runs, and the other medium has none; allowed: the medium without "
            "'@', whose map is compared"
        )
    return side.name, side.medium.map().profile


def _find_side(source: KnownMedium | str | Path, opened: dict[Path, Results]) -> _Side:
    """Find the medium, and the session, that a word means."""
    if isinstance(source, Medium):
        return _Side(source.name, source)
    word = str(source)
    place, at_sign, label = word, "", ""
    if not Path(word).is_dir() and "@" in word:
        place, at_sign, label = word.rpartition("@")
    if at_sign and not label:
        raise InputError(f"found '{word}'; allowed: a label of the run sheet after '@'")
    return _Side(word, _find_medium(place, opened), label)


def _find_medium(place: str, opened: dict[Path, Results]) -> Medium:
    """Find the medium that a word without '@' means: MEDIUM of the current folder, FOLDER:MEDIUM or FOLDER."""
    current = _open_current(opened)
    if current is not None and place in current.media:
        return current[place]
    folder, _, name = place.rpartition(":")
    if folder and Path(folder).is_dir():
        results = _open(Path(folder), opened)
        return results[choose("medium", name, results.media, f"in {folder}")]
    if Path(place).is_dir():
        results = _open(Path(place), opened)
        if len(results.media) == 1:
            return results[results.media[0]]
        listed = ", ".join(f"{place}:{medium}" for medium in results.media) or "no medium there"
        raise InputError(f"{place}: {len(results.media)} media; allowed: {listed}")
    if current is None:
        raise InputError(
            f"found '{place}', but the current folder is no campaign; allowed: FOLDER:MEDIUM, FOLDER of a campaign "
            f"with one medium, a profile file with errors (rftfit export), or {PUBLISHED}MEDIUM"
        )
    return current[choose("medium", place, current.media, "or FOLDER:MEDIUM of another campaign")]


def _open(folder: Path, opened: dict[Path, Results]) -> Results:
    """Open a campaign, or return it where it was opened before."""
    config = config_of(folder).resolve()
    if config not in opened:
        opened[config] = open_results(folder)
    return opened[config]


def _open_current(opened: dict[Path, Results]) -> Results | None:
    """Open the campaign of the current folder, if there is one."""
    try:
        config_of(".")
    except InputError:
        return None
    return _open(Path(), opened)


def _compare_sizes(sides: Sequence[tuple[str, Profile]], confidence: float, why: str) -> Comparison:
    """Compare the sizes of two media by draws of their alpha; `sides`: name and profile of each."""
    sizes = [_sizes_of_draws(name, profile) for name, profile in sides]
    # the draws of both come from the same random numbers: differences draw by draw would not be
    # independent
    error = math.hypot(*(float(size.std(ddof=1)) for size in sizes))
    middle = float(sizes[1].mean() - sizes[0].mean())
    half = normal_quantile(confidence) * error
    return Comparison(
        a=sides[0][0],
        b=sides[1][0],
        ratio=math.exp(middle),
        ratio_lo=math.exp(middle - half),
        ratio_hi=math.exp(middle + half),
        size_p=float(student_p(middle / error, math.inf)),
        least_ratio=math.exp(errors_detected(math.inf) * error),
        notes=(f"{why}; the sizes are those of the maps",),
        confidence=confidence,
    )


def _sizes_of_draws(name: str, profile: Profile) -> FloatArray:
    """Return the logarithm of the root mean square of alpha over the published directions, by draw.

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
