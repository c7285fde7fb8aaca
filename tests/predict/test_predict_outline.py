"""Outlines of legs have the designed shape, and a wrong csv of points is refused by its rows.

Outline: the side view of a body as a chain of points.
"""

import itertools
import math
import re

import numpy as np
import pytest
from log_files import told

from rftfit import Outline, RftfitError, arc
from rftfit.forces.outlines import read_outline

R = 3.81
"""Half the greatest length of a leg, cm."""


def written(tmp_path, rows, header="x_cm,z_cm"):
    path = tmp_path / "scoop.csv"
    path.write_text(f"{header}\n{rows}", encoding="utf-8")
    return path


def problems_of(path):
    with pytest.raises(RftfitError) as caught:
        read_outline(path, 2.0)
    problems = getattr(caught.value, "problems", ())
    assert {problem.place.file for problem in problems} == {str(path)}
    return problems


def test_missing_columns_and_files(tmp_path):
    no_column = problems_of(written(tmp_path, "0,0\n", "xcm,z_cm"))
    assert told(no_column) == ["outline.missing-column 1 x_cm ~xcm"]
    assert told(problems_of(tmp_path / "none.csv")) == ["outline.missing"]


@pytest.mark.parametrize("c", [-1.0, -0.5, -1e-9, 0.0, 1e-300, 1e-5, 0.86, 1.0])
def test_arcs_go_from_axle_to_tip(c):
    leg = arc(c, elements=4000)
    x, z, tx, tz, half = leg.body.T
    length = 2 * R if abs(c) < 1e-6 else 2 * R / c * math.asin(c)
    assert 2 * half.sum() == pytest.approx(length, rel=1e-9)
    assert leg.area_cm2 == pytest.approx(length * 2.54, rel=1e-9)
    np.testing.assert_allclose(tx**2 + tz**2, 1, atol=1e-14)
    ends = [(x[0] - half[0] * tx[0], z[0] - half[0] * tz[0]),
            (x[-1] + half[-1] * tx[-1], z[-1] + half[-1] * tz[-1])]  # fmt: skip
    np.testing.assert_allclose(ends, [(0, 0), (0, -2 * R)], atol=1e-5)
    # one circle, bulging toward -x for positive curvature
    if abs(c) > 1e-6:
        r = R / abs(c)
        middle = math.copysign(math.sqrt(r * r - R * R), c) if abs(c) < 1 else 0.0
        np.testing.assert_allclose(np.hypot(x - middle, z + R), r, rtol=1e-9)
    assert (np.sign(x) == -np.sign(c)).all()


def test_elements_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match="finite"):
        Outline(np.full((2, 5), np.nan), 1.0)


def test_read_outline(tmp_path):
    path = written(tmp_path, "0,0\n0,-6\n3,-6\n", "# a scoop\nx_cm,z_cm")
    outline = read_outline(path, 2.0, 30)
    assert (outline.name, len(outline.body), outline.solid) == ("scoop", 30, False)
    assert outline.area_cm2 == pytest.approx(18)
    np.testing.assert_allclose(outline.body[0], [0, -0.15, 0, -1, 0.15])
    np.testing.assert_allclose(outline.body[-1], [2.85, -6, 1, 0, 0.15])
    # a dense part of the outline takes no element away from the others
    assert len(read_outline(path, 2.0, 1).body) == 2
    semicolon_path = written(tmp_path, "0;0;a\n0;-6;b\n3;-6;c\n", "x_cm;z_cm;note")
    np.testing.assert_array_equal(read_outline(semicolon_path, 2.0).body, outline.body)


def test_closed_outline_is_solid_whichever_way_it_runs(tmp_path):
    turn = np.linspace(0, 2 * np.pi, 25)
    points = np.column_stack([3 * np.cos(turn), 3 * np.sin(turn)]).round(6)
    for path_points in (points, points[::-1]):
        text = "".join(f"{x},{z}\n" for x, z in path_points)
        wheel = read_outline(written(tmp_path, text), 4.0)
        assert wheel.solid
        x, z, tx, tz, _ = wheel.body.T
        assert (x * tz - z * tx > 0).all()  # outward to the right of the tangent


@pytest.mark.parametrize(
    ("rows", "expected", "rows_met"),
    [
        ("1,2\n", ["too-short 2"], "1"),
        ("", ["empty"], ""),
        ("0,0\n1,1\n2,0\n1,1\n3,3\n", ["repeated 5 '1, 1'"], "3"),
        ("0,0\n0,0\n1,1\n", ["repeated 3 '0, 0'"], "2"),
        ("0,0\n2,0\n0,0\n3,3\n", ["repeated 4 '0, 0'"], "2"),
        ("0,0\n2,2\n2,0\n0,2\n", ["crossing 4"], "2 3 4 5"),
        ("0,0\n2,0\n2,1\n1,-1\n", ["crossing 4"], "2 3 4 5"),
        ("0,0\n2,0\n1,0\n", ["crossing 3"], "2 3 3 4"),  # turns back on itself
        ("0,0\n2,0\n2,1\n1,0\n", ["crossing 4"], "2 3 4 5"),  # touches
        # overlaps in one line
        ("0,0\n4,0\n4,1\n5,1\n5,0\n3,0\n", ["crossing 6", "crossing 6"], "2 3 6 7 3 4 6 7"),
        ("0,0\n1,a\n2,nan\n", ["not-a-number 3 z_cm 'a'", "not-finite 4 z_cm 'nan'"], ""),
        ("0,0\n1\n", ["required 3 z_cm"], ""),
        ("0;0\n", ["not-a-number 2 x_cm '0;0'", "required 2 z_cm"], ""),
    ],
)
def test_bad_outlines_are_refused_with_their_rows(tmp_path, rows, expected, rows_met):
    """`rows_met`: points, or rows of the points that a bad one meets."""
    problems = problems_of(written(tmp_path, rows))
    assert told(problems) == [f"outline.{problem}" for problem in expected]
    numbers = (re.findall(r"\d+", problem.allowed) for problem in problems)
    assert " ".join(itertools.chain(*numbers)) == rows_met


def test_rows_are_counted_with_comments(tmp_path, monkeypatch):
    path = written(tmp_path, "0,0\n\n# turn\n1,1\n0,0\n2,2\n", "# a\nx_cm,z_cm")
    (repeated,) = problems_of(path)
    assert told([repeated]) == ["outline.repeated 7 '0, 0'"]
    assert re.findall(r"\d+", repeated.allowed) == ["3"]
    monkeypatch.setattr("rftfit.forces.outlines.MAX_POINTS", 3)
    assert told(problems_of(path)) == ["outline.too-long 8"]


def test_crossings_against_brute_force(tmp_path):
    random, refused_count = np.random.default_rng(5), 0
    for _ in range(100):
        points = random.normal(size=(5, 2))
        expected = []
        for i, j in ((0, 2), (0, 3), (1, 3)):
            a, b, c, d = points[[i, i + 1, j, j + 1]]
            s, t = np.linalg.solve(np.column_stack([b - a, c - d]), c - a)
            if 0 <= s <= 1 and 0 <= t <= 1:
                expected.append(f"{i + 2} {i + 3} {j + 2} {j + 3}")
        path = written(tmp_path, "".join(f"{x!r},{z!r}\n" for x, z in points.tolist()))
        if not expected:
            assert not read_outline(path, 2.0).solid
            continue
        refused_count += 1
        rows_met = [" ".join(re.findall(r"\d+", problem.allowed)) for problem in problems_of(path)]
        assert sorted(rows_met) == sorted(expected)
    assert 20 < refused_count < 80
