"""A table of stress or alpha is read in its own layout and units, and each bad cell is named.

Such a table stands in for the logs of a campaign.
"""

import math
import re
from importlib import import_module
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers import json_of, refused, write_campaign
from numpy.testing import assert_allclose, assert_array_equal

import rftfit
from rftfit.campaign.load import check_campaign

ALPHA_Z, ALPHA_X, DEPTH, GAMMA = "alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "depth_cm", "gamma_deg"
HEAD = f"beta_deg,{GAMMA},{ALPHA_Z},{ALPHA_X}"
"""Header of a table of alpha."""
STRESS_HEAD = f"beta_deg,{GAMMA},{DEPTH},stress_z_N_per_cm2,stress_x_N_per_cm2"
"""Header of a table of stress."""
SAND = {"sand": {"title": "sand", "role": "natural_sand"}}


def read(folder, content, name="t.csv", *, media=SAND, intruders=None, **settings):
    """Write a campaign that is a table; its runs, those with errors left out, and its problems.

    `content`: Lines or bytes. `settings`: Of the table, beside those of a table of alpha.
    """
    config = {"title": "t", "raw": "raw", "run_sheet": f"raw/{name}", "media": media}
    config |= {"table": {"holds": "alpha"} | settings, "intruders": intruders or {}}
    log = content if isinstance(content, bytes) else "\n".join(content) + "\n"
    return check_campaign(write_campaign(folder, config, logs={name: log}), good_rows=True)


def read_stress(folder, *rows, head="", **settings):
    return read(folder, [STRESS_HEAD + head, *rows], holds="stress", **settings)


def places(problems):
    """Code without the kind of table, row and column of each problem."""
    return [
        (problem.code.partition(".")[2], problem.place.row, problem.place.column)
        for problem in problems
    ]


def alpha_of(campaign, column):
    """Alpha of each run, by its run_id."""
    return {run_id: columns[column].tolist() for run_id, columns in campaign.numbers.items()}


def test_names_and_units_of_a_file(tmp_path):
    lines = ["b,g,kz,kx", f"{math.pi / 6},{-math.pi / 4},200000,-1e5"]
    columns = {"beta_deg": "b", GAMMA: "g", ALPHA_Z: "kz", ALPHA_X: "kx"}
    units = {"angle_unit": "rad", "alpha_unit": "N/m^3"}
    campaign, problems = read(tmp_path, lines, columns=columns, **units)
    assert not problems
    (run,) = campaign.runs
    assert (run.beta_deg, run.gamma_deg) == (pytest.approx(30), pytest.approx(-45))
    assert run.direction == "extraction"
    assert alpha_of(campaign, ALPHA_Z) == {run.run_id: [pytest.approx(0.2)]}
    assert alpha_of(campaign, ALPHA_X) == {run.run_id: [pytest.approx(-0.1)]}


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
    campaign, problems = read(tmp_path, rows)
    assert not problems
    assert alpha_of(campaign, ALPHA_Z)["b0_g45"] == pytest.approx([0.2 * factor], rel=1e-12)
    problems = read(tmp_path, rows, alpha_unit="N/m^3")[1]
    assert places(problems) == [("other-unit", row, None) for row in (1, 5)]


def test_any_table_may_be_a_workbook_or_tab_separated(tmp_path):
    rows: list[list[Any]] = [
        ["beta_deg", GAMMA, "depth (mm)", "qc (kPa)"],
        [0, 90, 25, 10],
        [None] * 4,
    ]
    pd.DataFrame(rows).to_excel(tmp_path / "t.xlsx", header=False, index=False)
    text = "\n".join("\t".join(map(str, row)) for row in rows[:2])
    for name, content in (("t.xlsx", (tmp_path / "t.xlsx").read_bytes()), ("t.tsv", text.encode())):
        campaign, problems = read(tmp_path, content, name, holds="stress")
        assert not problems
        (columns,) = campaign.numbers.values()
        assert [*columns[DEPTH], *columns["stress_z_N_per_cm2"]] == [2.5, 1.0]


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_a_table_reads_what_a_log_reads(tmp_path, encoding):
    """Encodings, units in headers and cells, decimal commas, and numbers as other programs spell them."""
    lines = [
        "beta (°);gamma (deg);Sinkage (mm);qc_MPa;stress_x (kPa)",
        "(30);90;10;0,002;-0,5",
        "-30;90;20,0 mm;0,004;0,5-",
        '="-30";90;3 cm;6,0D-03;1.200,5',
    ]
    campaign, problems = read(tmp_path, "\n".join(lines).encode(encoding), holds="stress")
    assert not problems
    assert [run.beta_deg for run in campaign.runs] == [-30]
    (columns,) = campaign.numbers.values()
    assert_allclose(columns[DEPTH], [1, 2, 3])
    assert_allclose(columns["stress_z_N_per_cm2"], [0.2, 0.4, 0.6])
    assert_allclose(columns["stress_x_N_per_cm2"], [-0.05, -0.05, 120.05])


