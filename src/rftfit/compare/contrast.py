"""Test whether alpha of two sets of runs differs in size or in shape, by single runs in common directions.

A run is y = s T (1 + bed) + patches + error of the run, with T the alpha of its direction and s the *size* of its set,
the factor on a shape that both may share. The *contrast* of a direction is the mean of B, divided by the ratio of sizes,
minus the mean of A. The ratio of sizes is the one that makes the weighted squares of all contrasts least; the squares
that remain show a difference of *shape*. Weights come from the *scatter* of single runs about the mean of their
direction, by repeats, in proportion to alpha with a floor, so that weak directions do not dominate; it is larger along
the force than across it, as a whole bed is looser or denser.

A and B are the two sets (a, b), n is the number of their common directions; alpha is in N/cm^3, z and x, shape (2, n).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.problems import join_words
from rftfit.conventions import FloatArray
from rftfit.directions import TOLERANCE_DEG, is_straight_down, number_directions
from rftfit.errors import InputError
from rftfit.measure.alpha import column
from rftfit.measure.errors import LEAST_DOF, USUAL_BED_SPREAD
from rftfit.measure.repeats import (
    Repeats,
    RunScatter,
    along_and_across,
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

    `name`: for people. `runs`: rows of ``results/fits/<medium>.csv``. Standard deviations of errors that all runs share:
    `surface_cm` of the height of the free surface, `turn_deg` of the angle of the mount, `rod_percent` of the bed that
    rods were pushed into. `campaign`, `medium`: runs of one campaign share the mount and the tares, those of one medium
    of it the bed of the rods, too; an empty campaign: `name` stands for it. `tolerance_deg`: difference of each angle up to
    which runs are of one direction; the larger of two sets counts.
    """

    name: str
    runs: pd.DataFrame
    surface_cm: float = 0.0
    turn_deg: float = 0.0
    rod_percent: float = 0.0
    campaign: str = ""
    medium: str = ""
    tolerance_deg: float = TOLERANCE_DEG


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
"""Sentences of `Comparison.sentence` by whether the sizes differ and whether the shapes differ."""


_ONLY_IF = ", if single runs of one direction scatter by less than {scatter}"


_WITHOUT_REPEATS = {
    (False, False): _ANSWERS[False, False],
    (True, False): _ANSWERS[True, False],
    (False, True): _ANSWERS[False, True].removesuffix(".") + _ONLY_IF + ".",
    (True, True): _ANSWERS[True, True].replace("{shapes})", "{shapes})" + _ONLY_IF + ",", 1),
}
"""The same where the scatter of single runs is assumed: a difference of shape holds for a smaller scatter only."""


_SIZE_ALONE = {
    False: "No difference of size between {a} and {b} by their maps: ratio {ratio} ({interval}); without runs in common directions "
    "their shapes cannot be compared.",
    True: "{b} is {ratio} times as strong as {a} by their maps ({interval}); without runs in common directions their shapes "
    "cannot be compared.",
}


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
        """The answer in one plain sentence: whether size and shape differ, by their p values and the chosen level."""
        sizes_differ, shapes_differ = self.size_p < _CHOSEN.level, self.shape_p < _CHOSEN.level
        if math.isnan(self.shape_p):
            answer = _SIZE_ALONE[sizes_differ]
        else:
            answers = _WITHOUT_REPEATS if self.assumed else _ANSWERS
            answer = answers[sizes_differ, shapes_differ]
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
        """Format the table of the directions that differ most; `most`: as in `summary`."""
        head = ["beta", "gamma", "depth", "B/ratio - A: alpha_z"]
        head += ["interval", "alpha_x", "interval", "p"]
        rows = []
        for direction in self.directions.head(most or len(self.directions)).to_dict("records"):
            cells = [
                f"{direction['beta_deg']:g}",
                f"{direction['gamma_deg']:.4g}",
                _cell(direction["depth_cm"], "g"),
            ]
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


class NoCommonDirection(InputError):
    """No direction has runs on both sides."""


