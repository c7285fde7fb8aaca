"""Test whether alpha of two sets of runs differs in size or in shape, by single runs in common directions.

A run is y = s T (1 + bed) + patches + error of the run, with T the alpha of its direction and s the size of its set.
The contrast of a direction is the mean of B, divided by the ratio of sizes, minus the mean of A. The ratio of sizes is
the one that makes the weighted squares of all contrasts least; the squares that remain show a difference of shape.
Weights come from the scatter of repeats, in proportion to alpha with a floor, so that weak directions do not dominate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, is_straight_down, number_directions
from rftfit.errors import InputError
from rftfit.measure.alpha import column
from rftfit.measure.errors import LEAST_DOF, USUAL_BED_SPREAD
from rftfit.measure.repeats import (
    Repeats,
    RunScatter,
    joined,
    level_of_floors,
    scatter_of_repeats,
    unit_vectors,
    usual_scatter,
)
from rftfit.measure.slopes import student_p, student_quantile
from rftfit.store.chosen import chosen
from rftfit.store.text import count, table

_CHOSEN = chosen("compare", "contrast")

PRIOR_ALONG = math.hypot(USUAL_BED_SPREAD, _CHOSEN.prior_across)
"""Scatter along the force that is assumed without any repeat, relative to alpha: of beds as a whole and of their
patches."""


@dataclass(frozen=True)
class RunSet:
    """Plate runs of one medium, and the errors that all of them share.

    `runs`: rows of ``results/fits/<medium>.csv``. Standard deviations of errors that all runs share: `surface_cm` of
    the height of the free surface, `turn_deg` of the angle of the mount, `rod_percent` of the bed that rods were pushed
    into. `campaign`, `medium`: runs of one campaign share the mount and the tares, those of one medium of it the bed of
    the rods, too. `tolerance_deg`: difference of each angle up to which runs are of one direction; the larger of two
    sets counts.
    """

    name: str
    runs: pd.DataFrame
    surface_cm: float = 0.0
    turn_deg: float = 0.0
    rod_percent: float = 0.0
    campaign: str = ""
    medium: str = ""
    tolerance_deg: float = TOLERANCE_DEG


@dataclass(frozen=True)
class Comparison:
    """How far alpha of B differs from alpha of A: made by `compare_media`.

    Parameters
    ----------
    a, b : str
        Names of the two media.
    ratio, ratio_lo, ratio_hi : float
        Size of B over size of A with its interval.
    size_p : float
        p value of "same size".
    shape_percent, shape_lo_percent, shape_hi_percent : float
        Root mean square difference of alpha after the ratio is taken out, in percent of the root mean square of
        alpha; NaN where no direction is common.
    shape_p : float
        p value of "same shape".
    least_ratio, least_shape_percent : float
        Least differences that these runs detect with a probability of 80 % (on the level 0.05).
    directions : pandas.DataFrame
        The common directions, those that differ most first.
    runs_a, runs_b : int
        Runs in the common directions.
    repeats : float
        Degrees of freedom of the repeats behind the scatter.
    assumed : bool
        True where the scatter of one medium, or of both, is assumed, because it has no repeats.
    scatter_along, scatter_across : float
        Scatter of single runs along and across the force, relative to alpha.
    explained_by : float
        Scatter along the force that would explain the whole difference of shape.
    notes : tuple of str
        Sentences on the limits of the comparison.
    confidence : float
        Level of the intervals.
    tolerance_deg : float
        Difference of each angle up to which runs are of one direction.

    Examples
    --------
    >>> import rftfit
    >>> comparison = rftfit.compare_media("poppy_LP", "poppy_CP")  # doctest: +SKIP
    >>> comparison.ratio, comparison.size_p, comparison.shape_p  # doctest: +SKIP
    """

    a: str
    b: str
    ratio: float
    ratio_lo: float
    ratio_hi: float
    size_p: float
    shape_percent: float = math.nan
    shape_lo_percent: float = math.nan
    shape_hi_percent: float = math.nan
    shape_p: float = math.nan
    least_ratio: float = math.nan
    least_shape_percent: float = math.nan
    directions: pd.DataFrame = field(default_factory=pd.DataFrame, repr=False)
    runs_a: int = 0
    runs_b: int = 0
    repeats: float = 0.0
    assumed: bool = False
    scatter_along: float = math.nan
    scatter_across: float = math.nan
    explained_by: float = math.nan
    notes: tuple[str, ...] = ()
    confidence: float = 0.95
    tolerance_deg: float = field(default=TOLERANCE_DEG, repr=False)

    @property
    def sentence(self) -> str:
        """The answer in one plain sentence."""
        size, shape = self.size_p < _CHOSEN.level, self.shape_p < _CHOSEN.level
        if math.isnan(self.shape_p):
            answer = _SIZE_ALONE[size]
        elif self.assumed:
            answer = _WITHOUT_REPEATS[size, shape]
        else:
            answer = _ANSWERS[size, shape]
        return answer.format(
            a=self.a,
            b=self.b,
            ratio=f"{self.ratio:.3g}",
            interval=f"{self.ratio_lo:.3g} to {self.ratio_hi:.3g}",
            shape=f"{self.shape_percent:.2g} %",
            shapes=f"{self.shape_lo_percent:.2g} to {self.shape_hi_percent:.2g} %",
            least=f"{self.least_ratio:.3g}",
            least_shape=f"{self.least_shape_percent:.2g} %",
            scatter=f"{100 * self.explained_by:.2g} %",
            directions=len(self.directions),
            down=""
            if math.isnan(self.ratio_down)
            else f", straight down it is {self.ratio_down:.3g}",
        )

    @property
    def ratio_down(self) -> float:
        """alpha_z of B over that of A at (0, 90 deg); NaN where that is no common direction."""
        if not len(self.directions):
            return math.nan
        beta_deg, gamma_deg = self.directions["beta_deg"], self.directions["gamma_deg"]
        down = self.directions[is_straight_down(beta_deg, gamma_deg, self.tolerance_deg)]
        if down.empty:
            return math.nan
        alpha_a, alpha_b = (float(down[f"alpha_z_{side}_N_per_cm3"].iloc[0]) for side in "ab")
        return alpha_b / alpha_a

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers, words and lists, as ``rftfit compare --json`` prints it.

        Returns
        -------
        dict of str to object
            The fields but `tolerance_deg`, ``sentence``, and ``directions`` as a dict for each row.
        """
        directions = self.directions.to_dict("records")
        facts = vars(self) | {"sentence": self.sentence, "directions": directions}
        del facts["tolerance_deg"]
        return facts

    def summary(self, most: int | None = None) -> str:
        """Format the comparison for people.

        Parameters
        ----------
        most : int, optional
            Most directions that are listed; default: all.

        Returns
        -------
        str
        """
        rows = [
            [
                "ratio of sizes, B/A",
                f"{self.ratio:.4g}",
                f"{self.ratio_lo:.4g} to {self.ratio_hi:.4g}",
                _cell(self.size_p, ".2g"),
                f"{self.least_ratio:.3g}",
            ]
        ]
        if not math.isnan(self.shape_p):
            rows.append(
                [
                    "difference of shape, rms",
                    f"{self.shape_percent:.2g} %",
                    f"{self.shape_lo_percent:.2g} to {self.shape_hi_percent:.2g} %",
                    _cell(self.shape_p, ".2g"),
                    f"{self.least_shape_percent:.2g} %",
                ]
            )
        interval = f"{100 * self.confidence:g} % interval"
        lines = [
            self.sentence,
            "",
            f"A: {self.a}\nB: {self.b}",
            table(["", "", interval, "p of no difference", "least detected"], rows),
        ]
        if len(self.directions):
            lines.append(
                f"{count(len(self.directions), 'common direction')}, {self.runs_a} and {self.runs_b} runs; scatter of a run: "
                f"{100 * self.scatter_along:.2g} % along the force, {100 * self.scatter_across:.2g} % across"
            )
        lines += [f"Note: {note}" for note in self.notes]
        if len(self.directions):
            lines += ["", self._list_directions(most)]
        return "\n".join(lines)

    def _list_directions(self, most: int | None) -> str:
        """Format the table of the directions that differ most."""
        head = ["beta", "gamma", "depth", "B/ratio - A: alpha_z"]
        head += ["interval", "alpha_x", "interval", "p"]
        rows = []
        for direction in self.directions.head(most or len(self.directions)).to_dict("records"):
            angles = [f"{direction['beta_deg']:g}", f"{direction['gamma_deg']:.4g}"]
            cells = [*angles, _cell(direction["depth_cm"], "g")]
            for c in "zx":
                names = (f"difference_{c}{end}_N_per_cm3" for end in ("", "_lo", "_hi"))
                middle, low, high = (direction[name] for name in names)
                cells.append(_cell(middle, ".3g"))
                cells.append("" if math.isnan(low) else f"{low:.2g} to {high:.2g}")
            rows.append([*cells, _cell(direction["p"], ".2g")])
        title = "Directions that differ most (degrees, cm, N/cm^3; intervals hold together):"
        rows_left = len(self.directions) - len(rows)
        rest = f"\n  and {rows_left} more (--all lists them)" if rows_left > 0 else ""
        return f"{title}\n{table(head, rows)}{rest}"


