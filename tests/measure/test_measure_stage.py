"""Clocks, zero and path of a push are those that its config and run sheet state, as docs/howto/home-rig.md says to write them."""

import numpy as np
import pytest
from makers import NOT_MEASURED, MadePush, TextLog, config_of_push, row_of_push, write_campaign
from measured import chain

from rftfit.campaign.load import load_campaign

USUAL_MM = 60.0
"""Reading at the surface in most runs."""


@pytest.mark.parametrize("at_surface_mm", [60.0, 66.0, 51.0])
@pytest.mark.parametrize("gamma_deg", [90, 60, 30])
# the other way round, a stage counts downward
@pytest.mark.parametrize("factor", [1, -1])
# in the run sheet, or for all runs in the config
@pytest.mark.parametrize("is_of_run", [True, False])
def test_the_surface_of_a_run_follows_from_the_reading_of_its_stage(
    tmp_path, factor, gamma_deg, at_surface_mm, is_of_run
):
    push = MadePush(gamma_deg=gamma_deg, noise_N=0.001)
    offset_mm = -factor * USUAL_MM
    columns = {name: values for name, values in push.log().columns.items() if name[0] in "tF"}
    columns["stage"] = at_surface_mm + factor * 10 * push.way_cm
    log = TextLog(columns, {"time": "s"}).text()
    sine = np.sin(np.radians(gamma_deg))
    surface_z_mm = -(at_surface_mm * factor + offset_mm) * sine
    along = {"column": "stage", "unit": "mm", "factor": factor, "offset": offset_mm}
    arm, cells = dict[str, float](), dict[str, float]()
    (cells if is_of_run else arm)["surface_z_mm"] = float(surface_z_mm)
    config = write_campaign(
        tmp_path,
        config_of_push("time", {"along": along}, arm=arm),
        rows=[row_of_push(gamma_deg, **cells)],
        logs={"p.csv": log},
    )
    results = chain(load_campaign(config), "sand")
    assert list(results.runs["reason"]) == [""]
    np.testing.assert_allclose(results.traces["depth_cm"], push.way_cm * sine, atol=1e-6)


def test_x_is_counted_from_the_middle_of_the_container(measure_push):
    push = MadePush(gamma_deg=60)
    samples = measure_push(push, arm={"middle_x_mm": 40.0}).traces
    np.testing.assert_allclose(samples["x_cm"], -push.way_cm / 2 - 4, atol=1e-6)


def test_two_logs_whose_clocks_are_to_be_aligned_need_a_sync_line(measure_push):
    results = measure_push(MadePush(), "q.csv", clock={"method": "sync_line"})
    assert list(results.runs["reason_code"]) == ["no-sync-line"]


def test_a_stated_zero_is_turned_into_the_lab_frame(measure_push):
    """The sensor has x along -F3 and z along -F1."""
    stated = {"method": "stated", "readings_N": [0.1, 0.2, 0.4], "sd_N": 0.03}
    push, axes = MadePush(gamma_deg=60), {"x": "-F3", "y": "+F2", "z": "-F1"}
    results = measure_push(push, zero=stated, transducer={"axes": axes})
    run = results.run("p")
    np.testing.assert_allclose([run["zero_var_z_N2"], run["zero_var_x_N2"]], 0.0009)
    force_z_N, force_x_N = push.forces_N
    np.testing.assert_allclose(results.traces["force_z_N"], -(force_x_N - 0.1), atol=1e-6)
    np.testing.assert_allclose(results.traces["force_x_N"], -(force_z_N - 0.4), atol=1e-6)


@pytest.mark.parametrize(("gamma_deg", "is_unknown"), [(90, False), (60, True)])
def test_a_force_along_x_that_nobody_measured_is_none_by_symmetry_alone(
    measure_push, gamma_deg, is_unknown
):
    results = measure_push(MadePush(gamma_deg=gamma_deg), force_columns=NOT_MEASURED)
    assert ("no-force-x" in results.codes("p")) == is_unknown
    assert np.isnan(results.fit("p")["alpha_x_N_per_cm3"]) == is_unknown
