"""``rftfit scale``: options by which alpha of a medium follows from one test, some pushes or contacts; its table.

Two ways lead to alpha in all directions: a *map*, estimated by the shape that known media share, and the paper's routine
(--profile generic), zeta times the nine terms M0 of the generic profile. Contacts are measured forces on a leg.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rftfit.campaign.problems import choose
from rftfit.cli import options
from rftfit.cli.late import load_late
from rftfit.cli.output import check_target, print_answer, print_line, warn, write_csv
from rftfit.errors import InputError

MARK = "# alpha table written by rftfit scale"
"""Beginning of the first line of an alpha table of this command: only tables with it are overwritten unasked."""


@options.grouped
def scale(
    *,
    alpha: Annotated[
        float | None,
        options.number_option(
            "N/cm^3",
            "Slope of stress over depth of a horizontal plate pushed straight down: "
            "alpha_z(0, 90 deg), in N/cm^3.",
        ),
    ] = None,
    se: options.ErrorOfTest = None,
    push_options: options.PushOptions,
    body: options.BodyOptions,
    contact_options: options.ContactOptions,
    profile: Annotated[
        str | None,
        typer.Option(
            help="map (default: alpha in all directions, by the shape of known media) or generic (zeta times nine terms, "
            "the paper's scaling routine; needs a push straight down)."
        ),
    ] = None,
    confidence: options.Level = 0.95,
    results: Annotated[
        Path | None,
        options.word_option(
            "DIR",
            "Take known media, chi and generic coefficients from a campaign's results, not from the "
            "published tables.",
        ),
    ] = None,
    method: options.MethodName = None,
    output: Annotated[Path, options.file_option("File of the alpha table.")] = Path("alpha.csv"),
    as_json: options.AsJson = False,
    force: options.Overwrite = False,
) -> None:
    """Turn one vertical penetration test, a few pushes, or forces on a leg into a whole stress profile, with intervals.

    By the shape that known media share: prints the map, and how far the pushes agree with that shape. With --profile
    generic by the paper's scaling routine: prints zeta, chi and the nine coefficients M = zeta M0. Both write
    alpha(beta, gamma) as csv.
    """
    # scipy.special copies every name of numpy, and would so load these parts of it
    for library in ("pandas", "numpy.f2py", "numpy.ma", "numpy.polynomial", "numpy.testing"):
        load_late(library)
    from rftfit.forces.medium_answer import answer_of_contacts, answer_of_pushes, answer_of_test

    contacts_file = contact_options.contacts
    no_push = alpha is None and not push_options
    if (alpha is not None and push_options) or (no_push and contacts_file is None):
        raise InputError(
            f"found {'neither' if no_push else 'both'} of --alpha and --pushes; allowed: --alpha N/cm^3 (one vertical push) or "
            "--pushes FILE (a table of pushes; or --profile-file, or both); or --contacts FILE (forces on a leg), "
            "alone or beside them"
        )
    read_files = (*push_options.files, contacts_file, body.outline, contact_options.mesh)
    check_target(output, MARK, "alpha table", force, read_files)
    if push_options and se is not None:
        raise InputError("--se is the standard error of --alpha; a table has columns se_z, se_x")
    options.check_penetration_test(alpha, se or 0.0)
    options.check_confidence(confidence)
    if profile is not None:
        choose("--profile", profile, options.PROFILES_OF_PUSHES, "pushes give no other profile")
    if profile == "generic" and contacts_file is not None:
        raise InputError("--profile generic takes one push straight down; --contacts needs the map")
    reference = options.reference_in(results, method)
    contacts = contact_options.read(body)
    pushes = None
    if no_push:
        name = str(contacts_file)
    else:
        name, pushes = options.read_given_pushes(alpha, se, push_options)
    # generic excludes contacts, so there are pushes
    if profile == "generic" and pushes is not None:
        scaled = options.scale_from_pushes(name, pushes, reference, confidence)
        answer = answer_of_test(scaled)
    else:
        shapes = options.shapes_in(results)
        estimated = options.estimate_map_of(name, pushes, shapes, confidence, contacts)
        answer = answer_of_pushes(name, estimated, pushes, reference)
        if contacts:
            # what the contacts alone tell stands beside what all tell
            by_contacts = estimated
            if pushes is not None:
                by_contacts = options.estimate_map_of(
                    str(contacts_file), None, shapes, confidence, contacts
                )
            answer = answer_of_contacts(answer, by_contacts, contacts, pushes)
    print_answer(answer, as_json, alpha_table=str(output))
    if answer.doubt:
        warn(f"warning: {answer.doubt}")
    # after the numbers are out: a folder that cannot be written must not hide them
    notes = [answer.description, f"_lo and _hi: {answer.level}"]
    write_csv(output, answer.columns_for_file(), MARK, notes, digits=6)
    if not as_json:
        print_line(f"Alpha {answer.where}: {output}")
