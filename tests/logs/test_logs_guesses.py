"""Columns that could be a quantity which no column of a log is by its name are pointed out."""

from makers import json_of


def test_columns_whose_unit_could_be_that_of_a_missing_quantity_are_named(tmp_path):
    rows = [f"{row / 10},{row},{2 * row},{3 * row}" for row in range(100)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time [s],F3 [N],cell left [mN],lamp [V]", *rows, ""]), "utf-8")
    lines = json_of("inspect", path)["config"]
    assert "    # F2: no column looks like it; with such a unit: cell left" in lines
    assert "lamp" not in "".join(lines)