ANGLES = "beta,45,90"
ONE_LEFT_OUT = ["alpha_z (N/cm^3)", f"{ANGLES},95", "0,0.2,0.3,0.1", "30,0.1,x,"]
ONE_LEFT_OUT += ["alpha_x (N/cm^3)", f"{ANGLES},95", "0,0.1,0,0", "30,,0.2,"]
TWICE = ["alpha_z,45,90", "0,0.2,0.3", "alpha_x,45,90", "0,0.1,0", "alpha_z,45,90", "0,0.2"]


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (
            [
                f"{HEAD},medium,n",
                "100,90,0.3,0,sand,1",
                "0,90,x,0,sand,1",
                "0,45,0.3,0,clay,1",
                "0,30,0.3,,sand,1.5",
            ],
            [
                ("out-of-range", 2, "beta_deg", "100", " at -80"),
                ("not-a-number", 3, ALPHA_Z, "x", ""),
                ("unknown-medium", 4, "medium", "clay", "sand"),
                ("not-whole", 5, "n", "1.5", ""),
            ],
        ),
        (
            ONE_LEFT_OUT,
            [
                ("out-of-range", 3, GAMMA, "95", ""),
                ("not-a-number", 4, ALPHA_Z, "x", ""),
                ("one-component", 4, ALPHA_X, None, "beta 30, gamma 45,"),
            ],
        ),
        # a block given twice and cut short
        (TWICE, [("twice", 6, ALPHA_Z, cell, "row 2 ") for cell in ("0.2", "")]),
        # a plate beyond ninety is another one
        *(
            ([HEAD, f"{beta},90,1,0"], [("out-of-range", 2, "beta_deg", beta, f" at {equal}")])
            for beta, equal in (("120", "-60"), ("-120", "60"), ("200", "20"))
        ),
    ],
)
def test_what_is_wrong_in_a_table_of_alpha_is_told(tmp_path, lines, expected):
    campaign, problems = read(tmp_path, lines)
    found = [
        (*place, problem.found) for place, problem in zip(places(problems), problems, strict=True)
    ]
    assert found == [entry[:-1] for entry in expected]
    for problem, (*_, allowed) in zip(problems, expected, strict=True):
        assert allowed in problem.allowed
    if lines is ONE_LEFT_OUT:
        assert campaign.by_id.keys() == {"b0_g45", "b0_g90"}


@pytest.mark.parametrize(
    ("holds", "names", "numbers"), [("alpha", HEAD, "0.35,0"), ("stress", STRESS_HEAD, "1,0.35,0")]
)
def test_labels_that_pushes_share_are_read(tmp_path, holds, names, numbers):
    """As in the run sheet: an error of a session can be told of a table too."""
    rows = [f"0,90,{numbers},wet day,p1", f"30,90,{numbers},,p2"]
    campaign, problems = read(tmp_path, [f"{names},session,plate", *rows], holds=holds)
    assert not problems
    labels = {(run.session, run.plate, run.rod) for run in campaign.runs}
    assert labels == {("wet day", "p1", ""), ("", "p2", "")}


def test_stress_is_not_divided_by_a_plate_of_the_config(tmp_path):
    """Intruders are welcome, to predict forces on them; the table's stress is stress already."""
    plate = {"shape": "flat", "area_cm2": 9.0, "length_cm": 3.0, "thickness_cm": 1.0}
    campaign, _ = read_stress(tmp_path, "0,90,1,0.3,0", intruders={"plate": plate})
    intruders = campaign.config.intruders
    assert intruders[campaign.runs[0].intruder].area_cm2 == 1
    assert intruders["plate"].area_cm2 == 9


