"""Samples of plate runs ready to be drawn: as stress, as filed, split at gaps, thinned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.figures.style import PER_CM3, format_number
from rftfit.measure.flags import Flags, Remark, format_remarks, reason_of
from rftfit.measure.lab_frame import measures_force_x
from rftfit.measure.ledger import RowStatus

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Mapping

    import pandas as pd
    from matplotlib.axes import Axes

    from rftfit.campaign.load import Campaign
    from rftfit.conventions import FloatArray
    from rftfit.results import Results

    Row = Mapping[Hashable, Any]
    Trace = dict[str, FloatArray]
    """Samples of one run by column."""

DIRECTIONS = ("extraction", "horizontal", "intrusion")
"""Directions of plate runs, in the order of their filed gamma."""

SAMPLES = (
    "depth_cm",
    "path_cm",
    "stress_z_N_per_cm2",
    "stress_x_N_per_cm2",
    "tare_z_N_per_cm2",
    "tare_x_N_per_cm2",
    "in_window",
)
"""Columns of `stress_samples` besides the run."""


STRESS_SETTINGS = ("intruders", "force_log", "transducer")
"""Sections of the configuration that `stress_of` reads."""


def stress_samples(
    campaign: Campaign, tared: pd.DataFrame, windows: pd.DataFrame, fits: pd.DataFrame
) -> pd.DataFrame:
    """Stress of every plate run of a medium as its alpha is filed in `fits`, and whether it was fitted.

    Stress along x is NaN where nothing measured it.
    """
    import pandas as pd

    ids = _run_ids(tared)
    intruders = [campaign.by_id[run].intruder for run in ids.cat.categories]
    # legs have no area and are not drawn here
    areas = [getattr(campaign.config.intruders[name], "area_cm2", np.nan) for name in intruders]
    area = np.array(areas, dtype=float)[ids.cat.codes.to_numpy()]
    # extractions are filed with their horizontal stress turned, as alpha_x is
    turned = fits.loc[fits["mirrored"].astype(bool), "run_id"].astype(str)
    unmeasured = [
        run
        for run in ids.cat.categories
        if not measures_force_x(campaign.config, campaign.by_id[run])
    ]
    # a channel that the config states as a constant shows no force
    measured_x = np.where(ids.isin(unmeasured), np.nan, 1.0)
    signs = {"z": 1.0, "x": np.where(ids.isin(turned), -1.0, 1.0) * measured_x}
    samples = pd.DataFrame(
        {
            "run_id": ids,
            "depth_cm": tared["depth_cm"],
            "path_cm": tared["path_cm"],
            **{
                f"{quantity}_{c}_N_per_cm2": tared[f"{column}_{c}_N"] / area * sign
                for quantity, column in (("stress", "force"), ("tare", "tare"))
                for c, sign in signs.items()
            },
            "in_window": windows["why"].to_numpy() == RowStatus.GOOD,
        }
    )
    plates: pd.DataFrame = samples[np.isfinite(area)]
    return plates


def stress_of(results: Results, medium: str) -> pd.DataFrame:
    """The `stress_samples` of a medium."""
    tared, windows = (results.table(f"{name}/{medium}.parquet") for name in ("tared", "windows"))
    return stress_samples(results.campaign, tared, windows, results[medium].fits)


def _run_ids(traces: pd.DataFrame) -> pd.Series[Any]:
    """Runs as categories, whatever the sheet named them: some number their runs."""
    ids = traces["run_id"].astype("category")
    return ids.cat.rename_categories([str(name) for name in ids.cat.categories])


def by_run(traces: pd.DataFrame) -> dict[str, Trace]:
    """Take `SAMPLES` of each run as arrays, by run and column."""
    if traces.empty:
        return {}
    ids = _run_ids(traces).cat.remove_unused_categories()
    code = ids.cat.codes.to_numpy()
    order = np.argsort(code, kind="stable")
    cuts = np.flatnonzero(np.diff(code[order])) + 1
    parts = [np.split(traces[name].to_numpy(float)[order], cuts) for name in SAMPLES]
    runs = zip(ids.cat.categories, *parts, strict=True)
    return {run: dict(zip(SAMPLES, samples, strict=True)) for run, *samples in runs}


def thin(x: FloatArray, y: FloatArray, points: int = 80) -> list[FloatArray]:
    """Polylines of at most about `points` points: smallest and largest sample of each stretch.

    Taking the extremes instead of every n-th sample keeps spikes and the width of the noise.
    Returns one array (m, 2) for each stretch between missing samples.
    """
    is_finite = np.isfinite(x) & np.isfinite(y)
    if not is_finite.any():
        return []
    place = np.flatnonzero(is_finite)
    lines = []
    for stretch in np.split(place, np.flatnonzero(np.diff(place) > 1) + 1):
        bins = max(1, points * stretch.size // (2 * place.size))
        if stretch.size > 2 * bins:
            width = stretch.size // bins
            bins = stretch.size // width  # so that less than one stretch is left over
            body = stretch[: bins * width].reshape(bins, width)
            rows = np.arange(bins)
            low = body[rows, y[body].argmin(axis=1)]
            high = body[rows, y[body].argmax(axis=1)]
            remainder = stretch[bins * width :]
            stretch = np.unique(np.concatenate([stretch[:1], low, high, remainder, stretch[-1:]]))  # noqa: PLW2901
        lines.append(np.column_stack([x[stretch], y[stretch]]))
    return lines


def draw_thin(
    axes: Axes, x: FloatArray, y: FloatArray, points: int = 400, **properties: Any
) -> None:
    """Draw a thinned curve: a run has more samples than a panel has dots."""
    for line in thin(x, y, points):
        axes.plot(*line.T, **properties)


def round_up_125(value: float) -> float:
    """Smallest of 1, 2 or 5 times a power of ten that is not below a positive value."""
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in (1, 2, 5, 10) if step * decade >= 0.999 * value))


def panel_limits(trace: Trace) -> tuple[float, float]:
    """Round stresses at the ends of a panel, N/cm^2, the smaller at least a fifth of the larger."""
    stresses = np.concatenate([trace[name] for name in trace if name.endswith("_N_per_cm2")])
    stresses = stresses[np.isfinite(stresses)]
    sides = -stresses.min(initial=0), stresses.max(initial=0)
    low, high = (round_up_125(max(side, 1e-3)) for side in sides)
    # less than 0.05 N/cm^2 would blow up mere noise
    largest = max(low, high, 0.05)
    return (-max(low, largest / 5), largest) if high >= low else (-largest, max(high, largest / 5))


def alpha_with_interval(row: Row, component: str) -> tuple[float, float, float]:
    """Alpha in a row of fits or cells with the ends of its interval, N/cm^3."""
    parts = (row[f"alpha_{component}_{end}N_per_cm3"] for end in ("", "lo_", "hi_"))
    value, low, high = map(float, parts)
    return value, low, high


def measures_x(trace: Trace) -> bool:
    """Whether the samples of a run have a stress along x; without samples nothing says that it was not measured."""
    return not trace or bool(np.isfinite(trace["stress_x_N_per_cm2"]).any())


def cell_of_run(alpha: pd.DataFrame, run_id: str) -> Row:
    """Row of a table of alpha that a run is part of; empty where it is part of none."""
    is_part = [run_id in str(names).split() for names in alpha["run_ids"]]
    return next(iter(alpha[is_part].to_dict("records")), {})


def describe_alpha(row: Row, component: str, trace: Trace, cell: Row) -> str:
    """Write alpha of a run with its symbol and interval as the tables have them, or why it is no number that a sensor gave.

    `row`: of the fits. `trace`: samples of the run. `cell`: `cell_of_run`; its interval holds more than one log shows.
    Of several runs in a direction alpha of this one, whose line is drawn, stands above their mean, which has the interval.
    """
    symbol = rf"$\alpha_{component}$"
    runs = int(cell["n_runs"]) if cell else 1
    value, low, high = alpha_with_interval(cell or row, component)
    if component == "x" and not measures_x(trace):
        return f"{symbol} = 0 by symmetry" if np.isfinite(value) else f"{symbol} not measured"
    text = format_number(value, 4)
    if cell and np.isfinite(high - low):
        text += f" \N{PLUS-MINUS SIGN} {format_number((high - low) / 2, 4)}"
    if runs == 1:
        return f"{symbol} = {text} {PER_CM3}"
    of_run = format_number(alpha_with_interval(row, component)[0], 4)
    return f"{symbol} = {of_run} {PER_CM3}\nmean of {runs} runs: {text} {PER_CM3}"


def problem_text(fit: Row, flags: Flags, shared: Collection[Remark] = ()) -> str:
    """Say what is wrong with a run, in few words; empty if nothing is but the `shared` flags."""
    run_id = str(fit["run_id"])
    of_run = [flag for flag in flags.of_run(run_id) if flag not in shared]
    text = format_remarks([*reason_of(fit), *of_run, *flags.of_run_beside_others(run_id)])
    # what nothing measured is not lacking
    measured = "z" if run_id in flags.runs_with("no-force-x") else "zx"
    if not text and not np.isfinite([fit[f"alpha_{c}_N_per_cm3"] for c in measured]).all():
        return "no alpha"
    return text
