"""Peaks of a mesh that moves in the plane are those of its outline: steepness, and shares near pushes."""

import numpy as np
import pytest
from paper import few_draws
from scipy.spatial.transform import Rotation

import rftfit
from rftfit.forces import prediction
from rftfit.forces.force_answer import ForceAnswer

THETA_DEG = np.arange(-60.0, 1.0, 10.0)


def in_space(heading_deg):
    """Rotation of a leg about an axle, headed to an angle from x."""
    heading = Rotation.from_rotvec(np.radians([0, 0, heading_deg]))
    turned = Rotation.from_rotvec(np.radians(np.multiply.outer(THETA_DEG, [0, 1, 0])))
    rate = heading.apply([0, 0.2, 0])
    position = np.broadcast_to([0, 0, 2.0], (len(THETA_DEG), 3))
    return rftfit.Motion3D(position, [0, 0, 0], rate, heading * turned)


def peaks_of(body, motion):
    """Peaks of a body in a sand that one push told, and shares of their forces near it."""
    answer = ForceAnswer(rftfit.scale(0.35).profile, body, motion)
    return {peak.name: peak for peak in answer.peaks}, answer


@few_draws()
@pytest.mark.parametrize("name", ["reversed_c_leg", "c_leg"])
@pytest.mark.parametrize("heading_deg", [0, 35])
def test_a_sheet_in_the_plane_is_as_steep_as_its_outline(name, heading_deg):
    leg = rftfit.model_leg(name)
    in_plane, plane = peaks_of(leg, rftfit.rotation(THETA_DEG))
    of_sheet, space = peaks_of(rftfit.Mesh.extrude(leg), in_space(heading_deg))
    lift, up = in_plane["lift"], of_sheet["force_z"]
    assert up.value == pytest.approx(lift.value, rel=0.01)
    assert up.steepness == pytest.approx(lift.steepness, rel=0.05, abs=1e-3)
    assert up.withheld == lift.withheld == ("steep" if name == "reversed_c_leg" else "")
    assert np.isnan(up.lo) == bool(up.withheld)
    assert np.isfinite(up.model_lo)
    share = plane.shares_near_pushes["lift"]
    assert space.shares_near_pushes["force_z"] == pytest.approx(share, abs=0.01)
    assert ("largest force z: no interval of alpha" in space.summary()) == bool(up.withheld)
    assert f"largest force z {100 * share:.0f} %" in space.summary()


@few_draws()
def test_friction_of_a_mesh_counts_in_its_steepness():
    """A smooth ball that is dragged bears by its normal stress alone, whose direction no error of alpha turns."""
    ball = rftfit.Mesh.cylinder(radius_cm=2, width_cm=3, facets=24)
    motion = rftfit.Motion3D([[0, 0, -1]], [[1, 0, 0]])
    profile = rftfit.scale(0.35).profile
    [rough], [smooth] = (
        [
            peak.steepness
            for peak in ForceAnswer(profile, ball, motion, friction=friction).peaks
            if peak.name == "force_z"
        ]
        for friction in (None, 0.0)
    )
    assert rough != pytest.approx(smooth, rel=0.01)


def test_3d_rft_takes_alpha_in_one_direction_and_no_steepness():
    leg = rftfit.Mesh.extrude(rftfit.model_leg("reversed_c_leg"))
    peaks = prediction.predict_with_peaks(rftfit.scale(0.35), leg, in_space(0), law="3d-rft")[1]
    assert not [peak.name for peak in peaks if peak.withheld]
