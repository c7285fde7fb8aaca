"""Stages that put the force model on trial: legs, natural sands, published numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rftfit.campaign.config import Leg
from rftfit.campaign.load import load_campaign
from rftfit.compare.legs import laboratory_candidates, leg_errors, leg_prediction, sand_prediction
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
from rftfit.model.scaling import (
    MediumFit,
    fit_media,
    published,
    reference_of,
    routine,
    scale_new_medium,
)
from rftfit.page.page import read_inputs, write_page
from rftfit.page.workbooks import write_alpha_workbook, write_coefficient_workbook
from rftfit.reference import MEDIA
from rftfit.store import read_csv, read_parquet, write_csv

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.compare.published import Item
    from rftfit.conventions import FloatArray


# --- Stage 7: the force model on trial, against the measured legs.


PREDICTED_COLUMNS = ["medium", "leg", "profile", "theta_deg", "force_z_N", "force_z_lo_N", "force_z_hi_N",
           "force_x_N", "force_x_lo_N", "force_x_hi_N", "moment_N_cm", "reason"]  # fmt: skip


def trials(
    config: Path, alpha: list[Path], sands: list[Path], legs: list[Path],
    predicted: Path, errors: Path,
) -> None:  # fmt: skip
    """Predict the force on every leg in every medium, and compare with what was measured.

    `alpha`, `sands`, `legs`: Read: alpha tables of laboratory media and of sands, measured leg
    curves. `predicted`, `errors`: Written: curves with intervals, and how far they are from the
    measured ones.
    """
    import pandas as pd

    settings = load_campaign(config).config
    tables = [read_csv(path) for path in alpha]
    fits = [f for f in fit_media(tables, settings) if f.method == settings.fourier.method]
    curves = [laboratory_curves(table, fits, settings) for table in tables]
    beds = [read_csv(path) for path in sands]
    curves += [sand_curves(table, fits, settings) for table in beds]
    everything = pd.concat(curves, ignore_index=True)[PREDICTED_COLUMNS]
    write_csv(everything, predicted)
    measured = pd.concat([read_csv(path) for path in legs], ignore_index=True)
    spread = {str(t["medium"].iloc[0]): bed_spread(t) for t in (*tables, *beds)}
    compared = leg_errors(measured, everything, spread, settings.fit.confidence)
    # a curve from the published media says so in this table too
    names = [str(t["medium"].iloc[0]) for t in beds]
    note = reference_of(fits, settings).note
    silent = compared["medium"].isin(names) & compared["reason"].isin(["", NO_TARE_FLAG])
    compared.loc[silent, "reason"] = [
        "; ".join(filter(None, (reason, note))) for reason in compared.loc[silent, "reason"]
    ]
    write_csv(compared, errors)


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


def laboratory_curves(table: pd.DataFrame, fits: list[MediumFit], config: Config) -> pd.DataFrame:
    """Predict the force on all legs in one medium that was measured over the grid.

    `table`: Its alpha table. `fits`: Of all laboratory media, by the config's method. Returns
    columns `COLUMNS`.
    """
    import pandas as pd

    medium = str(table["medium"].iloc[0])
    own = next(fit for fit in fits if fit.medium == medium)
    reference = [fit for fit in fits if not fit.reason]
    parts = [
        leg_prediction(candidate, leg, config).assign(
            medium=medium, leg=name, profile=candidate.name
        )
        for candidate in laboratory_candidates(table, own, reference, config)
        for name, leg in _legs(config).items()
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=PREDICTED_COLUMNS)


def sand_curves(table: pd.DataFrame, fits: list[MediumFit], config: Config) -> pd.DataFrame:
    """Predict the force on all legs in one natural sand from its penetration test.

    `table`: Its alpha table. `fits`: Of the laboratory media; with fewer than two usable ones the
    published five serve. Returns columns `COLUMNS`; empty where the test gives no number, which
    the penetration table says.
    """
    import pandas as pd

    medium = str(table["medium"].iloc[0])
    reference = reference_of(fits, config)
    try:
        parts = [
            sand_prediction(table, reference, leg, config).assign(
                medium=medium, leg=name, profile="generic"
            )
            for name, leg in _legs(config).items()
        ]
    except ValueError:
        parts = []
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=PREDICTED_COLUMNS)


# --- Natural sands: the stated linear regime beside the detected one, and zeta from each.


SAND_COLUMNS = ["medium", "run_id", "window", "linear_to_cm", "alpha_z_N_per_cm3", "lo", "hi", "bend", "zeta",
           "zeta_lo", "zeta_hi", "reason"]  # fmt: skip


def sands(
    config: Path, runs: list[Path], tared: list[Path], penetration: Path, sands: Path
) -> None:
    """Fit the penetration tests of the natural sands over the stated and the detected regime.

    `runs`, `tared`: Read: errors of the zeros, and tared strokes, of each sand. `penetration`:
    Read: for chi of the reference media, which may be the published five. `sands`: Written
    (`COLUMNS`).
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
    known = {row["run_id"] for row in rows}
    for name, fact in sorted(zeros.items()):
        if _is_test(run := campaign.by_id[name]) and name not in known:
            reason = fact["reason"] or f"it has no stroke, or its tare {run.tare_run} is of no use"
            rows.append(
                {"medium": run.medium, "run_id": name, "window": "stated", "reason": reason}
            )
    for row in rows:
        if note and row["reason"] in ("", NO_TARE_FLAG):
            row["reason"] = "; ".join(filter(None, (row["reason"], note)))
    write_csv(pd.DataFrame(rows, columns=SAND_COLUMNS), sands)


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


