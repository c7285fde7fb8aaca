"""Hostile and broken input: harmless, and said so."""

import csv
import html
import io
import json
import os
import re
import shutil
import subprocess
import sys
import time
import unicodedata
import zipfile
from dataclasses import replace
from pathlib import Path

import chain_tables as chain
import pandas as pd
import pytest
import yaml
from campaigns import FEW, make_campaign
from jobs import run_rules
from memory import Memory, memory, run
from page_inputs import NASTY, page_results
from result_tables import read_result

from rftfit.campaign import rows
from rftfit.campaign.columns import COLUMNS
from rftfit.campaign.load import check_campaign, root_of
from rftfit.figures.maps import alpha_maps
from rftfit.figures.style import content
from rftfit.page.page import page as write

CONFIG = """\
title: Test
raw: raw
run_sheet: runs.csv
transducer: {name: sensor, range_N: [65, 65, 200], axes: {x: "-F2", y: "+F1", z: "-F3"}}
container: {length_cm: 24, width_cm: 22, depth_cm: 15}
intruders:
  plate: {shape: plate, length_cm: 3.81, width_cm: 2.54, thickness_cm: 0.64}
media:
  sand: {title: sand}
"""
ROD = {"kind": "rod", "medium": "sand", "intruder": "plate", "direction": "intrusion",
       "beta_deg": "30", "gamma_deg": "45"}  # fmt: skip
PATIENCE_S = 30
needs_links = pytest.mark.skipif(os.name != "posix", reason="links and pipes of a POSIX system")


class Room:
    """A campaign with one pair of runs, that is right until a test puts it wrong."""

    def __init__(self, folder):
        self.folder, self.config = folder, CONFIG
        (folder / "raw").mkdir(parents=True)
        self.rows = [
            {**ROD, "run_id": "p", "kind": "plate", "tare_run": "t", **self.logs("p")},
            {**ROD, "run_id": "t", **self.logs("t")},
        ]

    def logs(self, name):
        found = {f"{part}_log": f"{name}_{part}.csv" for part in ("force", "motion")}
        for log in found.values():
            (self.folder / "raw" / log).write_text("", encoding="utf-8")
        return found

    @property
    def path(self):
        return self.folder / "config.yaml"

    def write(self, sheet=None):
        out = io.StringIO()
        writer = csv.DictWriter(out, [column.name for column in COLUMNS], restval="")
        writer.writeheader()
        writer.writerows(self.rows)
        self.path.write_text(self.config, encoding="utf-8")
        target = self.folder / "runs.csv"
        if not target.is_symlink() and not target.exists():
            target.write_bytes(out.getvalue().encode() if sheet is None else sheet)

    def problems(self, sheet=None):
        """Texts of the problems by their code."""
        self.write(sheet)
        return {problem.code: str(problem) for problem in check_campaign(self.path)[1]}


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path / "room")


