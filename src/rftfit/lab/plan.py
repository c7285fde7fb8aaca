"""Plan the runs of the re-enacted lab and the motion of its arm: directions, names, depths, rests, ramps.

Which runs does the campaign have (`plan_runs`)? Along which path does each go (`_path_ends`)? Where is the intruder at
each time (`segments`, `motion_at`)?

Lab frame: x forward, 0 in the middle of the box; z upward, 0 at the surface; cm. A *direction* or *cell* is (beta,
gamma), degrees: beta of the plate from +x downward, gamma of its motion from -x downward, so that 90 is straight down
and a pull has gamma < 0. The *reference point* is the centre of a plate or the axle of a leg, whose angle is theta.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rftfit import reference
from rftfit.campaign.config import AnyPlate, Config, Direction, Intruder, Leg, MediumSettings, Plate
from rftfit.campaign.problems import choose
from rftfit.errors import InputError
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `lab/chosen.toml`, table `plan`, says what each decides
_CHOSEN = chosen("lab", "plan")

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

AIR = "air"
"""Folder of the logs of legs turned in air, which are the tares of every medium."""


@dataclass(frozen=True)
class PlannedRun:
    """One run of the campaign; fields with the name of a column of the run sheet hold its cell, None if blank.

    `kind`: ``plate``, ``leg``, or the tare of one of them: ``rod``, ``leg_air``. `intruder`: Name of its plate or leg.
    `direction`: ``intrusion``, ``extraction``, ``horizontal``, or ``rotation`` of a leg.
    `beta_deg`, `gamma_deg`: Angle of the plate, and of the path on the way down, also of a pull.
    `depth_cm`: Of a horizontal run. `tare_run`: run_id of its tare; `tare_shared`: True if other runs have the same.

    `published`: Name of its medium in the published tables; empty in air.
    `leg`: Name in `reference.LEGS`; empty for plate and rod.
    `natural`: True if the medium is a natural sand.
    `clock_s`: Earliest start on the force log's clock, s since midnight.
    `one_file`: True if force and motion are in one file.
    `own_zero`: True if a log without load is recorded before the run.
    `cycles`: Number of strokes in its log, each with a row of the run sheet.
    `suffix`: Ending of the names of its files.
    """

    run_id: str
    kind: str
    medium: str
    published: str
    intruder: str
    direction: str
    beta_deg: float | None = None
    gamma_deg: float | None = None
    depth_cm: float | None = None
    tare_run: str = ""
    tare_shared: bool = False
    leg: str = ""
    natural: bool = False
    note: str = ""
    clock_s: float = 0.0
    one_file: bool = False
    own_zero: bool = False
    cycles: int = 1
    suffix: str = ".csv"

    @property
    def folder(self) -> str:
        """Folder of the run's logs inside raw."""
        return self.medium or AIR

    @property
    def force_log(self) -> str:
        """Path of the force log relative to raw."""
        return f"{self.folder}/{self.run_id}{'' if self.one_file else '_force'}{self.suffix}"

    @property
    def motion_log(self) -> str:
        """Path of the motion log relative to raw."""
        separate_path = f"{self.folder}/{self.run_id}_motion{self.suffix}"
        return self.force_log if self.one_file else separate_path

    @property
    def zero_log(self) -> str:
        """Path of the log without load relative to raw; empty where there is none."""
        return f"{self.folder}/{self.run_id}_zero{self.suffix}" if self.own_zero else ""

    @property
    def logs(self) -> set[str]:
        """Paths of its logs relative to raw."""
        return {self.force_log, self.motion_log, self.zero_log} - {""}


def plate_of(intruders: Mapping[str, Intruder]) -> tuple[str, Plate]:
    """Return the name and the size of the campaign's plate (the first of the config)."""
    for name, intruder in intruders.items():
        if isinstance(intruder, Plate):
            return name, intruder
    raise InputError("config: intruders has no entry of shape plate, so there is nothing to push")


LEG_OF_CURVATURE = {1.0: "c_leg", 0.0: "flat_leg", -1.0: "reversed_c_leg"}
"""Published name of a leg by its curvature R/r."""


def legs_of(legs: Mapping[str, Leg]) -> dict[str, str]:
    """Return the names of the config's legs whose forces are published (R/r = 1, 0, -1), to their published names."""
    return {
        name: LEG_OF_CURVATURE[leg.curvature_times_R]
        for name, leg in legs.items()
        if leg.curvature_times_R in LEG_OF_CURVATURE
    }


