"""The drawings of the documentation, which ``make gallery`` writes into ``docs/images``.

Every arrow is computed by the package: angles by `rftfit.conventions`, forces by a published medium.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import rftfit
from rftfit import conventions
from rftfit.figures import style
from rftfit.forces import reference_kernel

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEEL, DARK = "#4d4d4d", "#222222"
MOTION, FORCE, ANGLE = (style.OKABE_ITO[name] for name in ("bluish green", "vermillion", "blue"))
FONT = 9
MEDIUM = "poppy_LP"
PLATE_CM = 2.54


# --- What the drawings are made of


def sheet(
    width_cm: float, height_cm: float, columns: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """Return a figure with a row of panels without frames, one cm being as long along both axes."""
    figure = style.new_figure(width_cm, height_cm)
    figure.set_layout_engine("constrained", w_pad=0.03, h_pad=0.03)
    panels = figure.subplots(1, columns, squeeze=False, **options)[0]
    for panel in panels:
        panel.set_aspect("equal")
        panel.axis("off")
    return figure, panels[0] if columns == 1 else panels


def bed(axes: Axes, left: float, right: float, bottom: float, top: float) -> None:
    """Fill the medium below z = 0 and set the limits."""
    axes.fill_between([left, right], bottom, 0, color=style.SAND, linewidth=0)
    axes.plot([left, right], [0, 0], color=style.SURFACE, linewidth=1)
    axes.set(xlim=(left, right), ylim=(bottom, top))


def arrow(
    axes: Axes, start: Any, vector: Any, colour: str, label: str = "", **options: Any
) -> None:
    """Draw an arrow, and a word at its head."""
    (x, z), (dx, dz) = start, vector
    if float(np.hypot(dx, dz)) > 0.02:
        arrow_style = {
            "arrowstyle": "-|>",
            "color": colour,
            "linewidth": options.pop("width", 1.6),
            "mutation_scale": options.pop("head", 9),
            "shrinkA": 0,
            "shrinkB": 0,
        }
        axes.annotate("", (x + dx, z + dz), (x, z), arrowprops=arrow_style)
    if label:
        label_place = options.pop("at", (x + 1.12 * dx, z + 1.12 * dz))
        say(axes, label_place, label, color=colour, **options)


def say(axes: Axes, place: Any, text: str, **options: Any) -> None:
    """Write at a place."""
    axes.text(*place, text, **({"fontsize": FONT, "ha": "center", "va": "center"} | options))


def bent(
    axes: Axes, centre: Any, radius: float, start: Any, end: Any, colour: str = ANGLE
) -> float:
    """Draw an arc from one direction to another the shorter way round; return its middle, rad."""
    first, last = (float(np.arctan2(way[1], way[0])) for way in (start, end))
    turn = (last - first + np.pi) % (2 * np.pi) - np.pi
    way = first + np.linspace(0, turn, 40)
    x, z = centre[0] + radius * np.cos(way), centre[1] + radius * np.sin(way)
    axes.plot(x[:-3], z[:-3], color=colour, linewidth=1.2)
    arrow(axes, (x[-4], z[-4]), (x[-1] - x[-4], z[-1] - z[-4]), colour, width=1.2, head=7)
    return first + turn / 2


def plate(axes: Axes, beta: float, centre: Any, length: float = PLATE_CM, **options: Any) -> None:
    """Draw a plate, seen from its edge."""
    way = np.array(conventions.tangent(beta))
    ends = np.array(centre) + np.outer([-0.5, 0.5], way) * length
    line_style = {"color": STEEL, "linewidth": 4, "solid_capstyle": "butt"} | options
    axes.plot(ends[:, 0], ends[:, 1], **line_style)


def lab_axes(axes: Axes, origin: Any, length: float = 0.8) -> None:
    """Draw the lab frame: x to the right, z up."""
    arrow(axes, origin, (length, 0), DARK, "$x$", width=1, head=7)
    arrow(axes, origin, (0, length), DARK, "$z$", width=1, head=7)


def force(beta: float, gamma: float) -> tuple[float, float]:
    """Return alpha_x, alpha_z (N/cm^3) of the published medium: the force's direction and size."""
    alpha_z, alpha_x = rftfit.published_medium(MEDIUM).alpha(beta, gamma)
    return float(alpha_x), float(alpha_z)


# --- The drawings


