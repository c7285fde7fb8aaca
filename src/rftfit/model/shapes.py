"""Shape of alpha over all directions that granular media share, and how far a further medium may differ from it.

The shape of a medium is its alpha over its size, the root mean square of alpha over the published grid; m is the mean
shape of the known media, C their covariance, K and R further covariances, w the share of R, lambda a factor on all of
them (`rftfit.model.prior`). Alpha in n directions is a vector (2 n,), all z, then all x.

The known tables have lines 30 degrees apart in beta. Between the lines m is not bilinear: it follows the law 3D-RFT,
whose difference from bilinear values is called the course here. It is not fitted. C includes the differences between
the courses of several frictions, and the course itself, since a further medium may have none of it or twice as much.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray, mirror, wrap_beta
from rftfit.directions import TOLERANCE_DEG
from rftfit.model.draws import SEED_OF_MAPS
from rftfit.model.energy import mean_effort, takes_energy
from rftfit.model.likelihood import Likelihood, Measurements
from rftfit.model.observations import Angles
from rftfit.model.prior import (
    ZERO_VARIANCE,
    Blocks,
    Prior,
    Variation,
    rough_kernel,
    smooth_kernel,
    symmetric_correlation,
    triangular_root,
)
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA
from rftfit.store.chosen import chosen, read_toml

_CHOSEN = chosen("model", "shapes")


def _published_variation() -> Variation:
    """Return the variation that was chosen on Table S5."""
    return Variation(**read_toml("reference", "shapes.toml"))


def grid(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Angles:
    """Return directions on the published grid of 7 x 13 lines and on extra lines, rad, two arrays of shape (n,).

    `beta_deg`, `gamma_deg`: extra lines, degrees; one that lies on a published line adds nothing.
    """

    def add_lines(published: FloatArray, extra_lines: npt.ArrayLike) -> FloatArray:
        """Return the published angles and those extra ones that lie on none of them, rad; all in degrees before."""
        extra = np.asarray(extra_lines, dtype=float).ravel()
        is_near = np.abs(extra[:, None] - published).min(axis=1, initial=np.inf) <= TOLERANCE_DEG
        all_lines: FloatArray = np.unique(np.concatenate([published, extra[~is_near]]))
        return np.radians(all_lines)

    # without beta = -90 degrees, which is the same plate as 90
    lines = add_lines(BETA_DEG[1:], beta_deg), add_lines(GAMMA_DEG, gamma_deg)
    mesh = np.meshgrid(*lines, indexing="ij")
    return mesh[0].ravel(), mesh[1].ravel()


PUBLISHED_GRID = grid()
"""Directions of the published grid, rad, each of shape (n,)."""

TILT_SHARE = 1.0
"""Share of the full tilt that is applied: decided on natural sands and on exact laws (docs/theory/map.md)."""

FRICTIONS: tuple[float, ...] = tuple(_CHOSEN.frictions)
"""Frictions of 3D-RFT over whose courses the mean is taken."""


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
        """Refuse fewer than two media, or media with holes: their differences would not be known."""
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
        """Standard deviation of log(alpha_x / alpha_z) of a medium as known media scatter, and that by C and K alone.

        Both components as root mean squares over the published grid. The second is the error of an estimate from exact
        pushes everywhere, by a prior that knows C and K alone.
        """
        z, x = np.split(self.of_media(*PUBLISHED_GRID), 2, axis=1)
        log_ratios = np.log(np.sqrt((x**2).mean(axis=1) / (z**2).mean(axis=1)))
        prior = self.prior(*PUBLISHED_GRID)
        mean = prior.mean
        # alpha that is 0 by symmetry has no variance
        varies = np.flatnonzero(np.diag(prior.covariance(0.0)) > ZERO_VARIANCE)
        # a medium with exactly the mean shape, measured everywhere without error
        exact = (1e-6 * np.abs(mean).max()) ** 2 * np.eye(varies.size)
        likelihood = Likelihood(Measurements(prior, varies, mean[varies], exact), 0.0)
        allowed = likelihood.fit_horizontal_ratio(varies >= mean.size // 2, 1.0)[1]
        return float(log_ratios.std(ddof=1)) * np.sqrt(1 + 1 / log_ratios.size), allowed

    def horizontal_error(self, seen: float) -> float:
        """Return the standard deviation of an estimate of log(alpha_x / alpha_z) of a medium like the known ones.

        `seen`: standard error of the estimate from some pushes by `Likelihood.fit_horizontal_ratio`. It includes what C
        and K allow, which is replaced by the scatter of the known media.
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
        grids = [profile.alpha(*PUBLISHED_GRID) for profile in self.profiles.values()]
        return np.asarray(np.sqrt(np.mean(np.square(grids), axis=(1, 2))))

    def of_media(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Return alpha of each known medium over its size in n directions (rad), shape (media, 2 n): z, then x.

        Between the lines of a table alpha is bilinear plus the course of 3D-RFT.
        """
        return self._with_course(beta, gamma, course_between_lines(beta, gamma).mean(axis=0))

    def _with_course(self, beta: FloatArray, gamma: FloatArray, course: FloatArray) -> FloatArray:
        """Return alpha of each known medium over its size, bilinear plus a course (2 n,); shape (media, 2 n).

        `course`: that of a medium whose alpha_z(0, 90 deg) is 1.
        """
        tables = [np.concatenate(profile.alpha(beta, gamma)) for profile in self.profiles.values()]
        bilinear = np.stack(tables) / self._sizes[:, None]
        return bilinear + self.levels[:, None] * course

    @cached_property
    def _mean_on_grid(self) -> FloatArray:
        """Mean shape m on the published grid, shape (2 n,)."""
        return np.asarray(self.of_media(*PUBLISHED_GRID).mean(axis=0))

    def slopes(self, beta_deg: FloatArray, gamma_deg: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the mean shape in n directions, (2, n), and its slopes over beta and gamma, per degree, (2, n, 2).

        With them an error of an angle becomes one of alpha. A slope is the root mean square of the slopes to both
        sides, with the sign of their sum: at a maximum or a corner of alpha their mean would be too small.
        """
        step_deg = _CHOSEN.slope_step_deg
        # no step, a step up and down in beta, a step up and down in gamma
        beta_steps, gamma_steps = step_deg * np.array([[0, 1, -1, 0, 0], [0, 0, 0, 1, -1]])
        beta = np.radians(beta_deg + beta_steps[:, None]).ravel()
        gamma = np.radians(gamma_deg + gamma_steps[:, None]).ravel()
        mean = self.of_media(beta, gamma).mean(axis=0).reshape(2, beta_steps.size, -1)
        above, below = mean[:, 1::2] - mean[:, :1], mean[:, :1] - mean[:, 2::2]
        size = np.hypot(above, below) / (np.sqrt(2) * step_deg)
        return mean[:, 0], np.moveaxis(np.copysign(size, above + below), 1, -1)

    def prior(self, beta: FloatArray, gamma: FloatArray) -> Prior:
        """Return the prior of alpha of a further medium of size 1 in n directions, rad, with C, K and R."""
        courses = course_between_lines(beta, gamma)
        media_shapes = self._with_course(beta, gamma, courses.mean(axis=0))
        mean, count, variation = media_shapes.mean(axis=0), len(media_shapes), self.variation
        # sample covariance of a further medium about the mean of `count` media, times the factor `media`
        between = (media_shapes - mean) * np.sqrt(variation.media * (1 + 1 / count) / (count - 1))
        # two more terms of C: courses differ by friction, and a medium may have less or more of the mean course
        courses = self.levels.mean() * courses
        course = courses.mean(axis=0)
        by_friction = (courses - course) / np.sqrt(len(courses) - 1)
        between = np.concatenate([between, by_friction, variation.course_share * course[None]])
        # the standard deviation of K depends on the mean there, that of R is the same everywhere
        sd_z, sd_x = np.split(variation.floor + variation.share * np.abs(mean), 2)
        sd_on_grid = variation.floor + variation.share * np.abs(self._mean_on_grid)
        rough_variance = np.mean(sd_on_grid**2)
        (smooth_z, smooth_x), (rough_z, rough_x) = (
            symmetric_correlation(beta, gamma, partial(kernel, variation))
            for kernel in (smooth_kernel, rough_kernel)
        )
        z, x = np.split(np.arange(mean.size), 2)
        smooth = np.outer(sd_z, sd_z) * smooth_z, np.outer(sd_x, sd_x) * smooth_x
        rough = rough_variance * rough_z, rough_variance * rough_x
        return Prior(mean, between, Blocks((z, x), smooth), Blocks((z, x), rough))

    @property
    def tilt(self) -> float:
        """Exponent that makes media of large effort less likely (`Posterior.draw_media`): `TILT_SHARE` of the full tilt.

        Effort is the mean energy that a medium takes over alpha_z(0, 90 deg) (`rftfit.model.energy`).
        """
        return TILT_SHARE * self._full_tilt if TILT_SHARE else 0.0

    @cached_property
    def _full_tilt(self) -> float:
        """Exponent with which media of the prior that take energy have on average the effort of the mean shape.

        Without it they would have more: media that give energy back are left out.
        """
        variation, random = self.variation, np.random.default_rng(SEED_OF_MAPS)
        prior = self.prior(*PUBLISHED_GRID)
        target_effort = float(mean_effort(prior.mean.reshape(1, 2, -1), PUBLISHED_GRID)[0])
        half = variation.departure_dof / 2
        efforts = []
        for rough_share in variation.rough_shares:
            departure = (half + 1) / random.gamma(half, size=(_CHOSEN.tilt_draws, 1))
            normals = random.standard_normal((_CHOSEN.tilt_draws, prior.mean.size))
            rows = triangular_root(prior.covariance(rough_share))
            drawn = prior.mean + np.sqrt(departure) * (normals @ rows)
            media = drawn.reshape(_CHOSEN.tilt_draws, 2, -1)
            largest = np.abs(media).max(axis=(1, 2))
            no_push = np.zeros(PUBLISHED_GRID[0].size, dtype=bool)
            is_passive = takes_energy(media, PUBLISHED_GRID[1], largest, no_push)
            efforts.append(mean_effort(media[is_passive], PUBLISHED_GRID))
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


@cache
def _published_shapes(left_out: frozenset[str]) -> Shapes:
    """Return `published_shapes` without some media, each set made once."""
    return Shapes({name: TableProfile.published(name) for name in MEDIA if name not in left_out})


def course_between_lines(beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return the course: 3D-RFT less its bilinear interpolation on the published grid, for each of `FRICTIONS`.

    For media whose alpha_z(0, 90 deg) is 1, in n directions (rad); shape (frictions, 2 n): z, then x. On the published
    grid the course is 0.
    """
    return np.stack([_law_less_its_lines(friction, beta, gamma) for friction in FRICTIONS])


def _law_less_its_lines(friction: float, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Return `course_between_lines` for one friction, shape (2 n,): z, then x."""
    image_beta, image_gamma = mirror(beta, gamma)
    # a plate at 90 degrees is the one at -90
    z, x = alpha_3drft(wrap_beta(beta), gamma, friction)
    z_of_image, x_of_image = alpha_3drft(wrap_beta(image_beta), image_gamma, friction)
    # the mean with the mirror image has exactly the symmetry of alpha
    law = np.concatenate([(z + z_of_image) / 2, (x - x_of_image) / 2])
    return law - np.concatenate(_law_on_lines(friction).alpha(beta, gamma))


@cache
def _law_on_lines(friction: float) -> TableProfile:
    """Return the table of 3D-RFT with one friction on the published grid, of a medium whose alpha_z(0, 90 deg) is 1."""
    return TableProfile(*alpha_3drft(*PUBLISHED_GRID, friction), *PUBLISHED_GRID)
