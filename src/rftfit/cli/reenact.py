"""``rftfit reenact``: the demonstration campaign, made from published results."""

from __future__ import annotations

import contextlib
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import rftfit
from rftfit.cli.output import count, megabytes, say, table
from rftfit.errors import InputError, OutputError
from rftfit.reference import CITATION
from rftfit.store import write_text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rftfit.campaign.load import Layout


# --- The file that tells re-enacted logs from original ones, and the care that hangs on it.


MARKER = "REENACTED.txt"

_LIST = "files (bytes, path from this folder):"
_UNFINISHED = "-"
_PART = re.compile(r"^\.(?P<stem>.+)\.\d+\.part(?P<suffix>\.\w+)?$")
_MOST_SHOWN = 5


@dataclass(frozen=True)
class Earlier:
    """What an earlier re-enactment left.

    `files`: Those of its files that are there, the run sheet first.
    """

    files: tuple[Path, ...] = ()


def write_marker(raw: Path, names: Iterable[Path], what: str, *, complete: bool) -> None:
    """Say in the raw folder what its logs are, and which files belong to the re-enactment.

    `names`: Files of the re-enactment, the run sheet included. `what`: Seed, media and faults.
    `complete`: False before the first log is written: the sizes are not known then.
    """
    lines = []
    for path in sorted(set(names)):
        relative = Path(os.path.relpath(path, raw)).as_posix()
        if not complete:
            lines.append(f"{_UNFINISHED} {relative}")
        elif path.is_file():
            lines.append(f"{path.stat().st_size} {relative}")
    text = (
        "The logs in this folder are re-enacted: computed from published results, for\n"
        "demonstration and tests. They are not original recordings.\n\n"
        f"Published in: {CITATION}.\n"
        f"Made by: rftfit {rftfit.__version__}, rftfit reenact, {what}.\n\n"
        "rftfit reenact clears and rewrites the files of this list and touches no others.\n"
    )
    write_text(raw / MARKER, f"{text}{_LIST}\n" + "\n".join(lines) + "\n")


def find_earlier(raw: Path, sheet: Path) -> Earlier:
    """Look for an earlier re-enactment, and for anything that is none.

    Returns without files where the raw folder is empty or missing.
    """
    if raw.exists() and not raw.is_dir():
        raise InputError(f"{raw}: this is no folder, so no logs can be written into it")
    marker = raw / MARKER
    there = {path for path in _walk(raw) if path not in (marker, raw / "README.md")}
    there.discard(sheet)
    if sheet.is_file() and not _only_a_header(sheet):
        there.add(sheet)
    if not marker.is_file():
        if there:
            raise InputError(
                f"{raw}: {_listed(there, raw)} not from a re-enactment (no {MARKER} says so), so "
                "nothing was written. Original logs are never overwritten: name another folder as "
                "`raw` and another `run_sheet` in the config, or move these files away"
            )
        return Earlier()
    sizes = _read_marker(marker, raw, sheet)
    foreign = {path for path in there if not _is_ours(path, sizes)}
    if foreign:
        raise InputError(
            f"{raw}: {_listed(foreign, raw)} not as the re-enactment wrote them (see {MARKER}), so "
            "nothing was written; move these files away, then re-enact again"
        )
    # the sheet first: while it is there, so are all the logs that it names
    return Earlier(tuple(sorted(there, key=lambda path: (path != sheet, path))))


def clear(earlier: Earlier) -> int:
    """Remove the files of an earlier re-enactment.

    `earlier`: From `find_earlier`. Returns how many.
    """
    for path in earlier.files:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(
                f"{path}: cannot be removed: {error.strerror or error}; allow writing there or close "
                "it in other programs"
            ) from error
    for folder in {path.parent for path in earlier.files}:
        # it refuses a folder that holds anything
        with contextlib.suppress(OSError):
            folder.rmdir()
    return len(earlier.files)


def _walk(raw: Path) -> list[Path]:
    def stop(error: OSError) -> None:
        # a folder that cannot be looked into may hold anything
        raise InputError(f"{error.filename}: cannot be looked into: {error.strerror}") from error

    found = []
    for folder, folders, names in os.walk(raw, onerror=stop if raw.is_dir() else None):
        found += [Path(folder) / name for name in names]
        # a link to a folder elsewhere is somebody's too: logs must not be written through it
        found += [Path(folder) / name for name in folders if (Path(folder) / name).is_symlink()]
    return found


def _read_marker(marker: Path, raw: Path, sheet: Path) -> dict[Path, int | None]:
    try:
        head, found, listing = marker.read_text(encoding="utf-8").partition(f"{_LIST}\n")
    except (OSError, ValueError) as error:
        raise InputError(
            f"{marker}: cannot be read: {error}; delete the folder yourself if no original log is in it"
        ) from error
    sizes: dict[Path, int | None] = {}
    for line in listing.splitlines():
        size, _, name = line.partition(" ")
        path = Path(os.path.normpath(raw / name))
        # an edited list must not reach outside
        inside = path.is_relative_to(raw) or path == sheet
        if not name or not inside or not (size == _UNFINISHED or size.isdecimal()):
            found = ""
            break
        sizes[path] = None if size == _UNFINISHED else int(size)
    if not head or not found:
        raise InputError(
            f"{marker}: this list has been changed, so it is not known which logs are re-enacted "
            "and nothing was written; delete the folder yourself if no original log is in it"
        )
    return sizes


def _is_ours(path: Path, sizes: dict[Path, int | None]) -> bool:
    part = _PART.match(path.name)
    if part:
        # left by a writer that was killed
        return path.with_name(f"{part['stem']}{part['suffix'] or ''}") in sizes
    return path in sizes and not path.is_symlink() and sizes[path] in (None, path.stat().st_size)


