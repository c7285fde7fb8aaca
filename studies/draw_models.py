"""Draw the scores of every model on measured legs and robot speeds: the figure of docs/theory/comparison.md.

    python studies/draw_models.py --rows FOLDER --picture FILE

FOLDER holds the rows that `python studies/grade_forces.py legs sands speeds --rows FOLDER` writes.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pandas as pd
from force_scores import mean_by_cluster

from rftfit.figures import style
from rftfit.store import write_bytes

ROBOT = "robot"
LEAST_DRAWN = 1.0  # percent
NAMES = {
    "table": "measured table",
    "map 91": "map, all pushes",
    "nine terms": "nine terms fitted",
    "map 16": "map, 16 pushes",
    "map 6": "map, 6 pushes",
    "map 1": "map, one push",
    "3D-RFT 0.6": "3D-RFT, friction fitted",
    "3D-RFT 0.4": "3D-RFT, friction 0.4",
    "generic": "generic nine terms",
    "depth-only": "depth-only",
}
LOOKS = {"laboratory media": ("blue", "o"), "natural sands": ("vermillion", "s")}
PANELS = {
    "z": ("A  lift on legs", "CRPS (% of measured peak)"),
    "x": ("B  thrust on legs", "CRPS (% of measured peak)"),
    ROBOT: ("C  speed of the robot", "error (% of measured speed)"),
}


def read_scores(folder: Path) -> pd.DataFrame:
    """One row a curve or a speed: group, model, component, cluster and score."""
    tables = []
    for part, group in (("legs", "laboratory media"), ("sands", "natural sands")):
        rows = pd.read_csv(folder / f"{part}.csv")
        tables.append(rows.assign(group=group, cluster=rows["unit"], score=rows["crps_model"]))
    speeds = pd.read_csv(folder / "speeds.csv")
    speeds = speeds.assign(component=ROBOT, cluster=speeds["speed"].astype(str))
    tables.append(speeds.assign(group="laboratory media", score=speeds["error"].abs()))
    names = ["group", "model", "component", "cluster", "score"]
    return pd.concat([table[names] for table in tables], ignore_index=True)


@style.styled()
def draw_models(scores: pd.DataFrame) -> bytes:
    """Draw each curve and each speed as a pale dot, means with their standard errors."""
    page = style.new_figure(style.DOUBLE_CM, 8.9, dpi=220)
    width_cm = (style.DOUBLE_CM - 3.9) / len(PANELS)
    models = [*NAMES]
    of_sands = set(scores.loc[scores["group"] == "natural sands", "model"])
    for panel, (component, (title, unit)) in enumerate(PANELS.items()):
        axes = style.axes_cm(page, 3.6 + width_cm * panel, 0.7, width_cm - 0.45, 6.5)
        of_component = scores[scores["component"] == component]
        for (group, model), rows in of_component.groupby(["group", "model"]):
            colour, marker = LOOKS[str(group)]
            is_beside = model in of_sands and component != ROBOT
            row = models.index(str(model)) + 0.17 * is_beside * (1 if marker == "s" else -1)
            look: Any = {"color": style.OKABE_ITO[colour], "marker": marker, "markeredgewidth": 0}
            drawn = rows["score"].clip(lower=LEAST_DRAWN)
            axes.plot(drawn, [row] * len(drawn), linestyle="", markersize=2, alpha=0.4, **look)
            mean, error = mean_by_cluster(rows["score"].to_numpy(float), [*rows["cluster"]])
            axes.errorbar(mean, row, xerr=error, capsize=1.5, markersize=4, **look)
        axes.set(xscale="log", xlim=(0.8 * LEAST_DRAWN, 400), ylim=(len(models) - 0.5, -0.5))
        axes.set_xticks((1, 2, 5, 10, 20, 50, 100, 200), minor=False)
        axes.set_yticks(range(len(models)), NAMES.values() if panel == 0 else [""] * len(models))
        axes.minorticks_off()
        axes.xaxis.set_major_formatter("{x:g}")
        axes.grid(axis="x")
        axes.set_xlabel(unit)
        axes.set_title(title, loc="left")
    entries = {
        f"mean with standard error, {group}": style.line(
            style.OKABE_ITO[colour], marker=marker, linestyle="", markersize=4
        )
        for group, (colour, marker) in LOOKS.items()
    }
    style.legend(page, entries | {"one curve": style.dots(style.GREY, 2)})
    return style.content(page, "png")


def main() -> None:
    """Draw the figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--picture", type=Path, metavar="FILE", required=True)
    options = parser.parse_args()
    write_bytes(options.picture, draw_models(read_scores(options.rows)))


if __name__ == "__main__":
    main()
