"""When and where: the clocks of a run, its free surface and its stroke, in the way the config asks for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rftfit.measure.alignment import Alignment, estimate_clocks, new_readings
from rftfit.measure.clock import ClockError, ClockFit, align, moving_spans, whole_spans
from rftfit.measure.motion import Motion, StrokeError, find_stroke
from rftfit.measure.surface import Surface, SurfaceError, find_surface

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.campaign.runs import Run
    from rftfit.conventions import FloatArray
    from rftfit.logs.base import Log

REPEATED = "repeats the reading before (transducer slower than its logger)"
_BOTTOM_CM = 0.02
_NEAR_CM = 0.3
_FLAT_DEG = 3.0


def without_repeats(config: Config, log: Log) -> Log:
    """Leave out the rows in which a slow transducer says the same again, if the config asks for it.

    Parameters
    ----------
    config : Config
    log : Log
        Force log.

    Returns
    -------
    Log
        What was left out is counted.
    """
    if config.transducer.repeats == "keep":
        return log
    channels = np.stack([log.columns[name] for name in ("F1", "F2", "F3")])
    return log.take(new_readings(channels), REPEATED)


def find_clock(
    config: Config,
    run: Run,
    time: FloatArray,
    line: FloatArray | None,
    lift: FloatArray,
    motion: Motion,
    usable: np.ndarray | None = None,
    spans: FloatArray | None = None,
) -> tuple[ClockFit, Alignment | None]:
    """Bring the clocks of force and motion log together.

    Parameters
    ----------
    config : Config
        Its ``clock`` says how.
    run : Run
    time : numpy.ndarray, shape (n,)
        Of the force log, s.
    line : numpy.ndarray, shape (n,), or None
        Its sync line, if it has one.
    lift : numpy.ndarray, shape (n,)
        Vertical force, zero not yet removed, N.
    motion : Motion
    usable : numpy.ndarray of bool, shape (n,), optional
        Which samples may be believed; all if not given.
    spans : numpy.ndarray, shape (k, 2), optional
        From `Motion.spans`, where it was called already.

    Returns
    -------
    clock : ClockFit
    alignment : Alignment or None
        What it was estimated from, where it was.

    Raises
    ------
    ClockError
        If the logs cannot decide, or lack what the method needs.
    """
    method = config.clock.method
    if method == "same_clock":
        return ClockFit(0.0, 0.0, 0.0, 0.0, 0), None
    if method == "estimate":
        if run.direction != "intrusion" or run.gamma_deg != 90:
            raise ClockError(
                f"clock.method estimate: found a run in direction {run.direction} along gamma "
                f"{run.gamma_deg:g} deg; allowed: intrusion straight down, where the force grows with "
                "depth. Others need a sync line or one clock"
            )
        good = slice(None) if usable is None else usable
        alignment = estimate_clocks(
            time[good],
            lift[good],
            motion.time,
            -motion.z,
            config.clock.max_drift,
            config.clock.max_se_s,
        )
        return alignment.clock(), alignment
    if line is None:
        raise ClockError(
            "the force log has no column arm_moving; clock.method sync_line needs it, allowed "
            "without: estimate, same_clock"
        )
    spans = motion.spans(config.arm) if spans is None else spans
    seen = whole_spans(moving_spans(time, line, 0.5), float(time[0]), float(time[-1]))
    # the speed is known from the second sample to the last but one; no spans in fewer than three
    done = whole_spans(spans, *motion.time[[1, -2]]) if len(spans) else spans
    return align(seen, done, config.clock.max_residual_s), None


def place_surface(
    config: Config,
    run: Run,
    motion: Motion,
    on_motion: FloatArray,
    lift: FloatArray,
    clock_se_s: float,
) -> tuple[Motion, Surface | None]:
    """Count z from the free surface that the force shows, where the config asks for that.

    Parameters
    ----------
    config : Config
    run : Run
    motion : Motion
    on_motion : numpy.ndarray, shape (n,)
        Times of the force log's samples on the motion log's clock, s.
    lift : numpy.ndarray, shape (n,)
        Vertical force, zero not yet removed, N.
    clock_se_s : float
        Standard error of the clocks' offset: it moves the surface by as far as the arm went in it.

    Returns
    -------
    motion : Motion
        With z = 0 at the surface.
    surface : Surface or None
        As found; its depth is counted from the zero that `motion` had.

    Raises
    ------
    StrokeError
        If no surface can be told, or not well enough.
    """
    if config.surface.method == "given" or run.surface_z_mm is not None:
        return motion, None
    plate = config.intruders[run.intruder]
    flat = run.kind == "plate" and abs(run.beta_deg) <= _FLAT_DEG
    if run.direction != "intrusion" or plate.shape == "leg" or not flat:
        raise StrokeError(
            "no_surface",
            "surface.method find works for flat plates pushed down, which meet the surface all at "
            f"once (beta within {_FLAT_DEG:g} deg of 0); this run needs surface_z_mm",
        )
    inside = (on_motion >= motion.time[0]) & (on_motion <= motion.time[-1])
    depth = -motion.at(on_motion[inside])[1]
    try:
        window, noise = config.surface.window_cm, config.transducer.precision_N
        toe = plate.thickness_cm / 2
        surface = find_surface(depth, lift[inside], window, noise, 0.0, toe)
        if clock_se_s > 0:
            near = np.abs(depth - surface.depth_cm) < _NEAR_CM
            speed = np.abs(np.gradient(depth, on_motion[inside]))[near].mean()
            surface = find_surface(
                depth, lift[inside], window, noise, float(speed) * clock_se_s, toe
            )
    except SurfaceError as error:
        raise StrokeError("no_surface", str(error)) from error
    if surface.se_cm > config.surface.max_se_cm:
        raise StrokeError(
            "no_surface",
            f"surface not found well enough: its standard error is {surface.se_cm:.2f} cm; allowed: "
            f"{config.surface.max_se_cm:g} cm",
        )
    return replace(motion, z=motion.z + surface.depth_cm), surface


def stroke_of(config: Config, run: Run, motion: Motion, spans: FloatArray) -> tuple[float, float]:
    """Find the stroke of a run.

    Parameters
    ----------
    config : Config
    run : Run
    motion : Motion
        With z = 0 at the surface.
    spans : numpy.ndarray, shape (k, 2)
        Stretches of motion, s.

    Returns
    -------
    start, end : float
        s, on the motion log's clock.

    Raises
    ------
    StrokeError
        If the motion log holds no such stroke.
    """
    straight = run.direction == "intrusion" and run.gamma_deg == 90
    if config.arm.drive == "steady" or not straight:
        return find_stroke(motion, spans, run, config.arm)
    lowest = float(motion.z.min())
    above = np.flatnonzero(motion.z > 0)
    if lowest > -5 * _BOTTOM_CM or not above.size:
        raise StrokeError(
            "surface_not_reached",
            f"the path from {motion.z.max():+.2f} to {lowest:+.2f} cm does not cross the surface",
        )
    end = int(np.argmax(motion.z <= lowest + _BOTTOM_CM))
    before = above[above < end]
    if not before.size:
        raise StrokeError("wrong_path", "the arm log begins below the surface")
    return float(motion.time[before[-1]]), float(motion.time[end])
