"""The demonstration: its directions, its configuration, and its logs with disturbances of a real laboratory."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from unittest.mock import patch

import numpy as np
import pandas as pd
import yaml
from makers import data_of, write_yaml

from rftfit import reference
from rftfit.campaign.config import Config, Grid, Leg
from rftfit.forces import prediction
from rftfit.lab.enact import prepare, run_logs
from rftfit.lab.plan import half_extents, plate_of
from rftfit.lab.rig import Lab, ideal, published_laws, random_numbers
from rftfit.lab.truth import published_alpha, sand_stress, submerged_depth
from rftfit.model import posterior

# --- The paper's 7 x 13 directions: as a planned grid, as a list of cells, and tables laid out on them ------------

PAPER = Grid(beta_deg=tuple(reference.BETA_DEG), gamma_deg=tuple(reference.GAMMA_DEG))
BETA, GAMMA = (
    angle.ravel()
    for angle in np.meshgrid(
        np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG), indexing="ij"
    )
)
"""Every cell, by beta, then gamma, rad, shape (91,)."""


def grid(table, name):
    """One column of an alpha table over the directions, shape (7, 13); NaN where it has no row.

    Plates at -90 and 90 degrees are the same.
    """
    values = table.set_index([table["beta_deg"].round(), table["gamma_deg"].round()])[name]
    beta_deg = np.degrees(BETA).round()
    cells = zip(np.where(beta_deg == -90, 90, beta_deg), np.degrees(GAMMA).round(), strict=True)
    return values.reindex([*cells]).to_numpy(float).reshape(7, 13)


def flat(alpha):
    """alpha_z and alpha_x of shape (..., 7, 13) as cells, shape (..., 91)."""
    z, x = (np.asarray(component).reshape(*np.shape(component)[:-2], 91) for component in alpha)
    return z, x


def by_hand(beta, gamma, alpha_z, alpha_x):
    """Unweighted least squares of the nine terms, written out: one row a direction that was measured."""
    runs = pd.DataFrame({"b": beta, "g": gamma, "z": alpha_z, "x": alpha_x})
    beta_deg, gamma_deg = np.round(np.degrees([beta, gamma]), 6)
    directions = runs.groupby([beta_deg % 180, gamma_deg % 360])
    means = directions.agg({"b": "first", "g": "first", "z": "mean", "x": "mean"})
    coefficients = []
    for component, terms in (("z", _lift), ("x", _drag)):
        measured = means.dropna(subset=component)
        design = [terms(b, g) for b, g in zip(measured["b"], measured["g"], strict=True)]
        coefficients.append(np.linalg.lstsq(np.array(design), measured[component])[0])
    return np.concatenate(coefficients)


def _lift(b, g):
    return [1, np.cos(2 * b), np.sin(2 * b + g), np.sin(g), np.sin(-2 * b + g)]


def _drag(b, g):
    return [np.cos(2 * b + g), np.cos(g), np.cos(-2 * b + g), np.sin(2 * b)]


# --- Disturbances of a real laboratory, each with a size ----------------------------------------------------------
# Disturbances of a real laboratory, each with a size: in the logs of the re-enacted lab, and in memory.

Sizes = Mapping[str, float]
"""Size by name of the disturbance; one that is not there has no effect."""

NOTHING: Sizes = MappingProxyType({})


@dataclass(frozen=True)
class Disturbance:
    """A default size, its unit, and what it is the size of; `nothing`: The size without an effect."""

    size: float
    unit: str
    what: str
    nothing: float = 0.0


REAL_LAB = "real-lab"
NORMAL_DEPTH_CM = 5.0
"""With `power`, the stress at this depth is that of the table."""

PATCH_CM, SLIP_CM = 2.0, 0.1

DISTURBANCES = {name: Disturbance(**entry) for name, entry in data_of("disturbances").items()}


def sizes_of(asked):
    """Read disturbances asked for as ``NAME`` or ``NAME=SIZE``, in the order of `DISTURBANCES`.

    `REAL_LAB` is all of them at their default sizes; sizes that are stated replace those.
    """
    sizes = {name: kind.size for name, kind in DISTURBANCES.items() if REAL_LAB in asked}
    for text in asked:
        if text == REAL_LAB:
            continue
        name, equals, size = text.partition("=")
        sizes[name] = float(size) if equals else DISTURBANCES[name].size
    return {name: sizes[name] for name in DISTURBANCES if name in sizes}


def described(sizes):
    """List disturbances with their sizes and units."""
    return ", ".join(f"{n}={size:g} {DISTURBANCES[n].unit}".strip() for n, size in sizes.items())


def session_cm(sizes, random, campaigns=1):
    """Draw the error of the surface that all runs of a campaign share, cm."""
    return sizes.get("surface-session", 0.0) / 10 * random.standard_normal(campaigns)


def beds(sizes, stream, campaigns=1):
    """Draw height of the surface, cm, and factor of the force of one run, each of shape (campaigns,)."""
    height = sizes.get("surface", 0.0) / 10 * stream(4).standard_normal(campaigns)
    factor = 1 + sizes.get("spread-percent", 0.0) / 100 * stream(5).standard_normal(campaigns)
    return height, factor


def unevenness(sizes, stream, travel_cm, campaigns=1):
    """Draw the factor of the granular force along a path by patches and stick-slip.

    `travel_cm`: shape (n,). Returns shape (2 campaigns, n): all z, then all x; patches are common.
    """
    factor = np.ones((2 * campaigns, travel_cm.size))
    if sizes.get("patches"):
        patches = along_path(stream(7), campaigns, travel_cm, PATCH_CM)
        factor += sizes["patches"] / 100 * np.tile(patches, (2, 1))
    if sizes.get("deep-noise"):
        slips = along_path(stream(8), 2 * campaigns, travel_cm, SLIP_CM)
        factor += sizes["deep-noise"] / 100 * slips
    return factor


def along_path(random, rows, travel_cm, length_cm):
    """Draw smooth stationary functions of the path, standard deviation 1, shape (rows, n).

    Independent values stand `length_cm` apart; between two of them weights of cosine and sine keep
    the variance the same everywhere.
    """
    place = (travel_cm - travel_cm.min()) / length_cm + random.uniform(0, 1, (rows, 1))
    knot = place.astype(int)
    values = random.standard_normal((rows, int(np.ptp(travel_cm) / length_cm) + 3))
    left, right = (np.take_along_axis(values, knot + k, axis=1) for k in (0, 1))
    angle = np.pi / 2 * (place - knot)
    return np.asarray(left * np.cos(angle) + right * np.sin(angle))


_PINK_SAMPLES = 4096


def pink(random, rows, count):
    """Draw noise with a power density of 1/f, shape (rows, count).

    Its standard deviation is 1 within 4096 samples, 41 s at 100 Hz; a longer record has slower
    parts, too.
    """
    length = max(_PINK_SAMPLES, 1 << (count - 1).bit_length())
    variance = 1 / np.arange(1, length // 2) / (1 / np.arange(1, _PINK_SAMPLES // 2)).sum()
    parts = random.standard_normal((2, rows, variance.size))
    spectrum = np.zeros((rows, length // 2 + 1), dtype=complex)
    spectrum[:, 1:-1] = (parts[0] + 1j * parts[1]) * np.sqrt(variance) / 2
    return np.asarray(np.fft.irfft(spectrum, length, axis=1)[:, :count] * length)


def power_law(depth_cm, power):
    """Depth that takes the place of |z| in alpha |z| where stress goes as depth^power, cm."""
    if power == 1:
        return depth_cm
    return np.asarray(NORMAL_DEPTH_CM * (np.maximum(depth_cm, 0) / NORMAL_DEPTH_CM) ** power)


def turned(force_z, force_x, degrees):
    """Force (z, x) as it is found where the mount is turned by so much more than the config says."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return force_x * s + force_z * c, force_x * c - force_z * s