def _only_a_header(sheet: Path) -> bool:
    """Tell whether a run sheet is still as `rftfit init` made it."""
    try:
        lines = sheet.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError):
        return False
    return sum(1 for line in lines if line.strip()) <= 1


def _listed(paths: set[Path], raw: Path) -> str:
    names = sorted(Path(os.path.relpath(path, raw)).as_posix() for path in paths)
    rest = len(names) - _MOST_SHOWN
    shown = ", ".join(names[:_MOST_SHOWN]) + (f" and {rest} more files" if rest > 0 else "")
    return f"{shown} {'is' if len(names) == 1 else 'are'}"


# --- ``rftfit reenact``: the demonstration campaign, made from published results.


PLAINLY = (
    "These logs are re-enacted from published results: they are not original recordings, and what\n"
    "is computed from them shows how well the program works, not how sand behaves."
)


def reenact(
    config: Annotated[Path, typer.Option(help="The campaign's configuration.")] = Path(
        "config/config.yaml"
    ),
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same bytes.")] = 2013,
    media: Annotated[
        list[str] | None, typer.Option(help="Only this medium of the config; may be repeated.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME or NAME:RUN_ID",
            help="Break the campaign on purpose, for tests and teaching; may be repeated.",
        ),
    ] = None,
    if_missing: Annotated[
        bool, typer.Option("--if-missing", help="Do nothing where the run sheet is there already.")
    ] = False,
    list_faults: Annotated[
        bool, typer.Option("--list-faults", help="List the faults there are and stop.")
    ] = False,
    spread: Annotated[
        float,
        typer.Option(min=0, help="Let beds differ from run to run: standard deviation, N/cm^3."),
    ] = 0.0,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes that write at once; default: all cores.")
    ] = None,
) -> None:
    """Write the logs that the paper's lab would have recorded, and their run sheet.

    They go into the raw folder and the run sheet that the config names. A folder that holds logs of
    another origin is refused; those of an earlier re-enactment are cleared first.
    """
    if list_faults:
        say(faults_table())
        return
    from rftfit.campaign.load import read_layout

    places = read_layout(config)
    # the sheet is written last and cleared first, so where it is, the logs are
    if if_missing and places.sheet.is_file() and not _lacks_tracks(places):
        say(f"The run sheet {_from_root(places, places.sheet)} is there already: nothing to do.")
        return
    _write(places, seed, media or None, tuple(fault or ()), workers or _cores(), spread)


def _lacks_tracks(places: Layout) -> bool:
    """Whether the medium of the robot was re-enacted before the robot itself could be."""
    robot = places.config.robot
    if robot is None or robot.runs is None or not (places.raw / robot.medium).is_dir():
        return False
    return not (places.raw / robot.runs).is_file()


def faults_table() -> str:
    """List the faults: name, the run that gets it unless another is named, what it does."""
    from rftfit.lab.rig import DEFAULT_RUNS, FAULTS

    rows = [[name, DEFAULT_RUNS[name], what] for name, what in FAULTS.items()]
    return table(["fault", "run of the first medium", "what it does"], rows, indent="")


def _write(
    places: Layout,
    seed: int,
    media: list[str] | None,
    faults: tuple[str, ...],
    workers: int,
    spread: float,
) -> None:
    from rftfit.lab import plan_runs
    from rftfit.lab import reenact as enact
    from rftfit.lab.plan import media_of
    from rftfit.lab.rig import resolve
    from rftfit.lab.tracks import track_files

    if places.sheet.suffix.lower() != ".csv":
        raise InputError(
            f"config, key run_sheet: found '{places.config.run_sheet}'; allowed here: a .csv file, "
            "which is what a re-enactment writes"
        )
    # a misspelled word must not cost the logs that are there: everything is checked before
    chosen = media_of(places.config, media)
    if not chosen:
        raise InputError(
            "config, key media: no medium here names published measurements to re-enact "
            "(published_as), so nothing was written; the demonstration campaign's config does"
        )
    runs = plan_runs(places.config, media)
    resolve(faults, {run.run_id: run for run in runs}, chosen[0])
    earlier = find_earlier(places.raw, places.sheet)

    what = f"seed {seed}, media: {', '.join(chosen)}, faults: {', '.join(faults) or 'none'}"
    if spread:
        what += f", run-to-run spread: {spread:g} N/cm^3"
    logs = [places.raw / name for run in runs for name in (run.force_log, run.motion_log)]
    if places.config.robot is not None and places.config.robot.medium in chosen:
        logs += track_files(places.config, places.raw, seed)
    cleared = clear(earlier)
    if cleared:
        say(f"{count(cleared, 'file')} of the earlier re-enactment cleared.")
    say(f"Writing the logs of {count(len(runs), 'run')} into {_from_root(places, places.raw)} ...")
    write_marker(places.raw, [*logs, places.sheet], what, complete=False)
    done = enact(
        places.config, places.raw, places.sheet,
        seed=seed, media=media, faults=faults, workers=workers, spread=spread,
    )  # fmt: skip
    write_marker(places.raw, [*logs, places.sheet], what, complete=True)
    say(
        f"{count(done.n_runs, 'run')}, {count(done.n_files, 'file')}, {megabytes(done.bytes)}, "
        f"{done.seconds:.1f} s, seed {seed}; run sheet: {_from_root(places, places.sheet)}"
    )
    for fault in done.faults:
        say(f"  fault {fault}")
    say(PLAINLY)
    say(f"{_from_root(places, places.raw / MARKER)} says the same.")


def _from_root(places: Layout, path: Path) -> str:
    return path.relative_to(places.root).as_posix()


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
