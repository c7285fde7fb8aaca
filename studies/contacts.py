"""What measured forces on legs tell of a medium, and of the same leg in another medium.

    python studies/contacts.py [PART ...] --rows FOLDER    some minutes on one core

carried    the same leg in media of the other material (Fig. S5) and in natural sands (Fig. S12): forces with what the model
           gets wrong on that leg, beside those without, and plain scaling of the measured curves
alone      alpha from the forces on one leg, without any plate; the leg calibrated in no, in one and in all other media
simulated  200 media with an exact law, with the model's error: coverage

Percent of the measured peak; poses from -110 to 110 degrees. The material of a medium is left out of its map and of what
is learned of a leg.
"""

from __future__ import annotations

import sys
import zlib
from functools import cache
from itertools import product
from typing import TYPE_CHECKING

import frame
import numpy as np
import pandas as pd
from exact_laws import MATERIALS, exact_laws, forces_in_plane
from force_scores import COMPONENTS, CONFIDENCE, peak_of, percent_inside, score_curve, smooth_errors
from frame import Part, Row, Tables, named
from grade_forces import (
    DRAWS,
    EVERY,
    MAPS,
    NODES,
    READING,
    SE,
    contact_of,
    forces_by,
    profile_of,
    push_table,
    vertical_alpha,
    with_error,
)

import rftfit
from rftfit.model.draws import interval
from rftfit.reference import LEGS, MEDIA, SANDS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rftfit.conventions import FloatArray

THIN = 3
"""Every third degree of a curve is a pose of a contact."""


# --- The same leg elsewhere


@cache
def calibration_profile(medium: str, kind: str, left_out: tuple[str, ...]) -> rftfit.Profile:
    """Table or map of all directions of a medium in which a leg was calibrated."""
    table = rftfit.published_medium(medium)
    if kind == "table":
        return table
    pushes = push_table(EVERY, np.stack(table.alpha(*NODES)), SE)
    return rftfit.estimate_map(pushes, rftfit.published_shapes(left_out)).profile


@cache
def body_error_of(
    leg_name: str, kind: str, left_out: tuple[str, ...], media: tuple[str, ...] = MEDIA
) -> rftfit.BodyError:
    """What the model gets wrong on a leg, learned in media that are not left out."""
    used = [medium for medium in media if medium not in left_out]
    return rftfit.learn_body_error(
        [
            (contact_of(medium, leg_name), calibration_profile(medium, kind, left_out))
            for medium in used
        ]
    )


def scaled_curves(medium: str, leg_name: str, left_out: Sequence[str]) -> FloatArray:
    """Curves measured elsewhere times the ratio of alpha_z(0, 90 deg), shape (media, 2, p)."""
    theta = contact_of(medium, leg_name).motion.columns["theta_deg"]
    curves = []
    for other in MEDIA:
        if other in left_out:
            continue
        contact = contact_of(other, leg_name)
        angles = contact.motion.columns["theta_deg"]
        force = np.stack([np.interp(theta, angles, curve) for curve in contact.measured])
        curves.append(force * vertical_alpha(medium) / vertical_alpha(other))
    return np.stack(curves)


MODELS = ("table", *MAPS)


def grade_carried(medium: str) -> list[Row]:
    """One row a leg, model and component of a medium."""
    left_out = MATERIALS.get(medium, ())
    rows: list[Row] = []
    for leg_name in LEGS:
        contact = contact_of(medium, leg_name)
        drawn = {"scaled curve": scaled_curves(medium, leg_name, left_out).mean(axis=0)[None]}
        for model in MODELS if medium in MEDIA else ("map 1",):
            body = body_error_of(leg_name, "table" if model == "table" else "map", left_out)
            plain, loads, _ = forces_by(medium, leg_name, model)
            paths = body.paths(contact.states, 2, DRAWS)[1]
            drawn[f"{model}, alone"] = with_error(plain, loads, 0.0, paths)
            drawn[model] = with_error(plain, loads, 1.0, paths)
        for (model, draws), component in product(drawn.items(), COMPONENTS):
            scores = score_curve(contact, component, draws, draws.mean(axis=0))
            rows.append({"leg": leg_name, "component": component, "model": model} | scores)
    return rows


