"""The granular force in re-enacted logs: laws of plates, sands, legs and rods, from published measurements alone.

A `Law` gives the force of the medium at a pose of the intruder while it moves: `plate_law` (Table S5), `sand_law` (Fig.
S11), `leg_law` (Figs. S5 and S12), `rod_law` (rod and mount, made up). `force_over_run` applies it to the rests and
moves of a run. Forces are (z, x), N, on the intruder, z upward and x forward; alpha is stress per depth (z, x), N/cm^3.
`depth_cm` is positive, `z_cm` upward from the surface; beta, gamma and theta are in degrees where the name ends in
``_deg``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from rftfit import reference
from rftfit.campaign.config import Config, Plate
from rftfit.lab.plan import (
    CLEARANCE_CM,
    ArmMotion,
    FloatArray,
    PlannedRun,
    Segment,
    half_extents,
    plate_of,
)
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `lab/chosen.toml`, table `truth`, says what each decides
_CHOSEN = chosen("lab", "truth")

Forces = tuple[FloatArray, FloatArray]
"""Force on the intruder, N: z (upward) and x (toward +x)."""

Law = Callable[[Segment, FloatArray, FloatArray, FloatArray], Forces]
"""Function of a segment and of n poses in it (x cm, z cm, angle deg; shape (n,)) that returns the force of the medium.