def _cell(number: float, number_format: str) -> str:
    """Format a number; NaN is empty."""
    return "" if math.isnan(number) else format(number, number_format)


_ANSWERS = {
    (
        False,
        False,
    ): "No difference between {a} and {b} is seen: ratio of sizes {ratio} ({interval}). A ratio of {least} or a "
    "difference of shape of {least_shape} would be detected in 8 of 10 such comparisons.",
    (
        True,
        False,
    ): "{b} is {ratio} times as strong as {a} ({interval}). No difference of shape is seen; one of {least_shape} "
    "would be detected in 8 of 10 such comparisons.",
    (
        False,
        True,
    ): "{b} is on average as strong as {a} (ratio {ratio}, {interval}), but has another shape: alpha differs by "
    "{shape} rms ({shapes}).",
    (
        True,
        True,
    ): "{b} has another shape than {a}, and alpha of another size: by {shape} rms ({shapes}) after the ratio of sizes is "
    "taken out, {ratio} ({interval}). This ratio is a mean over {directions} directions{down}; of media of different shapes it "
    "does not say that one is denser.",
}
_ONLY_IF = ", if single runs of one direction scatter by less than {scatter}"
_WITHOUT_REPEATS = {
    (False, False): _ANSWERS[False, False],
    (True, False): _ANSWERS[True, False],
    (False, True): _ANSWERS[False, True].removesuffix(".") + _ONLY_IF + ".",
    (True, True): _ANSWERS[True, True].replace("{shapes})", "{shapes})" + _ONLY_IF + ",", 1),
}
_SIZE_ALONE = {
    False: "No difference of size between {a} and {b} by their maps: ratio {ratio} ({interval}); without runs in common directions "
    "their shapes cannot be compared.",
    True: "{b} is {ratio} times as strong as {a} by their maps ({interval}); without runs in common directions their shapes "
    "cannot be compared.",
}


