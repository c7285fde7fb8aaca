"""Check that no stretch of the run sheet is shifted against its logs, by the angles in motion logs and by alpha.

A row that is missing or there twice shifts all rows behind it. Motion logs that show other angles than their rows are
refused, so their runs have no alpha; where logs show no angles, alpha itself does, by the table ``misplaced``
(`rftfit.compare.misplaced`).
"""

from __future__ import annotations

import math

from rftfit.campaign.sheet import FEWEST_SHIFTED, Run, find_shift
from rftfit.checks.channels import causes_in_readings
from rftfit.checks.declared import (
    Check,
    MediumMeasurements,
    Sentences,
    declare_check,
    describe_rows,
    flags_on,
)
from rftfit.checks.runs import check_drift, check_rods
from rftfit.directions import beta_apart
from rftfit.measure.flags import remark
from rftfit.measure.verdict_words import BETA_ROWS, ROWS, UNUSABLE
from rftfit.store.chosen import chosen

_EVIDENCE: float = chosen("checks", "evidence").other_rows
"""Log of the Bayes factor above which the angles of other rows clearly fit alpha better."""

_ALLOWED = "no stretch of the run sheet that the angles of rows nearby fit better than its own"
_CURE = "look whether a row is missing or there twice before the first of them, and whether cells of a column were shifted."


@declare_check(
    "sheet",
    title="rows of the run sheet",
    effect=UNUSABLE,
    good="no stretch of the run sheet is shifted against its logs",
    fault="runs stand in rows with the angles of others",
    outcomes={
        "sheet": Sentences(
            "no stretch of the {size} runs fits the angles of rows nearby better than its own",
            _ALLOWED,
        ),
        "sheet-logs": Sentences(
            "the motion logs of {count} of {size} runs that are refused for their angles show those of the row {where} ({rows})",
            _ALLOWED,
            f"logs and angles look shifted against each other ({{found}}): {_CURE}",
        ),
        "sheet-rows": Sentences(
            "the angles of the row {where} explain alpha of {count} runs 10^{power:.0f} times better than their own, by the shape of "
            "known media ({rows})",
            _ALLOWED,
            f"logs and angles look shifted against each other ({{found}}): {_CURE}",
        ),
        "sheet-beta": Sentences(
            "beta of the row {where} explains alpha of {count} runs 10^{power:.0f} times better than their own, by the shape of known "
            "media ({rows})",
            _ALLOWED,
            f"the column beta_deg looks shifted ({{found}}): {_CURE}",
        ),
        "sheet-readings": Sentences(
            "not before the readings of all channels are as they should be"
        ),
        "sheet-few": Sentences(
            "too few runs with alpha to tell whether they stand in the right rows"
        ),
    },
)
def check_sheet(measured: MediumMeasurements) -> Check:
    """Check that the angles of nearby rows do not fit a stretch of runs better than the angles of its rows.

    Faults of channels, exchanged rods and drifts also make angles of other rows fit better, so they come first.
    """
    if (by_logs := _find_shift_of_logs(measured)) is not None:
        shift, shifted_runs, refused_count = by_logs
        return Check.judge(
            "sheet",
            False,
            code="sheet-logs",
            count=len(shifted_runs),
            size=refused_count,
            where=_describe_shift(shift),
            rows=describe_rows(shifted_runs, measured.sheet),
        )
    # only the likeliest mistake counts: with wrong axes the angles of other rows may fit better, too
    likeliest = measured.likeliest_mistake
    mistake = likeliest.get("mistake")
    if mistake in (ROWS, BETA_ROWS) and likeliest["log_bayes_factor"] > _EVIDENCE:
        if (
            causes_in_readings(measured)[1]
            or check_rods(measured).flags
            or check_drift(measured).flags
        ):
            return Check.skip("sheet", "sheet-readings")
        run_ids = likeliest["run_ids"].split()
        return Check.judge(
            "sheet",
            False,
            flags_on(run_ids, "other-row"),
            code="sheet-rows" if mistake == ROWS else "sheet-beta",
            count=len(run_ids),
            power=likeliest["log_bayes_factor"] / math.log(10),
            where=_describe_shift(likeliest["rows"]),
            rows=describe_rows(run_ids, measured.sheet),
        )
    run_count = len(measured.tables["peers"])
    if run_count < FEWEST_SHIFTED:
        return Check.skip("sheet", "sheet-few")
    return Check.judge("sheet", True, size=run_count)


def _describe_shift(shift: int) -> str:
    """Describe in which row the angles of a log stand; `shift`: number of rows above it, negative for below."""
    side = "above" if shift > 0 else "below"
    return str(remark(f"row-{side}" if abs(shift) == 1 else f"rows-{side}", count=abs(shift)))


def _find_shift_of_logs(measured: MediumMeasurements) -> tuple[int, list[str], int] | None:
    """Find a stretch of refused runs whose motion logs show the angles of other rows; None where there is none.

    Returns the number of rows by which the angles stand above the logs that show them, the run_ids, and the number of
    all runs that are refused for their angles.
    """
    plates = sorted(
        (run for run in measured.sheet.values() if run.kind == "plate"), key=lambda run: run.row
    )
    position_of_run = {run.run_id: position for position, run in enumerate(plates)}
    runs = measured.tables["runs"]
    is_seen = runs[["seen_beta_deg", "seen_gamma_deg"]].notna().any(axis=1)
    refused = runs[is_seen & runs["run_id"].isin([*position_of_run])]
    if len(refused) < FEWEST_SHIFTED:
        return None
    # of logs against the sheet, not of the grid
    tolerance_deg = measured.config.arm.angle_tolerance_deg
    run_ids = refused["run_id"].tolist()
    seen_deg = refused[["seen_beta_deg", "seen_gamma_deg"]].to_numpy(float)

    def shows_angles_at(index: int, position: int) -> bool:
        """Return True if the log of refused run `index` shows the angles of the plate run at a position in the sheet."""
        beta_deg, gamma_deg = seen_deg[index]
        return 0 <= position < len(plates) and _shows_angles(
            plates[position], beta_deg, gamma_deg, tolerance_deg
        )

    likeliest_shift = find_shift([position_of_run[run_id] for run_id in run_ids], shows_angles_at)
    if likeliest_shift is None:
        return None
    shift, shifted = likeliest_shift
    return shift, [run_ids[index] for index in shifted], len(refused)


def _shows_angles(run: Run, beta_deg: float, gamma_deg: float, tolerance_deg: float) -> bool:
    """Return True if the angles that a log shows may be those of a run; NaN: this angle is not known."""
    beta_off_deg = abs(float(beta_apart(beta_deg, run.beta_deg)))
    gamma_off_deg = abs((gamma_deg - run.motion_gamma_deg + 180) % 360 - 180)
    # a comparison with NaN is False, so an unknown angle fits
    return not (beta_off_deg > tolerance_deg or gamma_off_deg > tolerance_deg)