def report_carried(rows: pd.DataFrame) -> Tables:
    """Scores by model, and errors of the peaks by leg, of media and of sands."""
    tables = []
    for title, media in (("Laboratory media, material left out", MEDIA), ("Natural sands", SANDS)):
        chosen = rows[rows["unit"].isin(media)]
        if chosen.empty:
            continue
        chosen = chosen.assign(off=chosen["peak_percent"].abs())
        scores = chosen.groupby("model", sort=False).agg(
            curves=("off", "size"),
            inside=("inside", "mean"),
            peaks_inside=("peak_in", "sum"),
            peak_median=("off", "median"),
            peak_worst=("off", "max"),
            rms=("rms_all", "mean"),
            rms_loaded=("rms", "mean"),
            crps=("crps", "mean"),
            score=("score", "mean"),
            width=("width", "mean"),
        )
        tables.append((title, scores.reset_index()))
        of_models = chosen[chosen["model"].isin(["table, alone", "scaled curve", *MODELS])]
        peaks = of_models.pivot_table(
            "peak_percent", ["leg", "component"], "model", aggfunc="median", sort=False
        )
        tables.append((f"{title}: error of the peak, median, %", peaks.reset_index()))
    return tables


# --- A leg alone


USES = (("c_leg",), ("flat_leg",), ("c_leg", "flat_leg"))


def grade_alone(medium: str) -> list[Row]:
    """One row a choice of legs and of calibration."""
    left_out = MATERIALS[medium]
    others = tuple(name for name in MEDIA if name not in left_out)
    truth = np.stack(rftfit.published_medium(medium).alpha(*NODES))
    rows: list[Row] = []
    for use, (calibrated, media) in product(
        USES, {"never": (), "in one medium": others[:1], "in all others": others}.items()
    ):
        contacts = [
            contact_of(
                medium, leg, body_error_of(leg, "map", left_out, media) if media else None, THIN
            )
            for leg in use
        ]
        shapes = rftfit.published_shapes(left_out)
        profile = rftfit.estimate_map(shapes=shapes, contacts=contacts).profile
        unused = [leg for leg in LEGS if leg not in use]
        rows.append(
            {"use": " + ".join(use), "calibrated": calibrated}
            | alpha_row(profile, truth)
            | {
                "legs_rms": rms_on_legs(medium, profile, unused),
                "push_rms": rms_on_legs(medium, profile_of(medium, "map 1"), unused),
            }
        )
    return rows


def alpha_row(profile: rftfit.Profile, truth: FloatArray) -> Row:
    """alpha_z(0, 90 deg) over the truth with its interval, and coverage of the published nodes (2, n)."""
    assert isinstance(profile.spread, rftfit.Profile)
    down = int(np.argmin(np.hypot(NODES[0], NODES[1] - np.pi / 2)))
    mean = np.stack(profile.alpha(*NODES))
    drawn = np.stack(profile.spread.alpha(*NODES), axis=1)
    lo, hi = interval(drawn, CONFIDENCE)
    level = truth[0, down]
    # symmetry leaves alpha_x of a level plate that moves straight no freedom
    free = hi - lo > 1e-9
    return {
        "ratio": 100 * mean[0, down] / level,
        "ratio_lo": 100 * lo[0, down] / level,
        "ratio_hi": 100 * hi[0, down] / level,
        "holds": float(lo[0, down] <= level <= hi[0, down]),
        "half_width": 50 * (hi - lo)[0, down] / mean[0, down],
        "nodes_inside": percent_inside(lo[free], hi[free], truth[free]),
        "map_rms": 100 * np.sqrt(np.mean((mean - truth) ** 2)) / level,
    }


