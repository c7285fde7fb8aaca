"""Check of each force channel: dead, frozen, clipped, reversed, exchanged or of another gain, in several runs.

First by the readings alone (table ``runs``, in which each channel F1, F2, F3 has columns ``_low_N`` and ``_high_N``, its
smallest and largest reading in the stroke, ``_held_N``, the reading at which it stayed longest, ``_held``, the share of
the samples there, and ``_noise_N``); then by axes that fit a part of the runs better; then by the force that known
media have in the direction of each run (table ``peers``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.config import Config, Transducer
from rftfit.campaign.sheet import Run
from rftfit.campaign.spikes import Mask
from rftfit.checks.axes import CLEAR, find_likelier_axes
from rftfit.checks.declared import (
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    describe_rows,
    flags_on,
)
from rftfit.checks.runs import check_drift, check_rods
from rftfit.conventions import FloatArray
from rftfit.directions import has_sign, number_rows
from rftfit.measure.alpha import alpha_columns
from rftfit.measure.flags import Remark, format_remarks, remark
from rftfit.measure.lab_frame import is_symmetric, measured_channel
from rftfit.measure.levels import two_clusters
from rftfit.measure.verdict_words import BETA_ROWS, ROWS, UNUSABLE
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "channels")


Cause = tuple[Remark, list[Remark]]
"""Fault of a channel, and flags of the runs that show it."""


@declare_check(
    "channels",
    title="force channels",
    effect=UNUSABLE,
    good="no force channel is dead, frozen, clipped, reversed or exchanged in several runs",
    fault="a force channel is dead, frozen, clipped, reversed or exchanged",
    after=("sheet",),
    outcomes={
        "channels": Sentences(
            "{causes}",
            "below {frozen:.0%} of a stroke at one reading, no end in common below the range",
            "{causes}.",
        ),
        "channels-unread": Sentences("no readings of channels"),
    },
)
def check_channels(measured: MediumMeasurements) -> Check:
    """Look for a channel that is constant, frozen, clipped, without force, exchanged or reversed.

    The first of three searches that finds causes ends the check: its causes also explain what the others would find.
    """
    logs, causes = causes_in_readings(measured)
    causes = causes or find_axes_of_part(measured)
    causes = causes or compare_with_known(measured, *_already_explained(measured))
    if not logs and not causes:
        return Check.skip("channels", "channels-unread")
    flags = [flag for _, flags_of_cause in causes for flag in flags_of_cause]
    causes_or_count = [cause for cause, _ in causes] or [remark("logs-read", count=len(logs))]
    return Check.judge(
        "channels", not causes, flags, causes=format_remarks(causes_or_count), frozen=_CHOSEN.frozen
    )


Logs = Sequence[tuple[Run, dict[Any, Any]]]
"""Runs, each with its row of the table of runs."""


def causes_in_readings(measured: MediumMeasurements) -> tuple[Logs, list[Cause]]:
    """Return the logs of plates and legs, and faults of channels that their readings show without alpha.

    The check of the run sheet uses this, too: it waits for sound readings.
    """
    logs = _logs_read(measured)
    # a frozen, clipped or exchanged channel also shows no force: report the more exact cause first
    config = measured.config
    return logs, find_stuck_channels(config, logs) or find_exchanged_channels(
        config.transducer, logs
    )


def _logs_read(measured: MediumMeasurements) -> Logs:
    """Return the logs of plates and legs that were read."""
    facts = measured.tables["runs"]
    read = facts[facts["status"].eq("read") & facts["F1_low_N"].notna()].to_dict("records")
    logs = [(measured.sheet[row["run_id"]], row) for row in read]
    return [(run, row) for run, row in logs if run.kind in ("plate", "leg")]


def _pushes(logs: Logs) -> Logs:
    """Select the logs in which the force must change: no horizontal runs and no pulls."""
    return [log for log in logs if log[0].direction not in ("horizontal", "extraction")]


def find_stuck_channels(config: Config, logs: Logs) -> list[Cause]:
    """Find channels along x and z that are frozen, or that stop below the end of their range, in several logs.

    A channel that holds one reading for a large share of a stroke, though the force must change, is frozen; it is
    constant where it has no other reading at all. One that holds its smallest or largest reading is clipped.
    """
    causes = []
    for axis in "xz":
        if (name := measured_channel(config, axis)) is None:
            continue
        # on a symmetric plate no force acts along x
        with_force = [row for run, row in _pushes(logs) if axis == "z" or not is_symmetric(run)]
        dead = [row for row in with_force if row[f"{name}_held"] >= _CHOSEN.frozen]
        if len(dead) >= min(_CHOSEN.fewest_logs, len(with_force)) > 0:
            constant = all(row[f"{name}_low_N"] == row[f"{name}_high_N"] for row in dead)
            cause = remark(
                "cause-constant" if constant else "cause-frozen",
                channel=name,
                axis=axis,
                count=len(dead),
                size=len(with_force),
            )
            runs = [row["run_id"] for row in dead]
            causes.append((cause, flags_on(runs, "channel-still", channel=name)))
            continue
        # just below the end of the range of F1, F2 or F3: there the transducer itself ends, which is flagged elsewhere
        limit = 0.99 * config.transducer.range_N[int(name[1]) - 1]
        for end_N, runs in _find_clipping_ends([row for _, row in logs], name, limit).items():
            of_channel: dict[str, Any] = {"channel": name, "newtons": end_N}
            cause = remark(
                "cause-clipped", **of_channel, axis=axis, count=len(runs), size=len(logs)
            )
            causes.append((cause, flags_on(runs, "channel-clipped", **of_channel)))
    return causes


def _find_clipping_ends(
    rows: Sequence[dict[Any, Any]], name: str, limit: float
) -> dict[float, list[str]]:
    """Find readings at which a channel stops in several logs, such as the end of an amplifier.

    Returns the run_ids by the reading, N. `rows`: of the table of runs. `name`: of the channel. `limit`: N; a channel
    that stops farther out is at the end of its own range.
    """
    runs_by_reading: dict[float, list[str]] = {}
    for row in rows:
        low, high, held = (row[f"{name}_{fact}_N"] for fact in ("low", "high", "held"))
        if row[f"{name}_held"] >= _CHOSEN.clipped and low < high and held in (low, high):
            runs_by_reading.setdefault(held, []).append(row["run_id"])
    return {
        held: runs
        for held, runs in runs_by_reading.items()
        if len(runs) >= _CHOSEN.fewest_logs and abs(held) < limit
    }


def find_exchanged_channels(transducer: Transducer, logs: Logs) -> list[Cause]:
    """Find exchanged channels x and y: the force across the plane of motion (y) is larger than that in it (x).

    `logs`: of `causes_in_readings`. Returns one cause, without flags as it concerns all runs, or none.
    """
    if (ratio := _exchange_ratio(transducer, logs)) is None:
        return []
    y, x = transducer.axes.y[1:], transducer.axes.x[1:]
    return [(remark("cause-exchanged", across=y, along=x, ratio=ratio), [])]


def _exchange_ratio(transducer: Transducer, logs: Logs) -> float | None:
    """Return how many times the force along x the channel y shows in slanted pushes; None if not clearly more.

    By symmetry no force acts along y. The range of the readings in a stroke stands for the force: the zero is not known.
    """
    slanted = [row for run, row in _pushes(logs) if not is_symmetric(run)]
    # names of the channels, without their signs
    y, x = transducer.axes.y[1:], transducer.axes.x[1:]
    ranges_N = [
        [row[f"{name}_high_N"] - row[f"{name}_low_N"] for name in (y, x)] for row in slanted
    ]
    across, along = np.array(ranges_N, dtype=float).reshape(-1, 2).T
    if not slanted or np.median(across) <= 10 * transducer.precision_N:
        return None
    ratio = float(np.median(across / np.maximum(along, 1e-9)))
    return ratio if ratio > _CHOSEN.exchanged else None


def find_axes_of_part(measured: MediumMeasurements) -> list[Cause]:
    """Find other axes that fit some runs better, by the shape of known media, as if two cables were exchanged.

    Returns one cause, with a flag on each of these runs, or none; axes that are wrong in all runs are another check's.
    """
    likeliest = measured.likeliest_mistake
    names = [measured_channel(measured.config, axis) for axis in "xz"]
    if not likeliest or None in names or find_likelier_axes(measured) is not None:
        return []
    mistake = likeliest["mistake"]
    if mistake in (ROWS, BETA_ROWS) or likeliest["log_bayes_factor"] < CLEAR:
        return []
    run_ids = likeliest["run_ids"].split()
    axes = str(remark(f"axes-{mistake}"))
    cause = remark(
        "cause-axes",
        axes=axes,
        channels=" and ".join(map(str, names)),
        count=len(run_ids),
        size=len(measured.tables["peers"]),
        rows=describe_rows(run_ids, measured.sheet),
    )
    return [(cause, flags_on(run_ids, "other-axes", axes=axes))]


def _already_explained(measured: MediumMeasurements) -> tuple[set[str], bool]:
    """Return what explains odd forces without a fault of a channel, for `compare_with_known`.

    These are the run_ids whose logs look like those of rods, and whether other axes or a drift of the zero explain the
    others.
    """
    exchanged = {flag.run_id for flag in check_rods(measured).flags}
    all_drift = len(check_drift(measured).flags) == len(measured.tables["fits"])
    return exchanged, all_drift or find_likelier_axes(measured) is not None


def compare_with_known(
    measured: MediumMeasurements, exchanged: set[str], explained: bool
) -> list[Cause]:
    """Find channels that show no force, the opposite force, or another gain than expected from known media.

    Expected is the least alpha that all published media have in the direction of a run (``known_z_ratio``,
    ``known_x_ratio`` of the table of peers, relative to their alpha_z straight down), times a scale of this medium. A
    medium may differ from all known ones in a direction, and then in all runs of that direction. So directions without
    force or with the opposite sign are counted, not runs.

    `exchanged`: run_ids that are left out. `explained`: True if other axes or a drift explain missing and opposite
    forces: then only gains are looked for.
    """
    config, tables = measured.config, measured.tables
    known = tables["peers"][["run_id", "known_z_ratio", "known_x_ratio"]]
    noises = tables["runs"][["run_id", *(f"F{n}_noise_N" for n in (1, 2, 3))]]
    table = tables["fits"].merge(known, on="run_id").merge(noises, on="run_id")
    table = table[~table["run_id"].isin([*exchanged])]
    if table.empty:
        return []
    force, mount_force, expected = _forces_beside_known(table, config.transducer.turn_deg)
    strong = np.abs(expected) >= _CHOSEN.clear
    is_comparable = strong & np.isfinite(mount_force)
    # scale of measured over expected forces, by the channel in which it is larger: the other one may be dead
    ratios = (np.abs(mount_force[c, use] / expected[c, use]) for c, use in enumerate(is_comparable))
    scale = max(float(np.median(ratio)) if ratio.size else 0.0 for ratio in ratios)
    if not scale > 0:
        return []
    directions = _DirectionsOfRuns(number_rows(table, measured.tolerance_deg))
    causes = []
    for component, axis in enumerate("zx"):
        name = measured_channel(config, axis)
        if name is None:
            continue
        faint = np.abs(mount_force[component]) < _CHOSEN.silent * scale
        must_act = np.abs(expected[component]) >= _CHOSEN.must_feel
        opposite = (np.sign(force[component]) != np.sign(expected[component])) & ~faint & must_act
        # values of the sentences of the flags and of the cause
        of_flag: dict[str, Any] = {"channel": name}
        of_cause: dict[str, Any] = {}
        # code of the fault, True for the runs that show it, and of how many directions or runs it is counted
        if not explained and (count := directions.count_silent(faint, must_act)):
            code, is_wrong, size = "silent", faint & must_act, directions.count(must_act)
        elif not explained and (count := directions.count_reversed(opposite, strong[component])):
            code, is_wrong, size = "reversed", opposite, directions.count(strong[component])
        elif gain := _find_other_gain(
            table[f"{name}_noise_N"].to_numpy(float),
            mount_force[component],
            expected[component],
            strong[component],
        ):
            of_cause["times"], is_wrong = gain
            of_flag |= of_cause
            code, count, size = "gain", int(is_wrong.sum()), is_wrong.size
        else:
            continue
        mistake = code
        if code == "reversed" and axis == "x":
            is_right = must_act & ~faint & ~opposite
            if _points_to_beta(table, is_wrong, is_right, measured.tolerance_deg):
                mistake = "reversed-beta"
        runs = table["run_id"][is_wrong]
        if code == "silent" and axis == "x":
            logs = [log for log in _logs_read(measured) if log[1]["run_id"] in set(runs)]
            if ratio := _exchange_ratio(config.transducer, logs):
                mistake = "silent-turned"
                of_cause = {"across": config.transducer.axes.y[1:], "ratio": ratio}
        cause = remark(
            f"cause-{mistake}",
            whose=f"alpha_{axis}" if config.table else f"{name}, along {axis},",
            count=count,
            size=size,
            rows=describe_rows(runs, measured.sheet),
            **of_cause,
        )
        causes.append((cause, flags_on(runs, f"channel-{code}", **of_flag)))
    return causes


def _forces_beside_known(
    table: pd.DataFrame, turn_deg: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the forces of runs in two frames, and the expected ones, as alpha, z and x, each of shape (2, runs).

    First the force on plate and rod together in the lab frame, N/cm^3; then the same along the axes of the mount, that
    is, by channel; then the least force of known media, relative to alpha_z straight down. `table`: Rows of fits with
    the ratios of `compare_with_known`. `turn_deg`: Turn of the mount.
    """
    # forces on the plates as they moved: `file_extraction` turned alpha_x of pulls
    side = np.where(table["mirrored"].to_numpy(bool), -1.0, 1.0)
    sides = np.stack([np.ones_like(side), side])
    force = sides * np.add(alpha_columns(table), np.nan_to_num(alpha_columns(table, "_rod")))
    expected = sides * table[["known_z_ratio", "known_x_ratio"]].to_numpy(float).T
    # a component that was not measured counts as 0, and 0 is expected of it
    unmeasured = np.isnan(force[1]) & ~np.isnan(force[0])
    force[1, unmeasured] = expected[1, unmeasured] = 0.0
    turn = math.radians(turn_deg)
    cos, sin = math.cos(turn), math.sin(turn)
    return force, np.array([[cos, sin], [-sin, cos]]) @ force, expected


