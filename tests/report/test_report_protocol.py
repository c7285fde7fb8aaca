"""Figures of how forces become slopes: recording to result, and all media at a few angles."""

from __future__ import annotations

import chain_tables as chain
import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text

from rftfit.errors import InputError
from rftfit.figures.plates import DrawnTrace, by_run, draw_linearity, runs_of_cells, thin
from rftfit.figures.protocol import Protocol, draw_protocol

CELLS = ((0.0, 90.0), (30.0, 0.0))


def words(figure: object) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text)]  # type: ignore[attr-defined]


def recording(kind: str) -> DrawnTrace:
    time = np.linspace(-4, 10, 800)
    path = np.clip(time, 0, 8)
    force = {"force_z_N": path, "force_x_N": -0.5 * path}
    if kind == "rotation":
        return {"time_s": time, "angle_deg": np.linspace(-135, 135, 800), **force}
    return {"time_s": time, "depth_cm": path, "x_cm": 4 - path, **force}


def column(kind: str, tare: bool = True) -> Protocol:
    trace, fit = chain.one_run("r", kind, 5.08, 0.35, 0.1, np.random.default_rng(2), 400)
    names = ["depth_cm", "path_cm", "stress_z_N_per_cm2", "stress_x_N_per_cm2", "in_window"]
    result = by_run(trace, names)["r"]
    if kind == "rotation":
        theta = np.arange(-135.0, 136.0)
        result = {"theta_deg": theta, "force_z_N": 5 * np.exp(-((theta + 40) ** 2) / 900),
                  "force_x_N": -2 * np.exp(-((theta - 9) ** 2) / 900)}  # fmt: skip
        fit = {}
    empty: DrawnTrace = {}
    return Protocol(
        kind, "held somehow", recording(kind), recording(kind) if tare else empty,
        {"pause": (-2.0, 0.0), "stroke": (0.0, 8.0)}, result, {str(key): cell for key, cell in fit.items()},
    )  # fmt: skip


def test_protocol_has_a_column_for_each_kind_with_units() -> None:
    kinds = ["intrusion", "extraction", "horizontal", "rotation"]
    figure = draw_protocol([column(kind) for kind in kinds], "poppy $eeds", 0.9)
    text = words(figure)
    assert len(figure.axes) == 12
    assert "poppy \\$eeds" in text
    assert [line for line in text if line in {f"{a}  {k}" for a, k in zip("ABCD", kinds)}]  # noqa: B905
    for wanted in ("position (cm)", "force on intruder (N)", r"stress (N/cm$^2$)", "depth (cm)",
                   r"$\theta$ (degrees)", "force, tare taken off (N)", "distance travelled (cm)",
                   "90 % interval of a fit"):  # fmt: skip
        assert wanted in text
    assert any("peak $F_z$ = 5.00 N at $\\theta$ = \u221240\u00b0" in line for line in text)
    assert any("peak $F_x$ = \u22122.00 N at $\\theta$ = 9\u00b0" in line for line in text)


def test_protocol_draws_slopes_of_depth_and_means_of_horizontal_runs() -> None:
    figure = draw_protocol([column("intrusion"), column("horizontal")], "m")
    slanted, flat = figure.axes[2], figure.axes[5]
    # zero, then for z and x the samples and the fit
    line = slanted.lines[2].get_xydata()
    np.testing.assert_allclose(np.asarray(line)[:, 1], 0.35 * np.asarray(line)[:, 0])
    assert np.asarray(line)[0, 0] == 0
    level = np.asarray(flat.lines[2].get_xydata())
    np.testing.assert_allclose(level[:, 1], 0.35 * 5.08)
    assert level[0, 0] == pytest.approx(2.0, abs=0.1)
    # height is minus depth, and x falls with it
    height, across = (np.asarray(one.get_ydata()) for one in figure.axes[0].lines[1:3])
    assert height.min() == -8.0
    assert across.min() == -4.0


def test_protocol_says_what_is_missing() -> None:
    lost = column("intrusion", tare=False)
    assert "no tare" in words(draw_protocol([lost], "m"))
    with pytest.raises(InputError, match="no run of which"):
        draw_protocol([], "m")


def tables() -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Traces, fits and alpha of two media; glass has lost its horizontal runs."""
    rng = np.random.default_rng(4)
    traces, fits, cells = [], [], []
    for medium, slope in (("poppy_LP", 0.35), ("glass3mm_CP", -0.02)):
        levels = (2.54, 5.08, 7.62) if medium == "poppy_LP" else ()
        runs = [("v", "intrusion", 0.0)] + [
            (f"h{i}", "horizontal", d) for i, d in enumerate(levels)
        ]
        for name, kind, level in runs:
            trace, fit = chain.one_run(f"{medium}_{name}", kind, level, slope, 0.1, rng, 300)
            traces.append(trace)
            fits.append(fit | {"medium": medium})
        for (beta, gamma), ids in zip(CELLS, (runs[:1], runs[1:]), strict=True):
            value = slope if ids else np.nan
            row = {"medium": medium, "beta_deg": beta, "gamma_deg": gamma,
                   "run_ids": " ".join(f"{medium}_{name}" for name, *_ in ids)}  # fmt: skip
            for c, alpha in (("z", value), ("x", 0.1 if ids else np.nan)):
                row |= {f"alpha_{c}_N_per_cm3": alpha, f"alpha_{c}_lo_N_per_cm3": alpha - 0.002,
                        f"alpha_{c}_hi_N_per_cm3": alpha + 0.002}  # fmt: skip
            cells.append(row)
    return pd.concat(traces, ignore_index=True), pd.DataFrame(fits), pd.DataFrame(cells)


def test_linearity_draws_slopes_points_and_gaps() -> None:
    traces, fits, alpha = tables()
    figure = draw_linearity(traces, fits, alpha, CELLS, chain.TITLES)
    text = words(figure)
    assert "depth (cm)" in text
    assert "vertical stress\n$\\sigma_z$ (N/cm$^2$)" in text
    assert {"poppy seeds, loose", "3 mm glass, close", "95 % interval"} <= set(text)
    assert sum("no usable run:\n3 mm glass, close" in line for line in text) == 2
    # a sketch and two panels for each cell
    flat = figure.axes[4]
    points = [line for line in flat.lines if line.get_marker() == "o"]
    depths = sorted(float(np.asarray(line.get_xdata())[0]) for line in points)
    assert depths == pytest.approx([2.54, 5.08, 7.62])
    for line in points:
        x, y = (float(np.asarray(values)[0]) for values in line.get_data())
        assert y == pytest.approx(0.35 * x)
    slanted = figure.axes[1]
    ends = [np.asarray(line.get_ydata())[-1] for line in slanted.lines if line.get_marker() == "o"]
    assert ends == pytest.approx([0.35 * 6.5])


def test_linearity_needs_a_medium() -> None:
    traces, fits, alpha = tables()
    with pytest.raises(InputError, match="no medium"):
        draw_linearity(traces, fits, alpha.iloc[:0], CELLS)


def test_runs_of_cells_are_those_of_the_alpha_table() -> None:
    alpha = tables()[2]
    assert runs_of_cells(alpha, CELLS[:1]) == {"poppy_LP_v", "glass3mm_CP_v"}
    assert runs_of_cells(alpha, [(60.0, 45.0)]) == set()


def test_thinning_leaves_no_stretch_out_at_the_end() -> None:
    x = np.arange(1131.0)
    line = thin(x, np.zeros(x.size), 400)[0]
    assert np.diff(line[:, 0]).max() <= 10
