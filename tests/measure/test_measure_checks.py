"""The checks of a medium pass all published media and name each wrong axis, channel or surface.

Also tested: rods, drift, size of alpha, steadiness, linearity, and copies of logs.
"""

import itertools
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from result_tables import LABORATORY, alpha_frame, make_campaign
from scipy.stats import chi2, norm
from seeds import seeds

import rftfit
from rftfit import reference, rft3d_profile
from rftfit.checks.declared import CHECKS, MediumMeasurements
from rftfit.checks.medium import check_medium
from rftfit.compare.peers import compare_runs
from rftfit.measure.flags import remark
from rftfit.measure.ledger import RowStatus
from rftfit.measure.levels import two_clusters

SCHEMA = Path(__file__).parents[2] / "config" / "config.schema.json"
SETTINGS_OF_MEDIUM = json.loads(SCHEMA.read_text("utf-8"))["$defs"]["MediumSettings"]["properties"]
CHECK_NAMES = SETTINGS_OF_MEDIUM["accept"]["propertyNames"]["enum"]
"""Checks whose failure a config may accept, in the order of the table."""
GRIDS: dict[str, Any] = {
    "coarse": itertools.product((-30, 0, 30, 90), range(-90, 91, 30)),
    "other": itertools.product((-75, -40, -10, 20, 55, 80), (-70, -45, -25, 25, 45, 70)),
    "no-vertical": itertools.product((-60, -20, 20, 60), (-75, -50, -20, 20, 50, 75)),
    "one-row": itertools.product((0,), (-90, -60, -30, 30, 60, 90)),
    "scattered": np.random.default_rng(5).uniform(-90, 90, (25, 2)),
    "straight-down": itertools.product((-60, -30, 0, 30, 60), (90,)),
}
"""Directions, beta and gamma, deg, of grids beside `few`, which is the published table as it is."""
DIRECTIONS_OF_GRID = {name: np.array([*directions], float) for name, directions in GRIDS.items()}


def on_grid(medium, grid):
    """The published table of a medium on another grid."""
    if grid == "few":
        return alpha_frame(medium, reference.alpha_grid(medium))
    directions = DIRECTIONS_OF_GRID[grid].T
    alphas = rftfit.TableProfile.published(medium).alpha(*np.radians(directions))
    columns: dict[str, Any] = {"alpha_x_turn_N_per_cm3": 0.0, "run_ids": ""}
    columns |= dict(zip(("beta_deg", "gamma_deg"), directions, strict=True))
    for c, values in zip("zx", alphas, strict=True):
        columns |= {f"alpha_{c}_N_per_cm3": values, f"alpha_{c}_se_N_per_cm3": 0.003}
    return pd.DataFrame(columns | {"medium": medium, "spread": "scatter between beds not included"})


PULLS = "beta-of-pulls"
"""Axes by which beta of pulls would have the other sign."""
AXES = SimpleNamespace(x="+F1", y="-F2", z="-F3")
"""Channels of a transducer along the axes of the lab."""


ZERO_NAMES = [f"zero_{what}_{c}_N" for what in ("trend", "change") for c in "zx"]
NOISE_NAMES = [f"F{number}_noise_N" for number in (1, 2, 3)]
ALPHA_NAMES = [f"alpha_{c}_N_per_cm3" for c in "zx"]
NO_RUNS_OF_NOTE = {
    "misplaced": pd.DataFrame(),
    "fits": pd.DataFrame(
        columns=["run_id", "direction", "tare_run", "beta_deg", "gamma_deg", *ALPHA_NAMES]
    ),
    "tared": pd.DataFrame(
        columns=["run_id", "depth_cm", "force_z_N", "force_x_N", "tare_z_N", "tare_x_N"]
    ),
    "windows": pd.DataFrame({"why": np.zeros(0, dtype=int)}),
}
"""Tables in which nothing is said of any run."""


GRID = SimpleNamespace(angle_tolerance_deg=0.5)
NO_TABLE: Any = SimpleNamespace(
    table=None,
    transducer=SimpleNamespace(axes=AXES),
    force_log=SimpleNamespace(columns={}),
    grid=GRID,
    fit=SimpleNamespace(confidence=0.95),
)


def measured(sheet=None, config=None, medium=None, copies=(), **tables):
    """A measured medium of which only what a check reads is there."""
    return MediumMeasurements(
        config or NO_TABLE, medium, sheet or {}, NO_RUNS_OF_NOTE | tables, copies
    )


def judge(name, medium_tables):
    """What the check of a name says of a medium."""
    return CHECKS[name].check(medium_tables)


def axes_of_runs(evidence):
    """Table of axes: of each the log of its Bayes factor against the axes as given."""
    evidence = {"as-given": 0.0} | evidence
    return pd.DataFrame({"axes": [*evidence], "log_bayes_factor": [*evidence.values()]})


def axes(table, config=None, **evidence):
    medium_tables = measured(alpha=table, axes=axes_of_runs(evidence), config=config)
    names = "work", "symmetry", "up_down"
    return {name: spoken(judge(name, medium_tables)) for name in names}


@pytest.mark.parametrize(
    ("evidence", "verdict", "code"),
    [
        ({"z-reversed": -9.0}, "passed", "axes"),
        ({"z-reversed": -9.0, PULLS: 1.0}, "passed", "axes-pulls-open"),
        ({"z-reversed": -9.0, PULLS: 9.0}, "failed", "axes-pulls"),
        ({"z-reversed": -9.0, "beta-reversed": -9.0}, "passed", "axes"),
        ({"z-reversed": -9.0, "beta-reversed": -3.0}, "passed", "axes-beta-open"),
        ({"z-reversed": -9.0, "beta-and-x-reversed": -3.0, PULLS: 1.0}, "passed", "axes-beta-open"),
        ({"z-reversed": -3.0, "beta-reversed": -3.0}, "not checked", "axes-open"),
        # what is told comes before what is open
        ({"z-reversed": 1.0, PULLS: 9.0}, "failed", "axes-pulls"),
        ({"z-reversed": 9.0, PULLS: 9.0}, "failed", "axes-others"),
        ({}, "not checked", "axes-no-runs"),
    ],
)
def test_what_the_evidence_says_of_axes_and_of_pulls(evidence, verdict, code):
    check = spoken(judge("axes", measured(axes=axes_of_runs(evidence))))
    assert (check.verdict, check.code) == (verdict, code)


@pytest.mark.parametrize(
    ("evidence", "stated_in"),
    [
        ({"x-reversed": 9.0, "beta-reversed": 4.5}, ["transducer.axes"]),
        ({"x-reversed": -9.0, "beta-reversed": 9.0}, ["beta_deg"]),
        ({"beta-reversed": 9.0, "x-reversed": 9.0}, ["beta_deg", "transducer.axes"]),
    ],
)
def test_axes_that_the_runs_do_not_tell_apart_are_named_together(evidence, stated_in):
    where = judge("axes", measured(axes=axes_of_runs(evidence))).values["where"]
    assert re.findall(r"beta_deg|transducer\.axes", where) == stated_in


def spoken(check):
    """A check whose words take its values."""
    assert check.row("m")
    return check


def negative_cells(table):
    """How many cells give energy back, and of how many."""
    values = axes(table)["work"].values["negative"].values
    return values["count"], values["size"]


def measured_with(table, z, x):
    """What a table would be if the config called other axes z and x; pulls are filed turned."""
    side = np.where(table["gamma_deg"] < 0, -1.0, 1.0)
    true = {c: table[f"alpha_{c}_N_per_cm3"] * (side if c == "x" else 1) for c in "zx"}
    seen = {}
    for name, read in (("z", z), ("x", x)):
        force = true[read[1]] * (1 if read[0] == "+" else -1)
        seen[f"alpha_{name}_N_per_cm3"] = force * (side if name == "x" else 1)
    return table.assign(**seen)


def turned(table, angle_deg):
    """What a table would be if the config stated a turn that is smaller by so much."""
    side = np.where(table["gamma_deg"] < 0, -1.0, 1.0)
    z, x = table["alpha_z_N_per_cm3"], table["alpha_x_N_per_cm3"] * side
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return table.assign(
        alpha_z_N_per_cm3=cosine * z + sine * x, alpha_x_N_per_cm3=side * (cosine * x - sine * z)
    )


@pytest.mark.parametrize("grid", ["few", *GRIDS])
@pytest.mark.parametrize("medium", reference.MEDIA)
def test_no_published_table_fails(medium, grid):
    table = on_grid(medium, grid)
    verdicts = {name: check.verdict for name, check in axes(table).items()}
    assert "failed" not in verdicts.values()
    assert verdicts["work"] == "passed"
    # what needs a push straight down is not said to have passed without one
    has_push = ((table["beta_deg"] == 0) & (table["gamma_deg"] == 90)).any()
    assert verdicts["symmetry"] == ("passed" if has_push else "not checked")


