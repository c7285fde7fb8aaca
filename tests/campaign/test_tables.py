"""A table of stress or alpha is read in its own layout and units, and each bad cell is named.

Such a table stands in for the logs of a campaign.
"""

import math
import re
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rftfit import reference
from rftfit.campaign.config import Config, TableSettings
from rftfit.campaign.formats import STRESS
from rftfit.campaign.load import check_campaign
from rftfit.campaign.problems import CampaignError
from rftfit.campaign.rows import read_table_columns
from rftfit.campaign.tables import pushes_in, read_pushes, rows_against_gamma

HEAD = "beta_deg,gamma_deg,alpha_z_N_per_cm3,alpha_x_N_per_cm3"
"""Header of a table of alpha."""
STRESS_HEAD = "beta_deg,gamma_deg,depth_cm,stress_z_N_per_cm2,stress_x_N_per_cm2"
"""Header of a table of stress."""


def read(path, table=None, *media):
    pushes, problems, *_ = read_pushes(
        path, path.name, table or TableSettings(holds="alpha"), media or ("sand",), path.name
    )
    return pushes, problems


def places(problems):
    """Code without the kind of table, row and column of each problem."""
    return [
        (problem.code.partition(".")[2], problem.place.row, problem.place.column)
        for problem in problems
    ]


def written(path, *lines):
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def test_names_and_units_of_a_file(tmp_path):
    path = written(tmp_path / "a.csv", "b,g,kz,kx", f"{math.pi / 6},{-math.pi / 4},200000,-1e5")
    table = TableSettings(
        holds="alpha",
        columns={
            "beta_deg": "b",
            "gamma_deg": "g",
            "alpha_z_N_per_cm3": "kz",
            "alpha_x_N_per_cm3": "kx",
        },
        angle_unit="rad",
        alpha_unit="N/m^3",
    )
    (push,), problems = read(path, table)
    assert not problems
    assert push.run.beta_deg == pytest.approx(30)
    assert push.run.gamma_deg == pytest.approx(-45)
    assert push.run.direction == "extraction"
    assert push.columns["alpha_z_N_per_cm3"][0] == pytest.approx(0.2)
    assert push.columns["alpha_x_N_per_cm3"][0] == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("N/cm^3", 1), ("N cm⁻³", 1), ("MPa/m", 1), ("kPa/m", 1e-3), ("kN/m³", 1e-3)],
)
def test_a_unit_in_the_head_of_a_block(tmp_path, unit, factor):
    rows = [
        line
        for c in "zx"
        for line in (f"alpha_{c} ({unit})", "beta,45,90", "0,0.2,0.3", "30,0.1,0.2")
    ]
    path = written(tmp_path / "b.csv", *rows)
    pushes, problems = read(path)
    assert not problems
    assert pushes[0].columns["alpha_z_N_per_cm3"][0] == pytest.approx(0.2 * factor, rel=1e-12)
    problems = read(path, TableSettings(holds="alpha", alpha_unit="N/m^3"))[1]
    assert places(problems) == [("other-unit", row, None) for row in (1, 5)]


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_a_table_reads_what_a_log_reads(tmp_path, encoding):
    """Encodings, units in headers and cells, decimal commas, and numbers as other programs spell them."""
    lines = [
        "beta (°);gamma (deg);Sinkage (mm);qc_MPa;stress_x (kPa)",
        "(30);90;10;0,002;-0,5",
        "-30;90;20,0 mm;0,004;0,5-",
        '="-30";90;3 cm;6,0D-03;1.200,5',
    ]
    path = tmp_path / "s.csv"
    path.write_bytes("\n".join(lines).encode(encoding))
    (push,), problems = read(path, TableSettings(holds="stress"))
    assert not problems
    assert push.run.beta_deg == -30
    assert_allclose(push.columns["depth_cm"], [1, 2, 3])
    assert_allclose(push.columns["stress_z_N_per_cm2"], [0.2, 0.4, 0.6])
    assert_allclose(push.columns["stress_x_N_per_cm2"], [-0.05, -0.05, 120.05])