def test_blocks_of_table_s5(tmp_path):
    """The layout of the paper's workbook, a sheet a medium, from the printed numbers."""
    book: Any = import_module("openpyxl").Workbook()
    book.active.append(["Notes: alpha_z > 0 pushes up"])
    media = ["poppy_LP", "poppy_CP"]
    printed = rftfit.published_table("table_s5").query("medium in @media")
    for medium in media:
        sheet = book.create_sheet(f"{medium} ")
        for c in "zx":
            alpha = printed[printed["medium"] == medium].pivot_table(
                f"alpha_{c}_N_per_cm3", "beta_deg", GAMMA
            )
            sheet.append([f"alpha_{c} (N/cm^3)"])
            sheet.append(["beta \\ gamma", *alpha.columns])
            for row in alpha.itertuples():
                sheet.append([*row])
            sheet.append([])
            sheet.append([f"half width of the interval of alpha_{c}"])
            sheet.append(["beta \\ gamma", *alpha.columns])
            sheet.append([0, *[0.001] * 13])
            sheet.append([])
    (tmp_path / "raw").mkdir()
    book.save(tmp_path / "raw" / "s5.xlsx")
    content = (tmp_path / "raw" / "s5.xlsx").read_bytes()
    campaign, problems = read(
        tmp_path, content, "s5.xlsx", media={medium: {"title": "m"} for medium in media}
    )
    assert not problems
    angles = ["medium", "beta_deg", GAMMA]
    runs = [
        [run.medium, run.beta_deg, round(run.gamma_deg, 3)]
        + [campaign.numbers[run.run_id][name][0] for name in (ALPHA_Z, ALPHA_X)]
        for run in campaign.runs
    ]
    table = pd.DataFrame(runs, columns=[*angles, ALPHA_Z, ALPHA_X]).sort_values(angles)
    expected = printed.round({GAMMA: 3}).sort_values(angles)[[*table]]
    assert len(expected) == 182
    assert_array_equal(table, expected)


def test_a_config_with_an_error_is_no_reason_to_read_the_table_as_a_run_sheet(tmp_path):
    media = {"sand": SAND["sand"] | {"colour": "red"}}
    campaign, (problem,) = read(tmp_path, [HEAD, "0,90,0.35,0"], media=media)
    assert campaign is None
    assert problem.place.key == "media.sand.colour"


def test_labels_that_differ_in_capitals_or_spaces_are_pointed_out_once(tmp_path):
    labels = ("wet day", "dry", "Wet-day", "dry", "Wet-day", "")
    rows = [f"{10 * place},90,0.35,0,{label}" for place, label in enumerate(labels)]
    (problem,) = read(tmp_path, [f"{HEAD},session", *rows])[1]
    assert (problem.code, problem.severity) == ("sheet.label-alike", "warning")
    assert (problem.place.row, problem.place.column, problem.found) == (4, "session", "Wet-day")
    assert re.search("'wet day' .* row 2", problem.allowed)


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
            [("two-in-one", 6, GAMMA), ("starts-again", 6, DEPTH)],
            "run r ",
        ),
        ("", [*DOWN, "0,90,5,1,5,0"], [("no-header", 6, "number 6")], ""),
        (
            "",
            [row.replace("90", "1.57") for row in DOWN],
            [("looks-like-rad", None, GAMMA)],
            "angle_unit: rad",
        ),
        (
            "",
            [row.replace("90", "91") for row in DOWN],
            [("out-of-range", 2, GAMMA)],
            "the first of 4 rows",
        ),
        ("", [*DOWN, *DOWN[2::-1]], [("other-sense", 6, DEPTH)], "3 rows of the run b0_g90 "),
        ("", [*UP[::-1], *UP[1:]], [("other-sense", 2, DEPTH)], "4 rows of the run b0_gm90 "),
    ],
)
def test_what_a_table_of_stress_is_refused_or_warned_of(tmp_path, head, rows, expected, value):
    problems = read_stress(tmp_path, *rows, head=head)[1]
    assert places(problems) == expected
    assert value in str(problems[0])