class NoCommonDirection(InputError):
    """No direction has runs on both sides."""


def compare_run_sets(a: RunSet, b: RunSet, confidence: float = 0.95) -> Comparison:
    """Compare two media by their runs in common directions.

    Raises `NoCommonDirection`, or `InputError` if the forces are opposite.
    """
    means_a, means_b, angles = _average_common_directions(a, b)
    means_a, means_b = _pool_sizes(means_a, means_b)
    scatter, by_side = _fit_scatters((means_a, means_b))
    repeats_of_sides = [float(side.repeats.dof.sum()) for side in (means_a, means_b)]
    are_enough = sum(repeats_of_sides) >= LEAST_DOF
    # what is stated is by the repeats alone, where there are enough
    stated = (
        scatter_of_repeats(joined([means_a.repeats, means_b.repeats])) if are_enough else scatter
    )
    scatter_along, scatter_across = stated.relative()
    contrast = _Contrast((means_a, means_b), by_side)
    ratio = contrast.find_ratio()
    size = contrast.test_size(ratio)
    shape = contrast.test_shape(ratio)
    half_width = float(student_quantile(confidence, size.dof)) * size.se
    low, high = shape.interval(confidence)
    return Comparison(
        a=a.name,
        b=b.name,
        ratio=ratio,
        ratio_lo=ratio * math.exp(-half_width),
        ratio_hi=ratio * math.exp(half_width),
        size_p=float(student_p(math.log(ratio) / size.se, size.dof)),
        shape_percent=100 * max(shape.rms(0.5), low),
        shape_lo_percent=100 * low,
        shape_hi_percent=100 * high,
        shape_p=_f_test_p(shape.squares / shape.k, shape.k, shape.dof),
        least_ratio=math.exp(errors_detected(size.dof) * size.se),
        least_shape_percent=100 * shape.least_rms(),
        directions=contrast.table(ratio, angles, confidence),
        runs_a=int(means_a.n.sum()),
        runs_b=int(means_b.n.sum()),
        repeats=sum(repeats_of_sides),
        scatter_along=scatter_along,
        scatter_across=scatter_across,
        explained_by=scatter.relative()[0] * math.sqrt(max(shape.squares / shape.k, 1.0)),
        notes=tuple(_describe_limits((a, b), (means_a, means_b), by_side)),
        assumed=not all(repeats_of_sides),
        confidence=confidence,
        tolerance_deg=_larger_tolerance(a, b),
    )


