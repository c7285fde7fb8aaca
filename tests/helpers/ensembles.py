"""Many simulated campaigns of one medium at once, from samples to alpha tables, for coverage.

Every run is made as samples (correlated noise, an offset that drifts, an error of the clocks, a bed
that differs from run to run, the start-up and stick-slip of a horizontal run) and measured by the
program's own functions: zero, slope, start-up, alpha table. Only the files between them are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import yaml
from campaigns import PROJECT
from paper_grid import PAPER
from scipy.signal import lfilter

from rftfit.campaign.config import Config, Errors
from rftfit.measure.alpha import alpha_table
from rftfit.measure.slopes import Slope, fit_slope, unfinished_start
from rftfit.measure.zero import find_zero
from rftfit.reference import BETA_DEG, GAMMA_DEG, alpha_grid

if TYPE_CHECKING:
    from collections.abc import Iterator

FloatArray = np.ndarray
AREA_CM2, PRECISION_N, DRIFT_N_PER_MIN = 9.6774, 0.05, 0.02
AIR_S, CLOCK_SD_S, SKIP_CM, CORRELATION = 1.9, 0.003, 2.0, 0.7
REPEATS = 3
RUN_TO_RUN = 0.005
"""N/cm^3: the paper's "within 0.005" taken as one standard deviation, the wider reading."""


def paper_config(draws: int) -> Config:
    """Return the demonstration's config with another number of draws."""
    text = (PROJECT / "config" / "config.yaml").read_text(encoding="utf-8")
    config = Config.model_validate(yaml.safe_load(text))
    fourier = config.fourier.model_copy(update={"draws": draws})
    return config.model_copy(update={"fourier": fourier})


@dataclass(frozen=True)
class Plan:
    """One run of every campaign; depth and travel in cm, of the samples of its stroke."""

    run_id: str
    beta_deg: float
    gamma_deg: float
    depth: FloatArray
    travel: FloatArray
    alpha: tuple[float, float]
    number: int = 0

    @property
    def level(self) -> bool:
        """Whether it is a horizontal run."""
        return self.gamma_deg == 0


def plan(medium: str, repeats: int = 1) -> list[Plan]:
    """Runs of the paper's protocol; the straight pushes and pulls are made `repeats` times."""
    truth = alpha_grid(medium)
    runs = []
    for i, beta in enumerate(BETA_DEG):
        if beta == -90:
            continue
        half_z = 1.905 * abs(np.sin(np.radians(beta))) + 0.32 * abs(np.cos(np.radians(beta)))
        for j, gamma in enumerate(GAMMA_DEG):
            alpha = (float(truth[0][i, j]), float(truth[1][i, j]))
            name = f"b{beta:+03.0f}_g{gamma:+06.2f}"
            if gamma == 0:
                travel = np.arange(640) / 100
                runs += [Plan(f"{name}_h{depth}", beta, 0.0, np.full(640, depth), travel, alpha)
                         for depth in (2.54, 5.08, 7.62)]  # fmt: skip
                continue
            steep = abs(np.sin(np.radians(gamma)))
            reach = 8.0 * np.tan(np.radians(abs(gamma))) if abs(gamma) < 89 else 99.0
            deep = min(9.0 - half_z, reach)
            depth = np.arange(half_z, max(deep, half_z + 0.7), steep / 100)
            depth = depth if gamma > 0 else depth[::-1]
            count = repeats if abs(gamma) == 90 else 1
            travel = np.abs(depth - depth[0])
            runs += [Plan(f"{name}_{number}", beta, gamma, depth, travel, alpha, number)
                     for number in range(count)]  # fmt: skip
    return runs


def noise(random: np.random.Generator, k: int, n: int) -> FloatArray:
    """First-order correlated noise of the transducer's precision, N/cm^2, shape (k, n)."""
    white = random.standard_normal((k, n + 20))
    scale = PRECISION_N / AREA_CM2 * np.sqrt(1 - CORRELATION**2)
    return np.asarray(lfilter([scale], [1, -CORRELATION], white, axis=1)[:, 20:])


def one_log(random: np.random.Generator, k: int, n: int) -> tuple[FloatArray, FloatArray, float]:
    """Noise of a stroke whose drifting zero has been removed; variance and dof of that zero."""
    air = np.arange(round(100 * AIR_S)) / 100
    stroke = AIR_S + 4.0 + np.arange(n) / 100
    drift = random.uniform(-1, 1, (k, 1)) * DRIFT_N_PER_MIN / 60 / AREA_CM2
    record = noise(random, k, air.size) + drift * air
    everywhere = np.ones(air.size, dtype=bool)
    zero = find_zero(
        air, record, everywhere, ~everywhere, float(stroke.mean()), DRIFT_N_PER_MIN / AREA_CM2
    )
    assert zero is not None
    return noise(random, k, n) + drift * stroke - zero.force[:, :1], zero.variance, zero.dof


