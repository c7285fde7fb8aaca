"""Readings that stand alone: how many are found by share and size, what they do to alpha, and what is wrongly left out: ``make readings``.

A push of 20 N per cm at 0.5 cm/s, 50 readings a second, noise of 0.02 N. Alpha is the zero-intercept slope from 1 cm on.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))

from pushes import (
    N_PER_CM,
    RATE_HZ,
    any_pushes,
    crust,
    irregular_slip,
    push,
    slip_among_stones,
    stick_slip,
    stones,
)

from rftfit.campaign.spikes import find_lone_positions, find_spikes, find_steps

SHARES = (0.002, 0.01, 0.03, 0.1)
SIZES_N = (0.5, 2.0, 5.0, 20.0, 100.0)
NOISES_MM = (0.0, 0.05, 0.1, 0.2, 0.5)


def slope_error_percent(height, readings, is_kept):
    """Error of the slope of some readings, percent."""
    below = is_kept & (height < -1.0)
    depth = -height[below]
    return 100 * abs(float(depth @ readings[below] / (depth @ depth)) / N_PER_CM - 1)


def found_and_errors(share, size_N, pushes):
    """Mean share of the bad readings that is found, and median errors of the slope with and without them."""
    results = []
    for seed in range(pushes):
        random = np.random.default_rng(seed)
        _, height, force = push(random)
        bad = random.random(force.size) < share
        bad[random.integers(200, force.size - 10)] = True
        readings = force + bad * size_N * random.choice([-1.0, 1.0], force.size)
        alone = find_spikes(readings)
        every = np.ones(force.size, dtype=bool)
        results.append(
            (
                100 * (alone & bad).sum() / bad.sum(),
                slope_error_percent(height, readings, every),
                slope_error_percent(height, readings, ~alone),
            )
        )
    found_share, before, after = np.array(results).T
    return found_share.mean(), np.median(before), np.median(after)


def shares_of_lone_positions(noise_mm, motions):
    """Percent of the positions of each of some clean motions that are wrongly left out."""
    paths = [any_pushes(seed, noise_mm / 10).motion() for seed in range(motions)]
    return [100 * find_lone_positions(path.x, path.z).mean() for path in paths]


SAND = (stick_slip, irregular_slip, slip_among_stones, crust, stones)
STEPS = {
    "3 N more": lambda force, row: force + 3 * (np.arange(force.size) >= row),
    "10 N less": lambda force, row: force - 10 * (np.arange(force.size) >= row),
    "half": lambda force, row: np.where(np.arange(force.size) >= row, force / 2, force),
}
"""Steps of the zero or the gain that stay from a reading on."""


def share_told(happens, step, pushes):
    """Percent of pushes in which a step in the sand is told; with a true one, in which it is told where it is."""
    told = []
    for seed in range(pushes):
        random = np.random.default_rng(seed)
        time, _, force = push(random)
        readings = force * (1 + happens(random, time)) if happens else force
        row = int(random.integers(250, 640))
        if step:
            readings = STEPS[step](readings, row)
        rows = [found.row for found in find_steps(readings, round(RATE_HZ)) if time[found.row] > 3]
        told.append(row in rows if step else bool(rows))
    return 100 * np.mean(told)


def main():
    """Run it, print four tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pushes", nargs="?", type=int, default=100)
    pushes = parser.parse_args().pushes
    print(f"{pushes} pushes each: found, percent; error of alpha with and without them, percent")
    print(f"| off by, N | {' | '.join(f'{100 * share:g} % of the readings' for share in SHARES)} |")
    print("|---" * (1 + len(SHARES)) + "|")
    for size_N in SIZES_N:
        cells = [
            "{:.0f}; {:.2g}, {:.2g}".format(*found_and_errors(share, size_N, pushes))
            for share in SHARES
        ]
        print(f"| {size_N:g} | {' | '.join(cells)} |")
    print(
        f"\nWrongly left out of {pushes} pushes: mean and largest share, percent; largest change of alpha, percent"
    )
    for happens in (stick_slip, crust, stones):
        shares, changes = [], []
        for seed in range(pushes):
            random = np.random.default_rng(seed)
            time, height, force = push(random)
            readings = force * (1 + happens(random, time))
            alone = find_spikes(readings)
            shares.append(100 * alone.mean())
            errors = [
                slope_error_percent(height, readings, is_kept)
                for is_kept in (np.ones(force.size, dtype=bool), ~alone)
            ]
            changes.append(abs(errors[1] - errors[0]))
        print(f"{happens.__name__}: {np.mean(shares):.2g}, {max(shares):.2g}; {max(changes):.2g}")
    print(f"\nPushes in which a step that stays is told, percent of {pushes}")
    print(f"| sand | no step | {' | '.join(STEPS)} |")
    print("|---" * (2 + len(STEPS)) + "|")
    for sand in (None, *SAND):
        shares = [share_told(sand, step, pushes) for step in (None, *STEPS)]
        name = sand.__name__ if sand else "smooth"
        print(f"| {name} | {' | '.join(f'{share:.0f}' for share in shares)} |")
    print(
        f"\nPositions wrongly left out of {2 * pushes} clean motions: mean and largest share, percent"
    )
    for noise_mm in NOISES_MM:
        shares = shares_of_lone_positions(noise_mm, 2 * pushes)
        print(f"noise of {noise_mm:g} mm: {np.mean(shares):.2g}, {max(shares):.2g}")


if __name__ == "__main__":
    main()