def compare_run_sets(a: RunSet, b: RunSet, confidence: float = 0.95) -> Comparison:
    """Compare two media by their runs in common directions; `confidence`: level of the intervals.

    Raises `NoCommonDirection`, or `InputError` if the forces are opposite, or one medium has none.
    """
    means_of_a, means_of_b, angles = _average_common_directions(a, b)
    means = _pool_sizes(means_of_a, means_of_b)
    scatter, scatter_of_sides = _fit_scatters(means)
    # degrees of freedom
    repeats_of_sides = [float(side.repeats.dof.sum()) for side in means]
    # what is stated is by the repeats alone, where there are enough
    stated_scatter = scatter
    if sum(repeats_of_sides) >= LEAST_DOF:
        stated_scatter = scatter_of_repeats(joined(side.repeats for side in means))
    scatter_along, scatter_across = stated_scatter.relative()
    contrast = _fit_ratio(means, scatter_of_sides)
    ratio = contrast.ratio
    log_ratio_se, log_ratio_dof = contrast.find_error_of_ratio()
    shape = contrast.test_shape()
    half_width = float(student_quantile(confidence, log_ratio_dof)) * log_ratio_se
    low, high = shape.interval(confidence)
    return Comparison(
        a=a.name,
        b=b.name,
        ratio=ratio,
        ratio_lo=ratio * math.exp(-half_width),
        ratio_hi=ratio * math.exp(half_width),
        size_p=float(student_p(math.log(ratio) / log_ratio_se, log_ratio_dof)),
        shape_percent=100 * max(shape.rms(0.5), low),
        shape_lo_percent=100 * low,
        shape_hi_percent=100 * high,
        shape_p=float(
            _f_test_p(shape.squares / shape.squares_dof, shape.squares_dof, shape.scatter_dof)
        ),
        least_ratio=math.exp(errors_detected(log_ratio_dof) * log_ratio_se),
        least_shape_percent=100 * shape.least_rms(),
        directions=contrast.table(angles, confidence),
        runs_a=int(means_of_a.run_count.sum()),
        runs_b=int(means_of_b.run_count.sum()),
        repeats=sum(repeats_of_sides),
        scatter_along=scatter_along,
        scatter_across=scatter_across,
        explained_by=scatter.relative()[0] * math.sqrt(max(shape.squares / shape.squares_dof, 1.0)),
        notes=tuple(_describe_limits((a, b), means, scatter_of_sides)),
        assumed=not all(repeats_of_sides),
        confidence=confidence,
        tolerance_deg=_larger_tolerance(a, b),
    )


def _describe_limits(
    sides: tuple[RunSet, RunSet],
    means: tuple[_Means, _Means],
    scatters: tuple[RunScatter, RunScatter],
) -> Iterator[str]:
    """Yield sentences on what limits the comparison: few repeats, unequal scatter, unequal windows.

    `means`, `scatters`: mean alpha, and scatter of single runs, of each medium.
    """
    a, b = sides
    dof = [float(side.repeats.dof.sum()) for side in means]
    if not any(dof):
        yield (
            f"no direction was pushed twice: the scatter of single runs is assumed, {100 * PRIOR_ALONG:.2g} % along "
            f"the force and {100 * _CHOSEN.prior_across:g} % across"
        )
    elif not all(dof):
        repeated, single = (a, b) if dof[0] else (b, a)
        yield f"{single.name} has no repeats: its runs are taken to scatter as those of {repeated.name}"
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
    deepest_cm = [_numbers(side.runs, "depth_to_cm").max() for side in sides]
    # a comparison with NaN is False
    if min(deepest_cm) > 0 and abs(math.log(deepest_cm[1] / deepest_cm[0])) > _CHOSEN.same_window:
        yield (
            f"fitted to {deepest_cm[0]:.3g} cm in {a.name} and to {deepest_cm[1]:.3g} cm in {b.name}: where stress is no "
            "line, this alone makes them differ"
        )


def _relative_square(repeats: Repeats, scatter: RunScatter) -> float:
    """Return the mean square by which repeats differ along the force, with noise, relative to it; 0 without repeats.

    `scatter`: gives the floor under the force of weak directions.
    """
    level = scatter.weight @ level_of_floors(repeats.size, repeats.largest)
    dof = float(repeats.dof.sum())
    return float((repeats.along / level).sum()) / dof if dof else 0.0


