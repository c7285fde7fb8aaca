"""Flags, reasons and uses of rows: a code with its numbers, until a table is written or a line printed."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.tables import OTHER_SENSE
from rftfit.logs.base import FINITE
from rftfit.logs.text import CELLS, CUT, NUMBER

DUPLICATE = "duplicated row"
BACKWARDS = "time runs backwards"
REPEATED = "repeats the reading before (transducer slower than its logger)"

_ROW_CODES = {
    CUT: "cut-rows",
    CELLS: "wrong-cells",
    NUMBER: "not-numbers",
    FINITE: "not-finite",
    DUPLICATE: "duplicated-rows",
    BACKWARDS: "time-backwards",
    REPEATED: "repeated-rows",
}
"""Codes of the reasons for which a reader of logs leaves out rows."""


class Flag(NamedTuple):
    """What a flag says, how grave it is, and where it is said.

    `severity`: The larger, the graver; of a medium's flags the page names the gravest. `shared`: Whether the page
    says it once of a medium, always or where all of its runs have it, and not of each run and cell. `weak`: Whether
    `fit.flagged` of the configuration can leave out the cell.
    """

    sentence: str
    severity: int = 0
    shared: Literal["", "always", "if all runs have it"] = ""
    weak: bool = False


_LOST_ROWS = "{count} rows of {file}: {why}"
FLAGS = {
    # of a run
    "gives-back": Flag(
        "the medium gives energy back: look at transducer.axes, the direction and the angles of this run",
        severity=14,
    ),
    "stroke-saturated": Flag("transducer saturated in {count} samples of the stroke", severity=13),
    "motion-log-cut": Flag("the motion log begins or ends within the stroke", severity=12),
    "force-log-short": Flag("force log lacks {seconds:.2f} s of the stroke", severity=11),
    "cut-rows": Flag(_LOST_ROWS, severity=10),
    "gap": Flag("gap of {seconds:.2f} s in the force log during the stroke", severity=9),
    "gaps": Flag(
        "{count} gaps in the force log during the stroke, {seconds:.2f} s in all, the longest of {longest:.2f} s",
        severity=8,
    ),
    "time-backwards": Flag(_LOST_ROWS, severity=7),
    "not-finite": Flag(_LOST_ROWS, severity=6),
    "duplicated-rows": Flag(_LOST_ROWS, severity=5),
    "not-linear": Flag(
        "alpha_{component} not linear ({percent:+.0f} % at the end of the window)",
        severity=3,
        weak=True,
    ),
    "zero-drifted": Flag("zero drifted by {newtons:.2f} N", severity=1),
    "wrong-cells": Flag(_LOST_ROWS),
    "not-numbers": Flag(_LOST_ROWS),
    "repeated-rows": Flag(_LOST_ROWS),
    "damaged-rows": Flag(_LOST_ROWS),
    "readings-repeated": Flag(
        "{share:.0%} of the samples of the stroke repeat the reading before: the transducer is slower than "
        "its logger, and errors come out too small unless transducer.repeats is drop"
    ),
    "no-tare": Flag(
        "no tare subtracted: force on rod and mount is in it", shared="if all runs have it"
    ),
    "no-scatter": Flag(
        "stress lies exactly on a line through zero: no scatter is known, so alpha has no interval",
        shared="if all runs have it",
    ),
    "rows-other-sense": Flag(f"{{count}} rows are left out: {OTHER_SENSE}"),
    "no-force-x": Flag("the force along x was not measured", shared="always"),
    "several-plates": Flag("{plate}, one of {count} plates in this medium", shared="always"),
    "channel-still": Flag("channel {channel} does not move"),
    "channel-clipped": Flag("channel {channel} stops at {newtons:g} N"),
    "channel-silent": Flag("channel {channel} shows no force"),
    "channel-reversed": Flag("channel {channel} has the opposite sign of the expected force"),
    "channel-gain": Flag(
        "channel {channel} has {times:.2g} times the noise and force of other runs"
    ),
    "rod-stronger": Flag("the force on the rod alone is larger than on plate and rod"),
    "same-readings": Flag("same readings as {runs}"),
    "zero-drifts": Flag("the zero drifts at rest before the stroke"),
    "surface-differs": Flag("stress begins {gap:+.1f} mm off from that of the other runs"),
    "lag-differs": Flag("the force log is {gap:+.2f} s off from those of the other runs"),
    "apart": Flag("differs from the {beside} by {times:.1f} times the spread of such differences"),
    # of a cell
    "few-depths": Flag("{found} of {wanted} depths", severity=4, weak=True),
    "pooled-plates": Flag(
        "repeats are of different plates: {plates} (alpha may depend on the size)", severity=2
    ),
    # of a marker track
    "track-gaps": Flag("{gaps}, the longest {seconds:.3g} s"),
    "speed-changes": Flag("speed changes along the track from {first:.3g} to {last:.3g} cm/s"),
    "stride-doubled": Flag(
        "{name} moves at {bob:.3g} and {twice:.3g} Hz: if its two halves of a stride differ much, the stride "
        "frequency is {bob:.3g} and not {stride:.3g} Hz; frequency_Hz of the sheet decides"
    ),
}
"""Each flag in one row."""

_OUTSIDE = "outside the window: "
SENTENCES = {
    **{code: flag.sentence for code, flag in FLAGS.items()},
    # what is put right by itself
    "clock-hours": "clocks differ by {hours:+d} h (time zone or daylight saving), corrected",
    # why the logs of a run give no trace: units, clocks, surface, stroke, zero
    "no-overlap": "force and motion log do not overlap at any offset",
    "no-motion-in-depth": "the motion log shows no motion in depth ({rows} rows): nothing to match the force with",
    "force-not-depth": "at no lag does the force follow the depth: at best {percent:.0f} % of its variance is "
    "explained, {least:.0f} % needed. Do the two files belong to one run?",
    "clocks-uncertain": "the offset of the clocks is uncertain by {seconds:.3g} s (standard error); allowed: "
    "{most:g} s. A push that starts, stops or changes speed in the medium decides it",
    "two-offsets": "the force follows the depth about equally well at two offsets, {first:.2f} s and {second:.2f} "
    "s: the data cannot decide between them",
    "few-readings": "the force log has {found} readings; {wanted} are needed to match it with the motion",
    "no-rise": "the force never rises from its start by more than {newtons:.2f} N, with a noise of {noise:.2f} N: "
    "no contact that the motion could be matched with",
    "begins-in-push": "the force is largest at reading {found} already; {wanted} are needed before it: the log must "
    "begin before the push",
    "force-constant": "the force is the same at every depth: nothing to match",
    "nothing-to-match": "the arm moves in {force} whole stretches by the force log's sync line and in {motion} by "
    "the motion log: nothing to match. Is a log cut short?",
    "clocks-disagree": "force and motion log disagree by {seconds:.3f} s on when the arm moved; allowed: {most:g} "
    "s. Do the two files belong to one run?",
    "clocks-ambiguous": "two ways of matching force and motion log fit equally well: no motion differs in length",
    "few-near-surface": "surface not found: fewer than {below} readings within {window:g} cm below the depth at "
    "which the force begins, or {above} above it",
    "few-on-the-way-down": "surface not found: {found} readings on the way down",
    "no-ground": "surface not found: the force grows by {newtons:.2f} N on the way down, with a noise of "
    "{noise:.2f} N: the intruder met no ground, or the sign of z (factor) or of the force (transducer.axes) is "
    "turned",
    "not-in-air": "surface not found: the force grows from the first reading on; the log must begin in air",
    "no-growth": "surface not found: below {depth:.2f} cm the force does not grow at first",
    "faint-growth": "surface not found: below {depth:.2f} cm the force grows by {newtons:.2f} N within {window:g} "
    "cm; needed: {times:g} times its noise of {noise:.2f} N",
    "uncertain-growth": "surface not found: below {depth:.2f} cm the force grows by {growth:.1f} N/cm with a "
    "standard error of {se:.1f} N/cm; needed: {times:g} times its error",
    "grows-in-air": "surface not found: above {depth:.2f} cm the force grows too, by {above:.1f} N/cm against "
    "{below:.1f} N/cm below; the log must begin in air",
    "few-rigid": "{found} readings are too few; {wanted} at least",
    "no-contact": "the force rises by {newtons:.2f} N only, with a noise of {noise:g} N: no contact",
    "few-in-contact": "{found} readings in contact are too few; {wanted} at least",
    "short-zero-log": "the zero log has {found} readings; at least {wanted} are needed",
    "too-slow": "the arm never moved straight for {least:g} cm below the surface, at half of arm.speed_cm_per_s "
    "({stated:g} cm/s) or faster; its speed there was {fastest:.3g} cm/s at most",
    "several-strokes": "the log holds {count} strokes along this path, of {lengths} {unit}: say which one in the "
    "column stroke of the run sheet",
    "other-direction": "below the surface the arm moved along gamma = {seen} deg; the sheet's {direction} at gamma "
    "{gamma:g} is along {way:.1f} deg",
    "no-such-stroke": "the sheet asks for stroke {wanted}; the log holds {found}",
    "surface-not-crossed": "the path from {highest:+.2f} to {lowest:+.2f} cm does not cross the surface",
    "begins-below": "the arm log begins below the surface",
    "other-angle": "the arm log shows the plate at beta = {found:.1f} deg, the sheet says {stated:g}",
    "other-depth": "the arm log shows a depth of {found:.2f} cm, the sheet says {stated:g}",
    "no-rotation": "the leg turned by {seen} deg; a rotation turns it by {least:+g} deg or more in one stretch, "
    "from negative theta to positive",
    "no-force-in-stroke": "the force log has no sample during the stroke; do the two logs belong to one run?",
    "no-zero": "no zero: the intruder is never at rest in air for half a second; where the zero is known otherwise, "
    "name a zero_log in the run sheet, or state it under `zero` in the config",
    "no-push-to-match": "clock.method estimate: found a run in direction {direction} along gamma {gamma:g} deg; "
    "allowed: intrusion straight down, where the force grows with depth. Others need a sync line or one clock; a "
    "difference that is known is stated as offset of the column time, with clock.method same_clock",
    "no-sync-line": "the force log has no column arm_moving; clock.method sync_line needs it, allowed without: "
    "estimate, same_clock",
    "surface-not-stated": "surface.method find works for flat plates pushed down, which meet the surface all at "
    "once (beta within {most:g} deg of 0); this run needs surface_z_mm",
    "surface-uncertain": "surface not found well enough: its standard error is {se:.3g} cm; allowed: {most:g} cm",
    "other-unit": "{quantity} in {found}, but the config says {declared}",
    "unknown-unit": "{quantity} in {found}; allowed: {allowed}",
    "surface-not-reached": "surface not reached: the lowest point of the path is z = {lowest:+.4g} cm; a stroke goes down to "
    "{least:+g} cm at least",
    "upside-down": "surface not reached: the lowest point of the path is z = {lowest:+.2f} cm, where it begins; z "
    "points up (factor: -1 where the log counts downward)",
    # why a run has no trace, no tare or no alpha
    "excluded": "excluded: {why}",
    "unclaimed": "in-air run that no leg run names as its tare",
    "tare-missing": "no tare: {why}",
    "tare-not-named": "the run sheet names none",
    "tare-unusable": "{tare} cannot be used: {why}",
    "no-stroke": "it has no stroke",
    "tare-empty": "tare {tare}: {count} samples are no tare",
    "tare-short": "tare shorter than the run or with a gap: {count} samples of the window have no tare",
    "no-sample": "no sample of the stroke can be used: {why}",
    "window-saturated": "transducer saturated in {count} samples of the window",
    "few-points": "too few points: {found} in the window, {wanted} wanted",
    "zero-depths": "all depths are 0, where a stress has no slope through zero",
    "short-window": "window too short: it covers {found:.4g} cm of depth, {wanted:.4g} cm wanted ({least}): a slope "
    "cannot be distinguished from a constant stress",
    "most-samples": "{count} of {size} samples {why}",
    "most-beyond-wall": "{count} of {size} samples {why}: the path goes from x = {first:.1f} to {last:.1f} cm, allowed are "
    "{low:.1f} to {high:.1f} cm from the middle of the container, which arm.middle_x_mm gives",
    "no-alpha": "no alpha: {why}",
    # why a cell has no alpha
    "no-run": "no run",
    "too-few-depths": "only {found} of {wanted} depths",
    "outside-window": "{at:g} cm is outside of its window, {top:.1f} to {deep:.1f} cm (fit.depths_cm)",
    # why there is no fit, no zeta, no comparison
    "no-push": "no run at (0, 90) deg, a level plate straight down",
    "empty-cells": "{found} of {wanted} cells have no alpha; the transform needs all of them",
    "zero-push": "the fit has an alpha_z(0, 90 deg) of 0, by which nothing can be scaled",
    "published-media": "fewer than two laboratory media with a usable grid: scaled with the published five media",
    "no-curve": "a slope from a table: no curve of stress against depth",
    "no-tared-stroke": "it has no stroke, or its tare {tare} is of no use",
    "no-linear-regime": "no linear regime with enough samples",
    "no-linear-end": "no end of the linear regime was found: it is that of the test",
    "few-legs": "{found} of 3 legs: none can be left out",
    "not-measured": "no measured curve",
    "no-common-theta": "measured and predicted curve share no theta",
    "not-predicted": "the prediction has no number",
    "short-curve": "the measured curve has only theta {first:g} to {last:g} deg",
    "short-at-peak": "the measured curve has only theta {first:g} to {last:g} deg, which may leave out its peak",
    # why a robot's track, run or interval has no speed
    "no-number": "no number for {column}",
    "force-unknown": "a force is unknown in stride {stride}",
    "robot-lost": "{what}: {why}",
    "tipped": "pitch {pitch:.0f} degrees after stride {stride}",
    "buried": "the whole body is below the surface after stride {stride}",
    "few-strides": "too short: {strides} strides, at least 3 are needed",
    "irregular": "irregular strides",
    "thirds": "second and last third of {strides} strides: {second:.3g} and {last:.3g} cm/s",
    "no-speed": "the profile itself has no steady speed",
    "draws-lost": "{lost} of {draws} draws have no steady speed",
    "arc-lost": "with the arc of the legs off by its error there is no steady speed",
    "best-at-end": "the fastest curvature lies at the end of those that were tried",
    "speed-unmeasured": "not measured: {why}",
    "no-steady-run": "no steady run at {count} curvatures",
    "not-simulated": "this condition was not simulated",
    "speed-not-positive": "no share of a measured speed that is not positive",
    # what fails the checks of a medium
    "unusable": "unusable: {faults} (results/checks)",
    "doubtful": "doubtful: {faults} (results/checks)",
    "accepted": "accepted: {fault}: {why}",
    # what rows were used for
    **{
        code: code.replace("-", " ")
        for code in ("slope", "leg-curve", "tare", "mean-speed", "path")
    },
    "zero": "zero of the transducer",
    # why a row is not used: names of `rftfit.measure.ledger.RowStatus`
    "motion-gap": "gap in the motion log",
    "no-motion": "outside the motion log",
    "saturated": "transducer saturated",
    "untared": "outside the tare's range",
    "approach": "approach",
    "pause": "pause at the surface",
    "elsewhere": "before or after the stroke",
    "above": f"{_OUTSIDE}plate not wholly submerged",
    "bottom": f"{_OUTSIDE}too near the bottom",
    "wall": f"{_OUTSIDE}too near a wall",
    "startup": f"{_OUTSIDE}start of the stroke, force still building up",
    "nonlinear": f"{_OUTSIDE}beyond the linear regime",
    "yielded": "force beyond that of the push against something rigid: depth not known",
    "too-deep": f"{_OUTSIDE}deeper than fit.max_depth_cm of the config",
    "other-sense": OTHER_SENSE,
    "too-shallow": f"{_OUTSIDE}above fit.submergence_cm of the config",
}
"""The one sentence of each code; readers of logs and tracks raise errors with code and sentence of their own."""


@dataclass(frozen=True)
class Remark:
    """A flag, a reason, a use of rows or a mark of a medium.

    `values`: numbers, words and further remarks that the sentence names. `run_id`: the run that a remark on
    several is about; `cell`: beta and gamma, deg, of the cell that a flag is about. `words`: the sentence, where
    it was made elsewhere, as that of an error or of a table.
    """

    code: str
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)
    run_id: str = ""
    words: str = ""
    cell: tuple[float, float] | None = None

    def __str__(self) -> str:
        """The sentence, without the run that it is about."""
        return self.words or SENTENCES[self.code].format(**self.values)

    @property
    def codes(self) -> tuple[str, ...]:
        """Its code, then those of the remarks that it names."""
        inner = (one for one in self.values.values() if isinstance(one, Remark))
        return (*self.code.split(), *(code for one in inner for code in one.codes))


class Refused(ValueError):
    """A run, a stroke or a tare that cannot be used; the text is the reason in ledger, table and report."""

    def __init__(self, code: str, **values: Any) -> None:
        self.remark = remark(code, **values)
        super().__init__(str(self.remark))


def remark(
    code: str, cell: tuple[float, float] | None = None, /, run_id: str = "", **values: Any
) -> Remark:
    """Make a remark; its numbers are kept as a table keeps them."""
    if code not in SENTENCES:
        raise KeyError(code)
    kept = {name: _plain(value) for name, value in values.items()}
    return Remark(code, kept, run_id, cell=cell)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    return float(f"{value:.6g}") if isinstance(value, float) else value


def quoted(error: Exception, code: str = "refused") -> Remark:
    """The remark of an error, by its code if it has one."""
    if isinstance(error, Refused):
        return error.remark
    return Remark(getattr(error, "code", code).replace("_", "-"), words=str(error))


def dropped_rows(reason: str) -> Remark:
    """The remark of a reason for which a reader of logs leaves out rows."""
    return Remark(_ROW_CODES.get(reason, "damaged-rows"), words=reason)


def say(remarks: Iterable[Remark]) -> str:
    """Say some remarks; those on one run stand together behind its name."""
    parts: list[str] = []
    for run, group in groupby(remarks, key=lambda one: one.run_id):
        sentences = [str(one) for one in group]
        parts += [f"{run}: {', '.join(sentences)}"] if run else sentences
    return "; ".join(parts)


def codes_of(remarks: Iterable[Remark]) -> str:
    """The codes of some remarks as a table has them, each once."""
    return " ".join(dict.fromkeys(code for one in remarks for code in one.codes))


def about(run_id: str, remarks: Iterable[Remark]) -> list[Remark]:
    """Say of some remarks which run they are about."""
    return [replace(one, run_id=run_id) for one in remarks]


# --- Remarks in tables: words to be read, codes to decide by.


REASON = ("reason", "reason_code")
MARKS = ("checks", "checks_code")


def reason_cells(reasons: Collection[Remark]) -> tuple[str, str]:
    """Cells of a reason, or of the marks of a medium: words and codes."""
    return say(reasons), codes_of(reasons)


def reason_columns(reasons: Collection[Remark]) -> dict[str, str]:
    """Columns of a reason."""
    return dict(zip(REASON, reason_cells(reasons), strict=True))


def mark_columns(marks: Collection[Remark] = ()) -> dict[str, str]:
    """Columns of the marks of a medium."""
    return dict(zip(MARKS, reason_cells(marks), strict=True))


def reason_of(row: Mapping[Any, Any]) -> tuple[Remark, ...]:
    """Read the reason of a row of a table, as words."""
    words = row.get("reason")
    if not (words and isinstance(words, str)):
        return ()
    return (Remark(str(row.get("reason_code", "")), words=words),)


def with_reasons(table: pd.DataFrame, added: Iterable[Iterable[Remark]]) -> pd.DataFrame:
    """Add remarks to the reason of each row of a table."""
    stated = table[[name for name in REASON if name in table]].to_dict("records")
    rows = zip(stated, added, strict=True)
    reasons = [reason_columns([*reason_of(row), *more]) for row, more in rows]
    return table.assign(**{name: [one[name] for one in reasons] for name in REASON})


def has(row: Mapping[Any, Any], code: str, name: str = "reason_code") -> bool:
    """Whether the codes in a row of a table name this one."""
    return code in str(row.get(name, "")).split()


# --- Flags: a table of their own, a row each, to which the stages append.


FLAG_COLUMNS = ["medium", "run_id", "beta_deg", "gamma_deg", "stage", "code", "values", "words"]
OF_CHECKS = "checks"
"""Stage whose flags come from beside other runs; those of earlier stages come from a run's own logs."""


