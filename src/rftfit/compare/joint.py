"""Finds errors that several runs of a medium share (a gain, a turn, an angle), by one joint model of all plate runs.

The alpha of a run is that of its direction, plus a part in proportion to it by its bed, plus a rest:

    y_i = T_c(E(beta_i, gamma_i)) + bed_i E_i + rest_i,    E = s (m + d)

s is the size of the medium, m and d mean and departure of the known shape. E has the prior of the map
(`rftfit.model.maps`), with more freedom where media differ: x against z, pulls and level runs against pushes. T_c is
the change that a *cause* c makes in the runs that share it: another gain from one run on, a mount that turned, plates
that are not at their stated angle. The *size of a cause* is how large this error is: a share, or degrees; 0 is none.

`find_causes` fits the model and ranks all possible causes, the candidates, by their *scores*: first estimates of their
sizes over the errors of these, linear in the size. The best few are decided by the likelihood of the exact
transformation against that of a size that is tolerated. The limit is the quantile of the largest of all scores, so one
rate of false alarms holds for all causes together. A cause that is found is removed from the runs, and the search
begins again.

n is the number of runs, m that of their directions; arrays of shape (2 n,) or (2 m,) have z of all, then x of all.

`docs/theory/checks.md` has the numbers: false alarms, power, and the errors that no data can show.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, angles_of_directions, beta_apart, number_directions
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.measure.flags import remark
from rftfit.measure.slopes import student_limit
from rftfit.model.run_model import Freedom, RunGaussian, Scatter, outer, prior_at
from rftfit.store.chosen import chosen

ALL, HOLDER, FROM_RUN, WINDOW, TREND = "all", "holder", "from-run", "window", "trend"
"""Groups of runs that may share a cause, besides those with one label of the run sheet: all runs; plates at plus or minus
one angle, which one holder holds; runs from one on; runs from one to another; all, by more and more in their order."""


class Kind(NamedTuple):
    """A kind of cause, such as a gain.

    `tolerated`: size up to which it is no fault. `checked_below`: a cause that is not seen counts as checked where the
    least size that would be seen is below this; one that is clearly seen is told in any case. `unit`: unit of sizes,
    ``deg``; empty for a share.
    """

    tolerated: float
    checked_below: float
    unit: str = ""


_CHOSEN, _RUNS = chosen("compare", "causes"), chosen("compare", "runs")

KINDS = {name: Kind(*numbers) for name, numbers in _CHOSEN.kinds.items()}
"""Kinds of causes by name: errors that change alpha or the angles of the runs that share them.

