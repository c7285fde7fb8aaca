"""Read the two logs of each run of a campaign: quantities in the units of the program, rows that count, a time that grows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

from rftfit.campaign.config import AnyLog, Config
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.logs.base import Log, LogError, Reader
from rftfit.logs.registry import load_each, source_reader
from rftfit.measure import log_columns, readings
from rftfit.measure.flags import Remark, quoted
from rftfit.measure.lab_frame import NEAR_FULL_RANGE, without_repeats
from rftfit.measure.log_columns import LogKey, source_of
from rftfit.measure.long_logs import LongLog, RowTreatment, may_be_long, read_long_log


def read_logs(campaign: Campaign, runs: Sequence[Run]) -> Iterator[tuple[Run, Logs]]:
    """Read the logs of many runs, in their order; whatever is wrong with them is told, not raised.

    Some runs are read at a time, which is faster than one by one and keeps memory flat.
    """
    zeros: dict[tuple[str, ...], Log | LogError] = {}
    for start in range(0, len(runs), _AT_A_TIME):
        runs_together = runs[start : start + _AT_A_TIME]
        zeros |= _read_zeros(campaign, runs_together, zeros)
        both = [
            LogOfRun(run, key, getattr(run, key)) for run in runs_together for key in _KEYS_OF_LOGS
        ]
        logs = iter(_read(campaign, both))
        for run, force_log, motion_log in zip(runs_together, logs, logs, strict=True):
            force = _usable(campaign, run, run.force_log, force_log, _force_rows)
            motion = _usable(campaign, run, run.motion_log, motion_log, _motion_rows)
            yield run, Logs(force, motion, zeros.get(_zero(run)))


def _force_of_columns(campaign: Campaign, run: Run, log: Log) -> Log:
    """Turn the columns of a force log into time and F1 to F3, row by row."""
    source, units = (
        source_of(campaign.config, run, "force_log"),
        log_columns.chain_units(campaign.config),
    )
    log = readings.without_missing(log, campaign.config.force_log.missing)
    log = log_columns.loads(log, campaign.calibration, units)
    log = log_columns.map_columns(log, source, units, "force_log")
    return log_columns.check_complete(log, run, log_columns.FORCE_QUANTITIES, "force")


def _motion_of_columns(campaign: Campaign, run: Run, log: Log) -> Log:
    """Turn the columns of a motion log into time, x, z and angle, row by row."""
    config = campaign.config
    source, units = source_of(config, run, "motion_log"), log_columns.chain_units(config)
    log = readings.without_missing(log, config.motion_log.missing)
    log = log_columns.map_columns(log, source, units, "motion_log")
    if not {"z", "along"}.isdisjoint(log.columns):
        log = log_columns.completed(log, run, units, config.arm.middle_x_mm / 10)
    return log_columns.check_complete(log, run, log_columns.MOTION_QUANTITIES, "motion")


def _force_rows(campaign: Campaign, run: Run) -> RowTreatment:
    """What is done with the rows of a force log: time grows, and no reading stands alone."""
    transducer = campaign.config.transducer
    channels = log_columns.FORCE_QUANTITIES[1:]
    limits = [NEAR_FULL_RANGE * limit for limit in transducer.range_N]
    return RowTreatment(
        convert=partial(_force_of_columns, campaign, run),
        clean=lambda log: readings.without_spikes(readings.clean(log), channels, limits),
        renew=lambda log: without_repeats(log, transducer),
        limits=dict(zip(channels, limits, strict=True)),
    )


def _motion_rows(campaign: Campaign, run: Run) -> RowTreatment:
    """What is done with the rows of a motion log: time grows, and no position stands alone or is held."""
    return RowTreatment(
        convert=partial(_motion_of_columns, campaign, run),
        clean=lambda log: readings.without_holds(
            readings.without_lone_positions(readings.clean(log))
        ),
        renew=lambda log: log,
        limits={},
    )


_AT_A_TIME = 32
"""Runs that are read together."""
_KEYS_OF_LOGS: tuple[LogKey, LogKey] = ("force_log", "motion_log")


@dataclass(frozen=True)
class Logs:
    """Force and motion log of one run, and its log without load; an unusable one is its error."""

    force: Log | LogError
    motion: Log | LogError
    zero: Log | LogError | None = None

    @property
    def problems(self) -> list[Remark]:
        """What is wrong with unusable logs."""
        logs = (self.force, self.motion, self.zero)
        # one file that holds both says it once
        return list(dict.fromkeys(quoted(log) for log in logs if isinstance(log, LogError)))


def _read_zeros(
    campaign: Campaign, runs: Sequence[Run], zeros_read: Mapping[tuple[str, ...], Log | LogError]
) -> dict[tuple[str, ...], Log | LogError]:
    """Read the logs without load that some runs name and nobody has read yet, each once."""
    # of several runs with one zero log the first
    run_of_zero = {
        _zero(run): run for run in reversed(runs) if run.zero_log and _zero(run) not in zeros_read
    }
    logs = _read(
        campaign, [LogOfRun(run, "force_log", run.zero_log) for run in run_of_zero.values()]
    )
    return {
        key: _usable(campaign, run, run.zero_log, log, _force_rows)
        for (key, run), log in zip(run_of_zero.items(), logs, strict=True)
    }


def _zero(run: Run) -> tuple[str, str, str]:
    """The zero log of a run, and which of its rows and columns are the run's."""
    return run.zero_log, run.force_where, run.force_columns


