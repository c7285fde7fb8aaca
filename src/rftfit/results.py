"""Access to a campaign and its results: typed tables, each read once, of one medium or of all."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import Any, Self

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config
from rftfit.campaign.load import Campaign, load_campaign
from rftfit.campaign.presence import config_of
from rftfit.campaign.problems import choose
from rftfit.checks.medium import marks_of
from rftfit.checks.verdict import Verdict, verdict_on
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.forces.contacts import Contact
from rftfit.forces.model_error import larger_model_error
from rftfit.forces.motion import rotation
from rftfit.forces.outlines import leg_outline
from rftfit.measure.alpha import QUANTITIES, bed_spread, cell_at, column, window_of
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.measure.flags import Flags, Remark, format_remarks, remark, with_reasons
from rftfit.measure.session_clocks import SessionClocks
from rftfit.measure.verdict_words import DOUBTFUL, UNUSABLE
from rftfit.model import scaling
from rftfit.model.bekker import PressureSinkage, pressure_sinkage, width_of_plate
from rftfit.model.common_errors import covariance_of
from rftfit.model.draws import measured_profile
from rftfit.model.fourier import METHODS
from rftfit.model.profiles import (
    EPS,
    KINDS,
    DepthOnlyProfile,
    FourierProfile,
    KnownMedium,
    Profile,
    TableProfile,
    scaled_generic,
)
from rftfit.model.shapes import Map, Shapes, estimate, nodes_of, published_shapes, pushes_of
from rftfit.outputs.dictionary import Output, column_of, describe_file
from rftfit.store import csv_bytes, read_csv, read_parquet
from rftfit.store.digests import sha256_of

FOLDER = "results"
LEG_ERRORS = "leg_errors.csv"
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

    @property
    def allowed(self) -> frozenset[str]:
        """Files that a stage may read, from the campaign's folder; empty where all may be read."""
        return self._allowed or frozenset()

    def path(self, name: str) -> Path:
        """Path of a file of the results, for example ``alpha/poppy_LP.csv``."""
        if self._allowed is not None and f"{FOLDER}/{name}" not in self._allowed:
            raise UndeclaredInput(name)
        return self.folder / name

    def has(self, name: str) -> bool:
        """Whether a file of the results is there, or held as if it were."""
        return name in self._tables or self.path(name).is_file()

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
            self._tables[name] = self._typed(name, self._there(name))
        return self._tables[name].copy(deep=False)

    def hold(self, name: str, table: pd.DataFrame) -> None:
        """Take a table as if it had been read."""
        (self._samples if name.endswith(".parquet") else self._tables)[name] = table

    def hold_as_csv(self, name: str, table: pd.DataFrame) -> pd.DataFrame:
        """Take a table as it would come back from the file that `rftfit run` writes, and return it so."""
        self.hold(name, self._typed(name, csv_bytes(table)))
        return self.table(name)

    def _there(self, name: str) -> Path:
        if not (path := self.path(name)).is_file():
            raise InputError(f"{path}: there is no such table; `rftfit run` makes it")
        return path

    def as_written(self, name: str) -> pd.DataFrame:
        """Read a table that another version of the program may have written: its columns are what they are."""
        return self._read(name, self._there(name))[0]

    def _read(self, name: str, source: Path | bytes) -> tuple[pd.DataFrame, Output]:
        output = describe_file(f"{FOLDER}/{name}")
        if output is None or not output.columns:
            raise InputError(f"{self.folder / name}: not a table of this program")
        table = read_csv(
            source, lambda column: entry.kind if (entry := column_of(output, column)) else ""
        )
        return table, output

    def _typed(self, name: str, source: Path | bytes) -> pd.DataFrame:
        path = self.folder / name
        table, output = self._read(name, source)
        always = (
            column_entry.names
            for column_entry in output.columns
            if not column_entry.when and "<" not in column_entry.name
        )
        if lacking := [name for names in always for name in names if name not in table]:
            raise InputError(
                f"{path}: no column {', '.join(lacking)}; make the table again with `rftfit run`"
            )
        return table

    def _sample_table(self, name: str) -> pd.DataFrame:
        if name not in self._samples:
            self._samples[name] = read_parquet(self._there(name))
            while len(self._samples) > _KEPT_SAMPLES:
                self._samples.popitem(last=False)
        self._samples.move_to_end(name)
        return self._samples[name].copy(deep=False)


