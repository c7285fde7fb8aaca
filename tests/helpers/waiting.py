"""Waiting for what another process does: for long, since a busy machine is no fault of the program."""

import time

LONGEST_S = 600
"""Longest that a test waits for what takes a second on a quiet machine."""

ASLEEP_S = 900
"""How long a process sleeps that has to be ended by others before."""


def wait_for(condition):
    """Wait until a condition holds; an error if it does not in time."""
    deadline = time.monotonic() + LONGEST_S
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)
