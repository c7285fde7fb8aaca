"""Whatever is known of a medium is taken at every door, and one push has one answer at all of them.

Doors: `predict`, `Ground`, `mujoco.attach`, `write_profile` with ``rftfit export``, `compare_media` with ``rftfit compare``.
Media: one push, a map, a published medium, a medium of a campaign, a profile that was read, and the path of its file.
"""

import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import answer_of
from seeds import seeds

import rftfit

ALPHA = 0.55
"""alpha_z(0, 90 deg) of the push, N/cm^3."""

MEDIA = ("scale", "map", "published", "campaign", "read", "path")
LEGS = ("c_leg", "flat_leg", "reversed_c_leg")
PAPER_MEDIA = ("poppy_LP", "poppy_CP", "glass0.3mm_LP", "glass0.3mm_CP", "glass3mm_CP")
FOOT = rftfit.polyline([(-4, 0), (4, 0)], 5.0)
DOWN = rftfit.path([0, 5], [0, 0], [0, -5], [0, 0])
"""A foot of 8 x 5 cm that goes 5 cm down."""


def one_push(alpha):
    return pd.DataFrame({"beta_deg": [0], "gamma_deg": [90], "alpha_z_N_per_cm3": [alpha]})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A campaign whose alpha is that of two published media, and the profile of a push in a file."""
    folder = tmp_path_factory.mktemp("doors")
    campaign, names = folder / "campaign", PAPER_MEDIA[:2]
    for name in ("config", "raw"):
        (campaign / name).mkdir(parents=True)
    media = "".join(f"  {name}: {{title: {name}, published_as: {name}}}\n" for name in names)
    (campaign / "config" / "config.yaml").write_text(
        f"title: Doors\nraw: raw\nrun_sheet: raw/alpha.csv\ntable: {{holds: alpha}}\nmedia:\n{media}"
    )
    alpha = rftfit.published_table("table_s5")
    alpha[alpha["medium"].isin(names)].to_csv(campaign / "raw" / "alpha.csv", index=False)
    code, _, err = answer_of("run", "results/penetration.csv", folder=campaign)
    assert code == 0, err
    rftfit.write_profile(folder / "sand.json", rftfit.scale(ALPHA), title="Sand")
    return folder


@pytest.fixture(scope="module")
def media(folder):
    """What is known of a medium, in every form."""
    known = (
        rftfit.scale(ALPHA),
        rftfit.estimate_map(one_push(ALPHA)),
        rftfit.published_medium("poppy_LP"),
        rftfit.open(folder / "campaign")["poppy_LP"],
        rftfit.read_profile(folder / "sand.json"),
        folder / "sand.json",
    )
    return dict(zip(MEDIA, known, strict=True))


OF_PUSH = ("scale", "map", "read", "path")
"""Forms of the one push."""


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda line: answer_of(*line.split(), folder=tmp_path)


def lift(medium, body=FOOT, motion=DOWN):
    return float(rftfit.predict(medium, body, motion, model_error=0)["force_z_N"].max())


@pytest.fixture(scope="module")
def lifts(media):
    """Largest force on the foot, by the form in which its medium is known."""
    return {form: lift(medium) for form, medium in media.items()}


@pytest.fixture(scope="module")
def twice():
    """A medium of twice the resistance."""
    return rftfit.scale(2 * ALPHA, 0.02)


def test_every_form_but_a_path_is_a_known_medium(media):
    are_known = {form: isinstance(medium, rftfit.KnownMedium) for form, medium in media.items()}
    assert are_known == {form: form != "path" for form in MEDIA}


@pytest.mark.parametrize("form", MEDIA)
def test_predict(media, lifts, form):
    expected = 110.0 if form in OF_PUSH else 40 * 5 * 0.35093
    assert lifts[form] == pytest.approx(expected, rel=1e-3)
    assert rftfit.beyond_measured(media[form], FOOT, DOWN) is not None


@pytest.mark.parametrize("form", MEDIA)
def test_ground(media, form):
    mesh = rftfit.Mesh.extrude(FOOT)
    ground = rftfit.Ground(media[form], [mesh], delta_mm=0)
    forces = ground.step([[0, 0, -5]], np.eye(3)[None], [[0, 0, -1]], [[0, 0, 0]], 0.001)
    expected = 110.0 if form in OF_PUSH else 40 * 5 * 0.35093
    assert forces[0, 2] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("form", MEDIA)
def test_attach(media, form):
    mujoco = pytest.importorskip("mujoco")
    text = """<mujoco><option timestep="0.0005"/><worldbody><body pos="0 0 -0.05"><freejoint/>
    <geom name="foot" type="box" size="0.04 0.025 0.001" mass="1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[2] = -0.01
    attach: Any = rftfit.mujoco
    ground = attach.attach(model, data, media[form], delta_mm=0)
    ground.step()
    # the lower side lies 1 mm deeper than the middle
    expected = (110.0 if form in OF_PUSH else 40 * 5 * 0.35093) * 5.1 / 5
    # and its walls, 2 mm high, bear a little as it sinks along them
    walls = ground.forces[0, 2] / expected - 1
    assert 0 < walls < 0.02


