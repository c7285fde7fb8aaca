"""Many simulated campaigns of one medium at once, from samples to alpha tables, for coverage.

Every run is made as samples (correlated noise, an offset that drifts, an error of the clocks, a bed
that differs from run to run, the start-up and stick-slip of a horizontal run) and measured by the
program's own functions: zero, slope, start-up, alpha table. Only the files between them are left out.
The disturbances are those of `disturbances`; sizes are given by name.
"""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import paper
from disturbances import NOTHING, Sizes, beds, pink, power_law, session_cm, turned, unevenness
from paper_grid import PAPER
from scipy.signal import lfilter

from rftfit.campaign.config import ErrorSettings
from rftfit.lab.plan import PlannedRun, Segment
from rftfit.lab.truth import rod_law
from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import surface_error
from rftfit.measure.fits import curved
from rftfit.measure.lab_frame import find_zero
from rftfit.measure.laws import LINE_THROUGH_ZERO, DepthLaw, replace_slope
from rftfit.measure.slopes import fit_slope, startup_bias, zero_intercept
from rftfit.reference import BETA_DEG, GAMMA_DEG, alpha_grid

FloatArray = np.ndarray
AREA_CM2, PRECISION_N, DRIFT_N_PER_MIN = 9.6774, 0.05, 0.02
AIR_S, CLOCK_SD_S, SKIP_CM, CORRELATION = 1.9, 0.003, 2.0, 0.7
REPEATS = 3
RUN_TO_RUN = 0.005
"""N/cm^3: the paper's "within 0.005" taken as one standard deviation, the wider reading."""


def paper_config(draws):
    """Return the demonstration's config with another number of draws."""
    return paper.paper_config(
        fourier=paper.paper_config().fourier.model_copy(update={"draws": draws})
    )


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
    def level(self):
        """Whether it is a horizontal run."""
        return self.gamma_deg == 0

    @property
    def direction(self):
        """As in the run sheet."""
        return "horizontal" if self.level else "intrusion" if self.gamma_deg > 0 else "extraction"


def plan(medium, repeats=1):
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
                runs += [
                    Plan(f"{name}_h{depth}", beta, 0.0, np.full(640, depth), travel, alpha)
                    for depth in (2.54, 5.08, 7.62)
                ]
                continue
            steep = abs(np.sin(np.radians(gamma)))
            reach = 8.0 * np.tan(np.radians(abs(gamma))) if abs(gamma) < 89 else 99.0
            deep = min(9.0 - half_z, reach)
            depth = np.arange(half_z, max(deep, half_z + 0.7), steep / 100)
            depth = depth if gamma > 0 else depth[::-1]
            count = repeats if abs(gamma) == 90 else 1
            travel = np.abs(depth - depth[0])
            runs += [
                Plan(f"{name}_{number}", beta, gamma, depth, travel, alpha, number)
                for number in range(count)
            ]
    return runs


def noise(random, k, n):
    """First-order correlated noise of the transducer's precision, N/cm^2, shape (k, n)."""
    white = random.standard_normal((k, n + 20))
    scale = PRECISION_N / AREA_CM2 * np.sqrt(1 - CORRELATION**2)
    return np.asarray(lfilter([scale], [1, -CORRELATION], white, axis=1)[:, 20:])


def one_log(random, k, n, sizes=NOTHING, odd=None, slow_noise_N=0.0):
    """Noise of a stroke whose drifting zero has been removed; variance and dof of that zero.

    `odd`: Random numbers of disturbances, so that all else is the same with and without them.
    `slow_noise_N`: What is stated of it.
    """
    air = np.arange(round(100 * AIR_S)) / 100
    stroke = AIR_S + 4.0 + np.arange(n) / 100
    drift = random.uniform(-1, 1, (k, 1)) * DRIFT_N_PER_MIN / 60 / AREA_CM2
    record = noise(random, k, air.size) + drift * air
    later = noise(random, k, n) + drift * stroke
    if odd and sizes.get("pink"):
        hum = sizes["pink"] / AREA_CM2 * pink(odd, k, air.size + 400 + n)
        record, later = record + hum[:, : air.size], later + hum[:, -n:]
    everywhere = np.ones(air.size, dtype=bool)
    zero = find_zero(air, record, everywhere, float(stroke.mean()), DRIFT_N_PER_MIN / AREA_CM2)
    variance = zero.variance + (slow_noise_N / AREA_CM2) ** 2
    return later - zero.force[:, :1], variance, zero.dof


def rod_stress(run, medium):
    """Force on rod and mount along a run over the area of the plate, filed as the run is, shape (2, n)."""
    gamma, back = np.radians(abs(run.gamma_deg)), -1 if run.gamma_deg < 0 else 1
    held = back * run.beta_deg if run.beta_deg != 90 else 90.0
    rod = PlannedRun("", "rod", medium, medium, "plate", run.direction, held, abs(run.gamma_deg))
    ahead = (-back * np.cos(gamma), -back * np.sin(gamma), held)
    stroke = Segment("stroke", (0.0, 0.0, held), ahead, 1.0, 1.0, 1.0)
    force_z, force_x = rod_law(rod)(stroke, run.travel, -run.depth, run.travel)
    return np.array([force_z, back * force_x]) / AREA_CM2


