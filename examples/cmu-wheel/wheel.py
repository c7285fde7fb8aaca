"""Forces on a wheel in sand, 96 runs, beside those of a map measured in the plane and of 3D-RFT."""

from pathlib import Path

import numpy as np
import pandas as pd

import rftfit
from rftfit.reference import MEDIA

RADIUS_CM = 6.25
CASES = (  # alpha_z(0, 90 deg) of the plate, law, friction
    (0.853, "measured", None),
    (0.853, "measured", 0.6),
    (0.853, "3d-rft", 0.4),
    (1.26, "measured", None),
    (0.7, "measured", None),
)
FORCES = ["force_x_N", "force_y_N", "force_z_N"]


def mean_map():
    """Mean of the published maps, each over its own alpha_z(0, 90 deg): (2, 7, 13)."""
    media = [rftfit.TableProfile.published(medium) for medium in MEDIA]
    return np.mean(
        [np.stack(one.cells[2:]) / one.alpha(0, np.pi / 2)[0] for one in media], axis=0
    ).reshape(2, 7, 13)


runs = pd.read_csv(Path(__file__).with_name("smooth.csv"))
angle, speed, none = np.radians(runs.slip_angle_deg), runs.travel_mm_per_s / 10, np.zeros(len(runs))
motion = rftfit.Motion3D(
    np.column_stack([none, none, RADIUS_CM - runs.sinkage_mm / 10]),
    np.column_stack([speed * np.cos(angle), -speed * np.sin(angle), none]),
    np.column_stack([none, runs.measured_rim_mm_per_s / 10 / RADIUS_CM, none]),
)
wheel = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=6)
measured, few = runs[FORCES].to_numpy(), abs(runs.slip) <= 0.51
print("rms error x, y, z, N; total; the same where abs(slip) <= 0.51")  # noqa: T201
for alpha, law, friction in CASES:
    sand = rftfit.TableProfile(*(alpha * mean_map()))
    error = (
        rftfit.predict(sand, wheel, motion, law=law, friction=friction)[FORCES].to_numpy()
        - measured
    )
    rms = [np.sqrt((error[rows] ** 2).mean(axis=0)) for rows in (none == 0, few)]
    text = "; ".join(f"{one.round(2)} {np.linalg.norm(one):5.1f}" for one in rms)
    print(f"{alpha:5g} {law:8} friction {friction}: {text}")  # noqa: T201
