"""Alpha over all directions from any number of pushes, by the shape that granular media share.

Alpha over the angles has nearly the same shape in all dry granular media. The shape of known media is
taken as what is known beforehand, and every push corrects it:

    alpha = s (m + d),   d ~ N(0, C + K)

with the unknown size s of this medium, the mean shape m and the covariance C of the known media, and a
smooth covariance K for how a further medium may differ from them all. Given s it is one linear solve.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rftfit.campaign.tables import ALPHA
from rftfit.conventions import mirror
from rftfit.errors import InputError
from rftfit.measure.alpha import SAME_DIRECTION_DEG, both, column, directions, flagged
from rftfit.model.draws import draws_of, errors_known, interval
from rftfit.model.fourier import fit_lsq, kept_terms
from rftfit.model.profiles import TableProfile
from rftfit.model.scaling import PAPER_RULE, vertical_penetration
from rftfit.model.symmetry import rectangle
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy.typing as npt
    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.conventions import FloatArray

    Angles = tuple[FloatArray, FloatArray]

DRAWS, SEED = 1000, 2013
"""Draws of a map behind its intervals, and their seed."""

FEWEST_DRAWS = 100
"""With fewer of them there are no intervals."""

_MOST_DRAWN = 20
"""So many times the wanted draws are made at most to find enough that are passive."""

NOT_ALIKE = 0.03
"""A medium whose pushes lie so far from the shape by chance less often than this does not belong."""


class Variation(NamedTuple):
    """How far a further medium may differ from the known ones: amplitude and lengths of K.

    `floor`, `share`: standard deviation floor + share |m|, of a shape whose size is 1.
    `smooth`: part of the variance that is smooth (squared exponential); the rest is rough (Matern 3/2).
    `smooth_beta`, `smooth_gamma`, `rough_beta`, `rough_gamma`: their lengths, in (cos 2 beta, sin 2 beta)
        and in (cos gamma, sin gamma).
    `media`: the covariance of the known media is taken so many times.
    """

    floor: float
    share: float
    smooth: float
    smooth_beta: float
    smooth_gamma: float
    rough_beta: float
    rough_gamma: float
    media: float


@cache
def _chosen() -> Variation:
    """The variation that ``studies/shapes.py`` chose on Table S5."""
    text = files("rftfit.reference").joinpath("shapes.toml").read_text(encoding="utf-8")
    return Variation(**tomllib.loads(text))


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
        if holes := [name for name, one in self.profiles.items() if one.reason]:
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
        known = np.log(np.sqrt((x**2).mean(axis=1) / (z**2).mean(axis=1)))
        mean, prior = self.moments(*_GRID)
        free = np.diag(prior) > _NONE
        whole = _Given(
            mean[free], prior[np.ix_(free, free)], mean[free], np.zeros((free.sum(),) * 2)
        )
        allowed = whole.horizontal(np.arange(mean.size)[free] >= mean.size // 2, 1.0)[1]
        return float(known.std(ddof=1)) * np.sqrt(1 + 1 / known.size), allowed

    def horizontal_error(self, seen: float) -> float:
        """Standard deviation of log(alpha_x over alpha_z) of a medium that belongs.

        `seen`: of its estimate from some pushes, as far as K allows it.
        """
        known, allowed = self.horizontal_spread
        return float(np.sqrt(known**2 + max(seen**2 - allowed**2, 0.0)))

    def of_media(self, beta: FloatArray, gamma: FloatArray) -> FloatArray:
        """Alpha of each known medium over its size, shape (media, 2 n): z, then x."""
        shapes = []
        for profile in self.profiles.values():
            size = np.sqrt(np.mean(np.square(profile.alpha(*_GRID))))
            shapes.append(np.concatenate(profile.alpha(beta, gamma)) / size)
        return np.stack(shapes)

    def moments(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, shape (2 n,), and covariance, shape (2 n, 2 n), of a further medium of size 1."""
        known = self.of_media(beta, gamma)
        mean, count, by = known.mean(axis=0), len(known), self.variation
        between = known - mean
        covariance = between.T @ between * (by.media * (1 + 1 / count) / (count - 1))
        amplitude = by.floor + by.share * np.abs(mean)
        covariance += np.outer(amplitude, amplitude) * _alike(beta, gamma, by)
        return mean, covariance


