"""The dialects there are, and which one a file is of.

A lab adds its own as an entry point of the group ``rftfit.dialects`` in a package of its own
(docs/dialects.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rftfit.campaign.problems import did_you_mean
from rftfit.errors import InputError
from rftfit.logs.ati_daq import AtiDaqReader
from rftfit.logs.ati_netft import AtiNetftReader
from rftfit.logs.base import HEAD_BYTES, Reader
from rftfit.logs.columnar import ParquetReader
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.excel import XlsxReader
from rftfit.logs.instron import InstronReader
from rftfit.logs.lvm import LvmReader
from rftfit.logs.plugins import plugins
from rftfit.logs.rig import RigDialect
from rftfit.logs.rosbag import RosBagReader
from rftfit.logs.rostopic import RostopicReader
from rftfit.logs.tdms import TdmsReader

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from rftfit.campaign.sources import AnyLog
    from rftfit.logs.plugins import Origin

_BUILTIN: tuple[Reader, ...] = (
    RigDialect(),
    AtiNetftReader(),
    AtiDaqReader(),
    RostopicReader(),
    RosBagReader(),
    TdmsReader(),
    LvmReader(),
    InstronReader(),
    XlsxReader(),
    ParquetReader(),
    DelimitedReader(),
)

DIALECTS: dict[str, Reader] = {dialect.name: dialect for dialect in _BUILTIN}
"""Those that come with the program."""


def dialects() -> dict[str, Reader]:
    """Return all readers: the program's own, then those of other packages.

    Returns
    -------
    dict of str to Reader
        By name. A package cannot take the name of one of the program's own.
    """
    others = plugins().readers
    return {**DIALECTS, **{name: others[name] for name in sorted(others) if name not in DIALECTS}}


def origins(names: Iterable[str]) -> dict[str, Origin]:
    """Say where those dialects are from that do not come with the program.

    Parameters
    ----------
    names : iterable of str

    Returns
    -------
    dict of str to Origin
        By dialect, sorted; without those that cannot be used.
    """
    # looking for other packages is slow, and most campaigns need none
    others = sorted(set(names) - DIALECTS.keys())
    found = plugins().origins if others else {}
    return {name: found[name] for name in others if name in found}


def faults() -> list[str]:
    """Say which dialects of other packages cannot be used, and why.

    Returns
    -------
    list of str
        A sentence each.
    """
    taken = [
        f"the dialect {name} of {reader.origin} has the name of one of the program's own: it is "
        "not used; rename its entry point"
        for name, reader in sorted(plugins().readers.items())
        if name in DIALECTS
    ]
    return [*plugins().faults.values(), *taken]


def dialect(name: str) -> Reader:
    """Return the reader of that name.

    Parameters
    ----------
    name : str

    Returns
    -------
    Reader

    Raises
    ------
    InputError
        If there is none; the message lists those there are.
    """
    if name in DIALECTS:
        return DIALECTS[name]
    known = dialects()
    if name in known:
        return known[name]
    if name in plugins().faults:
        raise InputError(plugins().faults[name])
    near = did_you_mean(name, known)
    hint = f"; did you mean {near!r}?" if near else ""
    raise InputError(f"no log dialect {name!r}; allowed: {', '.join(sorted(known))}{hint}")


def source_reader(source: AnyLog, default: str, key: str) -> Reader:
    """Return the reader that a section of the config asks for.

    Parameters
    ----------
    source : ForceLog or MotionLog
    default : str
        Dialect of the campaign.
    key : str
        Of the section, for the message.

    Returns
    -------
    Reader

    Raises
    ------
    InputError
        If there is no such dialect, or it cannot be told that.
    """
    if source.text is not None:
        reader: Reader = DelimitedReader().described(source.text)
    else:
        reader = dialect(source.dialect or default)
    if source.options:
        try:
            reader = reader.with_options(source.options)
        except ValueError as error:
            raise InputError(f"config, {key}.options: {error}") from None
    return reader


def head_of(path: Path) -> bytes:
    """Read the beginning of a file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    bytes
        The first 64 kB.

    Raises
    ------
    InputError
        If the file cannot be opened.
    """
    try:
        with path.open("rb") as handle:
            return handle.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be opened: {error.strerror}") from error


def claimants(head: bytes) -> list[Reader]:
    """Return every reader that knows a file.

    Parameters
    ----------
    head : bytes
        The first 64 kB of it.

    Returns
    -------
    list of Reader
        The program's own first; the first one reads it.
    """
    return [reader for reader in dialects().values() if reader.detect(head)]


def detect(path: Path) -> Reader | None:
    """Tell from its content which dialect a file is of.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Reader or None
        None when no reader knows it.

    Raises
    ------
    InputError
        If the file cannot be opened.
    """
    head = head_of(path)
    own = next((reader for reader in DIALECTS.values() if reader.detect(head)), None)
    return own or next((reader for reader in dialects().values() if reader.detect(head)), None)