``gain`` of both channels and ``gain-x`` of the one along x, relative; ``turn`` of the mount, deg; ``crosstalk``, share of
the force along z that is added along x; ``beta-offset``, ``gamma-offset`` and ``holder``, deg that are added to angles;
``beta-scale``, relative change of beta."""

_FAMILY = {ALL: ALL, HOLDER: "order", FROM_RUN: "order", WINDOW: "order", TREND: "order"}
"""Family of a group of runs: the causes of a family share a limit. All other groups are labels of the run sheet."""

LEAST_GAIN = 0.05
"""Least gain of a run that a cause may state."""

_REVERSED_GAIN_DIFFERENCE = 2.0
"""Difference of the gains of two parts of the runs, 1 and -1, where one part has the opposite sign."""

_FREEDOM = Freedom(*_RUNS.freedom)
"""How media differ beyond the known shape: in x, in pulls and in level runs."""


@dataclass(frozen=True, eq=False)
class RunSlopes:
    """Slopes of n runs, what the joint model is fitted to.

    `beta_deg`, `gamma_deg`: angles as the runs are filed, shape (n,). `alpha`, `se`: alpha and its standard error by the
    noise of the logs, z and x, N/cm^3, shape (2, n). `mirrored`: whether a run is filed under its mirror image, with the
    other sign of alpha_x, as an extraction is; (n,). `order`: number of each run in the order of the campaign, (n,).
    `labels`: the label of each run, or an empty one, (n,), by name of the column of the run sheet. `tolerance_deg`:
    difference of each angle up to which runs are of one direction.
    """

    beta_deg: FloatArray
    gamma_deg: FloatArray
    alpha: FloatArray
    se: FloatArray
    mirrored: npt.NDArray[np.bool_]
    order: npt.NDArray[np.intp]
    labels: Mapping[str, npt.NDArray[np.str_]] = field(default_factory=dict)
    tolerance_deg: float = TOLERANCE_DEG

    @property
    def size(self) -> int:
        """Number of runs."""
        return self.beta_deg.size

    @property
    def side(self) -> FloatArray:
        """-1 where the sign of alpha_x was turned, else 1; shape (n,)."""
        return np.where(self.mirrored, -1.0, 1.0)


class Cause(NamedTuple):
    """An error that some runs may share, whatever its size.

    `group`: how the runs are grouped: by a column of the run sheet, or `ALL`, `HOLDER`, `FROM_RUN`, `WINDOW`, `TREND`.
    `place`: which runs of the group: a label, the angle of a holder, or the numbers of the first and last run, as texts.
    `kind`: one of `KINDS`. `share`: factor on the size of the cause in each run, shape (n,): 1/2 in the runs that share
    it and -1/2 in the others, or 1 and 0. `effect`: change of alpha by a cause of size 1, shape (2 n,), z first.
    `reversed_side`: where a gain besides has the opposite sign in a part of the runs, the sign of `share` in these; else 0.
    """

    group: str
    place: str
    kind: str
    share: FloatArray
    effect: FloatArray
    reversed_side: int = 0

    @property
    def name(self) -> tuple[str, str, str]:
        """Group, place and kind, which name the cause in any model of the same runs."""
        return self[:3]

    @property
    def spread_of_media(self) -> float:
        """Standard deviation of a cause of all runs over sound media and ordinary mounts; 0 if it has none.

        The known shape alone shows a turn of all runs, and each medium has its own departure from it.
        """
        return float(_CHOSEN.of_media.get(self.kind, 0.0)) if self.group == ALL else 0.0

    @property
    def tolerated(self) -> float:
        """Size that is no fault; 0 where `spread_of_media` is a part of the error instead."""
        return 0.0 if self.spread_of_media else KINDS[self.kind].tolerated

    @property
    def is_gain(self) -> bool:
        """Whether the cause is a gain of one channel or of both."""
        return self.kind in ("gain", "gain-x")

    @property
    def largest(self) -> float:
        """Largest size that leaves each run a gain of `LEAST_GAIN`; infinite for other kinds."""
        if not self.is_gain:
            return math.inf
        return float((1 - LEAST_GAIN) / np.abs(self.share).max())

    def tolerated_part(self, size: float) -> float:
        """Return the tolerated size, of either sign, that is nearest to a size."""
        return math.copysign(min(self.distance(size), self.tolerated), size)

    def distance(self, size: float) -> float:
        """Return how far a size is from none; a gain of the opposite sign is far away at any size."""
        return _REVERSED_GAIN_DIFFERENCE if self.reversed_side else abs(size)

    @property
    def moves_angles(self) -> bool:
        """Whether the cause changes the angles of its runs; others change their forces."""
        return not self.is_gain and self.kind not in ("turn", "crosstalk")

    def may_reverse(self, size: float) -> bool:
        """Return True if this is a gain and a first estimate of its size is nearer to a reversed force than to none."""
        is_large = abs(size) > _REVERSED_GAIN_DIFFERENCE / 2
        return self.is_gain and self.group != TREND and is_large


class FoundCause(NamedTuple):
    """A cause that was found, with its size and the standard error of the size.

    `errors_beyond`: number of errors by which the size exceeds the tolerated one. `inseparable`: other causes that
    explain the runs about as well.
    """

    cause: Cause
    size: float
    se: float
    errors_beyond: float
    inseparable: tuple[Cause, ...] = ()


class Scan(NamedTuple):
    """Scores of all k candidates, each alone; arrays have shape (k,).

    `size`, `se`: first estimate of the size and its standard error. `separable`: whether the runs can tell the cause
    from alpha in their directions. `checked`: whether they would besides show a likely size, so that a score within the
    limit is evidence against the cause. `mixed_up`: whether it cannot be told from alpha since its runs have other
    directions than the rest. `limit`: number of errors beyond the tolerated size from which a candidate is a cause;
    causes by order share a limit, causes by label another, and each cause of all runs has one for itself.
    """

    causes: list[Cause]
    size: FloatArray
    se: FloatArray
    separable: npt.NDArray[np.bool_]
    checked: npt.NDArray[np.bool_]
    mixed_up: npt.NDArray[np.bool_]
    limit: FloatArray

    @property
    def tolerated(self) -> FloatArray:
        """Tolerated size of each candidate."""
        return np.array([cause.tolerated for cause in self.causes])

    @property
    def error(self) -> FloatArray:
        """Standard error of the size of each fault, which includes the spread over sound media."""
        return np.hypot(self.se, [cause.spread_of_media for cause in self.causes])

    @property
    def errors_beyond(self) -> FloatArray:
        """Number of errors by which each size exceeds the tolerated one."""
        return np.maximum(np.abs(self.size) - self.tolerated, 0) / self.error

    @property
    def least_seen(self) -> FloatArray:
        """Least size of each candidate that is found with a probability of 80 %, in the unit of its kind."""
        return np.asarray(self.tolerated + (self.limit + _CHOSEN.power_sigmas) * self.error)


@dataclass(eq=False)
class JointModel:
    """Joint model of n runs in m directions, from which the causes that were found are removed.

    Made of `runs`, it has a first guess; `fit` finds its parameters, `scan` scores the candidates, and `remove` returns
    another model, without a cause.

    Parameters
    ----------
    runs : RunSlopes
        In the model all runs of a direction have its angles, and alpha is moved to them.
    angles_deg : (float, float)
        Standard deviations of beta and gamma of a run, deg.

    Attributes
    ----------
    theta : ndarray, shape (4,)
        Logarithms of the size of the medium (N/cm^3), of the factor on the variance of its departure from the known
        shape, of the spread of beds and of the rest (both relative to alpha).
    weight : ndarray, shape (n,)
        Weight of each run: 1, and less for a run that lies far from the others of its direction.
    number : ndarray, shape (n,)
        Number of the direction of each run, from `number_directions`.
    directions, direction_of_run : ndarray, shape (2, m) and (n,)
        Beta and gamma of the directions, deg, and the index of the direction of each run among them.
    prior_mean, prior_covariance, local_variance : ndarray, shape (2 m,), (2 m, 2 m), (2 m,)
        Alpha of the directions, z first, for a medium of size 1: mean, covariance of the departure, and variance of the
        departure that repeats of one direction share.
    mean_around, covariance_around : ndarray, shape (10 m,) and (10 m, 2 m)
        Prior mean of alpha at five points around each direction, for slopes over the angles: itself, a step up and down
        in beta, and one up and down in gamma; in the order of components, points, directions. Its covariance with alpha
        of the directions.
    expected, by_beta, by_gamma : ndarray, shape (2, n)
        Alpha of the direction of each run by prior and data, and its slopes over the angles, per degree.
    transform, log_jacobian : ndarray or None, shape (n, 2, 2), and float
        Linear transformation of the slopes by which causes were removed (None: none was), and the logarithm of its
        Jacobian, by which likelihoods of transformed slopes are compared.
    """

    runs: RunSlopes
    angles_deg: tuple[float, float] = tuple(_RUNS.angles_deg)

    def __post_init__(self) -> None:
        """Sort the runs into directions, make a first guess of `theta`, and move alpha of runs to their directions."""
        self.weight = np.ones(self.runs.size)
        self.log_jacobian = 0.0
        self.transform: FloatArray | None = None
        angles_deg = self.runs.beta_deg, self.runs.gamma_deg
        # numbered only here: removing a cause moves directions, but runs of two directions
        # do not become runs of one
        self.number = number_directions(*angles_deg, tolerance_deg=self.runs.tolerance_deg)
        beta_deg, gamma_deg = angles_of_directions(self.number, *angles_deg)
        off_deg = angles_deg[0] - beta_deg, angles_deg[1] - gamma_deg
        self.runs = replace(self.runs, beta_deg=beta_deg, gamma_deg=gamma_deg)
        self.locate_runs()
        # the size of the medium by least squares, but not next to 0 where runs have wrong signs
        count = self.directions.shape[1]
        prior_mean = self.prior_mean.reshape(2, count)
        mean_of_runs = prior_mean[:, self.direction_of_run]
        size = float((mean_of_runs * self.runs.alpha).sum() / (mean_of_runs**2).sum())
        least = 0.05 * float(np.abs(self.runs.alpha).sum() / np.abs(mean_of_runs).sum())
        size = max(size, least)
        self.theta = np.log([size, 1.0, USUAL_BED_SPREAD, _RUNS.start_rest])
        medians = [
            np.median(self.runs.alpha[:, self.direction_of_run == direction], axis=1)
            for direction in range(count)
        ]
        # slopes over the angles are those of the known shape; alpha is mostly that of the runs
        self._set_expected(size * self.mean_around)
        start = 0.8 * np.stack(medians, axis=1) + 0.2 * size * prior_mean
        self.expected = start[:, self.direction_of_run]
        # alpha of each run is moved from its own angles to those of its direction
        moved = self.by_beta * off_deg[0] + self.by_gamma * off_deg[1]
        self.runs = replace(self.runs, alpha=self.runs.alpha - moved)

    # --- the prior

    def locate_runs(self) -> None:
        """Sort runs into directions, and set the prior there and, for its slopes over the angles, a few degrees away."""
        self._sort_into_directions()
        beta, gamma = self.directions
        step = _RUNS.difference_deg
        betas = np.concatenate([beta, beta + step, beta - step, beta, beta])
        gammas = np.concatenate([gamma, gamma, gamma, gamma + step, gamma - step])
        self.mean_around, covariance = prior_of_media(betas, gammas, _RUNS.rough_share)
        # indices of the directions themselves, z and x, among all these numbers
        itself = np.arange(10 * beta.size).reshape(2, 5, -1)[:, 0].ravel()
        self.covariance_around = covariance[:, itself]
        self._set_prior(self.mean_around[itself], self.covariance_around[itself])

    def _sort_into_directions(self) -> None:
        """Set `directions` and `direction_of_run` by the angles of the runs, which may have been moved."""
        # runs of one direction agree to six decimals after all were moved by the same angle
        angles_deg = np.round([beta_apart(self.runs.beta_deg, 0.0), self.runs.gamma_deg], 6)
        directions, direction_of_run = np.unique(
            np.stack([*angles_deg, self.number]), axis=1, return_inverse=True
        )
        self.directions, self.direction_of_run = directions[:2], direction_of_run.ravel()

    def _set_prior(self, mean: FloatArray, covariance: FloatArray) -> None:
        """Set the prior of alpha in the directions, for a medium of size 1; `mean`: (2 m,), `covariance`: (2 m, 2 m)."""
        self.prior_mean = mean
        # so that it can be inverted
        self.prior_covariance = covariance + 1e-8 * np.eye(mean.size)
        self.local_variance = _local_variance(mean, np.bincount(self.direction_of_run))

    def _set_expected(self, alpha_around: FloatArray) -> None:
        """Set alpha of each run's direction and its slopes over the angles; `alpha_around`: alpha as in `mean_around`."""
        # shape (2, 5, n)
        points = alpha_around.reshape(2, 5, -1)[:, :, self.direction_of_run]
        itself, beta_above, beta_below, gamma_above, gamma_below = points.swapaxes(0, 1)
        self.expected = itself
        self.by_beta: FloatArray = (beta_above - beta_below) / (2 * _RUNS.difference_deg)
        self.by_gamma: FloatArray = (gamma_above - gamma_below) / (2 * _RUNS.difference_deg)

    # --- the likelihood

    def _scatter(self, theta: FloatArray, weight: FloatArray | None = None) -> FloatArray:
        """Return the covariance of alpha of each run about that of its direction, shape (n, 2, 2), (N/cm^3)^2.

        By its bed, the rest, the noise of its log and its angles. `theta`: see the class. `weight`: of each run, which
        divides the covariance; default: that of the model.
        """
        scatter_of_runs = Scatter(math.exp(theta[2]), math.exp(theta[3]), _RUNS.weak, _RUNS.floor)
        scatter = scatter_of_runs.covariance(self.expected, self.runs.se)
        for error_deg, slopes in zip(self.angles_deg, (self.by_beta, self.by_gamma), strict=True):
            scatter += error_deg**2 * outer(slopes)
        scatter /= (self.weight if weight is None else weight)[:, None, None]
        if self.transform is not None:
            scatter = self.transform @ scatter @ self.transform.transpose(0, 2, 1)
        return scatter

    def _gaussian(self, theta: FloatArray) -> RunGaussian:
        """Return the distribution of the runs about the prior mean; `theta`: see the class."""
        relative = math.exp(theta[1]) * self.prior_covariance + np.diag(self.local_variance)
        shared = math.exp(2 * theta[0]) * relative
        return RunGaussian(self._scatter(theta), self.direction_of_run, shared)

    def _mean(self, theta: FloatArray) -> FloatArray:
        """Return the prior mean of alpha of the runs, N/cm^3, shape (2 n,)."""
        of_runs = self.prior_mean.reshape(2, -1)[:, self.direction_of_run]
        return math.exp(theta[0]) * of_runs.ravel()

    def _residual(self, theta: FloatArray) -> FloatArray:
        """Return alpha of the runs less its prior mean, shape (2 n,)."""
        return self.runs.alpha.ravel() - self._mean(theta)

    def cost(self, theta: FloatArray) -> float:
        """Return the negative logarithm of likelihood times prior of `theta`, up to a constant; what `fit` minimises.

        Infinite where no covariance can be inverted. The prior of the factor on the departure is inverse gamma, as that
        of a variance, with its mode at 1; the logarithms of both scatters are normal about usual ones; any size of the
        medium is as likely.
        """
        residual = self._residual(theta)
        try:
            gaussian = self._gaussian(theta)
            quadratic, log_det = residual @ gaussian.solve(residual), gaussian.log_det
        except np.linalg.LinAlgError:
            # where runs fit no shape at all, as with angles in rad, the search may stray so far
            return math.inf
        half = _RUNS.departure_dof / 2
        of_prior = half * theta[1] + (half + 1) * math.exp(-theta[1])
        usual = np.log([USUAL_BED_SPREAD, _RUNS.rest])
        of_prior += 0.5 * (((theta[2:] - usual) / _RUNS.log_sd) ** 2).sum()
        return float(0.5 * (quadratic + log_det) + of_prior + self.log_jacobian)

    # --- the fit

    def fit(self, rounds: int = 3, evaluations: int = 90, step: float = 1.0) -> None:
        """Find size, departure and scatter, in `theta`, and from them weights of runs and alpha of the directions.

        Each depends on the others, so they are found in rounds. `evaluations`: most evaluations of the cost in the first
        round. `step`: factor of its first steps.
        """
        for round_number in range(rounds):
            # later rounds follow the changes of the weights, which are small
            first = (0.4 if round_number else step) * np.array([0.1, 0.5, 0.3, 0.3])
            most = evaluations // 2 if round_number else evaluations
            self.theta = _minimise(self.cost, self.theta, first, most)
            self.update()

    def update(self) -> None:
        """Set alpha of the directions by the data, at the present `theta`, and the weights of the runs."""
        # mean of a normal distribution that data are known of: its covariance with them times their weighted residuals
        gaussian = self._gaussian(self.theta)
        sums = gaussian.sum_by_direction(gaussian.solve(self._residual(self.theta)))[:, 0]
        departure = math.exp(self.theta[1]) * (self.covariance_around @ sums)
        # repeats of a direction share a departure from the known shape that its neighbours do not show
        departure.reshape(2, 5, -1)[:, 0] += (self.local_variance * sums).reshape(2, -1)
        size = math.exp(self.theta[0])
        self._set_expected(size * self.mean_around + size**2 * departure)
        self.update_weights()

    def update_weights(self) -> None:
        """Set the weight of each run by its distance from alpha by all others (Student's t): far runs count little.

        So a single wrong run neither makes a cause nor hides one.
        """
        residual = self._residual(self.theta).reshape(2, -1)
        predicted, covariance = self._gaussian(self.theta).leave_out(residual)
        off = residual - predicted
        # of the prediction by all others, and of the run itself with its full weight
        covariance = covariance + self._scatter(self.theta, np.ones(self.runs.size))
        distance = np.einsum("in,nij,jn->n", off, np.linalg.inv(covariance), off)
        self.weight = np.clip((_RUNS.t_dof + 2) / (_RUNS.t_dof + distance), 0.02, 1.0)

    # --- causes

    def _shares(self) -> Iterator[tuple[str, str, FloatArray]]:
        """Yield the sets of runs by the order and by the labels of the sheet: `group`, `place` and `share` of `Cause`.

        The share is 1/2 in the runs of the set and -1/2 in the others, so that a cause leaves the size of the medium
        alone; it grows from the one to the other in a trend.
        """
        size = self.runs.size
        # number of each run in the order, from 0
        rank = np.argsort(np.argsort(self.runs.order, kind="stable"), kind="stable")
        yield TREND, "", rank / (size - 1) - 0.5
        edge = least_step(size)
        if size >= _CHOSEN.most_stepped and size > 2 * edge:
            steps = np.linspace(edge, size - edge, min(_CHOSEN.most_steps, size - 2 * edge + 1))
            for step in np.unique(steps.astype(int)):
                yield FROM_RUN, str(step + 1), (rank >= step) - 0.5
            # windows that begin or end with the campaign are steps: they are left out
            ends = np.unique(np.linspace(0, size, _CHOSEN.window_parts + 1)[1:-1].astype(int))
            for first, end in combinations(ends, 2):
                if end - first >= edge:
                    is_inside = (rank >= first) & (rank < end)
                    yield WINDOW, f"{first + 1}-{end}", is_inside - 0.5
        for column, labels in self.runs.labels.items():
            names, counts = np.unique(labels, return_counts=True)
            # two labels divide the runs in one way: one of them is enough
            first = 1 if names.size == 2 else 0
            for label, count in zip(names[first:], counts[first:], strict=True):
                if label and _CHOSEN.fewest_of_label <= count <= size - _CHOSEN.fewest_of_label:
                    yield column, str(label), (labels == label) - 0.5

    def causes(self) -> list[Cause]:
        """List all candidates: each kind that makes sense in each set of runs, with its effect at the present alpha."""
        alpha, side, runs = self.expected, self.runs.side, self.runs
        # change of alpha by a turn of the mount by 1 degree
        turned = math.radians(1) * side * np.stack([alpha[1], -alpha[0]])
        along_x = np.array([[0.0], [1.0]])
        every_run = np.ones(runs.size)
        candidates: list[Cause] = []

        def add(group: str, place: str, kind: str, share: FloatArray, effect: FloatArray) -> None:
            """Add a candidate; `effect`: of shape (2, n)."""
            candidates.append(Cause(group, place, kind, share, effect.ravel()))

        for group, place, share in self._shares():
            add(group, place, "gain", share, share * alpha)
            if group == WINDOW:
                continue
            add(group, place, "turn", share, share * turned)
            add(group, place, "gain-x", share, share * alpha * along_x)
            if group != TREND:
                add(group, place, "beta-offset", share, share * side * self.by_beta)
        # paths that are neither level nor vertical, and plates that are not upright
        is_slanted = (np.abs(runs.gamma_deg) > 1) & (np.abs(np.abs(runs.gamma_deg) - 90) > 1)
        is_tilted = (np.abs(runs.beta_deg) < 89).astype(float)
        add(ALL, "", "turn", every_run, turned)
        add(ALL, "", "crosstalk", every_run, np.stack([0 * alpha[0], side * alpha[0]]))
        add(ALL, "", "beta-scale", is_tilted, runs.beta_deg * is_tilted * self.by_beta)
        add(ALL, "", "beta-offset", every_run, side * self.by_beta)
        add(ALL, "", "gamma-offset", is_slanted.astype(float), is_slanted * side * self.by_gamma)
        # a holder of one angle holds plates at plus and at minus this angle
        for angle in np.unique(np.round(np.abs(self.directions[0]))):
            is_held = np.abs(np.abs(runs.beta_deg) - angle) < 0.6
            share = np.where(is_held, np.sign(runs.beta_deg), 0.0)
            if 0 < angle < 89 and 2 <= np.abs(share).sum() <= runs.size - 4:
                add(HOLDER, f"{angle:g}", "holder", share, share * self.by_beta)
        return candidates

    def remove(self, cause: Cause, size: float) -> JointModel:
        """Return the model of the runs as they would be without a cause of this size: the inverse of T_c.

        Gains, turns and crosstalk transform alpha of each run, linearly; the other kinds move its angles.
        """
        runs, share, side = self.runs, cause.share, self.runs.side
        beta, gamma = runs.beta_deg, runs.gamma_deg
        # of z and x, for each run
        transform = np.tile(np.eye(2), (runs.size, 1, 1))
        log_jacobian = 0.0
        if cause.is_gain:
            gain = np.maximum(1 + size * share, LEAST_GAIN)
            log_jacobian = float(np.log(gain).sum())
            if cause.reversed_side:
                gain = np.where(np.sign(share) == cause.reversed_side, -gain, gain)
            transform[:, 1, 1] /= gain
            if cause.kind == "gain":
                transform[:, 0, 0] /= gain
                log_jacobian *= 2
        elif cause.kind == "turn":
            angle = np.radians(size * share) * side
            transform[:, 0, 0] = transform[:, 1, 1] = np.cos(angle)
            transform[:, 1, 0] = np.sin(angle)
            transform[:, 0, 1] = -np.sin(angle)
        elif cause.kind == "crosstalk":
            transform[:, 1, 0] = -size * side
        elif cause.kind == "beta-scale":
            beta = beta * (1 + size * share)
        elif cause.kind == "gamma-offset":
            gamma = gamma + size * share * side
        else:
            beta = beta + size * share * (side if cause.kind == "beta-offset" else 1.0)
        model = copy(self)
        alpha = np.einsum("nij,jn->in", transform, runs.alpha)
        model.runs = replace(runs, beta_deg=beta, gamma_deg=gamma, alpha=alpha)
        model.log_jacobian = self.log_jacobian + log_jacobian
        model.transform = transform if self.transform is None else transform @ self.transform
        if cause.moves_angles:
            # the slopes over the angles stay: they need five times as many points of the known shape
            model._sort_into_directions()
            model._set_prior(
                *prior_of_media(model.directions[0], model.directions[1], _RUNS.rough_share)
            )
        return model

    def scan(self) -> Scan:
        """Score all candidates, and find the limit that the largest score of sound runs hardly exceeds.

        The scores of a family are correlated normal numbers, so the limit of the largest comes from their correlation.
        """
        from scipy.special import ndtri

        causes = self.causes()
        effects = np.column_stack([cause.effect for cause in causes])
        scores, information = self._gaussian(self.theta).score(
            self._residual(self.theta), self._mean(self.theta), effects
        )
        # of each candidate without the others: its size is score over information
        precision = np.maximum(np.diag(information), 1e-12)
        size = scores / precision
        wider = np.array([_CHOSEN.wider.get(cause.kind, 1.0) for cause in causes])
        se = wider / np.sqrt(precision)
        tolerated, checked_below = np.array([KINDS[cause.kind][:2] for cause in causes]).T
        families = np.array([_FAMILY.get(cause.group, "labels") for cause in causes])
        # candidates that the directions hardly show would only blur the limit of their family
        is_seen = se < 50 * tolerated
        limit_of_one = -float(ndtri(_CHOSEN.nominal_rate / 2))
        limit = np.array(
            [limit_of_one if cause.spread_of_media else _CHOSEN.limit_of_all for cause in causes]
        )
        # of the scatter of the runs: repeats show it, and so does the known shape
        dof = max(self.runs.size - self.directions.shape[1], self.runs.size / 2, 8.0)
        for family in ("order", "labels"):
            members = is_seen & (families == family)
            if members.any():
                root = np.sqrt(precision[members])
                correlation = information[np.ix_(members, members)] / np.outer(root, root)
                normal_limit = _limit_of_largest(correlation, _CHOSEN.nominal_rate)
                limit[families == family] = student_limit(normal_limit, dof)
        grouped = np.array([cause.group not in (ALL, HOLDER) for cause in causes])
        mixed_up = grouped & (se > _CHOSEN.mixed_up * self._error_with_exact_shape(effects))
        separable = is_seen & ~mixed_up
        scan = Scan(causes, size, se, separable, separable, mixed_up, limit)
        return scan._replace(checked=separable & (scan.least_seen < checked_below))

    def _error_with_exact_shape(self, effects: FloatArray) -> FloatArray:
        """Return the standard errors that causes would have if no medium departed from the known shape, shape (k,).

        Where they are much smaller than the true ones, a cause is mixed up with alpha of the directions of its runs.
        `effects`: `Cause.effect` of k causes, shape (2 n, k).
        """
        theta = self.theta.copy()
        # next to no departure
        theta[1] = math.log(1e-4)
        mean = self._mean(theta)
        _, information = self._gaussian(theta).score(mean, mean, effects)
        return 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))

    def errors_at(self, cause: Cause, size: float) -> float:
        """Return by how many errors a size of a cause exceeds the tolerated one, at the scatter of the model.

        By the exact transformation, as `fit_cause`, but without a fit: a fast test whether this is worth while.
        """
        tolerated, whole = (
            self.remove(cause, removed).cost(self.theta)
            for removed in (cause.tolerated_part(size), size)
        )
        return math.sqrt(max(2 * (tolerated - whole), 0.0))

    def fit_cause(self, cause: Cause, size: float, se: float) -> tuple[float, float, JointModel]:
        """Find the best size of a cause, the errors by which it exceeds the tolerated size, and the model without it.

        The scatter is fitted both with the best and with the tolerated size, so a cause cannot win by making errors
        small. `size`, `se`: first estimate and its standard error. Returns the three in this order.
        """
        # the first estimate is linear, and may state a gain below 0
        size = math.copysign(min(abs(size), 0.7 * cause.largest), size)
        step_of_size = max(0.5 * abs(size), se)
        if size > 0.5 * cause.largest:
            # away from the largest size
            step_of_size *= -1
        step = np.array([0.1, 0.3, 0.3, 0.3, step_of_size])
        model = copy(self)

        def cost(theta_and_size: FloatArray) -> float:
            """Cost of `theta` and a size of the cause, shape (5,), infinite beyond the largest size."""
            if abs(theta_and_size[4]) > cause.largest:
                return math.inf
            return model.remove(cause, theta_and_size[4]).cost(theta_and_size[:4])

        def without_cause(theta_and_size: FloatArray) -> JointModel:
            """Model of the runs without the cause of this size, at this `theta`."""
            without = model.remove(cause, theta_and_size[4])
            without.theta = theta_and_size[:4]
            return without

        first = _minimise(cost, np.append(self.theta, size), step, 70, 0.01)
        # a run that lies far from the others because of the cause counts fully without it
        without = without_cause(first)
        without.update_weights()
        model.weight = without.weight
        best = _minimise(cost, first, 0.4 * step, 70, 0.01)
        size = float(best[4])
        tolerated_size = cause.tolerated_part(size)
        tolerated_model = model.remove(cause._replace(reversed_side=0), tolerated_size)
        theta = _minimise(tolerated_model.cost, self.theta, step[:4], 70)
        # twice the logarithm of the likelihood ratio is the square of a standard normal number
        errors_beyond = math.sqrt(max(2 * (tolerated_model.cost(theta) - cost(best)), 0.0))
        return size, errors_beyond, without_cause(best)


