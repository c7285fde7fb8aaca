"""A table of stress or alpha alone gives coefficients and a report page, as the logs would."""

import os
import subprocess
import sys
from tempfile import TemporaryFile

import numpy as np
import pytest
from campaigns import Folder, run_rules
from makers import answer_of, refused

import rftfit
from rftfit.workflow.state import hand_over, read_states

slow = pytest.mark.slow
MEASURE = ("ingest", "tare", "slopes", "checks")
"""Stages up to alpha."""


def started(root, source, kind="stress"):
    """A campaign of a table, as `rftfit init` lays it out."""
    assert answer_of("init", root, f"--{kind}-table", source)[0] == 0
    return Folder(root)


@pytest.fixture(scope="module")
def alpha(tmp_path_factory):
    """Table S5 as a user has it, in a folder whose name has a blank."""
    root = tmp_path_factory.mktemp("alpha") / "my table"
    source = root.parent / "table s5.csv"
    rftfit.published_table("table_s5").to_csv(source, index=False)
    folder = started(root, source, "alpha")
    folder.run_here(drawn=("alpha_maps", "fit_maps", "generic_profile"))
    return folder


@slow
def test_no_error_is_made_up(alpha):
    """The table states none: there is no interval anywhere, and the page says so."""
    for name in ("coefficients", "penetration"):
        ends = alpha.table(f"{name}.csv").filter(regex=r"(^|_)(lo|hi)(_N_.*)?$")
        assert len(ends.columns)
        assert ends.isna().all(axis=None)
    page = (alpha.root / "results" / "report.html").read_text("utf-8")
    assert "rod and mount" not in page.partition('id="methods"')[2]
    ledger = alpha.table("ledger.csv")
    assert (ledger["rows"].sum(), set(ledger["fate"])) == (455, {"used"})
    # of logs there are no figures
    figures = {path.stem for path in (alpha.root / "results" / "figures").glob("*.png")}
    assert {"alpha_maps", "fit_maps", "generic_profile"} <= figures
    assert not {"linearity", "stress_of_runs", "protocol_poppy_LP", "tare_poppy_LP"} & figures


def test_stated_errors_become_intervals(tmp_path):
    """Also of the parts that a table knows nothing of: a surface, a start-up, a tare."""
    source = tmp_path / "alpha.csv"
    head = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3,se_z,se_x"
    source.write_text(f"{head}\n0,90,0.35,0,0.004,0.002\n30,45,0.165,0.105,0.003,0.003\n")
    folder = started(tmp_path / "c", source, "alpha")
    run_rules(folder.config, *MEASURE)
    cell = folder.table("alpha/alpha.csv").set_index("beta_deg")
    assert cell.loc[0, "alpha_z_se_N_per_cm3"] == pytest.approx(0.004)
    assert cell.loc[30, "alpha_x_hi_N_per_cm3"] == pytest.approx(0.105 + 1.96 * 0.003, abs=1e-5)
    row = folder.table("fits/alpha.csv").set_index("beta_deg").loc[30]
    assert row["alpha_z_lo_N_per_cm3"] == pytest.approx(0.165 - 1.96 * 0.003, abs=1e-5)
    assert row["alpha_z_hi_N_per_cm3"] == pytest.approx(0.165 + 1.96 * 0.003, abs=1e-5)
    assert row["direction"] == "intrusion"


