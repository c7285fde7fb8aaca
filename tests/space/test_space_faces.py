"""Forces on faces and meshes in space agree with published vectors, plain numpy and symmetry."""

from io import StringIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshforces import mesh_forces
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from seeds import seeds

import rftfit
from rftfit import FourierProfile, Mesh, Motion3D
from rftfit.forces import faces
from rftfit.forces.space import compiled_mesh_forces

from .test_space_mesh import box

POPPY = rftfit.TableProfile.published("poppy_LP")
UNIT = rftfit.rft3d_profile(0.87504, friction=0.4)  # xi = 1
"""3D-RFT of a medium of unit strength."""

VECTORS = np.loadtxt(
    StringIO("""
 0 0 -1          0 0 -1        0 0 0.350930                    0 0 0.875040
 1 0 0           1 0 0         -0.071280 0 0.009457            -0.191850 0 0.074620
 1 0 0           0 1 0         0 -0.015925 0                   0.002120 -0.067960 0.026340
 .6 0 -.8        .8 0 -.6      -0.102892 0 0.146587            -0.371078 0 0.576288
 .6 0 -.8        0 .8 -.6      -0.044816 -0.043030 0.115830    -0.178931 -0.274613 0.567569
 .36 .48 -.8     -.6 0 -.8     0.001101 -0.040590 0.163412     0.126798 -0.142861 0.670820
 .48 .6 .64      .6 .64 .48    -0.017011 -0.018376 -0.010961   -0.108214 -0.121036 0.016086
 .6 .8 0         1 0 0         -0.035853 -0.026570 0.005674    -0.235004 -0.135797 0.041528
 0 .6 -.8        .48 .64 -.6   -0.025818 -0.090624 0.138638    -0.164346 -0.364415 0.609791
 0 0 1           0 0 1         0 0 -0.009094                   0 0 -0.079660
""")
).reshape(-1, 4, 3)
"""Normal and velocity of a face, and its alpha by the measured law and by 3D-RFT."""


def test_faces():
    normal, velocity, measured, rft3d = VECTORS.swapaxes(0, 1)
    assert_allclose(faces.face_alpha(POPPY, normal, velocity), measured, atol=1e-6)
    assert_allclose(faces.face_alpha(UNIT, normal, 2 * velocity, "3d-rft"), rft3d, atol=6e-7)


def triangle(*heights):
    """Corners above (0, 0), (3, 0) and (0, 3) of the plane."""
    return np.array(
        [[x, y, z] for (x, y), z in zip([(0, 0), (3, 0), (0, 3)], heights, strict=True)]
    )


@pytest.mark.parametrize(
    ("heights", "share", "centroid"),
    [
        # whole, and whole with an edge or a corner on the surface: the mean of the corners
        ((-1, -1, -1), 1, (1, 1, -1)),
        ((-3, 0, 0), 1, (1, 1, -1)),
        ((0, -3, -3), 1, (1, 1, -2)),
        # in the air, and standing on the surface
        ((1, 2, 3), 0, None),
        ((0, 0, 3), 0, None),
        ((3, -1e-20, -1e-20), 0, None),
        # a tip that is a third as large each way: 1/9, its centroid a third of the way from its corner
        ((-1, 2, 2), 1 / 9, (1 / 3, 1 / 3, -1 / 3)),
        # the rest of it: (9 (1, 1, -1) - (1/3, 1/3, 1/3)) / 8
        ((1, -2, -2), 8 / 9, (13 / 12, 13 / 12, -7 / 6)),
    ],
)
def test_the_submerged_part_of_a_triangle(heights, share, centroid):
    """The weights of the parts times their centroids make the mean of the corners."""
    wet, centre = faces.submerged_parts(triangle(*heights))
    assert wet == pytest.approx(share, abs=1e-12)
    assert np.isfinite(centre).all()
    if centroid:
        assert_allclose(centre, centroid, atol=1e-12)


def slipping():
    a = np.radians(15)
    return Motion3D([0, 0, 3.25], [np.cos(a), np.sin(a), 0], [0, 1 / 6.25, 0])


def leg_at(theta_deg, velocity=(0, 0, 0), rate=0.2):
    turned = Rotation.from_rotvec([0, np.radians(theta_deg), 0])
    return Motion3D([0, 0, 2], velocity, [0, rate, 0], turned)


SINKING = Motion3D([0, 0, -1], [1, 0.3, -0.5], [0.1, 0.4, -0.2])
LEG = Mesh.extrude(rftfit.model_leg("c_leg"))


BODIES = {
    "sphere 64": (Mesh.sphere(2, 64), SINKING,
                  (-1.565907, -0.734335, 4.208601, -1.459321, -0.867027, 0.353756)),
    "wheel 192": (Mesh.cylinder(6.25, 6, 192), slipping(),
                  (-3.473274, -3.741298, 14.159593, -20.007744, -15.535065, -4.499362)),
    "leg": (LEG, leg_at(-40), (4.894529, 0, 8.097347, -0.070094, -44.495996, 0.032795)),
    "leg aside": (LEG, leg_at(-40, (0, 0.3, 0)),
                  (4.733959, -0.842351, 7.950653, -5.196937, -43.371511, -1.468956)),
    "sphere by 3D-RFT": (Mesh.sphere(2, 128), SINKING,
                         (-2.780853, -1.186514, 6.271999, -1.404455, -1.179153, 0.581460)),
}  # fmt: skip


