"""Profiles of a campaign's own media, from the tables in its results, with draws of their errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rftfit.cli.predict_sources import Source, choose, from_test
from rftfit.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.profile.base import Profile
    from rftfit.profile.reference_media import Reference

_GENERIC = "generic"
_AGAIN = "make these tables again with `rftfit run`"
_NEEDED = ("method", "medium", "coefficient", "value_N_per_cm3", "kept", "reason")


def from_campaign(folder: Path, medium: str, kind: str, method: str, confidence: float) -> Source:
    """Profile of a medium of a campaign.

    Draws carry the errors of alpha. A medium without a nine-term fit (a natural sand) has as its
    generic profile the one scaled from its penetration test.

    Parameters
    ----------
    folder : Path
        Results, with ``alpha/*.csv`` and ``coefficients.csv``.
    medium : str
    kind : str
        One of `rftfit.cli.predict_sources.PROFILES`.
    method : str
        Of the nine-term fit.
    confidence : float
        Level of the intervals in the tables.

    Returns
    -------
    Source

    Raises
    ------
    InputError
        If a table is missing or damaged, or does not have the medium or method.
    """
    from rftfit.cli.scale_sources import from_results
    from rftfit.profile.depth_only import DepthOnlyProfile
    from rftfit.profile.reference_media import published
    from rftfit.profile.table import TableProfile

    own = f"{folder.as_posix()}, {medium}"
    table = _alpha_table(folder, medium)
    if kind in ("fourier", "generic"):
        if kind == "generic" and _from_print(folder, medium, method):
            return _by_its_test(folder, medium, table, published(), confidence)
        fits = _Fits(folder, method, confidence)
        if kind == "fourier":
            return fits.nine_terms(medium, table, own)
        if medium in fits.media:
            return fits.scaled(medium, own)
        return _by_its_test(folder, medium, table, from_results(folder, method), confidence)
    measured = TableProfile.from_table(table, f"alpha table of {own}")
    many: Profile = TableProfile(*_draws(table, confidence))
    if kind == "depth_only":
        return Source(
            f"depth-only, from {own}", DepthOnlyProfile.of(measured), DepthOnlyProfile.of(many)
        )
    return Source(measured.name, measured, many)


def _from_print(folder: Path, medium: str, method: str) -> bool:
    """Whether the campaign scaled this medium with the published ones."""
    from rftfit.profile.reference_media import routine, table_rows

    try:
        rows = table_rows(folder / "penetration.csv")
    except (OSError, ValueError):
        return False
    wanted = (routine(method, printed=True), medium)
    return any((row.get("method"), row.get("medium")) == wanted for row in rows)


def _by_its_test(
    folder: Path, medium: str, table: pd.DataFrame, reference: Reference, confidence: float
) -> Source:
    from rftfit.measure.alpha import column
    from rftfit.profile.nine_terms import FourierProfile

    cell = table[(table["beta_deg"] == 0) & (table["gamma_deg"] == 90)].iloc[0]
    alpha, se = float(cell[column("z")]), float(cell[column("z", "_se")])
    if not np.isfinite(alpha):
        name = f"generic, {folder.as_posix()}, {medium}"
        reason = f"{name}: no alpha at (0, 90) deg" + (
            f": {why}" if (why := cell["reason"]) else ""
        )
        return Source(name, FourierProfile(np.full(9, np.nan), name, reason))
    if not np.isfinite(se):
        raise InputError(
            f"{_alpha_path(folder, medium)}: alpha at (0, 90) deg has no standard error; {_AGAIN}"
        )
    return from_test(reference, alpha, se, confidence)


class _Fits:
    """Nine-term fits of a campaign by one method."""

    def __init__(self, folder: Path, method: str, confidence: float) -> None:
        self.folder, self.method, self.confidence = folder, method, confidence
        self.path = folder / "coefficients.csv"
        whole = _read(self.path, _NEEDED, ("value_N_per_cm3",))
        choose("--method", method, list(dict.fromkeys(whole["method"])), f"in {self.path}")
        self.rows = whole[whole["method"] == method]
        self.media = [name for name in dict.fromkeys(self.rows["medium"]) if name != _GENERIC]

    def values(self, medium: str) -> tuple[FloatArray, npt.NDArray[np.bool_], str]:
        """Coefficients (a dropped term is 0), which terms are kept, and why there are none."""
        from rftfit.profile.fourier import TERMS

        rows = self.rows[self.rows["medium"] == medium].drop_duplicates("coefficient")
        rows = rows.set_index("coefficient").reindex(list(TERMS))
        lacking = rows.index[rows["method"].isna()]
        if len(lacking):
            raise InputError(
                f"{self.path}: no value by {self.method!r} for {medium}: {', '.join(lacking)}; "
                f"{_AGAIN}"
            )
        keep = (rows["kept"].astype(str).str.lower() != "false").to_numpy()
        value = rows["value_N_per_cm3"].to_numpy(float)
        reasons = [str(text) for text in dict.fromkeys(rows["reason"]) if text]
        return np.where(keep, value, 0.0), keep, "; ".join(reasons)

    def draws(self, medium: str, table: pd.DataFrame) -> FloatArray:
        """Fit the draws of the alpha table with the terms that were kept, shape (draws, 9)."""
        from rftfit.profile.fourier import fit_dft_index, fit_lsq
        from rftfit.reference import BETA_DEG, GAMMA_DEG

        keep = self.values(medium)[1]
        alpha_z, alpha_x = _draws(table, self.confidence)
        beta, gamma = np.radians(BETA_DEG), np.radians(GAMMA_DEG)
        if self.method != "lsq":
            return np.where(keep, fit_dft_index(gamma, alpha_z, alpha_x), 0.0)
        try:
            return fit_lsq(beta, gamma, alpha_z, alpha_x, keep)
        except ValueError as error:
            raise InputError(
                f"{self.path}: has a fit that {_alpha_path(self.folder, medium)} cannot give: "
                f"{error}; {_AGAIN}"
            ) from error

    def nine_terms(self, medium: str, table: pd.DataFrame, own: str) -> Source:
        """Coefficients of the medium itself."""
        from rftfit.profile.nine_terms import FourierProfile

        more = f"in {self.path}; --profile generic needs one penetration test only"
        choose("--medium", medium, self.media, more)
        value, _, reason = self.values(medium)
        name = f"nine terms ({self.method}) of {own}"
        if not np.isfinite(value).all():
            why = f"{name}: {reason or 'a coefficient is missing'}"
            return Source(name, FourierProfile(value, name, why))
        return Source(name, FourierProfile(value, name), FourierProfile(self.draws(medium, table)))

    def scaled(self, medium: str, own: str) -> Source:
        """Zeta of the medium times the generic coefficients, the mean over all media."""
        from rftfit.profile.nine_terms import FourierProfile, scaled_generic
        from rftfit.profile.scaling import generic, vertical_penetration

        value, _, reason = self.values(medium)
        m0 = self.values(_GENERIC)[0]
        zeta = float(vertical_penetration(value))
        name = f"generic ({self.method}) times zeta = {zeta:.4f} of {own}"
        if not np.isfinite(zeta) or not np.isfinite(m0).all():
            why = f"{name}: {reason or 'a coefficient is missing'}"
            return Source(name, FourierProfile(np.full(9, np.nan), name, why))
        each = {
            other: self.draws(other, _alpha_table(self.folder, other))
            for other in self.media
            if np.isfinite(self.values(other)[0]).all()
        }
        many = scaled_generic(
            vertical_penetration(each[medium]), generic(np.stack(list(each.values()), axis=1))
        )
        return Source(name, scaled_generic(zeta, m0, name), many)


def _draws(table: pd.DataFrame, confidence: float) -> tuple[FloatArray, FloatArray]:
    from rftfit.campaign.config import Fourier
    from rftfit.profile.bootstrap import alpha_draws

    # as many and the same as the workflow's own, unless its config says otherwise
    settings = Fourier()
    return alpha_draws(table, settings.draws, settings.seed, confidence)


def _alpha_path(folder: Path, medium: str) -> Path:
    return folder / "alpha" / f"{medium}.csv"


def _alpha_table(folder: Path, medium: str) -> pd.DataFrame:
    from rftfit.measure.alpha import ANGLE_TOLERANCE_DEG, QUANTITIES, column
    from rftfit.reference import BETA_DEG, GAMMA_DEG

    known = sorted(path.stem for path in (folder / "alpha").glob("*.csv"))
    if not known:
        raise InputError(
            f"--results: {folder / 'alpha'} has no alpha tables; allowed: the folder that "
            "`rftfit run` fills"
        )
    choose("--medium", medium, known, f"in {folder / 'alpha'}")
    path = _alpha_path(folder, medium)
    numbers = [column(component, quantity) for component in "zx" for quantity in QUANTITIES]
    angles = ("beta_deg", "gamma_deg")
    table = _read(path, (*angles, *numbers, "medium", "reason"), (*angles, *numbers))
    table = table.sort_values(list(angles), ignore_index=True)
    grid = np.stack(np.meshgrid(BETA_DEG, GAMMA_DEG, indexing="ij"), axis=-1).reshape(-1, 2)
    found = table[list(angles)].to_numpy(float)
    if found.shape != grid.shape or not (np.abs(found - grid) < ANGLE_TOLERANCE_DEG).all():
        raise InputError(
            f"{path}: not the 7 x 13 angles of an alpha table, each once, but {len(table)} rows; "
            f"{_AGAIN}"
        )
    return table


def _read(path: Path, needed: tuple[str, ...], numbers: tuple[str, ...]) -> pd.DataFrame:
    from rftfit.store import read_csv

    if not path.is_file():
        raise InputError(f"{path}: there is no such table; `rftfit run` makes it")
    table = read_csv(path)
    lacking = [name for name in needed if name not in table]
    if lacking:
        raise InputError(f"{path}: no column {', '.join(lacking)}; {_AGAIN}")
    if table.empty:
        raise InputError(
            f"{path}: no rows; a campaign without a medium measured over the grid has none, and "
            "--profile generic needs one penetration test only"
        )
    for name in numbers:
        if table[name].dtype.kind not in "if" or np.isinf(table[name]).any():
            raise InputError(f"{path}: column {name} does not hold numbers only; {_AGAIN}")
    return table
