"""`rftfit watch` reports every push, and `rftfit reenact --live` ends with the usual files.

Usual: those of `rftfit reenact` without `--live`.
"""

import json
import shutil

import pytest
import yaml
from campaigns import MEDIUM, Folder
from makers import read_rows

import rftfit
from rftfit.bench.watch import Watch
from rftfit.workflow.closing import closing_lines
from rftfit.workflow.records import Recorded
from rftfit.workflow.state import read_states

WATCH = ["watch", "--json", "--no-page", "--wait", "0.1", "--stop"]
"""Words of the command, up to the width in percent at which it stops."""


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_each_line_of_json_is_an_event_and_the_watch_stops_when_enough_is_known(bench):
    bench.push(*bench.plates)
    process = Folder(bench.root).rftfit(*WATCH, "60")
    assert process.returncode == 0
    events = [json.loads(line) for line in process.stdout.splitlines()]
    assert {event["event"] for event in events} == {"push", "medium"}
    assert {event["run_id"] for event in events if event["event"] == "push"} == set(bench.rows)
    medium = [event for event in events if event["event"] == "medium"][-1]
    assert medium["half_width_percent"] <= 60
    assert medium["next"][0]["medium"] == MEDIUM
    assert medium["verdict"].startswith(f"{MEDIUM} shows no fault, ")


def test_the_target_is_chosen(bench):
    bench.push(*bench.plates[:3])
    process = Folder(bench.root).rftfit(*WATCH, "500", "--target", "zeta")
    assert '"target": "zeta"' in process.stdout


def test_control_c_ends_it_well(bench, monkeypatch):
    def step(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Watch, "step", step)
    process = Folder(bench.root).rftfit("watch")
    assert process.returncode == 0
    assert process.stdout.split()[-1].startswith("http://127.0.0.1:")


def test_a_folder_that_is_no_campaign_is_told(tmp_path):
    process = Folder(tmp_path).rftfit("watch", "--no-page", "--wait", "0.1")
    assert process.returncode == 2
    assert "config/config.yaml: " in process.stderr


def test_every_event_has_a_line_for_people(bench):
    good, bad, loose = bench.plates[:3]
    bench.push(good)
    watch = bench.watch()
    events = bench.settle(watch)
    bench.push(bad)
    bench.put(bench.logs(bad)[0], b"")
    bench.put(bench.logs(loose)[0])
    bench.rows["x"] = dict(bench.every[loose]) | {"run_id": "x", "kind": "rood"}
    del bench.rows[good]
    bench.write_sheet()
    events += bench.settle(watch)
    lines = [(event.kind, event.summary()) for event in events]
    medium = next(event.facts for event in events if event.kind == "medium")
    for kind, values in (
        ("withdrawn", f"{good}: "),
        ("problem", "error: raw/paper/runs.csv, row 5, column kind: found 'rood'"),
        ("file", f"{bench.logs(loose)[0]}: "),
        ("medium", f"{medium['half_width_percent']:.2g} %"),
        ("push", f"{bad} (row 4): no alpha"),
    ):
        assert any(values in line for line_kind, line in lines if line_kind == kind), kind
    assert not any("nan" in line for _, line in lines)


def test_a_live_re_enactment_ends_as_one_at_once_and_has_a_config_to_watch(tmp_path, recorded):
    (tmp_path / "lab").mkdir()
    shutil.copytree(recorded / "config", tmp_path / "lab" / "config")
    lab, bench = Folder(tmp_path / "lab"), Folder(tmp_path / "lab" / "bench")
    words = ("--grid", "0:90,30:45", "--no-legs")
    live = ("reenact", "--live", "bench", *words, "--pace", "0", "--bad")
    assert lab.rftfit("reenact", *words).returncode == 0
    process = lab.rftfit(*live, "0")
    assert process.returncode == 0, process.stderr
    assert process.stdout.splitlines()[-1].endswith("recorded")
    once, second = lab.raw_digests(), bench.raw_digests()
    sheet = "paper/runs.csv"
    assert once.pop(sheet) != second.pop(sheet)
    assert once == second
    in_order = [sorted(map(str, read_rows(folder.root / "raw" / sheet))) for folder in (lab, bench)]
    assert in_order[0] == in_order[1]
    watch = Watch(bench.config)
    for step in range(10):
        list(watch.step(0.5 * step))
    assert watch.summary(watch.media[MEDIUM])["states"] == {"measured": 2, "read": 2}
    shutil.rmtree(bench.root)
    assert lab.rftfit(*live, "1").stdout.count("fault") == 2


@pytest.mark.parametrize("has_tares", [True, False])
def test_watch_check_page_and_terminal_state_one_verdict(bench, has_tares):
    config = yaml.safe_load(bench.config.read_text("utf-8"))
    config["fit"]["missing_tare"] = "flag"
    bench.config.write_text(yaml.safe_dump(config, sort_keys=False), "utf-8")
    bench.push(*bench.plates, tare=has_tares)
    if not has_tares:
        for row in bench.rows.values():
            row["tare_run"] = ""
        bench.write_sheet()
    folder = Folder(bench.root)
    watching = folder.rftfit(*WATCH, "500")
    events = [json.loads(line) for line in watching.stdout.splitlines()]
    sentence = [event for event in events if event["event"] == "medium"][-1]["verdict"]
    facts = json.loads(folder.rftfit("check", "--diagnose", "--json").stdout)["verdicts"][MEDIUM]
    assert f"{sentence}\n" in folder.rftfit("check", "--diagnose").stdout
    folder.run_here("page")
    verdict = rftfit.open(bench.root)[MEDIUM].verdict
    assert verdict == type(verdict)(**facts)
    assert sentence == f"{verdict.on(MEDIUM)}."
    assert (verdict.word == "doubtful") != has_tares
    # a sentence begins with a capital letter
    of_title = f"{verdict.on(config['media'][MEDIUM]['title'])[1:]}."
    assert of_title in folder.table("findings.csv")["finding"][0]
    terminal = closing_lines(Recorded(read_states(folder.config)))
    assert sum(of_title in line for line in terminal) == 1