@dataclass(frozen=True)
class _DirectionsOfRuns:
    """Counts directions in which a channel is wrong; arrays are bool of shape (runs,).

    `number`: number of the direction of each run, of `number_rows`.
    """

    number: npt.NDArray[np.intp]

    def count(self, is_shown: Mask) -> int:
        """Count the directions in which `is_shown` is True for more than half of the runs."""
        return int((np.bincount(self.number, is_shown) > 0.5 * np.bincount(self.number)).sum())

    def count_silent(self, faint: Mask, must_act: Mask) -> int:
        """Count the directions without force where a force must act; 0 if they are too few for a dead channel.

        `faint`: The channel shows next to no force. `must_act`: A force must act, in all known media.
        """
        # one silent run is enough for a direction: if alpha were 0 there, its repeats would be silent too
        n_silent = np.unique(self.number[faint & must_act]).size
        n_must = self.count(must_act)
        fewest = min(max(_CHOSEN.fewest_silent, math.ceil(_CHOSEN.faint * n_must)), n_must)
        return n_silent if n_silent >= fewest > 0 else 0

    def count_reversed(self, opposite: Mask, strong: Mask) -> int:
        """Count the directions with the opposite of a strong force; 0 if they are too few or too many for a channel.

        `opposite`: The force has the other sign. `strong`: The expected force is clear. A channel that is reversed in
        nearly all directions is a question of the stated axes, which another check answers.
        """
        is_reversed = opposite & strong
        n_reversed = self.count(is_reversed)
        most = _CHOSEN.most_reversed * self.count(strong)
        are_several = is_reversed.sum() >= _CHOSEN.fewest_logs
        return n_reversed if are_several and _CHOSEN.fewest_reversed <= n_reversed <= most else 0


