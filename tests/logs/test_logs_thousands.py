"""Numbers with thousands separators are read where the marks are clear, else left out.

What is left out is counted.
"""

import pytest

import rftfit


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


@pytest.mark.parametrize("column", ["2", "column 2"])
def test_a_column_by_its_number_may_stand_in_quotes(column, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("Time (s),Force (N)\n" + "".join(f"{i},{2 * i}\n" for i in range(9)))
    log = rftfit.read_log(path)
    assert log.columns[log.name_of(column)].tolist() == [2.0 * i for i in range(9)]
