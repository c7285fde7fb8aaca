"""Check where stress begins, which shows errors of surface and clocks, and that it is proportional to depth."""

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
from rftfit.checks.declared import (
    SOUND_LOGS,
    Check,
    MediumMeasurements,
    Words,
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
from rftfit.measure.levels import (
    FEW_RUNS,
    Mask,
    median_of_runs,
    sd_by_median,
    shifted_runs,
    two_clusters,
)
from rftfit.measure.slopes import student_limit, student_quantile
from rftfit.measure.verdict_words import DOUBTFUL, FAILED
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "surface")


_ROD_IN_IT = Words("the force on the rod, which begins elsewhere, is in it")
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
        "natural-sand": Words("stress is a line only near the surface of a natural sand"),
        "few-pushes": Words("too few pushes with a slope of their own"),
        "surface": Words(_SURFACE_FOUND, _SURFACE_ALLOWED),
        "surface-late": Words(_SURFACE_FOUND, _SURFACE_ALLOWED, _LATE, _LATE_FAULT),
        "surface-off": Words(_SURFACE_FOUND, _SURFACE_ALLOWED, f"the {_SURFACE}."),
        "surface-late-off": Words(_SURFACE_FOUND, _SURFACE_ALLOWED, f"{_LATE} The {_SURFACE}."),
        "surface-differs": Words(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            f"stress begins {{gap_mm:.1f}} mm {{side}} {_SURFACE_OTHER}surface_z_mm of these runs.",
        ),
        "lag-differs": Words(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            f"the force log is {{gap_s:.2g}} s {{side}} {_SURFACE_OTHER}the clocks of these runs.",
            _LATE_FAULT,
        ),
        "surface-of-path": Words(
            _SURFACE_FOUND,
            _SURFACE_ALLOWED,
            "stress begins {gap_mm:.1f} mm {side} in the {count} pushes at gamma {gamma_deg:g} deg than in the {others} at other "
            "angles of the path ({rows}): look at surface_z_mm of these runs, and where a slanted stage stands at the surface.",
        ),
        "surface-curved": Words(
            "stress looks curved, so where a line through it begins does not tell the surface"
        ),
    },
)
def check_surface(measured: MediumMeasurements) -> Check:
    """Check that stress begins at the surface, and at the same depth in all runs."""
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
        "linearity": Words(
            _LINE_FOUND,
            _LINE_ALLOWED,
            "stress is not proportional to depth ({found}): a line through zero depends on its window.",
        ),
        "linearity-or-surface": Words(
            _LINE_FOUND,
            _LINE_ALLOWED,
            "{found}, or the surface is wrong ({surface}): look at arm.surface_z_mm and surface_z_mm; or, where stress begins "
            "above the surface, the sand sticks together (cohesion), as wet sand does. These logs cannot distinguish them.",
            "stress is not proportional to depth, or does not begin at the stated surface",
        ),
        "linearity-few": Words("too few pushes with a power of their own"),
        "linearity-open": Words(
            f"{_LINE_FOUND}; only beyond {LINE_POWERS} would another power be told"
        ),
    },
)
def check_linearity(measured: MediumMeasurements) -> Check:
    """Check that stress is proportional to depth."""
    return _judge_surface_and_linearity(measured)[1]