def _points_to_beta(
    table: pd.DataFrame, is_wrong: Mask, is_right: Mask, tolerance_deg: float
) -> bool:
    """Return True if the sign of beta is wrong, not a channel, in runs with the opposite force along x.

    That is so if all of these are slanted plates, and a level or upright plate on the same path shows the right force:
    a reversed channel would reverse both.

    `table`: Rows of fits. `is_wrong`, `is_right`: True for its runs with the opposite and with the right force.
    """
    is_slanted = has_sign(table["beta_deg"], tolerance_deg)
    gamma_deg = table["gamma_deg"].to_numpy(float)
    # each run beside the nearest path of a wrong one
    on_their_paths = np.abs(gamma_deg[:, None] - gamma_deg[is_wrong]).min(axis=1) <= tolerance_deg
    return bool(is_slanted[is_wrong].all() and (is_right & ~is_slanted & on_their_paths).any())


def _find_other_gain(
    noise: FloatArray, force: FloatArray, expected: FloatArray, strong: Mask
) -> tuple[float, Mask] | None:
    """Find runs with another gain: noise and force of a channel are both larger or smaller by the same factor.

    An amplifier that was switched changes both; a denser bed changes the force alone. Returns the factor, and True for
    these runs; None if there are none. Arrays have shape (runs,): `noise` of the channel, N, `force` and `expected`
    force in any unit, `strong`: True where the expected force is clear.
    """
    if not (noise > 0).all() or (clusters := two_clusters(np.log(noise))) is None:
        return None
    in_second = clusters[1]
    strong_second, strong_first = strong & in_second, strong & ~in_second
    if not strong_second.any() or not strong_first.any():
        return None
    # measured over expected force; 1 stands for an expected force that is not clear, whose runs are not used
    share = np.abs(force / np.where(strong, expected, 1.0))
    share_first = float(np.median(share[strong_first]))
    times = float(np.median(noise[strong_second]) / np.median(noise[strong_first]))
    force_ratio = float(np.median(share[strong_second])) / share_first if share_first > 0 else 0.0
    log_times = abs(math.log(times))
    ratios_agree = force_ratio > 0 and abs(math.log(force_ratio / times)) < 0.5 * log_times
    return (times, in_second) if ratios_agree and log_times > math.log(_CHOSEN.gain) else None