def path_cm(motion, intruder):
    """Length of the way of a plate's centre or a leg's tip, shape (n,)."""
    steps = np.hypot(np.diff(motion.x_cm), np.diff(motion.z_cm))
    if isinstance(intruder, Leg):
        steps += intruder.max_length_cm * np.radians(np.abs(np.diff(motion.angle_deg)))
    return np.append(0.0, np.cumsum(steps))


def delayed(force, samples):
    """Forces, shape (2, n), so many samples ago; before the first, that."""
    place = np.arange(force.shape[1], dtype=float)
    return np.array([np.interp(place - samples, place, row) for row in force])


@dataclass(frozen=True)
class Bed:
    """What the bed of a stroke differs by from the published one.

    `off`: Of alpha_z and alpha_x, N/cm^3. `factor`, `rod`: Of the granular force, and of that on rod
    and mount. `surface_cm`: Above the nominal one. `power`: Of the depth in the stress of plates.
    """

    off: tuple[float, float]
    factor: float
    surface_cm: float
    power: float
    rod: float


def bed_of(stroke, sizes, spread=0.0):
    """Draw the bed of a stroke; alpha_z and alpha_x are off by `spread` (standard deviation), N/cm^3."""
    z, x = (spread * stroke.random(3).standard_normal(2)).tolist()
    height, factor = beds(sizes, stroke.random)
    height += session_cm(sizes, random_numbers(stroke.seed, "", 4))
    rod = 1 + sizes.get("tare-bed", 0.0) / 100 if stroke.run.kind == "rod" else 1.0
    return Bed((z, x), float(factor[0]), float(height[0]), sizes.get("power", 1.0), rod)