A segment is a rest or a move of the arm. The force is that once it is fully developed: over the first travel of a move
it builds up.
"""

Alpha = Callable[[PlannedRun, str], tuple[float, float]]
"""Function of a plate run and its phase (approach, stroke or lift) that returns stress per depth (z, x), N/cm^3."""

BUILD_UP: float = _CHOSEN.build_up
"""Travel (cm; rad for a leg) after which a force is fully developed; it ends within the speed ramp."""


def force_over_run(law: Law, parts: tuple[Segment, ...], motion: ArmMotion, level: bool) -> Forces:
    """Calculate the force over a whole run: by the law while moving; at rest the last force, which relaxes a little.

    A medium that was prepared around a resting intruder exerts no force before the first move. The force of a
    horizontal stroke (`level`) builds up over `start_up_cm`. `parts`: Rests and moves of the run. `motion`: Poses at
    the times that are wanted, shape (n,) each.
    """
    force = np.zeros((2, motion.elapsed_s.size))
    # force at the end of the segment before
    last = np.zeros(2)
    segment_start_s = 0.0
    for number, segment in enumerate(parts):
        in_segment = motion.segment == number
        if segment.moving:
            travel = motion.travel[in_segment]
            # share of the force of this move, and share of the last force that is released
            grown = released = _grow_to_one(travel, BUILD_UP)
            if level and segment.phase == "stroke":
                grown = 1 - np.exp(-travel / _CHOSEN.start_up_cm)
                released = _grow_to_one(travel, _CHOSEN.release_cm)
            poses = np.stack([motion.x_cm, motion.z_cm, motion.angle_deg])[:, in_segment]
            developed = np.array(law(segment, *poses))
            force[:, in_segment] = grown * developed + (1 - released) * last[:, None]
            last = np.array(law(segment, *np.array(segment.end)[:, None]))[:, 0]
        else:
            rest_s = motion.elapsed_s[in_segment] - segment_start_s
            force[:, in_segment] = last[:, None] * (
                _CHOSEN.kept + (1 - _CHOSEN.kept) * np.exp(-rest_s / _CHOSEN.relax_s)
            )
            last = _CHOSEN.kept * last
        segment_start_s += segment.duration_s
    return force[0], force[1]


def _grow_to_one(travel: FloatArray, length: float) -> FloatArray:
    """Return a factor that grows smoothly from 0 to exactly 1 over `length`; `travel`: in the same unit, shape (n,)."""
    return 1 - np.clip(1 - travel / length, 0.0, 1.0) ** 2


def table_s5(medium: str, beta_deg: float, gamma_deg: float) -> tuple[float, float]:
    """Interpolate alpha_z and alpha_x, N/cm^3, in Table S5, linearly in both angles; each angle from -90 to 90."""
    (row, u), (column, v) = (
        _find_interval(reference.BETA_DEG, beta_deg),
        _find_interval(reference.GAMMA_DEG, gamma_deg),
    )
    # the four cells around the direction, of alpha_z and of alpha_x, weighted by how near they are
    cells = (grid[row : row + 2, column : column + 2] for grid in reference.alpha_grid(medium))
    z, x = (float(np.array([1 - u, u]) @ corners @ [1 - v, v]) for corners in cells)
    return z, x


def _find_interval(lines: FloatArray, angle: float) -> tuple[int, float]:
    """Return the index of the table's line below an angle, and the angle's fraction of the interval to the next line.

    An angle that differs from a line only by rounding counts as this line. `lines`: Angles of the table, increasing.
    """
    nearest = int(np.abs(lines - angle).argmin())
    snapped_angle = lines[nearest] if abs(lines[nearest] - angle) < _CHOSEN.rounding_deg else angle
    # at the last line the interval before it, so that there is a next line
    line = int(np.clip(np.searchsorted(lines, snapped_angle, side="right") - 1, 0, lines.size - 2))
    return line, float((snapped_angle - lines[line]) / (lines[line + 1] - lines[line]))


def pull_alpha(medium: str, beta_deg: float, path_gamma_deg: float) -> tuple[float, float]:
    """Return the stress per depth (z, x), N/cm^3, on a plate that is pulled back along a path.

    The plate keeps its tangent (cos beta, -sin beta) and moves along (cos gamma, sin gamma), gamma
    being the path's angle on the way down. Seen in a mirror (x into -x) the tangent is that of
    -beta and the velocity (-cos gamma, sin gamma) that of -gamma, a cell of the table; the mirror
    keeps the vertical force and turns the horizontal one.
    """
    alpha_z, alpha_x = table_s5(medium, -beta_deg, -path_gamma_deg)
    return alpha_z, -alpha_x


def published_alpha(run: PlannedRun, phase: str) -> tuple[float, float]:
    """Return the published stress per depth (z, x) of a plate run in a phase, N/cm^3; this is an `Alpha`.

    The approach goes straight down and the lift straight up, whatever the path of the stroke.
    """
    beta, gamma = run.beta_deg or 0.0, run.gamma_deg or 0.0
    if phase == "approach":
        return table_s5(run.published, beta, 90.0)
    if phase == "lift":
        return pull_alpha(run.published, beta, 90.0)
    if run.direction == "extraction":
        return pull_alpha(run.published, beta, gamma)
    return table_s5(run.published, beta, gamma)


def submerged_depth(depth_cm: FloatArray, half_z_cm: float) -> FloatArray:
    """Return the mean depth of the submerged part of a plate, times the submerged share, cm.

    This is the depth of its centre if the plate is wholly submerged, and 0 if it is wholly in air. Near the surface the
    bed can heave, so a partly submerged plate has a somewhat smaller value still.
    """
    share = np.clip((depth_cm + half_z_cm) / (2 * half_z_cm), 0.0, 1.0)
    partly = half_z_cm * share**2 * (1 - 0.25 * (1 - share) ** 2)
    return np.where(depth_cm >= half_z_cm, depth_cm, partly)


def wall_factor(
    config: Config, x_cm: FloatArray, depth_cm: FloatArray, beta_deg: float
) -> FloatArray:
    """Return the factor by which walls and bottom raise the force on a plate; 1 where all are `CLEARANCE_CM` away.

    `x_cm`, `depth_cm`: of the centre of the plate.
    """
    _, plate = plate_of(config.intruders)
    half_x, half_z = half_extents(plate, beta_deg)
    box, factor = config.container, np.ones_like(depth_cm)
    for clearance in (box.depth_cm - depth_cm - half_z, box.length_cm / 2 - np.abs(x_cm) - half_x):
        factor *= 1 + 0.3 * np.clip(1 - clearance / CLEARANCE_CM, 0.0, 1.0) ** 2
    return factor


def plate_law(run: PlannedRun, config: Config, alpha: Alpha) -> Law:
    """Return the law of a plate in a laboratory medium: alpha times depth times area, larger near walls and bottom.

    A level stroke slips and sticks a little instead. `alpha`: Stress per depth by run and phase.
    """
    plate: Plate = plate_of(config.intruders)[1]
    beta = run.beta_deg or 0.0
    _, half_z = half_extents(plate, beta)

    def law(segment: Segment, x_cm: FloatArray, z_cm: FloatArray, _: FloatArray) -> Forces:
        alpha_z, alpha_x = alpha(run, segment.phase)
        load = plate.area_cm2 * submerged_depth(-z_cm, half_z)
        if run.direction == "horizontal" and segment.phase == "stroke":
            # the published alpha is already the mean over the steady part, so walls are not added
            load = load * (
                1 + _CHOSEN.stick_slip * np.sin(2 * np.pi * x_cm / _CHOSEN.stick_slip_cm)
            )
        else:
            load = load * wall_factor(config, x_cm, -z_cm, beta)
        return alpha_z * load, alpha_x * load

    return law


def granular_law(run: PlannedRun, config: Config, alpha: Alpha) -> Law | None:
    """Return the law of the force of the medium on the intruder; None if no intruder is in a medium.

    `alpha`: Stress per depth of plates in a laboratory medium; forces on legs and in natural sands are published
    curves.
    """
    if run.kind == "leg":
        return leg_law(run)
    if run.kind != "plate":
        return None
    return sand_law(run, config) if run.natural else plate_law(run, config, alpha)


@cache
def _load_penetration(sand: str) -> tuple[FloatArray, FloatArray]:
    """Load depth (cm) and stress (N/cm^2) of the published push into a natural sand."""
    table = reference.load("fig_s11")
    rows = table[table["medium"] == sand].sort_values("depth_cm")
    return rows["depth_cm"].to_numpy(float), rows["stress_z_N_per_cm2"].to_numpy(float)


def sand_stress(sand: str, depth_cm: FloatArray) -> FloatArray:
    """Return the vertical stress on a level plate pushed into a natural sand (Fig. S11, 0 to 6 cm), N/cm^2."""
    return np.interp(depth_cm, *_load_penetration(sand))


def sand_law(run: PlannedRun, config: Config) -> Law:
    """Return the law of the level plate of a penetration test: stress of Fig. S11 times the area that touches."""
    plate = plate_of(config.intruders)[1]
    _, half_z = half_extents(plate, run.beta_deg or 0.0)

    def law(_segment: Segment, _x: FloatArray, z_cm: FloatArray, _angle: FloatArray) -> Forces:
        touching = np.clip(1 - z_cm / half_z, 0.0, 1.0)
        force_z = plate.area_cm2 * touching * sand_stress(run.published, -z_cm)
        return force_z, np.zeros_like(force_z)

    return law


@cache
def _load_rotation(name: str, medium: str, leg: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Load theta (deg) and force z, x (N) of a leg from the published figure `name`."""
    table = reference.load(name)
    rows = table[(table["medium"] == medium) & (table["leg"] == leg)].sort_values("theta_deg")
    theta, force_z, force_x = rows[["theta_deg", "force_z_N", "force_x_N"]].to_numpy(float).T
    return theta, force_z, force_x


