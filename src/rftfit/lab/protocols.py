"""Protocols: other ways of recording a run than the paper's, with other parts of its logs or other files.

They show whether the analysis reads the logs of labs that record in these ways. `with_files` sets which files a run
has, `as_recorded` keeps the part of a whole recording that a protocol records, `in_one_log` joins strokes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rftfit.campaign.config import Config
from rftfit.errors import InputError
from rftfit.lab.plan import PlannedRun
from rftfit.lab.rig import Recording

PAPER = "paper"
PROTOCOLS = {
    PAPER: "rest in air, approach, pause at the surface, stroke, rest; two logs on two clocks",
    "no-pause": "the arm goes through the surface without a pause",
    "stroke-only": "nothing but the stroke, one clock, the transducer set to zero before",
    "separate-zero": "nothing but the stroke, one clock, and a log without load before it (zero_log)",
    "one-file": "force and motion in one file, on one clock",
    "cyclic": "three strokes in one file, each into a bed prepared anew (column stroke)",
    "constant-speed": "nothing but a push straight down at known speed, and no position",
}
"""Protocols by name, each with what it records."""

_SET_TO_ZERO = ("stroke-only", "constant-speed")
"""Protocols whose transducer was set to zero before."""

_CYCLES, _BETWEEN_S = 3, 5.0
"""Strokes in a log of the protocol ``cyclic``, and the time between two of them, s."""


def check_protocol(protocol: str, config: Config, runs: Sequence[PlannedRun]) -> None:
    """Refuse a protocol whose logs the config would not read, or that cannot record all runs.

    The message names the settings that the config needs.
    """
    missing = []
    if protocol not in (PAPER, "no-pause") and config.clock.method != "same_clock":
        missing.append("clock: {method: same_clock}")
    if protocol in _SET_TO_ZERO and config.zero.method != "stated":
        missing.append("zero: {method: stated, sd_N: 0.02}")
    if protocol == "constant-speed":
        unsuitable_runs = [
            run.run_id for run in runs if run.gamma_deg != 90 or run.direction != "intrusion"
        ]
        if unsuitable_runs:
            raise InputError(
                f"--protocol {protocol}: only pushes straight down have a position that is known from "
                f"their speed; found {len(unsuitable_runs)} others, such as {unsuitable_runs[0]}. Use --no-legs, --media and "
                "--grid '... x 90'"
            )
        z = config.motion_log.columns.get("z")
        if z is None or z.rate is None:
            surface, speed = config.arm.surface_z_mm, -10 * config.arm.speed_cm_per_s
            column = f"{{constant: {surface:g}, unit: mm, rate: {speed:g}}}"
            missing.append(f"motion_log: {{columns: {{time: time, z: {column}}}}}")
    if missing:
        raise InputError(
            f"--protocol {protocol}: the config would not read such logs; it needs: {'; '.join(missing)}"
        )


def as_recorded(recording: Recording, protocol: str) -> tuple[Recording, Recording | None]:
    """Return the part of a recording that a protocol keeps, and the log without load; None if the protocol has none."""
    if protocol in (PAPER, "no-pause"):
        return recording, None
    # all others: one logger, one clock
    aligned = replace(recording, motion_time_s=recording.motion_time_s - recording.motion_ahead_s)
    if protocol in ("one-file", "cyclic"):
        return _move_to_force_clock(aligned), None
    # what the transducer read in air, without a motion
    unloaded = aligned.rows(aligned.in_air, np.zeros_like(aligned.motion_stroke))
    if protocol in _SET_TO_ZERO:
        zero = aligned.channels_N[aligned.in_air].mean(axis=0)
        aligned = replace(aligned, channels_N=aligned.channels_N - zero)
    stroke = aligned.rows(aligned.stroke, aligned.motion_stroke)
    return stroke, unloaded if protocol == "separate-zero" else None


def _move_to_force_clock(recording: Recording) -> Recording:
    """Interpolate the motion at the times of the force samples, so that both fit into one file."""
    force_time_s, names = recording.force_time_s, ("x_mm", "z_mm", "angle_deg")
    moved = {
        name: np.interp(force_time_s, recording.motion_time_s, getattr(recording, name))
        for name in names
    }
    return replace(recording, motion_time_s=force_time_s, **moved)


def in_one_log(cycles: Sequence[Recording]) -> Recording:
    """Join the recordings of several strokes, one after the other; force and motion have one clock."""
    first = cycles[0]
    shifts_s = [0.0]
    for cycle in cycles[:-1]:
        shifts_s.append(shifts_s[-1] + float(np.ptp(cycle.force_time_s)) + _BETWEEN_S)
    parts = {name: [getattr(cycle, name) for cycle in cycles] for name in vars(first)}
    for name in ("force_time_s", "motion_time_s"):
        parts[name] = [time + shift for time, shift in zip(parts[name], shifts_s, strict=True)]
    return Recording(**{name: np.concatenate(arrays) for name, arrays in parts.items()})


def with_files(runs: Sequence[PlannedRun], protocol: str) -> list[PlannedRun]:
    """Return the runs with the files that a protocol writes, and with the number of strokes that a log has."""
    one_file = protocol in ("one-file", "cyclic", "constant-speed")
    own_zero = protocol == "separate-zero"
    repeated_kinds = ("plate", "rod") if protocol == "cyclic" else ()
    return [
        replace(
            run,
            one_file=one_file,
            own_zero=own_zero,
            cycles=_CYCLES if run.kind in repeated_kinds else 1,
        )
        for run in runs
    ]
