"""Answers of ``rftfit predict``: forces on a body, their sources, peaks, intervals, doubts, in words and facts.

A quantity is a force (N) or a moment (N cm) by its column, such as ``force_z_N``. Each has up to three intervals: of
alpha and with the force model's own error, both of the mean over many beds that are prepared alike, and of the next
bed, one more of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from rftfit.forces.bodies import set_in_motion
from rftfit.forces.body_error import BodyError
from rftfit.forces.mesh import Mesh, Motion3D, describe_triangles
from rftfit.forces.model_error import eps_of, has_model_error
from rftfit.forces.motion import Motion
from rftfit.forces.moving import BodyInMotion
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import (
    STEEP,
    STEEP_DEG,
    Peak,
    describe_beside,
    pose_of,
    unit_of,
    unknown_peaks,
)
from rftfit.forces.prediction import predict_with_peaks
from rftfit.forces.rolling import RULES, Rim, describe_friction
from rftfit.model.draws import end_names, model_end_names, next_end_names
from rftfit.model.profiles import FAR_DEG, Profile, TableProfile
from rftfit.store.text import count
from rftfit.store.text import table as format_table

PEAK_TITLES = {
    "lift": "peak lift (up)",
    "suction": "peak suction (down)",
    "thrust": "peak thrust (toward +x)",
    "drag": "peak drag (toward -x)",
    "moment": "peak moment (z toward x)",
    "moment_negative": "peak moment (x toward z)",
}
"""Titles of the peaks of an outline, by name."""

PEAK_TITLES_IN_SPACE = {
    f"{quantity}_{axis}": f"largest {quantity} {axis}"
    for quantity in ("force", "moment")
    for axis in "xyz"
}
"""Titles of the peaks of a mesh, by name."""

_TITLES = PEAK_TITLES | PEAK_TITLES_IN_SPACE

_FACTS_OF_PEAK = ("lo", "hi", "model_lo", "model_hi", "next_lo", "next_hi", "beside", "withheld")
"""Fields of a peak that `ForceAnswer.as_dict` returns."""

_LONGEST_REASON = 300
"""Most characters of a reason that are printed."""


@dataclass(frozen=True, eq=False)
class ForceAnswer:
    """Forces on a body along its motion, with what they are predicted from: the answer of ``rftfit predict``.

    It is calculated when it is first asked for. `confidence`, `friction`, `model_error`, `body_error`: arguments of
    `rftfit.predict`; None: as the law, the profile, or nothing learned of this body, states it. `origin`: name of the
    profile and its folder, as it is printed; empty: the name alone. `left_out`: words on errors that the intervals of
    this form of alpha leave out; empty: none.
    """

    profile: Profile
    body: Outline | Mesh
    motion: Motion | Motion3D
    confidence: float = 0.95
    friction: float | None = None
    model_error: float | None = None
    body_error: BodyError | None = None
    origin: str = ""
    left_out: str = ""

    @cached_property
    def _table_and_peaks(self) -> tuple[pd.DataFrame, list[Peak]]:
        """`forces` and `peaks`, from one pass through all draws."""
        return predict_with_peaks(
            self.profile,
            self.body,
            self.motion,
            self.confidence,
            friction=self.friction,
            model_error=self.model_error,
            body_error=self.body_error,
        )

    @property
    def forces(self) -> pd.DataFrame:
        """Table of `rftfit.predict`, one row a pose.

        Columns of the motion (``theta_deg`` or ``t_s`` first), of each force (N) and moment (N cm) such as
        ``force_z_N`` with the ends of its intervals (of alpha ``force_z_lo_N``, with the model's error
        ``force_z_model_lo_N``, of the next bed ``force_z_next_lo_N``), and ``reason`` why there is no number.
        """
        return self._table_and_peaks[0]

    @property
    def peaks(self) -> list[Peak]:
        """Greatest force and moment of each sign, those of `rftfit.find_peaks`; in space the largest of either sign."""
        return self._table_and_peaks[1]

    @cached_property
    def _moving(self) -> BodyInMotion:
        """The body in its motion, for questions that neither `forces` nor `peaks` answer."""
        return set_in_motion(self.body, self.motion, friction=self.friction)

    @property
    def in_space(self) -> bool:
        """True for a mesh, False for an outline."""
        return isinstance(self.body, Mesh)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Columns of forces and moments, such as ``force_z_N``."""
        return self._moving.with_interval

    @cached_property
    def beside(self) -> Profile | None:
        """For a profile of nine terms that of the same medium by its table or map, to compare with; else None."""
        return None if self.profile.beside is None else self.profile.beside()

    @property
    def eps(self) -> float:
        """Relative error of the model that the intervals contain; 0: none."""
        return eps_of(self.model_error, self.profile, self.body)

    @property
    def poses_unknown(self) -> int:
        """Number of poses in which a force or moment has no number."""
        return int(self.forces[list(self.quantities)].isna().any(axis=1).sum())

    @property
    def reason(self) -> str:
        """Why the first pose without a number has none; empty where all have one."""
        return next((reason for reason in self.forces["reason"] if reason), "")

    @property
    def short_reason(self) -> str:
        """`reason`, cut where it names dozens of cells."""
        is_short = len(self.reason) <= _LONGEST_REASON
        return self.reason if is_short else f"{self.reason[:_LONGEST_REASON]} ..."

    @property
    def peaks_not_stated(self) -> list[str]:
        """Names of peaks that may lie in a pose without a number: what is largest elsewhere is then not their value."""
        curves = {name: self.forces[name].to_numpy(float) for name in self.quantities}
        return unknown_peaks(curves, self._moving.peak_targets(curves), self.peaks)

    @property
    def interval_of_alpha(self) -> str:
        """Name of the interval of alpha, as it is printed; empty where no error of alpha is known."""
        return f"{self._percent} of alpha" if self.profile.spread is not None else ""

    @property
    def interval_of_model(self) -> str:
        """Name of the interval with the model's own error; empty where there is none."""
        with_error = f"{self._percent} with the model's own error"
        if self.body_error is not None:
            return f"{with_error} on this body (eps {self.body_error.per_medium:.2g})"
        return f"{with_error} (eps {self.eps:g})" if self.eps else ""

    @property
    def interval_of_bed(self) -> str:
        """Name of the interval of the next bed; empty where there is none.

        There is one where an interval with the model's own error is known, or one of alpha by a profile whose model
        error could be known: a measured force has both errors.
        """
        alpha_is_enough = self.interval_of_alpha and has_model_error(self.profile)
        if not (self.eps or self.body_error or alpha_is_enough):
            return ""
        percent = 100 * self.profile.bed_spread
        also = "with the model's own error, " if self.interval_of_model else ""
        return f"{self._percent} of the next bed ({also}{percent:.3g} % from bed to bed)"

    @property
    def _percent(self) -> str:
        """Words on the confidence, such as ``95 % interval``."""
        return f"{100 * self.confidence:g} % interval"

    @property
    def sources(self) -> dict[str, str]:
        """Body, motion, profile and options of the prediction, each as words for people.

        Keys: ``mesh`` or ``outline``, ``motion``, ``profile``, and where they apply ``beside`` (profile to compare
        with), ``rim``, ``rule`` and ``friction`` (of a wheel or mesh) and ``body`` (error learned of this body).
        """
        body = self.body
        if isinstance(body, Mesh):
            triangles = describe_triangles(len(body.faces), body.triangles_given)
            form, pieces = "mesh", f"{triangles}, {body.describe_size()}"
        else:
            form, pieces = "outline", f"{len(body.body)} elements"
        sources = {
            form: f"{body.name}, {body.area_cm2:.4g} cm^2, {pieces}",
            "motion": self.motion.name + self._deepest,
            "profile": self.origin or self.profile.name,
        }
        if self.beside is not None:
            sources["beside"] = self.beside.name
        if self.rim is not None:
            sources["rim"] = self.rim.describe()
        if self.rule is not None:
            sources["rule"] = f"{self.rule}: {RULES[self.rule]}"
        if self.rule is not None or self.friction is not None:
            sources["friction"] = describe_friction(self.friction)
        if self.body_error is not None:
            sources["body"] = self.body_error.words
        return sources

    @property
    def _deepest(self) -> str:
        """Say how deep the lowest point of a mesh gets along a path, to show a wrong height at once.

        Empty of any other motion: only a path has `Motion3D.rates_of_steps`.
        """
        if not isinstance(self.body, Mesh) or not isinstance(self.motion, Motion3D):
            return ""
        if self.motion.rates_of_steps is None:
            return ""
        depth_cm = self.motion.depth_of(self.body)
        if not depth_cm > 0:
            return ", above the surface"
        return f", deepest {depth_cm:.3g} cm"

    @property
    def rim(self) -> Rim | None:
        """Rim of a rolling wheel; None of any other motion."""
        return self.motion.rim if isinstance(self.motion, Motion3D) else None

    @property
    def rule(self) -> str | None:
        """Rule of a rolling wheel, a key of `RULES`; None of any other motion."""
        return self.motion.rule if isinstance(self.motion, Motion3D) and self.rim else None

    @property
    def notes(self) -> list[str]:
        """Lines for the head of a table of the forces; the last one is empty where every pose has a number."""
        intervals_by_suffix = {
            "": self.interval_of_alpha,
            "_model": self.interval_of_model,
            "_next": self.interval_of_bed,
        }
        notes = [*self.sources.values()]
        notes += [
            f"{suffix}_lo and {suffix}_hi: {interval}, row by row"
            for suffix, interval in intervals_by_suffix.items()
            if interval
        ]
        if self.beside is not None:
            notes.append(
                f"_beside: by {self.beside.name}; where it lies outside of _lo and _hi, these are empty"
            )
        notes += [
            f"{peak.quantity}_lo and {peak.quantity}_hi are too narrow near {self._position_column} = {peak.position:g}: there "
            f"{STEEP_DEG:g} degrees of the attack angle change the force by {100 * peak.steepness:.0f} %"
            for peak in self.peaks
            if peak.withheld == STEEP
        ]
        return [*notes, self.reason and f"empty cells: {self.short_reason}"]

    @property
    def mean_of_turn(self) -> dict[str, float]:
        """Mean over the poses of a wheel's turn: ``drawbar_N`` (toward +x), ``load_N`` (up) and ``torque_N_cm`` of the drive.

        NaN where a pose has no number.
        """
        drawbar, load, moment = (
            float(self.forces[name].mean(skipna=False))
            for name in ("force_x_N", "force_z_N", "moment_y_N_cm")
        )
        # the medium turns the wheel back: the drive gives the opposite moment
        return {"drawbar_N": drawbar, "load_N": load, "torque_N_cm": -moment}

    def as_dict(self) -> dict[str, Any]:
        """Return everything but the curves, as ``rftfit predict --json`` prints it; None for a peak that is missing.

        ``peaks``: by name (a key of `PEAK_TITLES` or of `PEAK_TITLES_IN_SPACE`) the fields of a `Peak`, with the value
        under the column of its quantity and the position under that of the motion. ``rows``: poses.
        """
        peaks: dict[str, dict[str, float | str] | None] = dict.fromkeys(
            PEAK_TITLES_IN_SPACE if self.in_space else PEAK_TITLES
        )
        for peak in self.peaks:
            numbers = {name: getattr(peak, name) for name in _FACTS_OF_PEAK}
            peaks[peak.name] = {
                peak.quantity: peak.value,
                **numbers,
                self._position_column: peak.position,
            }
        facts: dict[str, Any] = self.sources | {
            "confidence": self.confidence if self.interval_of_alpha or self.eps else None,
            "model_error": self.eps,
            "rows": len(self.forces),
            "rows_unknown": self.poses_unknown,
            "reason": self.reason,
            "peaks_complete": not self.peaks_not_stated,
            "peaks": peaks,
            "model_error_known": has_model_error(self.profile),
            "shares_near_pushes": self.shares_near_pushes,
            "signs_unknown": self.signs_unknown,
        }
        if isinstance(self.body, Mesh):
            facts |= {
                "triangles": len(self.body.faces),
                "triangles_given": self.body.triangles_given,
            }
        if self.rim is not None:
            facts |= {
                "rim_cm": self.rim.radius_cm,
                "rim_from": self.rim.taken_from,
                "rim_doubtful": self.rim.is_doubtful,
            }
        if "friction" in facts:
            facts |= {"friction": self.friction}
        if self.rule is not None:
            facts |= {"rule": self.rule, "mean_of_turn": self.mean_of_turn}
        return facts

    @property
    def signs_unknown(self) -> list[str]:
        """Names of the peaks in space whose widest interval holds 0: they may have the other sign."""
        if not self.in_space:
            return []
        ends = {peak.name: _widest_ends(peak) for peak in self.peaks}
        return [name for name, (low, high) in ends.items() if low < 0 < high]

    @property
    def shares_near_pushes(self) -> dict[str, float]:
        """Share of each peak force in directions within `FAR_DEG` of a push, 0 to 1, by name of the peak; of a map alone.

        The rest of a map is by the shape of known media: it is no measurement of this medium.
        """
        if self.profile.form != "map" or not isinstance(self.profile, TableProfile):
            return {}
        moving = self._moving
        curves = {name: self.forces[name].to_numpy(float) for name in moving.force_names}
        return {
            peak.name: moving.share_near_pushes(
                peak, self.profile, pose_of(peak, curves[peak.quantity])
            )
            for peak in self.peaks
            if peak.quantity in moving.force_names and peak.value
        }

    @property
    def farthest_of_zeros(self) -> dict[str, float]:
        """Largest |end| of the intervals of all poses, for each force and moment in space that symmetry makes 0.

        Such a force has no peak, but the force model may err on it. Keys: as ``force_y``; N or N cm.
        """
        if not self.in_space or self.poses_unknown:
            return {}
        has_peak = {peak.quantity for peak in self.peaks}
        farthest = {}
        for quantity in self.quantities:
            columns = self._columns_of_widest(quantity)
            if columns and quantity not in has_peak:
                size = float(np.nanmax(np.abs(self.forces[columns].to_numpy(float))))
                if size > 0:
                    farthest[quantity.partition("_N")[0]] = size
        return farthest

    def _columns_of_widest(self, quantity: str) -> list[str]:
        """Both columns of the widest interval of a quantity that `forces` has; empty where it has none.

        That of the next bed is wider than that with the model's error, and this one wider than that of alpha.
        """
        widest_first = (names(quantity) for names in (next_end_names, model_end_names, end_names))
        return next((list(ends) for ends in widest_first if ends[0] in self.forces), [])

    @property
    def _position_column(self) -> str:
        """Column of `forces` that tells the poses apart, such as ``theta_deg``: that of `Peak.position`."""
        return next(iter(self.motion.columns))

    def summary(self) -> str:
        """Format sources, peaks, intervals and what they leave out as lines for people."""
        lines = [f"{word.capitalize()}: {source}" for word, source in self.sources.items()]
        lines += ["", self._format_peaks(), *self._list_missing_intervals()]
        if self.signs_unknown:
            titles = ", ".join(_TITLES[name] for name in self.signs_unknown)
            lines.append(f"{titles}: the sign is not known.")
        lines += [
            f"{_TITLES[name]}: 0, in the interval of a pose up to {_format_number(farthest)} {unit_of(name)} either way."
            for name, farthest in self.farthest_of_zeros.items()
        ]
        if self.shares_near_pushes:
            shares = ", ".join(
                f"{_TITLES[name].partition(' (')[0]} {100 * share:.0f} %"
                for name, share in self.shares_near_pushes.items()
            )
            lines.append(
                f"Share of the force in directions within {FAR_DEG:g} degrees of a push: {shares}; the rest is by the shape of "
                "known media."
            )
        if self.in_space:
            lines.append("Moments are about the point (0, 0, 0) of the mesh.")
        if self.peaks_not_stated:
            # the greatest of a curve with gaps need not be its peak, and must not pass for it
            titles = ", ".join(_TITLES[name] for name in self.peaks_not_stated)
            poses = count(self.poses_unknown, "pose")
            lines.append(
                f"Not stated, as it may lie in one of the {poses} without a number: {titles}."
            )
        if self.interval_of_alpha and self.left_out:
            lines.append(f"Not in the intervals: {self.left_out}.")
        if self.rule is not None:
            means = self.mean_of_turn
            lines.append(
                f"\nMean over the turn: drawbar (toward +x) {means['drawbar_N']:.4g} N, load (up) {means['load_N']:.4g} N, "
                f"torque of the drive {means['torque_N_cm']:.4g} N cm."
            )
        if self.in_space and self.forces["closure_N"].max() > 0:
            lines.append(
                f"\nNot in the intervals: the law in space may err by up to {self.forces['closure_N'].max():.3g} N "
                "(closure_N), in the worst case."
            )
        return "\n".join(lines)

    def _format_peaks(self) -> str:
        """Format the table of the peaks, and below it sentences on what its intervals are of."""
        of_mean = ", of the mean over beds"
        intervals = {
            ("lo", "hi"): self.interval_of_alpha and self.interval_of_alpha + of_mean,
            ("model_lo", "model_hi"): self.interval_of_model and self.interval_of_model + of_mean,
            ("next_lo", "next_hi"): self.interval_of_bed,
        }
        # fields of `Peak` that are shown, in pairs, with the meaning of the interval
        ends_shown = {ends: meaning for ends, meaning in intervals.items() if meaning}
        columns = ["value", *(end for ends in ends_shown for end in ends)]
        rows = [
            [
                _TITLES[peak.name],
                *(_format_number(getattr(peak, column)) for column in columns),
                unit_of(peak.quantity),
                f"{peak.position:g}",
            ]
            for peak in self.peaks
        ]
        if not rows:
            return "  no force in these poses that can be stated"
        head = ["", *(column.replace("_", " ") for column in columns)]
        sentences = [
            f"{', '.join(ends).replace('_', ' ')}: {meaning}"
            for ends, meaning in ends_shown.items()
        ]
        if self.interval_of_bed:
            sentences.append("Compare a measured force with next lo, next hi")
        if ends_shown:
            sentences.append(
                "All are of the largest value along the motion; the table of poses has those of each pose"
            )
        if not self.interval_of_alpha:
            sentences.insert(0, "No interval of alpha: the errors of this profile are not known")
        peaks = format_table([*head, "unit", self._position_column], rows)
        return f"{peaks}\n\n" + ".\n".join(sentences) + "."

    def _list_missing_intervals(self) -> list[str]:
        """List sentences that say which intervals are missing, and why: of nine terms, of steep peaks."""
        lines = []
        if not has_model_error(self.profile):
            lines.append(
                "No interval with the model's own error: it was measured by tables and maps, and is not that of "
                f"{self.profile.form}."
            )
        if self.beside is not None:
            lines += [
                f"{_TITLES[peak.name]}: {describe_beside(peak, self.profile.form, self.beside.form)}."
                for peak in self.peaks
            ]
        instead = ""
        if self.interval_of_model:
            instead = "; the interval with the model's own error includes that"
        lines += [
            f"{_TITLES[peak.name]}: no interval of alpha: {STEEP_DEG:g} degrees of the attack angle change it by "
            f"{100 * peak.steepness:.0f} %, and pushes around do not tell where alpha is so steep{instead}."
            for peak in self.peaks
            if peak.withheld == STEEP
        ]
        return lines

    def list_doubts(self, cure: str = "") -> list[str]:
        """List sentences on poses without a number or an interval, as warnings of the command.

        `cure`: words on how to get numbers there, behind the reason.
        """
        poses = len(self.forces)
        doubts = []
        if self.poses_unknown:
            doubts.append(
                f"no number in {self.poses_unknown} of {poses} poses: {self.short_reason}{cure}"
            )
        elif (self.forces[list(self.quantities)] == 0).all(axis=None):
            doubts.append(
                "no force in any pose: the body stays above the surface, or does not move"
            )
        # poses in which some force has a number, but an end of its interval of alpha has none
        lacks_interval = np.zeros(poses, dtype=bool)
        for name in self.quantities:
            ends = list(end_names(name))
            if ends[0] in self.forces:
                lacks_end = self.forces[ends].isna().any(axis=1)
                lacks_interval |= (lacks_end & self.forces[name].notna()).to_numpy()
        # where a table stands beside nine terms, the head of the file says why intervals are empty
        if self.beside is None and (without := int(lacks_interval.sum())):
            doubts.append(
                f"no interval in {without} of {poses} poses: no error of alpha is known there"
            )
        return doubts


def _widest_ends(peak: Peak) -> tuple[float, float]:
    """Return the interval of the next bed, else that with the model's error, else that of alpha, else NaN."""
    intervals = ((peak.next_lo, peak.next_hi), (peak.model_lo, peak.model_hi), (peak.lo, peak.hi))
    return next((ends for ends in intervals if not math.isnan(ends[0])), (math.nan, math.nan))


def _format_number(number: float) -> str:
    """Format a number; NaN is empty, and -0 is written as 0."""
    return "" if math.isnan(number) else f"{number + 0.0:.4g}"
