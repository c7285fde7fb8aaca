"""``rftfit example``: a real campaign, from its logs to forces on legs."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli.output import count, megabytes, say, table
from rftfit.errors import InputError, OutputError
from rftfit.store import atomic_path, write_bytes, write_text
from rftfit.store.digests import read_sums, sha256_of
from rftfit.store.environment import shipped

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from rftfit.workflow.plates import Plates

SUMS = "logs.sha256"
_PLATE_OF_THE_PAPER_CM = 3.8


@dataclass(frozen=True)
class Example:
    """One example: a pinned folder on the web with its logs, and who recorded them, with the licence."""

    title: str
    address: str
    credit: str


EXAMPLES = {
    "cmu-sand": Example(
        "nine penetrations of circular plates into sand",
        "https://raw.githubusercontent.com/robomechanics/3d-terramechanics/"
        "55a6e92b35cb7a94530e47311fd7c4767fafb835/raw-data-processing/f-d-large-box/",
        "Catherine Pavlov and Aaron Johnson, Carnegie Mellon University, MIT licence",
    )
}


def own_files(name: str) -> Path:
    """Folder of an example: its configuration, run sheet and the sums of its logs."""
    return shipped(f"examples/{name}")


def lay_out(source: Path, folder: Path) -> None:
    """Copy configuration and run sheet into the folder; what is there is never overwritten."""
    for file in sorted((source / "config").iterdir()):
        target = folder / "config" / file.name
        if not target.exists():
            write_bytes(target, file.read_bytes())


def fetch_logs(example: Example, source: Path, raw: Path, origin: str | None) -> None:
    """Bring the logs that are not there yet into the raw folder, each checked against its sha256.

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
            "logs are downloaded with the package pooch; install it: pip install pooch; or give a folder "
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


def summary(found: Plates, folder: str) -> str:
    """Say what the plates come to, in words that follow from the numbers."""
    level = f"{100 * found.config.fit.confidence:g} %"
    closing = (
        f"Tables and figures: {folder}/\n"
        "(clocks: how clocks and surface were found; stress: every run beside its fit)."
    )
    return "\n\n".join(
        [
            _runs_text(found.runs),
            _plates_text(found, level),
            _verdict(found, level),
            _legs_text(found, level),
            closing,
        ]
    )


def _runs_text(runs: pd.DataFrame) -> str:
    rows = []
    run: Any
    for run in runs.itertuples():
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


def _plates_text(found: Plates, level: str) -> str:
    rows = [
        [
            name,
            f"{found.sizes_cm[name]:g}",
            str(result.runs),
            f"{result.alpha.value:.3f}",
            f"{result.alpha.lo:.3f} to {result.alpha.hi:.3f}",
            f"{100 * result.largest_deviation:.1f} %",
            f"{found.scaled[name].zeta:.3f}",
            f"{found.scaled[name].zeta_lo:.3f} to {found.scaled[name].zeta_hi:.3f}",
        ]
        for name, result in found.combined.items()
    ]
    header = ["plate", "cm", "runs", "alpha_z", level, "farthest run", "zeta", level]
    fit = found.config.fit
    window = f"{fit.submergence_cm or 0:g} to {fit.max_depth_cm or np.nan:g} cm"
    bare = ", no tare subtracted" if fit.missing_tare == "flag" else ""
    return (
        f"alpha_z(0, 90 deg) over depths of {window}{bare}; run-to-run spread: {found.spread};\n"
        "zeta by the scaling routine from the published five media, method lsq (interval for one further medium)\n\n"
        + table(header, rows)
    )


def _verdict(found: Plates, level: str) -> str:
    combined, with_size = found.combined, found.with_size
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


def _legs_text(found: Plates, level: str) -> str:
    from rftfit.model.prediction import find_peaks

    sizes = found.sizes_cm
    nearest = min(sizes, key=lambda name: abs(sizes[name] - _PLATE_OF_THE_PAPER_CM))
    rows = []
    profile, confidence = found.scaled[nearest].profile, found.config.fit.confidence
    for leg in dict.fromkeys(found.forces["leg"]):
        outline = rftfit.model_leg(leg)
        peaks = {one.name: one for one in find_peaks(profile, outline, None, confidence)}
        cells = []
        for name in ("lift", "thrust"):
            peak = peaks.get(name)
            cells += (
                ["-", "-"]
                if peak is None
                else [f"{peak.value:.1f}", f"{peak.lo:.1f} to {peak.hi:.1f}"]
            )
        rows.append([str(leg), *cells])
    alpha = found.combined[nearest].alpha.value
    ratios = ", ".join(
        f"{result.alpha.value / alpha:.2f} times with {name}"
        for name, result in found.combined.items()
        if name != nearest
    )
    text = (
        f"Forces on the model legs in this sand (N), from {nearest}, nearest in size to the plate that "
        f"resistive\nforce theory was measured with ({count(len(rows), 'leg')}, hip at 2 cm)\n\n"
        + table(["leg", "peak lift", level, "peak thrust", level], rows)
    )
    if ratios:
        text += f"\nThe same prediction is {ratios}."
    if deepest := found.config.fit.max_depth_cm:
        text += f"\nThe plates tell of the sand down to {deepest:g} cm; the tip of a leg goes to 5.6 cm."
    return text


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
    from rftfit.workflow.plates import run_plates

    chosen = EXAMPLES[choose("example", name, tuple(EXAMPLES))]
    target = Path(name) if folder is None else folder
    say(f"{chosen.title.capitalize()}, in {target}")
    source = own_files(name)
    lay_out(source, target)
    fetch_logs(chosen, source, target / "raw", origin)
    results = target / "results"
    text = summary(run_plates(target / "config" / "config.yaml", results), results.name)
    write_text(results / "summary.txt", text + "\n")
    say(f"\n{text}")
