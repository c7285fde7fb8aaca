"""Campaigns that are a table of stress or of alpha: what is read, what is refused, where."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from rftfit import reference
from rftfit.campaign.config import Config, Table
from rftfit.campaign.load import check_campaign
from rftfit.campaign.tables import media_of_table, read_pushes

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.tables import Push

HEAD = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3"


def read(path: Path, table: Table | None = None, *media: str) -> tuple[list[Push], list[str]]:
    found, problems, _ = read_pushes(
        path, path.name, table or Table(holds="alpha"), media or ("sand",), path.name
    )
    return found, [str(problem) for problem in problems]


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_long_table_of_alpha(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", f"{HEAD},se_z,se_x,n,colour", "0,90,0.35,0,0.01,0.02,3,red")
    (push,), problems = read(path)
    assert not problems
    assert (push.run.beta_deg, push.run.gamma_deg, push.run.medium) == (0, 90, "sand")
    assert push.columns["se_x"][0] == 0.02
    assert push.columns["n"][0] == 3


def test_names_and_units_of_a_file(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "b,g,kz,kx", f"{math.pi / 6},{-math.pi / 4},200000,-1e5")
    table = Table(
        holds="alpha",
        columns={"beta_deg": "b", "gamma_deg": "g", "alpha_z_N_per_cm3": "kz", "alpha_x_N_per_cm3": "kx"},
        angle_unit="rad",
        alpha_unit="N/m^3",
    )  # fmt: skip
    (push,), problems = read(path, table)
    assert not problems
    assert push.run.beta_deg == pytest.approx(30)
    assert push.run.gamma_deg == pytest.approx(-45)
    assert push.run.direction == "extraction"
    assert push.columns["alpha_z_N_per_cm3"][0] == pytest.approx(0.2)
    assert push.columns["alpha_x_N_per_cm3"][0] == pytest.approx(-0.1)


def test_everything_that_is_wrong_is_told(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.csv", f"{HEAD},medium,n",
        "100,90,0.3,0,sand,1", "0,90,x,0,sand,1", "0,45,0.3,0,clay,1", "0,30,0.3,,sand,1.5",
    )  # fmt: skip
    _, problems = read(path)
    told = "\n".join(problems)
    assert "row 2, column beta_deg: found '100'; allowed: -90 to 90 deg" in told
    assert "row 3, column alpha_z_N_per_cm3: found 'x'" in told
    assert "row 4, column medium: found 'clay'; allowed: one of sand" in told
    assert "row 5, column alpha_x_N_per_cm3" in told
    assert "row 5, column n: found '1.5'; allowed: a whole number" in told


def test_stress_by_run_or_by_direction(tmp_path: Path) -> None:
    head = "beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2"
    rows = [f"0,{g},{d},{0.3 * d},0" for g in (90, 0) for d in (10, 20, 30)]
    table = Table(holds="stress", depth_unit="mm", stress_unit="kPa")
    pushes, problems = read(written(tmp_path / "s.csv", head, *rows), table)
    assert not problems
    assert [push.run.run_id for push in pushes] == ["b0_g0", "b0_g90"]
    assert pushes[1].columns["depth_cm"].tolist() == [1, 2, 3]
    assert pushes[1].columns["stress_z_N_per_cm2"][0] == pytest.approx(0.3)
    named = [f"{row},r{i // 3}" for i, row in enumerate(rows)]
    pushes, _ = read(written(tmp_path / "s.csv", f"{head},run_id", *named), table)
    assert [push.run.run_id for push in pushes] == ["r0", "r1"]
    mixed = [f"{row},r" for row in rows]
    _, problems = read(written(tmp_path / "s.csv", f"{head},run_id", *mixed), table)
    assert "all rows of the run r have one direction" in problems[0]
    _, problems = read(written(tmp_path / "s.csv", head, "0,90,-1,0.1,0"), table)
    assert "depth grows downward" in problems[0]


def test_nothing_in_a_block_is_lost_in_silence(tmp_path: Path) -> None:
    path = written(
        tmp_path / "b.csv", "alpha_z (N/cm^3)", "beta,45,90,95", "0,0.2,0.3,0.1", "30,0.1,x,",
        "alpha_x (N/cm^3)", "beta,45,90,95", "0,0.1,0,0", "30,,0.2,",
    )  # fmt: skip
    pushes, problems = read(path)
    told = "\n".join(problems)
    assert "row 3, column gamma_deg: found '95'; allowed: -90 to 90 deg" in told
    assert "row 4, column alpha_z_N_per_cm3: found 'x'" in told
    assert "column alpha_x_N_per_cm3: both components of b30_g45" in told
    assert {push.run.run_id for push in pushes} == {"b0_g45", "b0_g90"}


def test_a_block_given_twice_and_cut_short(tmp_path: Path) -> None:
    rows = ["alpha_z,45,90", "0,0.2,0.3", "alpha_x,45,90", "0,0.1,0", "alpha_z,45,90", "0,0.2"]
    _, problems = read(written(tmp_path / "b.csv", *rows))
    told = "\n".join(problems)
    assert (
        "column alpha_z_N_per_cm3: found '0.2'; allowed: each direction once; row 2 has it" in told
    )
    assert "column alpha_z_N_per_cm3: found ''; allowed: each direction once; row 2 has it" in told


def test_stress_is_not_divided_by_a_plate_of_the_config(tmp_path: Path) -> None:
    """Intruders are welcome, to predict forces on them; the table's stress is stress already."""
    values = {
        "title": "t", "raw": "raw", "run_sheet": "raw/s.csv", "table": {"holds": "stress"},
        "media": {"sand": {"title": "sand"}},
        "intruders": {"plate": {"shape": "flat", "area_cm2": 9.0, "length_cm": 3.0, "thickness_cm": 1.0}},
    }  # fmt: skip
    config = Config.model_validate(values)
    head = "beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2"
    path = written(tmp_path / "s.csv", head, "0,90,1,0.3,0")
    assert config.table is not None
    (push,), _ = read(path, config.table)
    area = config.intruders[push.run.intruder]
    assert area.shape == "flat"
    assert area.area_cm2 == 1
    assert config.intruders["plate"].shape == "flat"


