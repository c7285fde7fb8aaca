"""The two logs of a run, read and with a usable time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from rftfit.logs.base import Log, LogError
from rftfit.logs.registry import source_reader
from rftfit.logs.textlog import TextReader
from rftfit.measure.clean import clean
from rftfit.measure.columns import chain_units, columns_asked, completed, mapped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from rftfit.campaign.config import Config
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.runs import Run
    from rftfit.campaign.sources import AnyLog
    from rftfit.logs.base import Reader


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
    config, units = campaign.config, chain_units(campaign.config)
    force_reader, motion_reader = readers(config)
    for first in range(0, len(runs), _AT_A_TIME):
        part = runs[first : first + _AT_A_TIME]
        force = force_reader.load_many([campaign.raw / run.force_log for run in part])
        motion = motion_reader.load_many([campaign.raw / run.motion_log for run in part])
        for run, one, other in zip(part, force, motion, strict=True):
            yield (
                run,
                Pair(
                    _usable(campaign, run.force_log, one, partial(_force, config, units)),
                    _usable(campaign, run.motion_log, other, partial(_motion, config, units, run)),
                ),
            )


def readers(config: Config) -> tuple[Reader, Reader]:
    """Return the readers of force logs and of motion logs.

    Parameters
    ----------
    config : Config

    Returns
    -------
    force, motion : Reader
        Of the columns only that the config names, where it names any.

    Raises
    ------
    InputError
        If there is no such dialect.
    """
    found = []
    sources: dict[str, AnyLog] = {"force_log": config.force_log, "motion_log": config.motion_log}
    for key, source in sources.items():
        reader = source_reader(source, config.dialect, key)
        if source.columns and isinstance(reader, TextReader):
            reader = reader.only(columns_asked(source))
        found.append(reader)
    return found[0], found[1]


def _force(config: Config, units: Mapping[str, str], log: Log) -> Log:
    log = mapped(log, config.force_log, units, "force_log")
    return _complete(log, ("time", "F1", "F2", "F3"), "force")


def _motion(config: Config, units: Mapping[str, str], run: Run, log: Log) -> Log:
    log = mapped(log, config.motion_log, units, "motion_log")
    if "z" in log.columns:
        log = completed(log, run, units)
    return _complete(log, ("time", "x", "z", "angle"), "motion")


def _complete(log: Log, wanted: tuple[str, ...], kind: str) -> Log:
    lacking = [name for name in wanted if name not in log.columns]
    if not lacking:
        return log
    if wanted[1] in lacking:
        raise LogError(
            "wrong_kind",
            f"{log.path}: this is not a {kind} log (no column for {wanted[1]}); are the two logs of "
            "the run swapped?",
            log.rows,
        )
    text = f"{log.path}: no column for {', '.join(lacking)}; name it under {kind}_log.columns"
    raise LogError("columns", f"{text} (`rftfit inspect` shows the columns)", log.rows)


def _usable(
    campaign: Campaign, file: str, log: Log | LogError, quantities: Callable[[Log], Log]
) -> Log | LogError:
    """Clean a log, or say why it cannot be used, by the name the run sheet gives it."""
    try:
        if isinstance(log, LogError):
            raise log
        return clean(quantities(log))
    except LogError as error:
        # the folder of the raw data is the reader's business, not the ledger's
        text = str(error).replace(str(campaign.raw / file), file)
        return LogError(error.code, text, error.rows)
