"""Pictures of the live page: stress of a push over depth, and the map, as svg that takes its colours from the page.

Places are in units of the picture, about pixels, from its upper left corner: x to the right, y down.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from rftfit.bench.medium import MeasuredRun
from rftfit.conventions import FloatArray
from rftfit.forces.planning import Plan
from rftfit.measure.alpha import column
from rftfit.measure.ledger import RowStatus


def draw_stress(
    measured: MeasuredRun, area_cm2: float, sign_x: float, repeats: Sequence[MeasuredRun]
) -> str:
    """Draw stress (N/cm^2) of a run over depth, cm, its fit, and the fits of repeats, dashed; empty without a sample.

    Stress is alpha times depth. Of a horizontal run it is drawn over the path, and the fit is a level line.
    `area_cm2`: Of the plate, by which force becomes stress. `sign_x`: 1 or -1, by which the measured force along x becomes
    that of the cell that the run is filed under. `repeats`: Other runs of this cell.
    """
    tared = measured.tared
    is_level = measured.rows["fits"]["direction"] == "horizontal"
    along_cm = tared["path_cm" if is_level else "depth_cm"]
    if not along_cm.size:
        return ""
    fitted_cm = along_cm[tared["window"] == RowStatus.GOOD]
    # both ends of the samples that were fitted; empty if there is none
    window_cm = np.array([fitted_cm.min(), fitted_cm.max()]) if fitted_cm.size else fitted_cm
    # the fit of a level push is the stress at its one depth
    depth_cm = np.full(window_cm.size, tared["depth_cm"].mean()) if is_level else window_cm
    signs = {"z": 1.0, "x": sign_x}
    stress = {c: sign * tared[f"force_{c}_N"] / area_cm2 for c, sign in signs.items()}
    both = np.nan_to_num(np.concatenate([*stress.values()]))
    first_cm, last_cm = float(along_cm.min()), float(along_cm.max())
    lowest, highest = min(0, both.min()), max(1e-9, both.max())
    # ends of the axes in the picture
    left, right, bottom, top = 46.0, 412.0, 206.0, 10.0

    def points(x_cm: FloatArray, stress: FloatArray) -> list[str]:
        """Format points of a curve as places in the picture, "x,y" each, without those that are NaN; `x_cm`: along the axis."""
        x = left + (x_cm - first_cm) / ((last_cm - first_cm) or 1) * (right - left)
        y = bottom - (stress - lowest) / (highest - lowest) * (bottom - top)
        return [f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True) if np.isfinite(b)]

    parts = [f'<path class="axis" d="M{left},{top}V{bottom}H{right}"/>']
    most_dots = 250
    # every so many-th sample is drawn
    thin = slice(None, None, 1 + along_cm.size // most_dots)
    for c, stress_of_component in stress.items():
        # a line of no length is drawn as a dot
        dots = "".join(f"M{dot}h0" for dot in points(along_cm[thin], stress_of_component[thin]))
        parts.append(f'<path class="dots {c}" d="{dots}"/>')
        for run in (measured, *repeats):
            line = " ".join(points(window_cm, run.rows["fits"][column(c)] * depth_cm))
            style = f"law {c}" if run is measured else f"law {c} other"
            parts.append(f'<polyline class="{style}" points="{line}"/>')
    title = "path, cm" if is_level else "depth, cm"
    parts += [
        _text_element(left - 4, bottom, f"{lowest:.2g}", "end"),
        _text_element(left - 4, top + 8, f"{highest:.2g}", "end"),
        _text_element(left, bottom + 14, f"{first_cm:.1f}"),
        _text_element(right, bottom + 14, f"{last_cm:.1f}"),
        _text_element(220, bottom + 28, title),
        _text_element(12, 110, "stress, N/cm²", attributes=' transform="rotate(-90 12,110)"'),
    ]
    return _svg_picture(424, 240, f"Stress over {title}, vertical and horizontal", parts)


def _text_element(
    x: float, y: float, content: object, anchor: str = "middle", attributes: str = ""
) -> str:
    """Format a text at (x, y); `anchor`: which part of the text lies there: start, middle or end."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{attributes}>{content}</text>'


def _svg_picture(width: int, height: int, label: str, parts: Sequence[str]) -> str:
    """Format a picture of some svg elements (`parts`); `label`: its description for readers that do not see it."""
    box = f'viewBox="0 0 {width} {height}" role="img" aria-label="{label}"'
    return f"<svg {box}>{''.join(parts)}</svg>"


_CELL = 16
"""Width and height of a cell of a map, in units of the picture."""
_LEFT = 34
"""Left end of a map, in units of the picture."""


