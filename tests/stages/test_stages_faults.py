"""Each fault of a log or sheet gives a reason or a flag, never an unmarked number or a lost row."""

from __future__ import annotations

import io
import math

import pandas as pd
import pytest
from campaigns import planned
from makers import golden_campaigns
from measured import row_of_run

from rftfit import reference
from rftfit.lab.rig import FAULTS

RUN = "poppy_LP_bp30_g45_in"
"""A slanted push."""
PULL = "poppy_LP_bp30_g45_ex"
"""Its way back."""
LEVEL = "poppy_LP_bp30_g00_h508"
"""A level run."""
OTHER = "poppy_LP_bp00_g90_in"
"""A push straight down."""
LEG = "poppy_LP_c_leg"

FORCE, MOTION = f"poppy_LP/{RUN}_force.csv", f"poppy_LP/{RUN}_motion.csv"
ROD = f"{RUN}_rod"

OF_TARES = ("duplicated_rows", "empty", "gap", "nan_cells", "saturated", "truncated")
"""Faults that a rod has here; those of plates are in golden campaigns."""
OF_LEGS = (*OF_TARES, "flipped_beta", "missing_tare")


LARGE = {RUN: (4, 9), PULL: (2, 3)}
"""Place of a run's cell in the published table."""


def is_right(fit):
    """Alpha of a run of `LARGE` is the published one."""
    for c, alpha in zip("zx", reference.alpha_grid("poppy_LP"), strict=True):
        assert fit[f"alpha_{c}_N_per_cm3"] == pytest.approx(alpha[LARGE[fit["run_id"]]], abs=0.005)


def first(share):
    """The first part of a log, up to the end of a row."""
    return lambda text: "".join(text.splitlines(keepends=True)[: int(text.count("\n") * share)])


def no_number(row):
    return all(
        math.isnan(row[f"alpha_{c}{q}_N_per_cm3"]) for c in "zx" for q in ("", "_se", "_lo", "_hi")
    )


def test_every_fault_of_a_plate_is_in_a_golden_campaign():
    """But for another delimiter, which is a log of `tests/logs/data`."""
    labs = [campaign.settings.get("lab", {}) for campaign in golden_campaigns()]
    named = {fault.partition(":")[0] for lab in labs for fault in lab.get("faults", [])}
    assert named == {*FAULTS} - {"wrong_delimiter"}


@pytest.mark.parametrize("fault", OF_TARES)
def test_fault_in_the_tare(room, fault):
    """A tare that is short or has a hole gives no number; one that is whole gives the right one."""
    rod = planned()[PULL].tare_run
    room.add(PULL, **{rod: (fault,)})
    results = room.chain()
    results.check_ledger(room.counted)
    fit, status = results.fit(PULL), results.run(rod)
    if fault in ("duplicated_rows", "nan_cells"):
        assert results.codes(rod)
        is_right(fit)
        return
    assert no_number(fit)
    if status["status"] == "refused":
        assert fit["reason"] == f"no tare: {rod} cannot be used: {status['reason']}"
        tare = row_of_run(results.tares, PULL)
        assert tare["reason"] == fit["reason"]
        assert math.isnan(tare["valid_to"])
    else:
        assert fit["reason_code"] == "tare-short"
        assert results.fates(f"poppy_LP/{PULL}_force.csv")["dropped", "untared"] > 50


@pytest.mark.parametrize("fault", OF_LEGS)
@pytest.mark.parametrize("target", [LEG, "air_c_leg"])
def test_fault_of_a_leg(room, fault, target):
    room.add(LEG, **{target: (fault,)})
    results = room.chain()
    results.check_ledger(room.counted)
    status = results.run(target)
    assert status["reason"] or results.codes(target)
    if fault == "flipped_beta":
        assert status["reason_code"] == "no-rotation"
    if status["reason"]:
        assert results.curves.empty
        if target != LEG:
            assert status["reason"] in results.tares.iloc[0]["reason"]
        return
    published = reference.load("fig_s5")
    published = published[(published["medium"] == "poppy_LP") & (published["leg"] == "c_leg")]
    both = results.curves.merge(published, on="theta_deg", suffixes=("", "_published"))
    assert len(both) > 200
    off = (
        both[["force_z_N", "force_x_N"]].to_numpy()
        - both[["force_z_N_published", "force_x_N_published"]].to_numpy()
    )
    assert abs(off).max() < 0.4
    if fault in ("gap", "saturated"):
        # no bin is bridged
        assert both["theta_deg"].diff().max() > 5