def test_a_header_of_which_no_name_is_known_is_cut(tmp_path):
    path = written(tmp_path / "s.csv", "Neigung;Richtung;Tiefe;Druck", "0;90;1;0.3")
    problems = read(path, TableSettings(holds="stress"))[1]
    unread = [column for code, _, column in places(problems) if code == "unknown-column"]
    assert unread == ["Neigung", "Richtung", "Tiefe", "Druck"]


def test_everything_that_is_wrong_is_told(tmp_path):
    path = written(
        tmp_path / "a.csv",
        f"{HEAD},medium,n",
        "100,90,0.3,0,sand,1",
        "0,90,x,0,sand,1",
        "0,45,0.3,0,clay,1",
        "0,30,0.3,,sand,1.5",
    )
    assert places(read(path)[1]) == [
        ("out-of-range", 2, "beta_deg"),
        ("not-a-number", 3, "alpha_z_N_per_cm3"),
        ("unknown-medium", 4, "medium"),
        ("not-whole", 5, "n"),
    ]


@pytest.mark.parametrize("holds", ["alpha", "stress"])
def test_labels_that_pushes_share_are_read(tmp_path, holds):
    """As in the run sheet: an error of a session can be told of a table too."""
    numbers = "0.35,0" if holds == "alpha" else "1,0.35,0"
    names = HEAD if holds == "alpha" else STRESS_HEAD
    path = written(
        tmp_path / "a.csv",
        f"{names},session,plate",
        f"0,90,{numbers},wet day,p1",
        f"30,90,{numbers},,p2",
    )
    pushes, problems = read(path, TableSettings(holds=holds))
    assert not problems
    assert {(push.run.session, push.run.plate) for push in pushes} == {
        ("wet day", "p1"),
        ("", "p2"),
    }
    assert {push.run.rod for push in pushes} == {""}


def test_nothing_in_a_block_is_lost_in_silence(tmp_path):
    path = written(
        tmp_path / "b.csv",
        "alpha_z (N/cm^3)",
        "beta,45,90,95",
        "0,0.2,0.3,0.1",
        "30,0.1,x,",
        "alpha_x (N/cm^3)",
        "beta,45,90,95",
        "0,0.1,0,0",
        "30,,0.2,",
    )
    pushes, problems = read(path)
    assert places(problems) == [
        ("out-of-range", 3, "gamma_deg"),
        ("not-a-number", 4, "alpha_z_N_per_cm3"),
        ("one-component", 4, "alpha_x_N_per_cm3"),
    ]
    assert [problem.found for problem in problems] == ["95", "x", None]
    assert "beta 30, gamma 45," in problems[2].allowed
    assert {push.run.run_id for push in pushes} == {"b0_g45", "b0_g90"}


def test_a_block_given_twice_and_cut_short(tmp_path):
    rows = ["alpha_z,45,90", "0,0.2,0.3", "alpha_x,45,90", "0,0.1,0", "alpha_z,45,90", "0,0.2"]
    problems = read(written(tmp_path / "b.csv", *rows))[1]
    assert [(problem.code, problem.place.column, problem.found) for problem in problems] == [
        ("alpha-table.twice", "alpha_z_N_per_cm3", cell) for cell in ("0.2", "")
    ]
    assert all("row 2 " in problem.allowed and problem.place.row == 6 for problem in problems)


def test_stress_is_not_divided_by_a_plate_of_the_config(tmp_path):
    """Intruders are welcome, to predict forces on them; the table's stress is stress already."""
    values = {
        "title": "t",
        "raw": "raw",
        "run_sheet": "raw/s.csv",
        "table": {"holds": "stress"},
        "media": {"sand": {"title": "sand"}},
        "intruders": {
            "plate": {"shape": "flat", "area_cm2": 9.0, "length_cm": 3.0, "thickness_cm": 1.0}
        },
    }
    config = Config.model_validate(values)
    path = written(tmp_path / "s.csv", STRESS_HEAD, "0,90,1,0.3,0")
    assert config.table is not None
    (push,), _ = read(path, config.table)
    area = config.intruders[push.run.intruder]
    assert area.shape == "flat"
    assert area.area_cm2 == 1
    assert config.intruders["plate"].shape == "flat"


