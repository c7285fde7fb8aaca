"""Penetrations with plates of several sizes, from logs to alpha, zeta and forces on legs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rftfit.cli.example_summary import LEGS, Run, Scaling, summary
from rftfit.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.measure.ingest import Trace
    from rftfit.validate.plates import PlateResult


class _Chain(NamedTuple):
    """What the campaign's own stages made of a medium."""

    traces: list[Trace]
    status: pd.DataFrame
    fits: pd.DataFrame
    stress: dict[str, tuple[np.ndarray, np.ndarray]]
    ledger: pd.DataFrame


def run_plates(config: Path, results: Path) -> str:
    """Run the chain on a campaign of vertical penetrations and write its results.

    Parameters
    ----------
    config : Path
    results : Path
        Folder; gets ``runs.csv``, ``fits.csv``, ``ledger.csv``, ``plates.csv``, ``forces.csv``,
        ``summary.txt`` and the figures ``clocks`` and ``stress``.

    Returns
    -------
    str
        The summary, for people.

    Raises
    ------
    RftfitError
        If the campaign is not valid, or no run gives an alpha.
    """
    from rftfit.campaign.load import load_campaign
    from rftfit.report.clocks import draw_clocks
    from rftfit.report.plates import draw_plates
    from rftfit.report.saving import save
    from rftfit.stages.ledger import check
    from rftfit.store import write_csv, write_text
    from rftfit.validate.plates import by_plate, depth_exponent, size_exponent

    campaign = load_campaign(config)
    chain = _chain(campaign)
    check(chain.ledger, chain.status)
    runs = _runs(campaign, chain)
    good = [run for run in runs if np.isfinite(run.alpha)]
    confidence = campaign.config.fit.confidence
    plates = sorted({run.plate for run in good}, key=lambda name: _size(campaign, name))
    if not plates:
        reasons = "; ".join(f"{run.name}: {run.reason}" for run in runs)
        raise InputError(f"no run gives an alpha: {reasons}")
    of_plate = {name: [run for run in good if run.plate == name] for name in plates}
    combined, spread = by_plate(
        {
            name: (
                np.array([run.alpha for run in own]),
                np.array([run.alpha_se for run in own]),
                np.array([run.alpha_dof for run in own]),
            )
            for name, own in of_plate.items()
        },
        {
            name: np.array([depth_exponent(*chain.stress[run.name]) for run in own])
            for name, own in of_plate.items()
        },
        confidence,
    )
    sizes = {name: _size(campaign, name) for name in plates}
    with_size = size_exponent(
        [sizes[run.plate] for run in good], [run.alpha for run in good], confidence
    )
    scalings, forces = _scale(combined, confidence)
    text = summary(
        campaign.config, runs, combined, sizes, with_size, spread.source, scalings, results.name
    )
    ends = {name: (r.alpha.value, r.alpha.lo, r.alpha.hi) for name, r in combined.items()}
    write_csv(chain.status, results / "runs.csv")
    write_csv(chain.fits, results / "fits.csv")
    write_csv(chain.ledger, results / "ledger.csv")
    write_csv(_plates_table(combined, sizes, scalings), results / "plates.csv")
    write_csv(forces, results / "forces.csv")
    save(draw_clocks(chain.traces), results / "clocks")
    save(draw_plates(chain.stress, of_plate, ends, sizes), results / "stress")
    write_text(results / "summary.txt", text + "\n")
    return text


def _chain(campaign: Campaign) -> _Chain:
    """Go through ingest, tare and slopes, as the workflow does."""
    import pandas as pd

    from rftfit.measure.rows import Why
    from rftfit.measure.strokes import split_runs
    from rftfit.stages.ingest import ingest_traces, samples_of
    from rftfit.stages.ledger import join
    from rftfit.stages.slopes import fit_medium
    from rftfit.stages.tare import tare_medium

    parts: list[_Chain] = []
    for medium in campaign.media_with_runs:
        traces, rows, first = ingest_traces(campaign, medium)
        status = pd.DataFrame(rows)
        tared, tares, second = tare_medium(campaign, medium, samples_of(traces), status)
        fits, windows, third = fit_medium(campaign, medium, status, tared, tares)
        good = windows["why"].to_numpy() == Why.GOOD
        stress = {}
        for name, place in split_runs(tared).items():
            area = campaign.config.intruders[campaign.by_id[name].intruder]
            part = tared.iloc[place][good[place]]
            assert area.shape != "leg"
            stress[name] = (
                part["depth_cm"].to_numpy(),
                part["force_z_N"].to_numpy() / area.area_cm2,
            )
        book = join([first.table(), second.table(), third.table()])
        parts.append(_Chain(traces, status, fits, stress, book))
    return _Chain(
        [trace for part in parts for trace in part.traces],
        pd.concat([part.status for part in parts], ignore_index=True),
        pd.concat([part.fits for part in parts], ignore_index=True),
        {name: pair for part in parts for name, pair in part.stress.items()},
        pd.concat([part.ledger for part in parts], ignore_index=True),
    )


