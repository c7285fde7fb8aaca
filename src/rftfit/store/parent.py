"""A process that ends when the one that started it has ended, so that no orphan goes on writing.

Nobody can ask a process that is killed with SIGKILL to end its children first. The children watch:
a process whose parent has ended is given another parent. The starter says who it is in the
environment, so that what a person starts, and leaves on purpose, is not ended.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

VARIABLE = "RFTFIT_PARENT"
"""Process id of the process to watch, in the environment of its child."""

SHELL_PREFIX = f"{VARIABLE}=$PPID exec " if os.name == "posix" else ""
"""In front of a job's one command: the stage takes the shell's place, below the shell's own parent."""

_LOOK_S = 0.5
_PATIENCE_S = 10.0
_INIT = 1
_ORPHANED = 143


def end_with_parent(end: Callable[[], None] | None = None) -> bool:
    """Watch the process that the environment names, and end soon after it has ended.

    The name is taken out of the environment, so that processes started from here do not watch it.

    Parameters
    ----------
    end : callable, optional
        How to end; default: at once. What was not finished is not there then (`rftfit.store`).

    Returns
    -------
    bool
        Whether anything is watched: only on POSIX systems, and where the environment asks for it.
    """
    named = os.environ.pop(VARIABLE, "")
    if os.name != "posix" or not named.isdecimal():
        return False
    end = end or end_now
    parent, starter = os.getppid(), int(named)
    # where another program stands between, that one is watched
    if parent != starter and (parent == _INIT or not _lives(starter)):
        end()
        return False

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_S)
        end()

    threading.Thread(target=watch, name="end with parent", daemon=True).start()
    return True


def end_now() -> None:
    """End this process without a further step of it."""
    try:
        sys.stderr.write("rftfit: ended, since the workflow that started this has ended\n")
        sys.stderr.flush()
    finally:
        os._exit(_ORPHANED)


def end_group() -> None:
    """End this process and all jobs it has started: politely, so that it clears up, then less so."""
    os.killpg(os.getpgrp(), signal.SIGTERM)
    time.sleep(_PATIENCE_S)
    os.killpg(os.getpgrp(), signal.SIGKILL)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True
