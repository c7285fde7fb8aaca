"""Inputs of the report page, made from the published tables with the program's own functions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import yaml
from chain_tables import MISSING, alpha_table

from rftfit import reference
from rftfit.campaign.config import Config, Leg
from rftfit.compare.legs import leg_errors
from rftfit.measure.alpha import column, grid
from rftfit.model.fourier import TERMS, fit_lsq
from rftfit.model.motion import sweep
from rftfit.model.outlines import leg_outline
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic
from rftfit.model.scaling import generic, scale_new_medium, vertical_penetration
from rftfit.page.methods import Provenance
from rftfit.page.page import PageInputs

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile

CONFIG = Path(__file__).parents[2] / "config" / "config.yaml"
NASTY = "</script><script>window.hacked = 1</script><b>\"&'"
SAND_ALPHA = 0.689
HOLED = "glass3mm_CP"
"""The medium with missing cells."""


def page_inputs(nasty: bool = False) -> PageInputs:
    config = Config.model_validate(yaml.safe_load(CONFIG.read_text(encoding="utf-8")))
    if nasty:
        media = dict(config.media)
        media["poppy_LP"] = media["poppy_LP"].model_copy(update={"title": NASTY, "note": NASTY})
        config = config.model_copy(update={"media": media, "title": NASTY})
    alpha = {m: alpha_table(m, MISSING if m == HOLED else {}) for m in reference.MEDIA}
    fits = {m: _fit(table) for m, table in alpha.items()}
    m0 = generic(np.stack(list(fits.values())))
    measured = {m: float(reference.alpha_grid(m)[0][3, -1]) for m in fits}
    zeta = {m: float(vertical_penetration(own)) for m, own in fits.items()}
    chi = np.array([measured[m] / zeta[m] for m in fits])
    alpha["yuma"] = _one_test("yuma")
    penetration = [
        _penetration("lsq", m, measured[m], zeta[m], measured[m] / zeta[m]) for m in fits
    ]
    sand = scale_new_medium(SAND_ALPHA, 0.0, chi, m0)
    penetration.append(
        _penetration("scaling routine (lsq)", "yuma", SAND_ALPHA, sand.zeta, sand.chi)
    )
    profiles: dict[str, dict[str, Profile]] = {"yuma": {"generic": scaled_generic(sand.zeta, m0)}}
    for m, own in fits.items():
        table = TableProfile.from_table(alpha[m])
        profiles[m] = {
            "table": table,
            "fourier": FourierProfile(own),
            "generic": scaled_generic(zeta[m], m0),
            "depth_only": DepthOnlyProfile.of(table),
        }
    predicted = pd.concat([_curves(config, m, own) for m, own in profiles.items()])
    legs = predicted[predicted["profile"].isin(["table"])].drop(columns=["profile", "reason"])
    legs = legs.assign(
        force_z_N=0.9 * legs["force_z_N"],
        force_x_N=0.8 * legs["force_x_N"],
        run_id=legs["leg"],
        flags="",
    )
    reason = NASTY if nasty else "saturated throughout"
    rows = {**fits, "generic": m0}
    return PageInputs(
        config=config,
        alpha=alpha,
        coefficients=pd.concat([_coefficients(m, own) for m, own in rows.items()]),
        penetration=pd.DataFrame(penetration),
        reproduction=_reproduction(reason),
        ledger=_ledger(reason),
        runs=pd.DataFrame(
            {"run_id": ["p1", "p2"], "medium": ["poppy_LP", "poppy_LP"],
             "flags": ["zero drifted by 0.30 N", "gap of 1.51 s in the force log"]}
        ),
        fits=pd.DataFrame({"run_id": ["p1"], "medium": ["poppy_LP"], "flags": [""]}),
        legs=legs,
        predicted=predicted,
        leg_errors=leg_errors(legs, predicted),
        sands=pd.DataFrame(
            [{"medium": "yuma", "run_id": "y1", "window": "stated", "linear_to_cm": 2.0,
              "alpha_z_N_per_cm3": SAND_ALPHA, "bend": 0.11, "zeta": sand.zeta,
              "zeta_lo": sand.zeta_lo, "zeta_hi": sand.zeta_hi, "reason": ""}]
        ),
        sand_correction=pd.DataFrame(
            [{"medium": "yuma", "model": "one factor", "factor_z": 0.66, "factor_x": 0.66,
              "rms_fit_N": 1.93, "rms_cv_N": 2.41, "gain_cv_percent": 10.7,
              "earns_its_place": True}]
        ),
        provenance=Provenance({"rftfit": "9.9.9"}, "d1gest", {"the settings": "c0ffee"}),
    )  # fmt: skip


def _fit(table: pd.DataFrame) -> FloatArray:
    beta, gamma = np.radians(reference.BETA_DEG), np.radians(reference.GAMMA_DEG)
    return fit_lsq(beta, gamma, grid(table, column("z")), grid(table, column("x")))


def _one_test(medium: str) -> pd.DataFrame:
    table = alpha_table("poppy_LP", {}).assign(medium=medium, reason="no run", n_runs=0)
    other = ~((table["beta_deg"] == 0) & (table["gamma_deg"] == 90))
    numbers = [name for name in table.columns if name.startswith("alpha_")]
    table.loc[other, numbers] = np.nan
    table.loc[~other, column("z")] = SAND_ALPHA
    table.loc[~other, "reason"] = ""
    return table


def _penetration(
    method: str, medium: str, alpha: float, zeta: float, chi: float
) -> dict[str, object]:
    row: dict[str, object] = {"method": method, "medium": medium, "reason": ""}
    for name, value in (("alpha_z_measured", alpha), ("alpha_z_fit", zeta)):
        for quantity, factor in (("", 1.0), ("_lo", 0.99), ("_hi", 1.01)):
            row[f"{name}{quantity}_N_per_cm3"] = value * factor
    for name, value in (("chi", chi), ("zeta", zeta)):
        for quantity, factor in (("", 1.0), ("_lo", 0.99), ("_hi", 1.01)):
            row[f"{name}{quantity}"] = value * factor
    return row


def _coefficients(medium: str, values: FloatArray) -> pd.DataFrame:
    return pd.DataFrame(
        {"method": "lsq", "medium": medium, "coefficient": list(TERMS), "value_N_per_cm3": values,
         "lo": values - 0.001, "hi": values + 0.001, "kept": True, "reason": ""}
    )  # fmt: skip


def _curves(config: Config, medium: str, profiles: dict[str, Profile]) -> pd.DataFrame:
    parts = []
    for leg, item in config.intruders.items():
        if not isinstance(item, Leg):
            continue
        for name, profile in profiles.items():
            forces = sweep(profile, leg_outline(item), None, item.hip_height_cm)
            frame = pd.DataFrame({"medium": medium, "leg": leg, "profile": name,
                                  "theta_deg": np.arange(-135, 136)})  # fmt: skip
            for c, values in (("z", forces.force_z_N), ("x", forces.force_x_N)):
                frame[f"force_{c}_N"] = values
                frame[f"force_{c}_lo_N"] = values - 0.1
                frame[f"force_{c}_hi_N"] = values + 0.1
            parts.append(frame.assign(moment_N_cm=forces.moment_N_cm, reason=forces.reason))
    return pd.concat(parts, ignore_index=True)


def _reproduction(why: str) -> pd.DataFrame:
    columns = ["item", "where", "paper", "ours", "lo", "hi", "verdict", "why"]
    rows = [
        [
            "poppy_LP: A00, N/cm^3",
            "Table S2",
            0.051,
            0.0508,
            0.0507,
            0.0509,
            "same",
            "within 0.002",
        ],
        ["poppy_LP: zeta", "Table S2", 0.248, 0.2564, np.nan, np.nan, "paper inconsistent", why],
        ["chi, mean", "text", 1.26, 1.13, 1.0, 1.2, "differs", "another fit"],
    ]
    return pd.DataFrame(rows, columns=columns)


def _ledger(reason: str) -> pd.DataFrame:
    columns = ["run_id", "medium", "kind", "file", "fate", "reason", "rows"]
    rows: list[list[object]] = [
        ["air", "", "leg_air", "a.csv", "used", "tare", 100],
        ["p1", "poppy_LP", "plate", "p1.csv", "used", "slope", 400],
        ["p1", "poppy_LP", "plate", "p1.csv", "dropped", "approach", 60],
        ["p1_rod", "poppy_LP", "rod", "p1_rod.csv", "used", "tare", 500],
        ["p2", "poppy_LP", "plate", "p2.csv", "used", "zero of the transducer", 90],
        ["p2", "poppy_LP", "plate", "p2.csv", "dropped", "approach", 60],
        ["p2", "poppy_LP", "plate", "p2.csv", "dropped", reason, 300],
        ["y1", "yuma", "plate", "y1.csv", "used", "slope", 200],
    ]
    return pd.DataFrame(rows, columns=columns)