def test_blocks_of_table_s5(tmp_path):
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
    found_media = read_pushes(path, path.name, TableSettings(holds="alpha"), (), path.name).media
    assert list(found_media) == list(reference.MEDIA[:2])
    pushes, problems = read(path, None, *reference.MEDIA[:2])
    assert not problems
    assert len(pushes) == 182
    for medium in reference.MEDIA[:2]:
        pushes_of_medium = [push for push in pushes if push.run.medium == medium]
        columns_by_direction = {
            (p.run.beta_deg, round(p.run.gamma_deg, 3)): p.columns for p in pushes_of_medium
        }
        for c, alpha in zip("zx", reference.alpha_grid(medium), strict=True):
            alpha_read = [
                columns_by_direction[beta, round(gamma, 3)][f"alpha_{c}_N_per_cm3"][0]
                for beta in reference.BETA_DEG
                for gamma in reference.GAMMA_DEG
            ]
            assert_array_equal(alpha_read, alpha.ravel())


def check_alpha_table(folder, media, *lines):
    """Write a campaign that is a table of alpha, and check it."""
    (folder / "config").mkdir()
    (folder / "raw").mkdir()
    written(folder / "raw" / "t.csv", *lines)
    settings = ("title: a", "raw: raw", "run_sheet: raw/t.csv", "table: {holds: alpha}", media)
    return check_campaign(written(folder / "config" / "config.yaml", *settings))


def test_a_config_with_an_error_is_no_reason_to_read_the_table_as_a_run_sheet(tmp_path):
    campaign, problems = check_alpha_table(
        tmp_path, "media: {sand: {title: sand, colour: red}}", HEAD, "0,90,0.35,0"
    )
    assert campaign is None
    assert len(problems) == 1
    assert problems[0].place.key == "media.sand.colour"


def test_labels_that_differ_in_capitals_or_spaces_are_pointed_out_once(tmp_path):
    labels = ("wet day", "dry", "Wet-day", "dry", "Wet-day", "")
    rows = [f"{10 * place},90,0.35,0,{label}" for place, label in enumerate(labels)]
    media = "media: {sand: {title: sand}}"
    _, problems = check_alpha_table(tmp_path, media, f"{HEAD},session", *rows)
    label_problems = [problem for problem in problems if problem.code == "sheet.label-alike"]
    assert [
        (problem.place.row, problem.place.column, problem.found) for problem in label_problems
    ] == [(4, "session", "Wet-day")]
    assert re.search("'wet day' .* row 2", label_problems[0].allowed)
    assert label_problems[0].severity == "warning"


DEPTH = "depth_cm"
DOWN = [f"0,90,{d},{0.3 * d},0" for d in (1, 2, 3, 4)]
UP = [f"0,-90,{d},{-0.1 * d},0" for d in (4, 3, 2, 1)]


def add_cells(rows, *cells):
    return [",".join([row, *cells]) for row in rows]


