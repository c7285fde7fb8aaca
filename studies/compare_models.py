"""Every model against measured legs and robot speeds: table and figure of docs/theory/comparison.md.

    python studies/compare_models.py [--csv FILE] [--picture FILE]

Map and generic know the other material only: poppy seeds are left out for poppy seeds, glass for glass. Scores are in
percent of the measured peak. CRPS: continuous ranked probability score (Gneiting & Raftery 2007), mean over
theta; of a model without a distribution it is the absolute error. The generic profile's distribution is its
interval at all levels; a map's are its draws.
"""

from __future__ import annotations

import argparse
import re
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from shapes import MATERIALS, SE, reference_without

import rftfit
from rftfit.compare.legs import COMPONENTS, leg_errors
from rftfit.figures import style
from rftfit.model.draws import end_names
from rftfit.model.forces import force_draws
from rftfit.model.fourier import fit_lsq
from rftfit.model.shapes import grid
from rftfit.reference import LEGS, MEDIA, SANDS
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from rftfit.conventions import FloatArray

    Profiles = dict[str, rftfit.Profile]

FRICTIONS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
LINEAR_CM = {"yuma": 2.0, "palms29": 3.0, "palms29_sieved": 3.0}
GROUPS = {"laboratory media": MEDIA, "natural sands": SANDS}
BASE, FITTED = "3D-RFT, friction 0.4", "3D-RFT, friction fitted"
ROBOT = "robot"
LEAST_DRAWN = 1.0  # percent
PUSHES = {
    "measured table": "all", "nine terms fitted": "all", "map, 16 pushes": "16", "map, 6 pushes": "6",
    "map, one push": "1", FITTED: "1", BASE: "1", "generic nine terms": "1", "depth-only": "3",
}  # fmt: skip
"""Models in the order of the table, with the directions that each was told."""


def of_one_push(alpha: float, se: float, left_out: tuple[str, ...]) -> Profiles:
    """Models that need one push straight down, N/cm^3."""
    push = pd.DataFrame({"beta_deg": [0.0], "gamma_deg": [90.0], "alpha_z_N_per_cm3": [alpha], "se_z": [se]})  # fmt: skip
    known = rftfit.estimate_map(push, rftfit.published_shapes(left_out))
    return {
        "map, one push": known.profile,
        "generic nine terms": rftfit.scale(alpha, se, reference_without(left_out)).profile,
        **{f"3D-RFT, friction {mu:g}": rftfit.rft3d_profile(alpha, mu) for mu in FRICTIONS},
    }


def of_laboratory(medium: str) -> Profiles:
    """All models of a published medium, whose material the map and the generic profile do not know."""
    table = rftfit.published_medium(medium)
    shapes = rftfit.published_shapes(MATERIALS[medium])

    def pushed(directions: list[tuple[float, float]]) -> rftfit.Map:
        beta_deg, gamma_deg = np.transpose(directions)
        z, x = table.alpha(np.radians(beta_deg), np.radians(gamma_deg))
        return rftfit.estimate_map(
            pd.DataFrame({
                "beta_deg": beta_deg, "gamma_deg": gamma_deg, "alpha_z_N_per_cm3": z,
                "alpha_x_N_per_cm3": x, "se_z": SE, "se_x": SE,
            }),
            shapes,
        )  # fmt: skip

    down = [(0.0, 90.0)]
    steps = rftfit.plan("map", pushed(down), count=30).steps
    places = list(dict.fromkeys(down + [d for step in steps for d in step.directions]))
    nodes = grid()
    return {
        "measured table": table,
        **{f"map, {n} pushes": pushed(places[:n]).profile for n in (6, 16)},
        "nine terms fitted": rftfit.FourierProfile(fit_lsq(*nodes, *table.alpha(*nodes))),
        **of_one_push(float(table.alpha(0.0, np.pi / 2)[0]), SE, MATERIALS[medium]),
        "depth-only": rftfit.DepthOnlyProfile.of(table),
    }


def of_sand(sand: str) -> Profiles:
    """Models of a natural sand, from its penetration test (Fig. S11) with an error of 5 %."""
    curve = rftfit.published_table("fig_s11")
    curve = curve[(curve["medium"] == sand) & (curve["depth_cm"] <= LINEAR_CM[sand])]
    slope = rftfit.fit_slope(curve["depth_cm"], curve["stress_z_N_per_cm2"]).alpha[0]
    return of_one_push(float(slope), 0.05 * float(slope), ())


def sample(
    profile: rftfit.Profile, leg: rftfit.Outline, motion: rftfit.Motion, c: str
) -> FloatArray:
    """Equally likely forces by pose, shape (draws, n); one where nothing is known of their errors."""
    name = f"force_{c}_N"
    if isinstance(profile.spread, rftfit.Profile):
        return np.asarray(getattr(force_draws(profile.spread, leg, motion.poses), name))
    middle = rftfit.predict(profile, leg, motion, quantities=())[name].to_numpy()
    if profile.spread is None:
        return middle[None]
    ends = [
        rftfit.predict(profile, leg, motion, 1 - 2 * tail, quantities=(name,))[[*end_names(name)]].T
        for tail in np.arange(0.0125, 0.25, 0.025)
    ]
    outer = np.swapaxes(ends, 0, 1)
    # between the innermost ends, at 0.2375 and 0.7625, and the number evenly
    shares = np.arange(1, 11)[:, None] / 10.5
    inner = [side[-1] + shares * (middle - side[-1]) for side in outer]
    return np.concatenate([*outer, *inner])


