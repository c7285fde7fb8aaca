"""Verdicts on an example: when a published number lies inside or outside the errors of ours, and the reason.

An example has an answer, published numbers, each with a key: cells that name the row of a table of results where the
program's number stands. A verdict is a row of ``verdicts.csv``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.suite.cells import CalculatedTables, NoRow, TableNumber, fill_words, is_same
from rftfit.suite.declared import EVERY, Example, Published, Quantity, RemarkOnRows, format_key
from rftfit.suite.windows import over_windows

INSIDE, OUTSIDE, NOT_COMPARABLE = "inside", "outside", "not comparable"
VERDICTS = (INSIDE, OUTSIDE, NOT_COMPARABLE)
"""Words of a verdict, in the order of tables."""

FILE = "verdicts.csv"
"""File of the verdicts in the folder of an example."""


class RowVerdict(NamedTuple):
    """A published number beside the number of the program: a row of `verdicts.csv`.

    `quantity`, `title`: What is compared, as example.yaml names it and in words. `key`: As answer.csv states it.
    `published`, `ours`: Both numbers, in `unit`; NaN: none. `published_lo`, `published_hi`: The published number less and
    plus its error; NaN without an error. `lo`, `hi`: 95 % interval of ours. `windows`, `windows_inside`: Number of windows
    of depth that were tried, and of those whose interval contains the published number; NaN: none were tried. `where`: Place
    in the publication. `from_file`: The table with the published number, empty if answer.csv states it. `reason_code`,
    `reason`: The reason of the verdict.
    """

    example: str
    domain: str
    quantity: str
    title: str
    key: str
    published: float | str = math.nan
    published_lo: float = math.nan
    published_hi: float = math.nan
    unit: str = ""
    ours: float | str = math.nan
    lo: float = math.nan
    hi: float = math.nan
    windows: float = math.nan
    windows_inside: float = math.nan
    verdict: str = NOT_COMPARABLE
    reason_code: str = ""
    reason: str = ""
    where: str = ""
    from_file: str = ""


def judge_example(example: Example, folder: Path) -> pd.DataFrame:
    """Compare the answer of an example with the results that were calculated in a folder.

    Returns
    -------
    pandas.DataFrame
        One row for each published number, with the columns of `RowVerdict`.
    """
    tables = CalculatedTables(folder)
    rows = [
        _judge(example, stated, folder, tables)
        for row_of_answer in example.answer
        for stated in _expand_stars(example, row_of_answer, tables)
    ]
    return pd.DataFrame(rows, columns=list(RowVerdict._fields))


def _expand_stars(
    example: Example, stated: Published, tables: CalculatedTables
) -> Iterator[Published]:
    """Yield a row of the answer; if its key has a *, one for each row of the program's table that agrees, with its cells."""
    names = [name for name, word in stated.key.items() if word == EVERY]
    if not names:
        yield stated
        return
    ours = example.settings.quantities[stated.quantity].ours
    try:
        rows = tables.rows(ours, stated.key)
    except NoRow:
        rows = pd.DataFrame()
    if rows.empty:
        yield stated
    for _, row in rows.iterrows():
        yield stated._replace(key=stated.key | {name: str(row[name]) for name in names})


def _judge(
    example: Example, stated: Published, folder: Path, tables: CalculatedTables
) -> RowVerdict:
    """Compare a published number, as a row of the answer states it, with the number of the program in tables below `folder`.

    First both numbers are looked up, then a remark of the example may forbid the comparison, then the rule decides.
    """
    quantity = example.settings.quantities[stated.quantity]
    row = RowVerdict(
        example=example.name,
        domain=quantity.domain,
        quantity=stated.quantity,
        title=quantity.title,
        key=format_key(stated.key),
        unit=stated.unit,
        where=stated.where,
    )
    row = _with_published(row, stated.value, stated.error)
    error = stated.error
    # stays None where either number is in no row
    ours: TableNumber | None = None
    try:
        number = tables.number(quantity.ours, stated.key)
        # the published number may stand in a table, too
        if math.isnan(stated.value) and quantity.published is not None:
            published = tables.number(quantity.published, stated.key)
            error = published.error if math.isnan(error) else error
            name = fill_words(quantity.published.table, stated.key)
            row = _with_published(row, published.value, error)._replace(from_file=name)
        ours = number
        row = row._replace(ours=ours.value, lo=ours.lo, hi=ours.hi)
    except NoRow as problem:
        row = row._replace(reason_code="no-row", reason=str(problem))
    remark = _find_remark(example, stated, ours.cells if ours else {})
    if remark is not None and not remark.comparable:
        return row._replace(reason_code=remark.code, reason=remark.sentence)
    if ours is None:
        return row
    if quantity.windows is not None:
        by_windows = over_windows(folder, quantity.windows, stated.key, quantity.ours)
        row = row._replace(
            # the median, and the 95 % interval
            ours=by_windows.quantile(0.5),
            lo=by_windows.quantile(0.025),
            hi=by_windows.quantile(0.975),
            windows=float(len(by_windows.values)),
            windows_inside=float(by_windows.count_inside(row.published)),
        )
    judged = _apply_rule(row, quantity, ours, error)
    # a remark explains why a row lies outside, or limits what being inside says
    if remark is None or judged.verdict != (INSIDE if remark.of_inside else OUTSIDE):
        return judged
    return judged._replace(reason_code=remark.code, reason=f"{judged.reason}; {remark.sentence}")


