"""Options of several commands: declared once, checked together, read into media, bodies, motions, pushes.

Typer makes an option from each parameter of a command: its annotation holds the help, its name the option's. A dataclass
here is a group of options; a command takes one as a parameter and has the decorator `grouped`. A value of None means that
the option was not given. Helpers raise InputError with the name of the option, since nothing later knows it.

Words: a *penetration test* is one push of a level plate straight down, (beta, gamma) = (0, 90) deg, whose alpha_z (N/cm^3) is
the value of --alpha. A *profile* is a function alpha(beta, gamma) of a medium, a *map* one that is estimated in all
directions from few pushes. *Contacts* are measured forces on a leg or body, from which a map can be estimated, too.
"""

from __future__ import annotations

import inspect
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

import rftfit
from rftfit.campaign import presence
from rftfit.campaign.presence import miss_campaign
from rftfit.campaign.problems import CampaignError, choose
from rftfit.cli.output import warn
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.forces.body_error import BodyError
    from rftfit.forces.contacts import Contact
    from rftfit.forces.mesh import Mesh, Motion3D
    from rftfit.forces.motion import Motion
    from rftfit.forces.outlines import Outline
    from rftfit.measure.alpha import Columns
    from rftfit.model.maps import Map
    from rftfit.model.profiles import Profile
    from rftfit.model.scaling import Reference, ScaledMedium
    from rftfit.model.shapes import Shapes


def parse_option_number(text: str) -> float:
    """Read the value of an option as a number, for typer; the message on a decimal comma proposes a point."""
    try:
        return float(text)
    except ValueError:
        comma = text.replace(",", ".", 1)
        hint = f"; write a decimal point: {comma}" if text.count(",") == 1 else ""
        raise typer.BadParameter(f"found '{text}'; allowed: a number{hint}") from None


def parse_numbers(option: str, text: str) -> list[float]:
    """Read numbers with commas between them, the value of the option that `option` names, as ``--slip``."""
    try:
        return [float(number) for number in text.split(",")]
    except ValueError:
        raise InputError(
            f"{option}: found '{text}'; allowed: a number, or several with commas between them, as 0.1,0.3"
        ) from None


def number_option(unit: str, meaning: str) -> Any:
    """Describe an option whose value is a number; `unit`: what stands for it in the help. `meaning`: The help."""
    return typer.Option(parser=parse_option_number, metavar=unit, help=meaning)


def word_option(metavar: str, meaning: str) -> Any:
    """Describe an option whose value is a word; `metavar`: what stands for it in the help. `meaning`: The help."""
    return typer.Option(metavar=metavar, help=meaning)


def file_option(meaning: str) -> Any:
    """Describe an option whose value is the path of a file; `meaning`: the help."""
    return word_option("FILE", meaning)


CONFIG = Path(presence.CONFIG)
"""Default of --config."""


def need_campaign(config: Path) -> Path:
    """Return the path of a configuration; refuse one that does not exist, before the slow import of what reads it."""
    if (no_campaign := miss_campaign(config)) is not None:
        raise CampaignError([no_campaign])
    return config


_CONFIG_HELP = "The campaign's configuration."
ConfigFile = Annotated[Path, typer.Option(help=_CONFIG_HELP)]
CampaignConfig = Annotated[Path, typer.Option(help=_CONFIG_HELP, callback=need_campaign)]
"""Configuration of a campaign that must be there."""

Cores = Annotated[int | None, typer.Option(min=1, help="Jobs at once; default: all cores.")]
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
Level = Annotated[float, number_option("LEVEL", "Level of the intervals.")]

