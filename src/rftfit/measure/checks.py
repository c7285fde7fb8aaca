"""Checks that need no fitted model: whether the numbers of a medium can be believed, and if not, why.

``docs/theory/checks.md`` says what each check rests on and where its threshold is from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from rftfit.campaign.config import UNIT_AREA, CheckName
from rftfit.measure.alpha import both, cell_at, column
from rftfit.measure.errors import AS_PREPARED, OF_CELL
from rftfit.measure.fits import is_symmetric
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
from rftfit.measure.strokes import split_runs

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from rftfit.campaign.config import Config, Medium
    from rftfit.campaign.load import Campaign
    from rftfit.campaign.sheet import Run
    from rftfit.conventions import FloatArray

    Tables = Mapping[str, pd.DataFrame]

PASSED, FAILED, ACCEPTED, NOT_CHECKED = "passed", "failed", "accepted", "not checked"
UNUSABLE, DOUBTFUL = "unusable", "doubtful"

CHECKS: dict[str, tuple[str, str]] = {
    "work": (UNUSABLE, "the medium takes energy"),
    "symmetry": (UNUSABLE, "a level plate straight down feels no horizontal force"),
    "up_down": (DOUBTFUL, "down is harder than up"),
    "channels": (UNUSABLE, "no channel is dead, frozen, cut off or another's"),
    "rods": (UNUSABLE, "rods feel less than plates"),
    "same_logs": (UNUSABLE, "no log is there twice"),
    "surface": (DOUBTFUL, "stress begins at the surface"),
    "size": (UNUSABLE, "alpha is as large as expected"),
    "steadiness": (DOUBTFUL, "horizontal runs are steady"),
}
"""What becomes of a medium that fails a check, and what the check asks, in few words."""
assert tuple(CHECKS) == get_args(CheckName)

NO_SCALE = (
    "The scale of the force was not checked: a wrong unit passes unless expected_alpha is stated."
)

COLUMNS = ["medium", "check", "verdict", "effect", "found", "allowed", "sentence"]

_SIGMAS = 3.0
_SIGMAS_PUSH = 2.0
"""Of one cell that is known beforehand: no medium pulls a level plate down that is pushed straight down."""
_BED_N_PER_CM3, _BED_SHARE = 0.005, 0.02
"""Scatter between beds where it is not known: as the paper states it, less in a weak medium."""
_LEAST_D, _CELLS = 0.005, 3
_TURN, _MOST_TURN_DEG = 0.04, 10.0
"""Beds are never quite alike to both sides: the paper's own tables have up to 1.7 %. Noise adds to it."""
_ALPHA_FROM, _ALPHA_TO = 0.01, 10.0
_CLIPPED, _FROZEN, _LOGS, _SIDEWAYS = 0.03, 0.5, 3, 2.0
_OFF_CM, _TREND = 0.1, 0.10
_SAME_MODEL, _FEW_RUNS = 0.8, 3


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