@pytest.mark.parametrize("form", MEDIA)
def test_export(media, lifts, form, tmp_path):
    rftfit.write_profile(tmp_path / "out.json", media[form])
    again = rftfit.read_profile(tmp_path / "out.json")
    assert lift(again) == pytest.approx(lifts[form], rel=1e-6)


@pytest.mark.parametrize("form", MEDIA)
def test_compare(media, twice, form):
    if form == "published":
        # printed without errors: no draws
        with pytest.raises(rftfit.RftfitError, match="no errors"):
            rftfit.compare_media(media[form], twice)
        return
    comparison = rftfit.compare_media(media[form], twice)
    expected = 2.0 if form in OF_PUSH else 2 * ALPHA / 0.35093
    assert comparison.ratio_lo < expected < comparison.ratio_hi
    assert comparison.ratio == pytest.approx(expected, rel=0.15)


def test_the_paper_routine_has_no_table_and_no_draws(media, tmp_path):
    routine = rftfit.scale_by_paper(ALPHA)
    assert lift(routine) < 0.95 * 110
    for profile in (routine, rftfit.published_medium("poppy_LP", "fourier")):
        with pytest.raises(rftfit.RftfitError, match="allowed: a map or a table"):
            rftfit.write_profile(tmp_path / "out.json", profile)
    assert not (tmp_path / "out.json").exists()
    with pytest.raises(rftfit.RftfitError, match="scatter between media"):
        rftfit.compare_media(routine, media["scale"])


@pytest.mark.parametrize("wrong", [0.55, None, np.zeros(3)])
def test_what_is_no_medium_is_named_with_what_is_allowed(media, wrong):
    for door in (
        lambda: rftfit.predict(wrong, FOOT, DOWN),
        lambda: rftfit.Ground(wrong, [rftfit.Mesh.extrude(FOOT)]),
        lambda: rftfit.compare_media(wrong, media["scale"]),
    ):
        with pytest.raises(TypeError, match=r"for a medium; allowed: .*rftfit\.scale"):
            door()


def test_commands_compare_and_export_a_file(command, folder):
    file, campaign = folder / "sand.json", folder / "campaign"
    code, out, _ = command(f"compare {file} {campaign}:poppy_LP --json")
    assert code == 0
    assert json.loads(out)["ratio"] == pytest.approx(0.35093 / ALPHA, rel=0.15)
    assert command(f"export --profile-file {file} --title Dune --output again.json")[0] == 0
    assert lift(rftfit.read_profile("again.json")) == pytest.approx(110, rel=1e-3)


