"""Tests of predictions on measured legs: by plates alone, with another leg, and with the same leg in other media."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from rftfit.compare.legs import extreme, measured_peak
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
LESSONS = (PLATES, OTHER_LEG, ELSEWHERE)
"""Lessons: sources of the prediction of a leg, beside the plates of its medium."""

COLUMNS = columns_of("contacts.csv")

_CHOSEN = chosen("compare", "lessons")


def lesson_rows(results: Results, model_error: float | None = None) -> pd.DataFrame:
    """Predict each measured leg in each medium by the map of its plates, with another leg, and with the same leg elsewhere.

    Another leg is one of ``maps.use_legs``. Returns one row for each medium, leg, component and lesson. A prediction
    never uses the tested leg in the same medium. `model_error`: for plates and another leg; default: that of `results`.
    """
    media = [results[name] for name in (*results.laboratory, *results.sands)]
    curves: dict[str, dict[str, Contact]] = {}
    peaks: dict[tuple[str, str], dict[str, float]] = {}
    maps: dict[str, Profile] = {}
    confidence = results.config.fit.confidence
    rows: list[dict[str, Any]] = []
    for medium in media:
        curves[medium.name] = {}
        for leg in results.config.legs:
            try:
                contact = medium.contact(leg)
            except InputError as error:
                rows += _untested_rows(medium.name, leg, quoted(error, "few-poses"))
                continue
            if contact is not None:
                curves[medium.name][leg] = contact
        if not curves[medium.name]:
            continue
        try:
            maps[medium.name] = medium.map(teachers=()).profile
        except InputError as error:
            for leg in curves[medium.name]:
                rows += _untested_rows(medium.name, leg, quoted(error, "no-map"))
            continue
        for leg, contact in curves[medium.name].items():
            # before poses are left out: the peaks of whole curves, as in `leg_errors.csv`
            peaks[medium.name, leg] = _measured_peaks(contact)
            curves[medium.name][leg] = _thin_out(contact, _peak_poses(contact, maps[medium.name]))
    errors = {
        (name, leg): error_curve(curves[name][leg], maps[name])
        for name in results.laboratory
        if name in maps
        for leg in curves[name]
    }
    for medium in media:
        if medium.name not in maps:
            continue
        of_legs = {
            leg: medium.map(teachers=[leg]).profile
            for leg in results.config.maps.use_legs
            if leg in curves[medium.name]
        }
        for leg, contact in curves[medium.name].items():
            lessons = [
                *_lessons_of_plates(maps[medium.name], of_legs, leg),
                *_lessons_elsewhere(errors, medium.name, maps[medium.name], leg),
            ]
            for lesson, learned_from, profile, body_error in lessons:
                key = {"medium": medium.name, "leg": leg}
                of_lesson = {"lesson": lesson, "learned_from": learned_from}
                peaks_of_leg = peaks[medium.name, leg]
                for scores in _score_prediction(
                    contact, peaks_of_leg, profile, confidence, model_error, body_error
                ):
                    rows.append(key | scores | of_lesson | reason_columns([]))
    return pd.DataFrame(rows, columns=COLUMNS)


def _untested_rows(medium: str, leg: str, why: Remark) -> list[dict[str, Any]]:
    """Make the rows of a leg that cannot be predicted, with the reason."""
    row = {"medium": medium, "leg": leg, "lesson": PLATES} | reason_columns([why])
    return [row | {"component": c} for c in "zx"]


Lesson = tuple[str, str, Profile, BodyError | None]
"""Name, the leg or media that were learned from, profile, and error of the model on the leg."""


def _lessons_of_plates(
    plates: Profile, of_legs: Mapping[str, Profile], leg: str
) -> Iterator[Lesson]:
    """Yield the lessons of plates alone and of each other leg; `of_legs`: profile learned with a leg, by its name."""
    yield PLATES, "", plates, None
    for teacher, profile in of_legs.items():
        if teacher != leg:
            yield OTHER_LEG, teacher, profile, None


def _lessons_elsewhere(
    errors: Mapping[tuple[str, str], ErrorCurve], medium: str, plates: Profile, leg: str
) -> Iterator[Lesson]:
    """Yield the lesson of the same leg in other media, if any; `errors`: those of the model, by medium and leg."""
    elsewhere = {
        name: curve for (name, of_leg), curve in errors.items() if of_leg == leg and name != medium
    }
    if elsewhere:
        yield ELSEWHERE, ", ".join(elsewhere), plates, learn_from_curves([*elsewhere.values()])


def _peak_poses(contact: Contact, profile: Profile) -> list[int]:
    """Find the poses in which lift and horizontal force on the body are largest by a profile."""
    assert isinstance(contact.motion, Motion)
    assert isinstance(contact.body, Outline)
    forces = forces_on(profile, contact.body, contact.motion.poses)
    return [extreme(forces.force_z_N, "z"), extreme(forces.force_x_N, "x")]


def _thin_out(contact: Contact, kept: Sequence[int]) -> Contact:
    """Keep about 60 poses of a contact, evenly chosen, and the poses `kept`."""
    poses = len(contact.frames)
    if poses <= _CHOSEN.most_poses:
        return contact
    even = np.linspace(0, poses - 1, _CHOSEN.most_poses).round().astype(int)
    places = np.unique(np.append(even, kept))
    motion = contact.motion
    assert isinstance(motion, Motion)
    fewer = Motion(
        motion.name,
        motion.poses[places],
        {name: values[places] for name, values in motion.columns.items()},
    )
    force = dict(zip(contact.components, contact.measured[:, places], strict=True))
    return replace(contact, motion=fewer, force=force)


def _measured_peaks(contact: Contact) -> dict[str, float]:
    """Find the size of the measured peak of each component, N; NaN where too few poses have a force."""
    assert isinstance(contact.motion, Motion)
    theta = contact.motion.columns["theta_deg"]
    peaks = {}
    for c, force in zip("zx", contact.measured, strict=True):
        finite = np.isfinite(force)
        is_enough = finite.sum() >= _CHOSEN.fewest_poses
        peaks[c] = (
            abs(measured_peak(theta[finite], force[finite], c).force_N) if is_enough else math.nan
        )
    return peaks


def _score_prediction(
    contact: Contact,
    peaks: Mapping[str, float],
    profile: Profile,
    confidence: float,
    model_error: float | None,
    body_error: BodyError | None,
) -> Iterator[dict[str, Any]]:
    """Yield, for each component, the error of the peak, the rms error and the share of poses inside the interval.

    `peaks`: from `_measured_peaks`.
    """
    names = {"z": "force_z_N", "x": "force_x_N"}
    forces, _ = predict_with_peaks(
        profile,
        contact.body,
        contact.motion,
        confidence,
        quantities=[*names.values()],
        model_error=model_error if body_error is None else None,
        body_error=body_error,
    )
    for row, (c, name) in enumerate(names.items()):
        measured = contact.measured[row]
        predicted = forces[name].to_numpy(float)
        finite = np.isfinite(measured) & np.isfinite(predicted)
        if finite.sum() < _CHOSEN.fewest_poses:
            continue
        top = peaks[c]
        lo, hi = (forces[f"force_{c}_model_{end}_N"].to_numpy(float) for end in ("lo", "hi"))
        highest = extreme(predicted, c)
        # sizes: an end of the interval with the other sign than the peak is negative
        side = math.copysign(1.0, predicted[highest])
        least, most = sorted((side * lo[highest], side * hi[highest]))
        loaded = finite & contact.touches
        inside = (lo <= measured) & (measured <= hi)
        yield {
            "component": c,
            "peak_measured_N": top,
            "peak_predicted_N": abs(predicted[highest]),
            "peak_predicted_model_lo_N": least,
            "peak_predicted_model_hi_N": most,
            "peak_error_percent": 100 * (abs(predicted[highest]) / top - 1),
            "rms_relative_to_peak": float(
                np.sqrt(np.mean((predicted - measured)[finite] ** 2)) / top
            ),
            "inside_percent": 100 * float(inside[loaded].mean()),
        }


def summary_of_lessons(table: pd.DataFrame) -> pd.DataFrame:
    """Summarize each lesson in a row: curves, error of the peak, rms, poses inside; media and sands together."""
    tested = table.dropna(subset=["peak_error_percent"])
    tested = tested.assign(off=tested["peak_error_percent"].abs())
    groups = tested.groupby("lesson", sort=False)
    return groups.agg(
        curves=("off", "size"),
        peak_error_percent=("off", "median"),
        rms_relative_to_peak=("rms_relative_to_peak", "median"),
        inside_percent=("inside_percent", "mean"),
    ).reset_index()
