"""Figures of legs and natural sands draw the curves of the tables and say what is missing."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from coverage_levels import sweep
from matplotlib.figure import Figure
from matplotlib.text import Annotation
from numpy.testing import assert_allclose, assert_array_equal
from pages import figure_faults, words
from result_tables import memory, of_runs

from rftfit import (
    DepthOnlyProfile,
    FourierProfile,
    Profile,
    TableProfile,
    model_leg,
    reference,
    scaled_generic,
)
from rftfit.campaign.config import Leg
from rftfit.compare.legs import measured_peak
from rftfit.figures import leg_panels, style
from rftfit.figures.registry import figures
from rftfit.forces.motion import THETA_DEG
from rftfit.model.fourier import as_array

MEDIA = ["poppy_LP", "glass3mm_CP"]
SANDS = ["yuma", "palms29"]
SAND_ZETAS = {"yuma": 0.61, "palms29": 0.78}
"""Scaling factor of each sand."""
STATED_CM = {"yuma": 2.0, "palms29": 3.0}
"""End of the linear regime that the config states."""


def curve(medium, leg, name, profile):
    forces = sweep(profile, model_leg(leg))
    names = {"medium": medium, "leg": leg, "profile": name, "reason": ""}
    table = pd.DataFrame({"theta_deg": THETA_DEG}).assign(**names)
    for c, force in (("z", forces.force_z_N), ("x", forces.force_x_N)):
        for end, share in (("", 0), ("_lo", -0.05), ("_hi", 0.05)):
            table[f"force_{c}{end}_N"] = force + share * abs(force)
    return table


def nine(medium):
    return as_array(reference.coefficients(medium))


@cache
def every_curve():
    parts = []
    for medium in MEDIA + SANDS:
        zeta = SAND_ZETAS.get(medium) or reference.coefficients(medium)["zeta"]
        profiles: dict[str, Profile] = {"generic": scaled_generic(zeta, nine("generic"))}
        if medium in MEDIA:
            table = TableProfile.published(medium)
            profiles |= {"table": table, "depth_only": DepthOnlyProfile.of(table)}
            profiles["fourier"] = FourierProfile(nine(medium))
        for leg in reference.LEGS:
            parts += [curve(medium, leg, name, profile) for name, profile in profiles.items()]
    return pd.concat(parts, ignore_index=True)


def predicted():
    return every_curve().copy()


def curve_of(leg, profile):
    return predicted().query(f"medium == 'poppy_LP' and leg == '{leg}' and profile == '{profile}'")


def draw(name, results, *medium):
    return next(figure for figure in figures() if figure.name == name).draw(results, *medium)


FIGURES: dict[str, Callable[[], Figure]] = {
    "legs": lambda: draw("legs", results(), "poppy_LP"),
    "legs_by_medium": lambda: draw("legs_by_medium", results()),
    "legs_depth_only": lambda: draw("legs_depth_only", results()),
    "legs_in_sands": lambda: draw("legs_in_sands", results(SANDS)),
    "forces_over_zeta": lambda: draw("forces_over_zeta", results()),
    "penetration": lambda: draw("penetration", pushed(*sand_tables())),
    "peak_errors": lambda: draw("peak_errors", results()),
}


@cache
def drawn(name):
    return FIGURES[name]()


@pytest.mark.parametrize("name", FIGURES)
def test_axes_have_units_and_no_text_leaves_the_figure_or_touches_another(name):
    figure = drawn(name)
    style.content(figure, "svg")
    assert figure_faults(figure) == []
    labels = {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())}
    assert labels != {""}
    assert all("(" in label and label.endswith(")") for label in labels - {""}), labels


def measured():
    both = pd.concat([reference.load("fig_s5"), reference.load("fig_s12")], ignore_index=True)
    both = both[both["medium"].isin(MEDIA + SANDS)]
    return both.assign(run_id=both["medium"] + "_" + both["leg"]).reset_index(drop=True)


def penetration():
    zetas = {medium: reference.coefficients(medium)["zeta"] for medium in MEDIA}
    return pd.DataFrame([{"method": "lsq", "medium": m, "zeta": z} for m, z in zetas.items()])


def sand_tables():
    samples = reference.load("fig_s11")
    samples = samples[samples["medium"].isin(SANDS)]
    end = samples["medium"].map(STATED_CM)
    samples = samples.assign(run_id=samples["medium"] + "_down", in_window=samples.depth_cm <= end)
    rows = []
    for medium in SANDS:
        for window, share in (("stated", 1.0), ("detected", 1.2)):
            to = share * STATED_CM[medium]
            samples_of_window = samples[(samples["medium"] == medium) & (samples["depth_cm"] <= to)]
            depth, stress = (
                samples_of_window[n].to_numpy(float) for n in ("depth_cm", "stress_z_N_per_cm2")
            )
            alpha = float(depth @ stress / (depth @ depth))
            rows.append(
                {
                    "medium": medium,
                    "run_id": f"{medium}_down",
                    "window": window,
                    "linear_to_cm": to,
                    "alpha_z_N_per_cm3": alpha,
                    "alpha_z_lo_N_per_cm3": 0.95 * alpha,
                    "alpha_z_hi_N_per_cm3": 1.05 * alpha,
                    "reason": "",
                }
            )
    empty = ("path_cm", "stress_x_N_per_cm2", "tare_z_N_per_cm2", "tare_x_N_per_cm2")
    return samples.assign(**dict.fromkeys(empty, 0.0)), pd.DataFrame(rows)


def errors():
    truth = measured()
    rows = []
    for (medium, leg, profile), curve in predicted().groupby(["medium", "leg", "profile"]):
        top = curve.iloc[int(curve["force_z_N"].argmax())]
        measured_curve = truth[(truth["medium"] == medium) & (truth["leg"] == leg)]
        ends = {f"peak_predicted_{e}N": top[f"force_z_{e}N"] for e in ("", "lo_", "hi_")}
        rows.append(
            {
                "medium": medium,
                "leg": leg,
                "profile": profile,
                "component": "z",
                "reason": "",
                "reason_code": "",
                "peak_measured_N": measured_curve["force_z_N"].max(),
                **ends,
            }
        )
    return pd.DataFrame(rows)


def results(media=MEDIA, legs=None, **tables):
    """Results of these media, with tables of one's own in place of the usual ones."""
    usual = {
        "predicted": predicted,
        "legs/{medium}": measured,
        "penetration": penetration,
        "leg_errors": errors,
    }
    used_tables = {name: tables[name] if name in tables else make() for name, make in usual.items()}
    if "measured" in tables:
        used_tables["legs/{medium}"] = tables["measured"]
    settings = {} if legs is None else {"intruders": legs}
    return memory({f"{name}.csv": table for name, table in used_tables.items()}, media, **settings)


