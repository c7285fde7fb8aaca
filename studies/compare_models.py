"""Every model against measured legs and robot speeds: table and figure of docs/theory/comparison.md.

    python studies/compare_models.py --rows FOLDER [--speeds] [--csv FILE] [--picture FILE]

Forces, intervals and scores are those of `studies/grade_forces.py`, whose rows are made in FOLDER where it lacks them: map and generic know the other material only, and
every model has its own error, learned from the other legs and the other material. Scores are in percent of the
measured peak. Standard errors are over media, because the legs of a medium share its alpha.
"""

from __future__ import annotations

import argparse
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from force_scores import mean_by_cluster
from grade_forces import curve_of, leg_rows, parts, profile_of, run

import rftfit
from rftfit.compare.legs import measured_peak
from rftfit.figures import style
from rftfit.reference import LEGS, MEDIA, SANDS
from rftfit.store import write_bytes

FRICTIONS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
GROUPS = {"laboratory media": MEDIA, "natural sands": SANDS}
BASE, FITTED = "3D-RFT, friction 0.4", "3D-RFT, friction fitted"
ROBOT = "robot"
COMPONENTS = ("z", "x")
LEAST_DRAWN = 1.0  # percent
PUSHES = {
    "measured table": "all",
    "map, all pushes": "all",
    "nine terms fitted": "all",
    "map, 16 pushes": "16",
    "map, 6 pushes": "6",
    "map, one push": "1",
    FITTED: "1",
    BASE: "1",
    "generic nine terms": "1",
    "depth-only": "3",
}
"""Models in the order of the table, with the directions that each was told."""
NAMES = {
    "table": "measured table",
    "map 91": "map, all pushes",
    "nine terms": "nine terms fitted",
    "map 16": "map, 16 pushes",
    "map 6": "map, 6 pushes",
    "map 1": "map, one push",
    "3D-RFT 0.4": BASE,
    "generic": "generic nine terms",
    "depth-only": "depth-only",
}
"""Models of `grade_forces`; the fitted 3D-RFT is that of one friction."""


OF_SPEEDS = ("peak_median_robot", "peak_rms_robot", "crps_robot", "crps_se_robot")


def fitted_friction() -> str:
    """Name of 3D-RFT with the friction of the least mean absolute error on the laboratory legs."""
    errors = {}
    for friction in FRICTIONS:
        model = f"3D-RFT {friction:g}"
        means = []
        for medium, leg in product(MEDIA, LEGS):
            curve = curve_of(medium, leg, model)
            for c, measured, mean in zip(COMPONENTS, curve.measured, curve.mean, strict=True):
                peak = abs(measured_peak(curve.theta_deg, measured, c).force_N)
                means.append(np.abs(mean - measured)[curve.loaded].mean() / peak)
        errors[model] = float(np.mean(means))
    return min(errors, key=lambda model: errors[model])


def curves(folder: Path, fitted: str) -> pd.DataFrame:
    """Errors and scores of `grade_forces`, one row a curve and model; rows that the folder has are not made again."""
    tables = []
    for group, part_name in (("laboratory media", "legs"), ("natural sands", "sands")):
        rows = run(parts()[part_name], folder / f"{part_name}.csv").rename(
            columns={"unit": "medium"}
        )
        if fitted not in set(rows["model"]):
            media = GROUPS[group]
            fitted_rows = [
                pd.DataFrame(leg_rows(name, [fitted])).assign(medium=name) for name in media
            ]
            rows = pd.concat([rows, *fitted_rows], ignore_index=True)
        of_fitted = rows[rows["model"] == fitted].assign(model=FITTED)
        of_named = rows[rows["model"].isin(NAMES)].assign(model=lambda x: x["model"].map(NAMES))
        tables.append(pd.concat([of_named, of_fitted]).assign(group=group))
    return pd.concat(tables, ignore_index=True)


