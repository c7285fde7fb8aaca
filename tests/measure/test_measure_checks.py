"""Checks on tables in memory: no false alarm on the published media, every wrong axis named."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from light_campaign import LABORATORY, alpha_frame, make_campaign, one_cell
from other_labs import GRIDS

from rftfit import reference
from rftfit.campaign.config import Medium
from rftfit.lab.plan import directions_of
from rftfit.lab.truth import table_s5
from rftfit.measure.checks import (
    COLUMNS,
    NOT_CHECKED,
    Check,
    check_axes,
    check_channels,
    check_logs,
    check_rods,
    check_size,
    check_steadiness,
    check_surface,
    marked,
    marks_of,
    same_readings,
    usable,
)
from rftfit.measure.flags import flag_columns, remark
from rftfit.measure.ledger import RowStatus
from rftfit.results import open_results

if TYPE_CHECKING:
    from collections.abc import Sequence

GRID_NAMES = ["few", *(name for name in GRIDS if name != "one-push")]


def on_grid(medium: str, grid: str) -> pd.DataFrame:
    """The published table of a medium on another grid."""
    if grid == "few":
        return alpha_frame(medium, reference.alpha_grid(medium))
    cells = directions_of(GRIDS[grid], 5)
    z, x = np.array([table_s5(medium, *cell) for cell in cells]).T
    columns: dict[str, Any] = dict(zip(("beta_deg", "gamma_deg"), np.array(cells).T, strict=True))
    for c, values in (("z", z), ("x", x)):
        columns |= {f"alpha_{c}_N_per_cm3": values, f"alpha_{c}_se_N_per_cm3": 0.003}
    return pd.DataFrame(columns | {"medium": medium, "spread": "one bed as prepared"})


def axes(table: pd.DataFrame, **words: Any) -> dict[str, Any]:
    return {one.check: one for one in check_axes(table, "transducer.axes", **words)}


def measured_with(table: pd.DataFrame, z: str, x: str) -> pd.DataFrame:
    """What a table would be if the config called other axes z and x; pulls are filed turned."""
    side = np.where(table["gamma_deg"] < 0, -1.0, 1.0)
    true = {c: table[f"alpha_{c}_N_per_cm3"] * (side if c == "x" else 1) for c in "zx"}
    seen = {}
    for name, read in (("z", z), ("x", x)):
        force = true[read[1]] * (1 if read[0] == "+" else -1)
        seen[f"alpha_{name}_N_per_cm3"] = force * (side if name == "x" else 1)
    return table.assign(**seen)


def turned(table: pd.DataFrame, angle_deg: float) -> pd.DataFrame:
    """What a table would be if the config stated a turn that is smaller by so much."""
    side = np.where(table["gamma_deg"] < 0, -1.0, 1.0)
    z, x = table["alpha_z_N_per_cm3"], table["alpha_x_N_per_cm3"] * side
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return table.assign(
        alpha_z_N_per_cm3=cosine * z + sine * x, alpha_x_N_per_cm3=side * (cosine * x - sine * z)
    )


def test_a_single_run_that_gives_energy_back_is_flagged() -> None:
    table = on_grid("poppy_LP", "few")
    table["run_ids"] = [f"run{place}" for place in range(len(table))]
    at = int(np.flatnonzero((table["beta_deg"] == 30) & (table["gamma_deg"] == 90))[0])
    assert not axes(table)["work"].runs
    table.loc[at, ["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]] *= -1
    work = axes(table)["work"]
    assert (work.verdict, work.runs) == ("passed", (remark("gives-back", run_id=f"run{at}"),))
    table[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]] *= -1
    assert (axes(table)["work"].verdict, axes(table)["work"].runs) == ("failed", ())


@pytest.mark.parametrize("grid", GRID_NAMES)
@pytest.mark.parametrize("medium", reference.MEDIA)
def test_no_published_table_fails(medium: str, grid: str) -> None:
    table = on_grid(medium, grid)
    verdicts = {name: one.verdict for name, one in axes(table).items()}
    assert "failed" not in verdicts.values()
    assert verdicts["work"] == "passed"
    # what needs a push straight down is not said to have passed without one
    has_push = ((table["beta_deg"] == 0) & (table["gamma_deg"] == 90)).any()
    assert verdicts["symmetry"] == ("passed" if has_push else "not checked")


@pytest.mark.parametrize("medium", reference.MEDIA)
@pytest.mark.parametrize(
    ("z", "x", "named"),
    [
        ("-z", "+x", "Z looks reversed"),
        ("+z", "-x", "X looks reversed"),
        ("-z", "-x", "Z and x both look reversed, or the logs of plates and rods exchanged"),
        ("+x", "+z", "X and z look exchanged ("),
        ("-x", "+z", "X and z look exchanged, with"),
        ("+x", "-z", "X and z look exchanged, with"),
        ("-x", "-z", "X and z look exchanged, and both reversed"),
    ],
)
def test_wrong_axes_are_named(medium: str, z: str, x: str, named: str) -> None:
    good = on_grid(medium, "few")
    found = axes(measured_with(good, z, x))["work"]
    assert found.verdict == "failed"
    assert found.sentence.startswith(named), found.sentence
    assert "; none of them with that put right" in found.sentence
    assert f" of {len(good)} cells give energy back" in found.sentence


def test_what_the_wrong_axes_of_the_first_medium_cost() -> None:
    """Cells that give energy back by more than three times the scatter of beds that the paper states."""
    table = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    counts = {}
    for z, x in (("+z", "+x"), ("-z", "+x"), ("+z", "-x"), ("+x", "+z")):
        said = axes(measured_with(table, z, x))["work"].found
        counts[z + x] = int(said.split()[0])
    # D of the printed table, by hand: alpha_x cos gamma + alpha_z sin gamma
    up, along = reference.alpha_grid("poppy_LP")
    gamma = np.radians(reference.GAMMA_DEG)
    least = 3 * math.hypot(0.003, 0.005)
    given = -up * np.sin(gamma) + along * np.cos(gamma)
    assert counts["-z+x"] == np.count_nonzero(given < -least)
    assert counts["+z+x"] == 0
    assert counts["+z-x"] > 20
    assert counts["+x+z"] >= 3


def test_plates_and_rods_are_named_where_rods_feel_more() -> None:
    table = measured_with(on_grid("poppy_CP", "few"), "-z", "-x")
    found = axes(table, swapped=True)["work"]
    assert found.sentence.startswith("The logs of plates and rods look exchanged")
    assert "tare_run" in found.sentence


@pytest.mark.parametrize("medium", reference.MEDIA)
@pytest.mark.parametrize("angle", [-8.0, 8.0])
def test_a_turned_mount_is_measured(medium: str, angle: float) -> None:
    found = axes(turned(on_grid(medium, "few"), angle))["symmetry"]
    assert found.verdict == "failed"
    said = found.sentence
    assert said.startswith("The mount looks turned by ")
    assert (" deg more than " in said) == (angle > 0)
    # up to 1.7 % of horizontal force, 1 deg, is in the published tables themselves
    assert float(said.split()[5]) == pytest.approx(8, abs=1.1)


def test_a_mount_that_is_not_turned_far_enough_to_tell() -> None:
    assert axes(turned(on_grid("poppy_CP", "few"), 1.5))["symmetry"].verdict == "passed"


def test_pulling_up_harder_than_pushing_down() -> None:
    table = on_grid("poppy_CP", "few")
    here = (table["beta_deg"] == 0) & (table["gamma_deg"] == -90)
    table.loc[here, "alpha_z_N_per_cm3"] = -0.6
    found = axes(table)["up_down"]
    assert found.verdict == "failed"
    assert "intrusions and extractions are exchanged" in found.sentence


def test_errors_decide_what_is_significant() -> None:
    """The same table with a known, larger spread from bed to bed fails nothing."""
    wrong = turned(on_grid("poppy_CP", "few"), 4)
    assert axes(wrong)["symmetry"].verdict == "failed"
    wide = wrong.assign(alpha_x_se_N_per_cm3=0.02, alpha_z_se_N_per_cm3=0.02, spread="stated")
    assert axes(wide)["symmetry"].verdict == "passed"


def few_cells(rows: Sequence[tuple[float, ...]], **columns: Any) -> pd.DataFrame:
    """A table of some cells: beta, gamma, alpha_z, alpha_x, and their standard errors; errors are known."""
    names = ["alpha_z", "alpha_x", "alpha_z_se", "alpha_x_se"]
    table = pd.DataFrame(
        rows, columns=["beta_deg", "gamma_deg", *(f"{n}_N_per_cm3" for n in names)]
    )
    return table.assign(**{"medium": "m", "spread": "stated", "run_ids": "", "flags": ""} | columns)


@pytest.mark.parametrize("work", [-0.0049, -0.0051, 0.02])
def test_work_is_what_the_force_does_along_the_motion(work: float) -> None:
    """D = alpha_x cos gamma + alpha_z sin gamma; found and allowed are of the cell that misses most."""
    gamma = 30.0
    # any force whose part along the motion is the wanted one
    z, x = np.array([[0.5, 0.866025], [0.866025, -0.5]]) @ [work, 0.4]
    table = few_cells([(0, 90, 0.3, 0, 0.01, 0.01), (30, gamma, z, x, 0.001, 0.001)])
    found = axes(table)["work"]
    assert found.verdict == "passed"
    assert found.allowed.startswith("D of -0.005 N/cm^3 or more in all but 2 cells")
    # the push has D = 0.3 and may have -0.02
    assert (
        found.found
        == f"{int(work < -0.005)} of 2 cells give energy back, the lowest D = {work:.3g} N/cm^3"
    )


def test_how_far_noise_may_bring_the_work_below_zero() -> None:
    """Three standard errors of D, of a push straight down two; none is asked to be below 0.005 N/cm^3."""

    def counted(gamma: float, z: float, x: float, se_z: float, se_x: float) -> str:
        return str(axes(few_cells([(0, gamma, z, x, se_z, se_x)]))["work"].found[0])

    assert [counted(90, z, 0, 0.1, 9) for z in (-0.199, -0.201)] == ["0", "1"]
    assert [counted(0, 0, x, 9, 0.1) for x in (-0.299, -0.301)] == ["0", "1"]
    # cos^2 and sin^2 of the errors of x and z
    limit = 3 * math.hypot(0.1 * math.cos(math.radians(30)), 0.2 * math.sin(math.radians(30)))
    for share, said in ((0.99, "0"), (1.01, "1")):
        z, x = -share * limit * 0.5, -share * limit * math.cos(math.radians(30))
        assert counted(30, z, x, 0.2, 0.1) == said
    # an error that is not known is none
    assert counted(0, 0, -0.0051, math.nan, math.nan) == "1"


def test_a_bed_adds_its_scatter_where_that_is_not_known() -> None:
    """0.005 N/cm^3, or 2 % of the largest alpha of a weak medium, beside the stated errors."""

    def limit(largest: float, spread: str) -> float:
        rows = [(0, 90, largest, 0, 0.003, 0.004), (0, 0, 0, -1.0, 0.0, 0.004)]
        found = axes(few_cells(rows, spread=spread))["work"].allowed
        return float(found.split()[2])

    assert limit(5.0, "stated") == pytest.approx(-3 * 0.004)
    for spread in ("one bed as prepared", "repeats of the cell"):
        assert limit(5.0, spread) == pytest.approx(-3 * math.hypot(0.004, 0.005), rel=0.01)
    # 2 % of 1 N/cm^3, the size of the other cell's alpha_x
    assert limit(0.1, "one bed as prepared") == pytest.approx(
        -3 * math.hypot(0.004, 0.005), rel=0.01
    )
    weak = few_cells([(0, 90, 0.1, 0, 0.003, 0.004), (0, 0, 0, -0.1, 0.0, 0.004)])
    found = axes(weak.assign(spread="one bed as prepared"))["work"].allowed
    assert float(found.split()[2]) == pytest.approx(-3 * math.hypot(0.004, 0.002), rel=0.01)


def test_how_much_a_level_plate_may_feel_sideways() -> None:
    """4 % of alpha_z, and three standard errors."""
    se = 0.002
    limit = math.hypot(0.04 * 0.5, 3 * se)
    for x, verdict in (
        (0.99 * limit, "passed"),
        (-0.99 * limit, "passed"),
        (1.01 * limit, "failed"),
    ):
        found = axes(few_cells([(0, 90, 0.5, x, se, se)]))["symmetry"]
        assert found.verdict == verdict
        assert found.found == f"alpha_x/alpha_z at (0, 90) deg is {100 * x / 0.5:.1f} %"
        assert found.allowed == f"{100 * limit / 0.5:.1f} % of either sign"


@pytest.mark.parametrize(("angle", "named"), [(9.9, "The mount"), (10.1, "A level plate")])
def test_a_mount_is_not_said_to_be_turned_by_more_than_ten_degrees(
    angle: float, named: str
) -> None:
    a = math.radians(angle)
    rows = [(0, 90, 0.5 * math.cos(a), -0.5 * math.sin(a), 0.001, 0.001)]
    # the pull is filed turned, as all extractions are
    rows.append((0, -90, -0.1 * math.cos(a), -0.1 * math.sin(a), 0.001, 0.001))
    found = axes(few_cells(rows))["symmetry"]
    assert found.verdict == "failed"
    assert found.sentence.startswith(named)
    if named == "The mount":
        assert (
            "turned by 9.9 deg more than stated (alpha_x/alpha_z at (0, 90) deg is -17.5 %"
            in found.sentence
        )
        # a zero of either sign
        assert ", 0.0 % with that put right)" in found.sentence.replace("-0.0", "0.0")


def test_a_turn_is_measured_by_push_and_pull_as_they_are_large() -> None:
    """A pull whose alpha_x says nothing of a turn takes its share of the angle."""
    rows = [(0, 90, 0.5, -0.03, 0.001, 0.001), (0, -90, -0.5, 0.0, 0.001, 0.001)]
    turn = math.degrees(math.atan2(0.5 * 0.03, 2 * 0.5**2))
    assert f"turned by {turn:.1f} deg more" in axes(few_cells(rows))["symmetry"].sentence


def test_what_a_turn_leaves_over_is_the_difference_of_the_angles() -> None:
    """A push along a rise of 0.32 and a pull along none: turned by 0.16, tan(a - b) is left."""
    rows = [(0, 90, 0.5, -0.16, 0.03, 0.03), (0, -90, -0.5, 0.0, 0.001, 0.001)]
    left = (0.32 - 0.16) / (1 + 0.32 * 0.16)
    said = axes(few_cells(rows))["symmetry"].sentence
    assert f"turned by {math.degrees(math.atan(0.16)):.1f} deg more" in said
    assert f", {-100 * left:.1f} % with that put right)" in said


def test_how_much_harder_than_down_up_may_be() -> None:
    """Three standard errors of the difference."""
    limit = 3 * math.hypot(0.01, 0.02)
    for more, verdict in ((0.99 * limit, "passed"), (1.01 * limit, "failed")):
        rows = [(0, 90, 0.2, 0, 0.01, 0), (0, -90, -0.2 - more, 0, 0.02, 0)]
        found = axes(few_cells(rows))["up_down"]
        assert found.verdict == verdict
        assert found.found == f"alpha_z(0, 90) = 0.2, alpha_z(0, -90) = {-0.2 - more:.3g} N/cm^3"
    assert axes(few_cells(rows[:1]))["up_down"].verdict == "not checked"
    assert axes(few_cells(rows[1:]))["up_down"].verdict == "not checked"


def test_what_is_said_of_the_level_plate() -> None:
    """Every word of what is not checked, failed and passed: these sentences are what a person reads."""
    push = (0, 90, 0.5, 0.0, 0.001, 0.001)
    assert check_axes(few_cells([]), "transducer.axes") == [
        Check(name, "not checked", "no cell has alpha") for name in ("work", "symmetry", "up_down")
    ]
    without = axes(few_cells([(0, 0, 0.0, 0.3, 0.001, 0.001)]))
    assert without["symmetry"] == Check("symmetry", "not checked", "no alpha at (0, 90) deg")
    assert without["up_down"] == Check(
        "up_down", "not checked", "no alpha at (0, 90) or at (0, -90) deg"
    )
    nothing = axes(few_cells([(0, 90, 0.0, 0.0, 0.001, 0.001)]))["symmetry"]
    assert nothing == Check("symmetry", "not checked", "alpha_z at (0, 90) deg is 0")
    slanted = axes(few_cells([(0, 90, 0.5, 0.25, 0.001, 0.001)]))["symmetry"]
    assert slanted == Check(
        "symmetry", "failed", "alpha_x/alpha_z at (0, 90) deg is 50.0 %", "4.0 % of either sign",
        "A level plate pushed straight down feels a horizontal force (alpha_x/alpha_z at (0, 90) deg is "
        "50.0 %): look at transducer.axes, at transducer.turn_deg and at the angle of the plate.",
    )  # fmt: skip
    a = math.radians(5)
    turned = axes(few_cells([(0, 90, 0.5 * math.cos(a), 0.5 * math.sin(a), 0.001, 0.001)]))[
        "symmetry"
    ]
    assert turned.sentence == (
        "The mount looks turned by 5.0 deg less than stated (alpha_x/alpha_z at (0, 90) deg is 8.7 %, 0.0 % "
        "with that put right): look at transducer.turn_deg, else for a bent plate or a slanted bed."
    )
    up = axes(few_cells([push, (0, -90, -0.6, 0.0, 0.001, 0.001)]))["up_down"]
    assert up == Check(
        "up_down", "failed", "alpha_z(0, 90) = 0.5, alpha_z(0, -90) = -0.6 N/cm^3",
        "alpha_z(0, 90) above the size of alpha_z(0, -90)",
        "Pulling a level plate up takes more than pushing it down (alpha_z(0, 90) = 0.5, alpha_z(0, -90) = "
        "-0.6 N/cm^3): look whether intrusions and extractions are exchanged in the run sheet.",
    )  # fmt: skip


def test_one_cause_is_told_once() -> None:
    """Axes that mend the work, and the level plate with it, are named by the check of the work alone."""
    table = on_grid("poppy_LP", "few")
    found = axes(measured_with(table, "+x", "+z"))
    assert found["symmetry"].verdict == "failed"
    assert found["symmetry"].sentence == "The same cause as of the check work."
    reversed_z = axes(measured_with(table, "-z", "+x"))
    assert (reversed_z["symmetry"].verdict, reversed_z["up_down"].verdict) == ("passed", "failed")
    assert reversed_z["up_down"].sentence == "The same cause as of the check work."
    # ratios of exchanged axes are no percentages
    assert "%" not in found["symmetry"].found


def test_errors_are_exchanged_with_the_axes() -> None:
    """A cell that noise of its true alpha_x explains gives no energy back once the axes are put right."""
    rows = [(0, 90, 0.0, 0.5, 0.001, 0.001), *[(0, 0, 0.3, -0.3, 0.001, 0.001)] * 3]
    for se_z, said in ((0.01, "none"), (0.001, "1")):
        noisy = few_cells([*rows, (30, 0, -0.02, 0.0, se_z, 0.0001)])
        assert axes(noisy)["work"].sentence == (
            f"X and z look exchanged (3 of 5 cells give energy back; {said} of them with that put right): look at "
            "transducer.axes."
        )


def test_axes_that_mend_nothing_are_not_named() -> None:
    """Forces that give energy back whatever the axes are called."""
    rows = [(0, 45, z, x, 0.001, 0.001) for z in (-0.2, 0.2) for x in (-0.2, 0.2)] * 3
    said = axes(few_cells(rows))["work"].sentence
    assert said.startswith(
        "The signs of forces or motion are wrong (3 of 12 cells give energy back)"
    )


def test_runs_of_several_cells_that_give_energy_back_are_each_flagged() -> None:
    rows = [
        (0, 90, 0.5, 0, 0.001, 0.001),
        (30, 0, 0, -0.1, 0.001, 0.001),
        (60, 0, 0, -0.1, 0.001, 0.001),
    ]
    table = few_cells(rows, run_ids=["a", "b c", "d"])
    assert axes(table)["work"].runs == tuple(remark("gives-back", run_id=run) for run in "bcd")


def test_a_cell_without_alpha_is_left_out_whole() -> None:
    """Also where only one of its components is missing; places of the others do not move."""
    rows = [(0, 60, math.nan, -9, 0, 0), (0, 45, -9, math.nan, 0, 0), (0, 90, -0.5, 0, 0.01, 0.01)]
    found = axes(few_cells(rows))
    assert found["work"].found.startswith("1 of 1 cells give energy back, the lowest D = -0.5")
    assert found["symmetry"].verdict == "passed"
    nothing = axes(few_cells(rows[:2]))
    assert {one.verdict for one in nothing.values()} == {"not checked"}


def test_two_cells_are_no_verdict_and_three_are() -> None:
    table = on_grid("poppy_CP", "few")
    sure = table.index[(table["gamma_deg"] == 0) & (table["beta_deg"].isin([30.0, 60.0, -60.0]))]
    for bad, verdict in ((sure[:2], "passed"), (sure, "failed")):
        changed = table.copy()
        changed.loc[bad, "alpha_x_N_per_cm3"] = -0.1
        found = axes(changed)["work"]
        assert found.verdict == verdict
        assert found.found.startswith(f"{len(bad)} of 91 cells")


def test_one_push_that_pulls_is_enough() -> None:
    table = alpha_frame("poppy_CP", one_cell(-0.5))
    assert axes(table)["work"].verdict == "failed"


def test_size_passes_what_nobody_expected_and_says_so() -> None:
    table = alpha_frame("poppy_CP", one_cell(0.5))
    silent = check_size(table, None)
    assert (silent.verdict, "not checked" in silent.sentence) == ("not checked", True)
    assert check_size(table, (0.4, 0.6)).verdict == "passed"
    for value in (0.3, 0.7):
        found = check_size(alpha_frame("poppy_CP", one_cell(value)), (0.4, 0.6))
        assert found.verdict == "failed"
        assert "0.4 to 0.6" in found.sentence
    for value in (0.005, 20.0):
        assert check_size(alpha_frame("poppy_CP", one_cell(value)), None).verdict == "failed"
    nothing = Check("size", "not checked", "no alpha at (0, 90) deg")
    assert check_size(table.assign(alpha_z_N_per_cm3=math.nan), (0.4, 0.6)) == nothing
    assert check_size(few_cells([(0, 0, 0.0, 0.3, 0.001, 0.001)]), (0.4, 0.6)) == nothing
    for value in (0.4, 0.6, -0.5):
        assert check_size(few_cells([(0, 90, value, 0, 0, 0)]), (0.4, 0.6)) == Check(
            "size", "passed", f"alpha_z(0, 90) = {value:g} N/cm^3", "0.4 to 0.6 N/cm^3"
        )
    assert silent.allowed == "0.01 to 10 N/cm^3"
    for expected, whose, limits in (
        ((0.4, 0.6), "expected_alpha", "0.4 to 0.6"), (None, "any granular medium", "0.01 to 10"),
    ):  # fmt: skip
        told = "alpha_z(0, 90) = 11 N/cm^3"
        assert check_size(few_cells([(0, 90, 11.0, 0, 0, 0)]), expected) == Check(
            "size", "failed", told, f"{limits} N/cm^3",
            f"The scale of the force or the size of the plate looks wrong: {told}, {whose} has {limits} "
            "N/cm^3: look at the unit of the force and at the size of the plate.",
        )  # fmt: skip


def runs(*names: str, **facts: Any) -> dict[str, Any]:
    plate = {"kind": "plate", "tare_run": "rod", "direction": "intrusion", "intruder": ""}
    return {name: SimpleNamespace(**plate | facts | {"force_log": name}) for name in names}


@pytest.mark.parametrize(("rod", "verdict"), [(0.2, "passed"), (5.0, "failed")])
def test_rods_that_feel_more(rod: float, verdict: str) -> None:
    names = ("a", "b", "c")
    tares = pd.DataFrame(
        {"run_id": names, "tare_run": "rod", "force_rms_N": [2.0, 3, 4], "tare_rms_N": rod}
    )
    assert check_rods(tares, runs(*names)).verdict == verdict
    assert check_rods(tares.assign(tare_run=""), runs(*names)).verdict == "not checked"


def test_which_rods_are_compared() -> None:
    """Of strokes that go down where there are any; of those whose forces are known."""
    sheet = (
        runs("a", "b", "c") | runs("up", "up2", direction="extraction") | runs("leg", kind="leg")
    )
    tares = pd.DataFrame(
        {
            "run_id": [*sheet],
            "tare_run": "rod",
            "force_rms_N": 2.0,
            "tare_rms_N": [1.0, 1.0, 3.0, 9, 9, 9],
        }
    )
    good = check_rods(tares, sheet)
    assert good == Check(
        "rods",
        "passed",
        "a rod alone feels 0.5 times what plate and rod feel (median of 3 runs)",
        "less than 1",
    )
    # three runs of six have no tare force, or feel nothing themselves
    some = tares.assign(
        tare_rms_N=[1.0, math.nan, 3.0, 9, 9, 9], force_rms_N=[2.0, 2.0, 0.0, 2, 2, 2]
    )
    assert "0.5 times" in check_rods(some, sheet).found
    assert "median of 1 runs" in check_rods(some, sheet).found
    pulls = check_rods(tares[3:], sheet)
    assert pulls == Check(
        "rods", "failed", "a rod alone feels 4.5 times what plate and rod feel (median of 2 runs)", "less than 1",
        "Logs of plates and rods look exchanged, or are the same (a rod alone feels 4.5 times what plate and rod "
        "feel (median of 2 runs)): look at kind and tare_run of the run sheet.",
    )  # fmt: skip
    assert check_rods(tares[5:], sheet) == Check("rods", "not checked", "no plate run has a tare")


def test_copies_are_told_from_runs_of_one_file() -> None:
    by_id = runs("a", "b", "c", "d") | runs("rod1", "rod2", kind="rod")
    by_id["d"].force_log = "c"
    table = pd.DataFrame({"run_id": list(by_id), "readings": ["1", "1", "2", "2", "3", "3"]})
    # c and d are one file by the sheet, the rods may be copies
    assert same_readings(by_id, table) == {"a": ("b",), "b": ("a",), "c": (), "d": ()}
    # of a log that says nothing there is no digest
    assert same_readings(by_id, table.assign(readings="")) == {}


RANGE_N = (100.0, 50.0, 200.0)


def channels_of(
    *logs: tuple[dict[str, Any], dict[str, Any]], constant: tuple[str, ...] = ()
) -> Any:
    """Check the channels of some logs, each of its own run; F1 is x, F2 is y, F3 is z.

    `logs`: What the sheet says of the run, and of its channels the lowest and the highest reading, the
    share of the stroke at one reading, and that reading.
    """
    usual = {"kind": "plate", "direction": "intrusion", "beta_deg": 30.0, "gamma_deg": 60.0}
    sheet, rows = {}, []
    for number, (run, channels) in enumerate(logs):
        name = f"r{number}"
        sheet[name] = SimpleNamespace(**usual | {k: v for k, v in run.items() if k != "status"})
        row: dict[str, Any] = {"run_id": name, "status": run.get("status", "read")}
        for channel in ("F1", "F2", "F3"):
            low, high, share, held = channels.get(
                channel, (0.0, 5.0 if channel != "F2" else 0.2, 0.001, 1.0)
            )
            row |= {f"{channel}_low_N": low, f"{channel}_high_N": high}
            row |= {f"{channel}_held": share, f"{channel}_held_N": held}
        rows.append(row)
    columns = {
        name: SimpleNamespace(constant=0.0 if name in constant else None)
        for name in ("F1", "F2", "F3")
    }
    config = SimpleNamespace(
        transducer=SimpleNamespace(
            axes=SimpleNamespace(x="+F1", y="-F2", z="-F3"), range_N=RANGE_N, precision_N=0.05
        ),
        force_log=SimpleNamespace(columns=columns),
    )
    facts = pd.DataFrame(rows or {"status": [], "F1_low_N": []})
    return check_channels(config, sheet, facts)  # type: ignore[arg-type]


FINE: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
DEAD_Z = {"F3": (1.5, 1.5, 1.0, 1.5)}


def test_channels_that_move_pass() -> None:
    found = channels_of(FINE, FINE, FINE)
    assert (found.verdict, found.found, found.runs) == ("passed", "3 logs", ())
    assert found.allowed == "below 50% of a stroke at one reading, no end in common below the range"


@pytest.mark.parametrize(
    ("dead", "fine", "verdict"), [(2, 2, "passed"), (2, 0, "failed"), (3, 9, "failed")]
)
def test_a_dead_channel_shows_in_three_logs_or_in_all(dead: int, fine: int, verdict: str) -> None:
    found = channels_of(*[({}, DEAD_Z)] * dead, *[FINE] * fine)
    assert found.verdict == verdict
    if verdict == "failed":
        assert found.sentence == (
            f"F3, along z, is constant in {dead} of {dead + fine} logs: look at its cable and its column."
        )
        assert found.runs == tuple(
            remark("channel-still", run_id=f"r{n}", channel="F3") for n in range(dead)
        )


def test_runs_of_each_dead_channel_are_told() -> None:
    dead_x = {"F1": (0.0, 0.0, 1.0, 0.0)}
    found = channels_of(*[({}, dead_x)] * 3, *[({}, DEAD_Z)] * 3)
    told = [one.values["channel"] for one in found.runs if one.code == "channel-still"]
    assert told == ["F1"] * 3 + ["F3"] * 3
    assert [one.run_id for one in found.runs] == [f"r{n}" for n in range(6)]


@pytest.mark.parametrize(("share", "verdict"), [(0.499, "passed"), (0.5, "failed")])
def test_a_channel_that_stands_still_half_a_stroke(share: float, verdict: str) -> None:
    found = channels_of(*[({}, {"F3": (0.0, 2.0, share, 1.0)})] * 3)
    assert found.verdict == verdict
    assert ("F3, along z, stands still in 3 of 3 logs" in found.found) == (verdict == "failed")


def test_whose_channels_are_looked_at() -> None:
    """Not those of rods, of logs that were not read; of strokes only what goes deeper has to move."""
    for other in (
        {"kind": "rod"},
        {"status": "refused"},
        {"direction": "horizontal"},
        {"direction": "extraction"},
    ):
        assert channels_of(*[(other, DEAD_Z)] * 3, FINE).verdict == "passed"
        assert channels_of(*[(other, DEAD_Z)] * 3).verdict == (
            "passed" if "direction" in other else "not checked"
        )
    turning = {"kind": "leg", "direction": "rotation"}
    assert channels_of(*[(turning, DEAD_Z)] * 3, FINE).verdict == "failed"
    assert channels_of(*[({}, DEAD_Z)] * 3, constant=("F3",)).verdict == "passed"
    assert channels_of() == Check("channels", "not checked", "no readings of channels")
    # one push is all there is
    assert channels_of(({}, DEAD_Z)).verdict == "failed"
    dead_x = {"F1": (0.0, 0.0, 1.0, 0.0)}
    assert channels_of(*[({}, dead_x | DEAD_Z)] * 3, constant=("F1",)).found.startswith(
        "F3, along z"
    )
    level = {"beta_deg": 0.0, "gamma_deg": 90.0}
    assert channels_of(*[(level, DEAD_Z)] * 3).verdict == "failed"


def test_what_feels_nothing_sideways_by_symmetry_is_no_dead_x() -> None:
    dead = {"F1": (0.0, 0.0, 1.0, 0.0)}
    for beta in (0.0, 90.0):
        assert channels_of(*[({"beta_deg": beta, "gamma_deg": 90.0}, dead)] * 3).verdict == "passed"
    found = channels_of(*[({}, dead)] * 3)
    assert found.sentence.startswith("F1, along x, is constant in 3 of 3 logs")
    both = channels_of(*[({}, dead | DEAD_Z)] * 3)
    assert both.found.startswith(
        "F1, along x, is constant in 3 of 3 logs: look at its cable and its column; F3"
    )


@pytest.mark.parametrize(
    ("low", "high", "share", "held", "count", "verdict"),
    [
        (0.0, 80.0, 0.03, 80.0, 3, "failed"),
        (0.0, 80.0, 0.03, 80.0, 2, "passed"),
        (0.0, 80.0, 0.029, 80.0, 3, "passed"),
        (-80.0, 0.0, 0.03, -80.0, 3, "failed"),
        (0.0, 80.0, 0.03, 40.0, 3, "passed"),
        (0.0, 99.1, 0.03, 99.1, 3, "passed"),
        (0.0, 98.9, 0.03, 98.9, 3, "failed"),
        (-99.1, 0.0, 0.03, -99.1, 3, "passed"),
        (80.0, 80.0, 0.03, 80.0, 3, "passed"),
    ],
)
def test_a_channel_that_ends_below_its_range(
    low: float, high: float, share: float, held: float, count: int, verdict: str
) -> None:
    """The range of F1 is 100 N; what ends there is told by other words, run by run."""
    clipped = {"F1": (low, high, share, held)}
    # pulls and level paths are looked at too
    ways: tuple[dict[str, Any], ...] = (
        {},
        {"direction": "extraction"},
        {"direction": "horizontal"},
    )
    found = channels_of(*[(way, clipped) for way in ways[:count]], FINE)
    assert found.verdict == verdict
    if verdict == "failed":
        assert found.found == (
            f"F1, along x, stops at {held:g} N in 3 of 4 logs, below its range: look at the range of "
            "amplifier and logger"
        )
        assert found.runs == tuple(
            remark("channel-clipped", run_id=f"r{n}", channel="F1", newtons=held) for n in range(3)
        )


def test_ends_in_common_are_one_reading() -> None:
    ends = [{"F3": (0.0, end, 0.1, end)} for end in (20.0, 20.0, 21.0, 21.0)]
    assert channels_of(*[({}, end) for end in ends]).verdict == "passed"
    assert channels_of(*[({}, end) for end in (*ends, ends[0])]).verdict == "failed"


@pytest.mark.parametrize(
    ("across", "along", "verdict"),
    [(1.1, 0.5, "failed"), (0.9, 0.5, "passed"), (0.49, 0.1, "passed"), (0.51, 0.1, "failed")],
)
def test_x_and_y_exchanged(across: float, along: float, verdict: str) -> None:
    """y, across the motion, feels more than twice what x does, and more than ten times the precision."""
    facts = {"F1": (-1.0, along - 1, 0.001, 0.0), "F2": (2.0, 2 + across, 0.001, 0.0)}
    level = {"beta_deg": 0.0, "gamma_deg": 90.0}
    found = channels_of(*[({}, facts)] * 2, *[(level, {})] * 5)
    assert found.verdict == verdict
    if verdict == "failed":
        assert found.found == (
            f"x and y look exchanged: F2, across the motion, feels {across / along:.3g} times what F1, along "
            "it, does: look at transducer.axes"
        )
    # not of strokes that feel nothing sideways by symmetry
    assert channels_of(*[(level, facts)] * 3).verdict == "passed"


def test_copies_are_listed_with_what_they_are_copies_of() -> None:
    logs = {"c": ("b", "d"), "b": ("c", "d"), "d": ("b", "c")}
    told = "3 runs have the readings of others: b and c, d"
    assert check_logs(runs("a", "b", "c", "d"), logs) == Check(
        "same_logs", "failed", told, "each log once",
        f"Copies of a log are no repeats ({told}): look at force_log of these runs, and leave out the copies.",
        tuple(remark("same-readings", run_id=run, runs=others)
              for run, others in (("b", "c, d"), ("c", "b, d"), ("d", "b, c"))),
    )  # fmt: skip
    assert check_logs(runs("a"), {"a": ()}) == Check(
        "same_logs", "passed", "no log is there twice", "each log once"
    )
    assert check_logs(runs("a"), {}) == Check(
        "same_logs", "not checked", "no run has enough readings to tell a copy by"
    )
    # legs are runs too
    turning = runs("a", "b", kind="leg")
    table = pd.DataFrame({"run_id": ["a", "b"], "readings": "1"})
    assert same_readings(turning, table) == {"a": ("b",), "b": ("a",)}


GAMMAS = (45.0, 71.57, 90.0)


def strokes(
    start_cm: float, late_cm: float = 0.0, ways: tuple[str, ...] = ("intrusion", "extraction")
) -> dict[str, pd.DataFrame]:
    """Fits of lines with a free intercept whose stress begins where it is told to."""
    rows = []
    for way in ways:
        for gamma in GAMMAS:
            for number in range(4):
                sign = 1 if way == "intrusion" else -1
                slope = 0.4 if sign > 0 else -0.02
                z0 = start_cm + sign * late_cm * math.sin(math.radians(gamma))
                z0 += 0.002 * (-1) ** number * (1 if sign > 0 else 20)
                rows.append(
                    {
                        "run_id": f"{way}{gamma}{number}", "flags": "", "direction": way,
                        "gamma_deg": sign * gamma, "depth_to_cm": 7.0, "alpha_z_N_per_cm3": slope,
                        "alpha_z_se_N_per_cm3": 0.001, "free_slope_z_N_per_cm3": slope,
                        "intercept_z_N_per_cm2": -z0 * slope, "exponent_z": 1.1,
                        "power_misfit_z_ratio": 1.5,
                    }
                )  # fmt: skip
    return {"fits": pd.DataFrame(rows)}


def settings(role: str = LABORATORY, speed: float = 1.0) -> Any:
    return SimpleNamespace(
        media={"m": SimpleNamespace(role=role)}, arm=SimpleNamespace(speed_cm_per_s=speed)
    )


@pytest.mark.parametrize(
    ("start", "late", "verdict", "named"),
    [
        (0.0, 0.0, "passed", ""),
        (0.08, 0.0, "passed", ""),
        (0.3, 0.0, "failed", "The surface is wrong"),
        (-0.3, 0.0, "failed", "The surface is wrong"),
        (0.0, 0.3, "failed", "The force log is late against the motion log by about 0.3 s"),
        (0.0, -0.3, "failed", "The force log is early against the motion log by about 0.3 s"),
    ],
)
def test_where_stress_begins(start: float, late: float, verdict: str, named: str) -> None:
    found = check_surface(settings(), "m", strokes(start, late))
    assert (found.verdict, found.sentence[: len(named)]) == (verdict, named)


@pytest.mark.parametrize(
    ("misfit", "named"),
    [
        (0.5, "Stress grows as about depth^1.10"),
        (
            [0.5, 1.5] * 12,
            "Stress grows as about depth^1.10, not in proportion to it, or the surface",
        ),
        (math.nan, "The surface is wrong"),
    ],
)
def test_what_an_offset_comes_from_is_what_the_fits_say(misfit: Any, named: str) -> None:
    fits = strokes(0.3)["fits"].assign(power_misfit_z_ratio=misfit)
    assert check_surface(settings(), "m", {"fits": fits}).sentence.startswith(named)


def test_surface_and_lag_together_are_both_named() -> None:
    said = check_surface(settings(), "m", strokes(0.5, 0.3)).sentence
    assert "force log is late" in said
    assert "The surface is wrong" in said


def test_pushes_straight_down_alone_do_not_tell_what_is_off() -> None:
    tables = strokes(0.3, ways=("intrusion",))
    tables["fits"] = tables["fits"][tables["fits"]["gamma_deg"] == 90]
    assert check_surface(settings(), "m", tables).verdict == "failed"
    tables["fits"] = tables["fits"].iloc[:2]
    assert check_surface(settings(), "m", tables).verdict == "not checked"


def test_offset_and_lag_are_found_by_weighted_least_squares() -> None:
    """Errors of a start: alpha's relative one times the end of the window, at least 0.1 mm."""
    noise = np.random.default_rng(5)
    fits = strokes(0.25, 0.35)["fits"]
    fits["alpha_z_se_N_per_cm3"] = fits["alpha_z_N_per_cm3"].abs() * noise.uniform(
        0.0005, 0.02, len(fits)
    )
    fits["intercept_z_N_per_cm2"] *= noise.normal(1, 0.05, len(fits))
    start = -fits["intercept_z_N_per_cm2"] / fits["free_slope_z_N_per_cm3"]
    error = fits["alpha_z_se_N_per_cm3"] / fits["alpha_z_N_per_cm3"].abs() * 7
    late, off = np.polyfit(
        np.sin(np.radians(fits["gamma_deg"])), start, 1, w=1 / error.clip(lower=0.01)
    )
    found = check_surface(settings(), "m", {"fits": fits})
    pushes = start[fits["direction"] == "intrusion"]
    assert found.found == (
        f"stress begins {10 * pushes.median():+.1f} mm below the surface in pushes, "
        f"{10 * (off - late):+.1f} mm in pulls straight up"
    )
    assert f"late against the motion log by about {late / 2:.1g} s" in (
        check_surface(settings(speed=2.0), "m", {"fits": fits}).sentence
    )


