"""Maps: alpha over all directions from any number of pushes or contacts, by the shape that granular media share.

Alpha over the angles has nearly the same shape in all dry granular media. The shape of known media is the prior,
and every push corrects it:

    alpha = s (m + d),   d ~ N(0, lambda (C + (1 - w) K + w R)),   the medium takes energy everywhere

Here s is the unknown size of this medium (root mean square of alpha over the published grid), m the mean shape and C
the covariance of the known media. A smooth covariance K and a rough one R allow a further medium to differ from all
known ones. The pushes determine s, how far the medium departs from the known shape (lambda) and how roughly (w). The
map consists of draws from the posterior: their mean is alpha, their quantiles are its interval. Alpha at the n nodes of
a map (directions, rad) is an array (2, n), z then x, N/cm^3; as a vector (2 n,) all z come first.

`rftfit.model.pushes` reads the pushes, `shapes` has the known media, `prior`, `likelihood` and `posterior` the three
terms of Bayes' rule, and `energy` the condition behind them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.alpha import Columns, column, directions, window_of
from rftfit.measure.errors import USUAL_BED_SPREAD, half_width_of_bed
from rftfit.model.draws import interval, widen
from rftfit.model.energy import work
from rftfit.model.fourier import fit_lsq, kept_terms
from rftfit.model.likelihood import Likelihood, Measurements, PushResidual
from rftfit.model.observations import Angles, Observation, ObservedSystem
from rftfit.model.posterior import Posterior, PushedNodes
from rftfit.model.prior import ZERO_VARIANCE, order_by_blocks, root
from rftfit.model.profiles import ANY_DEPTH, EPS, KnownMedium, Profile, TableProfile
from rftfit.model.pushes import (
    NO_PUSHES,
    Pushes,
    bed_spread_of_repeats,
    describe_push,
    merged,
    one_push,
    sorted_pushes,
    with_scatter_of_repeats,
)
from rftfit.model.scaling import PAPER_RULE, check_level, check_test, chi_of, vertical_penetration
from rftfit.model.shapes import PUBLISHED_GRID, Shapes, grid, published_shapes
from rftfit.model.symmetry import find_grid
from rftfit.reference import GAMMA_DEG, load
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "maps")

NOT_ALIKE: float = _CHOSEN.not_alike
"""Least `Map.belongs` of a medium that counts as one of the known shape."""


class Nodes(NamedTuple):
    """Nodes of a map, rad, shape (n,); the first `lines` lie on lines that a rig pushes, from which a plan may choose."""

    beta: FloatArray
    gamma: FloatArray
    lines: int


def fit_terms_of_map(
    beta: FloatArray, gamma: FloatArray, best: FloatArray, alpha: FloatArray
) -> FloatArray:
    """Return nine coefficients (..., 9), N/cm^3, fitted to alpha (..., 2, n) at the n nodes of a map (rad).

    Terms that the fit to `best`, the map's own alpha (2, n), does not keep are 0, so that all draws have the same
    terms.
    """
    keep = kept_terms(fit_lsq(beta, gamma, *best), PAPER_RULE)
    return fit_lsq(beta, gamma, alpha[..., 0, :], alpha[..., 1, :], keep)


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
    horizontal: float = math.nan
    horizontal_off: float = math.nan
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
        """Deviations of the draws from alpha, (draws, 2, n), scaled: their products, summed over draws, are its covariance."""
        return np.asarray((self.draws - self.alpha) / np.sqrt(len(self.draws) - 1))

    @property
    def measurements(self) -> str:
        """Words with the numbers of pushes and contacts from which the map was estimated, such as ``2 pushes``."""
        counts = ((self.pushes, "push", "pushes"), (self.contacts, "contact", "contacts"))
        counted = [
            f"{count} {singular if count == 1 else plural}"
            for count, singular, plural in counts
            if count
        ]
        return " and ".join(counted) or "0 pushes"

    @property
    def pushed(self) -> FloatArray:
        """Measured directions: rows beta and gamma in degrees, alpha_z, alpha_x and their standard errors, shape (6, n).

        Alpha and errors in N/cm^3, NaN if not known, as in `TableProfile.pushed`.
        """
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
            return math.nan
        from scipy.special import erfc, gammaincc

        chances = [float(gammaincc(self.dof / 2, self.distance / 2))]
        if not math.isnan(self.horizontal_off):
            chances.append(float(erfc(self.horizontal_off / math.sqrt(2))))
        return min(len(chances) * min(chances), 1.0)

    @property
    def profile(self) -> TableProfile:
        """Profile of the map, a table over its nodes, with its draws for intervals and its pushes as measured directions."""
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
        return self._with_ends(lambda alpha: vertical_penetration(self.coefficients(alpha)))

    @property
    def chi(self) -> tuple[float, float, float]:
        """Ratio of alpha_z(0, 90 deg) of the map to `zeta`, with its interval."""
        straight_down = int(np.argmin(np.hypot(self.beta, self.gamma - np.pi / 2)))
        return self._with_ends(
            lambda alpha: chi_of(alpha[..., 0, straight_down], self.coefficients(alpha))
        )

    def _with_ends(
        self, quantity: Callable[[FloatArray], FloatArray]
    ) -> tuple[float, float, float]:
        """Return a quantity of the map's alpha, with the ends of its interval from the draws.

        `quantity`: function of alpha (..., 2, n) that returns numbers (...).
        """
        lo, hi = interval(quantity(self.draws), self.confidence)
        return float(quantity(self.alpha)), float(lo), float(hi)

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
        alpha = self.alpha if alpha is None else alpha
        return fit_terms_of_map(self.beta, self.gamma, self.alpha, alpha)

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
        ends = {"": self.alpha, "_lo": lo, "_hi": hi, "_lo_next": lo_next, "_hi_next": hi_next}
        for row, component in enumerate(COMPONENTS):
            for end, alpha in ends.items():
                columns[column(component, end)] = alpha[row, order]
        columns["source"] = np.where(self.measured[order], "measured", "estimated")
        return columns


def published_map(medium: str) -> Map:
    """Estimate the map of a published medium from all its directions; the known media are the other four."""
    table = load("table_s5")
    pushes = table[table["medium"] == medium]
    return estimate_map(pushes, published_shapes([medium]), name=medium)


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


def estimate(
    pushes: Pushes,
    shapes: Shapes | None = None,
    nodes: Nodes | None = None,
    *,
    confidence: float = 0.95,
    name: str = "",
    contacts: Sequence[Observation] = (),
) -> Map:
    """Return the map that `estimate_map` returns, for pushes with known errors, but without a table's spread and window.

    `nodes`: nodes of the map, all on lines of a grid; default: `map_nodes`. `contacts`: measured forces on bodies.
    Other arguments as in `estimate_map`.
    """
    shapes = shapes or published_shapes()
    nodes = nodes or map_nodes()
    push_count = int(np.isfinite(pushes.alpha).any(axis=0).sum())
    pushes = merged(pushes) if pushes.beta.size else pushes
    # nodes of the published grid come first: most draws are rejected before the others are drawn
    on_grid = _on_published_grid((nodes.beta, nodes.gamma))
    node_order = np.argsort(~on_grid, kind="stable")
    sorted_nodes = nodes.beta[node_order], nodes.gamma[node_order]
    coarse = int(on_grid.sum())
    # one prior of the pushes, the nodes on the published grid and the other nodes, block after block, each z then x
    block_order = order_by_blocks([pushes.beta.size, coarse, nodes.beta.size - coarse])
    prior = shapes.prior(
        np.concatenate([pushes.beta, sorted_nodes[0]]),
        np.concatenate([pushes.gamma, sorted_nodes[1]]),
    ).select(block_order)
    # indices of alpha at the sorted nodes in this prior, z then x
    node_indices = np.argsort(block_order).reshape(2, -1)[:, pushes.beta.size :].ravel()
    # the measured numbers y and the covariance of their errors, z then x
    y, covariance = pushes.alpha.ravel(), pushes.covariance
    # a number that is 0 by symmetry, without variance, says nothing about the medium
    varies = prior.smooth.diagonal[: y.size] > ZERO_VARIANCE
    used = np.isfinite(y) & np.isfinite(np.diag(covariance)) & varies
    if not (used.any() or contacts):
        raise ValueError("no push has a number that tells of the medium")
    # without a copy if all are used: for a thousand pushes it would be 32 MB
    used_covariance = covariance if used.all() else covariance[np.ix_(used, used)]
    push_numbers = Measurements(prior, np.flatnonzero(used), y[used], used_covariance)
    measurements = push_numbers
    if contacts:
        measurements = _add_contacts(push_numbers, contacts, sorted_nodes, node_indices)
    # the posterior, and media drawn from it
    posterior = Posterior(measurements, shapes.variation)
    pushed_nodes = PushedNodes.of(sorted_nodes, pushes, used)
    draws, not_passive = posterior.draw_media(sorted_nodes, coarse, pushed_nodes, shapes.tilt)
    smooth_likelihood = posterior.likelihoods[0]  # w is 0
    size = smooth_likelihood.expected_size
    # what the pushes alone say of the shape of this medium
    farthest, horizontal, horizontal_off = None, math.nan, math.nan
    if used.any():
        likelihood = _smooth_likelihood(push_numbers) if contacts else smooth_likelihood
        farthest = likelihood.farthest(pushes, used, size)
        is_x = np.flatnonzero(used) >= pushes.beta.size
        horizontal, se = likelihood.fit_horizontal_ratio(is_x, size)
        # NaN if only one component was measured
        if horizontal == 0:
            horizontal_off = 1 / se
        elif horizontal > 0:
            horizontal_off = abs(math.log(horizontal)) / shapes.horizontal_error(se)
    unsorted = np.argsort(node_order)
    return Map(
        name,
        nodes.beta,
        nodes.gamma,
        draws[..., unsorted],
        measured=pushed_nodes.is_pushed[unsorted],
        not_passive=not_passive,
        size=size,
        distance=smooth_likelihood.chi_squared(size),
        dof=measurements.y.size - 1,
        pushes=push_count,
        known_media=shapes.name,
        farthest=farthest,
        horizontal=horizontal,
        horizontal_off=horizontal_off,
        confidence=confidence,
        given=pushes,
        lines=nodes.lines,
        contacts=len(contacts),
    )


def _add_contacts(
    push_numbers: Measurements,
    contacts: Sequence[Observation],
    nodes: Angles,
    node_indices: npt.NDArray[np.intp],
) -> Measurements:
    """Return the numbers of pushes, and behind them the combinations of measured forces of contacts.

    The error of the force model is proportional to the size of the medium, which depends on these numbers: numbers and
    size are calculated in turn until the size does not change. `push_numbers`: may be none. `nodes`: beta and gamma of
    the map, rad. `node_indices`: of alpha at the nodes in the prior, z then x.
    """
    from scipy.linalg import block_diag

    prior = push_numbers.prior
    # C + K + R, more than any medium has: no useful combination of forces is left out
    covariance = prior.covariance(0.0)
    prior.rough.add_to(covariance)
    rows_of_prior = root(covariance[np.ix_(node_indices, node_indices)])
    system = ObservedSystem.of(contacts, nodes, prior.mean[node_indices], rows_of_prior)
    size = system.first_size()
    if not size > 0:
        raise ValueError(
            "the contacts meet no resistance: look at the signs of the forces and at the angles"
        )
    first_node = int(node_indices.min())
    for _ in range(_CHOSEN.size_steps):
        rows = system.rows(size)
        measurements = Measurements(
            prior.insert_rows(rows, node_indices, first_node),
            np.concatenate([push_numbers.prior_index, first_node + np.arange(rows.values.size)]),
            np.concatenate([push_numbers.y, rows.values]),
            block_diag(push_numbers.covariance, np.diag(rows.errors**2)),
        )
        previous_size, size = size, _smooth_likelihood(measurements).expected_size
        if abs(size - previous_size) < _CHOSEN.same_size * previous_size:
            break
    return measurements


def _smooth_likelihood(measurements: Measurements) -> Likelihood:
    """Return the likelihood of measured numbers in a medium without roughness (w = 0), by which its size is estimated."""
    return Likelihood(measurements.with_rounding(), 0.0)


def _on_published_grid(nodes: Angles) -> npt.NDArray[np.bool_]:
    """Return True for nodes (rad) that lie on lines of the published grid in both angles, shape (n,)."""
    distances = [
        np.abs(angles[:, None] - np.unique(published)).min(axis=1)
        for angles, published in zip(nodes, PUBLISHED_GRID, strict=True)
    ]
    return np.asarray(np.maximum(*distances) < 1e-9)


def map_nodes(beta_deg: npt.ArrayLike = (), gamma_deg: npt.ArrayLike = ()) -> Nodes:
    """Return the nodes of `grid`, for which pushes can be planned, then those of finer lines between them.

    The finer lines are `STEP_DEG` apart in beta, and at the middles of the published gammas: alpha bends between the
    lines of the paper. `beta_deg`, `gamma_deg`: lines in addition to those of the published grid.
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


STEP_DEG: float = _CHOSEN.step_deg
"""Distance of the lines of a map in beta, degrees."""


def nodes_of(table: pd.DataFrame) -> Nodes:
    """Return the nodes for the map of a medium, with the lines of its table if they are a grid of moderate size.

    `table`: with columns ``beta_deg`` and ``gamma_deg``. Scattered directions, or very many lines, get the usual nodes:
    the time of a map grows with the third power of their number.
    """
    lines_deg = tuple(table[name].unique() for name in ("beta_deg", "gamma_deg"))
    coarse = grid(*lines_deg)
    if find_grid(*directions(table)) is None or coarse[0].size > _CHOSEN.most_nodes:
        return map_nodes()
    fine = map_nodes(*lines_deg)
    return fine if fine.beta.size <= _CHOSEN.most_fine_nodes else Nodes(*coarse, coarse[0].size)