def _alike(beta: FloatArray, gamma: FloatArray, by: Variation) -> FloatArray:
    """Correlation of functions on the torus of (2 beta, gamma) that have the symmetry of alpha.

    Of alpha_z the part that is even under the mirror, with a variance of 1 everywhere; of alpha_x the
    odd part, whose variance goes to 0 where a direction is its own mirror image.
    """
    one, image = (beta, gamma), mirror(beta, gamma)
    direct, turned = _kernel(one, one, by), _kernel(one, image, by)
    size = np.sqrt(1 + np.diag(turned))
    nothing = np.zeros_like(direct)
    even = (direct + turned) / size / size[:, None]
    return np.block([[even, nothing], [nothing, direct - turned]])


def _kernel(one: Angles, other: Angles, by: Variation) -> FloatArray:
    # the chords between two points of each circle
    chord_beta = 2 * np.sin(one[0][:, None] - other[0])
    chord_gamma = 2 * np.sin((one[1][:, None] - other[1]) / 2)
    smooth = np.hypot(chord_beta / by.smooth_beta, chord_gamma / by.smooth_gamma)
    rough = np.sqrt(3) * np.hypot(chord_beta / by.rough_beta, chord_gamma / by.rough_gamma)
    result: FloatArray = by.smooth * np.exp(-(smooth**2) / 2)
    result += (1 - by.smooth) * (1 + rough) * np.exp(-rough)
    return result


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
    left = set(without)
    return Shapes({name: TableProfile.published(name) for name in MEDIA if name not in left})


def grid(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Angles:
    """Nodes of a map: the published grid of 7 x 13 directions with more lines, rad, shape (n,)."""

    def lines(published: FloatArray, more: npt.ArrayLike) -> FloatArray:
        new = np.asarray(more, dtype=float).ravel()
        near = np.abs(new[:, None] - published).min(axis=1, initial=np.inf) <= SAME_DIRECTION_DEG
        every: FloatArray = np.unique(np.concatenate([published, new[~near]]))
        return np.radians(every)

    # a plate at -90 degrees is the one at 90
    mesh = np.meshgrid(lines(BETA_DEG[1:], beta_deg), lines(GAMMA_DEG, gamma_deg), indexing="ij")
    return mesh[0].ravel(), mesh[1].ravel()


_GRID = grid()


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
            np.radians(np.ravel(np.asarray(one, float))) for one in (beta_deg, gamma_deg)
        )
        alpha = np.asarray(alpha, dtype=float).reshape(2, beta.size)
        error = np.broadcast_to(np.asarray(se, dtype=float), alpha.shape)
        error = np.where(np.isnan(error), usual_error(alpha), error)
        return cls(beta, gamma, alpha, np.diag(error.ravel() ** 2))


USUAL_PERCENT, LEAST_PERCENT = 5.0, 1.0
"""Error of a push of which none is stated: of its own alpha (from bed to bed) and of the largest."""


def usual_error(
    alpha: FloatArray, percent: float = USUAL_PERCENT, least_percent: float = LEAST_PERCENT
) -> FloatArray:
    """Standard error of pushes of which none is known, N/cm^3."""
    largest = float(np.nanmax(np.abs(alpha), initial=0.0))
    return np.hypot(percent / 100 * alpha, least_percent / 100 * largest)


def sorted_pushes(pushes: pd.DataFrame) -> Pushes:
    """Pushes of a table as `estimate_map` takes it; the order of its rows makes no difference."""
    nothing = np.full(len(pushes), np.nan)
    pushes = pushes.rename(columns={name: own.name for own in ALPHA.columns for name in own.also})
    if missing := {"beta_deg", "gamma_deg", column("z")} - {*pushes}:
        raise InputError(
            f"pushes: no column {', '.join(sorted(missing))}; found: {', '.join(map(str, pushes))}"
        )

    def numbers(*names: str) -> FloatArray:
        return np.stack(
            [pushes[own].to_numpy(float) if own in pushes else nothing for own in names]
        )

    beta_deg, gamma_deg = numbers("beta_deg", "gamma_deg")
    found = Pushes.of(
        beta_deg, gamma_deg, numbers(column("z"), column("x")), numbers("se_z", "se_x")
    )
    order = np.lexsort([found.alpha[1], found.alpha[0], gamma_deg, beta_deg])
    both = np.concatenate([order, order.size + order])
    return Pushes(
        found.beta[order], found.gamma[order], found.alpha[:, order],
        found.covariance[np.ix_(both, both)],
    )  # fmt: skip


