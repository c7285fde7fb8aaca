"""Results made by hand from the published tables: of the measurement chain, of a campaign without logs, of the page."""

import atexit
import json
import shutil
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import row_of_push, write_campaign
from paper import paper_config, paper_values
from pushes import plate_run

from rftfit import (
    DepthOnlyProfile,
    FourierProfile,
    Profile,
    Results,
    TableProfile,
    model_leg,
    predict,
    reference,
    rotation,
    scaled_generic,
)
from rftfit.campaign.config import Leg
from rftfit.campaign.load import Campaign
from rftfit.compare.legs import leg_errors
from rftfit.compare.robot import optima
from rftfit.errors import InputError
from rftfit.forces import prediction
from rftfit.measure.alpha import alpha_columns, column
from rftfit.measure.flags import attach_run, flag_table, remark
from rftfit.measure.ledger import RowStatus
from rftfit.model import posterior
from rftfit.model.fourier import TERMS, fit_lsq
from rftfit.model.scaling import generic, published, scale_new_medium, vertical_penetration
from rftfit.outputs.dictionary import describe_file
from rftfit.page import live
from rftfit.results import Tables
from rftfit.robot.speeds import published_speeds, speed_errors
from rftfit.robot.sweep import CALIBRATED_ON
from rftfit.store import write_csv
from rftfit.workflow.validate import estimated_map_rows

# --- Tables of results in any copy of their folder, and tables that a command wrote -------------------------------


def read_result(path):
    """Read a table of results, typed as the dictionary says; its name is the longest end of the path that the dictionary knows."""
    names = {folder: path.relative_to(folder).as_posix() for folder in reversed(path.parents)}
    folder, name = next(
        (folder, name) for folder, name in names.items() if describe_file(f"results/{name}")
    )
    return Tables(folder).table(name)


def read_output(path):
    """Read what a command wrote below lines of comment; untyped, since cells may be of any kind."""
    return pd.read_csv(path, comment="#")


# --- A campaign without logs, and tables of alpha as the workflow writes them -------------------------------------

LABORATORY, SAND = "laboratory", "natural_sand"
SE = 0.003
SOURCES = [
    "noise",
    "startup",
    "surface",
    "angle",
    "bed",
    "curvature",
    "tare",
    "rod",
    "session",
    "turn",
]
"""Sources of the error of alpha, each with a column."""


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
    columns |= {"spread": "scatter between beds not included", "flagged": False}
    columns |= {"checks": "", "checks_code": ""}
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


def make_campaign(root, roles, alpha, settings=None):
    """Write configuration, run sheet and tables of alpha; its logs are missing, which is a warning.

    Returns the folder of results.
    """
    config = paper_values("robot")
    config |= {"raw": "raw", "run_sheet": "config/runs.csv", **(settings or {})}
    config["fit"] |= {"missing_tare": "flag"}
    config["media"] = {name: {"title": name, "role": role} for name, role in roles.items()}
    for name, role in roles.items():
        if role == SAND:
            config["media"][name]["linear_to_cm"] = 2
    rows = [
        row_of_push(run_id=name, medium=name, force_log=f"{name}_f.csv", motion_log=f"{name}_m.csv")
        for name in roles
    ]
    write_campaign(root, config, rows=rows)
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


# --- Tables of the measurement chain, built from the published ones, for the tests of figures ---------------------

MISSING = {(-30.0, 45.0): "no tare: rod_p_017 is too short", (90.0, -90.0): "surface not found"}


def alpha_table(medium, missing=MISSING):
    table = alpha_frame(medium, reference.alpha_grid(medium))
    table["run_ids"] = [f"{medium}_{place:03d}" for place in range(len(table))]
    numbers = [name for name in table.columns if name.startswith("alpha_")]
    for (b, g), reason in missing.items():
        is_cell = (table["beta_deg"] == b) & np.isclose(table["gamma_deg"], g)
        table.loc[is_cell, numbers] = np.nan
        table.loc[is_cell, ["reason", "n_runs"]] = reason, 0
    return table


