"""What one process of pytest-xdist makes and all read."""

import os

from waiting import wait_for


def make_once(tmp_path_factory, name, make):
    """Make a folder by ``make(folder)`` in the first process that asks for it; the others wait.

    Returns
    -------
    Path
        The folder, which nobody changes.
    """
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent
    folder, finished = base / name, base / f"{name} made"
    try:
        (base / f"{name} begun").mkdir()
    except FileExistsError:
        wait_for(finished.exists)
    else:
        make(folder)
        finished.touch()
    return folder