def media_of(media: Mapping[str, MediumSettings], asked: Sequence[str] | None) -> list[str]:
    """Return the media to re-enact, in the order of the config; by default all that are published.

    `media`: Media of the config by name. `asked`: Names that the user asks for; others than published ones are refused.
    """
    published_media = [
        name
        for name, medium in media.items()
        if medium.published_as
        in (reference.MEDIA if medium.role == "laboratory" else reference.SANDS)
    ]
    for name in asked or ():
        choose("medium with published measurements", name, published_media)
    return [name for name in published_media if asked is None or name in asked]


def _format_angle(angle: float) -> str:
    """Format an angle for the name of a run: whole degrees if it is whole or one of the paper, else tenths."""
    is_papers = bool((np.abs(reference.GAMMA_DEG - angle) < 0.01).any())
    return f"{angle:02.0f}" if is_papers or abs(angle - round(angle)) < 0.05 else f"{angle:04.1f}"


def _name_with_rod(run: PlannedRun) -> Iterator[PlannedRun]:
    """Name a plate run by its medium and motion; yield it, and its tare: rod and mount alone on the same path."""
    ending = "in" if run.direction == "intrusion" else "ex"
    if run.depth_cm is not None:
        ending = f"h{100 * run.depth_cm:03.0f}"
    beta, gamma = run.beta_deg or 0.0, run.gamma_deg or 0.0
    sign = "m" if beta < 0 else "p"
    run_id = f"{run.medium}_b{sign}{_format_angle(abs(beta))}_g{_format_angle(gamma)}_{ending}"
    yield replace(run, run_id=run_id, tare_run=f"{run_id}_rod")
    note = "re-enacted: rod and mount alone"
    yield replace(run, run_id=f"{run_id}_rod", kind="rod", note=note)


def paper_directions() -> list[tuple[float, float]]:
    """List the cells (beta, gamma) of the paper, deg, for each beta: push and pull along each path, then level.

    A pull of the same plate is the mirror image of the cell -beta, -gamma.
    """
    gammas = reference.GAMMA_DEG[reference.GAMMA_DEG > 0].tolist()
    cells = []
    # a plate at -90 degrees is the same as one at 90
    for beta in reference.BETA_DEG[1:].tolist():
        for gamma in gammas:
            cells += [(beta, gamma), (_mirrored(beta), -gamma)]
        cells.append((beta, 0.0))
    return cells


def _mirrored(beta: float) -> float:
    """Angle beta of the mirror image of a plate, deg; 90 stays 90, as -90 and 90 degrees are the same plate."""
    return beta if beta == 90 else -beta + 0.0


def parse_directions(text: str, seed: int) -> list[tuple[float, float]]:
    """Read directions (beta, gamma), deg, as the command line writes them.

    ``-30,0,30 x -45,0,45,90``: every beta with every gamma. ``0:90,30:45``: pairs. ``scattered:40``: 40 random
    directions in whole degrees, the first of them straight down with a level plate; no two are nearer than 6 degrees,
    or than a smaller distance if there are more than 250.
    """
    if (
        text.startswith("scattered:")
        and text[10:].isdecimal()
        and 1 <= int(text[10:]) <= _CHOSEN.most_scattered
    ):
        return _scatter_directions(int(text[10:]), seed)
    try:
        if "x" in text:
            beta, gamma = (
                [float(angle) for angle in angle_list.split(",")] for angle_list in text.split("x")
            )
            directions = [(b, g) for b in beta for g in gamma]
        else:
            directions = [
                (float(b), float(g)) for b, g in (pair.split(":") for pair in text.split(","))
            ]
    except ValueError:
        directions = []
    if not directions or not all(abs(angle) <= 90 for pair in directions for angle in pair):
        raise InputError(
            f"--grid: found {text!r}; allowed: angles from -90 to 90 degrees as lists "
            "'-30,0,30 x -45,0,45,90', as pairs '0:90,30:45', or 'scattered:40' "
            f"(1 to {_CHOSEN.most_scattered})"
        )
    return list(dict.fromkeys((90.0 if b == -90 else b + 0.0, g + 0.0) for b, g in directions))


def _scatter_directions(count: int, seed: int) -> list[tuple[float, float]]:
    """Draw random directions (beta, gamma), deg, one after the other; draws too near to earlier ones are rejected.

    The first is a level plate straight down, which the scaling of a medium needs.
    """
    random = np.random.default_rng(seed)
    directions = np.zeros((count, 2))
    directions[0] = 0.0, 90.0
    apart_deg = _CHOSEN.apart_deg * min(1.0, math.sqrt(_CHOSEN.room_for / count))
    drawn = 1
    while drawn < count:
        # shallower paths leave no window between surface, walls and bottom
        beta, gamma = random.integers(-89, 91), random.integers(20, 91) * random.choice([-1, 1])
        beta_apart = np.abs((beta - directions[:drawn, 0] + 90) % 180 - 90)
        gamma_apart = np.abs(gamma - directions[:drawn, 1])
        if np.maximum(beta_apart, gamma_apart).min() >= apart_deg:
            directions[drawn] = beta, gamma
            drawn += 1
    return [(float(beta), float(gamma)) for beta, gamma in directions]


