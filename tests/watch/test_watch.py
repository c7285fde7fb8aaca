"""`rftfit watch` gives the tables of `rftfit run` for any order in which files come or change."""

import random
import re

import numpy as np
import pandas as pd
import pytest
from campaigns import MEDIUM, Bench, lay_out_home_rig, run_rules
from seeds import seeds

import rftfit
from rftfit.bench.watch import Watch
from rftfit.measure.ingest import ingest_medium
from rftfit.workflow.validate import estimated_map_rows


def facts_of_kind(events, kind):
    return [event.facts for event in events if event.kind == kind]


def states_of_pushes(events):
    """State of each run of which a push was reported."""
    return {facts["run_id"]: facts["state"] for facts in facts_of_kind(events, "push")}


def assert_as_run(bench, watch):
    """Tables of a watch are those that `rftfit run` makes now."""
    run_rules(bench.config, "ingest", "tare", "slopes", "checks")
    results, medium = rftfit.open(bench.root), watch.media[MEDIUM]
    rows = [medium.runs[name].rows for name in sorted(medium.runs)]
    for name, table in {
        "alpha": medium.alpha,
        "checks": medium.checks,
        "fits": pd.DataFrame([row["fits"] for row in rows if "fits" in row]),
        "runs": pd.DataFrame([row["runs"] for row in rows]),
    }.items():
        of_run = results.table(f"{name}/{MEDIUM}.csv")
        table_of_watch = table.astype(of_run.dtypes)
        pd.testing.assert_frame_equal(of_run, table_of_watch, obj=name, check_exact=True)
    of_run = estimated_map_rows(results, MEDIUM)
    assert (medium.map is None) == of_run["alpha_z_N_per_cm3"].isna().all()
    if medium.map is not None:
        map_of_watch = medium.map.table()
        numbers = [name for name in map_of_watch if name != "source"]
        np.testing.assert_allclose(map_of_watch[numbers], of_run[numbers], rtol=6e-6, atol=1e-12)
        assert list(map_of_watch["source"]) == list(of_run["source"])


def change(bench, chance):
    """One thing that happens at a bench."""
    name = chance.choice(list(bench.every))
    log = chance.choice(bench.logs(name))
    content = bench.content(log)
    event_number = chance.randrange(9)
    if event_number < 3:
        bench.push(name if bench.every[name]["kind"] == "plate" else chance.choice(bench.plates))
    elif event_number == 3:
        bench.put(log, content[: chance.randrange(len(content))])
    elif event_number == 4:
        bench.put(log, bench.content(chance.choice(bench.logs(chance.choice(bench.plates)))))
    elif event_number == 5:
        (bench.raw / log).unlink(missing_ok=True)
    elif event_number == 6:
        bench.rows.pop(name, None)
    elif event_number == 7 and name in bench.rows:
        bench.rows[name]["beta_deg"] = chance.choice(["0", "30", "not a number", "45"])
    else:
        text = bench.config.read_text("utf-8")
        levels = ["confidence: 0.95\n", "confidence: 0.9\n"]
        old, new = levels if levels[0] in text else levels[::-1]
        bench.config.write_text(text.replace(old, new), "utf-8")
    bench.write_sheet()


@pytest.mark.statistics
@pytest.mark.parametrize("seed", range(seeds(4, 1)))
def test_any_order_of_arrival_gives_what_a_run_gives(bench, seed):
    chance = random.Random(seed)
    watch = bench.watch()
    for _ in range(12):
        change(bench, chance)
        bench.collect_events(watch, chance.randrange(4))
    # a run needs rows without error: what is wrong is corrected, and the last push is made
    bench.rows = {name: dict(bench.every[name]) for name in bench.rows}
    bench.push(chance.choice(bench.plates))
    for name in list(bench.rows):
        tare = bench.every[name]["tare_run"]
        bench.rows |= {tare: dict(bench.every[tare])} if tare else {}
    bench.write_sheet()
    bench.settle(watch)
    assert_as_run(bench, watch)