def check_medium(campaign: Campaign, medium: str, tables: Tables) -> list[Check]:
    """Do every check on one medium; what the config accepts is not failed.

    `tables`: ``runs``, ``tares``, ``fits``, ``alpha``, ``tared`` and ``windows`` of the medium.
    """
    config, alpha = campaign.config, tables["alpha"]
    sheet = {run.run_id: run for run in campaign.runs_of(medium)}
    rods = check_rods(tables["tares"], sheet)
    where = "the columns of the table" if config.table else "transducer.axes"
    found = [
        *check_axes(alpha, where, swapped=rods.verdict == FAILED),
        check_channels(config, sheet, tables["runs"]),
        rods,
        check_logs(sheet, same_readings(sheet, tables["runs"])),
        check_surface(config, medium, tables),
        check_size(alpha, config.media[medium].expected_alpha),
        check_steadiness(tables),
    ]
    accepted = config.media[medium].accept
    return [
        replace(one, verdict=ACCEPTED, sentence=f"{one.sentence} Accepted: {why}")
        if one.verdict == FAILED and (why := accepted.get(one.check))
        else one
        for one in sorted(found, key=lambda one: [*CHECKS].index(one.check))
    ]


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

    `gamma`: rad. `side`: -1 where alpha_x was turned, as that of an extraction.
    `push`, `pull`: Where the cells (0, 90) and (0, -90) deg are; None where they have no alpha.
    """

    gamma: FloatArray
    side: FloatArray
    force: FloatArray
    se: FloatArray
    push: int | None
    pull: int | None

    @classmethod
    def of(cls, alpha: pd.DataFrame) -> _Cells:
        known = np.flatnonzero(np.isfinite(both(alpha)).all(axis=0))
        table = alpha.iloc[known].reset_index(drop=True)
        force = np.stack(both(table))
        se = np.nan_to_num(np.stack([table[column(c, "_se")].to_numpy(float) for c in "zx"]))
        if table["spread"].isin([AS_PREPARED, OF_CELL]).any():
            largest = float(np.abs(force).max(initial=0.0))
            se = np.hypot(se, min(_BED_N_PER_CM3, _BED_SHARE * largest))
        gamma = np.radians(table["gamma_deg"].to_numpy(float))
        places = (cell_at(table, 0, angle) for angle in (90, -90))
        push, pull = (None if cell is None else cast("int", cell.name) for cell in places)
        return cls(gamma, np.where(gamma < 0, -1.0, 1.0), force, se, push, pull)

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
        return np.sum(share * self.force, axis=0), np.maximum(_LEAST_D, sigmas * se)

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
    def upright(self) -> bool:
        """Whether a level plate pushed straight down feels no horizontal force."""
        if self.push is None:
            return True
        (z, x), (_, se) = self.force[:, self.push], self.se[:, self.push]
        return bool(abs(x) <= math.hypot(_TURN * z, _SIGMAS * se))

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

    @property
    def turn_deg(self) -> float:
        """How far the mount is turned beyond what is stated, by the level plate's horizontal force."""
        own = [place for place in (self.push, self.pull) if place is not None]
        z, x = self.force[0, own] * self.side[own], self.force[1, own]
        return -math.degrees(math.atan2(float(z @ x), float(z @ z)))


def _turn(angle_deg: float) -> FloatArray:
    cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return np.array([[cosine, -sine], [sine, cosine]])


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


def check_axes(alpha: pd.DataFrame, where: str, *, swapped: bool = False) -> list[Check]:
    """Work, symmetry, and down above up, with the axes that would mend the table.

    `where`: What gives the axes. `swapped`: Rods feel more than their plates.
    """
    cells = _Cells.of(alpha)
    count = cells.force.shape[1]
    if not count:
        names: tuple[CheckName, ...] = ("work", "symmetry", "up_down")
        return [Check(name, NOT_CHECKED, "no cell has alpha") for name in names]
    other = None if cells.resists else _axes(cells)
    done, least = cells.work
    given = f"{cells.back} of {count} cells give energy back"
    said = f"The signs of forces or motion are wrong ({given}): look at {where} and at the angles."
    if other is not None:
        name, then = other
        if swapped:
            name = "The logs of plates and rods look exchanged"
            where = "kind and tare_run of the run sheet"
        after = f"{then.back or 'none'} of them with that put right"
        said = f"{name} ({given}; {after}): look at {where}."
    worst = int((done / least).argmin())
    found = f"{given}, the lowest D = {done[worst]:.3g} N/cm^3"
    allowed = f"D of {-least[worst]:.3g} N/cm^3 or more in all but {_CELLS - 1} cells"
    back = alpha[np.isfinite(both(alpha)).all(axis=0)][done < -least]
    # where the axes are wrong it is all runs, and said once
    alone = " ".join(back.get("run_ids", ())).split() if cells.resists else []
    work = _judged(
        "work",
        cells.resists,
        found,
        allowed,
        said,
        *(remark("gives-back", run_id=run) for run in alone),
    )
    return [work, _symmetry(cells, other), _up_down(cells, other)]


