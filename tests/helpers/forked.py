"""Snakemake and its jobs, forked from a process that has imported what they import.

A whole run starts Python twice, for Snakemake and for the process that jobs are forked from
(`rftfit.workflow.preload`), and their imports take as long as the jobs of a small campaign. Commands that
`makers.run_command` runs have both as forks; tests of processes start theirs as a user does.

The forkserver of `multiprocessing` makes the forks: it has one thread, as the process of the tests has not.
"""

import contextlib
import json
import multiprocessing
import os
import runpy
import socket
import subprocess
import sys
from functools import cache, partial
from multiprocessing import forkserver, util
from unittest.mock import patch

SNAKEMAKE = [sys.executable, "-P", "-m", "snakemake"]
PRELOADED = "rftfit.workflow.preload"
STANDARD = (0, 1, 2)
"""File descriptors of the standard streams."""
ENVIRONMENT = dict(os.environ)
LONGEST_MESSAGE = 100_000
MOST_DESCRIPTORS = 16


@contextlib.contextmanager
def snakemake_forked():
    """Let ``python -P -m snakemake`` be a fork, where the system has forks."""
    if sys.platform != "linux":
        yield
        return
    _start_server()
    with patch.object(subprocess, "Popen", partial(_start, subprocess.Popen)):
        yield


@cache
def _start_server():
    """Start the process that is forked, with the environment that this module was imported in.

    Its folder is none of a test, since such a folder goes before the process ends.
    """
    forkserver.set_forkserver_preload(["snakemake.cli", PRELOADED])
    with contextlib.chdir("/"), patch.dict(os.environ, ENVIRONMENT, clear=True):
        forkserver.ensure_running()


def _start(start_program, words, *positional, **options):
    if list(words[: len(SNAKEMAKE)]) != SNAKEMAKE:
        return start_program(words, *positional, **options)
    return _Snakemake(words[len(SNAKEMAKE) :], options["cwd"], options["env"])


class _Snakemake:
    """What `subprocess.Popen` is of a process: as much of it as `rftfit run` uses."""

    def __init__(self, words, folder, environment):
        reads, writes = multiprocessing.Pipe(duplex=False)
        self._process = multiprocessing.get_context("forkserver").Process(
            target=run_snakemake, args=(words, writes, folder, environment)
        )
        self._process.start()
        writes.close()
        self.pid = self._process.pid
        self.stdout = os.fdopen(os.dup(reads.fileno()), "rb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stdout.close()
        self.wait()

    def wait(self, timeout=None):
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("snakemake", timeout)
        return self._process.exitcode

    def communicate(self, timeout=None):
        self.wait(timeout)

    def poll(self):
        return self._process.exitcode


def run_snakemake(words, writes, folder, environment):
    """In the fork: be the process that `rftfit run` starts."""
    os.setsid()
    for descriptor in STANDARD[1:]:
        os.dup2(writes.fileno(), descriptor)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    begin = _fork_server_to_be()
    start = partial(_begin_or_start, util.spawnv_passfds, begin)
    with patch.object(util, "spawnv_passfds", start):
        sys.argv = ["snakemake", *words]
        runpy.run_module("snakemake", run_name="__main__", alter_sys=True)


def _fork_server_to_be():
    """Fork the process that jobs are forked from, before Snakemake has threads.

    Returns
    -------
    callable
        Lets that process begin with the code and the file descriptors that `multiprocessing` gives it, and
        returns its process id.
    """
    asks, is_asked = socket.socketpair()
    process_id = os.fork()
    if process_id == 0:
        try:
            asks.close()
            _serve_when_asked(is_asked)
        finally:
            os._exit(0)
    is_asked.close()

    def begin(code, descriptors):
        message = json.dumps({"code": code, "descriptors": descriptors}).encode()
        socket.send_fds(asks, [message], descriptors)
        return process_id

    return begin


def _begin_or_start(start_program, begin, path, words, descriptors):
    """Let the process that jobs are forked from begin; start others as `multiprocessing` does."""
    if PRELOADED not in words[-1]:
        return start_program(path, words, descriptors)
    return begin(words[-1], [*map(int, descriptors)])


def _serve_when_asked(is_asked):
    """In the fork of the fork: be the process that `multiprocessing` starts, once Snakemake asks for it."""
    message, received, *_ = socket.recv_fds(is_asked, LONGEST_MESSAGE, MOST_DESCRIPTORS)
    if not message:
        return
    asked = json.loads(message)
    # numbers that are free in both lists: the code names those that its file descriptors had
    spare = max([*received, *asked["descriptors"]]) + 1
    for number, descriptor in enumerate(received):
        os.dup2(descriptor, spare + number)
    for number, descriptor in enumerate(asked["descriptors"]):
        os.dup2(spare + number, descriptor)
    lowest = max(STANDARD) + 1
    for descriptor in sorted(asked["descriptors"]):
        os.closerange(lowest, descriptor)
        lowest = descriptor + 1
    os.closerange(lowest, os.sysconf("SC_OPEN_MAX"))
    sys.modules.pop(PRELOADED)  # what it does at its import is done anew
    exec(asked["code"], {"__name__": "__main__"})  # noqa: S102 (code of `multiprocessing`)