def _plan_laboratory_runs(
    config: Config, first: PlannedRun, directions: Sequence[Direction]
) -> Iterator[PlannedRun]:
    """Plan the plate runs in a laboratory medium, with their tares, for the cells `directions`.

    `first`: A run with the facts that all share. A level direction has a run at each depth of
    ``fit.horizontal_depths_cm``.
    """
    for beta, gamma in directions:
        # the cell of a pull is the mirror image of the plate that is pulled back along the path
        beta_of_plate = beta if gamma >= 0 else _mirrored(beta)
        run = replace(first, beta_deg=beta_of_plate, gamma_deg=abs(gamma))
        if gamma == 0:
            for depth in config.fit.horizontal_depths_cm:
                level = replace(run, direction="horizontal", depth_cm=float(depth))
                yield from _name_with_rod(level)
        else:
            direction = "intrusion" if gamma > 0 else "extraction"
            yield from _name_with_rod(replace(run, direction=direction))


def _plan_medium(
    config: Config, medium: str, directions: Sequence[Direction]
) -> Iterator[PlannedRun]:
    """Plan the plate and leg runs of a medium, with their tares, for the cells `directions`.

    A natural sand has one push straight down and the legs, as the paper published no more of it.
    """
    published = config.media[medium].published_as or ""
    natural = config.media[medium].role == "natural_sand"
    plate, _ = plate_of(config.intruders)
    first = PlannedRun("", "plate", medium, published, plate, "", note="re-enacted from Table S5")
    if natural:
        push = replace(first, direction="intrusion", beta_deg=0.0, gamma_deg=90.0, natural=True)
        yield from _name_with_rod(replace(push, note="re-enacted from Fig. S11"))
    else:
        yield from _plan_laboratory_runs(config, first, directions)
    for name, leg in legs_of(config.legs).items():
        yield PlannedRun(
            f"{medium}_{name}",
            "leg",
            medium,
            published,
            name,
            "rotation",
            leg=leg,
            tare_run=f"{AIR}_{name}",
            tare_shared=True,
            natural=natural,
            note=f"re-enacted from Fig. {'S12' if natural else 'S5'}",
        )


def plan_runs(
    config: Config,
    media: Sequence[str] | None = None,
    directions: Sequence[Direction] | None = None,
) -> list[PlannedRun]:
    """List the runs of the campaign, sorted by run_id, with the legs in air.

    A run does not depend on which other media are planned.

    `media`: Media to plan; default: all published ones.
    `directions`: Cells (beta, gamma) of the plates in a laboratory medium, deg; default: those of the config's grid, or
    else of the paper.
    """
    chosen = media_of(config.media, media)
    if directions is None:
        # -90 and 90 degrees are one plate
        planned = [(90.0 if beta == -90 else beta, gamma) for beta, gamma in config.grid.planned]
        directions = list(dict.fromkeys(planned)) or paper_directions()
    groups = [list(_plan_medium(config, name, directions)) for name in chosen]
    in_air = PlannedRun("", "leg_air", "", "", "", "rotation", note="re-enacted: turned in air")
    legs = legs_of(config.legs).items() if chosen else ()
    air = [replace(in_air, run_id=f"{AIR}_{name}", intruder=name, leg=leg) for name, leg in legs]
    # each medium takes a day of its own, so that the clock of a run does not depend on the other media
    runs = [
        replace(run, clock_s=_CHOSEN.day_starts_s + _CHOSEN.run_every_s * number)
        for runs_of_day in (*groups, air)
        for number, run in enumerate(runs_of_day)
    ]
    runs.sort(key=lambda run: run.run_id)
    for run in runs:
        if run.kind in ("plate", "rod"):
            _check_room(run, config)
    return runs


Pose = tuple[float, float, float]
"""x and z of the intruder's reference point (cm), and its angle (deg): beta of a plate, theta of a leg."""


