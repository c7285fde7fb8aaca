"""``rftfit example``: a real campaign, from its logs to forces on legs."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import typer

import rftfit
from rftfit.cli.output import count, megabytes, say, table
from rftfit.errors import InputError, OutputError
from rftfit.store import atomic_path, write_bytes
from rftfit.store.digests import read_sums, sha256_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.cli.predict import Peak
    from rftfit.compare.sands import Estimate, PlateResult
    from rftfit.measure.ingest import Trace


# --- Where an example's files come from: the package, a folder, a mirror, or the public repository.


SUMS = "logs.sha256"
INSTALL = "pip install pooch"


@dataclass(frozen=True)
class Example:
    """One example: its own files, and where its logs are to be had.

    `address`: Folder of the logs on the web, ending with a slash; pinned, so that it never
        changes.
    `credit`: Who recorded them, and their licence.
    """

    name: str
    title: str
    address: str
    credit: str


EXAMPLES = {
    "cmu-sand": Example(
        "cmu-sand",
        "nine penetrations of circular plates into sand",
        "https://raw.githubusercontent.com/robomechanics/3d-terramechanics/"
        "55a6e92b35cb7a94530e47311fd7c4767fafb835/raw-data-processing/f-d-large-box/",
        "Catherine Pavlov and Aaron Johnson, Carnegie Mellon University, MIT licence",
    )
}


def own_files(name: str) -> Path:
    """Find the files of an example: at the top of a checkout, inside the package where installed.

    Returns its folder.
    """
    package = Path(rftfit.__file__).resolve().parent
    for folder in (package.parents[1] / "examples" / name, package / "_examples" / name):
        if (folder / SUMS).is_file():
            return folder
    raise InputError(f"the files of the example {name} are not there; install rftfit again")


def lay_out(source: Path, folder: Path) -> None:
    """Copy configuration and run sheet into the folder; what is there is never overwritten.

    `source`: From `own_files`.
    """
    for file in sorted((source / "config").iterdir()):
        target = folder / "config" / file.name
        if not target.exists():
            write_bytes(target, file.read_bytes())


def fetch_logs(example: Example, source: Path, raw: Path, origin: str | None) -> None:
    """Bring the logs into the raw folder, each checked against its known sha256.

    `source`: From `own_files`. `raw`: Logs that are there and are right stay as they are.
    `origin`: A folder, or the address of a mirror; the public repository if not given.
    """
    sums = read_sums(source / SUMS)
    lacking = {name: digest for name, digest in sums.items() if not _is_right(raw / name, digest)}
    if not lacking:
        say(f"All {count(len(sums), 'log')} are there, checked against their sha256.")
        return
    wrong = [name for name in lacking if (raw / name).exists()]
    if wrong:
        raise InputError(
            f"{raw / wrong[0]}: not the log of that name (its sha256 differs), and "
            f"{count(len(wrong) - 1, 'other')} like it; move them away"
        )
    try:
        raw.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"{raw}: cannot be made: {error.strerror}; allow writing there or name another folder"
        ) from error
    if origin is not None and "://" not in origin:
        _copy(Path(origin), raw, lacking)
    else:
        address = example.address if origin is None else origin.rstrip("/") + "/"
        _download(address, raw, lacking)
    size = sum((raw / name).stat().st_size for name in lacking)
    say(
        f"{count(len(lacking), 'log')}, {megabytes(size)}, from {origin or example.address}, "
        "checked against their sha256."
    )
    say(f"Recorded by {example.credit}.")


def _is_right(path: Path, digest: str) -> bool:
    return path.is_file() and sha256_of(path) == digest


def _copy(folder: Path, raw: Path, wanted: Mapping[str, str]) -> None:
    for name, digest in wanted.items():
        if not (folder / name).is_file():
            raise InputError(
                f"--from: no {name} in {folder}; allowed: a folder with all logs of the example"
            )
        if not _is_right(folder / name, digest):
            raise InputError(
                f"--from: {folder / name} is not the log of that name (sha256 differs)"
            )
        with atomic_path(raw / name) as part:
            shutil.copyfile(folder / name, part)


def _download(address: str, raw: Path, wanted: Mapping[str, str]) -> None:
    try:
        import pooch
    except ImportError:
        raise InputError(
            f"logs are downloaded with the package pooch; install it: {INSTALL}; or give a folder "
            "that has them: --from DIR"
        ) from None
    pooch.get_logger().setLevel("ERROR")
    known = {name: f"sha256:{digest}" for name, digest in wanted.items()}
    store = pooch.create(path=raw, base_url=address, registry=known, retry_if_failed=2)
    for place, name in enumerate(wanted, start=1):
        say(f"  {place} of {len(wanted)}: {name}")
        try:
            store.fetch(name)
        except (OSError, ValueError) as error:
            # the libraries below raise errors of many kinds, all of these two families
            raise InputError(
                f"{address}{name}: cannot be downloaded ({str(error).splitlines()[0][:200]}); without "
                "a connection, give a folder that has the logs: --from DIR"
            ) from error


# --- What an example of plate penetrations says, in words that follow from its numbers.


LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
_PLATE_OF_THE_PAPER_CM = 3.8


class Run(NamedTuple):
    """One run: clocks, surface and slope; NaN where there is none.

    `clock_s`, `clock_se_s`: Offset of the clocks and its standard error.
    `surface_mm`, `surface_se_mm`: Arm z of the free surface and its standard error.
    `alpha`, `alpha_se`, `alpha_dof`: alpha_z(0, 90 deg), N/cm^3, its standard error and degrees of
        freedom.
    `curvature`, `curvature_p`: Departure of a parabola from the line at the end of the window, and
        its probability by noise.
    `reason`: Why there is no alpha.
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

    `peaks`: Greatest forces, by leg and name.
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

    `combined`: By plate, the smallest first. `sizes`: cm. `with_size`: Exponent m of alpha ~
    size^m. `spread`: Where the run-to-run spread is from. `folder`: Name of the results' folder.
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


