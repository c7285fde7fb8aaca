"""The one door to a campaign and its results: typed tables, read once, by medium or as a whole."""

from __future__ import annotations

from collections import OrderedDict
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Self

from rftfit.campaign.load import Campaign, load_campaign
from rftfit.errors import InputError
from rftfit.outputs.dictionary import column_of, describe
from rftfit.store import read_csv, read_parquet

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import pandas as pd

    from rftfit.campaign.config import Config

FOLDER = "results"
_CONFIGS = ("config/config.yaml", "config.yaml")
_KEPT_SAMPLES = 4
"""Tables of samples are large: only the last few are kept."""


class UndeclaredInput(AssertionError):
    """A stage reads a result that its declaration does not name: a fault of the program."""


class Tables:
    """Tables below one folder of results, with the types that the dictionary of outputs states."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._allowed: frozenset[str] | None = None
        self._tables: dict[str, pd.DataFrame] = {}
        self._samples: OrderedDict[str, pd.DataFrame] = OrderedDict()

    def only(self, paths: Iterable[str]) -> Self:
        """The same tables, from which nothing but these files may be read: a stage's own inputs."""
        view = copy(self)
        view._allowed = frozenset(paths)
        return view

    def path(self, name: str) -> Path:
        """Path of a file of the results, for example ``alpha/poppy_LP.csv``."""
        if self._allowed is not None and f"{FOLDER}/{name}" not in self._allowed:
            raise UndeclaredInput(name)
        return self.folder / name

    def has(self, name: str) -> bool:
        """Whether a file of the results is there."""
        return self.path(name).is_file()

    def table(self, name: str) -> pd.DataFrame:
        """Read a table, with the types that the dictionary of outputs states.

        Parameters
        ----------
        name : str
            Path below ``results/``, for example ``coefficients.csv`` or ``fits/poppy_LP.csv``.

        Returns
        -------
        pandas.DataFrame
            A copy of its own: a change of it changes nothing else.

        Raises
        ------
        InputError
            If the file is missing, is no table, or lacks a column that is always there.
        """
        if name.endswith(".parquet"):
            return self._sample_table(name)
        self.path(name)
        if name not in self._tables:
            self._tables[name] = self._read(name)
        return self._tables[name].copy(deep=False)

    def _read(self, name: str) -> pd.DataFrame:
        path = self.path(name)
        if not path.is_file():
            raise InputError(f"{path}: there is no such table; `rftfit run` makes it")
        output = describe(f"{FOLDER}/{name}")
        if output is None or not output.columns:
            raise InputError(f"{path}: not a table of this program")
        table = read_csv(
            path, lambda column: one.kind if (one := column_of(output, column)) else ""
        )
        lacking = [
            column
            for one in output.columns
            if not one.when and "<" not in one.name
            for column in one.names
            if column not in table
        ]
        if lacking:
            raise InputError(
                f"{path}: no column {', '.join(lacking)}; make the table again with `rftfit run`"
            )
        return table

    def _sample_table(self, name: str) -> pd.DataFrame:
        if name not in self._samples:
            path = self.path(name)
            if not path.is_file():
                raise InputError(f"{path}: there is no such table; `rftfit run` makes it")
            self._samples[name] = read_parquet(path)
            while len(self._samples) > _KEPT_SAMPLES:
                self._samples.popitem(last=False)
        self._samples.move_to_end(name)
        return self._samples[name].copy(deep=False)


class Results(Tables):
    """A campaign and its tables. Made by `rftfit.open`.

    Parameters
    ----------
    campaign : Campaign
        Checked configuration and run sheet.
    """

    def __init__(self, campaign: Campaign) -> None:
        super().__init__(campaign.root / FOLDER)
        self.campaign = campaign
        self.root = campaign.root

    @property
    def config(self) -> Config:
        """The campaign's configuration."""
        return self.campaign.config

    @cached_property
    def media(self) -> tuple[str, ...]:
        """Media that have runs, in the order of the configuration."""
        return self.campaign.media_with_runs

    @cached_property
    def laboratory(self) -> tuple[str, ...]:
        """Media measured over the angles."""
        return self.campaign.of_role("laboratory")

    @cached_property
    def sands(self) -> tuple[str, ...]:
        """Natural sands: media with one penetration test."""
        return self.campaign.of_role("natural_sand")

    def joined(self, pattern: str, media: tuple[str, ...] | None = None) -> pd.DataFrame:
        """Join the tables of several media, for example of ``alpha/{medium}.csv``."""
        import pandas as pd

        names = self.media if media is None else media
        tables = [self.table(pattern.format(medium=medium)) for medium in names]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()

    def __getitem__(self, medium: str) -> Medium:
        if medium not in self.media:
            raise InputError(f"medium: found '{medium}'; allowed: {', '.join(self.media)}")
        return Medium(self, medium)

    def __iter__(self) -> Iterator[Medium]:
        return (Medium(self, name) for name in self.media)


class Medium:
    """One medium of a campaign: its tables and profiles."""

    def __init__(self, results: Results, name: str) -> None:
        self.results = results
        self.name = name
        self.settings = results.config.media[name]

    @property
    def title(self) -> str:
        """Name for figures and tables."""
        return self.settings.title

    @property
    def alpha(self) -> pd.DataFrame:
        """Alpha over the angles with intervals, one row a cell, N/cm^3."""
        return self.results.table(f"alpha/{self.name}.csv")

    @property
    def fits(self) -> pd.DataFrame:
        """Slope of every plate run."""
        return self.results.table(f"fits/{self.name}.csv")

    @property
    def runs(self) -> pd.DataFrame:
        """What became of the logs of every run."""
        return self.results.table(f"runs/{self.name}.csv")

    @property
    def legs(self) -> pd.DataFrame:
        """Measured forces on legs against theta."""
        return self.results.table(f"legs/{self.name}.csv")

    def __repr__(self) -> str:
        return f"<medium {self.name} of {self.results.root}>"


def open_results(folder: str | Path = ".") -> Results:
    """Open a campaign and its results.

    Parameters
    ----------
    folder : str or Path
        The campaign's folder, its ``config`` or ``results`` folder, or its ``config.yaml``.

    Returns
    -------
    Results

    Raises
    ------
    InputError
        If there is no campaign.
    CampaignError
        If configuration or run sheet are not valid.
    """
    folder = Path(folder)
    places = [folder] if folder.is_file() else []
    for place in (folder, folder.parent) if folder.name in ("config", FOLDER) else (folder,):
        places += [place / name for name in _CONFIGS]
    config = next((path for path in places if path.is_file()), None)
    if config is None:
        raise InputError(
            f"{folder}: no config/config.yaml there; allowed: the folder of a campaign "
            "(`rftfit init` makes one)"
        )
    return Results(load_campaign(config))