def pushed(samples, sands):
    """Results of penetration tests."""
    fits = (
        samples[["run_id", "medium"]]
        .drop_duplicates()
        .assign(direction="intrusion", mirrored=False)
    )
    sand_results = of_runs(samples.drop(columns="medium"), fits)
    sand_results.sands = tuple(SANDS)
    sand_results.tables["sands.csv"] = sands
    return sand_results


def panels(figure):
    """Text of each axes, its ticks left out."""
    return ["\n".join(t.get_text() for t in axes.texts) for axes in figure.axes]


def test_the_curves_drawn_are_those_of_the_tables():
    figure = drawn("legs")
    seen, flat = (
        measured().query(f"medium == 'poppy_LP' and leg == '{leg}'")["force_z_N"].max()
        for leg in ("c_leg", "reversed_c_leg")
    )
    # a row of sketches, of F_z and of F_x; the first line of a panel is that of zero
    lines = [line.get_ydata() for line in figure.axes[3].lines[1:]]
    assert_allclose(np.nanmax(lines[0]), seen)
    assert_array_equal(lines[1], curve_of("c_leg", "table")["force_z_N"])
    # the depth-only model has an inset of its own
    highest = curve_of("reversed_c_leg", "depth_only")["force_z_N"].max()
    (inset,) = figure.axes[5].child_axes
    dots, line = (np.nanmax(np.asarray(curve.get_ydata(), dtype=float)) for curve in inset.lines)
    assert dots == flat
    assert line == highest < inset.get_ylim()[1]
    assert figure.axes[5].get_ylim()[1] < highest
    line = next(curve for curve in drawn("legs_depth_only").axes[0].lines if curve.is_dashed())
    assert_array_equal(line.get_ydata(), curve_of("c_leg", "depth_only")["force_z_N"])
    # the generic forces are the sweep of the printed coefficients
    expected = sweep(FourierProfile(nine("generic")), model_leg("c_leg")).force_z_N
    drawn_forces = np.asarray(drawn("forces_over_zeta").axes[0].lines[1].get_ydata(), dtype=float)
    assert_allclose(drawn_forces, expected, atol=1e-12)


