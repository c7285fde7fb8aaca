"""Profiles, which give alpha for any (beta, gamma): from a table, from nine Fourier terms, or from depth alone.

Alpha is the stress over depth on a plate, z up and x forward, N/cm^3. beta is the angle of the plate, gamma that of its
motion, in rad unless a name says deg. A profile is linear in its parameters: alpha at the nodes of a table,
coefficients, or three numbers. A stack of draws is a profile whose parameters have leading axes: alpha drawn many times
within its errors. Cells of a table are the directions that were measured, its nodes those of the grid that symmetry
completes.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.problems import choose
from rftfit.conventions import FloatArray, mirror, wrap_beta, wrap_gamma
from rftfit.measure.alpha import alpha_columns, column, directions
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.model.compiling import is_worth_compiling
from rftfit.model.fourier import TERMS, TERMS_Z, as_array, basis
from rftfit.model.packs import (
    DEPTH_ONLY,
    FOURIER,
    NEGLIGIBLE,
    STILL,
    TABLE,
    Pack,
    make_pack,
    pack_values,
)
from rftfit.model.symmetry import WIDEST_DEG, find_exact_grid, find_grid, list_once, torus
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, alpha_grid, coefficients
from rftfit.store.chosen import chosen

_CHOSEN = chosen("model", "profiles")

IndexArray = npt.NDArray[np.signedinteger]
Arrays = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""Beta, gamma, alpha_z and alpha_x, of the cells of a table or at its nodes."""

KINDS = ("table", "map", "fourier", "generic", "depth_only")
"""Kinds of profile of a medium: measured alpha; alpha completed by the shape that known media share; nine terms fitted
to it; zeta times the generic nine terms; depth-only."""

PUBLISHED_KINDS = tuple(kind for kind in KINDS if kind != "map")
"""Kinds of profile of a published medium: no map, since every direction was pushed."""