def leg_law(run: PlannedRun) -> Law:
    """Return the law of a leg that is turned in a medium: force over theta of Fig. S5, in natural sands of Fig. S12.

    Outside the published range the last value decreases to 0 within 3 degrees.
    """
    figure = "fig_s12" if run.natural else "fig_s5"
    theta, *published = _load_rotation(figure, run.published, run.leg)

    def law(_segment: Segment, _x: FloatArray, _z: FloatArray, angle_deg: FloatArray) -> Forces:
        outside = np.maximum(theta[0] - angle_deg, angle_deg - theta[-1])
        fade = np.clip(1 - outside / _CHOSEN.taper_deg, 0.0, 1.0)
        force_z, force_x = (fade * np.interp(angle_deg, theta, curve) for curve in published)
        return force_z, force_x

    return law


def strength(run: PlannedRun) -> float:
    """Return the strength of a medium relative to loose poppy seeds: alpha_z of a level plate pushed straight down.

    The force on rod and mount, which nobody published, is taken in proportion to it.
    """
    if run.natural:
        alpha = float(sand_stress(run.published, np.array([2.0]))[0]) / 2.0
    else:
        alpha, _ = table_s5(run.published, 0.0, 90.0)
    return alpha / float(_CHOSEN.alpha_of_strength_one)


def rod_law(run: PlannedRun) -> Law:
    """Return the law of the force on rod and mount, which is the same in a plate run and in its tare run.

    The force on a thin rod grows with the square of the depth; deeper than 3 cm the mount is in the medium too. The
    force opposes the motion. It is larger in a level move than in a steep one, and smaller in a pull than in a push; a
    tilted mount is pushed a little sideways.
    """
    size = strength(run)
    beta = math.radians(run.beta_deg or 0.0)

    def law(segment: Segment, _x: FloatArray, z_cm: FloatArray, _angle: FloatArray) -> Forces:
        vx, vz = np.subtract(segment.end[:2], segment.start[:2]) / segment.distance
        depth = np.maximum(-z_cm, 0.0)
        mount_depth = np.maximum(depth - _CHOSEN.mount_from_cm, 0.0)
        load = size * (0.007 * depth**2 + 0.009 * mount_depth**2)
        load = load * (1 + 0.06 * math.sin(beta) ** 2)
        if vz > 0:
            load = 0.55 * load
        force_z = -vz * load + 0.04 * math.cos(beta) * load
        force_x = -1.2 * vx * load + 0.06 * math.sin(beta) * load
        return force_z, force_x

    return law
