"""Samples of plate runs for figures: stress with the sign in which it is filed, thinned curves, a run with its fit.

Stress is tared force on the plate over the area of one face, N/cm^2. A run may be filed in the tables as its mirror
image, with beta, gamma and the sign of its horizontal stress turned (`rftfit.conventions.file_extraction`). The window
of a run is the range of depth (of path, for a horizontal run) whose samples were fitted.

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run).

A `Remark` is a flag (a doubt about a run that is used all the same) or a reason why a number is missing: a code with
numbers, which becomes a sentence. `c` or `component`: ``z`` (vertical) or ``x`` (horizontal).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures.style import COMPONENT_COLOURS, PER_CM3, WINDOW, format_number, ticks, zero_line
from rftfit.measure.alpha import column
from rftfit.measure.flags import Flags, Remark, format_remarks, reason_of
from rftfit.measure.lab_frame import measures_force_x
from rftfit.measure.ledger import RowStatus
from rftfit.model.draws import end_names

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Mapping

    import pandas as pd
    from matplotlib.axes import Axes

    from rftfit.campaign.load import Campaign
    from rftfit.conventions import FloatArray
    from rftfit.results import Results

    Row = Mapping[Hashable, Any]
    """Row of a table as a dict: column to cell."""
    Trace = dict[str, FloatArray]
    """Samples of one run by column."""

DIRECTIONS = ("extraction", "horizontal", "intrusion")
"""Directions of plate runs, in the order of their filed gamma: negative, zero, positive."""

SAMPLES = (
    "depth_cm",
    "path_cm",
    "stress_z_N_per_cm2",
    "stress_x_N_per_cm2",
    "tare_z_N_per_cm2",
    "tare_x_N_per_cm2",
    "in_window",
)
"""Columns of `stress_samples` besides ``run_id``: depth and path from the begin of the stroke, stress of the medium on
the plate, the subtracted tare as a stress, and 1 inside the window of the fit."""


STRESS_SETTINGS = ("intruders", "force_log", "transducer")
"""Sections of the configuration that `stress_of` reads."""


def stress_of(results: Results, medium: str) -> pd.DataFrame:
    """Read the tables of samples of a medium, and compute its `stress_samples`."""
    tared, windows = (results.table(f"{name}/{medium}.parquet") for name in ("tared", "windows"))
    return stress_samples(results.campaign, tared, windows, results[medium].fits)


def stress_samples(
    campaign: Campaign, tared: pd.DataFrame, windows: pd.DataFrame, fits: pd.DataFrame
) -> pd.DataFrame:
    """Compute the stress of every plate run of a medium, a row a sample, with the sign in which alpha is filed in `fits`.

    `tared`, `windows`: Tables of samples after the tare and after the fit, with the same rows. `fits`: A row for each
    run; ``mirrored`` is True for a run that was filed with its horizontal stress turned. Returns ``run_id`` and the
    columns `SAMPLES`. Stress along x is NaN where no sensor measured it.
    """
    import pandas as pd

    ids = tared["run_id"].astype("category")
    # text, also where a lab names its runs by numbers
    ids = ids.cat.rename_categories([str(name) for name in ids.cat.categories])
    runs = [campaign.by_id[run_id] for run_id in ids.cat.categories]
    # legs have no area and are not drawn here
    # areas and signs by run, then by sample
    areas = [getattr(campaign.config.intruders[run.intruder], "area_cm2", np.nan) for run in runs]
    # a channel that the config states as a constant shows no force
    signs_x = [1.0 if measures_force_x(campaign.config, run) else np.nan for run in runs]
    area, sign_x = np.array([areas, signs_x], dtype=float)[:, ids.cat.codes.to_numpy()]
    # extractions are filed with their horizontal stress turned, as alpha_x is
    turned = fits.loc[fits["mirrored"].astype(bool), "run_id"].astype(str)
    signs = {"z": 1.0, "x": np.where(ids.isin(turned), -sign_x, sign_x)}
    samples = pd.DataFrame({"run_id": ids} | {name: tared[name] for name in SAMPLES[:2]})
    for quantity, force in (("stress", "force"), ("tare", "tare")):
        for c, sign in signs.items():
            samples[f"{quantity}_{c}_N_per_cm2"] = tared[f"{force}_{c}_N"] / area * sign
    samples["in_window"] = windows["why"].to_numpy() == RowStatus.GOOD
    plates: pd.DataFrame = samples[np.isfinite(area)]
    return plates


def by_run(samples: pd.DataFrame) -> dict[str, Trace]:
    """Split `stress_samples` by run: the columns `SAMPLES` of each run as arrays, by run_id."""
    return {
        str(run_id): {name: rows[name].to_numpy(float) for name in SAMPLES}
        for run_id, rows in samples.groupby("run_id", observed=True)
    }


def thin(x: FloatArray, y: FloatArray, points: int = 80) -> list[FloatArray]:
    """Thin a curve to about `points` points at most: the smallest and the largest y of each bin of successive samples.

    Extremes, unlike every n-th sample, keep spikes and the width of the noise. Returns polylines, shape (m, 2), one for
    each part of the curve between missing samples.
    """
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not finite.size:
        return []
    lines = []
    # `samples`: indices of one part of the curve; two successive finite samples with others between are in two parts
    for samples in np.split(finite, np.flatnonzero(np.diff(finite) > 1) + 1):
        # a bin keeps two points; each part gets its share of them by its length
        bins = max(1, points * samples.size // (2 * finite.size))
        kept = samples
        if samples.size > 2 * bins:
            width = samples.size // bins
            bins = samples.size // width  # so that fewer samples than a bin are left over
            by_bin = samples[: bins * width].reshape(bins, width)
            rows = np.arange(bins)
            extremes = (by_bin[rows, of(y[by_bin], axis=1)] for of in (np.argmin, np.argmax))
            ends = samples[:1], samples[-1:]
            kept = np.unique(np.concatenate([*extremes, samples[bins * width :], *ends]))
        lines.append(np.column_stack([x[kept], y[kept]]))
    return lines


def draw_thin(
    axes: Axes, x: FloatArray, y: FloatArray, points: int = 400, **properties: Any
) -> None:
    """Draw a curve thinned to about `points` points: a run has more samples than a panel has pixels.

    Each part between gaps is a line of its own. `properties`: Of matplotlib's lines.
    """
    for line in thin(x, y, points):
        axes.plot(*line.T, **properties)


def round_up_125(value: float) -> float:
    """Round a positive value up to 1, 2 or 5 times a power of ten."""
    decade = 10.0 ** np.floor(np.log10(value))
    # 0.999: a value that is above a step by rounding alone stays there
    return float(next(step * decade for step in (1, 2, 5, 10) if step * decade >= 0.999 * value))


def panel_limits(trace: Trace) -> tuple[float, float]:
    """Choose the range of stress of a panel, N/cm^2: round numbers, the smaller side at least a fifth of the larger.

    `trace`: Of one run; its stress and tare count.
    """
    stresses = np.concatenate([trace[name] for name in trace if name.endswith("_N_per_cm2")])
    stresses = stresses[np.isfinite(stresses)]
    sides = -stresses.min(initial=0), stresses.max(initial=0)
    low, high = (round_up_125(max(side, 1e-3)) for side in sides)
    # a range below 0.05 N/cm^2 would fill the panel with noise
    largest = max(low, high, 0.05)
    return (-max(low, largest / 5), largest) if high >= low else (-largest, max(high, largest / 5))


def with_end_names(quantity: str) -> list[str]:
    """Name the columns of a quantity, such as ``force_z_N``, and of the ends of its interval."""
    return [quantity, *end_names(quantity)]


def alpha_with_interval(row: Row, component: str) -> tuple[float, float, float]:
    """Return alpha in a row of the table of fits or of alpha, and the ends of its interval, N/cm^3; `component`: z or x."""
    value, low, high = (float(row[name]) for name in with_end_names(column(component)))
    return value, low, high


def measures_x(trace: Trace) -> bool:
    """Return True if a run has stress along x; True also without samples: nothing says that x was not measured."""
    return not trace or bool(np.isfinite(trace["stress_x_N_per_cm2"]).any())


def draw_run(axes: Axes, trace: Trace, fit: Row) -> None:
    """Draw the stress of a run with the lines of its fit and its shaded window, over depth or, of a level run, over its path.

    `fit`: Its row of the table of fits. The line of a fit is alpha times depth: through zero, or level at a single
    depth.
    """
    is_level = fit["direction"] == "horizontal"
    along = trace["path_cm" if is_level else "depth_cm"]
    window = along[(trace["in_window"] > 0) & np.isfinite(along)]
    if window.size:
        axes.axvspan(window.min(), window.max(), color=WINDOW, linewidth=0)
    zero_line(axes)
    for c, dashes in (("z", "-"), ("x", "--")):
        # samples before the stroke or above the surface are not drawn
        stress = np.where(along >= 0, trace[f"stress_{c}_N_per_cm2"], np.nan)
        draw_thin(axes, along, stress, color=COMPONENT_COLOURS[c], linewidth=0.6, alpha=0.75)
        alpha, *_ = alpha_with_interval(fit, c)
        if window.size and np.isfinite(alpha) and (c == "z" or measures_x(trace)):
            ends = depths = np.array([0.0, np.nanmax(along)])
            if is_level:
                # it stays at one depth, so the line of its fit is level
                ends = np.array([window.min(), window.max()])
                depths = np.full(2, np.nanmean(trace["depth_cm"]))
            axes.plot(ends, alpha * depths, dashes, color="black")
    axes.set_xlim(0, None)
    ticks(axes.xaxis, 5, integer=True)


def cell_of_run(alpha: pd.DataFrame, run_id: str) -> Row:
    """Find the row of a table of alpha to which a run belongs (column ``run_ids``); empty where it belongs to none."""
    holds_run = [run_id in str(names).split() for names in alpha["run_ids"]]
    return next(iter(alpha[holds_run].to_dict("records")), {})


def describe_alpha(row: Row, component: str, trace: Trace, cell: Row) -> str:
    """Write alpha of a run with symbol and interval as in the tables, or that it is 0 by symmetry or was not measured.

    `row`: Row of the run in the table of fits. `trace`: Samples of the run. `cell`: Row of `cell_of_run`; the interval
    is its interval, which holds more errors than one log shows. Where the cell is the mean of several runs, two lines
    are written: alpha of this run, whose line is drawn, and the mean with its interval.
    """
    symbol = rf"$\alpha_{component}$"
    # how many runs the cell is the mean of
    runs = int(cell["n_runs"]) if cell else 1
    alpha, low, high = alpha_with_interval(cell or row, component)
    if component == "x" and not measures_x(trace):
        return f"{symbol} = 0 by symmetry" if np.isfinite(alpha) else f"{symbol} not measured"
    half_width = ""
    if cell and np.isfinite(high - low):
        half_width = f" \N{PLUS-MINUS SIGN} {format_number((high - low) / 2, 4)}"
    with_unit = f"{format_number(alpha, 4)}{half_width} {PER_CM3}"
    if runs == 1:
        return f"{symbol} = {with_unit}"
    alpha_of_run = format_number(alpha_with_interval(row, component)[0], 4)
    return f"{symbol} = {alpha_of_run} {PER_CM3}\nmean of {runs} runs: {with_unit}"


def describe_problem(fit: Row, flags: Flags, shared: Collection[Remark]) -> str:
    """Say in few words what is wrong with a run; empty if nothing is.

    `fit`: Row of the run in the table of fits. `flags`: Flags of the medium. `shared`: Flags that all its runs have,
    which are left out.
    """
    run_id = str(fit["run_id"])
    flags_of_run = [flag for flag in flags.of_run(run_id) if flag not in shared]
    problem = format_remarks([*reason_of(fit), *flags_of_run, *flags.of_run_by_checks(run_id)])
    # a component that no sensor measured is not missing
    measured = "z" if run_id in flags.runs_with("no-force-x") else "zx"
    has_alpha = np.isfinite([fit[f"alpha_{c}_N_per_cm3"] for c in measured]).all()
    return problem or ("" if has_alpha else "no alpha")