def _runs(campaign: Campaign, chain: _Chain) -> list[Run]:
    status = {row["run_id"]: row for row in chain.status.to_dict("records")}
    runs = []
    for row in chain.fits.to_dict("records"):
        fact = status[row["run_id"]]
        runs.append(
            Run(
                str(row["run_id"]),
                campaign.by_id[str(row["run_id"])].intruder,
                float(fact["clock_offset_s"]),
                float(fact["clock_se_s"]),
                float(fact.get("surface_z_mm", np.nan)),
                float(fact.get("surface_se_mm", np.nan)),
                float(row["alpha_z_N_per_cm3"]),
                float(row["alpha_z_se_N_per_cm3"]),
                float(row["alpha_z_dof"]),
                float(row["nonlinear_z_ratio"]),
                float(row["nonlinear_z_p"]),
                str(row["reason"]),
            )
        )
    return runs


def _size(campaign: Campaign, name: str) -> float:
    plate = campaign.config.intruders[name]
    assert plate.shape != "leg"
    return plate.length_cm


def _scale(
    combined: dict[str, PlateResult], confidence: float
) -> tuple[dict[str, Scaling], pd.DataFrame]:
    """Run the scaling routine on alpha of each plate; zeta, peak forces, and forces by pose."""
    import pandas as pd

    from rftfit.cli.predict_inputs import make_motion, make_outline
    from rftfit.cli.predict_intervals import predict_forces
    from rftfit.cli.predict_sources import from_test
    from rftfit.cli.predict_summary import find_peaks
    from rftfit.cli.scale_intervals import scale_from
    from rftfit.profile.reference_media import published

    reference, motion = published(), make_motion(None, None)
    scalings, parts = {}, []
    for name, result in combined.items():
        scaled = scale_from(reference, result.alpha.value, result.alpha.se, confidence)
        source = from_test(reference, result.alpha.value, result.alpha.se, confidence)
        peaks = {}
        for leg in LEGS:
            outline = make_outline(leg, None, None, None, 30)
            prediction = predict_forces(source, outline, motion.poses, confidence)
            peaks[leg] = {peak.name: peak for peak in find_peaks(motion, prediction)}
            columns = {"plate": name, "leg": leg, motion.key: motion.columns[motion.key]}
            for quantity in ("force_z_N", "force_x_N"):
                stem = quantity.removesuffix("_N")
                lo, hi = prediction.ends[quantity]
                columns |= {
                    quantity: prediction.values[quantity],  # noqa: PD011
                    f"{stem}_lo_N": lo,
                    f"{stem}_hi_N": hi,
                }
            parts.append(pd.DataFrame(columns))
        scalings[name] = Scaling(scaled.zeta, scaled.zeta_lo, scaled.zeta_hi, peaks)
    return scalings, pd.concat(parts, ignore_index=True)


def _plates_table(
    combined: dict[str, PlateResult], sizes: dict[str, float], scalings: dict[str, Scaling]
) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "plate": name,
                "size_cm": sizes[name],
                "runs": result.runs,
                "alpha_z_N_per_cm3": result.alpha.value,
                "alpha_z_se_N_per_cm3": result.alpha.se,
                "alpha_z_lo_N_per_cm3": result.alpha.lo,
                "alpha_z_hi_N_per_cm3": result.alpha.hi,
                "largest_deviation_percent": 100 * result.largest_deviation,
                "depth_exponent": result.exponent.value,
                "depth_exponent_lo": result.exponent.lo,
                "depth_exponent_hi": result.exponent.hi,
                "zeta": scalings[name].zeta,
                "zeta_lo": scalings[name].lo,
                "zeta_hi": scalings[name].hi,
            }
            for name, result in combined.items()
        ]
    )
