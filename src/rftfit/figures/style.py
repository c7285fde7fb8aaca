"""The look shared by all figures: sizes, colours, markers, dashes, labels, legends, marks and stamps, and files.

Five parts: constants of the look; `styled`, which sets it; how numbers and names are written; pages, axes and legends
(positions in cm from the upper left corner of a page); and the files of a figure (`save_pages`). A page is a matplotlib
figure; a figure of this program may have several pages.

matplotlib is imported where it is used: the workflow reads the declarations of all figures, and must not wait for
this import.
"""

from __future__ import annotations

import contextlib
import logging
import math
import textwrap
from functools import cache
from importlib.resources import as_file, files
from io import BytesIO
from itertools import cycle
from typing import TYPE_CHECKING, Any

from rftfit.store import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    import numpy.typing as npt
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

    from rftfit.results import Results

Look = dict[str, Any]
"""Options of lines, points or text, by their names in matplotlib."""

CM = 1 / 2.54
"""One centimetre in inches."""

SINGLE_CM, DOUBLE_CM = 8.9, 18.3
"""Width of a figure over one and over two columns of a journal, cm."""

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

COMPONENT_COLOURS = {"z": "#004C7F", "x": OKABE_ITO["vermillion"]}
"""Colours of vertical (z) and horizontal (x) force, stress or alpha. In a grey print z is darker than x."""
PALE_COLOURS = {"z": "#3D8FC6", "x": "#E8A838"}
"""The same two, paler: of a tare beside its run, and of measured points below a predicted curve."""

DASHES: dict[str, Any] = {
    "solid": "-",
    "dashed": (0, (4, 1.2)),
    "dotted": (0, (1, 1)),
    "dash-dotted": (0, (5, 1.2, 1, 1.2)),
    "double-dotted": (0, (5, 1.2, 1, 1.2, 1, 1.2)),
    "short": (0, (2.5, 1)),
    "long": (0, (6, 1)),
}
"""Lines that stay apart in a grey print, in the order in which curves take them."""

INTERVAL_OPACITY, WIDER_OPACITY = 0.3, 0.12
"""Opacities of the band of an interval, and of a wider one below it, such as that with the model's own error."""

NOTE_PT = 5.5
"""Size of notes in panels and above them."""

DIVERGING = "RdBu_r"
"""Colour map of signed quantities, white at zero: red pushes up or toward +x, blue down or toward -x."""

SEQUENTIAL = "viridis"
"""Colour map of quantities that start at zero."""

MARK = "#C00000"
"""Colour of marks that need attention."""

SAND, SURFACE = "#efe6d2", "#8a7343"
"""Colours of the medium and of its free surface in sketches."""

GREY, WINDOW = "#808080", "#e6e6e6"
"""Colours of lines of zero, and of the window of a fit, the range of depth or path whose samples were fitted."""

# these settings belong to the session, not to the look; some must not be set again once a figure exists
_SESSION_SETTINGS = (
    "backend",
    "interactive",
    "toolbar",
    "timezone",
    "webagg",
    "tk.",
    "docstring",
    "date.",
)


@cache
def _read_settings() -> Any:
    """Return the settings of matplotlib for all figures, by name: its defaults, changed by the style file of this project.

    Cached, because the file is read for each figure otherwise.
    """
    import matplotlib as mpl

    with as_file(files(__package__).joinpath("rftfit.mplstyle")) as path:
        project_settings = mpl.rc_params_from_file(path, use_default_template=False)
    defaults = {
        key: value
        for key, value in mpl.rcParamsDefault.items()
        if not key.startswith(_SESSION_SETTINGS)
    }
    return defaults | dict(project_settings)


@contextlib.contextmanager
def styled() -> Iterator[None]:
    """Set matplotlib's defaults plus this project's style, whatever the user's own settings are; restore these after.

    For ``with`` and as a decorator (``@styled()``) of functions that draw.
    """
    import matplotlib as mpl

    with mpl.rc_context(_read_settings()):
        yield


