"""The compliance of the machine is found from a push on a rigid body and is never extrapolated.

Compliance: how far the machine itself bends under a force.
"""

import numpy as np
import pytest

from rftfit.measure.flags import Refused, remark
from rftfit.measure.surface import compliance_of


def yielded_cm(force):
    """Of a machine that stiffens."""
    return 0.05 * (1 - np.exp(-force / 60))


def test_a_curve_comes_back_from_noise():
    """Press 200 N: 1 cm in air, then as far as the machine yields."""
    force = np.concatenate([np.zeros(200), np.linspace(0, 200, 800)])
    depth = np.concatenate([np.linspace(0, 1, 200), np.ones(800)]) + yielded_cm(force)
    noise = 0.05 * np.random.default_rng(4).standard_normal(1000)
    compliance = compliance_of(depth, force + noise - 3, 0.05)
    asked = np.linspace(0, 195, 50)
    travel, in_range = compliance.travel_at(asked)
    assert in_range.all()
    np.testing.assert_allclose(travel, yielded_cm(asked), atol=1e-3)
    assert (np.diff(compliance.travel) >= 0).all()


def push(peak_N, in_air=40, contact=400):
    """Without noise: 1 cm in air, then 0.001 cm for each newton."""
    force = np.concatenate([np.zeros(in_air), np.linspace(0, peak_N, contact + 1)[1:]])
    depth = np.concatenate([np.linspace(0, 1, in_air), np.ones(contact)]) + 1e-3 * force
    return depth, force


@pytest.mark.parametrize("peak_N", [8.0, 200.0, 5000.0])
def test_a_spring_is_exact_up_to_its_last_newton_and_not_extrapolated(peak_N):
    compliance = compliance_of(*push(peak_N), 0.001)
    force = np.append(np.linspace(0, peak_N, 77), [-5.0, 1.01 * peak_N])
    travel, in_range = compliance.travel_at(force)
    np.testing.assert_allclose(travel, 1e-3 * np.clip(force, 0, peak_N), atol=1e-12 * peak_N)
    assert in_range[:76].all()
    assert in_range[-2:].tolist() == [True, False]
    assert compliance.force[-1] == pytest.approx(peak_N, rel=1e-12)


def test_the_way_back_is_not_used():
    depth, force = push(50.0)
    back = np.linspace(50, 0, 100)
    up = compliance_of(
        np.concatenate([depth, depth[-1] - 3e-3 * (50 - back)]), np.concatenate([force, back]), 0.01
    )
    np.testing.assert_array_equal(up.travel, compliance_of(depth, force, 0.01).travel)


@pytest.mark.parametrize(
    ("good", "bad", "noise", "reason"),
    [
        ({"contact": 30}, {"contact": 29}, 0.01, remark("few-in-contact", found=29, wanted=30)),
        ({"in_air": 9, "contact": 30}, {"in_air": 9, "contact": 21}, 0.01, remark("few-in-contact", found=21, wanted=30)),
        ({"in_air": 9, "contact": 30}, {"in_air": 9, "contact": 20}, 0.01, remark("few-rigid", found=29, wanted=30)),
        # twenty times the noise
        ({"peak_N": 2.01}, {"peak_N": 1.99}, 0.1, remark("no-contact", newtons=pytest.approx(1.99), noise=0.1)),
    ],
)  # fmt: skip
def test_the_least_that_is_enough(good, bad, noise, reason):
    curve = compliance_of(*push(**{"peak_N": 50.0} | good), noise)
    assert curve.travel[-1] / curve.force[-1] == pytest.approx(1e-3, rel=1e-6)
    with pytest.raises(Refused) as caught:
        compliance_of(*push(**{"peak_N": 50.0} | bad), noise)
    assert caught.value.remark == reason


def test_travel_never_falls_and_begins_at_contact():
    # something gives way at 60 N: the plate goes back a little, which no machine's yielding does
    depth, force = push(100.0)
    depth = depth - np.where(force > 60, 0.02, 0.0)
    curve = compliance_of(depth, force, 0.01)
    assert (np.diff(curve.travel) >= 0).all()
    assert (curve.travel >= 0).all()
    np.testing.assert_allclose(curve.travel_at(np.array([20.0, 50.0]))[0], [0.02, 0.05], atol=1e-9)


def test_a_blow_shows_no_yielding():
    force = np.concatenate([np.zeros(40), np.linspace(100, 100.1, 40)])
    curve = compliance_of(np.concatenate([np.linspace(0, 1, 40), np.ones(40)]), force, 0.01)
    np.testing.assert_array_equal(curve.travel, 0)
    assert curve.force[-1] == pytest.approx(100, abs=0.1)