def crps(draws: FloatArray, seen: FloatArray) -> FloatArray:
    """Continuous ranked probability score of draws, shape (m, n), at each of n numbers."""
    m = len(draws)
    rank = 2 * np.arange(1, m + 1) - m - 1
    return np.asarray(np.abs(draws - seen).mean(axis=0) - rank @ np.sort(draws, axis=0) / m**2)


def curves() -> tuple[pd.DataFrame, str]:
    """Errors and scores, percent of the peak, one row a curve and model; and the best name of 3D-RFT."""
    seen = pd.concat([rftfit.published_table(name) for name in ("fig_s5", "fig_s12")])
    parts, scores = [], {}
    for medium in (*MEDIA, *SANDS):
        profiles = of_laboratory(medium) if medium in MEDIA else of_sand(medium)
        for leg in LEGS:
            own = seen[(seen["medium"] == medium) & (seen["leg"] == leg)]
            outline = rftfit.model_leg(leg)
            motion = rftfit.rotation(own["theta_deg"].to_numpy(float))
            for model, profile in profiles.items():
                table = rftfit.predict(profile, outline, motion)
                parts.append(table.assign(medium=medium, leg=leg, profile=model))
                for c in COMPONENTS:
                    force = own[f"force_{c}_N"].to_numpy(float)
                    score = crps(sample(profile, outline, motion, c), force).mean()
                    lo, hi = (table.get(end, np.nan) for end in end_names(f"force_{c}_N"))
                    miss = np.maximum(lo - force, 0) + np.maximum(force - hi, 0)
                    scores[medium, leg, model, c] = score, np.mean(hi - lo + 40 * miss)
    found = leg_errors(seen, pd.concat(parts))
    keys = ["medium", "leg", "profile", "component"]
    peak = found["peak_measured_N"].abs()
    both = np.array([scores[tuple(key)] for key in found[keys].to_numpy()])
    found["rms"] = 100 * found["rms_relative_to_peak"]
    found["crps"], found["interval_score"] = (100 * both / peak.to_numpy()[:, None]).T
    found["group"] = np.where(found["medium"].isin(MEDIA), *GROUPS)
    laboratory = found[(found["group"] == "laboratory media") & found["profile"].str.match("3D")]
    best = str(laboratory.groupby("profile")["crps"].mean().idxmin())
    fitted = found[found["profile"] == best].assign(profile=FITTED)
    rows = pd.concat([found, fitted]).rename(columns={"profile": "model"})
    return rows[rows["model"].isin(PUSHES)], best


