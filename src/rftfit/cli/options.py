"""Options that several commands share, each spelled once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer


def number_of(text: str) -> float:
    """Read a number of the command line; a decimal comma is named as what it is."""
    try:
        return float(text)
    except ValueError:
        comma = text.replace(",", ".", 1)
        hint = f"; write a decimal point: {comma}" if text.count(",") == 1 else ""
        raise typer.BadParameter(f"found '{text}'; allowed: a number{hint}") from None


def number(unit: str, meaning: str) -> Any:
    """Describe an option whose value is a number."""
    return typer.Option(parser=number_of, metavar=unit, help=meaning)


def file(meaning: str) -> Any:
    """Describe an option whose value is the path of a file."""
    return typer.Option(metavar="FILE", help=meaning)


CONFIG = Path("config/config.yaml")
ConfigFile = Annotated[Path, typer.Option(help="The campaign's configuration.")]

Cluster = Annotated[
    str | None,
    typer.Option(
        help="Hand the jobs over to a cluster: slurm, or a folder with a Snakemake profile."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of a text for people.")]
Overwrite = Annotated[
    bool, typer.Option("--force", help="Overwrite a file that rftfit did not write.")
]
Level = Annotated[float, number("LEVEL", "Level of the intervals.")]

LegName = Annotated[str | None, typer.Option(help="Model leg: c_leg, flat_leg or reversed_c_leg.")]

# what is known of a medium

MediumName = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Published medium, or with --results one of a campaign."),
]
ResultsFolder = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Take the tables of a campaign's results.")
]
ProfileKind = Annotated[
    str | None,
    typer.Option(
        help="table (default: alpha as measured), map (estimated in all directions), fourier, generic "
        "or depth_only; with --alpha always generic."
    ),
]
MethodName = Annotated[
    str | None,
    typer.Option(help="Nine-term fit that chi and M0 belong to: lsq (default) or dft-index."),
]
AlphaOfTest = Annotated[
    float | None,
    number("N/cm^3", "A medium known by one vertical penetration test: as for rftfit scale."),
]
ErrorOfTest = Annotated[float | None, number("N/cm^3", "Standard error of alpha; default 0.")]
ProfileFile = Annotated[
    Path | None, file("A medium that was handed on: as rftfit export writes it.")
]
