"""A stage with one position along its path: the surface of a run, as docs/howto/home-rig.md says to write it."""

import numpy as np
import pytest
from makers import MadePush, TextLog, config_of_push, row_of_push, write_campaign

from rftfit.campaign.load import load_campaign
from rftfit.measure.ingest import ingest_medium

USUAL_MM = 60.0
"""Reading at the surface in most runs."""


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
    surface_z_mm = -(at_surface_mm * factor + offset_mm) * sine
    along = {"column": "stage", "unit": "mm", "factor": factor, "offset": offset_mm}
    config = write_campaign(
        tmp_path,
        config_of_push("time", {"along": along}),
        rows=[row_of_push(gamma_deg, surface_z_mm=surface_z_mm)],
        logs={"p.csv": log},
    )
    samples, runs, _ = ingest_medium(load_campaign(config), "sand")
    assert list(runs["reason"]) == [""]
    np.testing.assert_allclose(samples["depth_cm"], push.way_cm * sine, atol=1e-6)
