"""Check where stress begins, which shows errors of surface and clocks, and that it is proportional to depth.

*Start* of a run: the depth, cm, at which lift begins by a line with a free intercept (``start_cm`` of the table of
fits); 0 where surface and clocks are right. *Lag*: by how much the force log is late against the motion log, as a length
in cm that the arm moves meanwhile at its full speed. `run_cm` and `session_cm`: standard deviations of the free surface
from run to run, and common to all runs. `tolerance_deg`: as in `MediumMeasurements`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.sheet import Run
from rftfit.campaign.spikes import Mask
from rftfit.checks.declared import (
    SOUND_LOGS,
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    describe_rows,
    flags_on,
)
from rftfit.checks.law import (
    LAW_OUTCOMES,
    LINE_POWERS,
    MOST_EXPONENT,
    TOLERATED,
    exponent_of,
    judge_crust,
    judge_law_alone,
)
from rftfit.checks.runs import SURE
from rftfit.conventions import FloatArray
from rftfit.directions import number_directions, number_rows
from rftfit.measure.depths import CLEAR_ALPHA, is_steep
from rftfit.measure.flags import Remark, remark
from rftfit.measure.laws import LEVELLED_CM, PATCHES, exponent_lever, ordinary_surface
from rftfit.measure.levels import FEW_RUNS, median_of_runs, sd_by_median, shifted_runs, two_clusters
from rftfit.measure.slopes import student_limit, student_quantile
from rftfit.measure.verdict_words import DOUBTFUL, FAILED
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "surface")


_ROD_IN_IT = Sentences("the force on the rod, which begins elsewhere, is in it")
_SURFACE_FOUND = "stress begins {push} in pushes{pull}"
_SURFACE_ALLOWED = "{most_mm:.1f} mm of either sign{by_cause}"
_LATE = (
    "The force log is {side} against the motion log by about {late_s:.1g} s ({found}): look at the clocks and "
    "filters of both."
)
_LATE_FAULT = "the clocks of the force log and the motion log differ"
_SURFACE = "surface is wrong ({found}): look at arm.surface_z_mm and surface_z_mm"
_SURFACE_OTHER = "in {count} of {size} runs than in the others ({rows}): look at "


@declare_check(
    "surface",
    title="surface",
    effect=DOUBTFUL,
    good="on paths of 45 degrees and steeper stress begins at the surface, at all angles of the path alike",
    fault="stress does not begin at the stated surface",
    after=SOUND_LOGS,
    outcomes={
        "rod-in-it": _ROD_IN_IT,
        "natural-sand": Sentences("stress is a line only near the surface of a natural sand"),
        "few-pushes": Sentences("too few pushes with a slope of their own"),
        "surface": Sentences(_SURFACE_FOUND, _SURFACE_ALLOWED),
        "surface-late": Sentences(_SURFACE_FOUND, _SURFACE_ALLOWED, _LATE, _LATE_FAULT),
        "surface-off": Sentences(_SURFACE_FOUND, _SURFACE_ALLOWED, f"the {_SURFACE}."),
        "surface-late-off": Sentences(_SURFACE_FOUND, _SURFACE_ALLOWED, f"{_LATE} The {_SURFACE}."),
        "surface-differs": Sentences(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            f"stress begins {{gap_mm:.1f}} mm {{side}} {_SURFACE_OTHER}surface_z_mm of these runs.",
        ),
        "lag-differs": Sentences(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            f"the force log is {{gap_s:.2g}} s {{side}} {_SURFACE_OTHER}the clocks of these runs.",
            _LATE_FAULT,
        ),
        "surface-of-path": Sentences(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            "stress begins {gap_mm:.1f} mm {side} in the {count} pushes at gamma {gamma_deg:g} deg than in the {others} at other "
            "angles of the path ({rows}): look at surface_z_mm of these runs, and where a slanted stage stands at the surface.",
        ),
        "surface-curved": Sentences(
            "stress looks curved, so where a line through it begins does not tell the surface"
        ),
    },
)
def check_surface(measured: MediumMeasurements) -> Check:
    """Check that stress begins at the surface, and at the same depth in all runs; else alpha is too large or too small."""
    return _judge_surface_and_linearity(measured)[0]


_LINE_FOUND = "stress of pushes grows as about depth^{power:.2f}; a power fits {share:.0%} of their directions better than a line"
_LINE_ALLOWED = (
    f"{LINE_POWERS}, or less than {{clear:.0%}} of the directions fitted better by a power"
)


@declare_check(
    "linearity",
    title="stress against depth",
    effect=DOUBTFUL,
    good="stress is proportional to depth",
    fault="stress is not proportional to depth",
    after=(*SOUND_LOGS, "surface"),
    outcomes={
        **LAW_OUTCOMES,
        "rod-in-it": _ROD_IN_IT,
        "linearity": Sentences(
            _LINE_FOUND,
            _LINE_ALLOWED,
            "stress is not proportional to depth ({found}): a line through zero depends on its window.",
        ),
        "linearity-or-surface": Sentences(
            _LINE_FOUND,
            _LINE_ALLOWED,
            "{found}, or the surface is wrong ({surface}): look at arm.surface_z_mm and surface_z_mm; or, where stress begins "
            "above the surface, the sand sticks together (cohesion), as wet sand does. These logs cannot distinguish them.",
            "stress is not proportional to depth, or does not begin at the stated surface",
        ),
        "linearity-few": Sentences("too few pushes with a power of their own"),
        "linearity-open": Sentences(
            f"{_LINE_FOUND}; only beyond {LINE_POWERS} would another power be told"
        ),
    },
)
def check_linearity(measured: MediumMeasurements) -> Check:
    """Check that stress is proportional to depth, as alpha, a slope through zero, takes it to be."""
    return _judge_surface_and_linearity(measured)[1]


_CODES = {
    (False, False): "surface",
    (True, False): "surface-late",
    (False, True): "surface-off",
    (True, True): "surface-late-off",
}
"""Code of the check `surface`, by two facts: the force log is late, the surface is off."""


@lru_cache(maxsize=1)  # the two checks of a medium call this one after the other
def _judge_surface_and_linearity(measured: MediumMeasurements) -> tuple[Check, Check]:
    """Judge where stress begins, by lines with a free intercept, and whether it is a line of depth.

    Returns the outcomes of `surface` and of `linearity`; they are judged together, as a curve looks like a wrong surface
    and the other way round. A shift of the start that all paths share is an error of the surface. A shift in proportion
    to the vertical speed, with the opposite sign in pulls, is a lag of the force log. A step along the run sheet, or
    two clusters of starts, mean two surfaces or two lags.
    """
    fits, config = measured.tables["fits"], measured.config
    if measured.flags.runs_with("no-tare").keys() & set(fits["run_id"]):
        return Check.skip("surface", "rod-in-it"), Check.skip("linearity", "rod-in-it")
    steep_fits = _select_clear_lines(fits)
    is_push = steep_fits["direction"].to_numpy() == "intrusion"
    pushes = steep_fits[is_push]
    run_cm, session_cm = ordinary_surface(config.errors)
    tolerance_deg, speed = measured.tolerance_deg, config.arm.speed_cm_per_s
    crust = judge_crust(measured.flags, pushes)
    is_laboratory = measured.medium.role == "laboratory"
    if not is_laboratory or len(pushes) < FEW_RUNS:
        # the surface cannot be checked, so the law is judged alone
        law = crust or judge_law_alone(pushes, run_cm, session_cm, tolerance_deg)
        return Check.skip("surface", "few-pushes" if is_laboratory else "natural-sand"), law
    # first whether stress is a line, then the error of the surface and the lag of all runs together
    line = crust or judge_linearity(pushes, session_cm, tolerance_deg)
    starts = Starts.of(steep_fits, is_push, run_cm)
    (offset_cm, lag_cm), covariance = _fit_surface_and_lag(starts, steep_fits, session_cm, speed)
    offset_se, lag_se = np.sqrt(np.diag(covariance))
    # start of a push with the mean vertical speed by surface and lag together, which pushes alone do not tell apart:
    # terms of `Starts` of such a push
    mean_push = np.array([1.0, float(starts.sine[is_push].mean())])
    push_start = offset_cm + mean_push[1] * lag_cm
    push_start_se = math.sqrt(mean_push @ covariance @ mean_push)
    is_off, is_late = abs(offset_cm) > SURE * offset_se, abs(lag_cm) > SURE * lag_se
    is_off |= abs(push_start) > SURE * push_start_se and not is_late
    # parts of the sentences that only pulls give
    pull_found: Remark | str = ""
    by_cause: Remark | str = ""
    if np.ptp(starts.sine) > 1:  # there are pulls
        pull_found = _describe_start_of_pulls(starts.start[~is_push], config.fit.confidence)
        most_mm, most_late_s = 10 * SURE * offset_se, SURE * lag_se / speed
        by_cause = remark("surface-and-lag", mm=most_mm, s=most_late_s)
    values: dict[str, Any] = {
        "push": _describe_start(push_start),
        "pull": pull_found,
        "most_mm": 10 * SURE * push_start_se,
        "by_cause": by_cause,
    }
    if line.verdict == FAILED or abs(float(pushes["exponent_z"].median()) - 1) > TOLERATED:
        # a line through curved stress starts deeper if its window ends deeper
        deep = steep_fits["depth_to_cm"].to_numpy(float)
        starts = replace(starts, terms=np.column_stack([starts.terms, deep - deep.mean()]))
    # consecutive runs with patches in their beds may look like a step, so the error includes patches
    starts = replace(starts, error=np.hypot(starts.error, _error_of_start(steep_fits)))
    # then whether a part of the runs has another surface or lag, which is the more exact cause
    runs = [measured.sheet[run] for run in steep_fits["run_id"]]
    other_level = _find_two_levels(starts, runs, speed) or _find_other_path(
        starts, pushes, measured
    )
    if other_level is not None:
        code, flags, values_of_level = other_level
        return Check.judge("surface", False, flags, code, **values, **values_of_level), line
    code = _CODES[bool(is_late), bool(is_off)]
    values |= {"side": "late" if lag_cm > 0 else "early", "late_s": abs(lag_cm) / speed}
    surface = Check.judge("surface", not (is_late or is_off), code=code, **values)
    if is_off and _looks_curved(pushes):
        # the start of a line through curved stress is not the surface
        if line.verdict != FAILED:
            values_of_both = {**line.values, "surface": surface.found}
            line = Check.judge("linearity", False, code="linearity-or-surface", **values_of_both)
        surface = Check.skip("surface", "surface-curved")
    return surface, line


def _select_clear_lines(fits: pd.DataFrame) -> pd.DataFrame:
    """Select the rows of fits, pushes and pulls on steep paths, whose line has a clear slope.

    A nearly flat line may reach zero at any depth.
    """
    steep_fits = fits[is_steep(fits) & fits["start_cm"].notna()]
    alpha, se, free_slope = (
        steep_fits[f"{name}_N_per_cm3"].to_numpy(float)
        for name in ("alpha_z", "alpha_z_se", "free_slope_z")
    )
    is_clear = np.fmin(np.abs(alpha), np.abs(free_slope)) > CLEAR_ALPHA * se
    clear_fits: pd.DataFrame = steep_fits[is_clear]
    return clear_fits


def _fit_surface_and_lag(
    starts: Starts, fits: pd.DataFrame, session_cm: float, speed: float
) -> tuple[FloatArray, FloatArray]:
    """Fit the starts by an error of the surface and a lag; return both, cm, shape (2,), and their covariance, (2, 2).

    The covariance includes what surface and lag may ordinarily be. `fits`: Rows of the table of fits, as in `starts`.
    `speed`: of the arm, cm/s.
    """
    # pulls that share a tare share the error of its zero, which matters as they are weak
    runs_of_tare = fits.groupby(["tare_run", "direction"])["run_id"].transform("size")
    shared = np.where(starts.pushes, 1, runs_of_tare.to_numpy(float))
    coefficients, covariance, _ = starts.fit(shared=shared)
    # 1 / shared adds up to the number of independent runs
    wider = student_limit(SURE, max((1 / shared).sum() - 2, 1)) / SURE
    ordinary = np.diag([session_cm**2, (_CHOSEN.ordinary_lag_s * speed) ** 2])
    return coefficients, wider**2 * covariance + ordinary


def _error_of_start(fits: pd.DataFrame) -> FloatArray:
    """Standard error of the start of each run, cm, shape (n,), by noise and by patches of the bed.

    The same noise moves the start of a line farther if its window is deeper or shorter. Patches change the exponent,
    and with it the start. `fits`: Rows of the table of fits.
    """
    # ends of the window, cm
    top, end, alpha, se = (
        fits[name].to_numpy(float)
        for name in ("depth_from_cm", "depth_to_cm", "alpha_z_N_per_cm3", "alpha_z_se_N_per_cm3")
    )
    # mean and standard deviation of the depths in the window
    middle, spread = (top + end) / 2, (end - top) / math.sqrt(12)
    # with n samples of scatter s, the slope through zero has the error s / sqrt(n (middle^2 + spread^2)), and the depth
    # at which a free line is 0 the error s / alpha sqrt(1 / n + middle^2 / (n spread^2))
    of_noise = se / np.abs(alpha) * (middle**2 + spread**2) / spread
    windows = zip(top.round(1).tolist(), end.round(1).tolist(), strict=True)
    of_patches = [PATCHES / exponent_lever(*window) for window in windows]
    return np.asarray(np.hypot(of_noise, of_patches))


@dataclass(frozen=True)
class Starts:
    """Depths at which stress begins in n runs, and the terms of the linear model of what may move them.

    `terms`: Terms that all starts have in common, shape (n, k): the surface (1), a lag (`sine`, or 0 if all paths are
    alike), and curvature if there is any.
    `sine`: Vertical speed over the speed of the arm, positive downward, (n,): a lag moves starts in proportion to it.
    `start`, `error`: Depth and its standard error, cm, shape (n,).
    `pushes`: True for pushes, False for pulls, (n,).
    """

    terms: FloatArray
    sine: FloatArray
    start: FloatArray
    error: FloatArray
    pushes: Mask

    @classmethod
    def of(cls, fits: pd.DataFrame, pushes: Mask, run_cm: float) -> Starts:
        """Make the starts of rows of the table of fits; `pushes`: True for those that are pushes, shape (n,).

        The error of a start is that of the surface (`run_cm`) and of the zero, which moves a weak run farther.
        """
        vertical = np.abs(np.sin(np.radians(fits["gamma_deg"].to_numpy(float))))
        sine = np.where(pushes, 1, -1) * vertical
        alpha = np.abs(fits["alpha_z_N_per_cm3"].to_numpy(float))
        return cls(
            # where all paths are about as steep, a lag cannot be told from the surface
            np.stack([np.ones_like(sine), sine * (np.ptp(sine) > 0.2)], axis=1),
            sine,
            fits["start_cm"].to_numpy(float),
            # a drift of the zero moves the start of a weak run farther
            np.hypot(run_cm, LEVELLED_CM * np.median(alpha[pushes]) / alpha),
            pushes,
        )

    def __getitem__(self, rows: npt.NDArray[Any]) -> Starts:
        """Select runs, by a mask or by indices, in the order of these."""
        return Starts(*(array[rows] for array in vars(self).values()))

    def fit(
        self, extra_term: npt.NDArray[Any] | None = None, shared: FloatArray | float = 1.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Fit the terms by robust least squares, as single runs may have another surface.

        Runs far off get less weight. The errors are multiplied by a factor from the scatter, one for pushes and one for
        pulls.

        Returns the k coefficients, cm, their covariance, shape (k, k), and the error of each start, cm, shape (n,).
        `extra_term`: Another term besides `terms`, shape (n,), whose coefficient then comes last.
        `shared`: Number of runs that share the error of a run, shape (n,).
        """
        design = self.terms if extra_term is None else np.column_stack([self.terms, extra_term])
        all_runs = np.ones(self.start.size, dtype=bool)
        weight, spread = np.ones_like(self.start), np.ones_like(self.start)
        for _ in range(10):
            sigma = self.error * spread * np.sqrt(shared / weight)
            scaled = design / sigma[:, None]
            inverse = np.linalg.pinv(scaled.T @ scaled)
            coefficients = inverse @ scaled.T @ (self.start / sigma)
            residual = np.abs(self.start - design @ coefficients) / self.error
            # all runs first, for a side that has too few runs
            for side in (all_runs, self.pushes, ~self.pushes):
                if residual[side].size >= FEW_RUNS:
                    spread[side] = max(float(sd_by_median(residual[side])), 0.3)
            # weights of Huber: residuals beyond 1.5 standard deviations count less
            weight = np.minimum(1.0, 1.5 * spread / np.maximum(residual, 1e-9))
        return coefficients, np.asarray(inverse), sigma

    def size_of(self, term: npt.NDArray[Any]) -> tuple[float, float]:
        """Fit a term, shape (n,), besides `terms`; return its coefficient, cm, and the size of this in standard errors.

        Both are 0 if the term depends linearly on `terms`, as nothing then tells them apart.
        """
        design = np.column_stack([self.terms, term])
        if np.linalg.matrix_rank(design) == np.linalg.matrix_rank(self.terms):
            return 0.0, 0.0
        coefficients, covariance, _ = self.fit(term)
        return float(coefficients[-1]), abs(coefficients[-1]) / math.sqrt(covariance[-1, -1])


