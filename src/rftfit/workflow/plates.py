"""Penetrations with plates of several sizes, from logs to alpha, zeta and forces on legs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.compare.sands import by_plate, depth_exponent, size_exponent
from rftfit.errors import InputError
from rftfit.measure.fits import fit_medium
from rftfit.measure.flags import FLAGS, REASON
from rftfit.measure.ingest import ingest_traces, samples_of
from rftfit.measure.ledger import RowStatus, check, join
from rftfit.measure.samples import split_runs
from rftfit.measure.tare import tare_medium
from rftfit.model.outlines import CURVATURES, model_leg
from rftfit.model.prediction import predict
from rftfit.model.scaling import scale
from rftfit.store import write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import AnyPlate, Config
    from rftfit.campaign.load import Campaign
    from rftfit.compare.sands import Estimate, PlateResult
    from rftfit.measure.ingest import Trace
    from rftfit.model.scaling import ScaledMedium


@dataclass(frozen=True)
class Plates:
    """What penetrations with several plates come to; by plate, the smallest first.

    `runs`: As `_runs`. `with_size`: Exponent m of alpha ~ size^m. `spread`: Where the run-to-run spread
    is from. `scaled`: The medium as each plate alone would have it. `forces`: On the three model legs,
    by pose.
    """

    config: Config
    runs: pd.DataFrame
    combined: dict[str, PlateResult]
    sizes_cm: dict[str, float]
    with_size: Estimate
    spread: str
    scaled: dict[str, ScaledMedium]
    forces: pd.DataFrame


class _Chain(NamedTuple):
    """What the campaign's own stages made of a medium."""

    traces: list[Trace]
    stress: dict[str, tuple[np.ndarray, np.ndarray]]
    status: pd.DataFrame
    fits: pd.DataFrame
    ledger: pd.DataFrame


def run_plates(config: Path, results: Path) -> Plates:
    """Run the chain on a campaign of vertical penetrations; write tables and figures into a folder."""
    from rftfit.figures.plates import draw_plates
    from rftfit.figures.protocol import draw_clocks
    from rftfit.figures.style import save

    campaign = load_campaign(config)
    chain = _chain(campaign)
    check(chain.ledger, chain.status)
    runs = _runs(campaign, chain)
    good = runs[np.isfinite(runs["alpha"])]
    if good.empty:
        reasons = "; ".join(f"{run.name}: {run.reason}" for run in runs.itertuples())
        raise InputError(f"no run gives an alpha: {reasons}")
    level = campaign.config.fit.confidence
    sizes = {name: _plate(campaign, name).length_cm for name in good["plate"]}
    sizes = dict(sorted(sizes.items(), key=lambda item: item[1]))
    of_plate = {name: good[good["plate"] == name] for name in sizes}
    alphas = {
        name: (own["alpha"].to_numpy(), own["alpha_se"].to_numpy(), own["alpha_dof"].to_numpy())
        for name, own in of_plate.items()
    }
    exponents = {
        name: np.array([depth_exponent(*chain.stress[run]) for run in own["name"]])
        for name, own in of_plate.items()
    }
    combined, spread = by_plate(alphas, exponents, level)
    with_size = size_exponent(
        [sizes[name] for name in good["plate"]], good["alpha"].tolist(), level
    )
    scaled = {
        name: scale(one.alpha.value, one.alpha.se, confidence=level)
        for name, one in combined.items()
    }
    forces = _forces(scaled, level)
    found = Plates(campaign.config, runs, combined, sizes, with_size, spread.source, scaled, forces)
    for name, table in (
        ("runs", chain.status),
        ("fits", chain.fits),
        ("ledger", chain.ledger),
        ("plates", _plates_table(found)),
        ("forces", forces.drop(columns=["reason", *forces.filter(like="moment").columns])),
    ):
        write_csv(table, results / f"{name}.csv")
    ends = {name: (r.alpha.value, r.alpha.lo, r.alpha.hi) for name, r in combined.items()}
    save(draw_clocks(chain.traces), results / "clocks")
    drawn = {name: list(own["name"]) for name, own in of_plate.items()}
    save(draw_plates(chain.stress, drawn, ends, sizes), results / "stress")
    return found


