"""The look shared by all figures: sizes, colours, labels, and a context that fixes every setting."""

from __future__ import annotations

import contextlib
from functools import cache, wraps
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from matplotlib.axes import Axes

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
    """Set matplotlib's defaults plus this project's style, whatever the user's own settings are.

    Yields
    ------
    None
    """
    with mpl.rc_context(_settings()):
        yield


def styled(function: Callable[P, R]) -> Callable[P, R]:
    """Let a drawing function run in `context`.

    Parameters
    ----------
    function : callable

    Returns
    -------
    callable
        With the same signature.
    """

    @wraps(function)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        with context():
            return function(*args, **kwargs)

    return inside


def new_figure(width_cm: float, height_cm: float, dpi: float | None = None) -> Figure:
    """Return an empty figure of a given size on paper.

    Parameters
    ----------
    width_cm, height_cm : float
    dpi : float, optional
        Dots per inch of the PNG; default that of the style.

    Returns
    -------
    matplotlib.figure.Figure
    """
    return Figure(figsize=(width_cm * CM, height_cm * CM), dpi=dpi)


def axes_cm(
    figure: Figure, left_cm: float, top_cm: float, width_cm: float, height_cm: float
) -> Axes:
    """Add axes at a place counted in cm from the figure's upper left corner.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    left_cm, top_cm : float
        Upper left corner of the axes.
    width_cm, height_cm : float

    Returns
    -------
    matplotlib.axes.Axes
    """
    width, height = (float(size) / CM for size in figure.get_size_inches())
    return figure.add_axes(
        (left_cm / width, 1 - (top_cm + height_cm) / height, width_cm / width, height_cm / height)
    )


def text_cm(figure: Figure, left_cm: float, top_cm: float, text: str, **how: Any) -> None:
    """Write on the figure at a place counted in cm from its upper left corner.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    left_cm, top_cm : float
    text : str
    **how
        Handed on to `Figure.text`.
    """
    width, height = (float(size) / CM for size in figure.get_size_inches())
    figure.text(left_cm / width, 1 - top_cm / height, text, **how)


def medium_looks(media: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Colour and marker of each medium; names that are not known get what is still free.

    Parameters
    ----------
    media : iterable of str

    Returns
    -------
    dict of str to (str, str)
    """
    names = list(dict.fromkeys(media))
    taken = {name: MEDIUM_LOOKS[name] for name in names if name in MEDIUM_LOOKS}
    free = [look for look in MEDIUM_LOOKS.values() if look not in taken.values()]
    free = free or list(MEDIUM_LOOKS.values())
    unknown = [name for name in names if name not in taken]
    return taken | {name: free[i % len(free)] for i, name in enumerate(unknown)}
