"""Channels of a LabVIEW file (.lvm) that have different clocks are never read with one time."""

import re

import numpy as np
import pytest
from log_files import lvm, refused
from numpy.testing import assert_allclose, assert_array_equal

from rftfit.logs.registry import dialect

LVM = dialect("lvm")
ROWS = 20
STEP = 0.01 * np.arange(ROWS)


def changed(path, key, second_value, *, segment=0, segments=1):
    """A file in which one key of one segment's header says something else of the second channel."""
    head, *segment_texts = lvm(ROWS, segments=segments).content.decode().split("Channels\t")
    pattern = re.compile(rf"^({key}\t[^\t]*)\t.*$", re.MULTILINE)
    segment_texts[segment] = pattern.sub(
        rf"\g<1>\t{second_value}\t", segment_texts[segment], count=1
    )
    path.write_text("Channels\t".join([head, *segment_texts]), "utf-8")
    return path


def clocks_differ(path, *clocks):
    error = refused(LVM, path, "clocks", *clocks)
    assert error.groups == [["Force z"], ["z"]]


@pytest.mark.parametrize(
    ("key", "second_value", "expected_time"),
    [
        ("X0", "0,5", 0.5 + STEP),
        ("Delta_X", "0,02", 2 * STEP),
        ("Time", "03:04:05,75", 0.5 + STEP),
        ("Date", "2026/01/03", 86400 + STEP),
    ],
)
def test_channels_on_clocks_of_their_own(tmp_path, key, second_value, expected_time):
    path = changed(tmp_path / "a.lvm", key, second_value)
    clocks_differ(path, "'Force z' from 0 s, every 0.01 s; 'z' from ")
    # each gets its own time, counted from one moment
    for names, time in (({"Force z", "F1"}, STEP), ({"z", "x"}, expected_time)):
        log = LVM.only(names).load(path)
        assert set(log.columns) == {"time", *names.intersection({"Force z", "z"})}
        assert_allclose(log.columns["time"], time, atol=1e-6)


def test_a_blank_in_the_header_says_nothing_else(tmp_path):
    log = LVM.load(changed(tmp_path / "a.lvm", "X0", ""))
    assert_allclose(log.columns["time"], STEP)


def test_a_later_segment_is_looked_at_too(tmp_path):
    path = changed(tmp_path / "a.lvm", "X0", "0,5", segment=1, segments=2)
    clocks_differ(path)
    log = LVM.only({"z"}).load(path)
    assert_allclose(log.columns["time"], [*STEP, *(10.5 + STEP)], atol=1e-6)


def with_x(path, columns, shift, late=0.0):
    """One X column or one for each channel; the second `shift` later in it, `late` in the header."""
    multi = columns == "Multi"
    head = lvm(ROWS).header.decode().replace("X_Columns\tNo", f"X_Columns\t{columns}")
    began = f"Time\t03:04:05,25\t03:04:{5.25 + late:09.6f}"
    head = head.replace("Time\t03:04:05,25\t03:04:05,25", began)
    if multi:
        head = head.replace("X_Value\tForce z\tz", "X_Value\tForce z\tX_Value\tz")
    lines = []
    for row, time in enumerate(STEP):
        second_time = f"\t{time + shift:.6f}" if multi else ""
        lines.append(f"{time:.6f}\t{row:.1f}{second_time}\t{-row:.1f}\n")
    path.write_text((head + "".join(lines)).replace(".", ","), "utf-8")
    return path


def test_a_log_says_where_its_time_comes_from(tmp_path):
    path = tmp_path / "counted.lvm"
    path.write_bytes(lvm(ROWS).content)
    counted = LVM.load(path)
    assert any(note.startswith("time is X0 + row x Delta_X (") for note in counted.notes)
    written = LVM.load(with_x(tmp_path / "x.lvm", "One", 0.0))
    assert "time is X_Value" in written.notes


@pytest.mark.parametrize(
    ("columns", "shift", "late"),
    [("Multi", 0.5, 0.0), ("Multi", 0.0, 0.5), ("Multi", 0.5, 0.5), ("One", 0.0, 0.5)],
)
def test_x_columns_that_differ(tmp_path, columns, shift, late):
    path = with_x(tmp_path / "a.lvm", columns, shift, late)
    clocks_differ(path, "0 s, " if columns == "One" else f"0 s, {shift + late:g} s ")
    force, motion = (LVM.only({name}).load(path) for name in ("Force z", "z"))
    assert_allclose(force.columns["time"], STEP, atol=1e-6)
    assert_allclose(motion.columns["time"], shift + late + STEP, atol=1e-6)
    assert_array_equal(motion.columns["z"], -np.arange(ROWS))


def test_x_columns_that_agree(tmp_path):
    """Also where a later segment's start and X together give one time."""
    for columns, shift, late in (("Multi", 0.0, 0.0), ("Multi", -0.5, 0.5), ("One", 0.0, 0.0)):
        log = LVM.load(with_x(tmp_path / "a.lvm", columns, shift, late))
        assert_allclose(log.columns["time"], STEP, atol=1e-6)
        assert_array_equal(log.columns["Force z"], np.arange(ROWS))


def with_blanks(path, rows, place, count):
    """A file whose cells of one channel are blank in its first rows."""
    head, _, body = lvm(rows, comment=False).content.decode().rpartition("Comment\n")
    lines = [line.split("\t") for line in body.splitlines()]
    for cells in lines[:count]:
        cells[place] = ""
    path.write_text(head + "Comment\n" + "".join("\t".join(cells) + "\n" for cells in lines))
    return path


@pytest.mark.parametrize(("place", "empty", "full"), [(1, "Force z", "z"), (2, "z", "Force z")])
def test_a_channel_without_values_costs_the_others_nothing(tmp_path, place, empty, full):
    log = LVM.load(with_blanks(tmp_path / "a.lvm", ROWS, place, ROWS))
    assert (set(log.columns), log.size) == ({"time", full}, ROWS)
    assert any(note.endswith(f": {empty}") for note in log.notes)


def test_a_channel_that_starts_later_is_read(tmp_path):
    """Its blank cells cost the other channel nothing."""
    path = with_blanks(tmp_path / "a.lvm", 60, 1, 50)
    log = LVM.load(path)
    assert np.isnan(log.columns["Force z"]).tolist() == [True] * 50 + [False] * 10
    assert np.isfinite(log.columns["z"]).all()
    assert LVM.only({"z"}).load(path).size == 60
    force = LVM.only({"Force z"}).load(path)
    assert (force.size, [*force.dropped.values()]) == (10, [50])
    assert_allclose(force.columns["time"], log.columns["time"][50:])


def test_a_segment_without_a_column_is_refused(tmp_path):
    lines = lvm(ROWS, comment=False).content.decode().splitlines(keepends=True)
    names_at = next(place for place, line in enumerate(lines) if line.startswith("X_Value"))
    lines[names_at] = "\t\t\n"
    path = tmp_path / "log.lvm"
    path.write_text("".join(lines), "utf-8")
    refused(LVM, path, "header", "found '' ")
