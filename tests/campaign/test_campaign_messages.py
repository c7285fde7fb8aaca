"""What is said of the sections on logs, where they contradict themselves."""

from __future__ import annotations

import importlib
import io
from typing import Any

import pytest

from rftfit.campaign import rows


@pytest.mark.parametrize(
    ("section", "key", "said"),
    [
        ("{dialect: delimited, text: {delimiter: ',', encoding: utf-99}}", ".text.encoding",
         "no encoding is called 'utf-99'; common ones: utf-8, cp1252, latin-1, shift_jis"),
        ("{columns: {F1: {column: Fx, factor: 0}}}", ".columns.F1", "a factor of 0 would erase the column"),
        ("{columns: {F1: {unit: N}}}", ".columns.F1", "needs either a column or a constant"),
        ("{dialect: delimited}", "",
         "the dialect delimited needs `text`, the description of the format"),
        ("{dialect: rig, text: {delimiter: ','}}", "",
         "`text` goes with the dialect delimited, found rig"),
    ],
)  # fmt: skip
def test_sections_of_logs(room, section, key, said):
    room.config += f"force_log: {section}\n"
    problem = room.only("config.inconsistent")
    assert problem.place.key == f"force_log{key}"
    assert said in problem.allowed


def test_an_extreme_workbook(room, monkeypatch):
    openpyxl: Any = importlib.import_module("openpyxl")
    book, out = openpyxl.Workbook(), io.BytesIO()
    book.save(out)
    monkeypatch.setattr(rows, "MAX_TAGS", 10)
    problem = room.only("sheet.too-large", out.getvalue(), "runs.xlsx")
    assert "at most 1e-05 million are read" in problem.allowed