def least_step(size: int) -> int:
    """Return the fewest of `size` runs on either side of a step, and in a window of the order: fewer tell nothing."""
    return max(int(_CHOSEN.step_runs), int(_CHOSEN.step_share * size))


def list_untold(runs: int) -> list[str]:
    """List the errors that no check can show in a campaign, whatever its data are; `runs`: most runs of any medium."""
    codes = ("untold-label", "untold-holder", "untold-blocks", "untold-choice", "untold-walls")
    return [str(remark(code, runs=least_step(runs))) for code in codes]


def find_causes(model: JointModel) -> tuple[list[FoundCause], Scan]:
    """Find the causes that runs share, the clearest first, and the scores of all candidates after these are removed.

    One cause is removed at a time, as it also raises the scores of others that it resembles. `model`: as made, not
    fitted; this function fits it.
    """
    model.fit()
    scan = model.scan()
    causes_found: list[FoundCause] = []
    while len(causes_found) < _CHOSEN.most_causes:
        trials = _try_candidates(model, scan)
        clear = [trial for trial in trials if trial.errors_beyond >= trial.limit]
        if not clear:
            break
        # which cause it is depends on the runs alone, not on the spread over sound media
        trial = max(clear, key=lambda trial: trial.errors_by_runs - trial.limit)
        without = trial.model
        without.locate_runs()
        without.update()
        without.fit(2, 50, 0.4)
        scan_without = without.scan()
        se = _error_in(scan_without, trial.cause)
        error = math.hypot(se, trial.cause.spread_of_media)
        # least size that is clear, by the errors without the cause
        clear_from = trial.cause.tolerated + trial.limit * error
        is_clear = trial.cause.distance(trial.size) > clear_from
        likely_is_seen = (
            clear_from + _CHOSEN.power_sigmas * error < KINDS[trial.cause.kind].checked_below
        )
        # without the cause, too, its size must be clear, or a likely one be seen
        if not (is_clear or likely_is_seen):
            break
        rivals = _inseparable_from(trial, trials, scan)
        causes_found.append(FoundCause(trial.cause, trial.size, se, trial.errors_beyond, rivals))
        model, scan = without, scan_without
    return causes_found, scan


