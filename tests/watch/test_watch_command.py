"""`rftfit watch` reports every push, and `rftfit reenact --live` ends with the usual files.

Usual: those of `rftfit reenact` without `--live`.
"""

import json
import shutil

import pytest
import yaml
from campaigns import MEDIUM, Folder

from rftfit.bench.watch import Watch
from rftfit.campaign.config import Config
from rftfit.checks.verdict import Verdict
from rftfit.lab.enact import prepare
from rftfit.results import open_results
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


def test_a_live_re_enactment_ends_as_one_at_once(tmp_path, recorded):
    values = yaml.safe_load((recorded / "config" / "config.yaml").read_text("utf-8"))
    plan = prepare(Config(**values), directions=[(0.0, 90.0), (30.0, 45.0)], legs=False)
    plan.write(tmp_path / "once", tmp_path / "once" / "runs.csv")
    lines = list(plan.live(tmp_path / "live", tmp_path / "live" / "runs.csv", 0.0, 0.0))
    assert len(lines) == len(plan.runs)
    once, live = (
        {
            p.relative_to(tmp_path / n): p.read_bytes()
            for p in (tmp_path / n).rglob("*.csv")
            if p.name != "runs.csv"
        }
        for n in ("once", "live")
    )
    assert once == live
    sheets = [
        sorted((tmp_path / n / "runs.csv").read_text().splitlines()) for n in ("once", "live")
    ]
    assert sheets[0] == sheets[1]
    bad = list(plan.live(tmp_path / "bad", tmp_path / "bad" / "runs.csv", 0.0, 1.0))
    assert sum("fault" in line for line in bad) == sum(run.kind == "plate" for run in plan.runs)


def test_a_live_re_enactment_has_a_config_to_watch(tmp_path, recorded):
    (tmp_path / "lab").mkdir()
    shutil.copytree(recorded / "config", tmp_path / "lab" / "config")
    lab, bench = Folder(tmp_path / "lab"), Folder(tmp_path / "lab" / "bench")
    words = ("--grid", "0:90,30:45", "--pace", "0", "--bad", "0", "--no-legs")
    process = lab.rftfit("reenact", "--live", "bench", *words)
    assert process.returncode == 0, process.stderr
    assert process.stdout.splitlines()[-1].endswith("recorded")
    watch = Watch(bench.config)
    for step in range(10):
        list(watch.step(0.5 * step))
    assert watch.summary(watch.media[MEDIUM])["states"] == {"measured": 2, "read": 2}


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
    verdict = Verdict(**facts)
    assert sentence == f"{verdict.on(MEDIUM)}."
    assert f"{verdict.on(MEDIUM)}.\n" in folder.rftfit("check", "--diagnose").stdout
    assert (verdict.word == "doubtful") != has_tares
    folder.run_here("page")
    # a sentence begins with a capital letter
    of_title = f"{verdict.on(config['media'][MEDIUM]['title'])[1:]}."
    assert of_title in folder.table("findings.csv")["finding"][0]
    terminal = closing_lines(Recorded(read_states(folder.config)))
    assert sum(of_title in line for line in terminal) == 1
    assert open_results(bench.root)[MEDIUM].verdict == verdict