_SAME = "The same cause as of the check work."


def _symmetry(cells: _Cells, other: tuple[str, _Cells] | None) -> Check:
    if cells.push is None:
        return Check("symmetry", NOT_CHECKED, "no alpha at (0, 90) deg")
    (z, x), se = cells.force[:, cells.push], cells.se[1, cells.push]
    if z == 0:
        return Check("symmetry", NOT_CHECKED, "alpha_z at (0, 90) deg is 0")
    found = f"alpha_x/alpha_z at (0, 90) deg is {_percent(x / z)}"
    allowed = f"{_percent(math.hypot(_TURN, _SIGMAS * se / z))} of either sign"
    turn = cells.turn_deg
    back = cells.turned(_turn(turn))
    said = (
        f"A level plate pushed straight down feels a horizontal force ({found}): look at "
        "transducer.axes, at transducer.turn_deg and at the angle of the plate."
    )
    if other is not None and other[1].upright:
        said = _SAME
    elif abs(turn) <= _MOST_TURN_DEG and back.upright:
        then = _percent(back.force[1, cells.push] / back.force[0, cells.push])
        said = (
            f"The mount looks turned by {abs(turn):.1f} deg {'more' if turn > 0 else 'less'} than "
            f"stated ({found}, {then} with that put right): look at transducer.turn_deg, else for "
            "a bent plate or a slanted bed."
        )
    return _judged("symmetry", cells.upright, found, allowed, said)


def _up_down(cells: _Cells, other: tuple[str, _Cells] | None) -> Check:
    if cells.push is None or cells.pull is None:
        return Check("up_down", NOT_CHECKED, "no alpha at (0, 90) or at (0, -90) deg")
    down, up = cells.force[0, [cells.push, cells.pull]]
    found = f"alpha_z(0, 90) = {down:.3g}, alpha_z(0, -90) = {up:.3g} N/cm^3"
    said = (
        f"Pulling a level plate up takes more than pushing it down ({found}): look whether "
        "intrusions and extractions are exchanged in the run sheet."
    )
    if other is not None and other[1].heavier_down:
        said = _SAME
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


