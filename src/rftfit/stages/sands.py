"""Natural sands: the stated linear regime beside the detected one, and zeta from each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.load import load_campaign
from rftfit.measure.slope import fit_slope
from rftfit.profile.reference_media import published, routine
from rftfit.profile.scaling import scale_new_medium
from rftfit.store import read_csv, read_parquet, write_csv
from rftfit.validate.sands import bend_of, linear_end

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.load import Campaign
    from rftfit.conventions import FloatArray

COLUMNS = ["medium", "run_id", "window", "linear_to_cm", "alpha_z_N_per_cm3", "lo", "hi", "bend", "zeta",
           "zeta_lo", "zeta_hi", "reason"]  # fmt: skip


def sands(
    config: Path, runs: list[Path], tared: list[Path], penetration: Path, sands: Path
) -> None:
    """Fit the penetration tests of the natural sands over the stated and the detected regime.

    Parameters
    ----------
    config : Path
    runs, tared : list of Path
        Read: errors of the zeros, and tared strokes, of each sand.
    penetration : Path
        Read: for chi of the reference media, which may be the published five.
    sands : Path
        Written (`COLUMNS`).

    Raises
    ------
    RftfitError
        If an input is not valid or the result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    table = read_csv(penetration)
    method, note = campaign.config.fourier.method, ""
    chi = table.loc[table["method"] == method, "chi"].dropna().to_numpy(float)
    if (table["method"] == routine(method, printed=True)).any():
        chi, note = published().chi, published().note
    zeros = {row["run_id"]: row for path in runs for row in read_csv(path).to_dict("records")}
    rows = [row for path in tared for row in _rows(campaign, read_parquet(path), zeros, chi)]
    for row in rows:
        row["reason"] = row["reason"] or note
    write_csv(pd.DataFrame(rows, columns=COLUMNS), sands)


def _rows(
    campaign: Campaign, tared: pd.DataFrame, zeros: dict[str, Any], chi: FloatArray
) -> list[dict[str, object]]:
    """Two rows for every flat plate that was pushed straight down."""
    rows: list[dict[str, object]] = []
    for name, part in tared.groupby("run_id", observed=True, sort=True):
        run = campaign.by_id[str(name)]
        plate = campaign.config.intruders[run.intruder]
        if plate.shape == "leg" or (run.beta_deg, run.gamma_deg) != (0, 90):
            continue
        if run.direction != "intrusion":
            continue
        depth = part["depth_cm"].to_numpy(float)
        stress = part["force_z_N"].to_numpy(float) / plate.area_cm2
        pair = (zeros[run.run_id], zeros[run.tare_run])
        variance = np.array([[fact["zero_var_z_N2"]] for fact in pair], dtype=float)
        zero = (variance / plate.area_cm2**2, np.array([[fact["zero_dof"]] for fact in pair]))
        stated = campaign.config.media[run.medium].linear_to_cm
        for window, end in (("stated", stated), ("detected", linear_end(depth, stress))):
            row: dict[str, object] = {"medium": run.medium, "run_id": name, "window": window}
            rows.append(
                row | _fit(depth, stress, np.nan if end is None else end, zero, chi, campaign)
            )
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
