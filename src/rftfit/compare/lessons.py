"""Tests of predictions on measured legs: by plates alone, with another leg, and with the same leg in other media.

A *lesson* is what a prediction of a leg is learned from. Each lesson predicts each measured leg, which it has not used;
the result is `contacts.csv`. A `Contact` is a leg with its motion and the forces that were measured on it, a *pose* one
of its positions; a component is ``z`` or ``x``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from rftfit.compare.legs import FORCES, extreme, measured_peak
from rftfit.errors import InputError
from rftfit.forces.body_error import BodyError, ErrorCurve, learn_from_curves
from rftfit.forces.contacts import Contact, error_curve
from rftfit.forces.motion import Motion
from rftfit.forces.outlines import Outline
from rftfit.forces.plane import forces_on
from rftfit.forces.prediction import predict_with_peaks
from rftfit.measure.flags import Remark, quoted, reason_columns
from rftfit.model.profiles import Profile
from rftfit.outputs.dictionary import columns_of
from rftfit.store.chosen import chosen

if TYPE_CHECKING:
    from rftfit.results import Results

PLATES, OTHER_LEG, ELSEWHERE = "plates", "other-leg", "same-leg-elsewhere"
"""Names of the lessons, in the table."""

COLUMNS = columns_of("contacts.csv")

_CHOSEN = chosen("compare", "lessons")


def lesson_rows(results: Results, model_error: float | None = None) -> pd.DataFrame:
    """Predict each measured leg in each medium by the map of its plates, with another leg, and with the same leg elsewhere.

    Another leg is one of ``maps.use_legs``. Returns one row of `COLUMNS` for each medium, leg, component and lesson. A
    prediction never uses the tested leg in the same medium. `model_error`: relative error of the force model, for
    plates and another leg; default: that of `results`.
    """
    rows: list[dict[str, Any]] = []
    measured_legs: list[_MeasuredLegs] = []
    for name in (*results.laboratory, *results.sands):
        legs, untested_rows = _measure_legs(results, name)
        rows += untested_rows
        if legs is not None:
            measured_legs.append(legs)
    # what the model gets wrong on each leg in each laboratory medium, from which the last lesson learns
    errors = {
        (legs.medium, leg): error_curve(contact, legs.map_of_plates)
        for legs in measured_legs
        if legs.medium in results.laboratory
        for leg, contact in legs.contacts.items()
    }
    confidence = results.config.fit.confidence
    for legs in measured_legs:
        maps_with_leg = {
            leg: results[legs.medium].map(teachers=[leg]).profile
            for leg in results.config.maps.use_legs
            if leg in legs.contacts
        }
        for leg, contact in legs.contacts.items():
            for lesson in _lessons(legs, maps_with_leg, errors, leg):
                scores = _score_prediction(
                    contact, legs.peaks[leg], lesson, confidence, model_error
                )
                key = {"medium": legs.medium, "leg": leg, "lesson": lesson.name}
                key |= {"learned_from": lesson.learned_from} | reason_columns([])
                rows += [key | numbers for numbers in scores]
    return pd.DataFrame(rows, columns=COLUMNS)


class _MeasuredLegs(NamedTuple):
    """Measured legs of a medium, and the map of its plates.

    `contacts`: outline, motion and measured forces by leg, in about 60 poses. `peaks`: size of the measured peak of each
    component, N, by leg.
    """

    medium: str
    map_of_plates: Profile
    contacts: dict[str, Contact]
    peaks: dict[str, dict[str, float]]


def _measure_legs(results: Results, name: str) -> tuple[_MeasuredLegs | None, list[dict[str, Any]]]:
    """Return the measured legs of a medium, None without any, and rows of those that cannot be tested, with the reason."""
    medium = results[name]
    contacts: dict[str, Contact] = {}
    untested_rows: list[dict[str, Any]] = []
    for leg in results.config.legs:
        try:
            contact = medium.contact(leg)
        except InputError as error:
            untested_rows += _untested_rows(name, leg, quoted(error, "few-poses"))
            continue
        if contact is not None:
            contacts[leg] = contact
    if not contacts:
        return None, untested_rows
    try:
        map_of_plates = medium.map(teachers=()).profile
    except InputError as error:
        for leg in contacts:
            untested_rows += _untested_rows(name, leg, quoted(error, "no-map"))
        return None, untested_rows
    # before poses are left out: the peaks of whole curves, as in `leg_errors.csv`
    peaks = {leg: _measured_peaks(contact) for leg, contact in contacts.items()}
    thinned = {
        leg: _thin_out(contact, _peak_poses(contact, map_of_plates))
        for leg, contact in contacts.items()
    }
    return _MeasuredLegs(name, map_of_plates, thinned, peaks), untested_rows


def _untested_rows(medium: str, leg: str, why: Remark) -> list[dict[str, Any]]:
    """Make the rows of a leg that cannot be predicted, with the reason."""
    row = {"medium": medium, "leg": leg, "lesson": PLATES} | reason_columns([why])
    return [row | {"component": c} for c in "zx"]


class Lesson(NamedTuple):
    """A source of predictions of a leg.

    `name`: `PLATES`, `OTHER_LEG` or `ELSEWHERE`. `learned_from`: the leg, or the media, besides the plates. `profile`:
    map of the medium by which the leg is predicted. `body_error`: error of the model on the leg, where it was learned;
    None: the error of the model is that of any body.
    """

    name: str
    learned_from: str
    profile: Profile
    body_error: BodyError | None = None


def _lessons(
    legs: _MeasuredLegs,
    maps_with_leg: Mapping[str, Profile],
    errors: Mapping[tuple[str, str], ErrorCurve],
    leg: str,
) -> Iterator[Lesson]:
    """Yield the lessons of a leg in a medium: of plates alone, of each other leg, and of the same leg elsewhere, if any.

    `maps_with_leg`: map of plates and a leg, by this leg. `errors`: those of the model, by medium and leg.
    """
    yield Lesson(PLATES, "", legs.map_of_plates)
    for teacher, profile in maps_with_leg.items():
        if teacher != leg:
            yield Lesson(OTHER_LEG, teacher, profile)
    elsewhere = {
        medium: curve
        for (medium, measured_leg), curve in errors.items()
        if measured_leg == leg and medium != legs.medium
    }
    if elsewhere:
        body_error = learn_from_curves([*elsewhere.values()])
        yield Lesson(ELSEWHERE, ", ".join(elsewhere), legs.map_of_plates, body_error)


def _peak_poses(contact: Contact, profile: Profile) -> list[int]:
    """Find the poses, two indices, in which lift and horizontal force on the body are largest by a profile."""
    assert isinstance(contact.motion, Motion)
    assert isinstance(contact.body, Outline)
    forces = forces_on(profile, contact.body, contact.motion.poses)
    return [extreme(forces.force_z_N, "z"), extreme(forces.force_x_N, "x")]


def _thin_out(contact: Contact, kept: Sequence[int]) -> Contact:
    """Return a contact with about 60 of its poses, evenly chosen, and the poses `kept`: each pose takes time."""
    poses = len(contact.frames)
    if poses <= _CHOSEN.most_poses:
        return contact
    even = np.linspace(0, poses - 1, _CHOSEN.most_poses).round().astype(int)
    chosen_poses = np.unique(np.append(even, kept))
    motion = contact.motion
    assert isinstance(motion, Motion)
    columns = {name: numbers[chosen_poses] for name, numbers in motion.columns.items()}
    fewer = Motion(motion.name, motion.poses[chosen_poses], columns)
    force = dict(zip(contact.components, contact.measured[:, chosen_poses], strict=True))
    return replace(contact, motion=fewer, force=force)


def _measured_peaks(contact: Contact) -> dict[str, float]:
    """Find the size of the measured peak of each component, N, by component; NaN where too few poses have a force."""
    assert isinstance(contact.motion, Motion)
    theta = contact.motion.columns["theta_deg"]
    peaks = {}
    for c, force in zip("zx", contact.measured, strict=True):
        finite = np.isfinite(force)
        peaks[c] = math.nan
        if finite.sum() >= _CHOSEN.fewest_poses:
            peaks[c] = abs(measured_peak(theta[finite], force[finite], c).force_N)
    return peaks


def _score_prediction(
    contact: Contact,
    peaks: Mapping[str, float],
    lesson: Lesson,
    confidence: float,
    model_error: float | None,
) -> Iterator[dict[str, Any]]:
    """Yield, for each component, the error of the peak, the rms error and the share of poses inside the interval.

    Each a dict of columns of `contacts.csv`; none for a component with too few poses. `peaks`: from `_measured_peaks`.
    `model_error`: for a lesson without a body error; see `lesson_rows`.
    """
    forces, _ = predict_with_peaks(
        lesson.profile,
        contact.body,
        contact.motion,
        confidence,
        quantities=[*FORCES.values()],
        model_error=model_error if lesson.body_error is None else None,
        body_error=lesson.body_error,
    )
    for measured, (c, name) in zip(contact.measured, FORCES.items(), strict=True):
        predicted = forces[name].to_numpy(float)
        finite = np.isfinite(measured) & np.isfinite(predicted)
        if finite.sum() < _CHOSEN.fewest_poses:
            continue
        peak = peaks[c]
        lo, hi = (forces[f"force_{c}_model_{end}_N"].to_numpy(float) for end in ("lo", "hi"))
        highest = extreme(predicted, c)
        predicted_peak = abs(predicted[highest])
        # sizes: an end of the interval with the other sign than the peak is negative
        sign = math.copysign(1.0, predicted[highest])
        least, most = sorted((sign * lo[highest], sign * hi[highest]))
        is_inside = (lo <= measured) & (measured <= hi)
        rms = float(np.sqrt(np.mean((predicted - measured)[finite] ** 2)))
        yield {
            "component": c,
            "peak_measured_N": peak,
            "peak_predicted_N": predicted_peak,
            "peak_predicted_model_lo_N": least,
            "peak_predicted_model_hi_N": most,
            "peak_error_percent": 100 * (predicted_peak / peak - 1),
            "rms_relative_to_peak": rms / peak,
            "inside_percent": 100 * float(is_inside[finite & contact.touches].mean()),
        }


def summary_of_lessons(table: pd.DataFrame) -> pd.DataFrame:
    """Summarize each lesson in a row, over all curves: their number, median error of the peak and rms, poses inside.

    A curve is one component of a leg in a medium. `table`: rows of `COLUMNS`, from `lesson_rows`.
    """
    tested = table.dropna(subset=["peak_error_percent"])
    tested = tested.assign(size_percent=tested["peak_error_percent"].abs())
    groups = tested.groupby("lesson", sort=False)
    return groups.agg(
        curves=("size_percent", "size"),
        peak_error_percent=("size_percent", "median"),
        rms_relative_to_peak=("rms_relative_to_peak", "median"),
        inside_percent=("inside_percent", "mean"),
    ).reset_index()
