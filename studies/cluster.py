"""Compare one campaign on this machine, on a Slurm cluster, and on one that loses a node: the same bytes.

``make cluster``: needs root, and Debian's packages slurm-wlm and munge. Controller and two nodes of one core run on this machine, in a temporary folder, and are
stopped at the end, whatever happens; /etc/slurm/slurm.conf is then as it was.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import frame
from campaigns import Folder, make_campaign
from slurmhost import CannotRun, SlurmHost, prepare

MEDIA = ("poppy_LP", "yuma")
# what this site needs beyond the project's profile: nodes of one core, and a cluster that keeps no
# accounts, so that only squeue knows what became of a job
SITE = "slurm-status-command: squeue\nslurm-no-account: true\n"
ONE_CORE = ("cores: 2\n", "cores: 1\n")
LOST = "n2"
PATIENCE_S = 3600


def site_profile(folder):
    """Write the project's profile with this site's lines, as a user would."""
    text = (frame.PROJECT / "profiles" / "slurm" / "config.yaml").read_text(encoding="utf-8")
    assert ONE_CORE[0] in text
    folder.mkdir()
    (folder / "config.yaml").write_text(text.replace(*ONE_CORE) + SITE, encoding="utf-8")
    return folder


def rftfit(folder, log, *words):
    """Start a command in a campaign's folder."""
    with log.open("wb") as out:
        return subprocess.Popen(
            [sys.executable, "-m", "rftfit", *words],
            cwd=folder.root,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
        )


def finish(child, log):
    """Wait for a command; stop with its words where it fails."""
    try:
        status = child.wait(timeout=PATIENCE_S)
    except BaseException:
        child.terminate()
        child.wait()
        raise
    if status:
        sys.exit(f"exit status {status}:\n{log.read_text(errors='replace')[-3000:]}")


def lose_a_node(host, child, after):
    """Wait until some jobs are done and one runs on a node, then end that node."""
    try:
        while child.poll() is None:
            done = host.jobs("-t", "COMPLETED")
            ages = host.jobs("-w", LOST, "-t", "RUNNING", form="%M")
            # a job that has come far enough to have written something
            if len(done) >= after and ages and ages[0] > "0:05":
                return host.kill_node(LOST)
            time.sleep(0.5)
    except BaseException:
        child.terminate()
        child.wait()
        raise
    return []


def main():
    """Run the comparison; exit status 1 where bytes differ."""

    def interrupt(*_):
        raise KeyboardInterrupt

    for name in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(name, interrupt)
    try:
        prepare()
        with tempfile.TemporaryDirectory(prefix="rftfit-cluster-") as folder:
            is_same = compare(Path(folder))
    except CannotRun as error:
        sys.exit(f"no cluster here: {error}")
    except KeyboardInterrupt:
        sys.exit("stopped; every job and daemon of this test has been ended")
    sys.exit(0 if is_same else 1)


def compare(root):
    """Run everything and print a row for each; True where all bytes are the same."""
    local_campaign = make_campaign(root / "campaign", MEDIA)
    copies = {name: Folder(root / name) for name in ("cluster", "lossy")}
    for copy in copies.values():
        shutil.copytree(local_campaign.root, copy.root)
    profile = site_profile(root / "site")
    same = True
    began, log = time.monotonic(), root / "local.log"
    finish(rftfit(local_campaign, log, "run", "--cores", "2"), log)
    print(f"this machine, 2 cores: {time.monotonic() - began:.0f} s", flush=True)
    for name, copy in copies.items():
        with SlurmHost(root / f"slurm-{name}").running() as host:
            began, log = time.monotonic(), root / f"{name}.log"
            child = rftfit(copy, log, "run", "--cluster", str(profile))
            hit = lose_a_node(host, child, 2) if name == "lossy" else []
            finish(child, log)
            jobs = len(host.jobs("-t", "all"))
        differing = frame.differing_files(local_campaign.digests(), copy.digests())
        lost = f", node lost under job {' '.join(hit)}" if hit else ""
        print(
            f"cluster, {jobs} jobs{lost}: {time.monotonic() - began:.0f} s; of "
            f"{len(local_campaign.digests())} files differ: {', '.join(differing) or 'none'}",
            flush=True,
        )
        if name == "lossy" and not hit:
            print("no node was lost: the run was over before")
        same &= not differing and bool(hit) == (name == "lossy")
    return same


if __name__ == "__main__":
    main()