class Results(Tables):
    """A campaign and the tables of its results: made by `open`.

    ``results["poppy_LP"]`` is one medium, iteration gives all of them.

    Parameters
    ----------
    campaign : Campaign
        Checked configuration and run sheet.

    Examples
    --------
    >>> import rftfit
    >>> results = rftfit.open("my_campaign")  # doctest: +SKIP
    >>> results.table("penetration.csv")  # doctest: +SKIP
    >>> results["poppy_LP"].profile("table")  # doctest: +SKIP
    """

    def __init__(self, campaign: Campaign) -> None:
        super().__init__(campaign.root / FOLDER)
        self.campaign = campaign
        self.root = campaign.root
        self._fits: dict[tuple[str, str], scaling.MediumFit] = {}
        self._alpha: dict[str, pd.DataFrame] = {}
        self._maps: dict[tuple[str, ...], Map] = {}

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

    @property
    def checks(self) -> pd.DataFrame:
        """Whether the numbers of each medium can be believed: one row a medium and check."""
        return self.joined("checks/{medium}.csv")

    @cached_property
    def marks(self) -> dict[str, list[Remark]]:
        """What stands wherever a medium appears that fails a check, by medium."""
        # a campaign that was not run yet has none
        are_checked = all(self.has(f"checks/{medium}.csv") for medium in self.media)
        return marks_of(self.checks, self.config.media) if are_checked else {}

    @property
    def session_clocks(self) -> SessionClocks | None:
        """Clocks of all sessions, from the pushes of all media; None where they are not estimated."""
        settings = self.config.clock
        if settings.method != "estimate":
            return None
        tables = (self.table(f"clocks/{medium}.parquet") for medium in self.media)
        return SessionClocks.of_pushes(tables, settings)

    @property
    def titles(self) -> dict[str, str]:
        """Titles of the media, marked where one fails a check."""
        marks = {medium: f" ({marks[0].code})" for medium, marks in self.marks.items()}
        return {name: title + marks.get(name, "") for name, title in self.campaign.titles.items()}

    def marked(self, table: pd.DataFrame) -> pd.DataFrame:
        """Add the marks of its medium to the reason of each row of a table."""
        return with_reasons(table, (self.marks.get(medium, ()) for medium in table["medium"]))

    def joined(self, pattern: str, media: tuple[str, ...] | None = None) -> pd.DataFrame:
        """Join the tables of several media.

        Parameters
        ----------
        pattern : str
            For example ``alpha/{medium}.csv``.
        media : tuple of str, optional
            Default: all.

        Returns
        -------
        pandas.DataFrame
        """
        names = self.media if media is None else media
        tables = [self.table(pattern.format(medium=medium)) for medium in names]
        return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()

    def map_table(self, medium: str) -> pd.DataFrame:
        """Estimated alpha of one medium in every direction.

        Parameters
        ----------
        medium : str

        Returns
        -------
        pandas.DataFrame
            ``maps/{medium}.csv`` without the row that says why there is no map (`map_reason`).

        Raises
        ------
        InputError
            If the table was not made.
        """
        table = self.table(f"maps/{medium}.csv")
        return table[table["beta_deg"].notna()]

    def map_reason(self, medium: str) -> str:
        """Why a medium has no map; empty where it has one.

        Parameters
        ----------
        medium : str

        Returns
        -------
        str

        Raises
        ------
        InputError
            If the table of maps was not made.
        """
        return "; ".join(filter(None, self.table(f"maps/{medium}.csv")["reason"].unique()))

    def alpha_table(self, medium: str) -> pd.DataFrame:
        """Alpha of one medium, each of its directions once.

        Parameters
        ----------
        medium : str

        Returns
        -------
        pandas.DataFrame
            By beta, then gamma.

        Raises
        ------
        InputError
            If the table is missing or damaged.
        """
        name = f"alpha/{medium}.csv"
        self.path(name)  # a stage must not get at a table that it does not declare
        if name not in self._alpha:
            self._alpha[name] = self._sound_alpha(name)
        return self._alpha[name].copy(deep=False)

    def _sound_alpha(self, name: str) -> pd.DataFrame:
        table = self.table(name).sort_values(["beta_deg", "gamma_deg"], ignore_index=True)
        numbers = table[[column(c, quantity) for c in "zx" for quantity in QUANTITIES]]
        kinds = {str(kind) for kind in (*numbers.dtypes, *table.dtypes[["beta_deg", "gamma_deg"]])}
        if not kinds <= {"float64", "int64"} or np.isinf(numbers).any(axis=None):
            why = "a column of numbers holds something else"
        else:
            angles = table[["beta_deg", "gamma_deg"]]
            angles_in_range = (angles.notna() & (angles.abs() <= 90)).all(axis=None)
            if angles_in_range and not angles.duplicated().any():
                return table
            why = "angles that are missing, outside of -90 to 90 degrees, or there twice"
        raise InputError(f"{self.path(name)}: {why}; make the table again with `rftfit run`")

    @property
    def error_of_legs(self) -> float:
        """The model's own error as the measured legs of the campaign show it; NaN where none was measured."""
        shown = self.table(LEG_ERRORS)["model_error_of_legs"].dropna()
        return float(shown.iloc[0]) if len(shown) else math.nan

    @property
    def model_error(self) -> float:
        """The model's own error in this campaign: that of its legs, where it is larger than the usual one.

        The usual one where no leg was compared yet.
        """
        declared = self._allowed is None or f"{FOLDER}/{LEG_ERRORS}" in self._allowed
        return larger_model_error(self.error_of_legs) if declared and self.has(LEG_ERRORS) else EPS

    def fits(self, method: str | None = None) -> dict[str, scaling.MediumFit]:
        """Nine-term fits of the laboratory media, made from their alpha tables.

        Parameters
        ----------
        method : str, optional
            ``lsq`` or ``dft-index``; default: that of the configuration.

        Returns
        -------
        dict of str to MediumFit
            By medium; a medium without a usable grid has a reason instead of numbers.
        """
        method = choose("method", method or self.config.fourier.method, METHODS)
        for medium in self.laboratory:
            # read first: a stage must not get at a table that it does not declare
            table = self.alpha_table(medium)
            if (medium, method) not in self._fits:
                self._fits[medium, method] = scaling.fit_terms(table, self.config, method)
        return {medium: self._fits[medium, method] for medium in self.laboratory}

    def generic(self, method: str | None = None) -> FloatArray:
        """Generic coefficients M0 of the laboratory media.

        Parameters
        ----------
        method : str, optional
            As for `fits`.

        Returns
        -------
        numpy.ndarray, shape (9,)
            Dimensionless; NaN where no medium has a usable grid.
        """
        coefficients = [fit.used for fit in self.fits(method).values() if fit.counts]
        return scaling.generic(np.stack(coefficients)) if coefficients else np.full(9, np.nan)

    def reference(self, method: str | None = None) -> scaling.Reference:
        """The media that a further medium is scaled from.

        Parameters
        ----------
        method : str, optional
            As for `fits`.

        Returns
        -------
        Reference
            The campaign's own; the published five (`Reference.printed`) where fewer than two of its
            media have a usable grid.
        """
        fits = list(self.fits(method).values())
        return scaling.reference_of(fits, method or self.config.fourier.method)

    def shapes(self, medium: str = "") -> Shapes:
        """Known media whose shape a medium is taken to have.

        Parameters
        ----------
        medium : str, optional
            It is not among them itself, nor is the published medium that it is; default: one that is
            not of this campaign.

        Returns
        -------
        Shapes
        """
        published_name = self.config.media[medium].published_as if medium else None
        published = published_shapes([published_name or ""])
        if not self.config.maps.own_media:
            return published
        profiles = dict(published.profiles)
        for lab_medium in self.laboratory:
            profile = TableProfile.from_table(self.alpha_table(lab_medium), lab_medium)
            if lab_medium != medium and not profile.reason and lab_medium not in self.marks:
                profiles |= {lab_medium: profile}
        return Shapes(profiles)

    def __getitem__(self, medium: str) -> Medium:
        return Medium(self, choose("medium", medium, self.media))

    def __iter__(self) -> Iterator[Medium]:
        return (Medium(self, name) for name in self.media)


