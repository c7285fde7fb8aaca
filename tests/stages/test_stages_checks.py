"""Mistakes of a real lab, made through real files: each is refused, named, or flagged on its cells."""

from __future__ import annotations

import csv
import io
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest
import yaml
from campaigns import FEW, Folder, make_campaign
from jobs import run_rules

from rftfit.measure.checks import _check_linearity
from rftfit.measure.fits import RunFit, _other_laws
from rftfit.measure.flags import flagged_with, flags_of
from rftfit.measure.laws import other_laws
from rftfit.results import open_results

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

MEDIUM = "poppy_CP"
STAGES = ("ingest", "tare", "slopes", "checks")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """Plates of one medium in 20 directions, without a mistake, measured."""
    folder = make_campaign(
        tmp_path_factory.mktemp("good") / "lab", (MEDIUM,), plates_only=True, directions=FEW
    )
    run_rules(folder.config, *STAGES)
    return folder


class Lab:
    """A copy of the good campaign to make mistakes in."""

    def __init__(self, root: Path, good: Folder) -> None:
        self.folder = Folder(root)
        shutil.copytree(good.root, root, ignore=shutil.ignore_patterns("results", ".snakemake"))
        self.raw = root / "raw" / "paper"
        self.sheet = list(csv.DictReader(io.StringIO((self.raw / "runs.csv").read_text())))

    def set(self, path: str, value: Any) -> None:
        values = yaml.safe_load(self.folder.config.read_text(encoding="utf-8"))
        *above, last = path.split("/")
        place = values
        for name in above:
            place = place[name]
        place[last] = value
        self.folder.config.write_text(yaml.safe_dump(values), encoding="utf-8")

    def write_sheet(self) -> None:
        out = io.StringIO()
        writer = csv.DictWriter(out, list(self.sheet[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.sheet)
        (self.raw / "runs.csv").write_text(out.getvalue())

    def change(self, how: Callable[[pd.DataFrame], None], **only: str) -> None:
        """Change the readings of logs, of some rows of the sheet."""
        for row in self.sheet:
            if any(row[name] != value for name, value in only.items()):
                continue
            path = self.raw / row["force_log"]
            head = "".join(f"{line}\n" for line in path.read_text().splitlines() if line[0] == "#")
            table = pd.read_csv(path, comment="#")
            how(table)
            path.write_text(head + table.to_csv(index=False, float_format="%.10g"))

    def measured(self) -> dict[str, dict[Any, Any]]:
        """Run the stages up to the checks: the checks that did not pass, by name."""
        run_rules(self.folder.config, *STAGES)
        table = open_results(self.folder.root).checks
        return {row["check"]: row for row in table.to_dict("records") if row["verdict"] != "passed"}

    @property
    def alpha(self) -> pd.DataFrame:
        return open_results(self.folder.root)[MEDIUM].alpha


@pytest.fixture
def lab(tmp_path: Path, good: Folder) -> Lab:
    return Lab(tmp_path / "lab", good)


CHANNELS = ["F1_N", "F2_N", "F3_N"]
STATED = {"x": "-F2", "y": "+F1", "z": "-F3"}


def test_a_campaign_without_a_mistake_fails_no_check(good: Folder) -> None:
    table = open_results(good.root).checks
    assert set(table["verdict"]) == {"passed", "not checked"}
    unchecked = table[table["verdict"] == "not checked"]
    # what no log can tell is said
    assert list(unchecked["check"]) == ["size"]
    assert unchecked["sentence"].iloc[0].startswith("The scale of the force was not checked")
    assert (open_results(good.root)[MEDIUM].alpha["checks"] == "").all()


@pytest.mark.parametrize(
    ("axes", "named"),
    [
        ({"z": "+F3"}, "Z looks reversed"),
        ({"x": "+F2", "y": "-F1"}, "X looks reversed"),
        ({"x": "-F3", "z": "-F2"}, "X and z look exchanged"),
        ({"x": "+F2", "z": "+F3"}, "Z and x both look reversed"),
    ],
)
def test_wrong_axes_are_named_with_what_mends_them(
    lab: Lab, axes: dict[str, str], named: str
) -> None:
    lab.set("transducer/axes", STATED | axes)
    found = lab.measured()
    work = found["work"]
    assert work["effect"] == "unusable"
    assert work["sentence"].startswith(f"{named}"), work["sentence"]
    assert "none of them with that put right" in work["sentence"]
    assert work["sentence"].endswith(": look at transducer.axes.")
    assert lab.alpha["checks"].str.startswith("unusable: fails work").all()


def test_x_and_y_exchanged_shows_in_the_channels(lab: Lab) -> None:
    lab.set("transducer/axes", STATED | {"x": "+F1", "y": "-F2"})
    found = lab.measured()["channels"]
    assert found["effect"] == "unusable"
    assert found["sentence"].startswith("X and y look exchanged: F2, across the motion, feels")


@pytest.mark.parametrize("channel", ["F2", "F3"])
@pytest.mark.parametrize("how", ["dead", "frozen"])
def test_a_channel_that_says_nothing(lab: Lab, channel: str, how: str) -> None:
    def deaden(log: pd.DataFrame) -> None:
        rows = slice(None) if how == "dead" else slice(len(log) // 2, None)
        log.loc[log.index[rows], f"{channel}_N"] = log[f"{channel}_N"].iloc[rows.start or 0]

    lab.change(deaden)
    found = lab.measured()["channels"]
    assert found["effect"] == "unusable"
    axis = {"F2": "x", "F3": "z"}[channel]
    what = "is constant" if how == "dead" else "stands still"
    assert found["sentence"].startswith(f"{channel}, along {axis}, {what} in ")


def test_plates_and_rods_exchanged(lab: Lab) -> None:
    rows = {row["run_id"]: row for row in lab.sheet}
    taken = set()
    for row in lab.sheet:
        other = rows.get(row["tare_run"])
        if other is None or other["run_id"] in taken:
            continue
        taken.add(other["run_id"])
        for name in ("force_log", "motion_log"):
            row[name], other[name] = other[name], row[name]
    lab.write_sheet()
    found = lab.measured()
    assert found["rods"]["effect"] == "unusable"
    assert found["rods"]["sentence"].startswith("Logs of plates and rods look exchanged")
    assert found["work"]["verdict"] == "not checked"


@pytest.mark.parametrize(("stated", "turned"), [(0.0, 4.0), (-4.0, 8.0)])
def test_a_mount_that_is_turned_otherwise(lab: Lab, stated: float, turned: float) -> None:
    lab.set("transducer/turn_deg", stated)
    found = lab.measured()["symmetry"]
    assert found["effect"] == "unusable"
    said = found["sentence"].split()
    assert said[:5] == ["The", "mount", "looks", "turned", "by"]
    assert said[6:9] == ["deg", "more", "than"]
    assert float(said[5]) == pytest.approx(turned, abs=1.0)


def test_the_scale_is_checked_only_where_it_is_stated(lab: Lab) -> None:
    def pounds(log: pd.DataFrame) -> None:
        log[CHANNELS] /= 4.448222

    lab.change(pounds)
    assert set(lab.measured()) == {"size"}
    lab.set(f"media/{MEDIUM}/expected_alpha", [0.4, 0.8])
    found = lab.measured()["size"]
    assert (found["verdict"], found["effect"]) == ("failed", "unusable")
    assert "alpha_z(0, 90) = 0.12" in found["sentence"]
    assert "unit" in found["sentence"]


def test_a_plate_in_inches(lab: Lab) -> None:
    lab.set("intruders/plate/length_cm", 1.5)
    lab.set("intruders/plate/width_cm", 1.0)
    lab.set(f"media/{MEDIUM}/expected_alpha", [0.4, 0.8])
    assert lab.measured()["size"]["verdict"] == "failed"


def test_channels_that_end_below_their_range(lab: Lab) -> None:
    def cut(log: pd.DataFrame) -> None:
        log[CHANNELS] = log[CHANNELS].clip(-4, 4)

    lab.change(cut, direction="horizontal", kind="plate")
    found = lab.measured()["channels"]
    assert " stops at " in found["sentence"]
    assert "look at the range of amplifier and logger" in found["sentence"]
    alpha = lab.alpha
    # every cell with such a log is flagged, and no other is
    cut_runs = {
        row["run_id"] for row in lab.sheet
        if (row["direction"], row["kind"]) == ("horizontal", "plate")
        and (pd.read_csv(lab.raw / row["force_log"], comment="#")[CHANNELS].abs() == 4).any(axis=None)
    }  # fmt: skip
    hit = np.array([bool(cut_runs & set(runs.split())) for runs in alpha["run_ids"]])
    assert hit.any()
    assert list(flagged_with(alpha, "channel-clipped")) == list(hit)


@pytest.mark.parametrize("off", [3.0, -3.0])
def test_a_surface_that_is_off(lab: Lab, off: float) -> None:
    lab.set("arm/surface_z_mm", 150.0 + off)
    found = lab.measured()["surface"]
    assert found["effect"] == "doubtful"
    assert f"stress begins {off:+.0f}" in found["found"].replace(".0", "").replace(".1", "")
    assert found["sentence"].startswith("The surface is wrong")
    assert lab.alpha["checks"].str.startswith("doubtful: fails surface").all()


def test_force_that_is_late(lab: Lab) -> None:
    def late(log: pd.DataFrame) -> None:
        log[CHANNELS] = log[CHANNELS].shift(30).bfill()

    lab.change(late)
    found = lab.measured()["surface"]
    assert "late against the motion log by about 0.3 s" in found["sentence"]


def test_stress_that_is_no_line() -> None:
    """Curvature moves the found surface too; where the strokes tell the two apart, it is named."""
    noise = np.random.default_rng(1)
    depth = np.linspace(2, 8, 600)
    for power, verdict in ((1.2, "failed"), (1.0, "passed")):
        pushes = []
        for _ in range(5):
            stress = (depth - (0.3 if power == 1 else 0)) ** power + noise.normal(0, 0.05, 600)
            fit = RunFit(0, 90, laws=other_laws(depth, stress[None], 5), line=np.ones(1))
            _, exponent, _, misfit = _other_laws(fit)
            pushes.append((exponent[0], misfit[0]))
        table = pd.DataFrame(pushes, columns=["exponent_z", "power_misfit_z_ratio"])
        assert _check_linearity(table).verdict == verdict


def test_copies_of_a_log_are_no_repeats(lab: Lab) -> None:
    first = next(row for row in lab.sheet if row["run_id"].endswith("bp00_g90_in"))
    for number in range(6):
        copy = first | {"run_id": f"copy{number}"}
        for name in ("force_log", "motion_log"):
            copy[name] = f"copy{number}_{name}.csv"
            shutil.copy(lab.raw / first[name], lab.raw / copy[name])
        lab.sheet.append(copy)
    for row in lab.sheet:
        if row["tare_run"] == first["tare_run"]:
            row["tare_shared"] = "yes"
    lab.write_sheet()
    found = lab.measured()["same_logs"]
    assert found["effect"] == "unusable"
    assert found["sentence"].startswith("Copies of a log are no repeats (7 runs")
    cell = lab.alpha.query("beta_deg == 0 and gamma_deg == 90").iloc[0]
    assert cell["n_runs"] == 1
    assert [one.code for one in flags_of({**cell})] == ["same-readings"]


def test_an_accepted_medium_is_used_and_says_why(lab: Lab) -> None:
    lab.set("transducer/turn_deg", 0.0)
    lab.set(f"media/{MEDIUM}/accept", {"symmetry": "the mount was re-seated; see the notebook"})
    found = lab.measured()["symmetry"]
    assert (found["verdict"], found["effect"]) == ("accepted", "")
    mark = "accepted: fails symmetry: the mount was re-seated; see the notebook"
    assert (lab.alpha["checks"] == mark).all()


def test_diagnose_reads_the_logs_and_writes_nothing(lab: Lab) -> None:
    assert "No check fails." in lab.folder.rftfit("check", "--diagnose").stdout
    lab.set("transducer/axes", STATED | {"z": "+F3"})
    done = lab.folder.rftfit("check", "--diagnose")
    assert done.returncode == 0
    assert f"{MEDIUM}, unusable: Z looks reversed (" in done.stdout
    assert "none of them with that put right" in done.stdout
    assert not (lab.folder.root / "results").exists()
    assert lab.folder.rftfit("check", "--diagnose", "--strict").returncode == 2
