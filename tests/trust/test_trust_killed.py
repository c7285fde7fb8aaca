"""A killed run leaves no half-written file and no process, and the next run continues by itself.

`make killed` does the same to the real workflow, at random moments.
"""

import os
import re
import signal
import subprocess
import sys
from typing import Any

import pytest
from campaigns import make_campaign
from paper import PROJECT
from waiting import ASLEEP_S, LONGEST_S, wait_for

from rftfit.store import write_text
from rftfit.store.files import is_temporary
from rftfit.workflow.processes import end_with_parent, stale_lock

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")

HALF = """
import os, signal, sys
from rftfit.store import atomic_path
with atomic_path(sys.argv[1]) as path:
    path.write_text("hal")
    print("half", flush=True)
    if sys.argv[2:] == ["live"]:
        sys.stdin.read()
    os.kill(os.getpid(), signal.SIGKILL)
"""
WRITES = "import sys; from rftfit.store import write_text; write_text(sys.argv[1], '')"
LOCKS = """
import pathlib, sys
from rftfit.workflow.processes import hold_lock
hold_lock(pathlib.Path(sys.argv[1]))
print("holds", flush=True)
sys.stdin.read()
"""
CHILD = f"""
import sys, time
from rftfit.workflow.processes import end_with_parent
assert end_with_parent()
print("watching", flush=True)
time.sleep({ASLEEP_S})
"""
PARENT = """
import os, subprocess, sys
subprocess.Popen([sys.executable, "-c", sys.argv[1]], env={**os.environ, "RFTFIT_PARENT": str(os.getpid())})
sys.stdin.read()
"""
WORKFLOW = """
from rftfit.workflow.processes import hold_lock
from rftfit.workflow.processes import SHELL_PREFIX, end_group, end_with_parent
end_with_parent(end_group)
shell.prefix(SHELL_PREFIX)
onstart:
    hold_lock(Path(".snakemake"))
rule all:
    input: "results/first.txt", "results/second.txt"
rule first:
    output: "results/first.txt"
    shell: "python stage.py {output}"
rule second:
    input: "results/first.txt"
    output: "results/second.txt"
    shell: "python stage.py {output}"
"""
STAGE = f"""
import os, sys, time
from rftfit.store import write_text
from rftfit.workflow.processes import end_with_parent
assert end_with_parent()
if not os.path.exists("go") and sys.argv[1].endswith("second.txt"):
    write_text("began", "")
    time.sleep({ASLEEP_S})
    write_text("results/orphan.txt", "")
write_text(sys.argv[1], "done")
"""


def killed_midway(target):
    process = subprocess.run([sys.executable, "-c", HALF, target], capture_output=True, check=False)
    assert process.returncode == -signal.SIGKILL, process.stderr


def rests(folder):
    return [path.name for path in folder.iterdir() if is_temporary(path.name)]


def test_killed_while_it_writes(tmp_path):
    target = tmp_path / "alpha.csv"
    killed_midway(target)
    assert not target.exists()
    (leftover,) = rests(tmp_path)
    write_text(target, "old")
    # the first write into a folder clears what is left there
    assert rests(tmp_path) == []
    killed_midway(target)
    assert target.read_text(encoding="utf-8") == "old"
    assert rests(tmp_path) != [leftover]