def _error_in(scan: Scan, cause: Cause) -> float:
    """Return the standard error of a cause among the candidates of another model; NaN where it is none of them.

    `scan`: scores of that model, in which the cause has the same name.
    """
    errors = (
        se
        for candidate, se in zip(scan.causes, scan.se, strict=True)
        if candidate.name == cause.name
    )
    return float(next(errors, math.nan))


def _inseparable_from(best: _Trial, trials: list[_Trial], scan: Scan) -> tuple[Cause, ...]:
    """Find the other causes that explain the runs about as well as the best one.

    Causes of all runs are seen by the known shape alone, from which each medium departs in its own way. So
    for such a cause others with a score near its score count, too, though a sound medium might have their size.
    `trials`: all candidates that were decided. `scan`: scores from which these were chosen.
    """
    inseparable = {
        trial.cause.name: trial.cause
        for trial in trials
        if trial is not best
        and trial.errors_beyond > trial.limit
        and trial.errors_by_runs > best.errors_by_runs - _CHOSEN.inseparable
    }
    if best.cause.group == ALL:
        scores = {
            cause.name: abs(size) / se
            for cause, size, se in zip(scan.causes, scan.size, scan.se, strict=True)
        }
        inseparable |= {
            cause.name: cause
            for cause in scan.causes
            if cause.group == ALL
            and cause.name != best.cause.name
            and scores[cause.name] > scores[best.cause.name] - _CHOSEN.inseparable
        }
    return tuple(inseparable.values())