@pytest.mark.parametrize(
    ("head", "rows", "expected", "value"),
    [
        ("", DOWN * 3, [("starts-again", 6, DEPTH)], "run_id in table.columns"),
        ("", UP * 2, [("starts-again", 6, DEPTH)], "run b0_gm90;"),
        ("", DOWN + UP + DOWN, [("starts-again", 10, DEPTH)], "run b0_g90;"),
        # sorted by depth, as a spreadsheet does
        ("", [row.replace(",90,", ",-90,") for row in DOWN * 2], [("starts-again", 6, DEPTH)], ""),
        ("", [row for row in DOWN for _ in range(3)], [("depths-repeated", 2, DEPTH)], " 3 times;"),
        ("", DOWN[:1] * 3, [("depths-repeated", 2, DEPTH)], " 3 times;"),
        ("", [f"0,0,{d},0,{d}" for d in (2, 5, 7, 2, 5, 7)], [("starts-again", 5, DEPTH)], ""),
        ("", DOWN + DOWN[2::-1] + DOWN, [("starts-again", 9, DEPTH)], ""),
        (
            ",run",
            add_cells(DOWN, "1") + add_cells(DOWN, "2"),
            [("unknown-column", 1, "run"), ("starts-again", 6, DEPTH)],
            "did you mean 'run_id'?",
        ),
        (",run_id", add_cells(DOWN * 2, "a"), [("starts-again", 6, DEPTH)], "run a;"),
        (",colour", add_cells(DOWN, "red"), [("unknown-column", 1, "colour")], ""),
        (",excluded", add_cells(DOWN, "yes"), [("excluded-without-reason", 2, "reason")], ""),
        (
            ",excluded,reason",
            add_cells(DOWN[:2], "yes", "dust") + add_cells(DOWN[2:], "", ""),
            [("two-in-one", 4, "excluded")],
            "row 2:",
        ),
        (
            ",exclude",
            add_cells(DOWN, "yes"),
            [("unknown-column", 1, "exclude")],
            "did you mean 'excluded'?",
        ),
        ("", ["0,90,-1,0.1,0"], [("negative-depth", 2, DEPTH)], ""),
        (
            ",run_id",
            add_cells([*DOWN, "0,0,1,0.3,0"], "r"),
            [("two-in-one", 6, "gamma_deg"), ("starts-again", 6, DEPTH)],
            "run r ",
        ),
        ("", [*DOWN, "0,90,5,1,5,0"], [("no-header", 6, "number 6")], ""),
        (
            "",
            [row.replace("90", "1.57") for row in DOWN],
            [("looks-like-rad", None, "gamma_deg")],
            "angle_unit: rad",
        ),
        (
            "",
            [row.replace("90", "91") for row in DOWN],
            [("out-of-range", 2, "gamma_deg")],
            "the first of 4 rows",
        ),
        ("", [*DOWN, *DOWN[2::-1]], [("other-sense", 6, DEPTH)], "3 rows of the run b0_g90 "),
        ("", [*UP[::-1], *UP[1:]], [("other-sense", 2, DEPTH)], "4 rows of the run b0_gm90 "),
    ],
)
def test_what_a_table_of_stress_is_refused_or_warned_of(tmp_path, head, rows, expected, value):
    path = written(tmp_path / "s.csv", STRESS_HEAD + head, *rows)
    problems = read(path, TableSettings(holds="stress"))[1]
    assert places(problems) == expected
    assert value in str(problems[0])


def test_noise_of_depth_is_no_turn():
    random = np.random.default_rng(1)
    depths = np.concatenate([np.linspace(0, 8, 800), np.full(100, 8.0), np.linspace(8, 0, 800)])
    wrong, second_start = rows_against_gamma(depths + random.normal(0, 0.01, depths.size), 90)
    assert not second_start
    assert abs(np.flatnonzero(wrong)[0] - 850) < 60
    assert wrong[900:].all()


def test_angles_within_the_tolerance_of_90_are_90(tmp_path):
    def pushes(*rows, **units):
        path = written(tmp_path / "s.csv", STRESS_HEAD, *rows)
        return read(path, TableSettings(holds="stress", **units))

    rows = ["0,1.571,1,0.3,0", "-1.566,1.571,1,0.2,0", "0.7854,-1.571,1,-0.1,0"]
    stress_pushes, problems = pushes(*rows, angle_unit="rad")
    assert not problems
    directions = {(round(push.run.beta_deg, 2), push.run.gamma_deg) for push in stress_pushes}
    assert directions == {(0, 90), (-90, 90), (45.0, -90)}
    stress_pushes, problems = pushes("0,90.6,1,0.3,0", "0,90.01,1,0.3,0")
    assert places(problems) == [("out-of-range", 2, "gamma_deg")]
    assert [push.run.gamma_deg for push in stress_pushes] == [90]


