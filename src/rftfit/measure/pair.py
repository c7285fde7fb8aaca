"""The two logs of a run, read and with a usable time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rftfit.logs.base import Log, LogError
from rftfit.logs.registry import dialect
from rftfit.measure.clean import clean

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run


_AT_A_TIME = 32


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


def load_pairs(campaign: Campaign, runs: Sequence[Run]) -> Iterator[tuple[Run, Pair]]:
    """Read the logs of many runs; whatever is wrong with them is told, not raised.

    Some runs are read at a time, which is faster than one by one and keeps memory flat however many
    there are.

    Parameters
    ----------
    campaign : Campaign
    runs : sequence of Run

    Yields
    ------
    run, pair : Run, Pair
        In the order of `runs`.
    """
    reader = dialect(campaign.config.dialect)
    for first in range(0, len(runs), _AT_A_TIME):
        part = runs[first : first + _AT_A_TIME]
        force = reader.load_many([campaign.raw / run.force_log for run in part])
        motion = reader.load_many([campaign.raw / run.motion_log for run in part])
        for run, one, other in zip(part, force, motion, strict=True):
            yield (
                run,
                Pair(
                    _usable(campaign, run.force_log, one, "F1"),
                    _usable(campaign, run.motion_log, other, "x"),
                ),
            )


def _usable(campaign: Campaign, file: str, log: Log | LogError, wanted: str) -> Log | LogError:
    """Clean a log, or say why it cannot be used, by the name the run sheet gives it."""
    try:
        if isinstance(log, LogError):
            raise log
        log = clean(log)
    except LogError as error:
        # the folder of the raw data is the reader's business, not the ledger's
        text = str(error).replace(str(campaign.raw / file), file)
        return LogError(error.code, text, error.rows)
    if wanted not in log.columns:
        kind = "force" if wanted == "F1" else "motion"
        return LogError("wrong_kind", f"{file}: this is not a {kind} log", log.rows)
    return log