def test_a_log_that_grows_is_never_read(bench):
    name = bench.plates[0]
    bench.push(name)
    force = bench.logs(name)[0]
    content = bench.content(force)
    watch = bench.watch()
    for twelfth in range(1, 12):
        bench.put(force, content[: twelfth * len(content) // 12])
        assert name not in states_of_pushes(bench.collect_events(watch))
    assert watch.state(MEDIUM, name) == "growing"
    bench.put(force)
    events = bench.settle(watch)
    assert states_of_pushes(events)[name] == "measured"
    assert facts_of_kind(events, "medium")[-1]["states"] == {"measured": 1, "read": 1}


def test_a_log_that_changes_while_it_is_read_is_measured_again(bench, monkeypatch):
    name = bench.plates[0]
    bench.push(name)
    watch = bench.watch()
    bench.collect_events(watch, 3)
    plain = ingest_medium

    def while_written(*arguments):
        tables = plain(*arguments)
        monkeypatch.setattr("rftfit.bench.medium.ingest_medium", plain)
        bench.put(bench.logs(name)[0], bench.content(bench.logs(bench.plates[1])[0]))
        return tables

    monkeypatch.setattr("rftfit.bench.medium.ingest_medium", while_written)
    assert name not in states_of_pushes(bench.collect_events(watch))
    bench.settle(watch)
    assert_as_run(bench, watch)


def test_a_plate_before_its_rod_is_not_tared_yet(bench):
    name = bench.plates[0]
    tare = bench.every[name]["tare_run"]
    bench.push(name)
    for log in bench.logs(tare):
        (bench.raw / log).unlink()
    watch = bench.watch()
    bench.settle(watch)
    assert (watch.state(MEDIUM, name), watch.state(MEDIUM, tare)) == ("not tared yet", "waiting")
    bench.push(name)
    assert states_of_pushes(bench.settle(watch))[name] == "measured"
    assert_as_run(bench, watch)


def test_a_bad_row_is_told_for_that_row_alone(bench):
    good, bad = bench.plates[:2]
    bench.push(good, bad)
    bench.rows[bad]["direction"] = "sideways"
    watch = bench.watch()
    events = bench.settle(watch)
    (problem,) = facts_of_kind(events, "problem")
    assert (problem["row"], problem["code"]) == ([*bench.rows].index(bad) + 2, "sheet.unknown-word")
    assert bad not in watch.rows[MEDIUM]
    assert watch.state(MEDIUM, good) == "measured"
    bench.rows[bad]["direction"] = bench.every[bad]["direction"]
    bench.write_sheet()
    events = bench.settle(watch)
    assert facts_of_kind(events, "problem") == [problem | {"solved": True}]
    assert watch.state(MEDIUM, bad) == "measured"


def test_the_run_of_a_bad_tare_row_is_left_out_and_told(bench):
    name = bench.plates[0]
    bench.push(name)
    bench.rows[bench.every[name]["tare_run"]]["kind"] = "rood"
    watch = bench.watch()
    codes = {facts["code"] for facts in facts_of_kind(bench.settle(watch), "problem")}
    assert {"sheet.unknown-word", "sheet.tare-row"} <= codes
    assert watch.rows == {}


def test_a_deleted_log_withdraws_its_run_and_a_changed_one_replaces_it(bench):
    name, donor = bench.plates[:2]
    bench.push(name)
    watch = bench.watch()
    bench.settle(watch)
    alpha_before = watch.media[MEDIUM].runs[name].rows["fits"]["alpha_z_N_per_cm3"]
    (bench.raw / bench.logs(name)[0]).unlink()
    assert [facts["run_id"] for facts in facts_of_kind(bench.settle(watch), "withdrawn")] == [name]
    assert watch.state(MEDIUM, name) == "waiting"
    assert watch.media[MEDIUM].map is None
    bench.put(bench.logs(name)[0], bench.content(bench.logs(donor)[0]))
    assert [*states_of_pushes(bench.settle(watch))] == [name]
    alpha_after = watch.media[MEDIUM].runs[name].rows["fits"]["alpha_z_N_per_cm3"]
    assert alpha_after != alpha_before
    del bench.rows[name]
    bench.write_sheet()
    assert [facts["run_id"] for facts in facts_of_kind(bench.settle(watch), "withdrawn")] == [name]


def test_results_are_untouched_and_two_watches_agree(bench):
    bench.push(*bench.plates[:2])
    watch = bench.watch()
    bench.settle(watch)
    assert not (bench.root / "results").exists()
    assert_as_run(bench, watch)
    files = {path: path.stat().st_mtime_ns for path in bench.root.rglob("*")}
    second_bench = Bench(bench.root, bench.recorded)
    second_watch = bench.watch()
    second_bench.settle(second_watch)
    pd.testing.assert_frame_equal(watch.media[MEDIUM].alpha, second_watch.media[MEDIUM].alpha)
    files[bench.sheet] = bench.sheet.stat().st_mtime_ns
    assert {path: path.stat().st_mtime_ns for path in bench.root.rglob("*")} == files


def test_a_log_without_row_is_told_with_the_row_that_would_name_it(bench):
    name, loose = bench.plates[:2]
    bench.push(name)
    force = bench.logs(loose)[0]
    bench.put(force)
    watch = bench.watch()
    (event,) = [event for event in bench.settle(watch) if event.kind == "file"]
    facts = event.facts
    assert (facts["file"], facts["row"]) == (force, {"run_id": loose, "force_log": force})
    assert f"a row for it has run_id {loose}, force_log {force}" in event.summary()
    bench.push(loose)
    bench.settle(watch)
    assert watch.unnamed == {}


def test_the_next_pushes_are_rows_that_the_sheet_takes(bench):
    watch = bench.watch()
    bench.push(bench.plates[-1])
    bench.settle(watch)
    rows = watch.next_rows(watch.media[MEDIUM])
    assert [row["kind"] for row in rows] == ["plate", "rod"] * (len(rows) // 2)
    bench.rows |= {row["run_id"]: row for row in rows}
    bench.write_sheet()
    bench.settle(watch)
    assert watch.problems == {}
    assert {watch.state(MEDIUM, row["run_id"]) for row in rows} == {"waiting"}


def test_a_campaign_that_cannot_be_read_is_refused_and_later_waited_for(bench):
    bench.push(bench.plates[0])
    watch = bench.watch()
    bench.settle(watch)
    text = bench.config.read_text("utf-8")
    bench.config.write_text("title: nothing else\n", "utf-8")
    with pytest.raises(rftfit.RftfitError):
        bench.watch()
    assert {facts["severity"] for facts in facts_of_kind(bench.settle(watch), "problem")} == {
        "error"
    }
    bench.config.write_text(text, "utf-8")
    assert {facts["solved"] for facts in facts_of_kind(bench.settle(watch), "problem")} == {True}
    assert_as_run(bench, watch)


def test_a_push_straight_down_tells_the_clock_of_the_slanted_runs_before_it(tmp_path, monkeypatch):
    script = {"(-30, 0, 30), (90, 60, 45, 30), (1, 2, 3)": "(0,), (90, 45), (1, 2)"}
    root, _ = lay_out_home_rig(tmp_path, monkeypatch, script=script)
    log = root / "raw" / "b0_g90_2_stage.csv"
    content = log.read_bytes()
    log.unlink()
    watch = Watch(root / "config/config.yaml", wait_s=0)
    # checks, map and plan of the medium are not what is looked at
    monkeypatch.setattr(watch, "_report_media", lambda _: iter(()))
    list(watch.step())
    # 150 s after the only push straight down the drift is not known well enough
    slanted = watch.facts(watch.media["sand"], "b0_g45_1")
    assert slanted["state"] == "no alpha"
    assert re.search(r" monday .*\+2\.4", slanted["reason"])
    row = watch.media["sand"].runs["b0_g45_1"].rows["runs"]
    assert row["reason_code"] == "session-uncertain"
    log.write_bytes(content)
    list(watch.step())
    sand = watch.media["sand"]
    assert watch.facts(sand, "b0_g45_1")["state"] == "measured"
    assert sand.runs["b0_g45_1"].rows["runs"]["clock_pushes"] == 2
