"""Hostile or broken input does no harm: it is refused with a message or shown as plain text."""

import csv
import io
import os
import re
import time
import unicodedata
import zipfile
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import result_tables as chain
import yaml
from campaigns import FEW, Room, make_campaign, run_rules
from makers import answer_of, read_rows, write_rows, write_yaml
from result_tables import Memory, memory, read_result, run
from waiting import run_commands

from rftfit.campaign import rows
from rftfit.campaign.load import check_campaign
from rftfit.campaign.problems import Place
from rftfit.figures.registry import figures

needs_links = pytest.mark.skipif(os.name != "posix", reason="links and pipes of a POSIX system")


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path / "room")


# --- files that are none ----------------------------------------------------------------------------


READING = (
    "check --config FILE",
    "inspect FILE",
    "predict --outline FILE --width 5 --path FILE --alpha 0.9",
    "verify --config FILE",
    "run --dry-run --config FILE",
)
"""Commands that read a file that somebody names."""


@needs_links
def test_pipes_and_devices_are_never_read(tmp_path):
    """A read would wait, or go on, for ever: then the child would be ended, which is an error."""
    os.mkfifo(tmp_path / "pipe")
    files = (tmp_path / "pipe", Path("/dev/zero"))
    commands = [words.replace("FILE", str(file)).split() for file in files for words in READING]
    for words, answer in zip(
        commands, run_commands(commands, tmp_path, tmp_path / "bin"), strict=True
    ):
        assert answer.returncode == 2, words
        assert re.search("device|a file", answer.stdout + answer.stderr), words


@needs_links
@pytest.mark.parametrize("target", ["", "/dev/zero", "pipe"])
@pytest.mark.parametrize("place", ["runs.csv", "raw/logs/p1_force.csv"])
def test_pipes_and_devices_of_a_campaign(room, tmp_path, target, place):
    room.write()
    file = room.folder / place
    file.unlink()
    if target:
        os.mkfifo(tmp_path / "pipe")
        file.symlink_to(tmp_path / target)
    else:
        os.mkfifo(file)
    codes = {
        "runs.csv": "config.path-outside" if target else "sheet.not-a-file",
        "raw/logs/p1_force.csv": "sheet.path-outside" if target else "sheet.log-not-a-file",
    }
    assert [problem.code for problem in check_campaign(room.path)[1]] == [codes[place]]


@needs_links
@pytest.mark.parametrize(
    ("raw", "sheet", "link"),
    [
        ("results/raw", "runs.csv", ""),
        ("results", "runs.csv", ""),
        ("raw", "results/runs.csv", ""),
        ("raw", "runs.csv", "raw"),
        ("raw", "runs.csv", "raw/inside"),
        ("results/logs", "runs.csv", "raw"),
    ],
)
def test_results_and_raw_are_apart(room, raw, sheet, link):
    """Else the program would write among the logs, or deleting the results would delete logs."""
    (room.folder / "raw" / "inside").mkdir()
    if link:
        (room.folder / "results").symlink_to(room.folder / link)
    (room.folder / raw).mkdir(parents=True, exist_ok=True)
    (room.folder / sheet).parent.mkdir(exist_ok=True)
    room.config = room.config.replace("raw: raw", f"raw: {raw}")
    assert "config.in-results" in {problem.code for problem in room.check(name=sheet)}


@pytest.mark.parametrize("path", ["../../secret.csv", "/etc/hostname", "absent.csv", "CON.csv"])
def test_logs_named_in_the_config_stay_in_raw_too(room, path):
    room.config += f"rigid_contact: {{force_log: '{path}', motion_log: logs/t1_motion.csv}}\n"
    problem = room.only("config.rigid-contact")
    assert (problem.place.key, problem.found) == ("rigid_contact.force_log", path)


# --- bombs ------------------------------------------------------------------------------------------

NS = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
CELL = f'<worksheet {NS}><sheetData><row r="1"><c r="A1" t="inlineStr"><is><t>&a;</t></is></c></row></sheetData></worksheet>'
ENTITIES = "".join(
    f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("bcdefgh", "cdefghi", strict=True)
)


def book(sheet, strings=f"<sst {NS}/>"):
    """Return a workbook of which one sheet and the shared strings are as given."""
    from openpyxl import Workbook  # type: ignore[import-untyped]

    plain = io.BytesIO()
    Workbook().save(plain)
    buffer = io.BytesIO()
    with zipfile.ZipFile(plain) as old, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if name not in ("xl/worksheets/sheet1.xml", "xl/sharedStrings.xml"):
                new.writestr(name, old.read(name))
        new.writestr("xl/worksheets/sheet1.xml", sheet)
        new.writestr("xl/sharedStrings.xml", strings)
    return buffer.getvalue()


