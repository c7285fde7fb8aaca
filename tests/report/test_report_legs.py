from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from rftfit import reference
from rftfit.campaign.config import Leg
from rftfit.errors import InputError
from rftfit.figures import leg_panels
from rftfit.figures.leg_panels import leg_line, model_legs
from rftfit.figures.legs import draw_generic_forces, draw_leg_media, draw_legs, draw_peak_errors
from rftfit.figures.sands import draw_penetration
from rftfit.figures.style import save
from rftfit.model.fourier import TERMS
from rftfit.model.motion import THETA_DEG, sweep
from rftfit.model.outlines import model_leg
from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

    from rftfit.conventions import FloatArray
    from rftfit.model.profiles import Profile

MEDIA = ["poppy_LP", "glass3mm_CP"]
SANDS = ["yuma", "palms29"]
SAND_ZETAS = {"yuma": 0.61, "palms29": 0.78}
STATED_CM = {"yuma": 2.0, "palms29": 3.0}


def nine(medium: str) -> FloatArray:
    published = reference.coefficients(medium)
    return np.array([published.get(term, 0.0) for term in TERMS])


def curve(medium: str, leg: str, name: str, profile: Profile) -> pd.DataFrame:
    forces = sweep(profile, model_leg(leg))
    names = {"medium": medium, "leg": leg, "profile": name, "reason": ""}
    table = pd.DataFrame({"theta_deg": THETA_DEG}).assign(**names)
    for c, force in (("z", forces.force_z_N), ("x", forces.force_x_N)):
        table[f"force_{c}_N"] = force
        table[f"force_{c}_lo_N"] = force - 0.05 * abs(force)
        table[f"force_{c}_hi_N"] = force + 0.05 * abs(force)
    return table


@cache
def _predicted() -> pd.DataFrame:
    parts = []
    for medium in MEDIA + SANDS:
        zeta = SAND_ZETAS.get(medium)
        profiles: dict[str, Profile] = {}
        if zeta is None:
            table = TableProfile.published(medium)
            profiles["table"] = table
            profiles["fourier"] = FourierProfile(nine(medium))
            profiles["depth_only"] = DepthOnlyProfile.of(table)
            zeta = reference.coefficients(medium)["zeta"]
        profiles["generic"] = scaled_generic(zeta, nine("generic"))
        for leg in reference.LEGS:
            parts += [curve(medium, leg, name, profile) for name, profile in profiles.items()]
    return pd.concat(parts, ignore_index=True)


def predicted() -> pd.DataFrame:
    return _predicted().copy()


def measured() -> pd.DataFrame:
    both = pd.concat([reference.load("fig_s5"), reference.load("fig_s12")], ignore_index=True)
    both = both[both["medium"].isin(MEDIA + SANDS)]
    return both.assign(run_id=both["medium"] + "_" + both["leg"]).reset_index(drop=True)


def penetration() -> pd.DataFrame:
    zetas = {medium: reference.coefficients(medium)["zeta"] for medium in MEDIA}
    return pd.DataFrame([{"method": "lsq", "medium": m, "zeta": z} for m, z in zetas.items()])


def sand_tables() -> tuple[pd.DataFrame, dict[str, str], pd.DataFrame]:
    samples = reference.load("fig_s11")
    samples = samples[samples["medium"].isin(SANDS)]
    end = samples["medium"].map(STATED_CM)
    samples = samples.assign(run_id=samples["medium"] + "_down", in_window=samples.depth_cm <= end)
    rows = []
    for medium in SANDS:
        for window, share in (("stated", 1.0), ("detected", 1.2)):
            to = share * STATED_CM[medium]
            part = samples[(samples["medium"] == medium) & (samples["depth_cm"] <= to)]
            depth, stress = (part[n].to_numpy(float) for n in ("depth_cm", "stress_z_N_per_cm2"))
            alpha = float(depth @ stress / (depth @ depth))
            rows.append(
                {"medium": medium, "window": window, "linear_to_cm": to, "alpha_z_N_per_cm3": alpha,
                 "lo": 0.95 * alpha, "hi": 1.05 * alpha}
            )  # fmt: skip
    media_of = {f"{medium}_down": medium for medium in SANDS}
    return samples.drop(columns="medium"), media_of, pd.DataFrame(rows)


