"""A stress profile as one file, ``profile.json``, that can be passed to others: writer, reader and its checks.

The file lists each direction once, with alpha and its draws there; `rftfit.model.profile_schema` has its keys. The
reader makes mirror images, the closed grid and every fit from these by the same code as from a measured table. The
golden value is alpha in one direction, by which a reader with other signs or angles notices it.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rftfit.campaign.files import read_text
from rftfit.campaign.problems import CampaignError, Place, Problem, in_lines
from rftfit.campaign.reading import ModelFile, check_model
from rftfit.campaign.tables import pushes_in
from rftfit.conventions import FloatArray
from rftfit.errors import InputError
from rftfit.model.maps import Map
from rftfit.model.profile_schema import FORMAT, VERSION, ProfileFile
from rftfit.model.profiles import KnownMedium, Profile, TableProfile
from rftfit.model.symmetry import list_once
from rftfit.store import write_text
from rftfit.store.digests import digest_of, sha256_of
from rftfit.store.text import megabytes
from rftfit.store.text import table as format_table
from rftfit.version import __version__

MARK = f'{{\n "format": "{FORMAT}"'
"""First characters of a file that this program wrote."""

_MOST_BYTES, _MOST_KEYS = 20_000_000, 100
"""Most bytes of a file, and most keys of a section of it, that are written or read."""

_TOLERANCE = 1e-6
"""Largest difference of equal numbers by rounding, as a share of the largest alpha."""

_DIGITS_OF_ANGLES, _DIGITS, _DIGITS_OF_DRAWS = 12, 9, 7
"""Significant digits of numbers in the file: of angles, of alpha and its errors, of draws."""

_ALPHA = ("alpha_z_N_per_cm3", "alpha_x_N_per_cm3")
"""Keys of alpha in each section of directions."""

_DRAW_COLUMNS = ("draws_z_N_per_cm3", "draws_x_N_per_cm3")
"""Keys of the draws, in the section ``errors``."""

_PUSH_COLUMNS = ("beta_deg", "gamma_deg", *_ALPHA, "se_z", "se_x")
"""Keys of the section ``pushes``, in the order of the rows of `TableProfile.pushed`."""


# --- Writing.


def write_profile(
    path: str | Path,
    medium: KnownMedium | str | Path,
    *,
    name: str = "",
    title: str = "",
    notes: str = "",
    marks: str = "",
    window: tuple[float, float] | None = None,
    made_from: Mapping[str, str] | None = None,
) -> None:
    """Write a stress profile as one file, ``profile.json``, that can be passed to others.

    The file holds alpha over all directions with its errors, the pushes behind it, the conventions in words and
    as a golden value, units, limits of validity, and what it was made from. The same profile gives the same
    bytes.

    Parameters
    ----------
    path : str or Path
        The file; an existing file is replaced.
    medium : Map, TableProfile, Medium, str or Path
        What `scale`, `estimate_map`, `published_medium` or `read_profile` return, a medium of a campaign (its table, or its
        map if the table has holes), or the path of a profile file.
    name, title, notes : str, optional
        Texts on the medium; default: those of the profile file, name and title of the medium of a campaign, or the name of
        the map.
    marks : str, optional
        Physical checks that the medium fails; default: those that the medium of a campaign or the profile file names.
    window : tuple of float, optional
        Least and greatest depth at which alpha was measured, cm; default: those of the medium.
    made_from : mapping of str to str, optional
        SHA-256 of the files that alpha was calculated from, by name; default: the alpha table of a medium of a
        campaign, or the profile file and what it was made from.

    Raises
    ------
    InputError
        If the medium is no map or table, alpha is known in too few directions to make a table, or `read_profile` would
        refuse the file.
    OutputError
        If the file cannot be written.

    Examples
    --------
    >>> import rftfit
    >>> profile = rftfit.published_medium("poppy_LP")
    >>> rftfit.write_profile("profile.json", profile, name="poppy_LP")  # doctest: +SKIP
    """
    if isinstance(medium, str | Path):
        medium = read_profile(medium)
    if not isinstance(medium, KnownMedium):
        raise InputError(
            f"found a {type(medium).__name__}; allowed: a map or a table of one medium"
        )
    source, facts = medium.export_source()
    table = source.profile if isinstance(source, Map) else source
    if not isinstance(table, TableProfile) or table.alpha_z.ndim > 2:
        raise InputError(
            f"{getattr(table, 'name', '') or 'medium'}: found a {type(table).__name__}; allowed: a map or a table of one "
            "medium: the file lists alpha as it was measured or estimated in each direction"
        )
    assert isinstance(source, Map | TableProfile)
    low, high = window or facts.get("window") or table.window
    model_error = None if math.isnan(table.model_error) else table.model_error
    file = ModelFile[ProfileFile](str(path))
    file.data = {
        "format": FORMAT,
        "version": VERSION,
        "medium": {
            "name": name or facts.get("name", ""),
            "title": title or facts.get("title", ""),
            "notes": notes or facts.get("notes", ""),
        },
        "golden": _choose_golden(table),
        "validity": {
            "depth_from_cm": low or None,
            "depth_to_cm": high if math.isfinite(high) else None,
            "without_number": table.reason,
            "marks": marks or facts.get("marks", ""),
        },
        "force_errors": {"model_error": model_error, "bed_spread": table.bed_spread},
        **_list_directions(table, source.pushed),
        "origin": {
            "program": f"rftfit {__version__}",
            "profile": table.name,
            "made_from": dict(made_from or facts.get("made_from", {})),
            **_describe_origin(source),
        },
    }
    content = _check_content(file)
    with_digest = content.model_copy(update={"digest": _digest(content)})
    json_text = _format_json(with_digest.model_dump()) + "\n"
    if (size := len(json_text.encode())) > _MOST_BYTES:
        file_content = (
            f"{size / 1e6:.1f} MB with the errors of {len(content.directions.beta_deg)} directions"
        )
        raise InputError(f"{path}: found {file_content}; allowed: {_MOST_BYTES / 1e6:g} MB")
    write_text(path, json_text)


def _describe_origin(profile: Map | TableProfile) -> dict[str, Any]:
    """Return the keys of `ProfileOrigin` that say whether alpha was measured or estimated, and from how many pushes.

    ``kind``: ``table`` or ``map``; of a map also ``pushes``, ``known_media`` and ``belongs``, None for a single push.
    """
    if isinstance(profile, TableProfile):
        return {"kind": "table"}
    belongs = None if math.isnan(profile.belongs) else profile.belongs
    return {
        "kind": "map",
        "pushes": profile.pushes,
        "known_media": profile.known_media,
        "belongs": belongs,
    }


def _list_directions(table: TableProfile, pushed: FloatArray) -> dict[str, Any]:
    """Return alpha and draws of a table, each direction once, and the pushes if they are not just these directions.

    `pushed`: shape (6, n), rows as in `TableProfile.pushed`. Returns the sections ``directions``, ``errors`` (where the
    table has draws) and ``pushes`` of a file, each a dict of lists.
    """
    beta, gamma = (axis.ravel() for axis in np.meshgrid(table.beta, table.gamma, indexing="ij"))
    cells, listed = list_once(beta, gamma)

    def alpha_at_nodes(of: TableProfile) -> FloatArray:
        """Return alpha_z and alpha_x in the listed directions, shape (2, ..., listed)."""
        return np.stack(listed.complete(*of.parameters))

    rows = np.concatenate([np.degrees([beta[cells], gamma[cells]]), alpha_at_nodes(table)])
    sections: dict[str, Any] = {
        "directions": _list_columns(("beta_deg", "gamma_deg", *_ALPHA), rows)
    }
    with_alpha = rows[:, np.isfinite(rows[2:]).any(axis=0)]
    if with_alpha.shape != pushed[:4].shape or not np.allclose(
        with_alpha, pushed[:4], rtol=1e-9, atol=1e-12, equal_nan=True
    ):
        sections["pushes"] = _list_columns(_PUSH_COLUMNS, pushed)
    if isinstance(table.spread, TableProfile):
        draws = alpha_at_nodes(table.spread)
        if not np.isnan(draws).all():
            draw_rows = [_round(draw, _DIGITS_OF_DRAWS) for draw in draws.reshape(-1, cells.size)]
            half = len(draw_rows) // 2  # first alpha_z of all draws, then alpha_x
            by_component = (draw_rows[:half], draw_rows[half:])
            sections["errors"] = dict(zip(_DRAW_COLUMNS, by_component, strict=True))
    return sections


def _list_columns(names: Sequence[str], rows: FloatArray) -> dict[str, list[float | None]]:
    """Return the rows of an array as lists under their names, rounded to the digits of the file."""
    digits = [_DIGITS_OF_ANGLES if name.endswith("_deg") else _DIGITS for name in names]
    return {n: _round(row, d) for n, row, d in zip(names, rows, digits, strict=True)}


def _round(values: FloatArray, digits: int) -> list[float | None]:
    """Return numbers for JSON with so many significant digits: NaN becomes None, and -0 becomes 0."""
    return [
        None if math.isnan(number) else float(f"{number:.{digits}g}") + 0.0 for number in values
    ]


def _digest(content: ProfileFile) -> str:
    """Return the digest of all content but the texts on the medium, which a user may change."""
    return digest_of(content.model_dump(exclude={"medium", "digest"}))


def _format_json(value: Any, depth: int = 1) -> str:
    """Format a value as JSON with one line for each key and each draw, so that files can be compared by lines.

    `depth`: spaces before the lines.
    """
    before, after = "\n" + " " * depth, "\n" + " " * (depth - 1)
    if isinstance(value, dict) and value:
        lines = (
            f"{json.dumps(name)}: {_format_json(member, depth + 1)}"
            for name, member in value.items()
        )
        return "{" + before + f",{before}".join(lines) + after + "}"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[" + before + f",{before}".join(map(_format_json, value)) + after + "]"
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ": "))


# --- The golden value.


def _misread_alpha(profile: Profile, beta_deg: float, gamma_deg: float) -> FloatArray:
    """Return alpha_z and alpha_x in a direction by ten wrong conventions (signs, axes, angles), shape (10, 2)."""

    def alpha_at(beta: float, gamma: float) -> FloatArray:
        """Return alpha_z and alpha_x at angles in degrees."""
        return np.array(profile.alpha(np.radians(beta), np.radians(gamma)))

    z, x = alpha_at(beta_deg, gamma_deg)
    wrong_signs = [(-z, x), (z, -x), (-z, -x), (x, z)]
    wrong_angles = [
        alpha_at(-beta_deg, gamma_deg),
        alpha_at(beta_deg, -gamma_deg),
        alpha_at(-beta_deg, -gamma_deg),
        alpha_at(gamma_deg, beta_deg),
        alpha_at(beta_deg, 180 - gamma_deg),
        alpha_at(90 - beta_deg, gamma_deg),
    ]
    return np.array([*wrong_signs, *wrong_angles])


def _choose_golden(table: TableProfile) -> dict[str, float | None]:
    """Return angles and alpha, by their keys in the file, of the golden direction.

    Of some directions between the lines it is that in which the least change of alpha by a wrong convention is
    greatest. Raises InputError where alpha is known in none of them.
    """
    tried = []
    for beta in (10, 20, 40, 50, -10, -20, -40, -50):
        for gamma in (25, 40, 50, 80, -25, -40, -50, -80):
            z, x = table.alpha(np.radians(beta), np.radians(gamma))
            change = np.abs(_misread_alpha(table, beta, gamma) - [z, x]).max(axis=1)
            if np.isfinite(z + x):
                tried.append((float(np.nanmin(change)), beta, gamma, float(z), float(x)))
    if not tried:
        raise InputError(
            f"{table.name}: alpha is known in too few directions for a table; allowed: a table whose cells have "
            "neighbours; the map needs one push only"
        )
    # by the change alone: of equal trials `max` returns the first
    _, *best = max(tried, key=lambda trial: trial[0])
    rounded = _round(np.array(best), _DIGITS)
    return dict(zip(("beta_deg", "gamma_deg", *_ALPHA), rounded, strict=True))


# --- Reading.


def read_profile(path: str | Path) -> TableProfile:
    """Read a stress profile from its file, and check schema, directions, golden value and digest.

    Parameters
    ----------
    path : str or Path
        A file that `write_profile` or ``rftfit export`` wrote.

    Returns
    -------
    TableProfile
        It has the depths of the file and, if the file has errors, the draws for intervals. `doubt` is the verdict on the
        data, where the file states one.

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
    table, validity = table_of(content), content.validity
    high = validity.depth_to_cm
    table.window = (validity.depth_from_cm or 0.0, math.inf if high is None else high)
    model_error = content.force_errors.model_error
    table.model_error = math.nan if model_error is None else model_error
    table.bed_spread = content.force_errors.bed_spread
    table.stated = {
        "name": content.medium.name,
        "title": content.medium.title,
        "notes": content.medium.notes,
        "marks": validity.marks,
        "made_from": content.origin.made_from | {Path(path).name: sha256_of(Path(path))},
    }
    if content.pushes is not None:
        table.pushed = _array(content.pushes, _PUSH_COLUMNS)
    return table