def measure(run: Plan, campaigns: int, random: np.random.Generator) -> Slope:
    """Simulate and fit one run in every campaign; all z, then all x, shape (2 campaigns,)."""
    k, n = 2 * campaigns, run.depth.size
    parts = [one_log(random, k, n) for _ in ("run", "tare")]
    alpha = np.repeat(run.alpha, campaigns)
    depth_sd = CLOCK_SD_S * abs(np.sin(np.radians(run.gamma_deg)))
    felt = run.depth + random.normal(0, depth_sd, (k, 1))
    if run.level:
        period, phase = random.uniform(0.25, 0.5, (k, 1)), random.uniform(0, 2 * np.pi, (k, 1))
        felt = felt * (1 - np.exp(-run.travel / 0.4))
        felt = felt * (1 + 0.015 * np.sin(2 * np.pi * run.travel / period + phase))
    stress = alpha[:, None] * felt + parts[0][0] - parts[1][0]
    variance = np.stack([part[1] for part in parts])
    dof = np.stack([np.full(k, part[2]) for part in parts])
    if not run.level:
        return fit_slope(run.depth, stress, variance, dof, depth_sd)
    steady = run.travel >= SKIP_CM
    startup = unfinished_start(run.travel, stress, steady, SKIP_CM)
    # the arm's log has its noise in the depth of a horizontal run too
    depth = run.depth[steady] + random.normal(0, 3e-4, int(steady.sum()))
    return fit_slope(depth, stress[:, steady], variance, dof, depth_sd, startup)


@dataclass(frozen=True)
class Ensemble:
    """What every run of many campaigns gave; arrays of shape (runs, 2, campaigns), z and x."""

    medium: str
    runs: list[Plan]
    alpha: FloatArray
    se: FloatArray
    dof: FloatArray
    startup: FloatArray

    def as_medium(self, medium: str) -> Ensemble:
        """Give another medium's truth the errors of this one, each campaign those of the next."""
        runs = plan(medium, REPEATS)
        ours, theirs = (np.array([run.alpha for run in part])[:, :, None]
                        for part in (self.runs, runs))  # fmt: skip
        rolled = {
            name: np.roll(getattr(self, name), 1, axis=2) for name in ("se", "dof", "startup")
        }
        return Ensemble(medium, runs, np.roll(self.alpha, 1, axis=2) - ours + theirs, **rolled)

    def tables(
        self,
        seed: int,
        run_to_run: float = 0.0,
        stated: float | None = None,
        repeats: int = 1,
        repeated: tuple[float, ...] = (90.0, -90.0),
    ) -> Iterator[pd.DataFrame]:
        """Alpha table of every campaign, as the slope stage makes it.

        Beds differ from run to run with that deviation; cells at the `repeated` gammas are measured
        `repeats` times, all others once.
        """
        random = np.random.default_rng([seed, *self.medium.encode()])
        beds = random.normal(0, run_to_run, self.alpha.shape)
        there = [run.number < (repeats if run.gamma_deg in repeated else 1) for run in self.runs]
        kept = [run for run, keep in zip(self.runs, there, strict=True) if keep]
        fixed = pd.DataFrame(
            {
                "run_id": [run.run_id for run in kept],
                "beta_deg": [run.beta_deg for run in kept],
                "gamma_deg": [run.gamma_deg for run in kept],
                "depth_from_cm": [run.depth.min() for run in kept],
                "depth_to_cm": [run.depth.max() for run in kept],
                "flags": "", "reason": "",
            }
        )  # fmt: skip
        numbers = {"": self.alpha + beds, "_se": self.se, "_startup": self.startup}
        for j in range(self.alpha.shape[2]):
            own = {
                f"alpha_{c}{name}_N_per_cm3": values[there, i, j]
                for i, c in enumerate("zx")
                for name, values in numbers.items()
            }
            own |= {f"alpha_{c}_dof": self.dof[there, i, j] for i, c in enumerate("zx")}
            errors = Errors(angle_deg=0, turn_deg=0, bed_N_per_cm3=stated)
            yield alpha_table(fixed.assign(**own), self.medium, 0.95, 3, errors, PAPER)


def simulate(medium: str, campaigns: int, seed: int) -> Ensemble:
    """Simulate and measure every run of so many campaigns, cells at gamma = +-90 three times."""
    random = np.random.default_rng([seed, *medium.encode()])
    runs = plan(medium, REPEATS)
    found = [measure(run, campaigns, random) for run in runs]
    names = ("alpha", "se", "dof", "startup")
    arrays = {
        name: np.stack([getattr(slope, name).reshape(2, campaigns) for slope in found])
        for name in names
    }
    return Ensemble(medium, runs, **arrays)