def test_each_push_into_a_sand_has_its_own_fit():
    samples, sands = sand_tables()
    samples_of_sand, fits = (table[table["medium"] == SANDS[0]] for table in (samples, sands))
    slopes_of = fits["alpha_z_N_per_cm3"]
    fits = fits.assign(run_id="again", alpha_z_N_per_cm3=2 * slopes_of)
    samples = pd.concat([samples, samples_of_sand.assign(run_id="again")])
    figure = draw("penetration", pushed(samples, pd.concat([sands, fits])))
    lines = [np.asarray(line.get_xydata(), dtype=float) for line in figure.axes[0].lines]
    slopes = [xy[1, 1] / xy[1, 0] for xy in lines if len(xy) == 2 and not xy[0].any()]
    assert_allclose(sorted(slopes), sorted([*slopes_of, *(2 * slopes_of)]))
    style.content(figure, "svg")
    assert figure_faults(figure) == []
    assert any("2 tests, stated" in text for text in words(figure))


def test_penetration_marks_the_detected_end_and_says_what_is_missing():
    def ends(figure):
        return [set(np.ravel(line.get_xdata())) for line in figure.axes[0].lines]

    samples, sands = sand_tables()
    detected = sands["window"] == "detected"
    figure = drawn("penetration")
    assert {1.2 * STATED_CM["yuma"]} in ends(figure)
    assert panels(figure) == ["Yuma sand", "29 Palms sand"]
    whole = sands.assign(reason_code=np.where(detected, "no-linear-end", ""))
    figure = draw("penetration", pushed(samples, whole))
    assert {1.2 * STATED_CM["yuma"]} not in ends(figure)
    assert any("no end in" in text for text in words(figure))
    samples.loc[samples["medium"] == "palms29", "stress_z_N_per_cm2"] = np.nan
    sands.loc[(sands["medium"] == "yuma") & detected, "alpha_z_N_per_cm3"] = np.nan
    figure = draw("penetration", pushed(samples, sands))
    assert panels(figure) == [
        "no fit over the detected window\nYuma sand",
        "no stress in this test\n29 Palms sand",
    ]


def test_peak_errors_are_ratios_and_missing_ones_are_told():
    table = errors()
    numbers = [name for name in table if str(name).startswith("peak")]
    first = (table["medium"] == "poppy_LP") & (table["leg"] == "c_leg")
    second = (table["medium"] == "glass3mm_CP") & (table["profile"] == "fourier")
    table.loc[first | second, numbers] = np.nan
    table.loc[first, "reason"] = "no measured curve"
    table = table[(table["medium"] != "yuma") | (table["leg"] != "flat_leg")]
    table = table[table["medium"] != "palms29"]
    figure = draw("peak_errors", results(leg_errors=table))
    labels_of_panels = [set(text.split("\n")) for text in panels(figure)]
    assert labels_of_panels[0] == {"no value: no measured curve", "no value: nine-term fit"}
    assert labels_of_panels[1] == {"no value: nine-term fit", "nothing predicted"}
    labels = [label.get_text() for label in drawn("peak_errors").axes[0].get_yticklabels()]
    titles = results().campaign.titles
    assert labels == [titles[name] for name in titles if name in (*MEDIA, *SANDS)]
    row = table.query("medium == 'poppy_LP' and leg == 'flat_leg' and profile == 'table'").iloc[0]
    ratio = row["peak_predicted_N"] / row["peak_measured_N"]
    drawn_at = [float(np.ravel(line.get_xdata())[0]) for line in figure.axes[1].lines]
    assert any(abs(x - ratio) < 1e-12 for x in drawn_at)
    nothing = words(draw("peak_errors", results(leg_errors=table[:0])))
    assert any("no leg was measured" in text for text in nothing)


def test_an_interval_of_a_peak_that_includes_zero_reaches_the_edge():
    table = errors().query("medium == 'yuma' and leg == 'flat_leg'")
    figure = draw("peak_errors", results(leg_errors=table.assign(peak_predicted_lo_N=-1.0)))
    bar: Any = figure.axes[0].collections[0]
    (start, _), (end, _) = bar.get_segments()[0]
    edge = figure.axes[0].get_xlim()[0]
    assert edge < start < 1.1 * edge
    (mark,) = [line for line in figure.axes[0].lines if line.get_marker() == "<"]
    assert np.asarray(mark.get_xdata()).tolist() == [start]
    assert_allclose(end * table["peak_measured_N"], table["peak_predicted_hi_N"])


