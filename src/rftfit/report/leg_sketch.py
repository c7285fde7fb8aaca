"""A leg drawn in the sand at a few angles: the inset that says what theta and the leg's name mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.predict.outline import CURVATURES, leg_outline
from rftfit.report import labels

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from rftfit.report.grid import FloatArray

SKETCH_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)
_SAND, _SURFACE = "#efe6d2", "#8a7343"


def model_legs() -> dict[str, Leg]:
    """Make the paper's three legs.

    Returns
    -------
    dict of str to Leg
    """
    return {
        name: Leg(
            shape="leg", curvature_times_R=curvature, max_length_cm=7.62, width_cm=2.54,
            thickness_cm=0.64, hip_height_cm=2.0,
        )
        for name, curvature in CURVATURES.items()
    }  # fmt: skip


def leg_line(leg: Leg, theta_deg: float) -> FloatArray:
    """Points along a leg, from its axle to its tip.

    Parameters
    ----------
    leg : Leg
    theta_deg : float

    Returns
    -------
    numpy.ndarray, shape (n, 2)
        x, z (cm) in the lab frame, the axle over x = 0.
    """
    x, z, tx, tz, half = leg_outline(leg).body.T
    last = [x[-1] + half[-1] * tx[-1], z[-1] + half[-1] * tz[-1]]
    body = np.vstack([np.column_stack([x - half * tx, z - half * tz]), last])
    cos, sin = np.cos(np.radians(theta_deg)), np.sin(np.radians(theta_deg))
    turned = np.column_stack(
        [body[:, 0] * cos + body[:, 1] * sin, body[:, 1] * cos - body[:, 0] * sin]
    )
    turned[:, 1] += leg.hip_height_cm
    return turned


def add_sketch(axes: Axes, leg: Leg | None, theta_deg: Sequence[float] = SKETCH_DEG) -> None:
    """Draw a leg in the sand at some angles, to scale, with a bar of 2 cm.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Emptied of its frame; its aspect becomes equal.
    leg : Leg or None
        None where its shape is not known, which the panel then says.
    theta_deg : sequence of float
        Every other angle is drawn darker, so that neighbours stay apart.
    """
    axes.set_axis_off()
    if leg is None:
        axes.text(0.5, 0.5, "shape of this leg not given", ha="center", va="center",
                  transform=axes.transAxes, fontsize=6)  # fmt: skip
        return
    reach, hip = leg.max_length_cm, leg.hip_height_cm
    left, right, bottom, top = -1.6 * reach, 1.6 * reach, hip - 1.35 * reach, hip + 0.38 * reach
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.axhspan(bottom, 0, color=_SAND, linewidth=0)
    axes.axhline(0, color=_SURFACE, linewidth=0.6)
    for theta in theta_deg:
        line = leg_line(leg, theta)
        dark = theta == 0
        colour = "black" if dark else "#7a7a7a"
        axes.plot(*line.T, color=colour, linewidth=1.4 if dark else 0.9, solid_capstyle="round")
        outward = np.array([-np.sin(np.radians(theta)), -np.cos(np.radians(theta))])
        x, z = [0.0, hip] + outward * (1.17 * reach)
        axes.text(x, z, labels.degrees(theta), ha="center", va="center", fontsize=5, color=colour)
    axes.plot(0, hip, "o", color="black", markersize=2.5)
    _turn_arrow(axes, reach, hip, -1 if leg.curvature_times_R < 0 else 1)
    x0, z0 = right - 0.42 * reach, bottom + 0.14 * reach
    axes.plot([x0, x0 + 2], [z0, z0], color="black", linewidth=1)
    axes.text(x0 + 1, z0 + 0.06 * reach, "2 cm", ha="center", va="bottom", fontsize=5)
    _frame_arrows(axes, left + 0.12 * reach, hip - 1.25 * reach, 0.3 * reach)


def _turn_arrow(axes: Axes, reach: float, hip: float, side: int) -> None:
    start, end = ((-np.sin(a) * 0.32 * reach, hip - np.cos(a) * 0.32 * reach)
                  for a in np.radians([150.0, 210.0]))  # fmt: skip
    # over the axle, from back to front: the sense in which theta grows below it
    axes.annotate("", xy=end, xytext=start, arrowprops={
        "arrowstyle": "->", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6,
        "connectionstyle": "arc3,rad=-0.5"})  # fmt: skip
    axes.text(
        side * 0.3 * reach, hip + 0.3 * reach, r"$\theta$", ha="center", va="center", fontsize=6
    )


def _frame_arrows(axes: Axes, x: float, z: float, length: float) -> None:
    how = {"arrowstyle": "->", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
    for dx, dz, name in ((length, 0.0, "x"), (0.0, length, "z")):
        axes.annotate("", xy=(x + dx, z + dz), xytext=(x, z), arrowprops=how)
        axes.text(x + 1.35 * dx, z + 1.35 * dz, f"${name}$", ha="center", va="center", fontsize=6)


def sketched(legs: Mapping[str, Leg] | None) -> Mapping[str, Leg]:
    """Shapes to sketch: those of the config, or the paper's three.

    Parameters
    ----------
    legs : mapping of str to Leg, optional

    Returns
    -------
    mapping of str to Leg
    """
    return model_legs() if legs is None else legs
