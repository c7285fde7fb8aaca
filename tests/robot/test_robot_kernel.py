"""The compiled robot stepper takes the same steps as its version in plain numpy."""

import ast
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from robotsteps import forces, net, plain_steps, step
from seeds import seeds

import rftfit
from rftfit.model import kernel, packs
from rftfit.robot.body import assemble

RANDOM = np.random.default_rng(4)


STATE = np.array([0.0, 2.0, 0.1, 10.0, -5.0, 0.3])
"""Of the body: x, z (cm) and pitch (rad), then their rates."""


def random_state(height_cm):
    return RANDOM.normal([0, height_cm, 0, 0, 0, 0], [5.0, 1.0, 0.5, 50.0, 30.0, 5.0])


def agree(profile, parts, state, turn, rate, *, step_s=1e-3, steps=1, off=1e-12, rk4=False):
    ours = step(profile, parts, state, turn, rate, step_s, steps, rk4)
    theirs = plain_steps(profile, parts, state, turn, rate, step_s, steps, rk4)[-1]
    assert_allclose(ours, theirs, rtol=off, atol=off)


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("curvature", "elements"), [(1.0, 30), (0.3, 1), (0.7, 31), (0.0, 32), (-0.5, 33), (-1.0, 100)]
)
@pytest.mark.parametrize("height_cm", [4.0, 2.0, 0.0, -8.0])
def test_one_step_is_the_twins(robot, profile, curvature, elements, height_cm):
    numerics = robot.numerics.model_copy(update={"elements": elements})
    parts = assemble(robot.model_copy(update={"numerics": numerics}), curvature)
    assert parts.bodies.shape == (5, elements, 5)
    for _ in range(seeds(6, 2)):
        state, turn = random_state(height_cm), RANDOM.uniform(-10, 10)
        rate = RANDOM.choice([-20.0, 0.0, 12.0])
        for rk4 in (False, True):
            agree(profile, parts, state, turn, rate, rk4=rk4)


def test_samples_are_the_twins(robot, profile):
    parts = assemble(robot, 1.0)
    state, rate, step_s = STATE, 12.0, 1e-3
    samples = np.empty((5, kernel.SAMPLE_HEAD + 2 * len(parts.names)))
    step(profile, parts, state, 0.4, rate, step_s, 15, every=3, samples=samples)
    path = plain_steps(profile, parts, state, 0.4, rate, step_s, 15)
    assert_allclose(samples[:, :6], path[:15:3], rtol=1e-9, atol=1e-9)
    for row in samples:
        sample_state, turn = row[:6], row[6]
        for index, group in enumerate(forces(profile, parts, sample_state, turn, rate)):
            assert_allclose(
                row[9 + 2 * index : 11 + 2 * index], group[..., :2].sum(axis=(0, 1)), atol=1e-11
            )
        assert_allclose(row[7], net(profile, parts, sample_state, turn, rate)[2], atol=1e-11)


def test_unknown_alpha_is_no_number_but_only_where_it_counts(robot, table):
    *angles, z, x = table.cells
    is_down = np.isclose(angles, [[0], [math.pi / 2]], atol=1e-6).all(axis=0)
    holed = rftfit.TableProfile(np.where(is_down, math.nan, z), x, *angles, "holed")
    parts = assemble(robot, 0.0)
    flat = np.array([0.0, 0.9, 0.0, 0.0, -1.0, 0.0])
    assert np.isnan(step(holed, parts, flat, 0.0, 0.0, 1e-3, 1)).any()
    high = np.array([0.0, 50.0, 0.0, 0.0, -1.0, 0.0])
    assert np.isfinite(step(holed, parts, high, 0.0, 0.0, 1e-3, 1)).all()
    run = rftfit.simulate(holed, 2.0, 1.0, robot)
    assert (run.outcome, math.isnan(run.speed_cm_per_s)) == ("not steady", True)
    assert "holed" in run.reason
    assert "(0, 90)" in run.reason


def test_compiled_code_needs_no_other_file():
    """The compiler's cache watches this file alone: it imports types only, and repeats constants of profiles."""
    tree = ast.parse(Path(kernel.__file__).read_text("utf-8"))
    imported_names = {
        alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rftfit")
        for alias in node.names
    }
    assert imported_names == {"FloatArray", "Pack"}
    repeated = kernel._FOURIER, kernel._TABLE, kernel._NEGLIGIBLE, kernel._STILL
    assert repeated == (packs.FOURIER, packs.TABLE, packs.NEGLIGIBLE, packs.STILL)


@pytest.mark.parametrize("turn", [0.7, 2.5])  # every group bears a load in one of them
def test_any_phases_and_hips(robot, profile, turn):
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
    agree(profile, parts, state, turn, rate)
    samples = np.empty((1, kernel.SAMPLE_HEAD + 2 * len(parts.names)))
    step(profile, parts, state, turn, rate, 1e-3, 1, every=1, samples=samples)
    drive = 0.0
    for index, group in enumerate(forces(profile, parts, state, turn, rate)):
        x, z, turns = parts.hips[parts.group == index, :, None].transpose(1, 0, 2)
        hip_x = state[0] + x * math.cos(0.2) + z * math.sin(0.2)
        hip_z = state[1] + z * math.cos(0.2) - x * math.sin(0.2)
        fz, fx, at_x, at_z = np.moveaxis(group, -1, 0)
        drive += (turns * ((at_z - hip_z) * fx - (at_x - hip_x) * fz)).sum()
    assert_allclose(samples[0, 8], drive, rtol=1e-9, atol=1e-9)
