"""Access to a campaign and its results (`rftfit.open`): typed tables, each read once; media, their profiles and maps.

`Tables` reads files of a folder of results. `Results` adds the campaign and what concerns all its media, `Medium` what
concerns one. `rftfit.outputs` is the dictionary of results: it states every column of every file with its unit. A
*stage* is a function of the workflow that makes some of the files from others.
"""

from __future__ import annotations

import math
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
from rftfit.measure.alpha import QUANTITIES, cell_down, column, spread_of_next_bed, window_of
from rftfit.measure.errors import USUAL_BED_SPREAD
from rftfit.measure.flags import Flags, Remark, format_remarks, remark, with_reasons
from rftfit.measure.session_clocks import SessionClocks
from rftfit.measure.verdict_words import DOUBTFUL, UNUSABLE
from rftfit.model import scaling
from rftfit.model.bekker import PressureSinkage, pressure_sinkage, width_of_plate
from rftfit.model.common_errors import covariance_of
from rftfit.model.draws import measured_profile
from rftfit.model.fourier import METHODS
from rftfit.model.maps import Map, estimate, nodes_of
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
from rftfit.model.pushes import pushes_of
from rftfit.model.shapes import Shapes, published_shapes
from rftfit.outputs.dictionary import Output, column_of, describe_file
from rftfit.store import csv_bytes, read_csv, read_parquet
from rftfit.store.digests import sha256_of
from rftfit.store.links import RESULTS

LEG_ERRORS = "leg_errors.csv"
"""Table of the forces on legs, predicted and measured, with the error of the force model."""


class UndeclaredInput(AssertionError):
    """A stage reads a result that is not among its declared inputs: a fault of the program."""


