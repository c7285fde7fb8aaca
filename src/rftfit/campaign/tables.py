"""Campaigns without logs: a table of stress against depth, or a finished table of alpha."""

from __future__ import annotations

import csv
import io
import math
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from rftfit.campaign.config import UNIT_AREA
from rftfit.campaign.files import decode, read_bytes
from rftfit.campaign.problems import CampaignError, Problem, listed
from rftfit.campaign.rows import MAX_BYTES, Column, DraftRow, Schema, read_rows, sheet_rows
from rftfit.campaign.sheet import Run

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    import pandas as pd

    from rftfit.campaign.config import Table

_ANGLES = tuple(
    Column(f"{name}_deg", "number", meaning, low=-90, high=90, unit="degrees", also=(name,))
    for name, meaning in (
        ("beta", "attack angle of the plate"),
        ("gamma", "intrusion angle of its motion: 90 straight down, -90 straight up"),
    )
)
_MEDIUM = Column("medium", "name", "key of the config's media", needed=False)


def _alpha(component: str) -> tuple[Column, Column]:
    name, error = f"alpha_{component}", f"se_{component}"
    return (
        Column(f"{name}_N_per_cm3", "number", "stress per depth", unit="N/cm^3", also=(name,)),
        Column(error, "number", f"standard error of {name}", needed=False, low=0, unit="N/cm^3",
               also=(f"{name}_se_N_per_cm3", f"{error}_N_per_cm3")),
    )  # fmt: skip


ALPHA = Schema(
    "alpha-table",
    (*_ANGLES, *_alpha("z"), *_alpha("x"),
     Column("n", "number", "number of runs behind it", needed=False, low=1, also=("n_runs",)),
     _MEDIUM),
    others=True,
)  # fmt: skip
STRESS = Schema(
    "stress-table",
    (*_ANGLES,
     Column("depth_cm", "number", "depth of the plate's centre, growing downward", unit="cm",
            also=("depth",)),
     *(Column(f"stress_{c}_N_per_cm2", "number", "force of the medium over the plate's area",
              unit="N/cm^2", also=(f"stress_{c}",)) for c in "zx"),
     Column("run_id", "name", "rows of one push", needed=False), _MEDIUM),
    others=True,
)  # fmt: skip
"""The formats of both tables; alpha and stress are positive upward and toward +x."""

LENGTHS = {"cm": 1.0, "mm": 0.1, "m": 100.0, "in": 2.54}
STRESSES = {"N/cm^2": 1.0, "Pa": 1e-4, "kPa": 0.1, "MPa": 100.0, "psi": 0.6894757293168361}
SLOPES = {"N/cm^3": 1.0, "N/m^3": 1e-6, "Pa/m": 1e-6, "kPa/m": 1e-3, "MPa/m": 1.0, "kPa/cm": 0.1}
SAME_DEPTH_CM = 0.1


@dataclass(frozen=True)
class Push:
    """Rows of the table that belong to one run, in their order.

    `rows`: Numbers by column: depth and stress, or alpha, error and number of runs; cm, N.
    """

    run: Run
    rows: tuple[dict[str, float], ...]


def read_pushes(
    path: Path, file: str, table: Table, media: Iterable[str], within: str
) -> tuple[list[Push], list[Problem]]:
    """Read the table of a campaign, long or, of alpha, in the blocks of Table S5.

    `file`: Its name for messages; `within`: relative to the raw folder. Returns the runs that it
    stands for, by run_id, and everything that is wrong with it.
    """
    known = tuple(media)
    schema = replace(_named(STRESS if table.holds == "stress" else ALPHA, table), file=file)
    problems: list[Problem] = []
    drafts = _blocks(path, schema, known, problems) if table.holds == "alpha" else None
    if drafts is None:
        drafts, problems = read_rows(path, schema, file)
    scale = {
        "beta_deg": table.angle_scale, "gamma_deg": table.angle_scale, "depth_cm": LENGTHS[table.depth_unit],
        **dict.fromkeys(("stress_z_N_per_cm2", "stress_x_N_per_cm2"), STRESSES[table.stress_unit]),
        **dict.fromkeys(("alpha_z_N_per_cm3", "alpha_x_N_per_cm3", "se_z", "se_x"),
                        SLOPES[table.alpha_unit]),
    }  # fmt: skip
    groups: dict[tuple[str, str], list[tuple[DraftRow, dict[str, float]]]] = {}
    for draft in drafts:
        medium = draft.text.get("medium", "") or (known[0] if len(known) == 1 else "")
        if "medium" not in draft.bad and medium not in known:
            allowed = f"one of {listed(known)} (media in the config)"
            draft.note("medium", "unknown-medium", draft.text.get("medium") or None, allowed)
        numbers = {name: value * scale.get(name, 1.0) for name, value in draft.number.items()}
        _check_numbers(draft, numbers)
        if not draft.bad:
            groups.setdefault((medium, _name(draft, numbers, table)), []).append((draft, numbers))
    pushes = []
    for (medium, name), members in groups.items():
        first, numbers = members[0]
        for draft, other in members[1:]:
            if any(abs(other[a] - numbers[a]) > 1e-6 for a in ("beta_deg", "gamma_deg")):
                allowed = (
                    f"the angles of row {first.row}: all rows of the run {name} have one direction"
                )
                draft.note("run_id", "two-directions", name, allowed)
        pushes.append(_push(medium, name, first.row, [own for _, own in members], within))
    ids = {push.run.run_id for push in pushes}
    if len(ids) < len(pushes):  # one name in two media
        pushes = [
            replace(one, run=replace(one.run, run_id=f"{one.run.medium}_{one.run.run_id}"))
            for one in pushes
        ]
    return sorted(pushes, key=lambda one: one.run.run_id), problems


