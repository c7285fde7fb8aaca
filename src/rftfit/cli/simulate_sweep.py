"""``rftfit sweep``: the paper's whole sweep of the robot, with a progress bar, resumable."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rftfit.cli.output import say
from rftfit.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

TARGET = "robot_full"
NEEDED = ("results/robot/measured.csv", "results/coefficients.csv")


def sweep(
    config: Annotated[Path, typer.Option(help="The campaign's configuration.")] = Path(
        "config/config.yaml"
    ),
    profile: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this profile; may be repeated; default: table, generic, depth_only."
        ),
    ] = None,
    cores: Annotated[
        int | None, typer.Option(min=1, help="Runs at once; default: all cores.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            help="Deal the runs out as batches to a cluster: slurm, or a folder with a Snakemake "
            "profile; --cores is then what one batch gets."
        ),
    ] = None,
) -> None:
    """Run the robot over the paper's 51 curvatures, 26 frequencies and 3 starting phases.

    First makes the tables that it needs, as `rftfit run` does; at the end the tables and figures of
    the whole sweep, in results/robot_full. What is finished is kept when it is stopped: start it
    again to go on.
    """
    from rftfit.campaign.load import load_campaign
    from rftfit.cli.predict_sources import choose
    from rftfit.cli.run import run
    from rftfit.stages.robot import robot_of
    from rftfit.stages.robot_profiles import PROFILES
    from rftfit.stages.robot_sweep import swept

    names = list(dict.fromkeys(profile or PROFILES))
    for name in names:
        choose("--profile", name, PROFILES)
    campaign = load_campaign(config)
    section, _ = robot_of(campaign)
    if section.medium not in campaign.media_with_runs:
        raise InputError(
            f"config, key robot.medium: {section.medium} has no runs, so there is nothing for the "
            "robot to run on"
        )
    if cluster is not None:
        if set(names) != set(PROFILES):
            raise InputError("--cluster and --profile: a cluster runs all profiles at once")
        run([TARGET], config=config, cores=cores, cluster=cluster)
        return
    alpha = f"results/alpha/{section.medium}.csv"
    run([*NEEDED, alpha], config=config, cores=cores)
    measured, coefficients = (campaign.root / path for path in NEEDED)
    try:
        for name in names:
            with _bar(name) as show:
                swept(
                    config, name, TARGET, campaign.root / alpha, coefficients, measured, show, cores
                )
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            "Stopped. Runs that were finished are kept; `rftfit sweep` goes on from there."
        ) from None
    if set(names) == set(PROFILES):
        run([TARGET], config=config, cores=cores)
    else:
        say(f"`rftfit run {TARGET}` makes tables and figures once every profile is done.")


@contextlib.contextmanager
def _bar(name: str) -> Iterator[Callable[[int, int], None]]:
    """Show how far a profile is, on standard error."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeElapsedColumn as Elapsed
    from rich.progress import TimeRemainingColumn as Remaining

    columns = (
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(),
        Elapsed(), Remaining(),
    )  # fmt: skip
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task(name, total=None)

        def show(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        yield show
