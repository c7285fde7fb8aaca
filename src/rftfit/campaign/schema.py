"""The configuration's JSON schema and the reference page, both generated.

``python -m rftfit.campaign.schema`` in the project's folder writes ``config/config.schema.json``
and ``config/README.md``; a test holds them in step with the models.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from rftfit.campaign.columns import COLUMNS, DIRECTIONS, KINDS, Column
from rftfit.campaign.keys import Key, all_keys, schema
from rftfit.errors import RftfitError
from rftfit.store import write_text

_INTRO = """\
# Configuration and run sheet

This page is generated from the program's own models by `python -m rftfit.campaign.schema`; do not
edit it. `rftfit check` says what is wrong with an edited file: file, row, column, what was found,
what is allowed and the nearest valid word, all problems at once.

## `config.yaml`

All paths are relative to the campaign's folder: the one above `config/`, or the folder of
`config.yaml` itself where that is not named `config`. They use `/` and stay inside that folder.
`<name>` is a name that you choose, of letters A-Z a-z, digits, and `. _ -`; the run sheet uses it.
Keys given twice, anchors (`&`), aliases (`*`) and tags (`!`) are refused.
"""

_SHEET = """\
## Run sheet

One row for each run, below a header row that names the columns, in any order. The sheet is csv
(UTF-8; comma, semicolon or tab), tsv, or the first sheet of an xlsx workbook. Numbers have a decimal
point. Blank rows are skipped. "All" below means all kinds of run; a filled cell that its kind of run
does not use is warned about and ignored.
"""

_NOTES = """\
- `gamma_deg` is always the angle on the way down. An extraction is the pull back along that path;
  the program files it under (-beta, -gamma) itself.
- A tare is a run of the same medium, intruder, direction, beta, gamma and depth without the plate
  (`rod`), or of the same leg in air (`leg_air`). A plate held at -90 and at 90 degrees is the same.
- Where one tare serves several runs, each of them has `tare_shared` set to yes.
- A run without a tare, or whose log is missing, is kept in the ledger and has no result.
- `yes`, `true` and `1` are the same, and so are `no`, `false`, `0` and blank.
"""


def json_schema() -> str:
    """JSON schema of ``config.yaml``, for editors that check while one types.

    Returns
    -------
    str
        The same bytes whenever the models are the same.
    """
    page = {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema()}
    return json.dumps(page, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


def reference_markdown() -> str:
    """Describe every key of the configuration and every column of the run sheet.

    Returns
    -------
    str
        Markdown, generated from the definitions that also check the files.
    """
    head = ("key", "type", "unit", "default", "allowed", "meaning")
    keys = _table(head, [_key_row(key) for key in all_keys()])
    head = ("column", "needed for", "used by", "unit", "allowed", "meaning")
    columns = _table(head, [_column_row(column) for column in COLUMNS])
    directions = "".join(
        f"- `{kind}` runs: {', '.join(words)}\n" for kind, words in DIRECTIONS.items()
    )
    return f"{_INTRO}\n{keys}\n{_SHEET}\n{columns}\nDirections:\n\n{directions}\nRules:\n\n{_NOTES}"


def _key_row(key: Key) -> tuple[str, ...]:
    path = f"`{'.'.join(key.path)}`"
    if key.shape:
        path += f" ({key.shape})"
    return path, key.type, key.unit, key.default, key.allowed, key.description


def _column_row(column: Column) -> tuple[str, ...]:
    used = "all" if column.kinds == KINDS else ", ".join(column.kinds)
    if column.direction:
        used += f"; {column.direction} only"
    needed = {"always": "all", "if used": used, "no": "may be blank"}[column.need]
    if column.name == "reason":
        needed = "excluded runs"
    return f"`{column.name}`", needed, used, column.unit, column.allowed, column.meaning


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, tuple("---" for _ in head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def main(folder: Path) -> None:
    """Write schema and reference page.

    Parameters
    ----------
    folder : Path
        Usually ``config``.

    Raises
    ------
    OutputError
        If they cannot be written.
    """
    write_text(folder / "config.schema.json", json_schema())
    write_text(folder / "README.md", reference_markdown())


if __name__ == "__main__":
    try:
        main(Path("config"))
    except RftfitError as error:
        sys.exit(str(error))