def with_false_sizes(data):
    """The archive's list of contents says 10 bytes where a part has many."""
    sheet = data.rindex(b"PK\x01\x02", 0, data.rindex(b"xl/worksheets/sheet1.xml"))
    return data[: sheet + 24] + (10).to_bytes(4, "little") + data[sheet + 28 :]


BOMB = f'<!DOCTYPE x [<!ENTITY b "bb">{ENTITIES}<!ENTITY a "&i;">]>{CELL}'
OUTSIDE = f'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>{CELL}'
LONG_CELL = CELL.replace("&a;", "x" * 50_000_000)


@pytest.mark.parametrize(
    ("code", "make"),
    [
        ("sheet.not-a-workbook", lambda: book(BOMB)),
        ("sheet.not-a-workbook", lambda: book(OUTSIDE)),
        ("sheet.not-a-workbook", lambda: book(("\ufeff" + BOMB).encode("utf-16-le"))),
        ("sheet.too-large", lambda: book(LONG_CELL)),
        ("sheet.too-large", lambda: book(CELL, f"<sst {NS}>" + "<si/>" * 6_000_000 + "</sst>")),
        ("sheet.not-a-workbook", lambda: with_false_sizes(book(LONG_CELL))),
    ],
)
def test_workbooks_that_would_unpack_without_end(room, code, make):
    data = make()
    assert len(data) < 500_000
    room.only(code, data)


def test_the_largest_workbook_that_is_read_takes_seconds(room, monkeypatch):
    """An eighth of it takes an eighth of the time."""
    monkeypatch.setattr(rows, "MAX_TAGS", rows.MAX_TAGS // 8)
    cells = "<row>" + "<c><v>1</v></c>" * 15 + "</row>"
    count = rows.MAX_TAGS // cells.count("<") - 10
    sheet = book(f"<worksheet {NS}><sheetData>{cells * count}</sheetData></worksheet>")
    start = time.process_time()
    assert "sheet.missing-column" in {problem.code for problem in room.check(sheet)}
    assert time.process_time() - start < 10


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("title: !!python/object/apply:os.system ['touch owned']\n", "config.tag"),
        ("title: !!binary aGk=\n", "config.tag"),
        ("<<: {title: x}\n", "config.unknown-key"),
        ("? [a, b]\n: c\n", "config.not-yaml"),
        ("title: a\n---\ntitle: b\n", "config.not-yaml"),
        ("title: \x1b[2Jx\n", "config.not-yaml"),
        ('title: "\\e[2J"\n', "config.control"),
        ('title: "\\ud800"\n', "config.not-yaml"),
        ("container: {length_cm: 1e999}\n", "config.out-of-range"),
    ],
)
def test_tricks_in_yaml(tmp_path, text, code):
    path = tmp_path / "config.yaml"
    path.write_text(text, encoding="utf-8")
    campaign, problems = check_campaign(path)
    assert campaign is None
    assert code in [problem.code for problem in problems]
    assert not (tmp_path / "owned").exists()
    assert all(str(problem).isprintable() for problem in problems)


# --- names ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["CON", "nul", "Aux", "COM1", "lpt9", "NUL.sand", "con.tar.gz"])
def test_devices_of_windows_are_no_names(room, name):
    right = room.config
    for old in ("  poppy_CP:", "  disc:"):
        room.config = right.replace(old, f"  {name}:")
        problem = room.only("config.inconsistent")
        assert f"'{name}'; allowed: a name that is no device of Windows, " in problem.allowed
    room.config = right
    room.add(name, "p1", force_log=f"logs/{name}.csv")
    room.touch(f"logs/{name}.csv")
    device_columns = [
        column for code, _, column in room.list_problems()[0] if code == "sheet.reserved-name"
    ]
    assert device_columns[:2] == ["run_id", "force_log"]


@pytest.mark.parametrize("name", ["CONcrete", "null", "com", "auxiliary", "COM10", "a.nul"])
def test_names_that_only_look_like_devices_are_fine(room, name):
    room.config = room.config.replace("  poppy_CP:", f"  {name}:")
    room.add(name, "t1", medium=name)
    room.add("p2", "p1", medium=name, tare_run=name)
    assert room.check() == []


def test_names_that_some_disks_take_for_the_same(room):
    composed = unicodedata.normalize("NFC", "é.csv")
    spread = unicodedata.normalize("NFD", "É.csv")
    for row, name in (("p1", composed), ("t1", spread)):
        room.touch(name)
        room.rows[row]["force_log"] = name
    room.rows["t1"]["run_id"] = room.rows["p1"]["tare_run"] = "P1"
    problems = {problem.code: problem for problem in room.check()}
    assert problems["sheet.case-id"].place == Place("runs.csv", 3, "run_id")
    assert " p1 in row 2" in problems["sheet.case-id"].allowed
    assert problems["sheet.shared-file"].place == Place("runs.csv", 3, "force_log")
    assert re.search(f" row 2 .* {composed}: ", problems["sheet.shared-file"].allowed)


