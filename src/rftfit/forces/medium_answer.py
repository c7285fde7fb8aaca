"""Answers of ``rftfit scale`` on a medium, from one test, a few pushes or contacts: as text, facts and a table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from rftfit.measure.alpha import Columns, column
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.model.draws import interval
from rftfit.model.fourier import TERMS
from rftfit.model.maps import NOT_ALIKE, Map
from rftfit.model.profiles import Profile
from rftfit.model.pushes import push_straight_down
from rftfit.model.scaling import Reference, ScaledMedium, scale_by_paper
from rftfit.store.text import table

if TYPE_CHECKING:
    from rftfit.forces.contacts import Contact

_SHOWN_BETA, _SHOWN_GAMMA = (-60, -30, 0, 30, 60, 90), (-90, -45, 0, 45, 90)
"""Attack and intrusion angles, deg, at which alpha of a map is printed."""


@dataclass(frozen=True)
class MediumAnswer:
    """Answer of ``rftfit scale`` on one medium: alpha by direction with intervals, zeta, and whether to trust them.

    `text`: for people. `facts`: for scripts, printed as JSON. `columns`: alpha by direction, each (n,): ``beta_deg``,
    ``gamma_deg``, then ``alpha_z_N_per_cm3``, its ends, the same of x, and others. `description`: from what alpha was
    estimated. `level`: of the intervals, in words. `where`: in which directions alpha is known. `doubt`: sentence on
    why the medium may not be like the known ones; empty where nothing speaks against it.
    """

    text: str
    facts: dict[str, Any]
    columns: Mapping[str, npt.NDArray[Any]]
    description: str
    level: str
    where: str
    doubt: str = ""

    def summary(self) -> str:
        """Return the text for people; this and `as_dict` are what a command prints of any answer."""
        return self.text

    def as_dict(self) -> dict[str, Any]:
        """Return the facts for scripts."""
        return self.facts

    def columns_for_file(self) -> dict[str, Any]:
        """Return the columns of alpha by direction for a file: angles to 0.01 degrees, numbers to 1e-6 N/cm^3.

        Angles are the first two columns; a column of words is left as it is.
        """
        beta_deg, gamma_deg, *others = self.columns
        columns: dict[str, Any] = {
            name: [f"{angle:.2f}" for angle in self.columns[name]] for name in (beta_deg, gamma_deg)
        }
        for name in others:
            column = self.columns[name]
            columns[name] = column.round(6) if column.dtype.kind == "f" else column
        return columns


def answer_of_test(scaled: ScaledMedium) -> MediumAnswer:
    """Answer from one penetration test, alpha_z(0, 90 deg), scaled by the paper's routine from reference media.

    Facts: ``zeta``, ``chi`` and each of the nine coefficients with ``value``, ``lo``, ``hi``.
    """
    alpha, se, confidence = scaled.alpha_z, scaled.alpha_z_se, scaled.confidence
    reference = scaled.reference
    terms = dict(zip(TERMS, zip(*scaled.coefficients_with_interval(), strict=True), strict=True))
    factors = {name: _value_and_ends(scaled, name) for name in ("zeta", "chi")}
    rows = [
        [name, *(f"{round(value, 4) + 0.0:.4f}" for value in values)]
        for name, values in (factors | terms).items()
    ]
    description = f"alpha_z(0, 90 deg) = {alpha:g} N/cm^3 (se {se:g}), scaled from {reference.name}"
    error_of_test = " and the error of the test" if se else ""
    text = (
        f"From {description}\n\n"
        f"{table(['', 'value', 'lo', 'hi'], rows)}\n\n"
        "zeta and chi without unit, coefficients in N/cm^3.\n"
        f"lo, hi: {100 * confidence:g} % interval for a new medium like these, from the scatter "
        f"between\n{', '.join(reference.media)}{error_of_test}.\n"
        "Measured alpha departs from nine terms: at (0, 90 deg) it lies above by the factor chi. The intervals\n"
        "of alpha and of forces contain what nine terms miss, those of the coefficients do not. chi and the\n"
        "coefficients belong to one fit: least squares by default, the paper's own transform, with its zeta of\n"
        "0.8 alpha_z, by --method dft-index."
    )
    facts = {
        "alpha_z_N_per_cm3": alpha,
        "alpha_z_se_N_per_cm3": se,
        "confidence": confidence,
        "scaled_from": reference.name,
        "media": list(reference.media),
        **{name: _name_ends(values) for name, values in factors.items()},
        "coefficients_N_per_cm3": {term: _name_ends(values) for term, values in terms.items()},
    }
    level = f"{100 * confidence:g} % interval for a new medium like these"
    where = "on the published grid of 7 x 13 angles"
    return MediumAnswer(text, facts, scaled.columns(), description, level, where)


def answer_of_pushes(
    name: str, medium_map: Map, pushes: Columns | None, reference: Reference
) -> MediumAnswer:
    """Answer from the map of any number of pushes; zeta by the paper's routine too where a push goes straight down.

    `name`: of the file of the pushes, as it is printed. `pushes`: columns of the alpha table from which the map was
    estimated; None: from contacts alone. `reference`: media from which the paper's routine scales.
    """
    confidence = medium_map.confidence
    # alpha_z(0, 90 deg) of the pushes and its standard error
    down = None if pushes is None else push_straight_down(pushes, confidence)
    routine = None
    if down is not None and down[0] > 0:
        routine = scale_by_paper(*down, reference, confidence)
    level = f"{100 * confidence:g} % interval"
    description = f"{medium_map.measurements} of {name}, with the shape of {medium_map.known_media}"
    facts = {
        "pushes": medium_map.pushes,
        "known_media": medium_map.known_media.split(", "),
        "confidence": confidence,
        "zeta": _name_ends(medium_map.zeta),
        "zeta_of_the_papers_routine": routine and _name_ends(_value_and_ends(routine, "zeta")),
        "chi_squared": medium_map.distance,
        "degrees_of_freedom": medium_map.dof,
        "probability_if_it_belongs": medium_map.belongs if medium_map.dof > 0 else None,
        "draws_not_passive": medium_map.not_passive,
        "alpha_x_over_known": None if has_no_alpha_x(medium_map) else medium_map.horizontal,
    }
    text = _format_map(medium_map, routine, description, level)
    where = f"in {medium_map.beta.size} directions"
    return MediumAnswer(
        text,
        facts,
        medium_map.columns(),
        f"from {description}",
        level,
        where,
        _describe_doubt(medium_map),
    )


def answer_of_contacts(
    answer: MediumAnswer, alone: Map, contacts: Sequence[Contact], pushes: Columns | None
) -> MediumAnswer:
    """Return an answer with alpha_z(0, 90 deg) by the contacts alone in front, compared with that of a plate.

    So two measurements of one number show whether forces on the body and pushes of plates agree. `answer`: that of
    pushes, contacts or both. `alone`: map of the contacts without a push. `pushes`: as in `answer_of_pushes`; None or
    without a push straight down: nothing is compared.
    """
    vertical = vertical_alpha(alone)
    level = f"{100 * alone.confidence:g} % interval"
    value, lo, hi = vertical
    plate = None if pushes is None else push_straight_down(pushes, alone.confidence)
    comparison = ""
    facts: dict[str, Any] = {"contacts": len(contacts), "alpha_z_of_contacts": _name_ends(vertical)}
    if plate is not None:
        plate_alpha, _ = plate
        facts |= {"alpha_z_of_plate": plate_alpha, "contacts_over_plate": value / plate_alpha}
        comparison = (
            f"; a plate says {plate_alpha:.3g}: ratio {value / plate_alpha:.2f} "
            f"({lo / plate_alpha:.2f} to {hi / plate_alpha:.2f})"
        )
    bodies = "; ".join(dict.fromkeys(contact.body_error.words for contact in contacts))
    poses = sum(int(contact.touches.sum()) for contact in contacts)
    head = (
        f"alpha_z(0, 90 deg) = {value:.3g} N/cm^3 ({lo:.3g} to {hi:.3g}, {level}) from forces on "
        f"{contacts[0].body.name} in {poses} poses{comparison}.\n{bodies[0].upper()}{bodies[1:]}.\n\n"
    )
    return replace(answer, text=head + answer.text, facts=answer.facts | facts)


def vertical_alpha(medium_map: Map) -> tuple[float, float, float]:
    """Return alpha_z(0, 90 deg) of a map, and the lower and upper end of its interval, N/cm^3."""
    profile = medium_map.profile
    assert isinstance(profile.spread, Profile)
    value = float(profile.alpha(0.0, math.pi / 2)[0])
    lo, hi = interval(profile.spread.alpha(0.0, math.pi / 2)[0], medium_map.confidence)
    return value, float(lo), float(hi)


def _value_and_ends(medium: ScaledMedium, name: str) -> tuple[float, ...]:
    """Return a number of a scaled medium, such as ``zeta``, and the lower and upper end of its interval."""
    return tuple(float(getattr(medium, name + end)) for end in ("", "_lo", "_hi"))


def _name_ends(numbers: Iterable[float]) -> dict[str, float]:
    """Return a number and the ends of its interval under the names ``value``, ``lo`` and ``hi``, for scripts."""
    return dict(zip(("value", "lo", "hi"), map(float, numbers), strict=True))


def _describe_doubt(medium_map: Map) -> str:
    """Say why a medium does not belong to the known ones; empty where it may belong.

    `Map.belongs` is the share of media that belong and lie as far from the shape; `Map.farthest` the push that lies
    farthest from what the others let expect, None where there was no push.
    """
    worst = medium_map.farthest
    if not medium_map.belongs < NOT_ALIKE:
        return ""
    media = f"{1 / max(medium_map.belongs, 1e-9):.3g} media that do"
    if worst is None:
        if not medium_map.contacts:
            return ""
        return (
            "this medium does not belong to those whose shape is known, or the body is described wrongly: forces lie so "
            f"far from those expected once in {media}"
        )
    return (
        "this medium does not belong to those whose shape is known: pushes lie so far from "
        f"it once in {media}. "
        f"{_describe_horizontal(medium_map, ' as in the known media')}. Farthest from the shape is {worst.describe()}. "
        "A wet, cohesive or angular medium, a wrong sign or angle; estimated alpha is not "
        "to be trusted."
    )


def _format_map(medium_map: Map, routine: ScaledMedium | None, description: str, level: str) -> str:
    """Format a map for people: tables of alpha at some angles, zeta, and its agreement with the known media.

    `routine`: zeta by the paper's routine, None without a push straight down. `description`, `level`: as in
    `MediumAnswer`.
    """
    columns = medium_map.columns()
    beta_deg, gamma_deg = columns["beta_deg"], columns["gamma_deg"]
    tables = []
    for component in "zx":
        rows = []
        for beta in _SHOWN_BETA:
            cells = []
            for gamma in _SHOWN_GAMMA:
                # the direction of the map that is nearest to the angles that are shown
                nearest = int((np.abs(beta_deg - beta) + np.abs(gamma_deg - gamma)).argmin())
                value, lo, hi = (
                    float(columns[column(component, end)][nearest]) for end in ("", "_lo", "_hi")
                )
                is_measured = columns["source"][nearest] == "measured" and hi > lo
                mark = "*" if is_measured else ""
                ends = f"{lo:.3f} to {hi:.3f}" if hi > lo else "by symmetry"
                # + 0.0 so that nothing is called -0
                cells.append(f"{round(value, 3) + 0.0:.3f} ({ends}){mark}")
            rows.append([f"{beta}", *cells])
        head = [f"alpha_{component}", *(f"gamma {gamma}" for gamma in _SHOWN_GAMMA)]
        tables.append(table(head, rows))
    zeta = "zeta {:.4f} ({:.4f} to {:.4f}) of this medium, by nine terms fitted to the map".format(
        *medium_map.zeta
    )
    if routine is not None:
        zeta += (
            f"\nzeta {routine.zeta:.4f} ({routine.zeta_lo:.4f} to {routine.zeta_hi:.4f}) "
            f"by the paper's routine from (0, 90) deg alone, with {routine.reference.name}"
        )
    # contacts measure both components together
    contacts_alone = medium_map.contacts and has_no_alpha_x(medium_map)
    strength = "" if contacts_alone else f", {_describe_horizontal(medium_map)}"
    if medium_map.dof > 0:
        agree = (
            f"Agreement with the shape of the known media: chi^2 = {medium_map.distance:.3g} for {medium_map.dof}{strength}; "
            "as far or farther in "
            f"{100 * medium_map.belongs:.3g} % of media that belong."
        )
    else:
        agree = "One number tells how strong the medium is, not whether it has the shape of the known media."
    of_repeats = ", by the repeats" if medium_map.bed_spread > USUAL_BED_SPREAD else ""
    return (
        f"From {description}\n\n"
        + "\n\n".join(tables)
        + f"\n\nN/cm^3; beta and gamma in degrees; {level}, of the mean over beds (a further bed differs by "
        f"{100 * medium_map.bed_spread:.3g} %, one standard deviation{of_repeats}); * measured.\n{zeta}\n{agree}\n"
        "Intervals are of draws that take energy in every direction, as any medium does; "
        f"{100 * medium_map.not_passive:.0f} % of all gave energy back somewhere and were left out, as usual: the fewer pushes, the more."
    )


def has_no_alpha_x(medium_map: Map) -> bool:
    """Tell whether no push measured how strong alpha_x is beside alpha_z, so that known media alone say it."""
    return math.isnan(medium_map.horizontal)


def _describe_horizontal(medium_map: Map, compared_with: str = "") -> str:
    """Say how strong alpha_x is beside alpha_z, compared with known media, or that no push measured it.

    `compared_with`: words at the end, such as " as in the known media".
    """
    if has_no_alpha_x(medium_map):
        return "alpha_x was not measured"
    return f"alpha_x is {medium_map.horizontal:.2g} times as strong beside alpha_z{compared_with}"
