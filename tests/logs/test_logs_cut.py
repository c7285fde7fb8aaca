"""A cut or damaged text log gives all its complete rows: none is invented and none is lost.

Tested for every dialect of text. Dialect: the log format of a program.
"""

import gc
import io
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_files import TEXTS, check_rows, netft
from makers import answer_of, sentence_of
from numpy.testing import assert_array_equal
from seeds import example_count, seeds

import rftfit

NAMES = sorted(TEXTS)
"""Dialects of text."""
ROWS = 12
LOGS = {name: make(ROWS) for name, make in TEXTS.items()}
"""A small log of each dialect."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("cut") / "log.txt"


def read(reader, content, place):
    """The log, or the error by which it is refused."""
    place.write_bytes(content)
    try:
        return reader.load(place)
    except rftfit.RftfitError as error:
        message = str(error)
        assert str(place) in message
        return error


def whole_log(foreign_log, place):
    return read(foreign_log.reader, foreign_log.content, place)


@pytest.mark.parametrize("name", NAMES)
def test_a_whole_log_is_claimed_by_one_dialect_and_has_the_numbers_of_its_file(name, place):
    foreign_log = LOGS[name]
    log = whole_log(foreign_log, place)
    assert (log.rows, log.dropped, log.missing) == (ROWS, {}, {})
    cells_of_file = np.array([foreign_log.cells(line.decode()) for line in foreign_log.lines])
    cells_of_log = np.stack([log.columns[column] for column in foreign_log.raw], axis=1)
    assert_array_equal(cells_of_log, cells_of_file)
    assert (np.diff(log.columns["Time" if name in ("instron", "dated") else "time"]) > 0).all()
    assert "also claimed by" not in answer_of("inspect", place)[1]


def check_cut(foreign_log, full, stop, place):
    stops = np.cumsum([len(foreign_log.header), *map(len, foreign_log.lines)])[1:]
    # a data line is complete behind its first line end character
    ends = stops - [line.endswith(b"\r\n") for line in foreign_log.lines]
    complete = int((ends <= stop).sum())
    log = read(foreign_log.reader, foreign_log.content[:stop], place)
    if isinstance(log, Exception):
        assert complete == getattr(log, "rows", None) == 0
        return
    # a last line without an end is read where all of its cells are there
    assert log.size - complete in (0, 1)
    assert set(log.dropped) <= {sentence_of("cut")}
    assert log.rows - log.size in (0, 1)
    for name, values in full.columns.items() if log.size else ():
        # nothing tells whether the last number of a line without an end lacks its last digits
        told = complete if name == foreign_log.raw[-1] else log.size
        assert_array_equal(log.columns[name][:told], values[:told])


@pytest.mark.statistics
@pytest.mark.parametrize("name", NAMES)
def test_cut_anywhere(name, place):
    """At every byte of a short file, or at every fourth."""
    foreign_log = TEXTS[name](3)
    full = whole_log(foreign_log, place)
    for stop in range(0, len(foreign_log.content) + 1, seeds(1, 4)):
        check_cut(foreign_log, full, stop, place)


@pytest.mark.statistics
@settings(max_examples=example_count(60))
@given(name=st.sampled_from(NAMES), rows=st.integers(1, 400), share=st.floats(0, 1))
def test_cut_long(name, rows, share, tmp_path_factory):
    place = tmp_path_factory.getbasetemp() / "long.txt"
    foreign_log = TEXTS[name](rows)
    check_cut(
        foreign_log, whole_log(foreign_log, place), round(share * len(foreign_log.content)), place
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_bad_line_keeps_its_place_in_time(name, place):
    """What is left out is a gap; the rows below stay when they were."""
    foreign_log = LOGS[name]
    full = whole_log(foreign_log, place)
    for bad, reasons in (
        (foreign_log.lines[5][: len(foreign_log.lines[5]) // 2] + b"\n", ("cells", "number")),
        (_worse(foreign_log, b"x"), ("number",)),
        (_worse(foreign_log, b"nan"), ("finite",)),
        (b"\x00\xff\xfe garbage\n", ("cells", "number")),
    ):
        lines = [*foreign_log.lines[:5], bad, *foreign_log.lines[6:]]
        log = read(foreign_log.reader, foreign_log.header + b"".join(lines), place)
        assert (log.rows, log.size) == (ROWS, ROWS - 1), bad
        assert set(log.dropped) <= {*map(sentence_of, reasons)}, bad
        assert not log.missing
        keep = np.arange(ROWS) != 5
        for column, values in full.columns.items():
            assert_array_equal(log.columns[column], values[keep])


def _worse(foreign_log, word):
    """The sixth line with its last number replaced."""
    *_, last_number = re.finditer(rb"-?\d+[.,]\d+", foreign_log.lines[5])
    return (
        foreign_log.lines[5][: last_number.start()]
        + word
        + foreign_log.lines[5][last_number.end() :]
    )


@pytest.mark.statistics
@settings(max_examples=example_count(80))
@given(
    name=st.sampled_from(NAMES),
    spots=st.lists(st.tuples(st.floats(0, 0.9999), st.binary(max_size=3)), min_size=1, max_size=4),
)
def test_no_row_is_invented(name, spots, tmp_path_factory):
    """Whatever bytes are changed: each row that comes back stands in a line of the file."""
    foreign_log = LOGS[name]
    content = bytearray(foreign_log.content)
    for share, patch in spots:
        spot = round(share * len(content))
        content[spot : spot + len(patch)] = patch
    log = read(foreign_log.reader, bytes(content), tmp_path_factory.getbasetemp() / "patched.txt")
    if not isinstance(log, Exception):
        check_rows(foreign_log, log, bytes(content))


@pytest.mark.parametrize("name", sorted({*NAMES} - {"ati-netft", "lvm"}))  # no number first
def test_a_byte_order_mark_within_the_file_is_damage(name, place):
    """Parsers pass over one at the start of what they are given, and take the cell without it."""
    foreign_log = LOGS[name]
    lines = [b"\xef\xbb\xbf" + foreign_log.lines[0].lstrip()[1:], *foreign_log.lines[1:]]
    log = read(foreign_log.reader, foreign_log.header + b"".join(lines), place)
    assert log.rows - 1 == log.size == ROWS - 1


def test_an_error_that_is_kept_holds_no_file_open(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,Fx,Fy,Fz\n0,1,2", "utf-8")
    gc.collect()
    gc.disable()  # a file in a circle of references is closed by the collector only
    try:
        with pytest.raises(rftfit.RftfitError) as error:
            rftfit.read_log(path, "delimited")
        files = [file for file in gc.get_objects() if isinstance(file, io.BufferedReader)]
        still_open = [file for file in files if file.name == str(path) and not file.closed]
    finally:
        gc.enable()
    assert str(path) in str(error.value)
    assert still_open == []


@pytest.mark.parametrize(
    ("numbers", "counted", "missing"),
    [
        ([5, 6, 8, 9], [0, 1, 3, 4], 1),
        ([2**32 - 2, 2**32 - 1, 0, 1], [0, 1, 2, 3], 0),
        ([2**32 - 1, 2, 1, 3], [0, 3, 2, 4], 1),
    ],
)
def test_packets_are_counted_past_the_end_of_their_counter(numbers, counted, missing, place):
    """A counter of 32 bits goes on at 0; a packet that comes late is not missing."""
    foreign_log = netft(len(numbers))
    lines = [
        line.replace(b'"%d"' % (26049 + row), b'"%d"' % number, 1)
        for row, (line, number) in enumerate(zip(foreign_log.lines, numbers, strict=True))
    ]
    log = read(foreign_log.reader, foreign_log.header + b"".join(lines), place)
    assert_array_equal(log.columns["time"], np.array(counted) / 125)
    assert sum(log.missing.values()) == missing
