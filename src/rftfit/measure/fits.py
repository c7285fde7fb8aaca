"""Fit the tared strokes of plates: alpha of a run as the slope of stress over depth; its window, flags and reasons.

Which readings count? What slope have they? When has a run no slope, and which doubts has it? `fit_medium` answers for
all plate runs of a medium, `fit_run` for one: a `Stroke` goes in, a `RunFit` comes out. `judge_run` finds only the
reasons and the doubt that `rftfit check` reports.

- Force is that of the medium on the plate, N, z upward and x forward; stress is force over the area of one face,
  N/cm^2. Arrays with two rows or of shape (2,) hold z, then x. Depth is below the free surface, cm, positive.
- The *cell* of a run is the direction (beta, gamma) of the alpha table to which it belongs: see `filed_under`.
- The *window* of a run is the range of depths whose samples are fitted: see `classify_samples`.
- ``status``, table ``runs/MEDIUM.csv``, a row a run: ``run_id``, its reason if its logs gave no stroke, ``note``, and
  errors that its log shows: ``zero_var_{z,x}_N2``, ``zero_dof``, ``clock_se_s``, ``clock_shared_se_s``,
  ``surface_se_mm``.
- ``tared``, a row a sample of a stroke: ``run_id``, ``depth_cm``, ``x_cm``, ``path_cm`` (length travelled since the
  start), ``force_{z,x}_N`` without the tare, ``tare_{z,x}_N`` (the tare: the force on the rod alone), ``why``
  (`RowStatus`).
- ``tares``, a row a plate run: ``run_id``, and the reason if it has no tare.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.config import AnyPlate, Config, Container, Fit
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import COMPONENTS, BoolArray, FloatArray, direction, file_extraction
from rftfit.measure import slopes
from rftfit.measure.flags import REASON, Remark, reason_columns, reason_of, remark
from rftfit.measure.lab_frame import half_extent, lacks_force_x
from rftfit.measure.laws import (
    PATCHES,
    DepthLaw,
    Laws,
    exponent_lever,
    find_crust,
    ordinary_surface,
    other_laws,
    replace_slope,
    replace_slope_of_few,
)
from rftfit.measure.ledger import DROPPED, USED, Ledger, RowStatus, StatusArray
from rftfit.measure.samples import StrokeColumns, split_runs, stack_components
from rftfit.store.chosen import chosen

# limits and shares that were chosen by hand: `measure/chosen.toml`, table `fits`, says what each decides
_CHOSEN = chosen("measure", "fits")

Row = dict[Any, Any]
"""One row of a table."""


def fit_medium(
    campaign: Campaign,
    medium: str,
    status: pd.DataFrame,
    tared: pd.DataFrame,
    tares: pd.DataFrame,
    linear_to_cm: Mapping[str, float] | None = None,
    only: Collection[str] | None = None,
    *,
    law: DepthLaw | None = None,
) -> tuple[pd.DataFrame, pd.DataFrame, Ledger]:
    """Fit every plate run of a medium, from the tables of the ingest and tare stages.

    `status`, `tared`, `tares`: Tables of the runs, of their samples, and of the tares.
    `linear_to_cm`: End of the linear regime by run_id, cm; a run that it lacks has the one that the config states.
    `only`: run_ids to be fitted; default: all.
    `law`: Law of stress against depth; default: ``fit.law`` of the config.

    Returns a row for each plate run of the sheet with the columns `FIT_COLUMNS`, also of those without alpha; the
    columns ``run_id`` and ``why`` of `tared`, where ``why`` now says also whether the window holds the sample; and the
    ledger with the rows of the strokes and the flags of the runs.
    """
    ledger = Ledger()
    runs = [run for run in campaign.runs_of(medium) if run.kind == "plate"]
    n_plates = len({run.intruder for run in runs})
    if only is not None:
        runs = [run for run in runs if run.run_id in only]
    notes = status.set_index("run_id")["note"]
    fit_rows = []
    why = tared["why"].to_numpy().copy()
    for run, stroke_rows, stroke in find_strokes(runs, status, tared, tares):
        if n_plates > 1:
            ledger.flag(run, remark("several-plates", plate=run.intruder, count=n_plates))
        if isinstance(stroke, Stroke):
            line_end_cm = (linear_to_cm or {}).get(run.run_id)
            fit = fit_run(run, stroke, campaign.config, line_end_cm, law=law)
            clock_cm = stroke.clock_cm
            why[stroke_rows] = fit.why
            _account_for_samples(ledger, run, stroke, fit)
            ledger.flag(run, *fit.flags)
        else:
            fit, clock_cm = RunFit(*filed_under(run)[:2], reason=stroke), 0.0
        fit_rows.append(make_fit_row(run, fit, clock_cm, campaign.config, notes[run.run_id]))
    windows = tared[["run_id"]].assign(why=why)
    return pd.DataFrame(fit_rows, columns=FIT_COLUMNS), windows, ledger


@dataclass(frozen=True)
class Stroke:
    """A tared stroke of a plate, what `fit_run` fits; arrays of shape (n,), in the order of recording.

    `depth`, `x`, `path`: Depth, position (0: middle of the container) and length travelled since the start, cm.
    `force`, `tare`: Force of the medium on the plate alone, and force on the rod that was subtracted, z and x, N, shape
    (2, n); NaN where the tare is not known. `tare` None: none was subtracted.
    `why`: `RowStatus` of each sample by the earlier stages: GOOD, or why it must not be used. `zero_variance` (N^2),
    `zero_dof`: Variance of the zero of the forces and its degrees of freedom; rows: the run, then its tare if it was
    read; columns: z, x.
    `depth_sd`: Standard error that all depths of the run share, from clocks and surface, cm.
    `clock_cm`: The part of it by the clock that all runs of a session share, cm; negative where the plate rises, as
    late readings are then too shallow instead of too deep.
    """

    depth: FloatArray
    x: FloatArray
    path: FloatArray
    force: FloatArray
    why: StatusArray
    zero_variance: FloatArray
    zero_dof: FloatArray
    depth_sd: float = 0.0
    clock_cm: float = 0.0
    tare: FloatArray | None = None


@dataclass(frozen=True)
class RunFit:
    """Result of one plate run, what `fit_run` returns.

    `beta_deg`, `gamma_deg`: Cell of the alpha table that it is for.
    `depth_from_cm`, `depth_to_cm`: Fitted window; NaN if there is no fit, and then `reason` says why.
    `slope`: Slopes of stress over depth by the law of the config, z and x, with their errors; the sign of x is that of
    the cell.
    `laws`: Fits of two other laws, for comparison; None along a level path, of few independent depths, or without a
    fit.
    `line`: Slopes of the line through zero, with which the other laws are compared, N/cm^3, shape (2,); NaN without
    `laws`.
    `rod`: Slopes of the tare that was subtracted, N/cm^3, shape (2,); 0 where none was.
    `why`: `RowStatus` of each sample, shape (n,); GOOD where it was fitted, or would have been but for `reason`.
    `flags`: Doubts that do not make the slope useless.
    """

    beta_deg: float
    gamma_deg: float
    depth_from_cm: float = math.nan
    depth_to_cm: float = math.nan
    slope: slopes.Slope | None = None
    laws: Laws | None = None
    line: FloatArray = field(default_factory=lambda: np.full(2, np.nan))
    rod: FloatArray = field(default_factory=lambda: np.zeros(2))
    why: StatusArray = field(default_factory=lambda: np.empty(0, dtype=np.int8))
    flags: tuple[Remark, ...] = ()
    reason: tuple[Remark, ...] = ()


def fit_run(
    run: Run,
    stroke: Stroke,
    config: Config,
    linear_to_cm: float | None = None,
    *,
    law: DepthLaw | None = None,
) -> RunFit:
    """Fit alpha_z and alpha_x of one plate run in its window, or return the reason why it has no number.

    `linear_to_cm`: End of the linear regime of a natural sand, cm; default: as the config states it.
    `law`: Law of stress against depth; default: ``fit.law`` of the config.
    """
    law = law or DepthLaw(config.fit.law)
    plate = config.intruders[run.intruder]
    assert plate.shape != "leg"
    is_stress_table = config.table is not None
    beta_deg, gamma_deg, sign_x = filed_under(run)
    why, reason = _choose_samples(run, stroke, plate, config, law, linear_to_cm)
    if reason:
        return RunFit(beta_deg, gamma_deg, why=why, reason=reason)
    usable = why == RowStatus.GOOD
    depth = stroke.depth[usable]
    stress_of_all, tare_stress = _stresses(stroke, plate, sign_x)
    stress = stress_of_all[:, usable]
    # rows of a table at few depths, or of a level motion at several depths, are independent: their scatter alone gives
    # the error, while the samples of a log are autocorrelated
    is_few = is_stress_table and (depth.size < slopes.FEWEST or not run.gamma_deg)
    if is_few:
        slope, flags = slopes.fit_few(depth, stress), tuple[Remark, ...]()
    else:
        slope, flags = _fit_line(run, stroke, stress_of_all, tare_stress, usable, plate, config)
    line = slope.alpha
    residual = stress - line[:, None] * depth
    # a level run has one depth: the law is fitted to its cell
    if law.name != "through_zero" and not slopes.level_path(depth):
        law_fits = law.fit(depth, stress)
        slope = (replace_slope_of_few if is_few else replace_slope)(slope, law_fits)
        residual = np.stack([fit_of_law.residual for fit_of_law in law_fits])
        if law.name == "free_intercept":
            # also of two depths, of which `fit_few` gives no intercept
            intercept, free_slope = slopes.free_intercept(depth, stress)
            slope = replace(slope, intercept=intercept, free_slope=free_slope)
    if is_stress_table:
        slope, exact = _mark_exact(slope, depth, residual, stress, run)
        flags += exact
    if not lacks_force_x(config, run):
        flags += _flag_negative_work(slope, gamma_deg)
    ends = float(depth.min()), float(depth.max())
    fit = RunFit(beta_deg, gamma_deg, *ends, slope, why=why, flags=flags)
    if is_few:
        return fit
    rod = fit.rod
    if tare_stress is not None:
        rod = slopes.zero_intercept(depth, tare_stress[:, usable])[0]
    return replace(fit, laws=other_laws(depth, stress, ends[1]), line=line, rod=rod)


def judge_run(run: Run, stroke: Stroke, config: Config) -> RunFit:
    """Find the reason of a run without alpha, or the flag ``gives-back`` of a force that pulls the plate along.

    These are what `rftfit check` reports of a fit. The flag needs a slope that pulls and its error; where the slope
    does not pull, its error need not be known, which takes most of the time of `fit_run`.
    """
    law = DepthLaw(config.fit.law)
    plate = config.intruders[run.intruder]
    assert plate.shape != "leg"
    beta_deg, gamma_deg, sign_x = filed_under(run)
    why, reason = _choose_samples(run, stroke, plate, config, law)
    if not reason and (config.table is not None or law.name != "through_zero"):
        return fit_run(run, stroke, config)
    if not reason:
        usable = why == RowStatus.GOOD
        stress, _ = _stresses(stroke, plate, sign_x)
        alpha, _ = slopes.zero_intercept(stroke.depth[usable], stress[:, usable])
        if _pulls_plate(alpha, gamma_deg):
            return fit_run(run, stroke, config)
    return RunFit(beta_deg, gamma_deg, why=why, reason=reason)


def filed_under(run: Run) -> tuple[float, float, float]:
    """Return the cell (beta, gamma) of a run, degrees, and the factor 1 or -1 by which its force along x is multiplied.

    Only an extraction may be in another cell than its angles in the run sheet: a plate that is pulled back along its
    path moves in a direction outside of the table, so it counts as its mirror image (`file_extraction`), with the other
    x.
    """
    if run.direction == "extraction":
        return file_extraction(run.beta_deg, run.gamma_deg)
    return run.beta_deg, run.gamma_deg, 1.0


# --- Which samples count


def _choose_samples(
    run: Run,
    stroke: Stroke,
    plate: AnyPlate,
    config: Config,
    law: DepthLaw,
    linear_to_cm: float | None = None,
) -> tuple[StatusArray, tuple[Remark, ...]]:
    """Return the `RowStatus` of each sample, GOOD in the window, and the reasons why these give no slope, if any.

    `linear_to_cm`: see `fit_run`.
    """
    line_end_cm = _end_of_linear_regime(run, config, linear_to_cm)
    # depth of the centre at which the upper edge of a tilted plate enters the bed; a level plate counts
    # from its face, as in the paper, and a table from the depths that it states
    edge_cm = 0.0
    if config.table is None:
        edge_cm = plate.length_cm / 2 * abs(math.sin(math.radians(run.beta_deg)))
    window_status = classify_samples(
        run, stroke, plate, config.container, config.fit, line_end_cm, edge_cm
    )
    why = np.where(stroke.why == RowStatus.GOOD, window_status, stroke.why)
    return why, _why_no_slope(run, stroke, window_status, why, plate, config, law)


def classify_samples(
    run: Run,
    stroke: Stroke,
    plate: AnyPlate,
    box: Container,
    fit: Fit,
    linear_to_cm: float | None,
    linear_from_cm: float,
) -> StatusArray:
    """Return the `RowStatus` of each sample: GOOD where the plate is submerged, off walls, and past its start-up.

    Elsewhere alpha would be wrong: a plate partly in air bears too little, one near a wall or the bottom too much, and
    the force of a pull or of a level run needs some travel to build up. This alone decides; what earlier stages found
    wrong with a sample is in ``stroke.why``.

    `box`: The container; x = 0 is its middle.
    `linear_to_cm`: End of the linear regime of a penetration test (a push into a natural sand) or of a table, cm: all
    samples from `linear_from_cm` to it count, and distances from walls are not tested, as these are far away. None: a
    run in a laboratory's container, to which the tests above apply.
    """
    beta, depth = math.radians(run.beta_deg), stroke.depth
    why = np.full(depth.size, RowStatus.GOOD, dtype=np.int8)
    # a later line overwrites an earlier one: of several reasons the last one counts
    if linear_to_cm is not None:
        why[depth > linear_to_cm] = RowStatus.NONLINEAR
        why[depth < linear_from_cm] = RowStatus.ABOVE
    else:
        if run.direction == "extraction":
            why[stroke.path < fit.extraction_skip_cm] = RowStatus.STARTUP
        why[np.abs(stroke.x) > _farthest_x(plate, beta, box, fit)] = RowStatus.WALL
        if run.direction == "horizontal":
            why[stroke.path < fit.horizontal_skip_cm] = RowStatus.STARTUP
            return why
        _, half_z = half_extent(plate, beta)
        if fit.max_depth_cm is None:
            why[depth > box.depth_cm - fit.wall_clearance_cm - half_z] = RowStatus.BOTTOM
        if fit.submergence_cm is None:
            why[depth < half_z] = RowStatus.ABOVE
    if fit.max_depth_cm is not None:
        why[depth > fit.max_depth_cm] = RowStatus.TOO_DEEP
    if fit.submergence_cm is not None:
        why[depth < fit.submergence_cm] = RowStatus.TOO_SHALLOW
    return why


def _farthest_x(plate: AnyPlate, beta: float, container: Container, fit: Fit) -> float:
    """Largest distance of the plate's centre from the middle of the container, cm, for clearance from both walls.

    `beta`: Angle of the plate, rad.
    """
    return container.length_cm / 2 - fit.wall_clearance_cm - half_extent(plate, beta)[0]


def _end_of_linear_regime(run: Run, config: Config, linear_to_cm: float | None) -> float | None:
    """Depth to which stress of a natural sand or a table is a line, cm; None for a laboratory medium in a container.

    It is `linear_to_cm`, else that of the config, else infinite.
    """
    medium = config.media[run.medium]
    if config.table is None and medium.role != "natural_sand":
        return None
    return linear_to_cm or medium.linear_to_cm or math.inf


def _why_no_slope(
    run: Run,
    stroke: Stroke,
    window_status: StatusArray,
    why: StatusArray,
    plate: AnyPlate,
    config: Config,
    law: DepthLaw,
) -> tuple[Remark, ...]:
    """Return the reasons why the samples of a stroke must not give a slope; empty if they may.

    Refused are saturated samples or a short tare inside the window, which would change the slope, and a window with too
    few samples or too little depth, whose slope cannot be told from a constant.

    `window_status`: Status by the window alone, from `classify_samples`.
    `why`: Status by the window and by all earlier stages.
    """
    is_stress_table = config.table is not None
    # number of samples of the window by what earlier stages say of them
    lost = np.bincount(stroke.why[window_status == RowStatus.GOOD], minlength=len(RowStatus))
    if saturated := lost[RowStatus.SATURATED]:
        return (remark("window-saturated", count=saturated),)
    # a few samples without tare at the ends only mean that the two logs start at different depths
    if (untared := lost[RowStatus.UNTARED]) > 0.02 * lost.sum() + 2:
        return (remark("tare-short", count=untared),)
    depth = stroke.depth[why == RowStatus.GOOD]
    # somebody chose the depths of a table, so a single row counts; a log needs several samples
    fewest = 1 if is_stress_table else max(config.fit.min_points, slopes.FEWEST)
    lacking = None
    is_level = run.direction == "horizontal"
    if depth.size < fewest:
        lacking = remark("few-points", found=depth.size, wanted=fewest)
    elif law.name == "free_intercept" and not is_level and slopes.level_path(depth):
        lacking = remark("few-points", found=1, wanted=2)
    elif not depth.any():
        return (remark("zero-depths"),)
    elif not is_level and not is_stress_table:
        lacking = _why_too_short(depth, plate, config.fit)
    if lacking is None:
        return ()
    widest = _farthest_x(plate, math.radians(run.beta_deg), config.container, config.fit)
    return (lacking, *_main_cause(why, stroke.x, widest))


def _why_too_short(depth: FloatArray, plate: AnyPlate, fit: Fit) -> Remark | None:
    """Return the reason why a window covers too little depth to give a slope; None if it covers enough.

    `depth`: Of the samples in the window, cm, shape (n,).
    """
    stated = fit.min_depth_cm
    least_cm = plate.length_cm / 10 if stated is None else stated
    covered = float(np.ptp(depth))
    # the first and last sample may lie slightly inside the window
    if covered >= 0.999 * least_cm:
        return None
    least_source = "a tenth of the plate's length" if stated is None else "fit.min_depth_cm"
    return remark("short-window", found=covered, wanted=least_cm, least=least_source)


def _main_cause(why: StatusArray, x: FloatArray, widest: float) -> tuple[Remark, ...]:
    """Return the most frequent reason why samples of a stroke do not count; empty if all count.

    It is added to a reason such as "too few points", which does not say where the points have gone.

    `why`: `RowStatus` of each sample. `x`: Positions, cm. `widest`: Largest allowed distance from the middle, cm, from
    `_farthest_x`; both are named where the samples lie beyond a wall.
    """
    counts = np.bincount(why)
    counts[RowStatus.GOOD] = 0
    if not counts.any():
        return ()
    main = RowStatus(int(counts.argmax()))
    facts = {"count": counts.max(), "size": why.size, "why": remark(main.code)}
    if main is not RowStatus.WALL:
        return (remark("most-samples", **facts),)
    return (remark("most-beyond-wall", **facts, first=x[0], last=x[-1], low=-widest, high=widest),)


# --- The slope of a run, and its flags


def _stresses(
    stroke: Stroke, plate: AnyPlate, sign_x: float
) -> tuple[FloatArray, FloatArray | None]:
    """Stress of the medium and of the tare on the plate, z and x, N/cm^2, shape (2, n) each; None without a tare.

    `sign_x`: Factor 1 or -1 of x, from `filed_under`.
    """
    stress = stroke.force / plate.area_cm2
    stress[1] *= sign_x
    if stroke.tare is None:
        return stress, None
    return stress, stroke.tare / plate.area_cm2 * np.array([[1.0], [sign_x]])


def _fit_line(
    run: Run,
    stroke: Stroke,
    stress: FloatArray,
    tare_stress: FloatArray | None,
    usable: BoolArray,
    plate: AnyPlate,
    config: Config,
) -> tuple[slopes.Slope, tuple[Remark, ...]]:
    """Fit the slope of stress over depth through zero, with every error that the log shows; flag a curve or a crust.

    `stress`, `tare_stress`: z and x of all samples, N/cm^2, shape (2, n). `usable`: True in the window, shape (n,).
    A level run has one depth, so its flags say nothing of depth, but the start-up of its force adds an error.
    """
    level = run.direction == "horizontal"
    depth = stroke.depth[usable]
    startup = None
    if level:
        startup = slopes.startup_bias(stroke.path, stress, usable, config.fit.horizontal_skip_cm)
    slope = slopes.fit_slope(
        depth,
        stress[:, usable],
        stroke.zero_variance / plate.area_cm2**2,
        stroke.zero_dof,
        stroke.depth_sd,
        startup,
        None if tare_stress is None else tare_stress[:, usable],
    )
    # a curvature below the resolution of the transducer does not count
    visible = config.transducer.precision_N / plate.area_cm2
    pull_skip_cm = config.fit.extraction_skip_cm if run.direction == "extraction" else None
    flags = () if level else _linearity_flags(slope, float(depth.max()), visible, pull_skip_cm)
    if run.direction == "intrusion" and (crust := find_crust(depth, stress[0, usable])) is not None:
        flags += (remark("crust", depth=crust.depth_cm, percent=100 * crust.excess),)
    return slope, flags


def _mark_exact(
    slope: slopes.Slope, depth: FloatArray, residual: FloatArray, stress: FloatArray, run: Run
) -> tuple[slopes.Slope, tuple[Remark, ...]]:
    """Set the error of a slope to NaN where stress lies exactly on the law: it was calculated, and has no scatter.

    An error of 0 would claim a perfect measurement. `residual`, `stress`: z and x, N/cm^2, shape (2, n).
    Returns the slope, and the flag ``no-scatter`` if a component is exact.
    """
    # no transducer is that fine, and tables are printed with six digits
    largest_residual = np.abs(residual).max(axis=1)
    exact = (largest_residual <= 1e-6 * np.abs(stress).max(axis=1)) & (depth.size > 1)
    # a plate that is level or upright has no horizontal stress on a vertical path
    exact[1] &= slope.alpha[1] != 0 or bool(run.beta_deg % 90 or run.gamma_deg % 180 != 90)
    if not exact.any():
        return slope, ()
    return replace(slope, se=np.where(exact, np.nan, slope.se)), (remark("no-scatter"),)


LEAST_WORK: float = _CHOSEN.least_work
"""Largest work that a medium may seem to do on a plate, -(alpha_x cos gamma + alpha_z sin gamma), N/cm^3."""


def _flag_negative_work(slope: slopes.Slope, gamma_deg: float) -> tuple[Remark, ...]:
    """Flag a force that pulls the plate along its path by more than its error: a sign of a channel is wrong then."""
    se_along_path = math.hypot(*(_resistance_direction(gamma_deg) * np.nan_to_num(slope.se)))
    is_pulled = _pulls_plate(slope.alpha, gamma_deg, _CHOSEN.work_sigmas * se_along_path)
    return (remark("gives-back"),) if is_pulled else ()


def _pulls_plate(alpha: FloatArray, gamma_deg: float, noise: float = 0.0) -> bool:
    """Return True if alpha (z and x) pulls the plate along its path by more than `noise` and `LEAST_WORK`, N/cm^3.

    A medium at rest can only resist a motion. `gamma_deg`: direction of the motion, that of the cell.
    """
    return float(_resistance_direction(gamma_deg) @ alpha) < -max(LEAST_WORK, noise)


def _resistance_direction(gamma_deg: float) -> FloatArray:
    """Unit vector (z, x) against the motion, (sin gamma, cos gamma), shape (2,): times alpha it is the resistance."""
    along_x, along_z = direction(math.radians(gamma_deg))
    return -np.array([along_z, along_x])


def _linearity_flags(
    slope: slopes.Slope, deepest: float, visible: float, pull_skip_cm: float | None
) -> tuple[Remark, ...]:
    """Flag the components whose stress is curved over depth (see `curved`): their alpha depends on the window.

    `deepest`: Depth of the end of the window, cm.
    `visible`: Stress that the transducer resolves, N/cm^2; a smaller curvature does not count.
    `pull_skip_cm`: Path at the start of a pull that is left out; None for a push.
    """
    is_curved = curved(slope.nonlinear_p, slope.nonlinear_ratio, slope.alpha, deepest, visible)
    percent = 100 * slope.nonlinear_ratio
    code = "not-linear" if pull_skip_cm is None else "pull-not-linear"
    skip: Row = {} if pull_skip_cm is None else {"skip": pull_skip_cm}
    return tuple(
        remark(code, component=COMPONENTS[k], percent=percent[k], **skip)
        for k in np.flatnonzero(is_curved)
    )


def curved(
    p: FloatArray, ratio: FloatArray, alpha: FloatArray, deepest: FloatArray | float, visible: float
) -> BoolArray:
    """Return True where a curvature is significant, large enough to matter, and more than `visible`, N/cm^2.

    Arrays of one shape, an element a run or a component. `p`: Probability of such a curvature by chance. `ratio`:
    Distance of a parabola from the line at the end of the window, relative to the stress there
    (`Slope.nonlinear_ratio`).
    `alpha`: N/cm^3. `deepest`: Depth of the end of the window, cm.
    """
    size = np.abs(ratio)
    is_large = (size > _CHOSEN.curved_ratio) & (size * np.abs(alpha) * deepest > visible)
    return np.asarray((p < slopes.CURVED_P) & is_large)


# --- Tables of the stage


# `outputs/measure.toml` says what each column means
_COMPONENT_COLUMNS = (
    "alpha_{}_N_per_cm3",
    "alpha_{}_se_N_per_cm3",
    "alpha_{}_lo_N_per_cm3",
    "alpha_{}_hi_N_per_cm3",
    "alpha_{}_dof",
    "alpha_{}_ols_se_N_per_cm3",
    "alpha_{}_startup_N_per_cm3",
    "alpha_{}_tare_N_per_cm3",
    "alpha_{}_curvature_N_per_cm3",
    "alpha_{}_rod_N_per_cm3",
    "intercept_{}_N_per_cm2",
    "free_slope_{}_N_per_cm3",
    "free_stress_{}_percent",
    "exponent_{}",
    "exponent_{}_se",
    "power_stress_{}_percent",
    "power_misfit_{}_ratio",
    "nonlinear_{}_p",
    "nonlinear_{}_ratio",
)
FIT_COLUMNS = [
    "run_id",
    "medium",
    "beta_deg",
    "gamma_deg",
    "direction",
    "mirrored",
    "tare_run",
    "depth_from_cm",
    "depth_to_cm",
    "n_points",
    "lever_per_cm",
    "clock_cm",
    "offset_cm",
    "offset_se_cm",
    "start_cm",
    *(name.format(c) for c in COMPONENTS for name in _COMPONENT_COLUMNS),
    "note",
    *REASON,
]


def find_strokes(
    runs: Sequence[Run], status: pd.DataFrame, tared: pd.DataFrame, tares: pd.DataFrame
) -> Iterator[tuple[Run, slice, Stroke | tuple[Remark, ...]]]:
    """Yield each run, its rows of `tared`, and its stroke, or the reasons why it has none.

    `status`, `tared`, `tares`: see the head of this module.
    """
    rows_by_run = split_runs(tared)
    columns = {name: tared[name].to_numpy() for name in tared.columns.drop("run_id")}
    facts: dict[str, Row] = {row["run_id"]: row for row in status.to_dict("records")}
    rows_of_tares = tares.filter(["run_id", *REASON]).to_dict("records")
    why_no_tare = {row["run_id"]: reason_of(row) for row in rows_of_tares}
    for run in runs:
        rows = rows_by_run.get(run.run_id)
        if rows is None:
            reason = reason_of(facts[run.run_id]) or why_no_tare.get(run.run_id, ())
            yield run, slice(0), reason
            continue
        # a tare that was not read has no row in `status`
        run_and_tare_facts = [facts[name] for name in (run.run_id, run.tare_run) if name in facts]
        samples = {name: values[rows] for name, values in columns.items()}
        yield run, rows, _make_stroke(samples, run_and_tare_facts)


def _make_stroke(samples: StrokeColumns, facts: list[Row]) -> Stroke:
    """Make the `Stroke` of one run from its samples.

    `samples`: Columns of ``tared``, each of shape (n,). `facts`: Row of the run in ``status``, then that of its tare,
    if that was read.
    """
    depth, run = samples["depth_cm"], facts[0]
    # an error of the clocks shifts the depth by speed x error
    speed = float(np.ptp(depth)) / (depth.size * float(run["sample_step_s"]))
    common_s = float(np.nan_to_num(run["clock_shared_se_s"]))
    # a surface that was found in this run shifts all its depths too; the error of a given surface is not of one run
    surface_se_cm = float(np.nan_to_num(run["surface_se_mm"])) / 10
    return Stroke(
        depth,
        x=samples["x_cm"],
        path=samples["path_cm"],
        force=stack_components(samples, "force"),
        why=samples["why"],
        zero_variance=np.array(
            [[fact[f"zero_var_{c}_N2"] for c in COMPONENTS] for fact in facts], dtype=float
        ),
        zero_dof=np.array([[fact["zero_dof"]] * 2 for fact in facts], dtype=float),
        depth_sd=math.hypot(speed * float(run["clock_se_s"]), surface_se_cm),
        clock_cm=math.copysign(speed * common_s, depth[-1] - depth[0]),
        tare=stack_components(samples, "tare"),
    )


def _account_for_samples(ledger: Ledger, run: Run, stroke: Stroke, fit: RunFit) -> None:
    """Enter the samples of a stroke into the ledger, by their use or the reason why they are not used.

    Those that an earlier stage dropped are in the ledger already.
    """
    handed_on = fit.why[stroke.why == RowStatus.GOOD]
    ledger.add_rows(run, handed_on[handed_on != RowStatus.GOOD], "")
    good = int(np.count_nonzero(handed_on == RowStatus.GOOD))
    if good and fit.reason:
        why = remark("no-alpha", why=fit.reason[0])
        ledger.add(run, run.force_log, DROPPED, good, why, *fit.reason[1:])
    elif good:
        ledger.add(run, run.force_log, USED, good, remark("slope"))


def make_fit_row(run: Run, fit: RunFit, clock_cm: float, config: Config, note: str) -> Row:
    """Make the row of a run in the table of fits (`FIT_COLUMNS`); without a slope its numbers are left out.

    `clock_cm`: Standard error of the depths by the clock that runs share, cm (see `Stroke`); it becomes a column, as do
    `note` and the reason. The columns of x are NaN where the force along x is unknown.
    """
    row: Row = {
        "run_id": run.run_id,
        "medium": run.medium,
        "beta_deg": fit.beta_deg,
        "gamma_deg": fit.gamma_deg,
        "direction": run.direction,
        "mirrored": filed_under(run)[2] < 0,
        "tare_run": run.tare_run,
        "depth_from_cm": fit.depth_from_cm,
        "depth_to_cm": fit.depth_to_cm,
        "n_points": 0,
        "clock_cm": clock_cm,
        "note": note,
        **reason_columns(fit.reason),
    }
    slope = fit.slope
    if slope is None:
        return row
    row |= {
        "n_points": slope.points,
        "lever_per_cm": slope.lever,
        "offset_cm": slope.offset[0],
        "offset_se_cm": slope.offset_se[0],
        "start_cm": slope.start[0],
    }
    lo, hi = slope.interval(config.fit.confidence)
    surface_cm = math.hypot(*ordinary_surface(config.errors))
    # in the order of `_COMPONENT_COLUMNS`, z and x each
    numbers = (
        slope.alpha,
        slope.se,
        lo,
        hi,
        slope.dof,
        slope.ols_se,
        slope.startup,
        slope.tare,
        slope.curvature,
        fit.rod,
        slope.intercept,
        slope.free_slope,
        *_compare_laws(fit, surface_cm),
        slope.nonlinear_p,
        slope.nonlinear_ratio,
    )
    for i, component in enumerate(COMPONENTS):
        names = [name.format(component) for name in _COMPONENT_COLUMNS]
        row |= {name: number[i] for name, number in zip(names, numbers, strict=True)}
    if lacks_force_x(config, run):
        row |= dict.fromkeys([name.format("x") for name in _COMPONENT_COLUMNS], math.nan)
    return row


class _LawComparison(NamedTuple):
    """Two other laws of depth, compared with the line through zero at the end of the window; shape (2,) each, z and x.

    Of both, a large difference says that alpha depends on the law; a power near 1 says that it does not.

    `free_percent`: Stress there by the line with a free intercept: difference from the line through zero, percent.
    `exponent`, `exponent_se`: Exponent of the power, and its standard error.
    `power_percent`: Stress there by the power: difference from the line through zero, percent.
    `misfit`: Sum of squared residuals of the power, relative to that of the line with a free intercept.
    """

    free_percent: FloatArray
    exponent: FloatArray
    exponent_se: FloatArray
    power_percent: FloatArray
    misfit: FloatArray


def _compare_laws(fit: RunFit, surface_cm: float) -> _LawComparison:
    """Compare other laws of depth with the line through zero; all NaN for a level run or a few depths.

    `surface_cm`: Standard deviation of the free surface, cm.
    """
    if fit.laws is None:
        return _LawComparison(*[np.full(2, np.nan)] * 5)
    line = np.where(fit.line == 0, np.nan, fit.line)
    free_percent, power_percent = (
        100 * (np.array([fit_of_law.alpha for fit_of_law in fits]) / line - 1) for fits in fit.laws
    )
    squares_of_line, squares_of_power = (
        np.array([fit_of_law.residual @ fit_of_law.residual for fit_of_law in fits])
        for fits in fit.laws
    )
    # a component without stress fits any power
    exponent = np.where(fit.line == 0, np.nan, [power.exponent for power in fit.laws.power])
    noise = np.array([power.exponent_se for power in fit.laws.power])
    # change of the exponent for a surface that is 1 cm off; rounded, so that its cache serves many runs
    lever = exponent_lever(round(fit.depth_from_cm, 2), round(fit.depth_to_cm, 2))
    return _LawComparison(
        free_percent,
        exponent,
        # errors by the scatter of samples, by the surface, and by denser and looser patches of the bed
        exponent_se=np.sqrt(noise**2 + (lever * exponent * surface_cm) ** 2 + PATCHES**2),
        power_percent=np.where(np.isnan(exponent), np.nan, power_percent),
        misfit=squares_of_power / np.where(squares_of_line > 0, squares_of_line, np.nan),
    )