def errors() -> pd.DataFrame:
    truth = measured()
    rows = []
    for (medium, leg, profile), part in predicted().groupby(["medium", "leg", "profile"]):
        top = part.iloc[int(part["force_z_N"].argmax())]
        own = truth[(truth["medium"] == medium) & (truth["leg"] == leg)]
        ends = {f"peak_predicted_{e}N": top[f"force_z_{e}N"] for e in ("", "lo_", "hi_")}
        rows.append(
            {"medium": medium, "leg": leg, "profile": profile, "component": "z", "reason": "",
             "peak_measured_N": own["force_z_N"].max(), **ends}
        )  # fmt: skip
    return pd.DataFrame(rows)


FIGURES: dict[str, Callable[[], Figure]] = {
    "legs": lambda: draw_legs(predicted(), measured(), "poppy_LP"),
    "s5": lambda: draw_leg_media(predicted(), measured(), MEDIA),
    "s12": lambda: draw_leg_media(predicted(), measured(), SANDS, profile="generic"),
    "s8": lambda: draw_generic_forces(predicted(), measured(), penetration()),
    "s11": lambda: draw_penetration(*sand_tables()),
    "peaks": lambda: draw_peak_errors(errors()),
}


def words(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def panels(figure: Figure) -> list[str]:
    """Text of each axes, its ticks left out."""
    return ["\n".join(t.get_text() for t in axes.texts) for axes in figure.axes]


@pytest.mark.parametrize("name", FIGURES)
def test_the_same_tables_give_the_same_bytes(name: str, tmp_path: Path) -> None:
    one, other = (save(FIGURES[name](), tmp_path / folder / name) for folder in ("one", "other"))
    for first, second in zip(one, other, strict=True):
        assert first.read_bytes() == second.read_bytes(), first.suffix


def test_the_order_of_rows_does_not_matter(tmp_path: Path) -> None:
    shuffled = [t.sample(frac=1, random_state=1) for t in (predicted(), measured())]
    one = save(draw_legs(predicted(), measured(), "poppy_LP"), tmp_path / "one")
    other = save(draw_legs(shuffled[0], shuffled[1], "poppy_LP"), tmp_path / "other")
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in other]


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_label_has_a_unit(name: str) -> None:
    figure = FIGURES[name]()
    found = {axes.get_xlabel() for axes in figure.axes} | {a.get_ylabel() for a in figure.axes}
    found.discard("")
    assert found
    assert all("(" in label and label.endswith(")") for label in found), found