def test_noise_of_depth_is_no_turn(tmp_path):
    random = np.random.default_rng(1)
    depths = np.concatenate([np.linspace(0, 8, 800), np.full(100, 8.0), np.linspace(8, 0, 800)])
    depths = np.abs(depths + random.normal(0, 0.01, depths.size))
    campaign, problems = read_stress(tmp_path, *[f"0,90,{depth},0.1,0" for depth in depths])
    assert "starts-again" not in {code for code, *_ in places(problems)}
    (columns,) = campaign.numbers.values()
    assert abs(np.flatnonzero(columns["other_sense"])[0] - 850) < 60
    assert columns["other_sense"][900:].all()


def test_angles_within_the_tolerance_of_90_are_90(tmp_path):
    rows = ["0,1.571,1,0.3,0", "-1.566,1.571,1,0.2,0", "0.7854,-1.571,1,-0.1,0"]
    campaign, problems = read_stress(tmp_path, *rows, angle_unit="rad")
    assert not problems
    directions = {(round(run.beta_deg, 2), run.gamma_deg) for run in campaign.runs}
    assert directions == {(0, 90), (-90, 90), (45.0, -90)}
    campaign, problems = read_stress(tmp_path, "0,90.6,1,0.3,0", "0,90.01,1,0.3,0")
    assert places(problems) == [("out-of-range", 2, GAMMA)]
    assert [run.gamma_deg for run in campaign.runs] == [90]


@pytest.mark.parametrize(
    ("head", "columns", "codes"),
    [
        (STRESS_HEAD, {"run_id": "push"}, [("missing-column", "push")]),
        # one problem, not one of each row
        (STRESS_HEAD.replace("depth_cm", "depth_ft"), {}, [("unknown-unit", "depth_ft")]),
        (f"{STRESS_HEAD},sinkage_mm", {}, [("duplicate-column", "sinkage_mm")]),
        # of which no name is known
        (
            "Neigung;Richtung;Tiefe;Druck",
            {},
            [("unknown-column", name) for name in ("Neigung", "Richtung", "Tiefe", "Druck")],
        ),
    ],
)
def test_names_of_the_config_and_of_the_file_are_compared(tmp_path, head, columns, codes):
    separator = ";" if ";" in head else ","
    lines = [head, *(row.replace(",", separator) for row in DOWN)]
    problems = read(tmp_path, lines, holds="stress", columns=columns)[1]
    told = [(code, column) for code, _, column in places(problems)]
    assert [entry for entry in told if entry in codes] == codes


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
    readings = []
    for head, block in ((10**6, 10**6), (40, 30), (40, 300), (200, 2000)):
        monkeypatch.setattr("rftfit.campaign.rows._FIRST_BLOCK", head)
        monkeypatch.setattr("rftfit.campaign.rows._BLOCK", block)
        campaign, problems = read_stress(tmp_path, *rows, head=",run_id")
        numbers = {
            run_id: {name: values.tolist() for name, values in columns.items()}
            for run_id, columns in campaign.numbers.items()
        }
        readings.append((str(campaign.runs), str(numbers), [str(problem) for problem in problems]))
    assert all(reading == readings[0] for reading in readings)
    assert [line.split(":")[0] for line in readings[0][-1]] == [
        "raw/t.csv, row 52, column depth_cm",
        "raw/t.csv, row 75, column depth_cm",
        "raw/t.csv, row 76, column stress_z_N_per_cm2",
        "raw/t.csv, row 76, column run_id",
    ]


def test_after_many_errors_the_rest_is_not_read_and_a_limit_names_its_cure(tmp_path, monkeypatch):
    monkeypatch.setattr("rftfit.campaign.rows._BLOCK", 1000)
    rows = [row.replace(",", ";") for row in DOWN * 2000]
    problems = read_stress(tmp_path, *rows)[1]
    assert "stress-table.many-problems" in {problem.code for problem in problems}
    assert len(problems) < 2000
    monkeypatch.setattr("rftfit.campaign.rows.MAX_TEXT", 1000)
    (problem,) = read_stress(tmp_path, *rows)[1]
    assert problem.code == "stress-table.too-large"
    assert " 0.001 MB " in problem.allowed