def check_channels(config: Config, sheet: Mapping[str, Run], facts: pd.DataFrame) -> Check:
    """Look for a channel that many logs show constant, frozen or cut off, or that is another's."""
    read = facts[facts["status"].eq("read") & facts["F1_low_N"].notna()].to_dict("records")
    rows = [(sheet[row["run_id"]], row) for row in read]
    rows = [(run, row) for run, row in rows if run.kind in ("plate", "leg")]
    if not rows:
        return Check("channels", NOT_CHECKED, "no readings of channels")
    # what goes deeper feels more and more; a level path or a pull need not
    pushes = [one for one in rows if one[0].direction not in ("horizontal", "extraction")]
    axes = {axis: getattr(config.transducer.axes, axis)[1:] for axis in "xyz"}
    causes: list[str] = []
    bad: dict[str, Remark] = {}
    for axis in "xz":
        name = axes[axis]
        stated = config.force_log.columns.get(name)
        if stated is not None and stated.constant is not None:
            continue
        feels = [row for run, row in pushes if axis == "z" or not is_symmetric(run)]
        dead = [row for row in feels if row[f"{name}_held"] >= _FROZEN]
        if len(dead) >= min(_LOGS, len(feels)) > 0:
            whole = all(row[f"{name}_low_N"] == row[f"{name}_high_N"] for row in dead)
            causes.append(
                f"{name}, along {axis}, {'is constant' if whole else 'stands still'} in "
                f"{len(dead)} of {len(feels)} logs: look at its cable and its column"
            )
            bad |= {run: remark("channel-still", run_id=run, channel=name)
                    for run in (row["run_id"] for row in dead)}  # fmt: skip
            continue
        limit = 0.99 * config.transducer.range_N[int(name[1]) - 1]
        for value, runs in _ends([row for _, row in rows], name, limit).items():
            causes.append(
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
    if slanted and not causes and np.median(across) > 10 * config.transducer.precision_N:
        ratio = float(np.median(across / np.maximum(along, 1e-9)))
        if ratio > _SIDEWAYS:
            causes.append(
                f"x and y look exchanged: {axes['y']}, across the motion, feels {ratio:.3g} times "
                f"what {axes['x']}, along it, does: look at transducer.axes"
            )
    found = "; ".join(causes) or f"{len(rows)} logs"
    allowed = f"below {_FROZEN:.0%} of a stroke at one reading, no end in common below the range"
    sentence = f"{found[0].upper()}{found[1:]}."
    return _judged("channels", not causes, found, allowed, sentence, *bad.values())


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
    down = [row for row in rows if sheet[row["run_id"]].direction != "extraction"]
    tare, force = (
        np.array([row[name] for row in down or rows], dtype=float)
        for name in ("tare_rms_N", "force_rms_N")
    )
    known = np.isfinite(tare) & (force > 0)
    ratio = tare[known] / force[known]
    if not ratio.size:
        return Check("rods", NOT_CHECKED, "no plate run has a tare")
    typical = float(np.median(ratio))
    found = f"a rod alone feels {typical:.3g} times what plate and rod feel (median of {ratio.size} runs)"
    said = (
        f"Logs of plates and rods look exchanged, or are the same ({found}): look at kind and tare_run of "
        "the run sheet."
    )
    return _judged("rods", typical < 1, found, "less than 1", said)


def same_readings(sheet: Mapping[str, Run], runs: pd.DataFrame) -> dict[str, tuple[str, ...]]:
    """Runs of a medium whose readings can be compared, each with those that have the same ones.

    Neither strokes of one log are copies nor rods: a tare that serves several runs is no repeat. The
    runs of a table are all in one file.
    """
    groups: dict[str, list[str]] = {}
    for name, digest in zip(runs["run_id"], runs["readings"], strict=True):
        if digest and sheet[name].kind in ("plate", "leg"):
            groups.setdefault(digest, []).append(name)

    def copies(one: Run, other: Run) -> bool:
        of_table = one.intruder == UNIT_AREA
        return one is not other and (of_table or one.force_log != other.force_log)

    return {
        name: tuple(other for other in group if copies(sheet[name], sheet[other]))
        for group in groups.values()
        for name in group
    }


def check_logs(sheet: Mapping[str, Run], logs: Mapping[str, tuple[str, ...]]) -> Check:
    """Whether two runs have the same readings under two names; `logs`: Of `same_readings`."""
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


# --- What the strokes show: surface, clocks, curvature, steadiness.


def check_surface(config: Config, medium: str, tables: Tables) -> Check:
    """Where stress begins, by lines with a free intercept: of pushes and of pulls, against the surface."""
    fits, speed = tables["fits"], config.arm.speed_cm_per_s
    if config.media[medium].role != "laboratory":
        why = "stress is a line only near the surface of a natural sand"
        return Check("surface", NOT_CHECKED, why)
    if flagged_with(fits, "no-tare").any():
        why = "the force on the rod, which begins elsewhere, is in it"
        return Check("surface", NOT_CHECKED, why)
    known = fits[(fits["gamma_deg"].abs() >= 45) & (fits["free_slope_z_N_per_cm3"].abs() > 0)]
    alpha, se = (known[f"alpha_z{end}_N_per_cm3"].to_numpy(float) for end in ("", "_se"))
    clear = np.abs(alpha) > _SIGMAS * se
    known = known[clear]
    start = -(known["intercept_z_N_per_cm2"] / known["free_slope_z_N_per_cm3"]).to_numpy(float)
    error = (se / np.abs(alpha))[clear] * known["depth_to_cm"].to_numpy(float)
    pushes = known["direction"].to_numpy() == "intrusion"
    down, down_se = _median(start[pushes])
    if math.isnan(down):
        return Check("surface", NOT_CHECKED, "too few pushes with a slope of their own")
    found = f"stress begins {10 * down:+.1f} mm below the surface in pushes"
    allowed = f"{10 * max(_OFF_CM, _SIGMAS * down_se):.1f} mm of either sign"
    sine = np.where(pushes, 1, -1) * np.abs(np.sin(np.radians(known["gamma_deg"].to_numpy(float))))
    (off, late), (off_se, late_se) = _offset_and_lag(sine, start, np.maximum(error, 0.1 * _OFF_CM))
    is_late = abs(late) > max(_OFF_CM, _SIGMAS * late_se)
    is_off = abs(off) > max(_OFF_CM, _SIGMAS * off_se)
    said = []
    if is_late and not is_off:
        late = float(np.median(start[pushes] / sine[pushes]))
    if is_late:
        found += f", {10 * (off * is_off - late):+.1f} mm in pulls straight up"
        said.append(
            f"The force log is {'late' if late > 0 else 'early'} against the motion log by about "
            f"{abs(late) / speed:.1g} s ({found}): look at the clocks and filters of both."
        )
    if is_off or (abs(down) > max(_OFF_CM, _SIGMAS * down_se) and not is_late):
        said.append(_surface_or_curve(known[pushes], found))
    return _judged("surface", not said, found, allowed, " ".join(said))


def _offset_and_lag(sine: FloatArray, start: FloatArray, error: FloatArray) -> FloatArray:
    """Start of the stress that all paths share, and what grows with the speed of sinking; errors.

    Returns shape (2, 2), cm; NaN where the paths do not tell the two apart.
    """
    design = np.stack([np.ones_like(sine), sine], axis=1) / error[:, None]
    power = design.T @ design
    if start.size < _FEW_RUNS + 1 or np.ptp(sine) < 0.2:
        return np.full((2, 2), math.nan)
    both_parts = np.linalg.solve(power, design.T @ (start / error))
    misfit = np.sum((start / error - design @ both_parts) ** 2) / (start.size - 2)
    return np.stack([both_parts, np.sqrt(np.diag(np.linalg.inv(power)) * max(1.0, misfit))])


def _median(values: FloatArray) -> tuple[float, float]:
    """Median of some runs and its standard error, from their scatter; NaN for fewer than three."""
    if values.size < _FEW_RUNS:
        return math.nan, math.nan
    middle = float(np.median(values))
    # 1.4826 makes a standard deviation of a median deviation, 1.2533 that of a median
    scatter = 1.4826 * float(np.median(np.abs(values - middle)))
    return middle, 1.2533 * scatter / math.sqrt(values.size)


def _surface_or_curve(pushes: pd.DataFrame, found: str) -> str:
    """Say what an offset of the stress comes from: an error of the surface, curvature, or either."""
    misfit = pushes["power_misfit_z_ratio"].dropna().to_numpy(float)
    surface = f"the surface is wrong ({found}): look at arm.surface_z_mm and surface_z_mm"
    share = float(np.mean(misfit > 1)) if misfit.size >= _FEW_RUNS else 0.5
    if share >= _SAME_MODEL or not misfit.size:
        return f"{surface[0].upper()}{surface[1:]}."
    curved = (
        f"Stress grows as about depth^{pushes['exponent_z'].median():.2f}, not in proportion to it"
    )
    if 1 - share >= _SAME_MODEL:
        return f"{curved} ({found}): a line through zero depends on its window."
    return f"{curved}, or {surface}. These logs do not tell the two apart."


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


def _percent(ratio: float) -> str:
    """A ratio in percent; one above 10, as of exchanged axes, as it is."""
    return f"{100 * ratio:.1f} %" if abs(ratio) <= 10 else f"{ratio:.3g}"