class Tables:
    """Tables in one folder of results, whose columns have the types that the dictionary of outputs states.

    A table's `name` is its path below ``results/``, such as ``alpha/poppy_LP.csv``.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._allowed: frozenset[str] | None = None  # None: every file may be read
        self._tables: dict[str, pd.DataFrame] = {}
        self._sorted: set[str] = (
            set()
        )  # names of the tables in memory that `alpha_table` has sorted and checked

    def only(self, paths: Iterable[str]) -> Self:
        """Return a view from which only some files may be read, so that a stage reads nothing but its declared inputs.

        `paths`: These files, from the campaign's folder, such as ``results/alpha/poppy_LP.csv``. Tables that were read
        are shared with the view.
        """
        view = copy(self)
        view._allowed = frozenset(paths)
        return view

    @property
    def allowed(self) -> frozenset[str]:
        """Files that a stage may read, from the campaign's folder; empty where all may be read."""
        return self._allowed or frozenset()

    def path(self, name: str) -> Path:
        """Path of a file of the results; raises UndeclaredInput if `only` does not allow it. The file may be missing."""
        if self._allowed is not None and f"{RESULTS}/{name}" not in self._allowed:
            raise UndeclaredInput(name)
        return self.folder / name

    def has(self, name: str) -> bool:
        """Return True if a file of the results exists, or a table was given for it by `hold`."""
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
            A copy: to change it changes nothing else.

        Raises
        ------
        InputError
            If the file is missing, is no table, or lacks a column that is always there.
        """
        self.path(name)  # raises if a stage has not declared this table, which may be in memory
        if name not in self._tables:
            path = self._existing_path(name)
            if name.endswith(".parquet"):  # samples are too large to be kept
                return read_parquet(path)
            self._tables[name] = self._read_current(name, path)
        return self._tables[name].copy()

    def hold(self, name: str, table: pd.DataFrame) -> None:
        """Keep a table as if it had been read from the file `name`, for code that has made it and has not written it."""
        self._tables[name] = table
        self._sorted.discard(name)

    def hold_as_csv(self, name: str, table: pd.DataFrame) -> pd.DataFrame:
        """Keep and return a table as if it had been written to the csv file `name` and read again.

        Its numbers are rounded as in the file, so that what is made of it is the same to the last digit.
        """
        self.hold(name, self._read_current(name, csv_bytes(table)))
        return self.table(name)

    def _existing_path(self, name: str) -> Path:
        """Return the path of a file of the results; raise InputError if there is none."""
        if not (path := self.path(name)).is_file():
            raise InputError(f"{path}: there is no such table; `rftfit run` makes it")
        return path

    def as_written(self, name: str) -> pd.DataFrame:
        """Read a csv table that another version of the program may have written: no column is required."""
        return self._read_typed(name, self._existing_path(name))[0]

    def _read_typed(self, name: str, source: Path | bytes) -> tuple[pd.DataFrame, Output]:
        """Read a csv table, and find its entry in the dictionary, which states the types of its columns.

        `source`: Path, or content, of the file `name`. Returns the table and the entry.
        """
        output = describe_file(f"{RESULTS}/{name}")
        if output is None or not output.columns:
            raise InputError(f"{self.folder / name}: not a table of this program")

        def kind_of(column: str) -> str:
            """Return the kind of a column; empty where the dictionary does not have it."""
            entry = column_of(output, column)
            return entry.kind if entry else ""

        return read_csv(source, kind_of), output

    def _read_current(self, name: str, source: Path | bytes) -> pd.DataFrame:
        """Read a csv table, as `_read_typed` does, that must have every column that this version of the program writes."""
        table, output = self._read_typed(name, source)
        lacking = []
        for entry in output.columns:
            # a column with `when` is written only under that condition, one with <...> has a name for each table
            if not entry.when and "<" not in entry.name:
                lacking += [column for column in entry.names if column not in table]
        if lacking:
            raise InputError(
                f"{self.folder / name}: no column {', '.join(lacking)}; make the table again with `rftfit run`"
            )
        return table


class Results(Tables):
    """A campaign and the tables of its results, returned by `open`.

    ``results["poppy_LP"]`` is one medium; ``for medium in results`` goes through all media.

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
        super().__init__(campaign.root / RESULTS)
        self.campaign = campaign
        self.root = campaign.root
        # what takes long to make, kept: fits by medium and method, maps by medium and its teachers
        self._fits: dict[tuple[str, str], scaling.MediumFit] = {}
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
        """Media whose alpha was measured in many directions (beta, gamma)."""
        return self.campaign.of_role("laboratory")

    @cached_property
    def sands(self) -> tuple[str, ...]:
        """Natural sands: media of which one penetration test is known."""
        return self.campaign.of_role("natural_sand")

    @property
    def checks(self) -> pd.DataFrame:
        """Results of the checks of the measurements, one row for each medium and check."""
        return self.joined("checks/{medium}.csv")

    @cached_property
    def marks(self) -> dict[str, list[Remark]]:
        """Remarks on each medium that fails a check, by medium, for all tables and figures that show the medium.

        A medium that passes has no entry; nor has any where not all media were checked yet.
        """
        # a campaign that was not run yet has no tables of checks
        are_checked = all(self.has(f"checks/{medium}.csv") for medium in self.media)
        return marks_of(self.checks, self.config.media) if are_checked else {}

    @property
    def session_clocks(self) -> SessionClocks | None:
        """Clocks of all sessions, estimated from the pushes of all media; None if they are not to be estimated."""
        settings = self.config.clock
        if settings.method != "estimate":
            return None
        tables = (self.table(f"clocks/{medium}.parquet") for medium in self.media)
        return SessionClocks.of_pushes(tables, settings)

    @property
    def titles(self) -> dict[str, str]:
        """Titles of the media by name; a medium that fails a check has the code of its first mark behind its title.

        For example ``loosely packed poppy seeds (doubtful)``.
        """
        marks = {medium: f" ({marks[0].code})" for medium, marks in self.marks.items()}
        return {name: title + marks.get(name, "") for name, title in self.campaign.titles.items()}

    def marked(self, table: pd.DataFrame) -> pd.DataFrame:
        """Return a table whose rows have the marks of their medium in their reason; `table`: with a column ``medium``."""
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
        return pd.concat(tables or [pd.DataFrame()], ignore_index=True)

    def map_table(self, medium: str) -> pd.DataFrame:
        """Table of the map of one medium: alpha estimated in every direction.

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
        """Reason why a medium has no map; empty if it has one.

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
        """Alpha of one medium, one row for each direction.

        Parameters
        ----------
        medium : str

        Returns
        -------
        pandas.DataFrame
            Sorted by beta, then gamma.

        Raises
        ------
        InputError
            If the table is missing, or its numbers or angles cannot be used.
        """
        name = f"alpha/{medium}.csv"
        table = self.table(name)
        # a page asks for it a hundred times
        if name in self._sorted:
            return table
        table = table.sort_values(["beta_deg", "gamma_deg"], ignore_index=True)
        numbers = table[[column(c, quantity) for c in "zx" for quantity in QUANTITIES]]
        angles = table[["beta_deg", "gamma_deg"]]
        types = {str(dtype) for dtype in (*numbers.dtypes, *angles.dtypes)}
        if not types <= {"float64", "int64"} or np.isinf(numbers).any(axis=None):
            why = "a column of numbers holds something else"
        # NaN, too, is not in range
        elif not (angles.abs() <= 90).all(axis=None) or angles.duplicated().any():
            why = "angles that are missing, outside of -90 to 90 degrees, or there twice"
        else:
            self.hold(name, table.copy())
            self._sorted.add(name)
            return table
        raise InputError(f"{self.path(name)}: {why}; make the table again with `rftfit run`")

    @property
    def error_of_legs(self) -> float:
        """Relative error of the force model on the measured legs of the campaign; NaN if none was measured."""
        # the same number in each row of a leg that was compared
        error_of_row = self.table(LEG_ERRORS)["model_error_of_legs"].dropna()
        return float(error_of_row.iloc[0]) if len(error_of_row) else math.nan

    @property
    def model_error(self) -> float:
        """Relative error of the force model in this campaign: the error on its legs, but at least the usual error.

        The usual error applies if no leg was compared yet.
        """
        may_read = self._allowed is None or f"{RESULTS}/{LEG_ERRORS}" in self._allowed
        return larger_model_error(self.error_of_legs) if may_read and self.has(LEG_ERRORS) else EPS

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
            # read even where the fit is kept: raises if a stage has not declared this table
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
        """Reference media, from which another medium that is known by one push is scaled.

        Parameters
        ----------
        method : str, optional
            As for `fits`.

        Returns
        -------
        Reference
            The media of the campaign; the five published ones (`Reference.printed`) if fewer than two media
            of the campaign have a usable grid.
        """
        fits = list(self.fits(method).values())
        return scaling.reference_of(fits, method or self.config.fourier.method)

    def shapes(self, medium: str = "") -> Shapes:
        """Known media from whose alpha the shape of alpha of a medium is estimated.

        They are the published media and, with ``maps.own_media`` of the configuration, the laboratory media of this
        campaign whose table is complete and that pass all checks.

        Parameters
        ----------
        medium : str, optional
            Medium whose shape is estimated: the medium itself is left out, and so is the published medium that
            it is a sample of. Default: a medium outside of this campaign, for which none is left out.

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
                profiles[lab_medium] = profile
        return Shapes(profiles)

    def __getitem__(self, medium: str) -> Medium:
        """Return one medium by its name; raises InputError where it has no runs."""
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
        """Verdict on the data of the medium, as a word with its causes, from its checks, fits and flags."""
        return verdict_on(self.results.table(f"checks/{self.name}.csv"), self.fits, self.flags)

    @property
    def doubt(self) -> str:
        """Text of the verdict on the data if it is ``doubtful`` or ``unusable``; otherwise, and before a run, empty."""
        needed = ("checks", "fits", "flags")
        if not all(self.results.has(f"{table}/{self.name}.csv") for table in needed):
            # results whose tables of runs were not kept: the marks of the checks alone
            return format_remarks(self.results.marks.get(self.name, ()))
        return str(self.verdict) if self.verdict.word in (UNUSABLE, DOUBTFUL) else ""

    @property
    def alpha(self) -> pd.DataFrame:
        """Alpha with intervals, N/cm^3, one row for each cell (beta, gamma)."""
        return self.results.alpha_table(self.name)

    @property
    def alpha_at_depth(self) -> pd.DataFrame:
        """Stress over depth at `fit.depths_cm` by a fitted power, with intervals; no rows where stress is linear."""
        return self.results.table(f"alpha_at_depth/{self.name}.csv")

    @property
    def covariance(self) -> pd.DataFrame:
        """Covariance of the errors of alpha, of all cells and both components, (N/cm^3)^2.

        Index and columns are beta_deg, gamma_deg and component (``z`` or ``x``); an alpha without an error has no
        row. Errors that runs share (session, turn, rod, tare) are correlated; the root of the diagonal is the
        standard error in `alpha`. The numbers are those of ``alpha_covariance/<medium>.csv``, not rounded. A force that
        is linear in alpha, with weights w, has the variance ``w @ covariance @ w``.
        """
        return covariance_of(self.alpha)

    @property
    def _bed_spread(self) -> float:
        """Relative spread of forces from one prepared bed to the next, by repeats; 0 where not known.

        Callers then take the usual spread.
        """
        config = self.results.config
        return spread_of_next_bed(
            self.alpha, config.grid.angle_tolerance_deg, config.fit.confidence
        )

    @property
    def fits(self) -> pd.DataFrame:
        """Slope of stress over depth of every plate run, with its errors: a row a run."""
        return self.results.table(f"fits/{self.name}.csv")

    def pressure_sinkage(self) -> PressureSinkage:
        """Fit Bekker's law to the pushes straight down, for programs that calculate tracks and wheels by its k and n.

        Raises
        ------
        InputError
            If no such push has a power of depth.
        """
        campaign = self.results.campaign
        plates = campaign.config.intruders
        # of the plate of each run, cm
        widths = {
            run.run_id: width_of_plate(plates[run.intruder])
            for run in campaign.runs
            if run.kind == "plate"
        }
        return pressure_sinkage(self.fits, widths, campaign.config.grid.angle_tolerance_deg)

    @property
    def runs(self) -> pd.DataFrame:
        """Table of runs: what became of the logs of each, a row a run."""
        return self.results.table(f"runs/{self.name}.csv")

    @property
    def flags(self) -> Flags:
        """Doubts about the runs and cells, by code."""
        return Flags(self.results.table(f"flags/{self.name}.csv"))

    @property
    def legs(self) -> pd.DataFrame:
        """Measured forces on legs against theta, N, a row a reading; empty where no leg was measured."""
        return self.results.table(f"legs/{self.name}.csv")

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of profile that the medium can have, see `profile`: a natural sand, known by one cell, has fewer."""
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
            N/cm^3, in the order of Table S2. A natural sand has those of its generic profile. NaN if there are
            none; the `reason` of the profile then says why.
        """
        if self.name in self.results.laboratory:
            return self.results.fits(method)[self.name].used
        return self._generic_profile(method, draws=False).coefficients

    @property
    def zeta(self) -> float:
        """Scaling factor by the method of the configuration; NaN if there is none.

        Of a laboratory medium it is that of nine terms fitted to the pushed directions, of a natural sand alpha straight
        down over the mean chi. If the pushes leave out parts of the published grid,
        this factor cannot be compared with those of the paper; the factor of the map (`rftfit.Map.zeta`) can.
        """
        if self.name in self.results.laboratory:
            return self.results.fits()[self.name].zeta
        try:
            return self.scaled().zeta
        except InputError:
            return np.nan

    @property
    def chi(self) -> float:
        """Measured over fitted alpha_z(0, 90 deg), `zeta`; for a natural sand the mean over its reference media."""
        if self.name in self.results.laboratory:
            fit = self.results.fits()[self.name]
            return fit.alpha_z / fit.zeta
        return float(self.results.reference().chi.mean())

    def scaled(self, method: str | None = None) -> scaling.ScaledMedium:
        """Scale the reference media to this medium by the paper's routine, from its one penetration test.

        Parameters
        ----------
        method : str, optional
            Method of the fits of the reference media; default: that of the configuration.

        Returns
        -------
        ScaledMedium

        Raises
        ------
        InputError
            If the test gives no number.
        """
        table = self.alpha
        cell = cell_down(table, self.results.config.grid.angle_tolerance_deg)
        if cell is None:
            raise InputError(f"{self.name}: {remark('no-push')}")
        level = self.results.config.fit.confidence
        # alpha_z straight down, N/cm^3
        alpha, se = scaling.alpha_of_test(cell, level)
        try:
            return scaling.scale_by_paper(alpha, se, self.results.reference(method), level)
        except ValueError as error:
            why = f"no alpha at (0, 90) deg: {cell['reason']}" if np.isnan(alpha) else str(error)
            raise InputError(f"{self.name}: {why}") from error

    def contact(self, leg: str) -> Contact | None:
        """Return the measured forces on a leg that turned in this medium, in the form that `rftfit.estimate_map` needs.

        Parameters
        ----------
        leg : str
            Name of the leg in the configuration.

        Returns
        -------
        Contact or None
            None where the leg was not measured in this medium.

        Raises
        ------
        InputError
            If the curve cannot be used, for example if it has a single pose.
        """
        legs, force_names = self.legs, ["force_z_N", "force_x_N"]
        readings = legs[legs["leg"] == leg]
        if not readings[force_names].notna().any(axis=None):
            return None
        # the error of the model is the same in all repeats: they count as one turn, their mean
        curve = readings.groupby("theta_deg", as_index=False)[force_names].mean()
        leg_settings = self.results.config.legs[leg]
        speed = self.results.config.arm.leg_speed_rad_per_s
        motion = rotation(curve["theta_deg"].to_numpy(float), leg_settings.hip_height_cm, speed)
        largest_N = float(np.nanmax(curve[force_names].abs()))
        # readings of one curve scatter less than forces in different beds: the scatter of beds is the error
        error_N = (self._bed_spread or USUAL_BED_SPREAD) * largest_N
        try:
            return Contact(leg_outline(leg_settings, leg), motion, curve, error_N, name=self.name)
        except ValueError as problem:
            raise InputError(f"{leg}: {problem}") from problem

    def map(
        self, contacts: Sequence[Contact] = (), *, teachers: Sequence[str] | None = None
    ) -> Map:
        """Estimate alpha in every direction: pushed directions, completed by the shape that known media share.

        Parameters
        ----------
        contacts : sequence of Contact, optional
            Forces on bodies in this medium, in addition to those on the teachers.
        teachers : sequence of str, optional
            Legs whose measured forces teach the map. Default: ``maps.use_legs`` of the configuration.

        Returns
        -------
        Map

        Raises
        ------
        InputError
            If no push has a usable alpha.
        """
        if teachers is None:
            teachers = self.results.config.maps.use_legs
        legs = [self.contact(leg) for leg in teachers]
        leg_contacts = [contact for contact in legs if contact is not None]
        # a map takes long to estimate: that of the legs alone is kept
        maps, key = self.results._maps, (self.name, *teachers)
        if contacts:
            estimated = self._estimate_map([*contacts, *leg_contacts])
        else:
            estimated = maps[key] = maps.get(key) or self._estimate_map(leg_contacts)
        return replace(
            estimated,
            bed_spread=self._bed_spread or USUAL_BED_SPREAD,
            model_error=self.results.model_error,
        )

    def _estimate_map(self, contacts: Sequence[Contact]) -> Map:
        """Estimate the map of this medium from its alpha table and from forces on bodies; takes seconds.

        `contacts`: These forces. An InputError names the medium where no push has a usable alpha.
        """
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
        """Return a profile of this medium, which gives alpha(beta, gamma), with the draws for its intervals.

        Parameters
        ----------
        kind : str, optional
            ``table``: measured alpha, interpolated. ``map``: measured alpha, completed by the shape that known media
            share. ``fourier``: the nine terms fitted to the medium. ``generic``: the generic nine terms times zeta of
            the medium; for a natural sand they are scaled from its one penetration test.
            ``depth_only``: the baseline without angles.
        method : str, optional
            Method of the nine-term fit, ``lsq`` or ``dft-index``; default: that of the configuration.
        draws : bool, optional
            True makes draws of the errors of alpha for the intervals, which takes a moment.

        Returns
        -------
        Profile
            If alpha is NaN somewhere, its `reason` says why.

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
            profile = self._fourier_profile(method, draws=draws)
        elif kind == "generic":
            profile = self._generic_profile(method, draws=draws)
        elif kind == "map":
            try:
                profile = self.map().profile
                if not draws:
                    profile.spread = None
            except InputError as error:
                unknown = np.full((7, 13), np.nan)  # on the grid of the paper
                profile = TableProfile(unknown, unknown, name=f"map of {self.name}")
                profile.reason = str(error)
        else:
            name = f"measured table of {self.name}"
            profile = measured = measured_profile(table, config, name, draws=draws)
            if kind == "depth_only":
                profile = DepthOnlyProfile.of(measured, f"depth-only, of {self.name}")
        # what a prediction of forces by this profile needs besides alpha
        profile.window = window_of(table)
        profile.bed_spread = self._bed_spread or profile.bed_spread
        if isinstance(profile, TableProfile):
            profile.model_error = self.results.model_error
        elif isinstance(profile, FourierProfile) and draws:
            # predictions by nine terms name the forces by the table beside them: made when it is asked for
            profile.beside = cache(partial(self.as_profile, draws=False))
        return profile

    def as_profile(
        self, is_enough: Callable[[Profile], bool] | None = None, *, draws: bool = True
    ) -> Profile:
        """Return the profile by which forces are predicted: the table if it is enough, otherwise the map.

        Parameters
        ----------
        is_enough : callable, optional
            Called with the table if it has holes; returns True if the table has a number in every direction that is
            needed. Default: a table with holes is not enough.
        draws : bool, optional
            As for `profile`.

        Returns
        -------
        Profile
        """
        table = self.profile("table", draws=draws)
        if not table.reason or (is_enough is not None and is_enough(table)):
            return table
        completed = self.profile("map", draws=draws)
        # a medium without any alpha has no map either: the reason of its table is the better known one
        return table if completed.reason else completed

    def export_source(self, kind: str | None = None) -> tuple[KnownMedium, dict[str, Any]]:
        """Return the source of alpha for a profile file of this medium, and the other facts that the file states.

        Parameters
        ----------
        kind : str, optional
            ``table`` or ``map``. Default: the table if every direction was pushed, otherwise the map.

        Returns
        -------
        source : KnownMedium
        facts : dict of str to object
            Arguments of `write_profile` by name: name, title, marks, window (cm), and the digest of the table that the
            profile is made from.

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
            "made_from": {f"{RESULTS}/{name}": sha256_of(self.results.path(name))},
        }
        table = self.profile()
        is_map = kind == "map" or (kind is None and bool(table.reason))
        return (self.map() if is_map else table), facts

    def _fourier_profile(self, method: str | None, *, draws: bool) -> FourierProfile:
        """Return the nine terms fitted to this medium; NaN with a reason if there is no fit. Parameters of `profile`."""
        fit = self.results.fits(method)[self.name]
        name = f"nine terms ({fit.method}) of {self.name}"
        if fit.reason:
            return FourierProfile(fit.used, name, f"{name}: {fit.reason}")
        return FourierProfile(fit.used, name, spread=FourierProfile(fit.draws) if draws else None)

    def _generic_profile(self, method: str | None, *, draws: bool) -> FourierProfile:
        """Return the generic nine terms times zeta of this medium; NaN with a reason if either is not known.

        Of a laboratory medium zeta is that of its own fit, of a natural sand that of its one penetration test.
        Parameters: those of `profile`.
        """
        if self.name not in self.results.laboratory:
            try:
                return self.scaled(method).profile
            except InputError as error:
                return FourierProfile(np.full(9, np.nan), f"generic, {self.name}", str(error))
        fits = self.results.fits(method)
        fit = fits[self.name]
        counted_fits = [counted for counted in fits.values() if counted.counts]
        if fit.reason or not counted_fits:
            why = fit.reason or "no medium that passes its checks has nine terms"
            name = f"generic ({fit.method}) of {self.name}"
            return FourierProfile(np.full(9, np.nan), name, f"{name}: {why}")
        name = f"generic ({fit.method}) times zeta = {fit.zeta:.4f} of {self.name}"
        spread = None
        if draws:
            # each draw has errors of alpha in all media, and with them another mean of the media
            draws_of_media = np.stack([counted.draws for counted in counted_fits], axis=1)
            spread = scaled_generic(fit.zeta_draws, scaling.generic(draws_of_media))
        return scaled_generic(fit.zeta, self.results.generic(method), name, spread)

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