@style.styled()
def angles() -> Figure:
    """Attack angle, direction of motion and force of a plate; angle of a leg."""
    figure, (left, right) = sheet(12, 5.6, 2, width_ratios=(1.25, 1))
    beta, gamma = np.radians(30), np.radians(60)
    centre = np.array([0.0, -2.2])
    way, going = (
        np.array(vector) for vector in (conventions.tangent(beta), conventions.direction(gamma))
    )
    bed(left, -3.0, 3.3, -4.6, 1.6)
    lab_axes(left, (-2.8, 0.3))
    left.plot([-2.1, 2.1], [centre[1]] * 2, color=style.GREY, linewidth=0.8, linestyle="--")
    plate(left, beta, centre)
    arrow(left, centre, 1.9 * going, MOTION, "motion", va="top")
    middle = bent(left, centre, 1.75, (1, 0), way)
    say(left, centre + 2.05 * np.array([np.cos(middle), np.sin(middle)]), r"$\beta$", color=ANGLE)
    middle = bent(left, centre, 1.2, (-1, 0), going)
    say(left, centre + 1.55 * np.array([np.cos(middle), np.sin(middle)]), r"$\gamma$", color=ANGLE)
    arrow(left, centre, 4.5 * np.array(force(beta, gamma)), FORCE, "force")
    left.plot([2.7, 2.7], [0, centre[1]], color=DARK, linewidth=0.8, marker="_")
    say(left, (2.75, centre[1] / 2), " $|z|$", ha="left")
    leg_at(right, "c_leg", -40)
    return figure


def leg_at(axes: Axes, name: str, theta_deg: float) -> None:
    """Draw a model leg, its angle theta, and the way its tip goes."""
    pose = rftfit.rotation([theta_deg]).poses
    axle = pose[0, :2]
    bed(axes, -6.5, 6.8, -6.9, 4.2)
    elements = reference_kernel.place(rftfit.model_leg(name).body, 2.54, pose)[0]
    line = elements[:, :2]
    tip = elements[-1, :2] + elements[-1, 4] * elements[-1, 2:4]
    axes.plot(*np.vstack([axle, line, tip]).T, color=STEEL, linewidth=3, solid_capstyle="round")
    axes.plot(*axle, "o", color=DARK, markersize=5)
    axes.plot(
        [axle[0]] * 2, [axle[1], axle[1] - 6.9], color=style.GREY, linewidth=0.8, linestyle="--"
    )
    axes.plot(*np.vstack([axle, tip]).T, color=style.GREY, linewidth=0.8, linestyle="--")
    going = elements[-1, 6:8] / np.hypot(*elements[-1, 6:8])
    arrow(axes, tip, 2.6 * going, MOTION)
    middle = bent(axes, axle, 3.2, (0, -1), tip - axle)
    say(axes, axle + 4.2 * np.array([np.cos(middle), np.sin(middle)]), r"$\theta$", color=ANGLE)
    if theta_deg < 0:
        say(axes, np.add(axle, (0, 1.3)), "axle")
        say(axes, np.add(tip, (0.2, 0.9)), "tip")


@style.styled()
def frames() -> Figure:
    """Rod, plate, sensor and its channels, and the lab frame."""
    from rftfit.campaign.config import Transducer
    from rftfit.measure.lab_frame import sensor_to_lab

    figure, axes = sheet(12, 7.4)
    bed(axes, -5.2, 7.4, -3.2, 6.0)
    lab_axes(axes, (-4.7, 0.3), 1.3)
    say(axes, (-4.7, 2.4), "lab frame", ha="left")
    axes.plot([0, 0], [-1.9, 3.4], color=STEEL, linewidth=3)
    plate(axes, np.radians(30), (0, -1.9))
    axes.add_patch(_box((-0.8, 3.4), 1.6, 0.9, "#9ec9e8"))
    axes.add_patch(_box((-1.3, 4.3), 2.6, 1.4, "#d9d9d9"))
    say(axes, (0, 5.0), "arm")
    say(axes, (-1.0, 3.8), "transducer", ha="right")
    say(axes, (0.25, 1.2), "rod", ha="left")
    say(axes, (1.5, -2.0), "plate", ha="left")
    words = {"x": "-F2", "y": "+F1", "z": "-F3"}
    turned = Transducer(name="", range_N=(65, 65, 200), precision_N=0.05, axes=words, turn_deg=8)
    channels = sensor_to_lab(turned)  # a row of each lab axis, a column of each channel
    for number in (1, 2):
        way = channels[:, number]
        arrow(axes, (3.6, 3.7), 1.5 * way, ANGLE, f"$F_{number + 1}$")
    say(axes, (3.6, 5.6), "tool frame: channels", color=ANGLE)
    say(axes, (3.9, 3.85), r"$F_1$ across", color=ANGLE, ha="left", va="bottom")
    return figure


def _box(corner: tuple[float, float], width: float, height: float, colour: str) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle(corner, width, height, facecolor=colour, edgecolor=STEEL)


