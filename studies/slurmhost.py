"""A Slurm controller and two nodes of one core each on this machine, for as long as a test takes."""

import contextlib
import ctypes
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import psutil

CONF = Path("/etc/slurm/slurm.conf")
NODES = ("n1", "n2")
PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "scancel", "squeue", "sinfo")
_PORTS = {"n1": 16821, "n2": 16822}
_CONTROLLER_PORT = 16820
_PR_SET_CHILD_SUBREAPER = 36


class CannotRun(Exception):
    """A cluster cannot be made of this machine; the message says why."""


def prepare():
    """See that this machine can be a cluster.

    Raises
    ------
    CannotRun
    """
    if sys.platform != "linux" or os.geteuid() != 0:
        raise CannotRun("it needs Linux and root: Slurm's daemons start jobs as other users")
    if not Path("/sys/fs/cgroup").is_mount() and not any(Path("/sys/fs/cgroup").iterdir()):
        raise CannotRun("/sys/fs/cgroup is not mounted, and slurmd needs it")
    if {"slurmctld", "slurmd"} & {p.info["name"] for p in psutil.process_iter(["name"])}:
        raise CannotRun("Slurm is running here already; it will not be disturbed")
    if any(shutil.which(name) is None for name in PROGRAMS):
        raise CannotRun("Slurm or munge is not installed: apt-get install slurm-wlm munge")


class SlurmHost:
    """Daemons of one cluster, all children of this process.

    Parameters
    ----------
    folder : Path
        For its keys, sockets, logs and state.
    """

    def __init__(self, folder):
        self.folder = folder
        self.daemons: dict[str, subprocess.Popen[bytes]] = {}
        self._found: Path | None = None

    def start(self):
        """Start everything and wait until both nodes take jobs."""
        self.folder.mkdir(parents=True)
        # what a daemon leaves behind becomes a child of this process, and so can be found again
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o400)
        for name in ("state", *(f"spool-{node}" for node in NODES)):
            (self.folder / name).mkdir()
        conf = self.folder / "slurm.conf"
        conf.write_text(self._conf(), encoding="utf-8")
        self._put_conf(conf)
        self._daemon(
            "munged",
            "munged",
            "--foreground",
            "--force",
            f"--key-file={key}",
            f"--socket={self.socket}",
            f"--pid-file={self.folder / 'munged.pid'}",
            f"--log-file={self.folder / 'munged.log'}",
            f"--seed-file={self.folder / 'munged.seed'}",
        )
        self._wait(self.socket.exists, "munged")
        self._daemon("slurmctld", "slurmctld", "-D", "-c")
        for node in NODES:
            self._daemon(node, "slurmd", "-D", "-c", "-N", node)
        self._wait(lambda: self.states() == dict.fromkeys(NODES, "idle"), "the two nodes")

    @property
    def socket(self):
        """Socket of munge."""
        return self.folder / "munge.socket"

    def _conf(self):
        host = socket.gethostname().partition(".")[0]
        memory = min(8000, psutil.virtual_memory().total // 2**20 // 2)
        folder = self.folder
        nodes = (
            f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={_PORTS[node]} "
            f"CPUs=1 RealMemory={memory}\n"
            for node in NODES
        )
        return f"""\
ClusterName=rftfit
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={_CONTROLLER_PORT}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={self.socket}
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
SwitchType=switch/none
MinJobAge=3600
SlurmctldTimeout=30
SlurmdTimeout=30
{"".join(nodes)}\
PartitionName=main Nodes={",".join(NODES)} Default=YES MaxTime=INFINITE State=UP
"""

    def _put_conf(self, conf):
        # the jobs' own srun looks here, whatever SLURM_CONF says
        CONF.parent.mkdir(exist_ok=True)
        if CONF.exists() or CONF.is_symlink():
            aside = CONF.with_name(f"slurm.conf.aside-{os.getpid()}")
            CONF.rename(aside)
            self._found = aside
        CONF.symlink_to(conf)

    def _take_conf_away(self):
        if CONF.is_symlink() and CONF.readlink() == self.folder / "slurm.conf":
            CONF.unlink()
        if self._found is not None:
            self._found.rename(CONF)
            self._found = None

    def _daemon(self, name, *command):
        with (self.folder / f"{name}.out").open("wb") as out:
            self.daemons[name] = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
            )

    def _wait(self, ready, what, seconds=60.0):
        end = time.monotonic() + seconds
        assert callable(ready)
        while not ready():
            dead = [name for name, child in self.daemons.items() if child.poll() is not None]
            if dead or time.monotonic() > end:
                logs = "\n".join(
                    path.read_text(errors="replace")[-500:]
                    for path in sorted(self.folder.glob("*.out"))
                )
                raise CannotRun(f"{what} did not come up (ended: {dead})\n{logs}")
            time.sleep(0.3)

    def states(self):
        """State of each node."""
        lines = _printed_lines("sinfo", "-h", "-N", "-o", "%N %T")
        return dict(line.split() for line in lines if line.strip())

    def jobs(self, *words, form="%i"):
        """Jobs as ``squeue`` lists them, those that have ended too where asked for."""
        return _printed_lines("squeue", "-h", "-o", form, *words)

    def kill_node(self, node):
        """End a node as a power cut would: its daemon, its jobs, all at once.

        Returns
        -------
        list of str
            Jobs that ran there.
        """
        hit = self.jobs("-w", node, "-t", "RUNNING")
        daemon = self.daemons.pop(node)
        daemon.kill()
        daemon.wait()
        steps = []
        for process in psutil.Process().children(recursive=True):
            with contextlib.suppress(psutil.Error):
                title = re.match(r"slurmstepd: \[(\d+)\.", " ".join(process.cmdline()))
                if title and title[1] in hit:
                    process.suspend()
                    steps.append(process)
        for process in steps:
            _kill_tree(process)
        return hit

    def stop(self):
        """End every job and daemon, and put the machine's own configuration back."""
        try:
            if self.daemons:
                with contextlib.suppress(OSError, subprocess.TimeoutExpired):
                    subprocess.run(
                        ["scancel", "--me"], check=False, timeout=10, capture_output=True
                    )
                    time.sleep(1.0)
            for child in self.daemons.values():
                child.terminate()
            for child in self.daemons.values():
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(timeout=10)
            for process in psutil.Process().children(recursive=True):
                with contextlib.suppress(psutil.Error):
                    if process.name().startswith(("slurm", "munge")):
                        _kill_tree(process)
            self.daemons.clear()
        finally:
            self._take_conf_away()

    @contextlib.contextmanager
    def running(self):
        """Start; stop at the end, whatever happens."""
        try:
            self.start()
            yield self
        finally:
            self.stop()


def _printed_lines(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.splitlines()


def _kill_tree(process):
    # stopped first, itself before its children: it must not report that they ended, as after a power cut
    for member in [process, *process.children(recursive=True)]:
        with contextlib.suppress(psutil.Error):
            member.suspend()
    for member in [*process.children(recursive=True), process]:
        with contextlib.suppress(psutil.Error):
            member.kill()
