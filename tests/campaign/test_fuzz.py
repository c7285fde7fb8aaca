"""Any bytes in a config file or run sheet give a list of problems and never an exception."""

import tempfile
from functools import cache
from pathlib import Path

import pytest
from campaigns import CONFIG, Room
from hypothesis import given, settings
from hypothesis import strategies as st
from seeds import example_count

from rftfit.campaign.load import check_campaign

from .test_workbook import book_of

# pieces that lead further in than random bytes do
PIECES = st.sampled_from(
    [*b" \n\t:,;-[]{}&*!|>'\"#%@`~?=", *map(str.encode, CONFIG.split("\n")), b"\r\n", b"\x00"]
).map(lambda piece: piece if isinstance(piece, bytes) else bytes([piece]))
BYTES = st.binary(max_size=300) | st.lists(PIECES, max_size=40).map(b"".join)
"""Random bytes, or a text of these pieces."""


@cache
def sound_files():
    """A valid run sheet as csv and as xlsx, in bytes."""
    with tempfile.TemporaryDirectory() as folder:
        room = Room(Path(folder))
        return room.text().encode(), book_of(room)


def run(config, sheet, name):
    """Check a campaign with this config and this sheet."""
    with tempfile.TemporaryDirectory() as folder:
        room = Room(Path(folder))
        room.write(sheet, name)
        if config is not None:
            room.path.write_bytes(config)
        check(room)


def with_hole(data, content, filling):
    """The bytes with some of them taken out and others put in their place."""
    start = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(start, min(len(content), start + 40)))
    return content[:start] + data.draw(filling) + content[end:]


@pytest.mark.statistics
@settings(max_examples=example_count(150))
@given(BYTES)
def test_any_config(data):
    run(data, None, "runs.csv")


@pytest.mark.statistics
@settings(max_examples=example_count(100))
@given(st.data())
def test_a_config_with_a_hole(data):
    run(with_hole(data, CONFIG.encode(), BYTES), None, "runs.csv")


@pytest.mark.statistics
@settings(max_examples=example_count(150))
@given(BYTES, st.sampled_from(["runs.csv", "runs.tsv", "runs.xlsx"]))
def test_any_sheet(data, name):
    run(None, data, name)


@pytest.mark.statistics
@settings(max_examples=example_count(150))
@given(st.data())
def test_a_sheet_with_a_hole(data):
    sheet = sound_files()[data.draw(st.integers(0, 1))]
    run(None, with_hole(data, sheet, st.binary(max_size=20)), "runs.csv")


WORDS = [
    "",
    "p1",
    "t1",
    "plate",
    "rod",
    "leg",
    "leg_air",
    "poppy_LP",
    "horizontal",
    "rotation",
    "yes",
]


CELLS = st.text(max_size=12) | st.sampled_from(WORDS) | st.floats().map(str)


NAMES = st.sampled_from(sound_files()[0].decode().split("\n")[0].split(","))


@pytest.mark.statistics
@settings(max_examples=example_count(150))
@given(st.lists(st.dictionaries(NAMES, CELLS), max_size=6))
def test_any_cells(rows):
    with tempfile.TemporaryDirectory() as folder:
        room = Room(Path(folder))
        for number, row in enumerate(rows):
            room.rows[f"x{number}"] = {**room.rows["p1"], **row}
        room.write(room.text().encode("utf-8", "surrogatepass"))
        check(room)


def check(room):
    """A campaign or an error, and problems that can be printed."""
    campaign, problems = check_campaign(room.path)
    assert (campaign is None) == any(problem.severity == "error" for problem in problems)
    assert all(str(problem).isprintable() for problem in problems)
