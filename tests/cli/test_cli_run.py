"""`rftfit run` does the jobs of a workflow, tells why one failed, and leaves no process behind.

A tiny workflow stands in for the real one; the real Snakemake runs it.
"""

import os
import signal
import subprocess
import sys
from typing import Any

import pytest
from forked import snakemake_forked
from waiting import ASLEEP_S, LONGEST_S, wait_for

import rftfit as package
from rftfit.workflow.snakemake import _signals_as_interrupts, find_snakemakes

WORKFLOW = """
import os
BAD, MEDIA = os.environ.get("BAD", ""), ["a", "b"]
rule all:
    input: "results/ledger.csv"
rule ingest:
    output: "results/{medium}.txt"
    params: campaign=config["campaign"]
    log: "results/logs/ingest_{medium}.log"
    shell:
        "(if [ {wildcards.medium} = '{BAD}' ]; then "
        "echo 'rftfit ingest: raw/{wildcards.medium}.csv: no good' >&2; "
        "echo '  and so on' >&2; exit 2; fi; echo {params.campaign:q} > {output}) 2> {log}"
rule ledger:
    input: expand("results/{medium}.txt", medium=MEDIA)
    output: "results/ledger.csv"
    log: "results/logs/ledger.log"
    shell:
        "(echo run_id,kind,fate,reason_code,rows > {output}; echo p1,plate,used,slope,3 >> {output}; "
        "echo p1,plate,dropped,approach,2 >> {output}; echo p2,plate,used,path,1 >> {output}; "
        "echo p2,plate,dropped,bad,3 >> {output}; echo p2,plate,lost,packets,8 >> {output}"
        ") 2> {log}"
"""
SLOW = f"""
rule all:
    output: "results/slow.txt"
    shell: "touch results/began; sleep {ASLEEP_S}; touch {{output}}"
"""


@pytest.fixture
def fake(campaign):
    """Words that run the tiny workflow by forks of a Snakemake that is started once."""
    (campaign / "fake.smk").write_text(WORKFLOW, "utf-8")
    with snakemake_forked():
        yield "run --snakefile fake.smk"


def test_whole_run_and_nothing_to_do(rftfit, campaign, fake):
    output = rftfit(fake, "--cores 2")
    lines = output.out.splitlines()
    assert sorted(line[6:] for line in lines[:2]) == ["ingest a", "ingest b"]
    assert [line[6:] for line in lines[2:4]] == ["ledger", "all"]
    assert [line[:5] for line in lines[:4]] == ["[1/4]", "[2/4]", "[3/4]", "[4/4]"]
    assert lines[4:] == [
        "Done: 4 jobs.",
        # jobs that leave no record: nobody knows whether their files are up to date, so none is summed up
        "Not made by this campaign, and left as they are: results/a.txt, results/b.txt, results/ledger.csv.",
    ]
    assert (campaign / "results/a.txt").read_text().strip() == "config/config.yaml"
    assert '"progress"' in (campaign / "results/logs/snakemake.log").read_text()

    output = rftfit(fake)
    assert output.out.startswith(
        "Nothing to do: all results are up to date.\nNot made by this campaign"
    )


@pytest.mark.slow
def test_dry_run_targets_and_words_for_snakemake(rftfit, campaign, fake):
    (campaign / "raw/paper/yuma/yuma_c_leg_force.csv").unlink()
    output = rftfit(fake, "--dry-run")
    assert output.err == "1 warning on the campaign; `rftfit check` shows them.\n"
    assert output.out.startswith("At most 4 jobs:")
    assert output.out.splitlines()[2].split() == ["ingest", "2"]
    assert not (campaign / "results").exists()
    output = rftfit(fake, "results/b.txt -- --force")
    assert output.out.splitlines()[:2] == ["[1/1] ingest b", "Done: 1 job."]
    output = rftfit(fake, "-- --list-rules")
    assert {"all", "ingest", "ledger"} <= set(output.out.split())


def test_a_stage_that_fails(rftfit, campaign, fake, monkeypatch):
    monkeypatch.setenv("BAD", "b")
    monkeypatch.setattr("rftfit.workflow.run.find_snakefile", lambda: campaign / "fake.smk")
    stopped: Any
    with pytest.raises(package.RftfitError) as stopped:
        package.run(campaign, cores=1)
    assert stopped.value.exit_code == 4
    assert stopped.value.report.made == ["ingest a"]
    assert stopped.value.report.failed == {"ingest b": "raw/b.csv: no good\n  and so on"}
    output = rftfit(fake, "--cores 1", code=4)
    assert output.err == (
        "rftfit: the workflow stopped: 1 job failed; 0 of 3 are done, and what is done is kept.\n"
        "  ingest b:\n    raw/b.csv: no good\n      and so on\n"
        "The whole log: results/logs/snakemake.log\n"
    )
    assert (campaign / "results/a.txt").is_file()
    assert '"job_error"' in (campaign / "results/logs/snakemake.log").read_text()