# --- Directions


@dataclass(frozen=True)
class _Means:
    """Mean alpha of the runs of one medium in each of n common directions, and what its error needs.

    `mean`: alpha, shape (2, n). `run_count`: number of runs, (n,). `noise_variance`: variance of the mean by the noise
    of the logs, (2, n). `repeats`: squares of the runs about their mean along and across the force, where x counts, and
    the size of the force (see `_pool_sizes`). `shared_changes`: changes of the means, (2, n), by one standard deviation
    of an error that many runs share, by the name of the error; an error of both sets with one name is one error.
    """

    mean: FloatArray
    run_count: FloatArray
    noise_variance: FloatArray
    repeats: Repeats
    shared_changes: Mapping[tuple[str, ...], FloatArray]


def _average_common_directions(a: RunSet, b: RunSet) -> tuple[_Means, _Means, FloatArray]:
    """Average the runs of both media in their common directions.

    Returned with the directions: beta and gamma, deg, and depth of level runs, cm (NaN for others), shape (3, n). Runs
    without alpha_z are left out.
    """
    usable = [side.runs[np.isfinite(_numbers(side.runs, column("z")))] for side in (a, b)]
    # runs of A, then of B
    beta_deg, gamma_deg, depth_cm, alpha_x = (
        np.concatenate([_numbers(runs, name) for runs in usable])
        for name in ("beta_deg", "gamma_deg", "depth_from_cm", column("x"))
    )
    tolerance_deg = _larger_tolerance(a, b)
    number = number_directions(beta_deg, gamma_deg, tolerance_deg, depth_cm)
    # indices of the runs of each medium
    of_a, of_b = np.split(np.arange(number.size), [len(usable[0])])
    common = np.intersect1d(number[of_a], number[of_b])
    if not common.size:
        described = [_describe_directions(beta_deg[runs], gamma_deg[runs]) for runs in (of_a, of_b)]
        raise NoCommonDirection(
            f"{a.name} and {b.name} have no common direction: {' and '.join(described)} "
            f"(beta, gamma in degrees, within {tolerance_deg:g})"
        )
    # x counts where all runs of a direction have it, on both sides
    has_x = np.array([np.isfinite(alpha_x[number == direction]).all() for direction in common])
    means_of_a = _average_runs(a, usable[0], number[of_a], common, has_x)
    means_of_b = _average_runs(b, usable[1], number[of_b], common, has_x)
    level_depth_cm = np.where(gamma_deg[common] == 0, depth_cm[common], math.nan)
    angles = np.stack([beta_deg[common], gamma_deg[common], level_depth_cm])
    return means_of_a, means_of_b, angles


def _larger_tolerance(a: RunSet, b: RunSet) -> float:
    """Return the difference of each angle, deg, up to which runs of both media are of one direction."""
    return max(a.tolerance_deg, b.tolerance_deg)


def _pool_sizes(a: _Means, b: _Means) -> tuple[_Means, _Means]:
    """Replace the size of the force in each direction by that of the runs of both media, times the size of the medium.

    Otherwise a direction whose runs are weak by chance would have a small scatter and too much weight.
    """
    size_of_a, size_of_b = (max(float(np.linalg.norm(side.mean)), 1e-30) for side in (a, b))
    relative = np.hypot(*a.mean) / size_of_a, np.hypot(*b.mean) / size_of_b
    pooled = np.average(relative, axis=0, weights=[a.run_count, b.run_count])

    def with_pooled(side: _Means, size_of_medium: float) -> _Means:
        """Return the means of a medium with the pooled size of the force in each direction, and the largest of them."""
        size = pooled * size_of_medium
        return replace(
            side, repeats=side.repeats._replace(size=size, largest=np.full_like(size, size.max()))
        )

    return with_pooled(a, size_of_a), with_pooled(b, size_of_b)


def _describe_directions(beta_deg: FloatArray, gamma_deg: FloatArray) -> str:
    """Write the first four directions of the runs of a medium, ``(0, 90), (30, 90)``; ``none`` without a run."""
    angles = np.round([beta_deg, gamma_deg], 1).T
    directions = sorted({(float(beta), float(gamma)) for beta, gamma in angles})
    return join_words((f"({beta:g}, {gamma:g})" for beta, gamma in directions), 4) or "none"


