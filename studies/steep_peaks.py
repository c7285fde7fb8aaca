"""Intervals of alpha of peaks on exact laws, by how fast the force changes with the attack angle.

    python studies/steep_peaks.py --rows FOLDER [--sets 3]

Media with an exact law, pushed in 6, 12, 16 and 40 directions of the published grid, straight down among them, with the
usual errors. A row is a peak of a leg: whether the true peak lies in the interval of alpha, and the steepness: relative
change of the force with 5 degrees of the attack angle. The wedge is no law of the map's own kind: stress grows with a power
of how a face leads. The report tells what is inside at several limits of the steepness; 0.15 was chosen on it.
"""

from __future__ import annotations

import argparse
import os
import zlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pandas as pd
from exact_laws import SIZE, Law, alpha_by_stress, dot, exact_laws, forces_in_plane
from shapes import MATERIALS

import rftfit
from rftfit.forces.motion import THETA_DEG
from rftfit.forces.plane import PEAKS
from rftfit.forces.prediction import predict_with_peaks
from rftfit.forces.reference_kernel import angles, place, submerged
from rftfit.model.shapes import usual_error
from rftfit.reference import BETA_DEG, GAMMA_DEG, LEGS

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

COUNTS = (6, 12, 16, 40)
_MESH = np.meshgrid(np.radians(BETA_DEG[1:]), np.radians(GAMMA_DEG), indexing="ij")
NODES = _MESH[0].ravel(), _MESH[1].ravel()
COMPONENT = {"force_z_N": 0, "force_x_N": 1}
LIMITS = (0.08, 0.1, 0.12, 0.15, 0.2, 0.3, np.inf)


def stress_of_wedge(power: float, normal: FloatArray, velocity: FloatArray) -> FloatArray:
    """Stress on a face that pushes a wedge ahead: across it by a power of how it leads, along it by its slope."""
    leading = np.clip(dot(normal, velocity), 0, 1)
    down = -velocity[..., -1:]
    firmness = 0.30 + 0.55 * np.clip(down, 0, 1) + 0.15 * np.abs(normal[..., -1:])
    across = SIZE * leading**power * firmness
    slip = velocity - leading * normal
    along = (
        0.35 * across * np.tanh(4 * np.sqrt(dot(slip, slip))) * (1 - 0.5 * np.abs(normal[..., -1:]))
    )
    return np.asarray(-across * normal - along * slip / np.sqrt(dot(slip, slip) + 1e-6))


def laws() -> dict[str, Law]:
    """Laws of `exact_laws`, and two of a wedge."""
    wedges = {}
    for power in (0.7, 1.3):
        stress = partial(stress_of_wedge, power)
        name = f"wedge {power:g}"
        wedges[name] = Law(name, partial(alpha_by_stress, stress), stress)
    return exact_laws(MATERIALS) | wedges


def steepness_of(
    profile: rftfit.Profile, leg: rftfit.Outline, pose: FloatArray, component: int
) -> float:
    """Relative change of force z (component 0) or x with 5 degrees of the attack angle in a pose (6,)."""
    elements = place(leg.body, leg.width_cm, pose[None])
    load = submerged(elements, leg.solid)[0]
    beta, gamma = (np.where(load == 0, 0.0, angle) for angle in angles(elements))
    turned = np.radians([-5.0, 0.0, 5.0])[:, None]
    less, force, more = (load * profile.alpha(beta + turned, gamma)[component]).sum(axis=-1)
    return abs(more - less) / 2 / abs(force)


def rows_of_law(law: Law, sets: int) -> list[dict[str, object]]:
    """Rows of all peaks in a medium of one law."""
    rows: list[dict[str, object]] = []
    motion = rftfit.rotation(THETA_DEG[::3])
    shapes = rftfit.published_shapes(law.material)
    down = int(np.argmin(np.abs(NODES[0]) + np.abs(NODES[1] - np.pi / 2)))
    for number in range(sets):
        random = np.random.default_rng([zlib.crc32(law.name.encode()), number])
        order = random.permutation(NODES[0].size)
        order = np.append(down, order[order != down])
        truth = law.alpha(*NODES)
        error = usual_error(truth)
        seen = truth + error * random.standard_normal(truth.shape)
        for count in COUNTS:
            places = order[:count]
            pushes = pd.DataFrame(
                {
                    "beta_deg": np.degrees(NODES[0][places]),
                    "gamma_deg": np.degrees(NODES[1][places]),
                    "alpha_z_N_per_cm3": seen[0, places],
                    "alpha_x_N_per_cm3": seen[1, places],
                    "se_z": error[0, places],
                    "se_x": error[1, places],
                }
            )
            try:
                profile = rftfit.estimate_map(pushes, shapes).profile
            except ValueError:
                continue
            for name in LEGS:
                leg = rftfit.model_leg(name)
                true = forces_in_plane(law, leg, motion.poses)
                forces, peaks = predict_with_peaks(
                    profile, leg, motion, quantities=[*COMPONENT], model_error=0
                )
                theta = forces["theta_deg"].to_numpy(float)
                for peak in peaks:
                    if peak.quantity not in COMPONENT or not np.isfinite(peak.lo):
                        continue
                    target = next(target for target in PEAKS if target.name == peak.name)
                    component = COMPONENT[peak.quantity]
                    pose = int(np.argmin(np.abs(theta - peak.position)))
                    top = max(float((target.sign * true[component]).max()), 0.0)
                    lo, hi = sorted(target.sign * end for end in (peak.lo, peak.hi))
                    rows.append(
                        {
                            "law": law.name,
                            "set": number,
                            "count": count,
                            "leg": name,
                            "peak": peak.name,
                            "value_N": abs(peak.value),
                            "true_N": top,
                            "lo_N": lo,
                            "hi_N": hi,
                            "steepness": steepness_of(profile, leg, motion.poses[pose], component),
                            "inside": 100.0 * (lo <= top <= hi),
                        }
                    )
    return rows


def report(rows: pd.DataFrame) -> str:
    """Peaks inside by number of pushes, and at limits of the steepness above which the interval is withheld."""
    rows = rows.assign(what=rows["peak"] + " " + rows["leg"])
    lines = []
    for limit in LIMITS:
        shown = rows[rows["steepness"] <= limit]
        reversed_lift = shown[shown["what"] == "lift reversed_c_leg"]
        lines.append(
            {
                "limit": limit,
                "shown, %": 100 * len(shown) / len(rows),
                "inside, %": shown["inside"].mean(),
                "lift of the reversed leg shown": len(reversed_lift),
                "its inside, %": reversed_lift["inside"].mean(),
            }
        )
    inside = rows.pivot_table("inside", "what", "count").round(0)
    return f"{inside.to_string()}\n\n{pd.DataFrame(lines).round(1).to_string(index=False)}"


def main() -> None:
    """Make the rows of all laws and print the report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=Path, required=True)
    parser.add_argument("--sets", type=int, default=3)
    arguments = parser.parse_args()
    arguments.rows.mkdir(parents=True, exist_ok=True)
    parts = []
    for name, law in laws().items():
        file = arguments.rows / f"{name.replace(' ', '_')}_{arguments.sets}.csv"
        if not file.is_file():
            pd.DataFrame(rows_of_law(law, arguments.sets)).to_csv(file, index=False)
        parts.append(pd.read_csv(file))
    print(report(pd.concat(parts, ignore_index=True)))


if __name__ == "__main__":
    main()