MeshUnit = Annotated[str | None, word_option("UNIT", "Of the mesh: mm, cm, m or in.")]
RimRadius = Annotated[
    float | None,
    number_option(
        "cm",
        "Radius of a wheel's rim, to which sinkage and slip belong; default: to its farthest point, over the lugs.",
    ),
]
NoTrack = Annotated[
    bool,
    typer.Option(
        "--no-track",
        help="Count what lies behind a lugged wheel's axle and faces back, as if the wheel left no track.",
    ),
]
FrictionOfMesh = Annotated[
    float | None,
    number_option(
        "MU",
        "Stress along a face of a mesh is at most so many times that across it, and no face is pulled or driven; "
        "default: off, the surface of the measured plates. 0.4 is usual of wheels.",
    ),
]

ModelError = Annotated[
    float | None,
    number_option(
        "EPS",
        "Relative error of the model itself; default: that on measured legs, or on a campaign's legs where it is larger; "
        "more of a solid mesh; 0: none.",
    ),
]

MediumName = Annotated[
    str | None, word_option("NAME", "Published medium, or with --results one of a campaign.")
]
ResultsFolder = Annotated[
    Path | None, word_option("DIR", "Take the tables of a campaign's results.")
]
ErrorOfTest = Annotated[
    float | None,
    number_option(
        "N/cm^3",
        "Standard error of --alpha; default: the usual scatter of beds, of --profile generic 0.",
    ),
]
PushesFile = Annotated[
    Path | None,
    file_option(
        "Any number of pushes: a table with beta_deg, gamma_deg, alpha_z_N_per_cm3, alpha_x_N_per_cm3 or both "
        "and, where known, se_z, se_x, depth_from_cm, depth_to_cm."
    ),
]
MethodName = Annotated[
    str | None,
    typer.Option(help="Nine-term fit that chi and M0 belong to: lsq (default) or dft-index."),
]