@style.styled()
def directions() -> Figure:
    """Plates at seven attack angles, moved in five directions, and what each feels."""
    betas, gammas = (-60, -30, 0, 30, 60, 90), (90, 45, 0, -45, -90)
    figure, axes = sheet(12, 9.2)
    axes.set(xlim=(-1.2, 5.5), ylim=(-4.6, 1.0))
    for column, beta in enumerate(betas):
        say(axes, (column, 0.85), rf"$\beta$ = {style.degrees(beta)}")
        for row, gamma in enumerate(gammas):
            centre = np.array([column, -row])
            plate(axes, np.radians(beta), centre, 0.6, linewidth=3)
            going = 0.42 * np.array(conventions.direction(np.radians(gamma)))
            arrow(axes, centre, going, MOTION, width=1.2, head=7)
            arrow(axes, centre, 1.9 * np.array(force(np.radians(beta), np.radians(gamma))), FORCE)
    for row, gamma in enumerate(gammas):
        say(axes, (-1.2, -row), rf"$\gamma$ = {style.degrees(gamma)}", ha="left")
    return figure


@style.styled()
def mirrored() -> Figure:
    """A plate and its mirror image: the same lift, the opposite drag."""
    figure, axes = sheet(12, 4.8)
    bed(axes, -5.4, 5.4, -3.6, 1.1)
    beta, gamma = np.radians(30.0), np.radians(45.0)
    for (b, g), x in zip(
        ((beta, gamma), conventions.mirror(beta, gamma)), (2.4, -2.4), strict=True
    ):
        centre = np.array([x, -1.7])
        plate(axes, float(b), centre)
        arrow(axes, centre, 1.5 * np.array(conventions.direction(g)), MOTION)
        arrow(axes, centre, 4.5 * np.array(force(float(b), float(g))), FORCE)
        shown = [style.degrees(float(np.degrees(angle))) for angle in (b, g)]
        say(axes, (x, 0.5), rf"$\beta$ = {shown[0]}, $\gamma$ = {shown[1]}")
    axes.plot([0, 0], [-3.4, 0.9], color=style.GREY, linestyle=":", linewidth=1)
    return figure


@style.styled()
def superposition() -> Figure:
    """Forces on the elements of a c-leg and their sum; lift over theta."""
    figure = style.new_figure(12, 5.6)
    figure.set_layout_engine("constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1))
    left.set_aspect("equal")
    left.axis("off")
    bed(left, -5.2, 7.6, -6.8, 6.4)
    theta_deg = -35.0
    profile, leg = rftfit.published_medium(MEDIUM), rftfit.model_leg("c_leg")
    pose = rftfit.rotation([theta_deg]).poses
    elements = reference_kernel.place(leg.body, leg.width_cm, pose)
    on_each = reference_kernel.element_forces(profile, elements)[0]
    total = reference_kernel.net(on_each, pose[0, 0], pose[0, 1])
    left.plot(*elements[0, :, :2].T, color=STEEL, linewidth=3)
    left.plot(*pose[0, :2], "o", color=DARK, markersize=5)
    for lift, thrust, x, z in on_each[::2]:
        arrow(left, (x, z), 4.0 * np.array([thrust, lift]), FORCE, width=0.9, head=5)
    arrow(left, pose[0, :2], 0.35 * np.array([total[1], total[0]]), style.OKABE_ITO["black"])
    say(left, (-5.0, 5.8), "black: sum, other scale", ha="left", fontsize=FONT - 1)
    say(left, (-5.0, -6.2), "every second force", ha="left", color=FORCE, fontsize=FONT - 1)
    poses = rftfit.rotation().poses
    every = reference_kernel.pose_forces(profile, leg.body, leg.width_cm, leg.solid, poses)
    right.plot(
        np.degrees(poses[:, 2]), every[:, 0], color=style.COMPONENT_COLOURS["z"], label="lift"
    )
    right.plot(
        np.degrees(poses[:, 2]), every[:, 1], color=style.COMPONENT_COLOURS["x"], label="thrust"
    )
    right.plot([theta_deg] * 2, total[:2], "o", color=style.OKABE_ITO["black"], markersize=4)
    _label(right, r"$\theta$ (deg)", "force on the leg (N)")
    return figure


def _label(axes: Axes, across: str, up: str, **options: Any) -> None:
    style.zero_line(axes)
    axes.set_xlabel(across, fontsize=FONT)
    axes.set_ylabel(up, fontsize=FONT)
    axes.tick_params(labelsize=FONT - 1)
    axes.legend(fontsize=FONT - 1, **options)


@style.styled()
def legs() -> Figure:
    """The three model legs, and theta on both sides of straight down."""
    figure, panels = sheet(12, 4.0, 3)
    titles = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}
    for axes, (name, title), theta in zip(panels, titles.items(), (-40, 25, 25), strict=True):
        leg_at(axes, name, theta)
        axes.set_title(rf"{title}, $\theta$ = {style.degrees(theta)}", fontsize=FONT)
    return figure


