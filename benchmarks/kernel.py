"""How fast forces are: elements a second, a leg's sweep, and draws, beside a plain numpy loop.

Everything is measured in this one process, on one core, in turns. The quickest turn of each counts:
whatever else the machine does can only add to it.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

# one core: the matrix products of the draws would take all
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MKL_NUM_THREADS", "1")

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import numpy as np
from coverage_levels import sweep, sweep_draws

from rftfit import reference
from rftfit.forces.motion import THETA_DEG
from rftfit.forces.outlines import model_leg
from rftfit.measure.alpha import alpha_columns, directions
from rftfit.model.fourier import fit_lsq
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.model.profiles import Profile

TURNS = 40
DEEP_CM = -6.0
DRAWS = 1000
RESULT = Path(__file__).parent / "results" / "kernel.md"


def seconds(function: Callable[[], object], repeats: int) -> float:
    """Seconds of one call, from several in a row."""
    start = time.perf_counter()
    for _ in range(repeats):
        function()
    return (time.perf_counter() - start) / repeats


def plain_loop(profile: Profile, body: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Sweep a leg the straightforward way: a loop over angles, numpy over the elements of each."""
    width, hip, rate = 2.54, 2.0, 0.2
    forces = np.zeros((theta.size, 2))
    for index, angle in enumerate(theta):
        cos_a, sin_a = np.cos(angle), np.sin(angle)
        x, z = body[:, 0] * cos_a + body[:, 1] * sin_a, body[:, 1] * cos_a - body[:, 0] * sin_a
        tx, tz = body[:, 2] * cos_a + body[:, 3] * sin_a, body[:, 3] * cos_a - body[:, 2] * sin_a
        vx, vz = rate * z, -rate * x
        depth = -(z + hip)
        load = np.where(depth > 0, depth, 0.0) * 2 * body[:, 4] * width
        beta, gamma = np.arctan2(-tz, tx), np.arctan2(-vz, -vx)
        alpha_z, alpha_x = profile.alpha(beta, gamma)
        forces[index] = (alpha_z * load).sum(), (alpha_x * load).sum()
    return forces


def draw_profiles() -> list[TableProfile]:
    random = np.random.default_rng(2)
    stacks = []
    for medium in reference.MEDIA:
        noise = random.normal(0, 0.005, (2, DRAWS, 7, 13))
        alpha_z, alpha_x = reference.alpha_grid(medium)
        stacks.append(TableProfile(alpha_z + noise[0], alpha_x + noise[1], name=medium))
    return stacks


def all_draws(stacks: list[TableProfile]) -> None:
    for stack in stacks:
        for leg in reference.LEGS:
            sweep_draws(stack, model_leg(leg))


def main() -> None:
    table = TableProfile.published("poppy_LP")
    cells = reference.load("table_s5").query("medium == 'poppy_LP'")
    nine = FourierProfile(fit_lsq(*directions(cells), *alpha_columns(cells)))
    profiles: dict[str, Profile] = {
        "nine terms": nine,
        "table": table,
        "depth-only": DepthOnlyProfile.of(table),
    }
    leg, theta = model_leg("c_leg"), np.radians(THETA_DEG)
    lines = [
        f"| one core; leg: {theta.size} angles x {len(leg.body)} elements | "
        + " | ".join(profiles),
        "|---" * (len(profiles) + 1) + "|",
    ]
    lines[0] += " |"
    rows: dict[str, list[str]] = {
        "elements in the sand a second, million": [],
        "sweep, ms": [],
        "plain numpy loop over angles, ms": [],
        "ratio": [],
        "alpha of a million angles, million a second": [],
    }
    angles = np.random.default_rng(5).uniform(-np.pi, np.pi, (2, 1_000_000))
    for profile in profiles.values():
        profile.alpha(*angles)  # so many import the compiler, for what follows too
        compiled_forces = sweep(profile, leg)  # read from disk before the clock starts
        plain_forces = plain_loop(profile, leg.body, theta)
        # the loop tests an element's middle only where the kernel clips: alike, not the same
        assert (
            np.abs(plain_forces[:, 0] - compiled_forces.force_z_N).max()
            < 0.02 * compiled_forces.force_z_N.max()
        )
        turns = [
            (
                seconds(lambda profile=profile: sweep(profile, leg, hip_height_cm=DEEP_CM), 20),  # type: ignore[misc]
                seconds(lambda profile=profile: sweep(profile, leg), 20),  # type: ignore[misc]
                seconds(lambda profile=profile: plain_loop(profile, leg.body, theta), 1),  # type: ignore[misc]
            )
            for _ in range(TURNS)
        ]
        each_s, sweep_s, loop_s = (min(turn[k] for turn in turns) for k in range(3))
        alpha_s = min(seconds(lambda profile=profile: profile.alpha(*angles), 1) for _ in range(9))  # type: ignore[misc]
        values = (
            f"{theta.size * len(leg.body) / each_s / 1e6:.0f}",
            f"{1e3 * sweep_s:.3f}",
            f"{1e3 * loop_s:.1f}",
            f"{loop_s / sweep_s:.0f}",
            f"{1e-6 * angles[0].size / alpha_s:.0f}",
        )
        for row, value in zip(rows.values(), values, strict=True):
            row.append(value)
    lines += [f"| {name} | {' | '.join(values)} |" for name, values in rows.items()]
    stacks = draw_profiles()
    all_draws(stacks)
    draws_s = min(seconds(lambda: all_draws(stacks), 1) for _ in range(5))
    lines.append(f"| {DRAWS} draws through all 15 leg curves, s | | {draws_s:.2f} | |")
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