def pushes_in_profile(path: Path) -> pd.DataFrame:
    """Return the pushes in a profile file as the table that `rftfit.estimate_map` needs, one row a push."""
    names = ("beta_deg", "gamma_deg", *_ALPHA, "alpha_z_se_N_per_cm3", "alpha_x_se_N_per_cm3")
    return pd.DataFrame(dict(zip(names, read_profile(path).pushed, strict=True)))


def table_of(content: ProfileFile) -> TableProfile:
    """Make the interpolated table of the directions in a file, with the draws of the file as its spread.

    Raises ValueError where the directions are no whole grid.
    """
    beta_deg, gamma_deg, *alpha = _array(content.directions, ("beta_deg", "gamma_deg", *_ALPHA))
    angles_rad = np.radians(beta_deg), np.radians(gamma_deg)
    name = content.origin.profile or "profile from a file"
    why = f"{name}: null there" if np.isnan(alpha).any() else ""
    why = content.validity.without_number or why
    table = TableProfile.of_directions(*angles_rad, (alpha[0], alpha[1]), name, why)
    if content.errors is not None:
        draws_z, draws_x = _array(content.errors, _DRAW_COLUMNS)
        table.spread = TableProfile.of_directions(*angles_rad, (draws_z, draws_x))
    return table


def _array(section: object, names: tuple[str, ...]) -> FloatArray:
    """Return lists of a section of the file, by their keys, as the rows of an array; null becomes NaN."""
    return np.array([getattr(section, name) for name in names], dtype=float)


