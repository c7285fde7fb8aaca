"""``rftfit predict``: forces on a leg, or on any outline along any path."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

import rftfit
from rftfit.cli.output import count, say, table, warn
from rftfit.cli.scale import check_test, number_of
from rftfit.errors import AllAtOnce, InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt
    import pandas as pd

    from rftfit.conventions import FloatArray
    from rftfit.model.forces import Forces
    from rftfit.model.outlines import Outline
    from rftfit.model.profiles import Profile
    from rftfit.model.scaling import Reference, Scaled


# --- Which profile `rftfit predict` takes, from print or from one penetration test, with its spread.


PROFILES = ("table", "fourier", "generic", "depth_only")


@dataclass(frozen=True)
class FurtherMedium:
    """A medium that is known by its zeta alone, and the media it was scaled from."""

    scaled: Scaled
    reference: Reference


@dataclass(frozen=True)
class Source:
    """A profile, and what its intervals come from.

    `name`: For people: which profile of which medium.
    `spread`: A stack of draws of the profile; or the reference media, whose scatter is that of one
        further medium; None where no error is known (published tables).
    """

    name: str
    profile: Profile
    spread: Profile | FurtherMedium | None = None


def choose(option: str, word: str, allowed: Sequence[str], more: str = "") -> str:
    """Check a word of the command line and return it; `more` is said after the allowed words."""
    from rftfit.campaign.problems import unknown_word

    if word not in allowed:
        raise InputError(unknown_word(option, word, allowed) + (more and f" ({more})"))
    return word


def from_print(medium: str, kind: str) -> Source:
    """Profile of a published medium.

    `kind`: One of `PROFILES`: Table S5 interpolated; the coefficients of Table S2; its printed
    zeta times its generic coefficients; the depth-only model with three cells of Table S5. Returns
    without a spread: the tables are printed without errors.
    """
    from rftfit.model.fourier import as_array
    from rftfit.model.profiles import DepthOnlyProfile, FourierProfile, TableProfile, scaled_generic
    from rftfit.reference import MEDIA, coefficients

    choose(
        "--medium",
        medium,
        MEDIA,
        "published media; --results DIR for those of a campaign, --alpha for one penetration test",
    )
    if kind == "fourier":
        name = f"published Table S2, {medium}"
        return Source(name, FourierProfile(as_array(coefficients(medium)), name))
    if kind == "generic":
        zeta = coefficients(medium)["zeta"]
        name = f"published Table S2, zeta of {medium} ({zeta:g}) times generic"
        return Source(name, scaled_generic(zeta, as_array(coefficients("generic")), name))
    table = TableProfile.published(medium)
    if kind == "depth_only":
        return Source(f"depth-only, from Table S5, {medium}", DepthOnlyProfile.of(table))
    return Source(f"published Table S5, {medium}", table)


def from_test(reference: Reference, alpha: float, se: float, confidence: float) -> Source:
    """Profile of a medium known by one vertical penetration test: as `rftfit scale`.

    `reference`: Where chi and the generic coefficients come from. `alpha`, `se`: alpha_z(0, 90
    deg) and its standard error, N/cm^3.
    """
    from rftfit.cli.scale import scale_from
    from rftfit.model.profiles import scaled_generic

    try:
        scaled = scale_from(reference, alpha, se, confidence)
    except ValueError as error:
        raise InputError(str(error)) from error
    name = (
        f"generic times zeta = {scaled.zeta:.4f} "
        f"({scaled.zeta_lo:.4f} to {scaled.zeta_hi:.4f}), from alpha_z(0, 90 deg) = "
        f"{alpha:g} N/cm^3 (se {se:g}) with {reference.name}"
    )
    profile = scaled_generic(scaled.zeta, reference.m0, name)
    return Source(name, profile, FurtherMedium(scaled, reference))


# --- Profiles of a campaign's own media, from the tables in its results, with draws of their errors.


_GENERIC = "generic"
_AGAIN = "make these tables again with `rftfit run`"
_NEEDED = ("method", "medium", "coefficient", "value_N_per_cm3", "kept", "reason")


def from_campaign(folder: Path, medium: str, kind: str, method: str, confidence: float) -> Source:
    """Profile of a medium of a campaign.

    Draws carry the errors of alpha. A medium without a nine-term fit (a natural sand) has as its
    generic profile the one scaled from its penetration test.

    `folder`: Results, with ``alpha/*.csv`` and ``coefficients.csv``. `kind`: One of
    `rftfit.cli.predict.PROFILES`. `method`: Of the nine-term fit. `confidence`: Level of the
    intervals in the tables.
    """
    from rftfit.cli.scale import from_results
    from rftfit.model.profiles import DepthOnlyProfile, TableProfile
    from rftfit.model.scaling import published

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
    from rftfit.model.scaling import routine, table_rows

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
    from rftfit.model.profiles import FourierProfile

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
        from rftfit.model.fourier import TERMS

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
        from rftfit.model.fourier import fit_dft_index, fit_lsq
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
        from rftfit.model.profiles import FourierProfile

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
        from rftfit.model.profiles import FourierProfile, scaled_generic
        from rftfit.model.scaling import generic, vertical_penetration

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
    from rftfit.model.draws import alpha_draws

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


# --- What is moved and how, from the words of the command line.


_MOST_ELEMENTS = 10_000
_WIDTH_CM = 2.54
_MOST_CM = 1000.0


@dataclass(frozen=True)
class Motion:
    """Poses, and the columns that say which is which.

    `name`: For people.
    `poses`: shape (p, 6).
    `columns`: shape (p,); In the order of the table; the first one tells the poses apart.
    """

    name: str
    poses: FloatArray
    columns: dict[str, FloatArray]

    @property
    def key(self) -> str:
        """Name of the column that tells the poses apart: ``theta_deg`` or ``t_s``."""
        return next(iter(self.columns))


def make_outline(
    leg: str | None,
    curvature: float | None,
    points: Path | None,
    width_cm: float | None,
    elements: int,
) -> Outline:
    """Make the outline that was asked for.

    `leg`: A model leg. `curvature`: R/r of a leg of the model legs' length. `points`: csv of
    points. `width_cm`: Needed with points; that of the model legs by default with a curvature.
    """
    from rftfit.model.outlines import CURVATURES, arc, model_leg, read_outline

    given = {"--leg": leg, "--curvature": curvature, "--outline": points}
    named = [option for option, value in given.items() if value is not None]
    if len(named) != 1:
        raise InputError(
            f"found {' and '.join(named) or 'no outline'}; allowed: one of --leg "
            f"({', '.join(CURVATURES)}), --curvature R/r, --outline FILE with --width"
        )
    if not 1 <= elements <= _MOST_ELEMENTS:
        raise InputError(f"--elements: found {elements}; allowed: 1 to {_MOST_ELEMENTS}")
    if width_cm is not None and not 0 < width_cm <= _MOST_CM:
        raise InputError(f"--width: found {width_cm:g}; allowed: above 0, up to {_MOST_CM:g} cm")
    if leg is not None:
        choose("--leg", leg, tuple(CURVATURES))
        if width_cm is not None:
            raise InputError(
                f"--width: the model legs are {_WIDTH_CM:g} cm wide; allowed with --curvature "
                f"(c_leg is --curvature {CURVATURES['c_leg']:g}) and --outline"
            )
        return model_leg(leg, elements)
    if curvature is not None:
        if not -1 <= curvature <= 1:
            raise InputError(
                f"--curvature: found {curvature:g}; allowed: R/r from -1 (reversed c-leg) over 0 "
                "(flat) to 1 (c-leg)"
            )
        name = f"leg of curvature R/r = {curvature:g}"
        return arc(curvature, width_cm=width_cm or _WIDTH_CM, elements=elements, name=name)
    assert points is not None
    if width_cm is None:
        raise InputError("--outline needs --width, in cm: how wide the body is across the plane")
    return read_outline(points, width_cm, elements)


def make_motion(hip_cm: float | None, path: Path | None) -> Motion:
    """Make the motion that was asked for.

    `hip_cm`: Height of the axle of a rotation; that of the paper by default. `path`: csv of a free
    path.
    """
    from rftfit.model.motion import HIP_HEIGHT_CM, THETA_DEG, read_path, rotation_poses

    if path is None:
        height = HIP_HEIGHT_CM if hip_cm is None else hip_cm
        if not abs(height) <= _MOST_CM:
            raise InputError(f"--hip: found {height:g}; allowed: -{_MOST_CM:g} to {_MOST_CM:g} cm")
        name = f"turned about an axle {height:g} cm above the surface"
        theta = THETA_DEG.copy()
        return Motion(name, rotation_poses(np.radians(theta), height), {"theta_deg": theta})
    if hip_cm is not None:
        raise InputError("--hip is for a rotation; with --path the height is in the file's z_cm")
    time, poses = read_path(path)
    columns = {
        "t_s": time,
        "x_cm": poses[:, 0],
        "z_cm": poses[:, 1],
        "angle_deg": np.degrees(poses[:, 2]),
    }
    return Motion(f"along {path}", poses, columns)


# --- Forces on an outline with their intervals: the spread of a profile carried through the integral.


QUANTITIES = ("force_z_N", "force_x_N", "moment_N_cm")

_MOST_AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Prediction:
    """Forces by pose, with intervals where the profile has a spread.

    `values`: shape (p,); By name, see `QUANTITIES`.
    `ends`: shape (p,); Lower and upper end of the interval of each; empty if no error is known.
    `reason`: Why there is NaN; empty if there is none.
    """

    values: dict[str, FloatArray]
    ends: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    reason: str = ""

    @property
    def unknown(self) -> int:
        """Number of poses with NaN."""
        return int(np.count_nonzero(np.isnan(np.stack(list(self.values.values()))).any(axis=0)))


def predict_forces(
    source: Source, outline: Outline, poses: FloatArray, confidence: float
) -> Prediction:
    """Integrate the forces over an outline in each pose, with intervals.

    `poses`: shape (p, 6); As for `rftfit.model.forces.forces_on`. Returns intervals are pointwise,
    each pose for itself.
    """
    from rftfit.model.forces import forces_on

    best = forces_on(source.profile, outline, poses)
    values = _named(best)
    if source.spread is None:
        return Prediction(values, reason=best.reason)
    if isinstance(source.spread, FurtherMedium):
        ends = _of_further_medium(source.spread, outline, poses, confidence)
    else:
        ends = _of_draws(source.spread, outline, poses, confidence)
    return Prediction(values, ends, best.reason)


def _of_further_medium(
    spread: FurtherMedium, outline: Outline, poses: FloatArray, confidence: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    from rftfit.model.forces import force_draws, forces_on
    from rftfit.model.profiles import FourierProfile
    from rftfit.model.scaling import with_interval

    unit = _named(forces_on(FourierProfile(spread.reference.m0), outline, poses))
    each = _named(force_draws(FourierProfile(spread.reference.scaled), outline, poses))
    return {
        name: with_interval(spread.scaled, unit[name], each[name], confidence)[1:]
        for name in QUANTITIES
    }


def _of_draws(
    spread: Profile, outline: Outline, poses: FloatArray, confidence: float
) -> dict[str, tuple[FloatArray, FloatArray]]:
    from rftfit.model.draws import interval
    from rftfit.model.forces import force_draws

    # a long path with every draw of every pose at once would not fit into the memory
    step = max(1, _MOST_AT_ONCE // spread.parameters[0].shape[0])
    parts: dict[str, list[tuple[FloatArray, FloatArray]]] = {name: [] for name in QUANTITIES}
    for start in range(0, len(poses), step):
        many = _named(force_draws(spread, outline, poses[start : start + step]))
        for name in QUANTITIES:
            parts[name].append(interval(many[name], confidence))
    return {
        name: (np.concatenate([lo for lo, _ in part]), np.concatenate([hi for _, hi in part]))
        for name, part in parts.items()
    }


def _named(forces: Forces) -> dict[str, FloatArray]:
    return {name: getattr(forces, name) for name in QUANTITIES}


# --- Peaks of predicted forces, for people and as JSON.


_LONGEST_REASON = 300

_PEAKS = (
    ("lift", "force_z_N", 1),
    ("suction", "force_z_N", -1),
    ("thrust", "force_x_N", 1),
    ("drag", "force_x_N", -1),
    ("moment", "moment_N_cm", 1),
    ("moment_negative", "moment_N_cm", -1),
)
_IN_WORDS = {
    "lift": "peak lift (up)",
    "suction": "peak suction (down)",
    "thrust": "peak thrust (toward +x)",
    "drag": "peak drag (toward -x)",
    "moment": "peak moment (z toward x)",
    "moment_negative": "peak moment (x toward z)",
}


@dataclass(frozen=True)
class Peak:
    """Greatest force of one sign, with its interval there.

    `value`, `lo`, `hi`: Unit of the quantity; NaN where no interval is known.
    `at`: Where: theta_deg or t_s.
    """

    name: str
    quantity: str
    value: float
    lo: float
    hi: float
    at: float


def find_peaks(motion: Motion, prediction: Prediction) -> list[Peak]:
    """Find the greatest force and moment of each sign; poses with NaN are left out.

    Returns only those that exist: no lift where nothing pushes up.
    """
    found = []
    for name, quantity, sign in _PEAKS:
        values = sign * prediction.values[quantity]
        if np.isnan(values).all() or not np.nanmax(values) > 0:
            continue
        index = int(np.nanargmax(values))
        ends = prediction.ends.get(quantity)
        lo, hi = (float(end[index]) for end in ends) if ends else (math.nan, math.nan)
        value, at = prediction.values[quantity][index], motion.columns[motion.key][index]
        found.append(Peak(name, quantity, float(value), lo, hi, float(at)))
    return found


def shortened(reason: str) -> str:
    """Cut a reason that names dozens of cells after a whole one."""
    if len(reason) <= _LONGEST_REASON:
        return reason
    parts = reason.split("; ")
    kept = [parts[0][:_LONGEST_REASON]]
    while len("; ".join(kept)) + len(parts[len(kept)]) < _LONGEST_REASON:
        kept.append(parts[len(kept)])
    return f"{'; '.join(kept)} and {len(parts) - len(kept)} more"


def as_text(motion: Motion, prediction: Prediction, peaks: list[Peak], confidence: float) -> str:
    """Peaks as a table for people."""
    known = bool(prediction.ends)
    header = ["", "value", *(["lo", "hi"] if known else []), "unit", motion.key]
    rows = []
    for peak in peaks:
        numbers = [peak.value, *([peak.lo, peak.hi] if known else [])]
        unit = "N cm" if peak.quantity.endswith("cm") else "N"
        rows.append(
            [_IN_WORDS[peak.name], *(f"{number:.4g}" for number in numbers), unit, f"{peak.at:g}"]
        )
    text = table(header, rows) if rows else "  no force"
    if prediction.unknown:
        # the greatest of a curve with gaps need not be its peak, and must not pass for it
        there = count(len(motion.poses) - prediction.unknown, "pose")
        text = f"Of the {there} with a number only:\n\n{text}"
    if not rows:
        return text
    if known:
        return f"{text}\n\nlo, hi: {100 * confidence:g} % interval, pose by pose."
    return f"{text}\n\nNo intervals: the errors of this profile are not known."


def json_text(
    names: dict[str, str], motion: Motion, prediction: Prediction, peaks: list[Peak],
    confidence: float, output: Path,
) -> str:  # fmt: skip
    """Peaks as JSON; what is not known is null.

    Peaks are those of the poses with a number; ``peaks_complete`` says whether these are all.

    `names`: What was predicted. `output`: File of the forces.
    """
    by_name = {peak.name: peak for peak in peaks}

    def entry(name: str, quantity: str) -> dict[str, Any] | None:
        if name not in by_name:
            return None
        peak = by_name[name]
        numbers = {quantity: peak.value, "lo": peak.lo, "hi": peak.hi, motion.key: peak.at}
        return {key: value if math.isfinite(value) else None for key, value in numbers.items()}

    content: dict[str, Any] = {
        **names,
        "confidence": confidence if prediction.ends else None,
        "rows": len(motion.poses),
        "rows_unknown": prediction.unknown,
        "reason": prediction.reason,
        "peaks_complete": prediction.unknown == 0,
        "peaks": {name: entry(name, quantity) for name, quantity, _ in _PEAKS},
        "forces": str(output),
    }
    return json.dumps(content, indent=2)


# --- The predicted forces as a file, never over a file of somebody else's.


MARK = "# forces written by rftfit predict"
"""How the first line of such a file begins: only these are overwritten unasked."""


def end_names(quantity: str) -> tuple[str, str]:
    """Names of the columns of an interval: ``force_z_N`` to ``force_z_lo_N``, ``force_z_hi_N``."""
    what, unit = quantity.rsplit("_N", maxsplit=1)
    return f"{what}_lo_N{unit}", f"{what}_hi_N{unit}"


def table_text(motion: Motion, prediction: Prediction, notes: Sequence[str]) -> str:
    """Write forces by pose as csv.

    `notes`: Comment lines: what was predicted, from what. Returns comment lines, a header row, a
    row for each pose; an empty cell is NaN.
    """
    # twelve digits, so that whoever takes the numbers further loses nothing; intervals need fewer
    columns: dict[str, list[str]] = {
        name: _cells(values, 10) for name, values in motion.columns.items()
    }
    for name in QUANTITIES:
        columns[name] = _cells(prediction.values[name], 12)
        if name in prediction.ends:
            for end, values in zip(end_names(name), prediction.ends[name], strict=True):
                columns[end] = _cells(values, 9)
    lines = [f"{MARK} (rftfit {rftfit.__version__})"]
    # a comment is one line, whatever a file name holds
    lines += [f"# {' '.join(note.split())}" for note in notes if note]
    lines.append(",".join(columns))
    lines += [",".join(row) for row in zip(*columns.values(), strict=True)]
    return "\n".join(lines) + "\n"


def _cells(values: FloatArray, digits: int) -> list[str]:
    # + 0.0 so that nothing is called -0
    return ["" if math.isnan(value) else f"{value + 0.0:.{digits}g}" for value in values.tolist()]


# --- ``rftfit predict``: forces on a leg, or on any outline along any path.


def predict(
    leg: Annotated[
        str | None, typer.Option(help="Model leg: c_leg, flat_leg or reversed_c_leg.")
    ] = None,
    curvature: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="R/r",
            help="Leg of any curvature, 2R = 7.62 cm: 1 is the c-leg, 0 flat, -1 the reversed one.",
        ),
    ] = None,
    outline: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Any outline: csv with x_cm, z_cm, points in order; it turns about (0, 0).",
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="cm",
            help="Width across the plane; 2.54 with --curvature, needed with --outline.",
        ),
    ] = None,
    hip: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="cm",
            help="Turn it about (0, 0) at this height, theta from -135 to 135 deg; default 2.",
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Move it along a path instead: csv with t_s, x_cm, z_cm, angle_deg.",
        ),
    ] = None,
    medium: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Published medium, or with --results one of a campaign."),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            help="table (default: alpha as measured), fourier, generic or depth_only; with --alpha "
            "always generic."
        ),
    ] = None,
    results: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Take the tables of a campaign's results.")
    ] = None,
    method: Annotated[
        str | None, typer.Option(help="Fit in those results: lsq (default) or dft-index.")
    ] = None,
    alpha: Annotated[
        float | None,
        typer.Option(
            parser=number_of,
            metavar="N/cm^3",
            help="A medium known by one vertical penetration test: as for rftfit scale.",
        ),
    ] = None,
    se: Annotated[
        float | None,
        typer.Option(
            parser=number_of, metavar="N/cm^3", help="Standard error of alpha; default 0."
        ),
    ] = None,
    confidence: Annotated[
        float,
        typer.Option(
            parser=number_of,
            metavar="LEVEL",
            help="Level of the intervals; for a medium of a campaign that of its config.",
        ),
    ] = 0.95,
    elements: Annotated[
        int, typer.Option(metavar="N", help="Straight elements that the outline is cut into.")
    ] = 30,
    output: Annotated[Path, typer.Option(metavar="FILE", help="File of the forces.")] = Path(
        "forces.csv"
    ),
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON instead of a text for people.")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="Overwrite a file that rftfit did not write.")
    ] = False,
) -> None:
    """Predict force and moment on a leg or any outline that moves through a medium.

    Prints the peaks and writes every pose as csv. Force is that of the medium on the body, z up;
    a leg sweeps from the front (+x, negative theta) down and backward.
    """
    from rftfit.cli.output import check_target
    from rftfit.store import write_text

    _check_together(medium, profile, results, method, alpha, se)
    inputs = AllAtOnce()
    with inputs.part():
        body = make_outline(leg, curvature, outline, width, elements)
    with inputs.part():
        motion = make_motion(hip, path)
    with inputs.part():
        # a value that cannot be wrong where none was given: the level is checked in any case
        check_test(0.9 if alpha is None else alpha, se or 0.0, confidence)
        source = _source(medium, profile, results, method, alpha, se or 0.0, confidence)
    inputs.check()
    check_target(output, MARK, "forces", force, (outline, path))
    prediction = predict_forces(source, body, motion.poses, confidence)
    peaks = find_peaks(motion, prediction)
    names = {
        "outline": f"{body.name}, {body.area_cm2:.4g} cm^2, {len(body.body)} elements",
        "motion": motion.name,
        "profile": source.name,
    }
    level = f"_lo and _hi: {100 * confidence:g} % interval, row by row" if prediction.ends else ""
    why = prediction.reason and f"empty cells: {shortened(prediction.reason)}"
    text = table_text(motion, prediction, [*names.values(), level, why])
    if as_json:
        say(json_text(names, motion, prediction, peaks, confidence, output))
    else:
        say("\n".join(f"{word.capitalize()}: {name}" for word, name in names.items()) + "\n")
        say(as_text(motion, prediction, peaks, confidence))
    needs_less = results is not None and profile in (None, "table", "depth_only")
    _warn_of(
        motion, prediction, "; --profile generic needs the cell (0, 90) only" if needs_less else ""
    )
    # after the numbers are out: a folder that cannot be written must not hide them
    write_text(output, text)
    if not as_json:
        say(f"Force and moment in {len(motion.poses)} poses: {output}")


def _check_together(
    medium: str | None, profile: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float | None,
) -> None:  # fmt: skip

    if (medium is None) == (alpha is None):
        found = "no medium" if alpha is None else "--medium and --alpha"
        raise InputError(
            f"found {found}; allowed: one of --medium NAME (published, or with --results DIR of a "
            "campaign) and --alpha N/cm^3 (one penetration test)"
        )
    if profile is not None:
        allowed = PROFILES if alpha is None else ("generic",)
        more = "" if alpha is None else "one penetration test gives no other profile"
        choose("--profile", profile, allowed, more)
    if se is not None and alpha is None:
        raise InputError("--se is the standard error of --alpha, so it needs --alpha")
    if method is not None and results is None:
        raise InputError("--method chooses among the fits of a campaign, so it needs --results DIR")
    if method is not None and alpha is None and profile not in ("fourier", "generic"):
        raise InputError(
            "--method chooses among nine-term fits, so it needs --profile fourier or generic"
        )


def _source(
    medium: str | None, profile: str | None, results: Path | None, method: str | None,
    alpha: float | None, se: float, confidence: float,
) -> Source:  # fmt: skip
    from rftfit.cli.scale import from_results
    from rftfit.model.scaling import published

    if alpha is not None:
        reference = published() if results is None else from_results(results, method or "lsq")
        return from_test(reference, alpha, se, confidence)
    assert medium is not None
    if results is None:
        return from_print(medium, profile or "table")
    return from_campaign(results, medium, profile or "table", method or "lsq", confidence)


def _warn_of(motion: Motion, prediction: Prediction, hint: str) -> None:
    import numpy as np

    unknown, total = prediction.unknown, len(motion.poses)
    if unknown:
        warn(
            f"warning: no number in {unknown} of {total} poses, which are left out of the peaks: "
            f"{shortened(prediction.reason)}{hint}"
        )
    elif all((values == 0).all() for values in prediction.values.values()):
        warn("warning: no force in any pose: the outline stays above the surface, or does not move")
    lost = [
        np.isnan(end) & ~np.isnan(prediction.values[name])
        for name, ends in prediction.ends.items()
        for end in ends
    ]
    if lost and np.any(lost):
        count = np.count_nonzero(np.any(lost, axis=0))
        warn(f"warning: no interval in {count} of {total} poses: a cell of the table has none")