def speeds(fitted: str) -> pd.DataFrame:
    """Errors of the robot's speeds (Fig. 4C), percent, as `curves`; without a steady speed they are -100."""
    points = rftfit.published_table("fig_4c").query("speed_cm_per_s > 1").to_numpy(float)
    rows = []
    for name, model in [*NAMES.items(), (fitted, FITTED)]:
        profile = profile_of("poppy_LP", name)
        for number, (curvature, frequency, speed) in enumerate(points):
            robot = rftfit.simulate(profile, frequency, curvature)
            error = 100 * (float(np.nan_to_num(robot.speed_cm_per_s)) / speed - 1)
            rows.append(("laboratory media", model, "poppy_LP", number, ROBOT, error, abs(error)))
    names = ["group", "model", "medium", "leg", "component", "peak_percent", "crps_model"]
    return pd.DataFrame(rows, columns=names)


def summary(rows: pd.DataFrame) -> pd.DataFrame:
    """One row a group and model; standard errors are over media, of the robot over its speeds."""
    lines = []
    for (group, model), of_model in rows.groupby(["group", "model"], sort=False):
        legs = of_model[of_model["component"] != ROBOT]
        line: dict[str, Any] = {"group": group, "model": model, "directions": PUSHES[str(model)]}
        line["inside"] = legs["inside_model"].mean()
        line["least"] = legs.groupby(["leg", "component"])["inside_model"].mean().min()
        line["peaks"] = legs["peak_in_model"].sum() / 100
        line["count"] = len(legs)
        line["error"] = legs["error"].mean()
        for c, of_component in of_model.groupby("component"):
            peak, score = of_component["peak_percent"], of_component["crps_model"]
            clusters = of_component["medium" if c != ROBOT else "leg"].astype(str)
            line[f"peak_median_{c}"] = peak.median()
            line[f"peak_rms_{c}"] = np.sqrt(np.mean(peak**2))
            line[f"curve_rms_{c}"] = of_component["rms"].mean()
            line[f"crps_{c}"] = score.mean()
            line[f"crps_se_{c}"] = mean_by_cluster(score.to_numpy(float), [*clusters])[1]
            line[f"interval_score_{c}"] = of_component["score_model"].mean()
        same_group = rows[(rows["group"] == group) & (rows["component"] != ROBOT)]
        by_leg = same_group.pivot_table("crps_model", ["medium", "leg"], "model")
        less = by_leg[model] - by_leg[BASE]
        media = less.index.get_level_values("medium").astype(str)
        line["crps_less"], line["crps_less_se"] = mean_by_cluster(less.to_numpy(float), [*media])
        lines.append(line)
    table = pd.DataFrame(lines)
    for name in OF_SPEEDS:
        table[name] = table.get(name, np.nan)
    order = [*GROUPS, *PUSHES]
    return table.sort_values(["group", "model"], key=lambda names: names.map(order.index))


_HEAD = (
    "| model | directions | poses inside (least leg) | peaks inside | own error | lift: peak | curve | CRPS | interval score | "
    "thrust: peak | curve | CRPS | interval score | CRPS less 3D-RFT's |"
)
_FORCE = (
    " | {peak_median_%s:+.0f}; {peak_rms_%s:.0f} | {curve_rms_%s:.0f} | {crps_%s:.1f} ± {crps_se_%s:.1f}"
    " | {interval_score_%s:.0f}"
)
_LINE = (
    "| {model} | {directions} | {inside:.0f} ({least:.0f}) | {peaks:.0f} of {count} | {error:.2f}"
    + _FORCE.replace("%s", "z")
    + _FORCE.replace("%s", "x")
    + " | {crps_less:+.1f} ± {crps_less_se:.1f} |"
)
_SPEED_HEAD = " speed | its CRPS |"
_SPEED_LINE = (
    " {peak_median_robot:+.0f}; {peak_rms_robot:.0f} | {crps_robot:.1f} ± {crps_se_robot:.1f} |"
)


