"""A campaign of one sand, of plates in one medium or with a hole in its grid says what it lacks."""

import json
import re
import shutil
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import make_campaign
from matplotlib.text import Text
from result_tables import read_result

from rftfit.figures.generic import plot_generic_profile
from rftfit.figures.legs import plot_forces_over_zeta
from rftfit.figures.maps import plot_fit_maps
from rftfit.measure.alpha import column
from rftfit.measure.flags import remark
from rftfit.model.scaling import published
from rftfit.reference import LEGS
from rftfit.results import open_results
from rftfit.store import write_csv
from rftfit.workflow.profiles import fourier, scaling
from rftfit.workflow.validate import legs_predicted

CONFIG = "config/config.yaml"

pytestmark = pytest.mark.slow


def rftfit(folder, *words):
    process = folder.rftfit(*words)
    assert process.returncode == 0, process.stdout + process.stderr
    return process.stdout


def run_twice(folder):
    folder.run_here()
    digests_before = folder.digests()
    assert "Nothing to do" in rftfit(folder, "run")
    assert folder.digests() == digests_before


def page_of(folder):
    """Text of the page on one line, and the numbers of its live parts."""
    html = (folder.root / "results" / "report.html").read_text("utf-8")
    match = re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)
    assert match
    return " ".join(html.split()), json.loads(match[1])


def figures_of(folder):
    return sorted(path.stem for path in (folder.root / "results" / "figures").glob("*.png"))


@pytest.fixture(scope="module")
def sand(tmp_path_factory):
    """One penetration test and three legs in Yuma sand, nothing else."""
    folder = make_campaign(tmp_path_factory.mktemp("sand") / "campaign", ("yuma",))
    run_twice(folder)
    return folder


def test_a_sand_alone_is_scaled_with_the_published_media(sand):
    table = sand.table("penetration.csv")
    assert len(table) == 1
    row = table.iloc[0]
    assert row["method"] == "scaling routine (lsq, published media)"
    assert row["reason_code"] == "published-media"
    alpha = sand.table("alpha/yuma.csv").query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    value, se = alpha[column("z")], alpha[column("z", "_se")]
    assert value == pytest.approx(0.69, abs=0.01)
    # least squares at the angles of Table S5, small terms dropped
    assert row["chi"] == pytest.approx(
        np.mean([1.23537, 1.08716, 1.10806, 0.97435, 1.21970]), abs=1e-4
    )
    assert row["zeta"] == pytest.approx(value / row["chi"], rel=5e-6)
    test = ("--alpha", f"{value}", "--se", f"{se}", "--profile", "generic")
    scaled = json.loads(rftfit(sand, "scale", *test, "--output", "scaled.csv", "--json"))
    for name in ("zeta", "chi"):
        assert f"{row[name]:.6g}" == f"{scaled[name]['value']:.6g}"
        assert f"{row[f'{name}_lo']:.5g}" == f"{scaled[name]['lo']:.5g}"
        assert f"{row[f'{name}_hi']:.5g}" == f"{scaled[name]['hi']:.5g}"
    stated = sand.table("sands.csv").set_index("window").loc["stated"]
    assert stated["zeta"] == pytest.approx(row["zeta"], rel=1e-5)
    assert stated["reason_code"] == "published-media"


def test_its_legs_are_predicted_from_them(sand):
    predicted = sand.table("predicted.csv")
    assert set(predicted["leg"]) == set(LEGS)
    assert set(predicted["profile"]) == {"map", "generic"}
    generic = predicted["profile"] == "generic"
    assert set(predicted.loc[generic, "reason_code"]) == {"published-media"}
    predicted = predicted[generic]
    alpha = sand.table("penetration.csv")["alpha_z_measured_N_per_cm3"].iloc[0]
    options = ("--profile", "generic", "--leg", "c_leg", "--output", "forces.csv", "--force")
    rftfit(sand, "predict", "--alpha", f"{alpha}", *options)
    of_cli = pd.read_csv(sand.root / "forces.csv", comment="#")
    of_c_leg = predicted[predicted["leg"] == "c_leg"].sort_values("theta_deg")
    assert np.allclose(of_c_leg["force_z_N"], of_cli["force_z_N"], rtol=1e-4, atol=1e-6)
    errors = sand.table("leg_errors.csv")
    assert errors["peak_error_percent"].notna().all()
    assert set(errors.loc[errors["profile"] == "generic", "reason_code"]) == {"published-media"}
    # from the results it is the same profile, with the error of the test
    rftfit(sand, "predict", "--results", "results", "--medium", "yuma", *options)
    of_results = pd.read_csv(sand.root / "forces.csv", comment="#")
    assert np.allclose(of_results["force_z_N"], of_cli["force_z_N"], rtol=1e-6)
    # what the stage adds is the shape of the leg
    assert (
        of_results["force_z_hi_N"].to_numpy() <= of_c_leg["force_z_hi_N"].to_numpy() + 1e-6
    ).all()
    top = int(of_c_leg["force_z_N"].to_numpy().argmax())
    assert of_results["force_z_hi_N"][top] > 0.9 * of_c_leg["force_z_hi_N"].iloc[top]


