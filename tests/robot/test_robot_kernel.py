"""The compiled stepper against its numpy twin."""

from __future__ import annotations

import importlib
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from robotsteps import step

from rftfit import reference
from rftfit.model.profiles import TableProfile
from rftfit.robot import kernel, reference_kernel
from rftfit.robot.body import assemble
from rftfit.robot.run import simulate

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot

RANDOM = np.random.default_rng(4)


def random_state(height_cm: float) -> np.ndarray:
    spread = np.array([5.0, 1.0, 0.5, 50.0, 30.0, 5.0])
    return np.asarray(RANDOM.normal(size=6) * spread + np.array([0, height_cm, 0, 0, 0, 0]))


@pytest.mark.parametrize("curvature", [1.0, 0.3, 0.0, -1.0])
@pytest.mark.parametrize("height_cm", [4.0, 2.0, 0.0, -8.0])
def test_one_step_is_the_twins(
    robot: Robot, profile: Profile, curvature: float, height_cm: float
) -> None:
    parts = assemble(robot, curvature)
    for _ in range(6):
        state, turn = random_state(height_cm), RANDOM.uniform(-10, 10)
        rate = RANDOM.choice([-20.0, 0.0, 12.0])
        for rk4 in (False, True):
            ours = step(profile, parts, state, turn, rate, 1e-3, 1, rk4)
            theirs = reference_kernel.advance(profile, parts, state, turn, rate, 1e-3, 1, rk4)[1]
            np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("rk4", [False, True])
def test_many_steps_are_the_twins(robot: Robot, profile: Profile, rk4: bool) -> None:
    parts = assemble(robot, 1.0)
    state = np.array([0.0, 3.2, 0.05, 10.0, -5.0, 0.3])
    ours = step(profile, parts, state, 0.2, 12.0, 5e-4, 200, rk4)
    theirs = reference_kernel.advance(profile, parts, state, 0.2, 12.0, 5e-4, 200, rk4)[-1]
    np.testing.assert_allclose(ours, theirs, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("count", [1, 31, 32, 33, 100])
def test_any_number_of_elements(robot: Robot, table: TableProfile, count: int) -> None:
    numerics = robot.numerics.model_copy(update={"elements": count})
    parts = assemble(robot.model_copy(update={"numerics": numerics}), 0.7)
    assert parts.elements == 9 * count
    state = random_state(0.5)
    ours = step(table, parts, state, 1.0, 12.0, 1e-3, 1)
    theirs = reference_kernel.advance(table, parts, state, 1.0, 12.0, 1e-3, 1)[1]
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)


def test_samples_are_the_twins(robot: Robot, profile: Profile) -> None:
    parts = assemble(robot, 1.0)
    state, rate, step_s = np.array([0.0, 2.0, 0.1, 10.0, -5.0, 0.3]), 12.0, 1e-3
    samples = np.empty((5, kernel.SAMPLE_HEAD + 2 * len(parts.names)))
    step(profile, parts, state, 0.4, rate, step_s, 15, every=3, samples=samples)
    path = reference_kernel.advance(profile, parts, state, 0.4, rate, step_s, 15)
    np.testing.assert_allclose(samples[:, :6], path[:15:3], rtol=1e-9, atol=1e-9)
    for row in samples:
        at, turn = row[:6], row[6]
        every = reference_kernel.forces(profile, parts, at, turn, rate)
        for index, group in enumerate(every):
            np.testing.assert_allclose(
                row[9 + 2 * index : 11 + 2 * index], group[..., :2].sum(axis=(0, 1)), atol=1e-11
            )
        np.testing.assert_allclose(
            row[7], reference_kernel.net(profile, parts, at, turn, rate)[2], atol=1e-11
        )
        drive = 0.0
        for group, elements, turned in zip(
            every, reference_kernel.place(parts, at, turn, rate), parts.turns, strict=True
        ):
            if turned[0]:
                # power of the legs' turn: force times the part of the velocity that it makes
                still = reference_kernel.place(parts, at, turn, 0.0)[len(parts.names) - 2 :]
                moved = elements[..., 6:] - still[0 if turned[1] > 0 else 1][..., 6:]
                x, z = group[..., 2] - elements[..., 0], group[..., 3] - elements[..., 1]
                # where the force acts, which is not the element's middle at the surface
                moved = moved + rate * np.stack([z, -x], axis=-1)
                drive += (group[..., 1] * moved[..., 0] + group[..., 0] * moved[..., 1]).sum()
        np.testing.assert_allclose(row[8] * rate, drive, atol=1e-9)


