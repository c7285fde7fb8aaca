"""Checks of a medium: whether its numbers can be believed, and if not, why.

``docs/theory/checks.md`` says what each check rests on and where its threshold is from.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pandas as pd

from rftfit.campaign.config import UNIT_AREA, CheckName, Config, Medium
from rftfit.campaign.load import Campaign
from rftfit.campaign.sheet import Run
from rftfit.conventions import FloatArray
from rftfit.measure.alpha import alpha_columns, cell_at, column, rows_at
from rftfit.measure.fits import LEAST_WORK, is_symmetric
from rftfit.measure.flags import (
    FLAGS,
    MARKS,
    Remark,
    flag_columns,
    flagged_with,
    flags_of,
    reason_columns,
    remark,
)
from rftfit.measure.ledger import RowStatus
from rftfit.measure.samples import split_runs

Tables = Mapping[str, pd.DataFrame]

PASSED, FAILED, ACCEPTED, NOT_CHECKED = "passed", "failed", "accepted", "not checked"
UNUSABLE, DOUBTFUL = "unusable", "doubtful"

CHECKS: dict[str, tuple[str, str]] = {
    "channels": (UNUSABLE, "no channel is dead, frozen, cut off, reversed or another's"),
    "rods": (UNUSABLE, "rods feel less than plates"),
    "work": (UNUSABLE, "the medium takes energy"),
    "symmetry": (
        UNUSABLE,
        "plates at beta and -beta straight down feel opposite horizontal forces",
    ),
    "up_down": (DOUBTFUL, "down is harder than up"),
    "drift": (DOUBTFUL, "the zero of the force stays where it is"),
    "surface": (DOUBTFUL, "stress begins at the surface, in all runs alike"),
    "linearity": (DOUBTFUL, "stress is proportional to depth"),
    "steadiness": (DOUBTFUL, "horizontal runs are steady"),
    "repeats": (DOUBTFUL, "each run is as the other runs say"),
    "same_logs": (UNUSABLE, "no log is there twice"),
    "size": (UNUSABLE, "alpha is as large as expected"),
}
"""What becomes of a medium that fails a check, and what the check asks, in few words."""
assert tuple(CHECKS) == get_args(CheckName)

_STROKES: tuple[CheckName, ...] = ("channels", "rods", "drift")
_TABLE: tuple[CheckName, ...] = (*_STROKES, "work")
_AFTER: dict[CheckName, tuple[CheckName, ...]] = {
    "rods": ("channels",), "drift": ("channels", "rods"), "work": _STROKES, "symmetry": _TABLE, "up_down": _TABLE,
    "surface": _STROKES, "linearity": (*_STROKES, "surface"), "steadiness": _STROKES,
    "repeats": (*_TABLE, "symmetry", "surface"), "size": _STROKES,
}  # fmt: skip
"""What must be put right before a check tells anything: its failure would be another name of the first."""

NO_SCALE = (
    "The scale of the force was not checked: a wrong unit passes unless expected_alpha is stated."
)

COLUMNS = ["medium", "check", "verdict", "effect", "found", "allowed", "sentence"]

_SIGMAS = 3.0
_SIGMAS_PUSH = 2.0
"""Of one cell that is known beforehand: no medium pulls a level plate down that is pushed straight down."""
_CELLS = 3
_TURN, _MOST_TURN_DEG, _ALIKE = 0.04, 10.0, 0.05
"""Beds are never quite alike to both sides: the paper's own tables look turned by up to 1.4 deg."""
_ALPHA_FROM, _ALPHA_TO = 0.01, 10.0
_CLIPPED, _FROZEN, _LOGS, _SIDEWAYS = 0.03, 0.5, 3, 2.0
_SILENT, _MUST_FEEL, _CLEAR = 0.01, 0.03, 0.12
"""Relative to alpha_z(0, 90): less is silence; all published media feel more than the second in some directions;
above the third no ordinary turn of the mount changes a sign."""
_MOST, _GAIN, _FAINT = 0.8, 1.5, 0.1
_DRIFT, _DRIFT_ALONE = 0.015, 0.15
_TREND = 0.10
_ROD_ALONE, _ROD_CLEAR, _ROD_FORCE = 1.5, 3.0, 0.1
"""A rod over its plate and rod: in a run that is clear by force, as a share of the medium's median; in any run."""
_FEW_RUNS = 3
_SURE = 3.7
"""Standard errors of one of several numbers that are looked at together."""
_SURFACE_CM, _LAG_S = 0.05, 0.03
"""Ordinary errors, that no verdict rests on: a bed levelled by a blade; filter of an amplifier."""
_CURVED = 0.05
_STEP_CM, _STEP, _ENDS = 0.22, 5.5, 300
"""A stretch of the sheet with another surface: least difference, in standard errors of the best of all stretches;
at most so many places where one begins or ends."""
_MODES, _LEAST_SPREAD, _HEAP = 8.0, 0.03, 0.2
"""Two heaps: least difference in spreads; least spread, cm or ratio; least share of the runs."""


@dataclass(frozen=True)
class Check:
    """What one check says about one medium: `found` and `allowed` in words, the likely cause in `sentence`.

    `runs`: what is wrong with single runs, for the flags of their cells.
    """

    check: CheckName
    verdict: str
    found: str = ""
    allowed: str = ""
    sentence: str = ""
    runs: tuple[Remark, ...] = ()

    @property
    def effect(self) -> str:
        """What follows for the medium."""
        return CHECKS[self.check][0] if self.verdict == FAILED else ""


def _judged(
    check: CheckName, good: bool, found: str, allowed: str, sentence: str, *runs: Remark
) -> Check:
    if good:
        return Check(check, PASSED, found, allowed, runs=runs)
    return Check(check, FAILED, found, allowed, sentence, runs)


