"""The comparison of golden tables notices each kind of change, and nothing below its tolerance."""

import numpy as np
import pandas as pd
import pytest
from golden_tables import (
    ELSEWHERE,
    HERE,
    MOST_ROWS,
    OF_ROBOT,
    compare_tables,
    output_of,
    short_object,
    short_table,
)

SANDS = "results/sands.csv"
PREDICTED = "results/predicted.csv"


def sands(**changes):
    columns = {
        "medium": ["yuma", "dune"],
        "alpha_z_N_per_cm3": [0.5, 2.0],
        "zeta": [0.3, np.nan],
        "reason": ["", "no push was read"],
        "reason_code": ["", "no-run"],
    }
    return pd.DataFrame(columns | changes)


def predicted(rows=3 * MOST_ROWS):
    theta_deg = np.arange(rows, dtype=float)
    columns = {"medium": "yuma", "theta_deg": theta_deg, "force_z_N": np.sin(theta_deg)}
    return pd.DataFrame(columns)


def changed(name, before, after, *, is_here=True):
    tables = [{name: short_table(table, output_of(name))} for table in (before, after)]
    return compare_tables(*tables, is_here=is_here)


@pytest.mark.parametrize(
    ("column", "cells", "rows"),
    [
        ("alpha_z_N_per_cm3", [0.5, 2.0 * (1 + 3 * HERE)], 1),
        ("alpha_z_N_per_cm3", [0.5 + 6 * HERE, 2.0 * (1 - 3 * HERE)], 2),
        ("alpha_z_N_per_cm3", [0.5 + HERE, 2.0], 0),
        ("alpha_z_N_per_cm3", [2.0, 0.5], 2),
        ("zeta", [0.3, 0.1], 1),
        ("zeta", [np.nan, np.nan], 1),
        ("medium", ["yuma", "Dune"], 1),
        ("reason_code", ["", "no-tare"], 1),
        ("reason", ["", "other words"], 0),
        ("reason", ["now there is one", "no push was read"], 1),
    ],
)
def test_a_changed_column_is_named_with_its_rows(column, cells, rows):
    differences = changed(SANDS, sands(), sands(**{column: cells}))
    expected = [(SANDS, column, rows)] if rows else []
    assert [(one.table, one.column, one.rows) for one in differences] == expected


@pytest.mark.parametrize("relative", [0.5 * ELSEWHERE, 2 * ELSEWHERE])
def test_another_machine_has_another_tolerance(relative):
    after = sands(alpha_z_N_per_cm3=[0.5, 2.0 * (1 + relative)])
    assert bool(changed(SANDS, sands(), after, is_here=False)) == (relative > ELSEWHERE)
    assert changed(SANDS, sands(), after)


@pytest.mark.parametrize("relative", [0.5 * OF_ROBOT, 2 * OF_ROBOT])
def test_tables_of_the_robot_have_another_tolerance(relative):
    name = "results/robot/measured.csv"
    before, after = (
        pd.DataFrame({"condition": ["c"], "speed_cm_per_s": [speed]})
        for speed in (30.0, 30.0 * (1 + relative))
    )
    assert bool(changed(name, before, after)) == (relative > OF_ROBOT)


@pytest.mark.parametrize(
    ("column", "after", "is_told"),
    [
        ("speed_cm_per_s", 30.3, False),
        ("speed_cm_per_s", 33.0, True),
        ("strides", 9, False),
        ("strides", 5, True),
    ],
)
def test_on_another_machine_the_robot_may_need_another_stride(column, after, is_told):
    row = {"condition": ["c"], "speed_cm_per_s": [30.0], "strides": [8]}
    before, changed_row = pd.DataFrame(row), pd.DataFrame(row | {column: [after]})
    name = "results/robot/runs_map.csv"
    assert changed(name, before, changed_row)
    assert bool(changed(name, before, changed_row, is_here=False)) == is_told


@pytest.mark.parametrize("change", [0.5 * OF_ROBOT, 2 * OF_ROBOT])
def test_a_spread_of_strides_is_compared_by_the_size_of_the_speed(change):
    before, after = (
        pd.DataFrame({"condition": ["c"], "speed_cm_per_s": [30.0], "speed_sd_cm_per_s": [spread]})
        for spread in (0.01, 0.01 + 30.0 * change)
    )
    assert bool(changed("results/robot/runs_map.csv", before, after)) == (change > OF_ROBOT)


@pytest.mark.parametrize("row", [0, 1, 2, 3 * MOST_ROWS - 1])
def test_a_change_of_any_row_of_a_long_table_is_noticed(row):
    after = predicted()
    after.loc[row, "force_z_N"] += 1e-3
    (difference,) = changed(PREDICTED, predicted(), after)
    assert difference.column == "force_z_N"
    relabelled = predicted().astype({"medium": object})
    relabelled.loc[row, "medium"] = "dune"
    (difference,) = changed(PREDICTED, predicted(), relabelled)
    assert difference.column == "medium"


def test_new_and_gone_columns_tables_and_rows_are_told():
    before, after = sands(), sands().drop(columns="zeta").assign(window="stated")
    assert {(one.column, one.remark) for one in changed(SANDS, before, after)} == {
        ("zeta", "gone"),
        ("window", "new"),
    }
    (difference,) = changed(SANDS, before, before.iloc[:1])
    assert difference.column == "*"
    short = {SANDS: short_table(before, output_of(SANDS))}
    assert [one.remark for one in compare_tables(short, {}, is_here=True)] == ["gone"]
    assert [one.remark for one in compare_tables({}, short, is_here=True)] == ["new"]


def test_numbers_and_words_of_json_are_compared_and_sentences_are_not():
    before = {"runs": [{"speed": 1.0, "state": "steady"}], "about": "a sentence of some words"}
    for after, path in (
        ({"runs": [{"speed": 1.1, "state": "steady"}], "about": before["about"]}, ".runs[].speed"),
        ({"runs": [{"speed": 1.0, "state": "tipped"}], "about": before["about"]}, ".runs[].state"),
        ({"runs": [], "about": before["about"]}, ".runs[].speed"),
    ):
        tables = [{"page.json": short_object(content, ())} for content in (before, after)]
        assert path in [one.column for one in compare_tables(*tables, is_here=True)]
    reworded = before | {"about": "the same in quite other words"}
    tables = [{"page.json": short_object(content, ())} for content in (before, reworded)]
    assert compare_tables(*tables, is_here=True) == []