def _describe_start(depth_cm: float) -> Remark:
    """Describe the depth at which stress begins."""
    code = "starts-below" if depth_cm >= 0 else "starts-above"
    return remark(code, mm=10 * abs(depth_cm))


def _describe_start_of_pulls(start_cm: FloatArray, confidence: float) -> Remark:
    """Describe the depth at which stress begins in pulls: their median, and its interval for three runs or more.

    The result of the fit is not used, as pushes and the order of the runs influence it. `start_cm`: starts of the pulls.
    """
    middle, se = median_of_runs(start_cm)
    if math.isnan(middle):
        return remark("in-pulls", pull=_describe_start(float(np.median(start_cm))), interval="")
    half_interval = float(student_quantile(confidence, start_cm.size - 1.0)) * se
    ends = remark(
        "interval-starts",
        low=_describe_start(middle - half_interval),
        high=_describe_start(middle + half_interval),
    )
    return remark("in-pulls", pull=_describe_start(middle), interval=ends)


def _find_two_levels(
    starts: Starts, runs: Sequence[Run], speed: float
) -> tuple[str, list[Remark], dict[str, Any]] | None:
    """Find runs whose surface or lag differs from that of the others, as after a bed was filled; None where all are alike.

    `runs`: Those of `starts`, in its order. `speed`: Speed of the arm, cm/s.
    Returns the code of the outcome, flags of these runs, and values of its sentences.
    """
    order = np.argsort([run.row for run in runs], kind="stable")
    runs, starts = [runs[index] for index in order], starts[order]
    on_second_level = _find_second_level(starts)
    if on_second_level is None:
        return None
    # the level differs by the surface or by a lag, whichever explains it more clearly; further terms are no cause
    sizes = {
        kind: starts.size_of(term * on_second_level)
        for kind, term in zip(("surface", "lag"), starts.terms.T, strict=False)
        if term.any()
    }
    kind = max(sizes, key=lambda name: sizes[name][1])
    gap = sizes[kind][0]  # cm
    if abs(gap) < _CHOSEN.step_cm:
        return None
    run_ids = [
        run.run_id for run, is_second in zip(runs, on_second_level, strict=True) if is_second
    ]
    values: dict[str, Any] = {
        "count": on_second_level.sum(),
        "size": on_second_level.size,
        "rows": describe_rows(run_ids, {run.run_id: run for run in runs}),
    }
    if kind == "surface":
        gap *= 10  # mm
        values |= {"side": "deeper" if gap > 0 else "higher", "gap_mm": abs(gap)}
    else:
        gap /= speed  # s
        values |= {"side": "later" if gap > 0 else "earlier", "gap_s": abs(gap)}
    code = f"{kind}-differs"
    return code, flags_on(run_ids, code, gap=gap), values