@pytest.mark.parametrize("name", BODIES)
def test_bodies(name):
    mesh, motion, expected = BODIES[name]
    law = ("3d-rft", 0.4) if "3D-RFT" in name else ()
    assert_allclose(compiled_mesh_forces(POPPY, mesh, motion, *law)[0, :6], expected, atol=1e-5)


HOLED = np.reshape(POPPY.cells[2:], (2, 91)).copy()
HOLED[[0, 1], [10, 60]] = np.nan
PROFILES = {
    "table": POPPY,
    "holes": rftfit.TableProfile(*HOLED.reshape(2, 7, 13)),
    "nine terms": rftfit.published_medium("poppy_LP", "fourier"),
    "depth only": rftfit.published_medium("poppy_LP", "depth_only"),
}


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("law", ["measured", "3d-rft"])
@pytest.mark.parametrize("friction", [None, 0.3])
def test_compiled_and_plain_agree(profile, law, friction):
    wheel, lugged = Mesh.cylinder(6.25, 6, 24), Mesh.wheel(3, 2, lug_cm=1, lugs=8)
    rolling = [
        (mesh, Motion3D.roll(mesh, 1.5, slip, 3))
        for mesh in (wheel, lugged)
        for slip in (-0.4, 0.8)
    ]
    bodies = (Mesh.sphere(2, 12), SINKING), (wheel, slipping()), (LEG, leg_at(35)), *rolling
    for body in bodies:
        compiled = compiled_mesh_forces(PROFILES[profile], *body, law, friction)[:, :6]
        plain = mesh_forces(PROFILES[profile], *body, law, friction)
        largest = abs(plain).max(initial=1, where=np.isfinite(plain))
        assert_allclose(compiled, plain, rtol=0, atol=1e-12 * largest)


angle = st.floats(-np.pi, np.pi)
PROPERTY = settings(max_examples=seeds(60, 15))


def vector(tilt, turn):
    return np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])


@pytest.mark.statistics
@PROPERTY
@given(tilt=angle, turn=angle, first_azimuth=angle, second_azimuth=angle)
def test_the_law_is_continuous_at_level_faces_and_vertical_motion(
    tilt, turn, first_azimuth, second_azimuth
):
    any_one, tiny = vector(tilt, turn), 1e-7
    for profile in (POPPY, PROFILES["nine terms"]):
        for pole in (0.0, np.pi):
            near = [vector(pole + tiny, a) for a in (first_azimuth, second_azimuth)]
            # a level face whatever way it is tilted; motion straight up or down whatever way it leans
            level = [faces.face_alpha(profile, n, any_one) for n in near]
            vertical = [faces.face_alpha(profile, any_one, v) for v in near]
            assert_allclose(level[0], level[1], atol=1e-6)
            assert_allclose(vertical[0], vertical[1], atol=1e-6)


def test_an_error_is_as_large_as_what_faces_bear_in_its_direction():
    """A slab that is pressed straight down bears nothing aside: there its error is the floor alone."""
    slab = block(4, 4, 1)
    down = Motion3D.press(slab, 3, 5)
    table = rftfit.predict(POPPY, slab, down)
    half = {
        axis: (table[f"force_{axis}_model_hi_N"] - table[f"force_{axis}_model_lo_N"]) / 2
        for axis in "xyz"
    }
    load = table["force_z_N"].to_numpy()
    floor = 0.2 * load.max()
    expected = 1.959964 * 0.39 * np.hypot(load, floor)
    # ends of an interval lie between two of a thousand draws
    assert_allclose(half["z"], expected, rtol=1e-2)
    for axis in "xy":
        assert_allclose(half[axis], 1.959964 * 0.39 * floor, rtol=1e-2)


def test_missing_numbers_say_why():
    poses = Motion3D(np.array([[0, 0, -1], [0, 0, np.nan], [0, 0, 5]]), [0, 0, -1])
    table = rftfit.predict(POPPY, Mesh.sphere(1, 8), poses)
    assert table["reason"].ne("").tolist() == [False, True, False]
    assert np.isnan(table["force_z_N"][1])
    assert table["force_z_N"][2] == 0
    table = rftfit.predict(FourierProfile(np.full(9, np.nan)), Mesh.sphere(1, 8), SINKING)
    assert table["reason"].ne("").all()