def check_medium(
    campaign: Campaign, medium: str, tables: Tables, copies: Mapping[str, Collection[str]]
) -> list[Check]:
    """Do every check on one medium; what the config accepts is not failed.

    `tables`: ``runs``, ``tares``, ``fits``, ``peers``, ``alpha``, ``tared`` and ``windows`` of the medium.
    `copies`: Of `copies_of`.
    """
    config, alpha, peers = campaign.config, tables["alpha"], tables["peers"]
    sheet = {run.run_id: run for run in campaign.runs_of(medium)}
    rods = check_rods(tables["tares"], sheet)
    exchanged = {one.run_id for one in rods.runs}
    where = "the columns of the table" if config.table else "transducer.axes"
    cells = _Cells.of(alpha)
    other = None if cells.resists else _axes(cells)
    drift = check_drift(sheet, tables["runs"], tables["tares"])
    # what other axes would mend, or a drift of all runs, also looks like channels that feel nothing
    explained = other is not None or len(drift.runs) == len(tables["fits"])
    runs = tables["runs"]
    against = against_known(config, sheet, runs, tables["fits"], peers, exchanged, explained)
    found = [
        check_channels(config, sheet, runs, against),
        rods,
        drift,
        *check_axes(cells, other, alpha, where, sheet),
        *check_surface(config, medium, tables, sheet),
        check_steadiness(tables),
        check_repeats(peers, sheet),
        check_logs(sheet, copies),
        check_size(alpha, config.media[medium].expected_alpha),
    ]
    accepted = config.media[medium].accept
    done: dict[CheckName, Check] = {}
    for one in found:
        done[one.check] = one
        first = [name for name in _AFTER.get(one.check, ()) if name in done and done[name].effect]
        if first and one.verdict != NOT_CHECKED:
            # cells keep the flags of single runs
            told = f"not before the check {first[0]} passes"
            done[one.check] = Check(one.check, NOT_CHECKED, told, runs=one.runs)
        elif one.verdict == FAILED and (why := accepted.get(one.check)):
            said = f"{one.sentence} Accepted: {why}"
            done[one.check] = replace(one, verdict=ACCEPTED, sentence=said)
    return [done[name] for name in get_args(CheckName)]


def rows_of(runs: Iterable[str], sheet: Mapping[str, Run]) -> str:
    """Rows of the run sheet of some runs, in few words: ``rows 2 to 34 and 40``; rods between them do not count."""
    wanted = set(runs)
    spans: list[list[int]] = []
    before = False
    for run in sorted(sheet.values(), key=lambda run: run.row):
        if run.run_id in wanted:
            spans = spans if before else [*spans, [run.row, run.row]]
            spans[-1][1] = run.row
        before = run.run_id in wanted or (before and run.kind not in ("plate", "leg"))
    words = [f"{first} to {last}" if last > first else f"{first}" for first, last in spans]
    if len(words) > _SPANS:
        words = [*words[: _SPANS - 1], f"others to {spans[-1][1]}"]
    said = " and ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))
    return f"{'rows' if len(wanted) > 1 else 'row'} {said} of the run sheet"


_SPANS = 6


def marks_of(checks: pd.DataFrame, media: Mapping[str, Medium]) -> dict[str, list[Remark]]:
    """What stands wherever a medium appears that fails a check, by medium; `checks`: the table."""
    found = {}
    for medium, rows in checks.groupby("medium", sort=False):
        marks = []
        for effect in (UNUSABLE, DOUBTFUL):
            failed = ", ".join(rows.loc[rows["effect"] == effect, "check"])
            marks += [remark(effect, checks=failed)] if failed else []
        # by the config as it is now, which may be newer than the table
        accept: dict[Any, str] = media[str(medium)].accept
        taken = rows.loc[rows["verdict"] == ACCEPTED, "check"]
        marks += [remark(ACCEPTED, check=check, why=accept.get(check, "")) for check in taken]
        if marks:
            found[str(medium)] = marks
    return found


def marked(alpha: pd.DataFrame, checks: Sequence[Check], marks: Sequence[Remark]) -> pd.DataFrame:
    """Add the marks of its medium to an alpha table, and flags to the cells of single bad runs."""
    alpha = alpha.assign(**reason_columns(marks, MARKS))
    bad = {one.run_id: one for check in checks for one in check.runs}
    added = ([bad[run] for run in runs.split() if run in bad] for runs in alpha["run_ids"])
    rows = zip(alpha.to_dict("records"), added, strict=True)
    alpha[[*FLAGS]] = [[*flag_columns([*flags_of(row), *own]).values()] for row, own in rows]
    return alpha


def usable(alpha: pd.DataFrame) -> bool:
    """Whether a medium may enter what is made from several media."""
    return not any(UNUSABLE in str(own).split() for own in alpha.get("checks_code", ()))


# --- What the alpha table itself shows: axes and signs.


