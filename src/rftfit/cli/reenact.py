"""``rftfit reenact``: options of the demonstration campaign, whose logs the simulated lab makes (`rftfit.lab`).

A *layout* is a campaign whose config was read, and whose run sheet and logs may not be there yet.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.output import print_line
from rftfit.errors import InputError
from rftfit.store.text import count, megabytes, table

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign


NOT_RECORDED = (
    "These logs are simulated from published results: they are not original recordings, and what\n"
    "is computed from them shows how well the program works, not how sand behaves."
)
"""Last words of the command."""


def reenact(
    config: options.ConfigFile = options.CONFIG,
    seed: Annotated[int, typer.Option(min=0, help="Same seed, same bytes.")] = 2013,
    media: Annotated[
        list[str] | None, typer.Option(help="Only this medium of the config; may be repeated.")
    ] = None,
    fault: Annotated[
        list[str] | None,
        options.word_option(
            "NAME or NAME:RUN_ID",
            "Break the campaign on purpose, for tests and teaching; may be repeated.",
        ),
    ] = None,
    if_missing: Annotated[
        bool, typer.Option("--if-missing", help="Do nothing where the run sheet is there already.")
    ] = False,
    list_faults: Annotated[
        bool, typer.Option("--list-faults", help="List the faults there are and stop.")
    ] = False,
    grid: Annotated[
        str,
        options.word_option(
            "ANGLES",
            "Directions of the plates in laboratory media: '-30,0,30 x -45,0,45,90', pairs "
            "'0:90,30:45', or 'scattered:40'; default: the config's grid, or the paper's. Between "
            "the paper's angles its table is interpolated.",
        ),
    ] = "",
    protocol: Annotated[
        str,
        options.word_option(
            "NAME",
            "How a run is recorded: paper, no-pause, stroke-only, separate-zero, one-file, cyclic, "
            "constant-speed.",
        ),
    ] = "paper",
    no_tare: Annotated[
        bool, typer.Option("--no-tare", help="Without runs of rod and mount alone or legs in air.")
    ] = False,
    no_legs: Annotated[bool, typer.Option("--no-legs", help="Without legs.")] = False,
    live: Annotated[
        Path | None,
        options.word_option(
            "DIR",
            "Write run by run, as a rig does, into this folder, which gets a copy of the config: for rftfit watch.",
        ),
    ] = None,
    pace: Annotated[
        float, typer.Option(min=0, metavar="SECONDS", help="From run to run with --live.")
    ] = 5.0,
    bad: Annotated[
        float,
        typer.Option(min=0, max=1, metavar="SHARE", help="Share of bad plate runs with --live."),
    ] = 0.1,
) -> None:
    """Write the logs that the paper's lab would have recorded, and their run sheet.

    They go into the raw folder and the run sheet that the config names; an empty folder gets the config of
    the demonstration first. A folder that holds logs of another origin is refused; those of an earlier
    re-enactment are cleared first.
    """
    if list_faults:
        from rftfit.lab.rig import FAULTS

        rows = [[name, *fault] for name, fault in FAULTS.items()]
        print_line(table(["fault", "run of the first medium", "what it does"], rows, indent=""))
        return
    from rftfit.campaign.load import read_layout
    from rftfit.campaign.new_campaign import init_demonstration
    from rftfit.lab.enact import copy_config, prepare
    from rftfit.lab.marker import MARKER, clear, find_earlier
    from rftfit.lab.plan import media_of, parse_directions
    from rftfit.lab.protocols import PROTOCOLS
    from rftfit.lab.tracks import lacks_tracks
    from rftfit.store.links import refuse_links

    if config == options.CONFIG and _is_empty(Path()):
        init_demonstration(Path())
        print_line(f"This folder was empty: {config} of the demonstration is written.")
    options.need_campaign(config)
    # a folder that fills while `rftfit watch` looks: a campaign of its own
    if live is not None:
        config = copy_config(config, live)
    layout = read_layout(config)
    # the sheet is written last and cleared first: where it is there, the logs are there, too
    if if_missing and layout.sheet.is_file() and not lacks_tracks(layout):
        print_line(
            f"The run sheet {_from_root(layout, layout.sheet)} is there already: nothing to do."
        )
        return
    if layout.sheet.suffix.lower() != ".csv":
        raise InputError(
            f"config, key run_sheet: found '{layout.config.run_sheet}'; allowed here: a .csv file, "
            "which is what rftfit reenact writes"
        )
    refuse_links(layout.root, [layout.config.raw, layout.config.run_sheet])
    # everything is checked before earlier logs are cleared: a misspelled word must not cost them
    if not media_of(layout.config.media, media or None):
        raise InputError(
            "config, key media: no medium here names published measurements to simulate "
            "(published_as), so nothing was written; the demonstration campaign's config does"
        )
    planned = layout.config.grid.planned
    directions = parse_directions(grid, seed) if grid else None
    if planned and set(directions or ()) - set(planned):
        raise InputError(
            "--grid: the config plans its own directions under `grid`; take that section out, or "
            "leave --grid away to measure the planned ones"
        )
    choose("--protocol", protocol, tuple(PROTOCOLS))
    campaign = prepare(
        layout.config,
        seed=seed,
        media=media or None,
        directions=directions,
        faults=fault or [],
        protocol=protocol,
        tare=not no_tare,
        legs=not no_legs,
    )
    earlier = find_earlier(layout.raw, layout.sheet)
    clear(earlier)
    if earlier:
        print_line(f"{count(len(earlier), 'file')} of the earlier simulation cleared.")
    if live is not None:
        for line in campaign.live(layout.raw, layout.sheet, pace, bad):
            print_line(line)
        return
    runs = count(sum(run.cycles for run in campaign.runs), "run")
    if trials := campaign.trials:
        runs += f" and {count(trials, 'trial')} of the robot"
    print_line(f"Writing the logs of {runs} into {_from_root(layout, layout.raw)} ...")
    began = time.perf_counter()
    sizes = campaign.write(layout.raw, layout.sheet)
    print_line(
        f"{runs}, {count(len(sizes), 'file')}, {megabytes(sum(sizes))}, "
        f"{time.perf_counter() - began:.1f} s, seed {seed}; run sheet: {_from_root(layout, layout.sheet)}"
    )
    for planted_fault in campaign.faults:
        print_line(f"  fault {planted_fault}")
    print_line(NOT_RECORDED)
    print_line(f"{_from_root(layout, layout.raw / MARKER)} says the same.")


def _is_empty(folder: Path) -> bool:
    """Return True for a folder with nothing in it but hidden files."""
    return all(path.name.startswith(".") for path in folder.iterdir())


def _from_root(layout: Campaign, path: Path) -> str:
    """Return a path relative to the campaign's folder, for messages."""
    return path.relative_to(layout.root).as_posix()