def measure(run, campaigns, random, medium, sizes, odd, session, slow_noise_N=0.0, at_cm=None):
    """Simulate and fit one run in every campaign; all z, then all x, shape (2 campaigns,).

    `at_cm`: Where alpha is wanted by a power of depth, not by the line.
    """
    k, n = 2 * campaigns, run.depth.size
    parts = [one_log(random, k, n, sizes, odd, slow_noise_N) for _ in ("run", "tare")]
    alpha = np.repeat(run.alpha, campaigns)
    depth_sd = CLOCK_SD_S * abs(np.sin(np.radians(run.gamma_deg)))
    late_s = sizes.get("lag", 0.0)
    up, factor = (np.tile(values, 2)[:, None] for values in beds(sizes, lambda _: odd, campaigns))
    effective_depth = (
        run.depth - 100 * late_s * np.gradient(run.depth) + random.normal(0, depth_sd, (k, 1))
    )
    effective_depth = power_law(
        effective_depth + up + np.tile(session, 2)[:, None], sizes.get("power", 1.0)
    )
    if run.level:
        travel = np.maximum(run.travel - late_s, 0)  # 1 cm/s
        period, phase = random.uniform(0.25, 0.5, (k, 1)), random.uniform(0, 2 * np.pi, (k, 1))
        effective_depth = effective_depth * (1 - np.exp(-travel / 0.4))
        effective_depth = effective_depth * (
            1 + 0.015 * np.sin(2 * np.pi * travel / period + phase)
        )
    effective_depth = (
        effective_depth * factor * unevenness(sizes, lambda _: odd, run.travel, campaigns)
    )
    stress = alpha[:, None] * effective_depth
    if sizes.get("tare-bed"):
        rod = np.repeat(rod_stress(run, medium), campaigns, axis=0)
        stress = stress - sizes["tare-bed"] / 100 * rod
    # filed in a mirror, an extraction is turned the other way
    turn = sizes.get("turn", 0.0) * (-1 if run.gamma_deg < 0 else 1)
    stress = np.concatenate(turned(stress[:campaigns], stress[campaigns:], turn))
    stress = stress + parts[0][0] - parts[1][0]
    variance = np.stack([log[1] for log in parts])
    dof = np.stack([np.full(k, log[2]) for log in parts])
    if not run.level:
        slope = fit_slope(run.depth, stress, variance, dof, depth_sd, tare_stress=parts[1][0])
        if at_cm is None:
            return slope
        return replace_slope(slope, DepthLaw("power", at_cm).fit(run.depth, stress))
    steady = run.travel >= SKIP_CM
    startup = startup_bias(run.travel, stress, steady, SKIP_CM)
    # the arm's log has its noise in the depth of a horizontal run too
    depth = run.depth[steady] + random.normal(0, 3e-4, int(steady.sum()))
    tare_stress = parts[1][0][:, steady]
    return fit_slope(depth, stress[:, steady], variance, dof, depth_sd, startup, tare_stress)


COLUMNS = {
    "alpha": "alpha_{}_N_per_cm3",
    "se": "alpha_{}_se_N_per_cm3",
    "dof": "alpha_{}_dof",
    "startup": "alpha_{}_startup_N_per_cm3",
    "intercept": "intercept_{}_N_per_cm2",
    "free_slope": "free_slope_{}_N_per_cm3",
    "nonlinear_p": "nonlinear_{}_p",
    "nonlinear_ratio": "nonlinear_{}_ratio",
    "tare": "alpha_{}_tare_N_per_cm3",
    "curvature": "alpha_{}_curvature_N_per_cm3",
    "offset": "offset_{}",
    "offset_se": "offset_se_{}",
}
"""What is kept of a slope, and its column in the table of fits."""


EXACT = ErrorSettings(
    surface_run_mm=0,
    surface_session_mm=0,
    angle_deg=0,
    turn_deg=0,
    tare_percent=0,
    bed_percent=0,
    hip_cm=0,
    arc_percent=0,
)
"""Stated to be none."""


