"""Find copies of a log that were filed as repeats: their noise is the same, even if they were cut, rounded or moved.

A log that is filed twice would make the scatter of repeats too small, so only the first of a set of copies counts
(`counted_once`). Copies have the same readings (`same_readings`) or, if they were changed, the same noise
(`near_copies`): noise is what is left of the force by second differences from sample to sample.

``tared`` is a row a sample: ``run_id``, forces and the tare that was subtracted, N. ``fits`` is a row a plate run. A
*direction* is (beta, gamma), the same within ``tolerance_deg``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from rftfit.campaign.config import UNIT_AREA
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.directions import number_rows
from rftfit.measure.flags import REASON, Remark, reason_cells, remark
from rftfit.measure.samples import split_runs
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `copies`, says what each decides
_CHOSEN = chosen("measure", "copies")


def copies_of(
    sheet: Mapping[str, Run],
    runs: pd.DataFrame,
    fits: pd.DataFrame,
    tared: pd.DataFrame,
    tolerance_deg: float,
) -> dict[str, tuple[str, ...]]:
    """Return the run_ids of the copies of each run that can be compared: runs with the same readings or noise.

    `sheet`: Runs by run_id. `runs`: Table of runs, with ``run_id`` and ``readings``, a digest of F1 to F3.
    """
    noise_copies: dict[str, tuple[str, ...]] = {}
    # rows of a table of stress have no noise from sample to sample
    if not any(run.intruder == UNIT_AREA for run in sheet.values()):
        noise_copies = near_copies(_group_by_direction(fits, tolerance_deg), tared)
    return {
        name: tuple(dict.fromkeys([*names, *noise_copies.get(name, ())]))
        for name, names in same_readings(sheet, runs).items()
    }


def _group_by_direction(fits: pd.DataFrame, tolerance_deg: float) -> list[list[str]]:
    """Return the run_ids of each direction and kind of motion that has at least two runs."""
    grouped = fits.groupby([number_rows(fits, tolerance_deg), fits["direction"]])["run_id"]
    return [list(run_ids) for _, run_ids in grouped if len(run_ids) > 1]


def same_readings(sheet: Mapping[str, Run], runs: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Return for each run whose readings can be compared the run_ids of those with the same readings.

    Several strokes of one log are no copies of each other, and neither are rods: a tare may serve several runs. But
    runs of a table of stress are all in one file, and may be copies.
    """
    groups: dict[str, list[Run]] = {}
    for name, digests in zip(runs["run_id"], runs["readings"], strict=True):
        if sheet[name].kind in ("plate", "leg"):
            for digest in digests.split():
                groups.setdefault(digest, []).append(sheet[name])
    copies: dict[str, tuple[str, ...]] = {}
    for group in groups.values():
        for run in group:
            is_stress_table = run.intruder == UNIT_AREA
            names = [
                other.run_id
                for other in group
                if other is not run and (is_stress_table or other.force_log != run.force_log)
            ]
            copies[run.run_id] = tuple(dict.fromkeys([*copies.get(run.run_id, ()), *names]))
    return copies


