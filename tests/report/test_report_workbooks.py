from __future__ import annotations

from typing import TYPE_CHECKING

import chain_tables as chain
import numpy as np
import pytest
from openpyxl import load_workbook  # type: ignore[import-untyped]

import rftfit
from rftfit import reference
from rftfit.errors import OutputError
from rftfit.figures.maps import half_width
from rftfit.page.workbooks import write_alpha_workbook, write_coefficient_workbook

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt
    from openpyxl.worksheet.worksheet import Worksheet  # type: ignore[import-untyped]


def block(sheet: Worksheet, head: str) -> tuple[list[object], list[object], np.ndarray]:
    """Columns, rows and values of the block under `head`."""
    top = next(row for row in range(1, sheet.max_row + 1) if sheet.cell(row, 1).value == head)
    width = 2
    while sheet.cell(top + 1, width).value is not None:
        width += 1
    heads = [sheet.cell(top + 1, column).value for column in range(2, width)]
    sides, values, row = [], [], top + 2
    while sheet.cell(row, 1).value is not None:
        sides.append(sheet.cell(row, 1).value)
        values.append([sheet.cell(row, column).value for column in range(2, width)])
        row += 1
    return heads, sides, np.array(values, dtype=object)


def same(got: npt.ArrayLike, wanted: npt.ArrayLike) -> None:
    """Equal to 15 digits; a workbook holds 16."""
    np.testing.assert_allclose(np.asarray(got, float), np.asarray(wanted, float), rtol=1e-14)


def numbers(values: np.ndarray) -> np.ndarray:
    flat = [value if isinstance(value, int | float) else np.nan for value in values.ravel()]
    return np.array(flat, dtype=float).reshape(values.shape)


def test_alpha_workbook_holds_the_tables(tmp_path: Path) -> None:
    tables = {medium: chain.alpha_table(medium) for medium in reference.MEDIA}
    write_alpha_workbook(tables, tmp_path / "alpha_tables.xlsx", chain.TITLES)
    book = load_workbook(tmp_path / "alpha_tables.xlsx")
    assert book.sheetnames == ["About", *reference.MEDIA]
    about = [cell.value for (cell,) in book["About"].iter_rows(max_col=1) if cell.value]
    assert f"Made by rftfit {rftfit.__version__}." in about
    for medium, table in tables.items():
        sheet = book[medium]
        for c in "zx":
            gamma, beta, values = block(sheet, f"alpha_{c} (N/cm^3)")
            np.testing.assert_allclose(np.array(gamma, float), reference.GAMMA_DEG, atol=0.006)
            np.testing.assert_allclose(np.array(beta, float), reference.BETA_DEG)
            wanted = table[f"alpha_{c}_N_per_cm3"].to_numpy(float).reshape(7, 13)
            same(numbers(values), wanted)
            head = f"half width of the 95 % interval of alpha_{c} (N/cm^3)"
            half = half_width(table, c).to_numpy(float).reshape(7, 13)
            same(numbers(block(sheet, head)[2]), half)


def test_missing_cells_say_so_and_why(tmp_path: Path) -> None:
    write_alpha_workbook({"poppy_LP": chain.alpha_table("poppy_LP")}, tmp_path / "a.xlsx")
    sheet = load_workbook(tmp_path / "a.xlsx")["poppy_LP"]
    empty = [cell for row in sheet.iter_rows() for cell in row if cell.value == "no run"]
    assert len(empty) == 4 * len(chain.MISSING)
    notes = [cell.comment.text for cell in empty if cell.comment is not None]
    assert len(notes) == len(empty)
    assert set(notes) == set(chain.MISSING.values())


def test_no_text_becomes_a_formula(tmp_path: Path) -> None:
    bad = ["=1+1", "+cmd", "-2+3", "@SUM(A1)", "http://example.org", "{=A1}"]
    tables = {
        f"m{i}": chain.alpha_table("poppy_LP", {(0.0, 0.0): text}) for i, text in enumerate(bad)
    }
    write_alpha_workbook(tables, tmp_path / "a.xlsx", {f"m{i}": text for i, text in enumerate(bad)})
    coefficients = chain.coefficient_table().replace({"medium": {"poppy_LP": "=1+1"}})
    write_coefficient_workbook(coefficients, tmp_path / "c.xlsx")
    for name in ("a.xlsx", "c.xlsx"):
        book = load_workbook(tmp_path / name)
        cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
        assert all(cell.data_type != "f" and cell.hyperlink is None for cell in cells)
        assert "=1+1" in [cell.value for cell in cells]


