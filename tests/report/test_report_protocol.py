"""Figures from recording to slope show a run of each kind with its slope, or say what is missing.

Also tested: the figure of all media at a few angles (linearity).
"""

import re

import numpy as np
import pytest
from pages import words
from result_tables import memory

import rftfit
from rftfit.figures import style
from rftfit.figures.registry import figures

MEDIUM = "poppy_LP"
PUSH, PULL, LEVEL = (f"{MEDIUM}_bp30_{name}" for name in ("g45_in", "g45_ex", "g00_h762"))
"""Runs of the small campaign that the figure shows beside its C-leg; of level ones the deepest."""


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


@pytest.fixture
def measured(small_root):
    """Results of the small campaign; a test may hold other tables."""
    return rftfit.open(small_root)


@pytest.fixture(scope="module")
def protocol(small_root):
    return draw("protocol", rftfit.open(small_root), MEDIUM)


def printed(number):
    return f"{number:.4f}".replace("-", "\N{MINUS SIGN}")


def test_protocol_has_a_column_for_each_kind_with_units(measured, protocol):
    text = words(protocol)
    assert len(protocol.axes) == 12
    assert "poppy seeds, loose" in text
    kinds = ("intrusion", "extraction", "horizontal", "rotation")
    assert {f"{letter}  {kind}" for letter, kind in zip("ABCD", kinds, strict=True)} <= set(text)
    for label in (
        "position (cm)",
        "force on intruder (N)",
        r"stress (N/cm$^2$)",
        "depth (cm)",
        r"$\theta$ (degrees)",
        "force, tare taken off (N)",
        "distance travelled (cm)",
        "$\\beta$ = 30\u00b0, $\\gamma$ = 45\u00b0",
        "$\\beta$ = 30\u00b0, 7.62 cm deep",
        "vertical, tare",
    ):
        assert label in text
    assert any("(\u221230\u00b0, \u221245\u00b0)" in line for line in text)
    assert any(line.startswith("c-leg, ") for line in text)
    # the line that is drawn is of this run, the interval of the mean
    medium = measured[MEDIUM]
    fits = medium.fits.set_index("run_id")
    cell = medium.alpha.query("beta_deg == 30 and gamma_deg == 0").iloc[0]
    half_width = (cell["alpha_z_hi_N_per_cm3"] - cell["alpha_z_lo_N_per_cm3"]) / 2
    of_run = f"= {printed(fits.loc[LEVEL, 'alpha_z_N_per_cm3'])} N/cm$^3$"
    mean = f"{printed(cell['alpha_z_N_per_cm3'])} \u00b1 {printed(half_width)} N/cm$^3$"
    assert any(f"{of_run}\nmean of 3 runs: {mean}" in line for line in text)
    curve = medium.legs.query("leg == 'c_leg'")
    (peak,) = (line for line in text if line.startswith("peak $F_z$"))
    force, theta = re.findall(
        r"= (\S+?)[ \u00b0]", peak.partition("\n")[0].replace("\u2212", "-") + " "
    )
    assert float(force) == pytest.approx(curve["force_z_N"].max(), rel=0.05)
    assert float(theta) == pytest.approx(curve["theta_deg"][curve["force_z_N"].idxmax()], abs=10)


def line_of_fit(axes):
    """Points of the line of alpha_z over the samples of a run."""
    (line,) = (
        line.get_xydata()
        for line in axes.lines
        if line.get_color() == "black" and line.get_linestyle() == "-" and np.any(line.get_ydata())
    )
    return np.asarray(line)


def test_protocol_draws_slopes_of_depth_and_means_of_horizontal_runs(measured, protocol):
    fits = measured[MEDIUM].fits.set_index("run_id")
    slanted, level = (line_of_fit(protocol.axes[place]) for place in (8, 10))
    assert slanted[0].tolist() == [0, 0]
    alpha = fits.loc[PUSH, "alpha_z_N_per_cm3"]
    np.testing.assert_allclose(slanted[:, 1], alpha * slanted[:, 0], rtol=1e-5)
    stress = 7.62 * fits.loc[LEVEL, "alpha_z_N_per_cm3"]
    np.testing.assert_allclose(level[:, 1], stress, rtol=0.01)
    assert level[0, 0] == pytest.approx(2.0, abs=0.1)
    # height is minus depth
    traces = measured.table(f"traces/{MEDIUM}.parquet")
    depth = traces.loc[traces["run_id"] == PUSH, "depth_cm"]
    heights = [
        np.nanmin(line.get_ydata())
        for line in protocol.axes[0].lines
        if line.get_linestyle() == "-"
    ]
    assert min(heights) == -depth.max()


def test_protocol_says_what_is_missing(measured, monkeypatch):
    name = f"traces/{MEDIUM}.parquet"
    traces = measured.table(name)
    measured.hold(name, traces[~traces["run_id"].str.endswith("_rod")])
    assert "no tare" in words(draw("protocol", measured, MEDIUM))
    measured.hold(name, traces[:0])
    assert any("no run of which" in line for line in words(draw("protocol", measured, MEDIUM)))
    for module in ("ingest", "session_clocks"):
        monkeypatch.setattr(f"rftfit.measure.{module}.read_logs", lambda *_: iter(()))
    (told,) = words(draw("clocks", memory({}), MEDIUM))
    assert told == "poppy seeds, loose: no run whose clocks were estimated"


def test_linearity_draws_slopes_and_points(measured):
    figure = draw("linearity", measured)
    text = words(figure)
    assert {"depth (cm)", "poppy seeds, loose", "95 % interval of alpha"} <= set(text)
    assert "vertical stress\n$\\sigma_z$ (N/cm$^2$)" in text
    marker = style.medium_looks([MEDIUM])[MEDIUM][1]
    # rows of sketches, of sigma_z and of sigma_x, five directions each; the third is of level runs
    slanted, level = (
        [
            np.ravel(line.get_xydata())
            for line in figure.axes[place].lines
            if line.get_marker() == marker
        ]
        for place in (6, 7)
    )
    fits = measured[MEDIUM].fits.set_index("run_id")["alpha_z_N_per_cm3"]
    (end,) = slanted
    assert end[1] == pytest.approx(fits[PUSH] * end[0], rel=1e-4)
    depths = {f"{MEDIUM}_bp90_g00_h{100 * depth:.0f}": depth for depth in (2.54, 5.08, 7.62)}
    expected = [(depth, fits[run_id] * depth) for run_id, depth in depths.items()]
    np.testing.assert_allclose(level, expected, rtol=0.01)


def test_linearity_is_drawn_in_directions_of_the_campaign_and_says_which_has_no_run(measured):
    name = f"alpha/{MEDIUM}.csv"
    alpha = measured.table(name)
    is_down = (alpha["beta_deg"] == 0) & (alpha["gamma_deg"] == 90)
    alpha.loc[is_down, ["beta_deg", "gamma_deg"]] = -5.0, 80.0
    alpha.loc[is_down, [column for column in alpha if column.startswith("alpha_")]] = np.nan
    measured.hold(name, alpha)
    text = words(draw("linearity", measured))
    assert "A  $\\beta$ = \u22125\u00b0, $\\gamma$ = 80\u00b0" in text
    assert sum("no usable run:\npoppy seeds, loose" in line for line in text) == 2
