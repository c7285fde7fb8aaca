"""A campaign of one sand says what it lacks."""

import json
import re

import numpy as np
import pytest
from campaigns import make_campaign
from makers import json_of

import rftfit

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sand(tmp_path_factory):
    """One penetration test and three legs in Yuma sand, nothing else."""
    folder = make_campaign(tmp_path_factory.mktemp("sand") / "campaign", ("yuma",))
    folder.run_here()
    digests_before = folder.digests()
    assert "Nothing to do" in folder.rftfit("run").stdout
    assert folder.digests() == digests_before
    return folder


def test_a_sand_alone_is_scaled_with_the_published_media(sand):
    table = sand.table("penetration.csv")
    assert len(table) == 1
    row = table.iloc[0]
    assert row["method"] == "scaling routine (lsq, published media)"
    assert row["reason_code"] == "published-media"
    alpha = sand.table("alpha/yuma.csv").query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    value, se = alpha["alpha_z_N_per_cm3"], alpha["alpha_z_se_N_per_cm3"]
    assert value == pytest.approx(0.69, abs=0.01)
    # least squares at the angles of Table S5, small terms dropped
    assert row["chi"] == pytest.approx(
        np.mean([1.23537, 1.08716, 1.10806, 0.97435, 1.21970]), abs=1e-4
    )
    assert row["zeta"] == pytest.approx(value / row["chi"], rel=5e-6)
    words = ("scale", "--alpha", f"{value}", "--se", f"{se}", "--profile", "generic")
    scaled = json_of(*words, "--output", "scaled.csv", folder=sand.root)
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
    html = (sand.root / "results" / "report.html").read_text("utf-8")
    (data,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL
    )
    live = json.loads(data)
    assert "(1.12)" in " ".join(html.split())
    assert "the nine-term Fourier" not in html
    zeta = sand.table("penetration.csv")["zeta"].iloc[0]
    generic = live["profiles"]["yuma"]["generic"]["values"]
    assert np.allclose(generic, zeta * rftfit.published_reference().m0)
    assert [reference["name"] for reference in live["references"]] == [
        rftfit.published_reference().name
    ]
