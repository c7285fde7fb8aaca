"""Snakemake as a child process: started, listened to, stopped with all its children."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rftfit
from rftfit.errors import OutputError, WorkflowError
from rftfit.store.parent import VARIABLE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

_PATIENCE_S = 20.0


def find_snakefile() -> Path:
    """Find the workflow: at the top of a checkout, inside the package where it was installed.

    Returns
    -------
    Path

    Raises
    ------
    WorkflowError
        If there is none.
    """
    package = Path(rftfit.__file__).resolve().parent
    places = (package.parents[1] / "Snakefile", package / "_workflow" / "Snakefile")
    for place in places:
        if place.is_file():
            return place
    looked = " or ".join(str(place) for place in places)
    raise WorkflowError(f"no workflow found at {looked}; install rftfit again")


def listen(
    words: Sequence[str], root: Path, log: Path | None, on_line: Callable[[str], None]
) -> int:
    """Run ``python -m snakemake`` and hand on each line that it or a job of it prints.

    Parameters
    ----------
    words : sequence of str
        After ``python -m snakemake``.
    root : Path
        Its current folder.
    log : Path or None
        Where the lines are kept as they come.
    on_line : callable
        Gets each line without its end.

    Returns
    -------
    int
        Exit status.

    Raises
    ------
    OutputError
        If the log cannot be written.
    KeyboardInterrupt
        On Ctrl-C, SIGTERM and SIGHUP, after all children have ended.
    """
    with contextlib.ExitStack() as stack:
        keep = stack.enter_context(_open(log)) if log else None
        stack.enter_context(_signals_as_interrupts())
        child = stack.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "snakemake", *words],
                cwd=root,
                env=_environment(),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                # of its own group: Ctrl-C comes here first, and is handed on to all of them at once
                start_new_session=os.name == "posix",
            )
        )
        try:
            assert child.stdout is not None
            for raw in child.stdout:
                if keep is not None:
                    _keep(keep, raw, log)
                on_line(raw.decode("utf-8", "replace").rstrip("\r\n"))
            return child.wait()
        except BaseException:
            _stop(child)
            raise


def working_in(root: Path) -> list[int]:
    """Process ids of the Snakemakes that work in a folder, so far as can be told.

    Parameters
    ----------
    root : Path

    Returns
    -------
    list of int
        Empty too where other processes cannot be looked at.
    """
    try:
        psutil: Any = import_module("psutil")
    except ImportError:
        return []
    found = []
    for process in psutil.process_iter(["pid", "cmdline", "cwd"]):
        words = process.info["cmdline"] or []
        is_snakemake = any(Path(word).name.startswith("snakemake") for word in words[:4])
        places = [process.info["cwd"], _after(words, "--directory"), _after(words, "-d")]
        if is_snakemake and any(place and Path(place) == root for place in places):
            found.append(int(process.info["pid"]))
    return sorted(found)


def _after(words: Sequence[str], option: str) -> str | None:
    return next((b for a, b in pairwise(words) if a == option), None)


def _environment() -> dict[str, str]:
    # jobs call `python`: it has to be this one, also where the environment was not activated
    here = os.path.dirname(sys.executable)  # noqa: PTH120
    path = os.pathsep.join(filter(None, [here, os.environ.get("PATH", "")]))
    # it ends when this process has ended, even where that could not say so
    return {**os.environ, "PATH": path, "PYTHONUNBUFFERED": "1", VARIABLE: str(os.getpid())}


def _open(log: Path) -> Any:
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        return log.open("wb", buffering=0)
    except OSError as error:
        raise _cannot_write(log, error) from error


def _keep(handle: Any, line: bytes, log: Path | None) -> None:
    try:
        handle.write(line)
    except OSError as error:
        raise _cannot_write(log, error) from error


def _cannot_write(log: Path | None, error: OSError) -> OutputError:
    return OutputError(
        f"{log}: cannot write the workflow's log: {error.strerror or error}; free some space or "
        "allow writing there, then run again"
    )


@contextlib.contextmanager
def _signals_as_interrupts() -> Iterator[None]:
    """Let a polite end of this process end its children too, as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    # what is ignored stays so: nohup keeps a run alive when its terminal closes
    heard = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    before = {number: signal.signal(number, interrupt) for number in heard}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop(child: subprocess.Popen[bytes]) -> None:
    """End Snakemake and its jobs: politely, so that it clears its lock, then less so."""
    steps = ("SIGINT", "SIGTERM", "SIGKILL") if os.name == "posix" else ("SIGTERM",)
    for name in steps:
        if child.poll() is not None:
            return
        with contextlib.suppress(OSError, KeyboardInterrupt):
            if os.name == "posix":
                os.killpg(child.pid, getattr(signal, name))
            else:
                child.terminate()
        # a second Ctrl-C is an impatient user: the next step comes at once
        with contextlib.suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
            # communicate, not wait: a full pipe would keep the child from ending
            child.communicate(timeout=_PATIENCE_S)
