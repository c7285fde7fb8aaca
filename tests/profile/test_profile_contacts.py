"""Forces measured on a body give alpha within its interval, and what tells nothing is refused.

Contact: forces on a body of known shape along a known motion. Also tested: what the model gets
wrong on a body is learned and removed.
"""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit import Contact, learn_body_error

LEG = rftfit.model_leg("c_leg", elements=12)
MOTION = rftfit.rotation(np.arange(-90.0, 91, 15))
SAND = rftfit.published_medium("poppy_LP")
ONE_PUSH = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.3]})
"""Straight down."""


def turned(medium="poppy_LP", motion=MOTION, factor=1.0, **options):
    """The leg in a published medium, by its table."""
    forces = rftfit.predict(rftfit.published_medium(medium), LEG, motion)
    both = {name: factor * forces[name].to_numpy() for name in ("force_z_N", "force_x_N")}
    return Contact(LEG, motion, both, errors=0.05, **options)


def vertical(estimate):
    """alpha_z(0, 90 deg) of a map: value, lower and upper end."""
    value = float(estimate.profile.alpha(0.0, np.pi / 2)[0])
    lo, hi = np.quantile(estimate.profile.spread.alpha(0.0, np.pi / 2)[0], [0.025, 0.975])
    return value, lo, hi


def test_weights_times_alpha_are_the_forces_of_the_program_in_the_plane_and_in_space():
    nodes = rftfit.scale(0.3)
    table = rftfit.TableProfile(*SAND.alpha(nodes.beta, nodes.gamma), nodes.beta, nodes.gamma)
    alpha = np.concatenate(SAND.alpha(nodes.beta, nodes.gamma))
    plate = rftfit.Mesh.extrude(rftfit.polyline([(-1, 0), (1, 0.5)], 2, elements=1))
    motion = rftfit.Motion3D([[0, 0, -2], [0, 0, -3]], [0.3, 0.2, -1])
    forces = rftfit.predict(table, plate, motion, model_error=0)
    in_space = Contact(plate, motion, forces, errors=0.1), forces
    for contact, forces in ((turned(), rftfit.predict(table, LEG, MOTION)), in_space):
        weights = contact.weights(nodes.beta, nodes.gamma)
        for row, name in enumerate(contact.components):
            assert_allclose(weights[row] @ alpha, forces[name], atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"force": {}}, "no force was measured"),
        ({"force": {"force_z_N": [1.0, np.nan, np.nan]}}, "1 pose with a force"),
        ({"motion": rftfit.rotation([0, 10, 20], hip_height_cm=9)}, "in the air"),
        ({"motion": rftfit.rotation([0, 10, 20], rate_rad_per_s=0)}, "never moves"),
        ({"errors": 0.0}, "above 0"),
        ({"force": {"force_z_N": [1.0, 2.0]}}, "one number for each of 3 poses"),
        ({"motion": rftfit.rotation([0, np.nan, 20])}, "is missing"),
    ],
)
def test_a_contact_that_tells_nothing_is_refused_with_its_reason(changes, words):
    given = {
        "body": LEG,
        "motion": rftfit.rotation([0, 10, 20]),
        "force": {"force_z_N": [1.0, 2.0, 3.0]},
        "errors": 0.1,
    }
    with pytest.raises(ValueError, match=words):
        Contact(**(given | changes))


def test_a_contact_refuses_the_motion_of_another_kind_of_body_as_predict_does():
    with pytest.raises(TypeError):
        Contact(LEG, rftfit.Motion3D([0, 0, -1], [0, 0, -1]), {}, 0.1)


def test_a_map_needs_something_and_a_medium_that_resists():
    with pytest.raises(ValueError, match="a push or a contact"):
        rftfit.estimate_map()
    with pytest.raises(ValueError, match="meet no resistance"):
        rftfit.estimate_map(contacts=[turned(factor=-1)])


def test_a_leg_alone_tells_alpha_and_beside_a_push_it_narrows_it():
    shapes = rftfit.published_shapes(["poppy_LP"])
    truth = float(SAND.alpha(0.0, np.pi / 2)[0])
    value, lo, hi = vertical(rftfit.estimate_map(shapes=shapes, contacts=[turned()]))
    assert lo < truth < hi
    assert 0.2 < (hi - lo) / 2 / value < 0.7
    alone = rftfit.estimate_map(ONE_PUSH.assign(se_z=0.15), shapes)
    both = rftfit.estimate_map(ONE_PUSH.assign(se_z=0.15), shapes, contacts=[turned()])
    # a direction that was pushed keeps what the push measured
    spread = [
        estimate.draws[..., ~estimate.measured].std(axis=0).mean() for estimate in (alone, both)
    ]
    assert spread[1] < 0.9 * spread[0]
    assert both.measurements == "1 push and 1 contact"


def test_forces_of_another_size_make_a_map_of_that_size():
    once, thrice = (
        vertical(rftfit.estimate_map(contacts=[turned(factor=factor)]))[0] for factor in (1, 3)
    )
    # the readings have the same error in both
    assert thrice / once == pytest.approx(3, rel=0.05)


def test_poses_of_one_body_share_the_models_error_so_a_repeat_narrows_nothing():
    alone, twice = (
        vertical(rftfit.estimate_map(contacts=contacts))
        for contacts in ([turned()], [turned(), turned()])
    )
    assert twice[2] - twice[1] == pytest.approx(alone[2] - alone[1], rel=0.1)


def test_from_one_medium_the_share_of_the_body_is_stated_and_from_none_refused():
    assert learn_body_error([(turned(), SAND)]).stated
    with pytest.raises(ValueError, match="one of them"):
        rftfit.predict(SAND, LEG, MOTION, model_error=0.1, body_error=rftfit.BodyError())
