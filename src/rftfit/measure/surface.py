"""Find the free surface from force and depth, and the compliance of the machine under load.

The *free surface* is where depth begins; the config states it, or the force of a level plate pushed down shows it
(`find_surface`): the lift is constant in air and grows below the surface. The *compliance* is how far the machine
yields under load, so that the plate is less deep than the motion log says; a push against something rigid shows it.

``depth``: cm, growing downward from any zero, shape (n,), in the order of recording. ``force`` or ``lift``: upward
force, N, plus any constant, shape (n,).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import BoolArray, FloatArray
from rftfit.errors import InputError
from rftfit.logs.base import Log
from rftfit.measure.flags import Refused, format_remarks
from rftfit.measure.lab_frame import logs_in_lab_frame
from rftfit.measure.read import read_logs
from rftfit.measure.session_clocks import find_clock
from rftfit.measure.slopes import student_quantile, weighted_sum_variance
from rftfit.measure.strokes import IntruderPath
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `surface`, says what each decides
_CHOSEN = chosen("measure", "surface")


@dataclass(frozen=True)
class Surface:
    """The free surface as found from the force, what `find_surface` returns.

    `depth_cm`, `se_cm`, `dof`: Depth of the surface on the given axis of depth, from which it must be subtracted; its
    standard error and degrees of freedom.
    `growth_N_per_cm`, `growth_se`: Slope of the force just below the surface, and its standard error.
    `air_N`: Force in air just above the surface.
    `depth` (cm), `force`, `fitted` (N): The n readings of the window, and the force of the model.
    """

    depth_cm: float
    se_cm: float
    dof: float
    growth_N_per_cm: float
    growth_se: float
    air_N: float
    depth: FloatArray
    force: FloatArray
    fitted: FloatArray

    def interval(self) -> tuple[float, float]:
        """Return the ends of the 95 % interval of the surface, cm."""
        half_interval = float(student_quantile(0.95, self.dof)) * self.se_cm
        return self.depth_cm - half_interval, self.depth_cm + half_interval


def place_surface(
    config: Config,
    run: Run,
    path: IntruderPath,
    time: FloatArray,
    lift: FloatArray,
    clock_se_s: float,
) -> tuple[IntruderPath, Surface | None]:
    """Count z from the free surface that the force shows, where the config asks for this.

    Returns the path with the new z, and the surface on the old axis of `path`; the path unchanged and None where the
    surface is given.

    `time`, `lift`: Times (s, on the motion log's clock) and lift (N, zero not yet removed) of the force log.
    `clock_se_s`: Standard error of the clock, s; the error of the surface includes the travel of the arm in this time.
    """
    if config.surface.method == "given" or run.surface_z_mm is not None:
        return path, None
    plate = config.intruders[run.intruder]
    flat = run.kind == "plate" and abs(run.beta_deg) <= _CHOSEN.flat_deg
    if run.direction != "intrusion" or plate.shape == "leg" or not flat:
        raise Refused("surface-not-stated", most=_CHOSEN.flat_deg)
    time, depth, lift = _in_motion_log(path, time, lift)
    window, noise = config.surface.window_cm, config.transducer.precision_N
    toe = plate.thickness_cm / 2
    surface = find_surface(depth, lift, window, noise, 0.0, toe)
    # with the surface known, the speed there turns the error of the clock into one of the depth
    if clock_se_s > 0:
        is_near = np.abs(depth - surface.depth_cm) < _CHOSEN.near_cm
        speeds = np.abs(np.gradient(depth, time))[is_near]
        # a pause at the surface is no slow motion
        speed = float(speeds[speeds >= _CHOSEN.moving * speeds.max(initial=0)].mean())
        surface = find_surface(depth, lift, window, noise, speed * clock_se_s, toe)
    if surface.se_cm > config.surface.max_se_cm:
        raise Refused("surface-uncertain", se=surface.se_cm, most=config.surface.max_se_cm)
    return replace(path, z=path.z + surface.depth_cm), surface


def _in_motion_log(
    path: IntruderPath, time: FloatArray, lift: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, depth and lift of the force readings that were made while the motion was logged: shape (m,) each.

    `time`: Of the n readings, s, on the clock of `path`. `lift`: N. Both have the shape (n,).
    """
    inside = (time >= path.time[0]) & (time <= path.time[-1])
    return time[inside], -path.pose_at(time[inside])[1], lift[inside]


def find_surface(
    depth: FloatArray,
    force: FloatArray,
    window_cm: float,
    noise_N: float,
    depth_sd: float = 0.0,
    toe_cm: float = 0.0,
) -> Surface:
    """Find the free surface on the way down: the depth from which the force grows.

    `window_cm`: Readings so far above and below the surface are used.
    `noise_N`: Noise that is stated for the transducer; the noise in air counts if it is larger.
    `depth_sd`: Standard error of the depth at the surface, from the clocks, cm.
    `toe_cm`: Half the thickness of the plate. Readings within it of the surface are not used: a plate that is partly in
    air does not yet have the force of its depth.
    """
    # only the way down counts, from air to the largest force
    is_deeper = depth >= np.maximum.accumulate(depth) - 0.02
    before_peak = np.arange(depth.size) <= int(np.argmax(force))
    depth, force = depth[is_deeper & before_peak], force[is_deeper & before_peak]
    onset, noise = _find_onset(depth, force, noise_N)
    fits: list[Surface | None] = []
    for share in _CHOSEN.windows:
        window = share * window_cm
        fit = _fit_change_point(depth, force, onset, window)
        # in each pass readings within the toe of the surface found before are left out
        for _ in range(_CHOSEN.passes if toe_cm > 0 else 0):
            if fit is not None:
                fit = _fit_change_point(depth, force, onset, window, fit.depth_cm, toe_cm)
        fits.append(fit)
    # the middle window counts, the others show its bias
    best = fits[1]
    if best is None:
        raise Refused(
            "few-near-surface", below=_CHOSEN.min_below, window=window_cm, above=_CHOSEN.min_air
        )
    _check_growth(best, window_cm, noise)
    depths_cm = [fit.depth_cm for fit in fits if fit is not None]
    spread = float(np.var(depths_cm, ddof=1)) if len(depths_cm) > 1 else 0.0
    return replace(best, se_cm=math.sqrt(best.se_cm**2 + spread + depth_sd**2))


def _find_onset(depth: FloatArray, force: FloatArray, noise_N: float) -> tuple[float, float]:
    """Return the depth below which the force stays above its noise in air, cm, and that noise, N.

    This is a first guess, some way below the surface. `noise_N`: see `find_surface`.
    """
    if depth.size < _CHOSEN.min_air + _CHOSEN.min_below:
        raise Refused("few-on-the-way-down", found=depth.size)
    begin = force[: max(_CHOSEN.min_air, depth.size // 10)]
    air = float(np.median(begin))
    trend = np.polyval(np.polyfit(np.arange(begin.size), begin, 1), np.arange(begin.size))
    # 1.483 times the median deviation is the standard deviation of normal numbers
    noise = max(noise_N, 1.483 * float(np.median(np.abs(begin - trend))))
    if force[-1] - air < _CHOSEN.rise_to_noise * noise:
        raise Refused("no-ground", newtons=force[-1] - air, noise=noise)
    quiet = np.flatnonzero(force < air + 4 * noise)
    if quiet.size < _CHOSEN.min_air:
        raise Refused("not-in-air")
    return float(depth[quiet[-1]]), noise


def _fit_change_point(
    depth: FloatArray,
    force: FloatArray,
    onset: float,
    window: float,
    previous_depth: float = 0.0,
    toe: float = 0.0,
) -> Surface | None:
    """Fit the depth of the surface to the readings within `window` of the `onset`, cm; None where these are too few.

    The force is a constant above the surface and a parabola below. Readings within `toe` of `previous_depth`, the
    surface of the pass before, cm, are not used. The depth of the surface with the smallest misfit is searched among
    trial depths, first over the window, then finely between two of them.
    """
    near_onset = (depth > onset - window) & (depth < onset + window)
    if toe > 0:
        near_onset &= np.abs(depth - previous_depth) > toe
    d, f = depth[near_onset], force[near_onset]
    readings_above, readings_below = np.count_nonzero(d < onset), np.count_nonzero(d > onset)
    if readings_above < _CHOSEN.min_air or readings_below < _CHOSEN.min_below:
        return None
    # the surface lies above the onset, where the force is already above its noise
    trial_depths = np.linspace(onset - 0.6 * window, onset + 0.1 * window + toe, _CHOSEN.trials)
    best = trial_depths[np.argmin(_misfits(d, f, trial_depths))]
    step = float(trial_depths[1] - trial_depths[0])
    fine_depths = np.linspace(best - step, best + step, 41)
    surface_depth = float(fine_depths[np.argmin(_misfits(d, f, fine_depths))])
    design = _design_matrix(d, surface_depth)
    # force in air (N), its growth at the surface (N/cm), and the change of that
    terms = np.linalg.lstsq(design, f, rcond=None)[0]
    fitted = design @ terms
    # derivative of the fitted force by the depth of the surface, the fourth parameter
    gradient = np.where(d > surface_depth, -(terms[1] + 2 * terms[2] * (d - surface_depth)), 0.0)
    # rows: weights of the readings in each parameter
    weights = np.linalg.pinv(np.column_stack([design, gradient]))
    residual = (f - fitted)[None]
    variance, dof = weighted_sum_variance(residual, weights[3])
    variance_of_growth, _ = weighted_sum_variance(residual, weights[1])
    return Surface(
        surface_depth,
        se_cm=math.sqrt(float(variance[0])),
        dof=dof,
        growth_N_per_cm=float(terms[1]),
        growth_se=math.sqrt(float(variance_of_growth[0])),
        air_N=float(terms[0]),
        depth=d,
        force=f,
        fitted=fitted,
    )


def _check_growth(surface: Surface, window_cm: float, noise: float) -> None:
    """Refuse a growth of the force that is small or uncertain, or that already begins in air: there is no surface then.

    `window_cm`: see `find_surface`. `noise`: Of the force in air, N.
    """
    growth, se, depth = surface.growth_N_per_cm, surface.growth_se, surface.depth_cm
    rise = float(surface.fitted.max() - surface.air_N)
    if growth <= 0:
        raise Refused("no-growth", depth=depth)
    if rise < _CHOSEN.rise_to_noise * noise:
        raise Refused(
            "faint-growth",
            depth=depth,
            newtons=rise,
            times=_CHOSEN.rise_to_noise,
            noise=noise,
            window=window_cm,
        )
    if growth < _CHOSEN.sure * se:
        raise Refused("uncertain-growth", depth=depth, growth=growth, se=se, times=_CHOSEN.sure)
    air = surface.depth < depth
    if np.count_nonzero(air) < _CHOSEN.min_air:
        raise Refused("not-in-air")
    centred = surface.depth[air] - surface.depth[air].mean()
    # at a single depth, as at rest, the force shows no growth
    square = float(centred @ centred) if np.ptp(centred) > 0 else math.inf
    in_air = float(centred @ surface.force[air]) / square
    if in_air > _CHOSEN.largest_air * growth:
        raise Refused("grows-in-air", depth=depth, above=in_air, below=growth)


def _design_matrix(depth: FloatArray, surface_depth: float | FloatArray) -> FloatArray:
    """Terms of the force on a new last axis: 1, depth below the surface (0 above it), and the square of that.

    Shape (n, 3); for trial depths of the shape (trials, 1), shape (trials, n, 3).
    """
    depth_below = np.maximum(depth - surface_depth, 0.0)
    return np.stack([np.ones_like(depth_below), depth_below, depth_below**2], axis=-1)


def _misfits(depth: FloatArray, force: FloatArray, trial_depths: FloatArray) -> FloatArray:
    """Sum of squared residuals for each trial depth of the surface, cm; infinite where the force falls below it.

    All trials are fitted at once. A force that falls below the surface is none of a medium. `depth` (cm), `force` (N):
    shape (n,). Returns the shape of `trial_depths`, (trials,).
    """
    design = _design_matrix(depth, trial_depths[:, None])
    transposed = design.transpose(0, 2, 1)
    terms = np.linalg.solve(transposed @ design + 1e-12 * np.eye(3), transposed @ force[:, None])
    residual = force - (design @ terms)[..., 0]
    return np.where(terms[:, 1, 0] > 0, (residual**2).sum(axis=1), math.inf)


@dataclass(frozen=True)
class Compliance:
    """Deflection of the machine under load, as a curve over the lift; known up to the largest measured lift.

    `force`: Lift, increasing from 0, N, shape (k,). `travel`: Deflection, 0 without force and never decreasing, cm,
    shape (k,).
    """

    force: FloatArray
    travel: FloatArray

    def travel_at(self, force: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the travel at some lifts, cm (0 in a pull), and True where it is known: up to the largest lift."""
        return np.interp(force, self.force, self.travel), force <= self.force[-1]


def compliance_of(depth: FloatArray, force: FloatArray, noise_N: float) -> Compliance:
    """Find the compliance of the machine from a push against something rigid, which begins out of contact.

    Whatever the arm travels while in contact, the machine has yielded. `noise_N`: Standard deviation of a single
    reading.
    """
    if force.size < _CHOSEN.min_readings:
        raise Refused("few-rigid", found=force.size, wanted=_CHOSEN.min_readings)
    lift = force - float(np.median(force[: max(8, force.size // 20)]))
    peak = int(np.argmax(lift))
    depth, lift = depth[: peak + 1], lift[: peak + 1]
    if lift[-1] < _CHOSEN.contact_to_noise * noise_N:
        raise Refused("no-contact", newtons=lift[-1], noise=noise_N)
    free = np.flatnonzero(lift < 5 * noise_N)
    touching = slice(int(free[-1]) + 1, None) if free.size else slice(0, None)
    depth, lift = depth[touching], lift[touching]
    if lift.size < _CHOSEN.min_readings:
        raise Refused("few-in-contact", found=lift.size, wanted=_CHOSEN.min_readings)
    # means of lift and depth in even steps of lift
    edges = np.linspace(0, lift[-1], _CHOSEN.levels + 1)
    bins = np.clip(np.digitize(lift, edges) - 1, 0, _CHOSEN.levels - 1)
    filled = np.unique(bins)
    levels, means = (
        np.array([readings[bins == number].mean() for number in filled])
        for readings in (lift, depth)
    )
    # the line through the first two levels gives the depth of contact; the travel never decreases
    slope = (means[1] - means[0]) / (levels[1] - levels[0]) if levels.size > 1 else 0.0
    contact = means[0] - max(slope, 0.0) * levels[0]
    travel = np.maximum.accumulate(np.maximum(means - contact, 0.0))
    lift_left = lift[-1] - levels[-1]
    if lift_left > 0 and levels.size > 1:
        # extend the curve from the mean of the last level to the largest lift, with the last slope
        steep = (travel[-1] - travel[-2]) / (levels[-1] - levels[-2])
        levels = np.append(levels, lift[-1])
        travel = np.append(travel, travel[-1] + lift_left * steep)
    return Compliance(np.append(0.0, levels), np.append(0.0, travel))


def find_compliance(campaign: Campaign, template_run: Run) -> Compliance:
    """Find the compliance of the machine from the push against something rigid that the config names.

    `template_run`: Any run of the campaign; the logs of the rigid push are read as those of this run.
    """
    config = campaign.config
    contact = config.rigid_contact
    assert contact is not None
    run = replace(
        template_run,
        run_id="rigid contact",
        direction="intrusion",
        force_log=contact.force_log,
        motion_log=contact.motion_log,
        surface_z_mm=None,
        gamma_deg=90.0,
    )
    (_, logs), *_ = read_logs(campaign, [run])
    if not isinstance(logs.force, Log) or not isinstance(logs.motion, Log):
        raise InputError(f"rigid_contact: {format_remarks(logs.problems)}")
    try:
        readings, path = logs_in_lab_frame(config, run, logs.force, logs.motion)
        clock = find_clock(config.clock, run, readings, path, path.spans(config.arm), None)
        _, depth, lift = _in_motion_log(path, clock.motion_time(readings.time), readings.force[0])
        return compliance_of(depth, lift, config.transducer.precision_N)
    except ValueError as error:
        raise InputError(f"rigid_contact, {contact.force_log}: {error}") from error
