"""Scores of predicted forces agree with hand calculation, and media with exact laws are physical.

Score: how far predicted forces and their intervals are from the true ones. Exact law: alpha of a
made-up medium, known without error.
"""

import math

import numpy as np
import pytest
from exact_laws import SIZE, alpha_by_stress, exact_laws, forces_in_plane, forces_in_space
from force_scores import crps, interval_score, learn_error
from scipy.spatial.transform import Rotation

import rftfit

LAWS = exact_laws()
"""Media whose alpha is known without error, by name."""


def test_interval_score_is_width_and_forty_times_the_miss():
    lo, hi = np.array([0.0, 0.0]), np.array([2.0, 2.0])
    # inside: the width; 0.5 above: width + 40 x 0.5
    assert interval_score(lo, hi, np.array([1.0, 2.5])) == pytest.approx((2 + 22) / 2)
    assert interval_score(lo, hi, np.array([-1.0, 1.0]), 0.9) == pytest.approx((22 + 2) / 2)


def test_crps_of_one_draw_is_its_error_and_of_two_less():
    assert crps(np.array([[3.0]]), np.array([1.0])) == pytest.approx(2)
    # mean distance 1, less half the mean distance between two draws: 0.5 x (0 + 2 + 2 + 0) / 4
    assert crps(np.array([[0.0], [2.0]]), np.array([1.0])) == pytest.approx(0.5)


def test_crps_of_normal_draws():
    draws = np.random.default_rng(1).standard_normal((20_000, 1))
    expected = (math.sqrt(2) - 1) / math.sqrt(math.pi)
    assert crps(draws, np.zeros(1)) == pytest.approx(expected, abs=0.01)


def test_without_errors_of_alpha_the_learned_error_is_the_rms_of_difference_over_load():
    load = np.array([1.0, 2.0, 4.0, 10.0])
    difference = np.array([0.1, -0.4, 0.4, 2.0])
    expected = math.sqrt(np.mean((difference / load) ** 2))
    assert learn_error([difference], [np.zeros(4)], [load]) == pytest.approx(expected, rel=1e-3)


def test_what_errors_of_alpha_explain_is_not_learned():
    random = np.random.default_rng(2)
    load = random.uniform(1, 3, 20_000)
    sd = random.uniform(0.1, 0.5, load.size)
    difference = random.standard_normal(load.size) * np.hypot(0.3 * load, sd)
    assert learn_error([difference], [sd**2], [load]) == pytest.approx(0.3, rel=0.03)


@pytest.mark.parametrize("name", LAWS)
def test_exact_laws_have_the_symmetry_of_alpha_and_take_energy(name):
    law = LAWS[name]
    beta, gamma = np.radians(np.random.default_rng(4).uniform(-89, 89, (2, 500)))
    alpha, image = law.alpha(beta, gamma), law.alpha(-beta, np.pi - gamma)
    np.testing.assert_allclose(image, alpha * np.array([[1], [-1]]), atol=1e-12)
    work = alpha[0] * np.sin(gamma) + alpha[1] * np.cos(gamma)
    assert work.min() > -0.01 * np.abs(alpha).max()


def test_an_exact_law_in_the_plane_is_that_of_space():
    law = LAWS["frictional 0.3"]
    assert law.stress is not None
    leg = rftfit.model_leg("c_leg")
    pose = np.array([[0, 2, 0.4, 0.3, -1.0, 0]])
    turned = Rotation.from_euler("y", 0.4)
    motion = rftfit.Motion3D([0, 0, 2], [0.3, 0, -1.0], [0, 0, 0], turned)
    in_space = forces_in_space(law, rftfit.Mesh.extrude(leg), motion)[0]
    z, x = forces_in_plane(law, leg, pose)[:, 0]
    np.testing.assert_allclose(in_space, [x, 0, z], rtol=0.02, atol=1e-9)


def test_exact_laws_have_their_stated_size():
    for name, law in LAWS.items():
        if law.stress is not None:
            down = alpha_by_stress(law.stress, np.array(0.0), np.array(np.pi / 2))
            np.testing.assert_allclose(down, [SIZE, 0], atol=1e-9, err_msg=name)