def _find_remark(
    example: Example, stated: Published, cells: Mapping[str, str]
) -> RemarkOnRows | None:
    """Find the first remark whose words agree with a row: with its key, or with the cells of the program's row; None: none.

    `cells`: Those of the program's row by column; empty without a row. A word may have wildcards, as ``palms*``.
    """
    words = {**cells, **stated.key}
    for remark in example.settings.remarks:
        is_on_quantity = not remark.quantities or stated.quantity in remark.quantities
        if is_on_quantity and all(
            name in words and (is_same(words[name], pattern) or fnmatchcase(words[name], pattern))
            for name, pattern in remark.match.items()
        ):
            return remark
    return None


def _with_published(row: RowVerdict, value: float | str, error: float) -> RowVerdict:
    """Return a row with its published number and the ends of its error; a NaN error gives NaN ends."""
    if isinstance(value, str):
        return row._replace(published=value)
    return row._replace(published=value, published_lo=value - error, published_hi=value + error)


def _apply_rule(row: RowVerdict, quantity: Quantity, ours: TableNumber, error: float) -> RowVerdict:
    """Return a row with its verdict, by the verdict in the program's table or else by the intervals.

    The published number is inside if it differs from ours by at most hypot(half, error): `half` is our half interval on
    its side, `error` its own error, NaN if it has none; without both nothing is comparable. `row.ours` is judged; `ours` is
    our number by the window of the config, which is another one where several windows were tried.
    """
    if quantity.judged is not None:
        return _take_verdict_of_table(row, quantity, ours)
    if isinstance(row.published, str) or isinstance(row.ours, str):
        return row._replace(reason_code="no-number", reason="it is no number")
    if math.isnan(row.ours):
        reason = ours.cells.get("reason") or "the program has no number here"
        return row._replace(reason_code="no-number", reason=reason)
    if math.isnan(row.published):
        return row._replace(reason_code="no-published", reason="no number is published here")
    difference = row.published - row.ours
    half = row.hi - row.ours if difference > 0 else row.ours - row.lo
    if math.isnan(half) and math.isnan(error):
        return row._replace(reason_code="no-interval", reason="neither number has an error")
    tried = ""
    if not math.isnan(row.windows):
        tried = (
            f"; in {row.windows_inside:.0f} of {row.windows:.0f} windows it lies in that window's own interval; in the window "
            f"of the config ours is {ours.value:.3g} ({ours.lo:.3g} to {ours.hi:.3g})"
        )
    if abs(difference) <= half:
        reason = f"the published number lies in our 95 % interval{tried}"
        return row._replace(verdict=INSIDE, reason_code="in-interval", reason=reason)
    # an error that is not stated adds nothing
    allowed = math.hypot(*np.nan_to_num([half, error]))
    if abs(difference) <= allowed:
        reason = f"the numbers differ by less than both errors together{tried}"
        return row._replace(verdict=INSIDE, reason_code="within-errors", reason=reason)
    side = "above" if difference > 0 else "below"
    reason = f"the published number lies {abs(difference):.3g} {row.unit} {side} ours; {allowed:.3g} is within the errors{tried}"
    return row._replace(
        verdict=OUTSIDE, reason_code="not-explained", reason=" ".join(reason.split())
    )


def _take_verdict_of_table(row: RowVerdict, quantity: Quantity, ours: TableNumber) -> RowVerdict:
    """Return a row with the verdict and the reason that the program's table states, in columns that `quantity.judged` names.

    A statement without a number, such as "lift is larger than thrust", can be judged so.
    """
    judged = quantity.judged
    assert judged is not None
    word, reason = ours.cells.get(judged.column, ""), ours.cells.get(judged.reason, "")
    code = word.replace(" ", "-") or "no-verdict"
    verdict = NOT_COMPARABLE
    if word in judged.inside:
        verdict = INSIDE
    elif word in judged.outside:
        verdict = OUTSIDE
    return row._replace(verdict=verdict, reason_code=code, reason=reason)


def count_verdicts(verdicts: pd.DataFrame) -> dict[str, int]:
    """Count the rows with each verdict, by its word; 0 is counted, too."""
    return {word: int((verdicts["verdict"] == word).sum()) for word in VERDICTS}
