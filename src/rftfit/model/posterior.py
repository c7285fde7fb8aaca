"""Draws of media that agree with measured numbers and take energy in every direction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rftfit.conventions import FloatArray
from rftfit.model.draws import DRAWS, SEED_OF_MAPS
from rftfit.model.energy import mean_effort, takes_energy
from rftfit.model.likelihood import Likelihood, add_rounding, weigh, whitening
from rftfit.model.observations import Angles
from rftfit.model.prior import Prior, Variation, triangular_root
from rftfit.model.pushes import Pushes, same_direction_or_mirror
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "posterior")

_DEPARTURES = np.exp(_CHOSEN.departure_step * np.arange(*_CHOSEN.departure_steps))
"""Values of lambda that are tried; 0.1 % of its prior lies outside."""


class Posterior:
    """Posterior of a medium, on a grid of its size s, departure lambda and share w of R, and draws of alpha from it.

    The prior has three blocks: pushes, nodes of the published grid, other nodes; in each z, then x. `seen`: indices of
    the measured numbers `y` in the prior.
    """

    def __init__(
        self,
        prior: Prior,
        seen: npt.NDArray[np.intp],
        y: FloatArray,
        errors: FloatArray,
        variation: Variation,
        size: float | None,
    ) -> None:
        self.prior, self.seen, self.y = prior, seen, y
        self._first_node = int(seen.max()) + 1
        self.rough_shares = variation.rough_shares
        rounded = add_rounding(errors, y)
        # standard deviations of independent errors, else rows whose products are their covariance
        self._noise = (
            np.sqrt(np.diag(rounded))
            if whitening(rounded).ndim == 1
            else np.linalg.cholesky(rounded).T
        )
        self.likelihoods = [
            Likelihood(prior, seen, rough_share, y, rounded) for rough_share in self.rough_shares
        ]
        self._matrices: dict[int, tuple[npt.NDArray[np.float32], FloatArray]] = {}
        half = variation.departure_dof / 2
        prior_of_departure = -half * np.log(_DEPARTURES) - (half + 1) / _DEPARTURES
        # the trapezoidal rule over w
        is_end = np.isin(np.arange(len(self.likelihoods)), (0, len(self.likelihoods) - 1))
        prior_of_share = np.log(np.where(is_end, 0.5, 1.0))
        log_prior = prior_of_share[:, None, None] + prior_of_departure[:, None]
        self.sizes, self.weights = weigh(self.likelihoods, _DEPARTURES, log_prior, size)

    def _root_and_towards(self, place: int) -> tuple[npt.NDArray[np.float32], FloatArray]:
        """Return two matrices for one w, the value number `place` of `rough_shares`.

        The first has rows whose products are the covariance of the prior; the second is the covariance between measured
        numbers and nodes. They are made when this w is first drawn: with many pushes most values never are.
        """
        if place not in self._matrices:
            covariance = self.prior.covariance(float(self.rough_shares[place]))
            towards = covariance[self.seen, self._first_node :]
            # single precision is enough for random parts
            rows = triangular_root(covariance).astype(np.float32, order="F")
            self._matrices[place] = rows, towards
        return self._matrices[place]

    def draws(
        self,
        nodes: Angles,
        coarse: int,
        pushed_nodes: PushedNodes,
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
        random = np.random.default_rng(SEED_OF_MAPS)
        grid_nodes = nodes[0][:coarse], nodes[1][:coarse]
        pushed_on_grid = PushedNodes(grid_nodes, pushes, used)
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
            is_passive = takes_energy(draws, grid_nodes[1], largest, pushed_on_grid.measured)
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
        pushed_nodes: PushedNodes,
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
                ~takes_energy(all_nodes, nodes[1], largest[unfinished], pushed_nodes.measured)
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

    `share_index`: index of w in `Posterior.rough_shares`. `s`: size. `departures`: lambda. `normals`: normal numbers
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


class PushedNodes:
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
            nodes_pushed, sign_x = same_direction_or_mirror(beta, gamma, *nodes)
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
