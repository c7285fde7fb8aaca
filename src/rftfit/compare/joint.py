"""One joint model of all plate runs of a medium: finds errors that several runs share.

The alpha of a run is that of its direction, plus a part in proportion to it by its bed, plus a rest:

    y_i = T_c(E(beta_i, gamma_i)) + bed_i E_i + rest_i,    E = s (m + d)

E has the prior of the map (`rftfit.model.maps`), with more freedom where media differ: x beside z, pulls and level
runs beside pushes. T_c is the change that a cause makes in the runs that share it: another gain from one run on, a
mount that turned, plates that are not at their stated angle. Candidates are ranked by their scores. The best few are
decided by the likelihood of the exact transformation against that of a size that is tolerated. The limit is the
quantile of the largest of all scores, so one rate of false alarms holds for all causes together.

`docs/theory/checks.md` has the numbers: false alarms, power, and the errors that no data can show.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
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
"""Groups of runs that may share a cause, besides the labels of the run sheet."""


class Kind(NamedTuple):
    """A kind of cause.

    `tolerated`: size up to which it is no fault. `most`: a cause counts as checked where its least size that is seen is
    below this.
    """

    tolerated: float
    most: float
    unit: str = ""


_CHOSEN, _RUNS = chosen("compare", "causes"), chosen("compare", "runs")

KINDS = {name: Kind(*numbers) for name, numbers in _CHOSEN.kinds.items()}

_FAMILY = {ALL: ALL, HOLDER: "order", FROM_RUN: "order", WINDOW: "order", TREND: "order"}
"""Family of a group of runs: the causes of a family share a limit. All other groups are labels of the run sheet."""

_FREEDOM = Freedom(*_RUNS.freedom)


@dataclass(frozen=True, eq=False)
class RunSlopes:
    """Slopes of n runs.

    `beta_deg`, `gamma_deg`: shape (n,). `alpha`, `se`: shape (2, n), z and x, N/cm^3. `mirrored`: whether the sign of
    alpha_x was turned, as for an extraction. `order`: place of each run in the campaign. `labels`: the label of each
    run, or an empty one, by name of the column of the run sheet. `tolerance_deg`: difference of each angle up to which
    runs are of one direction.
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
        """-1 where the sign of alpha_x was turned, else 1."""
        return np.where(self.mirrored, -1.0, 1.0)


class Cause(NamedTuple):
    """An error that some runs may share.

    `group`: name of a column of the run sheet, or one of `ALL`, `HOLDER`, `FROM_RUN`, `WINDOW`, `TREND`. `place`: which
    runs of the group, by label, angle or numbers. `kind`: one of `KINDS`. `share`: part of the cause that each run has,
    shape (n,). `effect`: change of alpha by a cause of size 1, shape (2 n,).
    """

    group: str
    place: str
    kind: str
    share: FloatArray
    effect: FloatArray

    @property
    def of_media(self) -> float:
        """Standard deviation of a cause of all runs over sound media and ordinary mounts; 0 if it has none."""
        return float(_CHOSEN.of_media.get(self.kind, 0.0)) if self.group == ALL else 0.0

    @property
    def tolerated(self) -> float:
        """Size that is no fault; 0 where `of_media` is a part of the error instead."""
        return 0.0 if self.of_media else KINDS[self.kind].tolerated


class Found(NamedTuple):
    """A cause that was found, with its size, the error of the size, and the errors beyond the tolerated size.

    `inseparable`: other causes that explain the runs about as well.
    """

    cause: Cause
    size: float
    se: float
    times: float
    inseparable: tuple[Cause, ...] = ()