def test_blocks_of_table_s5(tmp_path: Path) -> None:
    """The layout of the paper's workbook, a sheet a medium, from the printed numbers."""
    book: Any = import_module("openpyxl").Workbook()
    book.active.append(["Notes: alpha_z > 0 pushes up"])
    for medium in reference.MEDIA[:2]:
        sheet = book.create_sheet(f"{medium} ")
        for c, alpha in zip("zx", reference.alpha_grid(medium), strict=True):
            sheet.append([f"alpha_{c} (N/cm^3)"])
            sheet.append(["beta \\ gamma", *reference.GAMMA_DEG])
            for beta, row in zip(reference.BETA_DEG, alpha, strict=True):
                sheet.append([beta, *row])
            sheet.append([])
            sheet.append([f"half width of the interval of alpha_{c}"])
            sheet.append(["beta \\ gamma", *reference.GAMMA_DEG])
            sheet.append([0, *[0.001] * 13])
            sheet.append([])
    path = tmp_path / "s5.xlsx"
    book.save(path)
    assert [key for key, _ in media_of_table(path, "alpha")] == list(reference.MEDIA[:2])
    pushes, problems = read(path, None, *reference.MEDIA[:2])
    assert not problems
    assert len(pushes) == 182
    for medium in reference.MEDIA[:2]:
        own = [push for push in pushes if push.run.medium == medium]
        found = {(p.run.beta_deg, round(p.run.gamma_deg, 3)): p.columns for p in own}
        for c, alpha in zip("zx", reference.alpha_grid(medium), strict=True):
            wanted = [
                found[beta, round(gamma, 3)][f"alpha_{c}_N_per_cm3"][0]
                for beta in reference.BETA_DEG
                for gamma in reference.GAMMA_DEG
            ]
            np.testing.assert_array_equal(wanted, alpha.ravel())


def test_a_config_with_an_error_is_no_reason_to_read_the_table_as_a_run_sheet(
    tmp_path: Path,
) -> None:
    (tmp_path / "config").mkdir()
    (tmp_path / "raw").mkdir()
    written(tmp_path / "raw" / "t.csv", HEAD, "0,90,0.35,0")
    config = written(
        tmp_path / "config" / "config.yaml", "title: a", "raw: raw", "run_sheet: raw/t.csv",
        "table: {holds: alpha}", "media: {sand: {title: sand, colour: red}}",
    )  # fmt: skip
    campaign, problems = check_campaign(config)
    assert campaign is None
    assert len(problems) == 1
    assert "colour" in str(problems[0])
