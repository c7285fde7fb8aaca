"""Forces on bodies in the plane and in space, the robot, and forces as measurements; against sums by hand."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit

POPPY = rftfit.published_medium("poppy_LP")
ALPHA_DOWN = float(POPPY.alpha(0.0, math.pi / 2)[0])
LEGS = {"c_leg": 1.0, "flat_leg": 0.0, "reversed_c_leg": -1.0}
AXES = ("force_x_N", "force_y_N", "force_z_N")


def down(depths_cm):
    """Straight down through these depths."""
    times = np.arange(len(depths_cm), dtype=float)
    return rftfit.path(times, 0 * times, -np.asarray(depths_cm, dtype=float), 0 * times)


@pytest.mark.parametrize("name", LEGS)
def test_a_model_leg(name):
    leg = rftfit.model_leg(name)
    assert isinstance(leg, rftfit.Outline)
    length = 7.62 * (math.pi / 2 if LEGS[name] else 1)
    assert leg.area_cm2 == pytest.approx(length * 2.54)
    assert_allclose(rftfit.arc(LEGS[name]).body, leg.body)
    side = -np.sign(LEGS[name])
    assert (np.sign(leg.body[:, 0].round(12)) == side).all()
    with pytest.raises(KeyError):
        rftfit.model_leg(f"{name}s")


@pytest.mark.parametrize(
    "words",
    [
        {"curvature_times_R": 1.01},
        {"curvature_times_R": math.nan},
        {"curvature_times_R": 0.0, "elements": 0},
        {"curvature_times_R": 0.0, "max_length_cm": -1.0},
        {"curvature_times_R": 0.0, "width_cm": 0.0},
    ],
)
def test_an_arc_that_cannot_be(words):
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.arc(**words)


def test_a_polyline_has_the_length_of_its_pieces():
    scoop = rftfit.polyline([(-2, 0), (0, -1), (2, 0)], width_cm=5, elements=8)
    assert scoop.area_cm2 == pytest.approx(5 * 2 * math.sqrt(5))
    assert not scoop.solid
    assert rftfit.polyline([(0, 0), (1, 0), (0, 1), (0, 0)], 2).solid
    for points in ([(0, 0)], [(0, 0), (0, 0)]):
        with pytest.raises(ValueError, match=r"\w"):
            rftfit.polyline(points, 2)


def test_a_plate_pushed_down_by_hand():
    plate = rftfit.polyline([(-1, 0), (1, 0)], width_cm=3, elements=1)
    forces = rftfit.predict(POPPY, plate, down([1, 2, 3]))
    assert [*forces["t_s"]] == [0, 1, 2]
    assert_allclose(forces["force_z_N"], ALPHA_DOWN * 6 * np.array([1, 2, 3]), rtol=1e-9)
    assert_allclose(forces["force_x_N"], POPPY.alpha(0, math.pi / 2)[1] * 6 * np.arange(1, 4))
    assert_allclose(forces["moment_N_cm"], 0, atol=1e-9)
    assert {*forces["reason"]} == {""}


def test_the_model_error_widens_the_interval():
    plate = rftfit.polyline([(-1, 0), (1, 0)], width_cm=3, elements=1)
    small, large, none = (
        rftfit.predict(POPPY, plate, down([1, 2, 3]), model_error=error) for error in (0.1, 0.3, 0)
    )
    width = [
        (table["force_z_model_hi_N"] - table["force_z_model_lo_N"]).to_numpy()
        for table in (small, large)
    ]
    assert (width[1] > 2 * width[0]).all()
    assert "force_z_model_lo_N" not in none
    assert_allclose(small["force_z_N"], none["force_z_N"])


def test_motions():
    turned = rftfit.rotation([-30, 0, 30], hip_height_cm=1.5)
    assert isinstance(turned, rftfit.Motion)
    assert [*turned.columns["theta_deg"]] == [-30, 0, 30]
    assert_allclose(turned.poses[:, 1], 1.5)
    assert rftfit.rotation().poses.shape[0] == 271
    for times in ([0.0], [0.0, 0.0], [1.0, 0.0]):
        with pytest.raises(ValueError, match=r"\w"):
            rftfit.path(times, times, times, times)


@pytest.mark.parametrize(("depths_cm", "limits"), [([1, 1.2], 0), ([1, 200], 3)])
def test_deeper_than_alpha_was_measured(depths_cm, limits):
    leg = rftfit.model_leg("c_leg")
    assert len(rftfit.beyond_measured(POPPY, leg, down(depths_cm))) == limits


@pytest.mark.parametrize("ask", [rftfit.predict, rftfit.find_peaks])
def test_a_prediction_warns_of_each_limit_at_the_line_that_asks_for_it(ask):
    body = rftfit.polyline([(0, 0), (0, -30)], 2.54, elements=30)
    limits_left = rftfit.beyond_measured(POPPY, body)
    assert limits_left
    with pytest.warns(rftfit.LimitWarning) as told:
        ask(POPPY, body)
    assert [str(warning.message) for warning in told] == limits_left
    assert {warning.filename for warning in told} == {__file__}


@pytest.mark.parametrize(
    ("mesh", "area"),
    [
        (lambda: rftfit.Mesh.cylinder(radius_cm=3, width_cm=4), 2 * math.pi * 3 * (3 + 4)),
        (lambda: rftfit.Mesh.sphere(2), 4 * math.pi * 4),
    ],
)
def test_a_mesh_has_its_area(mesh, area):
    assert mesh().area_cm2 == pytest.approx(area, rel=0.01)


def test_an_open_mesh_is_refused():
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.Mesh([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])


def test_ground_is_the_prediction():
    ball = rftfit.Mesh.sphere(2)
    ground = rftfit.Ground(POPPY, [ball], triangle_cm=10, delta_mm=0, tau_s=0)
    forces = ground.step([[0, 0, 1]], np.eye(3), [[0, 0, -10]], [[0, 0, 0]], 0.001)
    pressed = rftfit.predict(POPPY, ball, rftfit.Motion3D([0, 0, 1], [0, 0, -10]))
    assert_allclose(forces[0, :3], pressed[[*AXES]].iloc[0], rtol=1e-6, atol=1e-9)
    with pytest.raises(rftfit.RftfitError):
        rftfit.Ground(POPPY, [])


def test_forces_on_a_leg_are_measurements():
    leg, motion = rftfit.model_leg("c_leg"), rftfit.rotation([-60, -30, 0, 30, 60])
    turned = rftfit.predict(POPPY, leg, motion, model_error=0)
    contact = rftfit.Contact(leg, motion, turned, errors=0.2)
    estimated = rftfit.estimate_map(contacts=[contact])
    assert (estimated.contacts, estimated.pushes) == (1, 0)
    _, low, high = estimated.zeta
    assert low < float(POPPY.alpha(0.0, math.pi / 2)[0]) / 1.23 < high
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.Contact(leg, rftfit.rotation([-60, 0], hip_height_cm=30), {"force_z_N": [0, 0]}, 0.2)


def test_what_the_model_gets_wrong_on_a_body_is_learned():
    leg, motion = rftfit.model_leg("c_leg"), rftfit.rotation([-60, -45, -30, -15, 0])
    exact = rftfit.predict(POPPY, leg, motion, model_error=0)
    pairs = []
    for medium in ("poppy_LP", "poppy_CP"):
        profile = rftfit.published_medium(medium)
        forces = (
            1.2 * rftfit.predict(profile, leg, motion, model_error=0)[["force_z_N", "force_x_N"]]
        )
        contact = rftfit.Contact(leg, motion, forces, errors=0.1, name=medium)
        pairs.append((contact, profile))
    learned = rftfit.learn_body_error(pairs)
    assert isinstance(learned, rftfit.BodyError)
    assert not learned.stated
    assert learned.media == ("poppy_LP", "poppy_CP")
    assert rftfit.BodyError().per_medium == 0.42
    corrected = rftfit.predict(POPPY, leg, motion, body_error=learned)["force_z_N"]
    # a body that was pushed back 1.2 times as hard as the model says is predicted so
    share = (corrected / exact["force_z_N"]).to_numpy()
    assert (np.abs(share[:3] - 1.2) < 0.1).all()
    with pytest.raises(ValueError, match=r"\w"):
        rftfit.learn_body_error([])


@pytest.mark.parametrize(
    ("body", "motion"),
    [
        (rftfit.model_leg("c_leg"), rftfit.Motion3D([0, 0, -1], [0, 0, -1])),
        (rftfit.Mesh.sphere(1), rftfit.rotation()),
    ],
)
def test_a_motion_belongs_to_its_body(body, motion):
    with pytest.raises(TypeError):
        rftfit.predict(POPPY, body, motion)
    with pytest.raises(TypeError):
        rftfit.predict(0.9, body, motion)  # type: ignore[arg-type]


def test_the_robot_walks():
    slow, fast = (rftfit.simulate(POPPY, frequency) for frequency in (1.0, 2.0))
    assert (slow.outcome, fast.outcome) == ("steady", "steady")
    assert 0 < slow.speed_cm_per_s < fast.speed_cm_per_s
    # never faster than its feet: 2R = 7.62 cm, half a turn on the ground a stride
    assert fast.speed_cm_per_s < 2 * math.pi * 7.62 * 2.0
    for wrong in (101.0, math.inf, math.nan):
        with pytest.raises(ValueError, match=r"\w"):
            rftfit.simulate(POPPY, wrong)


# --- a rolling wheel


def test_a_wheel_at_its_load():
    wheel = rftfit.Mesh.cylinder(6, 5, facets=24)
    answer = rftfit.wheel(POPPY, wheel, 0.3, sinkage_cm=1.5)
    assert isinstance(answer, rftfit.WheelAnswer)
    mean = rftfit.predict(
        POPPY, wheel, rftfit.Motion3D.roll(wheel, 1.5, 0.3, 73), model_error=0
    ).mean(numeric_only=True)
    row = answer.table.iloc[0]
    assert row["drawbar_N"] == pytest.approx(mean["force_x_N"])
    assert row["load_N"] == pytest.approx(mean["force_z_N"])
    solved = rftfit.wheel(POPPY, wheel, 0.3, load_N=row["load_N"]).table.iloc[0]
    assert solved["sinkage_cm"] == pytest.approx(1.5, rel=1e-3)
    twice = rftfit.wheel(POPPY, wheel, 0.3, sinkage_cm=1.5, load_N=2 * row["load_N"]).table.iloc[0]
    assert twice["drawbar_N"] == pytest.approx(2 * row["drawbar_N"])
    assert twice["alpha_of_load_N_per_cm3"] == pytest.approx(2 * ALPHA_DOWN)
    measured = answer.table[["slip", "drawbar_N", "load_N"]]
    panels = rftfit.draw_wheel(answer, measured).axes
    drawn = np.asarray(panels[0].lines[0].get_ydata())
    assert drawn == pytest.approx([row["drawbar_N"]])
    with pytest.raises(ValueError, match="sinkage"):
        rftfit.wheel(POPPY, wheel, 0.3)


def test_a_smooth_wheel_has_no_rule_and_a_lugged_one_has():
    smooth = rftfit.Mesh.cylinder(6, 5, facets=24)
    # every second rim vertex farther out: teeth
    out = smooth.vertices_cm.copy()
    turn = np.round(np.degrees(np.arctan2(out[:, 0], out[:, 2])) / 15).astype(int)
    on_rim = np.hypot(out[:, 0], out[:, 2]) > 5.9
    out[on_rim & (turn % 2 == 0)] *= [1.15, 1, 1.15]
    lugged = rftfit.Mesh(out, smooth.faces)
    rules = [rftfit.wheel(POPPY, mesh, 0.3, sinkage_cm=1).rule for mesh in (smooth, lugged)]
    assert rules == ["none", "own-track"]
    assert rftfit.wheel(POPPY, lugged, 0.3, sinkage_cm=1, track=False).rule == "none"
    ground = rftfit.Ground(POPPY, [lugged, smooth], wheels=[0, 1], triangle_cm=9)
    assert ground.rules == ("own-track", "none")