class Scan(NamedTuple):
    """Scores of all k candidates.

    `size`, `se`: size and its standard error. `checked`: whether the runs can show the cause. `mixed_up`: whether they
    cannot because its runs have other directions than the rest. `limit`: errors from which the cause is told; causes by
    order share one, causes by label another, and each cause of all runs has its own.
    """

    causes: list[Cause]
    size: FloatArray
    se: FloatArray
    checked: npt.NDArray[np.bool_]
    mixed_up: npt.NDArray[np.bool_]
    limit: FloatArray

    @property
    def tolerated(self) -> FloatArray:
        """Tolerated size of each candidate."""
        return np.array([cause.tolerated for cause in self.causes])

    @property
    def error(self) -> FloatArray:
        """Standard error of the size of each fault, which includes the spread over sound media (`Cause.of_media`)."""
        return np.hypot(self.se, [cause.of_media for cause in self.causes])

    @property
    def beyond(self) -> FloatArray:
        """Number of errors by which each size exceeds the tolerated one."""
        return np.maximum(np.abs(self.size) - self.tolerated, 0) / self.error

    @property
    def least_seen(self) -> FloatArray:
        """Least size of each candidate that is told with a probability of 80 %."""
        return np.asarray(self.tolerated + (self.limit + _CHOSEN.power_sigmas) * self.error)