@pytest.mark.statistics
@pytest.mark.parametrize("medium", seeds(PAPER_MEDIA, PAPER_MEDIA[1:2]))
def test_one_push_has_one_answer(command, medium):
    alpha = round(float(rftfit.published_medium(medium).alpha(0.0, np.pi / 2)[0]), 5)
    sand = rftfit.scale(alpha)
    rftfit.write_profile("sand.json", sand)
    same: dict[str, Any] = {
        "estimate_map": rftfit.estimate_map(one_push(alpha)),
        "file": rftfit.read_profile("sand.json"),
        "path": "sand.json",
    }
    for leg in seeds(LEGS, LEGS[2:]):
        outline = rftfit.model_leg(leg)
        peaks = {peak.name: peak for peak in rftfit.find_peaks(sand, outline)}
        for other in same.values():
            for peak in rftfit.find_peaks(other, outline):
                expected = peaks[peak.name]
                tolerance = 1e-3 * max(abs(expected.value), 0.01)
                assert peak.value == pytest.approx(expected.value, abs=tolerance)
                assert peak.withheld == expected.withheld
        for words in (f"--alpha {alpha}", "--profile-file sand.json"):
            code, out, _ = command(f"predict --leg {leg} {words} --json --force")
            assert code == 0
            printed = json.loads(out)["peaks"]["lift"]
            for name in ("lo", "hi", "model_lo", "model_hi", "next_lo", "next_hi"):
                number = getattr(peaks["lift"], name)
                end = None if np.isnan(number) else pytest.approx(number, rel=1e-3, abs=1e-3)
                assert printed[name] == end
            assert printed["force_z_N"] == pytest.approx(peaks["lift"].value, rel=1e-3)


def test_nine_terms_print_no_interval_with_the_error_of_the_model(command, folder):
    campaign = folder / "campaign"
    for words in (
        "--medium poppy_LP --profile fourier",
        "--medium poppy_LP --profile generic",
        f"--medium poppy_LP --profile fourier --results {campaign}",
        f"--medium poppy_LP --profile generic --results {campaign}",
        "--alpha 0.35093 --profile generic",
    ):
        code, out, _ = command(f"predict --leg reversed_c_leg {words} --json --force")
        assert code == 0
        facts = json.loads(out)
        assert facts["model_error_known"] is False
        peak = facts["peaks"]["lift"]
        assert peak["force_z_N"] > 3.5
        # the table of the same medium, or the map of the same push
        assert peak["beside"] == pytest.approx(1.42, abs=0.02)
        assert [peak[name] for name in ("model_lo", "model_hi", "next_lo", "next_hi")] == [None] * 4
        # an interval that is left holds the force by the table or the map
        if peak["lo"] is not None:
            assert peak["lo"] <= peak["beside"] <= peak["hi"]
        rows = pd.read_csv("forces.csv", comment="#")
        assert not [name for name in rows if "_model_" in str(name) or "_next_" in str(name)]
        if "force_z_lo_N" in rows:
            is_shown = rows["force_z_lo_N"].notna()
            holds = rows["force_z_beside_N"].between(rows["force_z_lo_N"], rows["force_z_hi_N"])
            assert holds[is_shown].all()
    code, _, err = command(
        "predict --leg c_leg --medium poppy_LP --profile fourier --model-error 0.3"
    )
    assert (code, "--model-error" in err) == (2, True)


def test_a_steep_peak_of_few_pushes_has_no_interval_of_alpha():
    few = rftfit.find_peaks(rftfit.scale(0.35), rftfit.model_leg("reversed_c_leg"))[0]
    assert isinstance(few, rftfit.Peak)
    assert (few.name, few.withheld) == ("lift", "steep")
    assert few.steepness > 0.15
    assert np.isnan([few.lo, few.hi]).all()
    assert few.model_lo <= few.value <= few.model_hi
    rows = rftfit.published_table("table_s5").query("medium == 'poppy_LP'")
    all_directions = rftfit.find_peaks(
        rftfit.estimate_map(rows), rftfit.model_leg("reversed_c_leg")
    )[0]
    assert (all_directions.withheld, np.isfinite(all_directions.lo)) == ("", True)


@pytest.mark.parametrize("tilt_deg", [0.0, 30.0, -40.0])
def test_steepness_is_what_five_degrees_of_tilt_make_of_the_force(media, tilt_deg):
    """Of a flat foot straight down: half the difference of alpha_z on either side, relative to alpha_z."""
    profile = media["map"].profile
    half_x, half_z = 4 * np.cos(np.radians(tilt_deg)), 4 * np.sin(np.radians(tilt_deg))
    foot = rftfit.polyline([(-half_x, half_z), (half_x, -half_z)], 5.0)
    lift = next(peak for peak in rftfit.find_peaks(profile, foot, DOWN) if peak.name == "lift")
    less, alpha_z, more = profile.alpha(np.radians(tilt_deg + np.array([-5, 0, 5])), np.pi / 2)[0]
    assert lift.steepness == pytest.approx(abs(more - less) / 2 / alpha_z, rel=1e-6)