def _numbers(runs: pd.DataFrame, name: str) -> FloatArray:
    """Return a column of the runs as numbers; NaN where the column is absent."""
    return pd.to_numeric(runs.get(name, pd.Series(math.nan, runs.index))).to_numpy(float)


def _error(runs: pd.DataFrame, quantity: str) -> FloatArray:
    """Return an error of alpha of the runs, z and x, shape (2, runs); 0 where it is not stated.

    `quantity`: Part of the name of its column in the table of fits: ``se``, ``startup``, ``tare``, ``curvature``, ``rod``.
    """
    return np.nan_to_num([_numbers(runs, column(c, f"_{quantity}")) for c in "zx"])


def _average_runs(
    side: RunSet,
    runs: pd.DataFrame,
    direction_of_run: npt.NDArray[np.intp],
    common: npt.NDArray[np.intp],
    has_x: npt.NDArray[np.bool_],
) -> _Means:
    """Average the runs of one medium in each common direction, and collect the errors of the means.

    `runs`: those of `side` with alpha_z. `direction_of_run`: number of the direction of each, from `number_directions`.
    `common`: numbers of the n common directions. `has_x`: where alpha_x counts, shape (n,).
    """
    is_of_direction = direction_of_run[:, None] == common
    run_count = is_of_direction.sum(axis=0).astype(float)
    # weight of each run in the mean of each direction, shape (runs, n)
    weight = is_of_direction / run_count
    alpha = np.nan_to_num([_numbers(runs, column(c)) for c in "zx"])
    mean = alpha @ weight
    mean[1] *= has_x
    # standard errors of alpha of each run, by their cause
    se, startup, tare, curvature, rod = (
        _error(runs, name) for name in ("se", "startup", "tare", "curvature", "rod")
    )
    # changes by 1 cm of the surface
    by_surface = alpha * np.nan_to_num(_numbers(runs, "lever_per_cm"))
    clock = by_surface * np.nan_to_num(_numbers(runs, "clock_cm"))
    # variance of single runs: the curvature is alike in runs over the same depths, tare and clock
    # are shared and counted below
    run_variance = np.maximum(se**2 - startup**2 - tare**2 - curvature**2 - clock**2, 0.0)
    squares = [
        along_and_across(alpha[:, members] * [[1], [x]], run_variance[:, members])
        for members, x in zip(is_of_direction.T, has_x, strict=True)
    ]
    along, across, noise_along, noise_across = np.array(squares).T
    size = np.hypot(*mean)
    repeats = Repeats(
        run_count - 1,
        along,
        across,
        has_x,
        noise_along,
        noise_across,
        size,
        np.full_like(size, size.max()),
    )
    # alpha_x of mirrored runs is stored with the other sign
    side_of_x = np.where(np.nan_to_num(_numbers(runs, "mirrored")) != 0, -1.0, 1.0)
    # change by a turn of the mount by 1 rad
    turned = np.stack([-alpha[1], alpha[0]]) * side_of_x
    # by the name of a shared error: change of each run by one standard deviation of it, shape (2, runs)
    campaign = side.campaign or side.name
    changes_of_runs: dict[tuple[str, ...], FloatArray] = {
        (side.name, side.campaign, "surface"): by_surface * side.surface_cm,
        (side.name, side.campaign, "clock"): clock,
        (campaign, "turn"): turned * math.radians(side.turn_deg),
        (campaign, side.medium, "rod"): rod * side.rod_percent / 100,
    }
    # the error of a tare is that of all runs from which it was subtracted, each component for itself
    tare_runs = runs.get("tare_run", pd.Series("", runs.index)).fillna("").astype(str).to_numpy()
    tare[1] *= side_of_x
    for name in dict.fromkeys(tare_runs):
        for c, component in zip("zx", np.eye(2), strict=True):
            changes_of_runs[campaign, "tare", name, c] = (
                component[:, None] * tare * (tare_runs == name)
            )
    changes = {name: change @ weight for name, change in changes_of_runs.items()}
    return _Means(
        mean=mean,
        run_count=run_count,
        noise_variance=run_variance @ weight**2 + startup**2 @ weight,
        repeats=repeats,
        shared_changes={name: change for name, change in changes.items() if change.any()},
    )


