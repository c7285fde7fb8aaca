"""Output of commands: text or JSON of an answer, csv below its mark, pictures; which files may be overwritten.

A *mark* is a text by which a command knows files that it has written: a csv begins with it, a picture has it in its metadata.
Only files with the mark are overwritten unasked.
"""

from __future__ import annotations

import csv
import io
import json
import math
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import typer

from rftfit.errors import InputError, OutputError
from rftfit.store.links import refuse_target_by_link
from rftfit.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy.typing as npt
    from matplotlib.figure import Figure

    from rftfit.measure.alpha import Columns


class Answer(Protocol):
    """Result of a command, for people and for scripts: what `print_answer` takes."""

    def summary(self, *most: Any, **_: Any) -> str:
        """Format the result for people; `most`: Most entries of each list, for a result that has lists."""

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain numbers, words and lists."""


# --- Lines, tables and sizes as they are shown in a terminal or written into a pipe.


def print_line(text: str = "") -> None:
    """Write a line to standard output."""
    typer.echo(text)


def warn(text: str) -> None:
    """Write a line to standard error."""
    typer.echo(text, err=True)


def format_comments(mark: str, notes: Iterable[str]) -> str:
    """Format the lines above a table: its mark with the version, and notes on its origin.

    A note is one line, even if it has a line break: a second line would be read as a row.
    """
    first_line = f"{mark} (rftfit {__version__})\n"
    return first_line + "".join(f"# {' '.join(note.split())}\n" for note in notes if note)


def print_answer(answer: Answer, as_json: bool, *most: int | None, **files: Any) -> None:
    """Print an answer for people, or as JSON with the names of files that are written.

    `most`: As in `Answer.summary`; only answers with lists take it. `files`: Path of each file by its key in the JSON.
    """
    print_line(json_text(answer.as_dict() | files) if as_json else answer.summary(*most))


def write_csv(path: Path, columns: Columns, mark: str, notes: Iterable[str], digits: int) -> None:
    """Write a table as csv below its mark and notes on its origin.

    `columns`: Numbers or words by name of the column, shape (rows,) each. `digits`: Significant ones of each number.
    """
    from rftfit.store import write_text

    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(_format_cells(columns[name], digits) for name in columns), strict=True))
    write_text(path, format_comments(mark, notes) + table.getvalue())


def _format_cells(column: npt.ArrayLike, digits: int) -> list[object]:
    """Format a column of numbers or words as cells of a csv; None and NaN are empty cells. `digits`: Significant ones."""
    import numpy as np

    values = np.asarray(column)
    is_number = values.dtype.kind in "iuf"
    cells: list[object] = []
    for value in values.tolist():
        if value is None or (isinstance(value, float) and math.isnan(value)):
            cells.append("")
        else:
            # -0.0 + 0.0 is 0.0
            cells.append(f"{value + 0.0:.{digits}g}" if is_number else value)
    return cells


def json_text(content: Any, indent: int | None = 2) -> str:
    """Format JSON; NaN and infinity are null, a path is a string."""
    return json.dumps(_make_json_safe(content), indent=indent, allow_nan=False)


def _make_json_safe(content: Any) -> Any:
    """Replace what JSON cannot hold: NaN and infinity by None, paths by strings."""
    if isinstance(content, dict):
        return {str(key): _make_json_safe(value) for key, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_make_json_safe(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content.as_posix() if isinstance(content, Path) else content


# --- Files that a command is asked to write: it never overwrites files that others made.


def check_target(
    path: Path,
    mark: str,
    what: str,
    force: bool,
    inputs: Sequence[Path | None] = (),
    *,
    option: str = "--output",
    picture: bool = False,
) -> None:
    """Refuse to overwrite a file that is read, or, unless the user said `force`, one without the mark of the command.

    Commands call it before any work, so that a long calculation is not lost. `path`: File to be written. `what`: Name of
    its content, for messages. `inputs`: Files that the command reads; None stands for an option not given. `option`: Option
    that names the file. `picture`: True for a picture, in which the mark may stand anywhere.
    """
    refuse_target_by_link(path)
    if path.is_dir():
        raise OutputError(f"{path}: this is a folder; name a file for the {what}")
    try:
        # a pipe or device would be read for ever
        if not stat.S_ISREG(path.stat().st_mode):
            raise OutputError(f"{path}: this is a pipe or device; name a file for the {what}")
        with path.open("rb") as handle:
            head = handle.read(-1 if picture else len(mark))
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(f"{path}: cannot be looked at: {error.strerror or error}") from error
    if any(
        input_path is not None and input_path.exists() and input_path.samefile(path)
        for input_path in inputs
    ):
        raise InputError(f"{path}: this file is read; name another for the {what} with {option}")
    if mark.encode() not in head and not force:
        command = mark.partition(" by ")[2] or "rftfit"
        raise InputError(
            f"{path}: this file is there and was not written by {command}, so it is left as it is; "
            f"name another with {option}, or add --force to overwrite it"
        )


def check_picture(path: Path | None, mark: str, force: bool, option: str = "--figure") -> None:
    """Refuse the file of a picture as `check_target` does, or if its ending is no format of figures; None: no picture."""
    if path is None:
        return
    from rftfit.figures.style import PRINTED

    if _ending(path) not in PRINTED:
        allowed = f".{', .'.join(PRINTED[:-1])} or .{PRINTED[-1]}"
        raise InputError(f"{option}: found '{path}'; allowed: a name that ends in {allowed}")
    check_target(path, mark, "drawing", force, option=option, picture=True)


def _ending(path: Path) -> str:
    """Return the ending of a file's name, in lower case and without the dot."""
    return path.suffix.lower().removeprefix(".")


def write_picture(path: Path, figure: Figure, mark: str = "") -> None:
    """Write a figure in the format that the name of its file ends in, with the mark in its metadata."""
    from rftfit.figures.style import content
    from rftfit.store import write_bytes

    write_bytes(path, content(figure, _ending(path), mark))