class _Trial(NamedTuple):
    """A candidate that the exact transformation has decided.

    `size`: its best size. `errors_beyond`: number of errors by which this exceeds the tolerated one. `errors_by_runs`:
    the same by errors without the spread over sound media. `limit`: of `errors_beyond`, see `Scan`; larger where only
    an unlikely size would be seen. `model`: the model without the cause.
    """

    cause: Cause
    size: float
    errors_beyond: float
    errors_by_runs: float
    limit: float
    model: JointModel


def _try_candidates(model: JointModel, scan: Scan) -> list[_Trial]:
    """Decide the candidates with the largest scores, one for each kind and group.

    The exact transformation takes long, so only candidates that may be the clearest cause are tried.
    """
    # size in its errors, and errors beyond the tolerated size; which of them counts depends on the cause
    scores = np.where(scan.separable, np.abs(scan.size) / scan.se, 0.0)
    beyond = scan.errors_beyond
    has_spread = np.array([cause.spread_of_media > 0 for cause in scan.causes])
    # seen by the known shape alone
    by_shape = np.array([cause.group == ALL for cause in scan.causes]) & ~has_spread
    is_worth_trying = np.where(
        by_shape,
        beyond > _CHOSEN.tried_of_all,
        np.where(has_spread, beyond, scores) > scan.limit - _CHOSEN.ranked_from,
    )
    is_worth_trying &= scan.separable & (beyond > 0) & (scores > scores.max() - _CHOSEN.far_behind)
    trials: dict[tuple[str, str], _Trial] = {}
    for number in np.argsort(-np.where(is_worth_trying, scores, 0.0)):
        cause = scan.causes[number]
        if not is_worth_trying[number] or len(trials) >= _CHOSEN.most_tried:
            break
        if (cause.kind, cause.group) in trials:
            continue
        size, se, limit = (float(column[number]) for column in (scan.size, scan.se, scan.limit))
        if not scan.checked[number]:
            # runs that scatter so much may do so in another way than the model says
            limit *= _CHOSEN.told_wider
            # the known shape at moved angles takes long
            if cause.moves_angles and model.errors_at(cause, size) < _CHOSEN.worth_fitting * limit:
                continue
        # the gain, or besides the opposite sign in the runs that it makes weaker
        variants = [_try_candidate(model, cause, size, se, limit)]
        if cause.may_reverse(size):
            reversed_cause = cause._replace(reversed_side=1 if size < 0 else -1)
            variants.append(_try_candidate(model, reversed_cause, 0.0, se, limit))
        trials[cause.kind, cause.group] = max(variants, key=lambda trial: trial.errors_by_runs)
    return list(trials.values())