# --- Cross-validated correction of the scaled generic profile in natural sands.


def correction(legs: list[Path], predicted: Path, correction: Path) -> None:
    """Fit and cross-validate corrections in every natural sand.

    `legs`: Read: measured leg curves of the sands. `predicted`: Read: predictions of the trials
    stage. `correction`: Written.
    """
    import pandas as pd

    curves = read_csv(predicted)
    empty = pd.DataFrame(columns=["medium", "leg", "theta_deg", "force_z_N", "force_x_N"])
    measured = pd.concat([read_csv(path) for path in legs]) if legs else empty
    write_csv(corrections(measured, curves[curves["profile"] == "generic"]), correction)


# --- Ours beside the paper's: every published number that this chain can meet, with a verdict.


def reproduction(
    config: Path,
    alpha: list[Path],
    coefficients: Path,
    penetration: Path,
    errors: Path,
    legs: list[Path],
    reproduction: Path,
    robot_errors: list[Path] | None = None,
    robot_optimum: list[Path] | None = None,
) -> None:
    """Write the reproduction table.

    `coefficients`, `penetration`, `errors`: Read: tables of the earlier stages. `legs`: Read:
    measured leg curves. `reproduction`: Written: `item, where, paper, ours, lo, hi, verdict, why`.
    `robot_errors`, `robot_optimum`: Read: tables of the robot, where the campaign has one.
    """
    import pandas as pd

    settings = load_campaign(config).config
    published = {
        name: medium.published_as
        for name, medium in settings.media.items()
        if medium.published_as is not None
    }
    tables = {str(t["medium"].iloc[0]): t for t in (read_csv(path) for path in alpha)}
    values = read_csv(coefficients)
    items: list[Item] = []
    items += compare_alpha(tables, published)
    items += compare_coefficients(values, published)
    scaled = read_csv(penetration)
    items += compare_penetration(scaled, published)
    measured = pd.concat([read_csv(path) for path in legs], ignore_index=True)
    printed = (scaled["method"] == routine(settings.fourier.method, printed=True)).any()
    chi_of = "the published" if printed else "this campaign's"
    items += leg_claims(read_csv(errors), measured, chi_of)
    for compared, best in zip(robot_errors or [], robot_optimum or [], strict=True):
        items += robot_claims(read_csv(compared), read_csv(best))
    items += slips()
    write_csv(pd.DataFrame([item.row() for item in items]), reproduction)


# --- Workbooks in the layouts of Tables S5 and S2.


def workbooks(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path,
    alpha_tables: Path, coefficient_tables: Path,
) -> None:  # fmt: skip
    """Write the alpha tables and the coefficients as workbooks.

    `coefficients`, `penetration`: Read: tables of the earlier stages. `alpha_tables`,
    `coefficient_tables`: Written (xlsx).
    """
    settings = load_campaign(config).config
    titles = {name: medium.title for name, medium in settings.media.items()}
    published = {
        name: medium.published_as
        for name, medium in settings.media.items()
        if medium.published_as in MEDIA
    }
    level = settings.fit.confidence
    tables = [read_csv(path) for path in alpha]
    write_alpha_workbook(
        {str(table["medium"].iloc[0]): table for table in tables}, alpha_tables, titles, level
    )
    write_coefficient_workbook(
        read_csv(coefficients), coefficient_tables,
        {name: key for name, key in published.items() if key} | {"generic": "generic"},
        read_csv(penetration), titles, level,
    )  # fmt: skip


# --- The report page of a run.


def page(
    config: Path, alpha: list[Path], coefficients: Path, penetration: Path, reproduction: Path,
    ledger: Path, runs: list[Path], fits: list[Path], legs: list[Path], predicted: Path,
    leg_errors: Path, sands: Path, sand_correction: Path, code: str, settings: str, rows: str,
    report: Path, robot: list[Path] | None = None,
) -> None:  # fmt: skip
    """Write the report page.

    `alpha`, `runs`, `fits`, `legs`: Read: tables of each medium. `coefficients`, `penetration`,
    `reproduction`, `ledger`, `predicted`, `leg_errors`, `sands`: Read: tables of the run.
    `sand_correction`: Read. `code`, `settings`, `rows`: Digests of the program's source, of the
    settings and of the run sheet, for the provenance. `report`: Written (html). `robot`: Read:
    speeds, errors, optima and pictures of the robot, in this order.
    """
    inputs = read_inputs(
        config, alpha=alpha, coefficients=coefficients, penetration=penetration,
        reproduction=reproduction, ledger=ledger, runs=runs, fits=fits, legs=legs,
        predicted=[predicted], leg_errors=leg_errors, sands=sands, sand_correction=sand_correction,
        code=code, digests={"the settings": settings, "the run sheet": rows}, robot=robot or [],
    )  # fmt: skip
    write_page(inputs, report)