def boxes(figure: Figure) -> list[tuple[str, Bbox]]:
    """Places of all text but the numbers of the ticks (those beyond the limits are not drawn)."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    every: list[Any] = [t for t in figure.findobj(Text) if t.get_visible()]
    words = [(t.get_text(), t.get_window_extent()) for t in every if t.get_text().strip()]
    return [(word, box) for word, box in words if not re.fullmatch(r"[\u2212+\d.]+", word)]


@pytest.mark.parametrize("name", FIGURES)
def test_no_text_leaves_the_figure_or_touches_another(name: str) -> None:
    figure = FIGURES[name]()
    found = boxes(figure)
    width, height = figure.get_size_inches() * figure.dpi
    for i, (text, box) in enumerate(found):
        assert min(box.x0, box.y0) >= -1, text
        assert box.x1 <= width + 1, text
        assert box.y1 <= height + 1, text
        assert not [other for other, place in found[i + 1 :] if box.overlaps(place)], text


def test_the_curves_drawn_are_those_of_the_tables() -> None:
    figure = draw_legs(predicted(), measured(), "poppy_LP", profiles=["table"])
    seen = measured().query("medium == 'poppy_LP' and leg == 'c_leg'")
    ours = predicted().query("medium == 'poppy_LP' and leg == 'c_leg' and profile == 'table'")
    # a sketch, then F_z and F_x, for each leg; the first line of a panel is that of zero
    lines = [line.get_ydata() for line in figure.axes[1].lines[1:]]
    np.testing.assert_allclose(np.nanmax(lines[0]), seen["force_z_N"].max())
    np.testing.assert_array_equal(lines[1], ours["force_z_N"])


def test_a_depth_only_peak_beyond_the_panel_is_told() -> None:
    figure = draw_legs(predicted(), measured(), "poppy_LP")
    rows = predicted().query(
        "medium == 'poppy_LP' and leg == 'reversed_c_leg' and profile == 'depth_only'"
    )
    highest = rows["force_z_N"].max()
    told = [text for text in panels(figure) if "beyond" in text]
    assert len(told) == 1
    assert f"{highest:.1f} N" in told[0].replace("\n", " ")
    assert figure.axes[7].get_ylim()[1] < highest


def test_a_leg_that_is_not_measured_is_told_in_its_panels() -> None:
    without = measured().query("leg != 'flat_leg'")
    for figure, count in (
        (draw_legs(predicted(), without, "poppy_LP"), 2),
        (draw_leg_media(predicted(), without, MEDIA), len(MEDIA)),
        (draw_generic_forces(predicted(), without, penetration()), 2),
    ):
        assert sum("not measured" in text for text in panels(figure)) == count


def test_a_prediction_without_numbers_is_told_with_its_reason() -> None:
    table = predicted()
    bad = (table["leg"] == "c_leg") & (table["profile"] == "table")
    table.loc[bad, [name for name in table if str(name).startswith("force")]] = np.nan
    table.loc[bad, "reason"] = "cell (30, 45) is missing"
    for figure in (
        draw_legs(table, measured(), "poppy_LP"),
        draw_leg_media(table, measured(), ["poppy_LP"]),
    ):
        told = " ".join(panels(figure)).replace("\n", " ")
        assert "no prediction (cell (30, 45) is missing)" in told


def test_a_medium_without_any_data_has_a_row_that_says_so() -> None:
    figure = draw_leg_media(predicted(), measured(), ["poppy_LP", "moon dust"])
    empty = [text for text in panels(figure) if "not measured" in text and "no prediction" in text]
    assert len(empty) == len(reference.LEGS)
    assert "moon dust" in words(figure)
    with pytest.raises(InputError, match="moon dust"):
        draw_legs(predicted(), measured(), "moon dust")


def test_empty_tables_are_refused() -> None:
    none, nothing = predicted().iloc[:0], measured().iloc[:0]
    with pytest.raises(InputError, match="no medium"):
        draw_leg_media(none, nothing)
    with pytest.raises(InputError, match="zeta"):
        draw_generic_forces(none, nothing, penetration().iloc[:0])
    with pytest.raises(InputError, match="no natural sand"):
        draw_penetration(sand_tables()[0], {}, sand_tables()[2].iloc[:0])
    with pytest.raises(InputError, match="leg errors"):
        draw_peak_errors(errors().iloc[:0])
    with pytest.raises(InputError, match="no profile"):
        draw_leg_media(predicted(), measured(), profile="tabel")


def test_generic_forces_collapse_on_the_sweep_of_the_printed_coefficients() -> None:
    figure = draw_generic_forces(predicted(), measured(), penetration())
    expected = sweep(FourierProfile(nine("generic")), model_leg("c_leg")).force_z_N
    np.testing.assert_allclose(
        np.asarray(figure.axes[0].lines[1].get_ydata(), dtype=float), expected, atol=1e-12
    )


def test_a_medium_without_zeta_is_named_in_the_panels() -> None:
    table = penetration()
    table.loc[table["medium"] == "poppy_LP", "zeta"] = np.nan
    figure = draw_generic_forces(predicted(), measured(), table)
    assert all("no curve: poppy_LP" in text for text in panels(figure))


def test_penetration_marks_the_detected_end_and_says_what_is_missing() -> None:
    samples, media_of, sands = sand_tables()
    figure = draw_penetration(samples, media_of, sands)
    ends = [set(np.ravel(line.get_xdata())) for line in figure.axes[0].lines]
    assert {1.2 * STATED_CM["yuma"]} in ends
    assert panels(figure) == ["", ""]
    part = sands[(sands["medium"] != "yuma") | (sands["window"] != "detected")]
    figure = draw_penetration(samples[samples["run_id"] != "palms29_down"], media_of, part)
    assert panels(figure) == ["no fit over the detected window", "no penetration test"]


def test_peak_errors_are_ratios_and_missing_ones_are_told() -> None:
    table = errors()
    numbers = [name for name in table if str(name).startswith("peak")]
    first = (table["medium"] == "poppy_LP") & (table["leg"] == "c_leg")
    table.loc[first, numbers] = np.nan
    table.loc[first, "reason"] = "no measured curve"
    second = (table["medium"] == "glass3mm_CP") & (table["profile"] == "fourier")
    table.loc[second, numbers] = np.nan
    table = table[(table["medium"] != "yuma") | (table["leg"] != "flat_leg")]
    figure = draw_peak_errors(table, media=["poppy_LP", "glass3mm_CP", "yuma"])
    assert panels(figure)[0] == "no value: no measured curve\nno value: nine-term fit"
    assert panels(figure)[1] == "no value: nine-term fit\nnothing predicted"
    own = table.query("medium == 'poppy_LP' and leg == 'flat_leg' and profile == 'table'").iloc[0]
    ratio = own["peak_predicted_N"] / own["peak_measured_N"]
    drawn = [float(np.ravel(line.get_xdata())[0]) for line in figure.axes[1].lines]
    assert any(abs(x - ratio) < 1e-12 for x in drawn)


def test_an_interval_of_a_peak_that_includes_zero_reaches_the_edge() -> None:
    table = errors().query("medium == 'yuma' and leg == 'flat_leg'")
    figure = draw_peak_errors(table.assign(peak_predicted_lo_N=-1.0), legs=["flat_leg"])
    bar: Any = figure.axes[0].collections[0]
    (start, _), (end, _) = bar.get_segments()[0]
    assert start == figure.axes[0].get_xlim()[0]
    np.testing.assert_allclose(end * table["peak_measured_N"], table["peak_predicted_hi_N"])


def test_gaps_and_new_runs_break_the_line() -> None:
    theta = [-3.0, -2.0, 4.0, 5.0, -3.0, -2.0]
    rows = pd.DataFrame({"theta_deg": theta, "force_z_N": np.arange(6.0)})
    force = leg_panels.broken(rows, "force_z_N")[1]
    np.testing.assert_array_equal(force, [0, 1, np.nan, 2, 3, np.nan, 4, 5])


def test_the_sketch_puts_axle_and_tip_where_the_design_says() -> None:
    for leg in model_legs().values():
        line = leg_line(leg, -60.0)
        np.testing.assert_allclose(line[0], [0, 2], atol=0.02)
        tip = [7.62 * np.sin(np.radians(60)), 2 - 7.62 * np.cos(np.radians(60))]
        np.testing.assert_allclose(line[-1], tip, atol=0.03)


def test_legs_of_the_config_are_drawn_in_its_order_and_unknown_shapes_are_told() -> None:
    own = Leg(shape="leg", curvature_times_R=0.5, max_length_cm=6, width_cm=2, thickness_cm=0.5,
              hip_height_cm=1)  # fmt: skip
    one = predicted().query("medium == 'poppy_LP' and leg == 'c_leg'")
    table = pd.concat([one, one.assign(leg="half $ leg")])
    figure = draw_legs(table, measured(), "poppy_LP", legs={"half $ leg": own})
    assert any(r"half \$ leg" in text for text in words(figure))
    figure = draw_legs(table, measured(), "poppy_LP")
    assert any("shape of this leg not given" in text for text in words(figure))


def test_generic_forces_without_any_zeta() -> None:
    lost = penetration().assign(zeta=np.nan)
    with pytest.raises(InputError, match="no medium has a zeta of method 'lsq': forces cannot be"):
        draw_generic_forces(predicted(), measured(), lost)