def few_cells(rows, **columns):
    """A table of some cells: beta, gamma, alpha_z, alpha_x, and their standard errors; errors are known."""
    names = ["alpha_z", "alpha_x", "alpha_z_se", "alpha_x_se"]
    table = pd.DataFrame(
        rows, columns=["beta_deg", "gamma_deg", *(f"{n}_N_per_cm3" for n in names)]
    )
    usual: dict[str, Any] = {"medium": "m", "spread": "stated", "run_ids": ""}
    return table.assign(**usual | {"alpha_x_turn_N_per_cm3": 0.0} | columns)


@pytest.mark.parametrize("work", [-0.0049, -0.0051, 0.02])
def test_work_is_what_the_force_does_along_the_motion(work):
    """D = alpha_x cos gamma + alpha_z sin gamma; found and allowed are of the cell that misses most."""
    gamma = 30.0
    # any force whose part along the motion is the wanted one
    z, x = np.array([[0.5, 0.866025], [0.866025, -0.5]]) @ [work, 0.4]
    table = few_cells([(0, 90, 0.3, 0, 0.01, 0.01), (30, gamma, z, x, 0.001, 0.001)])
    check = axes(table)["work"]
    assert check.verdict == "passed"
    assert check.values["allowed"] == remark("few-cells-no-push", count=1, clear=1)
    # the push has D = 0.3 and may have -0.02
    assert negative_cells(table) == (work < -0.005, 2)
    assert check.values["worst"] == pytest.approx(work, abs=1e-6)
    assert check.values["noise"] == -0.005


def test_one_cell_alone_may_not_give_energy_back():
    """Of few cells all that give energy back are no accident; of many, two are."""
    away = (30, 0, 0, -0.1, 0.001, 0.001), (30, 0, 0, 0.1, 0.001, 0.001)
    for cells, verdict in (
        (away[:1], "failed"),
        (away[1:], "passed"),
        (away[:1] * 2, "failed"),
        (away, "passed"),
        ([(0, 90, -0.5, 0, 0.01, 0.01)], "failed"),
    ):
        assert axes(few_cells(cells))["work"].verdict == verdict


def test_a_pair_that_contradicts_its_mirror_image_is_no_symmetry():
    """A plate filed with the wrong sign of beta; one turn of the mount cannot explain it."""
    sound = [(0, 90, 0.35, 0, 0.01, 0.01), (60, 90, 0.15, -0.12, 0.01, 0.01), (-60, 90, 0.15, 0.12, 0.01, 0.01),
             (30, 90, 0.3, -0.08, 0.01, 0.01), (-30, 90, 0.3, 0.08, 0.01, 0.01)]  # fmt: skip
    assert axes(few_cells(sound))["symmetry"].verdict == "passed"
    sound[1] = (60, 90, 0.15, 0.12, 0.01, 0.01)
    check = axes(few_cells(sound))["symmetry"]
    assert (check.verdict, check.code) == ("failed", "symmetry-pair")
    assert (check.values["size_deg"], check.values["gamma_deg"]) == (60, 90)


def peers_of(count, **columns):
    """Runs r2, r3 and so on beside their repeats, none of which stands apart but for these columns."""
    usual = {"times_spread": 1.0, "apart": False, "beside": "repeats", "seen_from_ratio": 0.2}
    usual |= {
        "off_z_ratio": 0.0,
        "off_x_ratio": 0.0,
        "beta_deg": 0.0,
        "gamma_deg": 90.0,
        "n_others": 5,
    }
    return pd.DataFrame({"run_id": [f"r{n}" for n in range(2, 2 + count)], **usual, **columns})


@pytest.mark.parametrize(("least", "verdict"), [(0.3, "passed"), (0.5, "not checked")])
def test_a_difference_that_would_not_be_seen_is_not_checked(least, verdict):
    peers = peers_of(6, seen_from_ratio=least, beside="map")
    check = judge("repeats", measured(sheet_of("p" * 6), peers=peers))
    assert (check.verdict, check.values["median"]) == (verdict, least)
    assert (check.code == "repeats-blind") == (verdict == "not checked")


@pytest.mark.parametrize(
    ("others", "apart", "is_named"),
    [
        ((0.55, 0.35, 0.1), 1, True),
        # it does not agree at its own angles either, but a third run would explain the first one as well
        ((0.55, 0.35, 0.36), 1, False),
        ((0.55, 0.55, 0.1), 1, False),
        # of two exchanged runs both may be apart
        ((0.55, 0.35, 0.1), 2, False),
    ],
)
def test_a_run_is_exchanged_with_the_only_one_at_whose_angles_both_agree(others, apart, is_named):
    peers = peers_of(3, times_spread=[8.1, 2.0, 7.5], apart=[True, False, False], off_z_ratio=0.1)
    peers.loc[1, "apart"] = apart == 2
    peers["alpha_z_N_per_cm3"] = 0.35, 0.55, 0.5
    peers["others_z_N_per_cm3"] = others
    peers["alpha_x_N_per_cm3"] = peers["others_x_N_per_cm3"] = 0.0
    sentence = judge("repeats", measured(sheet_of("ppp"), peers=peers)).sentence
    assert ("exchanged with r3" in sentence) == is_named
    assert "with r4" not in sentence


@pytest.mark.statistics
def test_of_two_exchanged_runs_the_other_is_named_or_none():
    """Beds of 4 %, media 6 % from the published ones; 12 directions, of which every third was pushed three times."""
    rng = np.random.default_rng(1)
    answers_to: dict[str, list[bool | None]] = {"exchanged": [], "alone": []}
    sheet = sheet_of("p" * 20)
    for run in sheet.values():
        vars(run).update(session="", operator="", plate="", rod="")
    for trial in range(seeds(400, 40)):
        table = on_grid(reference.MEDIA[trial % 5], "coarse").query("gamma_deg > 0").iloc[:12]
        sound = table[["beta_deg", "gamma_deg", *ALPHA_NAMES]].to_numpy(float, copy=True)
        sound[:, 2:] *= rng.normal(1, 0.06, (12, 2))
        sound = np.repeat(sound, [3, 1, 1] * 4, axis=0)
        sound[:, 2:] *= rng.normal(1, 0.04, (20, 1))
        first, second = rng.choice(20, 2, replace=False)
        for mistake, answers in answers_to.items():
            wrong = sound.copy()
            if mistake == "exchanged":
                wrong[[first, second], :2] = sound[[second, first], :2]
            else:
                wrong[first, 2:] *= rng.choice([0.5, 1.6])
            fits = few_cells(np.hstack([wrong, np.full((20, 2), 0.003)]), depth_from_cm=0.0)
            fits["run_id"] = [f"r{row}" for row in range(2, 22)]
            peers = compare_runs(fits, "m")
            if peers["apart"].sum() != 1:
                continue
            check = judge("repeats", measured(sheet, peers=peers, fits=fits))
            (run_apart,) = peers["run_id"][peers["apart"]]
            match = re.search(r"exchanged with (r\d+)", check.sentence)
            true_pair = {f"r{first + 2}", f"r{second + 2}"}
            answers.append(match and {run_apart, match[1]} == true_pair)
    exchanged = [answer for answer in answers_to["exchanged"] if answer is not None]
    assert len(exchanged) >= seeds(30, 2)
    assert np.mean(exchanged) > 0.95
    # of single runs that are wrong for another reason
    assert np.mean([answer is not None for answer in answers_to["alone"]]) < 0.15


def test_two_runs_against_one_may_be_the_wrong_ones():
    peers = peers_of(3, apart=[False, True, False], beside="repeats", n_others=2)
    for name in ("alpha_z", "others_z", "alpha_x", "others_x"):
        peers[f"{name}_N_per_cm3"] = 0.3
    check = judge("repeats", measured(sheet_of("ppp"), peers=peers))
    assert "If r2 and r4 share a mistake, r3 is the good one" in check.sentence


NEXT_TO_EACH_OTHER = "3 of the 4 runs in rows 4 to 7 of the run sheet"
CABLE_OF_X = "the cable and the sign of the channel along x, and at the sign of beta_deg"