def laws_in(bed, run, config):
    """Laws of a run in a bed.

    Published curves of legs and natural sands are multiplied by what the bed makes of a straight
    push; a leg's also by what the surface makes of the square of its greatest depth.
    """

    def alpha(pushed, phase):
        alpha_z, alpha_x = published_alpha(pushed, phase)
        return alpha_z + bed.off[0], alpha_x + bed.off[1]

    granular, rod = published_laws(run, config, alpha)
    if rod:
        rod = scaled(below(rod, bed.surface_cm), lambda _: bed.rod)
    if not granular:
        return None, rod
    factor, intruder = bed.factor, config.intruders[run.intruder]
    if isinstance(intruder, Leg) or run.natural:
        factor *= 1 + bed.off[0] / push_alpha(run)
    else:
        _, half_z = half_extents(plate_of(config.intruders)[1], run.beta_deg or 0.0)
        granular = scaled(granular, lambda z: bent(submerged_depth(-z, half_z), bed.power))
    if isinstance(intruder, Leg):
        deepest = intruder.max_length_cm - intruder.hip_height_cm
        factor *= (1 + bed.surface_cm / deepest) ** 2 if deepest > 0 else 1.0
    else:
        granular = below(granular, bed.surface_cm)
    return scaled(granular, lambda _: factor), rod


def scaled(law, factor):
    """Multiply a law by a factor that depends on z, cm."""

    def scaled_law(segment, x, z, angle):
        force_z, force_x = law(segment, x, z, angle)
        times = factor(z)
        return times * force_z, times * force_x

    return scaled_law


def below(law, surface_cm):
    """Put a law into a bed whose surface is higher by `surface_cm`."""
    return lambda segment, x, z, angle: law(segment, x, z - surface_cm, angle)


def bent(depth_cm, power):
    """Factor of a force that is proportional to depth where stress goes as a power of depth."""
    equivalent_cm = power_law(depth_cm, power)
    return np.divide(equivalent_cm, depth_cm, out=np.ones_like(depth_cm), where=depth_cm > 0)


def push_alpha(run):
    """alpha_z of a straight push, N/cm^3: Table S5; of a natural sand, first centimetre of Fig. S11."""
    if run.natural:
        return float(sand_stress(run.published, np.array([1.0]))[0])
    return published_alpha(run, "approach")[0]