def rms_on_legs(medium: str, profile: rftfit.Profile, legs: Sequence[str]) -> float:
    """Rms error of the forces on legs over their measured peaks, %."""
    errors = []
    for leg_name in legs:
        contact = contact_of(medium, leg_name)
        off = contact.force_draws(profile)[0] - contact.measured
        for component, error in zip(COMPONENTS, np.sqrt((off**2).mean(axis=1)), strict=True):
            errors.append(100 * error / abs(peak_of(contact, component)))
    return float(np.mean(errors))


def report_alone(rows: pd.DataFrame) -> Tables:
    """Ratio to the plates, intervals and coverage by choice, and each medium."""
    groups = rows.groupby(["use", "calibrated"], sort=False, dropna=False)
    summary = groups.agg(
        media=("ratio", "count"),
        ratio=("ratio", "mean"),
        sd=("ratio", "std"),
        holds=("holds", "sum"),
        half_width=("half_width", "mean"),
        nodes_inside=("nodes_inside", "mean"),
        map_rms=("map_rms", "mean"),
        legs_rms=("legs_rms", "mean"),
        push_rms=("push_rms", "mean"),
    )
    return [("alpha_z(0, 90 deg) over the plate's, %", summary.reset_index())]


# --- Simulated contacts


SIMULATED = 200
MODEL_ERROR = 0.28
THETA_DEG = np.arange(-110.0, 111.0, 5.0)
LAWS = ("3D-RFT 0.3", "3D-RFT 0.6", "frictional 0.3", "frictional 0.6", "bilinear poppy_LP")


def grade_simulated(number: int) -> list[Row]:
    """Coverage of a medium with an exact law, of which one to three legs are simulated with the model's error."""
    random = np.random.default_rng([zlib.crc32(b"laws"), number])
    law = exact_laws()[LAWS[number % len(LAWS)]]
    truth = law.alpha(*NODES)
    exact = rftfit.TableProfile(truth[0], truth[1], *NODES)
    motion = rftfit.rotation(THETA_DEG)
    contacts = []
    for leg_name in LEGS[: 1 + number % 3]:
        leg = rftfit.model_leg(leg_name)
        force = forces_in_plane(law, leg, motion.poses)
        load = rftfit.Contact(leg, motion, {"force_z_N": force[0]}, 1.0).load(exact)
        seed = int(random.integers(1 << 30))
        force = force + MODEL_ERROR * load * smooth_errors(THETA_DEG, (2,), seed)
        error = READING * float(np.abs(force).max())
        force = force + error * random.standard_normal(force.shape)
        measured = {"force_z_N": force[0], "force_x_N": force[1]}
        contacts.append(rftfit.Contact(leg, motion, measured, error))
    row: Row = {"medium": law.name, "legs": len(contacts)}
    try:
        shapes = rftfit.published_shapes(law.material)
        estimate = rftfit.estimate_map(shapes=shapes, contacts=contacts)
    except ValueError as problem:
        return [row | {"refused": str(problem)[:60]}]
    return [row | alpha_row(estimate.profile, truth)]


def report_simulated(rows: pd.DataFrame) -> Tables:
    """Coverage of alpha_z(0, 90 deg) and of the nodes."""
    tables = []
    for by in ("medium", "legs"):
        groups = rows.groupby(by, sort=False)
        table = groups.agg(
            media=("medium", "size"),
            ratio=("ratio", "mean"),
            holds=("holds", "mean"),
            half_width=("half_width", "mean"),
            nodes_inside=("nodes_inside", "mean"),
            map_rms=("map_rms", "mean"),
        )
        table["refused"] = groups["refused"].count() if "refused" in rows else 0
        table["holds"] *= 100
        tables.append((f"Coverage by {by}", table.reset_index()))
    return tables


PARTS = {
    "carried": Part(named([*MEDIA, *SANDS]), grade_carried, report_carried),
    "alone": Part(named(MEDIA), grade_alone, report_alone),
    "simulated": Part(
        lambda count, _seed: named(range(count)), grade_simulated, report_simulated, SIMULATED
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS, processes=1))
