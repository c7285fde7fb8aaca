"""A mesh that cannot be used is refused or mended with a note, and its forces have intervals."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rftfit
from rftfit import Mesh, Motion3D
from rftfit.forces.space import compiled_mesh_forces

POPPY = rftfit.TableProfile.published("poppy_LP")
BALL = Mesh.sphere(2, 8)
MOTION = Motion3D([0, 0, -1], [1, 0.3, -0.5], [0.1, 0.4, -0.2])


def stl(folder, mesh, name="ball.stl"):
    """Write a mesh in mm."""
    lines = ["solid x"]
    for triangle in 10 * mesh.triangles:
        corners = "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in triangle)
        lines.append(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet")
    file = folder / name
    file.write_text("\n".join([*lines, "endsolid x\n"]))
    return file


BAD = {
    "open": (lambda v, f: (v, f[1:]), "belong to one face only"),
    "one face turned": (lambda v, f: (v, [f[0][::-1], *f[1:]]), "turned over"),
    "walls": (lambda v, f: (v, [*f, [f[0][0], f[0][1], 50]]), "belong to"),
    "no such vertex": (lambda v, f: (v, f + len(v)), "faces name vertices"),
    "not finite": (lambda v, f: (v * np.nan, f), "finite vertices"),
    "a hollow": (
        lambda v, f: (np.vstack([v, v / 2]), np.vstack([f, f[:, ::-1] + len(v)])),
        "hollow",
    ),
    "a point": (lambda v, f: (0 * v, f), "one point"),
}
"""Fault of a mesh: a change of vertices and faces, and words of the message."""


@pytest.mark.parametrize("case", BAD)
def test_refused(case):
    change, words = BAD[case]
    with pytest.raises(ValueError, match=words):
        Mesh(*change(BALL.vertices_cm, BALL.faces))


MENDED = {
    "inside out": lambda v, f: (v, f[:, ::-1]),
    "5 faces that were there twice": lambda v, f: (v, np.vstack([f, f[:5]])),
    "1 faces without area": lambda v, f: (v, np.vstack([f, [[1, 1, 2]]])),
}
"""Words of the warning, and the change that causes it."""


@pytest.mark.parametrize("words", MENDED)
def test_mended_with_a_word_to_the_same_forces(words):
    with pytest.warns(UserWarning, match=words):
        mesh = Mesh(*MENDED[words](BALL.vertices_cm, BALL.faces))
    assert len(mesh.notes) == 1
    forces, expected = (compiled_mesh_forces(POPPY, body, MOTION) for body in (mesh, BALL))
    assert_allclose(forces, expected, atol=1e-12)


def box(size, middle):
    corners = (np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5) * size
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[a, b, c] for a, *others in sides for b, c in pairwise(others)]
    return corners + middle, np.array(faces)


@pytest.mark.parametrize(
    ("size", "middle", "crossing"),
    [
        ((1, 1, 4), (0, 0, 0), "2 of 2"),  # a cross, of which no corner lies inside
        ((2, 2, 2), (1.9, 0.3, 0.2), "2 of 2"),
        ((0.5, 0.5, 0.5), (0, 0, 0), "1 of 2"),
        ((1, 1, 1), (2.6, 0, 0), ""),
        ((1, 1, 1), (9, 0, 0), ""),
    ],
)
def test_parts_that_reach_into_one_another_are_told(size, middle, crossing, recwarn):
    (first, faces), (second, _) = box((4, 1, 1), (0, 0, 0)), box(size, middle)
    Mesh(np.vstack([first, second]), np.vstack([faces, faces + 8]))
    told = [str(warning.message) for warning in recwarn.list]
    assert len(told) == bool(crossing)
    assert not crossing or f"{crossing} closed parts reach into another one" in told[0]


def test_files(tmp_path):
    pytest.importorskip("trimesh")
    file = stl(tmp_path, BALL)
    mesh = Mesh.read(file, unit="mm")
    assert mesh.name == "ball"
    assert mesh.faces.shape == BALL.faces.shape
    same = compiled_mesh_forces(POPPY, BALL, MOTION)
    assert_allclose(compiled_mesh_forces(POPPY, mesh, MOTION), same, rtol=1e-5)
    (tmp_path / "empty.stl").write_text("solid nothing")
    for name, unit, words in (
        ("ball.stl", "m", "4000 cm long"),
        ("ball.stl", "micron", "unit"),
        ("none.stl", "mm", "no such file"),
        ("empty.stl", "mm", "no mesh"),
    ):
        with pytest.raises(rftfit.RftfitError, match=words):
            Mesh.read(tmp_path / name, unit)


def test_wrong_motions():
    for wrong in (
        {"position_cm": [0, 0], "velocity_cm_per_s": [0, 0, 1]},
        {"position_cm": np.zeros((2, 3)), "velocity_cm_per_s": np.zeros((3, 3))},
        {"position_cm": [0, 0, 0], "velocity_cm_per_s": [0, 0, 1], "rotation": -np.eye(3)},
    ):
        with pytest.raises(ValueError, match=r"wanted|differ|mirrors"):
            Motion3D(**wrong)