def pushes_in(path: Path) -> pd.DataFrame:
    """Read a table of alpha of one medium, as `rftfit.estimate_map` takes it.

    alpha_x may be missing: a penetrometer measures the force along its way only. Raises CampaignError
    with everything that is wrong.
    """
    import pandas as pd

    columns = [
        replace(column, needed=False) if column.name.startswith("alpha_x") else column
        for column in ALPHA.columns
        if column.name != "medium"
    ]
    drafts, problems = read_rows(path, replace(ALPHA, columns=tuple(columns)), str(path))
    rows = []
    for draft in drafts:
        _check_numbers(draft, draft.number)
        rows.append(draft.number)
    if problems:
        raise CampaignError(problems)
    names = {"se_z": "alpha_z_se_N_per_cm3", "se_x": "alpha_x_se_N_per_cm3"}
    table = pd.DataFrame(rows).rename(columns=names)
    lacking = {f"alpha_x{end}_N_per_cm3" for end in ("", "_se")} | {"alpha_z_se_N_per_cm3"}
    return table.assign(**dict.fromkeys(sorted(lacking - {*table}), math.nan))


def _named(schema: Schema, table: Table) -> Schema:
    """The schema with the names that the file has; angles in radians have other limits."""
    high = 90 / table.angle_scale
    given: dict[str, str] = {str(ours): theirs for ours, theirs in table.columns.items()}
    columns = []
    for column in schema.columns:
        changes: dict[str, Any] = {}
        if column.name in given:
            changes["also"] = (*column.also, given[column.name])
        if column.name in ("beta_deg", "gamma_deg"):
            changes |= {"low": -high, "high": high, "unit": table.angle_unit}
        columns.append(replace(column, **changes))
    return replace(schema, columns=tuple(columns))


def _check_numbers(draft: DraftRow, numbers: dict[str, float]) -> None:
    """Note what the columns' own ranges do not hold: of blocks, also the angles."""
    for name in ("beta_deg", "gamma_deg"):
        if name in numbers and not abs(numbers[name]) <= 90 + 1e-6:
            draft.note(name, "out-of-range", f"{numbers[name]:g}", "-90 to 90 degrees")
    if (depth := numbers.get("depth_cm")) is not None and depth < 0:
        draft.note("depth_cm", "negative-depth", draft.text["depth_cm"],
                   "0 or more: depth grows downward from the free surface")  # fmt: skip
    count = numbers.get("n")
    if count is not None and count != int(count):
        draft.note("n", "not-whole", draft.text["n"], "a whole number of runs")


def _name(draft: DraftRow, numbers: dict[str, float], table: Table) -> str:
    given = draft.text.get("run_id", "")
    if given or table.holds == "alpha":
        return given or f"row{draft.row:05d}"
    return _of_direction(numbers["beta_deg"], numbers["gamma_deg"])


def _of_direction(beta: float, gamma: float) -> str:
    return f"b{beta:g}_g{gamma:g}".replace("-", "m")


def _push(medium: str, name: str, row: int, rows: list[dict[str, float]], file: str) -> Push:
    beta, gamma = (rows[0][f"{angle}_deg"] + 0.0 for angle in ("beta", "gamma"))
    depths = [one.get("depth_cm", math.nan) for one in rows]
    level = gamma == 0 and max(depths) - min(depths) <= SAME_DEPTH_CM
    direction = "extraction" if gamma < 0 else "horizontal" if level else "intrusion"
    run = Run(
        run_id=name, kind="plate", medium=medium, intruder=UNIT_AREA, direction=direction, beta_deg=beta,
        gamma_deg=gamma, depth_cm=depths[0] if level else math.nan, force_log=file, motion_log=file,
        tare_run="", tare_shared=False, surface_z_mm=None, excluded=False, reason="", note="", row=row,
    )  # fmt: skip
    return Push(run, tuple(rows))


# --- the layout of Table S5: a block for each component, rows by beta, columns by gamma

_COMPONENT = re.compile(
    r"\W*(?:measured\s+)?(?:alpha|\N{GREEK SMALL LETTER ALPHA})\W*_?\W*([zx])\b[^a-z]{0,4}.{0,24}",
    re.IGNORECASE,
)
"""Head of a block, for example ``alpha_z (N/cm^3)``."""


