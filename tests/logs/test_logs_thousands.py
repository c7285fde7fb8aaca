"""Numbers with thousands separators are read where the marks are clear, else left out.

What is left out is counted.
"""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import rftfit


def write(path, head, forces, times):
    delimiter = ";" if ";" in head else "\t" if "\t" in head else ","
    rows = [f"{time}{delimiter}{force}" for time, force in zip(times.split(), forces, strict=True)]
    path.write_text("\n".join([head, *rows]) + "\n", "utf-8")
    return path


def test_a_single_mark_is_not_guessed(tmp_path):
    """1,442 may be a thousand or a fraction: the row is left out and counted."""
    forces = ("0.5", '"1,442"', "2.5", '"1,44.2"', '"12,4421.5"', "3.5", "4.5")
    path = write(tmp_path / "log.csv", "time (s),Fz (N)", forces, "0.0 0.1 0.2 0.3 0.4 0.5 0.6")
    log = rftfit.read_log(path, text={"delimiter": ","})
    assert_array_equal(log.columns["Fz"], [0.5, 2.5, 3.5, 4.5])
    assert sum(log.dropped.values()) == 3


@pytest.mark.parametrize(
    ("column", "values"),
    [
        # the decimal mark of 7.834 has become a blank
        ("0.5 1.25 7~834 2.75 3.5", [0.5, 1.25, 2.75, 3.5]),
        ("0.5 1~442.25 7~834 2.75 3.5", [0.5, 1442.25, 2.75, 3.5]),
        # a digit of 1234567 has
        ("1234567 1234570 123~573 1234576 12~4579", [1234567, 1234570, 1234576]),
        ("1234567.5 123~573.5 1234576.5", [1234567.5, 1234576.5]),
        # thousands
        ("998 999 1~000 1~001 12~345", [998, 999, 1000, 1001, 12345]),
        ("998 9999 10~000 10~001", [998, 9999, 10000, 10001]),
        ("5 999.5 1~000 1~000.5", [5, 999.5, 1000, 1000.5]),
    ],
)
@pytest.mark.parametrize("rows_above", [0, 300])
def test_a_blank_parts_thousands_where_the_column_shows_it(tmp_path, column, values, rows_above):
    """Elsewhere it may be a damaged character: the row is left out and counted."""
    cells = column.replace("~", "\u00a0").split(" ")
    cells = cells[:1] * rows_above + cells
    path = tmp_path / "log.csv"
    rows = "".join(f"{place / 10};{cell}\n" for place, cell in enumerate(cells))
    path.write_text(f"time (s);Fz (N)\n{rows}", "utf-8")
    log = rftfit.read_log(path, text={"delimiter": ";"})
    assert log.columns["Fz"][rows_above:].tolist() == values
    assert log.size + sum(log.dropped.values()) == len(cells)


def test_a_column_may_have_the_other_decimal_mark(tmp_path):
    """As where a logger stamps rows with a point and an amplifier writes readings with a comma."""
    rows = [(0.02 * i, -1.25 * i + 0.5) for i in range(60)]
    text = "\n".join(
        ["Time (s);Force (N)", *(f"{t:.2f};{str(f).replace('.', ',')}" for t, f in rows)]
    )
    path = tmp_path / "a.csv"
    path.write_text(text + "\nx;1,5\n1.3;1,5\n")
    log = rftfit.read_log(path)
    assert log.columns.keys() == {"Time", "Force"}
    times, forces = np.array([*rows, (1.3, 1.5)]).T
    kept = np.isfinite(log.columns["Time"])
    np.testing.assert_allclose(log.columns["Time"][kept], times, atol=1e-12)
    np.testing.assert_allclose(log.columns["Force"][kept], forces, atol=1e-12)


@pytest.mark.parametrize("column", ["2", "column 2"])
def test_a_column_by_its_number_may_stand_in_quotes(column, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Time (s),Force (N)\n" + "".join(f"{i},{2 * i}\n" for i in range(9)))
    log = rftfit.read_log(path)
    assert log.columns[log.name_of(column)].tolist() == [2.0 * i for i in range(9)]
