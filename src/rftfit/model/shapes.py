"""Alpha over all directions from any number of pushes, by the shape that granular media share.

Alpha over the angles has nearly the same shape in all dry granular media. The shape of known media is the prior,
and every push corrects it:

    alpha = s (m + d),   d ~ N(0, lambda (C + (1 - w) K + w R)),   the medium takes energy everywhere

Here s is the unknown size of this medium (root mean square of alpha over the published grid), m the mean shape and C
the covariance of the known media. A smooth covariance K and a rough one R allow a further medium to differ from all
known ones. The pushes determine s, how far the medium departs from the known shape (lambda) and how roughly (w). The
map consists of draws from the posterior: their mean is alpha, their quantiles are its interval.

The known tables have lines 30 degrees apart in beta. Between the lines m is not bilinear: it follows the law 3D-RFT,
whose difference from bilinear values is called the course here. It is not fitted. C includes the differences between
the courses of several frictions, and the course itself, since a further medium may have none of it or twice as much.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.formats import ALPHA
from rftfit.conventions import FloatArray, mirror, wrap_beta
from rftfit.directions import TOLERANCE_DEG, same_direction
from rftfit.errors import InputError
from rftfit.measure.alpha import Columns, alpha_columns, column, directions, flagged, window_of
from rftfit.measure.errors import (
    USUAL_BED_SPREAD,
    Part,
    bed_of_mean,
    bed_of_next,
    combined_half_width,
    half_width_of_bed,
    scatter_of_runs,
    spread_of_beds,
)
from rftfit.model.draws import DRAWS, draws_of, errors_known, interval, widen
from rftfit.model.fourier import fit_lsq, kept_terms
from rftfit.model.observations import Observation, ObservedRows, ObservedSystem
from rftfit.model.profiles import ANY_DEPTH, EPS, KnownMedium, Profile, TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.model.scaling import PAPER_RULE, check_level, check_test, vertical_penetration
from rftfit.model.symmetry import rectangle
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, load
from rftfit.store.chosen import chosen, read_toml

if TYPE_CHECKING:
    from rftfit.campaign.config import Config

_CHOSEN = chosen("model", "shapes")

Angles = tuple[FloatArray, FloatArray]
"""Beta and gamma of directions, rad."""

SEED = 2013
"""Seed of the draws of a map behind its intervals."""

NOT_ALIKE = 0.03
"""Least `Map.belongs` of a medium that counts as one of the known shape."""


class Variation(NamedTuple):
    """Prior of the difference of a further medium from the known ones: amplitude and correlation lengths of K and R.

    `floor`, `share`: K has the standard deviation floor + share |m|, for a shape of size 1.
    `smooth`: share of the variance of K with a smooth kernel (squared exponential); the rest has a rough one (Matern
    3/2).
    `smooth_beta`, `smooth_gamma`, `rough_beta`, `rough_gamma`: correlation lengths of these two kernels, as chords
        between points (cos 2 beta, sin 2 beta) and between points (cos gamma, sin gamma).
    `media`: factor on the covariance of the known media.
    `own_beta`, `own_gamma`: correlation lengths of R (Matern 3/2), whose standard deviation is the same everywhere: the
        root mean square of floor + share |m|.
    `most_own`: the prior of the share w of R is flat from 0 to this.
    `departure_dof`: the prior of lambda is inverse gamma with these degrees of freedom and its mode at 1.
    `course_share`: standard deviation of the factor, 1 on average, on the course of 3D-RFT between the lines of the
        published grid.
    """

    floor: float
    share: float
    smooth: float
    smooth_beta: float
    smooth_gamma: float
    rough_beta: float
    rough_gamma: float
    media: float
    own_beta: float
    own_gamma: float
    most_own: float
    departure_dof: float
    course_share: float


def _published_variation() -> Variation:
    """Return the variation that was chosen on Table S5."""
    return Variation(**read_toml("reference", "shapes.toml"))


@dataclass(frozen=True)
class Shapes:
    """Known media, and how far a further medium may differ from them.

    Parameters
    ----------
    profiles : dict of str to TableProfile
        Tables of known media, without holes; at least two.
    variation : Variation, optional
        Prior of the difference; default: the one that was chosen on the published media.

    Examples
    --------
    >>> import rftfit
    >>> shapes = rftfit.published_shapes(without=["poppy_LP"])
    >>> len(shapes.profiles)
    4
    """

    profiles: dict[str, TableProfile]
    variation: Variation = field(default_factory=_published_variation)

    def __post_init__(self) -> None:
        if len(self.profiles) < 2:
            raise ValueError(f"shapes need at least two known media, found {len(self.profiles)}")
        if holes := [name for name, profile in self.profiles.items() if profile.reason]:
            raise ValueError(f"a known medium has no holes; {', '.join(holes)} has")

    @property
    def name(self) -> str:
        """Names of the known media as one text."""
        return ", ".join(self.profiles)

    @cached_property
    def horizontal_spread(self) -> tuple[float, float]:
        """Standard deviation of log(alpha_x / alpha_z) of a medium: as known media scatter, and as C and K allow.

        Both components as root mean squares over the published grid.
        """
        z, x = np.split(self.of_media(*_GRID), 2, axis=1)
        log_ratios = np.log(np.sqrt((x**2).mean(axis=1) / (z**2).mean(axis=1)))
        prior = self.prior(*_GRID)
        mean = prior.mean
        # alpha that is 0 by symmetry has no variance
        varies = np.diag(prior.covariance(0.0)) > _CHOSEN.zero_variance
        # a medium with exactly the mean shape, measured everywhere without error
        exact = 1e-6 * np.abs(mean).max() * np.eye(int(varies.sum()))
        likelihood = _Likelihood(prior, np.flatnonzero(varies), 0.0, mean[varies], exact**2)
        is_x = np.arange(mean.size)[varies] >= mean.size // 2
        allowed = likelihood.horizontal(is_x, 1.0)[1]
        return float(log_ratios.std(ddof=1)) * np.sqrt(1 + 1 / log_ratios.size), allowed

    def horizontal_error(self, seen: float) -> float:
        """Return the standard deviation of an estimate of log(alpha_x / alpha_z) of a medium like the known ones.

        `seen`: standard error of the estimate from some pushes by `_Likelihood.horizontal`. It includes what C and K
        allow, which is replaced by the scatter of the known media.
        """
        known_spread, allowed = self.horizontal_spread
        return float(np.sqrt(known_spread**2 + max(seen**2 - allowed**2, 0.0)))

    @cached_property
    def levels(self) -> FloatArray:
        """Alpha_z(0, 90 deg) of each known medium over its size, shape (media,)."""
        down = [profile.alpha(0.0, np.pi / 2)[0] for profile in self.profiles.values()]
        return np.array(down, dtype=float) / self._sizes

    @cached_property
    def _sizes(self) -> FloatArray:
        """Size of each known medium, N/cm^3, shape (media,)."""
        grids = [profile.alpha(*_GRID) for profile in self.profiles.values()]
        return np.asarray(np.sqrt(np.mean(np.square(grids), axis=(1, 2))))

    def of_media(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Return alpha of each known medium over its size in n directions (rad), shape (media, 2 n): z, then x.

        Between the lines of a table alpha is bilinear plus the course of 3D-RFT.
        """
        return self._with_course(beta, gamma, course_between_lines(beta, gamma).mean(axis=0))

    def _with_course(self, beta: FloatArray, gamma: FloatArray, course: FloatArray) -> FloatArray:
        """Return alpha of each known medium over its size, bilinear plus a course (2 n,); shape (media, 2 n)."""
        tables = [np.concatenate(profile.alpha(beta, gamma)) for profile in self.profiles.values()]
        bilinear = np.stack(tables) / self._sizes[:, None]
        return bilinear + self.levels[:, None] * course

    @cached_property
    def _mean_on_grid(self) -> FloatArray:
        """Mean shape m on the published grid, shape (2 n,)."""
        return np.asarray(self.of_media(*_GRID).mean(axis=0))

    def slopes(self, beta_deg: FloatArray, gamma_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mean shape in n directions, (2, n), and its slopes over beta and gamma, per degree, (2, n, 2).

        A slope is the root mean square of the slopes to both sides, with the sign of their sum: at a maximum or a
        corner of alpha their mean would be too small.
        """
        steps = SLOPE_STEP_DEG * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        beta, gamma = (
            np.radians(angles + steps[:, axis, None]).ravel()
            for axis, angles in enumerate((beta_deg, gamma_deg))
        )
        mean = self.of_media(beta, gamma).mean(axis=0).reshape(2, len(steps), -1)
        above, below = mean[:, 1::2] - mean[:, :1], mean[:, :1] - mean[:, 2::2]
        size = np.hypot(above, below) / (np.sqrt(2) * SLOPE_STEP_DEG)
        return mean[:, 0], np.moveaxis(np.copysign(size, above + below), 1, -1)

    def prior(self, beta: FloatArray, gamma: FloatArray) -> _Prior:
        """Return the prior of alpha of a further medium of size 1 in n directions, rad."""
        courses = course_between_lines(beta, gamma)
        media_shapes = self._with_course(beta, gamma, courses.mean(axis=0))
        mean, count, variation = media_shapes.mean(axis=0), len(media_shapes), self.variation
        between = (media_shapes - mean) * np.sqrt(variation.media * (1 + 1 / count) / (count - 1))
        # two more terms of C: courses differ by friction, and a medium may have less or more of the mean course
        courses = self.levels.mean() * courses
        course = courses.mean(axis=0)
        by_friction = (courses - course) / np.sqrt(len(courses) - 1)
        between = np.concatenate([between, by_friction, variation.course_share * course[None]])
        amplitude = variation.floor + variation.share * np.abs(mean)
        amplitude_on_grid = variation.floor + variation.share * np.abs(self._mean_on_grid)
        smooth = _symmetric_correlation(beta, gamma, partial(_smooth_kernel, variation))
        rough = _symmetric_correlation(beta, gamma, partial(_rough_kernel, variation))
        return _Prior(
            mean,
            between,
            smooth.changed(lambda at, k: np.outer(amplitude[at], amplitude[at]) * k),
            rough.changed(lambda _, r: np.mean(amplitude_on_grid**2) * r),
        )

    @property
    def tilt(self) -> float:
        """Exponent that makes media of large effort less likely (`_Posterior.draws`): `TILT_SHARE` of the full tilt."""
        return TILT_SHARE * self._full_tilt if TILT_SHARE else 0.0

    @cached_property
    def _full_tilt(self) -> float:
        """Exponent with which media of the prior that take energy have on average the effort of the mean shape.

        Without it they would have more: media that give energy back are left out.
        """
        variation, random = self.variation, np.random.default_rng(SEED)
        prior = self.prior(*_GRID)
        target_effort = float(mean_effort(prior.mean.reshape(1, 2, -1), _GRID)[0])
        half = variation.departure_dof / 2
        efforts = []
        for rough_share in np.linspace(0, variation.most_own, _CHOSEN.rough_shares):
            departure = (half + 1) / random.gamma(half, size=(_CHOSEN.tilt_draws, 1))
            normals = random.standard_normal((_CHOSEN.tilt_draws, prior.mean.size))
            rows = _covariance_rows(prior.covariance(rough_share))
            drawn = prior.mean + np.sqrt(departure) * (normals @ rows)
            media = drawn.reshape(_CHOSEN.tilt_draws, 2, -1)
            largest = np.abs(media).max(axis=(1, 2))
            no_push = np.zeros(_GRID[0].size, dtype=bool)
            is_passive = _takes_energy(media, _GRID[1], largest, no_push)
            efforts.append(mean_effort(media[is_passive], _GRID))
        effort = np.concatenate(efforts)
        effort = effort[np.isfinite(effort)]

        def excess(exponent: float) -> float:
            """Return the mean effort of the media, weighted by the tilt, less the effort of the mean shape."""
            weights = np.exp(-exponent * (effort - effort.min()))
            return float(weights @ effort / weights.sum()) - target_effort

        low, high = 0.0, _CHOSEN.most_tilt
        if excess(low) <= 0:
            return 0.0
        for _ in range(30):  # bisection
            middle = (low + high) / 2
            low, high = (middle, high) if excess(middle) > 0 else (low, middle)
        return low

    def moments(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return mean (2 n,) and covariance (2 n, 2 n) of alpha of a medium with size 1, lambda 1 and w 0, z first."""
        prior = self.prior(beta, gamma)
        return prior.mean, prior.covariance(0.0)


SLOPE_STEP_DEG = 5.0
"""Step of the angles in `Shapes.slopes`."""


class _Blocks(NamedTuple):
    """A symmetric matrix that is 0 outside of some blocks: 27 instead of 54 MB for a thousand pushes.

    `places`: for each block the indices of its rows (and columns) in the matrix, increasing. `squares`: its numbers.
    """

    places: tuple[npt.NDArray[np.intp], ...]
    squares: tuple[FloatArray, ...]

    def changed(self, change: Callable[[npt.NDArray[np.intp], FloatArray], FloatArray]) -> _Blocks:
        """Return the matrix with each block replaced by ``change(places, square)``."""
        return _Blocks(self.places, tuple(map(change, self.places, self.squares)))

    def at(self, places: npt.NDArray[np.intp]) -> _Blocks:
        """Return the matrix of some rows and the same columns, in the order of `places`."""
        new_places, squares = [], []
        for block_places, square in zip(*self, strict=True):
            chosen = np.flatnonzero(np.isin(places, block_places))
            if chosen.size:
                rows = np.searchsorted(block_places, places[chosen])
                new_places.append(chosen)
                squares.append(square[np.ix_(rows, rows)])
        return _Blocks(tuple(new_places), tuple(squares))

    def whole(self) -> FloatArray:
        """Return the whole matrix, with its zeros."""
        matrix = np.zeros((sum(places.size for places in self.places),) * 2)
        self.add_to(matrix)
        return matrix

    def add_to(self, whole: FloatArray, factor: float = 1.0) -> None:
        """Add this matrix times a factor to a whole matrix, in place."""
        for places, square in zip(*self, strict=True):
            whole[np.ix_(places, places)] += factor * square


class _Prior(NamedTuple):
    """Prior of n numbers of a medium of size 1: alpha in some directions, or sums of alpha with weights.

    `mean`: m, shape (n,). `between` (k, n): between.T @ between is C. `smooth`, `rough`: K and R.
    """

    mean: FloatArray
    between: FloatArray
    smooth: _Blocks
    rough: _Blocks

    def at(self, places: npt.NDArray[np.intp]) -> _Prior:
        """Return the prior of some of the numbers, in the order of `places`."""
        return _Prior(
            self.mean[places],
            self.between[:, places],
            self.smooth.at(places),
            self.rough.at(places),
        )

    def by_blocks(self, counts: Sequence[int]) -> _Prior:
        """Reorder all z, then all x, into blocks of directions, each z, then x; `counts`: directions of each."""
        places = np.arange(self.mean.size).reshape(2, -1)
        ends = np.cumsum([0, *counts])
        blocks = [places[:, start:stop].ravel() for start, stop in pairwise(ends)]
        return self.at(np.concatenate(blocks))

    def with_rows(self, rows: ObservedRows, nodes: npt.NDArray[np.intp], place: int) -> _Prior:
        """Insert rows of contacts at index `place`; `nodes`: indices of alpha at the nodes of the map, z then x."""
        size = self.mean.size
        all_rows = np.zeros((size + len(rows.values), size))
        is_new = np.zeros(len(all_rows), dtype=bool)
        is_new[place : place + len(rows.values)] = True
        all_rows[~is_new] = np.eye(size)
        all_rows[np.ix_(is_new, nodes)] = rows.weights
        mean = all_rows @ self.mean
        mean[is_new] += rows.offset
        everywhere = (np.arange(len(all_rows)),)
        smooth, rough = (
            _Blocks(everywhere, (all_rows @ blocks.whole() @ all_rows.T,))
            for blocks in (self.smooth, self.rough)
        )
        return _Prior(mean, self.between @ all_rows.T, smooth, rough)

    def covariance(self, rough_share: float) -> FloatArray:
        """Return C + (1 - w) K + w R, where w is `rough_share`."""
        covariance = self.between.T @ self.between
        self.smooth.add_to(covariance, 1 - rough_share)
        self.rough.add_to(covariance, rough_share)
        return covariance


def _symmetric_correlation(
    beta: FloatArray, gamma: FloatArray, kernel: Callable[[FloatArray, FloatArray], FloatArray]
) -> _Blocks:
    """Return correlations, by a kernel of chords, of functions on the torus (2 beta, gamma) with alpha's symmetry.

    Alpha_z is even under the mirror image; its variance is scaled to 1 everywhere. Alpha_x is odd; its variance
    goes to 0 where a direction is its own mirror image. Returns two blocks, z and x.
    """

    def kernel_to(angles: Angles) -> FloatArray:
        # kernel of the chords from each direction to each of `angles`, on both circles
        return kernel(
            2 * np.sin(beta[:, None] - angles[0]), 2 * np.sin((gamma[:, None] - angles[1]) / 2)
        )

    direct, mirrored = kernel_to((beta, gamma)), kernel_to(mirror(beta, gamma))
    size = np.sqrt(1 + np.diag(mirrored))
    even = (direct + mirrored) / size / size[:, None]
    places = np.arange(2 * beta.size)
    return _Blocks((places[: beta.size], places[beta.size :]), (even, direct - mirrored))


def _smooth_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of K for chords `beta` and `gamma`."""
    distance = np.hypot(beta / variation.smooth_beta, gamma / variation.smooth_gamma)
    kernel: FloatArray = variation.smooth * np.exp(-(distance**2) / 2)
    kernel += (1 - variation.smooth) * _matern(
        np.hypot(beta / variation.rough_beta, gamma / variation.rough_gamma)
    )
    return kernel


def _rough_kernel(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the kernel of R for chords `beta` and `gamma`."""
    return _matern(np.hypot(beta / variation.own_beta, gamma / variation.own_gamma))


def _matern(distance: FloatArray) -> FloatArray:
    """Return the Matern 3/2 kernel of distances in units of its length."""
    return np.asarray((1 + np.sqrt(3) * distance) * np.exp(-np.sqrt(3) * distance))


def published_shapes(without: Iterable[str] = ()) -> Shapes:
    """Return the five media of Table S5 as known shapes.

    Parameters
    ----------
    without : iterable of str, optional
        Names of media that are left out, for example the medium of the pushes, to see what its pushes alone give.

    Returns
    -------
    Shapes

    Examples
    --------
    >>> import rftfit
    >>> rftfit.published_shapes().name.split(", ")[0]
    'poppy_LP'
    """
    return _published_shapes(frozenset(without))


def published_map(medium: str) -> Map:
    """Estimate the map of a published medium from all its directions; the known media are the other four."""
    table = load("table_s5")
    pushes = table[table["medium"] == medium]
    return estimate_map(pushes, published_shapes([medium]), name=medium)


@cache
def _published_shapes(left_out: frozenset[str]) -> Shapes:
    """Return `published_shapes`, each set made once."""
    return Shapes({name: TableProfile.published(name) for name in MEDIA if name not in left_out})


def grid(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Angles:
    """Return directions on the published grid of 7 x 13 lines and on extra lines, rad, two arrays of shape (n,)."""

    def add_lines(published: FloatArray, extra_lines: npt.ArrayLike) -> FloatArray:
        extra = np.asarray(extra_lines, dtype=float).ravel()
        is_near = np.abs(extra[:, None] - published).min(axis=1, initial=np.inf) <= TOLERANCE_DEG
        all_lines: FloatArray = np.unique(np.concatenate([published, extra[~is_near]]))
        return np.radians(all_lines)

    # without beta = -90 degrees, which is the same plate as 90
    lines = add_lines(BETA_DEG[1:], beta_deg), add_lines(GAMMA_DEG, gamma_deg)
    mesh = np.meshgrid(*lines, indexing="ij")
    return mesh[0].ravel(), mesh[1].ravel()


class Nodes(NamedTuple):
    """Nodes of a map, rad, shape (n,); a plan of pushes may choose from the first `lines` nodes."""

    beta: FloatArray
    gamma: FloatArray
    lines: int


def map_nodes(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Nodes:
    """Return the nodes of `grid`, for which pushes can be planned, then those of finer lines between them.

    The finer lines are `STEP_DEG` apart in beta, and at the middles of the published gammas.
    """
    planned = grid(beta_deg, gamma_deg)
    steps = np.arange(-90 + STEP_DEG, 90, STEP_DEG)
    middles = (GAMMA_DEG[1:] + GAMMA_DEG[:-1]) / 2
    more_beta = np.concatenate([steps, np.asarray(beta_deg, dtype=float).ravel()])
    more_gamma = np.concatenate([middles, np.asarray(gamma_deg, dtype=float).ravel()])
    all_nodes = np.stack(grid(more_beta, more_gamma), axis=1)
    distance = np.abs(all_nodes[:, None] - np.stack(planned, axis=1)).max(axis=-1).min(axis=1)
    fine = all_nodes[distance > 1e-9]
    beta, gamma = (np.concatenate(angles) for angles in zip(planned, fine.T, strict=True))
    return Nodes(beta, gamma, planned[0].size)


STEP_DEG = 15.0
"""Distance of the lines of a map in beta, calibrated on the legs of Fig. S5 (docs/theory/map.md)."""

_GRID = grid()
"""Directions of the published grid, rad, each of shape (n,)."""

FRICTIONS = (0.2, 0.4, 0.8)
"""Frictions of 3D-RFT over whose courses the mean is taken."""


def course_between_lines(beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return 3D-RFT less its bilinear interpolation on the published grid, for each of `FRICTIONS`.

    For media whose alpha_z(0, 90 deg) is 1, in n directions (rad); shape (frictions, 2 n): z, then x. On the published
    grid the course is 0.
    """
    return np.stack([_law_less_its_lines(friction, beta, gamma) for friction in FRICTIONS])


def _law_less_its_lines(friction: float, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return `course_between_lines` for one friction, shape (2 n,)."""
    image = mirror(beta, gamma)
    # the mean with the mirror image has exactly the symmetry of alpha; a plate at 90 degrees is the one at -90
    law_here, law_at_mirror = (
        alpha_3drft(wrap_beta(angles[0]), angles[1], friction) for angles in ((beta, gamma), image)
    )
    law = np.concatenate(
        [(law_here[0] + law_at_mirror[0]) / 2, (law_here[1] - law_at_mirror[1]) / 2]
    )
    return law - np.concatenate(_law_on_lines(friction).alpha(beta, gamma))


@cache
def _law_on_lines(friction: float) -> TableProfile:
    """Return the table of 3D-RFT on the published grid."""
    return TableProfile(*alpha_3drft(*_GRID, friction), *_GRID)


class Pushes(NamedTuple):
    """Measured pushes.

    `beta`, `gamma`: shape (n,), rad. `alpha`: shape (2, n); z and x, N/cm^3, NaN where not measured.
    `covariance`: of the errors of alpha, (N/cm^3)^2, shape (2 n, 2 n), z first.
    """

    beta: FloatArray
    gamma: FloatArray
    alpha: FloatArray
    covariance: FloatArray

    @classmethod
    def of(
        cls,
        beta_deg: npt.ArrayLike,
        gamma_deg: npt.ArrayLike,
        alpha: npt.ArrayLike,
        se: npt.ArrayLike = np.nan,
    ) -> Pushes:
        """Make pushes with independent errors.

        `alpha`, `se`: shape (2, n), N/cm^3; a standard error of NaN is not known and replaced by `usual_error`.
        """
        beta, gamma = (
            np.radians(np.ravel(np.asarray(angles_deg, float)))
            for angles_deg in (beta_deg, gamma_deg)
        )
        alpha = np.asarray(alpha, dtype=float).reshape(2, beta.size)
        error = np.broadcast_to(np.asarray(se, dtype=float), alpha.shape)
        error = np.where(np.isnan(error), usual_error(alpha), error)
        return cls(beta, gamma, alpha, np.diag(error.ravel() ** 2))


NO_PUSHES = Pushes(np.zeros(0), np.zeros(0), np.zeros((2, 0)), np.zeros((0, 0)))

USUAL_PERCENT, LEAST_PERCENT = 100 * USUAL_BED_SPREAD, 1.0
"""Parts of an error that is not stated: relative to alpha of the push (scatter of beds), and to the largest alpha."""


def usual_error(
    alpha: FloatArray, percent: float = USUAL_PERCENT, least_percent: float = LEAST_PERCENT
) -> FloatArray:
    """Return the standard error of pushes whose error is not known, N/cm^3, in the shape of `alpha`."""
    largest = float(np.nanmax(np.abs(alpha), initial=0.0))
    return np.hypot(percent / 100 * alpha, least_percent / 100 * largest)


def sorted_pushes(pushes: Columns) -> Pushes:
    """Return the pushes of a table for `estimate_map`, sorted, so that the order of its rows has no effect."""
    angles_deg, alpha, se = _read_columns(pushes)
    order = np.lexsort([alpha[1], alpha[0], angles_deg[1], angles_deg[0]])
    beta_deg, gamma_deg = angles_deg[:, order]
    return Pushes.of(beta_deg, gamma_deg, alpha[:, order], se[:, order])


def _read_columns(pushes: Columns) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return angles (deg), alpha and standard errors (N/cm^3) of n pushes, each of shape (2, n); NaN: not stated."""
    name_of_alias = {name: column.name for column in ALPHA.columns for name in column.also}
    columns = {name_of_alias.get(str(name), str(name)): pushes[name] for name in pushes}
    if len(columns) < len([*pushes]):
        raise InputError(
            f"pushes: two columns have one meaning; found: {', '.join(map(str, pushes))}"
        )
    if missing := {"beta_deg", "gamma_deg", column("z")} - {*columns}:
        raise InputError(
            f"pushes: no column {', '.join(sorted(missing))}; found: {', '.join(columns)}"
        )
    not_stated = np.full(np.size(columns["beta_deg"]), np.nan)

    def stack(*names: str) -> FloatArray:
        arrays = (np.atleast_1d(columns.get(name, not_stated)) for name in names)
        return np.stack([array.astype(float) for array in arrays])

    return (stack("beta_deg", "gamma_deg"), stack(column("z"), column("x")), stack("se_z", "se_x"))


def push_straight_down(pushes: Columns, confidence: float) -> tuple[float, float] | None:
    """Find alpha_z(0, 90 deg) among pushes, and its standard error, N/cm^3; None if no plate was pushed straight down.

    The error of a single push is the stated error, or 0 if none is stated. For several pushes it is the error of their
    mean, calculated as for a map.
    """
    angles_deg, alpha, se = _read_columns(pushes)
    places, _ = _same_direction_or_mirror(0.0, math.pi / 2, *np.radians(angles_deg))
    places = places[np.isfinite(alpha[0, places])]
    if not places.size:
        return None
    if places.size == 1:
        return float(alpha[0, places[0]]), float(np.nan_to_num(se[0, places[0]]))
    beta_deg, gamma_deg = angles_deg[:, places]
    down = Pushes.of(beta_deg, gamma_deg, alpha[:, places], se[:, places])
    mean = merged(with_scatter_of_repeats(down, confidence))
    return float(mean.alpha[0, 0]), float(np.sqrt(mean.covariance[0, 0]))


def estimate_map(
    pushes: Columns | None = None,
    shapes: Shapes | None = None,
    confidence: float = 0.95,
    name: str = "",
    *,
    contacts: Sequence[Observation] = (),
    beta_deg: npt.ArrayLike = (),
    gamma_deg: npt.ArrayLike = (),
) -> Map:
    """Estimate alpha over all directions from pushes of plates, from measured forces on other bodies, or from both.

    Parameters
    ----------
    pushes : pandas.DataFrame or dict of str to array_like, optional
        One row for each push: ``beta_deg, gamma_deg``, ``alpha_z_N_per_cm3`` and, if it was measured,
        ``alpha_x_N_per_cm3``; standard errors ``se_z``, ``se_x``: an error that is not stated is assumed to be
        5 % of alpha and 1 % of the largest alpha. Pushes of one direction that differ by more than their errors explain
        have the error that their scatter shows, and so has the next bed. ``depth_from_cm, depth_to_cm``: least and
        largest depth behind alpha; deeper predictions have a warning. Column names: any that ``rftfit scale --pushes``
        accepts.
    shapes : Shapes, optional
        Known media, from whose shape the prior is made; default: the five published media.
    confidence : float, optional
        Level of the intervals.
    name : str, optional
        Name of the medium, for people.
    contacts : sequence of Contact, optional
        Measured forces on bodies that moved through this medium.
    beta_deg, gamma_deg : array_like, optional
        Lines of the grid of the map in addition to those of the published grid, degrees.

    Returns
    -------
    Map

    Raises
    ------
    ValueError
        If there is neither push nor contact, no push has a usable alpha, or pushes and contacts meet no resistance.

    Examples
    --------
    >>> import pandas as pd, rftfit
    >>> one = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.9]})
    >>> round(rftfit.estimate_map(one).zeta[0], 1)
    0.8
    """
    if pushes is None and not contacts:
        raise ValueError("a map needs a push or a contact")
    measured = NO_PUSHES if pushes is None else sorted_pushes(pushes)
    medium_map = estimate(
        with_scatter_of_repeats(measured, confidence),
        shapes,
        map_nodes(beta_deg, gamma_deg),
        confidence=confidence,
        name=name,
        contacts=contacts,
    )
    window = ANY_DEPTH if pushes is None else window_of(pushes)
    spread = bed_spread_of_repeats(measured, confidence)
    return replace(medium_map, bed_spread=spread, window=window)


def scale(
    alpha: float, se: float | None = None, shapes: Shapes | None = None, confidence: float = 0.95
) -> Map:
    """Turn one push straight down into a whole stress profile, with intervals: the map of this push.

    The result is that of `estimate_map` for a table with this push, as in ``rftfit scale --alpha`` and
    ``rftfit predict --alpha``.

    Parameters
    ----------
    alpha : float
        Slope of stress over depth of a horizontal plate pushed straight down, alpha_z(0, 90 deg),
        N/cm^3.
    se : float, optional
        Standard error of alpha, N/cm^3; default: the usual 5 % from bed to bed.
    shapes : Shapes, optional
        Known media whose shape the medium has, for example those of a campaign (`Results.shapes`); default: the
        five published media.
    confidence : float, optional
        Level of the intervals.

    Returns
    -------
    Map

    Raises
    ------
    TypeError
        If alpha or `se` is no number.
    ValueError
        If alpha is not positive, `se` is negative, or the level is not between 0.5 and 1.

    Examples
    --------
    >>> import rftfit
    >>> sand = rftfit.scale(0.9, se=0.02)
    >>> [round(number, 1) for number in sand.zeta]
    [0.8, 0.5, 1.0]
    """
    check_test(alpha, 0.0 if se is None else se)
    check_level(confidence)
    return estimate_map(one_push(alpha, se), shapes, confidence, name=describe_push(alpha, se))


def one_push(alpha: float, se: float | None) -> Columns:
    """Return the columns of a table with one push straight down; an `se` of None becomes NaN."""
    columns = {"beta_deg": [0.0], "gamma_deg": [90.0], column("z"): [alpha]}
    return columns | {column("z", "_se"): [np.nan if se is None else se]}


def describe_push(alpha: float, se: float | None) -> str:
    """Describe one push straight down in words."""
    error = "" if se is None else f" (se {se:g})"
    return f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3{error}"


def pushes_of(table: pd.DataFrame, config: Config) -> Pushes:
    """Return the cells of an alpha table as pushes, with the covariance of their errors."""
    beta_deg = table["beta_deg"].to_numpy(float)
    alpha = np.stack(alpha_columns(table))
    if config.fit.flagged == "leave_out":
        alpha = np.where(flagged(table), np.nan, alpha)
    # rows at beta = -90 degrees that repeat one at 90, the same plate
    is_repeated = (beta_deg == -90) & table["gamma_deg"].isin(
        table.loc[beta_deg == 90, "gamma_deg"]
    )
    use = np.isfinite(alpha).any(axis=0) & ~is_repeated.to_numpy(bool)
    gamma_deg = table["gamma_deg"].to_numpy(float)
    if not errors_known(table):
        return Pushes.of(beta_deg[use], gamma_deg[use], alpha[:, use])
    draws = np.concatenate(
        [draws_of_component[:, use] for draws_of_component in draws_of(table, config)], axis=1
    )
    covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    beta, gamma = directions(table)
    return Pushes(beta[use], gamma[use], alpha[:, use], covariance)


def _by_direction(pushes: Pushes) -> Iterator[tuple[npt.NDArray[np.intp], FloatArray]]:
    """Yield for each direction the indices (n,) of pushes in it or its mirror image, and the signs of z and x, (2, n).

    The signs make alpha comparable with that of the first push: alpha_x of its mirror image has the opposite sign.
    """
    is_left = np.ones(pushes.beta.size, dtype=bool)
    for push in range(pushes.beta.size):
        if is_left[push]:
            same_pushes, sign_x = _same_direction_or_mirror(
                pushes.beta[push], pushes.gamma[push], pushes.beta, pushes.gamma
            )
            # a push within the tolerance of two directions counts for the first direction alone
            is_new = is_left[same_pushes]
            same_pushes, sign_x = same_pushes[is_new], sign_x[is_new]
            is_left[same_pushes] = False
            yield same_pushes, np.stack([np.ones(same_pushes.size), sign_x])


class _Repeats(NamedTuple):
    """One component, z or x, of n pushes of the same direction.

    `places`: their rows in `Pushes.covariance`. `alpha`: shape (n,), N/cm^3, with signs as if all were in the direction
    of the first push.
    """

    places: npt.NDArray[np.intp]
    alpha: FloatArray


def _repeats_of(pushes: Pushes) -> Iterator[_Repeats]:
    """Yield each component of each direction that was measured by two pushes or more."""
    for same_pushes, signs in _by_direction(pushes):
        for component, alpha in enumerate(signs * pushes.alpha[:, same_pushes]):
            is_known = np.isfinite(alpha)
            if np.count_nonzero(is_known) > 1:
                places = component * pushes.beta.size + same_pushes[is_known]
                yield _Repeats(places, alpha[is_known])


def with_scatter_of_repeats(pushes: Pushes, confidence: float) -> Pushes:
    """Return pushes whose errors are as large as the scatter of pushes in one direction shows.

    Pushes without a stated error get the error of `spread_of_beds`, as the runs of a campaign do. Pushes with a stated
    error get the error by their scatter if it is larger than their errors explain. The scatter of few pushes is poorly
    known: the error is enlarged so that the normal interval is as wide as Student's.
    """
    repeats = [*_repeats_of(pushes)]
    if not repeats:
        return pushes
    variance = np.diag(pushes.covariance).copy()
    usual_variance = usual_error(pushes.alpha).ravel() ** 2
    spread = spread_of_beds(
        [
            (signs * pushes.alpha[:, same_pushes], np.zeros_like(signs))
            for same_pushes, signs in _by_direction(pushes)
        ]
    )
    for places, alpha in repeats:
        if (variance[places] == usual_variance[places]).all():
            component, first = divmod(int(places[0]), pushes.beta.size)
            mean_alpha = pushes.alpha[:, first].copy()
            mean_alpha[component] = alpha.mean()
            error_of_one_bed = spread.error_at(mean_alpha, component)
            share = np.full(alpha.size, 1 / alpha.size)
            bed = bed_of_mean(alpha, share, Part(0.0), error_of_one_bed, spread.source)[1]
            # variance of one push, whose mean over the pushes has the error of the mean
            variance[places] = alpha.size * _normal_error(bed, confidence) ** 2
            continue
        scatter = scatter_of_runs(alpha)
        stated_variance_of_mean = 1 / np.sum(1 / np.maximum(variance[places], 1e-300))
        if scatter.sd**2 / alpha.size > stated_variance_of_mean:
            variance[places] = _normal_error(scatter, confidence) ** 2
    if np.array_equal(variance, np.diag(pushes.covariance)):
        return pushes
    return pushes._replace(covariance=np.diag(variance))


def bed_spread_of_repeats(pushes: Pushes, confidence: float) -> float:
    """Return the relative standard deviation of a further bed: the usual one, or the scatter of repeats if larger.

    The scatter is the root mean square over directions and components, weighted by degrees of freedom and by alpha
    squared.
    """
    squares, weights = 0.0, 0.0
    for _, alpha in _repeats_of(pushes):
        mean = abs(float(alpha.mean()))
        usual = Part(USUAL_BED_SPREAD * mean)
        next_error = bed_of_next(alpha, usual, confidence, scatter=True)
        squares += (alpha.size - 1) * _normal_error(next_error, confidence) ** 2
        weights += (alpha.size - 1) * mean**2
    return math.sqrt(squares / weights) if weights else USUAL_BED_SPREAD


def _normal_error(error: Part, confidence: float) -> float:
    """Return the standard deviation of a normal error whose interval is as wide as the interval of `error`."""
    return combined_half_width([error], confidence) / half_width_of_bed(1.0, confidence)


def merged(pushes: Pushes) -> Pushes:
    """Replace repeated pushes of a direction by their mean, weighted by their errors, with its error."""
    count = pushes.beta.size
    is_known = np.isfinite(pushes.alpha.ravel()) & np.isfinite(np.diag(pushes.covariance))
    covariance = pushes.covariance
    if is_known.all() and all(same.size == 1 for same, _ in _by_direction(pushes)):
        return pushes
    if not is_known.all():
        covariance = np.where(np.outer(is_known, is_known), covariance, 0.0)
    least = (1e-9 * np.abs(np.where(is_known, pushes.alpha.ravel(), 0.0)).max(initial=1e-9)) ** 2
    weight = np.where(is_known, 1 / np.maximum(np.diag(covariance), least), 0.0)
    first_pushes: list[int] = []
    groups: list[npt.NDArray[np.intp]] = []
    shares: list[FloatArray] = []
    for same_pushes, signs in _by_direction(pushes):
        first_pushes.append(int(same_pushes[0]))
        for component, sign in enumerate(signs):
            places = component * count + same_pushes
            total = float(weight[places].sum())
            groups.append(places)
            shares.append(sign * weight[places] / total if total else np.full(places.size, np.nan))
    # z of all directions, then x
    order = [*range(0, len(groups), 2), *range(1, len(groups), 2)]
    places = np.concatenate([groups[group] for group in order])
    share = np.concatenate([shares[group] for group in order])
    starts = np.cumsum([0, *(groups[group].size for group in order)])[:-1]
    not_measured = np.isnan(share[starts]).reshape(2, -1)
    share = np.nan_to_num(share)
    known_alpha = np.where(is_known, pushes.alpha.ravel(), 0.0)
    alpha = np.add.reduceat(share * known_alpha[places], starts).reshape(2, -1)
    # in place: for a thousand pushes each product would be another 32 MB
    merged_covariance = covariance[np.ix_(places, places)]
    merged_covariance *= share[:, None]
    merged_covariance *= share
    if starts.size < places.size:
        row_sums = np.add.reduceat(merged_covariance, starts, axis=0)
        merged_covariance = np.add.reduceat(row_sums, starts, axis=1)
    beta, gamma = pushes.beta[first_pushes], pushes.gamma[first_pushes]
    return Pushes(beta, gamma, np.where(not_measured, np.nan, alpha), merged_covariance)


def nodes_of(table: pd.DataFrame) -> Nodes:
    """Return the nodes for the map of a medium, with the lines of its table if they are a grid of moderate size."""
    lines_deg = tuple(table[name].unique() for name in ("beta_deg", "gamma_deg"))
    coarse = grid(*lines_deg)
    if rectangle(*directions(table)) is None or coarse[0].size > _CHOSEN.most_nodes:
        return map_nodes()
    fine = map_nodes(*lines_deg)
    return fine if fine.beta.size <= _CHOSEN.most_fine_nodes else Nodes(*coarse, coarse[0].size)


def estimate(
    pushes: Pushes,
    shapes: Shapes | None = None,
    nodes: Nodes | None = None,
    *,
    size: float | None = None,
    confidence: float = 0.95,
    name: str = "",
    contacts: Sequence[Observation] = (),
) -> Map:
    """Do what `estimate_map` does, for pushes with known errors.

    `nodes`: nodes of the map, all on lines of a grid; default: `map_nodes`. `size`: root mean square of alpha over the
    published grid, N/cm^3, if it is known; default: it is estimated.
    """
    shapes = shapes or published_shapes()
    nodes = nodes or map_nodes()
    push_count = int(np.isfinite(pushes.alpha).any(axis=0).sum())
    pushes = merged(pushes) if pushes.beta.size else pushes
    # three blocks: pushes, nodes of the published grid, other nodes; most draws are rejected before the third is drawn
    on_grid = _on_published_grid((nodes.beta, nodes.gamma))
    order = np.concatenate([np.flatnonzero(on_grid), np.flatnonzero(~on_grid)])
    count, coarse = pushes.beta.size, int(on_grid.sum())
    prior = shapes.prior(
        *(
            np.concatenate([push_angles, node_angles[order]])
            for push_angles, node_angles in ((pushes.beta, nodes.beta), (pushes.gamma, nodes.gamma))
        )
    ).by_blocks((count, coarse, nodes.beta.size - coarse))
    seen = np.arange(2 * count)
    y, errors = pushes.alpha.ravel(), pushes.covariance
    smooth_variance = np.empty(prior.mean.size)
    for places, square in zip(*prior.smooth, strict=True):
        smooth_variance[places] = np.diag(square)
    # a number that is 0 by symmetry, without variance, says nothing about the medium
    used = (
        np.isfinite(y)
        & np.isfinite(np.diag(errors))
        & (smooth_variance[seen] > _CHOSEN.zero_variance)
    )
    if not (used.any() or contacts):
        raise ValueError("no push has a number that tells of the medium")
    sorted_nodes = nodes.beta[order], nodes.gamma[order]
    # without a copy if all are used: for a thousand pushes it would be 32 MB
    used_errors = errors if used.all() else errors[np.ix_(used, used)]
    measured_pushes = measurements = _Measurements(prior, seen[used], y[used], used_errors)
    if contacts:
        places = _places_of_nodes(count, coarse, nodes.beta.size)
        measurements = _with_contacts(measured_pushes, contacts, sorted_nodes, places, size)
    posterior = _Posterior(*measurements, shapes.variation, size)
    pushed_nodes = _PushedNodes(sorted_nodes, pushes, used)
    drawn, share = posterior.draws(sorted_nodes, coarse, pushed_nodes, pushes, used, shapes.tilt)
    back = np.argsort(order)
    draws, measured = drawn[..., back], pushed_nodes.measured[back]
    smooth_likelihood = posterior.likelihoods[0]  # w is 0
    expected_size = smooth_likelihood.expected(size)
    farthest = None
    horizontal, seen_error = float("nan"), float("nan")
    if used.any():
        of_pushes = _likelihood_of(measured_pushes) if contacts else smooth_likelihood
        is_x = np.flatnonzero(used) >= pushes.beta.size
        horizontal, seen_error = of_pushes.horizontal(is_x, expected_size)
        farthest = of_pushes.farthest(pushes, used, expected_size)
    # NaN if only one component was measured
    horizontal_off = float("nan")
    if horizontal == 0:
        horizontal_off = 1 / seen_error
    elif horizontal > 0:
        horizontal_off = abs(np.log(horizontal)) / shapes.horizontal_error(seen_error)
    return Map(
        name,
        nodes.beta,
        nodes.gamma,
        draws,
        measured,
        share,
        expected_size,
        smooth_likelihood.distance(expected_size),
        measurements.y.size - 1,
        push_count,
        shapes.name,
        farthest,
        horizontal,
        float(horizontal_off),
        confidence,
        pushes,
        nodes.lines,
        contacts=len(contacts),
    )


class _Measurements(NamedTuple):
    """Measured numbers `y` (n,), covariance of their `errors`, and `seen` (n,), the indices of `y` in the `prior`."""

    prior: _Prior
    seen: npt.NDArray[np.intp]
    y: FloatArray
    errors: FloatArray


def _places_of_nodes(pushes: int, coarse: int, count: int) -> npt.NDArray[np.intp]:
    """Return the indices in the prior of `estimate` of alpha at the sorted nodes, z then x.

    The blocks of the prior are pushes, the `coarse` nodes of the published grid, and other nodes; `count`: of all
    nodes.
    """
    grid_start = 2 * pushes
    fine_start = grid_start + 2 * coarse
    fine = count - coarse
    blocks = [
        np.arange(start + component * length, start + (component + 1) * length)
        for component in range(2)
        for start, length in ((grid_start, coarse), (fine_start, fine))
    ]
    return np.concatenate(blocks)


def _with_contacts(
    measured: _Measurements,
    contacts: Sequence[Observation],
    nodes: Angles,
    places: npt.NDArray[np.intp],
    size: float | None,
) -> _Measurements:
    """Add the rows of contacts behind those of the pushes.

    The error of the force model is proportional to the size of the medium, which depends on these rows: rows and size
    are calculated in turn until the size does not change.
    """
    prior = measured.prior
    # C + K + R, more than any medium has: no useful combination of forces is left out
    covariance = prior.covariance(0.0)
    prior.rough.add_to(covariance)
    rows_of_prior = root(covariance[np.ix_(places, places)])
    system = ObservedSystem.of(contacts, nodes, prior.mean[places], rows_of_prior)
    size_now = size or system.first_size()
    if not size_now > 0:
        raise ValueError(
            "the contacts meet no resistance: look at the signs of the forces and at the angles"
        )
    place = int(places.min())
    for _ in range(_CHOSEN.size_steps):
        rows = system.rows(size_now)
        count, added = len(measured.y), len(rows.values)
        errors = np.zeros((count + added,) * 2)
        errors[:count, :count] = measured.errors
        errors[count:, count:] = np.diag(rows.errors**2)
        both = _Measurements(
            prior.with_rows(rows, places, place),
            np.concatenate([measured.seen, place + np.arange(added)]),
            np.concatenate([measured.y, rows.values]),
            errors,
        )
        before, size_now = size_now, _likelihood_of(both).expected(size)
        if abs(size_now - before) < _CHOSEN.same_size * before:
            break
    return both


def _likelihood_of(measured: _Measurements) -> _Likelihood:
    """Return the likelihood of measured numbers in a medium without roughness (w = 0)."""
    prior, seen, y, errors = measured
    return _Likelihood(prior, seen, 0.0, y, _add_rounding(errors, y))


def _add_rounding(errors: FloatArray, y: FloatArray) -> FloatArray:
    """Add a variance of rounding to a covariance, so that it has an inverse even for exact numbers."""
    scale = float(np.abs(y).max()) or 1.0
    rounded = errors.copy()
    rounded[np.diag_indices(y.size)] += (1e-6 * scale) ** 2
    return rounded


def _on_published_grid(nodes: Angles) -> npt.NDArray[np.bool_]:
    """Return True for nodes (rad) that lie on the published grid."""
    distances = [
        np.abs(map_angles[:, None] - published).min(axis=1)
        for map_angles, published in zip(
            nodes, (np.unique(_GRID[0]), np.unique(_GRID[1])), strict=True
        )
    ]
    return np.asarray(np.maximum(*distances) < 1e-9)


TILT_SHARE = 1.0
"""Share of the full tilt that is applied: decided on natural sands and on exact laws (docs/theory/map.md)."""

_DEPARTURES = np.exp(0.28 * np.arange(-4, 12))
"""Values of lambda that are tried; 0.1 % of its prior lies outside."""


class _PushedNodes:
    """Nodes of the map that were pushed, whose alpha is the measured one with its error.

    `measured` (n,): True for pushed nodes. `places`: indices of their numbers among the 2 n of the nodes; `rows`: index
    of each number among the used numbers of the pushes; `signs`: -1 for alpha_x of a mirror image.
    """

    def __init__(self, nodes: Angles, pushes: Pushes, used: npt.NDArray[np.bool_]) -> None:
        count, push_count = nodes[0].size, pushes.beta.size
        self.measured = np.zeros(count, dtype=bool)
        places, rows, signs = [], [], []
        # index of each number of the pushes among those that are used
        place = np.cumsum(used) - 1
        for push, (beta, gamma) in enumerate(zip(pushes.beta, pushes.gamma, strict=True)):
            nodes_pushed, sign_x = _same_direction_or_mirror(beta, gamma, *nodes)
            if not used[push]:  # no alpha_z: the node does not count as pushed
                continue
            self.measured[nodes_pushed] = True
            for component, sign in enumerate((np.ones(nodes_pushed.size), sign_x)):
                if used[row := component * push_count + push]:
                    places.append(component * count + nodes_pushed)
                    rows.append(np.full(nodes_pushed.size, place[row]))
                    signs.append(sign)
        self.places = np.concatenate([np.zeros(0, int), *places])
        self.rows = np.concatenate([np.zeros(0, int), *rows])
        self.signs = np.concatenate([np.zeros(0), *signs])

    def put(self, into: FloatArray, numbers: FloatArray) -> None:
        """Write used numbers of the pushes, shape (..., k), into an array of the nodes, shape (..., 2 n)."""
        into[..., self.places] = self.signs * numbers[..., self.rows]


class _Posterior:
    """Posterior of a medium, on a grid of its size s, departure lambda and share w of R, and draws of alpha from it.

    The prior has three blocks: pushes, nodes of the published grid, other nodes; in each z, then x. `seen`: indices of
    the measured numbers `y` in the prior.
    """

    def __init__(
        self,
        prior: _Prior,
        seen: npt.NDArray[np.intp],
        y: FloatArray,
        errors: FloatArray,
        variation: Variation,
        size: float | None,
    ) -> None:
        self.prior, self.seen, self.y = prior, seen, y
        self._first_node = int(seen.max()) + 1
        self.rough_shares = np.linspace(0, variation.most_own, _CHOSEN.rough_shares)
        rounded = _add_rounding(errors, y)
        # standard deviations of independent errors, else rows whose products are their covariance
        self._noise = (
            np.sqrt(np.diag(rounded))
            if whitening(rounded).ndim == 1
            else np.linalg.cholesky(rounded).T
        )
        self.likelihoods = [
            _Likelihood(prior, seen, rough_share, y, rounded) for rough_share in self.rough_shares
        ]
        self._matrices: dict[int, tuple[npt.NDArray[np.float32], FloatArray]] = {}
        half = variation.departure_dof / 2
        prior_of_departure = -half * np.log(_DEPARTURES) - (half + 1) / _DEPARTURES
        # the trapezoidal rule over w
        is_end = np.isin(np.arange(_CHOSEN.rough_shares), (0, _CHOSEN.rough_shares - 1))
        prior_of_share = np.log(np.where(is_end, 0.5, 1.0))
        log_prior = prior_of_share[:, None, None] + prior_of_departure[:, None]
        self.sizes, self.weights = _weigh(self.likelihoods, _DEPARTURES, log_prior, size)

    def _root_and_towards(self, place: int) -> tuple[npt.NDArray[np.float32], FloatArray]:
        """Return two matrices for one w, the value number `place` of `rough_shares`.

        The first has rows whose products are the covariance of the prior; the second is the covariance between measured
        numbers and nodes. They are made when this w is first drawn: with many pushes most values never are.
        """
        if place not in self._matrices:
            covariance = self.prior.covariance(float(self.rough_shares[place]))
            towards = covariance[self.seen, self._first_node :]
            # single precision is enough for random parts
            rows = _covariance_rows(covariance).astype(np.float32, order="F")
            self._matrices[place] = rows, towards
        return self._matrices[place]

    def draws(
        self,
        nodes: Angles,
        coarse: int,
        pushed_nodes: _PushedNodes,
        pushes: Pushes,
        used: npt.NDArray[np.bool_],
        tilt: float,
    ) -> tuple[FloatArray, float]:
        """Draw alpha at the nodes, (draws, 2, n); return also the share of draws rejected as they give energy back.

        The first `coarse` nodes are those of the published grid. A draw that gives energy back there is rejected. Any
        other is kept with the probability exp(-tilt (T - least T of the first draws)), where T is its `mean_effort`.
        The nodes between the lines are then drawn until the medium takes energy there too, at most `most_completed`
        times.
        """
        random = np.random.default_rng(SEED)
        grid_nodes = nodes[0][:coarse], nodes[1][:coarse]
        pushed_on_grid = _PushedNodes(grid_nodes, pushes, used)
        place_count = self.prior.mean.size - 2 * (nodes[0].size - coarse)
        draws_kept: list[FloatArray] = []
        batches = passive = completed = 0
        least_effort = np.nan
        while batches < _CHOSEN.most_drawn and completed < DRAWS:
            batch = self._draw_sizes_and_pull(place_count, random)
            draws = self._alpha_at(batch, slice(place_count - 2 * coarse, place_count))
            # before alpha as measured is put in: its error is no property of the medium
            efforts = mean_effort(draws, grid_nodes)
            pushed_on_grid.put(draws.reshape(len(draws), -1), self.y - batch.noise)
            largest = np.abs(draws).max(axis=(1, 2))
            is_passive = _takes_energy(draws, grid_nodes[1], largest, pushed_on_grid.measured)
            batches, passive = batches + 1, passive + int(is_passive.sum())
            chosen = np.flatnonzero(is_passive)
            if tilt:
                chosen = chosen[np.isfinite(efforts[chosen])]
            if tilt and chosen.size:
                effort = efforts[chosen]
                least_effort = float(effort.min()) if np.isnan(least_effort) else least_effort
                chance = np.exp(-tilt * np.maximum(effort - least_effort, 0.0))
                chosen = chosen[random.random(chance.size) < chance]
            # rejected draws are dropped: for a thousand pushes they would be another 40 MB
            batch, draws = batch.of(chosen), draws[chosen]
            alpha = self._complete_between_lines(batch, draws, nodes, pushed_nodes, random)
            completed += len(alpha)
            draws_kept.append(alpha)
        share = 1 - passive / (batches * DRAWS)
        if completed < _CHOSEN.fewest_draws:
            raise ValueError(
                f"in {share:.1%} of the draws the medium would push the plate along where it was not pushed: check the "
                "signs of alpha and the angles"
            )
        drawn = np.concatenate(draws_kept)[:DRAWS]
        # the mean of the draws at a pushed node is moved to exactly the measured number
        by_draw = drawn.reshape(len(drawn), -1)
        centre = by_draw.mean(axis=0)
        pushed_nodes.put(centre, self.y)
        by_draw += centre - by_draw.mean(axis=0)
        return drawn, share

    def _draw_sizes_and_pull(self, place_count: int, random: np.random.Generator) -> _Batch:
        """Draw size, departure, roughness and normal numbers of a batch, and the correction by the pushes (the pull).

        Matheron's rule: a medium and errors are drawn from the prior, its pushes with these errors are calculated,
        and the draw is corrected by their difference from the measured pushes.
        """
        # evenly spaced quantiles of the weights, in random order
        quantiles = (np.arange(DRAWS) + random.random()) / DRAWS
        cumulative = np.cumsum(self.weights.ravel())[:-1]
        chosen = np.searchsorted(cumulative, random.permutation(quantiles))
        share_index, departure, size = np.unravel_index(chosen, self.weights.shape)
        s, departures = self.sizes[size][:, None], _DEPARTURES[departure][:, None]
        shares_drawn = np.unique(share_index).tolist()
        for place in shares_drawn:
            # made before the arrays of the draws, to limit the memory in use at a time
            self._root_and_towards(place)
        noise = random.standard_normal((DRAWS, self.y.size))
        if self._noise.ndim == 1:
            noise *= self._noise
        else:
            noise = noise @ self._noise
        normals = random.standard_normal((DRAWS, place_count), np.float32)
        pull = np.empty((DRAWS, self.y.size))
        variance = s**2 * departures
        for place in shares_drawn:
            # the root is triangular: the numbers of the pushes, the first ones, depend on the first normal numbers
            # alone
            root = self._root_and_towards(place)[0][: self.seen[-1] + 1, _as_slice(self.seen)]
            of_share = np.flatnonzero(share_index == place)
            blocks = -(-of_share.size * self.y.size // _CHOSEN.numbers_at_once)
            for block in np.array_split(of_share, blocks):
                drawn = normals[block, : len(root)] @ root
                shape = self.prior.mean[self.seen] + np.sqrt(departures[block]) * drawn
                difference = self.y - s[block] * shape - noise[block]
                solved = self.likelihoods[place].solved(difference, variance[block])
                pull[block] = variance[block] * solved
        return _Batch(share_index, s, departures, normals, pull, noise)

    def _complete_between_lines(
        self,
        batch: _Batch,
        draws: FloatArray,
        nodes: Angles,
        pushed_nodes: _PushedNodes,
        random: np.random.Generator,
    ) -> FloatArray:
        """Add alpha at the other nodes to draws on the published grid, (draws, 2, coarse); returns (draws, 2, n).

        Next to a push that gives energy back, by its error, every completion may give energy back: the last one is then
        kept.
        """
        place_count, size = batch.normals.shape[1], self.prior.mean.size
        if place_count == size:
            return draws
        other_nodes = slice(place_count, size)
        largest = np.abs(draws).max(axis=(1, 2), initial=0.0)
        # mean of alpha between the lines, given alpha on the lines
        expected = self._alpha_at(batch, other_nodes)
        alpha = np.empty((len(draws), 2, nodes[0].size))
        unfinished = np.arange(len(draws))
        for _ in range(_CHOSEN.most_completed):
            if not unfinished.size:
                break
            normals = random.standard_normal((unfinished.size, size - place_count), np.float32)
            completed = expected[unfinished] + self._draw_rest(
                batch, unfinished, normals, other_nodes
            )
            all_nodes = np.concatenate([draws[unfinished], completed], axis=-1)
            pushed_nodes.put(
                all_nodes.reshape(unfinished.size, 2 * nodes[0].size),
                self.y - batch.noise[unfinished],
            )
            alpha[unfinished] = all_nodes
            unfinished = unfinished[
                ~_takes_energy(all_nodes, nodes[1], largest[unfinished], pushed_nodes.measured)
            ]
        return alpha

    def _alpha_at(self, batch: _Batch, places: slice) -> FloatArray:
        """Calculate alpha at n nodes, those at `places` in the prior, by the normal numbers of a batch, (draws, 2, n).

        Numbers of the prior that have no normal number in the batch yet count as 0, their mean.
        """
        reach = min(places.stop, batch.normals.shape[1])
        alpha = np.empty((len(batch.share_index), places.stop - places.start))
        for place in np.unique(batch.share_index).tolist():
            of_share = batch.share_index == place
            root, towards = self._root_and_towards(place)
            drawn = batch.normals[of_share, :reach] @ root[:reach, places]
            shape = self.prior.mean[places] + np.sqrt(batch.departures[of_share]) * drawn
            columns = slice(places.start - self._first_node, places.stop - self._first_node)
            pulled = batch.pull[of_share] @ towards[:, columns]
            alpha[of_share] = batch.s[of_share] * shape + pulled
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)

    def _draw_rest(
        self,
        batch: _Batch,
        unfinished: npt.NDArray[np.intp],
        normals: npt.NDArray[np.float32],
        places: slice,
    ) -> FloatArray:
        """Draw the part of alpha at the last n nodes that alpha at the others does not determine, (draws, 2, n)."""
        alpha = np.empty((unfinished.size, places.stop - places.start))
        share_index = batch.share_index[unfinished]
        spread = batch.s[unfinished] * np.sqrt(batch.departures[unfinished])
        for place in np.unique(share_index).tolist():
            of_share, root = share_index == place, self._root_and_towards(place)[0]
            # transposed, in the order in which the root lies in memory: half the time for few draws
            drawn = (root[places, places].T @ normals[of_share].T).T
            alpha[of_share] = spread[of_share] * drawn
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)


def _as_slice(places: npt.NDArray[np.intp]) -> npt.NDArray[np.intp] | slice:
    """Return consecutive indices as a slice, which needs no copy (16 MB for a thousand pushes); others as they are."""
    is_consecutive = places.size and np.array_equal(
        places, np.arange(places[0], places[0] + places.size)
    )
    return slice(places[0], places[-1] + 1) if is_consecutive else places


class _Batch(NamedTuple):
    """Draws before alpha is calculated, one row for each draw.

    `share_index`: index of w in `_Posterior.rough_shares`. `s`: size. `departures`: lambda. `normals`: normal numbers
    of the prior. `pull`: correction by the pushes. `noise`: drawn errors of the pushes.
    """

    share_index: npt.NDArray[np.intp]
    s: FloatArray
    departures: FloatArray
    normals: npt.NDArray[np.float32]
    pull: FloatArray
    noise: FloatArray

    def of(self, chosen: npt.NDArray[np.intp]) -> _Batch:
        """Return some of the draws."""
        return _Batch._make(values[chosen] for values in self)


def _takes_energy(
    draws: FloatArray, gamma: FloatArray, largest: FloatArray, measured: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Return True for media (draws, 2, n) that take energy in every direction that was not pushed.

    `largest` (draws,): largest alpha of each medium, by which rounding is judged.
    """
    takes = (work(draws, gamma) >= -LEAST_WORK * largest[:, None]) | measured
    return np.asarray(takes.all(axis=-1))


def mean_effort(alpha: FloatArray, nodes: Angles) -> FloatArray:
    """Return the mean of `work` over n nodes of the published grid relative to alpha_z(0, 90 deg), shape (draws,).

    `alpha`: shape (draws, 2, n). The effort is infinite if a medium does not resist a plate that is pushed straight
    down.
    """
    down = np.argmin(np.abs(nodes[0]) + np.abs(nodes[1] - np.pi / 2))
    alpha_z_down = alpha[:, 0, down]
    resists = alpha_z_down > 0
    effort = work(alpha, nodes[1]).mean(axis=-1) / np.where(resists, alpha_z_down, 1.0)
    return np.where(resists, effort, np.inf)


def _covariance_rows(covariance: FloatArray) -> FloatArray:
    """Return triangular rows R with R.T @ R equal to a covariance; columns of numbers without variance are exactly 0.

    Raises the diagonal of `covariance` a little, in place, so that the decomposition succeeds.
    """
    variance = np.diag(covariance).copy()
    covariance[np.diag_indices(variance.size)] += _CHOSEN.zero_variance * variance.max()
    if variance.size < _CHOSEN.many_numbers:
        rows = np.linalg.cholesky(covariance).T
    else:
        # overwrites the covariance: numpy would make two copies of 54 MB each for a thousand pushes
        from scipy.linalg import cholesky

        rows = cholesky(covariance.T, lower=True, overwrite_a=True, check_finite=False).T
    rows[:, variance <= _CHOSEN.zero_variance] = 0.0
    return np.asarray(rows)


def _weigh(
    likelihoods: list[_Likelihood],
    departures: FloatArray,
    log_prior: FloatArray,
    fixed_size: float | None,
) -> tuple[FloatArray, FloatArray]:
    """Return sizes (k,), evenly spaced in their logarithm, and the posterior weight of each w, lambda and size.

    `likelihoods`: one for each w. `log_prior`: of w and lambda, shape (w, lambda, 1). The weights sum to 1. The prior
    of the logarithm of the size is flat, but falls for sizes that the errors would hide: pushes in directions where
    media have hardly any force would otherwise fit the weakest medium best.
    """
    middle = likelihoods[0].first if fixed_size is None else fixed_size
    low, high = np.log(middle / _CHOSEN.widest), np.log(middle * _CHOSEN.widest)
    for _ in range(3):  # narrow the range to sizes with weight
        sizes = (
            np.exp(np.linspace(low, high, _CHOSEN.sizes))
            if fixed_size is None
            else np.array([fixed_size])
        )
        log_weights = log_prior + np.stack(
            [likelihood.likelihood(sizes, departures) for likelihood in likelihoods]
        )
        hidden_below = _CHOSEN.hidden_below_se * likelihoods[0].least_error
        log_weights += np.log(sizes / (sizes + hidden_below))
        weights = np.exp(log_weights - log_weights.max())
        likely = np.flatnonzero(weights.max(axis=(0, 1)) > 1e-6)
        low = np.log(sizes[max(likely[0] - 1, 0)])
        high = np.log(sizes[min(likely[-1] + 1, sizes.size - 1)])
    return sizes, weights / weights.sum()


class _Likelihood:
    """Likelihood of n measured numbers with normal errors, for any size and departure of the medium at one w.

    After whitening, which makes the errors independent and 1, the covariance of the numbers is 1 + t (B B' + S): t is
    the size squared times the departure, B (few columns) the differences of known media, and S the rest, (1 - w) K + w
    R. One eigendecomposition of S serves every t, and B is a correction of few columns (Woodbury). If the errors of z
    and x are independent, S has two parts, and the decomposition takes a quarter of the time. For few numbers, or if S
    has one part, B B' is added to S instead.

    `seen`: indices of the numbers in the prior.
    """

    def __init__(
        self,
        prior: _Prior,
        seen: npt.NDArray[np.intp],
        rough_share: float,
        y: FloatArray,
        errors: FloatArray,
    ) -> None:
        measured = prior.at(seen)
        self.mean, self.y = measured.mean, y
        variance_without_bed = np.diag(errors) - (USUAL_PERCENT / 100 * y) ** 2
        self.least_error = float(np.sqrt(np.maximum(variance_without_bed, 0.0).min()))
        whiten = whitening(errors)
        parts = _independent_parts(measured.smooth, errors)
        if y.size <= _CHOSEN.few_numbers or len(parts) == 1:
            parts = [np.arange(y.size)]
            rests = [measured.covariance(rough_share)]
            between = measured.between[:0]
        else:
            squares = zip(measured.smooth.squares, measured.rough.squares, strict=True)
            rests = [(1 - rough_share) * k + rough_share * r for k, r in squares]
            between = measured.between
        self._parts = [
            _EigenPart.of(places, rest, whiten) for places, rest in zip(parts, rests, strict=True)
        ]
        self._values = np.concatenate([part.values for part in self._parts])
        self._between = self._to_axes(between)
        self._y, self._mean = self._to_axes(y), self._to_axes(self.mean)
        # a first estimate of the size, with an error of 20 % of each number
        weight = 1 / (np.diag(errors) + (0.2 * np.abs(y)) ** 2)
        self.first = float(weight @ (self.mean * y)) / float(weight @ self.mean**2)
        if not self.first > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )

    def _to_axes(self, numbers: FloatArray) -> FloatArray:
        """Transform numbers (..., n) to the axes in which errors are independent and 1 and S is diagonal."""
        return np.concatenate(
            [numbers[..., part.places] @ part.axes.T for part in self._parts], axis=-1
        )

    def _correction(self, variance: FloatArray, over: FloatArray) -> FloatArray:
        """Return the inverse of 1 + t B' D^-1 B, shape (t, k, k), where D is the diagonal of 1 + t S.

        `variance`: t, shape (t,). `over`: 1 / D, shape (t, n).
        """
        between = self._between
        products = (between[:, None] * between).reshape(-1, between.shape[1])
        inner = (over @ products.T).reshape(len(over), len(between), len(between))
        return np.asarray(np.linalg.inv(np.eye(len(between)) + variance[:, None, None] * inner))

    def likelihood(self, sizes: FloatArray, departures: FloatArray) -> FloatArray:
        """Return the logarithm of the likelihood, shape (departures, sizes)."""
        variance = (departures[:, None] * sizes**2).ravel()
        diagonal = 1 + variance[:, None] * self._values
        if not len(self._between):
            residual = np.tile(self._y - sizes[:, None] * self._mean, (departures.size, 1))
            total = (np.log(diagonal) + residual**2 / diagonal).sum(axis=-1)
            return np.asarray(-0.5 * total).reshape(departures.size, sizes.size)
        over = 1 / diagonal
        inverse = self._correction(variance, over)
        size = np.broadcast_to(sizes, (departures.size, sizes.size)).ravel()
        # (y - s m)^2 / D, summed for all t at once: y^2 - 2 s y m + s^2 m^2
        terms = self._y * self._y, -2 * self._y * self._mean, self._mean * self._mean
        squares = over @ np.stack(terms, axis=1)
        powers = np.stack([np.ones_like(size), size, size**2], axis=1)
        between_y, between_mean = (
            over @ (self._between * numbers).T for numbers in (self._y, self._mean)
        )
        residual = between_y - size[:, None] * between_mean
        correction = np.einsum("ti,tij,tj->t", residual, inverse, residual)
        total = (squares * powers).sum(axis=1) - variance * correction
        determinant = np.log(diagonal).sum(axis=1) - np.linalg.slogdet(inverse)[1]
        return np.asarray(-0.5 * (determinant + total)).reshape(departures.size, sizes.size)

    def expected(self, fixed_size: float | None) -> float:
        """Return the posterior mean of the size for lambda = 1, or `fixed_size` if it is given."""
        sizes, weights = _weigh([self], np.ones(1), np.zeros((1, 1, 1)), fixed_size)
        return float(weights[0, 0] @ sizes)

    def _solve_in_axes(self, numbers: FloatArray, variance: FloatArray) -> FloatArray:
        """Return the inverse covariance times numbers (draws, n) in these axes; `variance`: t, (draws, 1)."""
        diagonal = 1 + variance * self._values
        without_between = numbers / diagonal
        if not len(self._between):
            return np.asarray(without_between)
        over = 1 / diagonal
        inverse = self._correction(variance[:, 0], over)
        factors = np.einsum("dij,dj->di", inverse, without_between @ self._between.T)
        return np.asarray(without_between - over * (variance * (factors @ self._between)))

    def solved(self, off: FloatArray, variance: FloatArray) -> FloatArray:
        """Return the inverse covariance of the numbers times `off`, (draws, n); `variance`: s^2 lambda, (draws, 1)."""
        in_axes = self._solve_in_axes(self._to_axes(off), variance)
        answer = np.empty_like(off)
        ends = np.cumsum([part.values.size for part in self._parts])[:-1]
        for part, block in zip(self._parts, np.split(in_axes, ends, axis=1), strict=True):
            answer[:, part.places] = block @ part.axes
        return answer

    def distance(self, size: float) -> float:
        """Return the squared distance of the numbers from the shape of this size: chi squared if the medium belongs."""
        off = (self._y - size * self._mean)[None]
        return float((off * self._solve_in_axes(off, np.full((1, 1), size**2))).sum())

    def horizontal(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Return alpha_x over alpha_z relative to this ratio in known media, and the standard error of its logarithm.

        By generalised least squares with one factor on the mean shape for each component; NaN if one component was not
        measured. If a factor is not positive, returns 0 and the relative error of the difference of both factors.
        """
        if is_x.all() or not is_x.any():
            return float("nan"), float("nan")
        design = np.stack([np.where(is_x, 0.0, self.mean), np.where(is_x, self.mean, 0.0)])
        in_axes = self._to_axes(design)
        weighted = self._solve_in_axes(in_axes, np.full((2, 1), size**2))
        covariance = np.linalg.pinv(weighted @ in_axes.T)
        z, x = (float(factor) for factor in covariance @ (weighted @ self._y))
        if min(z, x) <= 0:
            of_difference = covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]
            return 0.0, float(np.sqrt(max(of_difference, 0.0))) / abs(z - x)
        variance = (
            covariance[0, 0] / z**2 + covariance[1, 1] / x**2 - 2 * covariance[0, 1] / (z * x)
        )
        return x / z, float(np.sqrt(max(variance, 0.0)))

    def _precision_of_each(self, size: float) -> FloatArray:
        """Return the diagonal of the inverse covariance of the numbers, shape (n,)."""
        variance = np.full(1, size**2)
        over = 1 / (1 + variance[:, None] * self._values)
        inverse = self._correction(variance, over)[0]
        between_over = self._between * over
        diagonal = np.empty(self.y.size)
        start = 0
        for part in self._parts:
            stop = start + part.values.size
            between = between_over[:, start:stop] @ part.axes
            correction = np.einsum("in,ij,jn->n", between, inverse, between)
            without_between = over[0, start:stop] @ part.axes**2
            diagonal[part.places] = without_between - size**2 * correction
            start = stop
        return diagonal

    def farthest(self, pushes: Pushes, used: npt.NDArray[np.bool_], size: float) -> PushResidual:
        """Return the number that differs most, in units of its error, from its prediction by all other numbers."""
        variance = 1 / self._precision_of_each(size)  # of the prediction, and of the number
        residual = (self.y - size * self.mean)[None]
        off = self.solved(residual, np.full((1, 1), size**2))[0] * variance
        worst = int(np.argmax(np.abs(off) / np.sqrt(variance)))
        component, push = divmod(int(np.flatnonzero(used)[worst]), pushes.beta.size)
        beta_deg, gamma_deg = np.degrees(pushes.beta[push]), np.degrees(pushes.gamma[push])
        return PushResidual(
            float(beta_deg),
            float(gamma_deg),
            "zx"[component],
            float(self.y[worst]),
            float(self.y[worst] - off[worst]),
            float(np.sqrt(variance[worst])),
        )


class _EigenPart(NamedTuple):
    """Eigendecomposition of S for numbers that S and errors do not connect with others.

    `places`: indices of the numbers. `values`: eigenvalues of whitened S. `axes`: its eigenvectors in rows, times the
    whitening.
    """

    places: npt.NDArray[np.intp]
    values: FloatArray
    axes: FloatArray

    @classmethod
    def of(cls, places: npt.NDArray[np.intp], rest: FloatArray, whiten: FloatArray) -> _EigenPart:
        """Decompose S of the numbers at `places`, `rest`; `whiten`: `whitening` of all numbers."""
        if whiten.ndim == 1:
            factors = whiten[places]
            values, vectors = np.linalg.eigh(factors[:, None] * rest * factors)
            return cls(places, np.maximum(values, 0.0), np.ascontiguousarray(vectors.T * factors))
        matrix = whiten[np.ix_(places, places)]
        values, vectors = np.linalg.eigh(matrix @ rest @ matrix.T)
        return cls(places, np.maximum(values, 0.0), vectors.T @ matrix)


def _independent_parts(rest: _Blocks, errors: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Return the indices of numbers in two parts that neither S nor errors connect, or else in one part."""
    if len(rest.places) > 1 and not errors[np.ix_(*rest.places)].any():
        return [*rest.places]
    return [np.arange(len(errors))]


def whitening(errors: FloatArray) -> FloatArray:
    """Return the matrix that makes errors independent and 1; for independent errors its diagonal alone, shape (n,)."""
    variance = np.diag(errors)
    if np.count_nonzero(errors) == np.count_nonzero(variance):
        return 1 / np.sqrt(variance)
    return np.linalg.inv(np.linalg.cholesky(errors))


class PushResidual(NamedTuple):
    """One measured number of a push, and its prediction by the other pushes and the known shape, N/cm^3."""

    beta_deg: float
    gamma_deg: float
    component: str
    measured: float
    expected: float
    error: float


LEAST_VARIANCE = 1e-9
"""Least eigenvalue of a covariance that `root` keeps, relative to the largest."""


def root(covariance: FloatArray) -> FloatArray:
    """Return rows R with R.T @ R equal to a covariance: normal numbers times R have this covariance."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    keep = values > LEAST_VARIANCE * max(float(values[-1]), 1e-300)
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep])).T)


def _same_direction_or_mirror(
    beta: float, gamma: float, betas: FloatArray, gammas: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Return indices of directions equal to (beta, gamma), rad, or its mirror image, and the sign of alpha_x."""
    nodes, signs = [], []
    for image, sign in (((beta, gamma), 1.0), (mirror(beta, gamma), -1.0)):
        image_deg = np.degrees([float(angle) for angle in image])
        off_gamma_deg = (np.degrees(gammas) - image_deg[1] + 180) % 360 - 180
        is_near = same_direction(np.degrees(betas), off_gamma_deg, image_deg[0], 0.0, TOLERANCE_DEG)
        nodes.append(np.flatnonzero(is_near))
        signs.append(np.full(nodes[-1].size, sign))
    places, first_places = np.unique(np.concatenate(nodes), return_index=True)
    return places, np.concatenate(signs)[first_places]


@dataclass(frozen=True)
class Map(KnownMedium):
    """Alpha over all directions, estimated from pushes; returned by `estimate_map` and `scale`.

    Parameters
    ----------
    name : str
        Name of the medium.
    beta, gamma : numpy.ndarray, shape (n,)
        Nodes, rad; together with their mirror images they are a whole grid.
    draws : numpy.ndarray, shape (draws, 2, n)
        Draws of alpha, z and x, N/cm^3: media that agree with the pushes and take energy in every direction.
    measured : numpy.ndarray of bool, shape (n,)
        True for nodes that were pushed, whose alpha is the measured one.
    not_passive : float
        Share of the draws that were rejected, because the medium would give energy back.
    size : float
        Root mean square of alpha over the published grid, N/cm^3.
    distance : float
        Chi squared of the pushes about the shape.
    dof : int
        Degrees of freedom of `distance`; 0 for a single number, which determines the size alone.
    pushes : int
        Number of pushes.
    known_media : str
        Names of the media from whose shape the map is estimated.
    farthest : PushResidual or None
        The measured number that differs most from its prediction by the other pushes.
    horizontal : float
        Ratio of alpha_x to alpha_z over this ratio in the known media; NaN if one component was not measured.
    horizontal_off : float
        Distance of the logarithm of `horizontal` from 0, in standard deviations of media of the known shape.
    confidence : float
        Level of the intervals.
    given : Pushes or None
        The pushes, each direction once.
    lines : int or None
        Number of nodes, the first ones, from which pushes are planned; the others lie between their lines. None: all.
    bed_spread, model_error : float
        As in `Profile`.
    contacts : int
        Number of bodies whose measured forces were used.
    window : tuple of float
        Least and largest depth of the pushes, cm; 0 and infinity if they do not state it.

    Examples
    --------
    >>> import pandas as pd, rftfit
    >>> pushes = pd.DataFrame({"beta_deg": [0, 60], "gamma_deg": [90, 45],
    ...                        "alpha_z_N_per_cm3": [0.35, 0.2], "alpha_x_N_per_cm3": [0, 0.1]})
    >>> sand = rftfit.estimate_map(pushes)
    >>> forces = rftfit.predict(sand, rftfit.model_leg("c_leg"))
    """

    name: str
    beta: FloatArray
    gamma: FloatArray
    draws: FloatArray = field(repr=False)
    measured: npt.NDArray[np.bool_]
    not_passive: float
    size: float
    distance: float
    dof: int
    pushes: int
    known_media: str
    farthest: PushResidual | None = None
    horizontal: float = float("nan")
    horizontal_off: float = float("nan")
    confidence: float = 0.95
    given: Pushes | None = field(default=None, repr=False)
    lines: int | None = None
    bed_spread: float = USUAL_BED_SPREAD
    model_error: float = EPS
    contacts: int = 0
    window: tuple[float, float] = ANY_DEPTH

    @cached_property
    def alpha(self) -> FloatArray:
        """Mean of the draws, shape (2, n): z and x, N/cm^3."""
        return np.asarray(self.draws.mean(axis=0))

    @property
    def factor(self) -> FloatArray:
        """Deviations of the draws from alpha, scaled so that their products are its covariance, shape (draws, 2, n)."""
        return np.asarray((self.draws - self.alpha) / np.sqrt(len(self.draws) - 1))

    @property
    def measurements(self) -> str:
        """Text with the numbers of pushes and contacts from which the map was estimated."""
        counts = {"push": self.pushes, "contact": self.contacts}
        plural = {"push": "pushes", "contact": "contacts"}
        words = [
            f"1 {word}" if count == 1 else f"{count} {plural[word]}"
            for word, count in counts.items()
            if count
        ]
        return " and ".join(words or ["0 pushes"])

    @property
    def pushed(self) -> FloatArray:
        """Measured directions with alpha and errors, in the rows of `TableProfile.pushed`."""
        if self.given is None:
            return np.zeros((6, 0))
        angles, alpha = np.degrees([self.given.beta, self.given.gamma]), self.given.alpha
        se = np.sqrt(np.diag(self.given.covariance)).reshape(alpha.shape)
        return np.concatenate([angles, alpha, np.where(np.isnan(alpha), np.nan, se)])

    def work(self, alpha: FloatArray | None = None) -> FloatArray:
        """Return the energy that the medium takes at each node, per area, depth and distance moved, N/cm^3.

        Parameters
        ----------
        alpha : numpy.ndarray, shape (..., 2, n), optional
            Default: alpha of the map.

        Returns
        -------
        numpy.ndarray, shape (..., n)
        """
        return work(self.alpha if alpha is None else alpha, self.gamma)

    @property
    def belongs(self) -> float:
        """Probability that a medium of the known shape has pushes as far from it as these; NaN for a single number.

        Two tests count, the distance from the shape and the ratio of alpha_x to alpha_z: twice the smaller probability.
        """
        if not self.dof:
            return float("nan")
        from scipy.special import erfc, gammaincc

        chances = [float(gammaincc(self.dof / 2, self.distance / 2))]
        if not np.isnan(self.horizontal_off):
            chances.append(float(erfc(self.horizontal_off / np.sqrt(2))))
        return min(len(chances) * min(chances), 1.0)

    @property
    def profile(self) -> TableProfile:
        """Profile of the map, with its draws for intervals."""
        of = f" of {self.name}" if self.name else ""
        name = f"map{of} from {self.measurements} and the shape of {self.known_media}"
        profile = TableProfile(self.alpha[0], self.alpha[1], self.beta, self.gamma, name)
        profile.spread = TableProfile(self.draws[:, 0], self.draws[:, 1], self.beta, self.gamma)
        profile.bed_spread, profile.model_error = self.bed_spread, self.model_error
        profile.pushed, profile.window = self.pushed, self.window
        profile.form = "map"
        return profile

    def as_profile(self, is_enough: Callable[[Profile], bool] | None = None) -> Profile:  # noqa: ARG002
        """Return the profile of the map.

        Parameters
        ----------
        is_enough : callable, optional
            Not used: a map has a number in every direction.

        Returns
        -------
        Profile
        """
        return self.profile

    def export_source(self) -> tuple[KnownMedium, dict[str, Any]]:
        """Return the map itself, and its name.

        Returns
        -------
        source : KnownMedium
        facts : dict of str to object
            Arguments of `write_profile` by name.
        """
        return self, {"name": self.name}

    @property
    def zeta(self) -> tuple[float, float, float]:
        """Scaling factor of the nine terms fitted to the map (least squares), with its interval."""
        return self._with_ends(
            *(vertical_penetration(self.coefficients(alpha)) for alpha in (self.alpha, self.draws))
        )

    @property
    def chi(self) -> tuple[float, float, float]:
        """Ratio of alpha_z(0, 90 deg) of the map to `zeta`, with its interval."""
        straight_down = int(np.argmin(np.hypot(self.beta, self.gamma - np.pi / 2)))
        return self._with_ends(
            *(
                alpha[..., 0, straight_down] / vertical_penetration(self.coefficients(alpha))
                for alpha in (self.alpha, self.draws)
            )
        )

    def _with_ends(self, best: FloatArray, draws: FloatArray) -> tuple[float, float, float]:
        """Return a number with the ends of the interval from its draws."""
        lo, hi = interval(draws, self.confidence)
        return float(best), float(lo), float(hi)

    def coefficients(self, alpha: FloatArray | None = None) -> FloatArray:
        """Fit nine coefficients to the map by least squares.

        Parameters
        ----------
        alpha : numpy.ndarray, shape (..., 2, n), optional
            Default: alpha of the map.

        Returns
        -------
        numpy.ndarray, shape (..., 9)
            N/cm^3; 0 for the terms that the fit to alpha of the map does not keep.
        """
        keep = kept_terms(fit_lsq(self.beta, self.gamma, *self.alpha), PAPER_RULE)
        alpha = self.alpha if alpha is None else alpha
        return fit_lsq(self.beta, self.gamma, alpha[..., 0, :], alpha[..., 1, :], keep)

    def table(self) -> pd.DataFrame:
        """Return alpha at the nodes.

        Returns
        -------
        pandas.DataFrame
            ``beta_deg, gamma_deg``; ``alpha_z_N_per_cm3``, ``alpha_z_lo_N_per_cm3``,
            ``alpha_z_hi_N_per_cm3``, ``alpha_z_lo_next_N_per_cm3`` and ``alpha_z_hi_next_N_per_cm3`` (of a push in
            one further bed), and the same of ``alpha_x``; ``source``: measured or estimated.
        """
        return pd.DataFrame(self.columns())

    def columns(self) -> dict[str, npt.NDArray[np.generic]]:
        """Return the columns of `table`, without pandas.

        Returns
        -------
        dict of str to numpy.ndarray, shape (n,)
        """
        order = np.lexsort([self.gamma, self.beta])
        columns: dict[str, npt.NDArray[np.generic]] = {
            "beta_deg": np.degrees(self.beta[order]),
            "gamma_deg": np.degrees(self.gamma[order]),
        }
        # rounded, so that alpha that is 0 by symmetry has ends of exactly 0
        lo, hi = np.round(interval(self.draws, self.confidence), 12) + 0.0
        bed = half_width_of_bed(self.bed_spread, self.confidence) * np.abs(self.alpha)
        lo_next, hi_next = widen(self.alpha, (lo, hi), bed)
        values = {"": self.alpha, "_lo": lo, "_hi": hi, "_lo_next": lo_next, "_hi_next": hi_next}
        for place, component in enumerate("zx"):
            for quantity, node_values in values.items():
                columns[column(component, quantity)] = node_values[place, order]
        columns["source"] = np.where(self.measured[order], "measured", "estimated")
        return columns


LEAST_WORK = 0.02
"""Energy that a medium may give back, as a share of its largest alpha, and still counts as taking energy."""


def work(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the energy that a medium takes, per area, depth and distance moved, N/cm^3, shape (..., n).

    `alpha`: shape (..., 2, n). `gamma`: shape (n,), rad.
    """
    return alpha[..., 0, :] * np.sin(gamma) + alpha[..., 1, :] * np.cos(gamma)
