"""Stages that draw: each function one figure, as png, pdf and svg."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from rftfit import conventions
from rftfit.campaign.config import Leg
from rftfit.campaign.load import load_campaign
from rftfit.errors import InputError
from rftfit.figures import style
from rftfit.figures.generic import draw_generic
from rftfit.figures.leg_panels import leg_title
from rftfit.figures.legs import draw_generic_forces, draw_leg_media, draw_legs, draw_peak_errors
from rftfit.figures.maps import draw_fit_maps, draw_maps
from rftfit.figures.plates import by_run, draw_linearity, draw_stress, filed, runs_of_cells
from rftfit.figures.protocol import Protocol, draw_clocks, draw_protocol, draw_tare
from rftfit.figures.quality import draw_quality
from rftfit.figures.robot import draw_motion, draw_optimum, draw_reaction, draw_speeds
from rftfit.figures.sands import draw_penetration
from rftfit.figures.style import draw_missing, drawn, save
from rftfit.measure.ingest import ingest_traces
from rftfit.measure.ledger import RowStatus
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.model.fourier import evaluate
from rftfit.robot.run import simulate
from rftfit.store import read_csv, read_parquet, write_csv
from rftfit.workflow.robot import PROFILES, robot_of, robot_profile

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator
    from pathlib import Path
    from typing import Any

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.figures.plates import DrawnTrace
    from rftfit.model.profiles import Profile
    from rftfit.robot.config import Robot
    from rftfit.robot.run import RobotRun


# --- Which runs a figure shows.


def stress_runs(campaign: Campaign) -> list[str]:
    """Choose the runs of the stress figure: those the config names, or the flat plate down and up.

    Returns empty where the sheet has no slanted plate run.
    """
    named = campaign.config.figures.stress_runs
    unknown = [name for name in named if name not in campaign.by_id]
    if unknown:
        raise InputError(
            f"config, figures.stress_runs: found {', '.join(unknown)}; allowed: run_id of the run sheet"
        )
    if named:
        return list(named)
    plates = [
        run
        for medium in campaign.config.media
        for run in campaign.runs_of(medium)
        if run.kind == "plate" and run.direction != "horizontal"
    ]
    if not plates:
        return []
    first = plates[0].medium
    flat = [run.run_id for run in plates
            if run.medium == first and run.beta_deg == 0 and run.gamma_deg == 90]  # fmt: skip
    return flat or [plates[0].run_id]


# --- Tared samples as stress, for the figures.


def stress_samples(campaign: Campaign, tared: pd.DataFrame, windows: pd.DataFrame) -> pd.DataFrame:
    """Stress of every plate run in the lab frame, and whether it was fitted.

    `tared`, `windows`: Of one medium, from the tare and slope stages; the same rows. Returns
    `run_id, depth_cm, path_cm, stress_z_N_per_cm2, stress_x_N_per_cm2, tare_z_N_per_cm2,
    tare_x_N_per_cm2, in_window`.
    """
    import pandas as pd

    runs = campaign.by_id
    run_id = tared["run_id"].astype("category")
    names = [str(name) for name in run_id.cat.categories]
    # legs have no area and are not drawn here
    area = np.array(
        [
            getattr(campaign.config.intruders[runs[name].intruder], "area_cm2", np.nan)
            for name in names
        ]
    )[run_id.cat.codes.to_numpy()]
    samples = pd.DataFrame(
        {
            "run_id": tared["run_id"].astype(str),
            "depth_cm": tared["depth_cm"],
            "path_cm": tared["path_cm"],
            **{
                f"{what}_{c}_N_per_cm2": tared[f"{column}_{c}_N"] / area
                for what, column in (("stress", "force"), ("tare", "tare"))
                for c in "zx"
            },
            "in_window": windows["why"].to_numpy() == RowStatus.GOOD,
        }
    )
    plates: pd.DataFrame = samples[np.isfinite(area)].reset_index(drop=True)
    return plates


# --- Figures of the measurement chain: each function one figure, as png, pdf and svg.


def base_of(png: Path) -> Path:
    """Path of a figure without its ending; a point in a medium's name is part of the name."""
    return png.with_name(png.name.removesuffix(".png"))


