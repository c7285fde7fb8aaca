"""The force in the simulated logs is the published one, with the signs of the lab frame; read here without the program."""

import numpy as np
import pandas as pd
import pytest
from makers import run_command

import rftfit

MEDIUM = "glass3mm_CP"
AREA_CM2 = 3.81 * 2.54


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """Folder of logs of one path down and of its way back, on a mount that is not turned."""
    folder = tmp_path_factory.mktemp("lab")
    words = ["reenact", "--media", MEDIUM, "--grid=-30:45,30:-45", "--no-legs"]
    run_command(folder, *words)
    config = folder / "config" / "config.yaml"
    config.write_text(config.read_text("utf-8").replace("turn_deg: 4.0", "turn_deg: 0"), "utf-8")
    run_command(folder, *words, expected_code=0)
    return folder / "raw" / "paper" / MEDIUM


def force_per_depth(logs, run_id):
    """Slopes of the forces z and x over the depth, N/cm; the clocks meet where the arm begins to move."""
    force, motion = (
        pd.read_csv(logs / f"{run_id}_{kind}.csv", comment="#") for kind in ("force", "motion")
    )
    is_moving = force["arm_moving"] > 0
    has_moved = (
        np.hypot(motion["x_mm"] - motion["x_mm"][0], motion["z_mm"] - motion["z_mm"][0]) > 0.2
    )
    offset_s = motion["time_s"][has_moved].iloc[0] - force["time_s"][is_moving].iloc[0] - 0.1
    z_mm = np.interp(force["time_s"] + offset_s, motion["time_s"], motion["z_mm"])
    depth_cm = 15 - z_mm / 10
    inside = is_moving & (depth_cm > 2) & (depth_cm < 5)
    return np.array(
        [np.polyfit(depth_cm[inside], -force[name][inside], 1)[0] for name in ("F3_N", "F2_N")]
    )


@pytest.mark.parametrize(
    ("run_id", "cell", "side"),
    [
        (f"{MEDIUM}_bm30_g45_in", (-30, 45), 1),
        # up along the path with the plate at -30 degrees: in a mirror, a plate at 30 that moves up at gamma = -45
        (f"{MEDIUM}_bm30_g45_ex", (30, -45), -1),
    ],
)
def test_force_grows_with_depth_as_published(logs, run_id, cell, side):
    table = rftfit.published_table("table_s5").query("medium == @MEDIUM").round({"gamma_deg": 1})
    printed = table.set_index(["beta_deg", "gamma_deg"]).loc[cell]
    of_plate = force_per_depth(logs, run_id) - force_per_depth(logs, f"{run_id}_rod")
    alpha = [printed["alpha_z_N_per_cm3"], side * printed["alpha_x_N_per_cm3"]]
    np.testing.assert_allclose(of_plate / AREA_CM2, alpha, atol=0.02 * np.hypot(*alpha))