def test_what_is_allowed_is_a_millimetre_or_what_scatter_explains() -> None:
    def allowed(scatter: float) -> tuple[str, str]:
        tables = strokes(0.2, ways=("intrusion",))
        fits = tables["fits"].query("gamma_deg == 90").iloc[:3].copy()
        fits["intercept_z_N_per_cm2"] = -0.4 * np.array([0.2 - scatter, 0.2, 0.2 + 5])
        found = check_surface(settings(), "m", {"fits": fits})
        return found.allowed, found.verdict

    assert allowed(0.01) == ("1.0 mm of either sign", "failed")
    # standard error of a median: 1.2533 * 1.4826 * median deviation / sqrt(3)
    se = 1.2533 * 1.4826 / math.sqrt(3)
    for scatter, verdict in ((0.19 / (3 * se), "failed"), (0.21 / (3 * se), "passed")):
        assert allowed(scatter) == (f"{30 * se * scatter:.1f} mm of either sign", verdict)


def test_which_strokes_tell_where_stress_begins() -> None:
    """Steep ones, whose alpha is clear of zero, and whose line with a free intercept has a slope."""
    for column, value in (
        ("gamma_deg", 44.9), ("free_slope_z_N_per_cm3", 0.0), ("alpha_z_se_N_per_cm3", 0.14),
    ):  # fmt: skip
        fits = strokes(0.3, ways=("intrusion",))["fits"].assign(**{column: value})
        assert check_surface(settings(), "m", {"fits": fits}).verdict == "not checked"
    few = Check("surface", "not checked", "too few pushes with a slope of their own")
    assert check_surface(settings(), "m", {"fits": strokes(0.3)["fits"][12:]}) == few
    clear = strokes(0.3, ways=("intrusion",))["fits"].assign(alpha_z_se_N_per_cm3=0.13)
    assert check_surface(settings(), "m", {"fits": clear}).verdict == "failed"
    without = strokes(0.3)["fits"].assign(flag_codes="no-tare zero-drifted")
    assert check_surface(settings(), "m", {"fits": without}) == Check(
        "surface", "not checked", "the force on the rod, which begins elsewhere, is in it"
    )
    assert check_surface(settings("natural_sand"), "m", {"fits": without}) == Check(
        "surface", "not checked", "stress is a line only near the surface of a natural sand"
    )