def _describe_limits(
    sides: tuple[RunSet, RunSet],
    means: tuple[_Means, _Means],
    scatters: tuple[RunScatter, RunScatter],
) -> Iterator[str]:
    """Yield sentences on what limits the comparison."""
    a, b = sides
    dof = [float(side.repeats.dof.sum()) for side in means]
    if not any(dof):
        yield (
            f"no direction was pushed twice: the scatter of single runs is assumed, {100 * PRIOR_ALONG:g} % along "
            f"the force and {100 * _CHOSEN.prior_across:g} % across"
        )
    elif not all(dof):
        alone = (a, b) if dof[0] else (b, a)
        yield f"{alone[1].name} has no repeats: its runs are taken to scatter as those of {alone[0].name}"
    elif sum(dof) < 2 * _CHOSEN.prior_dof:
        yield f"only {sum(dof):g} degrees of freedom show the scatter of single runs"
    squares = [
        _relative_square(side.repeats, scatter)
        for side, scatter in zip(means, scatters, strict=True)
    ]
    if min(dof) >= _CHOSEN.prior_dof and min(squares) > 0:
        p = 2 * min(
            _f_test_p(squares[1] / squares[0], dof[1], dof[0]),
            _f_test_p(squares[0] / squares[1], dof[0], dof[1]),
        )
        if p < _CHOSEN.level / 5:
            yield (
                f"runs of {a.name} scatter by {100 * math.sqrt(squares[0]):.2g} %, those of {b.name} by "
                f"{100 * math.sqrt(squares[1]):.2g} %"
            )
    deepest = [_number(side.runs, "depth_to_cm").max() for side in (a, b)]
    if all(math.isfinite(depth) and depth > 0 for depth in deepest):
        apart = abs(math.log(deepest[1] / deepest[0]))
        if apart > _CHOSEN.same_window:
            yield (
                f"fitted to {deepest[0]:.3g} cm in {a.name} and to {deepest[1]:.3g} cm in {b.name}: where stress is no "
                "line, this alone makes them differ"
            )


def _relative_square(repeats: Repeats, scatter: RunScatter) -> float:
    """Return the mean square, over the force, by which repeats differ along it, with noise; 0 without repeats."""
    level = scatter.weight @ level_of_floors(repeats.size, repeats.largest)
    dof = float(repeats.dof.sum())
    return float((repeats.along / level).sum()) / dof if dof else 0.0


# --- Directions


@dataclass(frozen=True)
class _Means:
    """Mean of the runs of each common direction, z and x, shape (n, 2), with what its error needs.

    `n`: number of runs. `noise_variance`: variance of the mean by the noise of the logs. `repeats`: squares of the runs
    about their mean, and the size of the force (see `_pool_sizes`). `common`: changes of the means by one standard
    deviation of an error that many runs share, by the name of the error.
    """

    mean: FloatArray
    n: FloatArray
    noise_variance: FloatArray
    repeats: Repeats
    common: Mapping[tuple[str, ...], FloatArray]


def _average_common_directions(a: RunSet, b: RunSet) -> tuple[_Means, _Means, FloatArray]:
    """Average the runs of both media in their common directions.

    Returned with the directions: beta, gamma, and depth of level runs, shape (3, n).
    """
    usable = [side.runs[np.isfinite(_number(side.runs, column("z")))] for side in (a, b)]
    angles = [
        np.stack([_number(runs, f"{name}_deg") for name in ("beta", "gamma")]) for runs in usable
    ]
    depths = [_number(runs, "depth_from_cm") for runs in usable]
    both, depth = np.concatenate(angles, axis=1), np.concatenate(depths)
    tolerance_deg = _larger_tolerance(a, b)
    number = number_directions(both[0], both[1], tolerance_deg, depth)
    split = len(usable[0])
    common = np.intersect1d(number[:split], number[split:])
    if not common.size:
        raise NoCommonDirection(
            f"{a.name} and {b.name} have no common direction: {_describe_directions(angles[0])} and "
            f"{_describe_directions(angles[1])} (beta, gamma in degrees, within {tolerance_deg:g})"
        )
    # x counts where all runs of a direction have it, on both sides
    x = np.concatenate([_number(runs, column("x")) for runs in usable])
    x_known = np.array([np.isfinite(x[number == cell]).all() for cell in common])
    numbers_of_sides = number[:split], number[split:]
    means = [
        _average_runs(side, runs, numbers, common, x_known)
        for side, runs, numbers in zip((a, b), usable, numbers_of_sides, strict=True)
    ]
    depth_cm = np.where(both[1, common] == 0, depth[common], math.nan)
    return means[0], means[1], np.vstack([both[:, common], depth_cm])


def _larger_tolerance(a: RunSet, b: RunSet) -> float:
    """Return the difference of each angle, deg, up to which runs of both media are of one direction."""
    return max(a.tolerance_deg, b.tolerance_deg)


def _pool_sizes(a: _Means, b: _Means) -> tuple[_Means, _Means]:
    """Replace the size of the force in each direction by that of the runs of both media, times the size of the medium.

    Otherwise a direction whose runs are weak by chance would have a small scatter and too much weight.
    """
    lengths = [max(math.sqrt(float((side.mean**2).sum())), 1e-30) for side in (a, b)]
    sizes = [np.hypot(*side.mean.T) / length for side, length in zip((a, b), lengths, strict=True)]
    pooled = (a.n * sizes[0] + b.n * sizes[1]) / (a.n + b.n)
    return _with_sizes(a, pooled * lengths[0]), _with_sizes(b, pooled * lengths[1])


