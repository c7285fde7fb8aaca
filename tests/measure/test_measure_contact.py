"""Where a log begins at contact, the interval of alpha includes the error of the surface."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from makers import NOT_MEASURED, TextLog, bench_config, comma_log, row_of_push, write_campaign
from measured import chain

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import errors_of

ALPHA = 1.02
"""N/cm^3."""
AREA_CM2 = np.pi * 2.5**2
NOISE_N = 0.02
PUSHES = 7
OFF_MM = 0.1, 0.5
"""How far the true surface lies from the first reading, least and most."""

TIME = {"column": "t", "unit": "s"}
CONFIG = bench_config(
    comma_log(time=TIME, F3={"column": "f", "unit": "N"}, **NOT_MEASURED),
    comma_log(time=TIME, z={"column": "z", "unit": "mm"}),
    zero={"method": "stated", "sd_N": NOISE_N},
    arm={"speed_cm_per_s": 0.5},
    intruders={"disc": {"shape": "disc", "diameter_cm": 5, "thickness_cm": 0.5}},
    # every other error is none here: the interval is that of the surface and of the noise
    errors={"bed_percent": 0, "angle_deg": 0, "turn_deg": 0, "tare_percent": 0},
)


def alpha_of_pushes(folder, off_mm, seed):
    """Table of alpha of a push of each surface `off_mm` above its first reading, each at an angle of its own.

    And the same with surfaces that are taken to be exact.
    """
    random = np.random.default_rng(seed)
    time = np.arange(80) / 10
    depth_mm = 5.0 * time
    rows, logs = [], {}
    for number, above_mm in enumerate(off_mm):
        force = ALPHA * AREA_CM2 * np.clip(depth_mm + above_mm, 0, None) / 10
        force = force + random.normal(0, NOISE_N, time.size)
        name = f"p{number:03}"
        columns: dict[str, Any] = {"t": time, "f": force, "z": -depth_mm}
        logs[f"{name}.csv"] = TextLog(columns, {}).text()
        beta_deg = number - len(off_mm) // 2
        rows.append(row_of_push(run_id=name, intruder="disc", beta_deg=beta_deg))
    campaign = load_campaign(write_campaign(folder, CONFIG, rows=rows, logs=logs))
    fits = chain(campaign, "sand").fits
    errors, surface = errors_of(fits, campaign.config)
    return [
        alpha_table(fits, "sand", 0.95, 1, errors, surface=taken)
        for taken in (surface, replace(surface, run=0.0, session=0.0))
    ]


def holds_truth(table):
    low, high = (table[f"alpha_z_{end}_N_per_cm3"] for end in ("lo", "hi"))
    return (low < ALPHA) & (high > ALPHA)


@pytest.mark.parametrize("sides", [(-1, 1), (1,), (-1,)])
def test_the_interval_holds_the_error_of_the_surface(tmp_path, sides):
    """The first reading is above the surface or below it, in each push otherwise, or in all alike."""
    random = np.random.default_rng(2)
    off_mm = random.uniform(*OFF_MM, PUSHES) * random.choice(sides, PUSHES)
    table, exact = alpha_of_pushes(tmp_path, off_mm, 3)
    assert holds_truth(table).all()
    assert holds_truth(exact).mean() < 0.2
    assert (table["alpha_z_hi_N_per_cm3"] - table["alpha_z_lo_N_per_cm3"]).max() < 0.12 * ALPHA
