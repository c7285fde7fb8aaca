"""``rftfit export``: the stress profile of a medium (or Bekker's law) as one file to hand on.

A profile file is made from a *source*, a table of alpha or a map (alpha estimated in all directions), and *facts*: keyword
arguments of `rftfit.write_profile`, as ``name``, ``marks`` (doubts about the medium) or ``made_from`` (digests of files).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import rftfit
from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.output import check_target, json_text, print_line, warn
from rftfit.errors import InputError
from rftfit.store.digests import sha256_of

if TYPE_CHECKING:
    from rftfit.model.profiles import KnownMedium

KINDS = ("table", "map")
"""Values of --profile: those with a number in each direction, which a file can hold."""


def export(
    medium: options.MediumName = None,
    results: options.ResultsFolder = None,
    alpha: Annotated[
        float | None,
        options.number_option(
            "N/cm^3", "Estimate the map from one push straight down, alpha_z(0, 90 deg)."
        ),
    ] = None,
    se: options.ErrorOfTest = None,
    pushes: options.PushesFile = None,
    profile_file: Annotated[
        Path | None,
        options.file_option(
            "A profile that was handed on, written again with another title or notes."
        ),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            help="table (alpha as measured) or map (estimated in all directions). Default: of --alpha and "
            "--pushes the map; of a medium the table, where every direction was pushed, else the map."
        ),
    ] = None,
    title: Annotated[str, options.word_option("TEXT", "Title of the medium.")] = "",
    notes: Annotated[str, options.word_option("TEXT", "What a user of the file has to know.")] = "",
    bekker: Annotated[
        bool,
        typer.Option(
            "--bekker",
            help="Instead of the profile: Bekker's k and n of the pushes straight down, in SI units, for programs that "
            "calculate wheels and tracks by them (SCM). Needs --results.",
        ),
    ] = False,
    output: Annotated[
        Path | None, options.file_option("The file. Default: profile.json, or bekker.json.")
    ] = None,
    force: options.Overwrite = False,
) -> None:
    """Write the stress profile of a medium as one file to hand on.

    It holds alpha over all directions with its errors, the pushes behind it, the conventions with a golden
    value to test one's signs against, and where it came from. `rftfit predict` and `rftfit simulate`
    read it (`--profile-file`); the documentation has readers in numpy and MATLAB.
    """
    medium_options = options.MediumOptions(
        medium=medium,
        profile=profile,
        results=results,
        alpha=alpha,
        pushes=pushes,
        profile_file=profile_file,
    )
    medium_options.check(se)
    from rftfit.model.profile_file import MARK, describe_profile

    if profile is not None:
        allowed = KINDS if medium is not None else ("map",)
        choose("--profile", profile, allowed, "a profile with a number in each direction")
    if bekker:
        if results is None or medium is None:
            raise InputError("--bekker needs the pushes of a campaign: --medium NAME --results DIR")
        _export_bekker(results, medium, output or Path("bekker.json"), force)
        return
    output = output or Path("profile.json")
    check_target(output, MARK, "profile", force, (pushes, profile_file))
    source: KnownMedium
    facts: dict[str, Any]
    if profile_file is not None:
        source, facts = rftfit.read_profile(profile_file).export_source()
    elif medium is None:
        options.check_penetration_test(alpha, se or 0.0)
        source = medium_options.make_map(se)
        facts = {"made_from": {} if pushes is None else {pushes.name: sha256_of(pushes)}}
    elif results is not None:
        source, facts = _source_in_campaign(results, medium, profile)
    else:
        source, facts = _published_source(medium, profile)
    facts |= {name: sentence for name, sentence in (("title", title), ("notes", notes)) if sentence}
    rftfit.write_profile(output, source, **facts)
    print_line(describe_profile(output))
    if marks := facts.get("marks"):
        warn(f"warning: {facts['name'] or 'the medium'} is {marks}")


_BEKKER_MARK = '{\n "format": "rftfit-bekker 1"'
"""Beginning of a file of Bekker's law: only files with it are overwritten unasked."""


def _export_bekker(folder: Path, name: str, output: Path, force: bool) -> None:
    """Write Bekker's law of a medium of a campaign, and print it.

    The law is pressure = k sinkage^n, fitted to pushes straight down; programs for wheels and tracks ask for k and n.
    `folder`: Results of the campaign. `name`: The medium. `force`: True overwrites a file of any origin.
    """
    from rftfit.store import write_text

    check_target(output, _BEKKER_MARK, "law", force)
    campaign = rftfit.open(folder)
    choose("--medium", name, campaign.media, f"in {folder}")
    law = campaign[name].pressure_sinkage()
    content = {"format": "rftfit-bekker 1", "medium": name, **law.as_dict()}
    write_text(output, json_text(content, indent=1) + "\n")
    print_line(f"{law.summary()}\nWritten: {output}")
    if law.doubt:
        warn(f"warning: {law.doubt}")
    if campaign[name].doubt:
        warn(f"warning: {name} is {campaign[name].doubt}")


def _source_in_campaign(
    folder: Path, name: str, kind: str | None
) -> tuple[KnownMedium, dict[str, Any]]:
    """Find a medium of a campaign; return source and facts of its profile file.

    `folder`: Results of the campaign. `name`: The medium. `kind`: ``table`` or ``map``; None: the table if every direction was
    pushed, else the map.
    """
    from rftfit.workflow.provenance import RECORD, SUMS

    campaign = rftfit.open(folder)
    medium = campaign[choose("--medium", name, campaign.media, f"in {folder}")]
    source, facts = medium.export_source(kind)
    # digests of the logs and of the record of the run, so that the numbers can be followed back
    facts["made_from"] |= {
        path: sha256_of(campaign.root / path)
        for path in (SUMS, RECORD)
        if (campaign.root / path).is_file()
    }
    return source, facts


def _published_source(name: str, kind: str | None) -> tuple[KnownMedium, dict[str, Any]]:
    """Find a published medium; return source and facts of its profile file; `kind`: ``map``, or else the table."""
    from rftfit.model.maps import published_map
    from rftfit.model.profiles import PAPER_WINDOW
    from rftfit.reference import MEDIA

    choose("--medium", name, MEDIA, "published media; --results DIR for those of a campaign")
    source = published_map(name) if kind == "map" else rftfit.published_medium(name)
    return source, {"name": name, "window": PAPER_WINDOW}