# Words and numbers


PER_CM3 = r"N/cm$^3$"
PER_CM2 = r"N/cm$^2$"
"""Units of alpha and of stress, as matplotlib's mathematics."""


def plain(text: str) -> str:
    """Escape dollar signs in a user's text, which would start mathematics."""
    return text.replace("$", r"\$")


def medium_label(results: Results, medium: str) -> str:
    """Return the name of a medium in figures: its title, or its key where it has no title."""
    return plain(results.campaign.titles.get(medium, medium))


def level(results: Results) -> str:
    """Write the level of the campaign's intervals (``fit.confidence``) in percent, with all digits: 0.99999 is not 100 %."""
    return f"{100 * results.config.fit.confidence:g} %"


def alpha_label(component: str) -> str:
    """Return the label of alpha_z or alpha_x, with its unit; `component`: ``z`` or ``x``."""
    return rf"$\alpha_{component}$ ({PER_CM3})"


def format_number(value: float | None, digits: int = 3) -> str:
    """Write a number with a true minus sign, `digits` digits after the point; "no value" where it is None or NaN."""
    if value is None or math.isnan(value):
        return "no value"
    rounded = f"{value:.{digits}f}"
    # no "-0.000"
    if float(rounded) == 0:
        rounded = rounded.lstrip("-")
    return rounded.replace("-", "\N{MINUS SIGN}")


def degrees(value: float) -> str:
    """Write an angle in degrees as 18.4\N{DEGREE SIGN}, 90\N{DEGREE SIGN}, with a true minus sign."""
    return format_number(value, 0 if abs(value - round(value)) < 0.005 else 1) + "\N{DEGREE SIGN}"