def test_what_a_living_process_writes_is_not_cleared_away(tmp_path):
    words = [sys.executable, "-c", HALF, str(tmp_path / "alpha.csv"), "live"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        (tmp_path / ".alpha.1.part.csv").write_text("a dead one's")
        (tmp_path / ".alpha.csv").write_text("the user's")
        (tmp_path / ".link.1.part.csv").symlink_to(tmp_path / ".alpha.csv")
        write_text(tmp_path / "beta.csv", "")
        assert sorted(rests(tmp_path)) == [f".alpha.{child.pid}.part.csv", ".link.1.part.csv"]
        child.kill()
    subprocess.run([sys.executable, "-c", WRITES, str(tmp_path / "beta.csv")], check=True)
    assert rests(tmp_path) == [".link.1.part.csv"]
    assert (tmp_path / ".alpha.csv").read_text(encoding="utf-8") == "the user's"


def test_an_orphan_ends_itself():
    with subprocess.Popen(
        [sys.executable, "-c", PARENT, CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as parent:
        assert parent.stdout is not None
        assert parent.stdout.readline() == b"watching\n"
        parent.kill()
        # the orphan, which would sleep for long, holds the pipes: they end with it
        assert b"ended, since the workflow" in parent.communicate(timeout=LONGEST_S)[1]


def test_whose_parent_ended_before_it_looked(monkeypatch):
    ended_process = subprocess.Popen([sys.executable, "-c", ""])
    ended_process.wait()
    ends: list[bool] = []
    monkeypatch.setenv("RFTFIT_PARENT", str(ended_process.pid))
    assert not end_with_parent(lambda: ends.append(True))
    assert ends == [True]


@pytest.fixture
def locked(tmp_path):
    """A folder that a process has locked and noted, which has died since."""
    (tmp_path / "locks").mkdir()
    (tmp_path / "locks" / "0.output.lock").write_text("results/alpha.csv\n")
    subprocess.run([sys.executable, "-c", LOCKS, tmp_path], check=True, stdin=subprocess.DEVNULL)
    return tmp_path


def is_certain(folder):
    with stale_lock(folder) as certain:
        return certain


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells one start from another")
def test_only_what_is_certain_is_taken_for_the_dead_ones(locked):
    note, lock = locked / "rftfit" / "holder", locked / "locks" / "0.output.lock"
    text = note.read_text(encoding="utf-8")
    host, _, start = text.partition("\n")
    with stale_lock(locked) as is_first_stale, stale_lock(locked) as is_second_stale:
        assert (is_first_stale, is_second_stale) == (True, False)
    # another computer, or the same one started anew
    for holder_text in (f"elsewhere\n{start}", f"{host}\n1-2\n", ""):
        note.write_text(holder_text, encoding="utf-8")
        assert not is_certain(locked)
    note.write_text(text, encoding="utf-8")
    assert is_certain(locked)
    # a lock that came after the note is somebody else's
    os.utime(lock, ns=(0, note.stat().st_mtime_ns + 1))
    assert not is_certain(locked)
    for file in (lock, note):
        file.unlink()
        assert not is_certain(locked)


def test_the_lock_of_a_living_process_is_left(locked):
    words = [sys.executable, "-c", LOCKS, str(locked)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        assert child.stdout is not None
        child.stdout.readline()
        assert not is_certain(locked)


def test_every_rule_is_one_program():
    """The prefix of the shell puts it in the shell's place: no second command could follow."""
    texts = [path.read_text(encoding="utf-8") for path in (PROJECT / "workflow").rglob("*.smk")]
    shared = sum(len(re.findall(r"^use rule stage as ", text, re.MULTILINE)) for text in texts)
    rule_names = [name for text in texts for name in re.findall(r"^rule (\w+)", text, re.MULTILINE)]
    # the target of all printed figures runs nothing
    assert rule_names == ["printed", "stage"]
    assert shared >= 19
    (block,) = (
        text for content in texts for text in re.findall(r"\n +shell:\n((?: +.+\n)+)", content)
    )
    command = "".join(re.findall(r'"([^"\n]*)"', block))
    assert command.startswith("python -P -m rftfit.workflow.job ")
    assert command.endswith(" 2> {log:q}")
    assert not set("|;&<`$") & set(command)


@pytest.fixture
def fake(tmp_path):
    root = make_campaign(tmp_path / "camp é", ("yuma",), plates_only=True).root
    (root / "Snakefile").write_text(WORKFLOW, encoding="utf-8")
    (root / "stage.py").write_text(STAGE, encoding="utf-8")
    return root


def rftfit_run(root):
    words = ["rftfit", "run", "--snakefile", "Snakefile", "--cores", "1"]
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-m", *words], cwd=root, **pipes)


@pytest.mark.slow
def test_a_killed_run_leaves_no_orphan_and_goes_on_by_itself(fake):
    """Both at once: nobody is left to tell the stage, or to clear the lock."""
    from harm import living, working

    child = rftfit_run(fake)
    wait_for((fake / "began").exists)
    processes = living(child)
    assert processes.snakemake is not None
    # the run, Snakemake and the stage
    assert len(working(fake)) == 3
    processes.run.kill()
    processes.snakemake.kill()
    wait_for(lambda: not working(fake))
    child.communicate(timeout=LONGEST_S)
    assert not (fake / "results/orphan.txt").exists()
    assert not (fake / "results/second.txt").exists()
    assert list((fake / ".snakemake/locks").glob("*"))
    (fake / "go").touch()
    out, err = rftfit_run(fake).communicate()
    assert " lock " in err
    assert "[1/2] second" in out
    assert (fake / "results/second.txt").read_text(encoding="utf-8") == "done"
