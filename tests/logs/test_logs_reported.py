"""Files reported by users give their known values when they are read as `rftfit inspect` proposes.

The values are those of the README of the files (../shared/data/reported).
"""

import re
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from seeds import seeds
from third_party import REPORTED, alpha_of, inspected, needs, proposal, read_by, truth

import rftfit

pytestmark = needs(REPORTED)

ALPHA = 1.0187
"""Of the push that most of these files hold, N/cm^3."""
BY_NUMBER = {
    "force_log": {"time": 1, "F3": {"column": 2, "unit": "N"}},
    "motion_log": {"time": 1, "z": {"column": 3, "unit": "mm"}},
}
"""Columns named by their numbers."""
DOWNWARD = {"factor": -1, "offset": 10, "unit": "mm"}
"""A position that counts downward from 10 mm."""
PUSHES: dict[str, dict[str, Any]] = {
    "m01_plotjuggler_sparse.csv": {},
    "m41_late_start.csv": {"zero": {"method": "stated", "sd_N": 0.01}},  # begins 0.1 s before
    "b40_sparse.xlsx": {},
    "b45_text_numbers.xlsx": {},
    "b14_cf_packed.h5": {},
    "b11_scaled.h5": {},
    "b20_object.npz": {},
    "m06_labels.txt": {},
    "m06_serial_monitor.txt": BY_NUMBER,
    "m09_lammps_ave.txt": {
        "motion_log": {"time": {"column": 2, "unit": "s"}, "z": {"column": "v_zc", "unit": "m"}}
    },
    "m13_toa5.dat": {"motion_log": {"time": "TIMESTAMP", "z": "Disp"}},
    "m16_bluehill_results.csv": {"motion_log": {"z": {"column": "Extension", **DOWNWARD}}},
    "m18_fullwidth.csv": {"motion_log": {"z": {"column": 3, **DOWNWARD}}},
    "m19_unicode_minus.csv": {},
    "m35_mts_blocks.dat": {},
    "m36_month_name.csv": {},
    "g1_stamp_0.04s.csv": {},
    "b30_lists.parquet": {
        "motion_log": {
            "time": {"column": "timestamp", "unit": "s"},
            "z": {"column": "observation.state column 3", "unit": "m"},
        }
    },
    "b10_compound.h5": {
        "motion_log": {
            "time": {"column": "log.ft.t", "unit": "ns"},
            "z": {"column": "log.ft.z", "unit": "m"},
        }
    },
}
"""File to the columns that a user puts in place of those proposed."""


@pytest.mark.parametrize("file", PUSHES)
def test_a_push_gives_its_alpha(file, tmp_path):
    """From the proposal, with what only a user can know, to the coefficient."""
    proposed = proposal(REPORTED / file)
    for key, columns in PUSHES[file].items():
        if key == "zero":
            proposed[key] = columns
            continue
        section = proposed.setdefault(
            key, {k: v for k, v in proposed["force_log"].items() if k != "columns"}
        )
        section["columns"] = {**(section.get("columns") or {}), **columns}
    alpha, codes = alpha_of(tmp_path / "one", REPORTED / file, proposed)
    assert alpha == pytest.approx(ALPHA, abs=3e-4)
    assert not {"cut-rows", "not-finite"}.intersection(codes)


@pytest.mark.parametrize(
    ("file", "forces", "poses"),
    [("m01_plotjuggler_sparse.csv", 700, 140), ("b40_sparse.xlsx", 700, 140)],
)
def test_two_rates_in_one_table(file, forces, poses):
    """Each log has the rows in which it has a value; nothing is lost of the other."""
    logs = read_by(REPORTED / file, proposal(REPORTED / file))
    assert (logs["force_log"].size, logs["motion_log"].size) == (forces, poses)
    assert_allclose(logs["force_log"].columns["F3"], truth()["F"])


def proposal_with_stamps(file):
    """What `inspect` proposes, but with the stamps of the first column in place of a rate."""
    proposed = proposal(REPORTED / file)
    for section in (proposed["force_log"], proposed["motion_log"]):
        section["columns"] |= {"time": {"column": 1, "unit": "s"}}
        section["text"].pop("rate_Hz", None)
    return proposed


def test_stamps_coarser_than_the_rows_lead_to_a_rate(tmp_path):
    assert proposal(REPORTED / "g1_stamp_0.04s.csv")["force_log"]["text"]["rate_Hz"] == 50
    proposed = proposal_with_stamps("m04_sixdigits.csv")
    with pytest.raises(AssertionError, match=": rate_Hz"):
        alpha_of(tmp_path / "one", REPORTED / "m04_sixdigits.csv", proposed)


def test_stamps_that_two_rows_share_are_spread(tmp_path):
    proposed = proposal_with_stamps("g1_stamp_0.04s.csv")
    alpha, codes = alpha_of(tmp_path / "one", REPORTED / "g1_stamp_0.04s.csv", proposed)
    assert alpha == pytest.approx(1.0187, rel=0.005)
    assert "stamps-of-arrival" in codes


