"""Where a log begins at contact, the interval of alpha includes the error of the surface."""

from typing import Any

import numpy as np
import pytest
import yaml
from campaigns import chain

from rftfit.campaign.load import load_campaign
from rftfit.measure.alpha import alpha_table
from rftfit.measure.errors import SurfaceError, errors_of

ALPHA = 1.02
"""N/cm^3."""
AREA_CM2 = np.pi * 2.5**2
NOISE_N = 0.02
PUSHES = 7
OFF_MM = 0.1, 0.5
"""How far the true surface lies from the first reading, least and most."""

CONFIG: dict[str, Any] = {
    "title": "from contact on",
    "raw": "raw",
    "run_sheet": "runs.csv",
    "force_log": {
        "text": {"delimiter": ","},
        "columns": {
            "time": {"column": "t", "unit": "s"},
            "F1": {"constant": 0, "unit": "N"},
            "F2": {"constant": 0, "unit": "N"},
            "F3": {"column": "f", "unit": "N"},
        },
    },
    "motion_log": {
        "text": {"delimiter": ","},
        "columns": {"time": {"column": "t", "unit": "s"}, "z": {"column": "z", "unit": "mm"}},
    },
    "clock": {"method": "same_clock"},
    "transducer": {
        "name": "load cell",
        "range_N": [500, 500, 500],
        "axes": {"x": "+F1", "y": "+F2", "z": "+F3"},
    },
    "zero": {"method": "stated", "sd_N": NOISE_N},
    "arm": {"speed_cm_per_s": 0.5},
    "container": {"length_cm": 60, "width_cm": 60, "depth_cm": 30},
    "intruders": {"disc": {"shape": "disc", "diameter_cm": 5, "thickness_cm": 0.5}},
    "media": {"sand": {"title": "sand"}},
    "fit": {"missing_tare": "flag"},
    # every other error is none here: the interval is that of the surface and of the noise
    "errors": {"bed_percent": 0, "angle_deg": 0, "turn_deg": 0, "tare_percent": 0},
}


def alpha_of_pushes(folder, off_mm, seed):
    """Table of alpha of a push of each surface `off_mm` above its first reading, each at an angle of its own.

    And the same with surfaces that are taken to be exact.
    """
    random = np.random.default_rng(seed)
    time = np.arange(80) / 10
    depth_mm = 5.0 * time
    (folder / "raw").mkdir(parents=True)
    lines = ["run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log"]
    for number, above_mm in enumerate(off_mm):
        force = ALPHA * AREA_CM2 * np.clip(depth_mm + above_mm, 0, None) / 10
        columns = time, force + random.normal(0, NOISE_N, time.size), -depth_mm
        file = f"push{number}.csv"
        path = folder / "raw" / file
        np.savetxt(path, np.transpose(columns), "%.4f", ",", header="t,f,z", comments="")
        lines.append(
            f"p{number:03},plate,sand,disc,intrusion,{number - len(off_mm) // 2},90,{file},{file}"
        )
    (folder / "runs.csv").write_text("\n".join([*lines, ""]))
    (folder / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    campaign = load_campaign(folder / "config.yaml")
    fits = chain(campaign, "sand").fits
    errors, surface = errors_of(fits, campaign.config)
    return [
        alpha_table(fits, "sand", 0.95, 1, errors, surface=taken)
        for taken in (surface, SurfaceError())
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