def coefficient_table():
    rows = []
    for method, shift in (("lsq", 0.002), ("dft-index", 0.0)):
        for medium in (*reference.MEDIA, "generic"):
            printed = reference.coefficients(medium)
            for i, term in enumerate(TERMS):
                value = printed[term] + shift * (-1) ** i or 0.0012
                half = 0.004 + 0.02 * abs(value)
                rows.append(
                    {
                        "method": method,
                        "medium": medium,
                        "coefficient": term,
                        "value_N_per_cm3": value,
                        "se": half / 2,
                        "lo": value - half,
                        "hi": value + half,
                        "relative_to_A00": value / printed["A00"],
                        "kept": printed[term] != 0,
                    }
                )
    return pd.DataFrame(rows)


def penetration_table():
    zetas = {m: sum(reference.coefficients(m)[term] for term in TERMS[:5]) for m in reference.MEDIA}
    rows = [
        {
            "method": method,
            "medium": medium,
            "zeta": zeta,
            "zeta_lo": 0.98 * zeta,
            "zeta_hi": 1.02 * zeta,
            "chi": 1.2,
            "chi_lo": 1.1,
            "chi_hi": 1.3,
        }
        for method in ("lsq", "dft-index")
        for medium, zeta in zetas.items()
    ]
    return pd.DataFrame(rows)


def runs(medium, samples=700):
    """Traces and fits of one medium: 42 intrusions, 42 extractions, 21 horizontal runs."""
    rng = np.random.default_rng(3)
    parts: list[tuple[pd.DataFrame, dict[str, object]]] = []
    for i, beta in enumerate(reference.BETA_DEG):
        for j, gamma in enumerate(reference.GAMMA_DEG):
            z, x = (grid[i, j] for grid in reference.alpha_grid(medium))
            kind = "horizontal" if gamma == 0 else "intrusion" if gamma > 0 else "extraction"
            for level in (2.54, 5.08, 7.62) if gamma == 0 else (np.nan,):
                name = f"{medium}_{len(parts):04d}"
                trace, fit = one_run(name, kind, level, z, x, rng, samples)
                parts.append(
                    (trace, fit | {"medium": medium, "beta_deg": beta, "gamma_deg": gamma})
                )
    traces, fits = zip(*parts, strict=True)
    return pd.concat(traces, ignore_index=True), pd.DataFrame(fits)


def one_run(run, kind, level, alpha_z, alpha_x, rng, samples):
    path, flat = np.linspace(0, 8, samples), kind == "horizontal"
    depth = np.full(samples, level) if flat else path
    window = path > 2 if flat else (path > 0.6) & (path < 6.5)
    rise = 1 - (1.0 if flat else 0.4) * np.exp(-path)
    trace = pd.DataFrame({"run_id": run, "depth_cm": depth, "path_cm": path, "in_window": window})
    low, high = (level, level) if flat else (0.6, 6.5)
    fit: dict[str, object] = {
        "run_id": run,
        "direction": kind,
        "mirrored": kind == "extraction",
        "note": "",
        "reason": "",
        "depth_from_cm": low,
        "depth_to_cm": high,
        "n_points": int(window.sum()),
    }
    turn = -1 if kind == "extraction" else 1
    for c, alpha, sign in (("z", alpha_z, 1), ("x", alpha_x, turn)):
        noise = np.convolve(rng.normal(0, 0.012, samples), np.ones(5) / 5, "same")
        trace[f"stress_{c}_N_per_cm2"] = sign * alpha * depth * rise + noise
        trace[f"tare_{c}_N_per_cm2"] = 0.08 * sign * alpha * depth + noise[::-1]
        half = 0.002 + 0.01 * abs(alpha)
        for end, value in (("", alpha), ("_lo", alpha - half), ("_hi", alpha + half)):
            fit[f"alpha_{c}{end}_N_per_cm3"] = value
    return trace.iloc[::turn], fit


# --- Results whose tables are at hand instead of in files, for tests of what is made from them --------------------

PLATE_CM2 = 3.81 * 2.54


class Memory(Results):
    """Tables by their names; one of several media stands under ``folder/{medium}.csv``."""

    def __init__(self, campaign, tables):
        super().__init__(campaign)
        self.tables = tables

    def table(self, name):
        for pattern, table in self.tables.items():
            head, _, tail = pattern.partition("{medium}")
            if name == pattern:
                return table.copy(deep=False)
            if tail and name.startswith(head) and name.endswith(tail):
                medium = name.removeprefix(head).removesuffix(tail)
                rows_of_medium = table[table["medium"] == medium]
                return (
                    rows_of_medium.drop(columns="medium") if tail == ".parquet" else rows_of_medium
                )
        raise InputError(f"{name}: there is no such table")