@dataclass(frozen=True)
class _Cells:
    """Cells that have alpha; `force` and `se` are of shape (2, n), z and x, N/cm^3.

    `gamma`: rad. `side`: -1 where alpha_x was turned, as that of an extraction. `turn`: the part of `se`
    that a turn of the mount beyond what is stated makes in x.
    `push`, `pull`: Where the cells (0, 90) and (0, -90) deg are; None where they have no alpha.
    `pairs`: Cells straight up or down that are mirror images of each other, or of themselves.
    """

    gamma: FloatArray
    side: FloatArray
    force: FloatArray
    se: FloatArray
    turn: FloatArray
    push: int | None
    pull: int | None
    pairs: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, alpha: pd.DataFrame) -> _Cells:
        known = np.flatnonzero(np.isfinite(alpha_columns(alpha)).all(axis=0))
        table = alpha.iloc[known].reset_index(drop=True)
        force = np.stack(alpha_columns(table))
        se = np.nan_to_num(np.stack([table[column(c, "_se")].to_numpy(float) for c in "zx"]))
        gamma = np.radians(table["gamma_deg"].to_numpy(float))
        turn = np.nan_to_num(table[column("x", "_turn")].to_numpy(float))
        beta_deg, gamma_deg = (table[f"{name}_deg"].to_numpy(float) for name in ("beta", "gamma"))
        push, pull = (int(row) if row >= 0 else None for row in rows_at(table, 0, [90, -90]))
        image = rows_at(table, -beta_deg, gamma_deg)
        pairs = tuple(
            (one, int(other)) for one, other in enumerate(image)
            if other >= one and abs(gamma_deg[one]) == 90
        )  # fmt: skip
        side = np.where(gamma < 0, -1.0, 1.0)
        return cls(gamma, side, force, se, turn, push, pull, pairs)

    def turned(self, matrix: FloatArray) -> _Cells:
        """What the table would be with other axes: `matrix` acts on the force (z, x)."""
        sides = np.stack([np.ones_like(self.side), self.side])
        turn = matrix[:, :, None] * sides[:, None] * sides[None]
        force = np.einsum("ijn,jn->in", turn, self.force)
        se = np.sqrt(np.einsum("ijn,jn->in", turn**2, self.se**2))
        return replace(self, force=force, se=se)

    @property
    def work(self) -> tuple[FloatArray, FloatArray]:
        """D = alpha_x cos gamma + alpha_z sin gamma, and how far below 0 noise may bring it."""
        share = np.stack([np.sin(self.gamma), np.cos(self.gamma)])
        se = np.sqrt(np.sum((share * self.se) ** 2, axis=0))
        sigmas = np.full(se.shape, _SIGMAS)
        if self.push is not None:
            sigmas[self.push] = _SIGMAS_PUSH
        return np.sum(share * self.force, axis=0), np.maximum(LEAST_WORK, sigmas * se)

    @property
    def back(self) -> int:
        """Number of cells in which the medium gives energy back."""
        done, least = self.work
        return int(np.count_nonzero(done < -least))

    @property
    def resists(self) -> bool:
        """Whether the medium takes energy, as it must."""
        done, least = self.work
        pulled = self.push is not None and done[self.push] < -least[self.push]
        return self.back < _CELLS and not pulled

    @property
    def turn_rad(self) -> tuple[float, float]:
        """How far the mount is turned beyond what is stated, and its standard error; NaN if not measured.

        Mirror images feel opposite horizontal forces: what their sum is, relative to the vertical forces.
        """
        one, other = np.array(self.pairs, dtype=int).reshape(-1, 2).T
        z, x = ((part[one] + part[other]) for part in (self.force[0] * self.side, self.force[1]))
        variance = np.maximum(self.se[1] ** 2 - self.turn**2, 0)
        # a cell that is its own image is there twice
        error = np.where(one == other, 4 * variance[one], variance[one] + variance[other])
        weight = z / np.maximum(error + (_ALIKE * np.abs(z).max(initial=0)) ** 2, 1e-12)
        size = float(weight @ z)
        if not size > 0:
            return math.nan, math.nan
        return -math.atan2(float(weight @ x), size), math.sqrt(float(weight**2 @ error)) / size

    @property
    def upright(self) -> bool:
        """Whether mirror images straight down feel opposite horizontal forces."""
        turn, se = self.turn_rad
        return not abs(turn) > _TURN + _SIGMAS * se

    @property
    def heavier_down(self) -> bool:
        """Whether pushing a level plate down takes more than pulling it up."""
        if self.push is None or self.pull is None:
            return True
        (down, up), errors = (part[0, [self.push, self.pull]] for part in (self.force, self.se))
        return bool(abs(up) - down <= _SIGMAS * math.hypot(*errors))

    @property
    def rank(self) -> tuple[int, int]:
        """Number of these tests that fail, and of cells that give energy back: the fewer the better."""
        return 3 - self.resists - self.upright - self.heavier_down, self.back


_OTHER_AXES = {
    "Z looks reversed": [[-1, 0], [0, 1]],
    "X looks reversed": [[1, 0], [0, -1]],
    "Z and x both look reversed, or the logs of plates and rods exchanged": [[-1, 0], [0, -1]],
    "X and z look exchanged": [[0, 1], [1, 0]],
    "X and z look exchanged, with z reversed": [[0, -1], [1, 0]],
    "X and z look exchanged, with x reversed": [[0, 1], [-1, 0]],
    "X and z look exchanged, and both reversed": [[0, -1], [-1, 0]],
}


def _axes(cells: _Cells) -> tuple[str, _Cells] | None:
    """The other axes with which a table that gives energy back is as it should be, if there are any."""
    tried = {name: cells.turned(np.array(matrix)) for name, matrix in _OTHER_AXES.items()}
    best = min(tried, key=lambda name: tried[name].rank)
    return (best, tried[best]) if tried[best].resists and tried[best].rank < cells.rank else None


def check_axes(
    cells: _Cells,
    other: tuple[str, _Cells] | None,
    alpha: pd.DataFrame,
    where: str,
    sheet: Mapping[str, Run],
) -> list[Check]:
    """Work, symmetry, and down above up; `other`: axes that would mend the table, `where`: what gives the axes."""
    count = cells.force.shape[1]
    if not count:
        names: tuple[CheckName, ...] = ("work", "symmetry", "up_down")
        return [Check(name, NOT_CHECKED, "no cell has alpha") for name in names]
    done, least = cells.work
    back = alpha[np.isfinite(alpha_columns(alpha)).all(axis=0)][done < -least]
    runs = " ".join(back["run_ids"]).split() if "run_ids" in back else []
    given = f"{cells.back} of {count} cells give energy back"
    said = (
        f"The signs of forces or motion are wrong in some runs ({given}: {rows_of(runs, sheet)}): look at "
        f"the direction, the angles and the logs of these runs, then at {where}."
    )
    if other is not None:
        name, then = other
        after = f"{then.back or 'none'} of them with that put right"
        said = f"{name} ({given}; {after}): look at {where}."
    worst = int((done / least).argmin())
    found = f"{given}, the lowest D = {done[worst]:.3g} N/cm^3"
    allowed = f"D of {-least[worst]:.3g} N/cm^3 or more in all but {_CELLS - 1} cells"
    # where the axes are wrong it is all runs, and said once
    alone = () if other is not None else (remark("gives-back", run_id=run) for run in runs)
    work = _judged("work", cells.resists, found, allowed, said, *alone)
    return [work, _symmetry(cells), _up_down(cells)]


def _symmetry(cells: _Cells) -> Check:
    turn, se = cells.turn_rad
    if math.isnan(turn):
        return Check("symmetry", NOT_CHECKED, "no alpha at (0, 90) deg, and no mirror images")
    degrees = math.degrees(turn)
    lo, hi = (degrees + sign * 1.96 * math.degrees(se) for sign in (-1, 1))
    found = f"the mount looks turned by {degrees:+.1f} deg ({lo:+.1f} to {hi:+.1f}) beyond what is stated"
    allowed = f"{math.degrees(_TURN + _SIGMAS * se):.1f} deg of either sign"
    said = (
        f"Plates straight down feel a horizontal force to one side ({found}): look at transducer.axes, "
        "at transducer.turn_deg and at the angle of the plate."
    )
    if abs(degrees) <= _MOST_TURN_DEG:
        said = (
            f"The mount looks turned by {abs(degrees):.1f} deg {'more' if turn > 0 else 'less'} than "
            f"stated ({lo:+.1f} to {hi:+.1f} deg): look at transducer.turn_deg, else for a bent plate or a "
            "slanted bed."
        )
    return _judged("symmetry", cells.upright, found, allowed, said)