def markdown(table: pd.DataFrame) -> str:
    """The tables of the documentation, one a group; with speeds where there are any."""
    lines = []
    for group, of_group in table.groupby("group", sort=False):
        has_speeds = bool(of_group["crps_robot"].notna().any())
        head = _HEAD + _SPEED_HEAD * has_speeds
        lines += ["", str(group), "", head, "|---" * (head.count("|") - 1) + "|"]
        for row in of_group.to_dict("records"):
            line = (_LINE + _SPEED_LINE * has_speeds).format_map(row)
            lines.append(line.replace("+0.0 ± 0.0", ""))
    return "\n".join(lines)


def by_leg(rows: pd.DataFrame) -> str:
    """Median error of the peaks on each leg, percent."""
    table = rows[rows["component"] != ROBOT].pivot_table(
        "peak_percent", ["group", "model"], ["component", "leg"], "median"
    )[[*COMPONENTS]]
    lines = [
        "",
        f"| media | model | lift: {' | '.join(LEGS)} | thrust: {' | '.join(LEGS)} |",
        "|---" * 8 + "|",
    ]
    for place in (place for place in product(GROUPS, PUSHES) if place in table.index):
        numbers = [f"{number:+.0f}" for number in table.loc[[place]].to_numpy()[0]]
        lines.append(f"| {' | '.join([*place, *numbers])} |")
    return "\n".join(lines)


@style.styled()
def picture(path: Path, rows: pd.DataFrame, table: pd.DataFrame) -> None:
    """Draw the scores: each curve and each speed a pale dot, means with their standard errors."""
    looks = {"laboratory media": ("blue", "o"), "natural sands": ("vermillion", "s")}
    page = style.new_figure(style.DOUBLE_CM, 8.9, dpi=220)
    peak = "CRPS (% of measured peak)"
    panels = {
        "z": ("A  lift on legs", peak),
        "x": ("B  thrust on legs", peak),
        ROBOT: ("C  speed of the robot", "error (% of measured speed)"),
    }
    if ROBOT not in set(rows["component"]):
        del panels[ROBOT]
    width_cm = (style.DOUBLE_CM - 3.9) / len(panels)
    places, models_of_sands = [*PUSHES], set(table.loc[table["group"] == "natural sands", "model"])
    for panel, (c, (title, unit)) in enumerate(panels.items()):
        axes = style.axes_cm(page, 3.6 + width_cm * panel, 0.7, width_cm - 0.45, 6.5)
        for row in table.to_dict("records"):
            colour, marker = looks[row["group"]]
            of_model = rows[(rows["group"] == row["group"]) & (rows["model"] == row["model"])]
            scores = of_model.loc[of_model["component"] == c, "crps_model"]
            scores = scores.clip(lower=LEAST_DRAWN)
            shift = (
                0.17
                * (1 if marker == "s" else -1)
                * (row["model"] in models_of_sands and c != ROBOT)
            )
            place = places.index(row["model"]) + shift
            marker_style: Any = {
                "color": style.OKABE_ITO[colour],
                "marker": marker,
                "markeredgewidth": 0,
            }
            axes.plot(
                scores, [place] * len(scores), linestyle="", markersize=2, alpha=0.4, **marker_style
            )
            mean, se = row[f"crps_{c}"], row[f"crps_se_{c}"]
            axes.errorbar(mean, place, xerr=se, capsize=1.5, markersize=4, **marker_style)
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
    style.legend(page, entries | {"one curve": style.dots(style.GREY, 2)})
    write_bytes(path, style.content(page, "png"))


def main() -> None:
    """Print the table; write and draw it where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--speeds", action="store_true", help="also those of the robot (Fig. 4C)")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the table with more digits")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="draw the scores")
    options = parser.parse_args()
    fitted = fitted_friction()
    rows = curves(options.rows, fitted)
    if options.speeds:
        rows = pd.concat([rows, speeds(fitted)], ignore_index=True)
    table = summary(rows)
    print(
        f"least mean absolute error on the laboratory legs: {fitted}\n{markdown(table)}\n{by_leg(rows)}"
    )
    if options.csv:
        table.to_csv(options.csv, index=False, float_format="%.4g")
    if options.picture:
        picture(options.picture, rows, table)


if __name__ == "__main__":
    main()
