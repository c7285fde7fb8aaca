"""Stages that put the force model on trial: legs, natural sands, published numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.compare.legs import leg_errors, leg_prediction
from rftfit.compare.published import (
    compare_alpha,
    compare_coefficients,
    compare_penetration,
    leg_claims,
    slips,
)
from rftfit.compare.robot import robot_claims
from rftfit.compare.sands import bend_of, corrections, linear_end
from rftfit.measure.alpha import column
from rftfit.measure.slopes import fit_slope
from rftfit.measure.tare import NO_TARE_FLAG
from rftfit.model.scaling import published, routine, scale_new_medium

if TYPE_CHECKING:
    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.compare.published import Item
    from rftfit.conventions import FloatArray
    from rftfit.results import Medium, Results


# --- Stage 7: the force model on trial, against the measured legs.


PREDICTED_COLUMNS = ["medium", "leg", "profile", "theta_deg", "force_z_N", "force_z_lo_N", "force_z_hi_N",
           "force_x_N", "force_x_lo_N", "force_x_hi_N", "moment_N_cm", "reason"]  # fmt: skip


def legs_predicted(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Predict the force on every leg in every medium, and compare with what was measured.

    Returns curves with intervals, and how far they are from the measured ones.
    """
    import pandas as pd

    settings = results.config
    media = [results[name] for name in (*results.laboratory, *results.sands)]
    curves = [one for medium in media if len(one := predicted_curves(medium))]
    nothing = pd.DataFrame(columns=PREDICTED_COLUMNS)
    everything = pd.concat(curves, ignore_index=True)[PREDICTED_COLUMNS] if curves else nothing
    spread = {one.name: bed_spread(one.alpha) for one in media}
    measured = results.joined("legs/{medium}.csv")
    compared = leg_errors(measured, everything, spread, settings.fit.confidence)
    # a curve from the published media says so in this table too
    silent = compared["medium"].isin(results.sands) & compared["reason"].isin(["", NO_TARE_FLAG])
    note = results.reference().note if silent.any() else ""
    compared.loc[silent, "reason"] = [
        "; ".join(filter(None, (reason, note))) for reason in compared.loc[silent, "reason"]
    ]
    return everything, compared


def bed_spread(table: pd.DataFrame) -> float:
    """Relative spread of forces from one prepared bed of a medium to the next.

    A bed is looser or denser as a whole: its spread is that of alpha_z(0, 90 deg), relative.

    `table`: Alpha table of the medium. Returns 0 where the spread is not known.
    """
    cell = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].iloc[0]
    ratio = float(cell.get("run_to_run_z_N_per_cm3", 0.0)) / float(cell[column("z")])
    return ratio if ratio > 0 else 0.0


def _legs(config: Config) -> dict[str, Leg]:
    return {name: item for name, item in config.intruders.items() if isinstance(item, Leg)}


def predicted_curves(medium: Medium) -> pd.DataFrame:
    """Predict the force on all legs in one medium by every profile that it has.

    A natural sand has the generic one alone, and none where its penetration test gives no number,
    which the penetration table says. A medium without a nine-term fit has no profile that needs one.
    """
    import pandas as pd

    sand = medium.name in medium.results.sands
    kinds = ("generic",) if sand else medium.kinds
    profiles = {kind: medium.profile(kind) for kind in kinds}
    config = medium.results.config
    parts = [
        leg_prediction(profile, leg, config).assign(medium=medium.name, leg=name, profile=kind)
        for kind, profile in profiles.items()
        if kind in ("table", "depth_only") or not profile.reason
        for name, leg in _legs(config).items()
    ]
    curves = (
        pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=PREDICTED_COLUMNS)
    )
    if sand and len(curves):
        curves.loc[curves["reason"] == "", "reason"] = medium.results.reference().note
    return curves


# --- Natural sands: the stated linear regime beside the detected one, and zeta from each.


SAND_COLUMNS = ["medium", "run_id", "window", "linear_to_cm", "alpha_z_N_per_cm3", "lo", "hi", "bend", "zeta",
           "zeta_lo", "zeta_hi", "reason"]  # fmt: skip


