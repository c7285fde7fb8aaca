"""A warm process: jobs are forked from it, so that none of them waits for its imports.

``rftfit run`` keeps one while Snakemake works. The command of a job, ``python -P -m rftfit STAGE``, asks
it for a child, hands its files, folder and environment over, and ends as the child ends. Where nothing
is warm (Windows, macOS, a cluster, Snakemake by hand) the command does the work itself.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

from rftfit.workflow.processes import end_now

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

VARIABLE = "RFTFIT_WARM"
"""Name of the warm process's socket, in the environment of Snakemake and its jobs."""

WARM = "--warm"
"""Word of the warm process's command, before the number of its listening socket's file."""

_IMPORTED = (
    "pandas",
    "rftfit.workflow.run_stage",
    "rftfit.campaign.load",
    *(f"rftfit.workflow.{name}" for name in ("measure", "profiles", "validate")),
    "scipy.special",
    "numba",
    "rftfit.workflow.robot",
    *(f"matplotlib.backends.backend_{name}" for name in ("agg", "pdf", "svg")),
    "rftfit.page.page",
)
"""In the order in which stages need them; one at a time, between the jobs that begin meanwhile."""

_MESSAGE = 1 << 20
_STATUS = struct.Struct("i")
_CREDENTIALS = struct.Struct("3i")


@contextlib.contextmanager
def warm(environment: dict[str, str]) -> Iterator[dict[str, str]]:
    """Keep a warm process; yield the environment in which jobs find it."""
    if sys.platform != "linux":
        yield environment
        return
    # an abstract name: no file is left behind, whoever is killed
    name = f"rftfit-{os.urandom(16).hex()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listening:
        listening.bind(f"\0{name}")
        listening.listen(64)
        server = subprocess.Popen(
            [sys.executable, "-P", "-m", "rftfit", WARM, str(listening.fileno())],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            pass_fds=(listening.fileno(),),
            # Ctrl-C ends Snakemake and with it the jobs, whose children end with them
            start_new_session=True,
        )
    with server:  # closes its standard input, at which it ends
        yield {**environment, VARIABLE: name}


def ask(words: Sequence[str]) -> int | None:
    """Let a child of the warm process run ``rftfit.__main__.main`` on some words.

    Returns its exit status, or None where nothing is warm. A signal that ended the child ends this
    process; a signal that ends this process ends the child.
    """
    name = os.environ.pop(VARIABLE, "")
    if not name:
        return None
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
        try:
            server.connect(f"\0{name}")
            if not _is_ours(server):
                return None
            what = [sys.prefix, os.getcwd(), dict(os.environ), list(words)]  # noqa: PTH109
            _end_together(server)
            socket.send_fds(server, [json.dumps(what).encode("utf-8", "surrogateescape")], [1, 2])
            if not server.recv(_STATUS.size):
                return None
        except OSError:
            return None
        status = _status(server)
    if status < 0:
        _end_by(-status)
    return status


def _end_by(number: int) -> None:
    """End this process by a signal."""
    if number != signal.SIGKILL:
        signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)


def _end_together(server: socket.socket) -> None:
    """On a polite end of this process, end the child first: nothing is written after the end."""

    def end(number: int, _: object) -> None:
        with contextlib.suppress(OSError):
            server.shutdown(socket.SHUT_WR)
            while server.recv(_STATUS.size):
                pass
        _end_by(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)


def _status(server: socket.socket) -> int:
    """Wait for the end of the child; where the warm process was lost, 1."""
    try:
        answer = server.recv(_STATUS.size)
    except OSError:
        answer = b""
    if answer:
        return int(_STATUS.unpack(answer)[0])
    sys.stderr.write("rftfit: the process that did this work was lost\n")
    return 1


def _is_ours(connection: socket.socket) -> bool:
    """Whether the other end is a process of the same user."""
    found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
    return bool(_CREDENTIALS.unpack(found)[1] == os.getuid())


def serve(listening: socket.socket, lifeline: int) -> list[str]:
    """Import, fork a child for each request, report how it ended; end as the lifeline is closed.

    Returns, in a child, the words of its request.
    """
    imports, busy = _imports(), True
    children: dict[int, socket.socket] = {}
    woken, wake = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(wake)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        watched = [listening.fileno(), lifeline, woken]
        ready, _, _ = select.select(watched, [], [], 0 if busy else None)
        if lifeline in ready:
            os._exit(0)
        if woken in ready:
            os.read(woken, 1000)
            _report(children)
        if watched[0] in ready:
            connection, _ = listening.accept()
            try:
                what, files = _request(connection)
                process = os.fork()
            except (OSError, ValueError):  # not ours, no longer there, or no room for one more
                connection.close()
                continue
            if not process:
                signal.set_wakeup_fd(-1)
                for one in (
                    woken,
                    wake,
                    listening.detach(),
                    *(c.fileno() for c in children.values()),
                ):
                    os.close(one)
                return _begin(connection, what, files)
            children[process] = connection
            for one in files:
                os.close(one)
            with contextlib.suppress(OSError):
                connection.send(_STATUS.pack(0))
        elif busy and not ready:
            busy = next(imports, False)


def _imports() -> Iterator[bool]:
    """Do one import at each step."""
    for name in _IMPORTED:
        importlib.import_module(name)
        yield True
    from rftfit.figures.registry import figures

    figures()


def _report(children: dict[int, socket.socket]) -> None:
    """Tell those who asked how their children ended."""
    while children:
        process, status = os.waitpid(-1, os.WNOHANG)
        if not process:
            return
        with children.pop(process) as connection, contextlib.suppress(OSError):
            connection.send(_STATUS.pack(os.waitstatus_to_exitcode(status)))


def _request(connection: socket.socket) -> tuple[list[Any], list[int]]:
    """Receive a request: prefix of its Python, folder, environment, words; and its open files."""
    if not _is_ours(connection):  # whoever it is may never send anything
        raise ConnectionRefusedError
    message, files, _, _ = socket.recv_fds(connection, _MESSAGE, 2)
    what = json.loads(message.decode("utf-8", "surrogateescape"))
    if what[0] != sys.prefix:
        for one in files:
            os.close(one)
        raise ConnectionRefusedError
    return what, files


def _begin(connection: socket.socket, what: list[Any], files: list[int]) -> list[str]:
    """Take the place of the one who asked: its files, folder and environment. Returns its words."""
    _, folder, environment, words = what

    def watch() -> None:
        connection.recv(1)  # nothing comes but the end of the one who asked
        end_now()

    threading.Thread(target=watch, name="end with the one who asked", daemon=True).start()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for target, one in enumerate((os.open(os.devnull, os.O_RDONLY), *files)):
        os.dup2(one, target)
        os.close(one)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    return list(words)


def keep_warm(number: int, job: Callable[[list[str]], int]) -> None:
    """Be the warm process, or, in a child of it, the job.

    `number`: Of the listening socket's file. `job`: What a child does with the words of its request.
    """
    words = serve(socket.socket(fileno=number), sys.stdin.fileno())
    status = 1
    try:
        status = job(words)
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else 1
    except BaseException:  # noqa: BLE001
        sys.excepthook(*sys.exc_info())
    finally:
        # to take down what was imported takes half a second, and nobody needs it
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)
