"""What an example of plate penetrations says, in words that follow from its numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rftfit.cli.output import count, table

if TYPE_CHECKING:
    from rftfit.campaign.config import Config
    from rftfit.cli.predict_summary import Peak
    from rftfit.validate.plates import Estimate, PlateResult

LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
_PLATE_OF_THE_PAPER_CM = 3.8


class Run(NamedTuple):
    """One run: clocks, surface and slope; NaN where there is none.

    Parameters
    ----------
    name, plate : str
    clock_s, clock_se_s : float
        Offset of the clocks and its standard error.
    surface_mm, surface_se_mm : float
        Arm z of the free surface and its standard error.
    alpha, alpha_se, alpha_dof : float
        alpha_z(0, 90 deg), N/cm^3, its standard error and degrees of freedom.
    curvature, curvature_p : float
        Departure of a parabola from the line at the end of the window, and its probability by noise.
    reason : str
        Why there is no alpha.
    """

    name: str
    plate: str
    clock_s: float
    clock_se_s: float
    surface_mm: float
    surface_se_mm: float
    alpha: float
    alpha_se: float
    alpha_dof: float
    curvature: float
    curvature_p: float
    reason: str


class Scaling(NamedTuple):
    """What the scaling routine makes of the alpha of one plate.

    Parameters
    ----------
    zeta, lo, hi : float
    peaks : dict of str to dict of str to Peak
        Greatest forces, by leg and name.
    """

    zeta: float
    lo: float
    hi: float
    peaks: dict[str, dict[str, Peak]]


def summary(
    config: Config,
    runs: list[Run],
    combined: dict[str, PlateResult],
    sizes: dict[str, float],
    with_size: Estimate,
    spread: str,
    scalings: dict[str, Scaling],
    folder: str,
) -> str:
    """Write the summary.

    Parameters
    ----------
    config : Config
    runs : list of Run
    combined : dict of str to PlateResult
        By plate, the smallest first.
    sizes : dict of str to float
        cm.
    with_size : Estimate
        Exponent m of alpha ~ size^m.
    spread : str
        Where the run-to-run spread is from.
    scalings : dict of str to Scaling
    folder : str
        Name of the results' folder.

    Returns
    -------
    str
    """
    level = f"{100 * config.fit.confidence:g} %"
    return "\n\n".join(
        [
            _runs_text(runs),
            _plates_text(config, combined, sizes, scalings, spread, level),
            _verdict(combined, with_size, level),
            _legs_text(config, combined, sizes, scalings, level),
            f"Tables and figures: {folder}/\n(clocks: how clocks and surface were found; stress: every "
            + "run beside its fit).",
        ]
    )


def _runs_text(runs: list[Run]) -> str:
    rows = []
    for run in runs:
        hours = round(run.clock_s / 3600) if np.isfinite(run.clock_s) else 0
        rest = run.clock_s - 3600 * hours
        rows.append(
            [
                run.name,
                f"{hours:+d} h {rest:+.3f} s",
                f"{run.clock_se_s:.3f}",
                f"{run.surface_mm:.2f}",
                f"{run.surface_se_mm:.2f}",
                f"{run.alpha:.3f}",
                f"{run.alpha_se:.3f}",
                run.reason,
            ]
        )
    header = ["run", "motion - force clock", "+-", "surface (mm)", "+-", "alpha_z", "+-", ""]
    return (
        "Clocks and surface, found from the logs; alpha_z(0, 90 deg) in N/cm^3; +- standard errors\n\n"
        + table(header, rows)
    )


def _plates_text(
    config: Config, combined: dict[str, PlateResult], sizes: dict[str, float],
    scalings: dict[str, Scaling], spread: str, level: str,
) -> str:  # fmt: skip
    rows = [
        [
            name,
            f"{sizes[name]:g}",
            str(result.runs),
            f"{result.alpha.value:.3f}",
            f"{result.alpha.lo:.3f} to {result.alpha.hi:.3f}",
            f"{100 * result.largest_deviation:.1f} %",
            f"{scalings[name].zeta:.3f}",
            f"{scalings[name].lo:.3f} to {scalings[name].hi:.3f}",
        ]
        for name, result in combined.items()
    ]
    header = ["plate", "cm", "runs", "alpha_z", level, "farthest run", "zeta", level]
    fit = config.fit
    window = f"{fit.submergence_cm or 0:g} to {fit.max_depth_cm or np.nan:g} cm"
    bare = ", no tare subtracted" if fit.missing_tare == "flag" else ""
    return (
        f"alpha_z(0, 90 deg) over depths of {window}{bare}; run-to-run spread: {spread};\n"
        "zeta by the scaling routine from the published five media (interval for one further medium)\n\n"
        + table(header, rows)
    )


def _verdict(combined: dict[str, PlateResult], with_size: Estimate, level: str) -> str:
    rows = [
        [name, f"{r.exponent.value:.2f}", f"{r.exponent.lo:.2f} to {r.exponent.hi:.2f}"]
        for name, r in combined.items()
    ]
    bent = [name for name, r in combined.items() if r.exponent.lo > 1]
    straight = [name for name, r in combined.items() if r.exponent.holds(1)]
    if len(bent) == len(combined):
        linear = "Not linear: with every plate stress grows faster than in proportion to depth."
    elif bent:
        linear = f"Not linear with {', '.join(bent)}; undecided with the others."
    elif len(straight) == len(combined):
        linear = "No departure from proportion to depth beyond the scatter of the runs."
    else:
        linear = "Stress grows more slowly than in proportion to depth with some plate."
    if with_size.holds(0):
        size = "No dependence on the size of the plate beyond the scatter of the runs."
    else:
        more = "more" if with_size.value > 0 else "less"
        size = (
            f"And it depends on the plate: the larger, the {more} stress at equal depth, "
            "alpha ~ size^m\n"
            f"with m = {with_size.value:.2f} ({with_size.lo:.2f} to {with_size.hi:.2f}). Resistive "
            "force theory has n = 1 and m = 0."
        )
    return (
        f"Is stress proportional to depth? stress ~ depth^n within the window, {level} from the scatter "
        f"of the runs\n\n{table(['plate', 'n', level], rows)}\n\n{linear}\n{size}"
    )


def _legs_text(
    config: Config, combined: dict[str, PlateResult], sizes: dict[str, float],
    scalings: dict[str, Scaling], level: str,
) -> str:  # fmt: skip
    nearest = min(combined, key=lambda name: abs(sizes[name] - _PLATE_OF_THE_PAPER_CM))
    rows = []
    for leg, peaks in scalings[nearest].peaks.items():
        cells = []
        for name in ("lift", "thrust"):
            peak = peaks.get(name)
            cells += (
                ["-", "-"]
                if peak is None
                else [f"{peak.value:.1f}", f"{peak.lo:.1f} to {peak.hi:.1f}"]
            )
        rows.append([leg, *cells])
    ratios = ", ".join(
        f"{result.alpha.value / combined[nearest].alpha.value:.2f} times with {name}"
        for name, result in combined.items()
        if name != nearest
    )
    deepest = config.fit.max_depth_cm
    reach = (
        f" The plates tell of the sand down to {deepest:g} cm; the tip of a leg goes to 5.6 cm."
        if deepest
        else ""
    )
    others = f"\nThe same prediction is {ratios}." if ratios else ""
    return (
        f"Forces on the model legs in this sand (N), from {nearest}, nearest in size to the plate that "
        f"resistive\nforce theory was measured with ({count(len(rows), 'leg')}, hip at 2 cm)\n\n"
        + table(["leg", "peak lift", level, "peak thrust", level], rows)
        + others
        + ("\n" + reach.strip() if reach else "")
    )
