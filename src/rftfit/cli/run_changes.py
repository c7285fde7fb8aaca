"""Logs that have changed since results were made from them: said before they are made anew."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from rftfit.campaign.problems import listed, shown
from rftfit.cli.output import count, warn
from rftfit.errors import InputError

if TYPE_CHECKING:
    from rftfit.campaign.load import Campaign

_MOST = 5


def say_changes(campaign: Campaign) -> None:
    """Warn of logs whose content is no longer what the last whole run read.

    Parameters
    ----------
    campaign : Campaign
    """
    from rftfit.stages.provenance_record import SUMS
    from rftfit.stages.provenance_state import all_log_names, digests_of_logs, logs_seen
    from rftfit.store.manifest import read_sums

    sums: dict[str, str] = {}
    if (campaign.root / SUMS).is_file():
        # a damaged list is made anew by the run itself
        with contextlib.suppress(InputError):
            sums = read_sums(campaign.root / SUMS)
    if not sums:
        return
    raw = campaign.raw.relative_to(campaign.root).as_posix()
    seen = logs_seen(campaign)
    found = digests_of_logs(campaign, all_log_names(campaign), seen)
    # Snakemake then need not read them a second time
    seen.save()
    changed = [name for name, now in found.items() if sums.get(f"{raw}/{name}", now) != now]
    gone = [name for name in changed if not found[name]]
    other = [name for name in changed if found[name]]
    for names, what in ((other, "changed"), (gone, "gone")):
        if names:
            warn(f"{count(len(names), 'log')} {what} since the results were made: {listed(map(shown, names), _MOST)}")  # fmt: skip
