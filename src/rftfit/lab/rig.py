"""The rig of the re-enacted lab: weights, drift, noise and clocks of its logs, and faults that are put in on purpose.

`record` makes the `Recording` of one stroke: `ideal` calculates its noise-free forces, `nuisance` draws what differs
from run to run (clocks, bias, drift), `Lab` the noise. `FAULTS` lists faults, which `damage_recording` and
`damage_bytes` put in.

Forces in the lab frame are (z, x), N; channels are F1, F2, F3, N, the columns of arrays of shape (n, 3). All random
numbers come from the seed, the run and a *purpose* (a number: 0 nuisance, 1 noise of the force, 2 noise of the
position).
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rftfit.campaign.config import Config, Transducer
from rftfit.campaign.problems import choose
from rftfit.errors import InputError
from rftfit.lab.plan import (
    ArmMotion,
    BoolArray,
    FloatArray,
    PlannedRun,
    Segment,
    duration,
    motion_at,
    segments,
)
from rftfit.lab.truth import (
    Alpha,
    Forces,
    Law,
    force_over_run,
    granular_law,
    published_alpha,
    rod_law,
)
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `lab/chosen.toml`, table `rig`, says what each decides
_CHOSEN = chosen("lab", "rig")

FORCE_HZ: int = _CHOSEN.force_hz
MOTION_HZ: int = _CHOSEN.motion_hz
"""Samples per second of the two logs."""


@dataclass(frozen=True)
class Nuisance:
    """Random properties of a run that have no physical cause in the medium.

    `start_s`: Start of the run on the clock of the force log, s since midnight.
    `motion_offset_s`: Time of the motion log's clock minus that of the force log's clock.
    `motion_phase_s`, `force_phase_s`: Time from the start to the first sample of each log.
    `bias_N`: Readings of the channels F1, F2, F3 without load.
    `drift_N_per_min`: Drift along x, y, z of the lab, shape (3,).
    `side_N`: Steady force along y of the lab, which the two-dimensional analysis must not use.
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
    """Noise-free forces (z, x) at the n samples of the force log, N, in the lab frame.

    `motion`: Where the intruder is at these samples.
    `granular`: Force of the medium on the intruder. `rod`: Force of the medium on rod and mount.
    `steady`: Weights, and the force of a leg's cable.
    """

    motion: ArmMotion
    granular: Forces
    rod: Forces
    steady: Forces


@dataclass(frozen=True)
class Recording:
    """The two logs of a run as numbers: n force samples and m motion samples, times since midnight.

    `arm_moving`: 1 while the arm moves, else 0, shape (n,).
    `channels_N`: F1, F2, F3, shape (n, 3).
    `x_mm`, `z_mm`: Reference point of the intruder in arm coordinates, shape (m,).
    `angle_deg`: Beta of a plate, theta of a leg, shape (m,).
    `motion_ahead_s`: Time of the arm controller's clock minus that of the force log's clock, shape (m,); not in the
    logs.
    `stroke`, `in_air`: True for force samples in the stroke, or at rest in air, shape (n,); not in the logs.
    `motion_stroke`: True for motion samples in the stroke, shape (m,); not in the logs.
    """

    force_time_s: FloatArray
    arm_moving: npt.NDArray[np.int64]
    channels_N: FloatArray
    stroke: BoolArray
    motion_time_s: FloatArray
    x_mm: FloatArray
    z_mm: FloatArray
    angle_deg: FloatArray
    in_air: BoolArray
    motion_stroke: BoolArray
    motion_ahead_s: FloatArray

    def rows(self, force: npt.ArrayLike, motion: npt.ArrayLike | slice = slice(None)) -> Recording:
        """Return the recording with some rows of the force log and of the motion log, by indices or by a mask each."""
        of_force = ("force_time_s", "arm_moving", "channels_N", "stroke", "in_air")
        columns = {
            name: column[force if name in of_force else motion]
            for name, column in vars(self).items()
        }
        return Recording(**columns)


def random_numbers(seed: int, run_id: str, purpose: int) -> np.random.Generator:
    """Make the random numbers of one run, which do not depend on other runs or on their order.

    `purpose`: Number of what they are drawn for; different purposes have independent numbers.
    """
    digest = np.frombuffer(hashlib.sha256(run_id.encode()).digest(), dtype="<u4")
    return np.random.default_rng([seed, purpose, *(int(word) for word in digest)])


