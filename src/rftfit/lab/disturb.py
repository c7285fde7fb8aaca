"""Disturbances of a real laboratory, each with a size; `rftfit reenact --disturb` puts them into logs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from rftfit.campaign.config import AnyPlate, Leg
from rftfit.campaign.problems import Place, Problem, did_you_mean, listed
from rftfit.campaign.rows import number_of
from rftfit.errors import InputError
from rftfit.lab.plan import ArmMotion, FloatArray

Sizes = Mapping[str, float]
"""Size by name of the disturbance; one that is not there has no effect."""

Stream = Callable[[int], np.random.Generator]
"""Random numbers by purpose."""

NOTHING: Sizes = MappingProxyType({})


@dataclass(frozen=True)
class Disturbance:
    """What `--disturb NAME=SIZE` changes: a default size, what it means, and why that is ordinary.

    `nothing`: The size without an effect.
    """

    size: float
    unit: str
    what: str
    why: str
    most: float
    least: float = 0.0
    nothing: float = 0.0


REAL_LAB = "real-lab"
NORMAL_DEPTH_CM = 5.0
"""With `power`, the stress at this depth is that of the table."""

PATCH_CM, SLIP_CM = 2.0, 0.1

DISTURBANCES: dict[str, Disturbance] = {
    "surface": Disturbance(
        1.0,
        "mm",
        "standard deviation of the height of the free surface, drawn for each run",
        "a bed is levelled by a blade or by eye to about a grain or two",
        20,
    ),
    "surface-session": Disturbance(
        1.0,
        "mm",
        "standard deviation of an error of the surface that all runs of the campaign share",
        "the arm's zero is found once, by lowering the plate until it seems to touch",
        20,
    ),
    "lag": Disturbance(
        0.05,
        "s",
        "delay of all force channels behind the sync line, in every run",
        "the low-pass filter of a transducer's amplifier, 3 to 10 Hz, delays by 20 to 50 ms",
        2,
    ),
    "spread-percent": Disturbance(
        5.0,
        "%",
        "standard deviation of a factor of the granular force, drawn for each run, common to "
        "alpha_z and alpha_x",
        "beds poured or tapped by hand; the paper's fluidised beds differ by 1 to 5 % (0.005 N/cm^3)",
        50,
    ),
    "pink": Disturbance(
        0.05,
        "N",
        "standard deviation of 1/f noise within 41 s, of each channel",
        "as large as the demonstration transducer's precision; bridges and amplifiers drift with temperature",
        10,
    ),
    "patches": Disturbance(
        3.0,
        "%",
        "standard deviation of the granular force along the path, in patches of 2 cm",
        "compaction that differs by 0.2 % in volume fraction changes the force by a few percent",
        50,
    ),
    "deep-noise": Disturbance(
        2.0,
        "%",
        "standard deviation of stick-slip of 1 mm, of the granular force",
        "grains give way in steps; the force fluctuates by a few percent of itself",
        50,
    ),
    "power": Disturbance(
        1.1,
        "",
        "exponent p of the stress of plates, depth^p, that of the table at 5 cm",
        "penetration tests of dry granular media are fitted with exponents of 1.0 to 1.3",
        3,
        0.3,
        1.0,
    ),
    "tare-bed": Disturbance(
        10.0,
        "%",
        "by how much the force on the rod alone is larger than that on the rod of plate runs",
        "rod runs are made on another day, in beds prepared by somebody else",
        500,
        -100,
    ),
    "turn": Disturbance(
        1.0,
        "deg",
        "angle by which the mount is turned more than the config says",
        "1 degree is 0.9 mm across a flange of 5 cm, which an eye does not see",
        45,
        -45,
    ),
}


def sizes_of(asked: Sequence[str]) -> dict[str, float]:
    """Read disturbances asked for as ``NAME`` or ``NAME=SIZE``, in the order of `DISTURBANCES`.

    `REAL_LAB` is all of them at their default sizes; sizes that are stated replace those.
    """
    found: dict[str, float] = {}
    for text in asked:
        name, equals, size = text.partition("=")
        if name == REAL_LAB and not equals:
            continue
        if name not in DISTURBANCES:
            known = [f"{key}={one.size:g} {one.unit}".strip() for key, one in DISTURBANCES.items()]
            near = did_you_mean(name, [*DISTURBANCES, REAL_LAB])
            every = listed([*known, f"{REAL_LAB} (all of these sizes)"])
            raise InputError(str(Problem("word.unknown", Place("--disturb"), text, every, near)))
        found[name] = _size(name, size) if equals else DISTURBANCES[name].size
    everything = {name: one.size for name, one in DISTURBANCES.items() if REAL_LAB in asked}
    found = everything | found
    return {name: found[name] for name in DISTURBANCES if name in found}


def _size(name: str, text: str) -> float:
    one = DISTURBANCES[name]
    size = number_of(text)
    if not one.least <= size <= one.most:
        allowed = f"a number from {one.least:g} to {one.most:g} {one.unit}".strip()
        place = Place(f"--disturb {name}")
        raise InputError(str(Problem("number.range", place, text, f"{allowed} ({one.what})")))
    return size


def described(sizes: Sizes) -> str:
    """List disturbances with their sizes and units."""
    return ", ".join(f"{n}={size:g} {DISTURBANCES[n].unit}".strip() for n, size in sizes.items())


@dataclass(frozen=True)
class Bed:
    """What the bed of a run differs by from the published one.

    `off`: Of alpha_z and alpha_x, N/cm^3. `factor`, `rod`: Of the granular force, and of that on rod
    and mount. `surface_cm`: Above the nominal one. `power`: Of the depth in the stress of plates.
    """

    off: tuple[float, float] = (0.0, 0.0)
    factor: float = 1.0
    surface_cm: float = 0.0
    power: float = 1.0
    rod: float = 1.0


AS_PUBLISHED = Bed()


def session_cm(sizes: Sizes, random: np.random.Generator, campaigns: int = 1) -> FloatArray:
    """Draw the error of the surface that all runs of a campaign share, cm."""
    return sizes.get("surface-session", 0.0) / 10 * random.standard_normal(campaigns)


def beds(sizes: Sizes, stream: Stream, campaigns: int = 1) -> tuple[FloatArray, FloatArray]:
    """Draw height of the surface, cm, and factor of the force of one run, each of shape (campaigns,)."""
    height = sizes.get("surface", 0.0) / 10 * stream(4).standard_normal(campaigns)
    factor = 1 + sizes.get("spread-percent", 0.0) / 100 * stream(5).standard_normal(campaigns)
    return height, factor


def unevenness(
    sizes: Sizes, stream: Stream, travel_cm: FloatArray, campaigns: int = 1
) -> FloatArray:
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


def along_path(
    random: np.random.Generator, rows: int, travel_cm: FloatArray, length_cm: float
) -> FloatArray:
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


def pink(random: np.random.Generator, rows: int, count: int) -> FloatArray:
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


def power_law(depth_cm: FloatArray, power: float) -> FloatArray:
    """Depth that takes the place of |z| in alpha |z| where stress goes as depth^power, cm."""
    if power == 1:
        return depth_cm
    return np.asarray(NORMAL_DEPTH_CM * (np.maximum(depth_cm, 0) / NORMAL_DEPTH_CM) ** power)


def turned(
    force_z: FloatArray, force_x: FloatArray, degrees: float
) -> tuple[FloatArray, FloatArray]:
    """Force (z, x) as it is found where the mount is turned by so much more than the config says."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return force_x * s + force_z * c, force_x * c - force_z * s


def path_cm(motion: ArmMotion, intruder: AnyPlate | Leg) -> FloatArray:
    """Length of the way of a plate's centre or a leg's tip, shape (n,)."""
    steps = np.hypot(np.diff(motion.x_cm), np.diff(motion.z_cm))
    if isinstance(intruder, Leg):
        steps += intruder.max_length_cm * np.radians(np.abs(np.diff(motion.angle_deg)))
    return np.append(0.0, np.cumsum(steps))


def delayed(force: FloatArray, samples: float) -> FloatArray:
    """Forces, shape (2, n), so many samples ago; before the first, that."""
    at = np.arange(force.shape[1], dtype=float)
    return np.array([np.interp(at - samples, at, row) for row in force])