class LogOfRun(NamedTuple):
    """A log that is to be read: the run it is of, the section of the config that describes it, its file."""

    run: Run
    key: LogKey
    file: str


def _read(campaign: Campaign, logs: Sequence[LogOfRun]) -> list[Log | LongLog | LogError]:
    """Read some logs in their order; a long one is left to be read part by part."""
    reader_by_form: dict[tuple[str, str, str], tuple[Reader, bool]] = {}
    read_or_long: list[tuple[Reader, Path] | LongLog] = []
    for run, key, file in logs:
        kind = key.removesuffix("_log")
        form = key, getattr(run, f"{kind}_where"), getattr(run, f"{kind}_columns")
        if form not in reader_by_form:
            source = source_of(campaign.config, run, key)
            # a column that changes by a rate counts from the first row of the file
            has_rate = any(chosen.rate is not None for chosen in source.columns.values())
            reader_by_form[form] = _reader(campaign, source, key), has_rate
        reader, has_rate = reader_by_form[form]
        path = campaign.raw / file
        is_long = not has_rate and may_be_long(path)
        read_or_long.append(LongLog(reader, path) if is_long else (reader, path))
    at_once = iter(load_each([log for log in read_or_long if not isinstance(log, LongLog)]))
    return [log if isinstance(log, LongLog) else next(at_once) for log in read_or_long]


def _usable(
    campaign: Campaign,
    run: Run,
    file: str,
    log: Log | LongLog | LogError,
    treatment_of: Callable[[Campaign, Run], RowTreatment],
) -> Log | LogError:
    """Turn a log into what the chain takes, or say why it cannot be used, by the name in the run sheet."""
    treatment = treatment_of(campaign, run)
    try:
        if isinstance(log, LogError):
            raise log
        if isinstance(log, LongLog):
            return read_long_log(log, treatment)
        return treatment.clean(treatment.convert(log))
    except LogError as error:
        # the folder of the raw data is the reader's business, not the ledger's
        text = str(error).replace(str(campaign.raw / file), file)
        return LogError(error.code, text, error.rows)


def same_table(config: Config, run: Run) -> bool:
    """Tell whether force and motion of a run are the same rows of one table: a line may hold both."""

    def table(key: LogKey) -> tuple[object, ...]:
        source = source_of(config, run, key)
        dialect = source.dialect or config.dialect
        return source.text, dialect, source.options, source.where_words

    return run.force_log == run.motion_log and table("force_log") == table("motion_log")


def readers(campaign: Campaign, run: Run | None = None) -> tuple[Reader, Reader]:
    """Return the readers of force and of motion logs, of the columns only that the config names.

    `run`: Whose row of the run sheet may name others.
    """
    config = campaign.config
    force, motion = (
        getattr(config, key) if run is None else source_of(config, run, key)
        for key in _KEYS_OF_LOGS
    )
    return _reader(campaign, force, "force_log"), _reader(campaign, motion, "motion_log")


def _reader(campaign: Campaign, source: AnyLog, key: LogKey) -> Reader:
    calibration = campaign.calibration
    gauges = calibration.gauges if calibration is not None else ()
    reader = source_reader(source, campaign.config.dialect, key)
    asks = source.columns or (gauges and key == "force_log")
    return reader.only(log_columns.columns_asked(source, gauges)) if asks else reader
