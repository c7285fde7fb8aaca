"""Tables of the measurement chain, built from the published ones, for the tests of figures."""

import numpy as np
import pandas as pd

from rftfit import reference

TERMS = ("A00", "A10", "B11", "B01", "Bm1", "C11", "C01", "Cm1", "D10")
TITLES = {
    "poppy_LP": "poppy seeds, loose",
    "poppy_CP": "poppy seeds, close",
    "glass0.3mm_LP": "0.3 mm glass, loose",
    "glass0.3mm_CP": "0.3 mm glass, close",
    "glass3mm_CP": "3 mm glass, close",
}
MISSING = {(-30.0, 45.0): "no tare: rod_p_017 is too short", (90.0, -90.0): "surface not found"}


def nine_terms(m, beta, gamma):
    b = 2 * beta
    z = m["A00"] + m["A10"] * np.cos(b) + m["B11"] * np.sin(b + gamma)
    z = z + m["B01"] * np.sin(gamma) + m["Bm1"] * np.sin(gamma - b)
    x = m["C11"] * np.cos(b + gamma) + m["C01"] * np.cos(gamma)
    return z, x + m["Cm1"] * np.cos(gamma - b) + m["D10"] * np.sin(b)


def alpha_table(medium, missing=MISSING):
    rng = np.random.default_rng(sum(map(ord, medium)))
    beta, gamma = np.meshgrid(reference.BETA_DEG, reference.GAMMA_DEG, indexing="ij")
    table = pd.DataFrame({"medium": medium, "beta_deg": beta.ravel(), "gamma_deg": gamma.ravel()})
    for c, values in zip("zx", reference.alpha_grid(medium), strict=True):
        alpha = values.ravel()
        half = 0.0015 + 0.01 * np.abs(alpha) + 0.0005 * rng.random(alpha.size)
        table[f"alpha_{c}_N_per_cm3"] = alpha
        table[f"alpha_{c}_se_N_per_cm3"] = half / 2
        table[f"alpha_{c}_lo_N_per_cm3"] = alpha - half
        table[f"alpha_{c}_hi_N_per_cm3"] = alpha + half
    table["n_runs"] = 1
    table["run_ids"] = [f"{medium}_{i:03d}" for i in range(len(table))]
    table["flags"] = ""
    table["reason"] = ""
    for (b, g), reason in missing.items():
        here = (table["beta_deg"] == b) & np.isclose(table["gamma_deg"], g)
        table.loc[here, [name for name in table.columns if name.startswith("alpha_")]] = np.nan
        table.loc[here, "reason"] = reason
        table.loc[here, "n_runs"] = 0
    return table


def alpha_tables():
    return pd.concat([alpha_table(medium) for medium in reference.MEDIA], ignore_index=True)


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
                        "kept_by_bic": True,
                    }
                )
    return pd.DataFrame(rows)


def penetration_table():
    rows = []
    for method in ("lsq", "dft-index"):
        for medium in reference.MEDIA:
            zeta = sum(reference.coefficients(medium)[term] for term in TERMS[:5])
            rows.append(
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
            )
    return pd.DataFrame(rows)


DEPTHS = (2.54, 5.08, 7.62)


def runs(medium, samples=700):
    """Traces and fits of one medium: 42 intrusions, 42 extractions, 21 horizontal runs."""
    rng = np.random.default_rng(3)
    grid = reference.alpha_grid(medium)
    traces: list[pd.DataFrame] = []
    fits: list[dict[str, object]] = []
    for i, beta in enumerate(reference.BETA_DEG):
        for j, gamma in enumerate(reference.GAMMA_DEG):
            kind = "horizontal" if gamma == 0 else "intrusion" if gamma > 0 else "extraction"
            for level in DEPTHS if gamma == 0 else (np.nan,):
                run = f"{medium}_{len(fits):04d}"
                trace, fit = one_run(run, kind, level, grid[0][i, j], grid[1][i, j], rng, samples)
                fit |= {"medium": medium, "beta_deg": beta, "gamma_deg": gamma}
                traces.append(trace)
                fits.append(fit)
    return pd.concat(traces, ignore_index=True), pd.DataFrame(fits)


def one_run(run, kind, level, alpha_z, alpha_x, rng, samples):
    path = np.linspace(0, 8, samples)
    depth = np.full(samples, level) if kind == "horizontal" else path
    window = path > 2 if kind == "horizontal" else (path > 0.6) & (path < 6.5)
    rise = 1 - np.exp(-path) if kind == "horizontal" else 1 - 0.4 * np.exp(-path)
    trace = pd.DataFrame({"run_id": run, "depth_cm": depth, "path_cm": path, "in_window": window})
    turn = -1 if kind == "extraction" else 1
    for c, alpha in (("z", alpha_z), ("x", alpha_x * turn)):
        noise = np.convolve(rng.normal(0, 0.012, samples), np.ones(5) / 5, "same")
        trace[f"stress_{c}_N_per_cm2"] = alpha * depth * rise + noise
        trace[f"tare_{c}_N_per_cm2"] = 0.08 * alpha * depth + noise[::-1]
    if kind == "extraction":
        trace = trace.iloc[::-1]
    fit: dict[str, object] = {
        "run_id": run,
        "direction": kind,
        "mirrored": kind == "extraction",
        "flags": "",
        "note": "",
        "reason": "",
    }
    low, high = (level, level) if kind == "horizontal" else (0.6, 6.5)
    fit |= {"depth_from_cm": low, "depth_to_cm": high, "n_points": int(window.sum())}
    for c, alpha in (("z", alpha_z), ("x", alpha_x)):
        fit[f"alpha_{c}_N_per_cm3"] = alpha
        half = 0.002 + 0.01 * abs(alpha)
        fit[f"alpha_{c}_lo_N_per_cm3"] = alpha - half
        fit[f"alpha_{c}_hi_N_per_cm3"] = alpha + half
    return trace, fit


def spoil(fits, row, reason):
    names = [name for name in fits.columns if name.startswith("alpha_")]
    fits.loc[row, names] = np.nan
    fits.loc[row, "reason"] = reason
