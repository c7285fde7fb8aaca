"""Environment of child processes, in which Python imports nothing from the folder they work in."""

from __future__ import annotations

import os


def child_environment(**more: str) -> dict[str, str]:
    """Return this process's environment with some values more, safe in a stranger's folder.

    ``python -m`` and ``python -c`` would look for modules in the current folder first, and so does
    every Python for entries of PYTHONPATH that are empty or relative.

    `**more`: Variables by name.
    """
    environment = {**os.environ, **more, "PYTHONSAFEPATH": "1"}
    paths = environment.pop("PYTHONPATH", "").split(os.pathsep)
    absolute = os.pathsep.join(filter(os.path.isabs, paths))
    return environment | ({"PYTHONPATH": absolute} if absolute else {})