# --- Penetrations with plates of several sizes, from logs to alpha, zeta and forces on legs.


class _Chain(NamedTuple):
    """What the campaign's own stages made of a medium."""

    traces: list[Trace]
    status: pd.DataFrame
    fits: pd.DataFrame
    stress: dict[str, tuple[np.ndarray, np.ndarray]]
    ledger: pd.DataFrame


def run_plates(config: Path, results: Path) -> str:
    """Run the chain on a campaign of vertical penetrations and write its results.

    `results`: Folder; gets ``runs.csv``, ``fits.csv``, ``ledger.csv``, ``plates.csv``,
    ``forces.csv``, ``summary.txt`` and the figures ``clocks`` and ``stress``. Returns the summary,
    for people.
    """
    from rftfit.campaign.load import load_campaign
    from rftfit.compare.sands import by_plate, depth_exponent, size_exponent
    from rftfit.figures.plates import draw_plates
    from rftfit.figures.protocol import draw_clocks
    from rftfit.figures.style import save
    from rftfit.measure.ledger import check
    from rftfit.store import write_csv, write_text

    campaign = load_campaign(config)
    chain = _chain(campaign)
    check(chain.ledger, chain.status)
    runs = _runs(campaign, chain)
    good = [run for run in runs if np.isfinite(run.alpha)]
    confidence = campaign.config.fit.confidence
    plates = sorted({run.plate for run in good}, key=lambda name: _size(campaign, name))
    if not plates:
        reasons = "; ".join(f"{run.name}: {run.reason}" for run in runs)
        raise InputError(f"no run gives an alpha: {reasons}")
    of_plate = {name: [run for run in good if run.plate == name] for name in plates}
    combined, spread = by_plate(
        {
            name: (
                np.array([run.alpha for run in own]),
                np.array([run.alpha_se for run in own]),
                np.array([run.alpha_dof for run in own]),
            )
            for name, own in of_plate.items()
        },
        {
            name: np.array([depth_exponent(*chain.stress[run.name]) for run in own])
            for name, own in of_plate.items()
        },
        confidence,
    )
    sizes = {name: _size(campaign, name) for name in plates}
    with_size = size_exponent(
        [sizes[run.plate] for run in good], [run.alpha for run in good], confidence
    )
    scalings, forces = _scale(combined, confidence)
    text = summary(
        campaign.config, runs, combined, sizes, with_size, spread.source, scalings, results.name
    )
    ends = {name: (r.alpha.value, r.alpha.lo, r.alpha.hi) for name, r in combined.items()}
    write_csv(chain.status, results / "runs.csv")
    write_csv(chain.fits, results / "fits.csv")
    write_csv(chain.ledger, results / "ledger.csv")
    write_csv(_plates_table(combined, sizes, scalings), results / "plates.csv")
    write_csv(forces, results / "forces.csv")
    save(draw_clocks(chain.traces), results / "clocks")
    save(draw_plates(chain.stress, of_plate, ends, sizes), results / "stress")
    write_text(results / "summary.txt", text + "\n")
    return text


