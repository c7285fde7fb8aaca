"""A stress profile as one file to hand on, ``profile.json``: writer, reader and its checks."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from pydantic import ValidationError

from rftfit.campaign.files import read_text
from rftfit.campaign.problems import CampaignError, Place, Problem
from rftfit.campaign.reading import ModelFile, check_model
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.model.draws import interval
from rftfit.model.fourier import TERMS, fit_lsq, kept_terms
from rftfit.model.profile_schema import (
    FORMAT,
    About,
    Errors,
    Golden,
    Made,
    Nodes,
    Origin,
    ProfileFile,
    Terms,
    Validity,
    Zeta,
)
from rftfit.model.profiles import FourierProfile, Profile, TableProfile
from rftfit.model.scaling import PAPER_RULE, vertical_penetration
from rftfit.model.shapes import Map
from rftfit.store import write_text
from rftfit.store.digests import digest_of
from rftfit.version import __version__

MARK = f'{{\n "format": "{FORMAT}"'
"""How a file of this program begins."""

_MOST_BYTES, _MOST_NODES, _MOST_KEYS = 20_000_000, 5_000, 100
_AGREES = 1e-6
"""Numbers that should be the same differ less, as a share of the largest alpha."""

_SAMPLED = 7
"""Significant digits of the draws."""


def profile_of(content: ProfileFile) -> TableProfile:
    """What answers alpha(beta, gamma)."""
    table = _table_of(content)
    low, high = content.validity.depth_from_cm, content.validity.depth_to_cm
    table.window = (low or 0.0, math.inf if high is None else high)
    table.spread = None if content.errors is None else _spread(table, content.errors)
    return table


def _table_of(content: ProfileFile) -> TableProfile:
    nodes = content.nodes
    beta, gamma = (np.radians(np.array(one)) for one in (nodes.beta_deg, nodes.gamma_deg))
    z, x = (
        np.array(one, dtype=float) for one in (nodes.alpha_z_N_per_cm3, nodes.alpha_x_N_per_cm3)
    )
    name, why = content.origin.profile or "profile from a file", content.validity.without_number
    missing = bool(np.isnan(z + x).any())
    return TableProfile._of_nodes(
        beta, gamma, (z, x), name, why or (f"{name}: null there" if missing else "")
    )


# --- Errors: nodes that are mirror images of one another have one error, turned in x.


class _Cells(NamedTuple):
    """Which nodes of a closed grid are one and the same but for the sign of alpha_x.

    `cell`, `sign`: shape (nb, ng). `first`: A node of each cell whose sign is 1, as index of the flat
    grid.
    """

    cell: npt.NDArray[np.intp]
    sign: FloatArray
    first: npt.NDArray[np.intp]


def _cells(beta_deg: FloatArray, gamma_deg: FloatArray) -> _Cells:
    def place(beta: FloatArray, gamma: FloatArray) -> FloatArray:
        return np.round((beta + 90) % 180, 6) % 180 * 1000 + np.round((gamma + 180) % 360, 6) % 360

    beta, gamma = np.meshgrid(beta_deg, gamma_deg, indexing="ij")
    own, image = place(beta, gamma), place(-beta, 180 - gamma)
    code = np.round(np.minimum(own, image), 5)
    _, first, cell = np.unique(code, return_index=True, return_inverse=True)
    return _Cells(cell.reshape(own.shape), np.where(own <= image, 1.0, -1.0), first)


def _spread(table: TableProfile, errors: Errors) -> TableProfile:
    """Draws of alpha at the nodes; NaN where there are none."""
    cell = np.array(errors.cell, dtype=float)
    known = np.isfinite(cell)
    index = np.where(known, cell, 0).astype(int)
    z, x = (np.array(one) for one in (errors.draws_z_N_per_cm3, errors.draws_x_N_per_cm3))
    sign = np.array(errors.sign_x, dtype=float)
    on_nodes = np.where(known, z[:, index], np.nan), np.where(known, sign * x[:, index], np.nan)
    return TableProfile._of_nodes(table.beta, table.gamma, on_nodes)


def _errors(table: TableProfile) -> Errors | None:
    rows = table.spread
    if not isinstance(rows, TableProfile):
        return None
    cells = _cells(np.degrees(table.beta), np.degrees(table.gamma))
    draws = np.stack(
        [one.reshape(len(one), -1)[:, cells.first] for one in (rows.alpha_z, rows.alpha_x)]
    )
    there = np.isfinite(draws).all(axis=(0, 1)) & np.isfinite(table.alpha_z.ravel()[cells.first])
    if not there.any():
        return None
    short = [float(f"{one:.{_SAMPLED}g}") for one in draws[..., there].flat]
    z, x = np.reshape(short, (2, draws.shape[1], -1))
    cell = np.where(there, np.cumsum(there) - 1, -1)[cells.cell]
    return Errors(
        cell=[[int(one) if one >= 0 else None for one in row] for row in cell],
        sign_x=cells.sign.astype(int).tolist(),
        draws_z_N_per_cm3=_rows(z),
        draws_x_N_per_cm3=_rows(x),
    )


def _rows(values: FloatArray) -> Any:
    """Numbers as JSON has them: NaN is null, nothing is called -0."""
    return np.where(np.isnan(values), np.array(None), values + 0.0).tolist()


# --- The golden value.

_TRIED_BETA = (10, 20, 40, 50, -10, -20, -40, -50)
_TRIED_GAMMA = (25, 40, 50, 80, -25, -40, -50, -80)


def _turned(profile: Profile, beta_deg: float, gamma_deg: float) -> dict[str, FloatArray]:
    """Alpha as it comes out where a convention is another one, by what is wrong then."""

    def at(beta: float, gamma: float) -> FloatArray:
        return np.array(profile.alpha(np.radians(beta), np.radians(gamma)))

    z, x = at(beta_deg, gamma_deg)
    return {
        "the sign of alpha_z is turned": np.array([-z, x]),
        "the sign of alpha_x is turned": np.array([z, -x]),
        "the signs of alpha_z and alpha_x are turned": np.array([-z, -x]),
        "alpha_z and alpha_x are swapped": np.array([x, z]),
        "beta counts the other way": at(-beta_deg, gamma_deg),
        "gamma counts the other way": at(beta_deg, -gamma_deg),
        "beta and gamma count the other way": at(-beta_deg, -gamma_deg),
        "beta and gamma are swapped": at(gamma_deg, beta_deg),
        "gamma is 180 degrees less what it should be": at(beta_deg, 180 - gamma_deg),
        "beta is 90 degrees less what it should be": at(90 - beta_deg, gamma_deg),
    }


def _golden(table: TableProfile, terms: FloatArray | None, errors: Errors | None) -> Golden:
    """Choose the direction in which a wrong convention shows most."""
    tried = []
    for beta in _TRIED_BETA:
        for gamma in _TRIED_GAMMA:
            right = np.array(table.alpha(np.radians(beta), np.radians(gamma)))
            off = [np.abs(one - right).max() for one in _turned(table, beta, gamma).values()]
            if np.isfinite(right).all():
                tried.append((float(np.nanmin(off)), beta, gamma))
    if not tried:
        raise InputError(
            f"{table.name}: alpha is known in too few directions for a table; allowed: a table whose cells have "
            "neighbours; the map needs one push only"
        )
    # the first of those that are equally good
    _, beta, gamma = max(tried, key=lambda one: one[0])
    return Golden(
        beta_deg=beta, gamma_deg=gamma, **_golden_numbers(table, terms, errors, beta, gamma)
    )


def _golden_numbers(
    table: TableProfile, terms: FloatArray | None, errors: Errors | None, beta: float, gamma: float
) -> dict[str, float]:
    at = np.radians(beta), np.radians(gamma)
    found = dict(zip(("alpha_z_N_per_cm3", "alpha_x_N_per_cm3"), table.alpha(*at), strict=True))
    if terms is not None:
        names = ("nine_terms_z_N_per_cm3", "nine_terms_x_N_per_cm3")
        found |= dict(zip(names, FourierProfile(terms).alpha(*at), strict=True))
    if errors is not None:
        (zz, zx), (_, xx) = np.cov(*_spread(table, errors).alpha(*at))
        found |= {
            "se_z_N_per_cm3": np.sqrt(zz), "se_x_N_per_cm3": np.sqrt(xx), "covariance_zx": zx,
        }  # fmt: skip
    return {name: float(value) + 0.0 for name, value in found.items() if np.isfinite(value)}


# --- Writing.


def write_profile(
    path: str | Path, profile: Map | TableProfile, *, name: str = "", title: str = "",
    notes: str = "", marks: str = "", window: tuple[float, float] | None = None,
    made_from: Mapping[str, str] | None = None, confidence: float = 0.95,
) -> None:  # fmt: skip
    """Write a stress profile as one file to hand on, ``profile.json``.

    It holds alpha over all directions with its errors, the nine terms, zeta, the conventions in words
    and as a golden value, units, limits of validity, and what it was made from. The same profile gives
    the same bytes.

    Parameters
    ----------
    path : str or Path
        The file; it is replaced.
    profile : Map or TableProfile
        Of the medium.
    name, title, notes : str, optional
        Of the medium; default: the name of the map.
    marks : str, optional
        Physical checks that the medium fails.
    window : tuple of float, optional
        Least and greatest depth behind alpha, cm; default: that of the profile.
    made_from : mapping of str to str, optional
        SHA-256 of files behind it, by name.
    confidence : float, optional
        Level of the interval of zeta of a table; a map has its own.

    Raises
    ------
    InputError
        If alpha is known in too few directions to make a table.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import rftfit
    >>> profile = rftfit.published_medium("poppy_LP")
    >>> rftfit.write_profile("profile.json", profile, name="poppy_LP")  # doctest: +SKIP
    """
    table, own = (profile.profile, profile.name) if isinstance(profile, Map) else (profile, "")
    kind = type(table).__name__
    if kind != "TableProfile" or table.alpha_z.ndim > 2:
        named = getattr(table, "name", "write_profile(path, profile)")
        raise InputError(f"{named}: found a {kind}; allowed: a map or a table of one medium")
    low, high = window or table.window
    level = profile.confidence if isinstance(profile, Map) else confidence
    try:
        content = ProfileFile(
            format=FORMAT, version=2,
            medium=About(name=name or own, title=title, notes=notes),
            validity=Validity(
                depth_from_cm=low or None, depth_to_cm=high if math.isfinite(high) else None,
                without_number=table.reason, marks=marks,
            ),
            origin=Origin(
                program=f"rftfit {__version__}", profile=table.name,
                made_from=dict(made_from or {}), **_of_map(profile),
            ),
            **_numbers(profile, table, level),
        )  # fmt: skip
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"]))
        raise InputError(
            f"{path}: {where}: {first['msg'].removeprefix('Value error, ')}"
        ) from error
    content = content.model_copy(update={"digest": _digest(content)})
    text = _text(content.model_dump()) + "\n"
    if (size := len(text.encode())) > _MOST_BYTES:
        found = f"{size / 1e6:.1f} MB with the errors of {len(table.alpha_z.ravel())} nodes"
        raise InputError(f"{path}: found {found}; allowed: {_MOST_BYTES / 1e6:g} MB")
    write_text(path, text)


def _of_map(profile: Map | TableProfile) -> dict[str, Any]:
    if not isinstance(profile, Map):
        return {"kind": "table"}
    belongs = None if math.isnan(profile.belongs) else profile.belongs
    return {
        "kind": "map", "pushes": profile.pushes, "known_media": profile.known, "belongs": belongs
    }  # fmt: skip


def _numbers(profile: Map | TableProfile, table: TableProfile, confidence: float) -> dict[str, Any]:
    nodes = Nodes(
        beta_deg=np.round(np.degrees(table.beta), 10).tolist(),
        gamma_deg=np.round(np.degrees(table.gamma), 10).tolist(),
        alpha_z_N_per_cm3=_rows(table.alpha_z), alpha_x_N_per_cm3=_rows(table.alpha_x),
        measured=_measured(profile, table).tolist(),
    )  # fmt: skip
    errors, (terms, zeta) = _errors(table), _fitted(table, confidence)
    named = None if terms is None else dict(zip(TERMS, terms.tolist(), strict=True))
    return {
        "nodes": nodes,
        "errors": errors,
        "pushes": _made(profile, table, nodes, errors),
        "nine_terms": None if named is None else Terms(**named),
        "zeta": zeta,
        "golden": _golden(table, terms, errors),
    }


def _made(
    profile: Map | TableProfile, table: TableProfile, nodes: Nodes, errors: Errors | None
) -> Made:
    """The pushes of a map; of a table its measured directions, each once."""
    if isinstance(profile, Map) and profile.given is not None:
        pushes = profile.given
        beta, gamma, alpha = np.degrees(pushes.beta), np.degrees(pushes.gamma), pushes.alpha
        se = np.sqrt(np.diag(pushes.covariance)).reshape(alpha.shape)
    else:
        beta, gamma = np.meshgrid(nodes.beta_deg, nodes.gamma_deg, indexing="ij")
        # what lies in the range of a run sheet; a plate at -90 degrees is the one at 90
        own = np.array(nodes.measured) & (np.abs(gamma) <= 90 + 1e-6) & (beta > -90 + 1e-6)
        values = (nodes.alpha_z_N_per_cm3, nodes.alpha_x_N_per_cm3)
        alpha = np.stack([np.array(one, dtype=float)[own] for one in values])
        se = np.full(alpha.shape, np.nan)
        if errors is not None:
            draws = _spread(table, errors)
            se = np.stack(
                [rows.std(axis=0, ddof=1)[own] for rows in (draws.alpha_z, draws.alpha_x)]
            )
        beta, gamma = beta[own], gamma[own]
    (z, x), (se_z, se_x) = (_rows(one) for one in (alpha, np.where(np.isnan(alpha), np.nan, se)))
    return Made(
        beta_deg=np.round(beta, 10).tolist(), gamma_deg=np.round(gamma, 10).tolist(),
        alpha_z_N_per_cm3=z, alpha_x_N_per_cm3=x, se_z=se_z, se_x=se_x,
    )  # fmt: skip


def pushes_in_profile(path: Path) -> pd.DataFrame:
    """The pushes behind a profile file, as `rftfit.estimate_map` takes them."""
    names = {"se_z": "alpha_z_se_N_per_cm3", "se_x": "alpha_x_se_N_per_cm3"}
    table = pd.DataFrame(read_content(path).pushes.model_dump()).rename(columns=names)
    return table.astype(float)


def _measured(profile: Map | TableProfile, table: TableProfile) -> npt.NDArray[np.bool_]:
    """Nodes that were pushed, or their mirror image; a grid is closed by lines between its own."""
    if isinstance(profile, Map):
        pushed = profile.measured.astype(float)
        return TableProfile(pushed, pushed, profile.beta, profile.gamma).alpha_z > 0
    (beta, gamma), off = table.lines, np.pi / 2
    rows = np.isclose((table.beta[:, None] - beta + off) % np.pi, off).any(axis=1)
    columns = np.isclose((table.gamma[:, None] - gamma + off) % (2 * np.pi), off).any(axis=1)
    return np.outer(rows, columns) & np.isfinite(table.alpha_z)


def _fitted(table: TableProfile, confidence: float) -> tuple[FloatArray | None, Zeta | None]:
    """Nine terms and zeta of a table; none where too few directions are known."""
    try:
        keep = kept_terms(fit_lsq(*table.cells), PAPER_RULE)
        terms = fit_lsq(*table.cells, keep)
        ends: dict[str, float] = {}
        if isinstance(table.spread, TableProfile):
            many = vertical_penetration(fit_lsq(*table.spread.cells, keep))
            lo, hi = interval(many, confidence)
            ends = {"lo": float(lo), "hi": float(hi)} if np.isfinite(lo) else {}
    except ValueError:
        return None, None
    value = float(vertical_penetration(terms))
    return terms, Zeta(value=value, confidence=confidence, **ends)


def _digest(content: ProfileFile) -> str:
    parts = content.model_dump(include={"nodes", "errors", "pushes", "nine_terms", "zeta"})
    return digest_of(parts)


def _text(value: Any, depth: int = 1) -> str:
    """JSON with a line for each key and each row of a table."""
    before, after = "\n" + " " * depth, "\n" + " " * (depth - 1)
    if isinstance(value, dict) and value:
        lines = (f"{json.dumps(name)}: {_text(one, depth + 1)}" for name, one in value.items())
        return "{" + before + f",{before}".join(lines) + after + "}"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[" + before + f",{before}".join(map(_text, value)) + after + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ": "))


# --- Reading.


def read_profile(path: str | Path) -> TableProfile:
    """Read a stress profile that was handed on, and check it: schema, golden value, symmetry.

    Parameters
    ----------
    path : str or Path
        A file as `write_profile` or ``rftfit export`` writes it.

    Returns
    -------
    TableProfile
        With its depths and, where the file has errors, the draws of its intervals.

    Raises
    ------
    InputError
        If the file is not valid; the message names every key that is wrong, what was found and what
        is allowed.

    Examples
    --------
    >>> import rftfit
    >>> profile = rftfit.read_profile("profile.json")  # doctest: +SKIP
    >>> forces = rftfit.predict(profile, rftfit.model_leg("c_leg"))  # doctest: +SKIP
    """
    content = read_content(Path(path))
    try:
        return profile_of(content)
    except InputError as error:
        raise InputError(f"{path}, key {error}") from error


def read_content(path: Path) -> ProfileFile:
    """Read all that a profile's file says; every problem is told at once."""
    file = ModelFile[ProfileFile](str(path))
    _parse(read_text(path, file.name, "profile", _MOST_BYTES), file)
    if file.data is not None:
        check_model(file, ProfileFile)
    if file.model is not None:
        _check(file, file.model)
    if file.model is None or file.problems:
        raise CampaignError(file.problems)
    return file.model