def _try_candidate(
    model: JointModel, cause: Cause, first_size: float, se: float, limit: float
) -> _Trial:
    """Decide one candidate: fit its size, and count the errors by which this exceeds what is tolerated.

    `first_size`, `se`: first estimate of its size and standard error. `limit`: see `_Trial`.
    """
    size, errors_beyond, without = model.fit_cause(cause, first_size, se)
    by_runs = errors_beyond / _CHOSEN.wider.get(cause.kind, 1.0)
    distance = cause.distance(size)
    # 0 for a size that is no fault
    by_runs *= distance > cause.tolerated
    # the error by the runs is size / by_runs; the spread over sound media is added in squares
    beyond_spread = by_runs / math.hypot(1.0, cause.spread_of_media * by_runs / (distance or 1.0))
    return _Trial(cause, size, beyond_spread, by_runs, limit, without)


def _limit_of_largest(correlation: FloatArray, rate: float) -> float:
    """Return the limit that the largest of k standard normal scores with this correlation, (k, k), exceeds at a rate.

    By 8000 draws, with a fixed seed, of normal numbers with this correlation.
    """
    values, vectors = np.linalg.eigh((correlation + correlation.T) / 2)
    # a root of the correlation, with rows of length 1: rows times independent normals are the scores
    rows = (vectors * np.sqrt(np.maximum(values, 0)))[:, values > 1e-6]
    rows /= np.sqrt((rows**2).sum(axis=1))[:, None]
    normals = np.random.default_rng(1).standard_normal((8000, rows.shape[1]))
    return float(np.quantile(np.abs(normals @ rows.T).max(axis=1), 1 - rate))


