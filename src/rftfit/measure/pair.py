"""The two logs of a run, read and with a usable time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.logs.base import Log, LogError
from rftfit.logs.registry import dialect
from rftfit.measure.clean import clean

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run

_AHEAD = 32


@dataclass(frozen=True)
class Pair:
    """Force and motion log of one run; an unusable one is its error.

    Parameters
    ----------
    force, motion : Log or LogError
    """

    force: Log | LogError
    motion: Log | LogError

    @property
    def problems(self) -> list[str]:
        """What is wrong with unusable logs."""
        return [str(log) for log in (self.force, self.motion) if isinstance(log, LogError)]


def load_pair(campaign: Campaign, run: Run) -> Pair:
    """Read both logs of a run; whatever is wrong with them is told, not raised.

    Parameters
    ----------
    campaign : Campaign
    run : Run

    Returns
    -------
    Pair
    """
    return Pair(_load(campaign, run.force_log, "F1"), _load(campaign, run.motion_log, "x"))


def load_pairs(campaign: Campaign, runs: Sequence[Run]) -> Iterator[tuple[Run, Pair]]:
    """Read the logs of many runs in order, a few ahead of the caller.

    The parser works outside the interpreter's lock, so a second thread reads while the first
    measures; reading a few ahead keeps memory flat however many runs there are.

    Parameters
    ----------
    campaign : Campaign
    runs : sequence of Run

    Yields
    ------
    run, pair : Run, Pair
    """
    with ThreadPoolExecutor(max_workers=1) as pool:
        waiting = [pool.submit(load_pair, campaign, run) for run in runs[:_AHEAD]]
        for index, run in enumerate(runs):
            if index + _AHEAD < len(runs):
                waiting.append(pool.submit(load_pair, campaign, runs[index + _AHEAD]))
            yield run, waiting.pop(0).result()


def _load(campaign: Campaign, file: str, wanted: str) -> Log | LogError:
    path = campaign.raw / file
    try:
        log = clean(dialect(campaign.config.dialect).load(path))
    except LogError as error:
        # the folder of the raw data is the reader's business, not the ledger's
        return LogError(error.code, str(error).replace(str(path), file), error.rows)
    if wanted not in log.columns:
        kind = "force" if wanted == "F1" else "motion"
        return LogError("wrong_kind", f"{file}: this is not a {kind} log", log.rows)
    return log
