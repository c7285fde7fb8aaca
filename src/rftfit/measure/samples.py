"""Long tables of samples of all runs: their columns, the phases of a run, and the stroke of each run in them.

A *long table* holds the samples of all runs of a medium below each other, a row a sample, in the order of recording;
its categorical column ``run_id`` says whose they are. The *stroke* of a run is the motion that is measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from rftfit.conventions import COMPONENTS, FloatArray
from rftfit.measure.levels import find_equal_stretches

PHASES = ("air", "approach", "pause", "stroke", "other")
"""Phases of a run: rest in air, way to the surface, rest at the surface, stroke, and all else; the column `phase`."""
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
"""Columns of the table of samples, besides `run_id`.

Time of the force log; phase; reference point of the intruder (centre of a plate, axle of a leg); its angle (beta or
theta); force of the medium on intruder and rod, zero removed; `why`: `RowStatus`, GOOD or why the sample must not be
used.
"""


def samples_table(runs: Mapping[str, Sequence[np.ndarray]]) -> pd.DataFrame:
    """Make the long table of samples; `runs`: columns of each run in the order of `SAMPLE_COLUMNS`, by run_id."""
    named_columns = {
        run_id: dict(zip(SAMPLE_COLUMNS, columns, strict=True)) for run_id, columns in runs.items()
    }
    samples = join_runs(named_columns, SAMPLE_COLUMNS)
    codes = samples["phase"].to_numpy(int)
    samples["phase"] = pd.Categorical.from_codes(codes, categories=pd.Index(PHASES))
    return samples


def join_runs(runs: Mapping[str, Mapping[str, np.ndarray]], columns: Sequence[str]) -> pd.DataFrame:
    """Join the `columns` of several runs into one long table; run_ids are categories, which keeps it small.

    `runs`: Arrays of shape (n,) by column, by run_id.
    """
    sizes = [columns_of_run[columns[0]].size for columns_of_run in runs.values()]
    codes = np.repeat(np.arange(len(runs)), sizes)
    table_columns: dict[str, object] = {
        "run_id": pd.Categorical.from_codes(codes, categories=pd.Index(list(runs)))
    }
    for name in columns:
        arrays = [columns_of_run[name] for columns_of_run in runs.values()]
        table_columns[name] = np.concatenate(arrays) if arrays else np.empty(0)
    return pd.DataFrame(table_columns, copy=False)  # nothing else uses these arrays


def split_runs(table: pd.DataFrame) -> dict[str, slice]:
    """Find the rows of each run, by run_id, in a long table, in which the rows of a run follow each other."""
    if table.empty:
        # it comes back from Parquet without categories
        return {}
    # equal numbers of the categories in sequence are the rows of one run
    run_id = table["run_id"].astype("category").cat
    run_ids, codes = run_id.categories, run_id.codes.to_numpy()
    starts, lengths = find_equal_stretches(codes)
    return {
        str(run_ids[codes[start]]): slice(start, start + length)
        for start, length in zip(starts.tolist(), lengths.tolist(), strict=True)
    }


StrokeColumns = dict[str, np.ndarray]
"""Samples of the stroke of one run, in the order of recording: arrays of shape (n,) by column."""


def stack_components(columns: Mapping[str, np.ndarray], quantity: str) -> FloatArray:
    """Stack z and x of a `quantity`, ``force`` or ``tare``, N, shape (2, n)."""
    return np.stack([columns[f"{quantity}_{c}_N"] for c in COMPONENTS])


def strokes(samples: pd.DataFrame) -> dict[str, StrokeColumns]:
    """Return the samples of each run's stroke, by run_id: `SAMPLE_COLUMNS` without time and phase, and ``path_cm``.

    That is the distance from the start of the stroke, cm. `samples`: Table of samples.
    """
    in_stroke = (samples["phase"] == "stroke").to_numpy()
    columns = {name: samples[name].to_numpy()[in_stroke] for name in SAMPLE_COLUMNS[2:]}
    columns_of_runs = {}
    for run, rows in split_runs(samples.loc[in_stroke, ["run_id"]]).items():
        columns_of_runs[run] = stroke = {name: values[rows] for name, values in columns.items()}
        x, depth = stroke["x_cm"], stroke["depth_cm"]
        stroke["path_cm"] = np.hypot(x - x[0], depth - depth[0])
    return columns_of_runs
