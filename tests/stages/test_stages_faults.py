"""Each thing that can go wrong: its reason, no silent number, and no row lost."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import pandas as pd
import pytest
from rigroom import Results, Room, one, paper, planned

from rftfit import reference
from rftfit.campaign.load import load_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.errors import RftfitError
from rftfit.lab.enact import reenact
from rftfit.lab.rig import FAULTS
from rftfit.measure.checks import check_axes
from rftfit.measure.ledger import check, join

if TYPE_CHECKING:
    from pathlib import Path

RUN = "poppy_LP_bp30_g45_in"
PULL = "poppy_LP_bp30_g45_ex"
LEVEL = "poppy_LP_bp30_g00_h508"
OTHER = "poppy_LP_bp00_g90_in"
LEG = "poppy_LP_c_leg"
CELL = {RUN: (30, 45), PULL: (-30, -45)}

FORCE = f"poppy_LP/{RUN}_force.csv"

REFUSED = {
    "missing_log": rf"{FORCE}: log missing",
    "empty": rf"{FORCE}: the file is empty",
    "header_only": rf"{FORCE}: a header and no data",
    "wrong_delimiter": rf"{FORCE}: the header row is separated by semicolons; .* wants commas",
    "wrong_unit": rf"{RUN}_force\.csv: F1 in lbf, but the config says N",
    "never_touches": r"surface not reached: the lowest point of the path is z = \+\d\.\d\d cm",
    "flipped_beta": r"the arm log shows the plate at beta = -30\.0 deg, the sheet says 30",
    "missing_tare": rf"no tare: {RUN}_rod cannot be used: poppy_LP/{RUN}_rod_force\.csv: log missing",
    "saturated": r"transducer saturated in 100 samples of the window",
}
FLAGGED = {
    "gap": ("gap of 1.51 s in the force log during the stroke",),
    "truncated": (
        f"1 rows of {RUN}_force.csv: cut in mid-row",
        "force log lacks 5.21 s of the stroke",
    ),
    "duplicated_rows": (f"60 rows of {RUN}_force.csv: duplicated row",),
    "time_reversed": (
        f"59 rows of {RUN}_force.csv: time runs backwards",
        "gap of 0.60 s in the force log during the stroke",
    ),
    "nan_cells": (f"30 rows of {RUN}_force.csv: NaN or infinite",),
}


def broken(room: Room, fault: str, run: str = RUN, beside: str = OTHER) -> Results:
    changed = planned()[run].tare_run if fault == "missing_tare" else run
    room.add(run, beside, **{changed: (fault,)})
    results = room.chain()
    results.check_ledger(room.counted)
    # what lies beside it is as if nothing had happened
    assert results.fit(beside)["reason"] == ""
    assert results.fit(beside)["alpha_z_N_per_cm3"] == pytest.approx(0.3505, abs=0.005)
    return results


def no_number(row: pd.Series) -> bool:
    return all(
        math.isnan(row[f"alpha_{c}{q}_N_per_cm3"]) for c in "zx" for q in ("", "_se", "_lo", "_hi")
    )


def test_every_fault_is_tested_here() -> None:
    assert REFUSED.keys() | FLAGGED.keys() | {"wrong_medium_tare"} == set(FAULTS)


@pytest.mark.parametrize("fault", REFUSED)
def test_fault_that_forbids_a_number(room: Room, fault: str) -> None:
    results = broken(room, fault)
    fit = results.fit(RUN)
    assert re.match(REFUSED[fault], fit["reason"]), fit["reason"]
    assert no_number(fit)
    assert fit["n_points"] == 0
    cell = results.cell(30, 45)
    assert cell["reason"] == f"{RUN}: {fit['reason']}"
    assert no_number(cell)
    assert cell["n_runs"] == 0
    # the rows say the same as the table
    reasons = " | ".join(reason for _, reason in results.fates(FORCE))
    assert re.search(REFUSED[fault], reasons), reasons
    used = sum(n for (fate, _), n in results.fates(FORCE).items() if fate == "used")
    refused_at_once = fault not in ("missing_tare", "saturated")
    assert (used == 0) == refused_at_once
    assert (results.run(RUN)["status"] == "refused") == refused_at_once


@pytest.mark.parametrize("fault", FLAGGED)
def test_fault_that_is_flagged(room: Room, fault: str) -> None:
    results = broken(room, fault)
    fit = results.fit(RUN)
    assert fit["reason"] == ""
    assert tuple(fit["flags"].split("; ")) == FLAGGED[fault]
    assert results.run(RUN)["flags"] == fit["flags"]
    # in a cell "; " stands between runs
    assert results.cell(30, 45)["flags"] == f"{RUN}: {', '.join(FLAGGED[fault])}"
    alpha_z, alpha_x = (alpha[4, 9] for alpha in reference.alpha_grid("poppy_LP"))
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(alpha_z, abs=0.005)
    assert fit["alpha_x_N_per_cm3"] == pytest.approx(alpha_x, abs=0.005)


@pytest.mark.parametrize(("axis", "verdict"), [("-F3", "passed"), ("+F3", "failed")])
def test_a_sign_of_the_mount_that_is_wrong(room: Room, axis: str, verdict: str) -> None:
    """A force log cannot tell it; a medium that seems to pull a plate down can."""
    room.add(OTHER)
    assert 'z: "-F3"' in room.config
    room.config = room.config.replace('z: "-F3"', f'z: "{axis}"')
    results = room.chain()
    assert check_axes(results.alpha, "transducer.axes")[0].verdict == verdict
    assert (results.fit(OTHER)["alpha_z_hi_N_per_cm3"] < 0) == (verdict == "failed")


@pytest.mark.parametrize("fault", sorted((REFUSED.keys() | FLAGGED.keys()) - {"never_touches"}))
@pytest.mark.parametrize("run", [PULL, LEVEL])
def test_no_row_is_lost_and_no_number_is_silent(room: Room, fault: str, run: str) -> None:
    fit = broken(room, fault, run).fit(run)
    assert fit["reason"] or fit["flags"]
    assert no_number(fit) == bool(fit["reason"])
    if not fit["reason"]:
        alpha = reference.alpha_grid("poppy_LP")
        row, column = (2, 3) if run == PULL else (4, 6)
        assert fit["alpha_z_N_per_cm3"] == pytest.approx(alpha[0][row, column], abs=0.005)
        assert fit["alpha_x_N_per_cm3"] == pytest.approx(alpha[1][row, column], abs=0.005)


@pytest.mark.parametrize(
    "fault", sorted((REFUSED.keys() | FLAGGED.keys()) - {"never_touches", "missing_tare"})
)
@pytest.mark.parametrize("run", [RUN, PULL, LEVEL])
def test_fault_in_the_tare(room: Room, fault: str, run: str) -> None:
    """A tare that is short or has a hole gives no number; one that is whole gives the right one."""
    rod = planned()[run].tare_run
    room.add(run, **{rod: (fault,)})
    results = room.chain()
    results.check_ledger(room.counted)
    fit, status = results.fit(run), results.run(rod)
    if fault in ("duplicated_rows", "nan_cells"):
        assert status["flags"]
        row, column = {RUN: (4, 9), PULL: (2, 3), LEVEL: (4, 6)}[run]
        expected = reference.alpha_grid("poppy_LP")[0][row, column]
        assert fit["alpha_z_N_per_cm3"] == pytest.approx(expected, abs=0.005)
        return
    assert no_number(fit)
    if status["status"] == "refused":
        assert fit["reason"] == f"no tare: {rod} cannot be used: {status['reason']}"
        tare = one(results.tares, run)
        assert tare["reason"] == fit["reason"]
        assert math.isnan(tare["valid_to"])
    else:
        assert re.match(
            r"tare shorter than the run or with a gap: \d+ samples of the window have no tare",
            fit["reason"],
        )
        assert (
            results.fates(f"poppy_LP/{run}_force.csv")["dropped", "outside the tare's range"] > 50
        )


@pytest.mark.parametrize("fault", sorted((REFUSED.keys() | FLAGGED.keys()) - {"never_touches"}))
@pytest.mark.parametrize("target", [LEG, "air_c_leg"])
def test_fault_of_a_leg(room: Room, fault: str, target: str) -> None:
    room.add(LEG, **{target: (fault,)})
    results = room.chain()
    results.check_ledger(room.counted)
    status = results.run(target)
    assert status["reason"] or status["flags"]
    if fault == "flipped_beta":
        assert "the leg turned by -270 deg" in status["reason"]
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


def test_tare_of_another_medium_is_stopped_before_anything_is_read(tmp_path: Path) -> None:
    (tmp_path / "config").mkdir()
    config = tmp_path / "config" / "config.yaml"
    config.write_text(Room(tmp_path).config, encoding="utf-8")
    raw = tmp_path / "raw" / "paper"
    media = ["yuma", "palms29"]
    reenact(paper(), raw, raw / "runs.csv", media=media, faults=["wrong_medium_tare"], workers=1)
    with pytest.raises(CampaignError) as caught:
        load_campaign(config)
    text = str(caught.value)
    assert "tare_run" in text
    assert "medium is yuma here and palms29 in palms29_bp00_g90_in_rod" in text
    assert re.search(r"row \d+", text)


def test_tare_shorter_than_the_run(room: Room) -> None:
    """The rod's logs end, both of them and at a row's end, before the plate's path does."""
    room.add(RUN)
    for kind in ("force", "motion"):
        log = f"poppy_LP/{RUN}_rod_{kind}.csv"
        room.change(
            log, lambda text: "".join(text.splitlines(keepends=True)[: text.count("\n") * 2 // 3])
        )
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert "tare shorter than the run" in fit["reason"]
    assert no_number(fit)
    tare = one(results.tares, RUN)
    assert 3 < tare["valid_to"] < 6


def test_motion_log_cut_short_is_flagged(room: Room) -> None:
    room.add(RUN)
    room.change(
        f"poppy_LP/{RUN}_motion.csv",
        lambda text: "".join(text.splitlines(keepends=True)[: text.count("\n") * 2 // 3]),
    )
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert "the motion log begins or ends within the stroke" in fit["flags"]
    assert fit["alpha_z_N_per_cm3"] == pytest.approx(0.1879, abs=0.005)
    assert results.fates(FORCE)["dropped", "outside the motion log"] > 300


def test_logs_of_two_runs_mixed_up(room: Room) -> None:
    room.add(RUN, OTHER)
    room.logs[FORCE] = room.logs[f"poppy_LP/{OTHER}_force.csv"]
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert re.match(
        r"force and motion log disagree by \d\.\d+ s .* belong to one run", fit["reason"]
    )
    assert no_number(fit)


def test_force_and_motion_swapped(room: Room) -> None:
    room.add(RUN)
    force, motion = FORCE, f"poppy_LP/{RUN}_motion.csv"
    room.set(RUN, force_log=motion, motion_log=force)
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fit(RUN)["reason"] == (
        f"{motion}: this is not a force log (no column for F1); are the two logs of the run swapped?; "
        f"{force}: this is not a motion log (no column for x); are the two logs of the run swapped?"
    )


def test_direction_of_the_sheet_must_be_the_arms(room: Room) -> None:
    room.add(RUN)
    for name in (RUN, f"{RUN}_rod"):
        room.set(name, direction="extraction")
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert re.match(
        r"below the surface the arm moved along gamma = 45\.0 deg; "
        r"the sheet's extraction at gamma 45 is along -135\.0 deg",
        fit["reason"],
    )


def test_depth_of_the_sheet_must_be_the_arms(room: Room) -> None:
    room.add(LEVEL)
    for name in (LEVEL, f"{LEVEL}_rod"):
        room.set(name, depth_cm="7.62")
    results = room.chain()
    assert results.fit(LEVEL)["reason"] == (
        "the arm log shows a depth of 5.08 cm, the sheet says 7.62"
    )


def test_two_faults_at_once_are_both_told(room: Room) -> None:
    room.add(RUN, **{RUN: ("empty",)})
    room.logs[f"poppy_LP/{RUN}_motion.csv"] = None
    results = room.chain()
    results.check_ledger(room.counted)
    reason = results.fit(RUN)["reason"]
    assert f"{FORCE}: the file is empty" in reason
    assert f"{RUN}_motion.csv: log missing" in reason


def test_two_faults_in_one_log(room: Room) -> None:
    room.add(RUN, **{RUN: ("nan_cells", "duplicated_rows", "truncated")})
    results = room.chain()
    results.check_ledger(room.counted)
    flags = results.fit(RUN)["flags"]
    assert all(flags.count(word) == 1 for word in ("NaN", "duplicated", "cut in mid-row"))


def test_two_faulty_runs(room: Room) -> None:
    room.add(RUN, PULL, OTHER, **{RUN: ("empty",), PULL: ("saturated",)})
    results = room.chain()
    results.check_ledger(room.counted)
    assert [bool(results.fit(name)["reason"]) for name in (RUN, PULL, OTHER)] == [True, True, False]


@pytest.mark.parametrize("fault", ["missing_log", "empty", "never_touches"])
def test_medium_of_which_nothing_can_be_used(room: Room, fault: str) -> None:
    room.add(RUN, LEG, **{
        name: ("missing_log" if "leg" in name and fault == "never_touches" else fault,)
        for name in (RUN, f"{RUN}_rod", LEG, "air_c_leg")
    })  # fmt: skip
    results = room.chain()
    results.check_ledger(room.counted)
    assert (results.runs["status"] == "refused").all()
    assert no_number(results.fit(RUN))
    assert len(results.traces) == len(results.tared) == len(results.curves) == 0
    assert (results.alpha["reason"] != "").all()


def test_excluded_run(room: Room) -> None:
    room.add(RUN, OTHER)
    room.set(RUN, excluded="yes", reason="bed was not level")
    room.set(f"{RUN}_rod", excluded="yes", reason="bed was not level")
    results = room.chain()
    results.check_ledger(room.counted)
    fit = results.fit(RUN)
    assert fit["reason"] == "excluded: bed was not level"
    assert no_number(fit)
    assert results.cell(30, 45)["reason"] == f"{RUN}: excluded: bed was not level"
    assert {fate for fate, _ in results.fates(FORCE)} == {"dropped"}


def test_excluded_tare(room: Room) -> None:
    room.add(RUN)
    room.set(f"{RUN}_rod", excluded="yes", reason="rod was bent")
    fit = room.chain().fit(RUN)
    assert fit["reason"] == f"no tare: {RUN}_rod cannot be used: excluded: rod was bent"


def test_run_without_a_tare(room: Room) -> None:
    room.add(RUN)
    room.set(RUN, tare_run="")
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fit(RUN)["reason"] == "no tare: the run sheet names none"
    assert no_number(results.fit(RUN))


def test_ledger_that_does_not_add_up_is_a_fault_of_the_program(room: Room) -> None:
    results = room.add(RUN).chain()
    book = results.book.copy()
    check(book, results.runs)
    book["rows"] += book.index == 3
    with pytest.raises(RftfitError, match=rf"does not add up in 1 runs, first {RUN}"):
        check(book, results.runs)
    with pytest.raises(RftfitError, match="does not add up"):
        check(results.book.drop(index=0), results.runs)


def test_air_run_that_serves_two_media_is_counted_once(room: Room) -> None:
    room.add(LEG, "poppy_CP_c_leg")
    one, two = room.chain("poppy_LP"), room.chain("poppy_CP")
    book = join([one.book, two.book])
    assert book.groupby("file")["rows"].sum().to_dict() == room.counted
    check(book, pd.concat([one.runs, two.runs]))


def test_logs_on_one_clock(room: Room) -> None:
    """Without the sync line the clocks are taken as one: then the surface pause is off, and told."""
    room.add(OTHER)
    synced = room.chain().run(OTHER)["clock_offset_s"]
    for run in (OTHER, f"{OTHER}_rod"):

        def shift(text: str, by: float = room.chain().run(run)["clock_offset_s"]) -> str:
            lines = [line.split(",", 1) for line in text.splitlines()]
            return "".join(
                ",".join(parts) + "\n" if parts[0].startswith(("#", "time"))
                else f"{float(parts[0]) - by:.4f},{parts[1]}\n"
                for parts in lines
            )  # fmt: skip

        room.change(f"poppy_LP/{run}_motion.csv", shift)
    room.config = room.config.replace("method: sync_line", "method: same_clock")
    results = room.chain()
    assert abs(synced) > 0.01
    assert results.run(OTHER)["clock_offset_s"] == 0
    assert results.run(OTHER)["clock_se_s"] == 0
    assert results.fit(OTHER)["alpha_z_N_per_cm3"] == pytest.approx(0.3505, abs=0.005)


def test_force_log_that_ends_before_the_stroke(room: Room) -> None:
    """The approach is there, so the clocks agree; of the stroke itself there is no sample."""
    room.add(RUN)
    room.change(FORCE, lambda text: "".join(text.splitlines(keepends=True)[: 3 + 500]))
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fit(RUN)["reason"] == (
        "the force log has no sample during the stroke; do the two logs belong to one run?"
    )


def test_rod_that_is_saturated_all_along_is_no_tare(room: Room) -> None:
    room.add(RUN)

    def saturate(text: str) -> str:
        lines = text.splitlines()
        rows = [line.split(",") for line in lines[3:]]
        for row in rows[480:]:
            row[4] = "-200"
        return "\n".join([*lines[:3], *map(",".join, rows), ""])

    room.change(f"poppy_LP/{RUN}_rod_force.csv", saturate)
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fit(RUN)["reason"] == f"no tare: tare {RUN}_rod: 0 samples are no tare"
    assert no_number(results.fit(RUN))


def test_zero_that_drifts_within_a_leg_run_is_flagged(room: Room) -> None:
    room.add(LEG)

    def drift(text: str) -> str:
        lines = text.splitlines()
        rows = [line.split(",") for line in lines[3:]]
        for place, row in enumerate(rows):
            row[4] = f"{float(row[4]) - 0.5 * place / len(rows):.5f}"
        return "\n".join([*lines[:3], *map(",".join, rows), ""])

    straight = room.chain().curves
    room.change(f"poppy_LP/{LEG}_force.csv", drift)
    results = room.chain()
    assert re.search(r"zero drifted by 0\.[45]\d N", results.run(LEG)["flags"])
    # and it is taken away as a line
    off = results.curves["force_z_N"] - straight["force_z_N"]
    assert abs(off).max() < 0.05


def test_gap_in_the_motion_log(room: Room) -> None:
    """Force samples between two arm samples a second apart have no known place."""
    room.add(RUN)

    def hole(text: str) -> str:
        lines = text.splitlines(keepends=True)
        return "".join(lines[:400] + lines[450:])

    room.change(f"poppy_LP/{RUN}_motion.csv", hole)
    results = room.chain()
    results.check_ledger(room.counted)
    assert results.fates(FORCE)["dropped", "gap in the motion log"] == pytest.approx(101, abs=2)
    assert results.fit(RUN)["alpha_z_N_per_cm3"] == pytest.approx(0.1879, abs=0.005)