def read_content(path: Path) -> ProfileFile:
    """Read and check the whole content of a profile file; raises CampaignError with all its problems."""
    file = ModelFile[ProfileFile](str(path))
    _parse(read_text(path, file.name, "profile", _MOST_BYTES), file)
    return _check_content(file)


def _parse(text: str, file: ModelFile[ProfileFile]) -> None:
    """Parse JSON into ``file.data``, changed in place; errors become problems of the file."""

    def parse_section(items: list[tuple[str, Any]]) -> dict[str, Any]:
        """Return a section as a dict; a key that is there twice is a problem, where JSON would take the last one."""
        if len(items) > _MOST_KEYS:
            file.note((), "too-large", f"{len(items)} keys", f"at most {_MOST_KEYS} in a section")
            return {}
        for name, count in Counter(name for name, _ in items).items():
            if count > 1:
                place = Place(file.name, key=name)
                allowed = f"each key once; this one is there {count} times"
                file.problems.append(Problem("profile.duplicate-key", place, name, allowed))
        return dict(items)

    try:
        file.data = json.loads(text, object_pairs_hook=parse_section)
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


def _check_content(file: ModelFile[ProfileFile]) -> ProfileFile:
    """Return the checked content of ``file.data``; raise CampaignError with all problems, by schema and further rules.

    A rule that needs what an earlier one checks is left out where that one finds a problem.
    """
    if file.data is not None:
        check_model(file, ProfileFile)
    content = file.model
    if content is not None:
        _check_lengths(file, content)
        if not file.problems:
            _check_directions(file, content)
        if not file.problems:
            _check_numbers(file, content)
        if content.digest and content.digest != (digest := _digest(content)):
            allowed = f"{content.digest}, as written: numbers were changed since; leave the key out to use them"
            file.note(("digest",), "digest", digest, allowed)
    if content is None or file.problems:
        raise CampaignError(file.problems)
    return content


