"""Planned pushes narrow an interval by as much as promised, and more than random pushes do."""

import numpy as np
import pandas as pd
import pytest
from paper import few_draws

import rftfit
from rftfit import published_shapes
from rftfit.forces.planning import peaks
from rftfit.reference import MEDIA

PUSH = pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [0.3]})


def nodes_of(some_map):
    """Angles of the nodes on the lines of the paper's grid, degrees, shape (2, n)."""
    return np.degrees([some_map.beta, some_map.gamma])[:, : some_map.lines]


def root_of(covariance):
    values, vectors = np.linalg.eigh(covariance)
    return (vectors * np.sqrt(np.maximum(values, 0))).T


def places_of(plan, count, nodes_deg):
    """Nodes of the planned pushes."""
    directions = [pair for step in plan.steps[1 : count + 1] for pair in step.directions]
    off_deg = np.abs(nodes_deg.T - np.array(directions)[:, None]).max(axis=-1)
    assert off_deg.min(axis=1).max() < 0.01
    return off_deg.argmin(axis=1)


def usual_error(alpha):
    """Error of pushes that state none: 5 % of alpha, beside 1 % of the largest alpha."""
    return np.hypot(0.05 * alpha, 0.01 * np.abs(alpha).max())


def test_half_widths_are_those_of_the_conditional_covariance():
    """Of zeta, against one dense solve with all planned pushes at once."""
    start = rftfit.estimate_map(PUSH)
    plan = rftfit.plan("zeta", start, count=3)
    places = places_of(plan, 3, nodes_of(start))
    rows = start.factor.reshape(len(start.factor), -1)
    covariance = rows.T @ rows
    seen = np.concatenate([places, start.beta.size + places])
    noise = usual_error(start.alpha.ravel())[seen] ** 2
    middle = covariance[np.ix_(seen, seen)] + np.diag(noise)
    conditional = covariance - covariance[:, seen] @ np.linalg.solve(middle, covariance[seen])
    draws = root_of(conditional).reshape(-1, 2, start.beta.size)
    # zeta is the sum of the five terms of alpha_z
    moved, zeta = (start.coefficients(a)[..., :5].sum(axis=-1) for a in (draws, start.alpha))
    expected = 1.95996 * np.sqrt(((moved / zeta) ** 2).sum())
    assert plan.steps[3].half_width[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.statistics
@pytest.mark.parametrize("target", ["map", "zeta", "leg"])
def test_what_is_promised_is_found(target):
    """Published media, each pushed as planned and estimated by the others: the half width, beside what was promised."""
    plan_target = rftfit.model_leg("c_leg") if target == "leg" else target
    plan = rftfit.plan(plan_target, count=6)
    beta_deg, gamma_deg = np.transpose([step.directions[0] for step in plan.steps[1:]])
    random, ratios = np.random.default_rng(7), []
    for medium in MEDIA:
        profile = rftfit.published_medium(medium)
        alpha = np.array(profile.alpha(np.radians(beta_deg), np.radians(gamma_deg)))
        noise = usual_error(alpha)
        measured = alpha + noise * random.standard_normal(alpha.shape)
        names = "beta_deg", "gamma_deg", "alpha_z", "alpha_x", "se_z", "se_x"
        pushes = dict(zip(names, [beta_deg, gamma_deg, *measured, *noise], strict=True))
        estimated_map = rftfit.estimate_map(pushes, published_shapes(without=[medium]))
        again = rftfit.plan(plan_target, current_map=estimated_map, count=1)
        ratios.append(again.steps[0].overall / plan.steps[6].overall)
    # about a tenth less than promised
    assert np.median(ratios) == pytest.approx(0.9, abs=0.15)
    assert max(ratios) < 1.15


def test_a_rig_that_measures_on_the_way_back():
    rig = rftfit.Rig(pairs=True)
    plan = rftfit.plan("map", rig=rig, count=4)
    for step in plan.steps[1:]:
        if step.directions[0][1] > 0:
            (beta, gamma), (back_beta, back_gamma) = step.directions
            assert (back_beta, back_gamma) == (-beta, -gamma)
            assert step.runs == 2
    assert plan.table()["half_width_percent"].is_monotonic_decreasing


@few_draws()
def test_what_a_rig_cannot_push_is_not_planned():
    rig = rftfit.Rig(((0.0, 90.0), (30.0, 45.0)))
    steps = rftfit.plan("map", rig=rig, count=4).steps[1:]
    assert {step.directions[0] for step in steps} <= {(0.0, 90.0), (30.0, 45.0)}
    odd = rftfit.Rig(((12.0, 90.0), (30.0, 22.0)))
    assert set(rftfit.plan("map", rig=odd, count=3).table()["beta_deg"].dropna()) <= {12.0, 30.0}
    with pytest.raises(ValueError, match=r"\(12.0, 90.0\) .*beta_deg=\[12\], gamma_deg=\[90\]"):
        rftfit.plan("map", rftfit.estimate_map(PUSH), odd, count=1)
    current_map = rftfit.estimate_map(PUSH, beta_deg=[12], gamma_deg=[22])
    assert len(rftfit.plan("map", current_map, odd, count=2).steps) == 3
    half = rftfit.Rig(((12.5, 67.5),))
    current_map = rftfit.estimate_map(PUSH, beta_deg=[12.5], gamma_deg=[67.5])
    assert rftfit.plan("map", current_map, half, count=1).steps[1].directions == ((12.5, 67.5),)


def test_an_angle_of_a_rig_is_that_of_the_line_within_the_tolerance():
    """33.7 and 89.8 degrees are the lines 33.69 and 90: no line of a map can lie so near to a published one."""
    rig = rftfit.Rig(directions=((0.2, 89.8), (30.0, 33.7)))
    exact = rftfit.Rig(directions=((0.0, 90.0), (30.0, 33.690068)))
    plans = [rftfit.plan("zeta", rig=chosen, count=2) for chosen in (rig, exact)]
    near, at_line = (plan.table()["half_width_percent"] for plan in plans)
    np.testing.assert_allclose(near, at_line)
    with pytest.raises(ValueError, match=r"\(0.0, 34.5\) degrees is no node"):
        rftfit.plan("zeta", rftfit.estimate_map(PUSH), rftfit.Rig(directions=((0.0, 34.5),)))


def test_peaks_of_bodies_are_planned_for():
    legs = [rftfit.model_leg(name) for name in ("c_leg", "flat_leg")]
    plan = rftfit.plan(legs, count=2)
    assert plan.parts == tuple(
        f"{leg}, {peak}" for leg in ("c_leg", "flat_leg") for peak in ("lift", "horizontal")
    )
    assert plan.steps[2].half_width.shape == (4,)


def test_a_horizontal_force_near_zero_does_not_decide():
    """A level sole that is pressed straight down: its lift is alpha_z(0, 90), so a push there is the best."""
    middles_cm = np.arange(-1.75, 2.0, 0.5)
    level = np.column_stack([middles_cm, *np.tile([[0.0], [0.5], [0.0], [1.0]], middles_cm.size)])
    sole = rftfit.Outline(level, width_cm=3.0, name="sole")
    down = rftfit.path([0, 1, 2], [0, 0, 0], [0, -1, -2], [0, 0, 0])
    slanted = rftfit.path([0, 1, 2], [0, 0.01, 0.02], [0, -1, -2], [0, 0, 0])
    straight, near = (rftfit.plan([sole], count=2, motion=motion) for motion in (down, slanted))
    assert straight.steps[1].directions == near.steps[1].directions == ((0.0, 90.0),)
    np.testing.assert_allclose(straight.steps[2].half_width[1], 0, atol=1e-12)
    assert near.steps[0].overall == pytest.approx(straight.steps[0].overall, rel=0.02)
    lift = rftfit.predict(rftfit.estimate_map(PUSH), sole, down).iloc[-1]
    of_prediction = (lift["force_z_hi_N"] - lift["force_z_lo_N"]) / 2 / lift["force_z_N"]
    after_push = rftfit.plan([sole], rftfit.estimate_map(PUSH), count=1, motion=down).steps[0]
    assert after_push.overall == pytest.approx(of_prediction, rel=0.05)
    # one push has an error of 5 % by default, two of them its root
    assert straight.steps[2].half_width[0] == pytest.approx(
        straight.steps[1].half_width[0] / np.sqrt(2), rel=0.05
    )


def test_a_mesh_is_planned_for_as_the_outline_that_it_is_made_of():
    """A bent sheet that is pushed down and forward; with friction its forces are not linear, and its plan is another."""
    sheet = rftfit.model_leg("c_leg", 12)
    x_cm, z_cm = np.linspace([0, 0], [3, 4], 6).T
    in_plane = rftfit.path(np.arange(6), x_cm, -z_cm, np.zeros(6))
    position_cm = np.stack([x_cm, 0 * x_cm, -z_cm], axis=-1)
    in_space = rftfit.Motion3D(position_cm, [0.6, 0, -0.8])
    mesh = rftfit.Mesh.extrude(sheet)
    outline_plan = rftfit.plan(sheet, count=3, motion=in_plane)
    mesh_plan = rftfit.plan(mesh, count=3, motion=in_space)
    assert [step.directions for step in mesh_plan.steps] == [
        step.directions for step in outline_plan.steps
    ]
    for of_mesh, of_outline in zip(mesh_plan.steps, outline_plan.steps, strict=True):
        np.testing.assert_allclose(of_mesh.half_width, of_outline.half_width, rtol=0.01)
    smooth = rftfit.plan(peaks([mesh], in_space, friction=0.1), count=3)
    assert abs(smooth.steps[1].overall / mesh_plan.steps[1].overall - 1) > 0.1
    with pytest.raises(TypeError, match="a mesh moves in space"):
        rftfit.plan(mesh, count=1)
