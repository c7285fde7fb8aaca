"""Snakemake, forked from the process of the tests, which has imported what Snakemake and its jobs import.

A whole run starts Python twice, for Snakemake and for the process that jobs are forked from
(`rftfit.workflow.preload`), and their imports take several times as long as the jobs of a small campaign. Commands
that `makers.run_command` runs have both as forks; tests of processes start theirs as a user does.
"""

import atexit
import contextlib
import inspect
import logging
import os
import runpy
import signal
import subprocess
import sys
import traceback
import warnings
import weakref
from functools import cache
from multiprocessing import forkserver, resource_tracker, util
from unittest.mock import patch

SNAKEMAKE = ["-P", "-m", "snakemake"]
PRELOADED = "rftfit.workflow.preload"
LOWEST_OTHER = 3
"""First file descriptor behind the standard ones."""


_SIGNATURE = inspect.signature(subprocess.Popen._execute_child)


def snakemake_forked():
    """Return a context in which ``python -P -m snakemake`` is a fork of this process."""
    if not hasattr(os, "fork") or sys.platform != "linux":
        return contextlib.nullcontext()
    return patch.object(subprocess, "Popen", _ForkedPopen)


class _ForkedPopen(subprocess.Popen):
    """A process; Snakemake's is forked and does not start Python anew."""

    def _execute_child(self, *positional):
        options = _SIGNATURE.bind(self, *positional).arguments
        words = options["args"]
        if isinstance(words, str) or list(words[:4]) != [sys.executable, *SNAKEMAKE]:
            super()._execute_child(*positional)
            return
        _import_snakemake()
        for stream in (sys.__stdout__, sys.__stderr__):
            stream.flush()
        self.pid = os.fork()
        if self.pid == 0:
            _run_in_child(lambda: _run_snakemake(options, words[4:]))
        self._child_created = True
        self._close_pipe_fds(
            *(options[name] for name in ("p2cread", "p2cwrite", "c2pread")),
            *(options[name] for name in ("c2pwrite", "errread", "errwrite")),
        )


@cache
def _import_snakemake():
    """Import it once in this process, with the warnings that Python has by itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import snakemake.cli


def _run_snakemake(options, words):
    """In the child: be the process that `subprocess` would have started."""
    if options["start_new_session"]:
        os.setsid()
    _keep_descriptors(options["p2cread"], options["c2pwrite"], options["errwrite"])
    os.chdir(options["cwd"])
    os.environ.clear()
    os.environ.update(options["env"])
    sys.argv = ["snakemake", *words]
    runpy.run_module("snakemake", run_name="__main__", alter_sys=True)


def _run_in_child(work):
    """Do the work of a fork as a process of its own, and end it."""
    status = 1
    try:
        _forget_tests()
        work()
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


def _forget_tests():
    """Take off what pytest and its plug-ins have put onto this process."""
    sys.settrace(None)
    logging.root.handlers.clear()
    warnings.resetwarnings()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        mode = "r" if number == 0 else "w"
        buffering = -1 if number == 0 else 1
        stream = open(number, mode, buffering, encoding="utf-8", closefd=False)  # noqa: SIM115
        setattr(sys, name, stream)
    # folders that tests have made are theirs to delete
    atexit._clear()
    weakref.finalize._registry.clear()
    weakref.finalize._registered_with_atexit = False
    util._finalizer_registry.clear()
    atexit.register(util._exit_function)
    forkserver._forkserver.__init__()
    resource_tracker._resource_tracker.__init__()
    util.spawnv_passfds = _forked_server


def _keep_descriptors(*standard):
    """Put three file descriptors in the place of the standard ones, and close all others."""
    copies = [os.dup(number if number >= 0 else place) for place, number in enumerate(standard)]
    for place, number in enumerate(copies):
        os.dup2(number, place)
    os.closerange(LOWEST_OTHER, os.sysconf("SC_OPEN_MAX"))


_spawnv_passfds = util.spawnv_passfds


def _forked_server(path, words, descriptors):
    """Start the process that jobs are forked from as a fork, too; others as `multiprocessing` does."""
    if PRELOADED not in words[-1]:
        return _spawnv_passfds(path, words, descriptors)
    process_id = os.fork()
    if process_id == 0:
        _run_in_child(lambda: _serve_forks(words[-1], descriptors))
    return process_id


def _serve_forks(code, descriptors):
    """In the grandchild: be the process that `multiprocessing` would have started."""
    lowest = LOWEST_OTHER
    for descriptor in sorted(descriptors):
        os.closerange(lowest, descriptor)
        lowest = descriptor + 1
    os.closerange(lowest, os.sysconf("SC_OPEN_MAX"))
    sys.modules.pop(PRELOADED, None)  # what it does at its import is done anew
    exec(code, {"__name__": "__main__"})
