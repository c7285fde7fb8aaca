"""Checks of an alpha table alone: the medium takes energy, mirror images agree, down is harder than up.

A *cell* is a row of the alpha table, a direction (beta, gamma). alpha is in N/cm^3, z up and x forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.checks.axes import axes_are_stated_in, find_likelier_axes
from rftfit.checks.declared import (
    SOUND_ALPHA,
    SOUND_LOGS,
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    describe_rows,
    flags_on,
)
from rftfit.conventions import FloatArray
from rftfit.directions import is_straight_down
from rftfit.measure.alpha import alpha_columns, column, rows_at
from rftfit.measure.fits import LEAST_WORK
from rftfit.measure.flags import remark
from rftfit.measure.lab_frame import measured_channel
from rftfit.measure.slopes import normal_quantile
from rftfit.measure.verdict_words import DOUBTFUL, UNUSABLE
from rftfit.store.chosen import chosen

_CHOSEN = chosen("checks", "cells")


_WORK_FOUND = "{negative}; the worst has D = {worst:.3g} N/cm^3, which must exceed {noise:.3g}"


@declare_check(
    "work",
    title="energy",
    effect=UNUSABLE,
    good="the medium takes energy",
    fault="the medium seems to give energy to the plates",
    after=SOUND_LOGS,
    outcomes={
        "work": Sentences(
            _WORK_FOUND,
            "{allowed}",
            "the signs of forces or motion are wrong in some runs ({negative}: {rows}): look at the direction, the angles "
            "and the logs of these runs, then at {where}.",
        ),
        "work-axes": Sentences(
            _WORK_FOUND,
            "{allowed}",
            "axes or signs look wrong in all runs: alpha fits with {axes} ({negative}): look at {where}.",
        ),
        "work-no-cell": Sentences("no cell has alpha"),
    },
)
def check_work(measured: MediumMeasurements) -> Check:
    """Check that the medium takes energy in all cells but a few: its force acts against the motion.

    Exchanged channels, wrong signs and exchanged runs break this. If the runs together show that other axes are right,
    the message names these axes instead of single runs.
    """
    alpha = measured.tables["alpha"]
    cells = Cells.of(alpha, measured.tolerance_deg)
    if not cells.gamma.size:
        return Check.skip("work", "work-no-cell")
    worst = int((cells.work / cells.work_noise).argmin())
    # code of the sentence on what is allowed, by the limits that this table has
    limit = "few-cells" if cells.fewest_negative > 1 else "no-cell"
    if cells.most_clear < cells.fewest_negative - 1:
        limit = "few-clear"
    n_negative = int(cells.gives_energy.sum())
    values: dict[str, Any] = {
        "negative": remark("negative-work", count=n_negative, size=cells.gamma.size),
        "worst": cells.work[worst],
        "noise": -cells.work_noise[worst],
        "allowed": remark(
            f"{limit}-no-push" if cells.push is not None else limit,
            count=cells.fewest_negative - 1,
            clear=cells.most_clear,
        ),
        "where": axes_are_stated_in(measured),
    }
    if likelier_axes := find_likelier_axes(measured):
        # other axes concern all runs, so no single run is flagged
        values |= {"axes": likelier_axes.mistake, "where": likelier_axes.stated_in}
        return Check.judge("work", cells.takes_energy, code="work-axes", **values)
    runs = " ".join(alpha["run_ids"].iloc[cells.rows[cells.gives_energy]]).split()
    flags = flags_on(runs, "gives-back")
    rows = describe_rows(runs, measured.sheet)
    return Check.judge("work", cells.takes_energy, flags, rows=rows, **values)


_SYMMETRY_FOUND = "the mount looks turned by {turn_deg:+.1f} deg{interval} beyond what is stated"
_SYMMETRY_ALLOWED = "{most_deg:.1f} deg of either sign, and pairs at most {most_errors:g} times their error off from one turn"
_SYMMETRY_CAUSE = "on plates on vertical paths a horizontal force acts to one side ({found}): look "


@declare_check(
    "symmetry",
    title="mirror images",
    effect=UNUSABLE,
    good="plates on vertical paths are not pushed to one side",
    fault="plates on vertical paths are pushed to one side",
    after=SOUND_ALPHA,
    outcomes={
        "symmetry": Sentences(
            _SYMMETRY_FOUND,
            _SYMMETRY_ALLOWED,
            f"{_SYMMETRY_CAUSE}at transducer.turn_deg and transducer.axes, and for a bent plate or a slanted bed.",
        ),
        "symmetry-pair": Sentences(
            f"{_SYMMETRY_FOUND}; (\N{PLUS-MINUS SIGN}{{size_deg:g}}, {{gamma_deg:g}}) deg are off from that by "
            "{errors:.1f} times their error",
            _SYMMETRY_ALLOWED,
            f"{_SYMMETRY_CAUSE}at the sign of beta_deg in the runs at ({{beta_deg:g}}, {{gamma_deg:g}}) and "
            "({image_deg:g}, {gamma_deg:g}) deg.",
        ),
        "symmetry-no-x": Sentences("the force along x was not measured"),
        "symmetry-no-cell": Sentences("no alpha at (0, 90) deg, and no mirror images"),
    },
)
def check_symmetry(measured: MediumMeasurements) -> Check:
    """Check that opposite horizontal forces act on plates that are mirror images, on vertical paths.

    A turn of the mount beyond the stated one adds the same share of alpha_z to alpha_x in all of them; a wrong sign of
    beta makes a single pair deviate from the others.
    """
    if measured.flags.runs_with("no-force-x") or measured_channel(measured.config, "x") is None:
        return Check.skip("symmetry", "symmetry-no-x")
    cells = Cells.of(measured.tables["alpha"], measured.tolerance_deg)
    turn, se = cells.turn_rad
    if math.isnan(turn):
        return Check.skip("symmetry", "symmetry-no-cell")
    # largest turn, rad, that passes
    most = _CHOSEN.turn + _CHOSEN.sigmas * se
    turn_deg = math.degrees(turn)
    half_deg = normal_quantile(measured.config.fit.confidence) * math.degrees(se)
    values: dict[str, Any] = {
        "turn_deg": turn_deg,
        "interval": remark("interval-deg", low=turn_deg - half_deg, high=turn_deg + half_deg)
        if se
        else "",
        "most_deg": math.degrees(most),
        "most_errors": _CHOSEN.unlike,
    }
    misfit, worst = cells.mirror_misfit
    if misfit <= _CHOSEN.unlike:
        return Check.judge("symmetry", abs(turn) <= most, **values)
    row = measured.tables["alpha"].iloc[cells.rows[worst]]
    beta, gamma = row["beta_deg"], row["gamma_deg"]
    values |= {"beta_deg": beta, "image_deg": -beta, "size_deg": abs(beta), "gamma_deg": gamma}
    return Check.judge("symmetry", False, code="symmetry-pair", errors=misfit, **values)


@declare_check(
    "up_down",
    title="up against down",
    effect=DOUBTFUL,
    good="down is harder than up",
    fault="up is harder than down for a level plate",
    after=SOUND_ALPHA,
    outcomes={
        "up_down": Sentences(
            "alpha_z(0, 90) = {down:.3g}, alpha_z(0, -90) = {up:.3g} N/cm^3",
            "alpha_z(0, 90) above the size of alpha_z(0, -90)",
            "pulling a level plate up takes more than pushing it down ({found}): look whether intrusions and extractions "
            "are exchanged in the run sheet.",
        ),
        "up_down-no-cell": Sentences("no alpha at {cells} deg"),
    },
)
def check_up_down(measured: MediumMeasurements) -> Check:
    """Check that pushing a level plate down takes more force than pulling it up; else the runs may be exchanged."""
    cells = Cells.of(measured.tables["alpha"], measured.tolerance_deg)
    push, pull = cells.push, cells.pull
    if push is None or pull is None:
        rows = {"(0, 90)": push, "(0, -90)": pull}
        names = " and ".join(name for name, row in rows.items() if row is None)
        return Check.skip("up_down", "up_down-no-cell", cells=names)
    down, up = cells.alpha[0, [push, pull]]
    error = math.hypot(*cells.se[0, [push, pull]])
    is_harder_down = bool(abs(up) - down <= _CHOSEN.sigmas * error)
    return Check.judge("up_down", is_harder_down, down=down, up=up)


@dataclass(frozen=True)
class Cells:
    """The n cells of an alpha table that have alpha in both components, and their energy and mirror images.

    `rows`: Row of each cell in the table, shape (n,).
    `gamma`: Intrusion angle, rad, shape (n,).
    `alpha`, `se`: Alpha and its standard error, z and x, N/cm^3, shape (2, n).
    `se_of_turn`: Part of the error of alpha_x by an unknown turn of the mount, N/cm^3, shape (n,).
    `push`, `pull`: Indices, among the n, of the cells (0, 90) and (0, -90) deg; None where they have no alpha.
    `pairs`: Indices of cells on vertical paths that are mirror images of each other, or of themselves, shape (2, k).
        Level and upright plates are their own images.
    """

    rows: npt.NDArray[np.intp]
    gamma: FloatArray
    alpha: FloatArray
    se: FloatArray
    se_of_turn: FloatArray
    push: int | None
    pull: int | None
    pairs: npt.NDArray[np.intp]

    @classmethod
    def of(cls, alpha_table: pd.DataFrame, tolerance_deg: float) -> Cells:
        """Select the cells of an alpha table that have alpha; `tolerance_deg`: `MediumMeasurements.tolerance_deg`."""
        rows = np.flatnonzero(np.isfinite(alpha_columns(alpha_table)).all(axis=0))
        table = alpha_table.iloc[rows].reset_index(drop=True)
        beta_deg, gamma_deg = (table[f"{name}_deg"].to_numpy(float) for name in ("beta", "gamma"))
        ends = rows_at(table, 0, [90, -90], tolerance_deg)
        push, pull = (int(row) if row >= 0 else None for row in ends)
        # row of the cell with the opposite beta, its mirror image on a vertical path; -1 if there is none
        image = rows_at(table, -beta_deg, gamma_deg, tolerance_deg)
        is_vertical = is_straight_down(0.0, np.abs(gamma_deg), tolerance_deg)
        # each pair once
        first_cells = np.flatnonzero((image >= np.arange(image.size)) & is_vertical)
        return cls(
            rows,
            np.radians(gamma_deg),
            np.stack(alpha_columns(table)),
            np.nan_to_num(alpha_columns(table, "_se")),
            np.nan_to_num(table[column("x", "_turn")].to_numpy(float)),
            push,
            pull,
            np.stack([first_cells, image[first_cells]]),
        )

    @cached_property
    def work(self) -> FloatArray:
        """Energy that the medium takes, D = alpha_z sin gamma + alpha_x cos gamma, N/cm^3, shape (n,).

        For each cm of path, cm^2 of plate and cm of depth. The motion has the direction (-cos gamma, -sin gamma), x and
        z, so D is the part of alpha against it.
        """
        return np.asarray(np.sum(self._directions * self.alpha, axis=0))

    @cached_property
    def work_noise(self) -> FloatArray:
        """Distance of `work` below 0 that noise may cause, N/cm^3, positive, shape (n,); less for the push down."""
        se = np.sqrt(np.sum((self._directions * self.se) ** 2, axis=0))
        sigmas = np.full(se.shape, _CHOSEN.sigmas)
        if self.push is not None:
            sigmas[self.push] = _CHOSEN.sigmas_of_push
        return np.asarray(np.maximum(LEAST_WORK, sigmas * se))

    @property
    def _directions(self) -> FloatArray:
        """Share of alpha_z and of alpha_x that acts against the motion, shape (2, n)."""
        return np.stack([np.sin(self.gamma), np.cos(self.gamma)])

    @property
    def gives_energy(self) -> npt.NDArray[np.bool_]:
        """True for cells in which the medium gives energy back, more than noise may cause; shape (n,)."""
        return self.work < -self.work_noise

    @property
    def takes_energy(self) -> bool:
        """True if few cells give energy back, even fewer do so clearly, and the level push down is none of them.

        Noise and single wrong runs explain a few cells, wrong axes or signs change many; no medium pulls a plate down.
        """
        n_clear = int(np.count_nonzero(self.work < -_CHOSEN.clear * self.work_noise))
        return (
            int(self.gives_energy.sum()) < self.fewest_negative
            and n_clear <= self.most_clear
            and not (self.push is not None and self.gives_energy[self.push])
        )

    @property
    def fewest_negative(self) -> int:
        """Number of cells that give energy back from which on this is no accident."""
        return int(min(_CHOSEN.fewest_cells, self.gamma.size))

    @property
    def most_clear(self) -> int:
        """Largest number of cells that may clearly give energy back; in a small table only one may."""
        return int(max(1, self.gamma.size // _CHOSEN.cells_of_one_mistake))

    @cached_property
    def _mirror_sums(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Sums of alpha_z and of alpha_x over each pair, N/cm^3, and the variance of the latter, each of shape (k,).

        alpha_x of mirror images is opposite, so without a turn of the mount its sum is 0. The error by an unknown turn
        is left out of the variance, as the turn is what is looked for. Alpha_z of pulls has the other sign, as
        `file_extraction` turned that of alpha_x: a turn of the mount then changes alpha_x by the same share of alpha_z
        in pushes and in pulls.
        """
        cell, image = self.pairs
        z, x = self.alpha * [np.where(self.gamma < 0, -1.0, 1.0), np.ones_like(self.gamma)]
        variance = np.maximum(self.se[1] ** 2 - self.se_of_turn**2, 0)
        # a cell that is its own image is added to itself: twice the error, four times the variance
        variance_of_sum = np.where(
            cell == image, 4 * variance[cell], variance[cell] + variance[image]
        )
        return z[cell] + z[image], x[cell] + x[image], variance_of_sum

    @property
    def turn_rad(self) -> tuple[float, float]:
        """Turn of the mount beyond the stated one and its standard error, rad; both NaN if not measured.

        Horizontal forces on mirror images are opposite, so their sum, relative to that of the vertical forces, shows
        the turn: the slope of x over z through zero, with weights by the error and what beds differ by.
        """
        z, x, variance = self._mirror_sums
        weight = z / np.maximum(variance + (_CHOSEN.alike * np.abs(z).max(initial=0)) ** 2, 1e-12)
        size = float(weight @ z)
        if not size > 0:
            return math.nan, math.nan
        return -math.atan2(float(weight @ x), size), math.sqrt(float(weight**2 @ variance)) / size

    @property
    def mirror_misfit(self) -> tuple[float, int]:
        """Largest deviation of a pair from the common turn of the mount, in standard errors, and its first cell, of n.

        Both are 0 where no turn was measured.
        """
        z, x, variance = self._mirror_sums
        if not z.size or math.isnan(turn := self.turn_rad[0]):
            return 0.0, 0
        of_beds = _CHOSEN.alike * np.abs(z).max()
        misfit = np.abs(x + math.tan(turn) * z) / np.sqrt(np.maximum(variance + of_beds**2, 1e-12))
        return float(misfit.max()), int(self.pairs[0, misfit.argmax()])
