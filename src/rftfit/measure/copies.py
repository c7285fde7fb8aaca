"""Copies of a log that were filed as repeats: same noise, whatever was cut, rounded or moved in them."""

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

_CHOSEN = chosen("measure", "copies")


def copies_of(
    sheet: Mapping[str, Run],
    runs: pd.DataFrame,
    fits: pd.DataFrame,
    tared: pd.DataFrame,
    tolerance_deg: float,
) -> dict[str, tuple[str, ...]]:
    """Runs of a medium that can be compared, each with those that have its readings, or its noise."""
    exact = same_readings(sheet, runs)
    of_table = any(run.intruder == UNIT_AREA for run in sheet.values())
    noise_copies = {} if of_table else near_copies(_groups(fits, tolerance_deg), tared)
    return {
        name: tuple(dict.fromkeys([*names, *noise_copies.get(name, ())]))
        for name, names in exact.items()
    }


def _groups(fits: pd.DataFrame, tolerance_deg: float) -> list[list[str]]:
    """Group the runs of one direction, and of one kind of motion."""
    grouped = fits.groupby([number_rows(fits, tolerance_deg), fits["direction"]])["run_id"]
    return [list(run_ids) for _, run_ids in grouped if len(run_ids) > 1]


def same_readings(sheet: Mapping[str, Run], runs: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Runs of a medium whose readings can be compared, each with those that have the same ones.

    Neither strokes of one log are copies nor rods: a tare that serves several runs is no repeat. The
    runs of a table are all in one file.
    """
    groups: dict[str, list[str]] = {}
    for name, digest in zip(runs["run_id"], runs["readings"], strict=True):
        if digest and sheet[name].kind in ("plate", "leg"):
            groups.setdefault(digest, []).append(name)

    def copies(first: Run, second: Run) -> bool:
        of_table = first.intruder == UNIT_AREA
        return first is not second and (of_table or first.force_log != second.force_log)

    return {
        name: tuple(run_id for run_id in group if copies(sheet[name], sheet[run_id]))
        for group in groups.values()
        for name in group
    }


def near_copies(groups: Sequence[Sequence[str]], tared: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Runs of one direction whose noise is that of another one, with these.

    `groups`: run_ids by direction. What is smooth in a stroke is alike in all repeats; the second difference
    from sample to sample leaves what is noise.
    """
    rows_by_run = split_runs(tared)
    force = tared[["force_z_N", "force_x_N"]].to_numpy(float)
    force = force + np.nan_to_num(tared[["tare_z_N", "tare_x_N"]].to_numpy(float))
    copies: dict[str, list[str]] = {}
    for group in groups:
        noise = {name: _noise(force[rows_by_run[name]]) for name in group if name in rows_by_run}
        names = [name for name in noise if noise[name].size >= _CHOSEN.shortest]
        shapes = [noise[name] / noise[name].std() for name in names]
        for pair in _pairs_with_same_noise(shapes):
            first, second = (names[index] for index in pair)
            # noise of another size is no copy of the readings
            same_size = abs(math.log(noise[first].std() / noise[second].std())) < _CHOSEN.same_size
            if same_size and _are_equal_in_part(noise[first], noise[second]):
                copies.setdefault(first, []).append(second)
                copies.setdefault(second, []).append(first)
    return {name: tuple(run_ids) for name, run_ids in copies.items()}


def _are_equal_in_part(first: FloatArray, second: FloatArray) -> bool:
    """Tell whether readings are equal where two noises fit best; a hum of the drive is alike and not equal."""
    size = 1 << (first.size + second.size).bit_length()
    match = np.fft.irfft(np.fft.rfft(second, size) * np.conj(np.fft.rfft(first, size)), size)
    shift = int(np.abs(match).argmax())
    sign = math.copysign(1.0, match[shift])
    shift -= size if shift > size // 2 else 0
    later, earlier = first[max(-shift, 0) :], second[max(shift, 0) :]
    overlap = min(later.size, earlier.size)
    apart = np.abs(later[:overlap] - sign * earlier[:overlap])
    step = max(_step_of(first), _step_of(second))
    most = _CHOSEN.equal * first.std() + _CHOSEN.equal_steps * step
    # of a copy the last digits may differ, however strong a hum is in both
    return bool(np.quantile(apart, _CHOSEN.part) < min(most, _CHOSEN.last_digit * step))


def _step_of(noise: FloatArray) -> float:
    """Smallest step between distinct values, N; what is far below the noise is that of the arithmetic."""
    # the lowest and the highest are where jumps are cut
    steps = np.diff(np.unique(noise)[1:-1])
    return float(min(steps[steps > 1e-6 * noise.std()], default=0.0))


def _noise(force: FloatArray) -> FloatArray:
    """Second differences of the more restless component, N; none where they are all alike."""
    steps = np.diff(force[np.isfinite(force).all(axis=1)], 2, axis=0)
    if not steps.size:
        return np.zeros(0)
    # a jump, as where the motion begins, is alike in all repeats and would outweigh the noise
    step_limit = _CHOSEN.jump * np.median(np.abs(steps), axis=0)
    steps = np.clip(steps, -step_limit, step_limit)
    channel = steps[:, steps.std(axis=0).argmax()]
    return channel if channel.std() > 0 else np.zeros(0)


def _pairs_with_same_noise(noise: Sequence[FloatArray]) -> Iterator[tuple[int, int]]:
    """Pairs of noises that are one, shifted by some samples."""
    sizes = np.array([series.size for series in noise], dtype=int)
    size = 1 << (2 * int(sizes.max(initial=1))).bit_length()
    padded = np.zeros((len(noise), size), np.float32)
    for row, series in zip(padded, noise, strict=True):
        row[: series.size] = series
    spectra = np.fft.rfft(padded)
    for first_index, conjugate in enumerate(np.conj(spectra)):
        for start in range(first_index + 1, len(noise), _BLOCK):
            block = slice(start, start + _BLOCK)
            shorter = np.minimum(sizes[block], sizes[first_index])
            match = np.abs(np.fft.irfft(spectra[block] * conjugate, size))
            best = match.max(axis=1)
            high = np.flatnonzero(best > shorter * np.maximum(_CHOSEN.least, 8 / np.sqrt(shorter)))
            remaining_match = match[high]
            for _ in range(_CHOSEN.shifts):
                peak_shifts = remaining_match.argmax(axis=1)[:, None] + np.arange(
                    -_CHOSEN.near, _CHOSEN.near + 1
                )
                np.put_along_axis(remaining_match, peak_shifts % size, 0, axis=1)
            alone = best[high] > _CHOSEN.alone * remaining_match.max(axis=1)
            yield from ((first_index, start + int(index)) for index in high[alone])


_BLOCK = 32


def counted_once(
    fits: pd.DataFrame, copies: Mapping[str, Sequence[str]], tolerance_deg: float
) -> tuple[pd.DataFrame, dict[str, Remark]]:
    """Leave the number of one run of each set of copies of one direction; the others say whose copy they are.

    Returns the fits, and why each run without its number is left out.
    """
    kept_run_ids: set[str] = set()
    left_out: dict[str, Remark] = {}
    groups = {name: set(group) for group in _groups(fits, tolerance_deg) for name in group}
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