@pytest.mark.parametrize(("share", "late"), [(0.97, False), (1.03, True)])
def test_scatter_of_the_starts_widens_what_is_allowed_for_a_lag(share: float, late: bool) -> None:
    """Four pushes at two angles, off their line by as much to both sides: the misfit has two degrees of freedom."""
    sine = np.sin(np.radians([45.0, 45.0, 90.0, 90.0]))
    scatter, wide = 0.05, sine[2] - sine[0]
    lag = share * 3 * math.sqrt(2) * scatter / wide
    start = lag * sine + scatter * np.array([1, -1, 1, -1])
    fits = strokes(0.0, ways=("intrusion",))["fits"].iloc[[0, 0, 8, 8]]
    fits = fits.assign(intercept_z_N_per_cm2=-0.4 * start)
    said = check_surface(settings(), "m", {"fits": fits}).sentence
    assert ("force log is late" in said) == late
    # three are too few for a line and its error
    assert "late" not in check_surface(settings(), "m", {"fits": fits[1:]}).sentence


def test_pushes_at_one_angle_alone_name_no_lag() -> None:
    tables = strokes(0.0, 0.4, ways=("intrusion",))
    tables["fits"] = tables["fits"][tables["fits"]["gamma_deg"] == 90]
    assert check_surface(settings(), "m", tables).sentence.startswith("The surface is wrong")