# --- Groups of options, and checks of single ones


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Decorate a command so that each field of its dataclass parameters is an option of its own.

    Typer cannot group options. It sees a function whose parameters are these fields and all other parameters; this
    function makes the dataclasses from the values and calls the command.
    """
    hints = get_type_hints(command, include_extras=True)
    # dataclass by the name of its parameter
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += inspect.signature(groups[name], eval_str=True).parameters.values()
        else:
            parameters.append(parameter.replace(annotation=hints[name]))
    parameters = [parameter.replace(kind=parameter.KEYWORD_ONLY) for parameter in parameters]

    @wraps(command)
    def run(**values: Any) -> None:
        """Make the dataclasses from the values of their options, and call the command."""
        for name, group in groups.items():
            values[name] = group(
                **{option.name: values.pop(option.name) for option in fields(group)}
            )
        command(**values)

    # typer reads the options from these two attributes of a function
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def list_given(options: object, *names: str) -> list[str]:
    """List the options that were given, as the command line names them, for messages as "found --leg and --mesh".

    An option was given where its value is neither None nor False. `options`: Dataclass with a field for each option.
    `names`: The fields to look at.
    """
    values = {name: getattr(options, name) for name in names}
    return [
        f"--{name.replace('_', '-')}"
        for name, value in values.items()
        if value is not None and value is not False
    ]


def check_confidence(confidence: float) -> None:
    """Refuse a level of intervals (--confidence) that is impossible."""
    if not 0.5 < confidence < 1:
        raise InputError(
            f"--confidence: found {confidence:g}; allowed: above 0.5 and below 1, such as 0.95"
        )


def read_mesh(file: Path, unit: str, sheet: bool = False) -> Mesh:
    """Read a mesh from a file, and print to standard error what was mended in it.

    `unit`: Of its coordinates: mm, cm, m or in. `sheet`: True for a thin sheet, which need not be closed.
    """
    # the same notes would come as warnings of Python
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh = rftfit.Mesh.read(file, unit, sheet)
    for note in mesh.notes:
        warn(f"warning: {file}: {note}")
    return mesh


_MOST_FRICTION = 2.0
"""Greatest friction that is taken: stress along a face over that across it."""


def check_friction(friction: float | None) -> None:
    """Refuse a friction that is impossible; None: not given."""
    if friction is not None and not 0 <= friction <= _MOST_FRICTION:
        raise InputError(f"--friction: found {friction:g}; allowed: 0 to {_MOST_FRICTION:g}")


def check_model_error(model_error: float | None) -> None:
    """Refuse an error of the model that is impossible; None: not given."""
    if model_error is not None and not 0 <= model_error < math.inf:
        raise InputError(f"--model-error: found {model_error:g}; allowed: 0 or a positive number")


_PLAUSIBLE_N_PER_CM3 = (0.05, 5.0)
"""Range of alpha_z(0, 90 deg) of dry granular media."""


def check_penetration_test(alpha: float | None, se: float) -> None:
    """Refuse a penetration test that is impossible; warn of one that seems to be in another unit.

    `alpha`: Value of --alpha, N/cm^3; None: not given. `se`: Its standard error; 0: not given.
    """
    if alpha is not None and not (math.isfinite(alpha) and alpha > 0):
        raise InputError(f"--alpha: found {alpha:g}; allowed: a positive number, in N/cm^3")
    if not (math.isfinite(se) and se >= 0):
        raise InputError(f"--se: found {se:g}; allowed: 0 or a positive number, in N/cm^3")
    lowest, highest = _PLAUSIBLE_N_PER_CM3
    if alpha is not None and not lowest <= alpha <= highest:
        warn(
            f"warning: {alpha:g} N/cm^3 is outside {lowest:g} to {highest:g} N/cm^3, where dry "
            "granular media lie; is it in another unit? 1 N/cm^3 = 1000 kN/m^3 = 1e6 N/m^3"
        )


def reference_in(folder: Path | None, method: str | None) -> Reference:
    """Return the media by which the paper's routine scales a medium: the published five, or those of a campaign.

    `folder`: Value of --results; None: the published five. `method`: Nine-term fit that their chi and M0 belong to; None:
    the first of `METHODS`, or the one of the campaign's config.
    """
    if folder is None:
        from rftfit.model.fourier import METHODS
        from rftfit.model.scaling import published

        return published(choose("--method", method or METHODS[0], METHODS))
    reference = rftfit.open(folder).reference(method)
    if reference.printed:
        raise InputError(
            f"{folder}: the scatter of chi needs at least two laboratory media with a usable grid; "
            "without --results the published five are used"
        )
    name = reference.name.replace("this campaign", folder.as_posix())
    return replace(reference, name=name)


# --- A medium


PROFILES_OF_PUSHES = ("map", "generic")
"""Profiles that can be estimated from pushes alone."""


@dataclass(frozen=True)
class MediumOptions:
    """Options that state a medium: published, of a campaign, one penetration test, some pushes, or a file.

    A command calls `check` before it imports anything slow, then `find_profile`.
    """

    medium: MediumName = None
    profile: Annotated[
        str | None,
        typer.Option(
            help="table (alpha as measured), map (estimated in all directions), fourier, generic (zeta times nine terms) "
            "or depth_only. Default: of --alpha and --pushes the map; of a medium the table, where every "
            "direction of the body was pushed, else the map."
        ),
    ] = None
    results: Annotated[
        Path | None,
        word_option(
            "DIR",
            "Take the tables of a campaign's results; with --alpha or --pushes its media as the known ones.",
        ),
    ] = None
    method: MethodName = None
    alpha: Annotated[
        float | None,
        number_option(
            "N/cm^3",
            "A medium known by one push: alpha_z(0, 90 deg), the slope of stress over depth of a horizontal plate "
            "pushed straight down.",
        ),
    ] = None
    pushes: PushesFile = None
    profile_file: Annotated[
        Path | None, file_option("A medium that was handed on: as rftfit export writes it.")
    ] = None

    @property
    def is_of_pushes(self) -> bool:
        """True where the medium is known by pushes alone: one, or a table of some."""
        return self.alpha is not None or self.pushes is not None

    def check(self, se: float | None = None) -> None:
        """Refuse options that do not go together; `se`: value of --se, standard error of --alpha; None: not given."""
        sources_given = list_given(self, "medium", "alpha", "pushes", "profile_file")
        if len(sources_given) != 1:
            raise InputError(
                f"found {' and '.join(sources_given) or 'no medium'}; allowed: one of --medium NAME (published, or "
                "with --results DIR of a campaign), --alpha N/cm^3 (one penetration test), --pushes FILE (a table of "
                "pushes) and --profile-file FILE (written by rftfit export)"
            )
        choices_given = list_given(self, "profile", "results", "method")
        if self.profile_file is not None and choices_given:
            raise InputError(
                f"found {choices_given[0]} with --profile-file; allowed: that file alone"
            )
        if self.profile is not None:
            from rftfit.model.profiles import KINDS

            allowed = PROFILES_OF_PUSHES if self.is_of_pushes else KINDS
            hint = "pushes give no other profile" if self.is_of_pushes else ""
            choose("--profile", self.profile, allowed, hint)
        if se is not None and self.alpha is None:
            raise InputError("--se is the standard error of --alpha, so it needs --alpha")
        if self.method is not None and self.results is None and not self.is_of_pushes:
            raise InputError(
                "--method chooses among fits, so it needs --results DIR or --alpha; the published media "
                "have those of Table S2"
            )
        if self.method is not None and self.profile not in ("fourier", "generic"):
            raise InputError(
                "--method chooses among nine-term fits, so it needs --profile fourier or generic"
            )

    @property
    def kind(self) -> str:
        """Kind of profile: value of --profile, or its default.

        Empty without either: then the table of the medium is taken where it is enough for the body, else the map.
        """
        return self.profile or ("map" if self.is_of_pushes else "")

    def find_profile(
        self, se: float | None = None, has_all_directions: Callable[[Profile], bool] | None = None
    ) -> Profile:
        """Find the profile of the medium; call `check` before. Doubts about the medium are printed to standard error.

        `se`: Value of --se, standard error of --alpha, N/cm^3; None: not given. `has_all_directions`: Function that returns
        True for a table with a number in every direction of the body, so that no map is needed; default: a table with any
        hole is not enough.
        """
        from rftfit.reference import MEDIA

        check_penetration_test(self.alpha, se or 0.0)
        if self.profile_file is not None:
            table = rftfit.read_profile(self.profile_file)
            if table.doubt:
                warn(f"warning: {self.profile_file.name} is of data that are {table.doubt}")
            return table
        if self.is_of_pushes:
            return self._profile_of_pushes(se)
        assert self.medium is not None
        if self.results is None:
            # a published medium
            hint = "published media; --results DIR for those of a campaign, --alpha for one penetration test"
            name = choose("--medium", self.medium, MEDIA, hint)
            if self.kind == "map":
                from rftfit.model.maps import published_map

                return published_map(name).profile
            return rftfit.published_medium(name, self.kind or "table")
        # a medium of a campaign
        campaign = rftfit.open(self.results)
        choose("--medium", self.medium, campaign.media, f"in {self.results}")
        medium = campaign[self.medium]
        if medium.doubt:
            warn(f"warning: {self.medium} is {medium.doubt}")
        if self.kind:
            return medium.profile(self.kind, self.method)
        return medium.as_profile(has_all_directions)

    def make_map(self, se: float | None = None) -> Map:
        """Estimate the map from --alpha or --pushes, by the shape of known media; `se`: as in `find_profile`."""
        name, pushes = read_given_pushes(self.alpha, se, PushOptions(self.pushes))
        return estimate_map_of(name, pushes, shapes_in(self.results))

    def _profile_of_pushes(self, se: float | None) -> Profile:
        """Estimate the map or the generic profile from --alpha or --pushes; `se`: as in `find_profile`."""
        if self.kind == "map":
            return self.make_map(se).profile
        name, pushes = read_given_pushes(self.alpha, se, PushOptions(self.pushes))
        reference = reference_in(self.results, self.method)
        profile = scale_from_pushes(name, pushes, reference, 0.95).profile
        # forces by the map are shown beside those by nine terms; it is estimated only if they are wanted
        profile.beside = lambda: self.make_map(se).profile
        return profile


BodyOf = Annotated[
    str | None,
    word_option(
        "DIR",
        "What the model gets wrong on this leg, learned from a campaign's results, where --leg names a leg of its "
        "configuration; or 'published': from the five media in which the model legs were measured.",
    ),
]


@dataclass(frozen=True)
class MeasuredLeg:
    """The leg of --leg with --body-of, which says where it was measured.

    `hip_cm`: Height of its axle above the surface; None: the default of --hip. `body_error`: Error of the force model on this
    leg, learned there.
    """

    outline: Outline
    hip_cm: float | None
    body_error: BodyError


def find_measured_leg(source: str, body: BodyOptions) -> MeasuredLeg:
    """Find the leg of --leg with the error of the force model on it.

    `source`: Value of --body-of: a campaign's folder, or "published". `body`: Options of the leg.
    """
    from rftfit.compare.bodies import PUBLISHED, campaign_body_error, published_body_error
    from rftfit.forces.outlines import leg_outline

    if body.leg is None or len(body.outlines_given) > 1:
        raise InputError("--body-of needs --leg NAME alone: a leg that was measured there")
    if source == PUBLISHED:
        outline = body.make_outline()
        return MeasuredLeg(outline, body.hip, published_body_error(body.leg))
    results = rftfit.open(source)
    learned = campaign_body_error(results, body.leg)
    described = results.config.legs[body.leg]
    hip = described.hip_height_cm if body.hip is None else body.hip
    return MeasuredLeg(leg_outline(described, body.leg, body.elements), hip, learned)


# --- Contacts and pushes, and what is estimated from them


@dataclass(frozen=True)
class ContactOptions:
    """Options of measured forces on a body that serves as penetrometer: the forces tell what the medium is."""

    contacts: Annotated[
        Path | None,
        file_option(
            "Measured forces on a leg or a body that moves through the medium: a table with theta_deg (or t_s, x_cm, "
            "z_cm, angle_deg), force_z_N, force_x_N and, where known, error_N; with --leg, --curvature, --outline or "
            "--mesh."
        ),
    ] = None
    mesh: Annotated[
        Path | None, file_option("The body of --contacts is a mesh: stl, obj or ply, with --unit.")
    ] = None
    unit: MeshUnit = None
    body_of: BodyOf = None

    def read(self, body: BodyOptions) -> list[Contact]:
        """Read the contacts of the file; none without a file, where options of a body are refused as they mean nothing.

        `body`: Options of the body on which the forces were measured, unless it is a mesh.
        """
        if self.contacts is None:
            options_given = [
                *body.outlines_given,
                *list_given(body, "hip", "width"),
                *list_given(self, "mesh", "body_of"),
            ]
            if options_given:
                raise InputError(
                    f"found {options_given[0]} without --contacts FILE, to which it belongs"
                )
            return []
        if body.path is not None:
            raise InputError("found --path with --contacts; the file has the poses")
        from rftfit.forces.contact_file import read_contacts

        if self.mesh is not None:
            if body.outlines_given or self.unit is None:
                raise InputError("--mesh needs --unit mm, cm, m or in, and stands alone")
            shape: Outline | Mesh = rftfit.Mesh.read(self.mesh, self.unit)
        elif self.body_of is None:
            shape = body.make_outline()
        hip, learned = body.hip, None
        if self.body_of is not None:
            leg = find_measured_leg(self.body_of, body)
            shape, hip, learned = leg.outline, leg.hip_cm, leg.body_error
        contacts, warnings = read_contacts(self.contacts, shape, hip, learned)
        for warning in warnings:
            warn(f"warning: {warning}")
        return contacts


def read_given_pushes(
    alpha: float | None, se: float | None, table: PushOptions
) -> tuple[str, Columns]:
    """Return a name and the pushes: of the tables if any is given, else the one push of --alpha.

    The name is that of the files, or the description of the push, for messages. The pushes are columns by name: directions
    (``beta_deg``, ``gamma_deg``), alpha (N/cm^3) and its standard errors. `se`: Standard error of --alpha; None: the usual
    scatter of beds.
    """
    if table:
        return table.read()
    from rftfit.model.pushes import describe_push, one_push

    return describe_push(alpha or 0.0, se), one_push(alpha or 0.0, se)


def shapes_in(folder: Path | None) -> Shapes:
    """Return the media by whose common shape a map is estimated: the published five, with those of a campaign if any.

    `folder`: Value of --results; None: not given.
    """
    return rftfit.published_shapes() if folder is None else rftfit.open(folder).shapes()


def estimate_map_of(
    name: str,
    pushes: Columns | None,
    shapes: Shapes | None = None,
    confidence: float = 0.95,
    contacts: Sequence[Contact] = (),
) -> Map:
    """Estimate the map from pushes or contacts; an error names their file or option.

    `name`: As `read_given_pushes` returns it: a file, whose name without ending is that of the map, or the description of
    one push, which has an ``=``. `pushes`: None: contacts alone. `shapes`: Known media (`shapes_in`); None: the published.
    """
    name_of_map = Path(name).stem if "=" not in name else name
    try:
        return rftfit.estimate_map(pushes, shapes, confidence, name=name_of_map, contacts=contacts)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from error


def scale_from_pushes(
    name: str, pushes: Columns, reference: Reference, confidence: float
) -> ScaledMedium:
    """Scale a medium by the paper's routine, zeta times the generic profile, from the push straight down among some pushes.

    `name`: Their file or option, for messages. `reference`: Media by which it is scaled (`reference_in`).
    """
    from rftfit.model.pushes import push_straight_down

    alpha_and_se = push_straight_down(pushes, confidence)
    if alpha_and_se is None or not alpha_and_se[0] > 0:
        raise InputError(
            f"{name}: --profile generic needs a push straight down, (beta, gamma) = (0, 90) deg"
        )
    return rftfit.scale_by_paper(*alpha_and_se, reference, confidence)


# --- A body and its motion


_MOST_ELEMENTS = 10_000
"""Most elements that an outline is cut into."""

_WIDTH_CM = 2.54
"""Width of the model legs."""

_MOST_CM = 1000.0
"""Greatest length that is taken."""


@dataclass(frozen=True)
class BodyOptions:
    """Options of a leg or any outline in the plane (x forward, z up), and of its motion."""

    leg: Annotated[
        str | None, typer.Option(help="Model leg: c_leg, flat_leg or reversed_c_leg.")
    ] = None
    curvature: Annotated[
        float | None,
        number_option(
            "R/r",
            "Leg of any curvature, 2R = 7.62 cm: 1 is the c-leg, 0 flat, -1 the reversed one.",
        ),
    ] = None
    outline: Annotated[
        Path | None,
        file_option("Any outline: csv with x_cm, z_cm, points in order; it turns about (0, 0)."),
    ] = None
    width: Annotated[
        float | None,
        number_option(
            "cm", "Width across the plane; 2.54 with --curvature, needed with --outline."
        ),
    ] = None
    hip: Annotated[
        float | None,
        number_option(
            "cm", "Turn it about (0, 0) at this height, theta from -135 to 135 deg; default 2."
        ),
    ] = None
    path: Annotated[
        Path | None,
        file_option(
            "Move it along a path instead: csv with t_s, x_cm, z_cm, angle_deg; a mesh along t_s, x_cm, "
            "y_cm, z_cm, turn_x_deg, turn_y_deg, turn_z_deg."
        ),
    ] = None
    elements: Annotated[
        int, word_option("N", "Straight elements that the outline is cut into.")
    ] = 30

    @property
    def outlines_given(self) -> list[str]:
        """Names of the options given that state an outline; more than one is an error."""
        return list_given(self, "leg", "curvature", "outline")

    def make_outline(self) -> Outline:
        """Make the outline: a model leg, a leg of a curvature R/r, or a csv of points; refuse options that do not fit it."""
        from rftfit.forces.outlines import CURVATURES, arc, model_leg, read_outline

        if len(self.outlines_given) != 1:
            raise InputError(
                f"found {' and '.join(self.outlines_given) or 'no outline'}; allowed: one of --leg "
                f"({', '.join(CURVATURES)}), --curvature R/r, --outline FILE with --width"
            )
        if not 1 <= self.elements <= _MOST_ELEMENTS:
            raise InputError(f"--elements: found {self.elements}; allowed: 1 to {_MOST_ELEMENTS}")
        if self.width is not None and not 0 < self.width <= _MOST_CM:
            raise InputError(
                f"--width: found {self.width:g}; allowed: above 0, up to {_MOST_CM:g} cm"
            )
        if self.leg is not None:
            choose("--leg", self.leg, tuple(CURVATURES))
            if self.width is not None:
                raise InputError(
                    f"--width: the model legs are {_WIDTH_CM:g} cm wide; allowed with --curvature "
                    f"(c_leg is --curvature {CURVATURES['c_leg']:g}) and --outline"
                )
            return model_leg(self.leg, self.elements)
        if self.curvature is not None:
            if not -1 <= self.curvature <= 1:
                raise InputError(
                    f"--curvature: found {self.curvature:g}; allowed: R/r from -1 (reversed c-leg) over 0 "
                    "(flat) to 1 (c-leg)"
                )
            name = f"leg of curvature R/r = {self.curvature:g}"
            width = self.width or _WIDTH_CM
            return arc(self.curvature, width_cm=width, elements=self.elements, name=name)
        assert self.outline is not None
        if self.width is None:
            raise InputError(
                "--outline needs --width, in cm: how wide the body is across the plane"
            )
        return read_outline(self.outline, self.width, self.elements)

    def make_motion(self) -> Motion:
        """Make the motion of an outline: a rotation about an axle at the height --hip, or a path from a file."""
        from rftfit.forces.motion import HIP_HEIGHT_CM, read_path

        if self.path is None:
            height = HIP_HEIGHT_CM if self.hip is None else self.hip
            if not abs(height) <= _MOST_CM:
                raise InputError(
                    f"--hip: found {height:g}; allowed: -{_MOST_CM:g} to {_MOST_CM:g} cm"
                )
            return rftfit.rotation(None, height)
        if self.hip is not None:
            raise InputError(
                "--hip is for a rotation; with --path the height is in the file's z_cm"
            )
        return read_path(self.path)


@dataclass(frozen=True)
class MeshOptions:
    """Options of a body in space, and of its motion."""

    mesh: Annotated[
        Path | None,
        file_option(
            "Any body in space instead: stl, obj or ply, moved by --press, --roll or along --path."
        ),
    ] = None
    press: Annotated[
        float | None,
        number_option("cm", "Press the mesh straight down until its lowest point is so deep."),
    ] = None
    roll: Annotated[
        str | None,
        word_option(
            "SINKAGE,SLIP",
            "Roll a wheel, whose axle lies along y of the mesh, for one turn toward +x: depth of the lowest point of "
            "its rim in cm, and slip, 0.2 for 20 % (below 0: it brakes).",
        ),
    ] = None
    rim: RimRadius = None
    no_track: NoTrack = False
    unit: MeshUnit = None
    sheet: Annotated[
        bool, typer.Option("--sheet", help="The mesh is a thin sheet and need not be closed.")
    ] = False
    friction: FrictionOfMesh = None

    def check(self, body: BodyOptions, has_figure: bool) -> None:
        """Refuse options of a mesh without one, those of an outline with one, and a mesh without unit or motion.

        `body`: Options of an outline, of which --path serves a mesh, too. `has_figure`: True where --figure was given, which
        shows a mesh alone.
        """
        if self.mesh is None:
            # --figure is an option of the command and no field here
            options_given = [
                *list_given(self, "unit", "sheet", "friction", "press", "roll", "rim", "no_track"),
                *["--figure"] * has_figure,
            ]
            if options_given:
                raise InputError(
                    f"found {options_given[0]} without --mesh FILE, to which it belongs"
                )
            return
        if options_given := [*body.outlines_given, *list_given(body, "width", "hip")]:
            cure = "allowed: a mesh alone"
            if body.hip is not None:
                cure = (
                    "a mesh turns about a hip along --path FILE: the hip at (0, 0, 0) of the mesh, z_cm its height, and "
                    "turn_y_deg the angle from z toward x"
                )
            raise InputError(f"found {' and '.join(options_given)} with --mesh; {cure}")
        motions_given = [*list_given(self, "press", "roll"), *list_given(body, "path")]
        if len(motions_given) > 1:
            raise InputError(f"found {' and '.join(motions_given)}; allowed: one of them")
        missing = []
        if self.unit is None:
            missing.append("--unit, the unit of its coordinates: mm, cm, m or in")
        if not motions_given:
            missing.append(
                "one of --press DEPTH (cm), --roll SINKAGE,SLIP (cm and a share) and --path FILE (csv with t_s, x_cm, y_cm, "
                "z_cm, turn_x_deg, turn_y_deg, turn_z_deg)"
            )
        if missing:
            raise InputError(f"--mesh needs {'; and '.join(missing)}")
        if self.roll is None and (self.rim is not None or self.no_track):
            option = "--no-track" if self.no_track else "--rim"
            raise InputError(f"found {option} without --roll SINKAGE,SLIP, to which it belongs")

    def make_motion(self, mesh: Mesh, path: Path | None) -> Motion3D:
        """Make the motion of a mesh: along a path, straight down (--press), or rolling for one turn (--roll).

        `path`: Value of --path; None: not given.
        """
        if path is not None:
            return rftfit.Motion3D.read(path)
        try:
            if self.press is not None:
                return rftfit.Motion3D.press(mesh, self.press)
            numbers = str(self.roll).split(",")
            if len(numbers) != 2:
                raise ValueError("two numbers wanted, sinkage in cm and slip, as 2,0.2")
            sinkage, slip = map(float, numbers)
            track = not self.no_track
            return rftfit.Motion3D.roll(mesh, sinkage, slip, track=track, rim_cm=self.rim)
        except ValueError as error:
            option = f"--press {self.press:g}" if self.press is not None else f"--roll {self.roll}"
            raise InputError(f"{option}: {error}") from error


@dataclass(frozen=True)
class PushOptions:
    """Options of pushes that were made: a table, those behind a profile file, or both."""

    pushes: PushesFile = None
    profile_file: Annotated[
        Path | None,
        file_option(
            "The pushes behind a profile of rftfit export, alone or with those of --pushes."
        ),
    ] = None

    def __bool__(self) -> bool:
        return self.pushes is not None or self.profile_file is not None

    @property
    def files(self) -> tuple[Path | None, ...]:
        """Both files, which a command must not overwrite; None where one is not given."""
        return self.pushes, self.profile_file

    def read(self) -> tuple[str, Columns]:
        """Read the pushes of both files; return the names of the files and the pushes, as `read_given_pushes` does.

        Warnings are printed to standard error.
        """
        from rftfit.model.profile_file import collect_pushes

        name, pushes, warnings = collect_pushes(*self.files)
        for warning in warnings:
            warn(f"warning: {warning}")
        return name, pushes
