"""Writing a figure as PNG, PDF and SVG: atomic, and the same figure always gives the same bytes."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rftfit.report import style
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# what would carry a date or a program version is left out, so that equal figures are equal files
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    "svg": {"Creator": None, "Date": None},
}

FORMATS = tuple(_METADATA)


def save(figure: Figure, base: str | Path) -> list[Path]:
    """Write ``base.png``, ``base.pdf`` and ``base.svg``.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        One made by a ``draw_*`` function of this package.
    base : str or Path
        Path without ending; a point in its name (``glass0.3mm_LP``) is part of the name.

    Returns
    -------
    list of Path
        The three files, in the order of `FORMATS`.

    Raises
    ------
    OutputError
        If a file cannot be written; none is ever half-written.
    """
    base = Path(base)
    written = []
    for ending in FORMATS:
        # not with_suffix: it would cut glass0.3mm_LP at the point
        target = base.with_name(f"{base.name}.{ending}")
        write_bytes(target, content(figure, ending))
        written.append(target)
    return written


def content(figure: Figure, ending: str) -> bytes:
    """Return what a figure's file holds.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    ending : str
        One of `FORMATS`.

    Returns
    -------
    bytes
        The whole file: what matplotlib itself raises on a full disk does not say that it is full.
    """
    more: dict[str, Any] = {"pil_kwargs": {"compress_level": 4}} if ending == "png" else {}
    whole = BytesIO()
    # some settings (letters, hatches, salt of the ids) are looked up while writing
    with style.context():
        figure.savefig(whole, format=ending, metadata=_METADATA[ending], **more)
    return whole.getvalue()