@dataclass(frozen=True)
class Segment:
    """One rest, one straight move, or one turn of a leg, with ramps of `ramp_s`.

    `phase`: ``rest``, ``approach``, ``pause``, ``stroke`` or ``lift``.
    `start`, `end`: Poses; equal at rest. `duration_s`: With its ramps.
    `distance`, `speed`: cm and cm/s, for a leg rad and rad/s; 0 at rest.
    """

    phase: str
    start: Pose
    end: Pose
    duration_s: float
    distance: float = 0.0
    speed: float = 0.0

    @property
    def moving(self) -> bool:
        """True if the arm moves."""
        return self.distance > 0


@dataclass(frozen=True)
class ArmMotion:
    """Path of the intruder's reference point in the lab frame at n times; every array has shape (n,).

    `angle_deg`: Beta of a plate, theta of a leg.
    `travel`: Distance since the start of the segment in which the sample lies, cm, for a leg rad.
    `segment`: Number of that segment in the run, from 0.
    """

    elapsed_s: FloatArray
    x_cm: FloatArray
    z_cm: FloatArray
    angle_deg: FloatArray
    travel: FloatArray
    segment: npt.NDArray[np.intp]
    moving: BoolArray


def half_extents(plate: AnyPlate, beta_deg: float) -> tuple[float, float]:
    """Return half the size of a tilted plate along x and along z, cm, thickness included."""
    c, s = abs(math.cos(math.radians(beta_deg))), abs(math.sin(math.radians(beta_deg)))
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    return length * c + thickness * s, length * s + thickness * c


CLEARANCE_CM: float = _CHOSEN.clearance_cm
"""Distance from walls and bottom below which the force is no longer in proportion to depth times area (paper)."""


def submerged_depths(run: PlannedRun, config: Config) -> tuple[float, float]:
    """Return the depths of its centre, cm, between which a plate is wholly submerged and clear of the bottom.

    `run`: A push or a pull. The upper depth comes first.
    """
    _, half_z = half_extents(plate_of(config.intruders)[1], run.beta_deg or 0.0)
    _, (_, z_end) = _path_ends(run, config)
    return half_z, min(-z_end, config.container.depth_cm - CLEARANCE_CM - half_z)