@dataclass(frozen=True)
class LabStroke:
    """One stroke of a run in a campaign, by its `config`, with the random numbers of a `seed`.

    `cycle`: Number of the stroke, from 0, if one log has several; each goes into a bed prepared anew.
    """

    run: PlannedRun
    config: Config
    seed: int
    cycle: int = 0

    def random(self, purpose: int) -> np.random.Generator:
        """Make the random numbers for a purpose, a number from 0 to 9."""
        return random_numbers(self.seed, self.run.run_id, purpose + 10 * self.cycle)


DAYLIGHT_SAVING = frozenset({"glass3mm_CP"})
"""Published media whose arm controller was left an hour behind when the clocks changed."""


def nuisance(run: PlannedRun, seed: int) -> Nuisance:
    """Draw bias, drift and clocks of a run; the same seed draws the same."""
    random = random_numbers(seed, run.run_id, 0)
    behind_s = 3600.0 if run.published in DAYLIGHT_SAVING else 0.0
    return Nuisance(
        start_s=round(run.clock_s + random.uniform(0, 60), 3),
        motion_offset_s=random.uniform(-0.4, 0.4) - behind_s,
        motion_phase_s=random.uniform(0, 0.1),
        bias_N=np.clip(random.normal(0, 1.5, 3), -4, 4),
        drift_N_per_min=random.uniform(-0.02, 0.02, 3),
        side_N=random.uniform(-0.1, 0.1),
        force_phase_s=round(random.uniform(0, 1 / FORCE_HZ), 3),
    )


def cable(run: PlannedRun, angle_deg: FloatArray) -> Forces:
    """Return the force (z, x) of a leg's cable and gears, N, shape (n,), the same in air and in a medium.

    It is made up, so that the tare of a leg in air has something to subtract. `angle_deg`: theta, shape (n,).
    """
    theta = np.radians(angle_deg)
    size = {"c_leg": 1.0, "flat_leg": 0.8}.get(run.leg, 1.15)
    force_z = size * (0.15 * np.sin(theta + 0.4) + 0.06 * np.sin(2 * theta))
    force_x = size * (0.12 * np.cos(theta - 0.3) + 0.05 * np.cos(2 * theta))
    return force_z, force_x


Laws = tuple[Law | None, Law | None]
"""Laws of the force of the medium on the intruder, and on rod and mount; None where the medium does not touch them."""


def published_laws(run: PlannedRun, config: Config, alpha: Alpha = published_alpha) -> Laws:
    """Return the laws of the force on intruder and on rod, in the published bed; a leg has no rod in the medium.

    `alpha`: Stress per depth of plates in a laboratory medium; default: Table S5.
    """
    return granular_law(run, config, alpha), None if run.leg else rod_law(run)


def ideal(
    run: PlannedRun,
    config: Config,
    parts: tuple[Segment, ...] = (),
    phase_s: float = 0.0,
    laws: Laws | None = None,
) -> Ideal:
    """Calculate the noise-free forces of a run at the sample times of the force log.

    `parts`: Rests and moves of the run; default: those of `segments`.
    `phase_s`: Time from the start of the run to the first sample.
    `laws`: Laws of the force; default: the published ones.
    """
    parts = parts or segments(run, config)
    count = int((duration(parts) - phase_s) * FORCE_HZ) + 1
    motion = motion_at(parts, phase_s + np.arange(count) / FORCE_HZ)
    nothing = np.zeros(count)
    level = run.direction == "horizontal"
    granular, rod = (
        force_over_run(law, parts, motion, level) if law else (nothing, nothing)
        for law in laws or published_laws(run, config)
    )
    if run.leg:
        force_z, force_x = cable(run, motion.angle_deg)
        return Ideal(motion, granular, rod, (force_z - _CHOSEN.leg_weight_n, force_x))
    weight = _CHOSEN.rod_weight_n + (_CHOSEN.plate_weight_n if run.kind == "plate" else 0.0)
    return Ideal(motion, granular, rod, (nothing - weight, nothing))