def _minimise(
    cost: Callable[[FloatArray], float],
    start: FloatArray,
    step: FloatArray,
    most: int,
    tolerance: float = 0.02,
) -> FloatArray:
    """Minimise a cost by Nelder-Mead; returns the best parameters, of the shape of `start`.

    `step`: size of the first simplex along each parameter. `most`: most evaluations. `tolerance`: of the parameters.
    """
    from scipy.optimize import minimize

    simplex = np.vstack([start, start + np.diag(step)])
    options = {"maxfev": most, "xatol": tolerance, "fatol": 0.05, "initial_simplex": simplex}
    return np.asarray(minimize(cost, start, method="Nelder-Mead", options=options).x)


def expected_alpha(beta_deg: FloatArray, gamma_deg: FloatArray) -> FloatArray:
    """Return alpha of the known shape, z and x, shape (2, n), for a medium of size 1."""
    mean, _ = prior_of_media(beta_deg, gamma_deg, _RUNS.rough_share)
    return mean.reshape(2, -1)


def prior_of_media(
    beta_deg: FloatArray, gamma_deg: FloatArray, rough_share: float
) -> tuple[FloatArray, FloatArray]:
    """Return mean (2 n,) and covariance (2 n, 2 n) of alpha, z first, for a medium of size 1 at n directions.

    The covariance includes what differs between sound media: `_FREEDOM` of alpha_x, of pulls and of level runs, and
    `rough_share`, the share w of the rough covariance (`rftfit.model.prior`).
    """
    return prior_at(beta_deg, gamma_deg, rough_share, _FREEDOM)


def _local_variance(mean: FloatArray, runs: npt.NDArray[np.intp]) -> FloatArray:
    """Return the variance of the departure that the repeats of a direction share, shape (2 m,), for a medium of size 1.

    `mean`: prior mean of alpha in m directions, (2 m,). `runs`: number of runs in each, (m,). A single run shares none:
    the departure of its direction is a part of its scatter.
    """
    level = np.hypot(*mean.reshape(2, -1))
    variance = (_RUNS.local * level) ** 2 + (_RUNS.local_floor * level.max()) ** 2
    return np.tile(np.where(runs > 1, variance, 0.0), 2)