def near_copies(groups: Sequence[Sequence[str]], tared: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Return the runs that have the noise of another run of their direction, with the run_ids of these others.

    `groups`: run_ids of each direction. All repeats have the same smooth stroke; second differences from sample to
    sample remove it and leave the noise.
    """
    rows_by_run = split_runs(tared)
    # the force before the tare was subtracted: a copy may have another tare
    force = tared[["force_z_N", "force_x_N"]].to_numpy(float)
    force = force + np.nan_to_num(tared[["tare_z_N", "tare_x_N"]].to_numpy(float))
    copies: dict[str, list[str]] = {}
    for group in groups:
        noise = {
            name: _noise_of_force(force[rows_by_run[name]]) for name in group if name in rows_by_run
        }
        names = [name for name in noise if noise[name].size >= _CHOSEN.shortest]
        shapes = [noise[name] / noise[name].std() for name in names]
        for pair in _find_pairs_with_same_noise(shapes):
            first, second = (names[index] for index in pair)
            # noise of another size is no copy of the readings
            same_size = abs(math.log(noise[first].std() / noise[second].std())) < _CHOSEN.same_size
            if same_size and _hold_equal_readings(noise[first], noise[second]):
                copies.setdefault(first, []).append(second)
                copies.setdefault(second, []).append(first)
    return {name: tuple(run_ids) for name, run_ids in copies.items()}


def _hold_equal_readings(first: FloatArray, second: FloatArray) -> bool:
    """Return True if many readings are equal at the shift where two noises fit best.

    A hum of the drive is similar in all runs, but its readings are not equal. `first`, `second`: Noises, N, shape (n,)
    and (m,).
    """
    # cross-correlation at all shifts of `second`; a power of two, for a fast transform
    size = 1 << (first.size + second.size).bit_length()
    correlation = np.fft.irfft(np.fft.rfft(second, size) * np.conj(np.fft.rfft(first, size)), size)
    shift = int(np.abs(correlation).argmax())
    sign = math.copysign(1.0, correlation[shift])
    # a transform is periodic: its upper half are the shifts the other way
    shift -= size if shift > size // 2 else 0
    first_part, second_part = first[max(-shift, 0) :], second[max(shift, 0) :]
    overlap = min(first_part.size, second_part.size)
    difference = np.abs(first_part[:overlap] - sign * second_part[:overlap])
    step = max(_smallest_step(first), _smallest_step(second))
    most = _CHOSEN.equal * first.std() + _CHOSEN.equal_steps * step
    # readings of a copy may differ in their last digit, but by no more, even if a strong hum allows more
    return bool(np.quantile(difference, _CHOSEN.part) < min(most, _CHOSEN.last_digit * step))


def _smallest_step(noise: FloatArray) -> float:
    """Smallest step between distinct values, N; steps far below the noise come from rounding in the arithmetic."""
    # the lowest and the highest value are limits at which jumps are cut
    steps = np.diff(np.unique(noise)[1:-1])
    return float(min(steps[steps > 1e-6 * noise.std()], default=0.0))


def _noise_of_force(force: FloatArray) -> FloatArray:
    """Second differences of the component of force that varies more, N; empty if all are equal.

    `force`: z and x, N, shape (n, 2).
    """
    steps = np.diff(force[np.isfinite(force).all(axis=1)], 2, axis=0)
    if not steps.size:
        return np.zeros(0)
    # a jump, for example at the start of the motion, is the same in all repeats and would outweigh the noise
    step_limit = _CHOSEN.jump * np.median(np.abs(steps), axis=0)
    steps = np.clip(steps, -step_limit, step_limit)
    channel = steps[:, steps.std(axis=0).argmax()]
    return channel if channel.std() > 0 else np.zeros(0)


def _find_pairs_with_same_noise(noise: Sequence[FloatArray]) -> Iterator[tuple[int, int]]:
    """Yield the indices of two noises that are the same but for a shift by some samples.

    The noises have standard deviation 1 and the shape (n,), with an n of their own. Their cross-correlation must have a
    high peak that stands alone: a hum has many.
    """
    sizes = np.array([series.size for series in noise], dtype=int)
    size = 1 << (2 * int(sizes.max(initial=1))).bit_length()
    padded = np.zeros((len(noise), size), np.float32)
    for row, series in zip(padded, noise, strict=True):
        row[: series.size] = series
    spectra = np.fft.rfft(padded)
    near_peak = np.arange(-_CHOSEN.near, _CHOSEN.near + 1)
    at_once = 32  # limits memory
    for first_index, conjugate in enumerate(np.conj(spectra)):
        for start in range(first_index + 1, len(noise), at_once):
            block = slice(start, start + at_once)
            shorter = np.minimum(sizes[block], sizes[first_index])
            correlation = np.abs(np.fft.irfft(spectra[block] * conjugate, size))
            best = correlation.max(axis=1)
            # equal noises of n samples have the correlation n, unrelated ones about sqrt(n)
            high = np.flatnonzero(best > shorter * np.maximum(_CHOSEN.least, 8 / np.sqrt(shorter)))
            # what remains of the correlation without its highest peaks
            remaining = correlation[high]
            for _ in range(_CHOSEN.shifts):
                peak_shifts = remaining.argmax(axis=1)[:, None] + near_peak
                np.put_along_axis(remaining, peak_shifts % size, 0, axis=1)
            stands_alone = best[high] > _CHOSEN.alone * remaining.max(axis=1)
            yield from ((first_index, start + int(index)) for index in high[stands_alone])


def counted_once(
    fits: pd.DataFrame, copies: Mapping[str, Sequence[str]], tolerance_deg: float
) -> tuple[pd.DataFrame, dict[str, Remark]]:
    """Keep the numbers of the first run of each set of copies in one direction; set those of the others to NaN.

    `copies`: run_ids of the copies of each run, of `copies_of`. Returns the fits, and the reason of each run that is
    left out, by run_id. Angles and depths stay, as the run is still listed.
    """
    kept_run_ids: set[str] = set()
    left_out: dict[str, Remark] = {}
    # by run_id: all runs of its direction
    groups = {
        name: set(group) for group in _group_by_direction(fits, tolerance_deg) for name in group
    }
    measured = fits[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]].notna().any(axis=1)
    for name in fits["run_id"][measured]:
        kept_copies = sorted(kept_run_ids & set(copies.get(name, ())) & groups.get(name, set()))
        if kept_copies:
            left_out[name] = remark("same-readings", runs=", ".join(kept_copies))
        else:
            kept_run_ids.add(name)
    is_left_out = fits["run_id"].isin([*left_out])
    numbers = [
        name
        for name in map(str, fits.select_dtypes("float"))
        if not name.startswith(("beta_", "gamma_", "depth_"))
    ]
    fits = fits.copy()
    fits.loc[is_left_out, numbers] = np.nan
    if left_out:
        fits.loc[is_left_out, [*REASON]] = [reason_cells([copy]) for copy in left_out.values()]
    return fits, left_out
