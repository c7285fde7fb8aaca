"""Forces on a wheel in sand, 96 runs, beside those of a map measured in the plane and of 3D-RFT.

``python studies/side_slip.py [FIGURE.png]`` prints the table and the verdict and draws the figure.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import rftfit
from rftfit.conventions import FloatArray
from rftfit.reference import MEDIA

RUNS = Path(__file__).parents[1] / "examples" / "wheels" / "smooth.csv"
RADIUS_CM = 6.25
DEPTHS_CM = np.arange(0.1, 12.05, 0.1)
MODEST_SLIP = 0.51
CASES: dict[
    str, tuple[float, Any, float | None]
] = {  # alpha_z(0, 90 deg) of the plate, law, friction
    "measured law": (0.853, "measured", None),
    "measured law, friction 0.6": (0.853, "measured", 0.6),
    "3D-RFT, friction 0.4": (0.853, "3d-rft", 0.4),
    "measured law, plate of 1.26": (1.26, "measured", None),
    "measured law, plate of 0.7": (0.7, "measured", None),
}
FORCES = ["force_x_N", "force_y_N", "force_z_N"]


def mean_map() -> FloatArray:
    """Mean of the published maps, each over its own alpha_z(0, 90 deg): (2, 7, 13)."""
    media = [rftfit.TableProfile.published(medium) for medium in MEDIA]
    maps = [np.stack(one.cells[2:]) / one.alpha(0, np.pi / 2)[0] for one in media]
    return np.mean(maps, axis=0).reshape(2, 7, 13)


def at_depth(runs: pd.DataFrame, sinkage_cm: Any) -> rftfit.Motion3D:
    """The wheel in each run, driven as it was, so deep."""
    angle, speed, none = np.radians(runs.slip_angle_deg), runs.travel_mm_per_s / 10, 0 * runs.slip
    return rftfit.Motion3D(
        np.column_stack([none, none, RADIUS_CM - sinkage_cm]),
        np.column_stack([speed * np.cos(angle), -speed * np.sin(angle), none]),
        np.column_stack([none, runs.measured_rim_mm_per_s / 10 / RADIUS_CM, none]),
    )


def predicted(runs: pd.DataFrame, case: str) -> tuple[FloatArray, FloatArray]:
    """Forces at the measured depth (runs, 3), N, and the depth at which the measured load is carried, cm."""
    alpha, law, friction = CASES[case]
    sand = rftfit.TableProfile(*(alpha * mean_map()))

    def forces(mesh: rftfit.Mesh, sinkage_cm: Any) -> FloatArray:
        motion = at_depth(runs, sinkage_cm)
        return rftfit.predict(sand, mesh, motion, law=law, friction=friction)[FORCES].to_numpy()

    found = forces(rftfit.Mesh.cylinder(RADIUS_CM, width_cm=6), runs.sinkage_mm / 10)
    coarse = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=6, facets=48)
    lift = np.array([forces(coarse, 0 * runs.slip + depth)[:, 2] for depth in DEPTHS_CM])
    enough = lift >= runs.force_z_N.to_numpy()
    first = enough.argmax(axis=0)  # lift grows with depth: the first depth that carries the load
    upper, lower = (
        np.take_along_axis(lift, at[None], axis=0)[0] for at in (first, np.maximum(first - 1, 0))
    )
    share = (runs.force_z_N - lower) / np.where(upper > lower, upper - lower, 1)
    depth = DEPTHS_CM[np.maximum(first - 1, 0)] + share * (DEPTHS_CM[1] - DEPTHS_CM[0])
    return found, np.where(enough.any(axis=0), depth, np.nan)


def rms(error: Any) -> Any:
    """Root mean square over the runs of each column."""
    return np.sqrt(np.nanmean(error**2, axis=0))


def draw(runs: pd.DataFrame, results: dict[str, tuple[FloatArray, FloatArray]]) -> Figure:
    """Predicted over measured forces and depths; open points: abs(slip) above 0.51."""
    page = Figure(figsize=(7.2, 5.6), layout="constrained")
    modest = (abs(runs.slip) <= MODEST_SLIP).to_numpy()
    panels = [*(name.replace("_N", " (N)").replace("_", " ") for name in FORCES), "sinkage (mm)"]
    for column, (axes, name) in enumerate(zip(page.subplots(2, 2).flat, panels, strict=True)):
        measured = runs.sinkage_mm if column == 3 else runs[FORCES[column]]
        for case, colour in (("measured law", "#0072B2"), ("3D-RFT, friction 0.4", "#E69F00")):
            forces, depth = results[case]
            model = 10 * depth if column == 3 else forces[:, column]
            axes.plot(measured[modest], model[modest], "o", color=colour, markersize=3, label=case)
            axes.plot(
                measured[~modest], model[~modest], "o", color=colour, markersize=3, mfc="none"
            )
        axes.axline((measured.mean(), measured.mean()), slope=1, color="#808080", linewidth=0.6)
        axes.set(xlabel=f"measured {name}", ylabel=f"predicted {name}")
    page.axes[0].legend(fontsize=7)
    return page


def main() -> None:
    """Print table and verdict; draw the figure where one is named."""
    runs = pd.read_csv(RUNS)
    measured, few = runs[FORCES].to_numpy(), abs(runs.slip) <= MODEST_SLIP
    results = {case: predicted(runs, case) for case in CASES}
    print("rms error of force x, y, z; total; N | where abs(slip) <= 0.51 | sinkage, mm | no depth")
    for case, (forces, depth) in results.items():
        each = [rms((forces - measured)[rows]) for rows in (few | True, few)]
        text = " | ".join(f"{one.round(2)} {np.linalg.norm(one):5.1f}" for one in each)
        off = 10 * depth - runs.sinkage_mm
        sinkage = f"{rms(off):.1f} (mean {off.mean():+.1f}; few {rms(off[few]):.1f})"
        print(f"{case:27} | {text} | {sinkage} | {np.isnan(depth).sum()}")
    print(f"sinkage measured: mean {runs.sinkage_mm.mean():.1f}, sd {runs.sinkage_mm.std():.1f} mm")
    if len(sys.argv) > 1:
        draw(runs, results).savefig(sys.argv[1], dpi=150)


if __name__ == "__main__":
    main()
