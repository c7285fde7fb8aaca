"""Snakemake, forked from the process of the tests, which has imported what Snakemake and its jobs import.

A whole run starts Python twice, for Snakemake and for the process that jobs are forked from
(`rftfit.workflow.preload`), and their imports take as long as the jobs of a small campaign. Commands that
`makers.run_command` runs have both as forks; tests of processes start theirs as a user does.
"""

import contextlib
import logging
import multiprocessing
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import warnings
from functools import cache, partial
from multiprocessing import util
from unittest.mock import patch

SNAKEMAKE = [sys.executable, "-P", "-m", "snakemake"]
PRELOADED = "rftfit.workflow.preload"
STANDARD = {"stdin": 0, "stdout": 1, "stderr": 2}
"""Name and file descriptor of the standard streams."""


@contextlib.contextmanager
def snakemake_forked():
    """Let ``python -P -m snakemake`` be a fork of this process, where the system has forks."""
    if sys.platform != "linux":
        yield
        return
    with tempfile.TemporaryDirectory() as scratch:
        start = partial(_start, subprocess.Popen, scratch)
        with patch.object(subprocess, "Popen", start):
            yield


def _start(start_program, scratch, words, *positional, **options):
    if list(words[: len(SNAKEMAKE)]) != SNAKEMAKE:
        return start_program(words, *positional, **options)
    return _Snakemake(words[len(SNAKEMAKE) :], scratch, options["cwd"], options["env"])


class _Snakemake:
    """What `subprocess.Popen` is of a process: as much of it as `rftfit run` uses."""

    def __init__(self, words, scratch, folder, environment):
        _import_snakemake()
        reads, writes = os.pipe()
        self._process = multiprocessing.get_context("fork").Process(
            target=_run_snakemake, args=(words, writes, scratch, folder, environment)
        )
        self._process.start()
        os.close(writes)
        self.pid = self._process.pid
        self.stdout = os.fdopen(reads, "rb")

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


@cache
def _import_snakemake():
    """Import it once in this process, with the warnings that Python has by itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import snakemake.cli  # noqa: F401


def _run_snakemake(words, writes, scratch, folder, environment):
    """In the child: be the process that `rftfit run` starts."""
    os.setsid()
    os.dup2(writes, STANDARD["stdout"])
    os.dup2(writes, STANDARD["stderr"])
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    tempfile.tempdir = scratch
    _forget_tests()
    with patch.object(util, "spawnv_passfds", partial(_fork_server, util.spawnv_passfds)):
        sys.argv = ["snakemake", *words]
        runpy.run_module("snakemake", run_name="__main__", alter_sys=True)


def _forget_tests():
    """Take off what pytest and its plug-ins have put onto this process."""
    sys.settrace(None)
    logging.root.handlers.clear()
    warnings.resetwarnings()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for name, descriptor in STANDARD.items():
        mode, buffering = ("r", -1) if name == "stdin" else ("w", 1)
        stream = open(descriptor, mode, buffering, encoding="utf-8", closefd=False)  # noqa: SIM115
        setattr(sys, name, stream)


def _fork_server(start_program, path, words, descriptors):
    """Start the process that jobs are forked from as a fork, too; others as `multiprocessing` does."""
    if PRELOADED not in words[-1]:
        return start_program(path, words, descriptors)
    process_id = os.fork()
    if process_id == 0:
        try:
            _serve_forks(words[-1], descriptors)
        finally:
            os._exit(0)
    return process_id


def _serve_forks(code, descriptors):
    """In the grandchild: be the process that `multiprocessing` starts."""
    lowest = max(STANDARD.values()) + 1
    for descriptor in sorted(descriptors):
        os.closerange(lowest, descriptor)
        lowest = descriptor + 1
    os.closerange(lowest, os.sysconf("SC_OPEN_MAX"))
    sys.modules.pop(PRELOADED, None)  # what it does at its import is done anew
    exec(code, {"__name__": "__main__"})  # noqa: S102 (code of `multiprocessing`)