def _up_down(cells: _Cells) -> Check:
    if cells.push is None or cells.pull is None:
        return Check("up_down", NOT_CHECKED, "no alpha at (0, 90) or at (0, -90) deg")
    down, up = cells.force[0, [cells.push, cells.pull]]
    found = f"alpha_z(0, 90) = {down:.3g}, alpha_z(0, -90) = {up:.3g} N/cm^3"
    said = (
        f"Pulling a level plate up takes more than pushing it down ({found}): look whether "
        "intrusions and extractions are exchanged in the run sheet."
    )
    allowed = "alpha_z(0, 90) above the size of alpha_z(0, -90)"
    return _judged("up_down", cells.heavier_down, found, allowed, said)


def check_size(alpha: pd.DataFrame, expected: tuple[float, float] | None) -> Check:
    """Whether alpha_z(0, 90 deg) is as large as stated; without that, what no medium is found."""
    cell = cell_at(alpha, 0, 90)
    value = math.nan if cell is None else float(cell[column("z")])
    low, high = expected or (_ALPHA_FROM, _ALPHA_TO)
    if math.isnan(value):
        return Check("size", NOT_CHECKED, "no alpha at (0, 90) deg")
    found, allowed = f"alpha_z(0, 90) = {value:.3g} N/cm^3", f"{low:g} to {high:g} N/cm^3"
    good, whose = low <= abs(value) <= high, "expected_alpha" if expected else "any granular medium"
    if good and not expected:
        return Check("size", NOT_CHECKED, found, allowed, NO_SCALE)
    said = (
        f"The scale of the force or the size of the plate looks wrong: {found}, {whose} has "
        f"{allowed}: look at the unit of the force and at the size of the plate."
    )
    return _judged("size", good, found, allowed, said)


# --- What the logs show: channels, rods, copies.


def check_channels(
    config: Config,
    sheet: Mapping[str, Run],
    facts: pd.DataFrame,
    against: tuple[list[str], list[Remark]],
) -> Check:
    """Look for a channel that is constant, frozen or cut off, feels nothing, or is another's or reversed.

    `against`: What `against_known` finds.
    """
    causes, flags = against
    read = facts[facts["status"].eq("read") & facts["F1_low_N"].notna()].to_dict("records")
    rows = [(sheet[row["run_id"]], row) for row in read]
    rows = [(run, row) for run, row in rows if run.kind in ("plate", "leg")]
    if not rows:
        if not causes:
            return Check("channels", NOT_CHECKED, "no readings of channels")
        return _judged("channels", False, "; ".join(causes), "", _sentence(causes), *flags)
    # what goes deeper feels more and more; a level path or a pull need not
    pushes = [one for one in rows if one[0].direction not in ("horizontal", "extraction")]
    axes = {axis: getattr(config.transducer.axes, axis)[1:] for axis in "xyz"}
    bad: dict[str, Remark] = {}
    more: list[str] = []
    for axis in "xz":
        name = axes[axis]
        stated = config.force_log.columns.get(name)
        if stated is not None and stated.constant is not None:
            continue
        feels = [row for run, row in pushes if axis == "z" or not is_symmetric(run)]
        dead = [row for row in feels if row[f"{name}_held"] >= _FROZEN]
        if len(dead) >= min(_LOGS, len(feels)) > 0:
            whole = all(row[f"{name}_low_N"] == row[f"{name}_high_N"] for row in dead)
            more.append(
                f"{name}, along {axis}, {'is constant' if whole else 'stands still'} in "
                f"{len(dead)} of {len(feels)} logs: look at its cable and its column"
            )
            bad |= {run: remark("channel-still", run_id=run, channel=name)
                    for run in (row["run_id"] for row in dead)}  # fmt: skip
            continue
        limit = 0.99 * config.transducer.range_N[int(name[1]) - 1]
        for value, runs in _ends([row for _, row in rows], name, limit).items():
            more.append(
                f"{name}, along {axis}, stops at {value:g} N in {len(runs)} of {len(rows)} logs, "
                "below its range: look at the range of amplifier and logger"
            )
            bad |= {run: remark("channel-clipped", run_id=run, channel=name, newtons=value)
                    for run in runs}  # fmt: skip
    slanted = [row for run, row in pushes if not is_symmetric(run)]
    across, along = (
        np.array([row[f"{axes[c]}_high_N"] - row[f"{axes[c]}_low_N"] for row in slanted])
        for c in "yx"
    )
    # what stands still or stops, or an exchange, is the first name of what feels nothing
    if more:
        causes, flags = more, [*bad.values()]
    elif slanted and np.median(across) > 10 * config.transducer.precision_N:
        ratio = float(np.median(across / np.maximum(along, 1e-9)))
        if ratio > _SIDEWAYS:
            told = (
                f"x and y look exchanged: {axes['y']}, across the motion, feels {ratio:.3g} times "
            )
            causes = [f"{told}what {axes['x']}, along it, does: look at transducer.axes"]
            flags = []
    found = "; ".join(causes) or f"{len(rows)} logs"
    allowed = f"below {_FROZEN:.0%} of a stroke at one reading, no end in common below the range"
    return _judged("channels", not causes, found, allowed, _sentence([found]), *flags)


def _sentence(causes: Sequence[str]) -> str:
    words = "; ".join(causes)
    return f"{words[0].upper()}{words[1:]}."