def test_the_closure_errs_as_stated_where_3d_rft_is_the_truth():
    """3D-RFT in the plane is the map; on 20,000 random leading faces the measured law is beside 3D-RFT itself."""
    normal, velocity = np.random.default_rng(3).standard_normal((2, 20_000, 3))
    normal *= np.sign((normal * velocity).sum(axis=-1))[:, None]
    beta, gamma = np.radians(np.arange(-90, 91.0)), np.radians(np.arange(-180, 181.0))
    b, g = np.meshgrid(beta, gamma, indexing="ij")
    motion = np.stack([-np.cos(g), 0 * g, -np.sin(g)], axis=-1)
    plate = np.stack([np.sin(b), 0 * b, np.cos(b)], axis=-1)
    plate *= np.where((plate * motion).sum(axis=-1) < 0, -1, 1)[..., None]
    alpha = faces.face_alpha(UNIT, plate, motion, "3d-rft")
    plane = rftfit.TableProfile.of_nodes(beta, gamma, (alpha[..., 2], alpha[..., 0]))
    truth = faces.face_alpha(UNIT, normal, velocity, "3d-rft")
    off = faces.face_alpha(plane, normal, velocity) - truth
    off /= np.hypot(alpha[..., 2], alpha[..., 0]).max()
    down = (normal[:, 2] < 0) & (velocity[:, 2] < 0)
    level = normal[:, 2] < -np.cos(np.radians(30)) * np.linalg.norm(normal, axis=-1)
    for chosen, rms, worst in (
        (down | True, 0.044, 0.23),
        (down, 0.061, 0.23),
        (down & level, 0.028, 0.15),
    ):
        assert np.sqrt((off[chosen] ** 2).mean()) == pytest.approx(rms, abs=0.001)
        assert np.linalg.norm(off[chosen], axis=-1).max() == pytest.approx(worst, abs=0.006)


# --- Faces that move along themselves


def block(*lengths_cm):
    """A solid block about (0, 0, 0)."""
    return Mesh(*box(np.array(lengths_cm), np.zeros(3)), "block")


def force_on(mesh, velocity, turned_deg=0.0):
    """Force on a mesh in one pose, turned about y."""
    turn = Rotation.from_euler("y", turned_deg, degrees=True).as_matrix()
    motion = Motion3D([[0, 0, -3]], [velocity], [[0, 0, 0]], [turn])
    return compiled_mesh_forces(POPPY, mesh, motion)[0, :6]


@pytest.mark.parametrize("velocity", [(1, 0, 0), (0, 0, -1), (0.6, 0.8, 0)])
def test_rounding_does_not_decide_which_faces_of_a_block_bear(velocity):
    foot = block(9, 5, 1.5)
    forces = force_on(foot, velocity)
    for change in 1e-12 * np.vstack([np.eye(3), -np.eye(3)]):
        assert_allclose(force_on(foot, np.array(velocity) + change), forces, atol=1e-6)
    assert_allclose(force_on(foot, velocity, turned_deg=1e-9), forces, atol=1e-5)
    one_pose = Motion3D([[0, 0, -3]], [velocity], [[0, 0, 0]], [np.eye(3)])
    assert_allclose(mesh_forces(POPPY, foot, one_pose)[0], forces, atol=1e-9)


@pytest.mark.parametrize("velocity", [(1, 0, 0), (-1, 0, 1e-9), (1, 0, -0.1), (0, 0, -1)])
@pytest.mark.parametrize("turned_deg", [0, 30, 90])
def test_a_thin_block_is_a_plate(velocity, turned_deg):
    """Whichever way it moves, along itself too: its two faces bear together what a sheet does."""
    plate = Mesh.extrude(rftfit.polyline([(-2, 0), (2, 0)], 5, 40))
    thin = force_on(block(4, 5, 1e-4), velocity, turned_deg=turned_deg)
    of_plate = force_on(plate, velocity, turned_deg=turned_deg)
    assert_allclose(thin[:3], of_plate[:3], atol=2e-3)


def test_a_block_that_sinks_a_little_askew_bears_what_one_does_that_sinks_straight():
    foot = block(9, 5, 1.5)
    straight = force_on(foot, (0, 0, -1))
    for turned_deg in (0.001, 0.01, 0.1):
        assert_allclose(
            force_on(foot, (0, 0, -1), turned_deg=turned_deg)[2], straight[2], rtol=0.01
        )


@pytest.mark.parametrize("velocity", [(1, 0), (0, -1), (1, -0.05)])
def test_a_thin_skin_in_the_plane_is_a_line(velocity):
    line = rftfit.polyline([(-2, 0), (2, 0)], 5, 40)
    skin = rftfit.polyline([(-2, 0), (2, 0), (2, 1e-4), (-2, 1e-4), (-2, 0)], 5, 80)
    poses = np.array([[0, -3, 0, *velocity, 0]])
    motion = rftfit.Motion("a pose", poses, {"t_s": np.zeros(1)})
    of_line, of_skin = (
        rftfit.predict(POPPY, outline, motion, model_error=0) for outline in (line, skin)
    )
    for name in ("force_z_N", "force_x_N"):
        assert_allclose(of_skin[name], of_line[name], atol=2e-3)