@lru_cache(maxsize=1)  # the two checks of a medium call this one after the other
def _judge_surface_and_linearity(measured: MediumMeasurements) -> tuple[Check, Check]:
    """Judge where stress begins, by lines with a free intercept, and whether it is a line of depth.

    A shift of the start that all paths share is an error of the surface. A shift in proportion to the vertical speed,
    with the opposite sign in pulls, is a lag of the force log. A step along the run sheet, or two clusters of starts,
    mean two surfaces or two lags.
    """
    fits, speed = measured.tables["fits"], measured.config.arm.speed_cm_per_s
    unchecked = ""
    if measured.flags.runs_with("no-tare").keys() & set(fits["run_id"]):
        return Check.skip("surface", "rod-in-it"), Check.skip("linearity", "rod-in-it")
    if measured.medium.role != "laboratory":
        unchecked = "natural-sand"
    steep_fits = fits[is_steep(fits) & fits["start_cm"].notna()]
    alpha, se, free_slope = (
        steep_fits[f"{name}_N_per_cm3"].to_numpy(float)
        for name in ("alpha_z", "alpha_z_se", "free_slope_z")
    )
    # a nearly flat line may reach zero at any depth
    clear = np.fmin(np.abs(alpha), np.abs(free_slope)) > CLEAR_ALPHA * se
    steep_fits, alpha = steep_fits[clear], np.abs(alpha[clear])
    pushes = steep_fits["direction"].to_numpy() == "intrusion"
    if not unchecked and pushes.sum() < FEW_RUNS:
        unchecked = "few-pushes"
    run_cm, session_cm = ordinary_surface(measured.config.errors)
    tolerance_deg = measured.config.grid.angle_tolerance_deg
    crust = judge_crust(measured.flags, steep_fits[pushes])
    if unchecked:
        # the surface cannot be checked, so the law is judged alone
        law = crust or judge_law_alone(steep_fits[pushes], run_cm, session_cm, tolerance_deg)
        return Check.skip("surface", unchecked), law
    # vertical speed over the speed of the arm, downward: a lag moves starts in proportion to it
    sine = np.where(pushes, 1, -1) * np.abs(
        np.sin(np.radians(steep_fits["gamma_deg"].to_numpy(float)))
    )
    # runs that share a tare share the error of its zero, which matters in weak pulls
    shared = (
        steep_fits.groupby(["tare_run", "direction"])["run_id"].transform("size").to_numpy(float)
    )
    starts = Starts(
        np.stack([np.ones_like(sine), sine * (np.ptp(sine) > 0.2)], axis=1),
        steep_fits["start_cm"].to_numpy(float),
        # a drift of the zero moves the start of a weak run farther
        np.hypot(run_cm, LEVELLED_CM * np.median(alpha[pushes]) / alpha),
        pushes,
    )
    shared = np.where(pushes, 1, shared)
    (offset_cm, lag_cm), covariance, _ = starts.fit(shared=shared)
    wider = student_limit(SURE, max((1 / shared).sum() - 2, 1)) / SURE
    covariance = wider**2 * covariance + np.diag(
        [session_cm**2, (_CHOSEN.ordinary_lag_s * speed) ** 2]
    )
    # start of a push with the mean vertical speed, by surface and lag together
    mean = np.array([1.0, float(sine[pushes].mean())])
    push_start, push_start_se = offset_cm + mean[1] * lag_cm, math.sqrt(mean @ covariance @ mean)
    offset_se, lag_se = np.sqrt(np.diag(covariance))
    is_off, is_late = abs(offset_cm) > SURE * offset_se, abs(lag_cm) > SURE * lag_se
    is_off |= abs(push_start) > SURE * push_start_se and not is_late
    most_mm, most_late_s = 10 * SURE * offset_se, SURE * lag_se / speed
    has_pulls = np.ptp(sine) > 1
    confidence = measured.config.fit.confidence
    values: dict[str, Any] = {
        "push": _describe_start(push_start),
        "pull": _describe_start_of_pulls(starts.start[~pushes], confidence) if has_pulls else "",
        "most_mm": 10 * SURE * push_start_se,
        "by_cause": remark("surface-and-lag", mm=most_mm, s=most_late_s) if has_pulls else "",
    }
    line = crust or judge_linearity(steep_fits[pushes], session_cm, tolerance_deg)
    if (
        line.verdict == FAILED
        or abs(float(steep_fits["exponent_z"][pushes].median()) - 1) > TOLERATED
    ):
        # a line through curved stress starts deeper if its window ends deeper
        deep = steep_fits["depth_to_cm"].to_numpy(float)
        paths = np.column_stack([starts.paths, deep - deep.mean()])
        starts = replace(starts, paths=paths)
    # consecutive runs with patches in their beds may look like a step, so the error includes patches
    starts = replace(starts, error=np.hypot(starts.error, _error_of_start(steep_fits)))
    runs = [measured.sheet[run] for run in steep_fits["run_id"]]
    apart = _find_two_levels(starts, runs, speed) or _find_path_apart(starts, steep_fits, measured)
    if apart is not None:
        code, flags, values_apart = apart
        return Check.judge("surface", False, flags, code, **values, **values_apart), line
    code = _CODES[bool(is_late), bool(is_off)]
    values |= {"side": "late" if lag_cm > 0 else "early", "late_s": abs(lag_cm) / speed}
    surface = Check.judge("surface", not (is_late or is_off), code=code, **values)
    if is_off and _looks_curved(steep_fits[pushes]):
        # the start of a line through curved stress is not the surface
        if line.verdict != FAILED:
            values_of_both = {**line.values, "surface": surface.found}
            line = Check.judge("linearity", False, code="linearity-or-surface", **values_of_both)
        surface = Check.skip("surface", "surface-curved")
    return surface, line