def against_known(
    config: Config,
    sheet: Mapping[str, Run],
    facts: pd.DataFrame,
    fits: pd.DataFrame,
    peers: pd.DataFrame,
    exchanged: Collection[str],
    explained: bool,
) -> tuple[list[str], list[Remark]]:
    """Runs in which a channel feels nothing of what every known medium makes it feel, the opposite, or a part.

    `exchanged`: Runs whose logs look like those of rods. `explained`: Whether something else is wrong with all runs.
    """
    table = fits.merge(peers[["run_id", "known_z_ratio", "known_x_ratio"]], on="run_id")
    table = table.merge(facts[["run_id", *(f"F{n}_noise_N" for n in (1, 2, 3))]], on="run_id")
    table = table[~table["run_id"].isin([*exchanged])]
    if table.empty:
        return [], []
    side = np.where(table["mirrored"].to_numpy(bool), -1.0, 1.0)
    force = np.stack([
        table[f"alpha_{c}_N_per_cm3"].to_numpy(float) + table[f"alpha_{c}_rod_N_per_cm3"].fillna(0)
        for c in "zx"
    ]) * np.stack([np.ones_like(side), side])  # fmt: skip
    turn = math.radians(config.transducer.turn_deg)
    mount = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]) @ force
    known = table[["known_z_ratio", "known_x_ratio"]].to_numpy(float).T.copy()
    known[1] *= side
    strong = np.abs(known) >= _CLEAR
    with np.errstate(invalid="ignore", divide="ignore"):
        sizes = [float(np.nanmedian(np.abs(mount[c] / known[c])[strong[c]])) if strong[c].any() else 0.0
                 for c in (0, 1)]  # fmt: skip
    size = np.nanmax(sizes)
    causes, flags = [], []
    for place, axis in enumerate("zx"):
        name = getattr(config.transducer.axes, axis)[1:]
        stated = config.force_log.columns.get(name)
        if not size > 0 or (stated is not None and stated.constant is not None):
            continue
        faint = np.abs(mount[place]) < _SILENT * size
        silent = faint & (np.abs(known[place]) >= _MUST_FEEL)
        opposite = (np.sign(force[place]) != np.sign(known[place])) & ~faint
        opposite &= np.abs(known[place]) >= _MUST_FEEL
        against = opposite & strong[place]
        must = int((np.abs(known[place]) >= _MUST_FEEL).sum())
        fewest = min(max(_LOGS, math.ceil(_FAINT * must)), must)
        whose = f"{name}, along {axis}," if not config.table else f"alpha_{axis}"
        if not explained and silent.sum() >= fewest > 0:
            runs = table.loc[faint, "run_id"]
            causes.append(
                f"{whose} feels nothing in {silent.sum()} of {must} runs that must feel something "
                f"({rows_of(runs, sheet)}): look at its cable and its column"
            )
            flags += [remark("channel-silent", run_id=run, channel=name) for run in runs]
        elif not explained and _LOGS <= against.sum() <= _MOST * strong[place].sum():
            runs = table.loc[opposite, "run_id"]
            causes.append(
                f"{whose} has the opposite sign in {against.sum()} of {strong[place].sum()} runs that tell "
                f"({rows_of(runs, sheet)}): look at its wires and at the motion of these runs"
            )
            flags += [remark("channel-reversed", run_id=run, channel=name) for run in runs]
        elif (
            quiet := _other_gain(
                table[f"{name}_noise_N"], mount[place], known[place], strong[place]
            )
        ) is not None:
            times, other = quiet
            runs = table.loc[other, "run_id"]
            causes.append(
                f"{whose} has {times:.2g} times the noise and about as much less or more force in {other.sum()} of "
                f"{other.size} runs ({rows_of(runs, sheet)}) as in the others: look at its amplifier and its unit"
            )
            flags += [remark("channel-gain", run_id=run, channel=name, times=times) for run in runs]
    return causes, flags


def _other_gain(
    noise: pd.Series[float], force: FloatArray, known: FloatArray, strong: npt.NDArray[np.bool_]
) -> tuple[float, npt.NDArray[np.bool_]] | None:
    """Runs in which noise and force of a channel are both so many times those of the others."""
    size = noise.to_numpy(float)
    if not (size > 0).all():
        return None
    found = two_heaps(np.log(size))
    if found is None:
        return None
    other = found[1]
    if not (strong & other).any() or not (strong & ~other).any():
        return None
    share = np.abs(force / np.where(strong, known, 1.0))
    times, more = (
        float(np.median(of[strong & other]) / np.median(of[strong & ~other]))
        for of in (size, share)
    )
    alike = more > 0 and abs(math.log(more / times)) < 0.5 * abs(math.log(times))
    return (times, other) if alike and abs(math.log(times)) > math.log(_GAIN) else None


def _ends(rows: Sequence[dict[Any, Any]], name: str, limit: float) -> dict[float, list[str]]:
    """Readings below the range at which a channel stops in several logs, and these runs."""
    found: dict[float, list[str]] = {}
    for row in rows:
        low, high, held = (row[f"{name}_{fact}_N"] for fact in ("low", "high", "held"))
        if row[f"{name}_held"] >= _CLIPPED and low < high and held in (low, high):
            found.setdefault(held, []).append(row["run_id"])
    return {held: runs for held, runs in found.items() if len(runs) >= _LOGS and abs(held) < limit}


def check_rods(tares: pd.DataFrame, sheet: Mapping[str, Run]) -> Check:
    """Whether rods alone feel less than plates on their rods do."""
    rows = [
        row for row in tares.to_dict("records")
        if row["tare_run"] and sheet[row["run_id"]].kind == "plate"
    ]  # fmt: skip
    tare, force = (
        np.array([row[name] for row in rows], dtype=float) for name in ("tare_rms_N", "force_rms_N")
    )
    known = np.isfinite(tare) & (force > 0)
    ratio = np.where(known, tare / np.where(known, force, 1), np.nan)
    if not known.any():
        return Check("rods", NOT_CHECKED, "no plate run has a tare")
    typical = float(np.nanmedian(ratio))
    # forces of the weakest directions are little more than the noise of their zeros
    clear = tare - force > _ROD_FORCE * np.nanmedian(np.fmax(tare, force))
    wrong = (ratio == 1) | (ratio >= np.where(clear, _ROD_ALONE, _ROD_CLEAR))
    stronger = [row["run_id"] for row, one in zip(rows, wrong, strict=True) if one]
    found = f"a rod alone feels {typical:.3g} times what plate and rod feel (median of {known.sum()} runs)"
    if stronger:
        found = (
            f"in {len(stronger)} of {known.sum()} runs a rod alone feels more than plate and rod"
        )
    said = (
        f"Logs of plates and rods look exchanged, or are the same ({found}: {rows_of(stronger, sheet)}): "
        "look at the logs, kind and tare_run of these runs."
    )
    flags = [remark("rod-stronger", run_id=run) for run in stronger]
    return _judged(
        "rods",
        not stronger,
        found,
        f"a ratio below {_ROD_ALONE:g} in each run ({_ROD_CLEAR:g} where forces are weak), and not 1",
        said,
        *flags,
    )


def check_logs(sheet: Mapping[str, Run], logs: Mapping[str, Collection[str]]) -> Check:
    """Whether two runs have the same readings, or the same noise, under two names; `logs`: Of `copies_of`."""
    of_table = any(run.intruder == UNIT_AREA for run in sheet.values())
    if not logs:
        why = "no run has enough readings to tell a copy by"
        return Check(
            "same_logs",
            NOT_CHECKED,
            f"{why}: a table of alpha, or of few depths" if of_table else why,
        )
    what = "run" if of_table else "log"
    copies = [name for name in sheet if logs.get(name)]
    if not copies:
        return Check("same_logs", PASSED, f"no {what} is there twice", f"each {what} once")
    first = copies[0]
    found = f"{len(copies)} runs have the readings of others: {first} and {', '.join(logs[first])}"
    where = "at these runs in the table" if of_table else "at force_log of these runs"
    said = f"Copies of a {what} are no repeats ({found}): look {where}, and leave out the copies."
    flags = [remark("same-readings", run_id=name, runs=", ".join(logs[name])) for name in copies]
    return _judged("same_logs", False, found, f"each {what} once", said, *flags)


