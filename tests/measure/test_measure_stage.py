"""A stage with one position along its path: the surface of a run, as docs/howto/home-rig.md says to write it."""

import numpy as np
import pytest
from makers import MadePush, TextLog, write_campaign

from rftfit.campaign.load import load_campaign
from rftfit.measure.ingest import ingest_medium

USUAL_MM = 60.0
"""Reading at the surface in most runs."""
CONFIG = {
    "title": "a slanted stage",
    "raw": "raw",
    "run_sheet": "config/runs.csv",
    "force_log": {
        "text": {"delimiter": ","},
        "columns": {
            "F1": {"column": "Fx", "unit": "N"},
            "F2": {"constant": 0, "unit": "N"},
            "F3": {"column": "Fz", "unit": "N"},
        },
    },
    "clock": {"method": "same_clock"},
    "transducer": {
        "name": "cell",
        "range_N": [200, 200, 200],
        "precision_N": 0.02,
        "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
    },
    "arm": {"speed_cm_per_s": 1.0},
    "container": {"length_cm": 60, "width_cm": 40, "depth_cm": 30},
    "intruders": {"plate": {"shape": "plate", "length_cm": 5, "width_cm": 3, "thickness_cm": 0.4}},
    "media": {"sand": {"title": "sand"}},
    "fit": {"missing_tare": "none"},
}


@pytest.mark.parametrize("at_surface_mm", [60.0, 66.0, 51.0])
@pytest.mark.parametrize("gamma_deg", [90, 60, 30])
@pytest.mark.parametrize("factor", [1, -1])
def test_the_surface_of_a_run_follows_from_the_reading_of_its_stage(
    tmp_path, factor, gamma_deg, at_surface_mm
):
    push = MadePush(gamma_deg=gamma_deg, noise_N=0.001)
    offset_mm = -factor * USUAL_MM
    columns = {name: values for name, values in push.log().columns.items() if name[0] in "tF"}
    columns["stage"] = at_surface_mm + factor * 10 * push.way_cm
    log = TextLog(columns, {"time": "s"}).text()
    sine = np.sin(np.radians(gamma_deg))
    row = {"run_id": "p", "kind": "plate", "medium": "sand", "intruder": "plate"}
    row |= {"direction": "intrusion", "beta_deg": 0, "gamma_deg": gamma_deg}
    row |= {"force_log": "p.csv", "motion_log": "p.csv"}
    row["surface_z_mm"] = -(at_surface_mm * factor + offset_mm) * sine
    along = {"column": "stage", "unit": "mm", "factor": factor, "offset": offset_mm}
    motion_log = {"text": {"delimiter": ","}, "columns": {"along": along}}
    config = write_campaign(
        tmp_path, CONFIG | {"motion_log": motion_log}, rows=[row], logs={"p.csv": log}
    )
    samples, runs, _ = ingest_medium(load_campaign(config), "sand")
    assert list(runs["reason"]) == [""]
    np.testing.assert_allclose(samples["depth_cm"], push.way_cm * sine, atol=1e-6)