def test_gaps_and_new_runs_break_the_line():
    theta = [-3.0, -2.0, 4.0, 5.0, -3.0, -2.0]
    rows = pd.DataFrame({"theta_deg": theta, "force_z_N": np.arange(6.0)})
    force = leg_panels.with_gaps(rows, "force_z_N")[1]
    assert_array_equal(force, [0, 1, np.nan, 2, 3, np.nan, 4, 5])


def test_the_sketch_puts_axle_and_tip_where_the_design_says(paper_config):
    for leg in (
        intruder for intruder in paper_config.intruders.values() if isinstance(intruder, Leg)
    ):
        line = leg_panels.leg_line(leg, -60.0)
        assert_allclose(line[0], [0, 2], atol=0.02)
        tip = [7.62 * np.sin(np.radians(60)), 2 - 7.62 * np.cos(np.radians(60))]
        assert_allclose(line[-1], tip, atol=0.03)


def test_the_sketch_has_a_scale_and_names_its_axes(paper_config):
    """Three arrows: x, z and the turn of the leg; the bar is 2 cm long."""
    axes = style.new_figure(6, 6).add_subplot()
    leg_panels.add_sketch(axes, paper_config.intruders["c_leg"])
    assert {"$x$", "$z$", r"$\theta$", "2 cm"} <= {text.get_text() for text in axes.texts}
    arrows = [text for text in axes.texts if isinstance(text, Annotation) and text.arrow_patch]
    assert len(arrows) == 3
    bar = axes.lines[-1]
    assert np.ptp(bar.get_xdata()) == pytest.approx(2)
    assert bar.get_color() == "black"


@pytest.mark.parametrize("name", ["legs_by_medium", "legs_depth_only"])
def test_the_measured_peak_is_that_of_the_tables(name):
    noise = np.random.default_rng(4).normal(0, 0.3, len(measured()))
    noisy = measured().assign(force_z_N=lambda table: table["force_z_N"] + noise)
    curve = noisy[(noisy["medium"] == MEDIA[0]) & (noisy["leg"] == "c_leg")]
    peak = measured_peak(*curve[["theta_deg", "force_z_N"]].to_numpy(float).T, "z").force_N
    assert curve["force_z_N"].max() > peak + 0.1
    text = words(draw(name, results(measured=noisy)))
    assert any(f"peak $F_z$ (N): {peak:.2f}" in line for line in text)


def test_the_interval_above_a_panel_is_that_of_the_peak_in_the_table():
    def titles(**ends):
        table = errors().assign(
            peak_predicted_N=7.25, peak_predicted_lo_N=3.5, peak_predicted_hi_N=9.75, **ends
        )
        figure = draw("legs_by_medium", results(leg_errors=table))
        return [axes.get_title(loc="left") for axes in figure.axes]

    of_model = {"peak_predicted_model_lo_N": 1.25, "peak_predicted_model_hi_N": 12.5}
    for ends, interval in (({}, "(3.50 to 9.75)"), (of_model, "(1.25 to 12.5)")):
        assert any(f"7.25 {interval}" in title for title in titles(**ends))


def test_no_band_of_alpha_is_drawn_around_a_peak_whose_interval_is_withheld():
    steep = errors()
    steep.loc[(steep["medium"] == MEDIA[0]) & (steep["leg"] == "c_leg"), "reason_code"] = (
        "steep accepted"
    )
    for table, bands, named in ((errors(), 2, False), (steep, 1, True)):
        figure = draw("legs_by_medium", results(leg_errors=table))
        # of F_z and F_x, one panel a leg
        assert [len(axes.collections) for axes in figure.axes[:3]] == [bands, 2, 2]
        assert any("none where that of the peak is withheld" in t for t in words(figure)) is named


def test_pieces_of_an_unknown_interval_are_not_drawn_as_a_narrow_one():
    table = predicted()
    is_large = table["force_z_N"].abs() > 0.1 * table["force_z_N"].abs().max()
    ends = [f"force_{c}_{end}_N" for c in "zx" for end in ("lo", "hi")]
    table.loc[is_large, ends] = np.nan
    figure = draw("forces_over_zeta", results(predicted=table))
    (bands,) = figure.axes[0].collections
    assert not np.isfinite(np.concatenate([p.vertices for p in bands.get_paths()] or [[]])).any()
    assert "95 % interval of it" in words(drawn("forces_over_zeta"))
    every = table.assign(**dict.fromkeys(ends, np.nan))
    assert "95 % interval of it" not in words(draw("forces_over_zeta", results(predicted=every)))