# --- What the strokes show: drift, surface, clocks, curvature, steadiness.


def check_drift(sheet: Mapping[str, Run], runs: pd.DataFrame, tares: pd.DataFrame) -> Check:
    """Whether the zero drifts already while the intruder rests in air before its stroke."""
    from scipy.special import ndtr, stdtrit

    table = runs.merge(tares[["run_id", "force_rms_N"]], on="run_id")
    trend = table[["zero_trend_z_N", "zero_trend_x_N"]].to_numpy(float).T
    force = table["force_rms_N"].to_numpy(float)
    known = np.isfinite(trend).all(axis=0) & (force > 0)
    if known.sum() < _FEW_RUNS:
        why = f"fewer than {_FEW_RUNS} runs rest in air at one end alone"
        return Check("drift", NOT_CHECKED, why)
    table, trend, typical = table[known], trend[:, known], float(np.median(force[known]))
    middle, se = np.array([_median(part) for part in trend]).T
    # few runs hardly tell their own scatter: Student's t at the same level
    limit = stdtrit(known.sum() - 1, ndtr(_SURE)) * se
    off = np.abs(trend - middle[:, None])
    # where most runs drift alike it is all of them, else those that stand out
    common = (np.abs(middle) > limit) & (np.abs(middle) > _DRIFT * typical)
    spread = 1.4826 * np.median(off, axis=1)[:, None]
    alone = (off > _MODES * spread) & (off > _DRIFT_ALONE * np.maximum(force[known], typical))
    alone = alone.any(axis=0)
    worst = int(np.abs(middle).argmax())
    found = (
        f"a drift at rest before the strokes that would move F_{'zx'[worst]} by {middle[worst]:+.2g} N until their "
        f"middle (median of {known.sum()} runs)"
    )
    allowed = f"{max(_DRIFT * typical, float(limit[worst])):.2g} N of either sign"
    which = table["run_id"] if common.any() else table.loc[alone, "run_id"]
    if alone.any() and not common.any():
        found = f"{alone.sum()} of {known.sum()} runs drift at rest before their strokes"
        allowed = "no run that drifts more than the others and than 15 % of the force"
    said = (
        f"The zero of the force drifts ({found}: {rows_of(which, sheet)}): let the transducer warm up, "
        "record a rest in air after the stroke too, or state transducer.drift_N_per_min."
    )
    flags = [remark("zero-drifts", run_id=run) for run in which]
    return _judged("drift", not (common.any() or alone.any()), found, allowed, said, *flags)


def check_surface(
    config: Config, medium: str, tables: Tables, sheet: Mapping[str, Run]
) -> tuple[Check, Check]:
    """Where stress begins, by lines with a free intercept, against the surface; and whether it is a line.

    What all paths share is an error of the surface; what grows with the speed of sinking, and has the
    opposite sign in pulls, is a lag. A step along the sheet, or two heaps, are two surfaces or two lags.
    """
    fits, speed = tables["fits"], config.arm.speed_cm_per_s
    why = ""
    if config.media[medium].role != "laboratory":
        why = "stress is a line only near the surface of a natural sand"
    elif flagged_with(fits, "no-tare").any():
        why = "the force on the rod, which begins elsewhere, is in it"
    known = fits[(fits["gamma_deg"].abs() >= 45) & fits["start_cm"].notna()]
    alpha, se = (known[f"alpha_z{end}_N_per_cm3"].to_numpy(float) for end in ("", "_se"))
    clear = np.abs(alpha) > _SIGMAS * se
    known, alpha = known[clear], np.abs(alpha[clear])
    pushes = known["direction"].to_numpy() == "intrusion"
    if not why and pushes.sum() < _FEW_RUNS:
        why = "too few pushes with a slope of their own"
    if why:
        return Check("surface", NOT_CHECKED, why), Check("linearity", NOT_CHECKED, why)
    start = known["start_cm"].to_numpy(float)
    stated = [config.errors.surface_run_mm, config.errors.surface_session_mm]
    run_cm, session_cm = (max(_SURFACE_CM, (one or 0) / 10) for one in stated)
    sine = np.where(pushes, 1, -1) * np.abs(np.sin(np.radians(known["gamma_deg"].to_numpy(float))))
    # the weaker a run, the farther a drift of its zero moves its start
    error = np.hypot(run_cm, _SURFACE_CM * np.median(alpha[pushes]) / alpha)
    paths = np.stack([np.ones_like(sine), sine * (np.ptp(sine) > 0.2)], axis=1)
    # the zero of a tare, which moves weak pulls, is one error of all that share it
    alike = known.groupby(["tare_run", "direction"])["run_id"].transform("size").to_numpy(float)
    (off, late), covariance, _ = _robust_fit(
        paths, start, error, pushes, np.where(pushes, 1, alike)
    )
    covariance = covariance + np.diag([session_cm**2, (_LAG_S * speed) ** 2])
    mean = np.array([1.0, float(sine[pushes].mean())])
    down, down_se = off + mean[1] * late, math.sqrt(mean @ covariance @ mean)
    off_se, late_se = np.sqrt(np.diag(covariance))
    is_off, is_late = abs(off) > _SURE * off_se, abs(late) > _SURE * late_se
    wrong = is_off or is_late or abs(down) > _SURE * down_se
    found = f"stress begins {10 * down:+.1f} mm below the surface in pushes"
    allowed = f"{10 * _SURE * down_se:.1f} mm of either sign"
    if np.ptp(sine) > 1:
        found += f", {10 * (off - late):+.1f} mm in pulls straight up"
        allowed += f", by the surface {10 * _SURE * off_se:.1f} mm, by a lag {_SURE * late_se / speed:.2f} s"
    line = _check_linearity(known[pushes])
    if line.verdict == FAILED or abs(float(known["exponent_z"][pushes].median()) - 1) > _CURVED:
        # a line through curved stress begins the deeper the deeper it ends
        deep = known["depth_to_cm"].to_numpy(float)
        paths = np.column_stack([paths, deep - deep.mean()])
    heaps = _two_levels(paths, start, error, pushes, [sheet[run] for run in known["run_id"]], speed)
    if heaps is not None:
        return _judged("surface", False, found, allowed, heaps[0], *heaps[1]), line
    said = []
    if is_late:
        said.append(
            f"The force log is {'late' if late > 0 else 'early'} against the motion log by about "
            f"{abs(late) / speed:.1g} s ({found}): look at the clocks and filters of both."
        )
    if is_off or (wrong and not is_late):
        misfit = known[pushes]["power_misfit_z_ratio"].dropna().to_numpy(float)
        surface = f"the surface is wrong ({found}): look at arm.surface_z_mm and surface_z_mm"
        if misfit.size and float(np.mean(misfit > 1)) < _clear_share(misfit.size):
            # a line through curved stress has a start that is no surface
            told = (
                "stress looks curved, so where a line through it begins does not tell the surface"
            )
            if line.verdict != FAILED:
                either = f"{line.found[0].upper()}{line.found[1:]}, or {surface}. These logs do not tell the two apart."
                line = replace(line, verdict=FAILED, sentence=either)
            return Check("surface", NOT_CHECKED, told), line
        said.append(f"{surface[0].upper()}{surface[1:]}.")
    return _judged("surface", not said, found, allowed, " ".join(said)), line


