"""Where stress begins, against the surface and the clocks, and whether it is proportional to depth."""

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
from rftfit.conventions import FloatArray
from rftfit.measure.checks_runs import SURE
from rftfit.measure.flags import Remark
from rftfit.measure.levels import FEW_RUNS, Mask, median_of_runs, shifted_runs, two_clusters
from rftfit.measure.verdicts import FAILED, Check, Measured, as_sentence, flags_on, rows_of

_SIGMAS = 3.0
_SURFACE_CM, _LAG_S = 0.05, 0.03
"""Ordinary errors, that no verdict rests on: a bed levelled by a blade; filter of an amplifier."""
_CURVED = 0.05
_STEP_CM, _STEP = 0.22, 5.3
"""A half of the sheet with another surface: least difference, and in standard errors of the best of all stretches."""


def check_surface(measured: Measured) -> Check:
    """Whether stress begins at the surface, and in all runs alike."""
    return _surface_and_linearity(measured)[0]


def check_linearity(measured: Measured) -> Check:
    """Whether stress is proportional to depth."""
    return _surface_and_linearity(measured)[1]


@lru_cache(maxsize=1)  # two checks of one medium ask in turn
def _surface_and_linearity(measured: Measured) -> tuple[Check, Check]:
    """Where stress begins, by lines with a free intercept, against the surface; and whether it is a line.

    What all paths share is an error of the surface; what grows with the speed of sinking, and has the
    opposite sign in pulls, is a lag. A step along the sheet, or two clusters, are two surfaces or two lags.
    """
    from scipy.special import ndtr, stdtrit

    fits, speed = measured.tables["fits"], measured.config.arm.speed_cm_per_s
    why = ""
    if measured.medium.role != "laboratory":
        why = "stress is a line only near the surface of a natural sand"
    elif measured.flags.runs_with("no-tare").keys() & set(fits["run_id"]):
        why = "the force on the rod, which begins elsewhere, is in it"
    known = fits[(fits["gamma_deg"].abs() >= 45) & fits["start_cm"].notna()]
    alpha, se = (known[f"alpha_z{end}_N_per_cm3"].to_numpy(float) for end in ("", "_se"))
    clear = np.abs(alpha) > _SIGMAS * se
    known, alpha = known[clear], np.abs(alpha[clear])
    pushes = known["direction"].to_numpy() == "intrusion"
    if not why and pushes.sum() < FEW_RUNS:
        why = "too few pushes with a slope of their own"
    if why:
        return Check.skipped("surface", why), Check.skipped("linearity", why)
    errors = measured.config.errors
    stated = errors.surface_run_mm or 0.0, errors.surface_session_mm or 0.0
    run_cm, session_cm = (max(_SURFACE_CM, one / 10) for one in stated)
    sine = np.where(pushes, 1, -1) * np.abs(np.sin(np.radians(known["gamma_deg"].to_numpy(float))))
    # the zero of a tare, which moves weak pulls, is one error of all that share it
    shared = known.groupby(["tare_run", "direction"])["run_id"].transform("size").to_numpy(float)
    starts = Starts(
        np.stack([np.ones_like(sine), sine * (np.ptp(sine) > 0.2)], axis=1),
        known["start_cm"].to_numpy(float),
        # the weaker a run, the farther a drift of its zero moves its start
        np.hypot(run_cm, _SURFACE_CM * np.median(alpha[pushes]) / alpha),
        pushes,
    )
    shared = np.where(pushes, 1, shared)
    (off, late), covariance, _ = starts.fit(shared=shared)
    # few runs hardly tell their own scatter: Student's t at the same level
    wider = stdtrit(max((1 / shared).sum() - 2, 1), ndtr(SURE)) / SURE
    covariance = wider**2 * covariance + np.diag([session_cm**2, (_LAG_S * speed) ** 2])
    mean = np.array([1.0, float(sine[pushes].mean())])
    down, down_se = off + mean[1] * late, math.sqrt(mean @ covariance @ mean)
    off_se, late_se = np.sqrt(np.diag(covariance))
    is_off, is_late = abs(off) > SURE * off_se, abs(late) > SURE * late_se
    is_off |= abs(down) > SURE * down_se and not is_late
    found = f"stress begins {_placed(down)} in pushes"
    allowed = f"{10 * SURE * down_se:.1f} mm of either sign"
    if np.ptp(sine) > 1:
        found += f", {_placed(off - late)} in pulls straight up"
        allowed += (
            f", by the surface {10 * SURE * off_se:.1f} mm, by a lag {SURE * late_se / speed:.2f} s"
        )
    line = linearity(known[pushes])
    if line.verdict == FAILED or abs(float(known["exponent_z"][pushes].median()) - 1) > _CURVED:
        # a line through curved stress begins the deeper the deeper it ends
        deep = known["depth_to_cm"].to_numpy(float)
        paths = np.column_stack([starts.paths, deep - deep.mean()])
        starts = replace(starts, paths=paths)
    apart = _two_levels(starts, [measured.sheet[run] for run in known["run_id"]], speed)
    if apart is not None:
        return Check.judged("surface", False, found, allowed, *apart), line
    sentences = []
    if is_late:
        sentences.append(
            f"The force log is {'late' if late > 0 else 'early'} against the motion log by about "
            f"{abs(late) / speed:.1g} s ({found}): look at the clocks and filters of both."
        )
    if is_off:
        surface = f"the surface is wrong ({found}): look at arm.surface_z_mm and surface_z_mm"
        if _looks_curved(known[pushes]):
            # a line through curved stress has a start that is no surface
            why = "stress looks curved, so where a line through it begins does not tell the surface"
            if line.verdict != FAILED:
                either = f"{as_sentence(f'{line.found}, or {surface}')} These logs cannot distinguish the two."
                line = replace(line, verdict=FAILED, sentence=either)
            return Check.skipped("surface", why), line
        sentences.append(as_sentence(surface))
    return Check.judged("surface", not sentences, found, allowed, " ".join(sentences)), line


