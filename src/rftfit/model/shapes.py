"""Alpha over all directions from any number of pushes, by the shape that granular media share.

Alpha over the angles has nearly the same shape in all dry granular media. The shape of known media is
taken as what is known beforehand, and every push corrects it:

    alpha = s (m + d),   d ~ N(0, lambda (C + (1 - w) K + w R)),   the medium takes energy everywhere

with the unknown size s of this medium, the mean shape m and the covariance C of the known media, and for how
a further medium may differ from them all a smooth covariance K and a rough one R. The pushes tell s, how far
the medium departs from the known shape (lambda) and how roughly (w). Draws of all of it are the map: their
mean is its number, their quantiles are its interval.

The known tables have lines 30 degrees apart in beta. Between them m has the course of 3D-RFT, fitted to nothing,
and C the differences of its frictions and the course itself: a further medium may have none of it, or twice.
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

SEED = 2013
"""Seed of the draws of a map behind its intervals."""


NOT_ALIKE = 0.03
"""A medium whose pushes lie so far from the shape by chance less often than this does not belong."""


class Variation(NamedTuple):
    """How far a further medium may differ from the known ones: amplitude and lengths of K and R.

    `floor`, `share`: standard deviation floor + share |m|, of a shape whose size is 1.
    `smooth`: part of the variance that is smooth (squared exponential); the rest is rough (Matern 3/2).
    `smooth_beta`, `smooth_gamma`, `rough_beta`, `rough_gamma`: their lengths, in (cos 2 beta, sin 2 beta)
        and in (cos gamma, sin gamma).
    `media`: the covariance of the known media is taken so many times.
    `own_beta`, `own_gamma`: lengths of R (Matern 3/2), whose standard deviation is the same everywhere: the
        root mean square of floor + share |m|.
    `most_own`: the share w of R is flat beforehand from 0 to this.
    `departure_dof`: lambda is inverse gamma beforehand with so many degrees of freedom and its mode at 1.
    `course_share`: standard deviation of the factor, 1 on average, by which a medium has the course of 3D-RFT
        between the lines of the published grid.
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


def _chosen() -> Variation:
    """The variation that was chosen on Table S5."""
    return Variation(**read_toml("reference", "shapes.toml"))