def natural_sands(results: Results) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Fit the penetration tests of the natural sands, and try corrections of their predicted forces.

    Returns slopes over the stated and the detected regime with zeta from each (chi is that of the
    reference media, which may be the published five), and the corrections with their validation.
    """
    import pandas as pd

    table = results.table("penetration.csv")
    method, note = results.config.fourier.method, ""
    chi = table.loc[table["method"] == method, "chi"].dropna().to_numpy(float)
    if (table["method"] == routine(method, printed=True)).any():
        chi, note = published().chi, published().note
    rows = []
    for medium in results.sands:
        facts = {row["run_id"]: row for row in results[medium].runs.to_dict("records")}
        found = _rows(results.campaign, results.table(f"tared/{medium}.parquet"), facts, chi)
        known = {row["run_id"] for row in found}
        for name, fact in sorted(facts.items()):
            if _is_test(run := results.campaign.by_id[name]) and name not in known:
                reason = (
                    fact["reason"] or f"it has no stroke, or its tare {run.tare_run} is of no use"
                )
                found.append(
                    {"medium": run.medium, "run_id": name, "window": "stated", "reason": reason}
                )
        rows += found
    for row in rows:
        if note and row["reason"] in ("", NO_TARE_FLAG):
            row["reason"] = "; ".join(filter(None, (str(row["reason"]), note)))
    curves = results.table("predicted.csv")
    measured = results.joined("legs/{medium}.csv", results.sands)
    if measured.empty:
        measured = pd.DataFrame(columns=["medium", "leg", "theta_deg", "force_z_N", "force_x_N"])
    tried = corrections(measured, curves[curves["profile"] == "generic"])
    return pd.DataFrame(rows, columns=SAND_COLUMNS), tried


def _is_test(run: Run) -> bool:
    """Whether a flat plate was pushed straight down."""
    place = (run.kind, run.direction, run.beta_deg, run.gamma_deg)
    return place == ("plate", "intrusion", 0, 90)


def _rows(
    campaign: Campaign, tared: pd.DataFrame, zeros: dict[str, Any], chi: FloatArray
) -> list[dict[str, Any]]:
    """Two rows for every flat plate that was pushed straight down."""
    rows: list[dict[str, Any]] = []
    for name, part in tared.groupby("run_id", observed=True, sort=True):
        run = campaign.by_id[str(name)]
        if not _is_test(run):
            continue
        plate = campaign.config.intruders[run.intruder]
        assert plate.shape != "leg"
        depth = part["depth_cm"].to_numpy(float)
        stress = part["force_z_N"].to_numpy(float) / plate.area_cm2
        pair = [zeros[name] for name in (run.run_id, run.tare_run) if name]
        variance = np.array([[fact["zero_var_z_N2"]] for fact in pair], dtype=float)
        zero = (variance / plate.area_cm2**2, np.array([[fact["zero_dof"]] for fact in pair]))
        stated = campaign.config.media[run.medium].linear_to_cm
        for window, end in (("stated", stated), ("detected", linear_end(depth, stress))):
            row: dict[str, Any] = {"medium": run.medium, "run_id": name, "window": window}
            row |= _fit(depth, stress, np.nan if end is None else end, zero, chi, campaign)
            if not run.tare_run:
                row["reason"] = "; ".join(filter(None, (row["reason"], NO_TARE_FLAG)))
            rows.append(row)
    return rows


def _fit(
    depth: FloatArray,
    stress: FloatArray,
    end: float,
    zero: tuple[FloatArray, FloatArray],
    chi: FloatArray,
    campaign: Campaign,
) -> dict[str, object]:
    part = np.isfinite(stress) & (depth > 0) & (depth <= end)
    if np.count_nonzero(part) < campaign.config.fit.min_points:
        return {"linear_to_cm": end, "reason": "no linear regime with enough samples"}
    depth, stress = depth[part], stress[part]
    slope = fit_slope(depth, stress[None], *zero)
    alpha, (lo, hi) = float(slope.alpha[0]), slope.interval(campaign.config.fit.confidence)
    row: dict[str, object] = {
        "linear_to_cm": end, "alpha_z_N_per_cm3": alpha, "lo": lo[0], "hi": hi[0], "bend": bend_of(depth, stress), "reason": "",
    }  # fmt: skip
    try:
        scaled = scale_new_medium(
            alpha, float(slope.se[0]), chi, np.zeros(9), campaign.config.fit.confidence
        )
    except ValueError as error:
        return row | {"reason": str(error)}
    return row | {"zeta": scaled.zeta, "zeta_lo": scaled.zeta_lo, "zeta_hi": scaled.zeta_hi}


# --- Ours beside the paper's: every published number that this chain can meet, with a verdict.


def validate(results: Results) -> pd.DataFrame:
    """Put this campaign's numbers beside the paper's: the reproduction table."""
    import pandas as pd

    settings = results.config
    published = {
        name: medium.published_as
        for name, medium in settings.media.items()
        if medium.published_as is not None
    }
    tables = {medium: results[medium].alpha for medium in results.laboratory}
    scaled = results.table("penetration.csv")
    items: list[Item] = []
    items += compare_alpha(tables, published)
    items += compare_coefficients(results.table("coefficients.csv"), published)
    items += compare_penetration(scaled, published)
    printed = (scaled["method"] == routine(settings.fourier.method, printed=True)).any()
    chi_of = "the published" if printed else "this campaign's"
    measured = results.joined("legs/{medium}.csv")
    items += leg_claims(results.table("leg_errors.csv"), measured, chi_of)
    if results.campaign.robot_medium:
        items += robot_claims(results.table("robot/errors.csv"), results.table("robot/optimum.csv"))
    items += slips()
    return pd.DataFrame([item.row() for item in items])