def memory(tables, media=reference.MEDIA, runs=(), **settings):
    """The demonstration campaign with these media and tables, its settings changed by section."""
    every = [*runs] or [
        run(f"{medium}_{kind}", medium, kind) for medium in media for kind in ("plate", "leg")
    ]
    # results of the folder in which the tests run must not be found
    no_folder = Path("no campaign is here")
    return Memory(
        Campaign(no_folder, no_folder, no_folder, paper_config(**settings), tuple(every)), tables
    )


def run(run_id, medium, kind="plate", **cells):
    """A row of the run sheet."""
    intruder = {"leg": "c_leg"}.get(kind, kind)
    return plate_run(run_id, medium=medium, kind=kind, intruder=intruder, **cells)


def of_runs(traces, fits, **settings):
    """Results of plate runs: their samples as the tare and slope stages leave them.

    `traces`: Stress in the lab frame, as `chain_tables.one_run` makes it.
    """
    medium = traces["run_id"].map(fits.drop_duplicates("run_id").set_index("run_id")["medium"])
    tared = traces[["run_id", "depth_cm", "path_cm"]].assign(medium=medium)
    for c in "zx":
        tared[f"force_{c}_N"] = traces[f"stress_{c}_N_per_cm2"] * PLATE_CM2
        tared[f"tare_{c}_N"] = traces[f"tare_{c}_N_per_cm2"] * PLATE_CM2
    windows = traces[["run_id"]].assign(medium=medium, why=int(RowStatus.ABOVE))
    windows["why"] = windows["why"].where(~traces["in_window"], int(RowStatus.GOOD))
    rows = fits.drop_duplicates("run_id").to_dict("records")
    runs = [run(str(r["run_id"]), str(r["medium"]), direction=str(r["direction"])) for r in rows]
    tables = {
        "tared/{medium}.parquet": tared,
        "windows/{medium}.parquet": windows,
        "fits/{medium}.csv": fits,
        "alpha/{medium}.csv": cells_of_runs(fits),
        "flags/{medium}.csv": flag_table("", "checks", []),
    }
    return memory(tables, runs=runs, **settings)


def cells_of_runs(fits):
    """Table of alpha of runs that are alone in their direction, with intervals wider than those of single logs."""
    cells = fits.assign(run_ids=fits["run_id"], n_runs=1)
    for c in "zx" if "alpha_z_N_per_cm3" in fits else "":
        alpha = fits[f"alpha_{c}_N_per_cm3"]
        for end in ("lo", "hi"):
            name = f"alpha_{c}_{end}_N_per_cm3"
            cells[name] = cells[f"alpha_{c}_{end}_next_N_per_cm3"] = alpha + 10 * (
                fits[name] - alpha
            )
        cells[f"alpha_{c}_se_N_per_cm3"] = abs(cells[name] - alpha) / 2
    return cells


# --- Campaigns whose results are made from the published tables, for the tests of the report page -----------------

NASTY = "</script><script>window.hacked = 1</script><b>\"&'"
SAND_ALPHA = 0.689
HOLED = "glass3mm_CP"
"""The medium with missing cells."""
THETA_DEG = np.arange(-135, 136, 5)
SINGLE = (
    "coefficients",
    "penetration",
    "reproduction",
    "ledger",
    "predicted",
    "leg_errors",
    "contacts",
    "sands",
    "sand_correction",
)
OF_MEDIA = ("flags", "checks", "alpha", "maps", "runs", "tares", "fits", "legs")


def bare_campaign(folder, names, *, robot=False, **changes):
    """A campaign that has media but not a row of results; `changes` are sections of its config."""
    config = paper_config(**(changes if robot else {"robot": None} | changes))
    runs = tuple(
        plate_run(f"{medium}_1", medium=medium, row=row)
        for row, medium in enumerate(names, start=2)
    )
    results = Results(Campaign(folder, folder / "raw", folder / "runs.csv", config, runs))
    for name in [*SINGLE, *(f"{kind}/{medium}" for kind in OF_MEDIA for medium in names)]:
        write(results, f"{name}.csv", pd.DataFrame())
    return results


