"""Pictures of the live page, as svg that takes its colours from the page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from rftfit.bench.medium import MeasuredRun
from rftfit.conventions import FloatArray
from rftfit.forces.planning import Plan
from rftfit.measure.alpha import column
from rftfit.measure.ledger import RowStatus

_CELL = 16
"""Size of a cell of a map, in units of the picture."""


def _text_element(
    x: float, y: float, words: object, anchor: str = "middle", attributes: str = ""
) -> str:
    """Format a text at (x, y), in units of the picture; `anchor`: end of the text that lies there."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{attributes}>{words}</text>'


def _svg_picture(wide: int, high: int, label: str, parts: Sequence[str]) -> str:
    """Format a picture of some parts; `label`: its description for readers that do not see it."""
    box = f'viewBox="0 0 {wide} {high}" role="img" aria-label="{label}"'
    return f"<svg {box}>{''.join(parts)}</svg>"


def draw_stress(
    measured: MeasuredRun, area_cm2: float, sign_x: float, repeats: Sequence[MeasuredRun]
) -> str:
    """Draw stress of a run over depth (horizontal run: over its path), its fit, and the fits of repeats, dashed.

    `sign_x`: Factor of alpha_x of the run. Empty if there is no sample.
    """
    fit, tared = measured.rows["fits"], measured.tared
    is_level = fit["direction"] == "horizontal"
    along = tared["path_cm" if is_level else "depth_cm"]
    good = tared["window"] == RowStatus.GOOD
    if not along.size:
        return ""
    curves = {c: s * tared[f"force_{c}_N"] / area_cm2 for c, s in (("z", 1.0), ("x", sign_x))}
    both = np.nan_to_num(np.concatenate([*curves.values()]))
    ends = (float(along.min()), float(along.max()), min(0, both.min()), max(1e-9, both.max()))
    left, right, bottom, top = 46.0, 412.0, 206.0, 10.0

    def points(x: FloatArray, y: FloatArray) -> list[str]:
        """Format points of the curve as coordinates of the picture."""
        across = left + (x - ends[0]) / ((ends[1] - ends[0]) or 1) * (right - left)
        down = bottom - (y - ends[2]) / (ends[3] - ends[2]) * (bottom - top)
        return [f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True) if np.isfinite(b)]

    parts = [f'<path class="axis" d="M{left},{top}V{bottom}H{right}"/>']
    window = np.array([along[good].min(), along[good].max()]) if good.any() else np.zeros(0)
    depth = np.full(window.size, tared["depth_cm"].mean()) if is_level else window
    most_dots = 250
    thin = slice(None, None, 1 + along.size // most_dots)
    for c, values in curves.items():
        dots = "".join(f"M{point}h0" for point in points(along[thin], values[thin]))
        parts.append(f'<path class="dots {c}" d="{dots}"/>')
        for kind, run in [("", measured), *((" other", run) for run in repeats)]:
            line = " ".join(points(window, run.rows["fits"][column(c)] * depth))
            parts.append(f'<polyline class="law {c}{kind}" points="{line}"/>')
    words = "path, cm" if is_level else "depth, cm"
    parts += [_text_element(left - 4, bottom, f"{ends[2]:.2g}", "end")]
    parts += [_text_element(left - 4, top + 8, f"{ends[3]:.2g}", "end")]
    parts += [
        _text_element(left, bottom + 14, f"{ends[0]:.1f}"),
        _text_element(right, bottom + 14, f"{ends[1]:.1f}"),
    ]
    parts += [_text_element(220, bottom + 28, words)]
    parts += [_text_element(12, 110, "stress, N/cm²", attributes=' transform="rotate(-90 12,110)"')]
    return _svg_picture(424, 240, f"Stress over {words}, vertical and horizontal", parts)


def draw_heat(table: pd.DataFrame, component: str, plan: Plan | None, *, error: bool) -> str:
    """Draw one component of a map over gamma and beta, or with `error` the half width of its interval.

    Larger numbers have fuller colours. Directions that were pushed have a frame; the next pushes have their number.
    """
    betas, gammas = (np.sort(table[f"{angle}_deg"].unique()) for angle in ("beta", "gamma"))
    alpha, low, high = (table[column(component, end)].to_numpy(float) for end in ("", "_lo", "_hi"))
    half = (high - low) / 2
    largest = float(table[[column(c) for c in "zx"]].abs().max().max()) or 1.0
    full = largest / 4 if error else largest
    shares = np.minimum(half if error else np.abs(alpha), full) / full

    def corner(beta: float, gamma: float) -> tuple[int, int]:
        """Return the upper left corner of the cell nearest to a direction, deg."""
        row, col = np.argmin(np.abs(betas - beta)), np.argmin(np.abs(gammas - gamma))
        return 34 + _CELL * int(col), 4 + _CELL * int(betas.size - 1 - row)

    parts = []
    for index, (beta, gamma) in enumerate(zip(table["beta_deg"], table["gamma_deg"], strict=True)):
        x, y = corner(beta, gamma)
        kind = "loose" if error else "up" if alpha[index] >= 0 else "down"
        frame = " pushed" if table["source"].iloc[index] == "measured" else ""
        title = f"({beta:.4g}, {gamma:.4g}): {alpha[index]:.3g} ± {half[index]:.2g}"
        shape = f'x="{x}" y="{y}" width="{_CELL - 2}" height="{_CELL - 2}"'
        fill = f'fill-opacity="{shares[index]:.2f}"'
        parts.append(f'<rect class="{kind}{frame}" {fill} {shape}><title>{title}</title></rect>')
    for number, step in enumerate(plan.steps[1:] if plan else (), start=1):
        x, y = corner(*step.directions[0])
        parts.append(_text_element(x + 7, y + 11, number))
    right, bottom = 32 + _CELL * gammas.size, 16 + _CELL * betas.size
    parts += [
        _text_element(30, 16, f"{betas[-1]:.3g}", "end"),
        _text_element(30, bottom - 16, f"{betas[0]:.3g}", "end"),
    ]
    parts += [
        _text_element(34, bottom, f"{gammas[0]:.3g}", "start"),
        _text_element(right, bottom, f"{gammas[-1]:.3g}", "end"),
    ]
    parts += [_text_element(right / 2 + 16, bottom, "gamma, deg")]
    parts += _colour_bar(right, bottom, full, error=error)
    what = f"{'half interval of ' if error else ''}alpha_{component}"
    drawn = _svg_picture(
        right + 6, bottom + 40, f"Map of {what} over beta (upward) and gamma", parts
    )
    way = "" if error else f"; red pushes {'up' if component == 'z' else 'toward +x'}"
    return f"<figure><figcaption>{what}{way}; beta upward</figcaption>{drawn}</figure>"


def _colour_bar(right: int, bottom: int, full: float, *, error: bool) -> list[str]:
    """Draw the colour bar below a map: from -`full` to +`full`, or with `error` from 0 to `full`, N/cm^3."""
    end = 4
    steps = range(0 if error else -end, end + 1)
    width = (right - 34) / len(steps)
    parts = []
    for number, step in enumerate(steps):
        kind = "loose" if error else "up" if step >= 0 else "down"
        place = f'x="{34 + number * width:.1f}" y="{bottom + 8}" width="{width:.1f}" height="10"'
        opacity = f'fill-opacity="{abs(step) / end:.2f}"'
        parts.append(f'<rect class="{kind}" {opacity} {place}/>')
    left_text = "0" if error else f"-{full:.2g}"
    parts.append(_text_element(34, bottom + 32, left_text, "start"))
    parts.append(_text_element(right, bottom + 32, f"{full:.2g} N/cm³", "end"))
    return parts