def _chain(campaign: Campaign) -> _Chain:
    """Go through ingest, tare and slopes, as the workflow does."""
    import pandas as pd

    from rftfit.measure.fits import fit_medium
    from rftfit.measure.ingest import ingest_traces, samples_of
    from rftfit.measure.ledger import RowStatus, join
    from rftfit.measure.strokes import split_runs
    from rftfit.measure.tare import tare_medium

    parts: list[_Chain] = []
    for medium in campaign.media_with_runs:
        traces, rows, first = ingest_traces(campaign, medium)
        status = pd.DataFrame(rows)
        tared, tares, second = tare_medium(campaign, medium, samples_of(traces), status)
        fits, windows, third = fit_medium(campaign, medium, status, tared, tares)
        good = windows["why"].to_numpy() == RowStatus.GOOD
        stress = {}
        for name, place in split_runs(tared).items():
            area = campaign.config.intruders[campaign.by_id[name].intruder]
            part = tared.iloc[place][good[place]]
            assert area.shape != "leg"
            stress[name] = (
                part["depth_cm"].to_numpy(),
                part["force_z_N"].to_numpy() / area.area_cm2,
            )
        book = join([first.table(), second.table(), third.table()])
        parts.append(_Chain(traces, status, fits, stress, book))
    return _Chain(
        [trace for part in parts for trace in part.traces],
        pd.concat([part.status for part in parts], ignore_index=True),
        pd.concat([part.fits for part in parts], ignore_index=True),
        {name: pair for part in parts for name, pair in part.stress.items()},
        pd.concat([part.ledger for part in parts], ignore_index=True),
    )


def _runs(campaign: Campaign, chain: _Chain) -> list[Run]:
    status = {row["run_id"]: row for row in chain.status.to_dict("records")}
    runs = []
    for row in chain.fits.to_dict("records"):
        fact = status[row["run_id"]]
        runs.append(
            Run(
                str(row["run_id"]),
                campaign.by_id[str(row["run_id"])].intruder,
                float(fact["clock_offset_s"]),
                float(fact["clock_se_s"]),
                float(fact.get("surface_z_mm", np.nan)),
                float(fact.get("surface_se_mm", np.nan)),
                float(row["alpha_z_N_per_cm3"]),
                float(row["alpha_z_se_N_per_cm3"]),
                float(row["alpha_z_dof"]),
                float(row["nonlinear_z_ratio"]),
                float(row["nonlinear_z_p"]),
                str(row["reason"]),
            )
        )
    return runs


