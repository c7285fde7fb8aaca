"""From a tared stroke to one row of the table of fits, over the window where stress is proportional to depth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rftfit.conventions import file_extraction
from rftfit.measure.ledger import Why
from rftfit.measure.slopes import Slope, fit_slope, unfinished_start

if TYPE_CHECKING:
    import numpy.typing as npt

    from rftfit.campaign.config import AnyPlate, Config, Container, Fit
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray


# --- Where along a stroke the stress is proportional to depth, and therefore fitted.


def half_extent(plate: AnyPlate, beta: float) -> tuple[float, float]:
    """Half the size of a plate along x and z when it is held at `beta`.

    `beta`: rad. Returns `half_x`, `half_z`: cm.
    """
    length, thickness = plate.length_cm / 2, plate.thickness_cm / 2
    cosine, sine = abs(math.cos(beta)), abs(math.sin(beta))
    return length * cosine + thickness * sine, length * sine + thickness * cosine


def slanted_window(
    depth: FloatArray, x: FloatArray, plate: AnyPlate, beta: float, container: Container, fit: Fit
) -> npt.NDArray[np.int8]:
    """Tell for each sample of a slanted stroke why it is not fitted, design section 2.

    `depth`, `x`: shape (n,); Of the plate's centre, cm; x = 0 in the middle of the container.
    `beta`: rad. `fit`: Clearance, and overrides of both ends of the window. Returns shape (n,):
    `Why`; GOOD where the sample is fitted.
    """
    half_x, half_z = half_extent(plate, beta)
    shallowest = half_z if fit.submergence_cm is None else fit.submergence_cm
    deepest = container.depth_cm - fit.wall_clearance_cm - half_z
    if fit.max_depth_cm is not None:
        deepest = fit.max_depth_cm
    widest = container.length_cm / 2 - fit.wall_clearance_cm - half_x
    # the outermost reason is tested last, so that it wins
    reason = np.full(depth.size, Why.GOOD, dtype=np.int8)
    reason[np.abs(x) > widest] = Why.WALL
    reason[depth > deepest] = Why.BOTTOM
    reason[depth < shallowest] = Why.ABOVE
    return reason


def horizontal_window(
    travel: FloatArray, x: FloatArray, plate: AnyPlate, beta: float, container: Container, fit: Fit
) -> npt.NDArray[np.int8]:
    """Tell for each sample of a horizontal stroke why it is not averaged.

    `travel`: shape (n,); Length of the path so far, cm. `x`: shape (n,); cm. `beta`: rad. Returns
    shape (n,): `Why`; GOOD where the sample is averaged.
    """
    half_x, _ = half_extent(plate, beta)
    reason = np.full(travel.size, Why.GOOD, dtype=np.int8)
    reason[np.abs(x) > container.length_cm / 2 - fit.wall_clearance_cm - half_x] = Why.WALL
    reason[travel < fit.horizontal_skip_cm] = Why.STARTUP
    return reason


def linear_window(depth: FloatArray, linear_to_cm: float) -> npt.NDArray[np.int8]:
    """Tell for each sample of a natural sand's penetration test why it is not fitted.

    `depth`: shape (n,); cm. `linear_to_cm`: End of the linear regime. Returns shape (n,): `Why`;
    GOOD where the sample is fitted.
    """
    reason = np.full(depth.size, Why.GOOD, dtype=np.int8)
    reason[depth > linear_to_cm] = Why.NONLINEAR
    reason[depth < 0] = Why.ABOVE
    return reason


# --- From a tared stroke to one row of the table of fits.


NOT_LINEAR = "not linear"
_CURVED_P, _CURVED_RATIO = 0.01, 0.10
COMPONENTS = ("z", "x")


@dataclass(frozen=True)
class Stroke:
    """A tared stroke; arrays of shape (n,), in the order of recording.

    `depth`, `x`, `path`: cm; path is the length travelled.
    `force`: shape (2, n); Granular force z, x, N; NaN where the tare is not known.
    `why`: `Why` a row must not be used; GOOD where it may.
    `zero_variance`, `zero_dof`: shape (2, 2); Of run and tare (rows), for z and x, N^2.
    `depth_sd`: Standard error of the depth common to all samples, from the clocks, cm.
    `flags`: What earlier stages remarked.
    """

    depth: FloatArray
    x: FloatArray
    path: FloatArray
    force: FloatArray
    why: np.ndarray
    zero_variance: FloatArray
    zero_dof: FloatArray
    depth_sd: float = 0.0
    flags: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunFit:
    """What one plate run says about one cell of the alpha table.

    `beta_deg`, `gamma_deg`: The cell it is filed under.
    `depth_from_cm`, `depth_to_cm`: Depths actually fitted; NaN if there is no fit.
    `slope`: Components z, x, the sign of x already that of the cell.
    `why`: shape (n,); `Why` each sample of the stroke was not fitted; GOOD where it was, or would
        have been.
    `reason`: Why there is no alpha; empty if there is one.
    """

    beta_deg: float
    gamma_deg: float
    depth_from_cm: float = math.nan
    depth_to_cm: float = math.nan
    slope: Slope | None = None
    why: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=np.int8))
    flags: tuple[str, ...] = ()
    reason: str = ""


def filed_under(run: Run) -> tuple[float, float, float]:
    """Cell of the alpha table to which a run belongs, and the sign of its alpha_x there.

    Returns `beta_deg`, `gamma_deg`, `sign_x`: Extractions go under (-beta, -gamma) with alpha_x
    turned.
    """
    if run.direction == "extraction":
        return file_extraction(run.beta_deg, run.gamma_deg)
    return run.beta_deg, run.gamma_deg, 1.0


def fit_run(run: Run, stroke: Stroke, config: Config) -> RunFit:
    """Fit alpha_z and alpha_x of one plate run in its window.

    Returns with a reason and no slope where the run must not give a number.
    """
    plate = config.intruders[run.intruder]
    assert plate.shape != "leg"
    beta_deg, gamma_deg, sign_x = filed_under(run)
    window = _window(run, stroke, plate, config)
    wanted = window == Why.GOOD
    usable = wanted & (stroke.why == Why.GOOD)
    why = np.where(stroke.why == Why.GOOD, window, stroke.why)

    def refuse(reason: str) -> RunFit:
        return RunFit(beta_deg, gamma_deg, why=why, flags=stroke.flags, reason=reason)

    saturated = int(np.count_nonzero(wanted & (stroke.why == Why.SATURATED)))
    if saturated:
        return refuse(f"transducer saturated in {saturated} samples of the window")
    wanted_count = int(np.count_nonzero(wanted))
    untared = int(np.count_nonzero(wanted & (stroke.why == Why.NO_TARE)))
    # a step or two at the ends is the difference of two logs' starts, not a tare that is short
    if untared > 0.02 * wanted_count + 2:
        return refuse(
            f"tare shorter than the run or with a gap: {untared} samples of the window have no tare"
        )
    points = int(np.count_nonzero(usable))
    if points < max(config.fit.min_points, 8):
        return refuse(f"too few points: {points} in the window, {config.fit.min_points} wanted")

    depth = stroke.depth[usable]
    stress = stroke.force / plate.area_cm2
    stress[1] *= sign_x
    startup = None
    if run.direction == "horizontal":
        startup = unfinished_start(stroke.path, stress, usable, config.fit.horizontal_skip_cm)
    slope = fit_slope(
        depth, stress[:, usable], stroke.zero_variance / plate.area_cm2**2, stroke.zero_dof,
        stroke.depth_sd, startup,
    )  # fmt: skip
    flags = stroke.flags + _linearity_flags(run, slope, float(depth.max()), plate, config)
    return RunFit(beta_deg, gamma_deg, float(depth.min()), float(depth.max()), slope, why, flags)


def _window(run: Run, stroke: Stroke, plate: AnyPlate, config: Config) -> np.ndarray:
    beta = math.radians(run.beta_deg)
    medium = config.media[run.medium]
    if medium.role == "natural_sand":
        return linear_window(stroke.depth, medium.linear_to_cm or math.inf)
    if run.direction == "horizontal":
        return horizontal_window(stroke.path, stroke.x, plate, beta, config.container, config.fit)
    why = slanted_window(stroke.depth, stroke.x, plate, beta, config.container, config.fit)
    if run.direction == "extraction":
        why[(stroke.path < config.fit.extraction_skip_cm) & (why == Why.GOOD)] = Why.STARTUP
    return why


def _linearity_flags(
    run: Run, slope: Slope, deepest: float, plate: AnyPlate, config: Config
) -> tuple[str, ...]:
    """Name the components whose curvature is both significant and large enough to matter."""
    if run.direction == "horizontal":
        return ()
    # curvature that stays below the noise of one sample bends nothing that could be measured
    visible = config.transducer.precision_N / plate.area_cm2
    end_stress = np.abs(slope.alpha) * deepest
    curved = (
        (slope.nonlinear_p < _CURVED_P)
        & (np.abs(slope.nonlinear_ratio) > _CURVED_RATIO)
        & (np.abs(slope.nonlinear_ratio) * end_stress > visible)
    )
    return tuple(
        f"alpha_{name} {NOT_LINEAR} ({100 * ratio:+.0f} % at the end of the window)"
        for name, ratio, bad in zip(COMPONENTS, slope.nonlinear_ratio, curved, strict=True)
        if bad
    )
