"""What `rftfit.wheel` says of wheels that were measured in five laboratories.

    python studies/wheels.py [--data FOLDER] [--quick] [--figure FILE]

FOLDER holds `wheels-measured` and `yade-wheel` (default: `../shared/data`). Four minutes on one core. The
medium is the map of one push straight down, whose size the load decides. Rows at a slip above 0.095.

1  drawbar over load by laboratory: all faces, the rule of the own track, and with a friction of 0.4; torque beside it
2  friction told by the other rigs
3  runs inside their intervals at the load and the measured sinkage; with the model's own error of the other rigs
4  sinkage solved from load and slip, alpha from the run of least slip of the rig
5  the numbers of `src/rftfit/reference/wheels.toml`

The rigs state radius, width, height and number of lugs, not their thickness, which is taken as `LUG_CM`; slip and sinkage
belong to the rim. `--quick` leaves parts 3 and 4 out; `--figure` draws all rigs side by side.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import side_slip
from frame import show

import rftfit
from rftfit.conventions import FloatArray

LUG_CM = 0.5
"""Thickness of a lug. With 0.2 to 0.5 cm the rule alone gives 0.15 to 0.13 of the load, friction 0.4 0.13 to 0.11."""

LEAST_SLIP = 0.095
FRICTION = 0.4
FRICTIONS = np.arange(0.2, 0.61, 0.05)
CASES: dict[str, dict[str, Any]] = {
    "all faces": {"track": False},
    "rule": {},
    f"rule, friction {FRICTION:g}": {"friction": FRICTION},
}
LABORATORIES = {
    "ding2011": "Ding",
    "wang_han_2016_kls1": "KLS-1",
    "hurrell2025_rashid1": "Rashid-1",
}
KYOTO_RADIUS_CM = 11.0
"""Over the lugs, to which the slip of its runs belongs."""


class Rig(NamedTuple):
    """A measured wheel: its mesh, the radius of its rim, and its runs by slip."""

    name: str
    lugged: bool
    mesh: rftfit.Mesh
    rim_cm: float
    runs: pd.DataFrame

    @property
    def label(self) -> str:
        """Laboratory and shape."""
        return f"{self.name}, {'lugged' if self.lugged else 'smooth'}"


def read_rigs(data: Path) -> list[Rig]:
    """Read all rigs, lugged ones first."""
    runs = pd.read_csv(data / "wheels-measured" / "single_wheel_experiments.csv")
    rigs = []
    for _, of_wheel in runs.groupby(["source", "grouser_height_m"], sort=False):
        first = of_wheel.iloc[0]
        lug_m = float(first["grouser_height_m"])
        radius, width = 100 * first["wheel_radius_m"], 100 * first["wheel_width_m"]
        lugs = int(first["grouser_count"]) if lug_m else 0
        mesh = rftfit.Mesh.wheel(radius, width, 100 * lug_m, lugs, LUG_CM)
        columns = {
            "slip": of_wheel["slip"],
            "load_N": of_wheel["vertical_load_n"],
            "sinkage_cm": 100 * of_wheel["meas_sinkage_m"],
            "drawbar_N": of_wheel["meas_drawbar_pull_n"],
            "torque_N_cm": 100 * of_wheel["meas_torque_nm"],
        }
        rigs.append(
            Rig(
                LABORATORIES[first["source"]],
                lug_m > 0,
                mesh,
                radius,
                _by_slip(pd.DataFrame(columns)),
            )
        )
    rigs.append(read_kyoto(data / "yade-wheel"))
    rigs.append(read_cmu(side_slip.RUNS))
    return sorted(rigs, key=lambda rig: not rig.lugged)


def read_kyoto(folder: Path) -> Rig:
    """Measured traction of the Kyoto wheel, at the heights of the axle of its simulation."""
    simulated = pd.read_csv(folder / "runs.csv")
    measured = pd.read_csv(folder / "Fig9ref.txt", sep=r"\s+")
    simulated = simulated[simulated["slip_percent"].between(5, 61)]
    at_slip = measured.set_index("slip").loc[simulated["slip_percent"]]
    columns = {
        "slip": simulated["slip_percent"] / 100,
        "load_N": simulated["force_z_N"],
        "sinkage_cm": KYOTO_RADIUS_CM - simulated["axle_height_cm"],
        "drawbar_N": at_slip["net"].to_numpy(),
        "torque_N_cm": at_slip["gross"].to_numpy() * KYOTO_RADIUS_CM,
        "simulated_drawbar_N": simulated["force_x_N"],
    }
    # of 284 triangles, some as long as the wheel is wide
    mesh = rftfit.Mesh.read(folder / "wheelKyoto.stl", "m").refined(1.0)
    runs = pd.DataFrame(columns).sort_values("slip", ignore_index=True)
    return Rig("Kyoto", True, mesh, KYOTO_RADIUS_CM, runs)


def read_cmu(file: Path) -> Rig:
    """Straight runs of the smooth wheel of `examples/wheels`."""
    runs = pd.read_csv(file)
    runs = runs[runs["slip_angle_deg"] == 0]
    columns = {
        "slip": runs["slip"],
        "load_N": runs["force_z_N"],
        "sinkage_cm": runs["sinkage_mm"] / 10,
        "drawbar_N": runs["force_x_N"],
        "torque_N_cm": np.nan,
    }
    return Rig("CMU", False, rftfit.Mesh.cylinder(6.25, 6.0), 6.25, _by_slip(pd.DataFrame(columns)))


def _by_slip(runs: pd.DataFrame) -> pd.DataFrame:
    return runs[runs["slip"] > LEAST_SLIP].sort_values("slip", ignore_index=True)


def graded(rig: Rig) -> pd.DataFrame:
    """Runs that are counted: of Kyoto those above the least slip too."""
    return rig.runs[rig.runs["slip"] > LEAST_SLIP]


def roll(
    rig: Rig, runs: pd.DataFrame, medium: rftfit.KnownMedium | None = None, **options: Any
) -> pd.DataFrame:
    """Predict runs at their load and sinkage."""
    numbers = {"sinkage_cm": runs["sinkage_cm"].to_numpy(), "load_N": runs["load_N"].to_numpy()}
    answer = rftfit.wheel(
        medium or one_push(),
        rig.mesh,
        runs["slip"].to_numpy(),
        rim_cm=rig.rim_cm,
        **(numbers | options),
    )
    return answer.table


@cache
def one_push() -> rftfit.KnownMedium:
    """Map of one push straight down."""
    return rftfit.scale(1.0).profile


@cache
def without_draws() -> rftfit.KnownMedium:
    """The same without the draws behind its intervals, for numbers alone."""
    profile = rftfit.scale(1.0).profile
    profile.spread = None
    return profile


def rms(errors: Any) -> float:
    """Root mean square of what is known."""
    return float(np.sqrt(np.nanmean(np.square(np.asarray(errors, dtype=float)))))


def drawbar_errors(predicted: pd.DataFrame, runs: pd.DataFrame) -> FloatArray:
    """Predicted less measured drawbar over the load."""
    off = predicted["drawbar_N"].to_numpy() - runs["drawbar_N"].to_numpy()
    return np.asarray(off / runs["load_N"].to_numpy())


def torque_errors(rig: Rig, predicted: pd.DataFrame, runs: pd.DataFrame) -> FloatArray:
    """Predicted less measured torque over load times radius."""
    off = predicted["torque_N_cm"].to_numpy() - runs["torque_N_cm"].to_numpy()
    radius = np.hypot(rig.mesh.vertices_cm[:, 0], rig.mesh.vertices_cm[:, 2]).max()
    return np.asarray(off / (runs["load_N"].to_numpy() * radius))


Errors = dict[str, dict[str, FloatArray]]


def report_rigs(rigs: Sequence[Rig]) -> tuple[Errors, Errors]:
    """Print drawbar over load by laboratory; return errors of drawbar and torque by case and rig."""
    drawbar: Errors = {case: {} for case in CASES}
    torque: Errors = {case: {} for case in CASES}
    lines = []
    for rig in rigs:
        runs = graded(rig)
        line: dict[str, Any] = {
            "rig": f"{rig.label} ({runs['load_N'].mean():.3g} N)",
            "runs": f"{len(runs)}",
            "measured": f"{(runs['drawbar_N'] / runs['load_N']).mean():.2f}",
        }
        for case, options in CASES.items():
            predicted = roll(rig, runs, medium=without_draws(), **options)
            errors = drawbar_errors(predicted, runs)
            drawbar[case][rig.label] = errors
            torque[case][rig.label] = torque_errors(rig, predicted, runs)
            line[case] = f"{errors.mean():+.2f}, {rms(errors):.2f}"
            off = (predicted["torque_N_cm"].to_numpy() - runs["torque_N_cm"].to_numpy()) / 100
            line[f"torque, {case}"] = "" if np.isnan(off).all() else f"{rms(off):.2f}"
        mean_torque = runs["torque_N_cm"].mean() / 100
        line["torque, measured"] = "" if np.isnan(mean_torque) else f"{mean_torque:.2f}"
        lines.append(line)
    show("1 Drawbar over load: bias, rms; rms of torque, N m", pd.DataFrame(lines))
    totals = []
    for title, chosen in groups(rigs).items():
        total: dict[str, Any] = {"runs of": title}
        for case in CASES:
            total[case] = f"{rms(np.concatenate([drawbar[case][name] for name in chosen])):.3f}"
        totals.append(total)
    show("Rms of drawbar over load", pd.DataFrame(totals))
    return drawbar, torque


def groups(rigs: Sequence[Rig]) -> dict[str, list[str]]:
    """Labels of rigs that are counted together."""
    lugged = [rig.label for rig in rigs if rig.lugged]
    smooth = [rig.label for rig in rigs if not rig.lugged]
    without = [label for label in lugged if not label.startswith("KLS-1")]
    return {"all lugged": lugged, "lugged without KLS-1": without, "all smooth": smooth}


def report_kyoto(rig: Rig) -> None:
    """Print the errors of the Kyoto wheel beside measured traction and beside its simulation."""
    lines = []
    for case, options in CASES.items():
        predicted = roll(rig, rig.runs, medium=without_draws(), **options)
        lines.append(
            {
                "case": case,
                "drawbar beside measured, N": f"{rms(predicted['drawbar_N'] - rig.runs['drawbar_N']):.2f}",
                "torque beside measured, N m": f"{rms(predicted['torque_N_cm'] - rig.runs['torque_N_cm']) / 100:.2f}",
                "drawbar beside simulated, N": f"{rms(predicted['drawbar_N'] - rig.runs['simulated_drawbar_N']):.2f}",
            }
        )
    show(f"Kyoto, {len(rig.runs)} slips from 6 to 60 %: rms", pd.DataFrame(lines))


def report_friction(rigs: Sequence[Rig]) -> None:
    """Print the friction that the other lugged rigs tell, and the error on the rig left out."""
    lugged = [rig for rig in rigs if rig.lugged]
    errors = {
        rig.label: [
            drawbar_errors(
                roll(rig, graded(rig), medium=without_draws(), friction=friction), graded(rig)
            )
            for friction in FRICTIONS
        ]
        for rig in lugged
    }
    lines, left_out = [], []
    for rig in lugged:
        rms_by_friction = [
            rms(np.concatenate([by[place] for name, by in errors.items() if name != rig.label]))
            for place in range(len(FRICTIONS))
        ]
        best = int(np.argmin(rms_by_friction))
        left_out.append(errors[rig.label][best])
        lines.append(
            {
                "rig left out": rig.label,
                "friction of the others": f"{FRICTIONS[best]:.2f}",
                "rms on it": f"{rms(errors[rig.label][best]):.3f}",
            }
        )
    lines.append(
        {
            "rig left out": "all",
            "friction of the others": "",
            "rms on it": f"{rms(np.concatenate(left_out)):.3f}",
        }
    )
    show("2 Friction left one rig out", pd.DataFrame(lines))


def error_of_others(errors: dict[str, FloatArray], rig: Rig, rigs: Sequence[Rig]) -> float:
    """Rms of rigs of the same shape, without those of the laboratory."""
    chosen = [
        errors[named.label]
        for named in rigs
        if named.lugged == rig.lugged and named.name != rig.name
    ]
    return rms(np.concatenate(chosen))


def report_intervals(rigs: Sequence[Rig], drawbar: Errors) -> None:
    """Print how many runs lie inside their intervals at the load and the measured sinkage."""
    for case, options in CASES.items():
        lines = []
        of_shape: dict[str, list[pd.DataFrame]] = {}
        for rig in rigs:
            runs = graded(rig)
            error = error_of_others(drawbar[case], rig, rigs)
            predicted = roll(rig, runs, model_error=error, **options)
            rows = inside_rows(runs, predicted)
            of_shape.setdefault("lugged" if rig.lugged else "smooth", []).append(rows)
            lines.append({"rig": rig.label, "error of the others": f"{error:.3f}"} | counts(rows))
        for shape, tables in of_shape.items():
            lines.append(
                {"rig": f"all {shape}", "error of the others": ""} | counts(pd.concat(tables))
            )
        show(f"3 At the load, {case}: runs inside; half width over load", pd.DataFrame(lines))


def inside_rows(runs: pd.DataFrame, predicted: pd.DataFrame) -> pd.DataFrame:
    """Whether each run is inside, and half widths over the load, for both intervals."""
    measured, load = runs["drawbar_N"].to_numpy(), runs["load_N"].to_numpy()
    rows = {}
    for name in ("", "model_"):
        lo, hi = (predicted[f"drawbar_{name}{end}_N"].to_numpy() for end in ("lo", "hi"))
        rows[f"{name}inside"] = (lo <= measured) & (measured <= hi)
        rows[f"{name}half"] = (hi - lo) / 2 / load
    return pd.DataFrame(rows)


def counts(rows: pd.DataFrame) -> dict[str, str]:
    """Cells of the table of runs inside."""
    cells = {}
    for name, words in (("", "alpha"), ("model_", "with the other rigs' error")):
        half = rows[f"{name}half"]
        cells[f"inside, {words}"] = f"{rows[f'{name}inside'].sum()} of {len(rows)}"
        cells[f"half width, {words}: median, largest"] = f"{half.median():.2f}, {half.max():.2f}"
    return cells


def report_solved(rigs: Sequence[Rig], drawbar: Errors) -> None:
    """Print sinkage and drawbar solved from load and slip, with alpha of the run of least slip."""
    lines, every = [], []
    for rig in rigs:
        runs = graded(rig).reset_index(drop=True)
        options: dict[str, Any] = {"friction": FRICTION}
        alpha = roll(rig, runs, medium=without_draws(), **options)["alpha_of_load_N_per_cm3"]
        tested = runs.iloc[1:]
        sand = rftfit.scale(float(alpha[0]))
        error = error_of_others(drawbar[f"rule, friction {FRICTION:g}"], rig, rigs)
        solved = roll(rig, tested, medium=sand, sinkage_cm=None, model_error=error, **options)
        measured, load = tested["drawbar_N"].to_numpy(), tested["load_N"].to_numpy()
        depth = tested["sinkage_cm"].to_numpy()
        lo, hi = (solved[f"drawbar_{end}_N"].to_numpy() for end in ("lo", "hi"))
        model_lo, model_hi = (solved[f"drawbar_model_{end}_N"].to_numpy() for end in ("lo", "hi"))
        depth_lo, depth_hi = (solved[f"sinkage_{end}_cm"].to_numpy() for end in ("lo", "hi"))
        rows = pd.DataFrame(
            {
                "off": (solved["drawbar_N"].to_numpy() - measured) / load,
                "inside": (lo <= measured) & (measured <= hi),
                "half": (hi - lo) / 2 / load,
                "model_inside": (model_lo <= measured) & (measured <= model_hi),
                "model_half": (model_hi - model_lo) / 2 / load,
                "depth_inside": (depth_lo <= depth) & (depth <= depth_hi),
                "ln_depth": np.log(solved["sinkage_cm"].to_numpy() / depth),
                "share": alpha[1:].to_numpy() / alpha[0],
            }
        )
        every.append(rows.assign(lugged=rig.lugged))
        lines.append({"rig": rig.label} | solved_cells(rows))
    together = pd.concat(every)
    for title, chosen in (("all lugged", True), ("all smooth", False)):
        lines.append({"rig": title} | solved_cells(together[together["lugged"] == chosen]))
    lines.append({"rig": "all"} | solved_cells(together))
    show("4 Sinkage solved from load and slip, friction 0.4", pd.DataFrame(lines))


def solved_cells(rows: pd.DataFrame) -> dict[str, str]:
    """Cells of the table of solved sinkages."""
    return {
        "rms, drawbar over load": f"{rms(rows['off']):.3f}",
        "drawbar inside": f"{rows['inside'].sum()} of {len(rows)}",
        "half width over load, median": f"{rows['half'].median():.2f}",
        "drawbar inside with the other rigs' error": f"{rows['model_inside'].sum()} of {len(rows)}",
        "its half width, median": f"{rows['model_half'].median():.2f}",
        "sinkage inside": f"{rows['depth_inside'].sum()} of {len(rows)}",
        "rms of ln sinkage": f"{rms(rows['ln_depth']):.2f}",
        "alpha over that of the least slip": f"{rows['share'].min():.2f} to {rows['share'].max():.2f}",
    }


def draw_rigs(rigs: Sequence[Rig], drawbar: Errors, file: Path) -> None:
    """Draw drawbar over load of all rigs side by side: measured, and predicted at the load and the measured sinkage."""
    from matplotlib.figure import Figure

    page = Figure(figsize=(9.6, 4.8), layout="constrained")
    panels = page.subplots(2, 4, sharey=True).ravel()
    colours = dict(zip(CASES, ("#D55E00", "#E69F00", "#0072B2"), strict=True))
    for axes, rig in zip(panels, rigs, strict=False):
        runs = graded(rig)
        load = runs["load_N"].to_numpy()
        axes.plot(runs["slip"], runs["drawbar_N"] / load, "ko", markersize=4, label="measured")
        for case, options in CASES.items():
            error = error_of_others(drawbar[case], rig, rigs)
            table = roll(rig, runs, model_error=error, **options)
            axes.plot(runs["slip"], table["drawbar_N"] / load, color=colours[case], label=case)
        ends = (table[f"drawbar_model_{end}_N"] / load for end in ("lo", "hi"))
        label = "its interval, error of the other rigs"
        axes.fill_between(
            runs["slip"], *ends, color=colours[case], alpha=0.15, linewidth=0, label=label
        )
        axes.axhline(0, color="#808080", linewidth=0.5)
        axes.set_title(f"{rig.label} ({load.mean():.3g} N)", fontsize=8)
        axes.set_xlabel("slip")
    for axes in panels[::4]:
        axes.set_ylabel("drawbar over load")
    panels[-1].axis("off")
    panels[-1].legend(*panels[0].get_legend_handles_labels(), loc="center", fontsize=8)
    page.savefig(file, dpi=150)


def constants(rigs: Sequence[Rig], drawbar: Errors, torque: Errors) -> Iterator[str]:
    """Lines of `wheels.toml`: errors of each rig, without and with friction."""
    for rig in rigs:
        yield "\n[[rig]]"
        yield f'laboratory = "{rig.name}"'
        yield f'shape = "{"lugged" if rig.lugged else "smooth"}"'
        yield f"runs = {len(graded(rig))}"
        for name, case in (("plain", "rule"), ("friction", f"rule, friction {FRICTION:g}")):
            numbers = {"drawbar": drawbar[case][rig.label], "torque": torque[case][rig.label]}
            cells = (
                f"{quantity} = {rms(errors):.4f}"
                for quantity, errors in numbers.items()
                if np.isfinite(errors).any()
            )
            yield f"{name} = {{ {', '.join(cells)} }}"


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    parser.add_argument("--data", type=Path, default=default, metavar="FOLDER")
    parser.add_argument("--quick", action="store_true", help="without intervals and sinkages")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="all rigs side by side")
    options = parser.parse_args()
    rigs = read_rigs(options.data)
    drawbar, torque = report_rigs(rigs)
    report_kyoto(next(rig for rig in rigs if rig.name == "Kyoto"))
    report_friction(rigs)
    if not options.quick:
        report_intervals(rigs, drawbar)
        report_solved(rigs, drawbar)
    if options.figure is not None:
        draw_rigs(rigs, drawbar, options.figure)
    print("\n5 wheels.toml\n")
    print("\n".join(constants(rigs, drawbar, torque)))


if __name__ == "__main__":
    main()
