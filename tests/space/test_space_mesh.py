"""Meshes that cannot be used are refused or mended, and say so; intervals and closure of a prediction."""

from __future__ import annotations

import numpy as np
import pytest

import rftfit
from rftfit.errors import InputError
from rftfit.model.mesh import Mesh, Motion3D
from rftfit.model.mesh_prediction import CLOSURE, mesh_forces

POPPY = rftfit.TableProfile.published("poppy_LP")
BALL = Mesh.sphere(2, 8)
MOTION = Motion3D([0, 0, -1], [1, 0.3, -0.5], [0.1, 0.4, -0.2])


def stl(tmp_path, mesh, scale=10.0):
    lines = ["solid x"]
    for triangle in scale * mesh.triangles:
        corners = "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in triangle)
        lines.append(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet")
    file = tmp_path / "ball.stl"
    file.write_text("\n".join([*lines, "endsolid x\n"]))
    return file


BAD = {
    "open": (lambda v, f: (v, f[1:]), "belong to one face only"),
    "one face turned": (lambda v, f: (v, [f[0][::-1], *f[1:]]), "turned over"),
    "walls": (lambda v, f: (v, [*f, [f[0][0], f[0][1], 50]]), "belong to"),
    "no such vertex": (lambda v, f: (v, f + len(v)), "faces name vertices"),
    "not finite": (lambda v, f: (v * np.nan, f), "finite vertices"),
    "a hollow": (lambda v, f: (np.vstack([v, v / 2]), np.vstack([f, f[:, ::-1] + len(v)])), "hollow"),
    "a point": (lambda v, f: (0 * v, f), "one point"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_refused(case):
    change, words = BAD[case]
    with pytest.raises(ValueError, match=words):
        Mesh(*change(BALL.vertices_cm, BALL.faces))


MENDED = {
    "inverted": (lambda v, f: (v, f[:, ::-1]), "inside out"),
    "doubled": (lambda v, f: (v, np.vstack([f, f[:5]])), "5 faces that were there twice"),
    "degenerate": (lambda v, f: (v, np.vstack([f, [[1, 1, 2]]])), "1 faces without area"),
}


@pytest.mark.parametrize("case", MENDED)
def test_mended_with_a_word_to_the_same_forces(case):
    change, words = MENDED[case]
    with pytest.warns(UserWarning, match=words):
        mesh = Mesh(*change(BALL.vertices_cm, BALL.faces))
    assert len(mesh.notes) == 1
    found, expected = (mesh_forces(POPPY, one, MOTION) for one in (mesh, BALL))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_files(tmp_path):
    pytest.importorskip("trimesh")
    file = stl(tmp_path, BALL)
    found = Mesh.read(file, unit="mm")
    assert found.name == "ball"
    assert found.faces.shape == BALL.faces.shape
    np.testing.assert_allclose(
        mesh_forces(POPPY, found, MOTION), mesh_forces(POPPY, BALL, MOTION), rtol=1e-5
    )
    with pytest.raises(InputError, match="4000 cm long"):
        Mesh.read(file, unit="m")
    with pytest.raises(InputError, match="unit"):
        Mesh.read(file, unit="micron")
    with pytest.raises(InputError, match="no such file"):
        Mesh.read(tmp_path / "none.stl", unit="mm")
    file.write_text("solid nothing")
    with pytest.raises(InputError, match="no mesh"):
        Mesh.read(file, unit="mm")


def test_without_trimesh(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    with pytest.raises(InputError, match=r"rftfit\[mesh\]"):
        Mesh.read(stl(tmp_path, BALL), unit="mm")


def test_refined_is_the_same_body():
    finer = BALL.refined(0.3)
    edges = np.roll(finer.triangles, -1, axis=1) - finer.triangles
    assert np.linalg.norm(edges, axis=-1).max() <= 0.3
    np.testing.assert_allclose(finer.area_cm2, BALL.area_cm2)
    deep = Motion3D([0, 0, -9], [0, 0, -1])
    np.testing.assert_allclose(
        mesh_forces(POPPY, finer, deep)[:, :3], mesh_forces(POPPY, BALL, deep)[:, :3], atol=1e-9
    )


def test_wrong_motions():
    for wrong in (
        {"position_cm": [0, 0], "velocity_cm_per_s": [0, 0, 1]},
        {"position_cm": np.zeros((2, 3)), "velocity_cm_per_s": np.zeros((3, 3))},
        {"position_cm": [0, 0, 0], "velocity_cm_per_s": [0, 0, 1], "rotation": -np.eye(3)},
    ):
        with pytest.raises(ValueError, match=r"wanted|differ|mirrors"):
            Motion3D(**wrong)
    with pytest.raises(TypeError, match="Motion3D"):
        rftfit.predict(POPPY, BALL, rftfit.rotation())
    with pytest.raises(TypeError, match="plane"):
        rftfit.predict(POPPY, rftfit.model_leg("c_leg"), MOTION)


def test_a_path_is_differentiated():
    time = np.linspace(0, 1, 11)
    turn = np.outer(time, [0, 90, 0])
    path = Motion3D.path(time, np.outer(time, [1, 2, 3]), turn)
    np.testing.assert_allclose(path.frames[:, 3:9], np.tile([1, 2, 3, 0, np.pi / 2, 0], (11, 1)))


def noisy(seed, count, sd=0.03):
    """Draws around poppy, cell by cell, all of one truth's prior."""
    random = np.random.default_rng(seed)
    z, x = POPPY.cells[2:]
    return [
        (one + sd * random.standard_normal((count, one.size))).reshape(count, 7, 13)
        for one in (z, x)
    ]


def test_intervals_are_quantiles_of_the_draws():
    wheel, angle = Mesh.cylinder(6.25, 6, 24), np.radians(15)
    motion = Motion3D([0, 0, 3.25], [np.cos(angle), np.sin(angle), 0], [0, 0.16, 0])
    z, x = noisy(0, 1000)
    profile = rftfit.TableProfile(z.mean(0), x.mean(0), spread=rftfit.TableProfile(z, x))
    table = rftfit.predict(profile, wheel, motion)
    truths_z, truths_x = noisy(1, 60)
    truth = [
        mesh_forces(rftfit.TableProfile(*one), wheel, motion)[0]
        for one in zip(truths_z, truths_x, strict=True)
    ]
    ends = {0: "force_x_{}_N", 1: "force_y_{}_N", 2: "force_z_{}_N", 4: "moment_y_{}_N_cm"}
    inside = [
        table[name.format("lo")][0] <= one[k] <= table[name.format("hi")][0]
        for one in truth
        for k, name in ends.items()
    ]
    assert 0.88 <= np.mean(inside) <= 0.99
    load = mesh_forces(profile, wheel, motion)[0, 6]
    largest = np.hypot(*profile.cells[2:]).max()
    np.testing.assert_allclose(table["closure_N"][0], CLOSURE * largest * load, rtol=1e-3)


def test_one_push_gives_a_wider_interval_that_holds_the_map():
    one_push = rftfit.scale(0.35093).profile
    table = rftfit.predict(one_push, BALL, MOTION).iloc[0]
    assert table["force_z_lo_N"] < mesh_forces(POPPY, BALL, MOTION)[0, 2] < table["force_z_hi_N"]
    law = rftfit.predict(one_push, BALL, MOTION, law="3d-rft", friction=0.4).iloc[0]
    assert np.isnan(law["closure_N"])