def medium_looks(media: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Choose colour and marker of each medium, by its key; one outside `MEDIUM_LOOKS` gets a look that is still free.

    Where more media than looks are drawn, looks repeat. A medium of the demonstration looks alike in all figures.
    """
    # each medium once
    names = list(dict.fromkeys(media))
    taken_looks = {name: MEDIUM_LOOKS[name] for name in names if name in MEDIUM_LOOKS}
    free_looks = [
        colour_marker
        for colour_marker in MEDIUM_LOOKS.values()
        if colour_marker not in taken_looks.values()
    ]
    other_media = [name for name in names if name not in taken_looks]
    return taken_looks | dict(zip(other_media, cycle(free_looks or MEDIUM_LOOKS.values())))


# Positions in centimetres, ticks and legends


def new_figure(width_cm: float, height_cm: float, dpi: float | None = None) -> Figure:
    """Return an empty figure of a given size on paper; `dpi`: dots per inch of its png, default: as the style has it."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_cm * CM, height_cm * CM), dpi=dpi)


def panels(
    heights_cm: Sequence[float], columns: int = 1, widest_cm: float = 8.0
) -> tuple[Figure, npt.NDArray[Any]]:
    """Return a page and its axes, shape (rows, columns); matplotlib makes room for the text around the panels.

    `heights_cm`: Heights of the rows with their text; the heights of the panels have the same ratios. `columns`: Number
    of panels in a row. `widest_cm`: Most width of a column; the page is one to two columns of a journal wide.
    """
    page = new_figure(min(DOUBLE_CM, max(SINGLE_CM, columns * widest_cm)), sum(heights_cm))
    # free at the right edge for `stamp`
    stamp_width = 0.35 * CM / page.get_figwidth()
    page.set_layout_engine("constrained", rect=(0, 0, 1 - stamp_width, 1))
    ratios = {"height_ratios": list(heights_cm)}
    return page, page.subplots(len(heights_cm), columns, squeeze=False, gridspec_kw=ratios)


def panels_in_rows(
    count: int, most_in_row: int, height_cm: float, widest_cm: float = 8.0
) -> tuple[Figure, list[Axes]]:
    """Return a page of `count` panels of the same size, row after row, and their axes in this order.

    `most_in_row`: Most panels in a row. `height_cm`: Height of a row. `widest_cm`: Most width of a column.
    """
    # rounded up
    rows = -(-count // most_in_row)
    page, grid = panels([height_cm] * rows, min(count, most_in_row), widest_cm)
    for axes in grid.flat[count:]:
        axes.set_axis_off()
    return page, [*grid.flat[:count]]


_NAME_LOOK: Look = {"textcoords": "offset points", "weight": "bold", "annotation_clip": False}
"""Look of the name of a row or column of panels: bold, placed by points, drawn also outside of its panel."""


def name_row(left_axes: Axes, name: str) -> None:
    """Write the name of a row of panels, left of the label of its first panel."""
    left_axes.annotate(
        name,
        (0, 0.5),
        (-3, 0),
        fontsize=6.5,
        xycoords=left_axes.yaxis.label,
        rotation=90,
        ha="right",
        va="center",
        **_NAME_LOOK,
    )


def name_column(top_axes: Axes, name: str) -> None:
    """Write the name of a column of panels, above the small title of its first panel."""
    top_axes.annotate(name, (0, 1), (0, 11), xycoords="axes fraction", va="bottom", **_NAME_LOOK)


def axes_cm(
    figure: Figure, left_cm: float, top_cm: float, width_cm: float, height_cm: float
) -> Axes:
    """Add axes whose upper left corner is `left_cm`, `top_cm` from that of the figure.

    matplotlib counts from the lower left, in shares of width and height.
    """
    width, height = (float(size) / CM for size in figure.get_size_inches())
    bottom = 1 - (top_cm + height_cm) / height
    return figure.add_axes((left_cm / width, bottom, width_cm / width, height_cm / height))


def text_cm(figure: Figure, left_cm: float, top_cm: float, text: str, **properties: Any) -> None:
    """Write text at a position counted from the upper left corner of the figure; `properties`: of matplotlib's text."""
    width, height = (float(size) / CM for size in figure.get_size_inches())
    figure.text(left_cm / width, 1 - top_cm / height, text, **properties)


def ticks(axis: Axis, max_ticks: int, **locator_options: Any) -> None:
    """Put at most `max_ticks` ticks on an axis, at round numbers."""
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(max_ticks, **locator_options))


def zero_line(axes: Axes) -> None:
    """Draw the line of zero."""
    axes.axhline(0, color=GREY, linewidth=0.4)


def draw_sand(axes: Axes, bottom: float, surface: float = 0.0) -> None:
    """Draw the medium of a sketch, down to `bottom`, and its free surface."""
    axes.axhspan(bottom, surface, color=SAND, linewidth=0)
    axes.axhline(surface, color=SURFACE, linewidth=0.6)


ARROW: Look = {
    "arrowstyle": "->",
    "linewidth": 0.6,
    "shrinkA": 0,
    "shrinkB": 0,
    "mutation_scale": 5,
}
"""Look of an arrow of a sketch."""


def draw_frame(axes: Axes, x: float, z: float, length: float) -> None:
    """Draw the axes x and z of the lab frame as arrows that begin at a point of a sketch."""
    for dx, dz, name in ((length, 0.0, "x"), (0.0, length, "z")):
        axes.annotate("", xy=(x + dx, z + dz), xytext=(x, z), arrowprops=ARROW)
        axes.text(x + 1.35 * dx, z + 1.35 * dz, f"${name}$", ha="center", va="center", fontsize=6)


def name_below(axes: Axes, label: str, is_last_row: bool) -> None:
    """Write label and numbers below a panel if `is_last_row`: those of the panels above are the same."""
    axes.tick_params(labelbottom=is_last_row)
    if is_last_row:
        axes.set_xlabel(label)


def dots(colour: str, size: float, **properties: Any) -> Artist:
    """Make points for a legend, round ones if no `marker` is given; `size`: in points."""
    return line(colour, **{"marker": "o", "linestyle": "", "markersize": size} | properties)


def line(color: str, **properties: Any) -> Artist:
    """Make a line for a legend, which is drawn in no panel; `properties`: of matplotlib's line."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, **properties)


def patch(**properties: Any) -> Artist:
    """Make an area for a legend, which is drawn in no panel; `properties`: of matplotlib's patch."""
    from matplotlib.patches import Patch

    return Patch(**properties)


def draw_band(
    axes: Axes,
    x: npt.ArrayLike,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    colour: str,
    opacity: float = INTERVAL_OPACITY,
) -> None:
    """Shade the interval of a curve between its ends `low` and `high`, each of the shape of `x`."""
    axes.fill_between(x, low, high, color=colour, alpha=opacity, linewidth=0)


def band(opacity: float = INTERVAL_OPACITY, colour: str = "#888888") -> Artist:
    """Make an interval for a legend, with the look of `draw_band`; grey stands for intervals of any colour."""
    return patch(facecolor=colour, alpha=opacity, linewidth=0)


def bands(colours: Iterable[str]) -> tuple[Artist, ...]:
    """Make one entry of a legend for the intervals of several curves: an area in each different colour, side by side."""
    return tuple(band(colour=colour) for colour in dict.fromkeys(colours))


def write_note(axes: Axes, note: str, x: float = 0.03, y: float = 0.97, **properties: Any) -> None:
    """Write what is missing into a panel in the colour of marks, at `x`, `y` (shares of the panel); default: upper left.

    `properties`: Of matplotlib's text, which replace those of this function.
    """
    note_look: Look = {"va": "top", "color": MARK, "fontsize": NOTE_PT, "transform": axes.transAxes}
    # a white box: curves may run through the note
    note_look["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
    axes.text(x, y, note, **note_look | properties)


def letters_in(width_pt: float, size_pt: float) -> int:
    """Return how many letters fit into a line, points: one is 0.55 of its size wide, in the mean."""
    return int(width_pt / (0.55 * size_pt))


def list_labelled(figure: Figure) -> dict[str, Artist]:
    """Return the entries of a legend for all that was drawn with a label, by label: of each the artist drawn first."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        for artist, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, artist)
    return entries


def legend(figure: Figure, entries: Mapping[str, Any], **options: Any) -> None:
    """Add a legend at the foot of a figure, in as few rows as the width of the figure allows.

    `entries`: For each name an artist, or a tuple of artists that are drawn beside one another. `options`: Options of
    matplotlib's legend; a title is broken into lines. A figure whose panels matplotlib lays out becomes higher by the
    height of the legend, so that the panels keep theirs; without a layout the figure must have room at its foot.
    """
    from matplotlib.legend_handler import HandlerTuple

    # True for a page of `panels`, False for one whose axes were placed by `axes_cm`
    is_laid_out = figure.get_layout_engine() is not None
    loc = "outside lower center" if is_laid_out else "lower center"
    defaults: dict[str, Any] = {"loc": loc, "columnspacing": 1.2, "borderaxespad": 0.2}
    defaults["handler_map"] = {tuple: HandlerTuple(ndivide=None, pad=0.25)}
    if title := options.pop("title", ""):
        options["title_fontsize"] = 6
        letters = letters_in(72 * figure.get_figwidth(), 6)
        options["title"] = "\n".join(textwrap.wrap(title, letters))
    # only a legend that exists has a width: it is made anew with more rows until it fits
    for rows in range(1, len(entries) + 1):
        defaults["ncols"] = -(-len(entries) // rows)
        legend = figure.legend([*entries.values()], [*entries], **defaults | options)
        box = legend.get_window_extent()
        if box.width <= figure.bbox.width or rows == len(entries):
            break
        legend.remove()
    if is_laid_out and entries:
        figure.set_figheight(figure.get_figheight() + box.height / figure.dpi)


@styled()
def missing(message: str, reasons: Sequence[str] = ()) -> Figure:
    """Make a figure that only says what is missing (`message`) and why (`reasons`), in the place of the one it stands for."""
    lines = [line for sentence in (message, *reasons) for line in textwrap.wrap(sentence, 110)]
    margin_cm, line_cm = 0.4, 0.38
    # the stamp along the right edge needs 1.6 cm
    figure = new_figure(DOUBLE_CM, max(1.6, 2 * margin_cm + len(lines) * line_cm))
    for row, line in enumerate(lines):
        top = margin_cm + row * line_cm
        text_cm(figure, margin_cm, top, plain(line), va="top", fontsize=7)
    return figure


_ABOVE = 1.01
"""Height at which warnings are written, relative to the height of the figure."""


def mark(figures: Figure | Sequence[Figure], sentences: Sequence[str]) -> None:
    """Write sentences about media that fail a check above a figure, or above each of its pages.

    They stand outside of the page, which becomes higher when its file is written (`_page_with_warning`).
    """
    for page in _pages(figures):
        letters = int(15 * page.get_size_inches()[0])  # letters of 7 pt in a line
        lines = [line for sentence in sentences for line in textwrap.wrap(plain(sentence), letters)]
        page.text(
            0.5,
            _ABOVE,
            "\n".join(lines),
            va="bottom",
            ha="center",
            fontsize=7,
            color=OKABE_ITO["vermillion"],
        )


def stamp(figures: Figure | Sequence[Figure], stamped: str) -> None:
    """Write what is simulated upright into the right edge of each page: figures are copied without their captions."""
    for page in _pages(figures):
        page.text(
            0.999, 0.5, stamped, rotation=90, va="center", ha="right", fontsize=5.5, color=GREY
        )


def _pages(figures: Figure | Sequence[Figure]) -> Sequence[Figure]:
    """Return the pages of a figure as a sequence, also where it is a single page."""
    from matplotlib.figure import Figure

    return [figures] if isinstance(figures, Figure) else figures


# Files: atomic, and the same figure always gives the same bytes


# metadata with a date or the version of a program are left out, so that equal figures give equal files
_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "pdf": {"Creator": None, "Producer": None, "CreationDate": None},
    "svg": {"Creator": None, "Date": None},
}

_REMARK_KEY = {"png": "Description", "pdf": "Subject", "svg": "Description"}
"""Key of the metadata under which each sort of file keeps a remark."""

PRINTED = tuple(_METADATA)
"""Endings of the file of a figure that a command writes."""

SCREEN = ("png", "webp")
"""Endings of the files of a figure that a run draws; webp is the preview that the report page shows."""

PAPER = ("pdf",)
"""Ending of the file of a figure that is drawn on demand, for a paper."""

PREVIEW, SHEET = 125 / 300, 60 / 300
"""Size of a preview relative to the png, for a figure (900 pixels for two columns) and for a quality sheet (a thumbnail)."""


def _place_panels(figure: Figure) -> None:
    """Let matplotlib place the panels once for all formats, since each layout takes time; a page placed by hand stays."""
    if engine := figure.get_layout_engine():
        engine.execute(figure)
        figure.set_layout_engine(None)  # with an engine matplotlib would draw twice for each file
        for axes in figure.axes:
            # rounded: the last digits of the solver differ from call to call, and files must not
            left, bottom, width, height = axes.get_position(original=True).bounds
            axes.set_position((round(left, 6), round(bottom, 6), round(width, 6), round(height, 6)))


def _page_with_warning(figure: Figure) -> Bbox | None:
    """Return the box of a page with the warnings above it (`mark`), inches; None without warnings: the page as it is.

    Matplotlib's ``bbox_inches="tight"`` would find it, too, but draws everything twice.
    """
    from matplotlib.transforms import Bbox

    # upper ends, pixels, of the texts that `mark` wrote
    tops = [
        text.get_window_extent().y1 for text in figure.texts if text.get_position()[1] >= _ABOVE
    ]
    if not tops:
        return None
    width, height = figure.get_size_inches()
    return Bbox.from_extents(0, 0, width, max(height, max(tops) / figure.dpi) + 0.05)


def content(figure: Figure, ending: str, about: str = "") -> bytes:
    """Return the bytes of a figure's file, with the remark `about` in its metadata.

    `ending`: One of `PRINTED`. The bytes are not written by matplotlib, whose error on a full disk does not name the
    cause.
    """
    # hard compression takes a third of the time of a large png and saves nothing
    savefig_options: dict[str, Any] = (
        {"pil_kwargs": {"compress_level": 2}} if ending == "png" else {}
    )
    metadata = _METADATA[ending] | ({_REMARK_KEY[ending]: about} if about else {})
    buffer = BytesIO()
    # fontTools would warn of dates in fonts, in the middle of the output of a command
    logging.getLogger("fontTools").setLevel(logging.ERROR)
    # matplotlib reads some settings (fonts, hatches, salt of ids) only while it writes
    with styled():
        _place_panels(figure)
        figure.savefig(
            buffer,
            format=ending,
            metadata=metadata,
            bbox_inches=_page_with_warning(figure),
            **savefig_options,
        )
    return buffer.getvalue()


def shrink_png(png: bytes) -> bytes:
    """Return the preview of a png for the report page: a smaller webp, as bytes."""
    from PIL import Image

    with Image.open(BytesIO(png)) as png_image:
        picture = png_image.convert("RGB")
    # only quality sheets are wider than two columns of a journal at 300 dots per inch
    scale = PREVIEW if picture.width < 1.1 * DOUBLE_CM * CM * 300 else SHEET
    size = max(1, round(scale * picture.width)), max(1, round(scale * picture.height))
    picture = picture.resize(size, Image.Resampling.LANCZOS, reducing_gap=2)
    buffer = BytesIO()
    picture.save(buffer, "webp", quality=50, method=4)
    return buffer.getvalue()


def size_of_preview(content: bytes) -> tuple[int, int]:
    """Return width and height of a preview, pixels, so that the page keeps room for it before it is loaded.

    `content`: Bytes of its file; of a file without a picture, as tests write them, the size is 1 and 1.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(BytesIO(content)) as picture:
            return picture.size
    except UnidentifiedImageError:
        return 1, 1


def save(page: Figure, base: Path, about: str = "", endings: Sequence[str] = SCREEN) -> None:
    """Write the files of one page, one for each ending; arguments as of `save_pages`, but `base` with its folder.

    All are drawn before the first is written, so that an error leaves no half of them.
    """
    contents: dict[str, bytes] = {}
    for ending in endings:
        is_preview = ending == "webp"
        contents[ending] = (
            shrink_png(contents["png"]) if is_preview else content(page, ending, about)
        )
    for ending, file_content in contents.items():
        # with_suffix would cut a name such as glass0.3mm_LP at its point
        write_bytes(base.with_name(f"{base.name}.{ending}"), file_content)


def save_pages(
    figures: Figure | Sequence[Figure],
    root: Path,
    base: str,
    about: str = "",
    endings: Sequence[str] = SCREEN,
) -> list[str]:
    """Write the files of a figure, its further pages as ``<base>_page2`` and so on; return the paths from `root`.

    `base`: Path from `root`, without ending. `about`: Remark in the metadata. `endings`: Endings of the files; webp is
    made from png, which must stand before it.
    """
    pages = _pages(figures)
    names = [base if number == 1 else f"{base}_page{number}" for number in range(1, len(pages) + 1)]
    for page, name in zip(pages, names, strict=True):
        save(page, root / name, about, endings)
    return [f"{name}.{ending}" for name in names for ending in endings]