def write(results, name, table):
    """Write a table; columns that the test does not care about get something of their kind."""
    described = describe_file(f"results/{name}")
    assert described is not None
    fillers: dict[str, Any] = {"text": "", "yes or no": True}
    always = [column for column in described.columns if not column.when and "<" not in column.name]
    lacking: dict[str, Any] = {
        key: fillers.get(column.kind, np.nan)
        for column in always
        for key in column.names
        if key not in table
    }
    write_csv(table.assign(**lacking), results.root / "results" / name)


def page_results(folder, *, nasty=False, robot=False):
    """The paper's five media and one sand, with legs; with the robot, if wanted."""
    campaign = _page_results(nasty, robot)
    shutil.copytree(campaign.root, folder, dirs_exist_ok=True)
    return Results(replace(campaign, root=folder, raw=folder / "raw", sheet=folder / "runs.csv"))


@cache
def _page_results(nasty, robot):
    temporary = TemporaryDirectory()
    atexit.register(temporary.cleanup)
    folder = Path(temporary.name)
    changes: dict[str, Any] = {}
    if nasty:
        media = dict(paper_config().media)
        media["poppy_LP"] = media["poppy_LP"].model_copy(update={"title": NASTY, "note": NASTY})
        changes = {"media": media, "title": NASTY}
    results = bare_campaign(folder, (*reference.MEDIA, "yuma"), robot=robot, **changes)
    for name, table in paper_tables().items():
        write(results, f"{name}.csv", table)
    reason = NASTY if nasty else "saturated throughout"
    write(results, "maps/yuma.csv", estimated_map_rows(results, "yuma"))
    write(results, "reproduction.csv", _table("reproduction").fillna({"why": reason}))
    write(results, "ledger.csv", _ledger(reason))
    if robot:
        write_robot(results)
    return results.campaign


@cache
def paper_tables():
    """Results of the paper's media and one sand, by name."""
    config = paper_config()
    tables = {f"alpha/{m}": alpha_table(m, MISSING if m == HOLED else {}) for m in reference.MEDIA}
    fits = {m: _fit(tables[f"alpha/{m}"]) for m in reference.MEDIA}
    m0 = generic(np.stack(list(fits.values())))
    zeta = {m: float(vertical_penetration(coefficients)) for m, coefficients in fits.items()}
    measured = {m: float(reference.alpha_grid(m)[0][3, -1]) for m in fits}
    chi = {m: measured[m] / zeta[m] for m in fits}
    sand = scale_new_medium(SAND_ALPHA, 0.0, np.array(list(chi.values())))
    profiles: dict[str, dict[str, Profile]] = {"yuma": {"generic": scaled_generic(sand.zeta, m0)}}
    for m, coefficients in fits.items():
        table = TableProfile.from_table(tables[f"alpha/{m}"])
        profiles[m] = {
            "table": table,
            "fourier": FourierProfile(coefficients),
            "generic": scaled_generic(zeta[m], m0),
            "depth_only": DepthOnlyProfile.of(table),
        }
    predicted = pd.concat(
        [
            curves(config, name, profile, m)
            for m, profile_by_name in profiles.items()
            for name, profile in profile_by_name.items()
        ]
    )
    legs = predicted[predicted["profile"] == "table"].drop(columns=["profile", "reason"])
    legs = legs.assign(
        force_z_N=0.9 * legs["force_z_N"], force_x_N=0.8 * legs["force_x_N"], run_id=legs["leg"]
    )
    tables |= {f"legs/{m}": legs[legs["medium"] == m] for m in profiles}
    rows = [_penetration("lsq", m, measured[m], zeta[m], chi[m]) for m in fits]
    rows.append(_penetration("scaling routine (lsq)", "yuma", SAND_ALPHA, sand.zeta, sand.chi))
    flags = [remark("zero-drifted", newtons=0.3), remark("gap", seconds=1.51)]
    return tables | {
        "alpha/yuma": _one_test("yuma"),
        "runs/poppy_LP": pd.DataFrame({"run_id": ["p1", "p2"]}),
        "fits/poppy_LP": pd.DataFrame({"run_id": ["p1", "p2"], column("z"): measured["poppy_LP"]}),
        "fits/yuma": pd.DataFrame({"run_id": ["y1"], column("z"): SAND_ALPHA}),
        "flags/poppy_LP": flag_table(
            "poppy_LP",
            "ingest",
            [
                flag
                for i, run_flag in enumerate(flags, 1)
                for flag in attach_run(f"p{i}", [run_flag])
            ],
        ),
        "coefficients": pd.concat(
            [_coefficients(m, coefficients) for m, coefficients in {**fits, "generic": m0}.items()]
        ),
        "penetration": pd.DataFrame(rows),
        "predicted": predicted,
        "leg_errors": leg_errors(legs, predicted),
        "contacts": _table("contacts"),
        "sands": _table("sands").assign(zeta=sand.zeta, zeta_lo=sand.zeta_lo, zeta_hi=sand.zeta_hi),
        "sand_correction": _table("sand_correction"),
    }


