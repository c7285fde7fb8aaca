"""The config alone, and where its raw folder and run sheet lie: they may not exist yet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from rftfit.campaign.config import Config


@dataclass(frozen=True)
class Places:
    """A checked configuration and its folders.

    Attributes
    ----------
    config : Config
    root : Path
        The campaign's folder.
    raw, sheet : Path
        Inside the root; need not exist.
    """

    config: Config
    root: Path
    raw: Path
    sheet: Path


def campaign_root(config_path: Path) -> Path:
    """Folder of a campaign: that of its config, or the one above where that is named ``config``.

    Parameters
    ----------
    config_path : Path

    Returns
    -------
    Path
        Absolute.
    """
    folder = config_path.absolute().parent
    return (folder.parent if folder.name == "config" else folder).resolve()


def read_places(config_path: Path) -> Places:
    """Read and check the configuration without its run sheet.

    Parameters
    ----------
    config_path : Path

    Returns
    -------
    Places

    Raises
    ------
    CampaignError
        If the configuration has errors.
    InputError
        If raw folder or run sheet would lie outside the campaign's folder.
    """
    from rftfit.campaign.configfile import read_config
    from rftfit.campaign.problems import CampaignError

    file, problems = read_config(config_path, config_path.as_posix())
    if file.config is None:
        raise CampaignError(problems)
    root = campaign_root(config_path)
    raw = _inside(root, "raw", file.config.raw)
    sheet = _inside(root, "run_sheet", file.config.run_sheet)
    if raw == root:
        raise InputError(
            f"{config_path}, key raw: found '{file.config.raw}'; allowed: a folder below the "
            "campaign's own"
        )
    return Places(file.config, root, raw, sheet)


def _inside(root: Path, key: str, written: str) -> Path:
    from rftfit.campaign.files import plain_path

    path, fault, nearest = plain_path(written)
    whole = (root / path).resolve()
    if fault or not whole.is_relative_to(root):
        why = fault.partition(": ")[2] or "a link leads out of it"
        hint = f"; did you mean '{nearest}'?" if nearest else ""
        raise InputError(
            f"config, key {key}: found '{written}'; allowed: a path inside the campaign's folder; "
            f"{why}{hint}"
        )
    return whole