@slow
def test_one_depth_gives_an_alpha_without_error_and_depth_zero_none(tmp_path):
    table = tmp_path / "one depth.csv"
    table.write_text(
        "medium,beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2\n"
        "sand,0,90,3,1.2,0.0\nsand,30,90,3,0.9,0.3\nsand,30,90,5,1.6,0.5\nsand,0,45,0,0.7,0.2\n"
        "sand,60,90,2,0.6,0.0\nsand,60,90,4,1.2,0.0\n"
        "sand,90,90,2,0.6,0.0\nsand,90,90,4,1.3,0.0\n",
        "utf-8",
    )
    folder = started(tmp_path / "lab", table)
    run_rules(folder.config, *MEASURE)
    cells = folder.table("alpha/sand.csv").set_index(["beta_deg", "gamma_deg"])
    one_depth, two_depths, zero_depth, exact = (
        cells.loc[c] for c in ((0, 90), (30, 90), (0, 45), (60, 90))
    )
    assert one_depth["alpha_z_N_per_cm3"] == pytest.approx(1.2 / 3)
    assert np.isnan(
        one_depth[["alpha_z_se_N_per_cm3", "alpha_z_lo_N_per_cm3"]].to_numpy(float)
    ).all()
    # what lies on a line to the last digit was calculated
    assert exact["alpha_z_N_per_cm3"] == pytest.approx(0.3)
    assert np.isnan(exact["alpha_z_lo_N_per_cm3"])
    flags = folder.table("flags/sand.csv").set_index("run_id")["code"]
    # zeros alone along x are no measurement
    assert {*flags[exact["run_ids"]]} == {"no-scatter", "no-force-x"}
    assert np.isnan(exact["alpha_x_se_N_per_cm3"])
    assert cells.loc[(90, 90), ["alpha_x_lo_N_per_cm3", "alpha_x_hi_N_per_cm3"]].tolist() == [0, 0]
    assert two_depths["alpha_z_N_per_cm3"] == pytest.approx((0.9 * 3 + 1.6 * 5) / 34)
    assert two_depths["alpha_z_lo_N_per_cm3"] < two_depths["alpha_z_N_per_cm3"]
    assert np.isnan(zero_depth["alpha_z_N_per_cm3"])
    assert zero_depth["reason_code"] == "zero-depths"


def test_the_way_back_and_what_is_excluded_are_counted(tmp_path):
    """Slopes are those of the way down alone, or up alone, whatever stands beside it."""
    random = np.random.default_rng(1)
    depth_down_cm = np.linspace(0.1, 8, 200)
    lines = ["beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2,excluded,reason"]
    slopes = {}
    depth_both_cm = np.concatenate([depth_down_cm, depth_down_cm[::-1]])
    for beta, gamma, depth, end, rows_used in (
        (0, 90, depth_both_cm, ",", slice(200)),
        (30, -45, depth_both_cm, ",", slice(201, 400)),
        (0, -90, depth_down_cm[::-1], ",", slice(200)),
        (60, 45, depth_down_cm, "yes,a stone", slice(200)),
    ):
        alpha = np.where((np.arange(depth.size) < 200) & (gamma > -90), 0.35, -0.05)
        stress = alpha * depth + random.normal(0, 0.02, depth.size)
        for d, stress_z in zip(depth, stress, strict=True):
            lines.append(f"{beta},{gamma},{d:.6f},{stress_z:.6f},0.01,{end}")
        slope = stress[rows_used] @ depth[rows_used] / (depth[rows_used] @ depth[rows_used])
        slopes[f"b{beta}_g{gamma}".replace("-", "m")] = slope
    source = tmp_path / "stress.csv"
    source.write_text("\n".join(lines), "utf-8")
    folder = started(tmp_path / "c", source)
    run_rules(folder.config, *MEASURE, "legs", "ledger")
    rows = folder.table("fits/stress.csv").set_index("run_id").to_dict("index")
    excluded = rows["b60_g45"]
    assert (excluded["reason"], excluded["reason_code"]) == ("excluded: a stone", "excluded")
    assert np.isnan(excluded["alpha_z_N_per_cm3"])
    for name in slopes.keys() - {"b60_g45"}:
        assert rows[name]["alpha_z_N_per_cm3"] == pytest.approx(slopes[name], rel=1e-3)
        # of neighbouring rows nobody knows that they are independent, whichever way the depth goes
        assert rows[name]["alpha_z_curvature_N_per_cm3"] >= 0
        assert np.isfinite(rows[name]["nonlinear_z_p"])
    flags = folder.table("flags/stress.csv").query("stage != 'checks'")
    assert sorted(zip(flags["code"], flags["run_id"], strict=True)) == [
        ("rows-other-sense", "b0_g90"),
        ("rows-other-sense", "b30_gm45"),
    ]
    book = folder.table("ledger.csv")
    assert book["rows"].sum() == len(lines) - 1
    fates = book.groupby(["run_id", "reason_code"])["rows"].sum().to_dict()
    assert fates["b0_g90", "other-sense"] == 200
    assert fates["b30_gm45", "other-sense"] == 201
    assert fates["b60_g45", "excluded"] == 200