def speeds(best: str) -> pd.DataFrame:
    """Errors of the robot's speeds (Fig. 4C), percent, as `curves`; without a steady speed they are -100."""
    profiles = of_laboratory("poppy_LP")
    profiles[FITTED] = profiles[best]
    points = rftfit.published_table("fig_4c").query("speed_cm_per_s > 1").to_numpy(float)
    rows = []
    for model in PUSHES:
        for number, (curvature, frequency, speed) in enumerate(points):
            run = rftfit.simulate(profiles[model], frequency, curvature)
            error = 100 * (float(np.nan_to_num(run.speed_cm_per_s)) / speed - 1)
            rows.append(("laboratory media", model, "poppy_LP", number, ROBOT, error, abs(error)))
    names = ["group", "model", "medium", "leg", "component", "peak_error_percent", "crps"]
    return pd.DataFrame(rows, columns=names)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a group and model; standard errors are over media and legs, of the robot over its speeds."""
    found = []
    for (group, model), own in rows.groupby(["group", "model"], sort=False):
        row = {"group": group, "model": model, "directions": PUSHES[str(model)]}
        for c, part in own.groupby("component"):
            peak, score = part["peak_error_percent"], part["crps"]
            row |= {
                f"peak_median_{c}": peak.median(), f"peak_rms_{c}": np.sqrt(np.mean(peak**2)),
                f"curve_rms_{c}": part["rms"].mean(), f"crps_{c}": score.mean(),
                f"crps_se_{c}": score.sem(), f"interval_score_{c}": part["interval_score"].mean(),
            }  # fmt: skip
        legs = rows[(rows["group"] == group) & (rows["component"] != ROBOT)]
        each = legs.pivot_table("crps", ["medium", "leg"], "model")
        less = each[model] - each[BASE]
        found.append(row | {"crps_less": less.mean(), "crps_less_se": less.sem()})
    table = pd.DataFrame(found)
    order = [*GROUPS, *PUSHES]
    return table.sort_values(["group", "model"], key=lambda names: names.map(order.index))


_HEAD = (
    "| model | directions | lift: peak | curve | CRPS | interval score | thrust: peak | curve | CRPS | "
    "interval score | CRPS less 3D-RFT's | speed | its CRPS |"
)
_FORCE = (
    " | {peak_median_%s:+.0f}; {peak_rms_%s:.0f} | {curve_rms_%s:.0f} | {crps_%s:.1f} ± {crps_se_%s:.1f}"
    " | {interval_score_%s:.0f}"
)
_LINE = (
    "| {model} | {directions}" + _FORCE.replace("%s", "z") + _FORCE.replace("%s", "x")
    + " | {crps_less:+.1f} ± {crps_less_se:.1f} | {peak_median_robot:+.0f}; {peak_rms_robot:.0f}"
    " | {crps_robot:.1f} ± {crps_se_robot:.1f} |"
)  # fmt: skip


def markdown(found: pd.DataFrame) -> str:
    """The tables of the documentation, one a group."""
    lines = []
    for group, own in found.groupby("group", sort=False):
        lines += ["", str(group), "", _HEAD, "|---" * 13 + "|"]
        for row in own.to_dict("records"):
            lines.append(re.sub(r"\+?nan(; nan| ± nan)?|\+0.0 ± 0.0", "", _LINE.format_map(row)))
    return "\n".join(lines)


def by_leg(rows: pd.DataFrame) -> str:
    """Median error of the peaks on each leg, percent."""
    found = rows[rows["component"] != ROBOT].pivot_table(
        "peak_error_percent", ["group", "model"], ["component", "leg"], "median"
    )[[*COMPONENTS]]
    lines = [
        "",
        f"| media | model | lift: {' | '.join(LEGS)} | thrust: {' | '.join(LEGS)} |",
        "|---" * 8 + "|",
    ]
    for place in (place for place in product(GROUPS, PUSHES) if place in found.index):
        lines.append(
            f"| {' | '.join([*place, *(f'{n:+.0f}' for n in found.loc[[place]].to_numpy()[0])])} |"
        )
    return "\n".join(lines)


@style.styled()
def picture(path: Path, rows: pd.DataFrame, found: pd.DataFrame) -> None:
    """Draw the scores: each curve and each speed a pale dot, means with their standard errors."""
    looks = {"laboratory media": ("blue", "o"), "natural sands": ("vermillion", "s")}
    page = style.new_figure(style.DOUBLE_CM, 8.9, dpi=220)
    peak = "CRPS (% of measured peak)"
    panels = {
        "z": ("A  lift on legs", peak), "x": ("B  thrust on legs", peak),
        ROBOT: ("C  speed of the robot", "error (% of measured speed)"),
    }  # fmt: skip
    places, both = [*PUSHES], set(found.loc[found["group"] == "natural sands", "model"])
    for panel, (c, (title, unit)) in enumerate(panels.items()):
        axes = style.axes_cm(page, 3.6 + 4.95 * panel, 0.7, 4.5, 6.5)
        for row in found.to_dict("records"):
            colour, marker = looks[row["group"]]
            each = rows[(rows["group"] == row["group"]) & (rows["model"] == row["model"])]
            each = each.loc[each["component"] == c, "crps"].clip(lower=LEAST_DRAWN)
            shift = 0.17 * (1 if marker == "s" else -1) * (row["model"] in both and c != ROBOT)
            place = places.index(row["model"]) + shift
            look: Any = {"color": style.OKABE_ITO[colour], "marker": marker, "markeredgewidth": 0}
            axes.plot(each, [place] * len(each), linestyle="", markersize=2, alpha=0.4, **look)
            mean, se = row[f"crps_{c}"], row[f"crps_se_{c}"]
            axes.errorbar(mean, place, xerr=se, capsize=1.5, markersize=4, **look)
        axes.set(xscale="log", xlim=(0.8 * LEAST_DRAWN, 400), ylim=(len(places) - 0.5, -0.5))
        axes.set_xticks((1, 2, 5, 10, 20, 50, 100, 200), minor=False)
        axes.set_yticks(range(len(places)), places if panel == 0 else [""] * len(places))
        axes.minorticks_off()
        axes.xaxis.set_major_formatter("{x:g}")
        axes.grid(axis="x")
        axes.set_xlabel(unit)
        axes.set_title(title, loc="left")
    entries = {
        f"mean with standard error, {group}": style.line(
            style.OKABE_ITO[colour], marker=marker, linestyle="", markersize=4
        )
        for group, (colour, marker) in looks.items()
    }
    style.legend(page, entries | {"one curve or one speed": style.dots(style.GREY, 2)}, 3)
    write_bytes(path, style.content(page, "png"))


def main() -> None:
    """Print the table; write and draw it where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the table with more digits")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the scores")
    options = parser.parse_args()
    rows, best = curves()
    rows = pd.concat([rows, speeds(best)], ignore_index=True)
    found = summary(rows)
    print(f"least CRPS on the laboratory legs: {best}\n{markdown(found)}\n{by_leg(rows)}")
    if options.csv:
        found.to_csv(options.csv, index=False, float_format="%.4g")
    if options.picture:
        picture(options.picture, rows, found)


if __name__ == "__main__":
    main()
