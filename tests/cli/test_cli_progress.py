"""Events of Snakemake become a count of jobs and the reason of each failed job.

The events are made here; Snakemake is not started.
"""

import json

import pytest

from rftfit.workflow.snakemake import Progress, describe_failure, failed_to_write

STOPPED = "At least one job did not complete successfully."
"""What Snakemake itself says of a failed job."""


def event(text="", **facts):
    return json.dumps({"snakemake": text, **facts})


def begun(number, rule):
    log = [f"results/logs/{rule}.log"]
    return event(event="job_info", jobid=number, rule_name=rule, log=log)


def ended(number, rule, status="returned non-zero exit status 2."):
    return [
        event(f"CalledProcessError in file Snakefile: Command 'x' {status}", event="error"),
        event(event="job_error", jobid=number, rule_name=rule, log=[f"results/logs/{rule}.log"]),
    ]


def watch(*lines):
    progress = Progress()
    for line in lines:
        progress.update_by(line)
    return progress


@pytest.fixture
def failure(tmp_path):
    """What is said of the jobs of some events, whose logs are in a folder."""
    return lambda *lines, status=1: describe_failure(watch(*lines), tmp_path, tmp_path, status)


def write_log(root, rule, text):
    path = root / "results" / "logs" / f"{rule}.log"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def test_jobs_are_counted():
    progress = Progress()
    lines = [
        event(event="run_info", stats={"total": 3}),
        begun(1, "ingest"),
        event(event="job_finished", job_id=1),
        event(event="progress", done=1, total=3),
        "a line",
    ]
    finished = [job.rule for line in lines if (job := progress.update_by(line))]
    assert finished == ["ingest"]
    assert (progress.done, progress.total, progress.plain) == (1, 3, ["a line"])
    assert not progress.nothing_to_do
    assert watch(event("Nothing to be done (all up to date).")).nothing_to_do
    assert watch(event("Error: Directory cannot be locked.", event="error")).locked


def test_each_failed_job_tells_what_is_in_its_log(tmp_path):
    write_log(tmp_path, "ingest", "rftfit ingest: sand_b/x.csv: empty\n  in row 3\n")
    write_log(tmp_path, "tare", "rftfit tare: no tare\n")
    progress = watch(
        event(event="run_info", stats={"total": 9}),
        begun(1, "ingest"),
        begun(3, "tare"),
        *ended(1, "ingest"),
        *ended(3, "tare"),
        *ended(3, "tare"),
        event(STOPPED, event="error"),
    )
    text = describe_failure(progress, tmp_path, tmp_path / "log", 1)
    assert text.splitlines()[:6] == [
        "the workflow stopped: 2 jobs failed; 0 of 9 are done, and what is done is kept.",
        "  ingest:",
        "    sand_b/x.csv: empty",
        "      in row 3",
        "  tare:",
        "    no tare",
    ]
    assert STOPPED not in text
    assert not failed_to_write(progress, tmp_path)


def test_a_traceback_becomes_its_last_line(failure, tmp_path):
    trace = 'Traceback (most recent call last):\n  File "a.py", line 1, in <module>\nValueError: no sand\n'
    write_log(tmp_path, "tare", trace)
    text = failure(begun(1, "tare"), *ended(1, "tare", "returned non-zero exit status 1."))
    assert "    ValueError: no sand\n    (an error that the program did not expect" in text
    assert "File " not in text


@pytest.mark.parametrize(
    ("status", "message"),
    [
        ("returned non-zero exit status 137.", "the memory was full"),
        ("died with <Signals.SIGKILL: 9>.", "the memory was full"),
        ("died with <Signals.SIGSEGV: 11>.", "ended by SIGSEGV"),
        ("returned non-zero exit status 7.", "no message; exit status 7"),
    ],
)
def test_jobs_that_say_nothing(failure, tmp_path, status, message):
    write_log(tmp_path, "tare", "")
    assert message in failure(begun(1, "tare"), *ended(1, "tare", status))


def on_slurm(number, rule):
    status = "SLURM-job '7' failed, SLURM status is: 'TIMEOUT'."
    error = event(event="job_error", jobid=number, rule_name=rule, rule_msg=status, indent=True)
    return [begun(number, rule), error]


def test_of_jobs_that_went_as_one_the_failed_one_is_named(failure, tmp_path):
    write_log(tmp_path, "slopes", "poppy: 3 of 4 runs\n")
    write_log(tmp_path, "tare", "rftfit tare: no tare\n  in row 3\n")
    jobs = [*on_slurm(1, "tare"), *on_slurm(2, "slopes")]
    text = failure(*jobs)
    assert text.splitlines()[1:4] == ["  tare:", "    no tare", "      in row 3"]
    assert "slopes" not in text
    write_log(tmp_path, "tare", "")
    text = failure(*jobs)
    assert text.splitlines()[1:3] == [
        "  one of tare, slopes:",
        "    no message; Slurm says TIMEOUT",
    ]


def test_a_job_whose_log_cannot_be_made(tmp_path):
    """Nothing of it was started: the shell said why in the user's language, and ended with 1."""
    refused = watch(begun(3, "page"), *ended(3, "page", "returned non-zero exit status 1."))
    text = describe_failure(refused, tmp_path, tmp_path, 1)
    assert "  page:\n    results/logs/page.log: cannot write: free some space" in text
    assert failed_to_write(refused, tmp_path)
    killed = watch(begun(3, "page"), *ended(3, "page", "returned non-zero exit status 137."))
    assert not failed_to_write(killed, tmp_path)
    write_log(tmp_path, "page", "")
    assert not failed_to_write(refused, tmp_path)
    full = watch(begun(3, "page"), *ended(3, "page", "returned non-zero exit status 3."))
    assert failed_to_write(full, tmp_path)


def test_a_stage_whose_log_is_full_speaks_among_the_lines_of_snakemake(failure, tmp_path):
    lines = ["rftfit tare: a: other", "rftfit page: page.html: cannot write; run again"]
    jobs = [*ended(3, "page"), *ended(4, "slopes")]
    write_log(tmp_path, "page", "")
    text = failure(begun(3, "page"), begun(4, "slopes"), *lines, *jobs)
    assert "  page:\n    page.html: cannot write; run again" in text
    assert "  slopes:\n    no message; exit status 2" in text


def test_two_jobs_fail_before_either_is_named():
    ends = [
        event(
            f"Command 'python -P -m rftfit.workflow.job results/state/{rule}.json --config c' returned non-zero exit status {code}.",
            event="error",
        )
        for rule, code in (("page", 3), ("slopes", 5))
    ]
    job_events = [ended(4, "slopes")[1], ended(3, "page")[1]]
    progress = watch(begun(3, "page"), begun(4, "slopes"), *ends, *job_events)
    assert {job.rule: job.status for job in progress.failed.values()} == {
        "page": "3",
        "slopes": "5",
    }
    unknown = [ended(number, "x", f"returned non-zero exit status {number}.") for number in (3, 4)]
    progress = watch(unknown[0][0], unknown[1][0], unknown[0][1], unknown[1][1])
    assert [job.status for job in progress.failed.values()] == ["3", "4"]


def test_snakemake_itself_fails(failure, tmp_path):
    full = "OSError: [Errno 28] No space left on device"
    assert ": No space left on device" in failure(full)
    assert failed_to_write(watch(full), tmp_path)
    assert not failed_to_write(watch("OSError: [Errno 2] No such file or directory"), tmp_path)
    assert not failed_to_write(watch(), tmp_path)
    assert "ended by SIGKILL" in failure(status=-9)
    assert "gave no reason" in failure()
