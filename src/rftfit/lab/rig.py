"""What the rig adds to the granular force, and what its two loggers see."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rftfit.lab.contact import felt
from rftfit.lab.path import FloatArray, Motion, duration, motion_at, segments
from rftfit.lab.rod import rod_law
from rftfit.lab.truth import granular_law

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.campaign.config import Config
    from rftfit.lab.contact import Forces
    from rftfit.lab.plan import Run

FORCE_HZ, MOTION_HZ = 100, 50
STEP_N = 1 / 160
DAYLIGHT_SAVING = frozenset({"glass3mm_CP"})
"""Published media whose arm controller was left an hour behind when the clocks changed."""

_CORRELATION = 0.7
_DRIFT_PPM = 30.0
_POSITION_SD_MM, _ANGLE_SD_DEG = 0.003, 0.02
_ROD_WEIGHT_N, _PLATE_WEIGHT_N, _LEG_WEIGHT_N = 2.4, 0.17, 1.1


@dataclass(frozen=True)
class Nuisance:
    """What differs from run to run for no reason of physics.

    Attributes
    ----------
    start_s : float
        Start of the run on the force log's clock, s since midnight.
    motion_offset_s : float
        What the motion log's clock shows at the start, less `start_s`.
    motion_phase_s, force_phase_s : float
        First sample after the start: the samplers of the two logs know nothing of each other.
    bias_N : numpy.ndarray, shape (3,)
        Of the channels F1, F2, F3.
    drift_N_per_min : numpy.ndarray, shape (3,)
        Along x, y, z of the lab.
    side_N : float
        Steady force along y of the lab.
    """

    start_s: float
    motion_offset_s: float
    motion_phase_s: float
    force_phase_s: float
    bias_N: FloatArray
    drift_N_per_min: FloatArray
    side_N: float


@dataclass(frozen=True)
class Ideal:
    """Noise-free force on the sensor at the n samples of the force log.

    Attributes
    ----------
    motion : Motion
    granular, rod, steady : Forces
        (z, x) in the lab frame, N, each of shape (n,): of the medium on the intruder, of the
        medium on rod and mount, of weights and a leg's cable.
    """

    motion: Motion
    granular: Forces
    rod: Forces
    steady: Forces


@dataclass(frozen=True)
class Recording:
    """The two logs of a run as numbers: n force samples and m motion samples.

    Attributes
    ----------
    force_time_s : numpy.ndarray, shape (n,)
        On the force log's clock, since midnight.
    arm_moving : numpy.ndarray of int, shape (n,)
        1 while the arm moves, else 0.
    channels_N : numpy.ndarray, shape (n, 3)
        F1, F2, F3.
    stroke : numpy.ndarray of bool, shape (n,)
        Force samples taken during the stroke; not in the log.
    motion_time_s : numpy.ndarray, shape (m,)
        On the arm controller's clock, since midnight.
    x_mm, z_mm : numpy.ndarray, shape (m,)
        Reference point of the intruder in arm coordinates.
    angle_deg : numpy.ndarray, shape (m,)
        beta of a plate, theta of a leg.
    """

    force_time_s: FloatArray
    arm_moving: npt.NDArray[np.int64]
    channels_N: FloatArray
    stroke: npt.NDArray[np.bool_]
    motion_time_s: FloatArray
    x_mm: FloatArray
    z_mm: FloatArray
    angle_deg: FloatArray


def _stream(seed: int, run_id: str, purpose: int) -> np.random.Generator:
    """Random numbers of one run: the same whatever runs are written, where and in what order."""
    digest = np.frombuffer(hashlib.sha256(run_id.encode()).digest(), dtype="<u4")
    return np.random.default_rng([seed, purpose, *(int(word) for word in digest)])


def nuisance(run: Run, seed: int) -> Nuisance:
    """Draw bias, drift and clocks of a run.

    Parameters
    ----------
    run : Run
    seed : int

    Returns
    -------
    Nuisance
    """
    random = _stream(seed, run.run_id, 0)
    late = 3600.0 if run.published in DAYLIGHT_SAVING else 0.0
    return Nuisance(
        start_s=round(run.clock_s + random.uniform(0, 60), 3),
        motion_offset_s=random.uniform(-0.4, 0.4) - late,
        motion_phase_s=random.uniform(0, 0.1),
        bias_N=np.clip(random.normal(0, 1.5, 3), -4, 4),
        drift_N_per_min=random.uniform(-0.02, 0.02, 3),
        side_N=random.uniform(-0.1, 0.1),
        force_phase_s=round(random.uniform(0, 1 / FORCE_HZ), 3),
    )


def cable(run: Run, angle_deg: FloatArray) -> Forces:
    """Force of a leg's cable and gears against theta, the same in air and in a medium, N.

    Parameters
    ----------
    run : Run
    angle_deg : numpy.ndarray

    Returns
    -------
    force_z, force_x : numpy.ndarray
    """
    theta = np.radians(angle_deg)
    size = {"c_leg": 1.0, "flat_leg": 0.8}.get(run.leg, 1.15)
    force_z = size * (0.15 * np.sin(theta + 0.4) + 0.06 * np.sin(2 * theta))
    force_x = size * (0.12 * np.cos(theta - 0.3) + 0.05 * np.cos(2 * theta))
    return force_z, force_x


def bed_of(run: Run, seed: int, spread: float) -> tuple[float, float]:
    """Draw what alpha of a run's bed is off by: no bed is prepared twice alike.

    Parameters
    ----------
    run : Run
    seed : int
    spread : float
        Standard deviation, N/cm^3.

    Returns
    -------
    alpha_z, alpha_x : float
        N/cm^3.
    """
    off = spread * _stream(seed, run.run_id, 3).standard_normal(2)
    return float(off[0]), float(off[1])


def ideal(
    run: Run,
    config: Config,
    raised: bool = False,
    phase_s: float = 0.0,
    bed: tuple[float, float] = (0.0, 0.0),
) -> Ideal:
    """Noise-free forces of a run at the force log's sample times.

    Parameters
    ----------
    run : Run
    config : Config
    raised : bool
        The whole path stays above the surface.
    phase_s : float
        Time of the first sample after the start, s.
    bed : (float, float)
        What alpha_z and alpha_x of its bed are off by, N/cm^3.

    Returns
    -------
    Ideal
        `granular` on the intruder, `rod` on rod and mount, `steady` weights and cable.
    """
    parts = segments(run, config, raised)
    count = int((duration(parts) - phase_s) * FORCE_HZ) + 1
    motion = motion_at(parts, phase_s + np.arange(count) / FORCE_HZ)
    nothing = np.zeros(count)
    level = run.direction == "horizontal"
    law = granular_law(run, config, bed)
    granular = felt(law, parts, motion, level) if law else (nothing, nothing)
    if run.leg:
        rod = (nothing, nothing)
        force_z, force_x = cable(run, motion.angle_deg)
        return Ideal(motion, granular, rod, (force_z - _LEG_WEIGHT_N, force_x))
    weight = _ROD_WEIGHT_N + (_PLATE_WEIGHT_N if run.kind == "plate" else 0.0)
    return Ideal(
        motion, granular, felt(rod_law(run), parts, motion, level), (nothing - weight, nothing)
    )


def to_channels(
    force_x: FloatArray, force_y: FloatArray, force_z: FloatArray, config: Config
) -> FloatArray:
    """Turn a force in the lab frame into the sensor's channels F1, F2, F3.

    The inverse of ``force_x = sx cos t + sz sin t``, ``force_z = -sx sin t + sz cos t`` with s the
    force along the axes of the mount.

    Parameters
    ----------
    force_x, force_y, force_z : numpy.ndarray, shape (n,)
    config : Config

    Returns
    -------
    numpy.ndarray, shape (n, 3)
    """
    turn = math.radians(config.transducer.turn_deg)
    mount = {
        "x": force_x * math.cos(turn) - force_z * math.sin(turn),
        "y": force_y,
        "z": force_x * math.sin(turn) + force_z * math.cos(turn),
    }
    channels = np.empty((force_x.size, 3))
    for axis, along in mount.items():
        name: str = getattr(config.transducer.axes, axis)
        channels[:, int(name[2]) - 1] = -along if name[0] == "-" else along
    return channels


def _noise(random: np.random.Generator, count: int, deviation: float) -> FloatArray:
    """Noise (n, 3) with the correlation of a first-order process from sample to sample."""
    memory = _CORRELATION ** np.arange(40)
    white = random.normal(0, deviation * math.sqrt(1 - _CORRELATION**2), (count + 39, 3))
    columns = [np.convolve(white[:, axis], memory, mode="valid") for axis in range(3)]
    return np.column_stack(columns)


def record(
    run: Run, config: Config, seed: int, raised: bool = False, spread: float = 0.0
) -> Recording:
    """Record a run the way the rig does.

    Parameters
    ----------
    run : Run
    config : Config
    seed : int
    raised : bool
        The whole path stays above the surface.
    spread : float
        Standard deviation of alpha from one prepared bed to the next, N/cm^3.

    Returns
    -------
    Recording
    """
    odd = nuisance(run, seed)
    true = ideal(run, config, raised, odd.force_phase_s, bed_of(run, seed, spread))
    motion = true.motion
    count = motion.elapsed_s.size
    drift = odd.drift_N_per_min * (np.arange(count) / FORCE_HZ / 60)[:, None]
    force_z = true.granular[0] + true.rod[0] + true.steady[0] + drift[:, 2]
    force_x = true.granular[1] + true.rod[1] + true.steady[1] + drift[:, 0]
    channels = to_channels(force_x, odd.side_N + drift[:, 1], force_z, config) + odd.bias_N
    channels += _noise(_stream(seed, run.run_id, 1), count, config.transducer.precision_N)
    limit = np.array(config.transducer.range_N)
    channels = np.clip(np.round(channels / STEP_N) * STEP_N, -limit, limit)

    # the motion log: same run, other clock; e is s since the start on the force log's clock
    parts = segments(run, config, raised)
    rate = 1 + _DRIFT_PPM * 1e-6
    begin = odd.start_s + odd.motion_offset_s
    ticks = int((duration(parts) - odd.motion_phase_s) * MOTION_HZ)
    clock = np.round(begin + odd.motion_phase_s, 3) + np.arange(ticks) / MOTION_HZ
    arm = motion_at(parts, (clock - begin) / rate)
    random = _stream(seed, run.run_id, 2)
    wobble = random.normal(0, 1, (3, ticks))
    stroke = np.array([part.phase == "stroke" for part in parts])
    return Recording(
        force_time_s=odd.start_s + odd.force_phase_s + np.arange(count) / FORCE_HZ,
        arm_moving=motion.moving.astype(np.int64),
        channels_N=channels,
        stroke=stroke[motion.segment],
        motion_time_s=clock,
        x_mm=10 * arm.x_cm + _POSITION_SD_MM * wobble[0],
        z_mm=config.arm.surface_z_mm + 10 * arm.z_cm + _POSITION_SD_MM * wobble[1],
        angle_deg=arm.angle_deg + _ANGLE_SD_DEG * wobble[2],
    )