def rftfit(*words, cwd=None):
    """Run the command as a user would; it may neither hang nor show a traceback."""
    done = subprocess.run(
        [sys.executable, "-m", "rftfit.cli.main", *map(str, words)],
        cwd=cwd, capture_output=True, text=True, check=False, timeout=PATIENCE_S,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip
    assert "Traceback" not in done.stdout + done.stderr
    return done


def test_the_room_itself_is_right(room):
    assert room.problems() == {}


# --- files that are none ----------------------------------------------------------------------------


@needs_links
@pytest.mark.parametrize("what", ["pipe", "device"])
@pytest.mark.parametrize(
    "words",
    [
        ["check", "--config", "FILE"],
        ["inspect", "FILE"],
        ["predict", "--outline", "FILE", "--width", "5", "--path", "FILE", "--alpha", "0.9"],
        ["verify", "--config", "FILE"],
        ["run", "--dry-run", "--config", "FILE"],
    ],
)
def test_pipes_and_devices_are_never_read(tmp_path, words, what):
    """A read would wait, or go on, for ever."""
    file = tmp_path / "pipe"
    if what == "pipe":
        os.mkfifo(file)
    else:
        file = Path("/dev/zero")
    done = rftfit(*(str(file) if word == "FILE" else word for word in words), cwd=tmp_path)
    assert done.returncode == 2
    assert re.search("device|a file", done.stdout + done.stderr)


@needs_links
@pytest.mark.parametrize("what", ["pipe", "link to a device", "link to a pipe outside", "folder"])
@pytest.mark.parametrize("place", ["runs.csv", "raw/p_force.csv"])
def test_pipes_and_devices_of_a_campaign(room, what, place):
    target = room.folder / place
    target.unlink(missing_ok=True)
    if what == "pipe":
        os.mkfifo(target)
    elif what == "folder":
        target.mkdir()
    elif what == "link to a device":
        target.symlink_to("/dev/zero")
    else:
        os.mkfifo(room.folder.parent / "pipe")
        target.symlink_to(room.folder.parent / "pipe")
    found = room.problems()
    outside = what.startswith("link")
    codes = {
        "runs.csv": "config.path-outside" if outside else "sheet.not-a-file",
        "raw/p_force.csv": "sheet.path-outside" if outside else "sheet.log-not-a-file",
    }
    assert list(found) == [codes[place]]


@needs_links
@pytest.mark.parametrize(
    ("raw", "sheet", "link"),
    [
        ("results/raw", "runs.csv", ""),
        ("results", "runs.csv", ""),
        ("raw", "results/runs.csv", ""),
        ("raw", "runs.csv", "results -> raw"),
        ("raw", "runs.csv", "results -> raw/inside"),
        ("raw", "runs.csv", "raw -> results/logs"),
    ],
)
def test_results_and_raw_are_apart(room, raw, sheet, link):
    """Else the program would write among the logs, or deleting the results would delete logs."""
    room.config = CONFIG.replace("raw: raw", f"raw: {raw}").replace(": runs.csv", f": {sheet}")
    room.write()
    for path in (room.folder / raw, (room.folder / sheet).parent, room.folder / "raw" / "inside"):
        path.mkdir(parents=True, exist_ok=True)
    if link.startswith("results"):
        (room.folder / "results").symlink_to(room.folder / link.split(" -> ")[1])
    elif link:
        shutil.copytree(room.folder / "raw", room.folder / "results" / "logs")
        shutil.rmtree(room.folder / "raw")
        (room.folder / "raw").symlink_to(room.folder / "results" / "logs")
    found = room.problems()
    assert "outside of results/" in found["config.in-results"]


@pytest.mark.parametrize("path", ["../../secret.csv", "/etc/hostname", "absent.csv", "CON.csv"])
def test_logs_named_in_the_config_stay_in_raw_too(room, path):
    room.config += f"rigid_contact: {{force_log: '{path}', motion_log: p_motion.csv}}\n"
    found = room.problems()
    assert list(found) == ["config.rigid-contact"]
    assert "key rigid_contact.force_log" in found["config.rigid-contact"]
    assert "inside the raw folder" in found["config.rigid-contact"]


# --- bombs ------------------------------------------------------------------------------------------

NS = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
CELL = f'<worksheet {NS}><sheetData><row r="1"><c r="A1" t="inlineStr"><is><t>&a;</t></is></c></row></sheetData></worksheet>'
ENTITIES = "".join(f'<!ENTITY {new} "{f"&{old};" * 10}">' for old, new in zip("bcdefgh", "cdefghi", strict=True))  # fmt: skip


def book(sheet, strings=f"<sst {NS}/>"):
    """Return a workbook of which one sheet and the shared strings are as given."""
    from openpyxl import Workbook  # type: ignore[import-untyped]

    plain = io.BytesIO()
    Workbook().save(plain)
    out = io.BytesIO()
    with zipfile.ZipFile(plain) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if name not in ("xl/worksheets/sheet1.xml", "xl/sharedStrings.xml"):
                new.writestr(name, old.read(name))
        new.writestr("xl/worksheets/sheet1.xml", sheet)
        new.writestr("xl/sharedStrings.xml", strings)
    return out.getvalue()


def with_false_sizes(data):
    """The archive's list of contents says 10 bytes where a part has many."""
    sheet = data.rindex(b"PK\x01\x02", 0, data.rindex(b"xl/worksheets/sheet1.xml"))
    return data[: sheet + 24] + (10).to_bytes(4, "little") + data[sheet + 28 :]


@pytest.mark.parametrize(
    ("code", "make"),
    [
        ("sheet.not-a-workbook",
         lambda: book(f'<!DOCTYPE x [<!ENTITY b "bb">{ENTITIES}<!ENTITY a "&i;">]>{CELL}')),
        ("sheet.not-a-workbook",
         lambda: book(f'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/hostname">]>{CELL}')),
        ("sheet.not-a-workbook",
         lambda: book(f'\ufeff<!DOCTYPE x [<!ENTITY b "bb">{ENTITIES}<!ENTITY a "&i;">]>{CELL}'.encode("utf-16-le"))),
        ("sheet.too-large", lambda: book(CELL.replace("&a;", "x" * 50_000_000))),
        ("sheet.too-large", lambda: book(CELL, f"<sst {NS}>" + "<si/>" * 6_000_000 + "</sst>")),
        ("sheet.not-a-workbook", lambda: with_false_sizes(book(CELL.replace("&a;", "x" * 50_000_000)))),
    ],
    ids=["entities", "external entity", "entities in UTF-16", "one long cell", "many tags", "false sizes"],
)  # fmt: skip
def test_workbooks_that_would_unpack_without_end(room, code, make):
    assert callable(make)
    data = make()
    assert len(data) < 500_000
    start = time.perf_counter()
    found = room.problems(data)
    assert list(found) == [code]
    assert time.perf_counter() - start < 5


def test_the_largest_workbook_that_is_read_takes_seconds(room, monkeypatch):
    """A quarter of it takes a quarter of the time."""
    monkeypatch.setattr(rows, "MAX_TAGS", rows.MAX_TAGS // 4)
    cells = "<row>" + "<c><v>1</v></c>" * 15 + "</row>"
    count = rows.MAX_TAGS // cells.count("<") - 10
    start = time.process_time()
    found = room.problems(
        book(f"<worksheet {NS}><sheetData>{cells * count}</sheetData></worksheet>")
    )
    assert "sheet.missing-column" in found
    assert time.process_time() - start < PATIENCE_S / 4


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("a: &x [1]\nb: [*x, *x]\n", "config.alias"),
        ("title: !!python/object/apply:os.system ['touch owned']\n", "config.tag"),
        ("title: !!binary aGk=\n", "config.tag"),
        ("<<: {title: x}\n", "config.unknown-key"),
        ("title: a\ntitle: b\n", "config.duplicate-key"),
        ("title: " + "[" * 5000 + "\n", "config.too-large"),
        ("? [a, b]\n: c\n", "config.not-yaml"),
        ("title: a\n---\ntitle: b\n", "config.not-yaml"),
        ("title: \x1b[2Jx\n", "config.not-yaml"),
        ('title: "\\e[2J"\n', "config.control"),
        ('title: "\\ud800"\n', "config.not-yaml"),
        ("container: {length_cm: 1e999}\n", "config.out-of-range"),
        ("x" * 1_100_000, "config.too-large"),
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

DEVICES = ["CON", "nul", "Aux", "COM1", "lpt9", "NUL.sand", "con.tar.gz"]


@pytest.mark.parametrize("name", DEVICES)
def test_devices_of_windows_are_no_names(room, name):
    for section, old in (("media", "  sand:"), ("intruders", "  plate:")):
        room.config = CONFIG.replace(old, f"  {name}:")
        (room.folder / "runs.csv").unlink(missing_ok=True)
        found = room.problems()
        assert f"found the name '{name}'" in found["config.inconsistent"], section
        assert "no device of Windows" in found["config.inconsistent"]
    room.config = CONFIG
    (room.folder / "runs.csv").unlink()
    room.rows[0] |= {"run_id": name, "force_log": f"logs/{name}.csv"}
    (room.folder / "raw" / "logs").mkdir()
    (room.folder / "raw" / "logs" / f"{name}.csv").write_text("", encoding="utf-8")
    room.write()
    texts = [str(problem) for problem in check_campaign(room.path)[1]]
    named = [text for text in texts if "no device of Windows" in text]
    assert len(named) == 2
    assert "column run_id" in named[0]
    assert "column force_log" in named[1]


@pytest.mark.parametrize("name", ["CONcrete", "null", "com", "auxiliary", "COM10", "a.nul"])
def test_names_that_only_look_like_devices_are_fine(room, name):
    room.config = CONFIG.replace("  sand:", f"  {name}:")
    for row in room.rows:
        row["medium"] = name
    assert room.problems() == {}


def test_names_that_some_disks_take_for_the_same(room):
    room.config = CONFIG + "  Sand: {title: sand}\n"
    found = room.problems()
    assert "the names 'sand' and 'Sand' differ by case only" in found["config.inconsistent"]
    (room.folder / "runs.csv").unlink()
    room.config = CONFIG
    composed = unicodedata.normalize("NFC", "é.csv")
    spread = unicodedata.normalize("NFD", "É.csv")
    for name in (composed, spread):
        (room.folder / "raw" / name).write_text("", encoding="utf-8")
    room.rows[0]["force_log"], room.rows[1]["force_log"] = composed, spread
    room.rows[1]["run_id"] = room.rows[0]["tare_run"] = "P"
    found = room.problems()
    assert "differs by more than case from p" in found["sheet.case-id"]
    assert "some disks treat both names as one" in found["sheet.shared-file"]


@pytest.mark.parametrize("sign", ["\x00", "\x07", "\x1b", "\x7f", "\x85"])
def test_notes_hold_no_control_characters(room, sign):
    """They would end up in tables, pages and drawings."""
    room.rows[0]["note"] = f"a{sign}b"
    found = room.problems()
    assert list(found) == ["sheet.control"]
    assert "row 2, column note" in found["sheet.control"]
    assert found["sheet.control"].isprintable()


def test_messages_hold_nothing_that_a_terminal_would_act_on(room):
    room.rows[0]["medium"] = "\x1b[2J\x07\u202egnas"
    room.write()
    done = rftfit("check", "--config", room.path)
    assert done.returncode == 2
    assert all(line.isprintable() for line in done.stdout.splitlines())
    assert r"\x1b[2J\x07\u202egnas" in done.stdout


# --- spreadsheets -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["=1+1.csv", "+cmd.csv", "-2+3.csv", "@SUM(A1).csv"])
def test_no_cell_of_a_csv_is_a_formula(room, name):
    """The ledger holds names of files, which are whatever the user made them."""
    room.rows[0]["force_log"] = name
    room.write()
    assert run_rules(room.path, "ingest") > 0
    ledger = next((root_of(room.path) / "results" / "ledger").rglob("sand.csv"))
    with ledger.open(encoding="utf-8", newline="") as handle:
        cells = [cell for row in csv.reader(handle) for cell in row]
    assert f"'{name}" in cells
    assert [cell for cell in cells if cell[:1] in "=+-@\t\r" and cell] == []
    assert name in set(read_result(ledger)["file"])


# --- what is drawn and shown ------------------------------------------------------------------------


def test_script_in_names_and_notes_is_text_in_the_page(tmp_path):
    page = write(page_results(tmp_path, nasty=True))
    assert NASTY not in page
    policy = re.search(r'http-equiv="Content-Security-Policy"\s+content="([^"]*)"', page)
    assert policy is not None
    rules = html.unescape(policy[1])
    assert "default-src 'none'" in rules
    assert "unsafe-inline" not in rules
    scripts = re.findall(r"<script[^>]*>", page)
    assert len(scripts) == 2
    data = re.search(r'<script type="application/json"[^>]*>(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert NASTY in {medium["title"] for medium in json.loads(data[1])["media"]}


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
    own, one = memory({}).campaign, chain.alpha_table("poppy_LP")
    poppy = own.config.media["poppy_LP"]
    media = {f"m{i}": poppy.model_copy(update={"title": title}) for i, title in enumerate(TITLES)}
    config = own.config.model_copy(update={"media": media})
    campaign = replace(own, config=config, runs=tuple(run(name, name, "plate") for name in media))
    tables = {"alpha/{medium}.csv": pd.concat([one.assign(medium=name) for name in media])}
    figure = alpha_maps(Memory(campaign, tables))
    assert b"<script" not in content(figure, "svg")


# --- sizes ------------------------------------------------------------------------------------------


def test_a_sheet_of_ten_thousand_rows_is_checked_in_seconds(room):
    (room.folder / "raw" / "many").mkdir()
    for number in range(5000):
        for row in list(room.rows[:2]):
            name = f"{row['run_id']}{number}"
            logs = {f"{part}_log": f"many/{name}_{part}.csv" for part in ("force", "motion")}
            for log in logs.values():
                (room.folder / "raw" / log).touch()
            tare = {"tare_run": f"t{number}"} if row["kind"] == "plate" else {}
            room.rows.append({**row, **tare, **logs, "run_id": name})
    room.write()
    start = time.perf_counter()
    campaign, problems = check_campaign(room.path)
    assert time.perf_counter() - start < 10
    assert campaign is not None, problems
    assert len(campaign.runs) == 10002


# --- names that shells and Snakemake act on ---------------------------------------------------------

ODD = ["{medium}.csv", "a b'c.csv", "$(touch owned).csv", "*.csv", "-rf.csv", "=1+1.csv", "%PATH%.csv",
       'q"x.csv', "#c.csv", "x{{y}}.csv", "&.csv", ";touch owned.csv", "{0}.csv", "é ü.csv"]  # fmt: skip


@pytest.mark.slow
@needs_links
def test_odd_names_pass_through_the_workflow(tmp_path):
    folder = make_campaign(
        tmp_path / "it's $(touch owned) & {medium}", ("poppy_LP",), directions=FEW[:2], robot=False
    )
    config = folder.root / "config" / "config.yaml"
    values = yaml.safe_load(config.read_text(encoding="utf-8"))
    values["media"]["poppy_LP"]["title"] = r"<script>$\frac{</script>"
    config.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    sheet = folder.root / "raw" / "paper" / "runs.csv"
    with sheet.open(encoding="utf-8", newline="") as handle:
        rows = list(csv.DictReader(handle))
    cells = [(row, column) for row in rows for column in ("force_log", "motion_log")]
    for (row, column), name in zip(cells, ODD, strict=False):
        new = Path(row[column]).parent / name
        (sheet.parent / row[column]).rename(sheet.parent / new)
        row[column] = new.as_posix()
    with sheet.open("w", encoding="utf-8", newline="") as handle:
        writer = csv.DictWriter(handle, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    before = folder.raw_digests()
    done = subprocess.run(
        [sys.executable, "-m", "rftfit.cli.main", "run", "results/ledger.csv"],
        cwd=folder.root, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert folder.raw_digests() == before
    assert list(tmp_path.rglob("owned*")) == []
    ledger = read_result(folder.root / "results" / "ledger.csv")
    assert set(ledger.loc[ledger["fate"] == "used", "file"]) >= {
        row[column] for row, column in cells[: len(ODD)]
    }
    # a log whose name Snakemake cannot be given is watched by its content
    log = next(path for path in sheet.parent.rglob("{medium}.csv"))
    log.write_bytes(log.read_bytes().rstrip(b"\n").rpartition(b"\n")[0] + b"\n")
    assert "ingest" in folder.stale()