def test_failures_before_any_job(rftfit, campaign, fake):
    output = rftfit(fake, "nowhere.txt", code=4)
    assert "stopped before any job" in output.err
    assert "No rule to produce nowhere.txt" in output.err
    (campaign / "fake.smk").write_text("raise ValueError('no such sand')\n")
    assert "no such sand" in rftfit(fake, code=4).err


def test_a_bad_sheet_runs_nothing(refusal, campaign, fake):
    sheet = campaign / "raw/paper/runs.csv"
    text = sheet.read_text("utf-8")
    sheet.write_text(text.replace(",yuma,plate,", ",yumma,plate,"), "utf-8")
    err = refusal(fake)
    assert "2 errors:" in err
    assert "rows 5, 6" in err
    assert err.count("did you mean 'yuma'?") == 1
    assert not (campaign / "results").exists()
    assert not (campaign / ".snakemake").exists()


@pytest.mark.parametrize("word", ["--config", "-C", "--snakefile=x", "-d"])
def test_words_that_rftfit_sets_itself(refusal, campaign, fake, word):
    assert f"found {word} after the two dashes" in refusal(fake, "--", word, "a=b")
    assert not (campaign / ".snakemake").exists()


@pytest.mark.slow
def test_a_lock_that_was_left(rftfit, campaign, fake):
    locks = campaign / ".snakemake" / "locks"
    locks.mkdir(parents=True)
    (locks / "0.output.lock").write_text(f"{campaign / 'results/a.txt'}\nresults/a.txt\n")
    output = rftfit(fake, code=4)
    assert "is locked" in output.err
    assert "rftfit run --unlock" in output.err
    assert "No lock is left" in rftfit(fake, "--unlock").out
    assert not list(locks.glob("*"))


def test_a_log_that_cannot_be_written(rftfit, campaign, fake):
    (campaign / "results").write_text("")
    assert "snakemake.log: cannot write" in rftfit(fake, code=3).err


@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopping_stops_the_children(campaign, number):
    (campaign / "slow.smk").write_text(SLOW)
    words = ["-m", "rftfit", "run", "--snakefile", "slow.smk"]
    # as of a shell's script in the background, whose children are deaf to SIGINT
    deaf = signal.SIG_IGN if number == signal.SIGTERM else signal.SIG_DFL
    old_handler = signal.signal(signal.SIGINT, deaf)
    with subprocess.Popen(
        [sys.executable, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        signal.signal(signal.SIGINT, old_handler)
        wait_for((campaign / "results/began").exists)
        root = campaign.resolve()
        assert len(find_snakemakes(root)) == 1
        child.send_signal(number)
        out, err = child.communicate(timeout=LONGEST_S)
    assert (child.returncode, out) == (130, "")
    assert (
        err
        == "Stopped. Results that were finished are kept; to go on, give the same command again.\n"
    )
    assert find_snakemakes(root) == []
    assert not (campaign / "results/slow.txt").exists()
    assert not list((campaign / ".snakemake").glob("locks/*"))


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this signal is POSIX's")
def test_a_run_under_nohup_stays_when_its_terminal_closes():
    old_handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with _signals_as_interrupts():
            signal.raise_signal(signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGHUP, old_handler)


def test_without_a_snakefile_nothing_is_run(refusal, monkeypatch, campaign, tmp_path):
    monkeypatch.setattr("rftfit.store.environment.PACKAGE", tmp_path)
    assert "Snakefile: not there" in refusal("run")
    assert not (campaign / ".snakemake").exists()


@pytest.mark.usefixtures("campaign")
def test_the_lock_of_a_run_that_goes_on_is_left(rftfit, monkeypatch):
    processes = [12, 34]
    monkeypatch.setattr("rftfit.workflow.run.find_snakemakes", lambda _: processes)
    assert "(process 12, 34)" in rftfit("run --unlock", code=4).err
    processes.clear()

    def refuse(_words, _log, tell):
        tell("no room left")
        return 1

    monkeypatch.setattr("rftfit.workflow.run.run_snakemake", refuse)
    assert "no room left" in rftfit("run --unlock", code=4).err
