"""Finds the configuration and the folder of a campaign, or says that there is none, without slow imports.

A campaign is a folder with a configuration, ``config/config.yaml`` or ``config.yaml``.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from rftfit.campaign.problems import Place, Problem, join_words
from rftfit.errors import InputError
from rftfit.store.links import RESULTS

CONFIG = "config/config.yaml"
"""Path of the configuration of a campaign, relative to its folder."""

_CONFIGS = (CONFIG, "config.yaml")
"""Where a configuration may lie in the folder of a campaign; the first that exists counts."""


def root_of(config_path: Path) -> Path:
    """Return the folder of a campaign: the folder of its config, or the one above if that is named ``config``."""
    folder = Path(config_path).absolute().parent
    return (folder.parent if folder.name == "config" else folder).resolve()


def miss_campaign(config_path: Path) -> Problem | None:
    """Return the problem that a configuration is missing, with campaigns nearby; None where a file lies there."""
    config_path = Path(config_path)
    try:
        config_path.stat()
    except FileNotFoundError:
        pass
    except (OSError, ValueError):
        return None  # a file that cannot be opened: its reader will say why
    else:
        return None
    working_folder = Path.cwd()
    # the campaign around the working folder, and those below the folder of the missing file
    near = [folder for folder in working_folder.parents if (folder / CONFIG).is_file()][:1]
    with suppress(OSError):
        near += sorted(path.parents[1] for path in root_of(config_path).glob(f"*/{CONFIG}"))
    folders = join_words([os.path.relpath(path, working_folder) for path in near], 3)
    allowed = (
        f"the file does not exist, so this is no campaign; go to the folder of one{folders and f' ({folders})'}, "
        "or make a new one: rftfit init FOLDER, or rftfit reenact in an empty folder (the demonstration)"
    )
    return Problem("config.missing", Place(config_path.as_posix()), None, allowed)


def config_of(folder: str | Path) -> Path:
    """Find the configuration of a campaign; `folder`: its folder, the folder of its results, or the file itself.

    Raises InputError where there is none.
    """
    path = Path(folder)
    folders = [path, path.parent] if path.name in ("config", RESULTS) else [path]
    for candidate in [path, *(folder / name for folder in folders for name in _CONFIGS)]:
        if candidate.is_file():
            return candidate
    raise InputError(
        f"{path}: no config/config.yaml there; allowed: the folder of a campaign "
        "(`rftfit init` makes one)"
    )