def weighted_sum(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return sums of p parameters with weights; a missing parameter (NaN) makes a sum NaN only if its weight counts.

    `values`: shape (draws, ..., p). `weights`: shape (n, ..., p). Returns shape (draws, ..., n, ...). A weight counts
    if it is more than `NEGLIGIBLE` of all weights of its sum: in plain numpy 0 times NaN would be NaN.
    """
    # only parameters with a weight, for speed: most poses need few directions of a map
    used = (weights != 0).reshape(-1, weights.shape[-1]).any(axis=0)
    values, weights = values[..., used], weights[..., used]
    missing = np.isnan(values)
    if not missing.any():
        return np.tensordot(values, weights, axes=(-1, -1))
    # relative to all weights of a sum, whose unit may be that of a force per alpha
    matters = np.abs(weights) > NEGLIGIBLE * np.abs(weights).sum(axis=-1, keepdims=True)
    total = np.tensordot(np.where(missing, 0.0, values), weights, axes=(-1, -1))
    by_draw = missing.reshape(-1, missing.shape[-1])
    # the same parameters are missing in all draws: one row is enough
    if (by_draw == by_draw[0]).all():
        missing = by_draw[0]
    is_unknown = np.tensordot(missing.astype(float), matters.astype(float), axes=(-1, -1)) > 0
    return np.where(is_unknown, np.nan, total)


ANY_DEPTH = (0.0, float("inf"))
"""Window of a profile whose depths are not stated, cm."""

PAPER_WINDOW = (0.3, 9.0)
"""Least and greatest depth of the paper's plates, cm: half the thickness of a level plate, and the 15 cm of the
container less the 6 cm kept from its bottom."""

EPS: float = _CHOSEN.eps
"""Usual relative error of the force model (`rftfit.forces.model_error`), from the measured legs of Fig. S5 (five
media, three legs, forces by the measured table)."""


class KnownMedium(ABC):
    """Base of all that is known of a medium: a profile, a map, one push by the paper's routine, a medium of a campaign.

    Every function with a medium as its parameter accepts any of these, and the path of a profile file
    (`rftfit.model.known.profile_of`).

    Examples
    --------
    >>> import rftfit
    >>> isinstance(rftfit.scale(0.9), rftfit.KnownMedium)
    True
    """

    @abstractmethod
    def as_profile(self, is_enough: Callable[[Profile], bool] | None = None) -> Profile:
        """Return the profile by which forces are predicted.

        Parameters
        ----------
        is_enough : callable, optional
            Called with a table that has holes; returns True if it has a number in every direction that is needed.
            Default: a table with holes is not enough.

        Returns
        -------
        Profile
        """

    def export_source(self) -> tuple[KnownMedium, dict[str, Any]]:
        """Return the map or table from which a profile file is made, and the other facts that the file states.

        Returns
        -------
        source : KnownMedium
        facts : dict of str to object
            Arguments of `write_profile` by name.
        """
        return self, {}


class OneTest:
    """Base of `rftfit.model.scaling.ScaledMedium`, for annotations here: a medium known by one penetration test.

    That module imports this one, and could not be imported here.
    """


class Profile(KnownMedium):
    """A function alpha(beta, gamma) of a medium, linear in its parameters.

    A profile may be a stack of draws: its parameters then have leading axes, which the arrays of `alpha` have too, and
    `pack` raises ValueError.

    Attributes
    ----------
    name : str
        What the profile is, for tables and captions.
    form : str
        Form in which alpha is known: ``table``, ``map``, ``nine terms``, ``generic``, ``depth-only``.
    reason : str
        Reason why alpha is NaN somewhere; empty if it is never NaN.
    spread : Profile, ScaledMedium or None
        Source of intervals: draws of the profile within its errors, or the one penetration test and the
        reference media from which the profile is scaled; None if no error is known.
    window : tuple of float
        Least and greatest depth over which alpha was measured, cm.
    bed_spread : float
        Relative standard deviation of forces from one prepared bed to the next.
    model_error : float
        Relative error of the force model itself in this medium (`rftfit.forces.model_error`), known for tables and
        maps; NaN for a profile of another form.
    beside : callable or None
        Function that returns the table or the map of the same medium, whose forces are shown beside those of nine
        terms.

    Examples
    --------
    >>> import numpy as np, rftfit
    >>> profile = rftfit.published_medium("poppy_LP")
    >>> alpha_z, alpha_x = profile.alpha(0.0, np.pi / 2)
    """

    name: str
    form: str
    reason: str
    spread: Profile | OneTest | None
    window: tuple[float, float] = ANY_DEPTH
    bed_spread: float = USUAL_BED_SPREAD
    model_error: float = math.nan
    beside: Callable[[], Profile] | None = None

    def as_profile(self, is_enough: Callable[[Profile], bool] | None = None) -> Profile:  # noqa: ARG002
        """Return the profile itself.

        Parameters
        ----------
        is_enough : callable, optional
            Not used: there is no other profile to choose.

        Returns
        -------
        Profile
        """
        return self

    @property
    @abstractmethod
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """Parameters of alpha_z, shape (..., p), and of alpha_x, shape (..., q), N/cm^3."""

    @abstractmethod
    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values of the functions whose sum, weighted with `parameters`, is alpha.

        Parameters
        ----------
        beta, gamma : numpy.ndarray, shape (...)
            Angles in rad, of the same shape.

        Returns
        -------
        basis_z : numpy.ndarray, shape (..., p)
        basis_x : numpy.ndarray, shape (..., q)
        """

    def weights_in_sums(
        self, factors: FloatArray, beta: FloatArray, gamma: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the weights of `parameters` in sums over n elements of alpha times a factor, as forces on bodies are.

        Parameters
        ----------
        factors : numpy.ndarray, shape (k, p, n)
            Factor of each of n elements, in p poses, for k sums.
        beta, gamma : numpy.ndarray, shape (p, n)
            Angles of each element, rad.

        Returns
        -------
        weights_z, weights_x : numpy.ndarray, shape (k, p, parameters)
            The same array twice if both components have the same basis.
        """
        basis_z, basis_x = self.basis(beta, gamma)
        by_pose = factors.transpose(1, 0, 2)
        weights_z = (by_pose @ basis_z).transpose(1, 0, 2)
        if basis_x is basis_z:
            return weights_z, weights_z
        return weights_z, (by_pose @ basis_x).transpose(1, 0, 2)

    @abstractmethod
    def _packed(self) -> Pack:
        """Make the `pack` of a profile that is no stack of draws."""

    @cached_property
    def pack(self) -> Pack:
        """Numbers of the profile for the compiled kernel. Raises ValueError for a stack of draws."""
        if self.parameters[0].ndim > 1:
            raise ValueError("a stack of draws has no pack; carry it through as draws")
        return self._packed()

    def alpha(self, beta: npt.ArrayLike, gamma: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return alpha, the stress per depth on a plate element.

        Parameters
        ----------
        beta, gamma : array_like
            Attack angle of the element and intrusion angle of its motion, rad, any value (see
            `rftfit.conventions`); shapes broadcast to (n, ...).

        Returns
        -------
        alpha_z, alpha_x : numpy.ndarray, shape (draws, ..., n, ...)
            N/cm^3, up and toward +x positive; NaN where the profile has no number or an angle is NaN.
        """
        beta, gamma = np.broadcast_arrays(np.asarray(beta, float), np.asarray(gamma, float))
        if self.parameters[0].ndim == 1 and is_worth_compiling(beta.size):
            return self._alpha_compiled(beta, gamma)
        return self._alpha(beta, gamma)

    def _alpha(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Calculate `alpha` in numpy, for angles of equal shape; the profile may be a stack of draws."""
        (basis_z, basis_x), (parameters_z, parameters_x) = self.basis(beta, gamma), self.parameters
        return weighted_sum(parameters_z, basis_z), weighted_sum(parameters_x, basis_x)

    def _alpha_compiled(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Calculate `alpha` by the compiled kernel, for angles of equal shape; the profile must be no stack."""
        from rftfit.model.kernel import alpha

        # the kernel is compiled for contiguous, writable arrays
        angles = (np.require(angle.ravel(), float, ["C", "W"]) for angle in (beta, gamma))
        alpha_z, alpha_x = alpha(self.pack, *angles)
        return alpha_z.reshape(beta.shape), alpha_x.reshape(beta.shape)


FAR_DEG = 18.0
"""Distance from every push, degrees, above which a direction counts as far from them: half the diagonal of the largest
cell of the published grid."""

REACH_DEG: float = _CHOSEN.reach_deg
"""Greatest distance from a push, degrees, in beta and gamma as the sides of a right angle, where scattered pushes give
alpha."""

_MOST_COMPARED = 5000
"""Most directions that are compared with all pushes at once."""


class TableProfile(Profile):
    """Alpha interpolated from a measured table, completed by symmetry.

    If the directions lie on a grid, full or with holes, alpha is bilinear between the lines of the grid; a
    missing cell makes alpha NaN between its neighbours and at its mirror image.
    Scattered directions are triangulated on the torus of all directions; farther than `REACH_DEG`
    from every push alpha is NaN.

    Parameters
    ----------
    alpha_z, alpha_x : numpy.ndarray, shape (..., *cells)
        N/cm^3, NaN where missing; leading axes are draws.
    beta, gamma : array_like, optional
        Angles in rad; shapes broadcast to the shape of the cells: ``(n,)`` for a list of directions, ``(nb, 1)`` and
        ``(ng,)`` for a grid. Default: the grid of Table S5, cells (7, 13).
    name : str, optional
    reasons : dict of (float, float) to str, optional
        Reason why a cell is missing, by (beta, gamma) in degrees.
    spread : Profile, optional
        Draws of the table within its errors.

    Raises
    ------
    ValueError
        If the angles do not fit the values.

    Examples
    --------
    >>> import numpy as np, rftfit
    >>> profile = rftfit.TableProfile(np.full((7, 13), 0.3), np.zeros((7, 13)))
    """

    form = "table"
    model_error = EPS
    stated: Mapping[str, Any] = MappingProxyType({})
    """What a profile file states of the medium, by arguments of `write_profile`."""

    def __init__(
        self,
        alpha_z: FloatArray,
        alpha_x: FloatArray,
        beta: npt.ArrayLike | None = None,
        gamma: npt.ArrayLike | None = None,
        name: str = "measured table",
        reasons: dict[tuple[float, float], str] | None = None,
        spread: Profile | None = None,
    ) -> None:
        beta_of, gamma_of = np.broadcast_arrays(
            np.radians(BETA_DEG)[:, None] if beta is None else np.asarray(beta, dtype=float),
            np.radians(GAMMA_DEG) if gamma is None else np.asarray(gamma, dtype=float),
        )
        alpha_z, alpha_x = np.asarray(alpha_z, dtype=float), np.asarray(alpha_x, dtype=float)
        shape = beta_of.shape
        if alpha_z.shape != alpha_x.shape or alpha_z.shape[alpha_z.ndim - len(shape) :] != shape:
            raise ValueError(
                f"there are {' x '.join(map(str, shape))} cells, "
                f"the values have shapes {alpha_z.shape} and {alpha_x.shape}"
            )
        flat = (*alpha_z.shape[: alpha_z.ndim - len(shape)], -1)
        angles = beta_of.ravel(), gamma_of.ravel()
        alpha = alpha_z.reshape(flat), alpha_x.reshape(flat)
        grid = find_grid(*angles)
        nodes = _triangulate(*angles, *alpha) if grid is None else grid.complete(*alpha)
        self._set((*angles, *alpha), nodes, name, spread=spread)
        self.scattered = grid is None  # True: triangulated
        self.reason = self._format_reason(reasons or {})

    def _set(
        self,
        cells: Arrays,
        nodes: Arrays,
        name: str,
        reason: str = "",
        spread: Profile | None = None,
    ) -> None:
        """Set the attributes of a table on a grid: all constructors end here.

        `cells`: beta, gamma (rad) and alpha_z, alpha_x of the cells, shapes (n,) and (..., n). `nodes`: lines of the
        completed grid in beta and gamma (rad), and alpha_z, alpha_x at its nodes, shape (..., nb, ng). `name`,
        `reason`, `spread`: as in `Profile`.
        """
        self.cells, self.scattered = cells, False
        self.beta, self.gamma, self.alpha_z, self.alpha_x = nodes
        self.name, self.reason, self.spread = name, reason, spread

    @classmethod
    def published(cls, medium: str) -> TableProfile:
        """Make the profile of Table S5 of one published medium.

        Parameters
        ----------
        medium : str
            One of `rftfit.reference.MEDIA`.

        Returns
        -------
        TableProfile

        Raises
        ------
        InputError
            If there is no such medium.
        """
        choose("medium", medium, MEDIA, "published media")
        return cls(*alpha_grid(medium), name=f"published Table S5, {medium}")

    @classmethod
    def from_table(
        cls, table: pd.DataFrame, name: str = "measured table", spread: Profile | None = None
    ) -> TableProfile:
        """Make the profile of one medium from its alpha table.

        Parameters
        ----------
        table : pandas.DataFrame
            Columns ``beta_deg, gamma_deg, alpha_z_N_per_cm3, alpha_x_N_per_cm3`` and optionally
            ``reason``, one row for each cell, any directions, as `rftfit.Medium.alpha`.
        name : str, optional
        spread : Profile, optional
            Draws of the table.

        Returns
        -------
        TableProfile
        """
        empty = table[~np.isfinite(table[column("z")].to_numpy(float))]
        reasons = {
            _name_of_cell(row["beta_deg"], row["gamma_deg"]): row["reason"]
            for row in empty.to_dict("records")
            if isinstance(row.get("reason"), str)
        }
        return cls(*alpha_columns(table), *directions(table), name, reasons, spread)

    def _format_reason(self, reasons: dict[tuple[float, float], str]) -> str:
        """Say where and why alpha is NaN, for `reason`; empty if it is never NaN.

        `reasons`: why a cell is missing, by (beta, gamma) in degrees.
        """
        if not (np.isnan(self.alpha_z) | np.isnan(self.alpha_x)).any():
            return ""
        beta, gamma, *alpha = self.cells
        # by directions, not cells: a missing cell counts only if no other cell of its direction has alpha
        directions = torus(beta, gamma)
        # missing in either component and any draw: shape (directions,)
        is_missing = np.isnan(directions.complete(*alpha)).any(axis=0)
        is_missing = is_missing.reshape(-1, is_missing.shape[-1]).any(axis=0)
        # the cell itself, not one whose mirror image the direction is
        missing_cells = np.unique(directions.cell[is_missing][directions.sign[is_missing] > 0])
        described = []
        for cell in missing_cells[missing_cells >= 0]:
            name = _name_of_cell(np.degrees(beta[cell]), np.degrees(gamma[cell]))
            why = reasons.get(name)
            described.append("({:g}, {:g})".format(*name) + (f": {why}" if why else ""))
        if self.scattered:
            far = f"farther than {REACH_DEG:g} deg from every push"
        else:
            far = f"where no run was made, or between lines of the grid more than {WIDEST_DEG:g} deg apart"
        if not described:
            return f"{self.name}: no alpha {far}"
        nor_far = f"; nor {far}" if self.scattered else ""
        return f"{self.name}: no alpha at (beta, gamma) in degrees {'; '.join(described)}{nor_far}"

    @property
    def doubt(self) -> str:
        """Verdict on the data that the profile file states if it is ``doubtful`` or ``unusable``; otherwise empty."""
        return str(self.stated.get("marks", ""))

    def export_source(self) -> tuple[KnownMedium, dict[str, Any]]:
        """Return the table itself, and what the profile file that it is from states of the medium.

        Returns
        -------
        source : KnownMedium
        facts : dict of str to object
            Arguments of `write_profile` by name.
        """
        return self, dict(self.stated)

    @classmethod
    def of_directions(
        cls,
        beta: FloatArray,
        gamma: FloatArray,
        alpha: tuple[FloatArray, FloatArray],
        name: str = "",
        reason: str = "",
    ) -> TableProfile:
        """Make a table of alpha, z and x, each (..., n), in n directions (rad).

        With their mirror images they are a whole grid, as in a profile file. No angle is moved or interpolated: raises
        ValueError if the grid has holes or does not begin at beta = -90 and gamma = -180 degrees.
        """
        grid = find_exact_grid(torus(beta, gamma))
        offset = np.inf if grid is None else max(grid.beta[0] + np.pi / 2, grid.gamma[0] + np.pi)
        if grid is None or offset > 1e-9 or (grid.node < 0).any():
            raise ValueError("the directions are no whole grid")
        profile = cls.__new__(cls)
        profile._set((beta, gamma, *alpha), grid.complete(*alpha), name, reason)
        return profile

    @classmethod
    def of_nodes(
        cls,
        beta: FloatArray,
        gamma: FloatArray,
        alpha: tuple[FloatArray, FloatArray],
        name: str = "",
        reason: str = "",
    ) -> TableProfile:
        """Make a table of alpha, z and x, each (..., nb, ng), on a complete grid.

        `beta`, `gamma`: its lines, rad, (nb,) from -pi/2 to pi/2 and (ng,) from -pi to pi, both ends included. Alpha
        must have its symmetry already.
        """
        # the cells are the nodes that are no mirror images of others
        in_half = np.abs(gamma) < np.pi / 2 + NEGLIGIBLE
        cell_beta, cell_gamma = np.meshgrid(beta, gamma[in_half], indexing="ij")
        z, x = (component[..., in_half].reshape(*component.shape[:-2], -1) for component in alpha)
        profile = cls.__new__(cls)
        cells = cell_beta.ravel(), cell_gamma.ravel(), z, x
        profile._set(cells, (beta, gamma, *alpha), name, reason)
        return profile

    @cached_property
    def pushed(self) -> FloatArray:
        """Measured directions, each once: rows beta and gamma in degrees, alpha_z, alpha_x and their standard errors.

        Shape (6, n); alpha and errors in N/cm^3, NaN if not known.
        """
        beta, gamma, *alpha = self.cells
        number, listed = list_once(beta, gamma)
        mean = np.stack(listed.complete(*alpha))
        se = np.full_like(mean, np.nan)
        if isinstance(self.spread, TableProfile):
            se = np.stack(listed.complete(*self.spread.cells[2:])).std(axis=1, ddof=1)
        rows = np.concatenate([np.degrees([beta[number], gamma[number]]), mean, se])
        return rows[:, np.isfinite(mean).any(axis=0)]

    def far_from_pushes(
        self, beta: FloatArray, gamma: FloatArray, far_deg: float = FAR_DEG
    ) -> npt.NDArray[np.bool_]:
        """Return True for directions (n,), rad, farther than `far_deg` from every push and its mirror image, shape (n,).

        The distance is the root of the squares of both angles between them. Alpha there is interpolated widely.
        """
        pushed = np.radians(self.pushed[:2])
        pushed_beta, pushed_gamma = np.concatenate([pushed, mirror(*pushed)], axis=1)
        is_far = np.empty(len(beta), dtype=bool)
        for start in range(0, len(beta), _MOST_COMPARED):
            block = slice(start, start + _MOST_COMPARED)
            apart_beta = wrap_beta(beta[block, None] - pushed_beta)
            apart_gamma = wrap_gamma(gamma[block, None] - pushed_gamma)
            apart_deg = np.degrees(np.hypot(apart_beta, apart_gamma))
            is_far[block] = apart_deg.min(axis=1, initial=np.inf) > far_deg
        return is_far

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """Alpha_z and alpha_x at all nodes of the completed table, N/cm^3, each (..., nb * ng), gamma running fastest."""
        shape = (*self.alpha_z.shape[:-2], -1)
        return self.alpha_z.reshape(shape), self.alpha_x.reshape(shape)

    def _packed(self) -> Pack:
        """Pack alpha at the four corners of each cell: low and high in beta, then in gamma, of z and then of x."""
        ends = (slice(None, -1), slice(1, None))
        alphas = (self.alpha_z, self.alpha_x)
        corners = [alpha[row, column] for alpha in alphas for row in ends for column in ends]
        return make_pack(TABLE, np.zeros(0), self.beta, self.gamma, np.stack(corners, axis=-1))

    def _corners(
        self, beta: FloatArray, gamma: FloatArray
    ) -> Iterator[tuple[IndexArray, FloatArray]]:
        """Yield index (as in `parameters`) and weight of each of the four nodes around directions (rad), in their shape.

        The four bilinear weights of a direction add up to 1.
        """
        # u, v: position between the lines below and above, from 0 to 1
        row, u = _find_interval(self.beta, wrap_beta(beta))
        col, v = _find_interval(self.gamma, wrap_gamma(gamma))
        for row_step, weight_u in ((0, 1 - u), (1, u)):
            for column_step, weight_v in ((0, 1 - v), (1, v)):
                yield (row + row_step) * self.gamma.size + col + column_step, weight_u * weight_v

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the bilinear weights of the nodes, (..., nodes), the same array for z and x."""
        weights = np.zeros((beta.size, self.beta.size * self.gamma.size))
        directions = np.arange(beta.size)
        for node, weight in self._corners(beta.ravel(), gamma.ravel()):
            weights[directions, node] += weight
        weights = weights.reshape(*beta.shape, -1)
        return weights, weights

    def weights_in_sums(
        self, factors: FloatArray, beta: FloatArray, gamma: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the same as `Profile.weights_in_sums`, faster: alpha of an element depends on four nodes alone.

        Shapes as there: `factors` (k, p, n), angles (p, n), weights (k, p, nodes).
        """
        poses, nodes = len(beta), self.beta.size * self.gamma.size
        first_node = nodes * np.arange(poses)[:, None]
        corners = [*self._corners(beta, gamma)]
        # the nodes of all poses in one row, so that one call adds the weights of all
        node_of_pose = np.stack([first_node + node for node, _ in corners]).ravel()
        corner_weights = np.stack([weight for _, weight in corners])
        sums = np.empty((len(factors), poses * nodes))
        for number, factor in enumerate(factors):
            weighted = (corner_weights * factor).ravel()
            sums[number] = np.bincount(node_of_pose, weighted, minlength=poses * nodes)
        weights = sums.reshape(len(factors), poses, nodes)
        return weights, weights

    def sums_of_sizes(
        self, factors: FloatArray, beta: FloatArray, gamma: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Sum |alpha| times a factor over n elements in p poses, for each draw.

        `factors`, `beta`, `gamma` (rad): shape (p, n). Returns the sums of |alpha_z| and of |alpha_x|, shape (draws,
        p). An unknown alpha counts as 0. Where all nodes around an element have one sign in all draws, |alpha| is
        linear in the nodes, and these elements are summed at once. The others are interpolated draw by draw, in single
        precision.
        """
        # index of each node, and whether its weight counts
        corners = [(node, weight >= NEGLIGIBLE) for node, weight in self._corners(beta, gamma)]
        corner_count = np.sum([counts for _, counts in corners], axis=0)
        sums = []
        for alpha in map(np.atleast_2d, self.parameters):
            # 0 for a node whose alpha changes its sign between draws
            node_sign = np.where((alpha >= 0).all(axis=0), 1.0, -1.0 * (alpha <= 0).all(axis=0))
            sign_sum = np.sum([counts * node_sign[node] for node, counts in corners], axis=0)
            # elements all of whose nodes have one sign
            is_linear = np.abs(sign_sum) == corner_count
            signed_factors = np.where(is_linear, np.sign(sign_sum) * factors, 0.0)
            weights = self.weights_in_sums(signed_factors[None], beta, gamma)[0][0]
            total = np.nan_to_num(alpha) @ weights.T
            # the other elements that bear a load
            pose, element = np.nonzero((factors > 0) & ~is_linear)
            if pose.size:
                alpha_of_elements = self.interpolate_draws(
                    alpha.astype(np.float32).T.copy(), beta[pose, element], gamma[pose, element]
                )
                sizes = np.abs(np.nan_to_num(alpha_of_elements)) * factors[pose, element, None]
                poses, starts = np.unique(pose, return_index=True)
                total[:, poses] += np.add.reduceat(sizes, starts, axis=0).T
            sums.append(total)
        return sums[0], sums[1]

    def interpolate_draws(
        self, values: npt.NDArray[np.float32], beta: FloatArray, gamma: FloatArray
    ) -> npt.NDArray[np.float32]:
        """Interpolate values at the nodes, shape (nodes, draws), in n directions (rad); returns shape (n, draws).

        In single precision, which is enough for a load; `alpha` has double precision.
        """
        corners = [
            (node, weight.astype(np.float32)[:, None], weight >= NEGLIGIBLE)
            for node, weight in self._corners(beta, gamma)
        ]
        sums = np.zeros((beta.size, values.shape[1]), np.float32)
        # in blocks of rows that stay in the cache of the processor
        rows_at_once = 128
        for start in range(0, beta.size, rows_at_once):
            for node, weights, counts in corners:
                rows = start + np.flatnonzero(counts[start : start + rows_at_once])
                sums[rows] += weights[rows] * values[node[rows]]
        return sums

    def _alpha(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Calculate `alpha` from the four nodes around each direction, without the weights of all nodes."""
        corners = [*self._corners(beta, gamma)]

        def interpolate(node_alpha: FloatArray) -> FloatArray:
            """Sum one component of alpha at the four nodes with their weights, in the shape of the directions."""
            sums = np.zeros((*node_alpha.shape[:-1], *beta.shape))
            for node, weight in corners:
                corner_alpha = node_alpha[..., node]
                # a missing node without weight does not make alpha NaN
                idle = (weight < NEGLIGIBLE) & np.isnan(corner_alpha)
                sums += np.where(idle, 0.0, weight * corner_alpha)
            return sums

        alpha_z, alpha_x = self.parameters
        return interpolate(alpha_z), interpolate(alpha_x)


def _name_of_cell(beta_deg: float, gamma_deg: float) -> tuple[float, float]:
    """Return the angles of a cell, degrees, rounded to 0.1: its name, equal for angles from a file and from a grid."""
    return round(float(beta_deg), 1) + 0.0, round(float(gamma_deg), 1) + 0.0


def _triangulate(
    beta: FloatArray, gamma: FloatArray, alpha_z: FloatArray, alpha_x: FloatArray
) -> Arrays:
    """Interpolate alpha (..., n) in scattered directions (n,), rad, on a regular grid.

    Alpha is linear in triangles between directions on the torus, mirror images included. Returns beta, gamma
    of the grid (rad), and alpha_z, alpha_x of shape (..., nb, ng).
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import Delaunay, KDTree

    step_deg = _CHOSEN.triangulation_step_deg
    rows, columns = np.arange(-90, 91, step_deg), np.arange(-180, 181, step_deg)
    is_finite = np.isfinite(alpha_z + alpha_x)
    has_alpha = is_finite.reshape(-1, is_finite.shape[-1]).all(axis=0)
    shape = (*alpha_z.shape[:-1], rows.size, columns.size)
    if not has_alpha.any():
        unknown = np.full(shape, np.nan)
        return np.radians(rows), np.radians(columns), unknown, unknown
    whole = torus(beta[has_alpha], gamma[has_alpha])
    directions_deg = np.degrees(np.column_stack([whole.beta, whole.gamma]))
    # the torus as a plane, with one more period to each side
    shifts = [(b, g) for b in (-180, 0, 180) for g in (-360, 0, 360)]
    points = np.concatenate([directions_deg + shift for shift in shifts])
    nodes_deg = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    # weights of the directions at each node, (nodes, directions): interpolated functions that are 1 in one direction each
    ones = np.tile(np.eye(len(directions_deg)), (len(shifts), 1))
    weights = LinearNDInterpolator(Delaunay(points), ones)(nodes_deg)
    is_near = KDTree(points).query(nodes_deg)[0] <= REACH_DEG
    # index of the mirror image of each node: (-beta, 180 - gamma)
    nodes = np.arange(len(nodes_deg)).reshape(rows.size, columns.size)
    image = nodes[::-1, np.searchsorted(columns, -columns % 360 - 180)].ravel()

    def interpolate(alpha: FloatArray, sign: float) -> FloatArray:
        """Interpolate one component of alpha (..., directions) at the nodes; `sign`: that of its mirror image."""
        # four directions on a circle make two triangles in either of two ways, and an image may have the other one:
        # the mean of both is symmetric
        symmetric_weights = (weights + sign * weights[image]) / 2
        node_alpha = (symmetric_weights @ alpha.reshape(-1, alpha.shape[-1]).T).T
        return np.where(is_near & is_near[image], node_alpha, np.nan).reshape(shape)

    z, x = whole.complete(alpha_z[..., has_alpha], alpha_x[..., has_alpha])
    return np.radians(rows), np.radians(columns), interpolate(z, 1.0), interpolate(x, -1.0)


def _find_interval(nodes: FloatArray, angle: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return the index of the interval between nodes that holds an angle, and how far the angle lies in it, 0 to 1.

    `nodes`: increasing, rad. `angle`: any shape, that of both results. Of an angle that is NaN the second number is
    NaN.
    """
    index = np.clip(np.searchsorted(nodes, angle, side="right") - 1, 0, nodes.size - 2)
    return index, (angle - nodes[index]) / (nodes[index + 1] - nodes[index])


class FourierProfile(Profile):
    """Alpha as a sum of nine terms.

    Parameters
    ----------
    coefficients : array_like, shape (..., 9)
        A00, A10, B11, B01, Bm1, C11, C01, Cm1, D10 as in Table S2, N/cm^3; leading axes are draws.
    name : str, optional
    reason : str, optional
        Reason why coefficients are NaN.
    spread : Profile or ScaledMedium, optional
        Draws of the profile, or the penetration test and the media from which it is scaled.

    Raises
    ------
    ValueError
        If there are not nine coefficients.

    Examples
    --------
    >>> import rftfit
    >>> profile = rftfit.FourierProfile([0.2, 0.2, 0.2, 0.4, 0.1, -0.1, 0.3, 0.0, 0.1])
    """

    form = "nine terms"

    def __init__(
        self,
        coefficients: npt.ArrayLike,
        name: str = "nine terms",
        reason: str = "",
        spread: Profile | OneTest | None = None,
    ) -> None:
        self.coefficients = _check_size(coefficients, len(TERMS), "nine coefficients")
        self.name, self.spread = name, spread
        missing = bool(np.isnan(self.coefficients).any())
        self.reason = reason or (f"{name}: a coefficient is missing" if missing else "")

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """The five coefficients of alpha_z and the four of alpha_x, N/cm^3."""
        split = len(TERMS_Z)
        return self.coefficients[..., :split], self.coefficients[..., split:]

    def _packed(self) -> Pack:
        """Pack the nine coefficients."""
        return pack_values(FOURIER, self.coefficients)

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the five terms of alpha_z, (..., 5), and the four of alpha_x, (..., 4); NaN where an angle is NaN."""
        terms_z, terms_x = basis(beta, gamma)
        # the constant term does not depend on the angles
        unknown = np.isnan(beta) | np.isnan(gamma)
        terms_z = np.where(unknown, np.nan, terms_z)
        return np.moveaxis(terms_z, 0, -1), np.moveaxis(terms_x, 0, -1)


def _check_size(values: npt.ArrayLike, size: int, shape_text: str) -> FloatArray:
    """Return values as an array; raise ValueError if its last axis has not this size.

    `shape_text`: words on the size, for the message.
    """
    array = np.asarray(values, dtype=float)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{shape_text} wanted, found an array of shape {array.shape}")
    return array


def scaled_generic(
    zeta: npt.ArrayLike,
    m0: FloatArray,
    name: str = "generic",
    spread: Profile | OneTest | None = None,
) -> FourierProfile:
    """Make the profile of a medium of which only the scaling factor is known: zeta times the generic coefficients.

    Parameters
    ----------
    zeta : array_like, shape (...)
        Dimensionless; an array makes a stack of draws.
    m0 : numpy.ndarray, shape (..., 9)
        Generic coefficients (`rftfit.Reference.m0`); leading axes (draws) broadcast with those of `zeta`.
    name : str, optional
    spread : Profile or ScaledMedium, optional
        Source of intervals, as in `Profile.spread`.

    Returns
    -------
    FourierProfile

    Raises
    ------
    ValueError
        If there are not nine coefficients.

    Examples
    --------
    >>> import rftfit
    >>> profile = rftfit.scaled_generic(0.5, rftfit.published_reference().m0)
    """
    profile = FourierProfile(np.asarray(zeta, dtype=float)[..., None] * m0, name, spread=spread)
    profile.form = "generic"
    return profile


class DepthOnlyProfile(Profile):
    """The paper's baseline: stress depends on depth and projected area, but on no angle otherwise.

    alpha_z = alpha_z(0, pi/2) |cos beta| in motion downward, alpha_z(0, -pi/2) |cos beta| in motion upward, 0 in
    purely horizontal motion; alpha_x = alpha_x(pi/2, 0) |sin beta| in motion toward -x, its negative in motion
    toward +x, 0 in purely vertical motion.

    Parameters
    ----------
    values : array_like, shape (..., 3)
        alpha_z(0, pi/2), alpha_z(0, -pi/2) (negative: the medium resists motion upward) and
        alpha_x(pi/2, 0), N/cm^3; leading axes are draws.
    name : str, optional
    reason : str, optional
        Reason why a value is NaN.
    spread : Profile, optional
        Draws of the profile.

    Raises
    ------
    ValueError
        If there are not three values.

    Examples
    --------
    >>> import rftfit
    >>> baseline = rftfit.DepthOnlyProfile.of(rftfit.published_medium("poppy_LP"))
    """

    form = "depth-only"

    def __init__(
        self,
        values: npt.ArrayLike,
        name: str = "depth-only",
        reason: str = "",
        spread: Profile | None = None,
    ) -> None:
        self.values = _check_size(values, 3, "three values")
        self.name, self.reason, self.spread = name, reason, spread

    @classmethod
    def of(cls, profile: Profile, name: str = "depth-only") -> DepthOnlyProfile:
        """Make the baseline, and its spread, from alpha of another profile in three directions.

        Parameters
        ----------
        profile : Profile
            A profile, or a stack of draws.
        name : str, optional

        Returns
        -------
        DepthOnlyProfile
        """
        alpha_z, alpha_x = profile.alpha([0.0, 0.0, np.pi / 2], [np.pi / 2, -np.pi / 2, 0.0])
        values = np.concatenate([alpha_z[..., :2], alpha_x[..., 2:]], axis=-1)
        spread = cls.of(profile.spread, name) if isinstance(profile.spread, Profile) else None
        return cls(values, name, profile.reason if np.isnan(values).any() else "", spread)

    @property
    def parameters(self) -> tuple[FloatArray, FloatArray]:
        """The two values of alpha_z and the one of alpha_x, N/cm^3."""
        return self.values[..., :2], self.values[..., 2:]

    def _packed(self) -> Pack:
        """Pack the three values."""
        return pack_values(DEPTH_ONLY, self.values)

    def basis(self, beta: FloatArray, gamma: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the projected area of a plate for each value, (..., 2) and (..., 1), signed to oppose the motion.

        A velocity component below `STILL` of the speed counts as 0, so that rounding does not choose its sign.
        """
        # components of the unit velocity toward -z and -x
        down, left = np.sin(gamma), np.cos(gamma)
        level, upright = np.abs(np.cos(beta)), np.abs(np.sin(beta))
        unknown = (np.isnan(beta) | np.isnan(gamma))[..., None]
        basis_z = np.stack([level * (down > STILL), level * (down < -STILL)], axis=-1)
        basis_x = upright * ((left > STILL).astype(float) - (left < -STILL))
        return np.where(unknown, np.nan, basis_z), np.where(unknown, np.nan, basis_x[..., None])


def published_medium(medium: str, kind: str = "table") -> Profile:
    """Return the profile of one of the five media of Li, Zhang and Goldman (2013), from the printed tables.

    Parameters
    ----------
    medium : str
        ``poppy_LP``, ``poppy_CP``, ``glass0.3mm_LP``, ``glass0.3mm_CP`` or ``glass3mm_CP``.
    kind : str, optional
        ``table``: Table S5 interpolated. ``fourier``: coefficients of Table S2. ``generic``: the
        medium's printed zeta times the printed generic coefficients. ``depth_only``: the baseline
        without angles, from three cells of Table S5.

    Returns
    -------
    Profile
        Its `spread` is None: the tables are printed without errors.

    Raises
    ------
    InputError
        If there is no such medium or kind.

    Examples
    --------
    >>> import numpy as np, rftfit
    >>> alpha_z, alpha_x = rftfit.published_medium("poppy_LP").alpha(0.0, np.pi / 2)
    >>> round(float(alpha_z), 2)
    0.35
    """
    choose("profile", kind, PUBLISHED_KINDS)
    table = TableProfile.published(medium)
    profile: Profile = table
    if kind == "fourier":
        name = f"published Table S2, {medium}"
        profile = FourierProfile(as_array(coefficients(medium)), name)
    elif kind == "generic":
        zeta = coefficients(medium)["zeta"]
        name = f"published Table S2, zeta of {medium} ({zeta:g}) times generic"
        profile = scaled_generic(zeta, as_array(coefficients("generic")), name)
    elif kind == "depth_only":
        name = f"depth-only, from {table.name.removeprefix('published ')}"
        profile = DepthOnlyProfile.of(table, name)
    profile.window = PAPER_WINDOW
    if kind in ("fourier", "generic"):
        profile.beside = partial(published_medium, medium)
    return profile