def _with_sizes(side: _Means, size: FloatArray) -> _Means:
    """Return the means with other sizes of the force, shape (n,)."""
    largest = np.full(size.size, size.max())
    return replace(side, repeats=side.repeats._replace(size=size, largest=largest))


def _describe_directions(angles: FloatArray) -> str:
    """Write the first directions of a medium; `angles`: beta and gamma, shape (2, runs)."""
    directions = sorted(
        {(round(float(beta), 1), round(float(gamma), 1)) for beta, gamma in angles.T}
    )
    listed = ", ".join(f"({beta:g}, {gamma:g})" for beta, gamma in directions[:4])
    return listed + (f" and {len(directions) - 4} more" if len(directions) > 4 else "") or "none"


def _number(runs: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of the runs as numbers; NaN where the column is absent."""
    return pd.to_numeric(runs.get(name, pd.Series(math.nan, runs.index))).to_numpy(float)


def _error(runs: pd.DataFrame, quantity: str) -> FloatArray:
    """Return an error of alpha of the runs, z and x, shape (runs, 2); 0 where it is not stated."""
    parts = [_number(runs, column(c, f"_{quantity}")) for c in "zx"]
    return np.nan_to_num(np.stack(parts, axis=1))


def _average_runs(
    side: RunSet,
    runs: pd.DataFrame,
    number: npt.NDArray[np.intp],
    common: npt.NDArray[np.intp],
    x_known: npt.NDArray[np.bool_],
) -> _Means:
    """Average the runs of one medium in each common direction, and collect the errors of the means.

    `number`: direction of each run. `common`: numbers of the common directions. `x_known`: where alpha_x counts.
    """
    # weight of each run in the mean of each direction, shape (n, runs)
    share = (number == common[:, None]).astype(float)
    n = share.sum(axis=1)
    share /= n[:, None]
    alpha = np.nan_to_num(np.stack([_number(runs, column(c)) for c in "zx"], axis=1))
    mean = share @ alpha
    mean[:, 1] *= x_known
    startup, tare, curvature = (_error(runs, name) for name in ("startup", "tare", "curvature"))
    lever = np.nan_to_num(_number(runs, "lever_per_cm"))[:, None]
    clock = alpha * lever * np.nan_to_num(_number(runs, "clock_cm"))[:, None]
    # variance of single runs: the curvature is alike in runs over the same depths, tare and clock
    # are shared and counted below
    run_variance = _error(runs, "se") ** 2 - startup**2 - tare**2 - curvature**2 - clock**2
    run_variance = np.maximum(run_variance, 0.0)
    unit = unit_vectors(mean.T)
    off = alpha[None] - mean[:, None]
    is_of_direction = share > 0
    along, across = (
        np.where(is_of_direction, np.einsum("crk,kc->cr", off, way) ** 2, 0.0).sum(axis=1)
        for way in unit
    )
    noise_along, noise_across = np.einsum("wkc,ck->wc", unit**2, share @ run_variance)
    size = np.hypot(*mean.T)
    repeats = Repeats(
        n - 1, along, across, x_known, noise_along, noise_across, size, np.full(n.size, size.max())
    )
    turned = np.where(np.nan_to_num(_number(runs, "mirrored")) != 0, -1.0, 1.0)[:, None]
    effects: dict[tuple[str, ...], FloatArray] = {
        (side.name, side.campaign, "surface"): share @ (alpha * lever * side.surface_cm),
        (side.name, side.campaign, "clock"): share @ clock,
        (side.campaign or side.name, "turn"): share
        @ (np.stack([-alpha[:, 1], alpha[:, 0]], axis=1) * turned * math.radians(side.turn_deg)),
        (side.campaign or side.name, side.medium, "rod"): share
        @ (_error(runs, "rod") * side.rod_percent / 100),
    }
    tares = runs.get("tare_run", pd.Series("", runs.index)).fillna("").astype(str).to_numpy()
    signed = tare * np.where([False, True], turned, 1.0)
    for name in dict.fromkeys(tares):
        of_tare = share @ (signed * (tares == name)[:, None])
        for place, c in enumerate("zx"):
            effects[side.campaign or side.name, "tare", name, c] = of_tare * (np.arange(2) == place)
    return _Means(
        mean=mean,
        n=n,
        noise_variance=(share**2) @ run_variance + share @ startup**2,
        repeats=repeats,
        common={name: moved for name, moved in effects.items() if moved.any()},
    )


# --- Scatter of single runs


def _fit_scatters(sides: tuple[_Means, _Means]) -> tuple[RunScatter, tuple[RunScatter, RunScatter]]:
    """Estimate the scatter of the runs of both media together, and of each medium.

    The scatter of both together is the prior for each medium: one without repeats has the scatter of the other.
    """
    repeats = joined(side.repeats for side in sides)
    usual = usual_scatter(PRIOR_ALONG, _CHOSEN.prior_across)
    both = scatter_of_repeats(repeats, usual, _CHOSEN.prior_dof)
    of_a, of_b = (scatter_of_repeats(side.repeats, both, _CHOSEN.prior_dof) for side in sides)
    return both, (of_a, of_b)


# --- Both media together


@dataclass(frozen=True)
class _SizeTest:
    """Standard error of the logarithm of the ratio of sizes, and its degrees of freedom."""

    se: float
    dof: float


@dataclass(frozen=True)
class _ShapeTest:
    """Squares of the contrast: weighted to test whether the shapes differ, plain to state by how much.

    `squares`: weighted squares, which show best whether the shapes differ. `k`: their number. `dof`: degrees of freedom
    of the scatter. `plain`: mean square without weights, relative to that of alpha, which states by how much the shapes
    differ; by chance alone it is about `unit` times chi squared with `plain_k` degrees of freedom. `least_unit`: least
    plain mean square that makes the weighted squares 1.
    """

    squares: float
    k: float
    dof: float
    plain: float
    plain_k: float
    unit: float
    least_unit: float

    def interval(self, confidence: float) -> tuple[float, float]:
        """Return the interval of the rms difference; it lies above 0 where the weighted squares show a difference."""
        outside = (1 - confidence) / 2
        low, high = self.rms(1 - outside), self.rms(outside)
        shown = _find_argument(
            lambda size: _noncentral_f(self.squares, self.k, self.dof, size),
            confidence,
            self.squares,
        )
        return max(low, math.sqrt(shown * self.least_unit)) if shown else 0.0, high

    def rms(self, chance: float) -> float:
        """Return the rms difference with which a mean square of at most `plain` has a probability of `chance`."""
        from scipy.special import fdtri

        squares = self.plain / self.unit
        if chance < 0.5:
            # contrasts that are small by chance do not bound the difference better than usual ones
            squares = max(squares, self.plain_k * float(fdtri(self.plain_k, self.dof, 0.5)))
        size = _find_argument(
            lambda size: _noncentral_f(squares, self.plain_k, self.dof, size), chance, squares
        )
        return math.sqrt(size * self.unit)

    def least_rms(self) -> float:
        """Return the least root mean square difference that is detected with the chosen probability."""
        from scipy.special import fdtri

        limit = float(fdtri(self.k, self.dof, 1 - _CHOSEN.level)) * self.k
        least = _find_argument(
            lambda size: _noncentral_f(limit, self.k, self.dof, size), 1 - _CHOSEN.power
        )
        return math.sqrt(least * self.unit * self.plain_k / self.k)


def _covariance_of_means(side: _Means, scatter: RunScatter) -> FloatArray:
    """Return the covariance of the means of one medium by errors that runs do not share, shape (n, 2, 2)."""
    size = side.repeats.size
    spread = scatter.covariance(side.mean.T, size, size.max()) / side.n[:, None, None]
    return spread + side.noise_variance[:, :, None] * np.eye(2)


class _Contrast:
    """Contrast of two media with its covariance; `ratio`: size of B over size of A.

    Its k + 1 components are those of z in all directions, then those of x where both media have it.
    """

    def __init__(
        self, means: tuple[_Means, _Means], scatters: tuple[RunScatter, RunScatter]
    ) -> None:
        self.a, self.b = means
        self.is_known = np.concatenate(
            [np.ones(self.a.n.size, dtype=bool), self.a.repeats.across_known]
        )
        self._blocks = [_covariance_of_means(*pair) for pair in zip(means, scatters, strict=True)]
        self._dof = [scatter.dof for scatter in scatters]

    def _stack_known(self, values: FloatArray) -> FloatArray:
        """Arrange numbers of shape (n, 2) as the components that both media have, shape (k + 1,)."""
        return np.asarray(values.T.ravel()[self.is_known])

    def difference(self, ratio: float) -> FloatArray:
        """Return alpha of B over the ratio minus alpha of A, shape (k + 1,)."""
        return self._stack_known(self.b.mean / ratio - self.a.mean)

    def _covariance_of_runs(self, ratio: float) -> FloatArray:
        """Return the covariance of the contrast by errors that runs do not share."""
        blocks = self._blocks[0] + self._blocks[1] / ratio**2
        n = len(blocks)
        whole = np.zeros((2, n, 2, n))
        diagonal = np.arange(n)
        whole[:, diagonal, :, diagonal] = blocks
        return np.asarray(whole.reshape(2 * n, 2 * n)[np.ix_(self.is_known, self.is_known)])

    def _shared_changes(self, ratio: float) -> FloatArray:
        """Return the change of the contrast by one standard deviation of each shared error, shape (k + 1, errors)."""
        nothing = np.zeros_like(self.a.mean)
        names = dict.fromkeys([*self.a.common, *self.b.common])
        moved = [
            self._stack_known(
                self.b.common.get(name, nothing) / ratio - self.a.common.get(name, nothing)
            )
            for name in names
        ]
        return np.stack(moved, axis=1) if moved else np.zeros((int(self.is_known.sum()), 0))

    def covariance(self, ratio: float) -> FloatArray:
        """Return the covariance of the contrast by all errors."""
        common = self._shared_changes(ratio)
        return self._covariance_of_runs(ratio) + common @ common.T

    def squares(self, ratio: float) -> float:
        """Return the weighted squares of the contrast: chi squared where the shapes are the same."""
        off = self.difference(ratio)
        return float(off @ np.linalg.solve(self.covariance(ratio), off))

    def degrees_of_freedom(self, ratio: float) -> float:
        """Return the degrees of freedom of the scatter (Welch): few where most of it is of a medium with few repeats.

        Media of two laboratories may scatter differently, so repeats of one say little about the other.
        """
        of_a, of_b = (np.trace(block, axis1=1, axis2=2) for block in self._blocks)
        share = float((of_b / (ratio**2 * of_a + of_b)).mean())
        welch = 1 / ((1 - share) ** 2 / self._dof[0] + share**2 / self._dof[1])
        # both media have the same prior, which counts once
        return float(min(welch, sum(self._dof) - _CHOSEN.prior_dof))

    def find_ratio(self) -> float:
        """Find the ratio of sizes with the least weighted squares; exchanging A and B inverts it."""
        from scipy.optimize import minimize_scalar

        product = float((self.a.mean * self.b.mean).sum())
        if not product > 0:
            raise InputError(
                "the forces of A and B are opposite in their common directions: look at the axes of both"
            )
        lengths = [math.sqrt(float((side.mean**2).sum())) for side in (self.a, self.b)]
        first = math.log(lengths[1] / lengths[0])
        if abs(first) > _CHOSEN.widest_log:
            raise InputError("one of A and B has no force in the common directions")
        optimum = minimize_scalar(
            lambda size: self.squares(math.exp(size)),
            bounds=(first - 1, first + 1),
            method="bounded",
            options={"xatol": 1e-6},
        )
        return math.exp(float(optimum.x))

    def mean(self, ratio: float) -> FloatArray:
        """Return the mean alpha of both media, in the size of A, shape (n, 2)."""
        weight = (self.a.n / (self.a.n + self.b.n))[:, None]
        return weight * self.a.mean + (1 - weight) * self.b.mean / ratio

    def test_size(self, ratio: float) -> _SizeTest:
        """Find the error of the ratio: by the scatter of runs, which repeats and contrast show, and shared errors."""
        alpha = self._stack_known(self.mean(ratio))
        weight = np.linalg.solve(self.covariance(ratio), alpha)
        weight /= weight @ alpha
        of_runs = float(weight @ self._covariance_of_runs(ratio) @ weight)
        shared = float(((weight @ self._shared_changes(ratio)) ** 2).sum())
        # the contrast along the force shows the scatter as well, so that a difference of shape
        # widens the interval
        unit = self.mean(ratio)
        unit = unit / np.maximum(np.hypot(*unit.T), 1e-30)[:, None]
        blocks = self._blocks[0] + self._blocks[1] / ratio**2
        off = ((self.b.mean / ratio - self.a.mean) * unit).sum(axis=1)
        squares = float((off**2 / np.einsum("ci,cij,cj->c", unit, blocks, unit)).sum())
        dof = self.degrees_of_freedom(ratio) + off.size - 1
        of_runs *= (self.degrees_of_freedom(ratio) + squares) / dof
        variance = of_runs + shared
        return _SizeTest(math.sqrt(variance), dof * (variance / of_runs) ** 2)

    def test_shape(self, ratio: float) -> _ShapeTest:
        """Find the squares of the contrast, which are larger than by chance where the shapes differ."""
        k = max(float(self.is_known.sum()) - 1, 1.0)
        mean = self._stack_known(self.mean(ratio))
        alpha = float(mean @ mean)
        without_size = np.eye(mean.size) - np.outer(mean, mean) / alpha
        off = without_size @ self.difference(ratio)
        covariance = without_size @ self.covariance(ratio) @ without_size / alpha
        trace, of_square = float(np.trace(covariance)), float((covariance**2).sum())
        return _ShapeTest(
            squares=self.squares(ratio),
            k=k,
            dof=self.degrees_of_freedom(ratio),
            plain=float(off @ off) / alpha,
            plain_k=trace**2 / of_square,
            unit=of_square / trace,
            least_unit=float(np.linalg.eigvalsh(self.covariance(ratio))[0]) / alpha,
        )

    def table(self, ratio: float, angles: FloatArray, confidence: float) -> pd.DataFrame:
        """Make a row for each direction: alpha of both media, the difference, and the ratio of B to A along the force.

        Intervals of alpha and of the ratio hold for one direction; those of the differences hold for all together. `p`:
        p value of "no difference in this direction", times the number of directions.
        """
        dof, n = self.degrees_of_freedom(ratio), self.a.n.size
        for_one = student_quantile(confidence, dof)
        for_all = student_quantile(1 - (1 - confidence) / self.is_known.sum(), dof)
        covariance = np.zeros((2 * n, 2 * n))
        covariance[np.ix_(self.is_known, self.is_known)] = self.covariance(ratio)
        covariance = covariance.reshape(2, n, 2, n)[:, np.arange(n), :, np.arange(n)]
        off = self.b.mean / ratio - self.a.mean
        columns: dict[str, object] = {
            "beta_deg": angles[0],
            "gamma_deg": angles[1],
            "depth_cm": angles[2],
            "runs_a": self.a.n.astype(int),
            "runs_b": self.b.n.astype(int),
        }
        x_missing = np.where(self.a.repeats.across_known, 0.0, math.nan)
        for name, values, covariances, quantile in (
            ("alpha_{}_a", self.a.mean, self._blocks[0], for_one),
            ("alpha_{}_b", self.b.mean, self._blocks[1], for_one),
            ("difference_{}", off, covariance, for_all),
        ):
            for place, c in enumerate("zx"):
                value = values[:, place] + place * x_missing
                half = quantile * np.sqrt(covariances[:, place, place])
                columns |= _with_ends(name.format(c), "_N_per_cm3", value, half)
        mean = self.mean(ratio)
        length = np.maximum(np.hypot(*mean.T), 1e-30)
        unit = mean / length[:, None]
        by_direction = ratio * (1 + (off * unit).sum(axis=1) / length)
        half = for_one * ratio * np.sqrt(np.einsum("ci,cij,cj->c", unit, covariance, unit)) / length
        columns |= _with_ends("ratio", "", np.where(half < ratio, by_direction, math.nan), half)
        squares = np.einsum("ci,cij,cj->c", off, np.linalg.pinv(covariance), off)
        count = 1.0 + self.a.repeats.across_known
        chances = [_f_test_p(s / k, k, dof) for s, k in zip(squares, count, strict=True)]
        columns["p"] = np.minimum(np.array(chances) * n, 1.0)
        order = np.argsort(-squares / count, kind="stable")
        return pd.DataFrame(columns).iloc[order].reset_index(drop=True)


def _with_ends(
    name: str, unit: str, value: FloatArray, half_width: FloatArray
) -> dict[str, FloatArray]:
    """Return the columns of a quantity and of the ends of its interval."""
    ends = {"": value, "_lo": value - half_width, "_hi": value + half_width}
    return {f"{name}{end}{unit}": values for end, values in ends.items()}


# --- Distributions; scipy.special, as scipy.stats takes ten times as long to import


def errors_detected(dof: float) -> float:
    """Return the least difference, in standard errors, that the test on the chosen level detects with the chosen probability."""
    one_sided = 2 * _CHOSEN.power - 1
    return float(student_quantile(1 - _CHOSEN.level, dof) + student_quantile(one_sided, dof))


def _f_test_p(ratio: float, k: float, dof: float) -> float:
    """Return the p value of a ratio of mean squares with `k` and `dof` degrees of freedom."""
    from scipy.special import fdtrc

    return float(fdtrc(k, dof, ratio))


def _noncentral_f(squares: float, k: float, dof: float, noncentrality: float) -> float:
    """Probability that k weighted squares add up to at most `squares` where they have this noncentrality."""
    from scipy.special import ncfdtr

    return float(ncfdtr(k, dof, noncentrality, squares / k))


def _find_argument(falling: Callable[[float], float], chance: float, first: float = 1.0) -> float:
    """Find the number at which a falling function is `chance`; 0 where the function is below it at 0 already."""
    from scipy.optimize import brentq

    if falling(0.0) <= chance:
        return 0.0
    high = max(first, 1.0)
    while falling(high) > chance:
        high *= 2
    return float(brentq(lambda size: falling(size) - chance, 0.0, high, xtol=1e-9 * high))