def _parse(text: str, file: ModelFile[ProfileFile]) -> None:
    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(items) > _MOST_KEYS:
            file.note((), "too-large", f"{len(items)} keys", f"at most {_MOST_KEYS} in a section")
            return {}
        for name, count in Counter(name for name, _ in items).items():
            if count > 1:
                place = Place(file.name, key=name)
                text = f"each key once; this one is there {count} times"
                file.problems.append(Problem("profile.duplicate-key", place, name, text))
        return dict(items)

    try:
        file.data = json.loads(text, object_pairs_hook=pairs)
    except RecursionError:
        file.note((), "too-deep", None, "nested too deeply: a profile has at most four levels")
    except json.JSONDecodeError as error:
        place = Place(file.name, line=error.lineno, column=str(error.colno))
        file.problems.append(
            Problem("profile.not-json", place, None, f"this is not JSON: {error.msg}")
        )
    except ValueError:
        file.note((), "not-json", None, "a whole number in it has thousands of digits")
    if file.data is None and not file.problems:
        file.note((), "empty", "null", "a profile as `rftfit export` writes it")


def _check(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    """What no schema can say: lengths, lines, golden value, symmetry."""
    _check_lines(file, content.nodes)
    _check_lengths(file, content)
    if file.problems:
        return
    _check_symmetry(file, content)
    _check_golden(file, content)
    if content.digest and content.digest != (own := _digest(content)):
        text = f"{content.digest}, as written: numbers were changed since; leave the key out to use them"
        file.note(("digest",), "digest", own, text)


def _check_lines(file: ModelFile[ProfileFile], nodes: Nodes) -> None:
    for name, lines, end in (("beta_deg", nodes.beta_deg, 90), ("gamma_deg", nodes.gamma_deg, 180)):
        for ends, wanted in ((0, -end), (-1, end)):
            if abs(lines[ends] - wanted) > _AGREES:
                where = ("nodes", name, ends % len(lines))
                file.note(
                    where, "lines", f"{lines[ends]:g}", f"{wanted}, the end of all directions"
                )
        falls = np.flatnonzero(np.diff(lines) <= _AGREES)
        if falls.size:
            at = int(falls[0]) + 1
            text = f"lines that rise; the one before is {lines[at - 1]:g}"
            file.note(("nodes", name, at), "lines", f"{lines[at]:g}", text)
    if len(nodes.beta_deg) * len(nodes.gamma_deg) > _MOST_NODES:
        found = f"{len(nodes.beta_deg)} x {len(nodes.gamma_deg)}"
        file.note(("nodes",), "too-large", found, f"at most {_MOST_NODES} nodes")


def _check_lengths(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    nodes, errors = content.nodes, content.errors
    shape = len(nodes.beta_deg), len(nodes.gamma_deg)
    grids: dict[tuple[str, str], list[Any]] = {
        ("nodes", name): getattr(nodes, name)
        for name in ("alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "measured")
    }
    if errors is not None:
        grids |= {("errors", name): getattr(errors, name) for name in ("cell", "sign_x")}
    for path, rows in grids.items():
        _check_rows(file, path, rows, *shape)
    made = content.pushes.model_dump()
    for name, entries in made.items():
        if len(entries) != len(made["beta_deg"]):
            wanted = f"{len(made['beta_deg'])} entries, as beta_deg has"
            file.note(("pushes", name), "length", f"{len(entries)} entries", wanted)
    if errors is None:
        return
    z, x = errors.draws_z_N_per_cm3, errors.draws_x_N_per_cm3
    used = {one for row in errors.cell for one in row if one is not None}
    width = len(z[0])
    for name, rows in (("draws_z_N_per_cm3", z), ("draws_x_N_per_cm3", x)):
        _check_rows(file, ("errors", name), rows, len(z), width)
    if not used or min(used) < 0 or max(used) >= width:
        found = f"{min(used)} to {max(used)}" if used else "none"
        file.note(("errors", "cell"), "cell", found, f"numbers of columns, 0 to {width - 1}")
    if wrong := {one for row in errors.sign_x for one in row} - {1, -1}:
        file.note(("errors", "sign_x"), "sign", str(min(wrong)), "1 or -1")


def _check_rows(
    file: ModelFile[ProfileFile], path: tuple[str, str], rows: list[Any], count: int, length: int
) -> None:
    if len(rows) != count:
        file.note(path, "length", f"{len(rows)} rows", f"{count} rows")
    for at, row in enumerate(rows):
        if len(row) != length:
            file.note((*path, at), "length", f"{len(row)} entries", f"{length} entries")
            return


def _check_symmetry(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    table = _table_of(content)
    cells = _cells(np.degrees(table.beta), np.degrees(table.gamma))
    beta, gamma = np.meshgrid(content.nodes.beta_deg, content.nodes.gamma_deg, indexing="ij")
    for name, alpha, sign in (
        ("alpha_z_N_per_cm3", table.alpha_z, np.ones_like(cells.sign)),
        ("alpha_x_N_per_cm3", table.alpha_x, cells.sign),
    ):
        own = sign * alpha
        wanted = own.ravel()[cells.first][cells.cell]
        off = np.abs(own - wanted) > _AGREES * _largest(table)
        off |= np.isnan(own) != np.isnan(wanted)
        if not off.any():
            continue
        row, column = (int(one[0]) for one in np.nonzero(off))
        other = np.unravel_index(cells.first[cells.cell[row, column]], alpha.shape)
        right = sign[row, column] * wanted[row, column]
        text = (
            f"{_number(right)} at ({beta[row, column]:g}, {gamma[row, column]:g}) degrees, by symmetry with "
            f"({beta[other]:g}, {gamma[other]:g}): one of the two is wrong; nodes like this: {off.sum()} of {off.size}"
        )
        found = _number(alpha[row, column])
        file.note(("nodes", name, row, column), "symmetry", found, text)


def _number(value: float) -> str:
    return "null" if math.isnan(value) else f"{value:.6g}"


def _largest(table: TableProfile) -> float:
    return max(float(np.nanmax(np.abs([table.alpha_z, table.alpha_x]), initial=0.0)), 1e-300)


def _check_golden(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    """Recompute the golden value from nodes, terms and errors; say which convention is another one."""
    golden, table = content.golden, _table_of(content)
    terms = None
    if content.nine_terms is not None:
        terms = np.array([*content.nine_terms.model_dump().values()])
    at = golden.beta_deg, golden.gamma_deg
    found = _golden_numbers(table, terms, content.errors, *at)
    written = golden.model_dump(exclude={"beta_deg", "gamma_deg"})
    near, missing = _AGREES * _largest(table), math.nan
    for part, where, profile in (
        ("alpha", "nodes", table),
        ("nine_terms", "nine_terms", None if terms is None else FourierProfile(terms)),
        ("se", "errors", None),
        ("covariance", "errors", None),
    ):
        names = [name for name in written if name.startswith(part)]
        own = np.array([found.get(name, missing) for name in names])
        right = np.array([missing if written[n] is None else written[n] for n in names])
        scale = _largest(table) if part == "covariance" else 1.0
        wrong = ~np.isclose(own, right, rtol=_AGREES, atol=near * scale, equal_nan=True)
        if not wrong.any():
            continue
        turned = {} if profile is None else _turned(profile, *at)
        hint = [
            words for words, one in turned.items() if np.allclose(one, right, rtol=0, atol=near)
        ]
        for name, one, value in zip(np.array(names)[wrong], own[wrong], right[wrong], strict=True):
            text = f"{_number(value)}, the golden value {name} at ({at[0]:g}, {at[1]:g}) degrees"
            text += f"; in the {where} {hint[0]}" if hint else ""
            file.note((where,), "golden", _number(one), text)