@pytest.mark.parametrize(
    ("curved", "named"),
    [
        (5, "Stress grows as about depth^1.10, not in proportion to it ("),
        (6, "Stress grows as about depth^1.10, not in proportion to it, or"),
        (19, "Stress grows as about depth^1.10, not in proportion to it, or"),
        (20, "The surface is wrong"),
    ],
)
def test_how_many_pushes_speak_for_a_curve(curved: int, named: str) -> None:
    """At least four fifths no worse as a power of depth: a curve; at least four fifths worse: the surface."""
    fits = strokes(0.3, ways=("intrusion",))["fits"]
    fits = pd.concat([fits, fits, fits.iloc[:1]], ignore_index=True)
    fits["power_misfit_z_ratio"] = np.where(np.arange(25) < curved, 1.01, 1.0)
    said = check_surface(settings(), "m", {"fits": fits}).sentence
    assert said.startswith(named)


def test_the_surface_of_a_natural_sand_is_not_judged() -> None:
    found = check_surface(settings("natural_sand"), "m", strokes(0.5))
    assert found.verdict == "not checked"


@pytest.mark.parametrize(("rise", "verdict"), [(0.02, "passed"), (0.3, "failed"), (-0.3, "failed")])
def test_horizontal_runs_that_are_not_steady(rise: float, verdict: str) -> None:
    path = np.linspace(2, 8, 200)
    noise = np.random.default_rng(3)
    parts = []
    for name in "abcd":
        force = 5 * (1 + rise * (path - 5) / 6) + noise.normal(0, 0.1, path.size)
        parts.append(pd.DataFrame({
            "run_id": name, "path_cm": path, "depth_cm": 2.54, "force_z_N": 0.1, "force_x_N": force,
        }))  # fmt: skip
    tared = pd.concat(parts, ignore_index=True)
    fits = pd.DataFrame(
        {"run_id": list("abcd"), "direction": "horizontal", "n_points": 200, "gamma_deg": 0.0}
    )
    windows = pd.DataFrame({"run_id": tared["run_id"], "why": int(RowStatus.GOOD)})
    found = check_steadiness({"fits": fits, "tared": tared, "windows": windows})
    assert found.verdict == verdict
    assert float(found.found.split()[3]) == pytest.approx(100 * rise, abs=1.5)


