"""Predictions of forces on bodies, `predict` and `find_peaks`: errors of alpha and of the model become intervals.

A profile gives alpha (N/cm^3) as a function of two angles; its `spread` is what is known of the errors of alpha: a
stack of draws, a `ScaledMedium` (one penetration test, scaled from reference media), or None. The model's own error is
how far measured forces lie from the integral with alpha known exactly. A motion has p poses. Forces (N) and moments (N
cm) by the name of their column are `ForcesByName`: shape (p,) of one profile, (draws, p) of a stack. `Ends` are the two
ends of an interval by the same names, each of shape (p,). Both intervals are of the mean over many beds that are
prepared alike; the interval of the next bed, one more of these, contains the spread from bed to bed, too.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from rftfit.conventions import FloatArray
from rftfit.errors import LimitWarning
from rftfit.forces import model_error as errors
from rftfit.forces.bodies import set_in_motion
from rftfit.forces.body_error import BodyError
from rftfit.forces.limits import beyond_measured
from rftfit.forces.mesh import Mesh, Motion3D
from rftfit.forces.motion import Motion
from rftfit.forces.moving import BodyInMotion, DrawnForces, ForcesByName, has_forces
from rftfit.forces.outlines import Outline
from rftfit.forces.peaks import (
    DrawStatistics,
    Ends,
    Peak,
    keep_true_intervals,
    pick_peaks,
    set_beside,
)
from rftfit.forces.plane import QUANTITIES
from rftfit.measure.errors import half_width_of_bed
from rftfit.model.draws import DRAWS, beside_name, end_names, model_end_names, next_end_names, widen
from rftfit.model.known import profile_of
from rftfit.model.profiles import FourierProfile, KnownMedium, Profile
from rftfit.model.scaling import ScaledMedium


def predict(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    quantities: Sequence[str] = QUANTITIES,
    law: str = "measured",
    friction: float | None = None,
    model_error: float | None = None,
    body_error: BodyError | None = None,
) -> pd.DataFrame:
    """Predict force and moment on a body that moves through a medium, with intervals.

    Parameters
    ----------
    medium : Map, Profile, Medium, ScaledMedium, str or Path
        What `scale`, `estimate_map`, `published_medium` or `read_profile` return, a medium of `open` (its table, or its map
        where the table has no number in a direction of the body) or one of its profiles, or the path of a profile file.
    outline : Outline or Mesh
        The body: `model_leg`, `arc`, `polyline` in the plane, a `Mesh` in space.
    motion : Motion or Motion3D, optional
        `rotation` (default: that of the paper's trials) or `path`; for a mesh a `Motion3D`.
    confidence : float, optional
        Level of the intervals, which are pointwise: each pose for itself.
    quantities : sequence of str, optional
        For an outline: those of ``force_z_N``, ``force_x_N``, ``moment_N_cm`` that get an interval; default all.
    law : str, optional
        For a mesh: ``measured``, by the whole map, or ``3d-rft``, by its alpha_z(0, 90 deg) alone.
    friction : float, optional
        For a mesh: stress along a face is at most this times the stress across it, and no face is pulled or
        driven. Default: as the law states it; the surface of the measured plates is in their map.
    model_error : float, optional
        Relative error of the model itself, beside that of alpha (`rftfit.forces.model_error`). Default: that of
        the profile, `EPS` of measured legs or more, of tables and maps (of a solid in space, by direction,
        `SPACE_OVER_PLANE` times that); of another profile none is known. 0: none.
    body_error : BodyError, optional
        What the model gets wrong on this body, learned in other media (`learn_body_error`): force and interval are
        blended with it by their errors. It replaces `model_error`.

    Returns
    -------
    pandas.DataFrame
        One row per pose: the columns of `motion`; ``force_z_N`` (up is positive), ``force_x_N``
        (toward +x), ``moment_N_cm`` about the reference point (from z toward x); after each two
        intervals: of alpha, as ``force_z_lo_N, force_z_hi_N``, where the profile has a spread, and with the
        model's own error, as ``force_z_model_lo_N, force_z_model_hi_N``, both of the mean over beds; the
        wider of them with the spread of one bed, ``force_z_next_lo_N, force_z_next_hi_N``; ``reason``, why
        there is no number. Of a mesh: ``x_cm, y_cm, z_cm``, forces and moments about the reference point in
        three directions (axes of the world), and ``closure_N``: the error of a force if the law in space errs
        alike on all faces that leave their plane (measured law). It is not in the interval, because no
        measurement in the plane contains it.

    Raises
    ------
    TypeError
        If the motion of a mesh is no `Motion3D`, or that of an outline is one; if there is no medium.
    ValueError
        If `model_error` is stated of a profile of which none is known.

    Warns
    -----
    LimitWarning
        For each sentence of `beyond_measured`.

    Examples
    --------
    >>> import rftfit
    >>> forces = rftfit.predict(rftfit.published_medium("poppy_LP"), rftfit.model_leg("c_leg"))
    >>> round(float(forces["force_z_N"].max()), 1)
    8.9
    """
    _warn_of_limits(medium, outline, motion)
    return predict_with_peaks(
        medium,
        outline,
        motion,
        confidence,
        quantities=quantities,
        law=law,
        friction=friction,
        model_error=model_error,
        body_error=body_error,
    )[0]


def predict_with_peaks(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    quantities: Sequence[str] = QUANTITIES,
    law: str = "measured",
    friction: float | None = None,
    model_error: float | None = None,
    body_error: BodyError | None = None,
) -> tuple[pd.DataFrame, list[Peak]]:
    """Return the table of `predict` and the peaks of `find_peaks`, from one pass through all draws.

    Arguments as in `predict`; it warns of no limit. Raises ValueError where both `model_error` and `body_error` are
    given.
    """
    if body_error is not None and model_error is not None:
        raise ValueError("found model_error and body_error; allowed: one of them")
    moving = set_in_motion(outline, motion, law, friction, quantities)
    # a medium of a campaign gives its table, or where that has no number for this body its map
    profile = profile_of(medium, moving.is_covered_by)
    spread = profile.spread
    draws = len(spread.parameters[0]) if isinstance(spread, Profile) else DRAWS
    error = _ErrorOfModel(moving, errors.eps_of(model_error, profile, outline), body_error, draws)
    return _Prediction(moving, profile, error, confidence).table_and_peaks()


def find_peaks(
    medium: KnownMedium | str | Path,
    outline: Outline | Mesh,
    motion: Motion | Motion3D | None = None,
    confidence: float = 0.95,
    *,
    model_error: float | None = None,
) -> list[Peak]:
    """Find the greatest force and moment of each sign on a body that moves, with the intervals that ``rftfit predict`` prints.

    Parameters
    ----------
    medium, outline, motion, confidence, model_error
        See `predict`.

    Returns
    -------
    list of Peak
        Only those that exist: no lift where nothing pushes up, and none that may lie in a pose without a number. Of a
        mesh: the largest value of each force and moment, of either sign.

    Warns
    -----
    LimitWarning
        For each sentence of `beyond_measured`.

    Examples
    --------
    >>> import rftfit
    >>> lift, *others = rftfit.find_peaks(rftfit.scale(0.9), rftfit.model_leg("c_leg"))
    >>> lift.name, round(lift.value, 1)
    ('lift', 27.8)
    """
    _warn_of_limits(medium, outline, motion)
    return predict_with_peaks(medium, outline, motion, confidence, model_error=model_error)[1]


def _warn_of_limits(
    medium: KnownMedium | str | Path, outline: Outline | Mesh, motion: Motion | Motion3D | None
) -> None:
    """Warn of each limit that a prediction leaves; the warning names the line that called `predict` or `find_peaks`."""
    for limit in beyond_measured(medium, outline, motion):
        warnings.warn(limit, LimitWarning, stacklevel=3)


class _ErrorOfModel:
    """Draws of what the force model gets wrong on a body that moves.

    `eps`: relative error on any body, over the load of the body; 0: none is known or asked for. `body_error`: error on
    a body that was measured before, which replaces `eps`, or None. `draws`: as many as of alpha, since each draw of
    alpha gets one draw of the error.
    """

    def __init__(
        self, moving: BodyInMotion, eps: float, body_error: BodyError | None, draws: int
    ) -> None:
        self.moving, self.eps, self.body_error, self.draws = moving, eps, body_error, draws

    @property
    def is_stated(self) -> bool:
        """True where an error of the model other than 0 is known, or asked for."""
        return self.body_error is not None or self.eps > 0

    @property
    def poses_at_once(self) -> int:
        """Number of poses whose draws are held in memory together."""
        return self.moving.poses_at_once(self.draws)

    def paths(self) -> Iterator[FloatArray]:
        """Draw the error over eps and the load, of `poses_at_once` poses at a time: shape (draws, forces, k).

        On a body that was measured before: the error over the load, less its mean, which `add_mean` adds.
        """
        step = self.poses_at_once
        if self.body_error is None:
            axes = len(self.moving.force_names)
            yield from errors.error_paths(self.moving.progress, self.draws, axes, step)
            return
        mean, drawn = self._body_paths
        about_mean = drawn - mean
        for start in range(0, len(self.moving.poses), step):
            yield about_mean[..., start : start + step]

    @cached_property
    def _body_paths(self) -> tuple[FloatArray, FloatArray]:
        """Mean of the body's error over the load, shape (forces, p), and draws of it, (draws, forces, p)."""
        assert self.body_error is not None
        return self.body_error.paths(self.moving.states, len(self.moving.force_names), self.draws)

    def add_mean(self, drawn: DrawnForces) -> DrawnForces:
        """Return draws of forces with the mean error of a body that was measured before; on any other body as they are."""
        if self.body_error is None:
            return drawn
        mean = self._body_paths[0][None, :, drawn.start : drawn.stop]
        mean_errors = self.moving.body_errors(drawn, mean)
        return drawn._replace(forces=_add_errors(drawn.forces, mean_errors))

    def add_draws(self, drawn: DrawnForces, paths: FloatArray) -> ForcesByName:
        """Return forces with draws of the error; `paths`: those of the same poses, an item of `paths`."""
        if self.body_error is None:
            return _add_errors(drawn.forces, self.moving.model_errors(drawn, paths, self.eps))
        return _add_errors(drawn.forces, self.moving.body_errors(drawn, paths))


def _add_errors(forces: ForcesByName, errors_by_name: ForcesByName) -> ForcesByName:
    """Return the forces with the errors of the same name added; forces without an error, as a moment may be, are left out."""
    return {name: forces[name] + error for name, error in errors_by_name.items()}


class _Prediction:
    """Forces on a body by a profile, with intervals of alpha (`alpha_ends`) and with the model's error (`model_ends`).

    Both are calculated at once, because every draw of alpha is also the base of one draw of the model's error. `best`:
    forces by the profile itself. `has_forces`: True in poses whose best forces all have a number, shape (p,).
    `alpha_draws`, `model_draws`: statistics of the draws of these intervals, from which peaks get theirs; None where an
    interval is not from draws. `alpha_ends`, `model_ends`: empty where the error is not known. `targets`: peaks to
    find.
    """

    def __init__(
        self, moving: BodyInMotion, profile: Profile, error: _ErrorOfModel, confidence: float
    ) -> None:
        """Integrate the forces of a body in motion, with the error of the model, and find their intervals."""
        self.moving, self.profile, self.error, self.confidence = moving, profile, error, confidence
        self.best = moving.best(profile)
        if error.body_error is not None:
            # the mean error of a body that was measured before moves the best forces, too
            forces = {name: drawn[0] for name, drawn in self._best_as_draw.forces.items()}
            self.best = self.best._replace(forces=forces)
        self.has_forces = has_forces(self.best.forces)
        self.targets = moving.peak_targets(self.best.forces)
        self.alpha_draws: DrawStatistics | None = None
        self.model_draws: DrawStatistics | None = None
        self.alpha_ends: Ends = {}
        self.model_ends: Ends = {}
        self._find_intervals()

    def _find_intervals(self) -> None:
        """Set the intervals and statistics of draws, by one of three ways.

        Draws of alpha: one pass through them gives both intervals. One penetration test: alpha's interval is that of
        scaling, and draws of the model's error alone, about the best forces, widen it. No error of alpha: the model's
        error alone, if there is one.
        """
        spread = self.profile.spread
        if isinstance(spread, Profile):
            self.alpha_draws = self._statistics()
            drawn = self.moving.draw(spread, with_load=self.error.is_stated)
            self.model_draws = self._collect(map(self.error.add_mean, drawn), self.alpha_draws)
            self.alpha_ends = self.alpha_draws.ends
            self.model_ends = {} if self.model_draws is None else self.model_draws.ends
            return
        if isinstance(spread, ScaledMedium):
            self.alpha_ends = self._ends_of_further_medium(spread.at_confidence(self.confidence))
        if not self.error.is_stated:
            return
        self.model_draws = self._collect(self._split_best(), None)
        assert self.model_draws is not None
        self.model_ends = self.model_draws.ends
        if self.alpha_ends:
            # both errors are independent: the squares of their half widths add
            self.model_ends = {
                name: widen(best, self.alpha_ends[name], np.subtract(self.model_ends[name], best))
                for name, best in self.best.forces.items()
                if name in self.model_ends
            }
            # the peaks of these draws lack the error of alpha: a peak gets the interval of its pose
            self.model_draws = None

    def _statistics(self) -> DrawStatistics:
        """Return statistics without a draw."""
        return DrawStatistics(self.moving.with_interval, self.targets, self.confidence)

    def _collect(
        self, draws: Iterable[DrawnForces], alpha_draws: DrawStatistics | None
    ) -> DrawStatistics | None:
        """Add draws to the statistics `alpha_draws` (changed, if not None), and return those with the model's error.

        `draws`: those of some poses after those of others, block by block as the error comes. Returns None where no
        error of the model is known or asked for.
        """
        model_draws = self._statistics() if self.error.is_stated else None
        paths = self.error.paths()
        for drawn in draws:
            is_finite = self.has_forces[drawn.start : drawn.stop]
            if alpha_draws is not None:
                alpha_draws.add(drawn.forces, is_finite)
            if model_draws is not None:
                model_draws.add(self.error.add_draws(drawn, next(paths)), is_finite)
        return model_draws

    @cached_property
    def _best_as_draw(self) -> DrawnForces:
        """The best forces with their load, and with the mean error of a body that was measured before."""
        return self.error.add_mean(self.moving.best_with_load(self.profile))

    def _split_best(self) -> Iterator[DrawnForces]:
        """Split the best forces, as the only draw of alpha, into blocks of as many poses as the error is drawn for at once."""
        step = self.error.poses_at_once
        for start in range(0, len(self.moving.poses), step):
            yield self._best_as_draw.between(start, start + step)

    def _ends_of_further_medium(self, medium: ScaledMedium) -> Ends:
        """Return the intervals of the forces in one further medium, scaled from the reference media.

        The same forces by each reference medium, at zeta 1, show how far media differ: by their nine terms and by their
        tables. `medium`: one penetration test at the confidence of the intervals, whose own error comes in addition.
        """
        reference = medium.reference
        by_m0 = self.moving.best(FourierProfile(reference.m0)).forces
        by_tables = [self.moving.best(table).forces for table in reference.tables]
        drawn_blocks = [*self.moving.draw(FourierProfile(reference.scaled), with_load=False)]
        ends: Ends = {}
        for name in self.moving.with_interval:
            by_terms = np.concatenate([drawn.forces[name] for drawn in drawn_blocks], axis=-1)
            of_media, measured = medium.of_media(by_terms, [forces[name] for forces in by_tables])
            ends[name] = medium.with_interval(by_m0[name], of_media, measured=measured)[1:]
        return ends

    def table_and_peaks(self) -> tuple[pd.DataFrame, list[Peak]]:
        """Return the table of `predict`, with the columns that it names, and the peaks of `find_peaks`.

        Nine terms are compared with the table or map of the same medium (`forces_beside`): where that lies outside of
        the interval of alpha, this interval is left empty.
        """
        best, alpha_ends, model_ends = self.best.forces, self.alpha_ends, self.model_ends
        forces_beside: ForcesByName | None = None
        if self.profile.beside is not None:
            forces_beside = self.moving.best(self.profile.beside()).forces
            alpha_ends = keep_true_intervals(alpha_ends, forces_beside)
        # False for nine terms and others, whose interval of the next bed would then lack the model's error
        has_model_error = errors.has_model_error(self.profile)
        # a bed is looser or denser as a whole, independently of the error of the mean over beds
        bed_half_width = half_width_of_bed(self.profile.bed_spread, self.confidence)
        columns: dict[str, FloatArray] = dict(self.moving.columns)
        for name, force in best.items():
            columns[name] = force
            if forces_beside is not None:
                columns[beside_name(name)] = forces_beside[name]
            if name in alpha_ends:
                columns |= dict(zip(end_names(name), alpha_ends[name], strict=True))
            if name in model_ends:
                columns |= dict(zip(model_end_names(name), model_ends[name], strict=True))
            if name in model_ends or (name in alpha_ends and has_model_error):
                widest = model_ends.get(name) or alpha_ends[name]
                of_bed = widen(force, widest, bed_half_width * force)
                columns |= dict(zip(next_end_names(name), of_bed, strict=True))
        columns = self.moving.finish_columns(columns, self.profile, self.best)
        table = pd.DataFrame(columns | {"reason": np.where(self.has_forces, "", self.best.reason)})
        peaks = pick_peaks(
            best,
            self.targets,
            self.moving.positions,
            {} if self.has_forces.all() else self.moving.bounds(self.profile),
            alpha_draws=self.alpha_draws,
            model_draws=self.model_draws,
            alpha_ends=alpha_ends,
            model_ends=model_ends,
            bed_half_width=bed_half_width if model_ends or has_model_error else np.nan,
        )
        if forces_beside is not None:
            peaks = set_beside(peaks, self.targets, forces_beside)
        return table, [
            self.moving.finish_peak(peak, self.profile, self.best.forces, columns) for peak in peaks
        ]
