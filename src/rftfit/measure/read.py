"""Read the two logs of each run of a campaign: quantities in the units of the program, without bad rows.

`read_logs` yields `Logs`: a force log (time, F1, F2, F3) and a motion log (time, x, z, angle) of each run, and its
*zero log*, a force log without load, if it has one. A log on its way: a `Reader` parses the file; its columns become
quantities (`log_columns`); its bad rows are left out and counted (`readings`). The last two are a `RowTreatment`, as a
*long log* (one with more rows than are kept) goes through them part by part (`long_logs`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from rftfit.measure.lab_frame import CHANNELS, NEAR_FULL_RANGE, without_repeats
from rftfit.measure.log_columns import LogKey, source_of
from rftfit.measure.long_logs import LongLog, RowTreatment, may_be_long, read_long_log


def read_logs(campaign: Campaign, runs: Sequence[Run]) -> Iterator[tuple[Run, Logs]]:
    """Read the logs of many runs, in their order; an unusable log is returned as its error, not raised.

    Runs are read in groups of `_AT_A_TIME`: this is faster than one by one and limits memory.
    """
    zeros: dict[tuple[str, ...], Log | LogError] = {}
    for start in range(0, len(runs), _AT_A_TIME):
        runs_together = runs[start : start + _AT_A_TIME]
        zeros |= _read_zeros(campaign, runs_together, zeros)
        both = [LogOfRun(run, key, getattr(run, key)) for run in runs_together for key in _LOG_KEYS]
        # an iterator over the force log and the motion log of each run in turn, so zip takes two of it for each run
        logs = _read_together(campaign, both)
        for run, force, motion in zip(runs_together, logs, logs, strict=True):
            yield run, Logs(force, motion, zeros.get(_zero_key(run)))


_AT_A_TIME = 32
"""Runs that are read together."""
_LOG_KEYS: tuple[LogKey, LogKey] = ("force_log", "motion_log")


def _force_of_columns(campaign: Campaign, run: Run, log: Log) -> Log:
    """Turn the columns of a force log into time and F1 to F3, row by row; raise `LogError` if one is lacking.

    Rows with a value that means no data are left out first, as a calibration would spread it over all channels.
    """
    config = campaign.config
    source, units = source_of(config, run, "force_log"), log_columns.chain_units(config)
    log = readings.without_missing(log, config.force_log.missing)
    log = log_columns.convert_gauges(log, campaign.calibration, units)
    log = log_columns.map_columns(log, source, units, "force_log")
    return log_columns.check_complete(log, run, log_columns.FORCE_QUANTITIES, "force")


def _motion_of_columns(campaign: Campaign, run: Run, log: Log) -> Log:
    """Turn the columns of a motion log into time, x, z and angle, row by row; raise `LogError` if one is lacking.

    What the run sheet states, as the angle, is added where the log has a height at least.
    """
    config = campaign.config
    source, units = source_of(config, run, "motion_log"), log_columns.chain_units(config)
    log = readings.without_missing(log, config.motion_log.missing)
    log = log_columns.map_columns(log, source, units, "motion_log")
    if not {"z", "along"}.isdisjoint(log.columns):
        middle_cm, surface_cm = config.arm.middle_x_mm / 10, run.surface_of(config.arm) / 10
        log = log_columns.complete_motion_log(log, run, units, middle_cm, surface_cm)
    return log_columns.check_complete(log, run, log_columns.MOTION_QUANTITIES, "motion")


def _force_rows(campaign: Campaign, run: Run) -> RowTreatment:
    """Make the treatment of the rows of a force log: afterwards time increases, and no reading stands alone.

    The limits are 99.5 % of the range of each channel: readings there are saturated, and are no spikes.
    """
    transducer = campaign.config.transducer
    limits = {
        channel: NEAR_FULL_RANGE * limit
        for channel, limit in zip(CHANNELS, transducer.range_N, strict=True)
    }
    return RowTreatment(
        convert=partial(_force_of_columns, campaign, run),
        clean=lambda log: readings.without_spikes(readings.clean(log), limits),
        drop_repeats=lambda log: without_repeats(log, transducer),
        limits=limits,
    )


def _motion_rows(campaign: Campaign, run: Run) -> RowTreatment:
    """Make the treatment of the rows of a motion log: after it time increases, no position stands alone or is held."""
    return RowTreatment(
        convert=partial(_motion_of_columns, campaign, run),
        clean=lambda log: readings.without_holds(
            readings.without_lone_positions(readings.clean(log))
        ),
        drop_repeats=lambda log: log,
        limits={},
    )


@dataclass(frozen=True)
class Logs:
    """Force and motion log of one run, and its zero log (recorded without load); an unusable log is its error."""

    force: Log | LogError
    motion: Log | LogError
    zero: Log | LogError | None = None

    @property
    def problems(self) -> list[Remark]:
        """Errors of the unusable logs."""
        logs = (self.force, self.motion, self.zero)
        # a file that holds both logs has the same error twice
        return list(dict.fromkeys(quoted(log) for log in logs if isinstance(log, LogError)))


def _read_zeros(
    campaign: Campaign, runs: Sequence[Run], zeros_read: Mapping[tuple[str, ...], Log | LogError]
) -> dict[tuple[str, ...], Log | LogError]:
    """Read the zero logs of some runs, each once, without those in `zeros_read`; return them by `_zero_key`."""
    # reversed, so that the first of several runs with the same zero log counts
    run_of_zero = {
        _zero_key(run): run
        for run in reversed(runs)
        if run.zero_log and _zero_key(run) not in zeros_read
    }
    logs = [LogOfRun(run, "force_log", run.zero_log) for run in run_of_zero.values()]
    return dict(zip(run_of_zero, _read_together(campaign, logs), strict=True))


def _zero_key(run: Run) -> tuple[str, str, str]:
    """Key of the zero log of a run: its file, and the rows and columns of it that the run uses."""
    return run.zero_log, run.force_where, run.force_columns


class LogOfRun(NamedTuple):
    """A log to be read: its run, the section of the config that describes it (`key`), its file below the raw folder."""

    run: Run
    key: LogKey
    file: str


def _read_together(campaign: Campaign, logs: Sequence[LogOfRun]) -> Iterator[Log | LogError]:
    """Read some logs in their order, and yield each converted and cleaned, or the error why it cannot be used."""
    for log_of_run, log in zip(logs, _load_logs(campaign, logs), strict=True):
        yield _treat_log(campaign, log_of_run, log)


def _load_logs(campaign: Campaign, logs: Sequence[LogOfRun]) -> list[Log | LongLog | LogError]:
    """Read some logs in their order; a long log is returned unread, to be read part by part later.

    Logs that are written alike share a reader, and logs that are not long are parsed at the same time.
    """
    # by section of the config and cells of the run sheet: the reader, and True if a column has a rate
    reader_by_form: dict[tuple[str, str, str], tuple[Reader, bool]] = {}
    read_or_long: list[tuple[Reader, Path] | LongLog] = []
    for run, key, file in logs:
        kind = key.removesuffix("_log")
        form = key, getattr(run, f"{kind}_where"), getattr(run, f"{kind}_columns")
        if form not in reader_by_form:
            source = source_of(campaign.config, run, key)
            # a column that changes at a stated rate counts from the first row of the file, so that file is read as a whole
            has_rate = any(chosen.rate is not None for chosen in source.columns.values())
            reader_by_form[form] = _make_reader(campaign, source, key), has_rate
        reader, has_rate = reader_by_form[form]
        path = campaign.raw / file
        is_long = not has_rate and may_be_long(path)
        read_or_long.append(LongLog(reader, path) if is_long else (reader, path))
    at_once = iter(load_each([log for log in read_or_long if not isinstance(log, LongLog)]))
    return [log if isinstance(log, LongLog) else next(at_once) for log in read_or_long]


def _treat_log(
    campaign: Campaign, log_of_run: LogOfRun, log: Log | LongLog | LogError
) -> Log | LogError:
    """Convert and clean a log, or return the error why not; its message names the file as the run sheet does.

    `log`: As read; a `LongLog` is read here, part by part; an error is returned with its message changed.
    """
    run, key, file = log_of_run
    treatment = (_force_rows if key == "force_log" else _motion_rows)(campaign, run)
    try:
        if isinstance(log, LogError):
            raise log
        if isinstance(log, LongLog):
            return read_long_log(log, treatment)
        return treatment.clean(treatment.convert(log))
    except LogError as error:
        # the ledger names files without the folder of the raw data
        message = str(error).replace(str(campaign.raw / file), file)
        return LogError(error.code, message, error.rows)


def same_table(config: Config, run: Run) -> bool:
    """Return True if force and motion of a run are read from the same rows of one file, which then count once."""

    def table(key: LogKey) -> tuple[object, ...]:
        source = source_of(config, run, key)
        dialect = source.dialect or config.dialect
        return source.text, dialect, source.options, source.where_words

    return run.force_log == run.motion_log and table("force_log") == table("motion_log")


def readers(campaign: Campaign, run: Run | None = None) -> tuple[Reader, Reader]:
    """Return the readers of force and motion logs, which read only the columns that the config names.

    `run`: Run whose row of the run sheet may replace columns of the config; None: the config alone counts.
    """
    config = campaign.config
    force, motion = (
        getattr(config, key) if run is None else source_of(config, run, key) for key in _LOG_KEYS
    )
    return _make_reader(campaign, force, "force_log"), _make_reader(campaign, motion, "motion_log")


def _make_reader(campaign: Campaign, source: AnyLog, key: LogKey) -> Reader:
    """Make the reader of the logs that a section of the config, `source`, describes.

    It reads all columns if the config names none.
    """
    calibration = campaign.calibration
    gauges = calibration.gauges if calibration is not None else ()
    reader = source_reader(source, campaign.config.dialect, key)
    asks = source.columns or (gauges and key == "force_log")
    return reader.only(log_columns.columns_asked(source, gauges)) if asks else reader