def _table(name):
    """Read a table of results that was made by hand."""
    return pd.read_csv(Path(__file__).parent / "data" / f"{name}.csv")


def sand_results(folder):
    """One natural sand alone, scaled with the published media."""
    results = bare_campaign(folder, ("yuma",))
    chi, m0 = published().chi, published().m0
    sand = scale_new_medium(SAND_ALPHA, 0.0, chi)
    method = "scaling routine (lsq, published media)"
    row = _penetration(method, "yuma", SAND_ALPHA, sand.zeta, sand.chi)
    predicted = curves(results.config, "generic", scaled_generic(sand.zeta, m0), "yuma")
    write(results, "alpha/yuma.csv", _one_test("yuma"))
    write(results, "penetration.csv", pd.DataFrame([row]))
    write(results, "predicted.csv", predicted)
    return results


def empty_grid_results(folder):
    """One laboratory medium of which no run gave an alpha: a grid of reasons, no coefficient."""
    intruders = paper_config().intruders
    plates = {
        name: intruder for name, intruder in intruders.items() if not isinstance(intruder, Leg)
    }
    results = bare_campaign(folder, ("poppy_LP",), intruders=plates)
    angles = [(b, g) for b in reference.BETA_DEG for g in reference.GAMMA_DEG]
    table = alpha_table("poppy_LP", dict.fromkeys(angles, "no tare"))
    nothing = np.full(len(TERMS), np.nan)
    write(results, "alpha/poppy_LP.csv", table)
    write(results, "coefficients.csv", _coefficients("poppy_LP", nothing))
    row = _penetration("lsq", "poppy_LP", np.nan, np.nan, np.nan)
    write(results, "penetration.csv", pd.DataFrame([row]))
    return results


def curves(config, name, profile, medium):
    """Forces that a profile predicts for every leg of the config."""
    parts = []
    for leg in config.legs:
        forces = predict(profile, model_leg(leg), rotation(THETA_DEG), model_error=0)
        frame = pd.DataFrame(
            {"medium": medium, "leg": leg, "profile": name, "theta_deg": THETA_DEG}
        )
        for c in "zx":
            for end, add in {"": 0.0, "_lo": -0.1, "_hi": 0.1}.items():
                frame[f"force_{c}{end}_N"] = forces[f"force_{c}_N"] + add
        parts.append(frame.assign(moment_N_cm=forces["moment_N_cm"], reason=profile.reason))
    return pd.concat(parts, ignore_index=True)


def write_robot(results):
    """Simulated speeds at fixed ratios to the measured ones, and pictures of two runs."""
    measured = published_speeds("poppy_LP", list(CALIBRATED_ON.values()))
    simulated, sweeps = [], []
    for name, factor in (("table", 1.1), ("depth_only", 2.0)):
        speed = factor * measured["speed_cm_per_s"]
        conditions = measured[["curvature_times_R", "frequency_Hz"]].assign(profile=name, reason="")
        ends = {f"speed{end}_cm_per_s": speed for end in ("", "_lo", "_hi")}
        simulated.append(conditions.assign(**ends))
        runs = [(round(k, 2), f) for k in np.arange(-1, 1.01, 0.2) for f in (1.0, 5.0)]
        sweep = pd.DataFrame(runs, columns=["curvature_times_R", "frequency_Hz"])
        shape = 15 - 4 * (sweep["curvature_times_R"] - 0.5) ** 2
        sweep["speed_cm_per_s"] = shape * sweep["frequency_Hz"]
        sweeps.append(
            sweep.assign(profile=name, medium="poppy_LP", phase_turns=0.0, outcome="steady")
        )
    speeds = pd.concat(sweeps, ignore_index=True)
    write(results, "robot/speed.csv", speeds)
    write(results, "robot/errors.csv", speed_errors(measured, pd.concat(simulated)))
    write(results, "robot/optimum.csv", optima(speeds))
    write(results, "robot/measured.csv", measured)
    for name in ("tracks", "strides"):
        write(results, f"robot/{name}.csv", pd.DataFrame())
    path = results.root / "results" / "robot" / "frames.json"
    path.write_text(json.dumps(FRAMES), encoding="utf-8")