def test_a_name_of_the_config_that_the_file_lacks(tmp_path):
    path = written(tmp_path / "s.csv", STRESS_HEAD, *DOWN)
    table = TableSettings(holds="stress", columns={"run_id": "push"})
    problems = read(path, table)[1]
    assert [(problem.code, problem.found) for problem in problems] == [
        ("stress-table.missing-column", "push")
    ]


def test_a_long_table_is_read_as_its_rows_are(tmp_path, monkeypatch):
    """Blocks of any size give the same columns and problems, whatever is in the cells."""
    rows = [
        f"{b},{g},{d},{0.1 * d},{-0.0},r{b}_{g}"
        for b in (0, 30)
        for g in (90, -45)
        for d in range(1, 40)
    ]
    rows[20], rows[50] = '0,90,"21","2.1",0," r0_90 "', "0,-45,x,1,0,r0_-45"
    rows[70:70] = ["", ",,,,,", "0,-45,33,1", "0,-45,inf,1,0,r0_-45", "0,-45,33,1_0,0,-bad"]
    path = written(tmp_path / "s.csv", f"{STRESS_HEAD},run_id", *rows)
    readings = []
    for head, block in ((10**6, 10**6), (40, 30), (40, 300), (200, 2000)):
        monkeypatch.setattr("rftfit.campaign.rows._FIRST_BLOCK", head)
        monkeypatch.setattr("rftfit.campaign.rows._BLOCK", block)
        read_rows, _, problems = read_table_columns(path, STRESS, "s.csv")
        names = {name: [*texts] for name, texts in read_rows.texts.items()}
        columns = {
            name: [names[name][index] for index in values] if name in names else values.tolist()
            for name, values in read_rows.columns.items()
        }
        readings.append((str(columns), [str(problem) for problem in problems]))
    assert all(reading == readings[0] for reading in readings)
    assert [line.split(":")[0] for line in readings[0][1]] == [
        "s.csv, row 52, column depth_cm",
        "s.csv, row 75, column depth_cm",
        "s.csv, row 76, column stress_z_N_per_cm2",
        "s.csv, row 76, column run_id",
    ]


