"""The xlsx workbooks of results hold the tables' numbers, no formula and always the same bytes."""

import io
from itertools import takewhile

import numpy as np
import pytest
import result_tables as chain
from numpy.testing import assert_allclose
from openpyxl import load_workbook  # type: ignore[import-untyped]
from paper import paper_config
from result_tables import bare_campaign, write

import rftfit
from rftfit import reference
from rftfit.model.fourier import TERMS
from rftfit.page.workbooks import workbooks

MEDIA = [*reference.MEDIA, "generic"]


def campaign(folder, missing=chain.MISSING, titles=None):
    """The paper's five media."""
    media = dict(paper_config().media)
    for name, title in (titles or {}).items():
        media[name] = media[name].model_copy(update={"title": title})
    results = bare_campaign(folder, reference.MEDIA, media=media)
    for medium in results.media:
        write(results, f"alpha/{medium}.csv", chain.alpha_table(medium, missing))
    write(results, "coefficients.csv", chain.coefficient_table())
    write(results, "penetration.csv", chain.penetration_table())
    return results


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return campaign(tmp_path_factory.mktemp("campaign"))


@pytest.fixture(scope="module")
def books(results):
    alpha, coefficients = (load_workbook(io.BytesIO(content)) for content in workbooks(results))
    return alpha, coefficients


def block(sheet, head):
    """Columns, rows and values of the block under `head`."""
    rows = [list(row) for row in sheet.iter_rows(values_only=True)]
    top = next(place for place, row in enumerate(rows) if row[0] == head) + 1
    heads = list(takewhile(lambda cell: cell is not None, rows[top][1:]))
    body = list(takewhile(lambda row: row[0] is not None, rows[top + 1 :]))
    values = np.array([row[1 : 1 + len(heads)] for row in body], dtype=object)
    return heads, [row[0] for row in body], values


def same(actual, expected):
    """Equal to 15 digits; a workbook holds 16."""
    assert_allclose(np.asarray(actual, float), np.asarray(expected, float), rtol=1e-14)


def numbers(values):
    to_numbers = np.vectorize(
        lambda cell: cell if isinstance(cell, int | float) else np.nan, [float]
    )
    return to_numbers(values)


def test_alpha_workbook_holds_the_tables(results, books):
    book, _ = books
    assert book.sheetnames == ["About", *reference.MEDIA]
    about = [cell.value for (cell,) in book["About"].iter_rows(max_col=1) if cell.value]
    assert f"Made by rftfit {rftfit.__version__}." in about
    for medium in results:
        sheet, table = book[medium.name], medium.alpha
        for c in "zx":
            gamma, beta, values = block(sheet, f"alpha_{c} (N/cm^3)")
            assert_allclose(np.array(gamma, float), reference.GAMMA_DEG, atol=0.006)
            assert_allclose(np.array(beta, float), reference.BETA_DEG)
            expected = table[f"alpha_{c}_N_per_cm3"].to_numpy(float).reshape(7, 13)
            same(numbers(values), expected)
            for of, what in (("", ""), ("_next", "the next push, ")):
                head = f"half width of the 95 % interval of {what}alpha_{c} (N/cm^3)"
                low, high = (
                    table[f"alpha_{c}_{end}{of}_N_per_cm3"].to_numpy(float).reshape(7, 13)
                    for end in ("lo", "hi")
                )
                same(numbers(block(sheet, head)[2]), (high - low) / 2)


def test_missing_cells_say_so_and_why(books):
    sheet = books[0]["poppy_LP"]
    empty = [cell for row in sheet.iter_rows() for cell in row if cell.value == "no run"]
    assert len(empty) == 6 * len(chain.MISSING)
    notes = [cell.comment.text for cell in empty if cell.comment is not None]
    assert len(notes) == len(empty)
    assert set(notes) == set(chain.MISSING.values())


def test_no_text_becomes_a_formula(tmp_path):
    bad = ["=1+1", "+cmd", "-2+3", "@SUM(A1)", "{=A1}"]
    titles = dict(zip(reference.MEDIA, bad, strict=True))
    results = campaign(tmp_path, {(0.0, 0.0): "=1+1", (30.0, 0.0): "http://example.org"}, titles)
    for content in workbooks(results):
        book = load_workbook(io.BytesIO(content))
        cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
        assert all(cell.data_type != "f" and cell.hyperlink is None for cell in cells)
        assert set(bad) <= {cell.value for cell in cells}


def test_sheet_names_are_made_acceptable(tmp_path):
    names = ("About", "x" * 40, "x" * 41, "History")
    media = dict.fromkeys(names, paper_config().media["poppy_LP"])
    results = bare_campaign(tmp_path, names, media=media)
    for name in names:
        write(results, f"alpha/{name}.csv", chain.alpha_table("poppy_LP"))
    sheets = load_workbook(io.BytesIO(workbooks(results)[0])).sheetnames
    assert sheets == ["About", "About_2", "x" * 31, "x" * 29 + "_2", "History_2"]


def test_coefficient_workbook_holds_values_intervals_and_what_was_published(results, books):
    _, book = books
    coefficients, penetration = results.table("coefficients.csv"), results.table("penetration.csv")
    assert book.sheetnames == ["About", "lsq", "dft-index"]
    unit = "(N/cm^3; generic and zeta dimensionless)"
    titles = [medium.title for medium in results]
    for method in ("lsq", "dft-index"):
        sheet = book[method]
        rows = coefficients[coefficients["method"] == method]
        title = f"coefficients {unit}; grey: term not kept, counts as zero"
        heads, sides, values = block(sheet, title)
        assert heads == [*titles, "generic"]
        assert sides == [*TERMS, "zeta"]
        expected = rows.pivot_table(index="coefficient", columns="medium", values="value_N_per_cm3")
        same(numbers(values)[:9], expected.loc[list(TERMS), MEDIA])
        zeta = penetration[penetration["method"] == method].set_index("medium")
        same(numbers(values)[9], [*zeta["zeta"][list(reference.MEDIA)], 1.0])
        both = block(sheet, f"95 % intervals {unit}")
        assert both[0][:2] == [f"{titles[0]}, lower", f"{titles[0]}, upper"]
        for end, start in (("lo", 0), ("hi", 1)):
            ends = rows.pivot_table(index="coefficient", columns="medium", values=end)
            interval_ends = numbers(both[2])[:, start::2]
            same(interval_ends[:9], ends.loc[list(TERMS), MEDIA])
            same(interval_ends[9, :-1], zeta[f"zeta_{end}"][list(reference.MEDIA)])
            assert np.isnan(interval_ends[9, -1])
        printed = block(sheet, f"published, Table S2 {unit}")
        for place, medium in enumerate(MEDIA):
            printed_terms = reference.coefficients(medium)
            same(numbers(printed[2])[:, place], [printed_terms[term] for term in (*TERMS, "zeta")])


def test_campaign_without_coefficients(tmp_path):
    results = bare_campaign(tmp_path, ("yuma",))
    write(results, "alpha/yuma.csv", chain.alpha_table("poppy_LP"))
    alpha, coefficients = (load_workbook(io.BytesIO(content)) for content in workbooks(results))
    assert alpha.sheetnames == ["About", "yuma"]
    assert coefficients.sheetnames == ["About"]


def test_workbooks_are_the_same_bytes_in_any_folder(results, tmp_path):
    assert workbooks(campaign(tmp_path / "an other, \u00e9")) == workbooks(results)