def _error_of_start(fits: pd.DataFrame) -> FloatArray:
    """Standard error of the depth at which a line with a free intercept starts, cm, by noise and by patches of the bed.

    The same noise moves the start of a line farther if its window is deeper or shorter. Patches change the exponent,
    and with it the start.
    """
    top, end, alpha, se = (
        fits[name].to_numpy(float)
        for name in ("depth_from_cm", "depth_to_cm", "alpha_z_N_per_cm3", "alpha_z_se_N_per_cm3")
    )
    middle, spread = (top + end) / 2, (end - top) / math.sqrt(12)
    of_noise = se / np.abs(alpha) * (middle**2 + spread**2) / spread
    windows = zip(top.round(1).tolist(), end.round(1).tolist(), strict=True)
    of_patches = [PATCHES / exponent_lever(*window) for window in windows]
    return np.asarray(np.hypot(of_noise, of_patches))


@dataclass(frozen=True)
class Starts:
    """Depths at which stress begins in n runs, and the terms that may move them.

    `paths`: Terms that all starts have in common: the surface, a lag, and curvature if there is any, shape (n, k).
    `start`, `error`: Depth and its standard error, cm, shape (n,).
    `pushes`: True for pushes, False for pulls.
    """

    paths: FloatArray
    start: FloatArray
    error: FloatArray
    pushes: Mask

    def __getitem__(self, rows: npt.NDArray[Any]) -> Starts:
        return Starts(self.paths[rows], self.start[rows], self.error[rows], self.pushes[rows])

    def fit(
        self, extra_terms: npt.NDArray[Any] | None = None, shared: FloatArray | float = 1.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Fit the terms by robust least squares; return coefficients, covariance, and the error of each start, cm.

        Runs far off get less weight. The errors are multiplied by a factor from the scatter, one for pushes and one for
        pulls.

        `extra_terms`: Another term besides `paths`, shape (n,).
        `shared`: Number of runs that share the error of a run.
        """
        design = self.paths if extra_terms is None else np.column_stack([self.paths, extra_terms])
        all_runs = np.ones(self.start.size, dtype=bool)
        weight, spread = np.ones_like(self.start), np.ones_like(self.start)
        for _ in range(10):
            sigma = self.error * spread * np.sqrt(shared / weight)
            scaled = design / sigma[:, None]
            inverse = np.linalg.pinv(scaled.T @ scaled)
            coefficients = inverse @ scaled.T @ (self.start / sigma)
            residual = np.abs(self.start - design @ coefficients) / self.error
            for side in (all_runs, self.pushes, ~self.pushes):
                if residual[side].size >= FEW_RUNS:
                    spread[side] = max(float(sd_by_median(residual[side])), 0.3)
            # weights of Huber: residuals beyond 1.5 standard deviations count less
            weight = np.minimum(1.0, 1.5 * spread / np.maximum(residual, 1e-9))
        return coefficients, np.asarray(inverse), sigma

    def size_of(self, term: npt.NDArray[Any]) -> tuple[float, float]:
        """Fit a term (n,) besides `paths`; return its coefficient, cm, and this in standard errors.

        Both are 0 if the term depends linearly on `paths`.
        """
        design = np.column_stack([self.paths, term])
        if np.linalg.matrix_rank(design) == np.linalg.matrix_rank(self.paths):
            return 0.0, 0.0
        coefficients, covariance, _ = self.fit(term)
        return float(coefficients[-1]), abs(coefficients[-1]) / math.sqrt(covariance[-1, -1])


_CODES = {
    (False, False): "surface",
    (True, False): "surface-late",
    (False, True): "surface-off",
    (True, True): "surface-late-off",
}
"""Code of the check, by two facts: the force log is late, the surface is off."""


def _describe_start(depth_cm: float) -> Remark:
    """Describe the depth at which stress begins."""
    code = "starts-below" if depth_cm >= 0 else "starts-above"
    return remark(code, mm=10 * abs(depth_cm))


def _describe_start_of_pulls(start_cm: FloatArray, confidence: float) -> Remark:
    """Describe the depth at which stress begins in pulls: their median, and its interval for three runs or more.

    The result of the fit is not used, as pushes and the order of the runs influence it.
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
    """Find runs whose surface or lag differs from that of the others; None where all are alike.

    `speed`: Speed of the arm, cm/s.
    Returns the code of the outcome, flags of these runs, and values of its sentences.
    """
    order = np.argsort([run.row for run in runs], kind="stable")
    starts = starts[order]
    # the two levels are found by pushes alone, as pulls are too weak
    push_starts = starts[starts.pushes]
    coefficients, _, sigma = push_starts.fit()
    clusters = two_clusters(push_starts.start - push_starts.paths @ coefficients)
    on_second_level = np.zeros(starts.start.size, dtype=bool)
    clear = 1.0
    if clusters is not None:
        clear, on_second_level[starts.pushes] = clusters
    for _ in range(2):
        stretch = shifted_runs(push_starts.paths, push_starts.start, sigma)
        coefficients, covariance, sigma = push_starts.fit(stretch)
    if stretch.any() and abs(coefficients[-1]) > clear * _clear_step(stretch) * math.sqrt(
        covariance[-1, -1]
    ):
        # a pull is on the level of the push before it
        on_second_level = stretch[np.maximum(np.cumsum(starts.pushes) - 1, 0)]
    elif clusters is None:
        return None
    gaps = {}
    for kind, path in zip(("surface", "lag"), starts.paths.T, strict=False):
        if path.any():
            coefficients, covariance, _ = starts.fit(path * on_second_level)
            gaps[kind] = (
                abs(coefficients[-1]) / math.sqrt(covariance[-1, -1]),
                float(coefficients[-1]),
            )
    kind = max(gaps, key=lambda name: gaps[name][0])
    gap = gaps[kind][1]
    if abs(gap) < _CHOSEN.step_cm:
        return None
    names = [
        run.run_id
        for run, is_second in zip([runs[n] for n in order], on_second_level, strict=True)
        if is_second
    ]
    values: dict[str, Any] = {
        "count": on_second_level.sum(),
        "size": on_second_level.size,
        "rows": describe_rows(names, {run.run_id: run for run in runs}),
    }
    if kind == "surface":
        gap *= 10
        values |= {"side": "deeper" if gap > 0 else "higher", "gap_mm": abs(gap)}
    else:
        gap /= speed
        values |= {"side": "later" if gap > 0 else "earlier", "gap_s": abs(gap)}
    code = f"{kind}-differs"
    return code, flags_on(names, code, gap=gap), values


def _find_path_apart(
    starts: Starts, fits: pd.DataFrame, measured: MediumMeasurements
) -> tuple[str, list[Remark], dict[str, Any]] | None:
    """Find pushes at one angle of the path whose surface differs from that of the others; None where all are alike.

    A slanted stage that counts along its path has another reading at the surface at each angle. Returns the code of the
    outcome, flags of these runs, and values of its sentences.
    """
    pushes, starts = fits[starts.pushes], starts[starts.pushes]
    gamma_deg = pushes["gamma_deg"].to_numpy(float)
    path = number_directions(
        np.zeros_like(gamma_deg), gamma_deg, tolerance_deg=measured.config.grid.angle_tolerance_deg
    )
    lag = starts.paths[:, 1].copy()
    starts = replace(starts, paths=np.where(np.arange(starts.paths.shape[1]) == 1, 0, starts.paths))
    # a lag also makes the paths differ: a surface of one path must explain the starts better than a lag
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
    names = pushes["run_id"][of_path].tolist()
    values: dict[str, Any] = {
        "gap_mm": 10 * abs(gap_cm),
        "side": "deeper" if gap_cm > 0 else "higher",
        "gamma_deg": float(np.median(gamma_deg[of_path])),
        "count": of_path.sum(),
        "others": (~of_path).sum(),
        "rows": describe_rows(names, measured.sheet),
    }
    return "surface-of-path", flags_on(names, "surface-differs", gap=10 * gap_cm), values


def _clear_step(stretch: Mask) -> float:
    """Standard errors from which on a stretch of runs differs: more for short stretches, as there are more of them.

    The penalty is that of Duembgen & Spokoiny (Ann. Stat. 29, 124, 2001); it is 0 for half of the runs.
    """
    step_sure = float(_CHOSEN.step_sure)
    return step_sure + math.sqrt(-2 * math.log(stretch.mean())) - math.sqrt(2 * math.log(2))


def judge_linearity(pushes: pd.DataFrame, session_cm: float, tolerance_deg: float) -> Check:
    """Judge whether stress of pushes grows in proportion to depth, or by another power of depth.

    `session_cm`: Standard deviation of the free surface that all runs share.
    `tolerance_deg`: Tolerance of angles of the campaign's grid.
    """
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
    """Return True unless a line fits clearly more than half of the pushes better than a power does."""
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    return bool(misfit.size) and float(np.mean(misfit > 1)) < _clear_share(misfit.size)


def _clear_share(runs: int) -> float:
    """Share of runs that must prefer one of two models: two standard errors above a half, at most 0.95."""
    return min(0.5 + 1 / math.sqrt(max(runs, 1)), 0.95)