def test_blocks_with_an_empty_corner(tmp_path):
    rows = [",45,90", "0,0.2,0.3", "30,0.1,0.2", "", ",45,90", "0,0.1,0", "30,0.15,0.05"]
    campaign, problems = read(tmp_path, rows)
    assert not problems
    expected = {"b0_g45": [0.1], "b0_g90": [0], "b30_g45": [0.15], "b30_g90": [0.05]}
    assert alpha_of(campaign, ALPHA_X) == expected
    assert alpha_of(campaign, ALPHA_Z)["b0_g45"] == [0.2]
    # of one or of three nobody knows which they are
    assert read(tmp_path, rows[:3])[1]
    assert read(tmp_path, [*rows, *rows[:3]])[1]


def scaled(folder, *lines):
    """What `rftfit scale` makes of a table of pushes."""
    (folder / "p.csv").write_text("\n".join([*lines, ""]), "utf-8")
    return json_of("scale", "--pushes", "p.csv", "--force", folder=folder)


def test_pushes_for_a_map_leave_out_what_is_excluded(tmp_path):
    head = "beta,gamma,alpha_z,excluded,reason,weather"
    rows = ["0,90,0.3,,,dry", "0,45,0.9,yes,a stone,dry"]
    assert scaled(tmp_path, head, *rows)["pushes"] == 1


def test_a_push_for_a_map_may_lack_either_component(tmp_path):
    """A penetrometer measures alpha_z alone, a load cell behind a blade alpha_x."""
    pushes = pd.DataFrame([[0, 90, 0.3, np.nan], [90, 0, np.nan, 0.2]], columns=HEAD.split(","))
    zeta = scaled(tmp_path, "beta,gamma,alpha_z,alpha_x", "0,90,0.3,", "90,0,,0.2")["zeta"]
    assert [*zeta.values()] == pytest.approx([*rftfit.estimate_map(pushes).zeta], rel=1e-6)
    assert scaled(tmp_path, "beta,gamma,alpha_x", "90,0,0.2")["pushes"] == 1


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        (["beta,gamma,alpha_z,medium", "0,90,0.3,a", "0,45,0.9,b"], "row 3, column medium"),
        (["beta,gamma,alpha_z,alpha_x", "0,90,0.3,", "0,45,,"], f"row 3, column {ALPHA_X}"),
        (["beta,gamma", "0,90"], f"row 1, column {ALPHA_Z}"),
        (["beta,gamma,alpha_z", "0,90,"], f"row 2, column {ALPHA_Z}"),
        (
            ["beta,gamma,alpha_z,se_z", "0,90,0.3,-1"],
            "row 2, column se_z: found '-1'; allowed: a number of at least 0 N/cm^3",
        ),
    ],
)
def test_pushes_that_give_no_map_are_refused_by_their_place(tmp_path, lines, place):
    (tmp_path / "p.csv").write_text("\n".join([*lines, ""]), "utf-8")
    assert f"p.csv, {place}" in refused("scale", "--pushes", "p.csv", folder=tmp_path)


def test_a_header_without_its_unit_is_told_with_lines_to_paste(tmp_path):
    lines = ["beta,gamma,depth_mm,sigma,tau_kPa", "0,90,1,2,0"]
    problems = read(tmp_path, lines, holds="stress")[1]
    (missing,) = (problem for problem in problems if problem.code.endswith("missing-column"))
    assert 'table: {columns: {stress_z_N_per_cm2: "sigma"}, stress_unit: ...}' in str(missing)
    settings = {"columns": {"stress_z_N_per_cm2": "sigma"}, "stress_unit": "kPa"}
    problems = read(tmp_path, lines, holds="stress", **settings)[1]
    assert "error" not in {problem.severity for problem in problems}


def test_alpha_in_another_unit_is_doubted(tmp_path):
    rows = [HEAD, "0,90,350000,0", "30,45,2e5,1"]
    (problem,) = read(tmp_path, rows)[1]
    assert problem.severity == "warning"
    assert "Set alpha_unit" in str(problem)
    assert not read(tmp_path, rows, alpha_unit="N/m^3")[1]