def draw_heat(table: pd.DataFrame, component: str, plan: Plan | None, *, error: bool) -> str:
    """Draw one component of a map over gamma (across) and beta (up), or with `error` the half width of its interval.

    A cell for each direction of the map. Larger numbers have fuller colours. Directions that were pushed have a frame; the
    next pushes have their number. `table`: Map as `Map.table` returns it: a row for each direction, with ``beta_deg``,
    ``gamma_deg``, alpha and its interval (N/cm^3) and ``source``. `component`: z or x. `plan`: Next pushes, or None.
    """
    betas, gammas = (np.sort(table[f"{angle}_deg"].unique()) for angle in ("beta", "gamma"))
    alpha, low, high = (table[column(component, end)].to_numpy(float) for end in ("", "_lo", "_hi"))
    half_width = (high - low) / 2
    # of both components, so that their colours mean the same
    largest = float(table[[column(c) for c in "zx"]].abs().max().max()) or 1.0
    # N/cm^3; errors are smaller than alpha, and would be pale
    full_colour = largest / 4 if error else largest
    opacities = np.minimum(half_width if error else np.abs(alpha), full_colour) / full_colour

    def corner(beta: float, gamma: float) -> tuple[int, int]:
        """Return the upper left corner (x, y) of the cell nearest to a direction, deg."""
        row, col = np.argmin(np.abs(betas - beta)), np.argmin(np.abs(gammas - gamma))
        return _LEFT + _CELL * int(col), 4 + _CELL * int(betas.size - 1 - row)

    parts = []
    for index, (beta, gamma) in enumerate(zip(table["beta_deg"], table["gamma_deg"], strict=True)):
        x, y = corner(beta, gamma)
        colour = "loose" if error else "up" if alpha[index] >= 0 else "down"
        frame = " pushed" if table["source"].iloc[index] == "measured" else ""
        title = f"({beta:.4g}, {gamma:.4g}): {alpha[index]:.3g} ± {half_width[index]:.2g}"
        shape = f'x="{x}" y="{y}" width="{_CELL - 2}" height="{_CELL - 2}"'
        fill = f'fill-opacity="{opacities[index]:.2f}"'
        parts.append(f'<rect class="{colour}{frame}" {fill} {shape}><title>{title}</title></rect>')
    # the first step of a plan is the state before any of the next pushes
    for number, step in enumerate(plan.steps[1:] if plan else (), start=1):
        x, y = corner(*step.directions[0])
        parts.append(_text_element(x + 7, y + 11, number))
    right, bottom = _LEFT - 2 + _CELL * gammas.size, 16 + _CELL * betas.size
    parts += [
        _text_element(_LEFT - 4, 16, f"{betas[-1]:.3g}", "end"),
        _text_element(_LEFT - 4, bottom - 16, f"{betas[0]:.3g}", "end"),
        _text_element(_LEFT, bottom, f"{gammas[0]:.3g}", "start"),
        _text_element(right, bottom, f"{gammas[-1]:.3g}", "end"),
        _text_element(right / 2 + 16, bottom, "gamma, deg"),
        *_colour_bar(right, bottom, full_colour, error=error),
    ]
    quantity = f"{'half interval of ' if error else ''}alpha_{component}"
    label = f"Map of {quantity} over beta (upward) and gamma"
    drawn = _svg_picture(right + 6, bottom + 40, label, parts)
    sign = "" if error else f"; red pushes {'up' if component == 'z' else 'toward +x'}"
    return f"<figure><figcaption>{quantity}{sign}; beta upward</figcaption>{drawn}</figure>"


def _colour_bar(right: int, bottom: int, full_colour: float, *, error: bool) -> list[str]:
    """Draw the colour bar below a map from -`full_colour` to +`full_colour`, N/cm^3, or with `error` from 0.

    `right`, `bottom`: Lower right corner of the map in the picture.
    """
    # fields of the bar on each side of 0
    end = 4
    steps = range(0 if error else -end, end + 1)
    width = (right - _LEFT) / len(steps)
    parts = []
    for number, step in enumerate(steps):
        colour = "loose" if error else "up" if step >= 0 else "down"
        shape = f'x="{_LEFT + number * width:.1f}" y="{bottom + 8}" width="{width:.1f}" height="10"'
        opacity = f'fill-opacity="{abs(step) / end:.2f}"'
        parts.append(f'<rect class="{colour}" {opacity} {shape}/>')
    lowest = "0" if error else f"-{full_colour:.2g}"
    parts.append(_text_element(_LEFT, bottom + 32, lowest, "start"))
    parts.append(_text_element(right, bottom + 32, f"{full_colour:.2g} N/cm³", "end"))
    return parts