def _robust_fit(
    design: FloatArray,
    start: FloatArray,
    error: FloatArray,
    pushes: npt.NDArray[np.bool_] | None = None,
    alike: FloatArray | float = 1.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Least squares in which a run that lies far off counts less: what is found, covariance, standard deviations.

    Errors are known but for a factor, which the scatter tells, of `pushes` and of pulls each its own;
    so many runs have one error in common.
    """
    whole = np.ones(start.size, dtype=bool)
    sides = [whole] if pushes is None else [whole, pushes, ~pushes]
    weight, spread = np.ones_like(start), np.ones_like(start)
    for _ in range(10):
        sigma = error * spread * np.sqrt(alike / weight)
        scaled = design / sigma[:, None]
        inverse = np.linalg.pinv(scaled.T @ scaled)
        found = inverse @ scaled.T @ (start / sigma)
        rest = np.abs(start - design @ found) / error
        for side in sides:
            if rest[side].size >= _FEW_RUNS:
                spread[side] = max(1.4826 * float(np.median(rest[side])), 0.3)
        weight = np.minimum(1.0, 1.5 * spread / np.maximum(rest, 1e-9))
    return found, np.asarray(inverse), sigma


def _two_levels(
    paths: FloatArray,
    start: FloatArray,
    error: FloatArray,
    pushes: npt.NDArray[np.bool_],
    runs: Sequence[Run],
    speed: float,
) -> tuple[str, list[Remark]] | None:
    """Name the runs whose surface or whose lag is not that of the others; None where all are alike.

    `paths` (n, k): what all `start` (n,), cm, have in common: the surface, a lag, and curvature if there is any.
    """
    order = np.argsort([run.row for run in runs], kind="stable")
    paths, start, error, pushes = paths[order], start[order], error[order], pushes[order]
    # pulls are too weak to find it by
    one = paths[pushes], start[pushes], error[pushes]
    found, _, sigma = _robust_fit(*one)
    heaps = two_heaps(one[1] - one[0] @ found)
    clear, part = heaps if heaps is not None else (0.0, np.zeros(sigma.size, dtype=bool))
    other = np.zeros(start.size, dtype=bool)
    other[pushes] = part
    for _ in range(2):
        stretch = _stretch(*one[:2], sigma)
        found, covariance, sigma = _robust_fit(np.column_stack([one[0], stretch]), *one[1:])
    if stretch.any() and abs(found[-1]) > max(clear, 1.0) * _STEP * math.sqrt(covariance[-1, -1]):
        # a pull is as the push before it
        other = stretch[np.maximum(np.cumsum(pushes) - 1, 0)]
    elif heaps is None:
        return None
    gaps = {}
    for kind, moves in (("surface", paths[:, 0]), ("lag", paths[:, 1])):
        if moves.any():
            design = np.column_stack([paths, moves * other])
            found, covariance, _ = _robust_fit(design, start, error, pushes)
            gaps[kind] = abs(found[-1]) / math.sqrt(covariance[-1, -1]), float(found[-1])
    kind = max(gaps, key=lambda name: gaps[name][0])
    gap = gaps[kind][1]
    if abs(gap) < _STEP_CM:
        return None
    names = [run.run_id for run, its in zip([runs[n] for n in order], other, strict=True) if its]
    rows = rows_of(names, {run.run_id: run for run in runs})
    count = f"in {other.sum()} of {other.size} runs than in the others ({rows})"
    if kind == "surface":
        way = "deeper" if gap > 0 else "higher"
        said = f"Stress begins {10 * abs(gap):.1f} mm {way} {count}: look at surface_z_mm of these runs."
        gap *= 10
    else:
        way = "later" if gap > 0 else "earlier"
        gap /= speed
        said = f"The force log is {abs(gap):.2g} s {way} {count}: look at the clocks of these runs."
    return said, [remark(f"{kind}-differs", run_id=run, gap=gap) for run in names]


def _stretch(common: FloatArray, start: FloatArray, sigma: FloatArray) -> npt.NDArray[np.bool_]:
    """Find the stretch of runs, in order, whose start least squares move farthest, in standard errors."""
    count, fewest = start.size, _fewest(start.size)
    ends = np.unique(np.linspace(0, count, min(count, _ENDS) + 1).astype(int))
    first, last = (ends[k] for k in np.triu_indices(ends.size, 1))
    fits = (last - first >= fewest) & (count - (last - first) >= fewest)
    other = np.zeros(count, dtype=bool)
    if not fits.any():
        return other
    first, last = first[fits], last[fits]
    basis, _ = np.linalg.qr(common / sigma[:, None])
    rest = start / sigma
    rest = rest - basis @ (basis.T @ rest)
    sums = np.zeros((count + 1, 2 + basis.shape[1]))
    sums[1:] = np.cumsum(np.column_stack([rest, 1 / sigma, basis]) / sigma[:, None], axis=0)
    along, power, *shared = (sums[last] - sums[first]).T
    free = np.maximum(power - np.sum(np.square(shared), axis=0), 1e-9)
    best = int(np.argmax(np.abs(along) / np.sqrt(free)))
    other[first[best] : last[best]] = True
    # the smaller part is the other one
    return other if 2 * other.sum() <= count else ~other


def _fewest(count: int) -> int:
    return max(_FEW_RUNS + 1, math.ceil(_HEAP * count))


def two_heaps(
    values: FloatArray, floor: float = _LEAST_SPREAD
) -> tuple[float, npt.NDArray[np.bool_]] | None:
    """Tell which of some values lie in a heap of their own; None where there is one heap.

    The smaller one, or of two equal ones that which is farther from 0, with how clear it is. `floor`: No
    spread is taken to be less.
    """
    count, fewest = values.size, _fewest(values.size)
    best: tuple[float, npt.NDArray[np.bool_]] = (1.0, np.zeros(count, dtype=bool))
    least_rest = math.inf
    ranks = np.empty(count, dtype=int)
    ranks[np.argsort(values, kind="stable")] = np.arange(count)
    for split in range(fewest, count - fewest + 1):
        part = ranks >= split
        middles = np.median(values[part]), np.median(values[~part])
        rest = np.abs(values - np.where(part, *middles))
        # of few runs, parted where they lie apart, the median deviation is small by chance
        spread = max(1.2533 * float(max(rest[part].mean(), rest[~part].mean())), floor)
        clear = float(abs(middles[0] - middles[1])) / spread / _MODES
        if clear > 1.0 and rest.sum() < least_rest - 1e-9:
            best, least_rest = (clear, part), float(rest.sum())
    clear, part = best
    if clear <= 1.0:
        return None
    sizes = part.sum(), (~part).sum()
    farther = abs(np.median(values[part])) >= abs(np.median(values[~part]))
    first = sizes[0] < sizes[1] or (sizes[0] == sizes[1] and farther)
    return clear, part if first else ~part


def _median(values: FloatArray) -> tuple[float, float]:
    """Median of some runs and its standard error, from their scatter; NaN for fewer than three."""
    if values.size < _FEW_RUNS:
        return math.nan, math.nan
    middle = float(np.median(values))
    # 1.4826 makes a standard deviation of a median deviation, 1.2533 that of a median
    scatter = 1.4826 * float(np.median(np.abs(values - middle)))
    return middle, 1.2533 * scatter / math.sqrt(values.size)


def _check_linearity(pushes: pd.DataFrame) -> Check:
    """Whether the stress of pushes grows in proportion to depth, or by another power of it."""
    power, se = _median(pushes["exponent_z"].dropna().to_numpy(float))
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    if math.isnan(power) or misfit.size < _FEW_RUNS:
        return Check("linearity", NOT_CHECKED, "too few pushes with a power of their own")
    share = float(np.mean(misfit < 1))
    found = f"stress of pushes grows as about depth^{power:.2f}, a power fits {share:.0%} of them better than a line"
    most, clear = max(_CURVED, _SURE * se), _clear_share(misfit.size)
    allowed = f"depth^{1 - most:.2f} to depth^{1 + most:.2f}, or less than {clear:.0%} fitted better by a power"
    said = (
        f"Stress is not proportional to depth ({found}): a line through zero depends on its window."
    )
    return _judged("linearity", abs(power - 1) <= most or share < clear, found, allowed, said)


def _clear_share(runs: int) -> float:
    """Share of runs that has to speak for one of two models: two standard errors above a half."""
    return min(0.5 + 1 / math.sqrt(max(runs, 1)), 0.95)


def check_steadiness(tables: Tables) -> Check:
    """Whether the stress of horizontal runs stays the same over the part that is averaged."""
    changes = []
    fits, tared, where = tables["fits"], tables["tared"], split_runs(tables["tared"])
    good = tables["windows"]["why"].to_numpy() == RowStatus.GOOD
    level = fits.loc[(fits["direction"] == "horizontal") & (fits["n_points"] > 0), "run_id"]
    for own in (where[name] for name in level if name in where):
        curve = tared.iloc[own][good[own]]
        force = curve[["force_z_N", "force_x_N"]].to_numpy(float).T
        force = force[np.abs(force.mean(axis=1)).argmax()]
        path = curve["path_cm"].to_numpy(float)
        if path.size >= 30:
            off = path - path.mean()
            changes.append(off @ force / (off @ off) * np.ptp(path) / force.mean())
    change, se = _median(np.array(changes))
    if math.isnan(change):
        return Check("steadiness", NOT_CHECKED, f"fewer than {_FEW_RUNS} horizontal runs")
    found = f"stress changes by {_percent(change)} over the steady part (of {len(changes)} runs)"
    most = max(_TREND, _SIGMAS * se)
    said = (
        f"Horizontal runs are not steady ({found}): look at fit.horizontal_skip_cm, at the distance "
        "to the walls, and whether the plate goes deeper or piles up the bed."
    )
    return _judged(
        "steadiness", abs(change) <= most, found, f"{_percent(most)} of either sign", said
    )


def check_repeats(peers: pd.DataFrame, sheet: Mapping[str, Run]) -> Check:
    """Whether each run has the alpha that its repeats, or else all other runs, say it should have."""
    judged = peers[np.isfinite(peers["times_spread"].to_numpy(float))]
    if judged.empty:
        return Check("repeats", NOT_CHECKED, "too few runs to tell how far runs differ")
    apart = judged[judged["apart"].to_numpy(bool)]
    first = apart.sort_values("times_spread", ascending=False).to_dict("records")[:_SPANS]
    told = "; ".join(
        f"{row['run_id']}: {row[f'alpha_{c}_N_per_cm3']:.3g} beside {row[f'others_{c}_N_per_cm3']:.3g}"
        for row in first
        for c in ["zx"[abs(row["off_x_ratio"]) > abs(row["off_z_ratio"])]]
    )
    largest = float(judged["times_spread"].max())
    found = f"{len(apart)} of {len(judged)} runs stand apart, the farthest by {largest:.1f} times the spread"
    said = (
        f"{found[0].upper()}{found[1:]} ({told} N/cm^3; {rows_of(apart['run_id'], sheet)}): look at the medium, the "
        "unit, the angles and the logs of these runs. They are used; exclude what is a mistake."
    )
    flags = [
        remark("apart", run_id=str(row["run_id"]), beside=row["beside"], times=row["times_spread"])
        for row in apart.to_dict("records")
    ]
    return _judged("repeats", apart.empty, found, "no run apart", said, *flags)


def _percent(ratio: float) -> str:
    """A ratio in percent; one above 10, as of exchanged axes, as it is."""
    return f"{100 * ratio:.1f} %" if abs(ratio) <= 10 else f"{ratio:.3g}"