# --- Scatter of single runs


def _fit_scatters(sides: tuple[_Means, _Means]) -> tuple[RunScatter, tuple[RunScatter, RunScatter]]:
    """Estimate the scatter of the runs of both media together, and of each medium; returned in this order.

    The scatter of both together is the prior for each medium: one without repeats has the scatter of the other.
    """
    repeats = joined(side.repeats for side in sides)
    usual = usual_scatter(PRIOR_ALONG, _CHOSEN.prior_across)
    both = scatter_of_repeats(repeats, usual, _CHOSEN.prior_dof)
    of_a, of_b = (scatter_of_repeats(side.repeats, both, _CHOSEN.prior_dof) for side in sides)
    return both, (of_a, of_b)


# --- Both media together


class _ShapeTest(NamedTuple):
    """Squares of the contrast: weighted to test whether the shapes differ, plain to state by how much.

    `squares`: weighted squares, which show best whether the shapes differ: chi squared with `squares_dof` degrees of
    freedom by chance alone. `scatter_dof`: degrees of freedom of the scatter, by which the weights are known.
    `mean_square`: mean square without weights, relative to that of alpha, which states by how much the shapes differ; by
    chance alone it is about `unit` times chi squared with `mean_square_dof` degrees of freedom. `least_unit`: least mean
    square that makes the weighted squares 1.

    Differences are root mean squares over the directions, relative to alpha: the root of a mean square. The
    *noncentrality* of chi squared is what a true difference adds to it.
    """

    squares: float
    squares_dof: float
    scatter_dof: float
    mean_square: float
    mean_square_dof: float
    unit: float
    least_unit: float

    def interval(self, confidence: float) -> tuple[float, float]:
        """Return the interval of the rms difference; it lies above 0 where the weighted squares show a difference.

        They show small differences better than the plain ones, but in their own unit: they give the least rms with which
        they would be as large.
        """
        outside = (1 - confidence) / 2
        low, high = self.rms(1 - outside), self.rms(outside)
        shown = _find_noncentrality(self.squares, self.squares_dof, self.scatter_dof, confidence)
        return max(low, math.sqrt(shown * self.least_unit)) if shown else 0.0, high

    def rms(self, probability: float) -> float:
        """Return the true rms difference with which a mean square of at most `mean_square` has a probability."""
        from scipy.special import fdtri

        squares, dof = self.mean_square / self.unit, self.mean_square_dof
        if probability < 0.5:
            # contrasts that are small by chance do not bound the difference better than usual ones
            squares = max(squares, dof * float(fdtri(dof, self.scatter_dof, 0.5)))
        noncentrality = _find_noncentrality(squares, dof, self.scatter_dof, probability)
        return math.sqrt(noncentrality * self.unit)

    def least_rms(self) -> float:
        """Return the least root mean square difference, relative to alpha, that the test detects with the chosen power.

        The weighted squares are then beyond their limit with this probability; they are taken back to plain ones by the
        ratio that both have by chance.
        """
        from scipy.special import fdtri

        dof = self.squares_dof
        limit = float(fdtri(dof, self.scatter_dof, 1 - _CHOSEN.level)) * dof
        least = _find_noncentrality(limit, dof, self.scatter_dof, 1 - _CHOSEN.power)
        return math.sqrt(least * self.unit * self.mean_square_dof / dof)


def _covariance_of_means(side: _Means, scatter: RunScatter) -> FloatArray:
    """Return the covariance of the means of one medium by errors that runs do not share, shape (n, 2, 2), (N/cm^3)^2."""
    size = side.repeats.size
    spread = scatter.covariance(side.mean, size, size.max()) / side.run_count[:, None, None]
    return spread + side.noise_variance.T[:, :, None] * np.eye(2)