def to_channels(
    force_x: FloatArray, force_y: FloatArray, force_z: FloatArray, transducer: Transducer
) -> FloatArray:
    """Turn a force in the lab frame into the channels F1, F2, F3, shape (n, 3).

    This is the inverse of ``force_x = sx cos t + sz sin t``, ``force_z = -sx sin t + sz cos t``, where s is the force
    along the axes of the mount and t is the turn of the mount.
    """
    turn = math.radians(transducer.turn_deg)
    mount = {
        "x": force_x * math.cos(turn) - force_z * math.sin(turn),
        "y": force_y,
        "z": force_x * math.sin(turn) + force_z * math.cos(turn),
    }
    channels = np.empty((force_x.size, 3))
    for axis, along in mount.items():
        name: str = getattr(transducer.axes, axis)  # a sign and a channel, as "-F3"
        channels[:, int(name[2]) - 1] = -along if name[0] == "-" else along
    return channels


def _draw_noise(random: np.random.Generator, count: int, deviation: float) -> FloatArray:
    """Draw noise, shape (count, 3), with the standard deviation `deviation`, correlated by a first-order process.

    Each value is ``correlation`` times the one before plus white noise; after 40 values nothing of that is left.
    """
    memory = _CHOSEN.correlation ** np.arange(40)
    white = random.normal(0, deviation * math.sqrt(1 - _CHOSEN.correlation**2), (count + 39, 3))
    columns = [np.convolve(white[:, axis], memory, mode="valid") for axis in range(3)]
    return np.column_stack(columns)


class Lab:
    """The lab of the published measurements: its beds, and the noise of its sensor.

    `rftfit.lab.enact.prepare` accepts another lab that is derived from this one; the tests have labs with the errors of
    a real lab. Such a lab draws its random numbers from `LabStroke.random` for purposes from 3 on.
    """

    def forces(self, stroke: LabStroke, parts: tuple[Segment, ...], phase_s: float) -> Ideal:
        """Calculate the noise-free forces of a stroke; `parts`, `phase_s`: see `ideal`."""
        return ideal(stroke.run, stroke.config, parts, phase_s)

    def noise_N(self, stroke: LabStroke, count: int) -> FloatArray:
        """Draw the noise of F1, F2 and F3, N, shape (count, 3)."""
        return _draw_noise(stroke.random(1), count, stroke.config.transducer.precision_N)


AS_PUBLISHED = Lab()


STEP_N: float = _CHOSEN.step_n
"""Step of a reading of the transducer."""


def _make_channels(
    true: Ideal, drawn: Nuisance, noise_N: FloatArray, sensor: Transducer
) -> FloatArray:
    """Add forces, drift, bias and noise to the readings of F1, F2, F3, N, shape (n, 3), in steps of the sensor.

    `true`: Noise-free forces. `drawn`: Bias and drift of the run. `noise_N`: Shape (n, 3). Readings end at the range.
    """
    drift = drawn.drift_N_per_min * (np.arange(len(noise_N)) / FORCE_HZ / 60)[:, None]
    force = np.array(true.granular) + np.array(true.rod) + np.array(true.steady)
    force_z, force_x = force + drift[:, [2, 0]].T
    channels = to_channels(force_x, drawn.side_N + drift[:, 1], force_z, sensor)
    channels = channels + drawn.bias_N + noise_N
    limit = np.array(sensor.range_N)
    return np.clip(np.round(channels / STEP_N) * STEP_N, -limit, limit)