def _run(curvature, frequency):
    """A run whose body sinks and whose legs turn from frame to frame."""
    poses = [[0.5 * i, 2 - 0.01 * i, 0.001 * i, 0.17 * i] for i in range(36)]
    arrows = [[-3.0, -1.0, 10 * i, 700 + i, 3.0, -1.5, -5, 770] for i in range(36)]
    return {
        "frequency_Hz": frequency,
        "curvature": curvature,
        "speed_cm_per_s": 21.25 * frequency,
        "outcome": "steady",
        "warning": "",
        "stride_s": 1 / frequency,
        "pose": poses,
        "arrows": arrows,
    }


FRAMES: dict[str, Any] = {
    "title": "robot", "medium": "poppy_LP",
    "plates": [[-6.5, -1, 6.5, -1]], "hips": [[-4, 0, 0], [0, 0, 0.5], [4, 0, 0]],
    "legs": {"0": [[0, 0], [0, -4.1]], "1": [[0, 0], [2, -2], [0, -4.1]]},
    "runs": [_run(curvature, frequency) for curvature in (0, 1) for frequency in (2, 5)],
}  # fmt: skip


def _fit(table):
    beta, gamma = (np.radians(table[name].to_numpy(float)) for name in ("beta_deg", "gamma_deg"))
    return fit_lsq(beta, gamma, *alpha_columns(table))


def _one_test(medium):
    table = alpha_table("poppy_LP", {}).assign(medium=medium, reason="no run", n_runs=0)
    is_unmeasured = ~((table["beta_deg"] == 0) & (table["gamma_deg"] == 90))
    numbers = [name for name in table.columns if name.startswith("alpha_")]
    table.loc[is_unmeasured, numbers] = np.nan
    table.loc[~is_unmeasured, column("z")] = SAND_ALPHA
    table.loc[~is_unmeasured, "reason"] = ""
    return table


def _penetration(method, medium, alpha, zeta, chi):
    row: dict[str, object] = {"method": method, "medium": medium}
    for end, factor in (("", 1.0), ("_lo", 0.99), ("_hi", 1.01)):
        row[f"alpha_z_measured{end}_N_per_cm3"] = alpha * factor
        row[f"alpha_z_fit{end}_N_per_cm3"] = zeta * factor
        row[f"chi{end}"] = chi * factor
        row[f"zeta{end}"] = zeta * factor
    return row


def _coefficients(medium, values):
    return pd.DataFrame(
        {
            "method": "lsq",
            "medium": medium,
            "coefficient": list(TERMS),
            "value_N_per_cm3": values,
            "lo": values - 0.001,
            "hi": values + 0.001,
        }
    )


def _ledger(reason):
    """Ledger whose dropped rows have a reason, but for those of the way to the surface."""
    table = _table("ledger").fillna("")
    words = table["reason_code"].mask(table["fate"] == "dropped", reason)
    return table.assign(reason=words.mask(table["reason_code"] == "approach", "approach"))


# --- The unit push of the live page, calculated once for each setting that it depends on --------------------------
# Every page has it, it takes a fifth of the time of a page, and with the published shapes it is the same in most campaigns.


@contextmanager
def shared_unit_push():
    """Pages of one process share what an exact push tells, where no medium of the campaign is a known shape."""
    plain = live._unit_push
    pending: dict[tuple[object, ...], Results] = {}

    @cache
    def calculated(key):
        return plain(pending[key])

    def shared(results):
        config = results.config
        if config.maps.own_media:
            return plain(results)
        legs = tuple((name, leg.model_dump_json()) for name, leg in config.legs.items())
        draws = vars(posterior)["DRAWS"], vars(prediction)["DRAWS"]
        key = (
            legs,
            config.arm.leg_speed_rad_per_s,
            config.fit.confidence,
            results.model_error,
            draws,
        )
        pending[key] = results
        try:
            return calculated(key)
        finally:
            del pending[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "_unit_push", shared)
        yield