def _path_ends(run: PlannedRun, config: Config) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the upper and lower end (x, z) of the path of a plate run, cm; of a horizontal run its right and left end.

    The path lies in the middle of the box, is as deep as walls and bottom allow, and is the same for every beta.
    """
    box, (_, plate) = config.container, plate_of(config.intruders)
    diagonal = math.hypot(plate.length_cm, plate.thickness_cm) / 2
    # in whole millimetres
    half_span = math.floor(10 * (box.length_cm / 2 - CLEARANCE_CM - diagonal)) / 10
    deepest = math.floor(10 * (box.depth_cm - CLEARANCE_CM - plate.thickness_cm / 2)) / 10
    _, half_z = half_extents(plate, run.beta_deg or 0.0)
    deepest = min(deepest, box.depth_cm - _CHOSEN.least_to_bottom_cm - half_z)
    if run.natural:
        deepest = _CHOSEN.sand_depth_cm
    if run.direction == "horizontal":
        reach, depth = 0.8 * half_span, run.depth_cm or 0.0
        return (reach, -depth), (-reach, -depth)
    gamma = math.radians(run.gamma_deg or 0.0)
    if math.isclose(gamma, math.pi / 2):
        return (0.0, 0.0), (0.0, -deepest)
    depth = min(deepest, 2 * half_span * math.tan(gamma))
    reach = depth / math.tan(gamma) / 2
    return (reach, 0.0), (-reach, -depth)


def _check_room(run: PlannedRun, config: Config) -> None:
    """Refuse a plate or rod run whose path has no fit window that keeps away from walls and bottom."""
    if run.direction == "horizontal":
        right, left = _path_ends(run, config)
        enough = right[0] - left[0] > config.fit.horizontal_skip_cm + _CHOSEN.least_window_cm
    else:
        shallow, deep = submerged_depths(run, config)
        enough = deep - shallow >= _CHOSEN.least_window_cm
    if not enough:
        raise InputError(
            f"{run.run_id}: container and plate of the config leave no fit window of "
            f"{_CHOSEN.least_window_cm} cm that keeps {CLEARANCE_CM:g} cm from walls and bottom"
        )


def _make_move(phase: str, start: Pose, end: Pose, speed: float) -> Segment:
    """Make a straight move, or a turn if x and z do not change; `speed`: cm/s, or rad/s for a turn."""
    distance = math.hypot(end[0] - start[0], end[1] - start[1])
    distance = distance or math.radians(abs(end[2] - start[2]))
    return Segment(phase, start, end, distance / speed + _CHOSEN.ramp_s, distance, speed)


def segments(
    run: PlannedRun, config: Config, raised: bool = False, pause: bool = True
) -> tuple[Segment, ...]:
    """Make the rests and moves of a run, in their order.

    `raised`: Lift the whole path into the air, as a fault. `pause`: Pause at the surface, as in the paper; without one
    a vertical path is a single move through the surface.
    """
    parts = _segments_with_pause(run, config, raised)
    if pause or not any(segment.phase == "pause" for segment in parts):
        return parts
    without_pause = [segment for segment in parts if segment.phase != "pause"]
    first = next(i for i, segment in enumerate(without_pause) if segment.moving)
    first_move, second_move = without_pause[first : first + 2]
    # on a vertical path without a pause the arm makes one move through the surface
    if first_move.start[0] == second_move.end[0]:
        speed = max(first_move.speed, second_move.speed)
        without_pause[first : first + 2] = [
            _make_move("stroke", first_move.start, second_move.end, speed)
        ]
    return tuple(without_pause)


def _segments_with_pause(run: PlannedRun, config: Config, raised: bool) -> tuple[Segment, ...]:
    """Make the rests and moves of a run, with the pause at the surface; of a leg one turn between two rests in air."""
    intruder = config.intruders[run.intruder]
    if isinstance(intruder, Leg):
        first, last = ((0.0, intruder.hip_height_cm, s * _CHOSEN.theta_end_deg) for s in (-1, 1))
        turn = _make_move("stroke", first, last, config.arm.leg_speed_rad_per_s)
        rest = Segment("rest", last, last, _CHOSEN.rest_s)
        return Segment("rest", first, first, _CHOSEN.rest_air_s), turn, rest
    beta, speed = run.beta_deg or 0.0, config.arm.speed_cm_per_s
    (x0, z0), (x1, z1) = _path_ends(run, config)
    _, half_z = half_extents(intruder, beta)
    top = half_z + _CHOSEN.air_cm
    lift = top - z1 if raised else 0.0
    air = (x0, top + lift, beta)
    begin, end = (x0, z0 + lift, beta), (x1, z1 + lift, beta)
    in_air, below = (
        Segment("rest", air, air, _CHOSEN.rest_air_s),
        Segment("rest", end, end, _CHOSEN.rest_s),
    )
    pause = Segment("pause", begin, begin, _CHOSEN.pause_s)
    if run.direction == "extraction":
        up, away = _make_move("stroke", end, begin, speed), _make_move("lift", begin, air, speed)
        return below, up, pause, away, in_air
    approach, down = (
        _make_move("approach", air, begin, speed),
        _make_move("stroke", begin, end, speed),
    )
    return in_air, approach, pause, down, below


def duration(parts: tuple[Segment, ...]) -> float:
    """Duration of a run of these segments, s."""
    return sum(segment.duration_s for segment in parts)


def _travelled(segment: Segment, time_s: FloatArray) -> FloatArray:
    """Return the distance since the start of a segment, cm (rad for a leg), at times since its start, s, shape (n,).

    The speed rises and falls linearly, in ramps of ``ramp_s``.
    """
    if not segment.moving:
        return np.zeros_like(time_s)
    ramp_s: float = _CHOSEN.ramp_s
    acceleration = segment.speed / ramp_s
    left = segment.duration_s - time_s
    cruise = segment.speed * (time_s - ramp_s / 2)
    speeding = acceleration * time_s**2 / 2
    braking = segment.distance - acceleration * left**2 / 2
    return np.where(time_s < ramp_s, speeding, np.where(left < ramp_s, braking, cruise))


def motion_at(parts: tuple[Segment, ...], elapsed_s: FloatArray) -> ArmMotion:
    """Position of the intruder's reference point at times since the start of the run, s; at the end it stays.

    `parts`: Rests and moves of the run. `elapsed_s`: shape (n,).
    """
    ends = np.cumsum([segment.duration_s for segment in parts])
    clipped = np.clip(elapsed_s, 0.0, ends[-1])
    index = np.minimum(np.searchsorted(ends, clipped, side="right"), len(parts) - 1)
    pose = np.empty((3, clipped.size))
    travel = np.zeros(clipped.size)
    for number, segment in enumerate(parts):
        in_segment = index == number
        travel[in_segment] = _travelled(
            segment, clipped[in_segment] - (ends[number] - segment.duration_s)
        )
        share = travel[in_segment] / segment.distance if segment.moving else 0.0
        for row, (first, last) in enumerate(zip(segment.start, segment.end, strict=True)):
            pose[row, in_segment] = first + (last - first) * share
    moving = np.array([segment.moving for segment in parts])[index]
    x_cm, z_cm, angle_deg = pose
    return ArmMotion(clipped, x_cm, z_cm, angle_deg, travel, index, moving)