def without_rows(text):
    """Force samples between two arm samples a second apart have no known place."""
    lines = text.splitlines(keepends=True)
    return "".join(lines[:400] + lines[450:])


@pytest.mark.parametrize(
    ("change", "flags", "dropped", "rows"),
    [
        (first(2 / 3), ["motion-log-cut"], "no-motion", (300, math.inf)),
        (without_rows, [], "motion-gap", (99, 103)),
    ],
)
def test_motion_log_with_a_part_missing(room, change, flags, dropped, rows):
    room.add(RUN)
    room.change(MOTION, change)
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert {*flags} <= {*results.codes(RUN)}
    assert rows[0] <= results.fates(FORCE)["dropped", dropped] <= rows[1]
    is_right(fit)


@pytest.mark.parametrize(
    ("cells", "logs", "code"),
    [
        ({}, {FORCE: f"poppy_LP/{OTHER}_force.csv"}, "clocks-disagree"),
        ({RUN: {"force_log": MOTION, "motion_log": FORCE}}, {}, "wrong-kind"),
        (
            {RUN: {"direction": "extraction"}, ROD: {"direction": "extraction"}},
            {},
            "other-direction",
        ),
        ({LEVEL: {"depth_cm": "7.62"}, f"{LEVEL}_rod": {"depth_cm": "7.62"}}, {}, "other-depth"),
        ({}, {FORCE: "", MOTION: ""}, "missing"),
        ({ROD: {"excluded": "yes", "reason": "bent"}}, {}, "tare-missing tare-unusable excluded"),
    ],
)
def test_sheet_and_logs_that_do_not_belong_together(room, cells, logs, code):
    run = LEVEL if LEVEL in cells else RUN
    room.add(run, OTHER)
    for name, changed in cells.items():
        room.set(name, **changed)
    room.logs |= {name: room.logs.get(source) for name, source in logs.items()}
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(run)
    assert fit["reason_code"] == code
    assert no_number(fit)
    if run == RUN and not code.startswith(("wrong", "other")):
        assert results.cell(30, 45)["reason"] == f"{RUN}: {fit['reason']}"


def test_no_number_rests_on_a_sentence(room, monkeypatch):
    room.add(RUN, PULL, LEVEL, OTHER, LEG, **{RUN: ("nan_cells", "gap"), PULL: ("saturated",)})
    words = {"reason", "note"}
    worded = room.chain()
    monkeypatch.setattr("rftfit.measure.flags.Remark.__str__", lambda remark: remark.code)
    coded = room.chain()
    for name in ("runs", "tares", "fits", "alpha", "curves", "book"):
        tables = (getattr(results, name) for results in (worded, coded))
        kept = (table[table.columns.difference(words)] for table in tables)
        pd.testing.assert_frame_equal(
            *(table.sort_values([*table]).reset_index(drop=True) for table in kept)
        )
    assert coded.codes(RUN) == worded.codes(RUN) != []


def test_force_log_that_ends_before_the_stroke(room):
    """The approach is there, so the clocks agree; of the stroke itself there is no sample."""
    room.add(RUN)
    room.change(FORCE, lambda text: "".join(text.splitlines(keepends=True)[: 3 + 500]))
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fit(RUN)["reason_code"] == "no-force-in-stroke"


def test_zero_that_drifts_within_a_leg_run_is_flagged(room):
    room.add(LEG)

    def drift(text):
        log = pd.read_csv(io.StringIO(text), comment="#")
        log["F3_N"] -= 0.5 * log.index / len(log)
        return log.to_csv(index=False)

    straight = room.chain().curves
    room.change(f"poppy_LP/{LEG}_force.csv", drift)
    results = room.chain()
    (flag,) = results.flags.of_run(LEG)
    assert (flag.code, flag.values["newtons"]) == ("zero-drifted", pytest.approx(0.5, abs=0.1))
    # and it is taken away as a line
    off = results.curves["force_z_N"] - straight["force_z_N"]
    assert abs(off).max() < 0.05
