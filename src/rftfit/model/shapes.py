"""Alpha over all directions from any number of pushes, by the shape that granular media share.

Alpha over the angles has nearly the same shape in all dry granular media. The shape of known media is
taken as what is known beforehand, and every push corrects it:

    alpha = s (m + d),   d ~ N(0, lambda (C + (1 - w) K + w R)),   the medium takes energy everywhere

with the unknown size s of this medium, the mean shape m and the covariance C of the known media, and for how
a further medium may differ from them all a smooth covariance K and a rough one R. The pushes tell s, how far
the medium departs from the known shape (lambda) and how roughly (w). Draws of all of it are the map: their
mean is its number, their quantiles are its interval.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from importlib.resources import files
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.campaign.tables import ALPHA
from rftfit.conventions import FloatArray, mirror
from rftfit.errors import InputError
from rftfit.measure.alpha import SAME_DIRECTION_DEG, alpha_columns, column, directions, flagged
from rftfit.model.draws import draws_of, errors_known, interval
from rftfit.model.fourier import fit_lsq, kept_terms
from rftfit.model.profiles import TableProfile
from rftfit.model.scaling import PAPER_RULE, vertical_penetration
from rftfit.model.symmetry import rectangle
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA

Angles = tuple[FloatArray, FloatArray]

DRAWS, SEED = 1000, 2013
"""Draws of a map behind its intervals, and their seed."""

FEWEST_DRAWS = 100
"""With fewer of them there is no map."""

_MOST_DRAWN = 60
"""So many times the wanted draws are made at most to find enough in which the medium takes energy."""

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
        exact = 1e-6 * np.abs(mean).max() * np.eye(int(free.sum()))
        whole = _Given(
            mean[free], prior[np.ix_(free, free)], mean[free], exact**2, np.linalg.inv(exact)
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

    def prior(self, beta: FloatArray, gamma: FloatArray) -> _Prior:
        """What is known of a further medium of size 1 before a push, at directions of shape (n,)."""
        known = self.of_media(beta, gamma)
        mean, count, by = known.mean(axis=0), len(known), self.variation
        between = (known - mean) * np.sqrt(by.media * (1 + 1 / count) / (count - 1))
        amplitude = by.floor + by.share * np.abs(mean)
        level = by.floor + by.share * np.abs(self.of_media(*_GRID).mean(axis=0))
        smooth = np.outer(amplitude, amplitude) * _alike(beta, gamma, partial(_smooth, by))
        return _Prior(
            mean, between, smooth, np.mean(level**2) * _alike(beta, gamma, partial(_rough, by))
        )

    def moments(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean, shape (2 n,), and covariance, shape (2 n, 2 n), of a medium of size 1, lambda 1 and w 0."""
        prior = self.prior(beta, gamma)
        return prior.mean, prior.covariance(0.0)


class _Prior(NamedTuple):
    """Mean shape; rows whose products are C; K; R."""

    mean: FloatArray
    between: FloatArray
    smooth: FloatArray
    rough: FloatArray

    def covariance(self, own: float) -> FloatArray:
        """C + (1 - w) K + w R, `own`: w."""
        return self.between.T @ self.between + (1 - own) * self.smooth + own * self.rough


def _alike(
    beta: FloatArray, gamma: FloatArray, kernel: Callable[[FloatArray, FloatArray], FloatArray]
) -> FloatArray:
    """Correlation of functions on the torus of (2 beta, gamma) that have the symmetry of alpha.

    Of alpha_z the part that is even under the mirror, with a variance of 1 everywhere; of alpha_x the
    odd part, whose variance goes to 0 where a direction is its own mirror image.
    """

    def between(other: Angles) -> FloatArray:
        # the chords between two points of each circle
        return kernel(
            2 * np.sin(beta[:, None] - other[0]), 2 * np.sin((gamma[:, None] - other[1]) / 2)
        )

    direct, turned = between((beta, gamma)), between(mirror(beta, gamma))
    size = np.sqrt(1 + np.diag(turned))
    nothing = np.zeros_like(direct)
    even = (direct + turned) / size / size[:, None]
    return np.block([[even, nothing], [nothing, direct - turned]])