def _check_lengths(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    """Note lists of the content whose lengths differ from the number of directions, of pushes or of draws.

    Here and below: a note is a problem that is added to `file`.
    """
    for section in ("directions", "pushes"):
        columns = dict(getattr(content, section) or {})
        for name, column in columns.items():
            if len(column) != (length := len(columns["beta_deg"])):
                allowed = f"{length} entries, as beta_deg has"
                file.note((section, name), "length", f"{len(column)} entries", allowed)
    if content.errors is None:
        return
    direction_count = len(content.directions.beta_deg)
    draw_count = len(content.errors.draws_z_N_per_cm3)
    for name, draws in content.errors:
        if len(draws) != draw_count:
            file.note(("errors", name), "length", f"{len(draws)} rows", f"{draw_count} rows")
        for index, draw in enumerate(draws):
            if len(draw) != direction_count:
                allowed = f"{direction_count} entries, one a direction"
                file.note(("errors", name, index), "length", f"{len(draw)} entries", allowed)
                break


def _check_directions(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    """Note a direction that is listed twice, itself or as its mirror image, or else directions that are no whole grid."""
    beta, gamma = np.radians(_array(content.directions, ("beta_deg", "gamma_deg")))
    listed, _ = list_once(beta, gamma)
    repeated = np.setdiff1d(np.arange(beta.size), listed)
    if repeated.size:
        index = int(repeated[0])
        direction_deg = f"({np.degrees(beta[index]):g}, {np.degrees(gamma[index]):g})"
        allowed = "directions once, without mirror images; this one was listed before"
        file.note(("directions", "gamma_deg", index), "twice", direction_deg, allowed)
        return
    try:
        table_of(content)
    except ValueError:
        allowed = "directions that, with their mirror images, are a whole grid of beta from -90 and gamma from -180"
        file.note(("directions",), "grid", f"{beta.size} directions", allowed)


def _check_numbers(file: ModelFile[ProfileFile], content: ProfileFile) -> None:
    """Note draws that lie on one side of alpha, as of another table, and alpha that differs from the golden value."""
    golden, table = content.golden, table_of(content)
    largest = float(np.nanmax(np.abs([table.alpha_z, table.alpha_x]), initial=1e-300))
    tolerance = _TOLERANCE * largest
    if content.errors is not None:
        alpha, draws = _array(content.directions, _ALPHA), _array(content.errors, _DRAW_COLUMNS)
        # draws: shape (2, draws, directions)
        least, most = draws.min(axis=1), draws.max(axis=1)
        has_draw = ~np.isnan(draws).all(axis=1)
        is_between = (least <= alpha + tolerance) & (alpha <= most + tolerance)
        # the first number alone: one wrong column makes thousands
        for component, index in np.argwhere(has_draw & ~is_between)[:1]:
            found = f"draws from {least[component, index]:.6g} to {most[component, index]:.6g}"
            allowed = f"numbers on both sides of {_ALPHA[component]}, {alpha[component, index]:.6g}"
            key_of_draw = "errors", _DRAW_COLUMNS[component], 0, int(index)
            file.note(key_of_draw, "draws", found, allowed)
    angles_deg = golden.beta_deg, golden.gamma_deg
    table_alpha = np.array(table.alpha(*np.radians(angles_deg)))
    golden_alpha = _array(golden, _ALPHA)
    for component in np.flatnonzero(~(np.abs(table_alpha - golden_alpha) <= tolerance)):
        direction_deg = f"({angles_deg[0]:g}, {angles_deg[1]:g})"
        allowed = f"{golden_alpha[component]:.6g}, the golden value {_ALPHA[component]} at {direction_deg} degrees"
        found = f"{table_alpha[component]:.6g}"
        file.note(("directions", _ALPHA[component]), "golden", found, allowed)


def collect_pushes(
    pushes: Path | None, profile_file: Path | None = None
) -> tuple[str, pd.DataFrame, list[str]]:
    """Return the names of the files as words, the pushes of a table and of a profile file together, and warnings.

    So a new push joins those of a profile from another place. None: no such file; one of them has to be given.
    """
    tables, warnings = [], []
    if pushes is not None:
        pushes_of_table, problems = pushes_in(pushes)
        tables.append(pushes_of_table)
        warnings = in_lines(problems)
    if profile_file is not None:
        tables.append(pushes_in_profile(profile_file))
    names = [path.name for path in (pushes, profile_file) if path is not None]
    return " and ".join(names), pd.concat(tables, ignore_index=True), warnings


def describe_profile(path: Path) -> str:
    """Describe a profile file that was written, in lines for people: content, golden value, and the next command."""
    content, profile = read_content(path), read_profile(path)
    listed, golden = content.directions, content.golden
    direction_rad = math.radians(golden.beta_deg), math.radians(golden.gamma_deg)
    rows = [["(beta, gamma)", f"({golden.beta_deg:g}, {golden.gamma_deg:g}) degrees"]]
    draws = profile.spread
    for index, (component, alpha) in enumerate(zip("zx", _array(golden, _ALPHA), strict=True)):
        error = ""
        if isinstance(draws, Profile):
            error = f" (standard error {draws.alpha(*direction_rad)[index].std(ddof=1):.4g})"
        rows.append([f"alpha_{component}", f"{alpha:.6g} N/cm^3{error}"])
    directions_known = sum(value is not None for value in listed.alpha_z_N_per_cm3)
    pushes = profile.pushed.shape[1]
    lines = [
        f"Profile: {content.origin.profile}",
        f"Directions: {len(listed.beta_deg)}, {directions_known} with a number, {pushes} pushed",
    ]
    if content.validity.without_number:
        lines.append(f"Without a number: {content.validity.without_number[:300]}")
    lines += [
        f"\nGolden value, for tests of signs:\n{format_table(['', 'value'], rows)}",
        f"\nWritten: {path} ({megabytes(path.stat().st_size)})",
        f"Next: rftfit predict --profile-file {path} --leg c_leg, or of a body of your own --mesh FILE --unit mm --press 3",
    ]
    return "\n".join(lines)
