"""A log that no dialect knows: what it looks like, and how it may be read all the same."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rftfit.campaign.sources import TextFormat
from rftfit.errors import InputError
from rftfit.logs.base import LogError
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.registry import dialects, faults
from rftfit.logs.sniff import encoding_of, first_lines, look

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.logs.base import Reader

_TRIED_WHOLE = 1 << 20


def as_text(head: bytes) -> tuple[Reader, dict[str, Any]] | None:
    """Find a description by which a file can be read as delimited text.

    Parameters
    ----------
    head : bytes

    Returns
    -------
    reader : Reader
    text : dict
        The description, as keys of `text` in the config.
    """
    found = look(head)
    if found is None:
        return None
    text = found.as_format()
    return DelimitedReader().described(TextFormat.model_validate(text)), text


def tried() -> list[str]:
    """Name the dialects that were tried, and those that could not be.

    Returns
    -------
    list of str
    """
    names = ", ".join(name for name in dialects() if name != "delimited")
    return [f"tried: {names}", *(f"not tried: {fault}" for fault in faults())]


def refusal(path: Path, head: bytes) -> InputError:
    """Say why a file cannot be read, and what it looks like.

    Parameters
    ----------
    path : Path
    head : bytes

    Returns
    -------
    InputError
    """
    if not head:
        return InputError(f"{path}: the file is empty")
    lines = [f"{path}: no dialect reads this file. The dialects there are:"]
    small = path.stat().st_size <= _TRIED_WHOLE
    for reader in dialects().values():
        why = f": {_reason(reader, path)}" if small and reader.name == "rig" else ""
        lines.append(f"  {reader.name} ({reader.describe()}){why}")
    lines += [f"  {fault}" for fault in faults()]
    lines.append(f"It looks like: {encoding_of(head)}; it begins with")
    lines += [f"  {line}" for line in first_lines(head)]
    if encoding_of(head) != "binary":
        lines.append(
            "No delimiter gives two rows of numbers below each other. If it is a table, describe it "
            "in the config: force_log: {text: {delimiter: ..., skip_lines: ...}}"
        )
    return InputError("\n".join(lines))


def _reason(reader: Reader, path: Path) -> str:
    try:
        reader.load(path)
    except LogError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""
