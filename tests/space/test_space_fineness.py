"""A body of few parts has the forces of the same body finely cut."""

import numpy as np
import pytest
from makers import json_of
from scipy.spatial.transform import Rotation
from seeds import seeds

import rftfit

from .test_space_mesh import box, stl

SAND = rftfit.published_medium("glass0.3mm_CP")
TURN_RAD = np.linspace(0, 2 * np.pi, 73)
WITHIN = 0.02
"""Part of the largest force, or moment, by which a peak may be off."""


def block(*lengths_cm):
    """A block as CAD writes it: 12 triangles."""
    return rftfit.Mesh(*box(np.array(lengths_cm), np.zeros(3)), "block")


def turning(axis, travel_cm, height_cm):
    """One turn about an axis, one radian a second, while the body travels toward +x."""
    turns = np.outer(TURN_RAD, axis)
    position = np.outer(TURN_RAD, [travel_cm, 0, 0]) + np.array([0, 0, height_cm])
    return rftfit.Motion3D(position, [travel_cm, 0, 0], axis, Rotation.from_rotvec(turns))


def worst_peak(coarse, fine, names):
    """Largest difference of a peak of either sign over the largest of these forces."""
    largest = fine[names].abs().max(axis=None)
    ends = [(coarse[names].max() - fine[names].max()), (coarse[names].min() - fine[names].min())]
    return max(end.abs().max() for end in ends) / largest


TURNING_BOXES = [
    ((10, 4, 3), (0, 1, 0), 0.5, -2),
    ((12, 2, 1), (0, 0.6, 0.8), 0.5, -3),
    ((10, 4, 3), (0, 1, 0), 0.0, -6),
    ((6, 6, 6), (1, 0, 0), 0.3, -1),
]
"""Size, axis of turning, travel in a turn and height of the middle of boxes, cm."""


@pytest.mark.statistics
@pytest.mark.parametrize(
    ("size", "axis", "travel", "height"), seeds(TURNING_BOXES, TURNING_BOXES[:2])
)
def test_a_box_of_12_triangles_has_the_peaks_of_a_fine_one(size, axis, travel, height):
    coarse_box, motion = block(*size), turning(axis, travel, height)
    coarse, fine = (
        rftfit.predict(SAND, mesh, motion, model_error=0)
        for mesh in (coarse_box, coarse_box.refined(0.25))
    )
    forces, moments = (
        [f"{what}{axis}{unit}" for axis in "xyz"]
        for what, unit in (("force_", "_N"), ("moment_", "_N_cm"))
    )
    assert worst_peak(coarse, fine, forces) < WITHIN
    assert worst_peak(coarse, fine, moments) < WITHIN


@pytest.mark.parametrize("travel", [0.0, 0.5, 2.0])
def test_an_outline_of_one_element_has_the_peaks_of_many(travel):
    angle = np.linspace(0, 2 * np.pi, 181)
    rows = [travel * angle, -3 + 0 * angle, angle, travel + 0 * angle, 0 * angle, 1 + 0 * angle]
    motion = rftfit.Motion("turns", np.stack(rows, axis=1), {"turn_deg": np.degrees(angle)})
    few = rftfit.Outline(np.array([[0.0, 0.0, 1.0, 0.0, 5.0]]), width_cm=3)
    many = rftfit.polyline([(-5, 0), (5, 0)], width_cm=3, elements=2000)
    coarse, fine = (rftfit.predict(SAND, outline, motion, model_error=0) for outline in (few, many))
    assert worst_peak(coarse, fine, ["force_z_N", "force_x_N"]) < WITHIN
    assert worst_peak(coarse, fine, ["moment_N_cm"]) < WITHIN


def wedge():
    """A foot, 7 mm lower at its heel, of 12 triangles: its sole is two of them."""
    corners, faces = box(np.array([5, 3, 1.7]), np.array([0, 0, 0.85]))
    is_toe = (corners[:, 0] > 0) & (corners[:, 2] < 0.1)
    corners[is_toe, 2] = 0.7
    return rftfit.Mesh(corners, faces, "wedge")


def test_a_slanted_sole_of_two_triangles_has_its_moments_where_it_does_not_turn():
    # stress grows with depth, so the force acts below the middle of a face
    foot = wedge()
    press = rftfit.Motion3D.press(foot, 2.5)
    coarse, fine = (
        rftfit.predict(SAND, mesh, press, model_error=0) for mesh in (foot, foot.refined(0.15))
    )
    assert np.allclose(coarse["force_z_N"], fine["force_z_N"], rtol=1e-9)
    assert worst_peak(coarse, fine, ["moment_x_N_cm", "moment_y_N_cm"]) < WITHIN / 4
    # the wedge is its own mirror image in y
    assert coarse["moment_x_N_cm"].abs().max() < 1e-3 * coarse["moment_y_N_cm"].max()


def answer_in(folder, mesh, words):
    """What a command prints about a mesh in loose poppy seeds."""
    pytest.importorskip("trimesh")
    stl(folder, mesh)
    command, _, options = words.partition(" ")
    words = (command, "--mesh", "ball.stl", "--unit", "mm", "--medium", "poppy_LP")
    return json_of(*words, *options.split(), folder=folder)


def test_the_command_says_how_many_triangles_were_made_of_how_many(tmp_path):
    head = "t_s,x_cm,y_cm,z_cm,turn_x_deg,turn_y_deg,turn_z_deg\n"
    rows = "".join(f"{t},{t},0,-2,0,{90 * t},0\n" for t in range(4))
    (tmp_path / "path.csv").write_text(head + rows)
    answer = answer_in(tmp_path, block(10, 4, 3), "predict --path path.csv")
    assert answer["triangles_given"] == 12
    assert answer["triangles"] > 100
    assert f"{answer['triangles']} triangles, made of 12" in answer["mesh"]


@pytest.mark.parametrize("command", ["predict --roll 1,0.2", "wheel --slip 0.2 --sinkage 1"])
@pytest.mark.parametrize(("options", "rim"), [("", "farthest-point"), (" --rim 4", "given")])
def test_the_command_states_the_rim_and_its_source(tmp_path, command, options, rim):
    wheel = rftfit.Mesh.wheel(4, 3, lug_cm=1, lugs=12)
    answer = answer_in(tmp_path, wheel, command + options)
    assert answer["rim_from"] == rim
    if "rim_cm" in answer:
        assert answer["rim_cm"] == pytest.approx(4 if options else 5)
