"""A campaign of one sand, of plates in one medium or with a hole in its grid says what it lacks."""

import json
import re

import numpy as np
import pytest
from campaigns import make_campaign

from rftfit.measure.alpha import column
from rftfit.model.scaling import published

pytestmark = pytest.mark.slow


def rftfit(folder, *words):
    process = folder.rftfit(*words)
    assert process.returncode == 0, process.stdout + process.stderr
    return process.stdout


def run_twice(folder):
    folder.run_here()
    digests_before = folder.digests()
    assert "Nothing to do" in rftfit(folder, "run")
    assert folder.digests() == digests_before


def page_of(folder):
    """Text of the page on one line, and the numbers of its live parts."""
    html = (folder.root / "results" / "report.html").read_text("utf-8")
    match = re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)
    assert match
    return " ".join(html.split()), json.loads(match[1])


def figures_of(folder):
    return sorted(path.stem for path in (folder.root / "results" / "figures").glob("*.png"))


@pytest.fixture(scope="module")
def sand(tmp_path_factory):
    """One penetration test and three legs in Yuma sand, nothing else."""
    folder = make_campaign(tmp_path_factory.mktemp("sand") / "campaign", ("yuma",))
    run_twice(folder)
    return folder


def test_a_sand_alone_is_scaled_with_the_published_media(sand):
    table = sand.table("penetration.csv")
    assert len(table) == 1
    row = table.iloc[0]
    assert row["method"] == "scaling routine (lsq, published media)"
    assert row["reason_code"] == "published-media"
    alpha = sand.table("alpha/yuma.csv").query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    value, se = alpha[column("z")], alpha[column("z", "_se")]
    assert value == pytest.approx(0.69, abs=0.01)
    # least squares at the angles of Table S5, small terms dropped
    assert row["chi"] == pytest.approx(
        np.mean([1.23537, 1.08716, 1.10806, 0.97435, 1.21970]), abs=1e-4
    )
    assert row["zeta"] == pytest.approx(value / row["chi"], rel=5e-6)
    test = ("--alpha", f"{value}", "--se", f"{se}", "--profile", "generic")
    scaled = json.loads(rftfit(sand, "scale", *test, "--output", "scaled.csv", "--json"))
    for name in ("zeta", "chi"):
        assert f"{row[name]:.6g}" == f"{scaled[name]['value']:.6g}"
        assert f"{row[f'{name}_lo']:.5g}" == f"{scaled[name]['lo']:.5g}"
        assert f"{row[f'{name}_hi']:.5g}" == f"{scaled[name]['hi']:.5g}"
    stated = sand.table("sands.csv").set_index("window").loc["stated"]
    assert stated["zeta"] == pytest.approx(row["zeta"], rel=1e-5)
    assert stated["reason_code"] == "published-media"


def test_what_a_sand_alone_lacks_is_told_not_drawn(sand):
    for name in ("alpha_extended", "coefficients", "fourier/media"):
        table = sand.table(f"{name}.csv")
        assert table.empty
        assert "medium" in table.columns
    drawn = figures_of(sand)
    assert drawn == [
        "estimated_maps",
        "first_map",
        "first_peaks",
        "legs_in_sands",
        "peak_errors",
        "penetration",
        "stress_of_runs",
    ]
    html, live = page_of(sand)
    assert "(1.12)" in html
    assert "the nine-term Fourier" not in html
    zeta = sand.table("penetration.csv")["zeta"].iloc[0]
    generic = live["profiles"]["yuma"]["generic"]["values"]
    assert np.allclose(generic, zeta * published().m0)
    assert [reference["name"] for reference in live["references"]] == [published().name]


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """Plates in loose poppy seeds: no sands, no legs, no robot."""
    root = tmp_path_factory.mktemp("plates") / "campaign"
    folder = make_campaign(root, ("poppy_LP",), plates_only=True)
    run_twice(folder)
    return folder


def test_plates_in_one_medium(plates):
    for name in (
        "predicted",
        "leg_errors",
        "contacts",
        "sands",
        "sand_correction",
        "legs/poppy_LP",
    ):
        empty = plates.table(f"{name}.csv")
        assert empty.empty
        assert "medium" in empty.columns
    drawn = figures_of(plates)
    assert "generic_profile" in drawn
    legs_or_sands = ("legs", "forces_over_zeta", "penetration", "peak", "robot")
    assert not any(name.startswith(legs_or_sands) for name in drawn)
    html, live = page_of(plates)
    assert 'id="legs"' not in html
    assert 'id="sands"' not in html
    assert "published five media" not in html
    assert set(live["profiles"]["poppy_LP"]) == {"table", "map", "fourier", "generic", "depth_only"}