def level_runs(count: int, rises: tuple[float, ...] = (0.2, 0.2, 0.2)) -> dict[str, pd.DataFrame]:
    """Horizontal runs of so many samples whose force grows by these shares of its mean."""
    path = np.linspace(2, 8, count)
    names = [f"r{n}" for n in range(len(rises))]
    tared = pd.concat(
        pd.DataFrame({"run_id": name, "path_cm": path, "force_z_N": -0.1,
                      "force_x_N": -5 * (1 + rise * (path - 5) / 6)})
        for name, rise in zip(names, rises, strict=True)
    )  # fmt: skip
    tared = tared.reset_index(drop=True)
    fits = pd.DataFrame({"run_id": names, "direction": "horizontal", "n_points": count})
    windows = pd.DataFrame({"run_id": tared["run_id"], "why": int(RowStatus.GOOD)})
    return {"fits": fits, "tared": tared, "windows": windows}


def test_a_trend_is_of_the_larger_force_over_the_good_part() -> None:
    tables = level_runs(60)
    assert (
        check_steadiness(tables).found
        == "stress changes by 20.0 % over the steady part (of 3 runs)"
    )
    # the largest on the whole, not at once
    tables["tared"].loc[::60, "force_z_N"] = 99.0
    assert check_steadiness(tables).found.startswith("stress changes by 20.0 %")
    # what the fit leaves out is left out; what is left is half as long, and its mean larger
    tables["windows"].loc[np.arange(180) % 60 < 30, "why"] = int(RowStatus.GOOD) + 1
    path = np.linspace(2, 8, 60)[30:]
    force = 1 + 0.2 * (path - 5) / 6
    change = 100 * np.ptp(force) / force.mean()
    assert check_steadiness(tables).found.startswith(f"stress changes by {change:.1f} %")