def estimate_map(
    pushes: pd.DataFrame, shapes: Shapes | None = None, confidence: float = 0.95, name: str = ""
) -> Map:
    """Estimate alpha over all directions from one push or many.

    Parameters
    ----------
    pushes : pandas.DataFrame
        One row a direction: ``beta_deg, gamma_deg``, ``alpha_z_N_per_cm3`` and, where it was measured,
        ``alpha_x_N_per_cm3``; their standard errors ``se_z``, ``se_x``: where there is none it is taken for
        5 % of alpha and 1 % of the largest. The columns have any name that ``rftfit scale --pushes`` takes.
    shapes : Shapes, optional
        What is known beforehand; default: the five published media.
    confidence : float, optional
        Level of the intervals.
    name : str, optional
        Of the medium, for people.

    Returns
    -------
    Map

    Raises
    ------
    ValueError
        If no push has a number that tells of the medium, or they meet no resistance.

    Examples
    --------
    >>> import pandas as pd, rftfit
    >>> one = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.9]})
    >>> round(rftfit.estimate_map(one).zeta[0], 1)
    0.8
    """
    return estimate(sorted_pushes(pushes), shapes, confidence=confidence, name=name)


def pushes_of(table: pd.DataFrame, config: Config) -> Pushes:
    """The cells of an alpha table as pushes, with their errors and what these share."""
    beta_deg = table["beta_deg"].to_numpy(float)
    alpha = np.stack(both(table))
    if config.fit.flagged == "leave_out":
        alpha = np.where(flagged(table), np.nan, alpha)
    # a plate at -90 degrees is the one at 90
    twice = (beta_deg == -90) & table["gamma_deg"].isin(table.loc[beta_deg == 90, "gamma_deg"])
    use = np.isfinite(alpha).any(axis=0) & ~twice.to_numpy(bool)
    gamma_deg = table["gamma_deg"].to_numpy(float)
    if not errors_known(table):
        return Pushes.of(beta_deg[use], gamma_deg[use], alpha[:, use])
    draws = np.concatenate([part[:, use] for part in draws_of(table, config)], axis=1)
    covariance = np.atleast_2d(np.cov(draws, rowvar=False))
    beta, gamma = directions(table)
    return Pushes(beta[use], gamma[use], alpha[:, use], covariance)


def merged(pushes: Pushes) -> Pushes:
    """Each direction once: repeated pushes are one, weighted with their errors."""
    count = pushes.beta.size
    known = np.isfinite(pushes.alpha.ravel()) & np.isfinite(np.diag(pushes.covariance))
    covariance = np.where(np.outer(known, known), pushes.covariance, 0.0)
    least = (1e-9 * np.abs(np.where(known, pushes.alpha.ravel(), 0.0)).max(initial=1e-9)) ** 2
    weight = np.where(known, 1 / np.maximum(np.diag(covariance), least), 0.0)
    first, rows = [], np.zeros((2, 0, 2 * count))
    left = np.ones(count, dtype=bool)
    for push in range(count):
        if not left[push]:
            continue
        same, turned = _same_direction(
            pushes.beta[push], pushes.gamma[push], pushes.beta, pushes.gamma
        )
        left[same] = False
        first.append(push)
        row = np.zeros((2, 1, 2 * count))
        for component, sign in enumerate((np.ones(same.size), turned)):
            there = component * count + same
            total = float(weight[there].sum())
            row[component, 0, there] = sign * weight[there] / total if total else np.nan
        rows = np.concatenate([rows, row], axis=1)
    mean = rows.reshape(2 * len(first), -1)
    alpha = (np.nan_to_num(mean) @ np.where(known, pushes.alpha.ravel(), 0.0)).reshape(2, -1)
    lost = np.isnan(mean).any(axis=1).reshape(2, -1)
    return Pushes(
        pushes.beta[first], pushes.gamma[first], np.where(lost, np.nan, alpha),
        np.nan_to_num(mean) @ covariance @ np.nan_to_num(mean).T,
    )  # fmt: skip


