"""What the results of a campaign hang on, as it is now: logs, rows of the run sheet, settings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rftfit.store.digest import digest_of
from rftfit.store.manifest import Seen

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run
    from rftfit.logs.plugins import Origin

OWN_DIALECT = "rig"
"""The one that is read where the config names none."""

# the number of a row, and what nobody computes with
_LEFT_OUT = ("row", "note")


def log_names(campaign: Campaign, medium: str) -> list[str]:
    """List the logs that a medium is measured from.

    Parameters
    ----------
    campaign : Campaign
    medium : str
        Empty for the runs that belong to none.

    Returns
    -------
    list of str
        Relative to the raw folder, sorted; some may not exist.
    """
    runs = campaign.runs_of(medium) if medium else campaign.unclaimed
    names = {name for run in runs for name in (run.force_log, run.motion_log)}
    contact = campaign.config.rigid_contact
    if contact is not None and medium:
        names |= {contact.force_log, contact.motion_log}
    return sorted(names)


def all_log_names(campaign: Campaign) -> list[str]:
    """List all logs that the campaign names.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    list of str
        Relative to the raw folder, sorted.
    """
    media = (*campaign.media_with_runs, "")
    return sorted({name for medium in media for name in log_names(campaign, medium)})


def logs_seen(campaign: Campaign) -> Seen:
    """Return what is remembered of the campaign's logs.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    Seen
        Kept in Snakemake's own folder: state of the workflow, not a result.
    """
    return Seen(campaign.root / ".snakemake" / "rftfit" / "logs_seen.tsv")


def digests_of_logs(campaign: Campaign, names: Iterable[str], seen: Seen) -> dict[str, str]:
    """Digest logs.

    Parameters
    ----------
    campaign : Campaign
    names : iterable of str
        Relative to the raw folder.
    seen : Seen
        What is known of them.

    Returns
    -------
    dict of str to str
        SHA-256 by name; empty where there is no such file.
    """
    paths = {f"{campaign.raw}/{name}": name for name in names}
    return {paths[path]: digest for path, digest in seen.digests(paths).items()}


def foreign_dialects(config: Config) -> dict[str, Origin]:
    """Say which dialects of other packages a campaign's logs are read with.

    Parameters
    ----------
    config : Config

    Returns
    -------
    dict of str to Origin
        By dialect.
    """
    named = {config.dialect, config.force_log.dialect, config.motion_log.dialect} - {
        None,
        OWN_DIALECT,
    }
    if not named:
        return {}
    # slow to import, and most campaigns have the rig's own logs
    from rftfit.logs.registry import origins

    return origins(name for name in named if name is not None)


def raw_digest(media: Sequence[str], digests: Mapping[str, str]) -> str:
    """Digest of the content of some logs.

    Parameters
    ----------
    media : sequence of str
        Whose they are.
    digests : mapping of str to str
        SHA-256 by name.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    # with the media, so that no two lists of them share a digest
    return digest_of(list(media), sorted(digests.items()))


def rows_digest(campaign: Campaign, media: Sequence[str]) -> str:
    """Digest of some media's rows of the run sheet; their order and numbers do not count.

    Parameters
    ----------
    campaign : Campaign
    media : sequence of str
        All rows when none is named.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    runs = [run for medium in media for run in campaign.runs_of(medium)] if media else campaign.runs
    return digest_of(list(media), sorted([*cells(run).values()] for run in runs))


def cells(run: Run) -> dict[str, str]:
    """Return what counts of a row of the run sheet, as text.

    Parameters
    ----------
    run : Run

    Returns
    -------
    dict of str to str
        By column; empty where there is nothing.
    """
    values = {
        name: getattr(run, name) for name in run.__dataclass_fields__ if name not in _LEFT_OUT
    }
    return {name: _text(value) for name, value in values.items()}


def _text(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, bool):
        return "yes" if value else ""
    return str(value)


def settings_digest(config: Config, sections: Sequence[str]) -> str:
    """Digest of sections of the configuration.

    Parameters
    ----------
    config : Config
    sections : sequence of str
        All when none is named.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    whole = config.model_dump(mode="json")
    return digest_of({name: whole[name] for name in sections or whole})
