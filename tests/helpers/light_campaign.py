"""A campaign without logs, and tables of alpha as the workflow writes them."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from paper import paper_values, write_yaml

from rftfit import reference
from rftfit.campaign.load import Campaign
from rftfit.measure.errors import SOURCES
from rftfit.measure.flags import MARKS, flag_table
from rftfit.results import Results
from rftfit.store import write_csv

LABORATORY, SAND = "laboratory", "natural_sand"
SE = 0.003


def alpha_frame(medium, values):
    """Alpha table of a medium with a known error."""

    columns: dict[str, Any] = {
        "medium": medium,
        "beta_deg": np.repeat(reference.BETA_DEG, 13),
        "gamma_deg": np.tile(np.round(reference.GAMMA_DEG, 4), 7),
    }
    for component, alpha in zip("zx", values, strict=True):
        flat = alpha.ravel()
        half = 1.96 * SE
        ends = {"_lo": -half, "_hi": half, "_lo_next": -2 * half, "_hi_next": 2 * half}
        for quantity, add in ({"": 0.0} | ends).items():
            columns[f"alpha_{component}{quantity}_N_per_cm3"] = flat + add
        known_mask = np.where(np.isnan(flat), np.nan, 1.0)
        columns[f"alpha_{component}_se_N_per_cm3"] = SE * known_mask
        for source in SOURCES:
            columns[f"alpha_{component}_{source}_N_per_cm3"] = SE * known_mask * (source == "noise")
    empty = np.isnan(values[0].ravel())
    columns |= {"depth_from_cm": 1.0, "depth_to_cm": 9.0, "tare_runs": ""}
    columns |= {"n_runs": np.where(empty, 0, 1), "n_depths": 0, "run_ids": "", "lost_run_ids": ""}
    columns |= {f"run_to_run_{c}_N_per_cm3": np.nan for c in "zx"}
    columns |= {
        "spread": "scatter between beds not included",
        "flagged": False,
        **dict.fromkeys(MARKS, ""),
    }
    columns |= {
        "reason": np.where(empty, "no run", ""),
        "reason_code": np.where(empty, "no-run", ""),
    }
    return pd.DataFrame(columns)


def one_cell(alpha_z):
    """Alpha of a natural sand: nothing but (0, 90 deg)."""
    z = np.full((7, 13), np.nan)
    z[3, -1] = alpha_z
    return z, np.where(np.isnan(z), np.nan, 0.0)


def make_campaign(root, roles, alpha, settings=None, without_runs=()):
    """Write configuration, run sheet and tables of alpha; its logs are missing, which is a warning.

    Returns the folder of results.
    """
    config = paper_values("robot")
    config |= {"raw": "raw", "run_sheet": "config/runs.csv", **(settings or {})}
    config["fit"] |= {"missing_tare": "flag"}
    config["media"] = {name: {"title": name, "role": role} for name, role in roles.items()}
    config["media"] |= {name: {"title": name} for name in without_runs}
    for name, role in roles.items():
        if role == SAND:
            config["media"][name]["linear_to_cm"] = 2
    (root / "raw").mkdir(parents=True)
    write_yaml(root / "config" / "config.yaml", config)
    rows = [
        f"{name},plate,{name},plate,intrusion,0,90,,{name}_f.csv,{name}_m.csv," for name in roles
    ]
    head = (
        "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,depth_cm,force_log,motion_log,"
        "tare_run"
    )
    (root / "config" / "runs.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    for medium, values in alpha.items():
        write_csv(alpha_frame(medium, values), root / "results" / "alpha" / f"{medium}.csv")
        write_csv(flag_table(medium, "checks", []), root / "results" / "flags" / f"{medium}.csv")
    return root / "results"


def results_of(tables, config):
    """Results that hold tables of alpha and nothing else, without a file."""
    names = [str(table["medium"].iloc[0]) for table in tables]
    runs: Any = tuple(SimpleNamespace(medium=name, kind="plate") for name in names)
    no_folder = Path("no campaign is here")
    results = Results(Campaign(no_folder, no_folder, no_folder, config, runs))
    results._tables = {f"alpha/{n}.csv": t for n, t in zip(names, tables, strict=True)}
    return results
