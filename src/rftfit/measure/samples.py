"""Long tables of samples of all runs, and the stroke of each run in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

PHASES = ("air", "approach", "pause", "stroke", "other")
"""Phases of a run: rest in air, way to the surface, rest at the surface, stroke, and all else."""
SAMPLE_COLUMNS = (
    "time_s",
    "phase",
    "x_cm",
    "depth_cm",
    "angle_deg",
    "force_z_N",
    "force_x_N",
    "why",
)
"""Columns of the table of samples, besides `run_id`."""


def samples_table(runs: Mapping[str, Sequence[np.ndarray]]) -> pd.DataFrame:
    """Make the long table of samples; `runs`: columns of each run in the order of `SAMPLE_COLUMNS`, by run_id."""
    parts = {name: dict(zip(SAMPLE_COLUMNS, run, strict=True)) for name, run in runs.items()}
    samples = join_runs(parts, SAMPLE_COLUMNS)
    codes = samples["phase"].to_numpy(int)
    samples["phase"] = pd.Categorical.from_codes(codes, categories=pd.Index(PHASES))
    return samples


def join_runs(
    parts: Mapping[str, Mapping[str, np.ndarray]], columns: Sequence[str]
) -> pd.DataFrame:
    """Join columns of several runs into one long table; run_ids are categories, which keeps it small."""
    sizes = [columns_of_run[columns[0]].size for columns_of_run in parts.values()]
    codes = np.repeat(np.arange(len(parts)), sizes)
    table_columns: dict[str, object] = {
        "run_id": pd.Categorical.from_codes(codes, categories=pd.Index(list(parts)))
    }
    for name in columns:
        arrays = [columns_of_run[name] for columns_of_run in parts.values()]
        table_columns[name] = np.concatenate(arrays) if arrays else np.empty(0)
    return pd.DataFrame(table_columns, copy=False)  # nothing else uses these arrays


def split_runs(table: pd.DataFrame) -> dict[str, slice]:
    """Find the rows of each run in a table whose categorical column ``run_id`` is sorted by run."""
    # a table without rows comes back from Parquet without its categories
    run_id = table["run_id"].astype("category")
    codes = run_id.cat.codes.to_numpy()
    names = run_id.cat.categories
    edges = np.flatnonzero(np.diff(codes)) + 1
    starts = np.concatenate([[0], edges]) if codes.size else np.empty(0, dtype=int)
    stops = np.append(edges, codes.size)
    parts = zip(starts.tolist(), stops.tolist(), strict=False)
    return {str(names[codes[a]]): slice(a, b) for a, b in parts}


StrokeColumns = dict[str, np.ndarray]
"""Samples of the stroke of one run, in the order of recording: arrays of shape (n,) by column."""


def strokes(samples: pd.DataFrame) -> dict[str, StrokeColumns]:
    """Return the samples of each run's stroke, by run_id, with the length travelled since its start, `path_cm`."""
    in_stroke = (samples["phase"] == "stroke").to_numpy()
    columns = {name: samples[name].to_numpy()[in_stroke] for name in SAMPLE_COLUMNS[2:]}
    columns_of_runs = {}
    for run, rows in split_runs(samples.loc[in_stroke, ["run_id"]]).items():
        columns_of_runs[run] = stroke = {name: values[rows] for name, values in columns.items()}
        x, depth = stroke["x_cm"], stroke["depth_cm"]
        stroke["path_cm"] = np.hypot(x - x[0], depth - depth[0])
    return columns_of_runs