@dataclass(frozen=True)
class Shapes:
    """Known media, and how far a further one may differ from them.

    Parameters
    ----------
    profiles : dict of str to TableProfile
        Known media, without holes; at least two.
    variation : Variation, optional
        Default: as chosen on the published media.

    Examples
    --------
    >>> import rftfit
    >>> shapes = rftfit.published_shapes(without=["poppy_LP"])
    >>> len(shapes.profiles)
    4
    """

    profiles: dict[str, TableProfile]
    variation: Variation = field(default_factory=_chosen)

    def __post_init__(self) -> None:
        if len(self.profiles) < 2:
            raise ValueError(f"shapes need at least two known media, found {len(self.profiles)}")
        if holes := [name for name, profile in self.profiles.items() if profile.reason]:
            raise ValueError(f"a known medium has no holes; {', '.join(holes)} has")

    @property
    def name(self) -> str:
        """The known media, for people."""
        return ", ".join(self.profiles)

    @cached_property
    def horizontal_spread(self) -> tuple[float, float]:
        """Standard deviation of log(alpha_x over alpha_z): between known media, and what K allows it.

        Sizes as root mean squares over the published grid.
        """
        z, x = np.split(self.of_media(*_GRID), 2, axis=1)
        log_ratios = np.log(np.sqrt((x**2).mean(axis=1) / (z**2).mean(axis=1)))
        prior = self.prior(*_GRID)
        free = np.diag(prior.covariance(0.0)) > _CHOSEN.zero_variance
        exact = 1e-6 * np.abs(prior.mean).max() * np.eye(int(free.sum()))
        mean = prior.mean
        likelihood = _Likelihood(prior, np.flatnonzero(free), 0.0, mean[free], exact**2)
        allowed = likelihood.horizontal(np.arange(mean.size)[free] >= mean.size // 2, 1.0)[1]
        return float(log_ratios.std(ddof=1)) * np.sqrt(1 + 1 / log_ratios.size), allowed

    def horizontal_error(self, seen: float) -> float:
        """Standard deviation of log(alpha_x over alpha_z) of a medium that belongs.

        `seen`: of its estimate from some pushes, as far as K allows it.
        """
        known_spread, allowed = self.horizontal_spread
        return float(np.sqrt(known_spread**2 + max(seen**2 - allowed**2, 0.0)))

    @cached_property
    def levels(self) -> FloatArray:
        """alpha_z(0, 90 deg) of each known medium over its size, shape (media,)."""
        down = [profile.alpha(0.0, np.pi / 2)[0] for profile in self.profiles.values()]
        return np.array(down, dtype=float) / self._sizes

    @cached_property
    def _sizes(self) -> FloatArray:
        grids = [profile.alpha(*_GRID) for profile in self.profiles.values()]
        return np.asarray(np.sqrt(np.mean(np.square(grids), axis=(1, 2))))

    def of_media(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Alpha of each known medium over its size, shape (media, 2 n): z, then x.

        Bilinear between the lines of its table, with the course of 3D-RFT.
        """
        return self._with_course(beta, gamma, course_between_lines(beta, gamma).mean(axis=0))

    def _with_course(self, beta: FloatArray, gamma: FloatArray, course: FloatArray) -> FloatArray:
        """Alpha of each known medium over its size, with a course between the lines of its table."""
        tables = [np.concatenate(profile.alpha(beta, gamma)) for profile in self.profiles.values()]
        bilinear = np.stack(tables) / self._sizes[:, None]
        return bilinear + self.levels[:, None] * course

    @cached_property
    def _mean_on_grid(self) -> FloatArray:
        """Mean shape on the published grid."""
        return np.asarray(self.of_media(*_GRID).mean(axis=0))

    def slopes(self, beta_deg: FloatArray, gamma_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean shape of the known media, (2, n), and its change with beta and gamma, per degree, (2, n, 2).

        Of the slopes to either side the root mean square, with the sign of their sum: alpha has corners and tops.
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
        """What is known of a further medium of size 1 before a push, at directions of shape (n,)."""
        courses = course_between_lines(beta, gamma)
        media_shapes = self._with_course(beta, gamma, courses.mean(axis=0))
        mean, count, variation = media_shapes.mean(axis=0), len(media_shapes), self.variation
        between = (media_shapes - mean) * np.sqrt(variation.media * (1 + 1 / count) / (count - 1))
        # how a further medium runs between the lines: the frictions differ, and it may have less of a course or more
        courses = self.levels.mean() * courses
        course = courses.mean(axis=0)
        apart = (courses - course) / np.sqrt(len(courses) - 1)
        between = np.concatenate([between, apart, variation.course_share * course[None]])
        amplitude = variation.floor + variation.share * np.abs(mean)
        level = variation.floor + variation.share * np.abs(self._mean_on_grid)
        smooth = _alike(beta, gamma, partial(_smooth, variation))
        rough = _alike(beta, gamma, partial(_rough, variation))
        return _Prior(
            mean,
            between,
            smooth.changed(lambda at, k: np.outer(amplitude[at], amplitude[at]) * k),
            rough.changed(lambda _, r: np.mean(level**2) * r),
        )

    @property
    def tilt(self) -> float:
        """Exponent of the tilt: `TILT_SHARE` of that with which passive media of the prior have the mean effort of m."""
        return TILT_SHARE * self._full_tilt if TILT_SHARE else 0.0

    @cached_property
    def _full_tilt(self) -> float:
        variation, random = self.variation, np.random.default_rng(SEED)
        prior = self.prior(*_GRID)
        target_effort = float(mean_effort(prior.mean.reshape(1, 2, -1), _GRID)[0])
        half = variation.departure_dof / 2
        efforts = []
        for rough_share in np.linspace(0, variation.most_own, _CHOSEN.rough_shares):
            wide = (half + 1) / random.gamma(half, size=(_CHOSEN.tilt_draws, 1))
            normals = random.standard_normal((_CHOSEN.tilt_draws, prior.mean.size))
            drawn = prior.mean + np.sqrt(wide) * (normals @ _rows(prior.covariance(rough_share)))
            media = drawn.reshape(_CHOSEN.tilt_draws, 2, -1)
            largest = np.abs(media).max(axis=(1, 2))
            takes = _takes_energy(media, _GRID[1], largest, np.zeros(_GRID[0].size, dtype=bool))
            efforts.append(mean_effort(media[takes], _GRID))
        effort = np.concatenate(efforts)
        effort = effort[np.isfinite(effort)]

        def excess(exponent: float) -> float:
            weights = np.exp(-exponent * (effort - effort.min()))
            return float(weights @ effort / weights.sum()) - target_effort

        low, high = 0.0, _CHOSEN.most_tilt
        if excess(low) <= 0:
            return 0.0
        for _ in range(30):
            middle = (low + high) / 2
            low, high = (middle, high) if excess(middle) > 0 else (low, middle)
        return low

    def moments(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, shape (2 n,), and covariance, shape (2 n, 2 n), of a medium of size 1, lambda 1 and w 0."""
        prior = self.prior(beta, gamma)
        return prior.mean, prior.covariance(0.0)


SLOPE_STEP_DEG = 5.0
"""Range over which a slope of the mean shape is taken."""


class _Blocks(NamedTuple):
    """A symmetric matrix that is 0 but between the places of each block: the places, in their order, and the numbers.

    K and R of a thousand pushes take 27 MB so, for z and x, and 54 MB each as a whole.
    """

    places: tuple[npt.NDArray[np.intp], ...]
    squares: tuple[FloatArray, ...]

    def changed(self, change: Callable[[npt.NDArray[np.intp], FloatArray], FloatArray]) -> _Blocks:
        """The same with other numbers."""
        return _Blocks(self.places, tuple(map(change, self.places, self.squares)))

    def at(self, places: npt.NDArray[np.intp]) -> _Blocks:
        """The same of some of its places, in another order."""
        places_here, squares = [], []
        for of_block, square in zip(*self, strict=True):
            here = np.flatnonzero(np.isin(places, of_block))
            if here.size:
                rows = np.searchsorted(of_block, places[here])
                places_here.append(here)
                squares.append(square[np.ix_(rows, rows)])
        return _Blocks(tuple(places_here), tuple(squares))

    def whole(self) -> FloatArray:
        """The matrix as a whole."""
        matrix = np.zeros((sum(places.size for places in self.places),) * 2)
        self.add_to(matrix)
        return matrix

    def add_to(self, whole: FloatArray, factor: float = 1.0) -> None:
        """Add it so many times to a whole matrix."""
        for places, square in zip(*self, strict=True):
            whole[np.ix_(places, places)] += factor * square


class _Prior(NamedTuple):
    """Mean shape; rows whose products are C; K; R."""

    mean: FloatArray
    between: FloatArray
    smooth: _Blocks
    rough: _Blocks

    def at(self, places: npt.NDArray[np.intp]) -> _Prior:
        """The same of some of its numbers."""
        return _Prior(
            self.mean[places],
            self.between[:, places],
            self.smooth.at(places),
            self.rough.at(places),
        )

    def by_blocks(self, counts: Sequence[int]) -> _Prior:
        """The same in another order: z and x of the first directions, then of the next; `counts` of directions."""
        places = np.arange(self.mean.size).reshape(2, -1)
        ends = np.cumsum([0, *counts])
        blocks = [places[:, start:stop].ravel() for start, stop in pairwise(ends)]
        return self.at(np.concatenate(blocks))

    def with_rows(self, rows: ObservedRows, nodes: npt.NDArray[np.intp], place: int) -> _Prior:
        """The same with rows of contacts put in at a place; `nodes`: places of alpha at the nodes, z then x."""
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
        """C + (1 - w) K + w R, `rough_share`: w."""
        covariance = self.between.T @ self.between
        self.smooth.add_to(covariance, 1 - rough_share)
        self.rough.add_to(covariance, rough_share)
        return covariance


def _alike(
    beta: FloatArray, gamma: FloatArray, kernel: Callable[[FloatArray, FloatArray], FloatArray]
) -> _Blocks:
    """Correlation of functions on the torus of (2 beta, gamma) that have the symmetry of alpha.

    Of alpha_z the part that is even under the mirror, with a variance of 1 everywhere; of alpha_x the
    odd part, whose variance goes to 0 where a direction is its own mirror image.
    """

    def between(angles: Angles) -> FloatArray:
        # the chords between two points of each circle
        return kernel(
            2 * np.sin(beta[:, None] - angles[0]), 2 * np.sin((gamma[:, None] - angles[1]) / 2)
        )

    direct, turned = between((beta, gamma)), between(mirror(beta, gamma))
    size = np.sqrt(1 + np.diag(turned))
    even = (direct + turned) / size / size[:, None]
    places = np.arange(2 * beta.size)
    return _Blocks((places[: beta.size], places[beta.size :]), (even, direct - turned))


def _smooth(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Kernel of K over chords."""
    smooth = np.hypot(beta / variation.smooth_beta, gamma / variation.smooth_gamma)
    kernel: FloatArray = variation.smooth * np.exp(-(smooth**2) / 2)
    kernel += (1 - variation.smooth) * _matern(
        np.hypot(beta / variation.rough_beta, gamma / variation.rough_gamma)
    )
    return kernel


def _rough(variation: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Kernel of R over chords."""
    return _matern(np.hypot(beta / variation.own_beta, gamma / variation.own_gamma))


def _matern(distance: FloatArray) -> FloatArray:
    return np.asarray((1 + np.sqrt(3) * distance) * np.exp(-np.sqrt(3) * distance))


def published_shapes(without: Iterable[str] = ()) -> Shapes:
    """The five media of Table S5 as known shapes.

    Parameters
    ----------
    without : iterable of str, optional
        Media that are left out: that of the pushes itself, to see what they alone would give.

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
    """Map of a published medium from all its directions, the known media without itself."""
    table = load("table_s5")
    pushes = table[table["medium"] == medium]
    return estimate_map(pushes, published_shapes([medium]), name=medium)


@cache
def _published_shapes(left_out: frozenset[str]) -> Shapes:
    return Shapes({name: TableProfile.published(name) for name in MEDIA if name not in left_out})


def grid(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Angles:
    """Nodes of a map: the published grid of 7 x 13 directions with more lines, rad, shape (n,)."""

    def lines(published: FloatArray, extra_lines: npt.ArrayLike) -> FloatArray:
        new = np.asarray(extra_lines, dtype=float).ravel()
        near = np.abs(new[:, None] - published).min(axis=1, initial=np.inf) <= TOLERANCE_DEG
        every: FloatArray = np.unique(np.concatenate([published, new[~near]]))
        return np.radians(every)

    # a plate at -90 degrees is the one at 90
    mesh = np.meshgrid(lines(BETA_DEG[1:], beta_deg), lines(GAMMA_DEG, gamma_deg), indexing="ij")
    return mesh[0].ravel(), mesh[1].ravel()


class Nodes(NamedTuple):
    """Nodes of a map, rad, shape (n,); a push can be planned in the first `lines` of them."""

    beta: FloatArray
    gamma: FloatArray
    lines: int


def map_nodes(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Nodes:
    """Nodes of `grid`, in which a push can be planned, then those of finer lines between them.

    The finer lines are `STEP_DEG` apart in beta, and the middles of the published gammas.
    """
    lines = grid(beta_deg, gamma_deg)
    steps = np.arange(-90 + STEP_DEG, 90, STEP_DEG)
    middles = (GAMMA_DEG[1:] + GAMMA_DEG[:-1]) / 2
    more_beta = np.concatenate([steps, np.asarray(beta_deg, dtype=float).ravel()])
    more_gamma = np.concatenate([middles, np.asarray(gamma_deg, dtype=float).ravel()])
    every = np.stack(grid(more_beta, more_gamma), axis=1)
    apart = np.abs(every[:, None] - np.stack(lines, axis=1)).max(axis=-1).min(axis=1)
    between = every[apart > 1e-9]
    beta, gamma = (
        np.concatenate([on_lines, fine]) for on_lines, fine in zip(lines, between.T, strict=True)
    )
    return Nodes(beta, gamma, lines[0].size)


STEP_DEG = 15.0
"""Lines of a map in beta: calibrated on the legs of Fig. S5 (docs/theory/map.md)."""

_GRID = grid()

FRICTIONS = (0.2, 0.4, 0.8)
"""Frictions of 3D-RFT whose mean is the course between the lines of the published grid."""


def course_between_lines(beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """3D-RFT less what is bilinear between its values on the published grid, shape (frictions, 2 n): z, then x.

    Of media whose alpha_z(0, 90 deg) is 1; 0 on the published grid.
    """
    return np.stack([_law_less_its_lines(friction, beta, gamma) for friction in FRICTIONS])


def _law_less_its_lines(friction: float, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """3D-RFT at a friction less what its values on the published grid give between them, shape (2 n,): z, then x."""
    image = mirror(beta, gamma)
    # a plate at 90 degrees is the one at -90
    law_here, law_at_mirror = (
        alpha_3drft(wrap_beta(angles[0]), angles[1], friction) for angles in ((beta, gamma), image)
    )
    law = np.concatenate(
        [(law_here[0] + law_at_mirror[0]) / 2, (law_here[1] - law_at_mirror[1]) / 2]
    )
    return law - np.concatenate(_law_on_lines(friction).alpha(beta, gamma))


@cache
def _law_on_lines(friction: float) -> TableProfile:
    return TableProfile(*alpha_3drft(*_GRID, friction), *_GRID)


class Pushes(NamedTuple):
    """What was measured.

    `beta`, `gamma`: shape (n,), rad. `alpha`: shape (2, n); z and x, N/cm^3, NaN where not measured.
    `covariance`: of their errors, shape (2 n, 2 n), z first.
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
        """Pushes whose errors are independent; NaN: not known, then as large as is usual.

        `alpha`, `se`: shape (2, n), N/cm^3.
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
"""Error of a push of which none is stated: of its own alpha (from bed to bed) and of the largest."""


def usual_error(
    alpha: FloatArray, percent: float = USUAL_PERCENT, least_percent: float = LEAST_PERCENT
) -> FloatArray:
    """Standard error of pushes of which none is known, N/cm^3."""
    largest = float(np.nanmax(np.abs(alpha), initial=0.0))
    return np.hypot(percent / 100 * alpha, least_percent / 100 * largest)


def sorted_pushes(pushes: Columns) -> Pushes:
    """Pushes of a table as `estimate_map` takes it; the order of its rows makes no difference."""
    angles_deg, alpha, se = _numbers_of(pushes)
    order = np.lexsort([alpha[1], alpha[0], angles_deg[1], angles_deg[0]])
    beta_deg, gamma_deg = angles_deg[:, order]
    return Pushes.of(beta_deg, gamma_deg, alpha[:, order], se[:, order])


def _numbers_of(pushes: Columns) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angles, deg, alpha and standard errors, N/cm^3, of a table of pushes, each of shape (2, n); NaN: not stated."""
    names = {name: column.name for column in ALPHA.columns for name in column.also}
    columns = {names.get(str(name), str(name)): pushes[name] for name in pushes}
    if len(columns) < len([*pushes]):
        raise InputError(
            f"pushes: two columns have one meaning; found: {', '.join(map(str, pushes))}"
        )
    if missing := {"beta_deg", "gamma_deg", column("z")} - {*columns}:
        raise InputError(
            f"pushes: no column {', '.join(sorted(missing))}; found: {', '.join(columns)}"
        )
    nothing = np.full(np.size(columns["beta_deg"]), np.nan)

    def numbers(*names: str) -> FloatArray:
        return np.stack([np.atleast_1d(columns.get(name, nothing)).astype(float) for name in names])

    return (
        numbers("beta_deg", "gamma_deg"),
        numbers(column("z"), column("x")),
        numbers("se_z", "se_x"),
    )


def push_straight_down(pushes: Columns, confidence: float) -> tuple[float, float] | None:
    """Find alpha_z(0, 90 deg) among pushes, and its standard error, N/cm^3; None where no plate was pushed straight down.

    The error of one push is the stated one, and 0 where none is. Of several it is that of their mean, as the map takes it.
    """
    angles_deg, alpha, se = _numbers_of(pushes)
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
        One row a push: ``beta_deg, gamma_deg``, ``alpha_z_N_per_cm3`` and, where it was measured,
        ``alpha_x_N_per_cm3``; their standard errors ``se_z``, ``se_x``: where there is none it is taken for
        5 % of alpha and 1 % of the largest. Pushes of one direction that differ by more have the error that their own
        scatter shows, and the next bed differs as much. ``depth_from_cm, depth_to_cm``: least and largest depth behind alpha;
        predictions that go deeper have a warning. The columns have any name that ``rftfit scale --pushes`` takes.
    shapes : Shapes, optional
        What is known beforehand; default: the five published media.
    confidence : float, optional
        Level of the intervals.
    name : str, optional
        Of the medium, for people.
    contacts : sequence of Contact, optional
        Measured forces on bodies that moved through this medium.
    beta_deg, gamma_deg : array_like, optional
        Lines of the map's grid beside those of the published one, degrees.

    Returns
    -------
    Map

    Raises
    ------
    ValueError
        If there is neither push nor contact, no push has a number that tells of the medium, or they meet no
        resistance.

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

    It is `estimate_map` of a table with this push, as ``rftfit scale --alpha`` and ``rftfit predict --alpha`` make it.

    Parameters
    ----------
    alpha : float
        Slope of stress over depth of a horizontal plate pushed straight down, alpha_z(0, 90 deg),
        N/cm^3.
    se : float, optional
        Its standard error, N/cm^3; default: the usual 5 % from bed to bed.
    shapes : Shapes, optional
        Known media whose shape the medium has: those of a campaign (`Results.shapes`); default: the five
        published ones.
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
    """Columns of a table with one push, straight down; an `se` that is not known has no number."""
    columns = {"beta_deg": [0.0], "gamma_deg": [90.0], column("z"): [alpha]}
    return columns | {column("z", "_se"): [np.nan if se is None else se]}


def describe_push(alpha: float, se: float | None) -> str:
    """Write what one push straight down was."""
    error = "" if se is None else f" (se {se:g})"
    return f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3{error}"


def pushes_of(table: pd.DataFrame, config: Config) -> Pushes:
    """The cells of an alpha table as pushes, with their errors and what these share."""
    beta_deg = table["beta_deg"].to_numpy(float)
    alpha = np.stack(alpha_columns(table))
    if config.fit.flagged == "leave_out":
        alpha = np.where(flagged(table), np.nan, alpha)
    # a plate at -90 degrees is the one at 90
    twice = (beta_deg == -90) & table["gamma_deg"].isin(table.loc[beta_deg == 90, "gamma_deg"])
    use = np.isfinite(alpha).any(axis=0) & ~twice.to_numpy(bool)
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
    """Yield the pushes of each direction and its mirror image, and the signs of z and x, shape (2, n), beside the first."""
    is_left = np.ones(pushes.beta.size, dtype=bool)
    for push in range(pushes.beta.size):
        if is_left[push]:
            same_pushes, turned = _same_direction_or_mirror(
                pushes.beta[push], pushes.gamma[push], pushes.beta, pushes.gamma
            )
            # within the tolerance of two directions a push counts for the first one alone
            is_new = is_left[same_pushes]
            same_pushes, turned = same_pushes[is_new], turned[is_new]
            is_left[same_pushes] = False
            yield same_pushes, np.stack([np.ones(same_pushes.size), turned])


class _Repeats(NamedTuple):
    """One component of the pushes of a direction.

    `places`: of its numbers in `Pushes.covariance`. `alpha`: shape (n,), N/cm^3, each with the sign of the first push.
    """

    places: npt.NDArray[np.intp]
    alpha: FloatArray


def _repeats_of(pushes: Pushes) -> Iterator[_Repeats]:
    """Yield the components that two pushes of a direction or more have."""
    for same_pushes, signs in _by_direction(pushes):
        for component, alpha in enumerate(signs * pushes.alpha[:, same_pushes]):
            is_known = np.isfinite(alpha)
            if np.count_nonzero(is_known) > 1:
                places = component * pushes.beta.size + same_pushes[is_known]
                yield _Repeats(places, alpha[is_known])


def with_scatter_of_repeats(pushes: Pushes, confidence: float) -> Pushes:
    """Give pushes of one direction the error that their scatter shows, as the runs of a campaign have it.

    Pushes of which no error is stated have that of `spread_of_beds`; others have the one that they show where they differ by more
    than their errors explain. Few pushes tell it poorly, so that it is the normal error whose interval is as wide as Student's.
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
            of_one_bed = spread.error_at(mean_alpha, component)
            share = np.full(alpha.size, 1 / alpha.size)
            bed = bed_of_mean(alpha, share, Part(0.0), of_one_bed, spread.source)[1]
            variance[places] = alpha.size * _normal_error(bed, confidence) ** 2
            continue
        shown = scatter_of_runs(alpha)
        if shown.sd**2 / alpha.size > 1 / np.sum(1 / np.maximum(variance[places], 1e-300)):
            variance[places] = _normal_error(shown, confidence) ** 2
    if np.array_equal(variance, np.diag(pushes.covariance)):
        return pushes
    return pushes._replace(covariance=np.diag(variance))


def bed_spread_of_repeats(pushes: Pushes, confidence: float) -> float:
    """Relative standard deviation of a further bed: the usual one, or what pushes of one direction show if it is larger.

    Of directions and components the mean square, each counts by its pushes and by its force.
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
    """Standard deviation of a normal error whose interval is as wide as that of `error`."""
    return combined_half_width([error], confidence) / half_width_of_bed(1.0, confidence)


def merged(pushes: Pushes) -> Pushes:
    """Each direction once: repeated pushes are one, weighted with their errors."""
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
    lost = np.isnan(share[starts]).reshape(2, -1)
    share = np.nan_to_num(share)
    known_alpha = np.where(is_known, pushes.alpha.ravel(), 0.0)
    alpha = np.add.reduceat(share * known_alpha[places], starts).reshape(2, -1)
    # of a thousand pushes each product would be another 32 MB
    spread = covariance[np.ix_(places, places)]
    spread *= share[:, None]
    spread *= share
    if starts.size < places.size:
        spread = np.add.reduceat(np.add.reduceat(spread, starts, axis=0), starts, axis=1)
    return Pushes(
        pushes.beta[first_pushes], pushes.gamma[first_pushes], np.where(lost, np.nan, alpha), spread
    )


def nodes_of(table: pd.DataFrame) -> Nodes:
    """Nodes of a medium's map, with the lines of its own grid where it has one."""
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
    """Estimate alpha over all directions from what was pushed: `estimate_map` with errors that are known.

    `nodes`: of the map, all on lines of a grid; default: `map_nodes`. `size`: root mean square of alpha over the
    published grid, N/cm^3, where it is known.
    """
    shapes = shapes or published_shapes()
    nodes = nodes or map_nodes()
    push_count = int(np.isfinite(pushes.alpha).any(axis=0).sum())
    pushes = merged(pushes) if pushes.beta.size else pushes
    # pushes, then nodes of the published grid, then the others: most draws end at the second
    on_grid = _on_published_grid((nodes.beta, nodes.gamma))
    order = np.concatenate([np.flatnonzero(on_grid), np.flatnonzero(~on_grid)])
    count, coarse = pushes.beta.size, int(on_grid.sum())
    prior = shapes.prior(
        *(
            np.concatenate([made_at, at_nodes[order]])
            for made_at, at_nodes in ((pushes.beta, nodes.beta), (pushes.gamma, nodes.gamma))
        )
    ).by_blocks((count, coarse, nodes.beta.size - coarse))
    seen = np.arange(2 * count)
    y, errors = pushes.alpha.ravel(), pushes.covariance
    smooth_variance = np.empty(prior.mean.size)
    for places, square in zip(*prior.smooth, strict=True):
        smooth_variance[places] = np.diag(square)
    # symmetry leaves some numbers no freedom: they tell nothing of the medium
    used = (
        np.isfinite(y)
        & np.isfinite(np.diag(errors))
        & (smooth_variance[seen] > _CHOSEN.zero_variance)
    )
    if not (used.any() or contacts):
        raise ValueError("no push has a number that tells of the medium")
    sorted_nodes = nodes.beta[order], nodes.gamma[order]
    # of a thousand pushes a copy of their errors is 32 MB
    used_errors = errors if used.all() else errors[np.ix_(used, used)]
    given = _Seen(prior, seen[used], y[used], used_errors)
    of_pushes = given
    if contacts:
        places = _places_of_nodes(count, coarse, nodes.beta.size)
        given = _with_contacts(given, contacts, sorted_nodes, places, size)
    posterior = _Posterior(*given, shapes.variation, size)
    pushed_nodes = _PushedNodes(sorted_nodes, pushes, used)
    drawn, share = posterior.draws(sorted_nodes, coarse, pushed_nodes, pushes, used, shapes.tilt)
    back = np.argsort(order)
    draws, measured = drawn[..., back], pushed_nodes.measured[back]
    usual = posterior.given[0]
    expected = usual.expected(size)
    farthest = None
    horizontal, seen_error = float("nan"), float("nan")
    if used.any():
        plates = _likelihood_of(of_pushes) if contacts else usual
        horizontal, seen_error = plates.horizontal(
            np.flatnonzero(used) >= pushes.beta.size, expected
        )
        farthest = plates.farthest(pushes, used, expected)
    # without both components there is nothing to compare
    off = float("nan")
    if horizontal == 0:
        off = 1 / seen_error
    elif horizontal > 0:
        off = abs(np.log(horizontal)) / shapes.horizontal_error(seen_error)
    return Map(
        name,
        nodes.beta,
        nodes.gamma,
        draws,
        measured,
        share,
        expected,
        usual.distance(expected),
        given.y.size - 1,
        push_count,
        shapes.name,
        farthest,
        horizontal,
        float(off),
        confidence,
        pushes,
        nodes.lines,
        contacts=len(contacts),
    )


class _Seen(NamedTuple):
    """Prior, places in it of the numbers that were measured, the numbers and the covariance of their errors."""

    prior: _Prior
    seen: npt.NDArray[np.intp]
    y: FloatArray
    errors: FloatArray


def _places_of_nodes(pushes: int, coarse: int, count: int) -> npt.NDArray[np.intp]:
    """Places in a prior of alpha at the sorted nodes, z then x: its blocks are pushes, published grid, others."""
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
    given: _Seen,
    contacts: Sequence[Observation],
    nodes: Angles,
    places: npt.NDArray[np.intp],
    size: float | None,
) -> _Seen:
    """Put the rows of contacts behind those of the pushes.

    The model's error grows with the medium, whose size these rows tell: both are found in turn.
    """
    prior = given.prior
    # as rough as a medium may be: no combination that could tell of it is left out
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
        count, added = len(given.y), len(rows.values)
        errors = np.zeros((count + added,) * 2)
        errors[:count, :count] = given.errors
        errors[count:, count:] = np.diag(rows.errors**2)
        both = _Seen(
            prior.with_rows(rows, places, place),
            np.concatenate([given.seen, place + np.arange(added)]),
            np.concatenate([given.y, rows.values]),
            errors,
        )
        before, size_now = size_now, _likelihood_of(both).expected(size)
        if abs(size_now - before) < _CHOSEN.same_size * before:
            break
    return both


def _likelihood_of(given: _Seen) -> _Likelihood:
    """Likelihood of the numbers in a medium that departs as the known ones do."""
    return _Likelihood(given.prior, given.seen, 0.0, given.y, _rounded(given.errors, given.y))


def _rounded(errors: FloatArray, y: FloatArray) -> FloatArray:
    """Covariance of errors with that of rounding, which exact numbers have too."""
    scale = float(np.abs(y).max()) or 1.0
    rounded = errors.copy()
    rounded[np.diag_indices(y.size)] += (1e-6 * scale) ** 2
    return rounded


def _on_published_grid(nodes: Angles) -> npt.NDArray[np.bool_]:
    off = [
        np.abs(map_angles[:, None] - published).min(axis=1)
        for map_angles, published in zip(
            nodes, (np.unique(_GRID[0]), np.unique(_GRID[1])), strict=True
        )
    ]
    return np.asarray(np.maximum(*off) < 1e-9)


TILT_SHARE = 1.0
"""Share of the full tilt: decided on natural sands and on exact laws (docs/theory/map.md)."""


_DEPARTURES = np.exp(0.28 * np.arange(-4, 12))
"""Values of lambda: beyond them lies 0.1 % of what is known of it beforehand."""


class _PushedNodes:
    """Nodes of the map that were pushed: each keeps its measured value and the error of that value."""

    def __init__(self, nodes: Angles, pushes: Pushes, used: npt.NDArray[np.bool_]) -> None:
        count, every = nodes[0].size, pushes.beta.size
        self.measured = np.zeros(count, dtype=bool)
        places, rows, signs = [], [], []
        # numbers of the pushes that tell of the medium, in their order
        place = np.cumsum(used) - 1
        for push, (beta, gamma) in enumerate(zip(pushes.beta, pushes.gamma, strict=True)):
            nodes_pushed, turned = _same_direction_or_mirror(beta, gamma, *nodes)
            if not used[push]:  # without a vertical component it is no cell
                continue
            self.measured[nodes_pushed] = True
            for component, sign in enumerate((np.ones(nodes_pushed.size), turned)):
                if used[row := component * every + push]:
                    places.append(component * count + nodes_pushed)
                    rows.append(np.full(nodes_pushed.size, place[row]))
                    signs.append(sign)
        self.places = np.concatenate([np.zeros(0, int), *places])
        self.rows = np.concatenate([np.zeros(0, int), *rows])
        self.signs = np.concatenate([np.zeros(0), *signs])

    def put(self, into: FloatArray, numbers: FloatArray) -> None:
        """Numbers of the pushes, shape (..., pushes), into those of the nodes, shape (..., 2 n)."""
        into[..., self.places] = self.signs * numbers[..., self.rows]


class _Posterior:
    """What pushes tell of a medium: its size, its departure lambda and the share w of R, on a grid.

    The prior has blocks: pushes, nodes of the published grid, other nodes; of each z, then x. `seen`: places of the
    numbers y in it.
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
        rounded = _rounded(errors, y)
        self._noise = (
            np.sqrt(np.diag(rounded))
            if whitening(rounded).ndim == 1
            else np.linalg.cholesky(rounded).T
        )
        self.given = [
            _Likelihood(prior, seen, rough_share, y, rounded) for rough_share in self.rough_shares
        ]
        self._made: dict[int, tuple[npt.NDArray[np.float32], FloatArray]] = {}
        half = variation.departure_dof / 2
        before = -half * np.log(_DEPARTURES) - (half + 1) / _DEPARTURES
        ends = np.where(
            np.isin(np.arange(_CHOSEN.rough_shares), (0, _CHOSEN.rough_shares - 1)), 0.5, 1.0
        )
        beforehand = np.log(ends)[:, None, None] + before[:, None]
        self.sizes, self.weights = _weighed(self.given, _DEPARTURES, beforehand, size)

    def _root_and_towards(self, place: int) -> tuple[npt.NDArray[np.float32], FloatArray]:
        """Rows whose products are the covariance of one w, and its part towards the measured numbers.

        Most values of w are never drawn where many pushes were made.
        """
        if place not in self._made:
            covariance = self.prior.covariance(float(self.rough_shares[place]))
            towards = covariance[self.seen, self._first_node :]
            # seven digits of what is random are enough
            self._made[place] = _rows(covariance).astype(np.float32, order="F"), towards
        return self._made[place]

    def draws(
        self,
        nodes: Angles,
        coarse: int,
        pushed_nodes: _PushedNodes,
        pushes: Pushes,
        used: npt.NDArray[np.bool_],
        tilt: float,
    ) -> tuple[FloatArray, float]:
        """Draws of alpha at the nodes, shape (draws, 2, n), and the share left out as they give energy back.

        `coarse`: how many of the nodes, the first, are of the published grid. A draw that gives energy back there is left
        out; of the others each is kept with the probability exp(-tilt T), T its mean work over alpha_z(0, 90 deg)
        there, less the least T of the first draws. Between the lines a draw is made until it takes energy, at most
        `most_completed` times.
        """
        random = np.random.default_rng(SEED)
        some = nodes[0][:coarse], nodes[1][:coarse]
        kept_there = _PushedNodes(some, pushes, used)
        place_count = self.prior.mean.size - 2 * (nodes[0].size - coarse)
        draws_kept: list[FloatArray] = []
        tried = passive = completed = 0
        least = np.nan
        while tried < _CHOSEN.most_drawn and completed < DRAWS:
            batch = self._draw_sizes_and_pull(place_count, random)
            draws = self._nodes(batch, slice(place_count - 2 * coarse, place_count))
            # of the medium itself: the error of a push is not of its shape
            efforts = mean_effort(draws, some)
            kept_there.put(draws.reshape(len(draws), -1), self.y - batch.noise)
            largest = np.abs(draws).max(axis=(1, 2))
            takes = _takes_energy(draws, some[1], largest, kept_there.measured)
            tried, passive = tried + 1, passive + int(takes.sum())
            chosen = np.flatnonzero(takes)
            if tilt:
                chosen = chosen[np.isfinite(efforts[chosen])]
            if tilt and chosen.size:
                effort = efforts[chosen]
                least = float(effort.min()) if np.isnan(least) else least
                chance = np.exp(-tilt * np.maximum(effort - least, 0.0))
                chosen = chosen[random.random(chance.size) < chance]
            # of a thousand pushes the draws that are left out would be another 40 MB
            batch, draws = batch.of(chosen), draws[chosen]
            alpha = self._between(batch, draws, nodes, pushed_nodes, random)
            completed += len(alpha)
            draws_kept.append(alpha)
        share = 1 - passive / (tried * DRAWS)
        if completed < _CHOSEN.fewest_draws:
            raise ValueError(
                f"in {share:.1%} of the draws the medium would push the plate along where it was not pushed: check the "
                "signs of alpha and the angles"
            )
        drawn = np.concatenate(draws_kept)[:DRAWS]
        # of what was measured the mean is the number itself
        flat = drawn.reshape(len(drawn), -1)
        centre = flat.mean(axis=0)
        pushed_nodes.put(centre, self.y)
        flat += centre - flat.mean(axis=0)
        return drawn, share

    def _draw_sizes_and_pull(self, place_count: int, random: np.random.Generator) -> _Batch:
        """Draw size, departure and roughness, and the pull of the pushes on the shape, for all draws.

        Matheron's rule: a medium and errors are drawn from the prior, the pushes are calculated that they would give,
        and the draw is corrected by the difference from the measured pushes (the pull).
        """
        where = (np.arange(DRAWS) + random.random()) / DRAWS
        chosen = np.searchsorted(np.cumsum(self.weights.ravel())[:-1], random.permutation(where))
        share_index, departure, size = np.unravel_index(chosen, self.weights.shape)
        s, wide = self.sizes[size][:, None], _DEPARTURES[departure][:, None]
        shares_drawn = np.unique(share_index).tolist()
        for place in shares_drawn:
            # before the arrays of the draws, which would add to the memory that it takes for a moment
            self._root_and_towards(place)
        noise = random.standard_normal((DRAWS, self.y.size))
        if self._noise.ndim == 1:
            noise *= self._noise
        else:
            noise = noise @ self._noise
        normals = random.standard_normal((DRAWS, place_count), np.float32)
        pull = np.empty((DRAWS, self.y.size))
        variance = s**2 * wide
        for place in shares_drawn:
            # a root is triangular: the first places need the first normal numbers only
            root = self._root_and_towards(place)[0][: self.seen[-1] + 1, _as_slice(self.seen)]
            of_share = np.flatnonzero(share_index == place)
            blocks = -(-of_share.size * self.y.size // _CHOSEN.numbers_at_once)
            for block in np.array_split(of_share, blocks):
                shape = self.prior.mean[self.seen] + np.sqrt(wide[block]) * (
                    normals[block, : len(root)] @ root
                )
                off = self.y - s[block] * shape - noise[block]
                pull[block] = variance[block] * self.given[place].solved(off, variance[block])
        return _Batch(share_index, s, wide, normals, pull, noise)

    def _between(
        self,
        batch: _Batch,
        draws: FloatArray,
        nodes: Angles,
        pushed_nodes: _PushedNodes,
        random: np.random.Generator,
    ) -> FloatArray:
        """Complete draws at the nodes of the published grid (draws, 2, n) by the nodes between its lines.

        Beside a push that gives energy back, as errors may make it, no completion takes energy: then the last one stays.
        """
        place_count, size = batch.normals.shape[1], self.prior.mean.size
        if place_count == size:
            return draws
        between = slice(place_count, size)
        largest = np.abs(draws).max(axis=(1, 2), initial=0.0)
        # what the numbers on the lines make those between them, without what they leave open
        expected = self._nodes(batch, between)
        alpha = np.empty((len(draws), 2, nodes[0].size))
        unfinished = np.arange(len(draws))
        for _ in range(_CHOSEN.most_completed):
            if not unfinished.size:
                break
            normals = random.standard_normal((unfinished.size, size - place_count), np.float32)
            completed = expected[unfinished] + self._left_open(batch, unfinished, normals, between)
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

    def _nodes(self, batch: _Batch, places: slice) -> FloatArray:
        """Alpha in some places of the prior as far as the normal numbers of a batch reach, shape (draws, 2, n)."""
        reach = min(places.stop, batch.normals.shape[1])
        alpha = np.empty((len(batch.share_index), places.stop - places.start))
        for place in np.unique(batch.share_index).tolist():
            of_share = batch.share_index == place
            root, towards = self._root_and_towards(place)
            drawn = batch.normals[of_share, :reach] @ root[:reach, places]
            shape = self.prior.mean[places] + np.sqrt(batch.wide[of_share]) * drawn
            pulled = (
                batch.pull[of_share]
                @ towards[:, places.start - self._first_node : places.stop - self._first_node]
            )
            alpha[of_share] = batch.s[of_share] * shape + pulled
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)

    def _left_open(
        self,
        batch: _Batch,
        unfinished: npt.NDArray[np.intp],
        normals: npt.NDArray[np.float32],
        places: slice,
    ) -> FloatArray:
        """Part of alpha in the last places of the prior that the numbers before them leave open, shape (draws, 2, n)."""
        alpha = np.empty((unfinished.size, places.stop - places.start))
        share_index = batch.share_index[unfinished]
        spread = batch.s[unfinished] * np.sqrt(batch.wide[unfinished])
        for place in np.unique(share_index).tolist():
            of_share, root = share_index == place, self._root_and_towards(place)[0]
            # turned, as the root lies in memory: of few draws half the time
            drawn = (root[places, places].T @ normals[of_share].T).T
            alpha[of_share] = spread[of_share] * drawn
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)


def _as_slice(places: npt.NDArray[np.intp]) -> npt.NDArray[np.intp] | slice:
    """Neighbours as a slice, which takes no copy: of a thousand pushes 16 MB."""
    is_row = places.size and np.array_equal(places, np.arange(places[0], places[0] + places.size))
    return slice(places[0], places[-1] + 1) if is_row else places


class _Batch(NamedTuple):
    """Draws that are not finished: place of w, size s, lambda, normal numbers, correction by the pushes, their errors."""

    share_index: npt.NDArray[np.intp]
    s: FloatArray
    wide: FloatArray
    normals: npt.NDArray[np.float32]
    pull: FloatArray
    noise: FloatArray

    def of(self, chosen: npt.NDArray[np.intp]) -> _Batch:
        """Some of the draws."""
        return _Batch._make(values[chosen] for values in self)


def _takes_energy(
    draws: FloatArray, gamma: FloatArray, largest: FloatArray, measured: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Whether each of some media takes energy in every direction that was not pushed; `largest`: alpha of each."""
    takes = (work(draws, gamma) >= -LEAST_WORK * largest[:, None]) | measured
    return np.asarray(takes.all(axis=-1))


def mean_effort(alpha: FloatArray, nodes: Angles) -> FloatArray:
    """Mean work over the nodes, over alpha_z(0, 90 deg), of media (draws, 2, n) at nodes of the published grid.

    Infinite where a medium does not resist a plate that is pushed straight down.
    """
    down = np.argmin(np.abs(nodes[0]) + np.abs(nodes[1] - np.pi / 2))
    level = alpha[:, 0, down]
    resists = level > 0
    effort = work(alpha, nodes[1]).mean(axis=-1) / np.where(resists, level, 1.0)
    return np.where(resists, effort, np.inf)


def _rows(covariance: FloatArray) -> FloatArray:
    """Rows whose products are a covariance, whose diagonal it lifts; what has no variance is exactly 0."""
    variance = np.diag(covariance).copy()
    covariance[np.diag_indices(variance.size)] += _CHOSEN.zero_variance * variance.max()
    if variance.size < _CHOSEN.many_numbers:
        rows = np.linalg.cholesky(covariance).T
    else:
        # in the place of the covariance: numpy makes two copies, of a thousand pushes 54 MB each
        from scipy.linalg import cholesky

        rows = cholesky(covariance.T, lower=True, overwrite_a=True, check_finite=False).T
    rows[:, variance <= _CHOSEN.zero_variance] = 0.0
    return np.asarray(rows)


def _weighed(
    likelihoods: list[_Likelihood],
    departures: FloatArray,
    beforehand: FloatArray,
    fixed_size: float | None,
) -> tuple[FloatArray, FloatArray]:
    """Sizes, on a grid of their logarithm, and the weight of each w, lambda and size, which sum to 1.

    Sizes are equally likely beforehand in their logarithm, but those that the errors would hide in
    themselves: a push where a medium has no force would fit the weakest one best.
    """
    middle = likelihoods[0].first if fixed_size is None else fixed_size
    low, high = np.log(middle / _CHOSEN.widest), np.log(middle * _CHOSEN.widest)
    for _ in range(3):  # to where the likelihood is
        sizes = (
            np.exp(np.linspace(low, high, _CHOSEN.sizes))
            if fixed_size is None
            else np.array([fixed_size])
        )
        logarithm = beforehand + np.stack(
            [likelihood.likelihood(sizes, departures) for likelihood in likelihoods]
        )
        logarithm += np.log(sizes / (sizes + _CHOSEN.hidden_below_se * likelihoods[0].least_error))
        weights = np.exp(logarithm - logarithm.max())
        likely = np.flatnonzero(weights.max(axis=(0, 1)) > 1e-6)
        low = np.log(sizes[max(likely[0] - 1, 0)])
        high = np.log(sizes[min(likely[-1] + 1, sizes.size - 1)])
    return sizes, weights / weights.sum()


class _Likelihood:
    """Numbers with a normal error, seen of a shape whose size and departure are unknown.

    Of unit errors the covariance is 1 + t (B B' + S), t the size squared times the departure, B the few columns by which
    known media differ, and S the rest: one decomposition of S serves every t, and B is a correction of few columns
    (Woodbury). Where the errors of z and x are independent, S falls into two parts, and the decomposition takes a quarter
    of the time; of few numbers, or where S does not fall apart, B stands in S.

    `seen`: places of the numbers in the prior.
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
        parts = _independent(measured.smooth, errors)
        if y.size <= _CHOSEN.few_numbers or len(parts) == 1:
            parts = [np.arange(y.size)]
            rests = [measured.covariance(rough_share)]
            between = measured.between[:0]
        else:
            squares = zip(measured.smooth.squares, measured.rough.squares, strict=True)
            rests = [(1 - rough_share) * k + rough_share * r for k, r in squares]
            between = measured.between
        self._parts = [
            _Part.of(places, rest, whiten) for places, rest in zip(parts, rests, strict=True)
        ]
        self._values = np.concatenate([part.values for part in self._parts])
        self._between = self._turned(between)
        self._y, self._mean = self._turned(y), self._turned(self.mean)
        weight = 1 / (np.diag(errors) + (0.2 * np.abs(y)) ** 2)
        self.first = float(weight @ (self.mean * y)) / float(weight @ self.mean**2)
        if not self.first > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )

    def _turned(self, numbers: FloatArray) -> FloatArray:
        """Numbers (..., n) in the axes in which errors are 1 and S is diagonal."""
        return np.concatenate(
            [numbers[..., part.places] @ part.axes.T for part in self._parts], axis=-1
        )

    def _correction(self, variance: FloatArray, over: FloatArray) -> FloatArray:
        """Inverse of 1 + t B' D^-1 B, shape (t, k, k); `over`: 1 / D, shape (t, n), D of 1 + t S."""
        few = self._between
        products = (few[:, None] * few).reshape(-1, few.shape[1])
        inner = (over @ products.T).reshape(len(over), len(few), len(few))
        return np.asarray(np.linalg.inv(np.eye(len(few)) + variance[:, None, None] * inner))

    def likelihood(self, sizes: FloatArray, departures: FloatArray) -> FloatArray:
        """Its logarithm, shape (departures, sizes)."""
        variance = (departures[:, None] * sizes**2).ravel()
        diagonal = 1 + variance[:, None] * self._values
        if not len(self._between):
            off = np.tile(self._y - sizes[:, None] * self._mean, (departures.size, 1))
            total = (np.log(diagonal) + off**2 / diagonal).sum(axis=-1)
            return np.asarray(-0.5 * total).reshape(departures.size, sizes.size)
        over = 1 / diagonal
        inverse = self._correction(variance, over)
        size = np.broadcast_to(sizes, (departures.size, sizes.size)).ravel()
        pairs = self._y * self._y, self._y * self._mean, self._mean * self._mean
        squares = over @ np.stack([pairs[0], -2 * pairs[1], pairs[2]], axis=1)
        powers = np.stack([np.ones_like(size), size, size**2], axis=1)
        few_y, few_mean = (over @ (self._between * part).T for part in (self._y, self._mean))
        few = few_y - size[:, None] * few_mean
        corrected = np.einsum("ti,tij,tj->t", few, inverse, few)
        total = (squares * powers).sum(axis=1) - variance * corrected
        determinant = np.log(diagonal).sum(axis=1) - np.linalg.slogdet(inverse)[1]
        return np.asarray(-0.5 * (determinant + total)).reshape(departures.size, sizes.size)

    def expected(self, fixed_size: float | None) -> float:
        """Size of a medium that departs as the known ones do."""
        sizes, weights = _weighed([self], np.ones(1), np.zeros((1, 1, 1)), fixed_size)
        return float(weights[0, 0] @ sizes)

    def _solved(self, turned: FloatArray, variance: FloatArray) -> FloatArray:
        """Inverse covariance times turned numbers (draws, n); `variance`: t, (draws, 1)."""
        first = turned / (1 + variance * self._values)
        if not len(self._between):
            return np.asarray(first)
        over = 1 / (1 + variance * self._values)
        inverse = self._correction(variance[:, 0], over)
        few = np.einsum("dij,dj->di", inverse, first @ self._between.T)
        return np.asarray(first - over * (variance * (few @ self._between)))

    def solved(self, off: FloatArray, variance: FloatArray) -> FloatArray:
        """Inverse covariance of the numbers times `off`, (draws, n); `variance`: s^2 lambda, (draws, 1)."""
        turned = self._solved(self._turned(off), variance)
        answer = np.empty_like(off)
        ends = np.cumsum([part.values.size for part in self._parts])[:-1]
        for part, block in zip(self._parts, np.split(turned, ends, axis=1), strict=True):
            answer[:, part.places] = block @ part.axes
        return answer

    def distance(self, size: float) -> float:
        """Squared distance of the numbers from the shape of this size: chi^2 where the medium belongs."""
        off = (self._y - size * self._mean)[None]
        return float((off * self._solved(off, np.full((1, 1), size**2))).sum())

    def horizontal(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Strength of alpha_x relative to alpha_z, as the known media have it 1, and error of its logarithm.

        Generalised least squares with one factor for each component; NaN where one was not seen. Where one
        is not positive: 0, and the error of their difference in units of it.
        """
        if is_x.all() or not is_x.any():
            return float("nan"), float("nan")
        design = np.stack([np.where(is_x, 0.0, self.mean), np.where(is_x, self.mean, 0.0)])
        turned = self._turned(design)
        weighted = self._solved(turned, np.full((2, 1), size**2))
        covariance = np.linalg.pinv(weighted @ turned.T)
        z, x = (float(factor) for factor in covariance @ (weighted @ self._y))
        if min(z, x) <= 0:
            apart = covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]
            return 0.0, float(np.sqrt(max(apart, 0.0))) / abs(z - x)
        variance = (
            covariance[0, 0] / z**2 + covariance[1, 1] / x**2 - 2 * covariance[0, 1] / (z * x)
        )
        return x / z, float(np.sqrt(max(variance, 0.0)))

    def _precision_of_each(self, size: float) -> FloatArray:
        """Diagonal of the inverse covariance of the numbers."""
        variance = np.full(1, size**2)
        over = 1 / (1 + variance[:, None] * self._values)
        inverse = self._correction(variance, over)[0]
        pulled = self._between * over
        diagonal = np.empty(self.y.size)
        start = 0
        for part in self._parts:
            stop = start + part.values.size
            few = pulled[:, start:stop] @ part.axes
            own = over[0, start:stop] @ part.axes**2
            diagonal[part.places] = own - size**2 * np.einsum("in,ij,jn->n", few, inverse, few)
            start = stop
        return diagonal

    def farthest(self, pushes: Pushes, used: npt.NDArray[np.bool_], size: float) -> PushResidual:
        """The number that differs most from what the others make it, in units of its error."""
        spread = 1 / self._precision_of_each(size)
        left = (self.y - size * self.mean)[None]
        off = self.solved(left, np.full((1, 1), size**2))[0] * spread
        worst = int(np.argmax(np.abs(off) / np.sqrt(spread)))
        component, push = divmod(int(np.flatnonzero(used)[worst]), pushes.beta.size)
        beta_deg, gamma_deg = np.degrees(pushes.beta[push]), np.degrees(pushes.gamma[push])
        return PushResidual(
            float(beta_deg),
            float(gamma_deg),
            "zx"[component],
            float(self.y[worst]),
            float(self.y[worst] - off[worst]),
            float(np.sqrt(spread[worst])),
        )


class _Part(NamedTuple):
    """Numbers that are independent of all others but for B: their places, eigenvalues of S and its whitened axes."""

    places: npt.NDArray[np.intp]
    values: FloatArray
    axes: FloatArray

    @classmethod
    def of(cls, places: npt.NDArray[np.intp], rest: FloatArray, whiten: FloatArray) -> _Part:
        """Decompose S of some of the numbers."""
        if whiten.ndim == 1:
            own = whiten[places]
            values, vectors = np.linalg.eigh(own[:, None] * rest * own)
            return cls(places, np.maximum(values, 0.0), np.ascontiguousarray(vectors.T * own))
        own = whiten[np.ix_(places, places)]
        values, vectors = np.linalg.eigh(own @ rest @ own.T)
        return cls(places, np.maximum(values, 0.0), vectors.T @ own)


def _independent(rest: _Blocks, errors: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Places of numbers that neither S nor errors connect, in two parts; in one where everything is connected."""
    if len(rest.places) > 1 and not errors[np.ix_(*rest.places)].any():
        return [*rest.places]
    return [np.arange(len(errors))]


def whitening(errors: FloatArray) -> FloatArray:
    """Matrix that makes errors independent and 1; of independent ones its diagonal alone, shape (n,)."""
    variance = np.diag(errors)
    if np.count_nonzero(errors) == np.count_nonzero(variance):
        return 1 / np.sqrt(variance)
    return np.linalg.inv(np.linalg.cholesky(errors))


class PushResidual(NamedTuple):
    """One number of a push beside what the other pushes and the known shape make it, N/cm^3."""

    beta_deg: float
    gamma_deg: float
    component: str
    measured: float
    expected: float
    error: float


LEAST_VARIANCE = 1e-9
"""Of the largest: directions in which alpha varies less are left out of its error."""


def root(covariance: FloatArray) -> FloatArray:
    """Rows whose products are a covariance: normal numbers times them have it."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    keep = values > LEAST_VARIANCE * max(float(values[-1]), 1e-300)
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep])).T)


def _same_direction_or_mirror(
    beta: float, gamma: float, betas: FloatArray, gammas: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Nodes that are a direction or its mirror image, and the sign of alpha_x there."""
    nodes, signs = [], []
    for image, sign in (((beta, gamma), 1.0), (mirror(beta, gamma), -1.0)):
        image_deg = np.degrees([float(angle) for angle in image])
        off_gamma_deg = (np.degrees(gammas) - image_deg[1] + 180) % 360 - 180
        is_near = same_direction(np.degrees(betas), off_gamma_deg, image_deg[0], 0.0)
        nodes.append(np.flatnonzero(is_near))
        signs.append(np.full(nodes[-1].size, sign))
    places, first_places = np.unique(np.concatenate(nodes), return_index=True)
    return places, np.concatenate(signs)[first_places]


@dataclass(frozen=True)
class Map(KnownMedium):
    """Alpha over all directions, estimated from pushes: made by `estimate_map` and `scale`.

    Parameters
    ----------
    name : str
        Of the medium.
    beta, gamma : numpy.ndarray, shape (n,)
        Its nodes, rad; together with their mirror images they make a whole grid.
    draws : numpy.ndarray, shape (draws, 2, n)
        Draws of alpha, z and x, N/cm^3: media that the pushes allow and that take energy in every direction.
    measured : numpy.ndarray of bool, shape (n,)
        Whether the node was pushed: its alpha is then what was measured.
    not_passive : float
        Share of the draws that was left out, because the medium would give energy back.
    size : float
        Root mean square of alpha over the published grid, N/cm^3.
    distance : float
        Chi squared of the pushes about the shape.
    dof : int
        Its degrees of freedom; 0: one number tells the size alone.
    pushes : int
    known_media : str
        The media whose shape it has.
    farthest : Push or None
        The measured number that differs most from what the other pushes make it.
    horizontal : float
        How strong alpha_x is beside alpha_z, relative to the known media; NaN where one was not measured.
    horizontal_off : float
        How many standard deviations of media that belong the logarithm of that is from 0.
    confidence : float
    given : Pushes or None
        The pushes, one a direction.
    lines : int or None
        How many of the nodes, the first, a push is planned in; the others lie between their lines. None: all.
    bed_spread, model_error : float
        As of its `Profile`.
    contacts : int
        Bodies with measured forces behind it.
    window : tuple of float
        Least and largest depth behind its pushes, cm; any where they do not state it.

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
        """Rows whose products are the covariance of alpha, shape (draws, 2, n)."""
        return np.asarray((self.draws - self.alpha) / np.sqrt(len(self.draws) - 1))

    @property
    def measurements(self) -> str:
        """How many pushes and contacts are behind the map, for people."""
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
        """What was pushed, as `TableProfile.pushed`."""
        if self.given is None:
            return np.zeros((6, 0))
        angles, alpha = np.degrees([self.given.beta, self.given.gamma]), self.given.alpha
        se = np.sqrt(np.diag(self.given.covariance)).reshape(alpha.shape)
        return np.concatenate([angles, alpha, np.where(np.isnan(alpha), np.nan, se)])

    def work(self, alpha: FloatArray | None = None) -> FloatArray:
        """Energy that the medium takes at each node, per area, depth and way, N/cm^3.

        Parameters
        ----------
        alpha : numpy.ndarray, shape (..., 2, n), optional
            Default: the map's own.

        Returns
        -------
        numpy.ndarray, shape (..., n)
        """
        return work(self.alpha if alpha is None else alpha, self.gamma)

    @property
    def belongs(self) -> float:
        """How often a medium of the known shape has pushes that lie as far from it: NaN for one number.

        By their distance from the shape, and by the strength of alpha_x beside alpha_z.
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
        """What answers alpha(beta, gamma), with draws for its intervals."""
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
            Arguments of `write_profile`, by name.
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

    def _with_ends(self, best: FloatArray, many: FloatArray) -> tuple[float, float, float]:
        lo, hi = interval(many, self.confidence)
        return float(best), float(lo), float(hi)

    def coefficients(self, alpha: FloatArray | None = None) -> FloatArray:
        """Nine coefficients fitted to the map by least squares.

        Parameters
        ----------
        alpha : numpy.ndarray, shape (..., 2, n), optional
            Default: the map's own.

        Returns
        -------
        numpy.ndarray, shape (..., 9)
            N/cm^3, those of the terms that the map itself keeps.
        """
        keep = kept_terms(fit_lsq(self.beta, self.gamma, *self.alpha), PAPER_RULE)
        alpha = self.alpha if alpha is None else alpha
        return fit_lsq(self.beta, self.gamma, alpha[..., 0, :], alpha[..., 1, :], keep)

    def table(self) -> pd.DataFrame:
        """Alpha at the nodes.

        Returns
        -------
        pandas.DataFrame
            ``beta_deg, gamma_deg``; ``alpha_z_N_per_cm3``, ``alpha_z_lo_N_per_cm3``,
            ``alpha_z_hi_N_per_cm3``, ``alpha_z_lo_next_N_per_cm3`` and ``alpha_z_hi_next_N_per_cm3`` (of a push in
            one further bed), the same of ``alpha_x``; ``source``: measured or estimated.
        """
        return pd.DataFrame(self.columns())

    def columns(self) -> dict[str, npt.NDArray[np.generic]]:
        """`table` without pandas.

        Returns
        -------
        dict of str to numpy.ndarray, shape (n,)
        """
        order = np.lexsort([self.gamma, self.beta])
        columns: dict[str, npt.NDArray[np.generic]] = {
            "beta_deg": np.degrees(self.beta[order]),
            "gamma_deg": np.degrees(self.gamma[order]),
        }
        # what is 0 by symmetry is so to the last digit
        lo, hi = np.round(interval(self.draws, self.confidence), 12) + 0.0
        bed = half_width_of_bed(self.bed_spread, self.confidence) * np.abs(self.alpha)
        lo_next, hi_next = widen(self.alpha, (lo, hi), bed)
        values = {"": self.alpha, "_lo": lo, "_hi": hi, "_lo_next": lo_next, "_hi_next": hi_next}
        for place, component in enumerate("zx"):
            for quantity, of_nodes in values.items():
                columns[column(component, quantity)] = of_nodes[place, order]
        columns["source"] = np.where(self.measured[order], "measured", "estimated")
        return columns


LEAST_WORK = 0.02
"""A medium that gives back less than this share of its largest alpha is within rounding."""


def work(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Energy that a medium takes, per area, depth and way, N/cm^3; `alpha`: shape (..., 2, n)."""
    return alpha[..., 0, :] * np.sin(gamma) + alpha[..., 1, :] * np.cos(gamma)