@pytest.mark.parametrize(("samples", "verdict"), [(30, "failed"), (29, "not checked")])
def test_a_trend_needs_thirty_samples(samples: int, verdict: str) -> None:
    assert check_steadiness(level_runs(samples)).verdict == verdict


def test_whose_trend_counts() -> None:
    assert check_steadiness(level_runs(60, (0.2, 0.2))).verdict == "not checked"
    tables = level_runs(60)
    for column, value in (("direction", "intrusion"), ("n_points", 0), ("run_id", "another")):
        one = tables["fits"].copy()
        one.loc[0, column] = value
        assert check_steadiness(tables | {"fits": one}).verdict == "not checked"


def test_what_trend_is_allowed() -> None:
    """A tenth, or three standard errors of the median."""
    told = "stress changes by 10.1 % over the steady part (of 3 runs)"
    assert check_steadiness(level_runs(60, (0.101,) * 3)) == Check(
        "steadiness", "failed", told, "10.0 % of either sign",
        f"Horizontal runs are not steady ({told}): look at fit.horizontal_skip_cm, at the distance to the walls, "
        "and whether the plate goes deeper or piles up the bed.",
    )  # fmt: skip
    found = check_steadiness(level_runs(60, (0.099,) * 3))
    assert (found.verdict, found.allowed) == ("passed", "10.0 % of either sign")
    se = 1.2533 * 1.4826 * 0.1 / math.sqrt(3)
    found = check_steadiness(level_runs(60, (0.1, 0.2, 0.3)))
    assert (found.verdict, found.allowed) == ("passed", f"{300 * se:.1f} % of either sign")