@pytest.mark.skipif(sys.platform != "linux", reason="handed over through /proc")
def test_a_campaign_that_was_handed_over_is_not_read_again_unless_something_changed(
    tmp_path, monkeypatch
):
    source = tmp_path / "stress.csv"
    source.write_text("beta,gamma,depth,stress_z,stress_x\n0,90,1,0.3,0\n0,90,2,0.6,0\n", "utf-8")
    config, second_config = (started(tmp_path / name, source).config for name in "ab")
    states = read_states(config)
    with TemporaryFile(buffering=0) as file:
        word = hand_over(states, file)
        with monkeypatch.context() as patch:
            patch.setenv("RFTFIT_CAMPAIGN", word)
            patch.setattr("rftfit.workflow.state.check_campaign", lambda _: (None, []))
            handed = read_states(config)
            assert (repr(handed.campaign.runs), handed.warnings) == (
                repr(states.campaign.runs),
                states.warnings,
            )
            contents = states.campaign.sheet.read_bytes(), config.read_bytes()
            for path, text in zip((states.campaign.sheet, config), contents, strict=True):
                path.write_bytes(text + b"\n")
                with pytest.raises(rftfit.RftfitError):
                    read_states(config)
                path.write_bytes(text)
            assert read_states(config).warnings == states.warnings
            with pytest.raises(rftfit.RftfitError):
                read_states(second_config)
            file.seek(-1, 2)
            file.write(b"?")
            with pytest.raises(rftfit.RftfitError):
                read_states(config)
    monkeypatch.setenv("RFTFIT_CAMPAIGN", word)
    assert repr(read_states(config).campaign.runs) == repr(states.campaign.runs)


@slow
def test_a_run_reads_its_table_once(tmp_path):
    """Of all processes of `rftfit run`, one parses the table."""
    source, patch = tmp_path / "stress.csv", tmp_path / "site" / "sitecustomize.py"
    rows = [f"0,90,{depth / 10},{depth / 30},0" for depth in range(1, 30)]
    source.write_text("\n".join(["beta,gamma,depth,stress_z,stress_x", *rows]), "utf-8")
    started(tmp_path / "c", source)
    patch.parent.mkdir()
    patch.write_text(_COUNTS.format(str(tmp_path / "reads")), "utf-8")
    paths = os.pathsep.join([str(patch.parent), *sys.path])
    targets = [f"results/{name}.csv" for name in ("penetration", "predicted", "ledger")]
    subprocess.run(
        [sys.executable, "-m", "rftfit", "run", "--cores", "1", *targets],
        cwd=tmp_path / "c",
        env=os.environ | {"PYTHONPATH": paths},
        check=True,
    )
    assert all((tmp_path / "c" / name).is_file() for name in targets)
    assert len((tmp_path / "reads").read_text().splitlines()) == 1


_COUNTS = """
import os, sys
def hook(event, args):
    if event == "open" and str(args[0]).endswith("raw/stress.csv"):
        caller = sys._getframe(1)
        while caller and caller.f_code.co_name != "read_pushes":
            caller = caller.f_back
        if caller:
            os.write(os.open({0!r}, os.O_WRONLY | os.O_CREAT | os.O_APPEND), b"read\\n")
sys.addaudithook(hook)
"""


@pytest.mark.parametrize("holds", ["stress", "alpha"])
@pytest.mark.parametrize("content", [bytes(range(256)) * 4, b"\xd0\xcf\x11\xe0"])
def test_no_campaign_is_made_of_a_file_that_cannot_be_read(tmp_path, holds, content):
    source = tmp_path / "table.csv"
    source.write_bytes(content)
    refused("init", tmp_path / "c", f"--{holds}-table", source)
    assert not (tmp_path / "c").exists()