_MOST_NODES = 400


def nodes_of(table: pd.DataFrame) -> Angles:
    """Nodes of a medium's map: the published grid, with the lines of its own grid where it has one."""
    own = grid(*(table[name].unique() for name in ("beta_deg", "gamma_deg")))
    whole = rectangle(*directions(table)) is not None and own[0].size <= _MOST_NODES
    return own if whole else _GRID


def estimate(
    pushes: Pushes,
    shapes: Shapes | None = None,
    nodes: Angles | None = None,
    *,
    size: float | None = None,
    confidence: float = 0.95,
    name: str = "",
) -> Map:
    """Estimate alpha over all directions from what was pushed: `estimate_map` with errors that are known.

    `nodes`: (beta, gamma) of the map, rad, all on lines of a grid (`grid`). `size`: Root mean square of alpha
    over the published grid, N/cm^3, where it is known.
    """
    shapes = shapes or published_shapes()
    nodes = _GRID if nodes is None else nodes
    made = int(np.isfinite(pushes.alpha).any(axis=0).sum())
    pushes = merged(pushes)
    count, every = nodes[0].size, pushes.beta.size
    mean, prior = shapes.moments(
        np.concatenate([nodes[0], pushes.beta]), np.concatenate([nodes[1], pushes.gamma])
    )
    place = np.arange(mean.size).reshape(2, -1)
    at, seen = place[:, :count].ravel(), place[:, count:].ravel()
    y, errors = pushes.alpha.ravel(), pushes.covariance
    # symmetry leaves some numbers no freedom: they tell nothing of the medium
    told = np.isfinite(y) & np.isfinite(np.diag(errors)) & (np.diag(prior)[seen] > _NONE)
    if not told.any():
        raise ValueError("no push has a number that tells of the medium")
    given = _Given(
        mean[seen[told]], prior[np.ix_(seen[told], seen[told])], y[told], errors[np.ix_(told, told)]
    )
    sizes, weights = given.sizes(size)
    across = prior[np.ix_(at, seen[told])]
    means = sizes[:, None] * mean[at] + given.pull(sizes) @ across.T
    best = weights @ means
    # the covariance given the size, at its typical one; how the mean moves with the size is exact
    middle = float(np.sqrt(weights @ sizes**2))
    gain = given.gain(across, middle)
    left = prior[np.ix_(at, at)] - (gain @ across.T + across @ gain.T) + gain @ given.prior @ gain.T
    noise = np.zeros((y.size, 2 * count))
    noise[told] = gain.T
    moved = np.sqrt(weights)[:, None] * (means - best)
    spread = middle**2 * left + moved.T @ moved
    measured = np.zeros(count, dtype=bool)
    for push, (beta, gamma) in enumerate(zip(pushes.beta, pushes.gamma, strict=True)):
        own, turned = _same_direction(beta, gamma, *nodes)
        if not told[push]:  # without a vertical component it is no cell
            continue
        measured[own] = True
        for component, sign in enumerate((np.ones(own.size), turned)):
            row, there = component * every + push, component * count + own
            if told[row]:  # a node that was pushed keeps its number, and its error
                best[there] = sign * y[row]
                spread[there] = spread[:, there] = noise[:, there] = 0.0
                noise[row, there] = sign
    spread += noise.T @ np.where(np.outer(told, told), errors, 0.0) @ noise
    # as few rows as there are numbers: for draws, and for the file of the profile
    factor = root(spread).reshape(-1, 2, count)
    expected = float(weights @ sizes)
    horizontal, seen_error = given.horizontal(np.flatnonzero(told) >= every, expected)
    # NaN stays: without both components there is nothing to compare
    off = (
        np.inf if horizontal == 0 else abs(np.log(horizontal)) / shapes.horizontal_error(seen_error)
    )
    return Map(
        name, *nodes, best.reshape(2, count), factor, measured, expected, given.distance(expected),
        y[told].size - 1, made, shapes.name,
        given.farthest(pushes, told, expected), horizontal, float(off), confidence, pushes,
    )  # fmt: skip


_NONE = 1e-9
"""A variance below this is none, of a shape whose size is 1."""

_SIZES = 80
_WIDEST = 30.0


