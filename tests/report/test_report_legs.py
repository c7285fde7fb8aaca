"""Figures of legs and natural sands draw the curves of the tables and say what is missing."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Annotation
from numpy.testing import assert_allclose, assert_array_equal
from pages import figure_faults, words
from result_tables import memory

import rftfit
from rftfit.figures import style
from rftfit.figures.registry import figures

MEDIUM, SECOND, SAND = "poppy_LP", "glass3mm_CP", "yuma"
LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
TEST, ROD = f"{SAND}_bp00_g90_in", f"{SAND}_bp00_g90_in_rod"
"""The penetration test of the sand, and a run of the same plate."""


@pytest.fixture
def measured(small_root):
    """Results of the small campaign; a test may hold other tables."""
    return rftfit.open(small_root)


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


@pytest.fixture(scope="module")
def legs(small_root):
    return draw("legs", rftfit.open(small_root), MEDIUM)


def hold(results, name, table):
    results.hold(name, table)
    return results


def curve_of(results, leg, profile):
    rows = results.table("predicted.csv")
    return rows[(rows[["medium", "leg", "profile"]] == [MEDIUM, leg, profile]).all(axis="columns")]


def two_media(results, predicted=None):
    """Results of two laboratory media, the second one like the first."""

    def of_both(table):
        table = table[table["medium"] == MEDIUM]
        return pd.concat([table, table.assign(medium=SECOND)], ignore_index=True)

    predicted = results.table("predicted.csv") if predicted is None else predicted
    tables = {
        "predicted.csv": of_both(predicted),
        "penetration.csv": of_both(results.table("penetration.csv")),
        "legs/{medium}.csv": of_both(results.table(f"legs/{MEDIUM}.csv")),
    }
    return memory(tables, [MEDIUM, SECOND])


@pytest.mark.parametrize(
    "name",
    [
        "legs",
        "legs_by_medium",
        "legs_depth_only",
        "legs_in_sands",
        "forces_over_zeta",
        "penetration",
        "peak_errors",
    ],
)
def test_axes_have_units_and_no_text_leaves_the_figure_or_touches_another(measured, name):
    results = two_media(measured) if name == "forces_over_zeta" else measured
    figure = draw(name, results, *([MEDIUM] if name == "legs" else []))
    style.content(figure, "svg")
    assert figure_faults(figure) == []
    labels = {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())}
    assert labels != {""}
    assert all("(" in label and label.endswith(")") for label in labels - {""}), labels


def test_the_curves_drawn_are_those_of_the_tables(measured, legs):
    curves = measured.table(f"legs/{MEDIUM}.csv").set_index("leg")["force_z_N"]
    # a row of sketches, of F_z and of F_x; the first line of a panel is that of zero
    lines = [line.get_ydata() for line in legs.axes[3].lines[1:]]
    assert_array_equal(lines[0], curves["c_leg"])
    assert_array_equal(lines[1], curve_of(measured, "c_leg", "table")["force_z_N"])
    # the depth-only model has an inset of its own
    highest = curve_of(measured, "reversed_c_leg", "depth_only")["force_z_N"].max()
    (inset,) = legs.axes[5].child_axes
    dots, line = (np.nanmax(np.asarray(curve.get_ydata(), dtype=float)) for curve in inset.lines)
    assert dots == curves["reversed_c_leg"].max()
    assert line == highest < inset.get_ylim()[1]
    assert legs.axes[5].get_ylim()[1] < highest
    axes = draw("legs_depth_only", measured).axes[0]
    line = next(curve for curve in axes.lines if curve.is_dashed())
    assert_array_equal(line.get_ydata(), curve_of(measured, "c_leg", "depth_only")["force_z_N"])
    # forces over zeta are one curve of all media
    zeta = measured.table("penetration.csv").query("method == 'lsq'")["zeta"].iloc[0]
    expected = curve_of(measured, "c_leg", "generic")["force_z_N"] / zeta
    drawn_forces = draw("forces_over_zeta", two_media(measured)).axes[0].lines[-1].get_ydata()
    assert_allclose(np.asarray(drawn_forces, dtype=float), expected, atol=1e-4)


def test_each_push_into_a_sand_has_its_own_fit(measured):
    for kind in ("tared", "windows"):
        name = f"{kind}/{SAND}.parquet"
        samples = measured.table(name)
        samples = samples[samples["run_id"] == TEST]
        measured.hold(name, pd.concat([samples, samples.assign(run_id=ROD)], ignore_index=True))
    sands = measured.table("sands.csv")
    slopes_of = sands["alpha_z_N_per_cm3"]
    again = sands.assign(run_id=ROD, alpha_z_N_per_cm3=2 * slopes_of)
    figure = draw("penetration", hold(measured, "sands.csv", pd.concat([sands, again])))
    lines = [np.asarray(line.get_xydata(), dtype=float) for line in figure.axes[0].lines]
    slopes = [xy[1, 1] / xy[1, 0] for xy in lines if len(xy) == 2 and not xy[0].any()]
    assert_allclose(sorted(filter(None, slopes)), sorted([*slopes_of, *(2 * slopes_of)]))
    style.content(figure, "svg")
    assert figure_faults(figure) == []


def test_penetration_marks_the_detected_end_and_says_what_is_missing(measured):
    sands = measured.table("sands.csv")
    detected = sands["window"] == "detected"
    end_cm = sands.loc[detected, "linear_to_cm"].item()

    def is_marked(figure):
        return {end_cm} in [set(np.ravel(line.get_xdata())) for line in figure.axes[0].lines]

    assert is_marked(draw("penetration", measured))
    endless = sands.assign(reason_code=np.where(detected, "no-linear-end", ""))
    figure = draw("penetration", hold(measured, "sands.csv", endless))
    assert not is_marked(figure)
    unfitted = sands.assign(alpha_z_N_per_cm3=sands["alpha_z_N_per_cm3"].where(~detected))
    figure = draw("penetration", hold(measured, "sands.csv", unfitted))
    assert any("no fit over the detected window" in text for text in words(figure))
    name = f"tared/{SAND}.parquet"
    figure = draw(
        "penetration", hold(measured, name, measured.table(name).assign(force_z_N=np.nan))
    )
    assert any("no stress in this test" in text for text in words(figure))


def test_peak_errors_are_ratios_and_missing_ones_are_told(measured):
    table = measured.table("leg_errors.csv")
    numbers = [name for name in table if str(name).startswith("peak_") and name != "peak_errors"]
    is_poppy = table["medium"] == MEDIUM
    first = is_poppy & (table["leg"] == "c_leg")
    second = is_poppy & (table["leg"] == "flat_leg") & (table["profile"] == "fourier")
    table.loc[first | second, numbers] = np.nan
    table.loc[first, "reason"] = "no measured curve"
    table = table[is_poppy | (table["leg"] != "flat_leg")]
    figure = draw("peak_errors", hold(measured, "leg_errors.csv", table))
    told = [
        {line for text in axes.texts for line in text.get_text().split("\n")}
        for axes in figure.axes
    ]
    assert "no value: no measured curve" in told[0]
    assert {"no value: nine-term fit", "nothing predicted"} <= told[1]
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["poppy seeds, loose", "Yuma sand"]
    row = table.query("leg == 'flat_leg' and profile == 'table' and component == 'z'")
    ratio = (row["peak_predicted_N"] / row["peak_measured_N"]).item()
    drawn_at = [float(np.ravel(line.get_xdata())[0]) for line in figure.axes[1].lines]
    assert any(abs(x - ratio) < 1e-12 for x in drawn_at)
    nothing = words(draw("peak_errors", hold(measured, "leg_errors.csv", table[:0])))
    assert any("no leg was measured" in text for text in nothing)


def test_an_interval_of_a_peak_that_includes_zero_reaches_the_edge(measured):
    table = measured.table("leg_errors.csv").query(
        "medium == 'yuma' and leg == 'flat_leg' and profile == 'generic' and component == 'z'"
    )
    table = table.assign(peak_predicted_lo_N=-1.0)
    figure = draw("peak_errors", hold(measured, "leg_errors.csv", table))
    bar: Any = figure.axes[0].collections[0]
    (start, _), (end, _) = bar.get_segments()[0]
    edge = figure.axes[0].get_xlim()[0]
    assert edge < start < 1.1 * edge
    (mark,) = [line for line in figure.axes[0].lines if line.get_marker() == "<"]
    assert np.asarray(mark.get_xdata()).tolist() == [start]
    assert_allclose(end * table["peak_measured_N"], table["peak_predicted_hi_N"])


def test_gaps_and_new_runs_break_the_line(measured):
    name = f"legs/{MEDIUM}.csv"
    curves = measured.table(name)
    is_leg = curves["leg"] == "c_leg"
    is_kept = ~is_leg | ~curves["theta_deg"].between(-1.5, 3.5)
    again = curves[is_leg].assign(run_id="z_again")
    table = pd.concat([curves[is_kept], again], ignore_index=True)
    figure = draw("legs", hold(measured, name, table), MEDIUM)
    forces = np.asarray(figure.axes[3].lines[1].get_ydata(), dtype=float)
    assert np.isnan(forces).sum() == 2
    assert len(forces) == 2 + (table["leg"] == "c_leg").sum()


@pytest.mark.parametrize("place", range(len(LEGS)))
def test_the_sketch_puts_axle_and_tip_where_the_design_says_and_has_a_scale(legs, place):
    """Three arrows: x, z and the turn of the leg; the bar is 2 cm long."""
    axes = legs.axes[place]
    tip = [7.62 * np.sin(np.radians(60)), 2 - 7.62 * np.cos(np.radians(60))]
    lines = [np.asarray(line.get_xydata(), dtype=float) for line in axes.lines]
    ends = [line[[0, -1]] for line in lines if len(line) > 2]
    assert min(np.abs(end - [[0, 2], tip]).max() for end in ends) < 0.03
    assert {"$x$", "$z$", r"$\theta$", "2 cm"} <= {text.get_text() for text in axes.texts}
    arrows = [text for text in axes.texts if isinstance(text, Annotation) and text.arrow_patch]
    assert len(arrows) == 3
    assert np.ptp(axes.lines[-1].get_xdata()) == pytest.approx(2)
    assert axes.lines[-1].get_color() == "black"


@pytest.mark.parametrize(("name", "medium"), [("legs_by_medium", MEDIUM), ("legs_in_sands", SAND)])
def test_no_band_of_alpha_is_drawn_around_a_peak_whose_interval_is_withheld(measured, name, medium):
    profile = "map" if medium == SAND else "table"
    rows = measured.table("leg_errors.csv").query("medium == @medium and component == 'z'")
    rows = rows[rows["profile"] == profile].set_index("leg")
    is_steep = rows["reason_code"].str.contains("steep")
    assert is_steep.any() == (medium == SAND)
    figure = draw(name, measured)
    # of F_z and F_x, one panel a leg
    assert [len(axes.collections) for axes in figure.axes] == [2 - is_steep[leg] for leg in LEGS]
    named = any("none where that of the peak is withheld" in text for text in words(figure))
    assert named == is_steep.any()


def test_pieces_of_an_unknown_interval_are_not_drawn_as_a_narrow_one(measured):
    table = measured.table("predicted.csv")
    for c in "zx":
        force = table[f"force_{c}_N"]
        table[f"force_{c}_lo_N"], table[f"force_{c}_hi_N"] = force - 0.1, force + 0.1
    is_large = table["force_z_N"].abs() > 0.1 * table["force_z_N"].abs().max()
    ends = [f"force_{c}_{end}_N" for c in "zx" for end in ("lo", "hi")]
    some = table.assign(**{end: table[end].mask(is_large) for end in ends})
    figure = draw("forces_over_zeta", two_media(measured, some))
    (bands,) = figure.axes[0].collections
    assert not np.isfinite(np.concatenate([p.vertices for p in bands.get_paths()] or [[]])).any()
    for predicted, named in ((table, True), (table.assign(**dict.fromkeys(ends, np.nan)), False)):
        drawn = draw("forces_over_zeta", two_media(measured, predicted))
        assert ("95 % interval of it" in words(drawn)) == named