@pytest.mark.parametrize(
    ("factor", "se", "rows", "is_opposite"),
    [
        (-1.0, 0.001, (4, 5, 7), True),
        (-0.6, 0.001, (4, 5, 7), True),
        # far from the others, but not of the opposite sign, or not clearly
        (0.4, 0.001, (4, 5, 7), False),
        (-0.2, 0.001, (4, 5, 7), False),
        (-1.0, 0.05, (4, 5, 7), False),
        # scattered over the sheet
        (-1.0, 0.001, (3, 8, 11), True),
    ],
)
def test_runs_of_opposite_sign_are_told_by_their_sign_and_where_they_lie(
    factor, se, rows, is_opposite
):
    sheet = sheet_of("p" * 12)
    is_wrong = np.isin([run.row for run in sheet.values()], rows)
    for run in sheet.values():
        labels = {"operator": "MK", "plate": "", "rod": ""}
        vars(run).update(labels, session="tue" if run.row in (*rows, 12) else "mon")
    alpha = {"alpha_z": 0.3, "others_z": 0.31, "alpha_x": np.where(is_wrong, 0.1 * factor, 0.1)}
    columns = {f"{name}_N_per_cm3": values for name, values in {**alpha, "others_x": 0.1}.items()}
    beside = np.where(is_wrong, "pair", "repeats")
    off = {"apart": is_wrong, "off_x_ratio": 0.6 * is_wrong, "beside": beside}
    peers = peers_of(12, **off, **columns)
    errors = {f"alpha_{c}_se_N_per_cm3": se for c in "zx"}
    fits = peers[["run_id", *ALPHA_NAMES]].assign(**errors)
    check = judge("repeats", measured(sheet, peers=peers, fits=fits))
    assert (check.verdict, check.values["count"]) == ("failed", 3)
    assert (CABLE_OF_X in check.sentence) == is_opposite
    assert ("opposite value of the others in 3 runs" in check.sentence) == is_opposite
    assert (NEXT_TO_EACH_OTHER in check.sentence) == (rows == (4, 5, 7))
    assert "all with session tue" in check.sentence
    assert "operator" not in check.sentence
    assert "one may be good" in check.sentence