def record(stroke: LabStroke, raised: bool, pause: bool, lab: Lab) -> Recording:
    """Record a stroke as the rig does: forces at 100 and positions at 50 samples a second, each on its own clock.

    `raised`, `pause`: see `segments`. `lab`: Whose forces and noise the recording has.
    """
    config = stroke.config
    drawn = nuisance(stroke.run, stroke.seed)
    parts = segments(stroke.run, config, raised, pause)
    true = lab.forces(stroke, parts, drawn.force_phase_s)
    motion = true.motion
    noise_N = lab.noise_N(stroke, motion.elapsed_s.size)
    channels = _make_channels(true, drawn, noise_N, config.transducer)
    # the motion log has another clock
    rate = 1 + _CHOSEN.drift_ppm * 1e-6
    begin = drawn.start_s + drawn.motion_offset_s
    ticks = int((duration(parts) - drawn.motion_phase_s) * MOTION_HZ)
    clock = np.round(begin + drawn.motion_phase_s, 3) + np.arange(ticks) / MOTION_HZ
    arm = motion_at(parts, (clock - begin) / rate)
    wobble = stroke.random(2).normal(0, 1, (3, ticks))
    in_stroke = np.array([segment.phase == "stroke" for segment in parts])
    # the intruder rests in air where it stands above the surface: a leg twice, a plate once
    in_air = np.array([segment.phase == "rest" and segment.start[1] > 0 for segment in parts])
    return Recording(
        force_time_s=drawn.start_s + drawn.force_phase_s + np.arange(len(channels)) / FORCE_HZ,
        arm_moving=motion.moving.astype(np.int64),
        channels_N=channels,
        stroke=in_stroke[motion.segment],
        motion_time_s=clock,
        x_mm=config.arm.middle_x_mm + 10 * arm.x_cm + _CHOSEN.position_sd_mm * wobble[0],
        z_mm=config.arm.surface_z_mm + 10 * arm.z_cm + _CHOSEN.position_sd_mm * wobble[1],
        angle_deg=arm.angle_deg + _CHOSEN.angle_sd_deg * wobble[2],
        in_air=in_air[motion.segment],
        motion_stroke=in_stroke[arm.segment],
        motion_ahead_s=clock - (drawn.start_s + (clock - begin) / rate),
    )


FAULTS: dict[str, tuple[str, str]] = {
    "gap": ("bp00_g90_in", "1.5 s in the middle of the stroke are missing from the force log"),
    "saturated": (
        "bp00_g72_in",
        "one second of the stroke is stuck at the range of the vertical channel",
    ),
    "missing_tare": (
        "bp30_g45_in",
        "both logs of the run's tare are missing; the sheet still names them",
    ),
    "truncated": ("bp30_g90_in", "the force log is cut off in mid-row, after about two thirds"),
    "wrong_unit": (
        "bm30_g90_in",
        "the force log is in lbf and says so, against the config (N where that has lbf)",
    ),
    "never_touches": ("bp00_g45_in", "the arm's path stays above the surface (plates and rods)"),
    "duplicated_rows": ("bp60_g45_in", "60 rows of the force log's stroke appear twice each"),
    "time_reversed": ("bp60_g56_in", "60 rows of the force log's stroke are in reverse order"),
    "nan_cells": (
        "bp60_g72_in",
        "every second of 60 rows of the stroke has nan in all force columns",
    ),
    "header_only": ("bm60_g34_in", "the force log ends after its header row"),
    "empty": ("bm60_g45_in", "the force log has no bytes"),
    "wrong_delimiter": ("bm60_g56_in", "the force log has semicolons and decimal commas"),
    "missing_log": ("bm60_g72_in", "the force log is missing; the sheet still names it"),
    "wrong_medium_tare": (
        "bp90_g45_in",
        "the sheet's tare_run is the same run's tare in another medium",
    ),
    "flipped_beta": (
        "bm30_g45_in",
        "the motion log shows -beta instead of beta (beta not 0 or 90 degrees)",
    ),
}
"""Faults by name: run that gets the fault if the user names none, and what the fault does.

The run is given without its medium, which is the first one; if that has no such run, its first plate run gets the
fault.
"""


@dataclass(frozen=True)
class Fault:
    """A fault of `FAULTS` in a run.

    `run_id`: Run for which the user asked it.
    `changed`: Run whose files or row the fault changes: for ``missing_tare`` that of the tare.
    `other_tare`: Wrong tare_run in the run sheet; empty for all other faults.
    """

    name: str
    run_id: str
    changed: str
    other_tare: str = ""

    def __str__(self) -> str:
        where = self.run_id if self.changed == self.run_id else f"{self.run_id} (in {self.changed})"
        return f"{self.name}: {where}: {FAULTS[self.name][1]}"


def _find_other_tare(run: PlannedRun, runs: Mapping[str, PlannedRun]) -> str:
    """Find the run_id of the tare of the same plate run in another medium, for the fault ``wrong_medium_tare``."""
    ending = run.tare_run.removeprefix(run.medium)
    for other_run in runs.values():
        if (
            run.kind == "plate"
            and other_run.medium != run.medium
            and other_run.run_id.endswith(ending)
        ):
            return other_run.run_id
    raise InputError(
        f"fault wrong_medium_tare: {run.run_id} has no tare of another medium among these runs; "
        "name a plate run and simulate at least two media of its kind"
    )