class _Given:
    """Numbers with a normal error, seen of a shape whose size is unknown."""

    def __init__(
        self, mean: FloatArray, prior: FloatArray, y: FloatArray, errors: FloatArray
    ) -> None:
        self.mean, self.prior, self.y = mean, prior, y
        # exact numbers have the error of rounding
        scale = float(np.abs(y).max()) or 1.0
        self._errors = errors + np.eye(y.size) * (1e-6 * scale) ** 2
        # one decomposition serves every size: both covariances become diagonal
        root = np.linalg.cholesky(self._errors)
        half = np.linalg.solve(root, np.linalg.solve(root, prior).T)
        values, vectors = np.linalg.eigh((half + half.T) / 2)
        self._values = np.maximum(values, 0.0)
        self._whiten = vectors.T @ np.linalg.inv(root)
        self._y, self._mean = self._whiten @ y, self._whiten @ mean

    def _likelihood(self, sizes: FloatArray) -> FloatArray:
        variance = 1 + np.square(sizes)[:, None] * self._values
        squares = (self._y - sizes[:, None] * self._mean) ** 2 / variance
        result: FloatArray = -0.5 * (np.log(variance) + squares).sum(axis=1)
        return result

    def sizes(self, known: float | None) -> tuple[FloatArray, FloatArray]:
        """Sizes and their weights: the likelihood on a grid of their logarithm, flat beforehand."""
        if known is not None:
            return np.array([known]), np.ones(1)
        weight = 1 / (np.diag(self._errors) + (0.2 * np.abs(self.y)) ** 2)
        first = float(weight @ (self.mean * self.y)) / float(weight @ self.mean**2)
        if not first > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )
        low, high = np.log(first / _WIDEST), np.log(first * _WIDEST)
        for _ in range(3):  # to where the likelihood is
            sizes = np.exp(np.linspace(low, high, _SIZES))
            likelihood = self._likelihood(sizes)
            weights = np.exp(likelihood - likelihood.max())
            there = np.flatnonzero(weights > 1e-6)
            low = np.log(sizes[max(there[0] - 1, 0)])
            high = np.log(sizes[min(there[-1] + 1, _SIZES - 1)])
        return sizes, weights / weights.sum()

    def pull(self, sizes: FloatArray) -> FloatArray:
        """What the covariance with a place is multiplied with to move its mean, shape (sizes, n)."""
        square = np.square(sizes)[:, None]
        rest = (self._y - sizes[:, None] * self._mean) / (1 + square * self._values)
        result: FloatArray = square * rest @ self._whiten
        return result

    def gain(self, across: FloatArray, size: float) -> FloatArray:
        """How places follow the numbers, shape (places, n); `across`: their covariance, of size 1."""
        turned = across @ self._whiten.T * (size**2 / (1 + size**2 * self._values))
        result: FloatArray = turned @ self._whiten
        return result

    def distance(self, size: float) -> float:
        """Squared distance of the numbers from the shape of this size: chi^2 where the medium belongs."""
        rest = (self._y - size * self._mean) ** 2 / (1 + size**2 * self._values)
        return float(rest.sum())

    def horizontal(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Strength of alpha_x relative to alpha_z, as the known media have it 1, and error of its logarithm.

        Generalised least squares with one factor for each component; NaN where one was not seen.
        """
        if is_x.all() or not is_x.any():
            return float("nan"), float("nan")
        design = np.stack([np.where(is_x, 0.0, self.mean), np.where(is_x, self.mean, 0.0)], axis=1)
        scale = np.sqrt(1 + size**2 * self._values)
        weighted = self._whiten @ design / scale[:, None]
        covariance = np.linalg.pinv(weighted.T @ weighted)
        z, x = (float(factor) for factor in covariance @ weighted.T @ (self._y / scale))
        if min(z, x) <= 0:
            return 0.0, float("nan")
        variance = (
            covariance[0, 0] / z**2 + covariance[1, 1] / x**2 - 2 * covariance[0, 1] / (z * x)
        )
        return x / z, float(np.sqrt(max(variance, 0.0)))

    def farthest(self, pushes: Pushes, told: npt.NDArray[np.bool_], size: float) -> Push:
        """The number that differs most from what the others make it, in units of its error."""
        precision = self._whiten.T / (1 + size**2 * self._values) @ self._whiten
        spread = 1 / np.diag(precision)
        off = precision @ (self.y - size * self.mean) * spread
        worst = int(np.argmax(np.abs(off) / np.sqrt(spread)))
        component, push = divmod(int(np.flatnonzero(told)[worst]), pushes.beta.size)
        beta_deg, gamma_deg = np.degrees(pushes.beta[push]), np.degrees(pushes.gamma[push])
        return Push(
            float(beta_deg), float(gamma_deg), "zx"[component], float(self.y[worst]), float(self.y[worst] - off[worst]),
            float(np.sqrt(spread[worst])),
        )  # fmt: skip


class Push(NamedTuple):
    """One number of a push beside what the other pushes and the known shape make it, N/cm^3."""

    beta_deg: float
    gamma_deg: float
    component: str
    found: float
    expected: float
    error: float


LEAST_VARIANCE = 1e-9
"""Of the largest: directions in which alpha varies less are left out of its error."""


def root(covariance: FloatArray) -> FloatArray:
    """Rows whose products are a covariance: normal numbers times them have it."""
    values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
    keep = values > LEAST_VARIANCE * max(float(values[-1]), 1e-300)
    result: FloatArray = (vectors[:, keep] * np.sqrt(values[keep])).T
    return result


def _same_direction(
    beta: float, gamma: float, betas: FloatArray, gammas: FloatArray
) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Nodes that are a direction or its mirror image, and the sign of alpha_x there."""
    found, signs = [], []
    for image, sign in (((beta, gamma), 1.0), (mirror(beta, gamma), -1.0)):
        off_beta = np.degrees(betas - float(image[0]))
        off_gamma = np.degrees(gammas - float(image[1]))
        near = (np.abs((off_beta + 90) % 180 - 90) <= SAME_DIRECTION_DEG) & (
            np.abs((off_gamma + 180) % 360 - 180) <= SAME_DIRECTION_DEG
        )
        found.append(np.flatnonzero(near))
        signs.append(np.full(found[-1].size, sign))
    places, first = np.unique(np.concatenate(found), return_index=True)
    return places, np.concatenate(signs)[first]


@dataclass(frozen=True)
class Map:
    """Alpha over all directions, estimated from pushes: made by `estimate_map`.

    Parameters
    ----------
    name : str
        Of the medium.
    beta, gamma : numpy.ndarray, shape (n,)
        Its nodes, rad; together with their mirror images they make a whole grid.
    alpha : numpy.ndarray, shape (2, n)
        z and x, N/cm^3.
    factor : numpy.ndarray, shape (r, 2, n)
        Rows which, each times an independent standard normal number, add up to the error of alpha.
    measured : numpy.ndarray of bool, shape (n,)
        Whether the node was pushed: its alpha is then what was measured.
    size : float
        Root mean square of alpha over the published grid, N/cm^3.
    distance : float
        Chi squared of the pushes about the shape.
    dof : int
        Its degrees of freedom; 0: one number tells the size alone.
    pushes : int
    known : str
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

    Examples
    --------
    >>> import pandas as pd, rftfit
    >>> pushes = pd.DataFrame({"beta_deg": [0, 60], "gamma_deg": [90, 45],
    ...                        "alpha_z_N_per_cm3": [0.35, 0.2], "alpha_x_N_per_cm3": [0, 0.1]})
    >>> sand = rftfit.estimate_map(pushes)
    >>> forces = rftfit.predict(sand.profile, rftfit.model_leg("c_leg"))
    """

    name: str
    beta: FloatArray
    gamma: FloatArray
    alpha: FloatArray
    factor: FloatArray = field(repr=False)
    measured: npt.NDArray[np.bool_]
    size: float
    distance: float
    dof: int
    pushes: int
    known: str
    farthest: Push | None = None
    horizontal: float = float("nan")
    horizontal_off: float = float("nan")
    confidence: float = 0.95
    given: Pushes | None = field(default=None, repr=False)

    @cached_property
    def _drawn(self) -> tuple[FloatArray, float]:
        """Draws in which the medium takes energy at every node, and the share of those that do not."""
        draws, share = passive_draws(self.alpha, self.factor, self.gamma, ~self.measured)
        if len(draws) < FEWEST_DRAWS:
            raise InputError(
                f"in {share:.1%} of the draws the medium gives energy back where it was not pushed: look "
                "at the signs of alpha and at the angles"
            )
        return draws, share

    @property
    def draws(self) -> FloatArray:
        """Draws of alpha within its errors, shape (draws, 2, n); each takes energy in every direction."""
        return self._drawn[0]

    @property
    def not_passive(self) -> float:
        """Share of the draws that was left out, because the medium would give energy back."""
        return self._drawn[1]

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
        from scipy.special import erfc, gammaincc

        if not self.dof:
            return float("nan")
        chances = [float(gammaincc(self.dof / 2, self.distance / 2))]
        if not np.isnan(self.horizontal_off):
            chances.append(float(erfc(self.horizontal_off / np.sqrt(2))))
        return min(len(chances) * min(chances), 1.0)

    @property
    def profile(self) -> TableProfile:
        """What answers alpha(beta, gamma), with draws for its intervals."""
        found = self.bare_profile
        found.spread = TableProfile(self.draws[:, 0], self.draws[:, 1], self.beta, self.gamma)
        return found

    @property
    def bare_profile(self) -> TableProfile:
        """`profile` without draws, which take a moment."""
        of = f" of {self.name}" if self.name else ""
        pushes = "1 push" if self.pushes == 1 else f"{self.pushes} pushes"
        name = f"map{of} from {pushes} and the shape of {self.known}"
        return TableProfile(self.alpha[0], self.alpha[1], self.beta, self.gamma, name)

    @property
    def zeta(self) -> tuple[float, float, float]:
        """Scaling factor of the nine terms fitted to the map (least squares), with its interval."""
        best, many = (
            vertical_penetration(self.coefficients(alpha)) for alpha in (self.alpha, self.draws)
        )
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
            ``alpha_z_hi_N_per_cm3``, the same of ``alpha_x``; ``source``: measured or estimated.
        """
        import pandas as pd

        return pd.DataFrame(self.columns())

    def columns(self) -> dict[str, npt.NDArray[np.generic]]:
        """`table` without pandas.

        Returns
        -------
        dict of str to numpy.ndarray, shape (n,)
        """
        columns: dict[str, npt.NDArray[np.generic]] = {
            "beta_deg": np.degrees(self.beta), "gamma_deg": np.degrees(self.gamma),
        }  # fmt: skip
        # what is 0 by symmetry is so to the last digit
        ends = np.round(interval(self.draws, self.confidence), 12) + 0.0
        for place, component in enumerate("zx"):
            for end, values in zip(("", "_lo", "_hi"), (self.alpha, *ends), strict=True):
                columns[column(component, end)] = values[place]
        columns["source"] = np.where(self.measured, "measured", "estimated")
        return columns


LEAST_WORK = 0.02
"""A medium that gives back less than this share of its largest alpha is within rounding."""


def work(alpha: FloatArray, gamma: FloatArray) -> FloatArray:
    """Energy that a medium takes, per area, depth and way, N/cm^3; `alpha`: shape (..., 2, n)."""
    return alpha[..., 0, :] * np.sin(gamma) + alpha[..., 1, :] * np.cos(gamma)


def passive_draws(
    alpha: FloatArray, factor: FloatArray, gamma: FloatArray, judged: npt.NDArray[np.bool_]
) -> tuple[FloatArray, float]:
    """Draws in which the medium takes energy at the nodes that are judged, and the share of others.

    `alpha`: shape (2, n). `factor`: shape (r, 2, n), as of a `Map`. `gamma`: rad, shape (n,).
    `judged`: shape (n,). Returns draws, shape (draws, 2, n).
    """
    random = np.random.default_rng(SEED)
    kept: list[FloatArray] = []
    tried = 0
    least = -LEAST_WORK * np.abs(alpha).max()
    while tried < _MOST_DRAWN and sum(map(len, kept)) < DRAWS:
        draws = alpha + np.tensordot(random.standard_normal((DRAWS, len(factor))), factor, axes=1)
        takes = (work(draws, gamma) >= least) | ~judged
        kept.append(draws[takes.all(axis=-1)])
        tried += 1
    share = 1 - sum(map(len, kept)) / (tried * DRAWS)
    return np.concatenate(kept)[:DRAWS], share