def flag_table(medium: str, stage: str, flags: Iterable[Remark]) -> pd.DataFrame:
    """Table of flags of one stage, each once: columns `FLAG_COLUMNS`."""
    rows = [
        (
            medium,
            flag.run_id,
            *(flag.cell or (np.nan, np.nan)),
            stage,
            flag.code,
            json.dumps(dict(flag.values)),
            str(flag),
        )
        for flag in dict.fromkeys(flags)
    ]
    return pd.DataFrame(rows, columns=FLAG_COLUMNS)


class Flags:
    """Flags of the runs and cells of one medium.

    Parameters
    ----------
    tables : DataFrame
        Of `flag_table`, in the order of the stages.
    """

    def __init__(self, *tables: pd.DataFrame) -> None:
        self._of_runs: dict[str, list[Remark]] = {}
        self._of_checks: dict[str, list[Remark]] = {}
        self._of_cells: dict[tuple[float, float], list[Remark]] = {}
        for row in (row for table in tables for row in table.to_dict("records")):
            flag = Remark(row["code"], json.loads(row["values"]))
            if row["run_id"]:
                of_stage = self._of_checks if row["stage"] == OF_CHECKS else self._of_runs
                of_stage.setdefault(str(row["run_id"]), []).append(flag)
            else:
                cell = float(row["beta_deg"]), float(row["gamma_deg"])
                self._of_cells.setdefault(cell, []).append(flag)

    def of_run(self, run_id: str) -> list[Remark]:
        """Flags of a run by its own logs."""
        return self._of_runs.get(run_id, [])

    def of_cell(self, cell: Mapping[Any, Any], without: Collection[Remark] = ()) -> list[Remark]:
        """Flags of the runs of a cell of an alpha table, then its own; flags `without` are said elsewhere."""
        runs = [*cell["run_ids"].split(), *cell["lost_run_ids"].split()]
        flags: list[Remark] = []
        for run_id in sorted(runs):
            of_run = [flag for flag in self.of_run(run_id) if flag not in without]
            flags += about(run_id, of_run)
        for run_id in cell["run_ids"].split():
            flags += about(run_id, self._of_checks.get(run_id, []))
        return flags + self.of_cell_alone(cell)

    def of_cell_alone(self, cell: Mapping[Any, Any]) -> list[Remark]:
        """Flags of a cell that are about none of its runs."""
        return self._of_cells.get((float(cell["beta_deg"]), float(cell["gamma_deg"])), [])

    def runs_with(self, code: str) -> dict[str, Remark]:
        """Runs that have a flag by their own logs, each with it, in the order of the table."""
        return {
            run_id: flag
            for run_id, flags in self._of_runs.items()
            for flag in flags
            if flag.code == code
        }

    def shared(self, fits: pd.DataFrame) -> tuple[Remark, ...]:
        """Flags that come from how a medium was measured, to be said once; `fits`: its plate runs."""
        rows = zip(map(str, fits["run_id"]), fits["reason"], strict=True)
        # a run that was never read has no flag of this sort
        of_runs = [
            self.of_run(run_id) for run_id, reason in rows if self.of_run(run_id) or not reason
        ]
        every = dict.fromkeys(flag for flags in of_runs for flag in flags)
        return tuple(
            flag
            for flag in every
            if (rule := FLAGS[flag.code].shared) == "always"
            or (rule and all(flag in flags for flags in of_runs))
        )


def describe_shared(shared: Collection[Remark]) -> list[str]:
    """Say what `Flags.shared` holds, for all runs together."""
    sentences = [
        f"all runs: {flag}" for flag in shared if FLAGS[flag.code].shared == "if all runs have it"
    ]
    sentences += [str(flag) for flag in shared if flag.code == "no-force-x"]
    plates = [flag.values["plate"] for flag in shared if flag.code == "several-plates"]
    return sentences + ([f"runs with {len(plates)} plates: {', '.join(plates)}"] if plates else [])