def _find_second_level(starts: Starts) -> Mask | None:
    """Mark runs whose starts have another level than the others, shape (n,): a stretch of runs, or else a cluster.

    None without any. `starts`: In the order of the run sheet. The levels are found by pushes alone, as pulls are too
    weak.
    """
    pushes = starts[starts.pushes]
    coefficients, _, sigma = pushes.fit()
    clusters = two_clusters(pushes.start - pushes.terms @ coefficients)
    # a stretch must be clearer than the clusters, if there are two
    clear = 1.0 if clusters is None else clusters[0]
    # the errors change with the stretch that is left out of the scatter: twice is enough
    for _ in range(2):
        stretch = shifted_runs(pushes.terms, pushes.start, sigma)
        coefficients, covariance, sigma = pushes.fit(stretch)
    if stretch.any():
        step_se = math.sqrt(covariance[-1, -1])
        if abs(coefficients[-1]) > clear * _clear_step(stretch) * step_se:
            # a pull is on the level of the push before it
            return np.asarray(stretch[np.maximum(np.cumsum(starts.pushes) - 1, 0)])
    if clusters is None:
        return None
    on_second_level = np.zeros(starts.start.size, dtype=bool)
    on_second_level[starts.pushes] = clusters[1]
    return on_second_level


def _find_other_path(
    starts: Starts, pushes: pd.DataFrame, measured: MediumMeasurements
) -> tuple[str, list[Remark], dict[str, Any]] | None:
    """Find pushes at one angle of the path whose surface differs from that of the others; None where all are alike.

    A slanted stage that counts along its path has another reading at the surface at each angle.

    `pushes`: Rows of the table of fits, those of `starts` that are pushes.
    Returns the code of the outcome, flags of these runs, and values of its sentences.
    """
    starts = starts[starts.pushes]
    gamma_deg = pushes["gamma_deg"].to_numpy(float)
    path = number_directions(np.zeros_like(gamma_deg), gamma_deg, measured.tolerance_deg)
    surface, lag, *curvature = starts.terms.T
    starts = replace(starts, terms=np.column_stack([surface, *curvature]))
    # a lag also makes the paths differ: a surface of one path must explain the starts better than a lag; of two that
    # explain them equally well, but for rounding, the first counts
    clearest = starts.size_of(lag)[1] * (1 + 1e-9)
    gap_cm, of_path = 0.0, np.zeros(gamma_deg.size, dtype=bool)
    # paths with fewer runs come first, so that of two paths this one is named
    for number in sorted(np.unique(path), key=lambda number: int(np.sum(path == number))):
        is_on_path = path == number
        if min(is_on_path.sum(), (~is_on_path).sum()) < FEW_RUNS:
            continue
        size_cm, times_error = starts.size_of(is_on_path)
        if times_error > clearest:
            clearest, gap_cm, of_path = times_error * (1 + 1e-9), size_cm, is_on_path
    if clearest < _CHOSEN.step_sure or abs(gap_cm) < _CHOSEN.step_cm:
        return None
    run_ids = pushes["run_id"][of_path].tolist()
    values: dict[str, Any] = {
        "gap_mm": 10 * abs(gap_cm),
        "side": "deeper" if gap_cm > 0 else "higher",
        "gamma_deg": float(np.median(gamma_deg[of_path])),
        "count": of_path.sum(),
        "others": (~of_path).sum(),
        "rows": describe_rows(run_ids, measured.sheet),
    }
    return "surface-of-path", flags_on(run_ids, "surface-differs", gap=10 * gap_cm), values


