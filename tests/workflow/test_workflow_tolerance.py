"""A campaign whose angles are set by eye: pushes at 89 degrees go straight down, by the tolerance of its grid."""

import json
import math
import re

import pytest
from campaigns import Folder
from makers import MadePushes, config_of_push, write_campaign

import rftfit

LOGS = {
    "force_log": {
        "text": {"delimiter": ","},
        "columns": {
            "time": {"column": "time", "unit": "s"},
            "F1": {"column": "force_x", "unit": "N"},
            "F2": {"constant": 0, "unit": "N"},
            "F3": {"column": "force_z", "unit": "N"},
        },
    },
    "motion_log": {
        "text": {"delimiter": ","},
        "columns": {
            "time": {"column": "millis", "unit": "ms"},
            "x": {"column": "x", "unit": "mm"},
            "z": {"column": "z", "unit": "mm"},
        },
    },
}


def row_of(medium, kind, beta_deg, gamma_deg, repeat=1):
    run_id = f"{medium}_{kind}_{beta_deg}_{gamma_deg}_{repeat}"
    return {
        "run_id": run_id,
        "kind": kind,
        "medium": medium,
        "intruder": "plate",
        "direction": "intrusion",
        "beta_deg": str(beta_deg) if kind == "plate" else "",
        "gamma_deg": str(gamma_deg),
        "tare_run": f"{medium}_rod__{gamma_deg}_1" if kind == "plate" else "",
        "force_log": f"{run_id}_force.csv",
        "motion_log": f"{run_id}_motion.csv",
    }


def config_by_eye():
    config = config_of_push("time", {}, transducer={"range_N": [50, 50, 100], "precision_N": 0.02})
    config |= LOGS
    del config["fit"]
    config |= {
        "grid": {"angle_tolerance_deg": 2},
        "media": {
            "bed": {"title": "our bed", "expected_alpha": [0.2, 0.8]},
            "dune": {"title": "a dune", "role": "natural_sand", "linear_to_cm": 6},
        },
    }
    return config


@pytest.fixture(scope="module")
def set_by_eye(tmp_path_factory):
    rows = [row_of("bed", "rod", "", gamma_deg) for gamma_deg in (89, 60)]
    rows += [row_of("bed", "plate", beta, gamma) for beta in (-30, 0, 30) for gamma in (89, 60)]
    rows += [row_of("bed", "plate", 0, 89, 2), row_of("dune", "rod", "", 89)]
    rows += [row_of("dune", "plate", 0, 89, repeat) for repeat in (1, 2)]
    folder = Folder(tmp_path_factory.mktemp("eye") / "campaign")
    write_campaign(folder.root, config_by_eye(), rows=rows, pushes=MadePushes())
    folder.run_here(last="page")
    return folder


def test_pushes_at_89_degrees_are_straight_down_from_slopes_to_the_page(set_by_eye):
    checks = set_by_eye.table("checks/bed.csv").set_index("check")
    assert checks.loc["size", "verdict"] == "passed"
    # plates at -30 and 30 degrees are mirror images, a level one is its own
    assert checks.loc["symmetry", "verdict"] != "not checked"
    penetration = set_by_eye.table("penetration.csv").query("method != 'dft-index'")
    penetration = penetration.set_index("medium")
    alpha = penetration["alpha_z_measured_N_per_cm3"]
    assert alpha["bed"] == pytest.approx(0.4, rel=0.1)
    assert alpha["dune"] == pytest.approx(0.4, rel=0.1)
    sands = set_by_eye.table("sands.csv")
    assert {"dune_plate_0_89_1", "dune_plate_0_89_2"} <= {*sands["run_id"]}
    results = rftfit.open(set_by_eye.root)
    assert results["dune"].scaled().zeta == pytest.approx(penetration["zeta"]["dune"], rel=1e-4)
    assert math.isfinite(results["bed"].pressure_sinkage().n)


def test_the_ratio_straight_down_is_that_of_pushes_at_89_degrees(set_by_eye):
    results = rftfit.open(set_by_eye.root)
    comparison = rftfit.compare_media(results["bed"], results["dune"])
    assert comparison.ratio_down == pytest.approx(1, abs=0.2)
    assert "tolerance_deg" not in comparison.as_dict()


def test_the_page_states_alpha_of_pushes_at_89_degrees(set_by_eye):
    page = (set_by_eye.root / "results" / "report.html").read_text("utf-8")
    assert "Straight down, stress per depth" in page
    (data,) = re.findall(
        r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL
    )
    assert json.loads(data)["down"] == pytest.approx({"bed": 0.4, "dune": 0.4}, rel=0.1)


def test_a_medium_of_pushes_at_89_degrees_alone_has_a_warning(tmp_path):
    rows = [row_of("bed", "plate", 0, 89, repeat) | {"tare_run": ""} for repeat in (1, 2)]
    write_campaign(tmp_path, config_by_eye(), rows=rows, logs={"README.md": "logs to come"})
    assert "sheet.only-straight-down" in {problem.code for problem in rftfit.check(tmp_path)}
