"""Every column of every table of the golden campaigns is as expected, and every column of the dictionary is in one.

`tests/golden/README.md` says what is compared, and how the expected tables are rewritten.
"""

import re
import tomllib
from functools import cache

import pandas as pd
import pytest
from golden_tables import (
    SUMMARIES,
    compare_tables,
    is_same_machine,
    output_of,
    read_expected,
    short_tables,
)
from makers import KNOWN_WRONG, SMALL, golden_campaigns
from waiting import make_once

from rftfit.outputs.dictionary import alternatives, column_of, describe_file, outputs

CAMPAIGNS = {campaign.name: campaign for campaign in golden_campaigns()}
TABLES = [output for output in outputs() if output.columns]

VERDICTS = "verdicts.csv of `rftfit example`"
NOT_IN_A_TABLE = {
    (output.file, name): "the examples have tests of their own (tests/cli/test_cli_example.py)"
    for output in TABLES
    if output.file == VERDICTS
    for column in output.columns
    for name in column.names
}
"""Columns of the dictionary that no golden table has, by table and column, with the reason."""
ALWAYS_EMPTY = {
    (table, column): "only the checks flag a cell; a stage and the tracks flag runs"
    for table in ("results/flags/<stage>/<medium>.csv", "results/robot/flags.csv")
    for column in ("beta_deg", "gamma_deg")
} | {
    (
        "FILE of `rftfit wheel --output`",
        "reason",
    ): "the golden wheels carry their load at each slip",
    (
        "results/runs/<medium>.csv",
        "seen_gamma_deg",
    ): "no golden campaign has a motion log along another path than its sheet",
}
"""Columns that are empty in all golden tables, by table and column, with the reason."""
WITHOUT_COLUMNS = ("files", "results/report.html", "commands/endings.json")
"""Golden tables whose rows the dictionary does not describe."""


@pytest.fixture(scope="session")
def golden_folder(request, tmp_path_factory):
    """Return the folder of a campaign by name, made once a test run."""

    def folder_of(name):
        if name == SMALL:
            return request.getfixturevalue("small_made").root
        return make_once(tmp_path_factory, f"golden {name}", CAMPAIGNS[name].make)

    return folder_of


@cache
def expected_of(name):
    """Return the expected tables of a campaign, which nobody changes."""
    return read_expected(CAMPAIGNS[name].expected)


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_column_is_as_expected(name, golden_folder):
    tables = short_tables(golden_folder(name))
    assert expected_of(name)
    is_here = is_same_machine(CAMPAIGNS[name].expected)
    differences = compare_tables(expected_of(name), tables, is_here=is_here)
    assert not differences, "\n".join(map(str, differences))


def columns_of(path, table):
    """Return the columns of a golden table, or the keys of a json object."""
    if path.endswith(".json"):
        return {path_of_value.split(".")[1].split("[")[0] for path_of_value in table["row"]}
    return {*table.columns} - {"row"}


def is_of_kind(kind, cells):
    """Return whether cells are what the dictionary calls them."""
    if kind == "yes or no":
        return {*cells} <= {"True", "False"}
    if kind not in ("number", "count"):
        return True
    numbers = pd.to_numeric(cells)
    return kind == "number" or bool(((numbers == numbers.round()) & (numbers >= 0)).all())


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_file_and_column_is_what_the_dictionary_says(name):
    tables = expected_of(name)
    assert [path for path in tables["files"]["file"] if describe_file(path) is None] == []
    for path in tables.keys() - WITHOUT_COLUMNS:
        described, table = output_of(path), tables[path]
        columns = columns_of(path, table)
        always = {
            column_name
            for column in described.columns
            if not column.when and "<" not in column.name
            for column_name in column.names
        }
        assert always <= columns, path
        for column in columns:
            entry = column_of(described, column)
            assert entry is not None, (path, column)
            if not path.endswith(".json"):
                cells = table.loc[~table["row"].isin(SUMMARIES), column]
                assert is_of_kind(entry.kind, cells[cells != ""]), (path, column)


def test_every_file_that_a_campaign_always_has_is_in_a_golden_one():
    files = {path for name in CAMPAIGNS for path in expected_of(name)["files"]["file"]}
    golden = {output.file for path in files if (output := describe_file(path))}
    always = {
        output.file
        for output in outputs()
        if not output.when and output.file.startswith("results/")
    }
    assert always - golden == {f"results/{kind}/<path>" for kind in ("logs", "records", "state")}


@cache
def filled_columns():
    """Return whether a column has a cell that is filled, by table and column of the dictionary."""
    filled: dict[tuple[str, str], bool] = {}
    for name in CAMPAIGNS:
        tables = expected_of(name)
        for path in tables.keys() - WITHOUT_COLUMNS:
            described, table = output_of(path), tables[path]
            for column in columns_of(path, table):
                if path.endswith(".json"):
                    filled[described.file, column] = True
                    continue
                key = described.file, name_in_dictionary(described, column)
                rows_of_table = ~table["row"].isin(SUMMARIES)
                is_filled = bool((table.loc[rows_of_table, column] != "").any())
                filled[key] = filled.get(key, False) or is_filled
    return filled


def name_in_dictionary(described, column):
    """Return the name of a column, or the pattern with ``<x>`` for any word that stands for it."""
    entry = column_of(described, column)
    assert entry is not None, f"{described.file}: {column}"
    patterns = (name for name in entry.names if re.fullmatch(re.sub("<[^>]+>", ".+", name), column))
    return column if column in entry.names else next(patterns)


def columns_of_dictionary():
    """Return table and column of all that the dictionary describes, braces written out."""
    return {
        (output.file, name)
        for output in TABLES
        for column in output.columns
        for name in column.names
    }


def test_every_column_of_the_dictionary_is_in_a_golden_table():
    missing = columns_of_dictionary() - filled_columns().keys()
    assert missing == NOT_IN_A_TABLE.keys()


def test_every_column_holds_something_in_some_golden_table():
    empty = {key for key, is_filled in filled_columns().items() if not is_filled}
    assert empty == ALWAYS_EMPTY.keys()


def test_columns_that_are_known_to_be_wrong_are_in_the_dictionary_and_say_why():
    described = {output.file: output for output in TABLES}
    for entry in tomllib.loads(KNOWN_WRONG.read_text(encoding="utf-8"))["wrong"]:
        assert entry["issue"]
        assert entry["why"]
        for table in entry["tables"]:
            names = {name for column in entry["columns"] for name in alternatives(column)}
            if table in ("files", "results/report.html"):
                assert names == {"*"}
                continue
            for name in names - {"*"}:
                assert name_in_dictionary(described[table], name) == name