def test_after_many_errors_the_rest_is_not_read_and_a_limit_names_its_cure(tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.campaign.rows._BLOCK", 1000)
    path = written(tmp_path / "s.csv", STRESS_HEAD, *[row.replace(",", ";") for row in DOWN * 2000])
    _, _, problems = read_table_columns(path, STRESS, "s.csv")
    assert problems[-1].code == "stress-table.many-problems"
    assert len(problems) < 2000
    monkeypatch.setattr("rftfit.campaign.rows.MAX_TEXT", 1000)
    _, _, (problem,) = read_table_columns(path, STRESS, "s.csv")
    assert problem.code == "stress-table.too-large"
    assert " 0.001 MB " in problem.allowed


def test_blocks_with_an_empty_corner(tmp_path):
    rows = [",45,90", "0,0.2,0.3", "30,0.1,0.2", "", ",45,90", "0,0.1,0", "30,0.15,0.05"]
    path = written(tmp_path / "b.csv", *rows)
    pushes, problems = read(path)
    assert not problems
    alpha_x_of_run = {push.run.run_id: push.columns["alpha_x_N_per_cm3"][0] for push in pushes}
    assert alpha_x_of_run == {"b0_g45": 0.1, "b0_g90": 0, "b30_g45": 0.15, "b30_g90": 0.05}
    assert pushes[0].columns["alpha_z_N_per_cm3"] == [0.2]
    # of one or of three nobody knows which they are
    assert read(written(tmp_path / "b.csv", *rows[:3]))[1]
    assert read(written(tmp_path / "b.csv", *rows, *rows[:3]))[1]


def test_pushes_for_a_map_leave_out_what_is_excluded(tmp_path):
    head = "beta,gamma,alpha_z,excluded,reason,weather"
    path = written(tmp_path / "p.csv", head, "0,90,0.3,,,dry", "0,45,0.9,yes,a stone,dry")
    pushes, (warning,) = pushes_in(path)
    assert pushes["alpha_z_N_per_cm3"].tolist() == [0.3]
    assert pushes["alpha_x_N_per_cm3"].isna().all()
    assert warning.code == "alpha-table.unknown-column"
    path = written(tmp_path / "p.csv", "beta,gamma,alpha_z,medium", "0,90,0.3,a", "0,45,0.9,b")
    with pytest.raises(CampaignError) as error:
        pushes_in(path)
    assert places(error.value.problems) == [("unknown-medium", 3, "medium")]


def test_a_push_for_a_map_may_lack_either_component(tmp_path):
    """A penetrometer measures alpha_z alone, a load cell behind a blade alpha_x."""
    rows = ["0,90,0.3,", "90,0,,0.2", "0,45,,"]
    path = written(tmp_path / "p.csv", "beta,gamma,alpha_z,alpha_x", *rows[:2])
    pushes, _ = pushes_in(path)
    alpha = pushes[["alpha_z_N_per_cm3", "alpha_x_N_per_cm3"]].to_numpy()
    np.testing.assert_array_equal(alpha, [[0.3, np.nan], [np.nan, 0.2]])
    drag_alone = written(tmp_path / "x.csv", "beta,gamma,alpha_x", "90,0,0.2")
    assert pushes_in(drag_alone)[0]["alpha_x_N_per_cm3"].tolist() == [0.2]
    for name, rows_of_file, place in (
        ("both.csv", ["beta,gamma,alpha_z,alpha_x", *rows], ("no-alpha", 4, "alpha_x_N_per_cm3")),
        ("none.csv", ["beta,gamma", "0,90"], ("missing-column", 1, "alpha_z_N_per_cm3")),
        ("z.csv", ["beta,gamma,alpha_z", "0,90,"], ("required", 2, "alpha_z_N_per_cm3")),
    ):
        with pytest.raises(CampaignError) as error:
            pushes_in(written(tmp_path / name, *rows_of_file))
        assert places(error.value.problems) == [place]


def test_a_header_without_its_unit_is_told_with_lines_to_paste(tmp_path):
    path = written(tmp_path / "table.csv", "beta,gamma,depth_mm,sigma,tau_kPa", "0,90,1,2,0")
    problems = read(path, TableSettings(holds="stress"))[1]
    (missing,) = (problem for problem in problems if problem.code.endswith("missing-column"))
    assert 'table: {columns: {stress_z_N_per_cm2: "sigma"}, stress_unit: ...}' in str(missing)
    table = TableSettings(
        holds="stress", columns={"stress_z_N_per_cm2": "sigma"}, stress_unit="kPa"
    )
    assert not [problem for problem in read(path, table)[1] if problem.severity == "error"]


@pytest.mark.parametrize(("beta", "equal_beta"), [("120", "-60"), ("-120", "60"), ("200", "20")])
def test_a_plate_beyond_ninety_is_told_which_one_it_is(beta, equal_beta, tmp_path):
    path = written(tmp_path / "table.csv", "beta,gamma,alpha_z,alpha_x", f"{beta},90,1,0")
    (problem,) = read(path)[1]
    assert places([problem]) == [("out-of-range", 2, "beta_deg")]
    assert problem.found == beta
    assert problem.allowed.endswith(f" at {equal_beta}")


def test_alpha_in_another_unit_is_doubted(tmp_path):
    rows = ("0,90,350000,0", "30,45,2e5,1")
    path = written(tmp_path / "table.csv", "beta,gamma,alpha_z,alpha_x", *rows)
    (problem,) = read(path)[1]
    assert problem.severity == "warning"
    assert "Set alpha_unit" in str(problem)
    assert not read(path, TableSettings(holds="alpha", alpha_unit="N/m^3"))[1]
