"""Draws of media that agree with measured numbers and take energy in every direction.

A medium is s (m + d): size s, mean shape m, and d normal with the covariance lambda (C + (1 - w) K + w R) of
`rftfit.model.prior`; lambda is called departure, w rough share. Draws are made in batches of `DRAWS`, a row each. A
draw whose medium would give energy back is rejected, since no medium does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.draws import DRAWS, SEED_OF_MAPS
from rftfit.model.energy import mean_effort, takes_energy
from rftfit.model.likelihood import Likelihood, Measurements, are_independent, weigh
from rftfit.model.observations import Angles
from rftfit.model.prior import Variation, triangular_root
from rftfit.model.pushes import Pushes, same_direction_or_mirror
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "posterior")

_DEPARTURES = np.exp(_CHOSEN.departure_step * np.arange(*_CHOSEN.departure_steps))
"""Values of lambda that are tried; 0.1 % of its prior lies outside."""


class PushedNodes(NamedTuple):
    """Nodes of a map that were pushed, or whose mirror images were, and the measured numbers that are alpha there.

    `is_pushed` (n,): True for pushed nodes. For each alpha that is measured: `component` (0: z, 1: x) and `node` of it,
    `number`, the index in `Measurements.y`, and `sign`, -1 for alpha_x of a mirror image.
    """

    is_pushed: npt.NDArray[np.bool_]
    component: npt.NDArray[np.intp]
    node: npt.NDArray[np.intp]
    number: npt.NDArray[np.intp]
    sign: FloatArray

    @classmethod
    def of(cls, nodes: Angles, pushes: Pushes, used: npt.NDArray[np.bool_]) -> PushedNodes:
        """Return the pushed ones of `nodes` (rad).

        `used`: True for those numbers of the pushes, z then x, that are in `Measurements.y`. A node where no alpha_z
        was measured does not count as pushed.
        """
        is_pushed = np.zeros(nodes[0].size, dtype=bool)
        # rows: component, node, number, sign; a column for each node whose alpha is measured
        entries = [np.zeros((4, 0))]
        # index in y of each number that is used: of z in the first row, of x in the second
        number_of = np.cumsum(used).reshape(2, -1) - 1
        used_z, used_x = used.reshape(2, -1)
        for push in np.flatnonzero(used_z):
            node, sign_x = same_direction_or_mirror(pushes.beta[push], pushes.gamma[push], *nodes)
            is_pushed[node] = True
            # z, and x where it was measured, too
            for component, sign in enumerate((1.0, sign_x)[: 1 + used_x[push]]):
                entries.append(
                    np.stack(np.broadcast_arrays(component, node, number_of[component, push], sign))
                )
        measured = np.concatenate(entries, axis=1)
        component, node, number = measured[:3].astype(np.intp)
        return cls(is_pushed, component, node, number, sign=measured[3])

    def first(self, count: int) -> PushedNodes:
        """Return the pushed nodes among the first `count` nodes alone."""
        is_first = self.node < count
        return PushedNodes(
            self.is_pushed[:count],
            self.component[is_first],
            self.node[is_first],
            self.number[is_first],
            self.sign[is_first],
        )

    def put(self, alpha: FloatArray, numbers: FloatArray) -> None:
        """Write measured numbers, shape (..., k), into alpha at the nodes, shape (..., 2, n), in place."""
        alpha[..., self.component, self.node] = self.sign * numbers[..., self.number]


class _Batch(NamedTuple):
    """Draws before alpha is calculated, one row for each draw; k measured numbers.

    `share_number`: index of w in `Posterior._rough_shares`, (draws,). `size`, `departure`: s (N/cm^3) and lambda,
    (draws, 1). `normals`: normal numbers for the first numbers of the prior, (draws, grid_end). `pull`: correction by
    the measured numbers, which their covariance with a node turns into its alpha, (draws, k). `noise`: drawn errors of
    the measured numbers, N/cm^3, (draws, k).
    """

    share_number: npt.NDArray[np.intp]
    size: FloatArray
    departure: FloatArray
    normals: npt.NDArray[np.float32]
    pull: FloatArray
    noise: FloatArray

    def select(self, draws: npt.NDArray[np.intp]) -> _Batch:
        """Return the batch of the draws with these indices alone."""
        return _Batch._make(array[draws] for array in self)


class Posterior:
    """Posterior of a medium, on a grid of its size s, departure lambda and share w of R, and draws of alpha from it.

    The prior of the measurements has three blocks: the measured numbers, alpha at the nodes of the published grid, and
    alpha at other nodes; at nodes z, then x. `likelihoods`: one for each w that is tried, the first for w = 0.
    """

    def __init__(self, measurements: Measurements, variation: Variation) -> None:
        """Weigh every w, lambda and s that is tried by the measured numbers."""
        measurements = measurements.with_rounding()
        self._prior, self._prior_index, self._y, covariance = measurements
        self._first_node = int(self._prior_index.max()) + 1
        self._rough_shares = variation.rough_shares
        # standard deviations of independent errors, else rows whose products are their covariance
        self._noise = (
            np.sqrt(np.diag(covariance))
            if are_independent(covariance)
            else np.linalg.cholesky(covariance).T
        )
        self.likelihoods = [
            Likelihood(measurements, rough_share) for rough_share in self._rough_shares
        ]
        self._matrices: dict[int, tuple[npt.NDArray[np.float32], FloatArray]] = {}
        # inverse gamma with its mode at 1, up to a constant; per step of the logarithm of lambda
        half = variation.departure_dof / 2
        log_prior_of_departure = -half * np.log(_DEPARTURES) - (half + 1) / _DEPARTURES
        # the trapezoidal rule over w
        quadrature = np.ones(len(self.likelihoods))
        quadrature[[0, -1]] = 0.5
        log_prior = np.log(quadrature)[:, None, None] + log_prior_of_departure[:, None]
        self._sizes, self._weights = weigh(self.likelihoods, _DEPARTURES, log_prior)

    def _matrices_of(self, share_number: int) -> tuple[npt.NDArray[np.float32], FloatArray]:
        """Return two matrices of the prior for one w, number `share_number` of `_rough_shares`.

        The first has rows whose products are the covariance of the prior; the second is the covariance between measured
        numbers and nodes. They are made when this w is first drawn: with many pushes most values never are.
        """
        if share_number not in self._matrices:
            covariance = self._prior.covariance(float(self._rough_shares[share_number]))
            measured_to_nodes = covariance[self._prior_index, self._first_node :]
            # single precision is enough for random parts
            root = triangular_root(covariance).astype(np.float32, order="F")
            self._matrices[share_number] = root, measured_to_nodes
        return self._matrices[share_number]

    def draw_media(
        self, nodes: Angles, coarse: int, pushed_nodes: PushedNodes, tilt: float
    ) -> tuple[FloatArray, float]:
        """Draw alpha at the nodes, (draws, 2, n), N/cm^3; return also the share of draws rejected as they give energy back.

        The first `coarse` nodes are those of the published grid. A draw that gives energy back there is rejected. Any
        other is kept with the probability exp(-tilt (T - least T of the first draws)), where T is its `mean_effort`:
        what rejection leaves would have more effort than known media (`Shapes.tilt`). The nodes between the lines are
        then drawn until the medium takes energy there too, at most `most_completed` times (chosen.toml).
        `pushed_nodes`: have alpha as measured. Raises ValueError where hardly any draw takes energy, as with a wrong
        sign.
        """
        random = np.random.default_rng(SEED_OF_MAPS)
        grid_nodes = nodes[0][:coarse], nodes[1][:coarse]
        pushed_on_grid = pushed_nodes.first(coarse)
        grid_end = self._prior.mean.size - 2 * (nodes[0].size - coarse)
        draws_kept: list[FloatArray] = []
        batches = passive = completed = 0
        least_effort = np.nan
        while batches < _CHOSEN.most_drawn and completed < DRAWS:
            batch = self._draw_batch(grid_end, random)
            draws = self._alpha_at(batch, slice(grid_end - 2 * coarse, grid_end))
            # before alpha as measured is put in: its error is no property of the medium
            efforts = mean_effort(draws, grid_nodes)
            pushed_on_grid.put(draws, self._y - batch.noise)
            largest = np.abs(draws).max(axis=(1, 2))
            is_passive = takes_energy(draws, grid_nodes[1], largest, pushed_on_grid.is_pushed)
            batches, passive = batches + 1, passive + int(is_passive.sum())
            kept = np.flatnonzero(is_passive)
            if tilt:
                kept = kept[np.isfinite(efforts[kept])]
            if tilt and kept.size:
                effort = efforts[kept]
                least_effort = float(effort.min()) if np.isnan(least_effort) else least_effort
                chance = np.exp(-tilt * np.maximum(effort - least_effort, 0.0))
                kept = kept[random.random(chance.size) < chance]
            # rejected draws are dropped: for a thousand pushes they would be another 40 MB
            batch, draws = batch.select(kept), draws[kept]
            alpha = self._complete_between_lines(batch, draws, nodes, pushed_nodes, random)
            completed += len(alpha)
            draws_kept.append(alpha)
        share = 1 - passive / (batches * DRAWS)
        if completed < _CHOSEN.fewest_draws:
            raise ValueError(
                f"in {share:.1%} of the draws the medium would push the plate along where it was not pushed: check the "
                "signs of alpha and the angles"
            )
        media = np.concatenate(draws_kept)[:DRAWS]
        # the mean of the draws at a pushed node is moved to exactly the measured number
        mean = media.mean(axis=0)
        moved_mean = mean.copy()
        pushed_nodes.put(moved_mean, self._y)
        media += moved_mean - mean
        return media, share

    def _draw_batch(self, grid_end: int, random: np.random.Generator) -> _Batch:
        """Draw size, departure, roughness, the first `grid_end` normal numbers, errors and the pull of a batch.

        Matheron's rule: a medium and errors are drawn from the prior, its pushes with these errors are calculated, and
        the draw is corrected by their difference from the measured pushes (the pull). `grid_end`: index in the prior
        behind the published grid.
        """
        # w, lambda and s of each draw: evenly spaced quantiles of the weights, in random order
        quantiles = (np.arange(DRAWS) + random.random()) / DRAWS
        cumulative = np.cumsum(self._weights.ravel())[:-1]
        drawn_cells = np.searchsorted(cumulative, random.permutation(quantiles))
        share_number, departure_number, size_number = np.unravel_index(
            drawn_cells, self._weights.shape
        )
        size = self._sizes[size_number][:, None]
        departure = _DEPARTURES[departure_number][:, None]
        shares_drawn = np.unique(share_number).tolist()
        for number in shares_drawn:
            # made before the arrays of the draws, to limit the memory in use at a time
            self._matrices_of(number)
        noise = random.standard_normal((DRAWS, self._y.size))
        if self._noise.ndim == 1:
            noise *= self._noise
        else:
            noise = noise @ self._noise
        normals = random.standard_normal((DRAWS, grid_end), np.float32)
        pull = np.empty((DRAWS, self._y.size))
        variance = size**2 * departure
        for number in shares_drawn:
            # the root is triangular: the measured numbers, the first ones, depend on the first normal numbers alone
            root = self._matrices_of(number)[0][: self._first_node, _as_slice(self._prior_index)]
            of_share = np.flatnonzero(share_number == number)
            blocks = -(-of_share.size * self._y.size // _CHOSEN.numbers_at_once)
            for block in np.array_split(of_share, blocks):
                drawn = normals[block, : len(root)] @ root
                shape = self._prior.mean[self._prior_index] + np.sqrt(departure[block]) * drawn
                difference = self._y - size[block] * shape - noise[block]
                solved = self.likelihoods[number].solve(difference, variance[block])
                pull[block] = variance[block] * solved
        return _Batch(share_number, size, departure, normals, pull, noise)

    def _complete_between_lines(
        self,
        batch: _Batch,
        draws: FloatArray,
        nodes: Angles,
        pushed_nodes: PushedNodes,
        random: np.random.Generator,
    ) -> FloatArray:
        """Return draws at all n nodes, (draws, 2, n), from those on the published grid, `draws`, (draws, 2, coarse).

        Alpha at the other nodes is drawn, given that on the grid, until the medium takes energy there, too. Next to a
        push that gives energy back, by its error, every completion may give energy back: the last one is then kept.
        `nodes`: rad, those of the grid first. `batch`: from which `draws` are.
        """
        grid_end, end = batch.normals.shape[1], self._prior.mean.size
        if grid_end == end:
            return draws
        other_nodes = slice(grid_end, end)
        largest = np.abs(draws).max(axis=(1, 2), initial=0.0)
        # mean of alpha between the lines, given alpha on the lines
        expected = self._alpha_at(batch, other_nodes)
        spread = batch.size * np.sqrt(batch.departure)
        alpha = np.empty((len(draws), 2, nodes[0].size))
        unfinished = np.arange(len(draws))
        for _ in range(_CHOSEN.most_completed):
            if not unfinished.size:
                break
            normals = random.standard_normal((unfinished.size, end - grid_end), np.float32)
            completed = expected[unfinished] + self._draw_rest(
                batch.share_number[unfinished], spread[unfinished], normals, other_nodes
            )
            all_nodes = np.concatenate([draws[unfinished], completed], axis=-1)
            pushed_nodes.put(all_nodes, self._y - batch.noise[unfinished])
            alpha[unfinished] = all_nodes
            unfinished = unfinished[
                ~takes_energy(all_nodes, nodes[1], largest[unfinished], pushed_nodes.is_pushed)
            ]
        return alpha

    def _alpha_at(self, batch: _Batch, columns: slice) -> FloatArray:
        """Return alpha at n nodes, those at `columns` in the prior, by the normal numbers of a batch, (draws, 2, n).

        s (m + root(lambda) normal numbers times the root of the prior), plus the pull of the measured numbers. Numbers
        of the prior that have no normal number in the batch yet count as 0, their mean.
        """
        reach = min(columns.stop, batch.normals.shape[1])
        alpha = np.empty((len(batch.share_number), columns.stop - columns.start))
        for number in np.unique(batch.share_number).tolist():
            of_share = batch.share_number == number
            root, measured_to_nodes = self._matrices_of(number)
            drawn = batch.normals[of_share, :reach] @ root[:reach, columns]
            shape = self._prior.mean[columns] + np.sqrt(batch.departure[of_share]) * drawn
            node_columns = slice(columns.start - self._first_node, columns.stop - self._first_node)
            pulled = batch.pull[of_share] @ measured_to_nodes[:, node_columns]
            alpha[of_share] = batch.size[of_share] * shape + pulled
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)

    def _draw_rest(
        self,
        share_number: npt.NDArray[np.intp],
        spread: FloatArray,
        normals: npt.NDArray[np.float32],
        columns: slice,
    ) -> FloatArray:
        """Draw that part of alpha at the last n nodes that alpha at the others leaves free, (draws, 2, n).

        `share_number`: as in `_Batch`. `spread`: s times the root of lambda, (draws, 1). `normals`: a normal number for
        each of `columns`, the indices of alpha at these nodes in the prior.
        """
        alpha = np.empty((len(normals), columns.stop - columns.start))
        for number in np.unique(share_number).tolist():
            of_share, root = share_number == number, self._matrices_of(number)[0]
            # transposed, in the order in which the root lies in memory: half the time for few draws
            drawn = (root[columns, columns].T @ normals[of_share].T).T
            alpha[of_share] = spread[of_share] * drawn
        return alpha.reshape(len(alpha), 2, alpha.shape[1] // 2)


def _as_slice(indices: npt.NDArray[np.intp]) -> npt.NDArray[np.intp] | slice:
    """Return consecutive indices as a slice, which needs no copy (16 MB for a thousand pushes); others as they are."""
    is_consecutive = (np.diff(indices) == 1).all()
    return slice(indices[0], indices[-1] + 1) if is_consecutive else indices