def _size(campaign: Campaign, name: str) -> float:
    plate = campaign.config.intruders[name]
    assert plate.shape != "leg"
    return plate.length_cm


def _scale(
    combined: dict[str, PlateResult], confidence: float
) -> tuple[dict[str, Scaling], pd.DataFrame]:
    """Run the scaling routine on alpha of each plate; zeta, peak forces, and forces by pose."""
    import pandas as pd

    from rftfit.cli.predict import find_peaks, from_test, make_motion, make_outline, predict_forces
    from rftfit.cli.scale import scale_from
    from rftfit.model.scaling import published

    reference, motion = published(), make_motion(None, None)
    scalings, parts = {}, []
    for name, result in combined.items():
        scaled = scale_from(reference, result.alpha.value, result.alpha.se, confidence)
        source = from_test(reference, result.alpha.value, result.alpha.se, confidence)
        peaks = {}
        for leg in LEGS:
            outline = make_outline(leg, None, None, None, 30)
            prediction = predict_forces(source, outline, motion.poses, confidence)
            peaks[leg] = {peak.name: peak for peak in find_peaks(motion, prediction)}
            columns = {"plate": name, "leg": leg, motion.key: motion.columns[motion.key]}
            for quantity in ("force_z_N", "force_x_N"):
                stem = quantity.removesuffix("_N")
                lo, hi = prediction.ends[quantity]
                columns |= {
                    quantity: prediction.values[quantity],
                    f"{stem}_lo_N": lo,
                    f"{stem}_hi_N": hi,
                }
            parts.append(pd.DataFrame(columns))
        scalings[name] = Scaling(scaled.zeta, scaled.zeta_lo, scaled.zeta_hi, peaks)
    return scalings, pd.concat(parts, ignore_index=True)


def _plates_table(
    combined: dict[str, PlateResult], sizes: dict[str, float], scalings: dict[str, Scaling]
) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(
        [
            {
                "plate": name,
                "size_cm": sizes[name],
                "runs": result.runs,
                "alpha_z_N_per_cm3": result.alpha.value,
                "alpha_z_se_N_per_cm3": result.alpha.se,
                "alpha_z_lo_N_per_cm3": result.alpha.lo,
                "alpha_z_hi_N_per_cm3": result.alpha.hi,
                "largest_deviation_percent": 100 * result.largest_deviation,
                "depth_exponent": result.exponent.value,
                "depth_exponent_lo": result.exponent.lo,
                "depth_exponent_hi": result.exponent.hi,
                "zeta": scalings[name].zeta,
                "zeta_lo": scalings[name].lo,
                "zeta_hi": scalings[name].hi,
            }
            for name, result in combined.items()
        ]
    )


# --- ``rftfit example``: a real campaign, from its logs to forces on legs.


def example(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Which example: cmu-sand.")],
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="DIR", help="Where to; default: a folder of the example's name."),
    ] = None,
    origin: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="DIR or URL",
            help="Take the logs from this folder or mirror instead of the public repository.",
        ),
    ] = None,
) -> None:
    """Run a campaign of real logs: download them, find clocks and surface, fit, scale, predict.

    cmu-sand: nine penetrations of circular plates of three sizes into sand, force in ROS bags and
    motion in text files on another clock (23 MB).
    """
    from rftfit.campaign.problems import did_you_mean

    if name not in EXAMPLES:
        nearest = did_you_mean(name, tuple(EXAMPLES))
        hint = f"; did you mean {nearest}?" if nearest else ""
        raise InputError(f"no example {name!r}; allowed: {', '.join(EXAMPLES)}{hint}")
    chosen = EXAMPLES[name]
    target = Path(name) if folder is None else folder
    say(f"{chosen.title.capitalize()}, in {target}")
    source = own_files(name)
    lay_out(source, target)
    fetch_logs(chosen, source, target / "raw", origin)
    say()

    say(run_plates(target / "config" / "config.yaml", target / "results"))