def _chain(campaign: Campaign) -> _Chain:
    """Go through ingest, tare and slopes, as the workflow does."""
    import pandas as pd

    traces: list[Trace] = []
    stress: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    tables: list[tuple[pd.DataFrame, ...]] = []
    for medium in campaign.media_with_runs:
        own, rows, first = ingest_traces(campaign, medium)
        status = pd.DataFrame(rows)
        tared, tares, second = tare_medium(campaign, medium, samples_of(own), status)
        fits, windows, third = fit_medium(campaign, medium, status, tared, tares)
        good = windows["why"].to_numpy() == RowStatus.GOOD
        for name, place in split_runs(tared).items():
            plate = _plate(campaign, campaign.by_id[name].intruder)
            part = tared.iloc[place][good[place]]
            pressure = part["force_z_N"].to_numpy() / plate.area_cm2
            stress[name] = part["depth_cm"].to_numpy(), pressure
        book = join([first.table(), second.table(), third.table()])
        traces += own
        tables.append((status, fits, book))
    joined = (pd.concat(parts, ignore_index=True) for parts in zip(*tables, strict=True))
    return _Chain(traces, stress, *joined)


_FOUND = {
    "alpha": "alpha_z_N_per_cm3", "alpha_se": "alpha_z_se_N_per_cm3", "alpha_dof": "alpha_z_dof",
    "clock_s": "clock_offset_s", "clock_se_s": "clock_se_s", "surface_mm": "surface_z_mm",
    "surface_se_mm": "surface_se_mm",
}  # fmt: skip


def _runs(campaign: Campaign, chain: _Chain) -> pd.DataFrame:
    """Runs with alpha_z(0, 90 deg), N/cm^3, or the reason why there is none, surface and clocks.

    `clock_s`: Motion minus force.
    """
    status = chain.status.drop(columns=[*REASON, *FLAGS, "note"])
    found = chain.fits.merge(status, on="run_id")
    plates = [campaign.by_id[name].intruder for name in found["run_id"]]
    numbers = {name: found[column].astype(float) for name, column in _FOUND.items()}
    return found[[*REASON]].assign(name=found["run_id"], plate=plates, **numbers)


def _plate(campaign: Campaign, name: str) -> AnyPlate:
    plate = campaign.config.intruders[name]
    assert plate.shape != "leg"
    return plate


def _forces(scaled: dict[str, ScaledMedium], level: float) -> pd.DataFrame:
    """Forces on the model legs by pose, from each plate alone."""
    import pandas as pd

    parts = []
    for name, medium in scaled.items():
        for leg in CURVATURES:
            table = predict(medium.profile, model_leg(leg), None, level)
            table.insert(0, "leg", leg)
            table.insert(0, "plate", name)
            parts.append(table)
    return pd.concat(parts, ignore_index=True)


def _plates_table(found: Plates) -> pd.DataFrame:
    import pandas as pd

    rows = []
    for name, result in found.combined.items():
        scaled = found.scaled[name]
        rows.append(
            {
                "plate": name,
                "size_cm": found.sizes_cm[name],
                "runs": result.runs,
                "alpha_z_N_per_cm3": result.alpha.value,
                "alpha_z_se_N_per_cm3": result.alpha.se,
                "alpha_z_lo_N_per_cm3": result.alpha.lo,
                "alpha_z_hi_N_per_cm3": result.alpha.hi,
                "largest_deviation_percent": 100 * result.largest_deviation,
                "depth_exponent": result.exponent.value,
                "depth_exponent_lo": result.exponent.lo,
                "depth_exponent_hi": result.exponent.hi,
                "zeta": scaled.zeta,
                "zeta_lo": scaled.zeta_lo,
                "zeta_hi": scaled.zeta_hi,
            }
        )
    return pd.DataFrame(rows)