class Medium(KnownMedium):
    """One medium of a campaign: its tables and profiles. Made by ``results[name]``.

    Parameters
    ----------
    results : Results
    name : str
        As in the configuration.

    Examples
    --------
    >>> import rftfit
    >>> sand = rftfit.open("my_campaign")["poppy_LP"]  # doctest: +SKIP
    >>> sand.zeta, sand.alpha  # doctest: +SKIP
    >>> rftfit.predict(sand, rftfit.model_leg("c_leg"))  # doctest: +SKIP
    >>> rftfit.predict(sand.profile("fourier"), rftfit.model_leg("c_leg"))  # doctest: +SKIP
    """

    def __init__(self, results: Results, name: str) -> None:
        self.results = results
        self.name = name
        self.settings = results.config.media[name]

    @property
    def title(self) -> str:
        """Name for figures and tables; marked where the medium fails a check."""
        return self.results.titles[self.name]

    @cached_property
    def verdict(self) -> Verdict:
        """Verdict on the data of the medium in a word, and why: by its checks, and by what its runs lack."""
        return verdict_on(self.results.table(f"checks/{self.name}.csv"), self.fits, self.flags)

    @property
    def doubt(self) -> str:
        """Verdict on the data where it is ``doubtful`` or ``unusable``; else, and before a run, empty."""
        needed = ("checks", "fits", "flags")
        if not all(self.results.has(f"{table}/{self.name}.csv") for table in needed):
            # of results whose tables of runs were not kept, by the checks alone
            return format_remarks(self.results.marks.get(self.name, ()))
        return str(self.verdict) if self.verdict.word in (UNUSABLE, DOUBTFUL) else ""

    @property
    def alpha(self) -> pd.DataFrame:
        """Alpha over the angles with intervals, one row a cell, N/cm^3."""
        return self.results.alpha_table(self.name)

    @property
    def alpha_at_depth(self) -> pd.DataFrame:
        """Stress over depth at `fit.depths_cm` by a power of depth, with intervals; no rows where stress is a line."""
        return self.results.table(f"alpha_at_depth/{self.name}.csv")

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the errors of alpha, of all cells and both components, (N/cm^3)^2.

        Index and columns are beta_deg, gamma_deg and component (``z`` or ``x``); an alpha without an error is
        not in it. Errors that runs share (session, turn, rod, tare) are correlated; the root of the diagonal is the
        standard error in `alpha`. As ``alpha_covariance/<medium>.csv``, not rounded. Of a force that is linear in
        alpha with weights w, ``w @ covariance @ w`` is the variance.
        """
        return covariance_of(self.alpha)

    @property
    def fits(self) -> pd.DataFrame:
        """Slope of every plate run."""
        return self.results.table(f"fits/{self.name}.csv")

    def pressure_sinkage(self) -> PressureSinkage:
        """Bekker's k and n of the pushes straight down, for programs that calculate tracks and wheels by them.

        Raises
        ------
        InputError
            If no such push has a power of depth.
        """
        campaign = self.results.campaign
        plates = campaign.config.intruders
        widths = {
            run.run_id: width_of_plate(plates[run.intruder])
            for run in campaign.runs
            if run.kind == "plate"
        }
        return pressure_sinkage(self.fits, widths)

    @property
    def runs(self) -> pd.DataFrame:
        """What became of the logs of every run."""
        return self.results.table(f"runs/{self.name}.csv")

    @property
    def flags(self) -> Flags:
        """Doubts about the runs and cells, by code."""
        return Flags(self.results.table(f"flags/{self.name}.csv"))

    @property
    def legs(self) -> pd.DataFrame:
        """Measured forces on legs against theta."""
        return self.results.table(f"legs/{self.name}.csv")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of profile that it can have: a natural sand is known by one cell of its table."""
        return KINDS if self.name in self.results.laboratory else ("table", "map", "generic")

    def coefficients(self, method: str | None = None) -> FloatArray:
        """Nine coefficients; a dropped term is 0.

        Parameters
        ----------
        method : str, optional
            ``lsq`` or ``dft-index``; default: that of the configuration.

        Returns
        -------
        numpy.ndarray, shape (9,)
            N/cm^3, as in Table S2; of a natural sand those of its generic profile; NaN where there
            are none, which the reason of the profile explains.
        """
        if self.name in self.results.laboratory:
            return self.results.fits(method)[self.name].used
        return self._generic(method, draws=False).coefficients

    @property
    def zeta(self) -> float:
        """Scaling factor of the nine terms fitted to the pushed directions; NaN where there is none.

        By the method of the configuration. Where the pushes leave parts of the published grid out it is not comparable
        with those of the paper; that of the map (`rftfit.Map.zeta`) is.
        """
        if self.name in self.results.laboratory:
            return self.results.fits()[self.name].zeta
        try:
            return self.scaled().zeta
        except InputError:
            return np.nan

    @property
    def chi(self) -> float:
        """Measured over fitted alpha_z(0, 90 deg), of the fit of `zeta`; of a natural sand the mean of its reference."""
        if self.name in self.results.laboratory:
            fit = self.results.fits()[self.name]
            return fit.alpha_z / fit.zeta
        return float(self.results.reference().chi.mean())

    def scaled(self, method: str | None = None) -> scaling.ScaledMedium:
        """The medium by its one penetration test, alpha_z(0, 90 deg), and the paper's scaling routine.

        Parameters
        ----------
        method : str, optional
            Of the fits of the reference media; default: that of the configuration.

        Returns
        -------
        ScaledMedium

        Raises
        ------
        InputError
            If the test gives no number.
        """
        table = self.alpha
        cell = cell_at(table, 0, 90)
        if cell is None:
            raise InputError(f"{self.name}: {remark('no-push')}")
        level = self.results.config.fit.confidence
        alpha, se = scaling.alpha_of_test(cell, level)
        try:
            return scaling.scale_by_paper(alpha, se, self.results.reference(method), level)
        except ValueError as error:
            why = f"no alpha at (0, 90) deg: {cell['reason']}" if np.isnan(alpha) else str(error)
            raise InputError(f"{self.name}: {why}") from error

    def contact(self, leg: str) -> Contact | None:
        """Measured forces on a leg that turned in this medium, as `rftfit.estimate_map` takes them.

        Parameters
        ----------
        leg : str
            Of the configuration.

        Returns
        -------
        Contact or None
            None where the leg was not measured in this medium.

        Raises
        ------
        InputError
            If its curve tells nothing, as one of one pose.
        """
        curve = self.legs
        curve = curve[curve["leg"] == leg] if len(curve) else curve
        names = ("force_z_N", "force_x_N")
        if not len(curve) or not curve[[*names]].notna().any(axis=None):
            return None
        # repeats share what the model gets wrong: their mean is one turn
        curve = curve.groupby("theta_deg", as_index=False)[[*names]].mean()
        described = self.results.config.legs[leg]
        speed = self.results.config.arm.leg_speed_rad_per_s
        motion = rotation(curve["theta_deg"].to_numpy(float), described.hip_height_cm, speed)
        forces = {name: curve[name].to_numpy(float) for name in names}
        largest = max(float(np.nanmax(np.abs(force))) for force in forces.values())
        # the errors of a curve itself are smaller than those from bed to bed
        error = (bed_spread(self.alpha) or USUAL_BED_SPREAD) * largest
        try:
            return Contact(leg_outline(described, leg), motion, forces, error, name=self.name)
        except ValueError as problem:
            raise InputError(f"{leg}: {problem}") from problem

    def map(
        self, contacts: Sequence[Contact] = (), *, teachers: Sequence[str] | None = None
    ) -> Map:
        """Alpha in every direction: what was pushed, completed by the shape that known media share.

        Parameters
        ----------
        contacts : sequence of Contact, optional
            Forces on bodies in this medium, beside those of the teachers.
        teachers : sequence of str, optional
            Legs whose measured forces teach the map. Default: ``maps.use_legs`` of the configuration.

        Returns
        -------
        Map

        Raises
        ------
        InputError
            If no push has a number that tells of the medium.
        """
        if teachers is None:
            teachers = self.results.config.maps.use_legs
        legs = [self.contact(leg) for leg in teachers]
        taught = [contact for contact in legs if contact is not None]
        if contacts:
            estimated = self._estimate([*contacts, *taught])
        else:
            maps, key = self.results._maps, (self.name, *teachers)
            estimated = maps[key] if key in maps else maps.setdefault(key, self._estimate(taught))
        return replace(
            estimated,
            bed_spread=bed_spread(self.alpha) or USUAL_BED_SPREAD,
            model_error=self.results.model_error,
        )

    def _estimate(self, contacts: Sequence[Contact]) -> Map:
        table, config = self.alpha, self.results.config
        try:
            return estimate(
                pushes_of(table, config),
                self.results.shapes(self.name),
                nodes_of(table),
                confidence=config.fit.confidence,
                name=self.name,
                contacts=contacts,
            )
        except ValueError as error:
            raise InputError(f"{self.name}: {error}") from error

    def profile(
        self, kind: str = "table", method: str | None = None, *, draws: bool = True
    ) -> Profile:
        """What answers alpha(beta, gamma) for this medium, with what its intervals come from.

        Parameters
        ----------
        kind : str, optional
            ``table``: alpha as measured, interpolated. ``map``: completed by the shape that known media
            share. ``fourier``: its nine terms. ``generic``: its
            zeta times the generic nine; that of a natural sand is scaled from its one penetration
            test. ``depth_only``: the baseline without angles.
        method : str, optional
            Of the nine-term fit, ``lsq`` or ``dft-index``; default: that of the configuration.
        draws : bool, optional
            Whether to make the draws of the errors of alpha, which take a moment.

        Returns
        -------
        Profile
            Its `reason` says why there is NaN.

        Raises
        ------
        InputError
            If there is no such kind or method.
        """
        allowed = "" if self.kinds == KINDS else "a natural sand is known by one penetration test"
        choose("profile", kind, self.kinds, allowed)
        table, config = self.alpha, self.results.config
        profile: Profile
        if kind == "fourier":
            profile = self._fourier(method, draws=draws)
        elif kind == "generic":
            profile = self._generic(method, draws=draws)
        elif kind == "map":
            try:
                profile = self.map().profile
                profile.spread = profile.spread if draws else None
            except InputError as error:
                nothing = np.full((7, 13), np.nan)
                profile = TableProfile(nothing, nothing, name=f"map of {self.name}")
                profile.reason = str(error)
        else:
            name = f"measured table of {self.name}"
            profile = measured = measured_profile(table, config, name, draws=draws)
            if kind == "depth_only":
                profile = DepthOnlyProfile.of(measured, f"depth-only, of {self.name}")
        profile.window = window_of(table)
        profile.bed_spread = bed_spread(table) or profile.bed_spread
        if isinstance(profile, TableProfile):
            profile.model_error = self.results.model_error
        elif isinstance(profile, FourierProfile) and draws:
            profile.beside = cache(partial(self._table_or_map, draws=False))
        return profile

    def as_profile(self, is_enough: Callable[[Profile], bool] | None = None) -> Profile:
        """Return the profile by which forces are predicted: the table where it is enough, else the map.

        Parameters
        ----------
        is_enough : callable, optional
            Whether the table has a number in every direction that is asked for; default: in all directions.

        Returns
        -------
        Profile
        """
        return self._table_or_map(is_enough)

    def _table_or_map(
        self, is_enough: Callable[[Profile], bool] | None = None, *, draws: bool = True
    ) -> Profile:
        """Return the table where it is enough, else the map, with or without draws."""
        table = self.profile("table", draws=draws)
        if not table.reason or (is_enough is not None and is_enough(table)):
            return table
        completed = self.profile("map", draws=draws)
        # a medium without any number has a reason by either
        return table if completed.reason else completed

    def export_source(self, kind: str | None = None) -> tuple[KnownMedium, dict[str, Any]]:
        """Return what a profile file of this medium is made of, and what the file says of it beside alpha.

        Parameters
        ----------
        kind : str, optional
            ``table`` or ``map``. Default: the table, where every direction was pushed, else the map.

        Returns
        -------
        source : KnownMedium
        facts : dict of str to object
            Arguments of `write_profile`, by name.

        Raises
        ------
        InputError
            If the map has no number.
        """
        name = f"alpha/{self.name}.csv"
        facts = {
            "name": self.name,
            "title": self.results.campaign.titles[self.name],
            "marks": self.doubt,
            "window": window_of(self.alpha),
            "made_from": {f"{FOLDER}/{name}": sha256_of(self.results.path(name))},
        }
        table = self.profile()
        is_map = kind == "map" or (kind is None and bool(table.reason))
        return (self.map() if is_map else table), facts

    def _fourier(self, method: str | None, *, draws: bool) -> FourierProfile:
        fit = self.results.fits(method)[self.name]
        name = f"nine terms ({fit.method}) of {self.name}"
        if fit.reason:
            return FourierProfile(fit.used, name, f"{name}: {fit.reason}")
        return FourierProfile(fit.used, name, spread=FourierProfile(fit.draws) if draws else None)

    def _generic(self, method: str | None, *, draws: bool) -> FourierProfile:
        if self.name not in self.results.laboratory:
            try:
                return self.scaled(method).profile
            except InputError as error:
                return FourierProfile(np.full(9, np.nan), f"generic, {self.name}", str(error))
        fits = self.results.fits(method)
        fit_of_medium, other_fits = fits[self.name], [fit for fit in fits.values() if fit.counts]
        name = (
            f"generic ({fit_of_medium.method}) times zeta = {fit_of_medium.zeta:.4f} of {self.name}"
        )
        if fit_of_medium.reason or not other_fits:
            why = fit_of_medium.reason or "no medium that passes its checks has nine terms"
            name = f"generic ({fit_of_medium.method}) of {self.name}"
            return FourierProfile(np.full(9, np.nan), name, f"{name}: {why}")
        spread = None
        if draws:
            many = scaling.generic(np.stack([fit.draws for fit in other_fits], axis=1))
            spread = scaled_generic(fit_of_medium.zeta_draws, many)
        return scaled_generic(fit_of_medium.zeta, self.results.generic(method), name, spread)

    def __repr__(self) -> str:
        return f"<medium {self.name} of {self.results.root}>"


def open_results(folder: str | Path = ".") -> Results:
    """Open a campaign and its results.

    Parameters
    ----------
    folder : str or Path, optional
        The campaign's folder, its ``config`` or ``results`` folder, or its ``config.yaml``.

    Returns
    -------
    Results

    Raises
    ------
    InputError
        If there is no campaign, or its configuration or run sheet are not valid.

    Examples
    --------
    >>> import rftfit
    >>> results = rftfit.open("my_campaign")  # doctest: +SKIP
    >>> results.media  # doctest: +SKIP
    """
    return Results(load_campaign(config_of(folder)))