def test_marks_name_what_fails_and_why_it_is_accepted() -> None:
    rows = [
        ("a", "work", "failed", "unusable"), ("a", "surface", "failed", "doubtful"),
        ("b", "size", "accepted", ""), ("c", "work", "passed", ""),
    ]  # fmt: skip
    table = pd.DataFrame(rows, columns=COLUMNS[:4])
    media = {name: Medium(title=name) for name in "ac"}
    media["b"] = Medium(title="b", accept={"size": "pumice"})
    assert marks_of(table, media) == {
        "a": [remark("unusable", checks="work"), remark("doubtful", checks="surface")],
        "b": [remark("accepted", check="size", why="pumice")],
    }
    frame = alpha_frame("poppy_LP", reference.alpha_grid("poppy_LP"))
    assert usable(frame)
    assert not usable(frame.assign(checks_code="unusable doubtful"))
    assert usable(
        frame.assign(checks="accepted: fails work: unusable: I know", checks_code="accepted")
    )


def test_flags_of_single_runs_are_added_to_those_of_their_cells() -> None:
    few = remark("few-depths", found=2, wanted=3)
    table = few_cells([(0, 90, 0.5, 0, 0, 0)] * 3, run_ids=["a b", "c", "d"])
    table = table.assign(**{name: [text, "", text] for name, text in flag_columns([few]).items()})
    bad = [remark("gives-back", run_id="b"), remark("channel-still", run_id="c", channel="F1")]
    checks = [Check("channels", "failed", runs=tuple(bad)), Check("work", "passed")]
    made = marked(table, checks, [remark("unusable", checks="channels")])
    assert made["flag_codes"].tolist() == ["few-depths gives-back", "channel-still", "few-depths"]
    assert made["flags"].tolist() == [f"{few}; b: {bad[0]}", f"c: {bad[1]}", str(few)]
    assert set(made["checks_code"]) == {"unusable"}


