"""Sentences about data, in tables by code: of flags, of reasons and uses of rows, of marks of a medium.

Words in braces are filled in from the values of a `Remark` (`rftfit.measure.flags`); one of them may be a remark
itself, whose sentence then stands there. `FLAGS` are doubts, `SENTENCES` all of them.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

from rftfit.campaign.formats import OTHER_SENSE


class Flag(NamedTuple):
    """Sentence of a flag, and how the page and the config treat it.

    `sentence`: Its sentence, with the names of values in braces.
    `severity`: Larger for graver flags; the page names the gravest flag of a medium.
    `shared`: If not empty, the page states the flag once for a medium instead of for each run and cell: always, or only
    where all runs have it.
    `weak`: True if `fit.flagged` of the configuration may leave out a cell with this flag.
    """

    sentence: str
    severity: int = 0
    shared: Literal["", "always", "if all runs have it"] = ""
    weak: bool = False


# of a sort of rows that are left out: what they are, `why`, is a word of `rftfit.measure.flags`
_LOST_ROWS = "{count} rows of {file}: {why}"
_LOST_STRETCHES = "{count} rows of {file}, {when}: {why}"
FLAGS = {
    # of a run
    "gives-back": Flag(
        "the medium would push the plate along: check the signs in transducer.axes, the direction and the angles of this run",
        severity=17,
    ),
    "stroke-saturated": Flag("transducer saturated in {count} samples of the stroke", severity=16),
    "motion-log-cut": Flag("the motion log begins or ends within the stroke", severity=15),
    "force-log-short": Flag("force log lacks {seconds:.2f} s of the stroke", severity=13),
    "cut-rows": Flag(_LOST_ROWS, severity=12),
    "gap": Flag("gap of {seconds:.2f} s in the force log during the stroke", severity=11),
    "gaps": Flag(
        "{count} gaps in the force log during the stroke, {seconds:.2f} s in all, the longest of {longest:.2f} s",
        severity=10,
    ),
    "time-backwards": Flag(_LOST_ROWS, severity=9),
    "not-finite": Flag(_LOST_ROWS, severity=8),
    "duplicated-rows": Flag(_LOST_ROWS, severity=7),
    "not-linear": Flag(
        "alpha_{component} not linear ({percent:+.0f} % at the end of the window)",
        severity=4,
        weak=True,
    ),
    "pull-not-linear": Flag(
        "alpha_{component} of this pull not linear ({percent:+.0f} % at the end of the window): if the force builds up over more "
        "way than fit.extraction_skip_cm leaves out, {skip:g} cm, make that longer",
        severity=5,
        weak=True,
    ),
    "crust": Flag(
        "stress peaks at {depth:.1f} cm, {percent:.0f} % above the line through the deeper part, and falls: a crust"
    ),
    "zero-drifted": Flag("zero drifted by {newtons:.2f} N", severity=1),
    "zero-log-old": Flag(
        "the zero log {file} is of {logged}, the stroke of {pushed}: {minutes:.0f} min between them, where zero.log_age_min allows "
        "{most:g}; the interval holds the drift of that time",
        severity=2,
    ),
    "zero-log-moves": Flag(
        "the force in the zero log {file} moves by {newtons:.2g} N, {times:.0f} times its noise: is a push in it?",
        severity=14,
    ),
    "lone-readings": Flag(_LOST_ROWS),
    "readings-away": Flag(_LOST_STRETCHES),
    "held-readings": Flag(_LOST_STRETCHES),
    "force-steps": Flag(
        "the force on {channel} steps by {newtons:+.3g} N from one reading to the next at {when}, and stays there: look at "
        "amplifier and cable, or was tare pressed? In a bed a crust may have broken"
    ),
    "zero-steps": Flag(
        "the zero of {channel} steps by {newtons:+.3g} N at {when}, in air, as when tare is pressed: {count} rows {side} are "
        "no zero of the stroke"
    ),
    "end-of-amplifier": Flag(
        "{channel} stops growing at once at {newtons:.4g} N, below its range, while the arm goes on: {count} samples from "
        "{when} on are at the end of amplifier or logger"
    ),
    "no-data": Flag(_LOST_ROWS),
    "other-source": Flag(_LOST_ROWS),
    "clock-set-back": Flag(
        "the clock of {file} is set back by whole hours at {when}, as at the end of summer: they are added to the rows below"
    ),
    "stamps-of-arrival": Flag(
        "the rows of {file} are stamped on arrival, several at once: their times are spread evenly over each packet"
    ),
    "held-positions": Flag(_LOST_ROWS),
    "clock-by-itself": Flag(
        "the offset of the clocks is that of this push alone, since the pushes of {session} contradict one offset and "
        "drift: {pushes}; label the runs before and after a clock was set in the column session of the run sheet",
        shared="always",
    ),
    "position-in-steps": Flag(
        "the position changes every {rows} rows, by {step_mm:.2g} mm: a coarse sensor, or a position that is read seldom and "
        "held; which of them it is moves the depth by {off_mm:.2g} mm, and the interval holds both"
    ),
    "wrong-cells": Flag(_LOST_ROWS),
    "not-numbers": Flag(_LOST_ROWS),
    "blank-cells": Flag(_LOST_ROWS),
    "repeated-rows": Flag(_LOST_ROWS),
    "averaged-rows": Flag(_LOST_ROWS),
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
    "rows-alone": Flag(
        "{count} rows are left out: their depth or stress stands alone, far from that of the rows before and after them"
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
    "other-row": Flag("the angles of a row nearby fit the logs better than those of their own"),
    "other-axes": Flag("fits the shape of known media with {axes}"),
    "rod-stronger": Flag("the force on the rod alone is larger than on plate and rod"),
    "same-readings": Flag("same readings as {runs}"),
    "zero-drifts": Flag("the zero drifts at rest before the stroke"),
    "zero-changes": Flag("the zero after the stroke is another than that before it"),
    "surface-differs": Flag("stress begins {gap:+.1f} mm off from that of the other runs"),
    "lag-differs": Flag("the force log is {gap:+.2f} s off from those of the other runs"),
    "apart": Flag("differs from the {beside} by {times:.1f} times the spread of such differences"),
    "shared-cause": Flag("shares with other runs: {cause}", severity=18),
    # of a cell
    "few-depths": Flag("{found} of {wanted} depths", severity=6, weak=True),
    "pooled-plates": Flag(
        "repeats are of different plates: {plates} (alpha may depend on the size)", severity=3
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
    "force-falls": "the force falls by {newtons:.2f} N from its start and never rises, where a medium pushes a plate up: is "
    "the axis z of the transducer turned (transducer.axes)?",
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
    "short-zero-log": "the zero log has {found} readings; at least {wanted} are needed: log some seconds without load, or state under `zero` in "
    "the config what the channels read without load",
    "too-slow": "the arm never moved straight for {least:g} cm below the surface, at half of arm.speed_cm_per_s "
    "({stated:g} cm/s) or faster; its speed there was {fastest:.3g} cm/s at most",
    "noisy-position": "the position has {noise_mm:.2g} mm of noise, which hides a way back of {hidden:.2g} cm: the strokes "
    "cannot be told apart (allowed: {most:g} cm). Log the position more often, or average it",
    "several-strokes": "the log holds {count} strokes along this path, of {lengths} {unit}: say which one in the "
    "column stroke of the run sheet{cure}",
    "other-direction": "below the surface the arm moved along gamma = {seen} deg; the sheet's {direction} at gamma "
    "{gamma:g} is along {way:.1f} deg; allowed: {tolerance:g} deg of difference (arm.angle_tolerance_deg){cure}",
    "no-such-stroke": "the sheet asks for stroke {wanted}; the log holds {found}",
    "surface-not-crossed": "the path from {highest:+.2f} to {lowest:+.2f} cm does not cross the surface",
    "begins-below": "the arm log begins below the surface",
    "other-angle": "the arm log shows the plate at beta = {found:.1f} deg, the sheet says {stated:g}; allowed: {tolerance:g} deg of "
    "difference (arm.angle_tolerance_deg)",
    "other-depth": "the arm log shows a depth of {found:.2f} cm, the sheet says {stated:g}",
    "no-rotation": "the leg turned by {seen} deg; a rotation turns it by {least:+g} deg or more in one stretch, "
    "from negative theta to positive",
    "no-force-in-stroke": "the force log has no sample during the stroke; do the two logs belong to one run?",
    "no-zero": "no zero: the intruder is never at rest in air for half a second, its reference point at least "
    "{least:.1f} cm above the surface (half its height and fit.air_clearance_cm); begin the run higher; where the "
    "zero is known otherwise, name a zero_log in the run sheet (zero.log_age_min in the config: how old it may be), or "
    "state the zero under `zero` in the config",
    "no-push-to-match": "clock.method estimate: found a run in direction {direction} along gamma {gamma:g} deg; "
    "allowed: intrusion straight down, where the force grows with depth. Others need a sync line or one clock; a "
    "difference that is known is stated as offset of the column time, with clock.method same_clock",
    # clocks of a session
    "no-push-aligned": "clock.method estimate: no push straight down shows how the clocks of {session} lie{why}; "
    "needed: one at least in each session (column session of the run sheet) whose force rises clearly from the air "
    "on, or an offset that is known, as offset of the column time with clock.method same_clock",
    "session-uncertain": "the clocks of {session} differ by {offset:+.3f} s, with a standard error of {seconds:.3g} s "
    "at the time of this run; allowed: {most:g} s (clock.max_se_s). Found from the pushes straight down "
    "that show it, {pushes}: more of them, before and after this run, or a smaller clock.max_drift",
    "clocks-contradict": "the pushes straight down of {session} contradict one offset and drift of the clocks: "
    "{pushes}; allowed for a run that cannot show its own offset: one clock a session. If a clock was set or started "
    "anew, label the runs before and after in the column session of the run sheet; if each log counts its time from "
    "0, record time of day",
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
    "no-linear-regime": "no linear regime: the upper {depth_cm:g} cm have fewer than {wanted} samples, or bend by more than {bend_percent:g} %",
    "no-linear-end": "no end of the linear regime was found: it is that of the test",
    "few-legs": "{found} of 3 legs: none can be left out",
    "not-measured": "no measured curve",
    "no-common-theta": "measured and predicted curve share no theta",
    "not-predicted": "the prediction has no number",
    "short-curve": "the measured curve has only theta {first:g} to {last:g} deg",
    "short-at-peak": "the measured curve has only theta {first:g} to {last:g} deg, which may leave out its peak",
    # why a peak has no interval of alpha
    "steep": "no interval of alpha: {degrees:g} degrees of the attack angle change the peak by {percent:.0f} %, and pushes around do not tell where alpha is so steep",
    "other-form": "no interval of alpha: it does not reach the peak by the table or map of the same medium, {beside:.3g} N",
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
    "model-error-unknown": "the model's own error was measured by tables and maps, and is not that of {form}",
    "arc-lost": "with the arc of the legs off by its error there is no steady speed",
    "best-at-end": "the fastest curvature lies at the end of those that were tried",
    "speed-unmeasured": "not measured: {why}",
    "no-steady-run": "no steady run at {count} curvatures",
    "not-simulated": "this condition was not simulated",
    "speed-not-positive": "no share of a measured speed that is not positive",
    # what a check names beside its numbers
    "cause-constant": "{channel}, along {axis}, is constant in {count} of {size} logs: look at its cable and its column",
    "cause-frozen": "{channel}, along {axis}, is frozen in {count} of {size} logs: look at its cable and its column",
    "cause-clipped": "{channel}, along {axis}, stops at {newtons:g} N in {count} of {size} logs, below its range: look at "
    "the range of amplifier and logger",
    "cause-exchanged": "x and y look exchanged: {across}, across the motion, shows {ratio:.3g} times the force of {along}, "
    "along it: look at transducer.axes",
    "cause-silent": "{whose} shows no force in {count} of {size} directions in which it must show one ({rows}): look at its cable "
    "and its column",
    "cause-silent-turned": "{whose} shows no force in {count} of {size} directions in which it must show one, and {across}, across "
    "the motion, {ratio:.3g} times as much ({rows}): look whether the load cell was turned about its axis or two cables exchanged",
    "cause-reversed": "{whose} has the opposite sign in {count} of {size} directions with a clear sign ({rows}): look at its "
    "wires, and at beta_deg and the motion of these runs (on a slanted path a level plate keeps its sign where only beta is wrong)",
    "cause-reversed-beta": "{whose} has the opposite sign in {count} of {size} directions with a clear sign ({rows}), but the right "
    "one where the plate is level or upright on the same paths: look at the sign of beta_deg of these runs, which is that of the left edge",
    "cause-gain": "{whose} has {times:.2g} times the noise, and about as many times the force, in {count} of {size} runs, "
    "beside the others ({rows}): look at its amplifier and its unit",
    "cause-axes": "{count} of {size} runs fit the shape of known media with {axes} and not as the others ({rows}): look at the "
    "cables of {channels} in these runs, at the sign of beta_deg, which is that of the left edge, and at the load cell: one that "
    "turns with a slanted path has other axes",
    "row-above": "above",
    "row-below": "below",
    "rows-above": "{count} rows above",
    "rows-below": "{count} rows below",
    "logs-read": "{count} logs",
    "negative-work": "{count} of {size} cells would push the plate along",
    "few-cells": "at most {count} of them",
    "few-clear": "at most {count} of them, {clear} of these by twice the limit",
    "few-clear-no-push": "at most {count} of them, {clear} of these by twice the limit, and not the push straight down",
    "no-cell": "none",
    "few-cells-no-push": "at most {count} of them, and not the push straight down",
    "no-cell-no-push": "none, and not the push straight down",
    "interval-deg": " ({low:+.1f} to {high:+.1f})",
    "starts-below": "{mm:.1f} mm below the surface",
    "starts-above": "{mm:.1f} mm above the surface",
    "in-pulls": ", {pull} in pulls{interval}",
    "interval-starts": " ({low} to {high})",
    "surface-and-lag": ", by the surface {mm:.1f} mm, by a lag {s:.2f} s",
    "exchanged-with": "; it may be exchanged with {run} ({rows}): each of the two agrees with the others at the angles of the other",
    "opposite-z": "alpha_z has about the opposite value of the others in {count} runs ({rows}): look at the cable and the sign of "
    "the channel along z there; else ",
    "opposite-x": "alpha_x has about the opposite value of the others in {count} runs ({rows}): look at the cable and the sign of "
    "the channel along x, and at the sign of beta_deg there; else ",
    "together": "Such runs lie together: {where}. Look at all runs there. ",
    "together-rows": "{count} of the {size} runs in rows {first} to {last} of the run sheet",
    "together-label": "all with {column} {label}",
    "one-of-pair": "Of two runs of one direction that differ from each other one may be good. ",
    "one-of-three": "If {others} share a mistake, {run} is the good one of the three. ",
    "alpha-beside": "{run}: alpha_{component} {alpha:.3g} beside {others:.3g}",
    "axes-x-reversed": "x reversed",
    "axes-z-reversed": "z reversed",
    "axes-both-reversed": "z and x both reversed",
    "axes-exchanged": "x and z exchanged",
    "axes-exchanged-z-reversed": "x and z exchanged, with z reversed",
    "axes-exchanged-x-reversed": "x and z exchanged, with x reversed",
    "axes-exchanged-both-reversed": "x and z exchanged, and both reversed",
    "axes-beta-reversed": "the other sign of beta",
    "axes-beta-and-x-reversed": "x reversed and the other sign of beta",
    "axes-or": "{axes} (or {others}, which these directions do not tell from it)",
    "told-gain": "force changes by {size:+.0%} ({low:+.0%} to {high:+.0%}) {where}",
    "told-gain-x": "force along x changes by {size:+.0%} ({low:+.0%} to {high:+.0%}) {where}",
    "told-gain-reversed": "force has the opposite sign and {times:.2f} times ({low_times:.2f} to {high_times:.2f}) its size {where}",
    "told-gain-x-reversed": "x reversed: force along x has the opposite sign and {times:.2f} times ({low_times:.2f} to {high_times:.2f}) "
    "its size {where}",
    "told-turn": "the mount looks turned by {size:+.1f} deg ({low:+.1f} to {high:+.1f}) {where}",
    "told-beta-offset": "plates look {size:+.1f} deg ({low:+.1f} to {high:+.1f}) off the stated beta {where}",
    "told-beta-scale": "beta looks {size:+.0%} ({low:+.0%} to {high:+.0%}) larger than stated {where}",
    "told-gamma-offset": "slanted paths look {size:+.1f} deg ({low:+.1f} to {high:+.1f}) off the stated gamma {where}",
    "told-holder": "plates look {size:+.1f} deg ({low:+.1f} to {high:+.1f}) off the stated beta {where}",
    "told-crosstalk": "the channel along x seems to show {size:+.0%} ({low:+.0%} to {high:+.0%}) of the force along z "
    "{where}",
    "told-or": "{told}, or another cause that these runs cannot tell from it ({others})",
    "where-from-run": "from row {row} of the run sheet on ({run} and what follows, {count} runs)",
    "where-window": "from row {row} of the run sheet to row {last_row} ({run} to {last_run}, {count} runs), beside the others",
    "where-trend": "from the first run to the last",
    "where-all": "in all runs",
    "where-holder": "where beta is {angle} or -{angle} deg",
    "where-label": "in the {count} runs with {column} {label}, beside the others",
    "other-all": "{kind} in all runs",
    "other-from-run": "{kind} from one run on",
    "other-window": "{kind} from one run to another",
    "other-trend": "{kind} that grows from run to run",
    "other-holder": "{kind}",
    "other-label": "{kind} in the runs of one {column}",
    "kind-gain": "gain",
    "kind-gain-x": "gain of x",
    "kind-turn": "turn of the mount",
    "kind-beta-offset": "offset of beta",
    "kind-beta-scale": "scale of beta",
    "kind-gamma-offset": "offset of gamma",
    "kind-holder": "one plate holder",
    "kind-crosstalk": "crosstalk",
    "cure-gain": "look at amplifier, plate, moisture and preparation of the bed",
    "cure-gain-x": "look at the channel along x and its amplifier",
    "cure-gain-reversed": "look at the cables, at the unit and at the signs in transducer.axes",
    "cure-gain-x-reversed": "look at the cable of the channel along x, at its sign in transducer.axes, and at the sign of beta_deg",
    "cure-turn": "look at the mount and at transducer.turn_deg",
    "cure-beta-offset": "look at how plates are clamped, and at beta_deg",
    "cure-beta-scale": "look at the scale of beta_deg",
    "cure-gamma-offset": "look at the path of the arm, and at gamma_deg",
    "cure-holder": "look at this plate holder, and at its beta_deg",
    "cure-crosstalk": "look at the calibration matrix of the transducer",
    "least-gain": "a force that changes by {least:.0%} from one run on",
    "least-turn": "a mount turned by {least:.1f} deg in all runs",
    "single-runs": "no push was made twice, in one direction to one depth, so runs are compared with the shape of known media alone",
    "pulls-open": "these directions do not tell whether beta of pulls has the right sign",
    "beta-open": "these directions do not tell whether beta has the right sign",
    "labels-open": "an error of the runs with one label cannot be told from their directions",
    "untold-walls": "a wall or a bottom that bore force, where readings count that a plate took near it",
    "repeat-twice": "push directions twice",
    "repeat-more": "push directions more often",
    "untold-label": "an area or a gain that is wrong in all runs, in a few, or in scattered ones that no column of the run sheet names",
    "untold-holder": "a plate holder that is a few degrees off, a surface that is off at one tilt of the plate, a share of the force along x in the channel along z, or a turn of "
    "the mount and crosstalk that cancel",
    "untold-blocks": "a gain that comes and goes within {runs} runs, or a zero that drifts in strokes whose logs do not end in air",
    "untold-choice": "runs that were kept for their result, as the highest of several, or two runs of a direction that are off alike",
    # what a plan of runs can tell
    "plan-tells": "{least} would be told",
    "plan-tells-large": "{least} would be told, and nothing smaller: {cure}",
    "plan-lacks-gain": "a force that changes from one run on would not be told: {cure}",
    "plan-lacks-turn": "a mount turned in all runs would not be told: {cure}",
    "repeat-first": "push the first direction again in the middle and at the end, and take directions in random order",
    "push-mirror-image": "push one mirror image straight down, beta and -beta at gamma 90",
    # what fails the checks of a medium
    "unusable": "unusable: {faults} (results/checks)",
    "doubtful": "doubtful: {faults} (results/checks)",
    "accepted": "accepted: {fault}: {why}",
    # what rows were used for
    "slope": "slope",
    "leg-curve": "leg curve",
    "tare": "tare",
    "mean-speed": "mean speed",
    "path": "path",
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
    "bottom": f"{_OUTSIDE}too near the bottom (fit.wall_clearance_cm)",
    "wall": f"{_OUTSIDE}too near a wall (fit.wall_clearance_cm)",
    "startup": f"{_OUTSIDE}start of the stroke, force still building up",
    "nonlinear": f"{_OUTSIDE}beyond the linear regime",
    "yielded": "force beyond that of the push against something rigid: depth not known",
    "too-deep": f"{_OUTSIDE}deeper than fit.max_depth_cm of the config",
    "other-sense": OTHER_SENSE,
    "alone": "stands alone, far from the rows before and after it",
    "other-zero": "at rest, but before or after the zero stepped",
    "too-shallow": f"{_OUTSIDE}above fit.submergence_cm of the config",
}
"""Sentence of each code. Readers of logs and tracks raise errors with further codes and sentences."""