def test_what_a_sand_alone_lacks_is_told_not_drawn(sand):
    for name in ("alpha_extended", "coefficients", "fourier/media"):
        table = sand.table(f"{name}.csv")
        assert table.empty
        assert "medium" in table.columns
    drawn = figures_of(sand)
    assert drawn == [
        "estimated_maps",
        "first_map",
        "first_peaks",
        "legs_in_sands",
        "peak_errors",
        "penetration",
        "stress_of_runs",
    ]
    html, live = page_of(sand)
    assert "(1.12)" in html
    assert "the nine-term Fourier" not in html
    zeta = sand.table("penetration.csv")["zeta"].iloc[0]
    generic = live["profiles"]["yuma"]["generic"]["values"]
    assert np.allclose(generic, zeta * published().m0)
    assert [reference["name"] for reference in live["references"]] == [published().name]


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    """Plates in loose poppy seeds: no sands, no legs, no robot."""
    root = tmp_path_factory.mktemp("plates") / "campaign"
    folder = make_campaign(root, ("poppy_LP",), plates_only=True)
    run_twice(folder)
    return folder


def test_plates_in_one_medium(plates):
    for name in (
        "predicted",
        "leg_errors",
        "contacts",
        "sands",
        "sand_correction",
        "legs/poppy_LP",
    ):
        empty = plates.table(f"{name}.csv")
        assert empty.empty
        assert "medium" in empty.columns
    drawn = figures_of(plates)
    assert "generic_profile" in drawn
    legs_or_sands = ("legs", "forces_over_zeta", "penetration", "peak", "robot")
    assert not any(name.startswith(legs_or_sands) for name in drawn)
    html, live = page_of(plates)
    assert 'id="legs"' not in html
    assert 'id="sands"' not in html
    assert "published five media" not in html
    assert set(live["profiles"]["poppy_LP"]) == {"table", "map", "fourier", "generic", "depth_only"}


def test_a_grid_with_a_hole_is_not_usable_by_the_transform(plates, sand, tmp_path):
    """Stages alone, on the tables of both: the sand is scaled with the published media again."""
    root = tmp_path / "campaign"
    # rows without their logs, which no stage of the model reads
    sheet = root / "raw" / "paper" / "runs.csv"
    sheet.parent.mkdir(parents=True)
    rows = [
        (folder.root / "raw" / "paper" / "runs.csv").read_text("utf-8").splitlines()
        for folder in (sand, plates)
    ]
    sheet.write_text("\n".join(dict.fromkeys(rows[0] + rows[1])) + "\n", "utf-8")
    values, values_of_plates = (
        yaml.safe_load((f.root / CONFIG).read_text()) for f in (sand, plates)
    )
    values["media"] |= values_of_plates["media"]
    values["fourier"]["method"] = "dft-index"
    (root / "config").mkdir()
    (root / CONFIG).write_text(yaml.safe_dump(values, sort_keys=False))
    results = root / "results"
    for folder, medium in ((plates, "poppy_LP"), (sand, "yuma")):
        for folder_name in ("alpha", "flags", "legs"):
            (results / folder_name).mkdir(parents=True, exist_ok=True)
            shutil.copy(
                folder.root / "results" / folder_name / f"{medium}.csv", results / folder_name
            )
    table: Any = read_result(results / "alpha" / "poppy_LP.csv")
    # not at 90 degrees, where the mirror image fills it
    hole = (table["beta_deg"] == -30) & (table["gamma_deg"] == 45)
    assert hole.sum() == 1
    table[table.filter(like="alpha_").columns] = table.filter(like="alpha_").mask(hole)
    write_csv(table, results / "alpha" / "poppy_LP.csv")
    write_csv(fourier(open_results(root)), results / "fourier" / "media.csv")
    for stage, names in (
        (scaling, ("coefficients.csv", "penetration.csv")),
        (
            legs_predicted,
            (
                "predicted.csv",
                "leg_errors.csv",
                "contacts.csv",
                "maps/poppy_LP.csv",
                "maps/yuma.csv",
            ),
        ),
    ):
        for name, stage_table in zip(names, stage(open_results(root)), strict=True):
            write_csv(stage_table, results / name)
    results_of_all = open_results(root)
    scaled: Any = results_of_all.table("penetration.csv").set_index(["medium", "method"])
    assert scaled.loc[("poppy_LP", "dft-index"), "reason_code"] == "empty-cells"
    row = scaled.loc[("yuma", "scaling routine (dft-index, published media)")]
    # by the other method the published media have another chi: Table S3
    assert row["chi"] == pytest.approx(1.242)
    assert row["zeta"] == pytest.approx(row["alpha_z_measured_N_per_cm3"] / 1.242, rel=1e-5)
    predicted = results_of_all.table("predicted.csv")
    # legs of the medium itself by its table; those of the sand from the published media
    of_poppy = predicted[predicted["medium"] == "poppy_LP"]
    # the table has a hole, which the map fills
    assert set(of_poppy["profile"]) == {"table", "map", "depth_only"}
    assert set(of_poppy["reason_code"]).isdisjoint({"published-media"})
    of_sand = predicted[predicted["medium"] == "yuma"]
    assert of_sand["force_z_N"].notna().all()
    generic = of_sand["profile"] == "generic"
    assert set(of_sand.loc[generic, "reason_code"]) == {"published-media"}
    # the figures of the fit say why there is none
    for draw in (plot_fit_maps, plot_generic_profile, plot_forces_over_zeta):
        words = " ".join(text.get_text() for text in draw(results_of_all).findobj(Text))
        assert str(remark("empty-cells", found=1, wanted=78)) in " ".join(words.split())