@pytest.mark.parametrize("sign", ["\x00", "\x07", "\x1b", "\x7f", "\x85", "\u202e", "\u2067"])
def test_notes_hold_no_control_characters(room, sign):
    """They would end up in tables, pages and drawings."""
    room.rows["p1"]["note"] = f"a{sign}b"
    problem = room.only("sheet.control")
    assert (problem.place.row, problem.place.column) == (2, "note")
    assert str(problem).isprintable()


def test_messages_hold_nothing_that_a_terminal_would_act_on(room):
    room.rows["p1"]["medium"] = "\x1b[2J\x07\u202egnas"
    room.write()
    code, out, _ = answer_of("check", "--config", room.path)
    assert code == 2
    assert all(line.isprintable() for line in out.splitlines())
    assert r"\x1b[2J\x07\u202egnas" in out


# --- spreadsheets -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["=1+1.csv", "+cmd.csv", "-2+3.csv", "@SUM(A1).csv"])
def test_no_cell_of_a_csv_is_a_formula(room, name):
    """The ledger holds names of files, which are whatever the user made them."""
    room.rows["p1"]["force_log"] = name
    room.write()
    assert run_rules(room.path, "ingest") > 0
    ledger = next((room.folder / "results" / "ledger").rglob("poppy_LP.csv"))
    with ledger.open(encoding="utf-8", newline="") as handle:
        cells = [cell for row in csv.reader(handle) for cell in row]
    assert f"'{name}" in cells
    assert [cell for cell in cells if cell[:1] in "=+-@\t\r" and cell] == []
    assert name in set(read_result(ledger)["file"])


# --- what is drawn and shown ------------------------------------------------------------------------


TITLES = (
    "<script>alert(1)</script>",
    r"$\frac{",
    "$x$",
    "&amp;<",
    "]]>",
    "--><b>",
    "\u202esand",
    "😀" * 50,
)


def test_any_title_can_be_drawn():
    """As text: neither as mathematics nor as a part of the svg."""
    base_campaign, alpha = memory({}).campaign, chain.alpha_table("poppy_LP")
    poppy = base_campaign.config.media["poppy_LP"]
    media = {f"m{i}": poppy.model_copy(update={"title": title}) for i, title in enumerate(TITLES)}
    config = base_campaign.config.model_copy(update={"media": media})
    campaign = replace(
        base_campaign, config=config, runs=tuple(run(name, name, "plate") for name in media)
    )
    tables = {"alpha/{medium}.csv": pd.concat([alpha.assign(medium=name) for name in media])}
    maps = next(figure for figure in figures() if figure.name == "alpha_maps")
    drawn = io.BytesIO()
    maps.draw(Memory(campaign, tables)).savefig(drawn, format="svg")
    assert b"<script" not in drawn.getvalue()


# --- names that shells and Snakemake act on ---------------------------------------------------------

ODD = [
    "{medium}.csv",
    "a b'c.csv",
    "$(touch owned).csv",
    "*.csv",
    "-rf.csv",
    "=1+1.csv",
    "%PATH%.csv",
    'q"x.csv',
    "#c.csv",
    "x{{y}}.csv",
    "&.csv",
    ";touch owned.csv",
    "{0}.csv",
    "é ü.csv",
]


@pytest.mark.slow
@needs_links
def test_odd_names_pass_through_the_workflow(tmp_path):
    folder = make_campaign(
        tmp_path / "it's $(touch owned) & {medium}", ("poppy_LP",), directions=FEW[:2], robot=False
    )
    values = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    values["media"]["poppy_LP"]["title"] = r"<script>$\frac{</script>"
    write_yaml(folder.config, values)
    sheet = folder.root / "raw" / "paper" / "runs.csv"
    rows = read_rows(sheet)
    cells = [(row, column) for row in rows for column in ("force_log", "motion_log")]
    for (row, column), name in zip(cells, ODD, strict=False):
        new = Path(row[column]).parent / name
        (sheet.parent / row[column]).rename(sheet.parent / new)
        row[column] = new.as_posix()
    write_rows(sheet, rows)
    digests = folder.raw_digests()
    process = folder.rftfit("run", "results/ledger.csv")
    assert process.returncode == 0, process.stdout + process.stderr
    assert folder.raw_digests() == digests
    assert list(tmp_path.rglob("owned*")) == []
    ledger = read_result(folder.root / "results" / "ledger.csv")
    assert set(ledger.loc[ledger["fate"] == "used", "file"]) >= {
        row[column] for row, column in cells[: len(ODD)]
    }
    # a log whose name Snakemake cannot be given is watched by its content
    log = next(path for path in sheet.parent.rglob("{medium}.csv"))
    log.write_bytes(log.read_bytes().rstrip(b"\n").rpartition(b"\n")[0] + b"\n")
    assert "ingest" in folder.stale()