def test_unknown_alpha_is_no_number_but_only_where_it_counts(robot: Robot) -> None:
    alpha_z, alpha_x = (part.copy() for part in reference.alpha_grid("poppy_LP"))
    alpha_z[3, 12] = math.nan  # a flat plate straight down
    holed = TableProfile(alpha_z, alpha_x, name="holed")
    parts = assemble(robot, 0.0)
    flat = np.array([0.0, 0.9, 0.0, 0.0, -1.0, 0.0])
    assert np.isnan(step(holed, parts, flat, 0.0, 0.0, 1e-3, 1)).any()
    high = np.array([0.0, 50.0, 0.0, 0.0, -1.0, 0.0])
    assert np.isfinite(step(holed, parts, high, 0.0, 0.0, 1e-3, 1)).all()
    run = simulate(robot, holed, 2.0, 1.0)
    assert (run.outcome, math.isnan(run.speed_cm_per_s)) == ("not steady", True)
    assert "holed" in run.reason
    assert "(0, 90)" in run.reason


def test_cache_knows_the_file_it_calls_into() -> None:
    # the digest of that file is in the closure, ...
    function: Any = kernel._advance
    inside = [cell.cell_contents for cell in function.py_func.__closure__]
    assert kernel.SOURCE in inside
    assert len(kernel.SOURCE) == 64


def test_compilers_cache_tells_closures_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # ... and the closure is part of the key under which compiled code is kept
    (tmp_path / "with_closure.py").write_text(
        "import numba\n\n\ndef make(source):\n    @numba.njit(cache=True)\n"
        "    def function(x):\n        return x if len(source) else 0\n\n    return function\n",
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(tmp_path)
    make: Any = importlib.import_module("with_closure").make
    found = []
    for source in ("first", "first", "second"):
        function = make(source)
        assert function(3) == 3
        found.append((len(function.stats.cache_hits), len(function.stats.cache_misses)))
    assert found == [(0, 1), (1, 0), (0, 1)]


@pytest.mark.parametrize("turn", [0.7, 2.5])  # every group bears a load in one of them
def test_any_phases_and_hips(robot: Robot, profile: Profile, turn: float) -> None:
    """Phases that are no half turns, hips at heights of their own, groups of one, two and three."""
    hips = [
        hip.model_copy(update={"phase_turns": phase, "z_cm": z, "x_cm": x})
        for hip, phase, z, x in zip(
            robot.legs.hips, (0.1, 0.35, 0.1, 0.8, 0.35, 0.1), (-0.7, 0.3, -1.1, 0.0, 0.9, -0.2),
            (5.0, 1.0, -4.0, 2.0, -3.0, 0.5), strict=True,
        )
    ]  # fmt: skip
    odd = robot.model_copy(update={"legs": robot.legs.model_copy(update={"hips": hips})})
    parts = assemble(odd, 0.8)
    state, rate = np.array([40.0, 0.4, 0.2, 10.0, -5.0, 0.3]), 12.0
    ours = step(profile, parts, state, turn, rate, 1e-3, 1)
    theirs = reference_kernel.advance(profile, parts, state, turn, rate, 1e-3, 1)[1]
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-12)
    samples = np.empty((1, kernel.SAMPLE_HEAD + 2 * len(parts.names)))
    step(profile, parts, state, turn, rate, 1e-3, 1, every=1, samples=samples)
    drive = 0.0
    for forces, (_, _, first, members), turned in zip(
        reference_kernel.forces(profile, parts, state, turn, rate),
        parts.groups,
        parts.turns,
        strict=True,
    ):
        if turned[0]:
            x, z = parts.places[first : first + members, :, None].transpose(1, 0, 2)
            hip_x = state[0] + x * math.cos(0.2) + z * math.sin(0.2)
            hip_z = state[1] + z * math.cos(0.2) - x * math.sin(0.2)
            fz, fx, at_x, at_z = np.moveaxis(forces, -1, 0)
            drive += ((at_z - hip_z) * fx - (at_x - hip_x) * fz).sum()
    np.testing.assert_allclose(samples[0, 8], drive, rtol=1e-9, atol=1e-9)