def _fit_ratio(means: tuple[_Means, _Means], scatters: tuple[RunScatter, RunScatter]) -> _Contrast:
    """Return the contrast at the ratio of sizes with the least weighted squares; exchanging A and B inverts the ratio.

    The ratio is sought within a factor e of that of the root mean squares. `scatters`: scatter of single runs of each
    medium.
    """
    from scipy.optimize import minimize_scalar

    a, b = means
    size_of_a, size_of_b = (float(np.linalg.norm(side.mean)) for side in means)
    if 0.0 in (size_of_a, size_of_b):
        raise InputError("one of A and B has no force in the common directions")
    if not float((a.mean * b.mean).sum()) > 0:
        raise InputError(
            "the forces of A and B are opposite in their common directions: look at the axes of both"
        )
    first = math.log(size_of_b / size_of_a)
    covariance_a, covariance_b = map(_covariance_of_means, means, scatters)
    contrast = _Contrast(a, b, covariance_a, covariance_b, scatters[0].dof, scatters[1].dof)
    optimum = minimize_scalar(
        lambda log_ratio: replace(contrast, ratio=math.exp(log_ratio)).squares,
        bounds=(first - 1, first + 1),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return replace(contrast, ratio=math.exp(float(optimum.x)))


@dataclass(frozen=True)
class _Contrast:
    """Contrast of two media at one ratio of sizes: alpha of B over the ratio minus alpha of A, with its covariance.

    `covariance_a`, `covariance_b`: covariance of the means of each medium by errors that runs do not share, shape
    (n, 2, 2). `dof_a`, `dof_b`: degrees of freedom of the scatter of each. `ratio`: size of B over size of A.

    A vector of components has z of the n directions, then x of those where both media have it.
    """

    a: _Means
    b: _Means
    covariance_a: FloatArray
    covariance_b: FloatArray
    dof_a: float
    dof_b: float
    ratio: float = 1.0

    @property
    def is_component(self) -> npt.NDArray[np.bool_]:
        """True for z of all directions and for x where both media have it, shape (2 n,)."""
        has_x = self.a.repeats.across_known
        return np.concatenate([np.ones_like(has_x), has_x])

    def _components(self, alpha: FloatArray) -> FloatArray:
        """Arrange numbers of shape (2, n) as a vector of components."""
        return np.asarray(alpha.ravel()[self.is_component])

    @property
    def difference(self) -> FloatArray:
        """Alpha of B over the ratio minus alpha of A, shape (2, n)."""
        return self.b.mean / self.ratio - self.a.mean

    @property
    def mean(self) -> FloatArray:
        """Mean alpha of both media, in the size of A, shape (2, n)."""
        share_of_a = self.a.run_count / (self.a.run_count + self.b.run_count)
        return share_of_a * self.a.mean + (1 - share_of_a) * self.b.mean / self.ratio

    @property
    def covariance_by_direction(self) -> FloatArray:
        """Covariance of the difference by errors that runs do not share, at this ratio, shape (n, 2, 2)."""
        return self.covariance_a + self.covariance_b / self.ratio**2

    @cached_property
    def covariance_of_runs(self) -> FloatArray:
        """Covariance of the components by errors that runs do not share, shape (components, components)."""
        # a block of 2 by 2 for each direction, at its places in the matrix of all components
        n = self.a.run_count.size
        full = np.zeros((2, n, 2, n))
        full[:, np.arange(n), :, np.arange(n)] = self.covariance_by_direction
        is_component = self.is_component
        return np.asarray(full.reshape(2 * n, 2 * n)[np.ix_(is_component, is_component)])

    @cached_property
    def shared_changes(self) -> FloatArray:
        """Change of the components by one standard deviation of each shared error, shape (components, errors).

        An error that both media share changes both means, so that much of it cancels in the difference.
        """
        of_a, of_b = self.a.shared_changes, self.b.shared_changes
        nothing = np.zeros_like(self.a.mean)
        changes = [
            self._components(of_b.get(name, nothing) / self.ratio - of_a.get(name, nothing))
            for name in dict.fromkeys([*of_a, *of_b])
        ]
        # a column of zeros, as there may be no shared error
        return np.stack([self._components(nothing), *changes], axis=1)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the components by all errors, shape (components, components)."""
        return self.covariance_of_runs + self.shared_changes @ self.shared_changes.T

    @property
    def squares(self) -> float:
        """Weighted squares of the contrast: chi squared where the shapes are the same."""
        difference = self._components(self.difference)
        return float(difference @ np.linalg.solve(self.covariance, difference))

    @cached_property
    def dof(self) -> float:
        """Degrees of freedom of the scatter (Welch): few where most of it is of a medium with few repeats.

        Media of two laboratories may scatter differently, so repeats of one say little about the other.
        """
        of_a, of_b = (
            np.trace(block, axis1=1, axis2=2) for block in (self.covariance_a, self.covariance_b)
        )
        share_of_b = float((of_b / (self.ratio**2 * of_a + of_b)).mean())
        welch = 1 / ((1 - share_of_b) ** 2 / self.dof_a + share_of_b**2 / self.dof_b)
        # both media have the same prior, which counts once
        return float(min(welch, self.dof_a + self.dof_b - _CHOSEN.prior_dof))

    def find_error_of_ratio(self) -> tuple[float, float]:
        """Return the standard error of the logarithm of the ratio, and its degrees of freedom (Satterthwaite).

        The error is that of the scatter of runs, which repeats and contrast show, and of the shared errors, which are
        known.
        """
        mean = self._components(self.mean)
        # least squares: the change of log(ratio) by a change of each component
        weight = np.linalg.solve(self.covariance, mean)
        weight /= weight @ mean
        of_runs = float(weight @ self.covariance_of_runs @ weight)
        shared = float(((weight @ self.shared_changes) ** 2).sum())
        # the contrast along the force shows the scatter as well, so that a difference of shape
        # widens the interval
        unit = unit_vectors(self.mean)[0]
        along = (self.difference * unit).sum(axis=0)
        variance_along = np.einsum("in,nij,jn->n", unit, self.covariance_by_direction, unit)
        squares = float((along**2 / variance_along).sum())
        dof = self.dof + along.size - 1
        of_runs *= (self.dof + squares) / dof
        variance = of_runs + shared
        return math.sqrt(variance), dof * (variance / of_runs) ** 2

    def test_shape(self) -> _ShapeTest:
        """Find the squares of the contrast, which are larger than by chance where the shapes differ.

        They hold what is left of the difference at the best ratio, so a difference of size is not in them.
        """
        mean = self._components(self.mean)
        square_of_mean = float(mean @ mean)
        # projection that removes what is in proportion to alpha, which is a difference of size
        without_size = np.eye(mean.size) - np.outer(mean, mean) / square_of_mean
        difference = without_size @ self._components(self.difference)
        covariance = without_size @ self.covariance @ without_size / square_of_mean
        # a sum of squares with covariance C is about tr(C^2) / tr(C) times chi squared with tr(C)^2 / tr(C^2)
        # degrees of freedom (Satterthwaite)
        trace, trace_of_square = float(np.trace(covariance)), float((covariance**2).sum())
        return _ShapeTest(
            squares=self.squares,
            squares_dof=max(mean.size - 1.0, 1.0),
            scatter_dof=self.dof,
            mean_square=float(difference @ difference) / square_of_mean,
            mean_square_dof=trace**2 / trace_of_square,
            unit=trace_of_square / trace,
            least_unit=float(np.linalg.eigvalsh(self.covariance)[0]) / square_of_mean,
        )

    def table(self, angles: FloatArray, confidence: float) -> pd.DataFrame:
        """Make a row for each direction: alpha of both media, the difference, and the ratio of B to A along the force.

        `angles`: beta, gamma (deg) and depth (cm), shape (3, n). Intervals of alpha and of the ratio hold for one
        direction; those of the differences hold for all together. `p`: p value of "no difference in this direction",
        times the number of directions.
        """
        dof, n, is_component = self.dof, self.a.run_count.size, self.is_component
        # half widths of intervals in standard errors: of one number, and of all together (Bonferroni)
        for_one = student_quantile(confidence, dof)
        for_all = student_quantile(1 - (1 - confidence) / is_component.sum(), dof)
        # covariance of z and x of each direction by all errors, shape (n, 2, 2); 0 for an x that does not count
        full = np.zeros((2 * n, 2 * n))
        full[np.ix_(is_component, is_component)] = self.covariance
        covariance = full.reshape(2, n, 2, n)[:, np.arange(n), :, np.arange(n)]
        difference = self.difference
        columns: dict[str, object] = dict(
            zip(("beta_deg", "gamma_deg", "depth_cm"), angles, strict=True)
        )
        columns |= {"runs_a": self.a.run_count.astype(int), "runs_b": self.b.run_count.astype(int)}
        has_x = self.a.repeats.across_known
        for name, alpha, covariances, quantile in (
            ("alpha_{}_a", self.a.mean, self.covariance_a, for_one),
            ("alpha_{}_b", self.b.mean, self.covariance_b, for_one),
            ("difference_{}", difference, covariance, for_all),
        ):
            for component, c in enumerate("zx"):
                shown = alpha[component] if c == "z" else np.where(has_x, alpha[1], math.nan)
                half_width = quantile * np.sqrt(covariances[:, component, component])
                columns |= _with_ends(name.format(c), "_N_per_cm3", shown, half_width)
        # ratio of B to A along the mean force of the direction
        mean = self.mean
        length = np.maximum(np.hypot(*mean), 1e-30)
        unit = mean / length
        ratio_along = self.ratio * (1 + (difference * unit).sum(axis=0) / length)
        variance_along = np.einsum("in,nij,jn->n", unit, covariance, unit)
        half_width = for_one * self.ratio * np.sqrt(variance_along) / length
        # a ratio whose interval reaches 0 is not stated
        is_bounded = half_width < self.ratio
        columns |= _with_ends("ratio", "", np.where(is_bounded, ratio_along, math.nan), half_width)
        # weighted squares of each direction, of one or two components
        squares = np.einsum("in,nij,jn->n", difference, np.linalg.pinv(covariance), difference)
        count = 1.0 + has_x
        columns["p"] = np.minimum(n * _f_test_p(squares / count, count, dof), 1.0)
        order = np.argsort(-squares / count, kind="stable")
        return pd.DataFrame(columns).iloc[order].reset_index(drop=True)


def _with_ends(
    name: str, unit: str, value: FloatArray, half_width: FloatArray
) -> dict[str, FloatArray]:
    """Return the columns of a quantity and of the ends of its interval, ``NAME_lo_UNIT`` and ``NAME_hi_UNIT``."""
    ends = {"": value, "_lo": value - half_width, "_hi": value + half_width}
    return {f"{name}{end}{unit}": numbers for end, numbers in ends.items()}


# --- Distributions; scipy.special, as scipy.stats takes ten times as long to import


def errors_detected(dof: float) -> float:
    """Return the least difference, in standard errors, that the test on the chosen level detects with the chosen power.

    `dof`: degrees of freedom of the standard error.
    """
    one_sided = 2 * _CHOSEN.power - 1
    return float(student_quantile(1 - _CHOSEN.level, dof) + student_quantile(one_sided, dof))


def _f_test_p(ratio: npt.ArrayLike, dof: npt.ArrayLike, dof_below: float) -> FloatArray:
    """Return the p value of a ratio of mean squares with `dof` above and `dof_below` below the line."""
    from scipy.special import fdtrc

    return np.asarray(fdtrc(dof, dof_below, ratio))


def _find_noncentrality(
    squares: float, dof: float, scatter_dof: float, probability: float
) -> float:
    """Return the noncentrality with which a sum of squares is at most `squares` with this probability; at least 0.

    Squares over their `dof` have a noncentral F distribution with `dof` and `scatter_dof` degrees of freedom.
    """
    from scipy.optimize import brentq
    from scipy.special import ncfdtr

    def excess(noncentrality: float) -> float:
        """Probability of at most `squares` less the wanted one; it falls with the noncentrality."""
        return float(ncfdtr(dof, scatter_dof, noncentrality, squares / dof)) - probability

    if excess(0.0) <= 0:
        return 0.0
    high = max(squares, 1.0)
    while excess(high) > 0:
        high *= 2
    return float(brentq(excess, 0.0, high, xtol=1e-9 * high))