@dataclass(eq=False)
class JointModel:
    """Joint model of all runs, in which the causes told so far are put right.

    Attributes
    ----------
    runs : RunSlopes
    angles_deg : (float, float)
        Standard deviations of beta and gamma of a run.
    without : tuple of str
        Published media that are left out of the known shapes.
    """

    runs: RunSlopes
    angles_deg: tuple[float, float] = tuple(_RUNS.angles_deg)
    without: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.weight = np.ones(self.runs.size)
        self.jacobian = 0.0
        self.transform: FloatArray | None = None
        angles_deg = self.runs.beta_deg, self.runs.gamma_deg
        # numbered only here: putting a cause right moves directions, but runs of two directions
        # stay apart
        self.number = number_directions(*angles_deg, tolerance_deg=self.runs.tolerance_deg)
        beta_deg, gamma_deg = angles_of_directions(self.number, *angles_deg)
        off_deg = angles_deg[0] - beta_deg, angles_deg[1] - gamma_deg
        self.runs = replace(self.runs, beta_deg=beta_deg, gamma_deg=gamma_deg)
        self._locate_runs(self.runs)
        count = self.directions.shape[1]
        mean = self.mean.reshape(2, count)[:, self.cell]
        size = float((mean * self.runs.alpha).sum() / (mean**2).sum())
        least = 0.05 * float(np.abs(self.runs.alpha).sum() / np.abs(mean).sum())
        self.theta = np.array(
            [
                math.log(max(size, least)),
                0.0,
                math.log(USUAL_BED_SPREAD),
                math.log(_RUNS.start_rest),
            ]
        )
        medians = [
            np.median(self.runs.alpha[:, self.cell == place], axis=1) for place in range(count)
        ]
        start = 0.8 * np.stack(medians, axis=1) + 0.2 * math.exp(self.theta[0]) * self.mean.reshape(
            2, count
        )
        self._set_expected(math.exp(self.theta[0]) * self.prior_mean, start)
        # alpha of each run is moved from its own angles to those of its direction
        moved = self.by_beta * off_deg[0] + self.by_gamma * off_deg[1]
        self.runs = replace(self.runs, alpha=self.runs.alpha - moved)

    # --- the prior

    def _locate_runs(self, runs: RunSlopes) -> None:
        """Sort runs into directions, and set the prior there and, for its derivatives by the angles, a few degrees away."""
        self._sort_into_directions(runs)
        count = self.directions.shape[1]
        self.prior_mean, self.prior_rows = _prior_beside(
            self.without, self.directions.tobytes(), count
        )
        places = _places_of_directions(count)
        self._set_prior(self.prior_mean[places], self.prior_rows[places])

    def _locate_moved_runs(self, runs: RunSlopes) -> None:
        """Sort runs whose angles were put right into directions, and set the prior there; slopes stay as they are."""
        self._sort_into_directions(runs)
        beta_deg, gamma_deg = self.directions
        self._set_prior(*prior_of_media(beta_deg, gamma_deg, _RUNS.rough_share, self.without))

    def _sort_into_directions(self, runs: RunSlopes) -> None:
        """Set `directions`, angles in degrees (2, m), and `cell`, the direction of each run."""
        # runs of one direction agree to six decimals after all were moved by the same angle
        angles_deg = np.round([beta_apart(runs.beta_deg, 0.0), runs.gamma_deg], 6)
        directions, cell = np.unique(
            np.stack([*angles_deg, self.number]), axis=1, return_inverse=True
        )
        self.directions, self.cell = np.ascontiguousarray(directions[:2]), cell.ravel()

    def _set_prior(self, mean: FloatArray, covariance: FloatArray) -> None:
        """Set the prior of alpha in the directions, for a medium of size 1."""
        self.mean = mean
        self.prior = covariance + 1e-8 * np.eye(mean.size)
        self.local = _local_variance(self.mean, np.bincount(self.cell))

    def _set_expected(self, full: FloatArray, cells: FloatArray | None = None) -> None:
        """Set alpha of the directions and its slopes over the angles, per degree, for each run.

        `full`: alpha at directions and beside, as `_prior_beside`. `cells`: alpha of the directions, in place of that
        in `full`.
        """
        blocks = full.reshape(2, 5, -1)
        self.expected = (blocks[:, 0] if cells is None else cells)[:, self.cell]
        self.by_beta = ((blocks[:, 1] - blocks[:, 2]) / (2 * _RUNS.difference_deg))[:, self.cell]
        self.by_gamma = ((blocks[:, 3] - blocks[:, 4]) / (2 * _RUNS.difference_deg))[:, self.cell]

    # --- the likelihood

    def _scatter(self, theta: FloatArray, weight: FloatArray | None = None) -> FloatArray:
        """Return the covariance of alpha of each run about that of its direction, shape (n, 2, 2).

        `theta`: logarithms of the size, of the factor on the variance of the departure, of the spread of beds and of
        the rest.
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
        """Return the distribution of the runs about the prior mean."""
        relative = math.exp(theta[1]) * self.prior + np.diag(self.local)
        return RunGaussian(self._scatter(theta), self.cell, math.exp(2 * theta[0]) * relative)

    def _mean(self, theta: FloatArray) -> FloatArray:
        """Return the prior mean of the runs, shape (2 n,)."""
        of_runs = self.mean.reshape(2, -1)[:, self.cell]
        return math.exp(theta[0]) * of_runs.ravel()

    def cost(self, theta: FloatArray) -> float:
        """Return the negative logarithm of likelihood times prior of `theta`; infinite without a covariance."""
        residual = self.runs.alpha.ravel() - self._mean(theta)
        try:
            gaussian = self._gaussian(theta)
            quadratic, log_det = residual @ gaussian.solve(residual), gaussian.log_det
        except np.linalg.LinAlgError:
            # where runs fit no shape at all, as with angles in rad, the search may stray so far
            return math.inf
        half = _RUNS.departure_dof / 2
        of_prior = half * theta[1] + (half + 1) * math.exp(-theta[1])
        for value, middle in ((theta[2], USUAL_BED_SPREAD), (theta[3], _RUNS.rest)):
            of_prior += 0.5 * ((value - math.log(middle)) / _RUNS.log_sd) ** 2
        return float(0.5 * (quadratic + log_det) + of_prior + self.jacobian)

    # --- the fit

    def fit(self, rounds: int = 3, evaluations: int = 90, step: float = 1.0) -> JointModel:
        """Find size, departure and scatter, in `theta`, and from them weights of runs and alpha of the directions."""
        first = step * np.array([0.1, 0.5, 0.3, 0.3])
        for turn in range(rounds):
            if turn:
                first = 0.4 * np.array([0.1, 0.5, 0.3, 0.3])
            most = evaluations if turn == 0 else evaluations // 2
            self.theta = _minimise(self.cost, self.theta, first, most)
            self.update()
        return self

    def update(self) -> None:
        """Set alpha of the directions by the data, and weights by the distance of each run from all others."""
        gaussian = self._gaussian(self.theta)
        residual = self.runs.alpha.ravel() - self._mean(self.theta)
        sums = gaussian.sum_by_direction(gaussian.solve(residual))[:, 0]
        departure = math.exp(self.theta[1]) * (self.prior_rows @ sums)
        departure[_places_of_directions(self.directions.shape[1])] += self.local * sums
        self._set_expected(
            math.exp(self.theta[0]) * self.prior_mean + math.exp(2 * self.theta[0]) * departure
        )
        self.update_weights()

    def update_weights(self) -> None:
        """Set the weight of each run by its distance from alpha by all others (Student's t): far runs count little."""
        gaussian = self._gaussian(self.theta)
        residual = self.runs.alpha.ravel() - self._mean(self.theta)
        predicted, covariance = gaussian.leave_out(residual.reshape(2, -1))
        off = residual.reshape(2, -1) - predicted
        covariance = covariance + self._scatter(self.theta, np.ones(self.runs.size))
        distance = np.einsum("in,nij,jn->n", off, np.linalg.inv(covariance), off)
        self.weight = np.clip((_RUNS.t_dof + 2) / (_RUNS.t_dof + distance), 0.02, 1.0)

    # --- causes

    def _shares(self) -> Iterator[tuple[str, str, FloatArray]]:
        """Yield groups of runs by the order and by the labels of the sheet: group, place, and share of each run."""
        size = self.runs.size
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
        """List all candidates."""
        alpha, side, runs = self.expected, self.runs.side, self.runs
        turned = math.radians(1) * side * np.stack([alpha[1], -alpha[0]])
        along_x = np.array([[0.0], [1.0]])
        every = np.ones(runs.size)
        candidates: list[Cause] = []

        def add(group: str, place: str, kind: str, share: FloatArray, effect: FloatArray) -> None:
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
        slanted = (np.abs(runs.gamma_deg) > 1) & (np.abs(np.abs(runs.gamma_deg) - 90) > 1)
        tilted = np.where(np.abs(runs.beta_deg) < 89, 1.0, 0.0)
        add(ALL, "", "turn", every, turned)
        add(ALL, "", "crosstalk", every, np.stack([0 * alpha[0], side * alpha[0]]))
        add(ALL, "", "beta-scale", tilted, runs.beta_deg * tilted * self.by_beta)
        add(ALL, "", "beta-offset", every, side * self.by_beta)
        add(ALL, "", "gamma-offset", np.where(slanted, 1.0, 0.0), slanted * side * self.by_gamma)
        # a holder of one angle holds plates at plus and at minus this angle
        sizes = np.abs(runs.beta_deg)
        for angle in np.unique(np.round(np.abs(self.directions[0]))):
            share = np.where(np.abs(sizes - angle) < 0.6, np.sign(runs.beta_deg), 0.0)
            if 0 < angle < 89 and 2 <= np.abs(share).sum() <= runs.size - 4:
                add(HOLDER, f"{angle:g}", "holder", share, share * self.by_beta)
        return candidates

    def put_right(self, cause: Cause, size: float) -> JointModel:
        """Return the model of the runs as they would be without a cause of this size."""
        runs, share, side = self.runs, cause.share, self.runs.side
        beta, gamma, alpha = runs.beta_deg, runs.gamma_deg, runs.alpha
        transform = np.tile(np.eye(2), (runs.size, 1, 1))
        log_jacobian = 0.0
        if cause.kind in ("gain", "gain-x"):
            gain = np.maximum(1 + size * share, 0.05)
            transform[:, 1, 1] /= gain
            log_jacobian = float(np.log(gain).sum())
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
        alpha = np.einsum("nij,jn->in", transform, alpha)
        model.runs = replace(runs, beta_deg=beta, gamma_deg=gamma, alpha=alpha)
        model.jacobian = self.jacobian + log_jacobian
        model.transform = transform if self.transform is None else transform @ self.transform
        if beta is not runs.beta_deg or gamma is not runs.gamma_deg:
            model._locate_moved_runs(model.runs)
        return model

    def scan(self) -> Scan:
        """Score all candidates, and find the limit that the largest score of sound runs hardly exceeds."""
        causes = self.causes()
        from scipy.special import ndtri

        effects = np.column_stack([cause.effect for cause in causes])
        mean = self._mean(self.theta)
        residual = self.runs.alpha.ravel() - mean
        scores, information = self._gaussian(self.theta).score(residual, mean, effects)
        precision = np.maximum(np.diag(information), 1e-12)
        size = scores / precision
        wider = np.array([_CHOSEN.wider.get(cause.kind, 1.0) for cause in causes])
        se = wider / np.sqrt(precision)
        tolerated = np.array([KINDS[cause.kind].tolerated for cause in causes])
        most = np.array([KINDS[cause.kind].most for cause in causes])
        families = np.array([_FAMILY.get(cause.group, "labels") for cause in causes])
        is_seen = se < 50 * tolerated
        limit_of_one = -float(ndtri(_CHOSEN.nominal_rate / 2))
        limit = np.array(
            [limit_of_one if cause.of_media else _CHOSEN.limit_of_all for cause in causes]
        )
        dof = max(self.runs.size - self.directions.shape[1], self.runs.size / 2, 8.0)
        for family in ("order", "labels"):
            members = is_seen & (families == family)
            if members.any():
                root = np.sqrt(precision[members])
                correlation = information[np.ix_(members, members)] / np.outer(root, root)
                normal_limit = _limit_of_largest(correlation, _CHOSEN.nominal_rate)
                limit[families == family] = student_limit(normal_limit, dof)
        grouped = np.array([cause.group not in (ALL, HOLDER) for cause in causes])
        mixed_up = grouped & (se > _CHOSEN.mixed_up * self._error_beside_known_shape(effects))
        scan = Scan(causes, size, se, is_seen & ~mixed_up, mixed_up, limit)
        return scan._replace(checked=scan.checked & (scan.least_seen < most))

    def _error_beside_known_shape(self, effects: FloatArray) -> FloatArray:
        """Return the standard errors that the causes would have if the shape were known exactly."""
        theta = self.theta.copy()
        theta[1] = math.log(1e-4)
        mean = self._mean(theta)
        _, information = self._gaussian(theta).score(mean, mean, effects)
        return 1 / np.sqrt(np.maximum(np.diag(information), 1e-12))

    def _fit_cause(self, cause: Cause, size: float, se: float) -> tuple[float, float, JointModel]:
        """Find the best size of a cause, the errors by which it exceeds the tolerated size, and the model without it.

        The scatter is fitted both with the best and with the tolerated size, so a cause cannot win by making errors
        small.
        """
        tolerated = cause.tolerated
        step = np.array([0.1, 0.3, 0.3, 0.3, max(0.5 * abs(size), se)])

        def cost(values: FloatArray) -> float:
            # `model` of the moment: it is replaced below by one with other weights
            return model.put_right(cause, values[4]).cost(values[:4])

        model = self
        values = _minimise(cost, np.append(self.theta, size), step, 70, 0.01)
        without = self.put_right(cause, values[4])
        without.theta = values[:4]
        without.update_weights()
        model = self._with_weight(without.weight)
        values = _minimise(cost, values, 0.4 * step, 70, 0.01)
        best, size = cost(values), float(values[4])
        tolerated_size = math.copysign(min(abs(size), tolerated), size)
        tolerated_model = model.put_right(cause, tolerated_size)
        theta = _minimise(tolerated_model.cost, self.theta, step[:4], 70)
        times = math.sqrt(max(2 * (tolerated_model.cost(theta) - best), 0.0))
        without = model.put_right(cause, size)
        without.theta = values[:4]
        return size, times, without

    def _with_weight(self, weight: FloatArray) -> JointModel:
        """Return the model with other weights of the runs."""
        model = copy(self)
        model.weight = weight
        return model

    def _error_of(self, cause: Cause) -> float:
        """Return the standard error of a cause in the model from which it was removed; NaN where it is not found."""
        scan = self.scan()
        for candidate, se in zip(scan.causes, scan.se, strict=True):
            if candidate[:3] == cause[:3]:
                return float(se)
        return math.nan


def least_step(size: int) -> int:
    """Return the fewest of `size` runs on either side of a step, and in a window of the order."""
    return max(int(_CHOSEN.step_runs), int(_CHOSEN.step_share * size))


def list_untold(runs: int) -> list[str]:
    """List the errors that no check can show in a campaign, whatever its data are; `runs`: most runs of any medium."""
    return [
        str(remark("untold-label")),
        str(remark("untold-holder")),
        str(remark("untold-blocks", runs=least_step(runs))),
        str(remark("untold-choice")),
        str(remark("untold-walls")),
    ]


def find_causes(model: JointModel) -> tuple[list[Found], Scan]:
    """Find the causes that runs share, the clearest first, and the scores of all causes after these are put right."""
    model.fit()
    scan = model.scan()
    told: list[Found] = []
    while len(told) < _CHOSEN.most_causes:
        tried = _try_candidates(model, scan)
        clear = [trial for trial in tried if trial.times >= trial.limit]
        if not clear:
            break
        # which cause it is depends on the runs alone, not on the spread over sound media
        trial = max(clear, key=lambda trial: trial.by_runs - trial.limit)
        without = trial.model
        without._locate_runs(without.runs)
        without.update()
        without.fit(2, 50, 0.4)
        se = without._error_of(trial.cause)
        error = math.hypot(se, trial.cause.of_media)
        least_seen = trial.cause.tolerated + (trial.limit + _CHOSEN.power_sigmas) * error
        if not least_seen < KINDS[trial.cause.kind].most:
            break
        told.append(
            Found(trial.cause, trial.size, se, trial.times, _inseparable_from(trial, tried, scan))
        )
        model, scan = without, without.scan()
    return told, scan


def _inseparable_from(told: _Trial, tried: list[_Trial], scan: Scan) -> tuple[Cause, ...]:
    """Find the other causes that explain the runs about as well as one that is told.

    Causes of all runs are seen by the known shape alone, from which each medium departs in its own way. So
    for such a cause others with a score near its own count, too, though a sound medium might have their size.
    """
    inseparable = {
        trial.cause[:3]: trial.cause
        for trial in tried
        if trial is not told
        and trial.times > trial.limit
        and trial.by_runs > told.by_runs - _CHOSEN.inseparable
    }
    if told.cause.group == ALL:
        scores = np.abs(scan.size) / scan.se
        names = [cause[:3] for cause in scan.causes]
        least_score = scores[names.index(told.cause[:3])] - _CHOSEN.inseparable
        inseparable |= {
            name: cause
            for name, cause, score in zip(names, scan.causes, scores, strict=True)
            if cause.group == ALL and score > least_score and name != told.cause[:3]
        }
    return tuple(inseparable.values())


class _Trial(NamedTuple):
    """A candidate that the exact transformation decides.

    `times`: errors beyond the tolerated size, `limit`: their limit. `by_runs`: the same by errors without the spread
    over sound media. `model`: the model without the cause.
    """

    cause: Cause
    size: float
    times: float
    by_runs: float
    limit: float
    model: JointModel


def _try_candidates(model: JointModel, scan: Scan) -> list[_Trial]:
    """Decide the candidates with the largest scores, one for each kind and group."""
    scores = np.where(scan.checked, np.abs(scan.size) / scan.se, 0.0)
    beyond = scan.beyond
    by_shape = np.array([cause.group == ALL and not cause.of_media for cause in scan.causes])
    of_media = np.array([cause.of_media > 0 for cause in scan.causes])
    ranked_by = np.where(of_media, beyond, scores)
    worth = np.where(
        by_shape, beyond > _CHOSEN.tried_of_all, ranked_by > scan.limit - _CHOSEN.ranked_from
    )
    worth &= scan.checked & (beyond > 0)
    worth &= scores > scores.max() - _CHOSEN.far_behind
    tried: dict[tuple[str, str], _Trial] = {}
    for number in np.argsort(-np.where(worth, scores, 0.0)):
        cause = scan.causes[number]
        if not worth[number] or len(tried) >= _CHOSEN.most_tried:
            break
        if (cause.kind, cause.group) in tried:
            continue
        size, times, right = model._fit_cause(cause, scan.size[number], scan.se[number])
        times = times if abs(size) > cause.tolerated else 0.0
        by_runs = times / _CHOSEN.wider.get(cause.kind, 1.0)
        # the error by the runs is size / by_runs; the spread over sound media is added in squares
        times = by_runs / math.hypot(1.0, cause.of_media * by_runs / (abs(size) or 1.0))
        trial = _Trial(cause, size, times, by_runs, float(scan.limit[number]), right)
        tried[cause.kind, cause.group] = trial
    return list(tried.values())


def _limit_of_largest(correlation: FloatArray, rate: float) -> float:
    """Return the size that the largest of standard normal scores with this correlation exceeds at a rate."""
    values, vectors = np.linalg.eigh((correlation + correlation.T) / 2)
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
    """Minimise a cost by Nelder-Mead; `step`: size of the first simplex, `most`: most evaluations."""
    from scipy.optimize import minimize

    simplex = np.vstack([start, start + np.diag(step)])
    options = {"maxfev": most, "xatol": tolerance, "fatol": 0.05, "initial_simplex": simplex}
    return np.asarray(minimize(cost, start, method="Nelder-Mead", options=options).x)


def expected_alpha(beta_deg: FloatArray, gamma_deg: FloatArray) -> FloatArray:
    """Return alpha of the known shape, z and x, shape (2, n), for a medium of size 1."""
    mean, _ = prior_of_media(beta_deg, gamma_deg, _RUNS.rough_share)
    return mean.reshape(2, -1)


def prior_of_media(
    beta_deg: FloatArray, gamma_deg: FloatArray, rough_share: float, without: tuple[str, ...] = ()
) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of alpha for a medium of size 1, free in what differs between sound media."""
    return prior_at(beta_deg, gamma_deg, rough_share, _FREEDOM, without)


@lru_cache(maxsize=4)
def _prior_beside(
    without: tuple[str, ...], directions: bytes, count: int
) -> tuple[FloatArray, FloatArray]:
    """Return the prior mean at directions and a step beside in beta and gamma, shape (10 n,).

    Returned with its covariance with the directions, (10 n, 2 n). `directions`: bytes of beta and gamma, degrees, shape
    (2, n), because the cache needs a key.
    """
    beta, gamma = np.frombuffer(directions).reshape(2, count)
    step = _RUNS.difference_deg
    betas = np.concatenate([beta, beta + step, beta - step, beta, beta])
    gammas = np.concatenate([gamma, gamma, gamma, gamma + step, gamma - step])
    mean, covariance = prior_of_media(betas, gammas, _RUNS.rough_share, without)
    return mean, covariance[:, _places_of_directions(count)]


def _places_of_directions(count: int) -> npt.NDArray[np.intp]:
    """Return the places of the directions, z then x, in the mean of `_prior_beside`."""
    return np.concatenate([np.arange(count), 5 * count + np.arange(count)])


def _local_variance(mean: FloatArray, runs: npt.NDArray[np.intp]) -> FloatArray:
    """Return the variance of the departure that the repeats of a direction share, shape (2 n,), for a medium of size 1.

    `mean`: of its alpha, (2 n,). `runs`: number in each direction, (n,). A single run shares none: the departure of its
    direction is a part of its scatter.
    """
    level = np.hypot(*mean.reshape(2, -1))
    variance = (_RUNS.local * level) ** 2 + (_RUNS.local_floor * level.max()) ** 2
    variance = np.where(runs > 1, variance, 0.0)
    return np.concatenate([variance, variance])