def _blocks(
    path: Path, schema: Schema, media: tuple[str, ...], problems: list[Problem]
) -> list[DraftRow] | None:
    """Rows of a table in blocks; None where the file is a long table.

    A block has a head that names alpha_z or alpha_x, in the corner or above it, gamma along its first
    row and beta down its first column. A sheet of a workbook, or a line with the key of a medium alone,
    says whose blocks follow.
    """
    found: dict[tuple[str, float, float], DraftRow] = {}
    try:
        grids = list(_grids(path, schema))
    except CampaignError:
        return None  # the reader of long tables says why
    for sheet, rows in grids:
        medium = next((one for one in media if one == key_of(sheet)), "")
        component: str = ""
        gammas: dict[int, float] = {}
        width = max((len(cells) for _, cells in rows), default=0)
        for number, cells in rows:
            texts = [cell.strip() for cell in cells] + [""] * (width - len(cells))
            head, rest = texts[0], {i: _float(text) for i, text in enumerate(texts) if i > 0}
            if (lone := key_of("".join(texts))) in media:
                medium, component, gammas = lone, "", {}
            elif named := _COMPONENT.fullmatch(head):
                component, gammas = named[1].lower(), {}
            elif head and _float(head) is None and not any(v is not None for v in rest.values()):
                component, gammas = "", {}
            if component and not gammas and _float(head) is None:
                gammas = {i: value for i, value in rest.items() if value is not None}
                gammas = gammas if len(gammas) > 1 else {}
            elif component and gammas and (beta := _float(head)) is not None:
                name = f"alpha_{component}_N_per_cm3"
                for i, gamma in gammas.items():
                    key, text, value = (medium, beta, gamma), texts[i], rest[i]
                    draft = found.setdefault(key, DraftRow(schema, number, problems))
                    if name in draft.number:
                        allowed = f"each direction once; row {draft.row} has it"
                        draft.note(name, "twice", text, allowed)
                    draft.text |= {"medium": medium, "run_id": _of_direction(beta, gamma)}
                    draft.number |= {"beta_deg": beta, "gamma_deg": gamma}
                    if value is not None:
                        draft.number[name] = value
                    elif text:
                        allowed = "a number, or nothing where none was measured"
                        draft.note(name, "not-a-number", text, allowed)
    both = {"alpha_z_N_per_cm3", "alpha_x_N_per_cm3"}
    if not any(both <= {*one.number} for one in found.values()):
        return None
    for draft in found.values():
        for name in sorted(both - {*draft.number} - draft.bad):
            if both & {*draft.number}:  # a direction without either was not measured
                allowed = f"both components of {draft.text['run_id']}"
                draft.note(name, "one-component", None, allowed)
    return [one for one in found.values() if both & {*one.number} or one.bad]


def key_of(name: str) -> str:
    """A key of the config from the name of a sheet, a file or a medium."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name.strip()).strip("_.-")[:64]


def media_of_table(path: Path, holds: str) -> list[tuple[str, str]]:
    """Keys and titles of the media that a table names, in its order; of the file where it names none."""
    schema = replace(STRESS if holds == "stress" else ALPHA, file=path.name)
    found: dict[str, str] = {}
    grids = list(_grids(path, schema))
    for sheet, rows in grids:
        heads = [row[0].strip() if row else "" for _, row in rows]
        blocks = holds == "alpha" and any(_COMPONENT.fullmatch(head) for head in heads)
        if holds == "alpha" and len(grids) > 1 and not blocks:
            continue
        if blocks:
            alone = [row[0] for _, row in rows if len([c for c in row if c.strip()]) == 1]
            named = [one for one in alone if not _COMPONENT.fullmatch(one) and _float(one) is None]
            if len(grids) > 1 or not named:
                named = [sheet]
            found |= {key_of(one): one.strip() for one in named}
        elif rows:
            header = [cell.strip().lower() for cell in rows[0][1]]
            if "medium" in header:
                at = header.index("medium")
                names = [row[at] for _, row in rows[1:] if len(row) > at and row[at].strip()]
                found |= {key_of(one): one.strip() for one in dict.fromkeys(names)}
            break
    found.pop("", None)
    return list(found.items()) or [(key_of(path.stem) or "medium", path.stem)]


def _grids(path: Path, schema: Schema) -> Iterator[tuple[str, list[tuple[int, list[str]]]]]:
    """Name of each sheet of a table, and its rows that are not blank, by number."""
    data = read_bytes(path, schema.file, schema.area, MAX_BYTES)
    if data.startswith(b"PK\x03\x04"):
        yield from sheet_rows(data, schema)
        return
    text = decode(data, schema.file, schema.area)
    delimiter = max(",;\t", key=text.count)
    lines = csv.reader(io.StringIO(text), delimiter=delimiter)
    try:
        yield path.stem, [(number, row) for number, row in enumerate(lines, start=1) if any(row)]
    except csv.Error:
        return


def _float(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
