"""Intervals of alpha of peaks on exact laws, by how fast the force changes with the attack angle.

    python studies/steep_peaks.py [--count 3] [--rows FOLDER]

Media with an exact law, pushed in 6, 12, 16 and 40 directions of the published grid, straight down among them, with the
usual errors. A row is a peak of a leg: whether the true peak lies in the interval of alpha, and the steepness: relative
change of the force with 5 degrees of the attack angle. The wedge is no law of the map's own kind: stress grows with a power
of how a face leads. The report tells what is inside at several limits of the steepness; 0.15 was chosen on it.
"""

from __future__ import annotations

import sys
import zlib
from functools import partial
from itertools import product
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from exact_laws import SIZE, Law, alpha_by_stress, dot, exact_laws, forces_in_plane
from frame import Part, Row, Tables
from grade_forces import EVERY, NODES, push_table
from shapes import MATERIALS

import rftfit
from rftfit.forces.motion import THETA_DEG
from rftfit.forces.plane import PEAKS
from rftfit.forces.prediction import predict_with_peaks
from rftfit.forces.reference_kernel import angles, place, submerged
from rftfit.model.shapes import usual_error
from rftfit.reference import LEGS

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

COUNTS = (6, 12, 16, 40)
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


def grade_law(name: str, number: int) -> list[Row]:
    """Rows of all peaks in a medium of one law, by one set of pushes."""
    law = laws()[name]
    shapes = rftfit.published_shapes(law.material)
    down = int(np.argmin(np.abs(NODES[0]) + np.abs(NODES[1] - np.pi / 2)))
    random = np.random.default_rng([zlib.crc32(name.encode()), number])
    order = random.permutation(NODES[0].size)
    order = np.append(down, order[order != down])
    truth = law.alpha(*NODES)
    error = usual_error(truth)
    seen = truth + error * random.standard_normal(truth.shape)
    rows: list[Row] = []
    for count in COUNTS:
        places = order[:count]
        directions = [EVERY[place] for place in places]
        pushes = push_table(directions, seen[:, places], error[:, places])
        try:
            profile = rftfit.estimate_map(pushes, shapes).profile
        except ValueError:
            continue
        for leg_name in LEGS:
            rows += [{"count": count} | row for row in rows_of_leg(law, profile, leg_name)]
    return rows


def rows_of_leg(law: Law, profile: rftfit.Profile, leg_name: str) -> list[Row]:
    """Rows of the peaks of one leg that have an interval of alpha."""
    leg, motion = rftfit.model_leg(leg_name), rftfit.rotation(THETA_DEG[::3])
    true = forces_in_plane(law, leg, motion.poses)
    forces, peaks = predict_with_peaks(profile, leg, motion, quantities=[*COMPONENT], model_error=0)
    theta = forces["theta_deg"].to_numpy(float)
    rows: list[Row] = []
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
                "what": f"{peak.name} {leg_name}",
                "steepness": steepness_of(profile, leg, motion.poses[pose], component),
                "inside": 100.0 * (lo <= top <= hi),
            }
        )
    return rows


def report(rows: pd.DataFrame) -> Tables:
    """Peaks inside by number of pushes, and at limits of the steepness above which the interval is withheld."""
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
    inside = rows.pivot_table("inside", "what", "count").reset_index()
    return [("Inside, %, by pushes", inside), ("By steepness", pd.DataFrame(lines))]


PARTS = {
    "steep_peaks": Part(lambda count, _seed: [*product(laws(), range(count))], grade_law, report, 3)
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
