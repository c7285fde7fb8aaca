"""The look shared by all figures: sizes, colours, words, units, and files."""

from __future__ import annotations

import contextlib
import math
import textwrap
from functools import cache, wraps
from importlib.resources import as_file, files
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.figure import Figure

from rftfit.errors import NothingToDraw
from rftfit.store import write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from matplotlib.axes import Axes


# --- Words, numbers and units as figures print them.


PER_CM3 = r"N/cm$^3$"
PER_CM2 = r"N/cm$^2$"


def title_of(medium: str, titles: Mapping[str, str] | None) -> str:
    """Name of a medium in figures, safe from being read as mathematics.

    `titles`: Names by medium; a medium that is not in it goes by its own key.
    """
    return plain((titles or {}).get(medium, medium))


def plain(text: str) -> str:
    """Escape a user's text so that a dollar sign in it does not start mathematics."""
    return text.replace("$", r"\$")


def alpha_label(component: str) -> str:
    """Return the label of alpha_z or alpha_x, with its unit."""
    return rf"$\alpha_{component}$ ({PER_CM3})"


def number(value: float, digits: int = 3) -> str:
    """Write a number with a true minus sign; "no value" for NaN.

    `digits`: Digits after the point.
    """
    if math.isnan(value):
        return "no value"
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\N{MINUS SIGN}")


def degrees(value: float) -> str:
    """Write an angle as 18.4 deg, 90 deg, with the degree sign and a true minus.

    `value`: Degrees.
    """
    return number(value, 0 if abs(value - round(value)) < 0.005 else 1) + "\N{DEGREE SIGN}"


# --- The look shared by all figures: sizes, colours, labels, and a context that fixes every setting.


P = ParamSpec("P")
R = TypeVar("R")

CM = 1 / 2.54
"""One centimetre in inches."""

SINGLE_CM = 8.9
"""Width of a figure of one column, cm."""

DOUBLE_CM = 18.3
"""Width of a figure of two columns, cm."""

OKABE_ITO = {
    "black": "#000000",
    "orange": "#E69F00",
    "sky blue": "#56B4E9",
    "bluish green": "#009E73",
    "yellow": "#F0E442",
    "blue": "#0072B2",
    "vermillion": "#D55E00",
    "reddish purple": "#CC79A7",
}
"""Colours that stay apart for colour-blind readers (Okabe and Ito, Color Universal Design)."""

MEDIUM_LOOKS = {
    "poppy_LP": (OKABE_ITO["sky blue"], "o"),
    "poppy_CP": (OKABE_ITO["blue"], "s"),
    "glass0.3mm_LP": (OKABE_ITO["orange"], "^"),
    "glass0.3mm_CP": (OKABE_ITO["vermillion"], "v"),
    "glass3mm_CP": (OKABE_ITO["bluish green"], "D"),
    "yuma": (OKABE_ITO["reddish purple"], "P"),
    "palms29": ("#5C3A1E", "X"),
    "palms29_sieved": ("#7F7F7F", "*"),
}
"""Colour and marker of each medium of the demonstration campaign; the marker serves grey prints."""

COMPONENT_COLOURS = {"z": OKABE_ITO["blue"], "x": OKABE_ITO["vermillion"]}
TARE_COLOURS = {"z": OKABE_ITO["sky blue"], "x": OKABE_ITO["orange"]}

DIVERGING = "RdBu_r"
"""Map of signed quantities, white at zero: red pushes up or toward +x, blue down or toward -x."""

SEQUENTIAL = "viridis"
"""Map of quantities that start at zero."""

MARK = "#C00000"
"""Colour of what needs a look."""

# settings of the session, not of the look; some may not be set anew once a figure exists
_SESSION = ("backend", "interactive", "toolbar", "timezone", "webagg", "tk.", "docstring", "date.")


@cache
def _settings() -> Any:
    with as_file(files(__package__).joinpath("rftfit.mplstyle")) as path:
        own = mpl.rc_params_from_file(path, use_default_template=False)
    base = {
        key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith(_SESSION)
    }
    return base | dict(own)


