"""Small logs beside what they hold: read by `rftfit.read_log` and by `rftfit inspect`.

`data/expected.toml` names for each log its columns, units, numbers, and the rows that are left out.
"""

import tomllib
from collections import defaultdict

import numpy as np
import pytest
import yaml
from makers import LOGS as DATA
from makers import expected_logs, json_of, refused
from makers import read_expected as read
from numpy.testing import assert_allclose

import rftfit

LOGS = expected_logs()
HEADERS = tomllib.loads((DATA / "expected.toml").read_text("utf-8"))["header"]
QUANTITIES = {"time", "F1", "F2", "F3", "x", "z", "angle"}
USUAL_UNITS = "", "s", "N", "mm", "deg"
READABLE = [log for log in LOGS if "refused" not in log]


def name_of(log):
    return f"{log['file']}, {log['why']}"


def words_of(log):
    """Words of `rftfit inspect` that read a log as `read` does."""
    words = ["--dialect", log["read_as"]] if "read_as" in log else []
    for key, setting in log.get("options", {}).items():
        words += ["--option", f"{key}={setting}"]
    return ["inspect", DATA / log["file"], *words]


def test_every_file_has_an_entry():
    assert {log["file"] for log in LOGS} == {
        path.name for path in DATA.iterdir() if path.name != "expected.toml"
    }


@pytest.mark.parametrize("expected", READABLE, ids=name_of)
def test_a_log_is_read_as_it_was_written(expected):
    log = read(expected)
    assert list(log.columns) == [name for name, *_ in expected["columns"]]
    for name, unit, first, last, total, blank in expected["columns"]:
        column = log.columns[name]
        finite = column[np.isfinite(column)]
        assert log.units[name] == unit
        assert int(np.isnan(column).sum()) == blank
        assert_allclose([finite[0], finite[-1]], [first, last], rtol=1e-12, atol=1e-6, err_msg=name)
        assert_allclose(finite.sum(), total, rtol=1e-12, atol=1e-6, err_msg=name)
    assert log.rows == expected["rows"]
    assert log.size == expected["rows"] - sum(expected.get("dropped", {}).values())
    assert sorted(log.dropped.values()) == sorted(expected.get("dropped", {}).values())
    assert sorted(log.missing.values()) == sorted(expected.get("missing", {}).values())
    assert set(log.unread) == set(expected.get("unread", []))
    if "notes" in expected:
        assert len(log.notes) == expected["notes"]


@pytest.mark.parametrize("expected", [log for log in READABLE if "text" not in log], ids=name_of)
def test_inspect_shows_what_is_read(expected):
    log = read(expected)
    content = json_of(*words_of(expected))
    assert content["dialect"] == expected["dialect"]
    assert content["refused"] is None
    (clock,) = content["clocks"]
    assert (clock["rows"], clock["used"]) == (log.rows, log.size)
    assert (clock["dropped"], clock["missing"]) == (log.dropped, log.missing)
    assert set(clock["unread"]) == set(log.unread)
    assert [column["name"] for column in clock["columns"]] == list(log.columns)
    for column in clock["columns"]:
        numbers = log.columns[column["name"]]
        assert column["unit"] == log.units[column["name"]]
        assert (column["lowest"], column["highest"]) == (np.nanmin(numbers), np.nanmax(numbers))
        assert column["values"] == np.isfinite(numbers).sum()
    sections = config_sections(content["config"])
    if "quantities" in expected:
        assert columns_by_quantity(sections, log) == expected["quantities"]
    if "time_unit" in expected:
        assert clock["time_unit"] == expected["time_unit"]
    no_value_codes = {code for section in sections for code in section.get("missing", [])}
    assert no_value_codes == {*expected.get("no_value_codes", [])}


def config_sections(lines):
    """Sections of the proposed config that describe a log."""
    config = yaml.safe_load("\n".join(lines))
    return [section for name, section in config.items() if name in ("force_log", "motion_log")]


def columns_by_quantity(sections, log):
    """Column of each quantity, with its unit where the config has to declare one other than the file's."""
    columns = {}
    for section in sections:
        for quantity, entry in (section.get("columns") or {}).items():
            described = entry if isinstance(entry, dict) else {"column": entry}
            name, unit = described["column"], described.get("unit", "")
            # of a column without a unit the proposal is a guess, and part of what is expected
            is_guess = unit not in (log.units[name], *USUAL_UNITS)
            columns[quantity] = f"{name} in {unit}" if is_guess else name
    # what has its quantity's own name needs no line
    return {name: name for name in sorted(QUANTITIES & log.columns.keys())} | columns


@pytest.mark.parametrize("expected", [log for log in LOGS if "refused" in log], ids=name_of)
def test_a_log_is_refused_with_its_code(expected):
    with pytest.raises(rftfit.RftfitError) as caught:
        read(expected)
    assert caught.value.exit_code == 2
    assert getattr(caught.value, "code", "") == expected["refused"]
    place, _, cause = str(caught.value).partition(": ")
    assert place == str(DATA / expected["file"])
    for quoted in expected.get("quotes", []):
        assert quoted in cause
    assert expected.get("advice", "") in cause.splitlines()[0]
    if "text" in expected:  # whose description the command does not take as a whole
        return
    assert expected["file"] in refused(*words_of(expected))


@pytest.mark.parametrize("counts", ["dropped", "missing"])
def test_each_reason_is_told_from_the_others(counts):
    """Short names of the table and sentences of the logs belong together, one to one."""
    sentences: defaultdict[str, set[str]] = defaultdict(set)
    for expected in READABLE:
        if len(expected.get(counts, {})) == 1:
            sentences[next(iter(expected[counts]))] |= getattr(read(expected), counts).keys()
    assert all(len(of_reason) == 1 for of_reason in sentences.values()), sentences
    sentence_of = {reason: next(iter(of_reason)) for reason, of_reason in sentences.items()}
    assert len({*sentence_of.values()}) == len(sentence_of)
    for expected in READABLE:
        if len(expected.get(counts, {})) > 1:
            by_sentence = getattr(read(expected), counts)
            assert by_sentence == {
                sentence_of[reason]: number for reason, number in expected[counts].items()
            }


def proposals(header, folder):
    """Words for the quantity of each column with such a header, by column; columns without one are left out."""
    cells = range(1, len(header["names"]) + 1)
    path = folder / "log.csv"
    rows = [",".join(f"{row}.{cell}5" for cell in cells) for row in range(4)]
    path.write_text("\n".join([",".join(header["names"]), *rows, ""]), "utf-8")
    (clock,) = json_of("inspect", path)["clocks"]
    assert len(clock["columns"]) == len(header["names"])
    return {c["name"]: c["quantity"] for c in clock["columns"] if c["quantity"] != "-"}


@pytest.mark.parametrize("header", HEADERS, ids=lambda header: "|".join(header["names"]))
def test_columns_of_a_header_that_have_a_quantity(header, tmp_path):
    assert set(proposals(header, tmp_path)) == {*header["quantities"].values()}


def test_each_quantity_has_its_own_words(tmp_path):
    words_of_quantity = defaultdict(set)
    for header in HEADERS:
        proposed = proposals(header, tmp_path)
        for quantity, column in header["quantities"].items():
            words_of_quantity[quantity].add(proposed[column])
    assert all(len(words) == 1 for words in words_of_quantity.values()), words_of_quantity
    assert len(set.union(*words_of_quantity.values())) == len(words_of_quantity) == 9
