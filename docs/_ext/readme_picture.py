"""First picture of the README, of measured data: ``python docs/_ext/readme_picture.py CAMPAIGN`` writes it into ``docs/images``.

CAMPAIGN is the folder of the example `cmu-sand` after its run; ``make gallery`` makes both. Left, three pushes of a plate.
Right, the side force on a wheel in the same sand, predicted from alpha of these pushes, beside that of the 96 runs of
`examples/wheels/smooth.csv`. What is printed stands below the picture.
"""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from PIL import Image

import rftfit
from rftfit.figures import style
from rftfit.figures.traces import by_run, stress_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.axes import Axes

    from rftfit.results import Results

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "images" / "readme.webp"
RUNS = ROOT / "examples" / "wheels" / "smooth.csv"
MEDIUM = "sand_60mm"
"""The plate as wide as the wheel."""

RADIUS_CM, WIDTH_CM = 6.25, 6.0
FACETS = 48
BLUE, RED = style.OKABE_ITO["blue"], style.OKABE_ITO["vermillion"]


def write(campaign: Path, images: Path = PICTURE.parent) -> str:
    """Write the picture; return how near the predictions are."""
    results = rftfit.open(campaign)
    alpha = results[MEDIUM].alpha.iloc[0]
    runs = pd.read_csv(RUNS)
    forces = predict_side_force(runs, alpha["alpha_z_N_per_cm3"], alpha["alpha_z_se_N_per_cm3"])
    with style.styled():
        page, panels = style.panels([2.3, 6.0], 2, 8.0)
        draw_sketches(panels[0])
        draw_pushes(panels[1, 0], results, alpha)
        draw_side_force(panels[1, 1], runs["force_y_N"], forces)
        entries = {
            "measured": style.line(BLUE, linewidth=1.2),
            "alpha times depth": style.line("black", linestyle="--"),
            "95 % interval of alpha": style.band(0.3, RED),
            "a run": style.dots(BLUE, 3),
            "95 % interval of its force": style.line(RED, linewidth=0.6, alpha=0.5),
            "exactly right": style.line("black"),
        }
        style.legend(page, entries)
        png = style.content(page, "png")
    picture = Image.open(BytesIO(png)).convert("RGB")
    size = 900, round(900 * picture.height / picture.width)
    picture.resize(size, Image.Resampling.LANCZOS).save(
        images / "readme.webp", "webp", quality=60, method=6
    )
    off = forces["force_y_N"] - runs["force_y_N"]
    inside = runs["force_y_N"].between(forces["force_y_model_lo_N"], forces["force_y_model_hi_N"])
    return (
        f"side force on a wheel from alpha {alpha['alpha_z_N_per_cm3']:.3f} N/cm^3: {inside.sum()} of "
        f"{len(runs)} runs inside their 95 % interval; root mean square error {np.sqrt(np.mean(off**2)):.1f} N, "
        f"largest force {runs['force_y_N'].max():.0f} N"
    )


def predict_side_force(runs: pd.DataFrame, alpha: float, se: float) -> pd.DataFrame:
    """Forces on the wheel of each run at its measured sinkage and speed, with their intervals."""
    angle, speed = np.radians(runs["slip_angle_deg"]), runs["travel_mm_per_s"] / 10
    zero = np.zeros(len(runs))
    motion = rftfit.Motion3D(
        np.column_stack([zero, zero, RADIUS_CM - runs["sinkage_mm"] / 10]),
        np.column_stack([speed * np.cos(angle), -speed * np.sin(angle), zero]),
        np.column_stack([zero, runs["measured_rim_mm_per_s"] / 10 / RADIUS_CM, zero]),
    )
    wheel = rftfit.Mesh.cylinder(RADIUS_CM, width_cm=WIDTH_CM, facets=FACETS)
    return rftfit.predict(rftfit.scale(alpha, se=se).profile, wheel, motion)


def draw_sketches(row: npt.NDArray[Any]) -> None:
    """Draw a plate that is pushed down, and a wheel that is pulled through the same sand with some slip to the side."""
    arrow = {"arrowstyle": "-|>", "linewidth": 1.0, "color": style.MARK, "mutation_scale": 8}
    for axes, title in zip(
        row, ("1  Push a plate into sand", "2  Predict the force on a wheel in it"), strict=True
    ):
        axes.set_axis_off()
        axes.set(xlim=(-4, 4), ylim=(-1, 1), aspect="equal")
        axes.axhspan(-1, 0, color=style.SAND, linewidth=0)
        axes.axhline(0, color=style.SURFACE, linewidth=0.6)
        axes.set_title(title, loc="left", weight="bold", fontsize=9)
    plate, wheel = row
    plate.plot([-0.7, 0.7], [-0.35, -0.35], color="black", linewidth=3)
    plate.plot([0, 0], [-0.35, 1], color="black", linewidth=1)
    plate.annotate("", xy=(1.1, -0.85), xytext=(1.1, 0.1), arrowprops=arrow)
    angle = np.linspace(0, 2 * np.pi, 60)
    for middle, colour in ((0.22, "#9a9a9a"), (0.0, "#444444")):
        wheel.fill(middle + 0.55 * np.cos(angle), 0.15 + 0.8 * np.sin(angle), color=colour)
    wheel.annotate("", xy=(2.2, 0.15), xytext=(1.0, 0.15), arrowprops=arrow)


def draw_pushes(axes: Axes, results: Results, alpha: pd.Series) -> None:
    """Draw stress over depth of each push, with the line of alpha and its interval."""
    depths = np.array([0, alpha["depth_to_cm"]])
    for trace in by_run(stress_of(results, MEDIUM)).values():
        within = (trace["depth_cm"] >= 0) & (trace["depth_cm"] <= depths[1])
        axes.plot(
            trace["depth_cm"][within],
            trace["stress_z_N_per_cm2"][within],
            color=BLUE,
            linewidth=1.2,
        )
    ends = (alpha[f"alpha_z_{end}_N_per_cm3"] * depths for end in ("lo", "hi"))
    axes.fill_between(depths, *ends, color=RED, alpha=0.3, linewidth=0)
    axes.plot(depths, alpha["alpha_z_N_per_cm3"] * depths, color="black", linestyle="--")
    axes.set(xlim=depths, ylim=(0, None), xlabel="depth (cm)")
    axes.set_ylabel(f"stress on the plate ({style.PER_CM2})")


def draw_side_force(axes: Axes, measured: pd.Series, forces: pd.DataFrame) -> None:
    """Draw predicted over measured side force."""
    ends = forces["force_y_model_lo_N"], forces["force_y_model_hi_N"]
    axes.vlines(measured, *ends, color=RED, linewidth=0.6, alpha=0.5)
    limits = min(0.0, float(ends[0].min())), float(ends[1].max())
    axes.plot([0, measured.max()], [0, measured.max()], color="black")
    axes.plot(measured, forces["force_y_N"], "o", color=BLUE, markersize=3)
    axes.set_xlabel("measured side force on the wheel (N)")
    axes.set_ylabel("predicted (N)")
    axes.set(xlim=(-1, 1.04 * measured.max()), ylim=(1.05 * limits[0], 1.05 * limits[1]))


if __name__ == "__main__":
    sys.stdout.write(write(Path(sys.argv[1])) + "\n")
