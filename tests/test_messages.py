"""Every message that the source can make has a cause, a cure and a test; no row is left over."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import message_evidence
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "rftfit"
FOLDER = ROOT / "docs" / "reference" / "messages"

sites, table = message_evidence.sites, message_evidence.table


@pytest.fixture(scope="module")
def made() -> dict[str, Any]:
    """Messages of the source."""
    found: dict[str, Any] = sites.by_message(sites.find_sites(PACKAGE))
    assert len(found) > 400
    return found


@pytest.fixture(scope="module")
def rows() -> dict[str, Any]:
    """Rows of the data files."""
    found = table.load_rows(FOLDER)
    assert len({row.message for row in found}) == len(found)
    return {row.message: row for row in found}


def test_every_message_has_a_row(made: dict[str, Any], rows: dict[str, Any]) -> None:
    lacking = {
        message: f"{places[0].file}:{places[0].first}"
        for message, places in made.items()
        if message not in rows
    }
    assert not lacking, f"add cause and cure to a file in {FOLDER.relative_to(ROOT)}"


def test_every_row_has_a_message(made: dict[str, Any], rows: dict[str, Any]) -> None:
    assert not rows.keys() - made.keys(), "the source no longer makes these messages"


def test_every_row_is_whole(rows: dict[str, Any]) -> None:
    for row in rows.values():
        said = (row.never,) if row.never else (row.cause, row.cure)
        assert all(text == text.strip() and len(text.split()) > 0 for text in said), row.message
        if not row.never:
            assert row.cause.endswith("."), row.message
            assert row.cure.rstrip("`").endswith((".", "`")), row.message


def test_every_row_has_a_test_that_exists(rows: dict[str, Any]) -> None:
    shown = [row for row in rows.values() if not row.never]
    without = [row.message for row in shown if not row.test]
    assert not without, "write a test, then `make messages`"
    gone = {
        row.message: row.test for row in shown if not message_evidence.function_source(row.test)
    }
    assert not gone, "the test has been renamed: `make messages`"


def test_hand_picked_tests_quote_their_message(rows: dict[str, Any]) -> None:
    # lines that every import runs are in no recording: the test has to hold the words
    picked = {row.message: row.test for row in rows.values() if row.picked}
    for message, test in picked.items():
        file = (ROOT / test.partition("::")[0]).read_text(encoding="utf-8")
        assert message_evidence.quotes(message, file), (message, test)


def source(tmp_path: Path, text: str) -> dict[str, Any]:
    """Messages of a package with one module."""
    (tmp_path / "measure").mkdir()
    (tmp_path / "measure" / "one.py").write_text(text, encoding="utf-8")
    found: dict[str, Any] = sites.by_message(sites.find_sites(tmp_path))
    return found


def test_what_a_message_is_made_of(tmp_path: Path) -> None:
    found = source(
        tmp_path,
        """
WANTED = "a number"
class OwnError(ValueError): ...
def one(path, rows, far):
    text = f"{path}: {len(rows)} rows"
    if far:
        text += "; too far"
    raise OwnError(f"{text}, allowed: {WANTED}")
def two(problems, name, column):
    problems.append(f"column {name!r} is {'long' if column else 'short'} here")
    return {"reason": "no run at all"}
def three(file):
    if file.name:
        code, allowed = "sheet.one", f"the first of {file.rows}"
    else:
        code, allowed = "sheet.two", file.words
    return Problem(file, None, None, None, allowed, code)
""",
    )
    assert set(found) == {
        "<path>: <rows> rows[; too far], allowed: a number",
        "column <name> is (long|short) here",
        "no run at all",
        "sheet.one: the first of <rows>",
        "sheet.two: <allowed>",
    }


def test_a_page_shows_what_is_there_and_no_more(made: dict[str, Any], rows: dict[str, Any]) -> None:
    text = table.page(FOLDER, PACKAGE)
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    shown = [row for row in rows.values() if not row.never and row.message in made]
    assert len(lines) == len(shown) + len(table.PLACES)
    # every row has three cells, whatever is in them
    assert {line.replace("\\|", "").count("|") for line in lines} == {4}
