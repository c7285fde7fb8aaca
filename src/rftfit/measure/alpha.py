"""The alpha table of a medium: made from the fits of its runs, with every error, and read by columns and cells.

Which runs make a cell? What is alpha of a cell, how large is each of its errors, and what will the next push give?
`alpha_table` answers; the functions from `directions` on read such a table.

- A *cell* is a direction (beta, gamma), degrees, of a plate: a row of the table. `Row` is a row of the table of fits
  (``fits/MEDIUM.csv``, of `rftfit.measure.fits`), one run: its angles, ``alpha_{z,x}_N_per_cm3``, errors of that as
  ``alpha_z_se_N_per_cm3``, ``depth_from_cm``, ``depth_to_cm``, ``lever_per_cm`` (relative change of alpha for a surface
  that is 1 cm off), ``clock_cm`` (error of its depths by the clock that runs share), ``mirrored`` and ``tare_run``.
- A *level* run or cell has gamma = 0. Each run is at one depth, so several depths make its line through zero.
- An `ErrorTerm` is one error of alpha by its cause (`SOURCES`): standard deviation and degrees of freedom.
- The *mean* is alpha of the medium over many beds prepared alike; the *next* push is one more run in one more bed.
- Alpha and all errors are in N/cm^3; arrays of shape (2, ...) hold z, then x. A component is ``z`` or ``x``, here
  ``c``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, BoolArray, FloatArray, IndexArray
from rftfit.directions import (
    SAME_DEPTH_CM,
    angle_apart,
    number_depths,
    number_directions,
    same_direction,
)
from rftfit.measure.errors import (
    AS_PREPARED,
    OF_CELL,
    REPEATS,
    SOURCES,
    USUAL_BED_SPREAD,
    ErrorTerm,
    Slopes,
    Source,
    Spread,
    SurfaceError,
    bed_of_mean,
    bed_of_next,
    combined_half_width,
    gradient,
    scaled_slopes,
    spread_of_beds,
    wider,
    without_included,
)
from rftfit.measure.flags import (
    MARKS,
    REASON,
    Flags,
    Remark,
    attach_run,
    mark_columns,
    reason_columns,
    reason_of,
    remark,
)
from rftfit.measure.laws import LINE_THROUGH_ZERO, DepthLaw
from rftfit.measure.sentences import FLAGS
from rftfit.measure.slopes import combine_dof, normal_quantile

if TYPE_CHECKING:
    from rftfit.campaign.config import ErrorSettings, Grid
    from rftfit.measure.fits import Row


def alpha_table(
    fits: pd.DataFrame,
    medium: str,
    confidence: float,
    depths: int,
    errors: ErrorSettings | None = None,
    grid: Grid | None = None,
    surface: SurfaceError | None = None,
    law: DepthLaw = LINE_THROUGH_ZERO,
    outliers: Mapping[str, tuple[float, float]] | None = None,
    shape: Slopes | None = None,
) -> pd.DataFrame:
    """Combine the fits of one medium into its cells (directions beta, gamma of a plate), one row a cell.

    Cells are the planned ones of the grid, or else the distinct directions of the runs. A cell with
    several runs gets their mean. Planned cells at beta = -90 and +90 degrees are one and the same plate
    and share their runs. A level cell is the zero-intercept fit through the steady-state means at
    the depths of its runs. The interval of alpha holds every error of `SOURCES`; each error has a column, and the
    column `spread` says where the error of the beds is known from. The interval of the next push holds also the noise,
    surface, angle and bed of one further run.

    `fits`: Table of fits.
    `confidence`: Probability of the intervals, 0 to 1.
    `depths`: Number of depths that a level cell should have.
    `errors`, `surface`: Errors that no log shows, from `errors_of`; default: none.
    `grid`: Planned cells and the tolerance of angles; default: none planned, and the usual tolerance.
    `outliers`: alpha_z and alpha_x of an outlying run minus the alpha of the other runs, N/cm^3, by run_id. The
    estimate of how beds differ leaves out these runs, and the interval of their cell reaches the other runs.
    `shape`: Function whose slopes replace those of alpha where a cell has no neighbours; default: none, so that an
    angle has no error there.
    `law`: Law of stress against depth by which `fits` were made; the means of a level cell are fitted by the same law.
    A cell whose window does not hold the depth of the law is NaN.

    Returns a table with the columns `_COLUMNS`.
    """
    from rftfit.campaign.config import ErrorSettings, Grid

    errors = errors or ErrorSettings(angle_deg=0, turn_deg=0, tare_percent=0, bed_percent=0)
    records = sorted(fits.to_dict("records"), key=lambda row: str(row["run_id"]))
    directions, runs_of_cells = _group_runs_by_cell(records, grid or Grid())
    outliers = outliers or {}
    runs_without_outliers = [
        [run for run in runs if run["run_id"] not in outliers] for runs in runs_of_cells
    ]
    spread = spread_of_beds(_collect_repeats(runs_without_outliers), errors.bed)
    cells = [
        _combine_runs(runs_of_cell, gamma == 0, depths, law)
        for runs_of_cell, (_, gamma) in zip(runs_of_cells, directions, strict=True)
    ]
    numbers_of_cells = _calculate_numbers(
        cells, directions, errors, surface or SurfaceError(), spread, confidence, outliers, shape
    )
    rows = []
    for (beta, gamma), cell, numbers in zip(directions, cells, numbers_of_cells, strict=True):
        cell_keys = {"medium": medium, "beta_deg": beta, "gamma_deg": gamma}
        rows.append(cell_keys | numbers | cell.columns)
    return pd.DataFrame(rows, columns=_COLUMNS)


QUANTITIES = ("", "_se", "_lo", "_hi", "_lo_next", "_hi_next")
"""Endings of the columns of a component: alpha (mean of the medium), its standard error, the ends of its interval, and
the ends of the interval in which the next push will lie."""


N_REPEATS = "n_repeats"
"""Column of the number of runs whose mean a row is; a campaign without logs may state more than one."""


def column(component: str, quantity: str = "") -> str:
    """Name of a column of alpha: `component` is ``z`` or ``x``, `quantity` is in `QUANTITIES`."""
    return f"alpha_{component}{quantity}_N_per_cm3"


def _group_runs_by_cell(
    records: list[Row], grid: Grid
) -> tuple[list[tuple[float, float]], list[list[Row]]]:
    """Return the cells (beta, gamma), degrees, and the runs of each cell.

    The cells are the planned ones, or else the distinct directions of the runs, sorted by beta, then gamma.
    """
    angles_deg = [(float(run["beta_deg"]), float(run["gamma_deg"])) for run in records]
    if grid.planned:
        runs_of_cells = [
            [run for run, angle in zip(records, angles_deg, strict=True) if grid.same(cell, angle)]
            for cell in grid.planned
        ]
        return list(grid.planned), runs_of_cells
    if not records:
        # a medium of legs alone has one cell, which says that there is no run
        return [(0.0, 90.0)], [[]]
    beta_of_runs, gamma_of_runs = np.array(angles_deg).T
    number = number_directions(beta_of_runs, gamma_of_runs, tolerance_deg=grid.angle_tolerance_deg)
    runs_by_cell: dict[tuple[float, float], list[Row]] = {}
    for run, first_run in zip(records, number, strict=True):
        beta_deg, gamma_deg = angles_deg[first_run]
        # plates at -90 and 90 degrees are one: it is called 90
        cell = (90.0 if beta_deg == -90 else beta_deg, gamma_deg)
        runs_by_cell.setdefault(cell, []).append(run)
    cells = sorted(runs_by_cell)
    return cells, [runs_by_cell[cell] for cell in cells]


def _collect_repeats(cells: list[list[Row]]) -> list[tuple[FloatArray, FloatArray]]:
    """Return alpha and its error, z and x, shape (2, runs), for each cell, to estimate how beds differ.

    A level cell gives one such pair for each depth, as only runs at one depth are repeats. Runs of a cell that is
    planned twice, at beta = -90 and 90 degrees, count once. `cells`: Runs of each cell.
    """
    counted_run_ids: set[str] = set()
    groups = []
    for runs in cells:
        measured = [run for run in runs if any(math.isfinite(run[column(c)]) for c in COMPONENTS)]
        new_runs = [run for run in measured if run["run_id"] not in counted_run_ids]
        if not new_runs:
            continue
        counted_run_ids.update(str(run["run_id"]) for run in new_runs)
        is_level = new_runs[0]["gamma_deg"] == 0 and math.isfinite(new_runs[0]["depth_from_cm"])
        for repeats in _split_by_depth(new_runs) if is_level else [new_runs]:
            groups.append((_of_components(repeats, ""), np.sqrt(_variance_between(repeats))))
    return groups


def _variance_between(runs: list[Row]) -> FloatArray:
    """Variance by which errors of the logs let alpha differ between repeats, (N/cm^3)^2, shape (2, runs).

    Repeats that differ by more show that their beds differ.
    """
    shares_tare = len({run.get("tare_run", "") for run in runs}) < len(runs)
    # runs that share a tare, a clock and the same curvature do not differ by these
    return _variance_without(runs, ("_tare", "_curvature") if shares_tare else ("_curvature",))


def _variance_without(runs: list[Row], errors: Sequence[str]) -> FloatArray:
    """Variance of alpha of each run less that by the clock and by `errors`, (N/cm^3)^2, shape (2, runs).

    `errors`: Endings of the columns of these errors, for example ``_tare``.
    """
    variance = _of_components(runs, "_se") ** 2
    for error in errors:
        variance -= _of_components(runs, error) ** 2
    # change of alpha by one standard error of the clock that all runs of a session share
    clock = (
        _of_components(runs, "") * _values_of(runs, "lever_per_cm") * _values_of(runs, "clock_cm")
    )
    return np.asarray(np.maximum(variance - clock**2, 0.0))


def _of_components(runs: list[Row], quantity: str) -> FloatArray:
    """Return a quantity of `QUANTITIES` or an error of each run, z and x, N/cm^3, shape (2, runs)."""
    return np.stack([_values_of(runs, column(c, quantity)) for c in COMPONENTS])


def _values_of(runs: list[Row], name: str, absent: float = 0.0) -> FloatArray:
    """Return a column of the runs, shape (runs,); `absent` where a run does not have it."""
    return np.array([run.get(name, absent) for run in runs], dtype=float)


def _split_by_depth(runs: list[Row]) -> list[list[Row]]:
    """Group horizontal runs by their depth; depths within a tolerance are one, as no arm reaches a depth exactly."""
    runs_by_depth: dict[int, list[Row]] = {}
    ordered = sorted(runs, key=lambda row: float(row["depth_from_cm"]))
    for run, number in zip(
        ordered, number_depths(_values_of(ordered, "depth_from_cm")), strict=True
    ):
        runs_by_depth.setdefault(int(number), []).append(run)
    return [runs_by_depth[number] for number in sorted(runs_by_depth)]


@dataclass(frozen=True)
class _Cell:
    """The runs of one direction that count; alpha of the cell is the sum of weight times alpha of each.

    `runs`: Empty if none counts; the reason is in `columns`.
    `weights`: shape (runs,): 1 / n for a mean of n runs, other ones for level runs, as deeper ones fix the line better.
    `is_level`: True for level runs, whose means at several depths are fitted.
    `is_line`: True where the law of stress is a line through zero of depth.
    `columns`: Cells of the alpha table that are no numbers of alpha: depths, runs, reasons, blank marks.
    """

    runs: list[Row]
    weights: FloatArray
    is_level: bool
    is_line: bool
    columns: dict[str, float | int | str]

    def weighted_sum(self, name: str) -> float:
        """Sum over the runs of weight times the value of a column."""
        return float(self.weights @ self.values_of(name))

    def values_of(self, name: str, absent: float = 0.0) -> FloatArray:
        """Values of a column, shape (runs,); `absent` where a run does not have it."""
        return _values_of(self.runs, name, absent)


_COLUMNS = [
    "medium",
    "beta_deg",
    "gamma_deg",
    *(column(c, q) for c in COMPONENTS for q in (*QUANTITIES, *(f"_{s}" for s in SOURCES))),
    *(f"run_to_run_{c}_N_per_cm3" for c in COMPONENTS),
    "depth_from_cm",
    "depth_to_cm",
    "n_runs",
    "n_depths",
    "run_ids",
    "lost_run_ids",
    "tare_runs",
    "spread",
    *MARKS,
    *REASON,
]
"""Columns of an alpha table; numbers that a cell does not have are NaN."""


def _combine_runs(runs: list[Row], is_level: bool, depths: int, law: DepthLaw) -> _Cell:
    """Choose the runs of one cell that count, their weights in its alpha, and the reasons why others do not count.

    `is_level`: True for a cell with gamma = 0. `depths`: Number of depths that such a cell should have; where it is 2
    or more, a single one is refused. `law`: see `alpha_table`.
    """
    good = [run for run in runs if math.isfinite(run[column("z")])]
    # a campaign without logs may hold the stress at all depths of a horizontal motion as one run
    is_level &= all(run.get("direction", "horizontal") == "horizontal" for run in good)
    reasons = [why for run in runs for why in attach_run(run["run_id"], reason_of(run))]
    n_depths = len(_split_by_depth(good)) if is_level else depths
    used_runs = good
    if not runs:
        reasons.append(remark("no-run"))
    elif good and n_depths < 2 <= depths:
        # one depth cannot show that stress is proportional to depth
        reasons.append(remark("too-few-depths", found=n_depths, wanted=depths))
        used_runs = []
    elif good and is_level and not any(run["depth_to_cm"] for run in good):
        reasons.append(remark("zero-depths"))
        used_runs = []
    top = min((run.get("depth_from_cm", math.nan) for run in used_runs), default=math.nan)
    deep = max((run.get("depth_to_cm", math.nan) for run in used_runs), default=math.nan)
    holds_depth = top - SAME_DEPTH_CM <= law.at_cm <= deep + SAME_DEPTH_CM
    if used_runs and math.isfinite(law.at_cm) and not holds_depth:
        reasons.append(remark("outside-window", at=law.at_cm, top=top, deep=deep))
        used_runs = []
    # by default alpha is the mean of the runs
    weights = np.full(len(used_runs), 1 / max(len(used_runs), 1))
    # runs at one depth cannot be fitted by another law: their mean counts
    if is_level and used_runs and (n_depths > 1 or law.name == "through_zero"):
        depth = (_values_of(used_runs, "depth_from_cm") + _values_of(used_runs, "depth_to_cm")) / 2
        alpha = _of_components(used_runs, "")
        # one set of weights serves both components: those of the larger one
        larger = alpha[int(np.square(alpha).sum(axis=1).argmax())]
        weights = law.weights(depth, larger * depth)
    tares = dict.fromkeys(str(run.get("tare_run", "")) for run in used_runs)
    columns = {
        "depth_from_cm": top,
        "depth_to_cm": deep,
        "n_runs": len(good),
        "n_depths": n_depths if good and is_level else 0,
        "run_ids": " ".join(run["run_id"] for run in good),
        "lost_run_ids": " ".join(
            run["run_id"] for run in runs if not math.isfinite(run[column("z")])
        ),
        "tare_runs": " ".join(filter(None, tares)),
    }
    columns |= mark_columns() | reason_columns(reasons)
    return _Cell(used_runs, weights, is_level, law.name == "through_zero", columns)


def _calculate_numbers(
    cells: list[_Cell],
    directions: list[tuple[float, float]],
    errors: ErrorSettings,
    surface: SurfaceError,
    spread: Spread,
    confidence: float,
    outliers: Mapping[str, tuple[float, float]],
    shape: Slopes | None,
) -> list[dict[str, float | str]]:
    """Return the numbers in the row of each cell: alpha, its errors by name, its interval, that of the next push.

    `directions`: Beta and gamma of each cell, degrees. `spread`: How alpha differs from bed to bed. Other parameters:
    see `alpha_table`. A cell without runs has only ``spread``.
    """
    # shape (2, cells): z and x
    alpha = np.array(
        [
            [cell.weighted_sum(column(c)) if cell.runs else math.nan for cell in cells]
            for c in COMPONENTS
        ]
    )
    beta, gamma = np.array(directions, dtype=float).reshape(-1, 2).T
    # how fast alpha changes with the angles, N/cm^3 per degree: of z and of x an array of shape (cells,)
    alpha_per_deg = [
        np.hypot(*gradient(beta, gamma, alpha_of_component, slopes).T)
        for alpha_of_component, slopes in zip(
            alpha, scaled_slopes(shape, beta, gamma, alpha), strict=True
        )
    ]
    rows: list[dict[str, float | str]] = []
    for i, cell in enumerate(cells):
        row: dict[str, float | str] = {"spread": spread.source}
        rows.append(row)
        if not cell.runs:
            continue
        for k, c in enumerate(COMPONENTS):
            angle = float(alpha_per_deg[k][i]) * errors.angle_deg
            # of one run in one bed
            bed_error = spread.error_at(alpha[:, i], k)
            errors_of_mean = _errors_of_runs(cell, c, surface, bed_error)
            errors_of_mean |= _errors_of_setup(cell, c, alpha[:, i], angle, errors)
            # what one further run adds, of its own surface, angle, noise and bed
            lever = math.sqrt(float(np.mean(cell.values_of("lever_per_cm") ** 2)))
            errors_of_next: dict[Source, ErrorTerm] = {
                "surface": ErrorTerm(surface.run * abs(alpha[k, i]) * lever, surface.dof),
                "angle": ErrorTerm(angle),
            }
            source = _add_bed_errors(
                errors_of_mean, errors_of_next, cell, c, bed_error, spread.source, confidence
            )
            offsets = [outliers.get(str(run["run_id"]), (0.0, 0.0))[k] for run in cell.runs]
            of_outliers = _outlier_errors(cell, c, np.array(offsets), confidence)
            for terms, of_outlier in zip(
                (errors_of_mean, errors_of_next), of_outliers, strict=True
            ):
                terms["bed"] = wider(terms["bed"], of_outlier, confidence)
            row |= _make_component_columns(
                c, alpha[k, i], errors_of_mean, errors_of_next, confidence
            )
            if spread.source != AS_PREPARED:
                row[f"run_to_run_{c}_N_per_cm3"] = bed_error.sd
            if row["spread"] != OF_CELL:
                row["spread"] = source
    return rows


def _make_component_columns(
    c: str,
    alpha: float,
    errors_of_mean: Mapping[Source, ErrorTerm],
    errors_of_next: Mapping[Source, ErrorTerm],
    confidence: float,
) -> dict[str, float]:
    """Return the columns of one component: alpha, the ends of its intervals, and its errors by name.

    `c`: ``z`` or ``x``. `errors_of_next`: What the next push adds to the errors of the mean.
    """
    mean_terms = errors_of_mean.values()
    half_width = combined_half_width(mean_terms, confidence)
    # what all runs share is in the errors of the mean, and counts once
    half_width_of_next = combined_half_width([*mean_terms, *errors_of_next.values()], confidence)
    numbers = {
        "": alpha,
        "_se": math.sqrt(sum(error.sd**2 for error in mean_terms)),
        "_lo": alpha - half_width,
        "_hi": alpha + half_width,
        "_lo_next": alpha - half_width_of_next,
        "_hi_next": alpha + half_width_of_next,
        **{f"_{name}": error.sd for name, error in errors_of_mean.items()},
    }
    return {column(c, quantity): number for quantity, number in numbers.items()}


def _outlier_errors(
    cell: _Cell, c: str, outlier_offsets: FloatArray, confidence: float
) -> tuple[ErrorTerm, ErrorTerm]:
    """Errors of a cell with outlying runs: of its mean, and what the next push adds to that.

    With three repeats or more these are the scatter of the repeats. Else the interval of the mean reaches as far as
    the outliers have moved the mean, and the next push adds nothing.

    `outlier_offsets`: alpha of each outlying run minus that of the other runs, N/cm^3, shape (runs,); 0 for the others.
    """
    n = len(cell.runs)
    if outlier_offsets.any() and n > 2 and not cell.is_level:
        scatter = float(cell.values_of(column(c)).std(ddof=1))
        return ErrorTerm(scatter / math.sqrt(n), n - 1.0), ErrorTerm(scatter, n - 1.0)
    moved = float(np.abs(cell.weights @ outlier_offsets))
    return ErrorTerm(moved / combined_half_width([ErrorTerm(1.0)], confidence)), ErrorTerm(0.0)


def _errors_of_runs(
    cell: _Cell, c: str, surface: SurfaceError, bed_error: ErrorTerm
) -> dict[Source, ErrorTerm]:
    """Errors of one component of alpha that come from the logs, the tares, the surface and the clocks, by source.

    Errors that each run has of its own add in squares, so that more runs make them smaller; errors that runs share add
    with their signs. `c`: ``z`` or ``x``. `bed_error`: Error of one run by its bed; within it no curvature over depth
    is seen.
    """
    noise_variances = _noise_variance(cell, c) * cell.weights**2
    # the error of a shared tare is the same in all its runs, but has the other sign in a mirrored run
    is_mirrored_x = (c == "x") & (cell.values_of("mirrored") != 0)
    signed = np.where(is_mirrored_x, -1.0, 1.0) * cell.weights * cell.values_of(column(c, "_tare"))
    tare_names = np.array([str(run.get("tare_run", "")) for run in cell.runs])
    tare_errors = [float(signed[tare_names == name].sum()) for name in dict.fromkeys(tare_names)]
    # change of alpha for a surface that is 1 cm off, by run
    change_per_cm = cell.weights * cell.values_of(column(c)) * cell.values_of("lever_per_cm")
    # surface and clock errors that all runs share: more runs do not make them smaller
    session = surface.session * float(change_per_cm.sum())
    clocks = float(change_per_cm @ cell.values_of("clock_cm"))
    return {
        "noise": ErrorTerm(
            math.sqrt(float(noise_variances.sum())),
            float(combine_dof(noise_variances, cell.values_of(f"alpha_{c}_dof"))),
        ),
        # a start-up moves all depths the same way, so its effects add up before they are squared
        "startup": ErrorTerm(cell.weighted_sum(column(c, "_startup"))),
        "tare": ErrorTerm(math.copysign(math.hypot(*tare_errors), sum(tare_errors) + 0.0)),
        "surface": ErrorTerm(
            surface.run * float(np.sqrt(change_per_cm @ change_per_cm)), surface.dof
        ),
        # the sign is that of the larger error
        "session": ErrorTerm(math.copysign(math.hypot(session, clocks), session + clocks)),
        "curvature": ErrorTerm(
            cell.weighted_sum(column(c, "_curvature"))
            + _nonlinearity_over_depths(cell, c, bed_error)
        ),
    }


def _errors_of_setup(
    cell: _Cell, c: str, alpha: FloatArray, angle_error: float, errors: ErrorSettings
) -> dict[Source, ErrorTerm]:
    """Errors of one component by the angle of the plate, by a turn of the mount, and by the bed around the rods.

    `alpha`: z and x of the cell, N/cm^3, shape (2,). `angle_error`: Error of one run by its angle, N/cm^3.
    """
    alpha_z, alpha_x = alpha
    if math.isnan(alpha_x):
        # where x was not measured, it is taken to be as large as z
        alpha_x = alpha_z
    mirror_signs = np.where(cell.values_of("mirrored"), -1.0, 1.0)
    mean_sign = float(cell.weights @ mirror_signs / cell.weights.sum())
    # a small turn of the mount mixes the components
    change_per_rad = mean_sign * (alpha_z if c == "x" else -alpha_x)
    return {
        # the mean of independent errors is smaller than each of them
        "angle": ErrorTerm(angle_error * math.sqrt(float(cell.weights @ cell.weights))),
        "turn": ErrorTerm(change_per_rad * math.radians(errors.turn_deg)),
        "rod": ErrorTerm(cell.weighted_sum(column(c, "_rod")) * errors.tare_percent / 100),
    }


def _noise_variance(cell: _Cell, c: str) -> FloatArray:
    """Variance of alpha of each run by noise alone, without start-up, tare, curvature and clock, (N/cm^3)^2."""
    variance = _variance_without(cell.runs, ("_startup", "_tare", "_curvature"))
    return np.asarray(variance[COMPONENTS.index(c)])


def _noise_of_next(cell: _Cell, c: str, *, scatter: bool) -> ErrorTerm:
    """Noise of one further run like those of the cell.

    A row of a campaign that is a table of alpha may be the mean of n runs: a single run then has n times its variance.
    With `scatter` the error of the bed is the scatter of the rows, which holds their noise once, so that n - 1 times
    the variance remains.
    """
    variance = _noise_variance(cell, c) * (cell.values_of(N_REPEATS, 1.0) - scatter)
    # the weights add up to 1, but where stress over depth depends on depth
    sd = float(cell.weights.sum()) * math.sqrt(float(variance.mean()))
    return ErrorTerm(sd, float(combine_dof(variance, cell.values_of(f"alpha_{c}_dof"))))


def _nonlinearity_over_depths(cell: _Cell, c: str, bed_error: ErrorTerm) -> float:
    """Error of a level cell, N/cm^3, whose runs leave the line through zero by more than noise and bed; else 0.

    Stress that is no line of depth gives another alpha at other depths. Half the width of a uniform distribution over
    sqrt(3) is its standard deviation.
    """
    alpha, se = cell.values_of(column(c)), cell.values_of(column(c, "_se"))
    if not (cell.is_level and cell.is_line) or alpha.size < 3:
        return 0.0
    deviation = alpha - float(cell.weights @ alpha)
    # within three standard errors no run clearly leaves the line
    if (np.abs(deviation) <= 3 * np.hypot(se, bed_error.sd)).all():
        return 0.0
    # the weight grows with the square of the depth: the deepest run counts
    return float(np.abs(deviation[cell.weights.argmax()])) / math.sqrt(3)


def _add_bed_errors(
    errors_of_mean: dict[Source, ErrorTerm],
    errors_of_next: dict[Source, ErrorTerm],
    cell: _Cell,
    c: str,
    bed_error: ErrorTerm,
    spread_source: str,
    confidence: float,
) -> str:
    """Add noise and bed to both dicts of errors, and return the source of the error by the bed.

    Repeats differ also by their surfaces and angles. So where repeats show the error of the bed, the errors of
    surface and angle are subtracted from it.

    `bed_error`, `spread_source`: Error of a single bed as estimated from the whole medium, and how that is known:
    `Spread.source`. The source returned is the same, or `OF_CELL` where the scatter of the runs of this cell counts.
    """
    alpha, noise = cell.values_of(column(c)), errors_of_mean["noise"]
    errors_of_mean["noise"], errors_of_mean["bed"], source = bed_of_mean(
        alpha, cell.weights, noise, bed_error, spread_source, shown_by_runs=not cell.is_level
    )
    # `bed_of_mean` changes the noise where it takes the scatter of the runs for noise and bed together
    scatter = source == OF_CELL and errors_of_mean["noise"] != noise
    errors_of_next["noise"] = _noise_of_next(cell, c, scatter=scatter)
    if spread_source == AS_PREPARED:
        # also where an interval does not include the scatter between beds, the next bed is another
        bed_error = ErrorTerm(USUAL_BED_SPREAD * abs(float(cell.weights @ alpha)))
    errors_of_next["bed"] = bed_of_next(alpha, bed_error, confidence, scatter=scatter)
    if spread_source == AS_PREPARED and not scatter and (cell.values_of(N_REPEATS, 1.0) > 1).all():
        # several runs stand behind each row, and what these differ by holds their beds
        errors_of_next["bed"] = ErrorTerm(0.0)
    if source in (REPEATS, OF_CELL):
        for terms in (errors_of_mean, errors_of_next):
            included = terms["surface"], terms["angle"]
            terms["bed"] = without_included(terms["bed"], included, confidence)
    return source


Columns: TypeAlias = "pd.DataFrame | Mapping[Any, npt.ArrayLike]"
"""An alpha table, or its columns by name."""


def directions(table: Columns) -> tuple[FloatArray, FloatArray]:
    """Beta and gamma of the cells of an alpha table, rad, shape (n,)."""
    beta, gamma = (np.radians(np.asarray(table[f"{a}_deg"], float)) for a in ("beta", "gamma"))
    return beta, gamma


def alpha_columns(table: Columns, quantity: str = "") -> tuple[FloatArray, FloatArray]:
    """alpha_z and alpha_x of the n cells of an alpha table, N/cm^3, or a quantity of both: see `QUANTITIES`."""
    of_z, of_x = (np.asarray(table[column(c, quantity)], float) for c in COMPONENTS)
    return of_z, of_x


def flagged(table: pd.DataFrame) -> BoolArray:
    """True for cells with alpha whose column ``flagged`` is true, shape (n,); False in a table without that column.

    `with_flagged` makes the column: alpha comes from nonlinear stress or from too few depths.
    """
    if "flagged" not in table:
        return np.zeros(len(table), dtype=bool)
    weak: BoolArray = table["flagged"].to_numpy(bool)
    return np.isfinite(alpha_columns(table)[0]) & weak


def flags_of_cells(alpha: pd.DataFrame, flags: Flags, depths: int) -> list[Remark]:
    """Return doubts about cells of an alpha table that concern no single run: runs of two plates, or few depths.

    `flags`: Flags of the runs.
    `depths`: Number of depths that a level cell should have.
    """
    cell_flags = []
    plates = flags.runs_with("several-plates")
    for cell in alpha.to_dict("records"):
        direction = float(cell["beta_deg"]), float(cell["gamma_deg"])
        runs = cell["run_ids"].split()
        pooled = dict.fromkeys(flag.values["plate"] for run, flag in plates.items() if run in runs)
        if len(pooled) > 1:
            cell_flags.append(remark("pooled-plates", direction, plates=", ".join(pooled)))
        n_depths = cell["n_depths"]
        if 2 <= n_depths < depths:
            cell_flags.append(remark("few-depths", direction, found=n_depths, wanted=depths))
    return cell_flags


def with_flagged(alpha: pd.DataFrame, flags: Flags) -> pd.DataFrame:
    """Add the column `flagged` to an alpha table: True for cells that `fit.flagged` of the config may leave out.

    These have a flag that is marked as weak in `FLAGS`: their own one, or that of one of their runs. `flags`: of both.
    """
    weak = [
        any(FLAGS[flag.code].weak for flag in flags.of_cell(cell))
        for cell in alpha.to_dict("records")
    ]
    return alpha.assign(flagged=np.array(weak, dtype=bool))


def window_of(table: Columns) -> tuple[float, float]:
    """Least and greatest depth behind an alpha table, cm; 0 and infinity where the table does not state them.

    Forces at other depths are beyond what was measured.
    """
    depths_from, depths_to = (
        np.asarray(table.get(name, []), float) for name in ("depth_from_cm", "depth_to_cm")
    )
    least = np.fmin.reduce(depths_from, initial=math.nan)
    greatest = np.fmax.reduce(depths_to, initial=math.nan)
    return (
        0.0 if math.isnan(least) else float(least),
        math.inf if math.isnan(greatest) else float(greatest),
    )


def rows_at(
    table: Columns, beta_deg: npt.ArrayLike, gamma_deg: npt.ArrayLike, tolerance_deg: float
) -> IndexArray:
    """Index of the row of an alpha table that is nearest to each direction, shape (k,); -1 where none is the same.

    `tolerance_deg`: Tolerance of angles of the campaign's grid.
    """
    directions = np.broadcast_arrays(np.atleast_1d(beta_deg), np.atleast_1d(gamma_deg))
    beta, gamma = (np.asarray(table[name], float) for name in ("beta_deg", "gamma_deg"))
    if not beta.size:
        return np.full(directions[0].shape, -1)
    distance_deg = angle_apart(beta, gamma, directions[0][:, None], directions[1][:, None])
    nearest = distance_deg.argmin(axis=1)
    is_same = same_direction(
        beta[nearest], gamma[nearest], directions[0], directions[1], tolerance_deg
    )
    return np.where(is_same, nearest, -1)


def cell_at(
    table: pd.DataFrame, beta_deg: float, gamma_deg: float, tolerance_deg: float
) -> pd.Series[Any] | None:
    """Row of an alpha table for one direction, degrees; None where it has none. `tolerance_deg`: see `rows_at`."""
    row = int(rows_at(table, beta_deg, gamma_deg, tolerance_deg)[0])
    return None if row < 0 else table.iloc[row]


def cell_down(table: pd.DataFrame, tolerance_deg: float) -> pd.Series[Any] | None:
    """Row of an alpha table for a level plate that is pushed straight down, (0, 90) deg; None where it has none.

    Size, zeta and the scatter of beds of a medium are judged by this direction.
    """
    return cell_at(table, 0, 90, tolerance_deg)


def spread_of_next_bed(table: pd.DataFrame, tolerance_deg: float, confidence: float) -> float:
    """Relative spread by which the interval of the next push is wider than that of the mean; 0 without repeats.

    It is that of alpha_z(0, 90 deg): sqrt(w_next^2 - w_mean^2) / (q alpha), with the half widths w of both intervals
    and q the normal quantile of `confidence`, so that other modules widen an interval again by q times this number. Of
    few repeats it is larger than their scatter, as their intervals are by Student's t.
    """
    cell = cell_down(table, tolerance_deg)
    if cell is None or not (cell["n_runs"] > 1 and cell[column("z")] > 0):
        return 0.0
    mean, next_bed = (
        (cell[column("z", f"_hi{suffix}")] - cell[column("z", f"_lo{suffix}")]) / 2
        for suffix in ("", "_next")
    )
    variance = next_bed**2 - mean**2
    if not variance > 0:
        return 0.0
    return float(math.sqrt(variance) / normal_quantile(confidence) / cell[column("z")])


def bed_spread(table: pd.DataFrame, tolerance_deg: float) -> float:
    """Relative standard deviation of forces from one prepared bed of a medium to the next; 0 where not known.

    A bed is looser or denser as a whole: its spread is that of alpha_z(0, 90 deg), relative.
    """
    cell = cell_down(table, tolerance_deg)
    if cell is None:
        return 0.0
    alpha, spread = float(cell[column("z")]), float(cell.get("run_to_run_z_N_per_cm3", 0.0))
    return spread / alpha if alpha > 0 and spread > 0 else 0.0