@dataclass(frozen=True)
class DisturbedLab(Lab):
    """A lab with all disturbances but `turn`, which is an error of the config (`turned_mount`).

    `spread`: As of `bed_of`. Purposes 3 to 8 of random numbers are used.
    """

    sizes: Sizes
    spread: float = 0.0

    def forces(self, stroke, parts, phase_s):
        """Noise-free forces in the bed of a stroke, uneven along its path and late."""
        run, config = stroke.run, stroke.config
        bed = bed_of(stroke, self.sizes, self.spread)
        true = ideal(run, config, parts, phase_s, laws_in(bed, run, config))
        way = path_cm(true.motion, config.intruders[run.intruder])
        uneven = np.array(true.granular) * unevenness(self.sizes, stroke.random, way)
        samples = 100 * self.sizes.get("lag", 0.0)  # of a second
        forces = (delayed(np.array(force), samples) for force in (uneven, true.rod, true.steady))
        granular, rod, steady = ((force[0], force[1]) for force in forces)
        return replace(true, granular=granular, rod=rod, steady=steady)

    def noise_N(self, stroke, count):
        """Noise of the sensor, and 1/f noise."""
        noise = super().noise_N(stroke, count)
        if not self.sizes.get("pink"):
            return noise
        return noise + self.sizes["pink"] * pink(stroke.random(6), 3, count).T


def turned_mount(config, sizes):
    """Config of a lab whose mount is turned by more than its own config says."""
    sensor = config.transducer
    turn_deg = sensor.turn_deg + sizes.get("turn", 0.0)
    sensor = sensor.model_copy(update={"turn_deg": turn_deg})
    return config.model_copy(update={"transducer": sensor})


def prepare_disturbed(config, sizes, spread=0.0, **options):
    """Prepare a re-enactment with disturbances: `options` of `prepare`.

    Each disturbance has its own random numbers: two re-enactments with the same seed differ by the
    disturbance only. Run sheet and marker name the sizes.
    """
    lab = DisturbedLab(sizes, spread)
    plain = prepare(turned_mount(config, sizes), lab=lab, **options)
    made_by, runs = plain.made_by, plain.runs
    if spread:
        made_by += f", run-to-run spread: {spread:g} N/cm^3"
    if sizes:
        words = f"disturbed: {described(sizes)}"
        made_by += f", {words}"
        runs = tuple(replace(run, note=f"{run.note}; {words}") for run in runs)
    return replace(plain, runs=runs, made_by=made_by)


def reenact_disturbed(config, raw, sheet, sizes, spread=0.0, **options):
    """Prepare and write a re-enactment with disturbances: `options` of `prepare`."""
    return prepare_disturbed(config, sizes, spread, **options).write(raw, sheet)


def disturbed_logs(run, config, seed, sizes, **options):
    """Make the logs of a run with disturbances: `options` of `run_logs`."""
    lab = DisturbedLab(sizes)
    return run_logs(run, turned_mount(config, sizes), seed, lab=lab, **options)


# --- The demonstration's configuration, changed or not, and campaigns with it in folders --------------------------

PROJECT = Path(__file__).resolve().parents[2]


def paper_values(*without):
    """Values of the demonstration's config, to be changed, without some sections."""
    values = yaml.safe_load((PROJECT / "config" / "config.yaml").read_text(encoding="utf-8"))
    return {name: section for name, section in values.items() if name not in without}


def paper_config(**changes):
    """The demonstration's config, some sections of it changed."""
    return Config.model_validate(paper_values()).model_copy(update=changes)


def enact(root, values, sizes=NOTHING, **options):
    """Write a config, and the logs and run sheet that the re-enacted lab makes of it; the config's path.

    `sizes`: Of disturbances.
    """
    path, raw = root / "config" / "config.yaml", root / "raw" / "paper"
    write_yaml(path, values)
    config = Config.model_validate(values)
    if sizes:
        reenact_disturbed(config, raw, raw / "runs.csv", sizes, **options)
    else:
        prepare(config, **options).write(raw, raw / "runs.csv")
    return path


# --- Maps and the model's error from few draws, where a test is not about their intervals -------------------------

MODULES = posterior, prediction
COUNT = 200


@contextlib.contextmanager
def few_draws():
    """Make a fifth of the draws of maps and of the model's own error."""
    with contextlib.ExitStack() as stack:
        for module in MODULES:
            stack.enter_context(patch.object(module, "DRAWS", COUNT))
        yield