def _smooth(by: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Kernel of K over chords."""
    smooth = np.hypot(beta / by.smooth_beta, gamma / by.smooth_gamma)
    result: FloatArray = by.smooth * np.exp(-(smooth**2) / 2)
    result += (1 - by.smooth) * _matern(np.hypot(beta / by.rough_beta, gamma / by.rough_gamma))
    return result


def _rough(by: Variation, beta: FloatArray, gamma: FloatArray) -> FloatArray:
    """Kernel of R over chords."""
    return _matern(np.hypot(beta / by.own_beta, gamma / by.own_gamma))


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
    pushes: pd.DataFrame, shapes: Shapes | None = None, confidence: float = 0.95, name: str = "",
    *, beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = (),
) -> Map:  # fmt: skip
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
    beta_deg, gamma_deg : array_like, optional
        Lines of the map's grid beside those of the published one, degrees.

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
    nodes = grid(beta_deg, gamma_deg)
    return estimate(sorted_pushes(pushes), shapes, nodes, confidence=confidence, name=name)


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
    prior = shapes.prior(
        np.concatenate([nodes[0], pushes.beta]), np.concatenate([nodes[1], pushes.gamma])
    )
    seen = np.arange(prior.mean.size).reshape(2, -1)[:, nodes[0].size :].ravel()
    y, errors = pushes.alpha.ravel(), pushes.covariance
    # symmetry leaves some numbers no freedom: they tell nothing of the medium
    used = np.isfinite(y) & np.isfinite(np.diag(errors)) & (np.diag(prior.smooth)[seen] > _NONE)
    if not used.any():
        raise ValueError("no push has a number that tells of the medium")
    posterior = _Posterior(
        prior, seen[used], y[used], errors[np.ix_(used, used)], shapes.variation, size
    )
    kept = _PushedNodes(nodes, pushes, used)
    draws, share = posterior.draws(kept, nodes[1])
    usual = posterior.given[0]
    expected = usual.expected(size)
    horizontal, seen_error = usual.horizontal(np.flatnonzero(used) >= pushes.beta.size, expected)
    # NaN stays: without both components there is nothing to compare
    if horizontal == 0:
        off = 1 / seen_error
    else:
        off = abs(np.log(horizontal)) / shapes.horizontal_error(seen_error)
    return Map(
        name, *nodes, draws, kept.measured, share, expected, usual.distance(expected),
        y[used].size - 1, made, shapes.name,
        usual.farthest(pushes, used, expected), horizontal, float(off), confidence, pushes,
    )  # fmt: skip


_NONE = 1e-9
"""A variance below this is none, of a shape whose size is 1."""

_SIZES = 32
_WIDEST = 30.0
_HIDDEN = 10.0
"""Sizes below so many standard errors of the best push are hidden by it."""
_OWN = 5
"""Values of w; the first is 0."""
_DEPARTURES = np.exp(0.28 * np.arange(-4, 12))
"""Values of lambda: beyond them lies 0.1 % of what is known of it beforehand."""


class _PushedNodes:
    """Nodes of the map that were pushed: each keeps its measured value and the error of that value."""

    def __init__(self, nodes: Angles, pushes: Pushes, used: npt.NDArray[np.bool_]) -> None:
        count, every = nodes[0].size, pushes.beta.size
        self.measured = np.zeros(count, dtype=bool)
        there, rows, signs = [], [], []
        # numbers of the pushes that tell of the medium, in their order
        place = np.cumsum(used) - 1
        for push, (beta, gamma) in enumerate(zip(pushes.beta, pushes.gamma, strict=True)):
            own, turned = _same_direction(beta, gamma, *nodes)
            if not used[push]:  # without a vertical component it is no cell
                continue
            self.measured[own] = True
            for component, sign in enumerate((np.ones(own.size), turned)):
                if used[row := component * every + push]:
                    there.append(component * count + own)
                    rows.append(np.full(own.size, place[row]))
                    signs.append(sign)
        self.there = np.concatenate([np.zeros(0, int), *there])
        self.rows = np.concatenate([np.zeros(0, int), *rows])
        self.signs = np.concatenate([np.zeros(0), *signs])

    def put(self, into: FloatArray, numbers: FloatArray) -> None:
        """Numbers of the pushes, shape (..., pushes), into those of the nodes, shape (..., 2 n)."""
        into[..., self.there] = self.signs * numbers[..., self.rows]


class _Posterior:
    """What pushes tell of a medium: its size, its departure lambda and the share w of R, on a grid.

    `seen`: places of the numbers y in the prior; the places before them are nodes, z first.
    """

    def __init__(
        self, prior: _Prior, seen: npt.NDArray[np.intp], y: FloatArray, errors: FloatArray,
        by: Variation, size: float | None,
    ) -> None:  # fmt: skip
        self.prior, self.seen, self.y = prior, seen, y
        self.own = np.linspace(0, by.most_own, _OWN)
        self._each = [prior.covariance(own) for own in self.own]
        # exact numbers have the error of rounding
        scale = float(np.abs(y).max()) or 1.0
        rounded = errors + np.eye(y.size) * (1e-6 * scale) ** 2
        self._noise = np.linalg.cholesky(rounded).T
        whiten = np.linalg.inv(self._noise.T)
        self.given = [
            _Given(prior.mean[seen], each[np.ix_(seen, seen)], y, rounded, whiten)
            for each in self._each
        ]
        # seven digits of what is random are enough
        self._roots = [_rows(each).astype(np.float32) for each in self._each]
        half = by.departure_dof / 2
        before = -half * np.log(_DEPARTURES) - (half + 1) / _DEPARTURES
        ends = np.where(np.isin(np.arange(_OWN), (0, _OWN - 1)), 0.5, 1.0)
        beforehand = np.log(ends)[:, None, None] + before[:, None]
        self.sizes, self.weights = _weighed(self.given, _DEPARTURES, beforehand, size)

    def draws(self, kept: _PushedNodes, gamma: FloatArray) -> tuple[FloatArray, float]:
        """Draws of alpha at the nodes, shape (draws, 2, n), and the share left out as they give energy back.

        `gamma`: of the nodes, rad.
        """
        random = np.random.default_rng(SEED)
        at = np.arange(self.prior.mean.size).reshape(2, -1)[:, : gamma.size].ravel()
        found: list[FloatArray] = []
        tried = 0
        while tried < _MOST_DRAWN and sum(map(len, found)) < DRAWS:
            draws = self._some(at, kept, random).reshape(DRAWS, 2, -1)
            least = -LEAST_WORK * np.abs(draws).max(axis=(1, 2))
            takes = (work(draws, gamma) >= least[:, None]) | kept.measured
            found.append(draws[takes.all(axis=-1)])
            tried += 1
        drawn = np.concatenate(found)
        share = 1 - len(drawn) / (tried * DRAWS)
        if len(drawn) < FEWEST_DRAWS:
            raise ValueError(
                f"in {share:.1%} of the draws the medium gives energy back where it was not pushed: look "
                "at the signs of alpha and at the angles"
            )
        drawn = drawn[:DRAWS]
        # of what was measured the mean is the number itself
        flat = drawn.reshape(len(drawn), -1)
        centre = flat.mean(axis=0)
        kept.put(centre, self.y)
        flat += centre - flat.mean(axis=0)
        return drawn, share

    def _some(
        self, at: npt.NDArray[np.intp], kept: _PushedNodes, random: np.random.Generator
    ) -> FloatArray:
        """Draws of size, departure and roughness, and of the shape given them and the pushes.

        A medium and errors are drawn from what is known beforehand and corrected by what its pushes would
        differ from those made (Matheron's rule).
        """
        where = (np.arange(DRAWS) + random.random()) / DRAWS
        chosen = np.searchsorted(np.cumsum(self.weights.ravel())[:-1], random.permutation(where))
        own, departure, size = np.unravel_index(chosen, self.weights.shape)
        s, wide = self.sizes[size][:, None], _DEPARTURES[departure][:, None]
        noise = random.standard_normal((DRAWS, self.y.size)) @ self._noise
        result = np.empty((DRAWS, at.size))
        for place, given in enumerate(self.given):
            mine = own == place
            rows, towards = self._roots[place], self._each[place][self.seen]
            normals = random.standard_normal((int(mine.sum()), len(rows)), np.float32)
            medium = s[mine] * (self.prior.mean + np.sqrt(wide[mine]) * (normals @ rows))
            off = self.y - medium[:, self.seen] - noise[mine]
            variance = s[mine] ** 2 * wide[mine]
            result[mine] = medium[:, at] + variance * given.solved(off, variance) @ towards[:, at]
        kept.put(result, self.y - noise)
        return result


def _rows(covariance: FloatArray) -> FloatArray:
    """Rows whose products are a covariance; what has no variance is exactly 0."""
    variance = np.diag(covariance)
    rows = np.linalg.cholesky(covariance + np.eye(variance.size) * _NONE * variance.max()).T
    return np.where(variance > _NONE, rows, 0.0)


def _weighed(
    given: list[_Given], departures: FloatArray, beforehand: FloatArray, known: float | None
) -> tuple[FloatArray, FloatArray]:
    """Sizes, on a grid of their logarithm, and the weight of each w, lambda and size, which sum to 1.

    Sizes are equally likely beforehand in their logarithm, but those that the errors would hide in
    themselves: a push where a medium has no force would fit the weakest one best.
    """
    middle = given[0].first if known is None else known
    low, high = np.log(middle / _WIDEST), np.log(middle * _WIDEST)
    for _ in range(3):  # to where the likelihood is
        sizes = np.exp(np.linspace(low, high, _SIZES)) if known is None else np.array([known])
        logarithm = beforehand + np.stack([one.likelihood(sizes, departures) for one in given])
        logarithm += np.log(sizes / (sizes + _HIDDEN * given[0].least_error))
        weights = np.exp(logarithm - logarithm.max())
        there = np.flatnonzero(weights.max(axis=(0, 1)) > 1e-6)
        low = np.log(sizes[max(there[0] - 1, 0)])
        high = np.log(sizes[min(there[-1] + 1, sizes.size - 1)])
    return sizes, weights / weights.sum()


class _Given:
    """Numbers with a normal error, seen of a shape whose size and departure are unknown.

    `whiten`: makes their errors independent and 1.
    """

    def __init__(
        self, mean: FloatArray, prior: FloatArray, y: FloatArray, errors: FloatArray, whiten: FloatArray,
    ) -> None:  # fmt: skip
        self.mean, self.y = mean, y
        own = np.diag(errors) - (USUAL_PERCENT / 100 * y) ** 2
        self.least_error = float(np.sqrt(np.maximum(own, 0.0).min()))
        # one decomposition serves every size: both covariances become diagonal
        values, vectors = np.linalg.eigh(whiten @ prior @ whiten.T)
        self._values = np.maximum(values, 0.0)
        self._whiten = vectors.T @ whiten
        self._y, self._mean = self._whiten @ y, self._whiten @ mean
        weight = 1 / (np.diag(errors) + (0.2 * np.abs(y)) ** 2)
        self.first = float(weight @ (mean * y)) / float(weight @ mean**2)
        if not self.first > 0:
            raise ValueError(
                "the pushes meet no resistance: look at the signs of alpha and at the angles"
            )

    def likelihood(self, sizes: FloatArray, departures: FloatArray) -> FloatArray:
        """Its logarithm, shape (departures, sizes)."""
        variance = 1 + (departures[:, None] * sizes**2)[..., None] * self._values
        squares = (self._y - sizes[:, None] * self._mean) ** 2 / variance
        return np.asarray(-0.5 * (np.log(variance) + squares).sum(axis=-1))

    def expected(self, known: float | None) -> float:
        """Size of a medium that departs as the known ones do."""
        sizes, weights = _weighed([self], np.ones(1), np.zeros((1, 1, 1)), known)
        return float(weights[0, 0] @ sizes)

    def solved(self, off: FloatArray, variance: FloatArray) -> FloatArray:
        """Inverse covariance of the numbers times `off`, (draws, n); `variance`: s^2 lambda, (draws, 1)."""
        return np.asarray((off @ self._whiten.T / (1 + variance * self._values)) @ self._whiten)

    def distance(self, size: float) -> float:
        """Squared distance of the numbers from the shape of this size: chi^2 where the medium belongs."""
        rest = (self._y - size * self._mean) ** 2 / (1 + size**2 * self._values)
        return float(rest.sum())

    def horizontal(self, is_x: npt.NDArray[np.bool_], size: float) -> tuple[float, float]:
        """Strength of alpha_x relative to alpha_z, as the known media have it 1, and error of its logarithm.

        Generalised least squares with one factor for each component; NaN where one was not seen. Where one
        is not positive: 0, and the error of their difference in units of it.
        """
        if is_x.all() or not is_x.any():
            return float("nan"), float("nan")
        design = np.stack([np.where(is_x, 0.0, self.mean), np.where(is_x, self.mean, 0.0)], axis=1)
        scale = np.sqrt(1 + size**2 * self._values)
        weighted = self._whiten @ design / scale[:, None]
        covariance = np.linalg.pinv(weighted.T @ weighted)
        z, x = (float(factor) for factor in covariance @ weighted.T @ (self._y / scale))
        if min(z, x) <= 0:
            apart = covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]
            return 0.0, float(np.sqrt(max(apart, 0.0))) / abs(z - x)
        variance = (
            covariance[0, 0] / z**2 + covariance[1, 1] / x**2 - 2 * covariance[0, 1] / (z * x)
        )
        return x / z, float(np.sqrt(max(variance, 0.0)))

    def farthest(self, pushes: Pushes, used: npt.NDArray[np.bool_], size: float) -> Push:
        """The number that differs most from what the others make it, in units of its error."""
        precision = self._whiten.T / (1 + size**2 * self._values) @ self._whiten
        spread = 1 / np.diag(precision)
        off = precision @ (self.y - size * self.mean) * spread
        worst = int(np.argmax(np.abs(off) / np.sqrt(spread)))
        component, push = divmod(int(np.flatnonzero(used)[worst]), pushes.beta.size)
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
    return np.asarray((vectors[:, keep] * np.sqrt(values[keep])).T)


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
    draws: FloatArray = field(repr=False)
    measured: npt.NDArray[np.bool_]
    not_passive: float
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
    def alpha(self) -> FloatArray:
        """Mean of the draws, shape (2, n): z and x, N/cm^3."""
        return np.asarray(self.draws.mean(axis=0))

    @property
    def factor(self) -> FloatArray:
        """Rows whose products are the covariance of alpha, shape (draws, 2, n)."""
        return np.asarray((self.draws - self.alpha) / np.sqrt(len(self.draws) - 1))

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
        of = f" of {self.name}" if self.name else ""
        pushes = "1 push" if self.pushes == 1 else f"{self.pushes} pushes"
        name = f"map{of} from {pushes} and the shape of {self.known}"
        found = TableProfile(self.alpha[0], self.alpha[1], self.beta, self.gamma, name)
        found.spread = TableProfile(self.draws[:, 0], self.draws[:, 1], self.beta, self.gamma)
        return found

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