def test_sheet_names_are_made_acceptable(tmp_path: Path) -> None:
    names = ["About", "x" * 40, "x" * 41, "History", "a/b"]
    table = chain.alpha_table("poppy_LP")
    write_alpha_workbook(dict.fromkeys(names, table), tmp_path / "a.xlsx")
    sheets = load_workbook(tmp_path / "a.xlsx").sheetnames
    assert sheets == ["About", "About_2", "x" * 31, "x" * 29 + "_2", "History_2", "a_b"]


def test_coefficient_workbook_holds_values_intervals_and_what_was_published(tmp_path: Path) -> None:
    coefficients, penetration = chain.coefficient_table(), chain.penetration_table()
    published = {name: name for name in (*reference.MEDIA, "generic")}
    write_coefficient_workbook(
        coefficients, tmp_path / "c.xlsx", published, penetration, chain.TITLES
    )
    book = load_workbook(tmp_path / "c.xlsx")
    assert book.sheetnames == ["About", "lsq", "dft-index"]
    unit = "(N/cm^3; generic and zeta dimensionless)"
    media = [*reference.MEDIA, "generic"]
    for method in ("lsq", "dft-index"):
        sheet = book[method]
        rows = coefficients[coefficients["method"] == method]
        title = f"coefficients {unit}; grey: term not kept, counts as zero"
        heads, sides, values = block(sheet, title)
        assert heads == [*chain.TITLES.values(), "generic"]
        assert sides == [*chain.TERMS, "zeta"]
        wanted = rows.pivot_table(index="coefficient", columns="medium", values="value_N_per_cm3")
        same(numbers(values)[:9], wanted.loc[list(chain.TERMS), media])
        zeta = penetration[penetration["method"] == method].set_index("medium")["zeta"]
        same(numbers(values)[9], [*zeta[list(reference.MEDIA)], 1.0])
        both = block(sheet, f"95 % intervals {unit}")
        assert both[0][:2] == ["poppy seeds, loose, lower", "poppy seeds, loose, upper"]
        for part, start in (("lo", 0), ("hi", 1)):
            ends = rows.pivot_table(index="coefficient", columns="medium", values=part)
            got = numbers(both[2])[:9, start::2]
            same(got, ends.loc[list(chain.TERMS), media])
        printed = block(sheet, f"published, Table S2 {unit}")
        first = reference.coefficients("poppy_LP")
        same(numbers(printed[2])[:, 0], [first[term] for term in (*chain.TERMS, "zeta")])


def test_dropped_terms_are_grey(tmp_path: Path) -> None:
    coefficients = chain.coefficient_table()
    write_coefficient_workbook(coefficients, tmp_path / "c.xlsx")
    sheet = load_workbook(tmp_path / "c.xlsx")["lsq"]
    rows = coefficients[coefficients["method"] == "lsq"]
    kept = dict(
        zip(zip(rows["medium"], rows["coefficient"], strict=True), rows["kept"], strict=True)
    )
    for j, medium in enumerate((*reference.MEDIA, "generic"), start=2):
        for i, term in enumerate(chain.TERMS, start=5):
            color = sheet.cell(i, j).font.color
            grey = color is not None and color.rgb == "FF9A9A9A"
            assert grey == (not kept[medium, term])


def test_workbooks_are_the_same_bytes_in_any_folder(tmp_path: Path) -> None:
    for folder in ("one", "an other, \u00e9"):
        tables = {medium: chain.alpha_table(medium) for medium in reference.MEDIA[:2]}
        write_alpha_workbook(tables, tmp_path / folder / "a.xlsx", chain.TITLES)
        write_coefficient_workbook(chain.coefficient_table(), tmp_path / folder / "c.xlsx")
    for name in ("a.xlsx", "c.xlsx"):
        one, other = (
            (tmp_path / folder / name).read_bytes() for folder in ("one", "an other, \u00e9")
        )
        assert one == other


def test_a_workbook_that_cannot_be_written_is_an_output_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError, match="cannot write"):
        write_coefficient_workbook(chain.coefficient_table(), tmp_path / "file" / "c.xlsx")