@contextlib.contextmanager
def context() -> Iterator[None]:
    """Set matplotlib's defaults plus this project's style, whatever the user's own settings are."""
    with mpl.rc_context(_settings()):
        yield


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Let a drawing function run in `context`.

    Returns with the same signature.
    """

    @wraps(function)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        with context():
            return function(*args, **kwargs)

    return inside


def new_figure(width_cm: float, height_cm: float, dpi: float | None = None) -> Figure:
    """Return an empty figure of a given size on paper.

    `dpi`: Dots per inch of the PNG; default that of the style.
    """
    return Figure(figsize=(width_cm * CM, height_cm * CM), dpi=dpi)


def axes_cm(
    figure: Figure, left_cm: float, top_cm: float, width_cm: float, height_cm: float
) -> Axes:
    """Add axes at a place counted in cm from the figure's upper left corner.

    `left_cm`, `top_cm`: Upper left corner of the axes.
    """
    width, height = (float(size) / CM for size in figure.get_size_inches())
    return figure.add_axes(
        (left_cm / width, 1 - (top_cm + height_cm) / height, width_cm / width, height_cm / height)
    )


def text_cm(figure: Figure, left_cm: float, top_cm: float, text: str, **how: Any) -> None:
    """Write on the figure at a place counted in cm from its upper left corner.

    `**how`: Handed on to `Figure.text`.
    """
    width, height = (float(size) / CM for size in figure.get_size_inches())
    figure.text(left_cm / width, 1 - top_cm / height, text, **how)


def medium_looks(media: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Colour and marker of each medium; names that are not known get what is still free."""
    names = list(dict.fromkeys(media))
    taken = {name: MEDIUM_LOOKS[name] for name in names if name in MEDIUM_LOOKS}
    free = [look for look in MEDIUM_LOOKS.values() if look not in taken.values()]
    free = free or list(MEDIUM_LOOKS.values())
    unknown = [name for name in names if name not in taken]
    return taken | {name: free[i % len(free)] for i, name in enumerate(unknown)}


# --- Writing a figure as PNG, PDF and SVG: atomic, and the same figure always gives the same bytes.


# what would carry a date or a program version is left out, so that equal figures are equal files
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    "svg": {"Creator": None, "Date": None},
}

FORMATS = tuple(_METADATA)


def save(figure: Figure, base: str | Path) -> list[Path]:
    """Write ``base.png``, ``base.pdf`` and ``base.svg``.

    `figure`: One made by a ``draw_*`` function of this package. `base`: Path without ending; a
    point in its name (``glass0.3mm_LP``) is part of the name. Returns the three files, in the
    order of `FORMATS`.
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

    `ending`: One of `FORMATS`. Returns the whole file: what matplotlib itself raises on a full
    disk does not say that it is full.
    """
    more: dict[str, Any] = {"pil_kwargs": {"compress_level": 4}} if ending == "png" else {}
    whole = BytesIO()
    # some settings (letters, hatches, salt of the ids) are looked up while writing
    with context():
        figure.savefig(whole, format=ending, metadata=_METADATA[ending], **more)
    return whole.getvalue()


# --- A figure that says why there is nothing to draw.


_LINE_CM, _MARGIN_CM = 0.38, 0.4


@styled
def draw_missing(what: str, reasons: Sequence[str] = ()) -> Figure:
    """Write what is missing and why, where a figure would stand.

    `reasons`: One line each, broken where it is long.
    """
    lines = [line for text in (what, *reasons) for line in textwrap.wrap(text, 110)]
    figure = new_figure(DOUBLE_CM, 2 * _MARGIN_CM + len(lines) * _LINE_CM)
    for row, line in enumerate(lines):
        top = _MARGIN_CM + row * _LINE_CM
        text_cm(figure, _MARGIN_CM, top, plain(line), va="top", fontsize=7)
    return figure


def drawn(draw: Callable[P, Figure], *args: P.args, **kwargs: P.kwargs) -> Figure:
    """Draw a figure, or one that says why there is nothing to draw.

    `draw`: Raises `NothingToDraw` where there is nothing. `*args`, `**kwargs`: Its own.
    """
    try:
        return draw(*args, **kwargs)
    except NothingToDraw as nothing:
        return draw_missing(str(nothing))