FILES = sorted(path for path in REPORTED.glob("*") if path.name not in ("README.md", "truth.npz"))
SEVERAL = {
    "c23_two_sensors": ("topic", "/tool .*/wrench "),
    "m50_long_format.csv": ("several-sources", "sensor .*'ft_other', 'ft_plate'"),
}
"""File of several sensors to the code of its refusal, and what it names."""


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_what_is_proposed_is_read(path):
    """No quantity of the proposal is refused, and no column that is not read holds a number."""
    if path.name in SEVERAL:
        code, values = SEVERAL[path.name]
        with pytest.raises(rftfit.RftfitError, match=values) as error:
            proposal(path)
        assert getattr(error.value, "code", "") == code
        return
    surveys, proposed = inspected(path)
    for log in read_by(path, proposed).values():
        assert log.size > 0 or not log.columns
    for survey in surveys:
        for reason in survey.unread.values():
            assert not re.match(r"'[-+.0-9]*'", reason), reason


# --- Headers made by rules: what is proposed is read, whatever stands above the numbers


ROWS = 60
HEADERS = {
    "names": ["{names}"],
    "units in names": ["{both}"],
    "units below": ["{names}", "{units}"],
    "units in brackets below": ["{names}", "{brackets}"],
    "mark": ["# {names}"],
    "mark without a blank": ["%{names}"],
    "marks of names and units": ["% {names}", "% {units}"],
    "names parted by blanks": ["% {blanks}"],
    "marks and settings": ["# rate 50", "#", "# {names}"],
    "no names": [],
    "fewer names": ["{two}"],
    "more names": ["{names}{cut}note{cut}remark"],
    "one word more": ["{names}{cut}note"],
    "title": ["Test of Tuesday", "", "{names}"],
    "a line below": ["{names}", "-----"],
    "types below": ["{names}", "{units}", "{cut}Smp{cut}Smp"],
    "results above": [
        "run{cut}peak{cut}depth",
        "1{cut}9.5{cut}5",
        "2{cut}8.5{cut}5",
        "",
        "{names}",
        "{units}",
    ],
}
"""Lines above the numbers."""
CELLS = {
    "full": (0, "", range(0)),
    "force in every third row": (1, "", [row for row in range(ROWS) if row % 3]),
    "z begins late": (2, "", range(45)),
    "z ends early": (2, "", range(25, ROWS)),
    "nan between": (1, "nan", range(0, ROWS, 2)),
    "a dash between": (2, "-", [row for row in range(ROWS) if row % 4]),
    "words between": (2, "OL", range(2, ROWS, 5)),
    "words mostly": (2, "rest", [row for row in range(ROWS) if row % 7]),
}
"""Which cell of some rows holds no number, and what it holds."""
DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blank"}
MADE = [
    (header, cells, cut)
    for header in HEADERS
    for cells, (_, word, rows) in CELLS.items()
    for cut in DELIMITERS
    if (cut != " " or word or not rows) and (cut not in "|;" or cells == "full")
]


def made_log(header, cells, cut):
    """Return the text of a log, and its numbers, NaN where a cell has none."""
    names, units = ("Time", "Force", "z"), ("s", "N", "mm")
    joined = "{}_{}" if cut == " " else "{} ({})"
    words = {
        "cut": cut,
        "names": cut.join(names),
        "two": cut.join(names[:2]),
        "blanks": " ".join(names),
        "units": cut.join(units),
        "brackets": cut.join(f"({unit})" for unit in units),
        "both": cut.join(map(joined.format, names, units)),
    }
    values = np.array([(row / 50, 0.5 * row, 10 - 0.25 * row) for row in range(ROWS)])
    place, word, without = CELLS[cells]
    texts = [[f"{time:.2f}", f"{force:.1f}", f"{z:.2f}"] for time, force, z in values]
    for row in without:
        texts[row][place], values[row, place] = word, np.nan
    lines = [line.format(**words) for line in HEADERS[header]]
    return "\n".join([*lines, *map(cut.join, texts), ""]), values


@pytest.mark.statistics
@pytest.mark.parametrize("header", HEADERS)
def test_what_is_proposed_for_made_headers_is_read(header, tmp_path):
    """In all numbers of the file, none of them in a column that is called unread."""
    for number, (_, cells, cut) in enumerate(
        made_header for made_header in MADE[:: seeds(1, 3)] if made_header[0] == header
    ):
        case = f"{header}, {cells}, {DELIMITERS[cut]}"
        path = tmp_path / f"{number}.txt"
        text, values = made_log(header, cells, cut)
        path.write_text(text, "utf-8")
        (survey,), proposed = inspected(path)
        assert survey.unread == {}, case
        is_number = np.isfinite(values)
        if cells == "words between":  # a word among numbers is damage, and costs the row
            is_number &= is_number.all(axis=1)[:, None]
        assert [column.values for column in survey.columns[:3]] == [*is_number.sum(axis=0)], case
        for key, quantity, place in (("force_log", "F3", 1), ("motion_log", "z", 2)):
            if quantity in ((proposed.get(key) or {}).get("columns") or {}):
                log = read_by(path, {key: proposed[key]})[key]
                is_whole_row = np.isfinite(values[:, place])
                assert_allclose(log.columns[quantity], values[is_whole_row, place], err_msg=case)
                assert_allclose(log.columns["time"], values[is_whole_row, 0], err_msg=case)