@dataclass(frozen=True)
class Ensemble:
    """What every run of many campaigns gave.

    `quantities`: By name in `COLUMNS`, shape (runs, 2, campaigns), z and x. `levers`: Of the runs, 1/cm. `sizes`:
    Of the disturbances. `session`: shape (campaigns,); Error of the surface common to the runs of a campaign,
    cm. `at_cm`: Depth of alpha by a power of depth; None for that by the line.
    """

    medium: str
    runs: list[Plan]
    quantities: dict[str, FloatArray]
    levers: list[float]
    sizes: Sizes
    session: FloatArray
    at_cm: float | None = None

    def as_medium(self, medium):
        """Give another medium's truth the errors of this one, each campaign those of the next.

        Errors of most disturbances are in proportion to the force, so they cannot be handed on.
        """
        assert not self.sizes
        runs = plan(medium, REPEATS)
        ours, theirs = (
            np.array([run.alpha for run in planned_runs])[:, :, None]
            for planned_runs in (self.runs, runs)
        )
        rolled = {name: np.roll(values, 1, axis=2) for name, values in self.quantities.items()}
        for name in ("alpha", "free_slope"):
            rolled[name] = rolled[name] - ours + theirs
        assert (self.quantities["curvature"] == 0).mean() > 0.9  # of noise
        rolled["nonlinear_ratio"] = rolled["nonlinear_ratio"] * ours / theirs
        return replace(self, medium=medium, runs=runs, quantities=rolled)

    def fits(self, seed, run_to_run=0.0, repeats=1, repeated=(90.0, -90.0)):
        """Table of fits of every campaign, as far as the slope stage makes it of samples.

        Beds differ from run to run with that deviation; cells at the `repeated` gammas are measured
        `repeats` times, all others once.
        """
        random = np.random.default_rng([seed, *self.medium.encode()])
        beds_off = random.normal(0, run_to_run, self.quantities["alpha"].shape)
        is_kept = [run.number < (repeats if run.gamma_deg in repeated else 1) for run in self.runs]
        kept = [run for run, keep in zip(self.runs, is_kept, strict=True) if keep]
        fixed = pd.DataFrame(
            {
                "run_id": [run.run_id for run in kept],
                "medium": self.medium,
                "beta_deg": [run.beta_deg for run in kept],
                "gamma_deg": [run.gamma_deg for run in kept],
                "direction": [run.direction for run in kept],
                "mirrored": [run.gamma_deg < 0 for run in kept],
                "tare_run": [f"{run.run_id}_rod" for run in kept],
                "lever_per_cm": [
                    lever for lever, keep in zip(self.levers, is_kept, strict=True) if keep
                ],
                "depth_from_cm": [run.depth.min() for run in kept],
                "depth_to_cm": [run.depth.max() for run in kept],
                "reason": "",
            }
        )
        rods = [zero_intercept(run.depth, rod_stress(run, self.medium))[0] for run in kept]
        fixed = fixed.assign(
            alpha_z_rod_N_per_cm3=[rod[0] for rod in rods],
            alpha_x_rod_N_per_cm3=[rod[1] for rod in rods],
        )
        numbers = self.quantities | {"alpha": self.quantities["alpha"] + beds_off}
        deepest = fixed["depth_to_cm"].to_numpy()
        for j in range(beds_off.shape[2]):
            columns = {
                COLUMNS[name].format(c): values[is_kept, i, j]
                for i, c in enumerate("zx")
                for name, values in numbers.items()
            }
            bent = []
            for c in "zx":
                p, ratio, alpha = (
                    columns[COLUMNS[name].format(c)]
                    for name in ("nonlinear_p", "nonlinear_ratio", "alpha")
                )
                bent.append(curved(p, ratio, alpha, deepest, PRECISION_N / AREA_CM2))
            offset = {"offset_cm": columns["offset_z"], "offset_se_cm": columns["offset_se_z"]}
            yield fixed.assign(**columns, **offset).assign(bent=np.any(bent, axis=0))

    def tables(self, seed, run_to_run=0.0, errors=EXACT, repeats=1, repeated=(90.0, -90.0)):
        """Alpha table of every campaign, as the slope stage makes it of `fits` with stated `errors`."""
        for fits in self.fits(seed, run_to_run, repeats, repeated):
            offset, se = (fits[name].to_numpy(float) for name in ("offset_cm", "offset_se_cm"))
            surface = surface_error(offset, se, errors)
            law = DepthLaw("power", self.at_cm) if self.at_cm else LINE_THROUGH_ZERO
            alpha = alpha_table(fits, self.medium, 0.95, 3, errors, PAPER, surface, law)
            bent = {*fits.loc[fits["bent"], "run_id"]}
            weak = [not bent.isdisjoint(runs.split()) for runs in alpha["run_ids"]]
            yield alpha.assign(flagged=weak)


def simulate(medium, campaigns, seed, sizes=NOTHING, slow_noise_N=0.0, at_cm=None, repeats=REPEATS):
    """Simulate and measure every run of so many campaigns, cells at gamma = +-90 `repeats` times.

    `sizes`: Of the disturbances; all else is the same with and without them. `slow_noise_N`: What is
    stated of it. `at_cm`: As of `measure`.
    """
    random = np.random.default_rng([seed, *medium.encode()])
    odd = np.random.default_rng([seed, 1, *medium.encode()])
    session = session_cm(sizes, odd, campaigns)
    runs = plan(medium, repeats)
    slopes = [
        measure(run, campaigns, random, medium, sizes, odd, session, slow_noise_N, at_cm)
        for run in runs
    ]
    quantities = {
        name: np.stack([getattr(slope, name).reshape(2, campaigns) for slope in slopes])
        for name in COLUMNS
    }
    levers = [slope.lever for slope in slopes]
    return Ensemble(medium, runs, quantities, levers, sizes, session, at_cm)