@pytest.mark.parametrize(
    ("scatter", "pairs", "code"),
    [
        (0.1, 40, "repeats"),
        (0.11, 40, "repeats-wide"),
        (0.11, 6, "repeats"),
        (0.2, 6, "repeats-wide"),
    ],
)
def test_repeats_that_differ_more_than_ordinary_beds_do(scatter, pairs, code):
    """By more than 10.5 %, and at the lower end of that by more than 8 %: pairs of runs along one force."""
    alpha = 0.3 * (1 + scatter / math.sqrt(2) * np.tile([-1.0, 1.0], pairs))
    runs = few_cells([(place // 2, 90, z, 0, 1e-5, 1e-5) for place, z in enumerate(alpha)])
    tables = {"peers": peers_of(1), "fits": runs}
    check = judge("repeats", measured(sheet_of("p" * 2 * pairs), **tables))
    assert (check.verdict, check.code) == ("failed" if "wide" in code else "passed", code)
    if code == "repeats-wide":
        spread, dof = check.values["spread"], check.values["dof"]
        assert (spread, dof) == (pytest.approx(scatter, rel=0.02), pairs)
        assert check.values["low"] == pytest.approx(spread * math.sqrt(dof / chi2.isf(0.04, dof)))


def test_how_far_noise_may_bring_the_work_below_zero():
    """Three standard errors of D, of a push straight down two; none is asked to be below 0.005 N/cm^3."""

    def counted(gamma, z, x, se_z, se_x):
        return negative_cells(few_cells([(0, gamma, z, x, se_z, se_x)]))[0]

    assert [counted(90, z, 0, 0.1, 9) for z in (-0.199, -0.201)] == [0, 1]
    assert [counted(0, 0, x, 9, 0.1) for x in (-0.299, -0.301)] == [0, 1]
    # cos^2 and sin^2 of the errors of x and z
    limit = 3 * math.hypot(0.1 * math.cos(math.radians(30)), 0.2 * math.sin(math.radians(30)))
    for share, expected_count in ((0.99, 0), (1.01, 1)):
        z, x = -share * limit * 0.5, -share * limit * math.cos(math.radians(30))
        assert counted(30, z, x, 0.2, 0.1) == expected_count
    # an error that is not known is none
    assert counted(0, 0, -0.0051, math.nan, math.nan) == 1


def test_how_much_harder_than_down_up_may_be():
    """Three standard errors of the difference."""
    limit = 3 * math.hypot(0.01, 0.02)
    down = (0, 90, 0.2, 0, 0.01, 0)
    for excess, verdict in ((0.99 * limit, "passed"), (1.01 * limit, "failed")):
        up = (0, -90, -0.2 - excess, 0, 0.02, 0)
        check = axes(few_cells([down, up]))["up_down"]
        assert (check.verdict, check.values) == (verdict, {"down": 0.2, "up": -0.2 - excess})
    for cell, lacking in ((down, "(0, -90)"), (up, "(0, 90)")):
        check = axes(few_cells([cell]))["up_down"]
        assert (check.verdict, check.values) == ("not checked", {"cells": lacking})


def test_a_cell_without_alpha_is_left_out_whole():
    """Also where only one of its components is missing; places of the others do not move."""
    rows = [(0, 60, math.nan, -9, 0, 0), (0, 45, -9, math.nan, 0, 0), (0, 90, -0.5, 0, 0.01, 0.01)]
    axis_checks = axes(few_cells(rows))
    assert axis_checks["work"].values["worst"] == -0.5
    assert axis_checks["symmetry"].verdict == "passed"
    nothing = axes(few_cells(rows[:2]))
    assert {check.verdict for check in nothing.values()} == {"not checked"}


@pytest.mark.parametrize(
    ("cells", "back", "verdict"),
    [(12, (-0.012, -0.012), "failed"), (12, (-0.012, -0.007), "passed"), (12, (-0.1,), "passed"),
     (12, (-0.007,) * 3, "failed"), (16, (-0.012, -0.012), "passed"), (16, (-0.007,) * 3, "failed"),
     (91, (-0.1,) * 2, "passed"), (91, (-0.1,) * 3, "failed")],
)  # fmt: skip
def test_energy_given_back_counts_by_its_size(cells, back, verdict):
    """Two cells clearly beyond the limit of 0.005 N/cm^3 are a large share of a small table; runs of all are flagged."""
    work = [*back, *[0.1] * (cells - len(back))]
    table = few_cells([(place, 0, 0, x, 0.0, 0.0) for place, x in enumerate(work)])
    check = axes(table.assign(run_ids=[f"run{place}" for place in range(cells)]))["work"]
    assert check.verdict == verdict
    assert [flag.run_id for flag in check.flags] == [f"run{place}" for place in range(len(back))]
    assert check.values["negative"].values == {"count": len(back), "size": cells}


RANGE_N = (100.0, 50.0, 200.0)


FINE: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
SOUND = {"F1": (0.0, 5.0, 0.001, 1.0), "F2": (0.0, 0.2, 0.001, 1.0), "F3": (0.0, 5.0, 0.001, 1.0)}
"""Of each channel of a log the lowest and the highest reading, the share of the stroke at one reading, and that reading."""
LEVEL: dict[str, Any] = {"beta_deg": 0.0, "gamma_deg": 90.0}
DEAD_X, DEAD_Z = {"F1": (0.0, 0.0, 1.0, 0.0)}, {"F3": (1.5, 1.5, 1.0, 1.5)}


def check_channels(sheet, constant=(), **tables):
    """Check of channels; F1 is x, F2 is y, F3 is z. `constant`: channels that the config states in place of readings."""
    config: Any = SimpleNamespace(
        table=None,
        transducer=SimpleNamespace(axes=AXES, range_N=RANGE_N, precision_N=0.05, turn_deg=0.0),
        grid=GRID,
        force_log=SimpleNamespace(
            columns={name: SimpleNamespace(constant=0.0) for name in constant}
        ),
    )
    tares = pd.DataFrame(columns=["run_id", "tare_run", "tare_rms_N", "force_rms_N"])
    tables["runs"] = tables["runs"].assign(**dict.fromkeys(ZERO_NAMES, math.nan))
    medium_tables = measured(sheet, config, alpha=few_cells([]), tares=tares, **tables)
    return spoken(judge("channels", medium_tables))


def channels_of(*logs, constant=()):
    """Check the channels of some logs, each of its own run: what the sheet says of it, and channels that are not sound."""
    usual = {"kind": "plate", "direction": "intrusion", "beta_deg": 30.0, "gamma_deg": 60.0}
    sheet: dict[str, Any] = {}
    columns = [f"{c}_{fact}" for c in SOUND for fact in ("low_N", "high_N", "held", "held_N")]
    rows = []
    for number, (run, channels) in enumerate(logs):
        facts = {"run_id": f"r{number}", "status": "read"} | usual | run
        sheet[facts["run_id"]] = SimpleNamespace(**facts)
        readings = itertools.chain(*(SOUND | channels).values())
        row = dict(zip(columns, readings, strict=True))
        rows.append(row | {name: facts[name] for name in ("run_id", "status")})
    runs = pd.DataFrame(rows, columns=["run_id", "status", *columns])
    runs = runs.assign(**dict.fromkeys(NOISE_NAMES, math.nan))
    fits = pd.DataFrame(columns=["run_id"])
    peers = pd.DataFrame(columns=["run_id", "known_z_ratio", "known_x_ratio"])
    return check_channels(sheet, constant, runs=runs, fits=fits, peers=peers)


def finds(check, *causes):
    """Whether a check names these causes and no other."""
    return check.values["causes"] == "; ".join(map(str, causes))


def cause(code, channel, count=3, size=3, **values):
    axis = {"F1": "x", "F3": "z"}[channel]
    values |= {"channel": channel, "axis": axis, "count": count, "size": size}
    return remark(f"cause-{code}", **values)


@pytest.mark.parametrize(
    ("dead", "fine", "share", "code"),
    [
        (2, 2, 1.0, ""),
        (2, 0, 1.0, "constant"),
        (3, 9, 1.0, "constant"),
        # one push is all there is
        (1, 0, 1.0, "constant"),
        # it stands still for less than half of a stroke
        (3, 0, 0.499, ""),
        (3, 0, 0.5, "frozen"),
    ],
)
def test_a_dead_channel_shows_in_three_logs_or_in_all(dead, fine, share, code):
    readings = DEAD_Z if share == 1.0 else {"F3": (0.0, 2.0, share, 1.0)}
    check = channels_of(*[({}, readings)] * dead, *[FINE] * fine)
    assert check.verdict == ("failed" if code else "passed")
    if code:
        assert finds(check, cause(code, "F3", dead, dead + fine))
        assert check.flags == tuple(
            remark("channel-still", run_id=f"r{n}", channel="F3") for n in range(dead)
        )


@pytest.mark.parametrize(
    ("run", "dead", "verdict", "verdict_beside_fine"),
    [
        ({"kind": "rod"}, DEAD_Z, "not checked", "passed"),
        ({"status": "refused"}, DEAD_Z, "not checked", "passed"),
        # of strokes only what goes deeper has to move
        ({"direction": "horizontal"}, DEAD_Z, "passed", "passed"),
        ({"direction": "extraction"}, DEAD_Z, "passed", "passed"),
        ({"kind": "leg", "direction": "rotation"}, DEAD_Z, "failed", "failed"),
        (LEVEL, DEAD_Z, "failed", "failed"),
        # what feels nothing sideways by symmetry is no dead x
        (LEVEL, DEAD_X, "passed", "passed"),
        (LEVEL | {"beta_deg": 90.0}, DEAD_X, "passed", "passed"),
        ({}, DEAD_X, "failed", "failed"),
    ],
)
def test_whose_channels_are_looked_at(run, dead, verdict, verdict_beside_fine):
    assert channels_of(*[(run, dead)] * 3).verdict == verdict
    assert channels_of(*[(run, dead)] * 3, FINE).verdict == verdict_beside_fine


def test_two_dead_channels_are_two_causes_and_one_that_is_stated_is_none():
    both: list[tuple[dict[str, Any], dict[str, Any]]] = [({}, DEAD_X | DEAD_Z)] * 3
    check = channels_of(*both)
    assert finds(check, cause("constant", "F1"), cause("constant", "F3"))
    dead = [(flag.run_id, flag.values["channel"]) for flag in check.flags]
    assert dead == [(f"r{n}", channel) for channel in ("F1", "F3") for n in range(3)]
    assert finds(channels_of(*both, constant=("F1",)), cause("constant", "F3"))
    assert channels_of().code == "channels-unread"


@pytest.mark.parametrize(
    ("ends_N", "share", "held_N", "verdict"),
    [
        ((0.0, 80.0), 0.03, 80.0, "failed"),
        ((0.0, 80.0), 0.029, 80.0, "passed"),
        ((-80.0, 0.0), 0.03, -80.0, "failed"),
        ((0.0, 80.0), 0.03, 40.0, "passed"),
        ((0.0, 99.1), 0.03, 99.1, "passed"),
        ((0.0, 98.9), 0.03, 98.9, "failed"),
        ((-99.1, 0.0), 0.03, -99.1, "passed"),
        ((80.0, 80.0), 0.03, 80.0, "passed"),
    ],
)
def test_a_channel_that_ends_below_its_range(ends_N, share, held_N, verdict):
    """The range of F1 is 100 N; what ends there is told by other words, run by run."""
    clipped = {"F1": (*ends_N, share, held_N)}
    # pulls and level paths are looked at too
    ways: list[dict[str, Any]] = [{}, {"direction": "extraction"}, {"direction": "horizontal"}]
    check = channels_of(*[(way, clipped) for way in ways], FINE)
    assert check.verdict == verdict
    if verdict == "failed":
        assert finds(check, cause("clipped", "F1", size=4, newtons=held_N))
        assert check.flags == tuple(
            remark("channel-clipped", run_id=f"r{n}", channel="F1", newtons=held_N)
            for n in range(3)
        )
    # ends in common are one reading, of three logs at least
    other_end = {"F1": (0.0, 70.0, 0.1, 70.0)}
    assert channels_of(*[({}, clipped), ({}, other_end)] * 2).verdict == "passed"


@pytest.mark.parametrize(
    ("across", "along", "verdict"),
    [(1.1, 0.5, "failed"), (0.9, 0.5, "passed"), (0.49, 0.1, "passed"), (0.51, 0.1, "failed")],
)
def test_x_and_y_exchanged(across, along, verdict):
    """y, across the motion, shows more than twice the force of x, and more than ten times the precision."""
    facts = {"F1": (-1.0, along - 1, 0.001, 0.0), "F2": (2.0, 2 + across, 0.001, 0.0)}
    check = channels_of(*[({}, facts)] * 2, *[(LEVEL, {})] * 5)
    assert check.verdict == verdict
    if verdict == "failed":
        ratio = across / along
        assert finds(check, remark("cause-exchanged", across="F2", along="F1", ratio=ratio))
    # not of strokes that feel nothing sideways by symmetry
    assert channels_of(*[(LEVEL, facts)] * 3).verdict == "passed"


def level_runs(count, rises=(0.2, 0.2, 0.2)):
    """Horizontal runs of so many samples whose force grows by these shares of its mean."""
    path = np.linspace(2, 8, count)
    names = [f"r{n}" for n in range(len(rises))]
    tared = pd.concat(
        pd.DataFrame(
            {
                "run_id": name,
                "path_cm": path,
                "force_z_N": -0.1,
                "force_x_N": -5 * (1 + rise * (path - 5) / 6),
            }
        )
        for name, rise in zip(names, rises, strict=True)
    )
    tared = tared.reset_index(drop=True)
    fits = pd.DataFrame({"run_id": names, "direction": "horizontal", "n_points": count})
    windows = pd.DataFrame({"run_id": tared["run_id"], "why": int(RowStatus.GOOD)})
    return {"fits": fits, "tared": tared, "windows": windows}


def steadiness(tables):
    return spoken(judge("steadiness", measured(**tables)))


def test_a_trend_is_of_the_larger_force_over_the_good_part():
    tables = level_runs(60)
    changes = {"change": "20.0 %", "size": 3}
    assert changes.items() <= steadiness(tables).values.items()
    # the largest on the whole, not at once
    tables["tared"].loc[::60, "force_z_N"] = 99.0
    assert changes.items() <= steadiness(tables).values.items()
    # what the fit leaves out is left out; what is left is half as long, and its mean larger
    tables["windows"].loc[np.arange(180) % 60 < 30, "why"] = int(RowStatus.GOOD) + 1
    path = np.linspace(2, 8, 60)[30:]
    force = 1 + 0.2 * (path - 5) / 6
    change = 100 * np.ptp(force) / force.mean()
    assert steadiness(tables).values["change"] == f"{change:.1f} %"


def test_whose_trend_counts():
    """Of three runs, each of 30 samples or more, with a path and a force."""
    assert judge("steadiness", measured(**level_runs(30))).verdict == "failed"
    tables = level_runs(60)
    fits, tared = tables["fits"], tables["tared"]
    for changed in (
        level_runs(29),
        level_runs(60, (0.2, 0.2)),
        tables | {"fits": fits.assign(direction=["intrusion", *["horizontal"] * 2])},
        tables | {"fits": fits.assign(n_points=[0, 60, 60])},
        tables | {"tared": tared.assign(path_cm=5.0)},
        tables | {"tared": tared.assign(force_z_N=0.0, force_x_N=0.0)},
    ):
        assert judge("steadiness", measured(**changed)).verdict == "not checked"


def test_without_a_medium_that_passes_its_checks_there_is_no_generic_profile(tmp_path):
    media = reference.MEDIA[:3]
    alpha = {name: reference.alpha_grid(name) for name in media}
    make_campaign(tmp_path, dict.fromkeys(media, LABORATORY), alpha)
    lost = rftfit.open(tmp_path)
    for name in media:
        bad = alpha_frame(name, alpha[name]).assign(checks_code="unusable")
        lost.hold(f"alpha/{name}.csv", bad)
    # tables and coefficients of each are still there
    assert np.isfinite(lost[media[0]].coefficients()).all()
    assert np.isnan(lost.generic()).all()
    assert lost.reference().printed


@pytest.mark.parametrize("medium", reference.MEDIA)
def test_axes_that_all_runs_tell_are_the_cause_of_energy_given_back(medium):
    table = on_grid(medium, "few")
    for z, x in (("+z", "-x"), ("+x", "+z")):
        assert axes(measured_with(table, z, x))["work"].verdict == "failed"
    wrong = measured_with(table, "-z", "+x")
    check = axes(wrong, **{"z-reversed": 4.1})["work"]
    assert (check.verdict, check.code, check.flags) == ("failed", "work-axes", ())
    assert str(remark("axes-z-reversed")) in check.sentence
    of_runs = axes(wrong, **{"z-reversed": 3.9})["work"]
    assert (of_runs.verdict, of_runs.code) == ("failed", "work")


@pytest.mark.parametrize("medium", reference.MEDIA)
@pytest.mark.parametrize("angle", [-8.0, 0.0, 8.0])
def test_a_turned_mount_is_measured(medium, angle):
    check = axes(turned(on_grid(medium, "few"), angle))["symmetry"]
    # the published tables themselves look turned by up to 2.3 deg
    assert check.values["turn_deg"] == pytest.approx(angle, abs=2.3)
    assert check.verdict == ("failed" if angle else "passed")


@pytest.mark.parametrize(
    ("rows", "turn", "se", "turned_deg"),
    [
        # a push alone: its alpha_x over its alpha_z
        ([(0, 90, 0.5, -0.05, 0, 0.01)], math.atan(0.1), 0.01 / 0.5, 0),
        # mirror images: opposite alpha_x is theirs, the sum is that of the turn
        (
            [(30, 90, 0.4, 0.16, 0, 0.01), (-30, 90, 0.4, -0.20, 0, 0.01)],
            math.atan(0.04 / 0.8),
            math.hypot(0.01, 0.01) / 0.8,
            0,
        ),
        # plates of beta and -beta, turned exactly
        (
            [(30, 90, 0.4, 0.2, 0, 0.01), (-30, 90, 0.4, -0.2, 0, 0.01)],
            math.radians(5),
            math.hypot(0.01, 0.01) / (0.8 * math.cos(math.radians(5))),
            5,
        ),
        # a pull is filed turned, as all extractions are
        ([(0, -90, -0.2, -0.02, 0, 0.01)], math.atan(0.1), 0.01 / 0.2, 0),
    ],
)
@pytest.mark.parametrize("confidence", [0.8, 0.95])
def test_turn_of_the_mount_by_mirror_images(rows, turn, se, turned_deg, confidence):
    config = SimpleNamespace(**vars(NO_TABLE) | {"fit": SimpleNamespace(confidence=confidence)})
    table = turned(few_cells(rows), turned_deg)
    # what the config says of the turn's own error is no error of the turn that is found
    parted = table.assign(alpha_x_turn_N_per_cm3=0.1)
    parted["alpha_x_se_N_per_cm3"] = np.hypot(parted["alpha_x_se_N_per_cm3"], 0.1)
    for cells in (table, parted):
        check = axes(cells, config)["symmetry"]
        assert check.verdict == ("passed" if turn <= 0.04 + 3 * se else "failed")
        assert check.values["turn_deg"] == pytest.approx(math.degrees(turn))
        assert check.values["most_deg"] == pytest.approx(math.degrees(0.04 + 3 * se), rel=1e-6)
        # numbers of a remark have six digits
        half_deg = norm.ppf(0.5 + confidence / 2) * math.degrees(se)
        ends = [check.values["interval"].values[end] for end in ("low", "high")]
        assert ends == pytest.approx(math.degrees(turn) + half_deg * np.array([-1, 1]), rel=1e-5)


@pytest.mark.parametrize(
    "rows",
    [
        # without its image a slanted plate says nothing, nor does a level path
        [(30, 90, 0.4, 0.2, 0, 0.01), (0, 0, 0.1, 0.3, 0, 0.01)],
        # without a vertical force, as of one log as plate and as rod, there is no turn
        [(0, 90, 0.0, 0.0, 0, 0)],
    ],
)
def test_what_shows_no_turn_of_the_mount(rows):
    assert axes(few_cells(rows))["symmetry"].verdict == "not checked"


def test_how_much_a_level_plate_may_feel_sideways():
    """An angle of 0.04, and three standard errors."""
    se = 0.002
    limit = math.tan(0.04 + 3 * se / 0.5) * 0.5
    for share, verdict in (
        (0.99, "passed"),
        (-0.99, "passed"),
        (1.01, "failed"),
        (-1.01, "failed"),
    ):
        check = axes(few_cells([(0, 90, 0.5, share * limit, se, se)]))["symmetry"]
        assert check.verdict == verdict


@pytest.mark.parametrize(
    ("value", "expected", "verdict"),
    [
        (0.5, None, "not checked"),
        (0.005, None, "failed"),
        (20.0, None, "failed"),
        (0.4, (0.4, 0.6), "passed"),
        (-0.5, (0.4, 0.6), "passed"),
        (0.3, (0.4, 0.6), "failed"),
        (0.7, (0.4, 0.6), "failed"),
        (math.nan, (0.4, 0.6), "not checked"),
    ],
)
def test_size(value, expected, verdict):
    medium = SimpleNamespace(expected_alpha=expected)
    for gamma, expected_verdict in ((90, verdict), (0, "not checked")):
        alpha = few_cells([(0, gamma, value, 0, 0, 0)])
        assert judge("size", measured(medium=medium, alpha=alpha)).verdict == expected_verdict


@pytest.mark.parametrize(
    ("values", "which"),
    [
        # a step: the smaller part
        ([0.0] * 12 + [1.0] * 6, range(12, 18)),
        ([1.0] * 6 + [0.0] * 12, range(6)),
        # of two equal parts the one farther from zero
        ([0.0] * 6 + [-1.0] * 6, range(6, 12)),
        # a heap that is spread over the order
        ([0.0, 1.0, 0.0] * 6, range(1, 18, 3)),
        # one level, with and without a scatter; a slow trend; too few for two parts of four
        ([0.5] * 20, None),
        ([0.01, -0.01, 0.02, -0.02] * 5, None),
        ([0.0] * 3 + [1.0] * 4, None),
        # an outlier moves no heap, as it would move a mean
        ([0.0] * 21 + [0.3] * 19 + [0.7], range(21, 41)),
        ([-0.2] * 20 + [0.19] * 19 + [0.59], range(20)),
        ([0.0] * 4 + [1.0] * 4, range(4, 8)),
        # too near one another
        ([0.0] * 10 + [0.2] * 10, None),
        # few runs of one wide spread, parted where they lie apart by chance: a campaign without a fault
        (
            [-0.10, 0.21, -0.16, 0.03, -0.07, 0.21, -0.08, 0.01, -0.07, 0.25, 0.01, -0.06, -0.09],
            None,
        ),
    ],
)
def test_two_heaps(values, which):
    clusters = two_clusters(np.array(values))
    assert (clusters is None) == (which is None)
    if clusters is not None and which is not None:
        assert np.flatnonzero(clusters[1]).tolist() == [*which]


def sheet_of(kinds):
    """Runs r2, r3 and so on, named by their rows; p a plate, r a rod."""
    names = {"p": "plate", "r": "rod"}
    return {
        f"r{n}": SimpleNamespace(run_id=f"r{n}", row=n, kind=names[kind])
        for n, kind in enumerate(kinds, 2)
    }


@pytest.mark.parametrize(
    ("way", "tare_N", "force_N", "which"),
    [
        ("intrusion", [0.2, 2.9, 0.2], 2.0, []),
        ("intrusion", [0.2, 3.1, 0.2], 2.0, ["r3"]),
        ("intrusion", [0.2, math.nan, 0.2], 2.0, []),
        ("intrusion", [9.0, 9.0, 9.0], 2.0, ["r2", "r3", "r4"]),
        # the same log as plate and as rod
        ("extraction", [0.2, 2.0, 0.2], 2.0, ["r3"]),
        # where plate and rod feel a twentieth, only three times as much is clear
        ("intrusion", [0.17, 0.2, 0.2], [0.1, 2.0, 2.0], []),
        ("intrusion", [0.31, 0.2, 0.2], [0.1, 2.0, 2.0], ["r2"]),
    ],
)
def test_rods_run_by_run(way, tare_N, force_N, which):
    sheet = sheet_of("ppp")
    for run in sheet.values():
        run.direction = way
    forces = {"force_rms_N": force_N, "tare_rms_N": tare_N}
    tares = pd.DataFrame({"run_id": [*sheet], "tare_run": "rod", **forces})
    check = judge("rods", measured(sheet, tares=tares))
    assert [flag.run_id for flag in check.flags] == which
    assert check.verdict == ("failed" if which else "passed")
    for nothing in ({"tare_run": ""}, {"force_rms_N": 0.0}):
        check = judge("rods", measured(sheet, tares=tares.assign(**nothing)))
        assert check.verdict == "not checked"


@pytest.mark.parametrize(
    ("what", "values", "verdict", "which"),
    [
        # of 10 N: 1.5 % of the force is 0.15 N, of a single run 15 %
        ("trend", [0.16] * 9, "failed", range(9)),
        ("trend", [0.14] * 9, "passed", []),
        ("trend", [0.0] * 8 + [1.6], "failed", [8]),
        ("trend", [0.0] * 8 + [1.4], "passed", []),
        # most runs have two rests, and no trend
        ("trend", [0.16, 0.16] + [math.nan] * 7, "not checked", []),
        # a median within 3.7 of its standard errors
        ("trend", [0.16, -0.5, 0.9, -0.2, 0.5, 0.16, -0.4, 0.7, 0.1], "passed", []),
        # so few alike by chance: 5 of its standard errors, where Student's t of five runs allows 10
        ("trend", [0.22, 0.30, 0.16, 0.12, 0.26] + [math.nan] * 4, "passed", []),
        # another zero after the stroke
        ("change", [0.6] * 9, "failed", range(9)),
        ("change", [0.4] * 9, "passed", []),
        # to either side
        ("change", [0.6, -0.6] * 4 + [0.6], "failed", range(9)),
        ("change", [0.6] * 3 + [0.1] * 6, "passed", []),
        ("change", [0.6] * 2 + [math.nan] * 7, "not checked", []),
    ],
)
@pytest.mark.parametrize("axis", "zx")
def test_drift(what, values, verdict, which, axis):
    sheet = sheet_of("p" * 9)
    runs = pd.DataFrame({"run_id": [*sheet], **dict.fromkeys(ZERO_NAMES, math.nan)})
    zeros = {f"zero_{what}_{c}_N": values if c == axis else 0.0 for c in "zx"}
    tares = pd.DataFrame({"run_id": [*sheet], "force_rms_N": 10.0})
    check = judge("drift", measured(sheet, runs=runs.assign(**zeros), tares=tares))
    assert check.verdict == verdict
    assert [flag.run_id for flag in check.flags] == [f"r{n + 2}" for n in which]
    if what == "change" and verdict == "failed":
        assert (check.code, check.values["axis"]) == ("drift-between", axis)


def causes_of(fits, runs=None, peers=None, evidence=None, constant=()):
    """Check of channels of runs without readings of note, beside each other or beside `peers`."""
    if runs is None:
        runs = runs_with_noise(fits)
    return check_channels(
        sheet_of("p" * len(fits)),
        constant,
        runs=runs,
        fits=fits,
        peers=compare_runs(fits, "m") if peers is None else peers,
        axes=axes_of_runs(evidence or {}),
    )


def runs_with_noise(fits):
    """Facts of runs that have all the same noise."""
    noise = dict.fromkeys(NOISE_NAMES, 0.01)
    return pd.DataFrame({"run_id": fits["run_id"], "status": "refused", "F1_low_N": 0.0, **noise})


def channels_against(seen, evidence=None, constant=(), directions=12, known_x_ratio=0.3):
    """Flags of twelve pushes of alpha 0.3 and 0.09 N/cm^3, but for what `seen` says of z and x and of noise."""
    known_ratios = {"known_z_ratio": 1.0, "known_x_ratio": known_x_ratio}
    fits = pd.DataFrame(
        {
            "run_id": [*sheet_of("p" * 12)],
            "beta_deg": np.repeat(np.linspace(5, 60, directions), 12 // directions),
            "gamma_deg": 60.0,
            "mirrored": False,
            "alpha_z_N_per_cm3": 0.3,
            "alpha_x_N_per_cm3": 0.09,
            "alpha_z_rod_N_per_cm3": 0.0,
            "alpha_x_rod_N_per_cm3": math.nan,
        }
    )
    runs = runs_with_noise(fits)
    for name, factor in seen.items():
        table = runs if name in runs else fits
        table[name] *= np.array(factor)
    peers = fits[["run_id"]].assign(**known_ratios)
    return causes_of(fits, runs, peers, evidence, constant).flags


X, Z = (f"alpha_{c}_N_per_cm3" for c in "xz")
HALF = [1.0] * 6 + [3.0] * 6


@pytest.mark.parametrize(
    ("seen", "code", "count"),
    [
        ({}, "", 0),
        ({X: [0.0] * 3 + [1.0] * 9}, "channel-silent", 3),
        ({X: [0.0] * 2 + [1.0] * 10}, "", 0),
        ({X: 0.0}, "channel-silent", 12),
        ({Z: [0.0] * 4 + [1.0] * 8}, "channel-silent", 4),
        ({X: [-1.0] * 3 + [1.0] * 9}, "channel-reversed", 3),
        ({Z: [-1.0] * 9 + [1.0] * 3}, "channel-reversed", 9),
        # where nearly all are reversed it is the axes
        ({X: [-1.0] * 10 + [1.0] * 2}, "", 0),
        ({X: HALF, "F1_noise_N": HALF}, "channel-gain", 6),
        # another noise alone, or another force alone, is no other gain
        ({"F1_noise_N": HALF}, "", 0),
        ({X: HALF}, "", 0),
        # a channel without force has no gain, where its silence is explained
        ({X: 0.0, "F1_noise_N": HALF}, "channel-silent", 12),
    ],
)
def test_channels_against_what_every_medium_feels(seen, code, count):
    flags = channels_against(seen)
    assert [flag.code for flag in flags] == [code] * count
    # what other axes or a drift of all runs explain is not told twice
    if code != "channel-gain":
        assert not channels_against(seen, {"z-reversed": 9.0})


@pytest.mark.parametrize(
    ("seen", "code", "count"),
    [
        # all runs of one direction, as three depths of a level run, are one witness
        ({X: [0.0] * 3 + [1.0] * 9}, "", 0),
        ({X: [-1.0] * 3 + [1.0] * 9}, "", 0),
        ({X: [0.0] * 9 + [1.0] * 3}, "channel-silent", 9),
        ({X: [-1.0] * 6 + [1.0] * 6}, "channel-reversed", 6),
        # one silent run beside repeats that feel the force is a dead channel, not an alpha of 0
        ({X: [0.0, 1.0, 1.0] * 4}, "channel-silent", 4),
        ({X: [0.0, 1.0, 1.0] * 2 + [1.0] * 6}, "", 0),
        # one of three repeats does not turn the sign of its direction
        ({X: [-1.0, 1.0, 1.0] * 4}, "", 0),
        ({X: [0.0, 0.0, 1.0] * 4}, "channel-silent", 8),
    ],
)
def test_a_direction_is_one_witness(seen, code, count):
    flags = channels_against(seen, directions=4)
    assert [flag.code for flag in flags] == [code] * count


def level_and_slanted(friction, random):
    """Runs of a medium of 3D-RFT, as they are compared with known media: level ones at three depths, pushes three times."""
    profile = rft3d_profile(0.6, friction, 5)
    rows: list[dict[str, Any]] = []
    for beta, gamma in itertools.product((-60, -30, -10, 30, 60, 90), (-60, 0, 20, 60)):
        alpha = [
            float(component) for component in profile.alpha(np.radians(beta), np.radians(gamma))
        ]
        for depth in (2.54, 5.08, 7.62):
            values = np.array(alpha) * (1 + 0.05 * random.standard_normal())
            values += 0.002 * random.standard_normal(2)
            row: dict[str, Any] = dict(zip((Z, X), values, strict=True))
            place = {"run_id": f"r{len(rows) + 2}", "beta_deg": beta, "gamma_deg": gamma}
            row |= place | {"mirrored": gamma < 0, "depth_from_cm": depth if gamma == 0 else 1.0}
            row |= {f"alpha_{c}_se_N_per_cm3": 0.002 for c in "zx"}
            rows.append(row | {f"alpha_{c}_rod_N_per_cm3": 0.0 for c in "zx"})
    return pd.DataFrame(rows)


@pytest.mark.parametrize("friction", [0.2, 0.4, 0.6, 0.8, 1.0])
def test_friction_is_no_fault_of_a_channel(friction):
    """A plate at -10 degrees dragged level feels no lift; a channel reversed in a third of the directions is named."""
    random = np.random.default_rng(4)
    fits = level_and_slanted(friction, random)
    assert causes_of(fits).code == "channels-unread"
    place = fits[["beta_deg", "gamma_deg"]].apply(tuple, axis=1)
    third = place.isin(random.permutation(place.unique())[:8])
    fits.loc[third, X] *= -1
    flags = causes_of(fits).flags
    assert {flag.code for flag in flags} == {"channel-reversed"}
    assert {flag.run_id for flag in flags} <= {*fits.loc[third, "run_id"]}


@pytest.mark.parametrize("is_upright_reversed", [False, True])
def test_a_plate_without_a_sign_of_beta_tells_beta_from_a_channel(is_upright_reversed):
    """The force along x has the opposite sign on paths of 20 degrees: of slanted plates, or of upright ones as well."""
    fits = level_and_slanted(0.4, np.random.default_rng(4))
    is_reversed = (fits["gamma_deg"] == 20) & (is_upright_reversed | (fits["beta_deg"] != 90))
    fits.loc[is_reversed, X] *= -1
    check = causes_of(fits)
    assert {flag.code for flag in check.flags} == {"channel-reversed"}
    assert ("look at the sign of beta_deg" in check.sentence) != is_upright_reversed


def test_a_silent_channel_is_no_fault_of_runs_that_need_not_feel_it():
    """Level plates pushed straight down show no force along x in any medium."""
    flags = channels_against({X: [0.0] * 7 + [1.0] * 5}, known_x_ratio=[0.0] * 4 + [0.3] * 8)
    assert [(flag.code, flag.run_id) for flag in flags] == [
        ("channel-silent", run_id) for run_id in ("r6", "r7", "r8")
    ]


def test_a_load_cell_that_was_turned_about_its_axis_shows_the_force_across():
    fits = level_and_slanted(0.4, np.random.default_rng(4))
    is_turned = fits["beta_deg"].isin([30, 60]) & (fits["gamma_deg"] >= 20)
    fits.loc[is_turned, X] = 0.0
    runs = runs_with_noise(fits).assign(status="read")
    for name, force_N in (("F1", np.where(is_turned, 0.2, 8.0)), ("F2", 4.0), ("F3", 8.0)):
        runs[f"{name}_low_N"], runs[f"{name}_high_N"] = 0.0, force_N
        runs[f"{name}_held"], runs[f"{name}_held_N"] = 0.001, 1.0
    sheet = sheet_of("p" * len(fits))
    for run, row in zip(sheet.values(), fits.to_dict("records"), strict=True):
        vars(run).update(row, direction="intrusion" if row["gamma_deg"] > 0 else "extraction")
    check = check_channels(
        sheet, runs=runs, fits=fits, peers=compare_runs(fits, "m"), axes=axes_of_runs({})
    )
    turned = {*fits.loc[is_turned, "run_id"]}
    assert len(turned & {flag.run_id for flag in check.flags}) > 0.7 * len(turned)
    assert "F2, across the motion, 20 times as much" in check.sentence


def test_a_channel_that_is_not_measured_hides_no_other():
    seen = {X: math.nan, Z: [0.0] * 4 + [1.0] * 8}
    flags = channels_against(seen, constant=("F1",))
    assert [(flag.code, flag.values["channel"]) for flag in flags] == [("channel-silent", "F3")] * 4


def strokes(start_cm, late_s=0.0, count=8, **columns):
    """Fits of pushes, then of pulls, of three angles, whose stress begins as told."""
    ways = [
        (sign, gamma) for sign in (1, -1) for gamma in (45.0, 71.57, 90.0) for _ in range(count)
    ]
    sign, gamma = np.array(ways).T
    wobble = 0.002 * np.where(sign > 0, 1, 20) * (-1.0) ** np.arange(sign.size)
    return {
        "fits": pd.DataFrame(
            {
                "run_id": [f"r{n + 2}" for n in range(sign.size)],
                "gamma_deg": sign * gamma,
                "direction": np.where(sign > 0, "intrusion", "extraction"),
                "depth_to_cm": 7.0,
                "tare_run": "",
                "alpha_z_N_per_cm3": np.where(sign > 0, 0.4, -0.02),
                "alpha_z_se_N_per_cm3": 0.001,
                "start_cm": start_cm + sign * late_s * np.sin(np.radians(gamma)) + wobble,
                "beta_deg": np.arange(gamma.size) % 24,
                "depth_from_cm": 2.0,
                "exponent_z": 1.0,
                "exponent_z_se": 0.002,
                "power_misfit_z_ratio": 1.5,
                "offset_cm": 0.01,
                "offset_se_cm": 0.01,
                "intercept_z_N_per_cm2": 0.0,
                "free_slope_z_N_per_cm3": 0.4,
            }
            | columns
        )
    }


def surface(tables, role=LABORATORY, **errors):
    config = SimpleNamespace(
        arm=SimpleNamespace(speed_cm_per_s=1.0),
        fit=SimpleNamespace(confidence=0.95),
        grid=GRID,
        errors=SimpleNamespace(**{"surface_run_mm": None, "surface_session_mm": None} | errors),
    )
    medium_tables = measured(sheet_of("p" * 60), config, SimpleNamespace(role=role), **tables)
    return judge("surface", medium_tables), judge("linearity", medium_tables)


@pytest.mark.parametrize(
    ("start", "late", "code"),
    [
        (0.0, 0.0, ""),
        (0.08, 0.0, ""),
        (0.0, 0.05, ""),
        (0.3, 0.0, "-off"),
        (-0.3, 0.0, "-off"),
        (0.0, 0.3, "-late"),
        (0.0, -0.3, "-late"),
        (0.5, 0.3, "-late-off"),
    ],
)
def test_where_stress_begins(start, late, code):
    surface_check, linearity_check = surface(strokes(start, late))
    assert surface_check.code == f"surface{code}"
    assert (surface_check.verdict, surface_check.flags) == ("failed" if code else "passed", ())
    assert linearity_check.verdict == "passed"
    assert surface_check.values["late_s"] == pytest.approx(abs(late))
    if "late" in code:
        assert surface_check.values["side"] == ("late" if late > 0 else "early")
    assert spoken(surface_check)


def test_what_is_stated_of_the_surface_is_allowed():
    assert surface(strokes(0.3), surface_session_mm=1.0)[0].verdict == "passed"
    assert surface(strokes(0.3), surface_session_mm=0.3)[0].verdict == "failed"


@pytest.mark.parametrize(
    ("start", "late", "code", "gap"),
    [
        (np.where(np.arange(48) % 3 == 0, 0.4, 0.0), 0.0, "surface-differs", 4.0),
        (np.where(np.arange(48) % 3 == 0, 0.05, 0.0), 0.0, "", 0.0),
        (0.0, np.where(np.arange(48) % 3 == 0, 0.5, 0.0), "lag-differs", 0.5),
    ],
)
def test_runs_with_a_surface_or_a_lag_of_their_own(start, late, code, gap):
    # errors of pulls are too large to tell theirs
    surface_check = surface(strokes(start, late))[0]
    assert bool(surface_check.flags) == bool(code)
    # pushes alone hardly tell a surface from a lag
    assert {flag.code for flag in surface_check.flags} <= {"surface-differs", "lag-differs"}
    assert surface_check.verdict == ("failed" if code else "passed")
    pushes = [f"r{n + 2}" for n in range(24) if n % 3 == 0]
    assert {*pushes} >= {flag.run_id for flag in surface_check.flags if int(flag.run_id[1:]) < 26}
    for flag in surface_check.flags:
        if flag.code == code:
            assert flag.values["gap"] == pytest.approx(gap, rel=0.05)


@pytest.mark.parametrize("seed", range(1, 6))
@pytest.mark.parametrize(
    ("gap", "gamma_deg", "code"),
    [
        (0.6, 71.57, "surface-of-path"),
        (-0.6, 71.57, "surface-of-path"),
        # too small, and none
        (0.15, 71.57, "surface"),
        (0.0, 90.0, "surface"),
    ],
)
def test_an_angle_of_the_path_with_another_surface(gap, gamma_deg, code, seed):
    """In random order, with starts that scatter by 1.5 mm: neither a stretch nor two heaps."""
    luck = np.random.default_rng(seed)
    (fits,) = strokes(luck.normal(0, 0.15, 48)).values()
    fits["run_id"] = luck.permutation(fits["run_id"])
    is_on_path = fits["gamma_deg"] == gamma_deg
    fits.loc[is_on_path, "start_cm"] += gap
    surface_check = surface({"fits": fits[fits["gamma_deg"] > 0]})[0]
    assert surface_check.code == code
    if code == "surface-of-path":
        assert surface_check.values["gamma_deg"] == gamma_deg
        assert surface_check.values["side"] == ("deeper" if gap > 0 else "higher")
        flagged = {flag.run_id: flag.values["gap"] for flag in surface_check.flags}
        assert {*flagged} == {*fits.loc[is_on_path, "run_id"]}
        assert [*flagged.values()] == pytest.approx([10 * gap] * 8, rel=0.4)


@pytest.mark.parametrize(
    ("gap", "first", "last", "flagged_rows"),
    [
        (0.3, 6, 14, range(6, 14)),
        (-0.3, 0, 12, range(12)),
        (0.3, 18, 24, range(18, 24)),
        # too small, too short, and none
        (0.1, 6, 14, []),
        (0.3, 6, 8, []),
        (0.0, 6, 14, []),
    ],
)
def test_a_stretch_of_the_sheet_with_another_surface(gap, first, last, flagged_rows):
    """Starts of pushes scatter by 0.7 mm, so that there are no two heaps, and one run at an edge may be missed."""
    place = np.arange(48)
    luck = np.random.default_rng(3).normal(0, 0.07, 48)
    starts_cm = np.where((first <= place) & (place < last), gap, 0.0) + luck
    of_angles = strokes(starts_cm)
    # on one path a lag would move all alike: it hides no run
    of_one_path = {"fits": of_angles["fits"].assign(gamma_deg=np.where(place < 24, 90.0, -90.0))}
    alone = surface(of_one_path)[0]
    assert bool(alone.flags) == bool(flagged_rows)
    surface_check = surface(of_angles)[0]
    pushes = {flag.run_id for flag in surface_check.flags} & {f"r{n + 2}" for n in range(24)}
    assert len(pushes ^ {f"r{n + 2}" for n in flagged_rows}) <= 1
    assert surface_check.verdict == ("failed" if flagged_rows else "passed")


@pytest.mark.parametrize(
    ("power", "misfit", "verdict"),
    [
        (1.1, 0.5, "failed"),
        (0.9, 0.5, "failed"),
        (1.04, 0.5, "passed"),
        (1.1, 1.5, "passed"),
        # of 24 pushes a half and 1 / sqrt(24) have to speak for a power: 17
        (1.1, [0.5] * 16 + [1.5] * 32, "passed"),
        (1.1, [0.5] * 17 + [1.5] * 31, "failed"),
        (1.1, math.nan, "not checked"),
        (math.nan, 0.5, "not checked"),
    ],
)
def test_linearity(power, misfit, verdict):
    surface_check, linearity_check = surface(
        strokes(0.0, exponent_z=power, power_misfit_z_ratio=misfit)
    )
    assert (surface_check.verdict, linearity_check.verdict) == ("passed", verdict)


def test_an_offset_of_curved_stress_does_not_tell_the_surface():
    for misfit in (0.5, [0.5, 1.5] * 24):
        surface_check, linearity_check = surface(strokes(0.3, power_misfit_z_ratio=misfit))
        assert (surface_check.verdict, linearity_check.verdict) == ("not checked", "failed")


@pytest.mark.parametrize(
    ("columns", "role"),
    [
        ({"gamma_deg": 44.9}, LABORATORY),
        ({"gamma_deg": math.nan}, LABORATORY),
        ({"alpha_z_se_N_per_cm3": 0.14}, LABORATORY),
        ({"direction": "extraction"}, LABORATORY),
        ({"direction": "extraction"}, "natural_sand"),
    ],
)
def test_which_strokes_tell_where_stress_begins(columns, role):
    """Steep pushes, whose alpha is clear of zero and whose line has a slope, with a tare."""
    both_checks = surface(strokes(0.3, **columns), role)
    assert {check.verdict for check in both_checks} == {"not checked"}


def test_the_surface_of_a_natural_sand_is_not_judged_and_its_law_is():
    beginning, law = surface(strokes(0.3), "natural_sand")
    assert (beginning.verdict, beginning.code) == ("not checked", "natural-sand")
    assert (law.verdict, law.code) == ("passed", "law-line")


def test_what_trend_is_allowed():
    """A tenth, or Student's t of two degrees at the level of three standard errors of the median."""
    for rise, verdict in ((0.101, "failed"), (0.099, "passed"), (-0.101, "failed")):
        check = steadiness(level_runs(60, (rise,) * 3))
        assert (check.verdict, check.values["most"]) == (verdict, "10.0 %")
    se = 1.2533 * math.sqrt(math.pi / 2) * 0.2 / 3 / math.sqrt(3)
    check = steadiness(level_runs(60, (0.1, 0.2, 0.3)))
    assert (check.verdict, check.values["most"]) == ("passed", f"{1920.7 * se:.1f} %")


def test_copies_are_listed_with_what_they_are_copies_of():
    sheet: Any = {name: SimpleNamespace(intruder="", beta_deg=0) for name in "abcd"}
    copies = {"c": ("b", "d"), "b": ("c", "d"), "d": ("b", "c")}
    check = judge("same_logs", measured(sheet, copies=copies))
    assert check.verdict == "failed"
    flags = {flag.run_id: flag.values["runs"] for flag in check.flags}
    assert flags == {"b": "c, d", "c": "b, d", "d": "b, c"}
    assert judge("same_logs", measured(sheet, copies={"a": ()})).verdict == "passed"
    assert judge("same_logs", measured(sheet, copies={})).verdict == "not checked"


@pytest.mark.parametrize(
    ("failed", "accept", "held"),
    [
        ("channels", {}, set(CHECKS) - {"sheet", "channels", "same_logs"}),
        ("work", {}, {"axes", "symmetry", "up_down", "repeats", "shared"}),
        ("symmetry", {}, {"repeats"}),
        ("surface", {}, {"linearity", "compression", "repeats"}),
        ("same_logs", {}, set()),
        # what is accepted holds nothing back
        ("channels", {"channels": "why"}, set()),
    ],
)
def test_later_checks_wait_until_a_first_is_put_right(failed, accept, held, monkeypatch):
    """All others would pass; a check that waits keeps its flags of single runs."""
    flag = remark("gives-back", run_id="a")
    passed = replace(judge("same_logs", measured(copies={})), verdict="passed", flags=(flag,))
    for name in CHECK_NAMES:
        verdict = "failed" if name == failed else "passed"
        outcome = replace(passed, check=name, code=name, verdict=verdict)
        instead = replace(CHECKS[name], check=lambda _, outcome=outcome: outcome)
        monkeypatch.setitem(CHECKS, name, instead)
    media = {"m": SimpleNamespace(accept=accept)}
    campaign: Any = SimpleNamespace(config=SimpleNamespace(media=media), runs_of=lambda _: [])
    outcomes = check_medium(campaign, "m", {}, {}, measured().flags)
    assert [check.check for check in outcomes] == CHECK_NAMES
    verdicts = {str(check.check): check.verdict for check in outcomes}
    expected = dict.fromkeys(CHECKS, "passed") | dict.fromkeys(held, "not checked")
    assert verdicts == expected | {failed: "accepted" if accept else "failed"}
    assert all(check.flags == (flag,) for check in outcomes)
    assert {check.values["first"] for check in outcomes if check.check in held} <= {failed}


# --- a new check: its module, its name in the config, its row in the documentation -----------------------------------


def test_config_and_documentation_name_the_checks_that_are_declared(pytestconfig):
    assert CHECKS.keys() == {*CHECK_NAMES}
    page = (pytestconfig.rootpath / "docs" / "theory" / "checks.md").read_text("utf-8")
    table = page[page.index("| check |") : page.index("## Diagnosis")]
    assert {*re.findall(r"(?m)^\| `(\w+)` \|", table)} == {*CHECK_NAMES}


def test_a_reversed_channel_that_runs_share_is_told_as_one():
    sizes = {"size": -2.06, "size_lo": -2.14, "size_hi": -1.99, "inseparable": ""}
    place = {"kind": "gain-x", "group": "session", "place": "wed", "n_runs": 3, "run_ids": "r2 r3"}
    causes = pd.DataFrame([place | sizes | {"verdict": "told"}])
    check = judge("shared", measured(sheet_of("ppp"), medium=SimpleNamespace(accept=()), causes=causes))  # fmt: skip
    assert check.verdict == "failed"
    for words in ("X reversed", "session wed", "1.06 times (0.99 to 1.14)", "cable"):
        assert words in check.sentence


def test_least_shared_cause_is_that_of_its_kind_and_group():
    least = {("gain", "from-run"): 0.05, ("gain", "all"): 0.5, ("turn", "from-run"): 9.0}
    least |= {("turn", "all"): 2.0}
    causes = pd.DataFrame(
        [
            {"kind": kind, "group": group, "verdict": "not seen", "least_seen": size, "reason": ""}
            for (kind, group), size in least.items()
        ]
    )
    check = judge("shared", measured(medium=SimpleNamespace(accept=()), causes=causes))
    gain, turn = remark("least-gain", least=0.05), remark("least-turn", least=2.0)
    assert check.values["seen"] == f"{gain} and {turn}"
    # a label that no other runs share a direction with hides an error of its runs
    label = {"group": "session", "place": "tue", "verdict": "not checked", "reason": "mixed-up"}
    of_label = pd.DataFrame([label | {"kind": kind} for kind in ("gain", "gain-x")])
    causes = pd.concat([causes, of_label])
    check = judge("shared", measured(medium=SimpleNamespace(accept=()), causes=causes))
    assert (check.verdict, check.code) == ("passed", "shared-labels-open")
    assert check.values["labels"] == "session tue"
    assert spoken(check).code == check.code