def test_an_unusable_medium_stays_out_of_what_is_made_from_several(tmp_path: Any) -> None:
    media = reference.MEDIA[:3]
    alpha = {name: reference.alpha_grid(name) for name in media}
    make_campaign(tmp_path, dict.fromkeys(media, LABORATORY), alpha)
    whole = open_results(tmp_path)
    everything = whole.generic()
    bad = alpha_frame(media[0], alpha[media[0]]).assign(checks_code="unusable")
    results = open_results(tmp_path)
    results.hold(f"alpha/{media[0]}.csv", bad)
    assert results.reference().media == media[1:]
    assert not np.allclose(results.generic(), everything)
    own = [results.fits()[name].used for name in media[1:]]
    zeta = [one[:5].sum() for one in own]
    np.testing.assert_allclose(
        results.generic(), np.mean([c / z for c, z in zip(own, zeta, strict=True)], axis=0)
    )
    # its own table and coefficients are still there
    assert np.isfinite(results[media[0]].coefficients()).all()
    for name in media[1:]:
        results.hold(f"alpha/{name}.csv", bad.assign(medium=name))
    lost = open_results(tmp_path)
    for name in media:
        lost.hold(f"alpha/{name}.csv", bad.assign(medium=name))
    assert np.isnan(lost.generic()).all()
    assert lost.reference().printed
    assert "no medium that passes its checks" in lost[media[0]].profile("generic").reason


def test_a_rod_log_in_place_of_the_plates() -> None:
    """The same log as plate and as rod leaves no force at all: told, and nothing is divided by it."""
    names = [f"alpha_{c}{end}_N_per_cm3" for c in "zx" for end in ("", "_se", "_lo", "_hi")]
    alpha = pd.DataFrame([dict.fromkeys(names, 0.0) | {"beta_deg": 0.0, "gamma_deg": 90.0}])
    alpha = alpha.assign(medium="sand", spread="as prepared", reason="", flags="")
    found = {one.check: one for one in check_axes(alpha, "transducer.axes")}
    assert found["symmetry"].verdict == NOT_CHECKED
    assert "is 0" in found["symmetry"].found