def _titles(campaign: Campaign) -> dict[str, str]:
    return {name: medium.title for name, medium in campaign.config.media.items()}


def _tables(paths: list[Path]) -> pd.DataFrame:
    import pandas as pd

    return pd.concat([read_csv(path) for path in paths], ignore_index=True)


def figure_stress(
    config: Path, tared: list[Path], windows: list[Path], fits: list[Path], png: Path
) -> None:
    """Draw stress against depth of the runs that the config names (Fig. 2B).

    `tared`, `windows`, `fits`: Read: of the media that these runs belong to, in one order. `png`:
    Written, with pdf and svg beside it.
    """
    import pandas as pd

    campaign = load_campaign(config)
    samples = pd.concat(
        [
            stress_samples(campaign, read_parquet(one), read_parquet(other))
            for one, other in zip(tared, windows, strict=True)
        ],
        ignore_index=True,
    )
    table = _tables(fits)
    chosen = stress_runs(campaign)
    known = set(samples["run_id"])
    # a run that was refused has nothing to draw; the quality sheet and the ledger say why
    drawn = [name for name in chosen if name in known] or sorted(known)[:1]
    if drawn:
        figure = draw_stress(samples, table, drawn, campaign.config.fit.confidence)
    else:
        why = table[table["run_id"].isin(chosen)]
        reasons = [f"{run}: {one}" for run, one in zip(why["run_id"], why["reason"], strict=True)]
        figure = draw_missing("no run has a stroke to draw stress against depth of", reasons)
    save(figure, base_of(png))


def figure_maps(config: Path, alpha: list[Path], png: Path) -> None:
    """Draw maps of measured alpha and of its intervals (Figs. 2C, 2D, S4).

    `alpha`: Read: alpha tables, drawn in this order. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    figure = draw_maps(_tables(alpha), _titles(campaign), campaign.config.fit.confidence)
    save(figure, base_of(png))


def figure_fit(config: Path, alpha: list[Path], coefficients: Path, png: Path) -> None:
    """Draw the nine-term fits and what they leave over (Fig. S6).

    `coefficients`: Read: alpha tables and coefficients. `png`: Written, with pdf and svg beside
    it.
    """
    campaign = load_campaign(config)
    method = campaign.config.fourier.method
    values = read_csv(coefficients)
    if not has_fit(values, method, "value_N_per_cm3"):
        figure = draw_missing(f"no nine-term fit by {method}", why_no_fit(values, method))
    else:
        figure = draw_fit_maps(_tables(alpha), values, evaluate, method, _titles(campaign))
    save(figure, base_of(png))


def figure_generic(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path, png: Path
) -> None:
    """Draw the media scaled onto the generic profile (Fig. S7).

    `coefficients`, `penetration`: Read: alpha tables, coefficients with M0, zeta. `png`: Written,
    with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    method, scaled = campaign.config.fourier.method, read_csv(penetration)
    if not has_fit(scaled, method, "zeta"):
        figure = draw_missing(f"no generic profile by {method}", why_no_fit(scaled, method))
    else:
        figure = draw_generic(
            read_csv(coefficients), scaled, _tables(alpha), evaluate, method, _titles(campaign)
        )
    save(figure, base_of(png))


def has_fit(table: pd.DataFrame, method: str, column: str) -> bool:
    """Whether any laboratory medium could be fitted.

    `table`: Coefficients or penetration. `method`: Of the fit. `column`: Whose number tells.
    """
    return bool(table.loc[table["method"] == method, column].notna().any())


def why_no_fit(table: pd.DataFrame, method: str) -> list[str]:
    """Say of every laboratory medium why it could not be fitted.

    `table`: Coefficients or penetration. `method`: Of the fit.
    """
    rows = table[table["method"] == method].drop_duplicates("medium")
    return [f"{m}: {why}" for m, why in zip(rows["medium"], rows["reason"], strict=True)]


