"""From fits of runs to the table alpha(beta, gamma) of one medium, with the spread between runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.directions import (
    SAME_DEPTH_CM,
    TOLERANCE_DEG,
    angle_apart,
    number_depths,
    number_directions,
)
from rftfit.measure.errors import (
    AS_PREPARED,
    OF_CELL,
    REPEATS,
    SOURCES,
    USUAL_BED_SPREAD,
    Part,
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
from rftfit.measure.slopes import combine_dof

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
    """Combine the fits of one medium into its cells, one row each.

    Cells are the planned ones of the grid, or else the distinct directions of the runs. A cell with
    several runs gets their mean. Planned cells at beta = -90 and +90 degrees are one and the same plate
    and share their runs. A horizontal cell is the zero-intercept fit through the steady-state means at
    the depths of its runs, of which it should have `depths` (design section 2). The interval holds every
    error of `SOURCES`, which have columns of their own; column `spread` says where that of the beds comes
    from. That of the next push holds the noise, surface, angle and bed of one further run too. `errors` (what
    no log shows) and `surface` are of `errors_of`; default: none. `outliers`: alpha of outlying runs minus that
    of the others, z and x, N/cm^3: these runs are left out of the estimate of how beds differ, and the interval
    of their cell reaches the others. `shape`: of which a medium's alpha has the slopes where no cell is near;
    default: none, so that an angle has no error there.

    `law`: Law of stress against depth of the fits, which goes through the means of a horizontal cell too. A cell whose window
    does not hold the depth of the law is NaN.
    """
    from rftfit.campaign.config import ErrorSettings, Grid

    errors = errors or ErrorSettings(angle_deg=0, turn_deg=0, tare_percent=0, bed_percent=0)
    records = sorted(fits.to_dict("records"), key=lambda row: str(row["run_id"]))
    directions, runs_of_cells = _cells_of(records, grid or Grid())
    outliers = outliers or {}
    runs_without_outliers = [
        [run for run in runs if run["run_id"] not in outliers] for runs in runs_of_cells
    ]
    spread = spread_of_beds(_repeats(runs_without_outliers), errors.bed)
    cells = [
        _cell(runs_of_cell, gamma == 0, depths, law)
        for runs_of_cell, (_, gamma) in zip(runs_of_cells, directions, strict=True)
    ]
    numbers_of_cells = _errors(
        cells, directions, errors, surface or SurfaceError(), spread, confidence, outliers, shape
    )
    rows = []
    for (beta, gamma), cell, numbers in zip(directions, cells, numbers_of_cells, strict=True):
        cell_keys = {"medium": medium, "beta_deg": beta, "gamma_deg": gamma}
        rows.append(cell_keys | numbers | cell.columns)
    # no plate run at all: the columns of a table all the same
    columns = ["medium", "beta_deg", "gamma_deg", *_NUMBERS, *_BEDS, *_WORDS]
    return pd.DataFrame(rows, columns=columns)


QUANTITIES = ("", "_se", "_lo", "_hi", "_lo_next", "_hi_next")
"""Of a component: alpha, the mean of the medium, its standard error and interval, and where the next push will fall."""


N_REPEATS = "n_repeats"
"""Column of the fits of a table of alpha: how many runs a row is the mean of; a log is one run."""


def column(component: str, quantity: str = "") -> str:
    """Name of a column of alpha: component ``z`` or ``x``, one of `QUANTITIES`."""
    return f"alpha_{component}{quantity}_N_per_cm3"


def _cells_of(records: list[Row], grid: Grid) -> tuple[list[tuple[float, float]], list[list[Row]]]:
    """Return the planned cells, or else the distinct directions of the runs by beta, then gamma, and the runs of each."""
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


def _repeats(cells: list[list[Row]]) -> list[tuple[FloatArray, FloatArray]]:
    """Alpha and its error, z and x, shape (2, runs), of the runs of each cell, and of each depth where they are horizontal.

    Runs of a cell that is planned twice, at beta = -90 and 90 degrees, count once.
    """
    counted_run_ids: set[str] = set()
    groups = []
    for runs in cells:
        new_runs = [
            run
            for run in runs
            if any(math.isfinite(run[column(c)]) for c in COMPONENTS)
            and run["run_id"] not in counted_run_ids
        ]
        counted_run_ids.update(str(run["run_id"]) for run in new_runs)
        level = new_runs and new_runs[0]["gamma_deg"] == 0
        runs_of_depths = (
            _by_depth(new_runs)
            if level and math.isfinite(new_runs[0]["depth_from_cm"])
            else [new_runs]
        )
        for runs_at_depth in filter(None, runs_of_depths):
            alpha = _array_of(runs_at_depth, "")
            groups.append((alpha, np.sqrt(_variance_between(runs_at_depth))))
    return groups


def _variance_between(runs: list[Row]) -> FloatArray:
    """Variance by which errors that the logs show let runs of one direction differ, (N/cm^3)^2, shape (2, runs)."""
    shares_tare = len({run.get("tare_run", "") for run in runs}) < len(runs)
    # a tare and a clock that they share and a curvature that they have alike do not make them differ
    return _variance_without(runs, ("_tare", "_curvature") if shares_tare else ("_curvature",))


def _variance_without(runs: list[Row], errors: Sequence[str]) -> FloatArray:
    """Variance of each run without some of its errors and that of its clock, (N/cm^3)^2, shape (2, runs)."""
    variance = _array_of(runs, "_se") ** 2
    for error in errors:
        variance -= _array_of(runs, error) ** 2
    clock = np.array([[_moved_by_clock(run, c) for run in runs] for c in COMPONENTS])
    return np.asarray(np.maximum(variance - clock**2, 0.0))


def _array_of(runs: list[Row], quantity: str) -> FloatArray:
    """A quantity of alpha, z and x, shape (2, runs); 0 where a table does not have it."""
    return np.array(
        [[run.get(column(c, quantity), 0.0) for run in runs] for c in COMPONENTS], float
    )


def _moved_by_clock(run: Row, component: str) -> float:
    """By how much the standard error of the clock that all runs of a session have in common moves alpha, N/cm^3."""
    lever = float(run.get("lever_per_cm", 0.0)) * float(run.get("clock_cm", 0.0))
    return float(run[column(component)]) * lever


def _by_depth(runs: list[Row]) -> list[list[Row]]:
    """Part horizontal runs by the depth they were made at; none is reached exactly."""
    ordered = sorted(runs, key=lambda row: float(row["depth_from_cm"]))
    level = number_depths(np.array([run["depth_from_cm"] for run in ordered], dtype=float))
    return [
        [run for run, level_of_run in zip(ordered, level, strict=True) if level_of_run == place]
        for place in np.unique(level)
    ]


@dataclass(frozen=True)
class _Cell:
    """The runs of one direction that give its alpha: the sum of `share` times that of each run.

    `level`: whether their means at several depths are fitted, as in horizontal runs; `line`: by a line through
    zero. `columns`: depths, runs and reasons.
    """

    runs: list[Row]
    share: FloatArray
    level: bool
    line: bool
    columns: dict[str, float | int | str]

    def sum(self, name: str) -> float:
        """What the runs have in a column, added up by their shares."""
        return float(self.share @ self.of(name))

    def of(self, name: str) -> FloatArray:
        """Column of the runs; 0 where it is absent."""
        return np.array([run.get(name, 0.0) for run in self.runs], dtype=float)


_NUMBERS = [column(c, q) for c in COMPONENTS for q in (*QUANTITIES, *(f"_{s}" for s in SOURCES))]
_BEDS = [f"run_to_run_{c}_N_per_cm3" for c in COMPONENTS]
_WORDS = [
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


def _cell(runs: list[Row], horizontal: bool, depths: int, law: DepthLaw) -> _Cell:
    good = [run for run in runs if math.isfinite(run[column("z")])]
    # a table may hold the stress at all depths of a level motion as one run
    horizontal &= all(run.get("direction", "horizontal") == "horizontal" for run in good)
    reasons = [why for run in runs for why in attach_run(run["run_id"], reason_of(run))]
    n_depths = len(_by_depth(good)) if horizontal else depths
    used_runs = good
    if not runs:
        reasons.append(remark("no-run"))
    elif good and n_depths < 2 <= depths:
        # one depth cannot show that stress is proportional to depth
        reasons.append(remark("too-few-depths", found=n_depths, wanted=depths))
        used_runs = []
    elif good and horizontal and not any(run["depth_to_cm"] for run in good):
        reasons.append(remark("zero-depths"))
        used_runs = []
    from_to = [
        [run.get(f"depth_{end}_cm", math.nan) for run in used_runs] for end in ("from", "to")
    ]
    top, deep = min(from_to[0], default=math.nan), max(from_to[1], default=math.nan)
    holds_depth = top - SAME_DEPTH_CM <= law.at_cm <= deep + SAME_DEPTH_CM
    if used_runs and math.isfinite(law.at_cm) and not holds_depth:
        reasons.append(remark("outside-window", at=law.at_cm, top=top, deep=deep))
        used_runs = []
    share = np.full(len(used_runs), 1 / max(len(used_runs), 1))
    if horizontal:
        depth = np.array([(run["depth_from_cm"] + run["depth_to_cm"]) / 2 for run in used_runs])
        alpha = np.array([[run[column(c)] for run in used_runs] for c in COMPONENTS])
        larger = alpha[int(np.square(alpha).sum(axis=1).argmax())]
        # one depth tells no other law, but the mean that is looked for
        if used_runs and (n_depths > 1 or law.name == "through_zero"):
            share = law.shares(depth, larger * depth)
    tares = dict.fromkeys(str(run.get("tare_run", "")) for run in used_runs)
    columns = {
        "depth_from_cm": top,
        "depth_to_cm": deep,
        "n_runs": len(good),
        "n_depths": n_depths if good and horizontal else 0,
        "run_ids": " ".join(run["run_id"] for run in good),
        "lost_run_ids": " ".join(
            run["run_id"] for run in runs if not math.isfinite(run[column("z")])
        ),
        "tare_runs": " ".join(filter(None, tares)),
    }
    columns |= mark_columns() | reason_columns(reasons)
    return _Cell(used_runs, share, horizontal, law.name == "through_zero", columns)


def _errors(
    cells: list[_Cell],
    directions: list[tuple[float, float]],
    errors: ErrorSettings,
    surface: SurfaceError,
    spread: Spread,
    confidence: float,
    outliers: Mapping[str, tuple[float, float]],
    shape: Slopes | None,
) -> list[dict[str, float | str]]:
    """Alpha of each cell with its errors by name, the interval that holds them all, and that of the next push."""
    alpha = {
        c: np.array([cell.sum(column(c)) if cell.runs else math.nan for cell in cells])
        for c in COMPONENTS
    }
    beta, gamma = np.array(directions, dtype=float).reshape(-1, 2).T
    both_alpha = np.stack([alpha[c] for c in COMPONENTS])
    elsewhere = scaled_slopes(shape, beta, gamma, both_alpha)
    rise = {
        c: np.hypot(*gradient(beta, gamma, alpha[c], slopes).T)
        for c, slopes in zip(COMPONENTS, elsewhere, strict=True)
    }
    rows: list[dict[str, float | str]] = []
    for i, cell in enumerate(cells):
        row: dict[str, float | str] = dict.fromkeys([*_NUMBERS, *_BEDS], math.nan)
        rows.append(row | {"spread": spread.source})
        if not cell.runs:
            continue
        side = float(cell.share @ np.where(cell.of("mirrored"), -1.0, 1.0) / cell.share.sum())
        # where x was not measured, it is taken to be as large as z
        across = alpha["z"][i] if math.isnan(alpha["x"][i]) else alpha["x"][i]
        turned = {"z": -side * across, "x": side * alpha["z"][i]}
        for component, c in enumerate(COMPONENTS):
            bed_error = spread.error_at(both_alpha[:, i], component)
            of_mean = _of_runs(cell, c, surface, bed_error)
            # the mean of independent errors is smaller than each of them
            mean_factor = math.sqrt(float(cell.share @ cell.share))
            angle = float(rise[c][i]) * errors.angle_deg
            of_mean["angle"] = Part(angle * mean_factor)
            lever = math.sqrt(float(np.mean(cell.of("lever_per_cm") ** 2)))
            of_next: dict[Source, Part] = {
                "surface": Part(surface.run * abs(alpha[c][i]) * lever, surface.dof),
                "angle": Part(angle),
            }
            of_mean["turn"] = Part(turned[c] * math.radians(errors.turn_deg))
            of_mean["rod"] = Part(cell.sum(column(c, "_rod")) * errors.tare_percent / 100)
            source = _add_bed(of_mean, of_next, cell, c, bed_error, spread.source, confidence)
            outlier_offsets = [
                outliers.get(str(run["run_id"]), (0.0, 0.0))["zx".index(c)] for run in cell.runs
            ]
            of_outliers = _outlier_errors(cell, c, np.array(outlier_offsets))
            for parts, of_outlier in zip((of_mean, of_next), of_outliers, strict=True):
                bed_errors = parts["bed"], of_outlier
                parts["bed"] = max(
                    bed_errors, key=lambda error: combined_half_width([error], confidence)
                )
            half_of_mean = combined_half_width(of_mean.values(), confidence)
            # what all runs share is in the errors of the mean, and counts once
            half_of_next = combined_half_width([*of_mean.values(), *of_next.values()], confidence)
            se = math.sqrt(sum(error.sd**2 for error in of_mean.values()))
            ends = (
                alpha[c][i] + width
                for width in (-half_of_mean, half_of_mean, -half_of_next, half_of_next)
            )
            values = (alpha[c][i], se, *ends)
            row = {column(c, q): value for q, value in zip(QUANTITIES, values, strict=True)}
            row |= {column(c, f"_{name}"): error.sd for name, error in of_mean.items()}
            if spread.source != AS_PREPARED:
                row[f"run_to_run_{c}_N_per_cm3"] = bed_error.sd
            known_from = OF_CELL if OF_CELL in (source, rows[-1]["spread"]) else source
            rows[-1] |= row | {"spread": known_from}
    return rows


def _outlier_errors(cell: _Cell, c: str, outlier_offsets: FloatArray) -> tuple[Part, Part]:
    """Errors of a cell with outlying runs, of its mean and of the next push beside that.

    The scatter of its repeats, or the `outlier_offsets` of these runs, which the error of the mean holds.
    """
    n = len(cell.runs)
    if outlier_offsets.any() and n > 2 and not cell.level:
        scatter = float(cell.of(column(c)).std(ddof=1))
        return Part(scatter / math.sqrt(n), n - 1.0), Part(scatter, n - 1.0)
    return Part(float(np.abs(cell.share @ outlier_offsets)) / _REACH), Part(0.0)


_REACH = 1.96
"""Standard errors to the end of an interval of 95 %."""


def _of_runs(cell: _Cell, c: str, surface: SurfaceError, bed_error: Part) -> dict[Source, Part]:
    """Errors that the logs show, and those of surface and tare, of one component."""
    alpha, se, dof = cell.of(column(c)), cell.of(column(c, "_se")), cell.of(f"alpha_{c}_dof")
    startup, tare, curvature = (
        cell.of(column(c, f"_{name}")) for name in ("startup", "tare", "curvature")
    )
    noise_variances = _noise_variance(cell, c) * cell.share**2
    # runs that share a tare err alike, each to its own side
    signed = np.where((c == "x") & (cell.of("mirrored") != 0), -1.0, 1.0) * cell.share * tare
    names = np.array([str(run.get("tare_run", "")) for run in cell.runs])
    of_tares = [float(signed[names == name].sum()) for name in dict.fromkeys(names)]
    moved = cell.share * alpha * cell.of("lever_per_cm")
    signs = 1.0 if sum(of_tares) >= 0 else -1.0
    return {
        "noise": Part(
            math.sqrt(float(noise_variances.sum())), float(combine_dof(noise_variances, dof))
        ),
        # a start-up moves all depths the same way, so its parts add up before they are squared
        "startup": Part(float(cell.share @ startup)),
        "tare": Part(signs * math.hypot(*of_tares)),
        "surface": Part(surface.run * float(np.sqrt(moved @ moved)), surface.dof),
        "session": _of_session(surface.session * float(moved.sum()), _of_clocks(cell, c)),
        "curvature": Part(float(cell.share @ curvature) + _over_depths(cell, alpha, se, bed_error)),
    }


def _of_clocks(cell: _Cell, c: str) -> float:
    """By how much the common error of the clocks moves a cell, N/cm^3: not less for more runs."""
    return float(cell.share @ np.array([_moved_by_clock(run, c) for run in cell.runs]))


def _of_session(surface: float, clocks: float) -> Part:
    """Error of surface and clocks of a session, N/cm^3, with the sign of the larger one."""
    if not clocks:
        return Part(surface)
    return Part(math.copysign(math.hypot(surface, clocks), surface + clocks))


def _noise_variance(cell: _Cell, c: str) -> FloatArray:
    """Variance of the noise of each run, (N/cm^3)^2: its standard error without start-up, tare, curvature and session."""
    variance = _variance_without(cell.runs, ("_startup", "_tare", "_curvature"))
    return np.asarray(variance["zx".index(c)])


def _noise_of_next(cell: _Cell, c: str, *, scatter: bool) -> Part:
    """Noise of one further run like those of the cell; `scatter`: beyond what these runs differ by.

    A row of a table may be the mean of several runs, of which one has more noise.
    """
    variance = _noise_variance(cell, c) * (_runs_behind(cell) - scatter)
    # the shares add up to 1, but where stress over depth depends on depth
    sd = float(cell.share.sum()) * math.sqrt(float(variance.mean()))
    return Part(sd, float(combine_dof(variance, cell.of(f"alpha_{c}_dof"))))


def _runs_behind(cell: _Cell) -> FloatArray:
    """How many runs each row of fits is the mean of: a table of alpha may state it."""
    return np.array([run.get(N_REPEATS, 1.0) for run in cell.runs], dtype=float)


def _over_depths(cell: _Cell, alpha: FloatArray, se: FloatArray, bed_error: Part) -> float:
    """By how much the deepest level runs leave the line through zero, where that is no scatter."""
    if not (cell.level and cell.line) or alpha.size < 3:
        return 0.0
    mean = float(cell.share @ alpha)
    deviation, noise = alpha - mean, np.hypot(se, bed_error.sd)
    if (np.abs(deviation) <= _SIGMAS * noise).all():
        return 0.0
    # the share grows with the square of the depth
    return float(np.abs(deviation[cell.share.argmax()])) / math.sqrt(3)


_SIGMAS = 3.0


def _add_bed(
    of_mean: dict[Source, Part],
    of_next: dict[Source, Part],
    cell: _Cell,
    c: str,
    bed_error: Part,
    known_from: str,
    confidence: float,
) -> str:
    """Add how beds differ to the errors of the mean and of one further run, and return where that is known from.

    Repeats differ by the errors of their surface and angles too, so these are not added to what repeats
    show; the wider of both counts.
    """
    alpha, noise = cell.of(column(c)), of_mean["noise"]
    of_mean["noise"], of_mean["bed"], source = bed_of_mean(
        alpha, cell.share, noise, bed_error, known_from, shown_by_runs=not cell.level
    )
    scatter = source == OF_CELL and of_mean["noise"] != noise
    of_next["noise"] = _noise_of_next(cell, c, scatter=scatter)
    if known_from == AS_PREPARED:
        # also where an interval does not include the scatter between beds, the next bed is another
        bed_error = Part(USUAL_BED_SPREAD * abs(float(cell.share @ alpha)))
    of_next["bed"] = bed_of_next(alpha, bed_error, confidence, scatter=scatter)
    if known_from == AS_PREPARED and not scatter and (_runs_behind(cell) > 1).all():
        # several runs stand behind each row, and what these differ by holds their beds
        of_next["bed"] = Part(0.0)
    if source in (REPEATS, OF_CELL):
        for parts in (of_mean, of_next):
            half_square = combined_half_width([parts["bed"]], confidence) ** 2
            half_square -= combined_half_width([parts["surface"], parts["angle"]], confidence) ** 2
            unit = combined_half_width([Part(1.0, parts["bed"].dof)], confidence)
            parts["bed"] = Part(math.sqrt(max(half_square, 0.0)) / unit, parts["bed"].dof)
    return source


Columns: TypeAlias = "pd.DataFrame | Mapping[Any, npt.ArrayLike]"
"""An alpha table, or its columns by name."""


def directions(table: Columns) -> tuple[FloatArray, FloatArray]:
    """Beta and gamma of the cells of an alpha table, rad, shape (n,)."""
    beta, gamma = (np.radians(np.asarray(table[f"{a}_deg"], float)) for a in ("beta", "gamma"))
    return beta, gamma


def alpha_columns(table: Columns) -> tuple[FloatArray, FloatArray]:
    """alpha_z and alpha_x of the cells of an alpha table, N/cm^3, shape (n,)."""
    alpha_z, alpha_x = (np.asarray(table[column(c)], float) for c in COMPONENTS)
    return alpha_z, alpha_x


def flagged(table: pd.DataFrame) -> npt.NDArray[np.bool_]:
    """Cells whose alpha comes from nonlinear stress or from too few depths, shape (n,); none of a bare table."""
    if "flagged" not in table:
        return np.zeros(len(table), dtype=bool)
    weak: npt.NDArray[np.bool_] = table["flagged"].to_numpy(bool)
    return np.isfinite(alpha_columns(table)[0]) & weak


def flags_of_cells(alpha: pd.DataFrame, flags: Flags, depths: int) -> list[Remark]:
    """Doubts about cells of an alpha table that are about none of its runs.

    `flags`: Of the runs. `depths`: As of `alpha_table`.
    """
    of_cells = []
    plates = flags.runs_with("several-plates")
    for cell in alpha.to_dict("records"):
        direction = float(cell["beta_deg"]), float(cell["gamma_deg"])
        runs = cell["run_ids"].split()
        pooled = dict.fromkeys(flag.values["plate"] for run, flag in plates.items() if run in runs)
        if len(pooled) > 1:
            of_cells.append(remark("pooled-plates", direction, plates=", ".join(pooled)))
        if 2 <= cell["n_depths"] < depths:
            of_cells.append(remark("few-depths", direction, found=cell["n_depths"], wanted=depths))
    return of_cells


def with_flagged(alpha: pd.DataFrame, flags: Flags) -> pd.DataFrame:
    """Add the column `flagged` to an alpha table: whether `fit.flagged` can leave out a cell."""
    weak = [
        any(FLAGS[flag.code].weak for flag in flags.of_cell(cell))
        for cell in alpha.to_dict("records")
    ]
    return alpha.assign(flagged=np.array(weak, dtype=bool))


def window_of(table: Columns) -> tuple[float, float]:
    """Least and greatest depth behind an alpha table, cm; any where it does not say."""
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
    table: Columns, beta_deg: npt.ArrayLike, gamma_deg: npt.ArrayLike
) -> npt.NDArray[np.intp]:
    """Row of an alpha table that is nearest to each direction, shape (k,); -1: none is near."""
    directions = np.broadcast_arrays(np.atleast_1d(beta_deg), np.atleast_1d(gamma_deg))
    beta, gamma = (np.asarray(table[name], float) for name in ("beta_deg", "gamma_deg"))
    if not beta.size:
        return np.full(directions[0].shape, -1)
    distance_deg = angle_apart(beta, gamma, directions[0][:, None], directions[1][:, None])
    return np.where(distance_deg.min(axis=1) <= TOLERANCE_DEG, distance_deg.argmin(axis=1), -1)


def cell_at(table: pd.DataFrame, beta_deg: float, gamma_deg: float) -> pd.Series[Any] | None:
    """Row of an alpha table for one direction; None where it has none."""
    row = int(rows_at(table, beta_deg, gamma_deg)[0])
    return None if row < 0 else table.iloc[row]


def bed_spread(table: pd.DataFrame) -> float:
    """Relative spread of forces from one prepared bed of a medium to the next; 0 where not known.

    A bed is looser or denser as a whole: its spread is that of alpha_z(0, 90 deg), relative.
    """
    cell = cell_at(table, 0, 90)
    if cell is None:
        return 0.0
    alpha, spread = float(cell[column("z")]), float(cell.get("run_to_run_z_N_per_cm3", 0.0))
    return spread / alpha if alpha > 0 and spread > 0 else 0.0