def resolve(asked: Sequence[str], runs: Mapping[str, PlannedRun], first_medium: str) -> list[Fault]:
    """Find the run of each fault in `asked`, which is written ``NAME`` or ``NAME:run_id``; refuse an impossible one.

    `runs`: All runs by run_id. `first_medium`: Medium of faults without a run.
    """
    faults = []
    for fault in asked:
        name, _, run_id = fault.partition(":")
        choose("fault", name, list(FAULTS))
        if not run_id:
            run_id = f"{first_medium}_{FAULTS[name][0]}"
            if run_id not in runs:
                plate_run_ids = (
                    run.run_id
                    for run in runs.values()
                    if run.medium == first_medium and run.kind == "plate"
                )
                run_id = next(plate_run_ids, run_id)
        choose(f"run for the fault {name}", run_id, list(runs))
        run = runs[run_id]
        if name == "flipped_beta" and run.beta_deg in (None, 0.0, 90.0):
            raise InputError(f"fault flipped_beta: {run_id} looks the same with -beta")
        if name == "never_touches" and run.leg:
            raise InputError(f"fault never_touches: {run_id} is a leg; name a plate or rod run")
        changed = (run.tare_run or run_id) if name == "missing_tare" else run_id
        other_tare = _find_other_tare(run, runs) if name == "wrong_medium_tare" else ""
        faults.append(Fault(name, run_id, changed, other_tare))
    return faults


def damage_recording(names: Sequence[str], whole: Recording, transducer: Transducer) -> Recording:
    """Apply the faults of a run that change its recording; other faults in `names` do nothing here.

    `whole`: The recording without faults. Most faults lie in the middle of the stroke.
    """
    first, last = np.flatnonzero(whole.stroke)[[0, -1]]
    # row in the middle of the stroke, and number of rows in a second
    middle, second = int(first + last) // 2, FORCE_HZ
    channels = whole.channels_N.copy()
    # rows of the force log to be kept, in their order
    rows = np.arange(len(channels))
    block = slice(middle, middle + _CHOSEN.rows)
    if "saturated" in names:
        column = int(transducer.axes.z[2]) - 1
        sign = -1 if transducer.axes.z[0] == "-" else 1
        channels[middle - second // 2 : middle + second // 2, column] = (
            sign * transducer.range_N[column]
        )
    if "nan_cells" in names:
        channels[block][::2] = np.nan
    if "time_reversed" in names:
        rows[block] = rows[block][::-1].copy()
    if "duplicated_rows" in names:
        rows = np.repeat(rows, np.where(np.isin(rows, rows[block]), 2, 1))
    if "gap" in names:
        rows = rows[(rows < middle - 3 * second // 4) | (rows >= middle + 3 * second // 4)]
    angle = -whole.angle_deg if "flipped_beta" in names else whole.angle_deg
    return replace(whole, channels_N=channels, angle_deg=angle).rows(rows)


def damage_bytes(names: Sequence[str], content: bytes, dialect: str) -> bytes | None:
    """Apply the faults of a run that change the bytes of its force log, `content`; None if a fault removes the file.

    `names`: Faults of the run; others do nothing here. `dialect`: Format of the log; some faults are made in one only.
    """
    if "missing_log" in names or "missing_tare" in names:
        return None
    if "empty" in names:
        return b""
    changed = [name for name in ("header_only", "truncated", "wrong_delimiter") if name in names]
    if not changed:
        return content
    if dialect != "rig":
        what = "is made in logs of the dialect rig only"
        raise InputError(f"fault {changed[0]}: {what}, not {dialect}")
    text = content.decode()
    comments = text[: text.index("time_s")]
    table = text[len(comments) :]
    if "header_only" in names:
        table = table[: table.index("\n") + 1]
    if "truncated" in names:
        # the cut falls four characters before a line's end
        table = table[: table.index("\n", 2 * len(table) // 3) - 4]
    if "wrong_delimiter" in names:
        table = table.replace(",", ";").replace(".", ",")
    return (comments + table).encode()