def quality(config: Path, medium: str, tared: Path, windows: Path, fits: Path, png: Path) -> None:
    """Draw the quality sheet of one medium: every plate run with its tare, window and fit.

    `tared`, `windows`, `fits`: Read: from the tare and slope stages. `png`: Written, with pdf and
    svg beside it; further pages as ``<name>_page2`` and so on.
    """
    campaign = load_campaign(config)
    samples = stress_samples(campaign, read_parquet(tared), read_parquet(windows))
    title = campaign.config.media[medium].title
    pages = draw_quality(samples, read_csv(fits), title)
    pages = pages or [draw_missing(f"{title}: the run sheet has no plate run")]
    for number, figure in enumerate(pages, start=1):
        base = base_of(png)
        save(figure, base if number == 1 else base.with_name(f"{base.name}_page{number}"))


def figure_tare(config: Path, medium: str, tared: Path, tares: Path, png: Path) -> None:
    """Draw the tare of the medium's deepest slanted plate run, with its valid range.

    `tared`, `tares`: Read: from the tare stage. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    samples = read_parquet(tared)
    table = read_csv(tares)
    known = table[(table["abscissa"] == "depth_cm") & table["valid_to"].notna()]
    title = campaign.config.media[medium].title
    if known.empty:
        why = [NO_TARE_FLAG if row == "" else row for row in dict.fromkeys(table["reason"])]
        save(draw_missing(f"{title}: no plate run has a tare to draw", why), base_of(png))
        return
    deepest = known.sort_values(["valid_to", "run_id"], ascending=[False, True]).iloc[0]
    part = samples[(samples["run_id"] == deepest["run_id"]).to_numpy()]
    frame = part[["depth_cm"]].assign(
        force_z_N=part["tare_z_N"], force_x_N=part["tare_x_N"], valid=part["tare_z_N"].notna()
    )
    save(draw_tare(frame, f"{title}: tare {deepest['tare_run']}"), base_of(png))


# --- Figures of how forces become slopes: one run of each kind, and slopes of all media.


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

    `traces`, `tared`, `windows`, `fits`, `legs`: Read: from the ingest, tare, slope and leg
    stages. `png`: Written, with pdf and svg beside it.
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
    save(drawn(draw_protocol, columns, title, campaign.config.fit.confidence), base_of(png))


def figure_linearity(
    config: Path, tared: list[Path], windows: list[Path], fits: list[Path], alpha: list[Path],
    png: Path,
) -> None:  # fmt: skip
    """Draw stress against depth in all laboratory media at a few angles (after Fig. S2).

    `tared`, `windows`, `fits`, `alpha`: Read: of the media, in one order. `png`: Written, with pdf
    and svg beside it.
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
    figure = drawn(
        draw_linearity, filed(pd.concat(samples, ignore_index=True), slopes), slopes, cells, CELLS,
        {name: medium.title for name, medium in campaign.config.media.items()},
        campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def _about(run: Run) -> str:
    if run.kind == "leg":
        return f"{leg_title(run.intruder)}, swept through the medium"
    beta, gamma = style.degrees(run.beta_deg), style.degrees(run.gamma_deg)
    held = rf"$\beta$ = {beta}"
    if run.direction == "horizontal":
        return f"{held}, {style.number(run.depth_cm, 2)} cm deep"
    if run.direction == "intrusion":
        return rf"{held}, $\gamma$ = {gamma}"
    filed_beta, filed_gamma, _ = conventions.file_extraction(run.beta_deg, run.gamma_deg)
    return f"{held}, filed under ({style.degrees(filed_beta)}, {style.degrees(filed_gamma)})"


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


def _recorded(samples: pd.DataFrame) -> tuple[DrawnTrace, dict[str, tuple[float, float]]]:
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


# --- Figures of legs and natural sands: each function one figure, as png, pdf and svg.


def _of_role(campaign: Campaign, role: str) -> list[str]:
    there = set(campaign.media_with_runs)
    media = campaign.config.media
    return [name for name in media if name in there and media[name].role == role]


def _joined(paths: list[Path]) -> pd.DataFrame:
    return pd.concat([read_csv(path) for path in paths], ignore_index=True)


def figure_legs(config: Path, medium: str, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in one medium (Figs. 3 D to F).

    `legs`: Read: predicted and measured curves. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    outlines = {n: leg for n, leg in campaign.config.intruders.items() if isinstance(leg, Leg)}
    level = campaign.config.fit.confidence
    figure = drawn(
        draw_legs,
        read_csv(predicted),
        _joined(legs),
        medium,
        _titles(campaign),
        outlines,
        confidence=level,
    )
    save(figure, base_of(png))


def figure_leg_media(config: Path, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in all laboratory media (Fig. S5).

    `legs`: Read: predicted and measured curves. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    figure = drawn(
        draw_leg_media, read_csv(predicted), _joined(legs), _of_role(campaign, "laboratory"), _titles(campaign),
        profile="table", confidence=campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_sand_legs(config: Path, predicted: Path, legs: list[Path], png: Path) -> None:
    """Draw the forces on all legs in the natural sands (Fig. S12).

    `legs`: Read: predicted and measured curves. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    figure = drawn(
        draw_leg_media, read_csv(predicted), _joined(legs), _of_role(campaign, "natural_sand"), _titles(campaign),
        profile="generic", confidence=campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_penetration(
    config: Path, tared: list[Path], windows: list[Path], sands: Path, png: Path
) -> None:
    """Draw the penetration tests of the natural sands (Fig. S11).

    `tared`, `windows`: Read: of the sands, in one order. `sands`: Read: slopes over the stated and
    the detected regime. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    samples = pd.concat(
        [
            stress_samples(campaign, read_parquet(one), read_parquet(other))
            for one, other in zip(tared, windows, strict=True)
        ],
        ignore_index=True,
    )
    table = read_csv(sands)
    media_of = dict(zip(table["run_id"], table["medium"], strict=True))
    tests = samples[samples["run_id"].isin(list(media_of))].reset_index(drop=True)
    figure = drawn(
        draw_penetration, tests, media_of, table, _of_role(campaign, "natural_sand"), _titles(campaign),
        campaign.config.fit.confidence,
    )  # fmt: skip
    save(figure, base_of(png))


def figure_generic_forces(
    config: Path, predicted: Path, legs: list[Path], penetration: Path, png: Path
) -> None:
    """Draw the forces on legs over zeta, all media on one another (Fig. S8).

    `penetration`: Read: predicted and measured curves, zeta. `png`: Written, with pdf and svg
    beside it.
    """
    campaign = load_campaign(config)
    method, scaled = campaign.config.fourier.method, read_csv(penetration)
    if not has_fit(scaled, method, "zeta"):
        what = f"no zeta by {method}, so forces cannot be scaled"
        figure = draw_missing(what, why_no_fit(scaled, method))
    else:
        figure = drawn(
            draw_generic_forces, read_csv(predicted), _joined(legs), scaled, method=method, titles=_titles(campaign),
            confidence=campaign.config.fit.confidence,
        )  # fmt: skip
    save(figure, base_of(png))


def figure_peak_errors(config: Path, errors: Path, png: Path) -> None:
    """Draw how far the predicted peak lifts are from the measured ones.

    `errors`: Read: of the trials stage. `png`: Written, with pdf and svg beside it.
    """
    campaign = load_campaign(config)
    figure = drawn(
        draw_peak_errors,
        read_csv(errors),
        titles=_titles(campaign),
        confidence=campaign.config.fit.confidence,
    )
    save(figure, base_of(png))


# --- Figures of the robot, and the motion that two of them show.


MOTION_HZ = 2.0
MOTION_CURVATURES = (1.0, 0.0, -1.0)
"""c-leg, flat and reversed c-leg at the stride frequency of the paper's movies."""

SAMPLES, STRIDES = 200, 2


def last_strides(
    robot: Robot, profile: Profile, frequency_Hz: float, curvature: float, samples: int = SAMPLES
) -> pd.DataFrame:
    """Motion and forces over the last two strides of a run.

    `samples`: In a stride. Returns `curvature_times_R, frequency_Hz, stride` (0 to 2), and the
    columns of `rftfit.robot.run.Series.table`; time and x count from the first row.
    """
    run = simulate(robot, profile, frequency_Hz, curvature, samples_per_stride=samples)
    return tail_of(run, samples)


def tail_of(run: RobotRun, samples: int) -> pd.DataFrame:
    """Cut the last two strides out of a run.

    `run`: With a series. `samples`: In a stride. Returns as `last_strides`; fewer where the run
    was shorter.
    """
    assert run.series is not None
    table = run.series.table().iloc[-STRIDES * samples :].reset_index(drop=True)
    for name in ("time_s", "x_cm"):
        table[name] -= table[name].iloc[0]
    table["leg_angle_deg"] -= 360 * np.floor(table["leg_angle_deg"].iloc[0] / 360)
    table.insert(0, "stride", np.arange(len(table)) / samples)
    table.insert(0, "frequency_Hz", run.condition.frequency_Hz)
    table.insert(0, "curvature_times_R", run.condition.curvature_times_R)
    return table


def robot_motion(config: Path, alpha: Path, coefficients: Path, motion: Path) -> None:
    """Run the three model legs at 2 Hz on every profile and keep their last two strides.

    `alpha`, `coefficients`: Read: alpha table of the robot's medium, coefficients of all.
    `motion`: Written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    section, robot = robot_of(campaign)
    method = campaign.config.fourier.method
    table, values = read_csv(alpha), read_csv(coefficients)
    parts = []
    for name in PROFILES:
        profile = robot_profile(name, section.medium, table, values, method)
        for curvature in MOTION_CURVATURES:
            part = last_strides(robot, profile, MOTION_HZ, curvature)
            part.insert(0, "profile", name)
            parts.append(part)
    write_csv(pd.concat(parts, ignore_index=True), motion)


def figures_robot_speed(
    speed: Path, errors: Path, optimum: Path, fig_4c: Path, fig_4d: Path, fig_s13: Path
) -> None:
    """Draw speed against frequency and curvature (Figs. 4C, 4D, S13).

    `speed`, `errors`, `optimum`: Read: tables of the robot. `fig_4c`, `fig_4d`, `fig_s13`:
    Written: png, with pdf and svg beside each.
    """
    runs, compared, best = (read_csv(path) for path in (speed, errors, optimum))
    save(drawn(draw_speeds, runs, compared, ["table"]), base_of(fig_4c))
    save(drawn(draw_optimum, runs, best), base_of(fig_4d))
    save(drawn(draw_speeds, runs, compared), base_of(fig_s13))


def figures_robot_motion(motion: Path, fig_4b: Path, fig_s14: Path) -> None:
    """Draw motion and ground reaction over two strides (after Figs. 4B and S14).

    `motion`: Read. `fig_4b`, `fig_s14`: Written: png, with pdf and svg beside each.
    """
    table = read_csv(motion)
    save(drawn(draw_motion, table), base_of(fig_4b))
    save(drawn(draw_reaction, table), base_of(fig_s14))


# --- Quality figure of a medium whose clocks are estimated: from the estimates' own details.


def figure_clocks(config: Path, medium: str, png: Path) -> None:
    """Draw how the clocks of each run of a medium were brought together.

    `config`: Its ``clock.method`` is ``estimate``. `png`: Written; pdf and svg beside it.
    """
    campaign = load_campaign(config)
    save(drawn(draw_clocks, ingest_traces(campaign, medium)[0]), base_of(png))
