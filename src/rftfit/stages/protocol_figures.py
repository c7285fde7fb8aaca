"""Figures of how forces become slopes: one run of each kind, and slopes of all media."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit import conventions
from rftfit.campaign.load import load_campaign
from rftfit.report import labels
from rftfit.report.curves import leg_title
from rftfit.report.linearity import draw_linearity, runs_of_cells
from rftfit.report.protocol import Protocol, draw_protocol
from rftfit.report.runs import by_run, filed
from rftfit.report.saving import save
from rftfit.stages.figures import base_of
from rftfit.stages.samples import stress_samples
from rftfit.store import read_csv, read_parquet

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator
    from pathlib import Path
    from typing import Any

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run
    from rftfit.report.runs import Trace

CELLS = ((0.0, 90.0), (30.0, 45.0), (90.0, 0.0), (-30.0, -45.0), (0.0, -90.0))
"""Beta and gamma, as filed, of which the figure of all media shows the stress."""

_SLANTED = (30.0, 45.0)
_TRACE = ("time_s", "depth_cm", "x_cm", "angle_deg", "force_z_N", "force_x_N")
_CURVE = ("theta_deg", "force_z_N", "force_x_N")
_RESULT = ("depth_cm", "path_cm", "stress_z_N_per_cm2", "stress_x_N_per_cm2", "in_window")


def figure_protocol(
    config: Path, medium: str, traces: Path, tared: Path, windows: Path, fits: Path, legs: Path,
    png: Path,
) -> None:  # fmt: skip
    """Draw one run of each kind from its recording to its result (after Fig. S1).

    Parameters
    ----------
    config : Path
    medium : str
    traces, tared, windows, fits, legs : Path
        Read: from the ingest, tare, slope and leg stages.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If no run gave a result or the figure cannot be written.
    """
    campaign = load_campaign(config)
    samples = read_parquet(traces, ["run_id", "phase", *_TRACE])
    names = samples["run_id"].astype(str).to_numpy()
    table, curves = read_csv(fits), read_csv(legs)
    stress = stress_samples(campaign, read_parquet(tared), read_parquet(windows))
    results = by_run(filed(stress, table), _RESULT)
    columns = []
    for run in (*_plates(campaign, table, set(results)), *_legs(campaign, medium, curves)):
        trace, phases = _recorded(samples[names == run.run_id])
        if not trace:
            continue
        own = curves[curves["run_id"].astype(str) == run.run_id]
        columns.append(
            Protocol(
                kind=run.direction,
                about=_about(run),
                run=trace,
                tare=_recorded(samples[names == run.tare_run])[0],
                phases=phases,
                result=results.get(run.run_id, {n: own[n].to_numpy(float) for n in _CURVE}),
                fit=_row_of(table, run.run_id),
            )
        )
    title = campaign.config.media[medium].title
    save(draw_protocol(columns, title, campaign.config.fit.confidence), base_of(png))


def figure_linearity(
    config: Path, tared: list[Path], windows: list[Path], fits: list[Path], alpha: list[Path],
    png: Path,
) -> None:  # fmt: skip
    """Draw stress against depth in all laboratory media at a few angles (after Fig. S2).

    Parameters
    ----------
    config : Path
    tared, windows, fits, alpha : list of Path
        Read: of the media, in one order.
    png : Path
        Written, with pdf and svg beside it.

    Raises
    ------
    RftfitError
        If an input is not valid or a result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    slopes = pd.concat(map(read_csv, fits), ignore_index=True)
    cells = pd.concat(map(read_csv, alpha), ignore_index=True)
    wanted = runs_of_cells(cells, CELLS)
    samples = []
    for one, other in zip(tared, windows, strict=True):
        stress = stress_samples(campaign, read_parquet(one), read_parquet(other))
        samples.append(stress[stress["run_id"].isin(wanted)])
    figure = draw_linearity(
        filed(pd.concat(samples, ignore_index=True), slopes), slopes, cells, CELLS,
        {name: medium.title for name, medium in campaign.config.media.items()},
        campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def _about(run: Run) -> str:
    if run.kind == "leg":
        return f"{leg_title(run.intruder)}, swept through the medium"
    beta, gamma = labels.degrees(run.beta_deg), labels.degrees(run.gamma_deg)
    held = rf"$\beta$ = {beta}"
    if run.direction == "horizontal":
        return f"{held}, {labels.number(run.depth_cm, 2)} cm deep"
    if run.direction == "intrusion":
        return rf"{held}, $\gamma$ = {gamma}"
    filed_beta, filed_gamma, _ = conventions.file_extraction(run.beta_deg, run.gamma_deg)
    return f"{held}, filed under ({labels.degrees(filed_beta)}, {labels.degrees(filed_gamma)})"


def _row_of(fits: pd.DataFrame, run_id: str) -> dict[Hashable, Any]:
    rows = fits[fits["run_id"].astype(str) == run_id].to_dict("records")
    return rows[0] if rows else {}


def _plates(campaign: Campaign, fits: pd.DataFrame, there: set[str]) -> Iterator[Run]:
    """For each direction the run nearest to the one that is wanted, of those that gave an alpha."""
    beta, gamma = _SLANTED
    wanted = {
        "intrusion": (beta, gamma),
        "extraction": conventions.file_extraction(beta, gamma)[:2],
        "horizontal": (beta, 0.0),
    }
    finite = fits[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]].notna().all(axis=1)
    usable = fits[finite & fits["run_id"].astype(str).isin(there)]
    for direction, (b, g) in wanted.items():
        own = usable[usable["direction"] == direction]
        if own.empty:
            continue
        away = (own["beta_deg"] - b).abs() + (own["gamma_deg"] - g).abs()
        # the deepest of equals: there the forces are largest
        order = own.assign(away=away.round(1), up=-own["depth_to_cm"].round(1))
        yield campaign.by_id[str(order.sort_values(["away", "up", "run_id"])["run_id"].iloc[0])]


def _legs(campaign: Campaign, medium: str, curves: pd.DataFrame) -> Iterator[Run]:
    there = set(curves.loc[curves["force_z_N"].notna(), "run_id"].astype(str))
    runs = [run for run in campaign.runs_of(medium) if run.kind == "leg" and run.run_id in there]
    order = list(campaign.config.intruders)
    if runs:
        yield min(runs, key=lambda run: (order.index(run.intruder), run.run_id))


def _recorded(samples: pd.DataFrame) -> tuple[Trace, dict[str, tuple[float, float]]]:
    """Take the recording of one run, its time counted from the stroke, and when it paused and moved."""
    if samples.empty:
        return {}, {}
    trace = {name: samples[name].to_numpy(float) for name in _TRACE}
    phase = samples["phase"].astype(str).to_numpy()
    moving = phase == "stroke"
    trace["time_s"] = trace["time_s"] - trace["time_s"][moving if moving.any() else slice(None)][0]
    phases = {}
    for name in ("pause", "stroke"):
        if (phase == name).any():
            time = trace["time_s"][phase == name]
            phases[name] = (float(time.min()), float(time.max()))
    return trace, phases
