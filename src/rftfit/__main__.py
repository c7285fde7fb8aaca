"""``python -P -m rftfit STAGE --config FILE --threads N``: one stage of the workflow.

People use the ``rftfit`` command instead.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import sys
from pathlib import Path

from rftfit.errors import RftfitError
from rftfit.workflow import warm
from rftfit.workflow.processes import end_with_parent


def main(argv: list[str] | None = None) -> int:
    """Do those tasks of a stage that are out of date; return 0, or the exit code of the error it tells."""
    end_with_parent()
    given = sys.argv[1:] if argv is None else argv
    if (status := warm.ask(given)) is not None:
        return status
    parser = argparse.ArgumentParser("python -P -m rftfit")
    parser.add_argument("stage")
    parser.add_argument("--config", type=Path, default=Path("config/config.yaml"))
    parser.add_argument("--threads", type=int, default=1)
    words = parser.parse_args(given)
    # figures and tables are many objects that live long: to look for garbage among them took a tenth
    # of the time
    gc.set_threshold(50_000, 20, 50)
    from rftfit.workflow.run_stage import run_stage

    try:
        run_stage(words.config, words.stage, words.threads)
    except RftfitError as error:
        _say(f"rftfit {words.stage}: {error}\n")
        return error.exit_code
    return 0


def _say(message: str) -> None:
    """Write to standard error; where that is a file on a full disk, to whoever listens."""
    try:
        sys.stderr.write(message)
        sys.stderr.flush()
    except OSError:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.write(message)
            sys.stdout.flush()
            # what waits in the stream is tried again at the very end, which would change the exit status
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


if __name__ == "__main__":
    if sys.argv[1:2] == [warm.WARM]:
        warm.keep_warm(int(sys.argv[2]), main)
    sys.exit(main())