@dataclass(frozen=True)
class Starts:
    """Depths at which stress begins, `start` (n,), cm, each with its `error`, and what may move them.

    `paths` (n, k): what all starts have in common: the surface, a lag, and curvature if there is any.
    """

    paths: FloatArray
    start: FloatArray
    error: FloatArray
    pushes: Mask

    def __getitem__(self, part: npt.NDArray[Any]) -> Starts:
        return Starts(self.paths[part], self.start[part], self.error[part], self.pushes[part])

    def fit(
        self, more: npt.NDArray[Any] | None = None, shared: FloatArray | float = 1.0
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Least squares in which a run that lies far off counts less: what is found, covariance, standard deviations.

        Errors are known but for a factor, which the scatter tells, of pushes and of pulls each its own;
        `shared` runs have one error in common. `more` (n,) is fitted beside `paths`.
        """
        design = self.paths if more is None else np.column_stack([self.paths, more])
        whole = np.ones(self.start.size, dtype=bool)
        weight, spread = np.ones_like(self.start), np.ones_like(self.start)
        for _ in range(10):
            sigma = self.error * spread * np.sqrt(shared / weight)
            scaled = design / sigma[:, None]
            inverse = np.linalg.pinv(scaled.T @ scaled)
            found = inverse @ scaled.T @ (self.start / sigma)
            rest = np.abs(self.start - design @ found) / self.error
            for side in (whole, self.pushes, ~self.pushes):
                if rest[side].size >= FEW_RUNS:
                    spread[side] = max(1.4826 * float(np.median(rest[side])), 0.3)
            weight = np.minimum(1.0, 1.5 * spread / np.maximum(rest, 1e-9))
        return found, np.asarray(inverse), sigma


def _placed(depth_cm: float) -> str:
    return f"{10 * abs(depth_cm):.1f} mm {'below' if depth_cm >= 0 else 'above'} the surface"


def _two_levels(
    starts: Starts, runs: Sequence[Run], speed: float
) -> tuple[str, list[Remark]] | None:
    """Name the runs whose surface or whose lag is not that of the others; None where all are alike."""
    order = np.argsort([run.row for run in runs], kind="stable")
    starts = starts[order]
    # pulls are too weak to find it by
    down = starts[starts.pushes]
    found, _, sigma = down.fit()
    clusters = two_clusters(down.start - down.paths @ found)
    other = np.zeros(starts.start.size, dtype=bool)
    clear = 1.0
    if clusters is not None:
        clear, other[starts.pushes] = clusters
    for _ in range(2):
        stretch = shifted_runs(down.paths, down.start, sigma)
        found, covariance, sigma = down.fit(stretch)
    if stretch.any() and abs(found[-1]) > clear * _clear_step(stretch) * math.sqrt(
        covariance[-1, -1]
    ):
        # a pull is as the push before it
        other = stretch[np.maximum(np.cumsum(starts.pushes) - 1, 0)]
    elif clusters is None:
        return None
    gaps = {}
    for kind, moves in zip(("surface", "lag"), starts.paths.T, strict=False):
        if moves.any():
            found, covariance, _ = starts.fit(moves * other)
            gaps[kind] = abs(found[-1]) / math.sqrt(covariance[-1, -1]), float(found[-1])
    kind = max(gaps, key=lambda name: gaps[name][0])
    gap = gaps[kind][1]
    if abs(gap) < _STEP_CM:
        return None
    names = [run.run_id for run, its in zip([runs[n] for n in order], other, strict=True) if its]
    rows = rows_of(names, {run.run_id: run for run in runs})
    count = f"in {other.sum()} of {other.size} runs than in the others ({rows})"
    if kind == "surface":
        way = "deeper" if gap > 0 else "higher"
        gap *= 10
        words = (
            f"Stress begins {abs(gap):.1f} mm {way} {count}: look at surface_z_mm of these runs."
        )
    else:
        way = "later" if gap > 0 else "earlier"
        gap /= speed
        words = (
            f"The force log is {abs(gap):.2g} s {way} {count}: look at the clocks of these runs."
        )
    return words, flags_on(names, f"{kind}-differs", gap=gap)


def _clear_step(stretch: Mask) -> float:
    """Standard errors from which a stretch stands apart: there are more short stretches than long ones.

    The penalty is that of Duembgen & Spokoiny (Ann. Stat. 29, 124, 2001), counted from one half.
    """
    return _STEP + math.sqrt(-2 * math.log(stretch.mean())) - math.sqrt(2 * math.log(2))


def linearity(pushes: pd.DataFrame) -> Check:
    """Whether the stress of pushes grows in proportion to depth, or by another power of it."""
    power, se = median_of_runs(pushes["exponent_z"].dropna().to_numpy(float))
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    if math.isnan(power) or misfit.size < FEW_RUNS:
        return Check.skipped("linearity", "too few pushes with a power of their own")
    share = float(np.mean(misfit < 1))
    found = f"stress of pushes grows as about depth^{power:.2f}, a power fits {share:.0%} of them better than a line"
    most, clear = max(_CURVED, SURE * se), _clear_share(misfit.size)
    allowed = f"depth^{1 - most:.2f} to depth^{1 + most:.2f}, or less than {clear:.0%} fitted better by a power"
    sentence = (
        f"Stress is not proportional to depth ({found}): a line through zero depends on its window."
    )
    good = abs(power - 1) <= most or share < clear
    return Check.judged("linearity", good, found, allowed, sentence)


def _looks_curved(pushes: pd.DataFrame) -> bool:
    """Whether a line fits too few of the pushes better than a power does."""
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    return bool(misfit.size) and float(np.mean(misfit > 1)) < _clear_share(misfit.size)


def _clear_share(runs: int) -> float:
    """Share of runs that must agree with one of two models: two standard errors above a half."""
    return min(0.5 + 1 / math.sqrt(max(runs, 1)), 0.95)