@style.styled()
def where_it_fails() -> Figure:
    """Lift of the c-leg and the reversed c-leg: measured, and by the measured table of stresses."""
    figure = style.new_figure(12, 5.4)
    figure.set_layout_engine("constrained")
    measured = rftfit.published_table("fig_s5")
    poses = rftfit.rotation().poses
    names = {"c_leg": "c-leg: well", "reversed_c_leg": "reversed c-leg: too high"}
    for axes, (name, title) in zip(figure.subplots(1, 2), names.items(), strict=True):
        curve = measured[(measured["medium"] == MEDIUM) & (measured["leg"] == name)]
        leg = rftfit.model_leg(name)
        profile = rftfit.published_medium(MEDIUM)
        lift = reference_kernel.pose_forces(profile, leg.body, leg.width_cm, leg.solid, poses)[:, 0]
        axes.plot(curve["theta_deg"], curve["force_z_N"], color=DARK, label="measured (Fig. S5)")
        axes.plot(np.degrees(poses[:, 2]), lift, color=FORCE, linestyle="--", label="model")
        _label(axes, r"$\theta$ (deg)", "lift (N)", loc="upper left")
        axes.set_title(title, fontsize=FONT)
        axes.set_ylim(top=1.55 * max(lift.max(), curve["force_z_N"].max()))
    return figure


@style.styled()
def nine_terms() -> Figure:
    """alpha_z of loose poppy seeds over the measured angles: the table, the nine terms, their difference."""
    figure = style.new_figure(12, 5.2)
    figure.set_layout_engine("constrained")
    beta, gamma = np.meshgrid(np.linspace(-90, 90, 61), np.linspace(-90, 90, 61), indexing="ij")
    table, terms = (
        rftfit.published_medium(MEDIUM, kind).alpha(np.radians(beta), np.radians(gamma))[0]
        for kind in ("table", "fourier")
    )
    shown = {"measured table": table, "nine terms": terms, "terms less table": terms - table}
    panels = figure.subplots(1, 3, sharey=True)
    for axes, (title, values) in zip(panels, shown.items(), strict=True):
        drawn = axes.pcolormesh(
            gamma, beta, values, cmap=style.DIVERGING, vmin=-0.3, vmax=0.3, rasterized=True
        )
        axes.set_title(title, fontsize=FONT)
        axes.set_xlabel(r"$\gamma$ (deg)", fontsize=FONT)
        axes.set(xticks=[-90, 0, 90], yticks=[-90, 0, 90])
        axes.tick_params(labelsize=FONT - 1)
    panels[0].set_ylabel(r"$\beta$ (deg)", fontsize=FONT)
    bar = figure.colorbar(drawn, ax=panels, location="bottom", aspect=40)
    bar.set_label(style.alpha_label("z"), fontsize=FONT)
    bar.ax.tick_params(labelsize=FONT - 1)
    return figure


@style.styled()
def push(samples: pd.DataFrame, fits: pd.DataFrame, runs: dict[str, str]) -> Figure:
    """Stress against depth of runs, and the line through zero that was fitted.

    `samples`, `fits`: Of `rftfit.figures.traces.stress_samples` and the slope stage. `runs`: Names
    to labels.
    """
    figure = style.new_figure(12, 6)
    figure.set_layout_engine("constrained")
    axes = figure.subplots()
    colours = [style.OKABE_ITO[name] for name in ("blue", "bluish green", "vermillion")]
    for (run, label), colour in zip(runs.items(), colours, strict=True):
        samples_of_run = samples[(samples["run_id"] == run) & (samples["path_cm"] > 0)]
        alpha = float(fits.set_index("run_id").loc[run, "alpha_z_N_per_cm3"])
        axes.plot(
            samples_of_run["depth_cm"],
            samples_of_run["stress_z_N_per_cm2"],
            color=colour,
            linewidth=0.8,
            label=label,
        )
        used = samples_of_run.loc[samples_of_run["in_window"], "depth_cm"]
        depth = np.array([used.min(), used.max()])
        axes.plot(depth, alpha * depth, color=DARK, linewidth=1.6, linestyle="--")
    _label(
        axes, "depth $|z|$ (cm)", rf"lift on the plate / area ({style.PER_CM2})", loc="upper left"
    )
    return figure


DRAWINGS: dict[str, Callable[[], Figure]] = {
    "angles": angles,
    "directions": directions,
    "frames": frames,
    "legs": legs,
    "mirrored": mirrored,
    "nine_terms": nine_terms,
    "superposition": superposition,
    "where_it_fails": where_it_fails,
}


def svg(figure: Figure) -> bytes:
    """Return the file of a drawing; the same drawing gives the same bytes."""
    return style.content(figure, "svg")


def write(folder: Path) -> None:
    """Write all drawings."""
    for name, draw in DRAWINGS.items():
        (folder / f"{name}.svg").write_bytes(svg(draw()))
