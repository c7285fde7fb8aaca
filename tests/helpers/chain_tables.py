"""Tables of the measurement chain, built from the published ones, for the tests of figures."""

import numpy as np
import pandas as pd

from rftfit import reference
from rftfit.model.fourier import TERMS

MISSING = {(-30.0, 45.0): "no tare: rod_p_017 is too short", (90.0, -90.0): "surface not found"}


def alpha_table(medium, missing=MISSING):
    rng = np.random.default_rng(sum(map(ord, medium)))
    beta, gamma = np.meshgrid(reference.BETA_DEG, reference.GAMMA_DEG, indexing="ij")
    table = pd.DataFrame({"medium": medium, "beta_deg": beta.ravel(), "gamma_deg": gamma.ravel()})
    for c, values in zip("zx", reference.alpha_grid(medium), strict=True):
        alpha = values.ravel()
        half = 0.0015 + 0.01 * np.abs(alpha) + 0.0005 * rng.random(alpha.size)
        for end, value in (
            ("", alpha),
            ("_se", half / 2),
            ("_lo", alpha - half),
            ("_hi", alpha + half),
            ("_lo_next", alpha - 2 * half),
            ("_hi_next", alpha + 2 * half),
        ):
            table[f"alpha_{c}{end}_N_per_cm3"] = value
    names = [f"{medium}_{i:03d}" for i in range(len(table))]
    table = table.assign(n_runs=1, run_ids=names, lost_run_ids="", reason="")
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