def _clear_step(stretch: Mask) -> float:
    """Standard errors from which on a stretch of runs differs: more for short stretches, as there are more of them.

    `stretch`: True for the runs of the stretch, shape (n,).
    The penalty is that of Duembgen & Spokoiny (Ann. Stat. 29, 124, 2001); it is 0 for half of the runs.
    """
    step_sure = float(_CHOSEN.step_sure)
    return step_sure + math.sqrt(-2 * math.log(stretch.mean())) - math.sqrt(2 * math.log(2))


def judge_linearity(pushes: pd.DataFrame, session_cm: float, tolerance_deg: float) -> Check:
    """Judge whether stress of pushes grows in proportion to depth, or by another power, where the surface is checked, too.

    The outcome of the check `linearity`. `pushes`: Rows of the table of fits.
    """
    # below 1: the power fits the direction better than a line with a free intercept
    of_directions = pushes.groupby(number_rows(pushes, tolerance_deg))["power_misfit_z_ratio"]
    misfit = of_directions.median().dropna().to_numpy(float)
    if len(pushes.dropna(subset=["exponent_z"])) < FEW_RUNS or not misfit.size:
        return Check.skip("linearity", "linearity-few")
    power, se = exponent_of(pushes, session_cm, tolerance_deg)
    share = float(np.mean(misfit < 1))
    most_departure, clear_share = max(TOLERATED, SURE * se), _clear_share(misfit.size)
    values: dict[str, Any] = {
        "power": power,
        "share": share,
        "least": 1 - most_departure,
        "most": 1 + most_departure,
        "clear": clear_share,
    }
    # another power must differ clearly from 1, and fit clearly more than half of the directions better than a line
    is_line = abs(power - 1) <= most_departure or share < clear_share
    if is_line and most_departure > MOST_EXPONENT:
        return Check.skip("linearity", "linearity-open", **values)
    return Check.judge("linearity", is_line, **values)


def _looks_curved(pushes: pd.DataFrame) -> bool:
    """Return True unless a line fits clearly more than half of the pushes better than a power does.

    Then the start of a line is not the surface. `pushes`: Rows of the table of fits.
    """
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    return bool(misfit.size) and float(np.mean(misfit > 1)) < _clear_share(misfit.size)


def _clear_share(runs: int) -> float:
    """Share of runs that must prefer one of two models to be clear: two standard errors above a half, at most 0.95."""
    return min(0.5 + 1 / math.sqrt(max(runs, 1)), 0.95)
