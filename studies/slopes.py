"""What is told of the slopes of runs that no model of the program made: shared causes, axes, and two runs of a direction.

    make shared    sound campaigns, faults, their power by size and design, mounts that slip
    make axes      right, reversed and exchanged axes
    make pairs     wrong runs beside their repeat

Media: the published tables, left out of the known shapes; the same warped; 3D-RFT of small and of large friction; nine Fourier
terms off the generic ones. Each run has a bed of its own and noise; in the first four parts a patch of 3 %, angles and a surface, too.
"""

from __future__ import annotations

import math
import sys
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from types import SimpleNamespace
from typing import Any

import frame
import numpy as np
import pandas as pd
from frame import Part, Row, Tables, Unit
from scipy.interpolate import RegularGridInterpolator

from rftfit.campaign.sheet import Run
from rftfit.checks.declared import MediumMeasurements
from rftfit.checks.runs import check_repeats
from rftfit.checks.shared import CLEAR
from rftfit.compare.axes import axes_evidence
from rftfit.compare.causes import describe_change
from rftfit.compare.joint import ALL, JointModel, RunSlopes, find_causes
from rftfit.compare.misplaced import find_misplaced
from rftfit.compare.peers import compare_runs
from rftfit.directions import TOLERANCE_DEG
from rftfit.measure.alpha import column
from rftfit.measure.verdict_words import FAILED, PAIR, PASSED, PULLS
from rftfit.model.profiles import TableProfile
from rftfit.model.rft3d import alpha_3drft
from rftfit.reference import BETA_DEG, GAMMA_DEG, MEDIA, alpha_grid

Random = np.random.Generator
Alpha = Callable[[np.ndarray, np.ndarray], Any]
"""alpha_z and alpha_x by beta and gamma, rad."""

GENERIC = (0.206, 0.169, 0.212, 0.358, 0.055, -0.124, 0.253, 0.007, 0.088)


def nine_terms(random: Random, scatter: float) -> Alpha:
    """A medium of nine Fourier terms, each off the generic one by chance."""
    terms = np.array(GENERIC) * random.normal(1, scatter, 9)
    a00, a10, b11, b01, bm11, c11, c01, cm11, d10 = terms

    def alpha(beta: np.ndarray, gamma: np.ndarray) -> np.ndarray:
        z = a00 + a10 * np.cos(2 * beta) + b11 * np.sin(2 * beta + gamma)
        z = z + b01 * np.sin(gamma) + bm11 * np.sin(gamma - 2 * beta)
        x = c11 * np.cos(2 * beta + gamma) + c01 * np.cos(gamma)
        return np.stack([z, x + cm11 * np.cos(gamma - 2 * beta) + d10 * np.sin(2 * beta)])

    return alpha


# --- Campaigns with all errors of a laboratory


@dataclass(frozen=True)
class Campaign:
    """Runs of one medium; `without`: the published medium that the known shapes leave out."""

    kind: str
    beta: np.ndarray
    gamma: np.ndarray
    alpha: np.ndarray
    se: np.ndarray
    without: tuple[str, ...]

    @property
    def side(self) -> np.ndarray:
        """-1 for pulls, of which alpha_x is stored with the other sign."""
        return np.where(self.gamma < 0, -1.0, 1.0)

    def slopes(self, alpha: np.ndarray | None = None, **labels: np.ndarray) -> RunSlopes:
        """As the model takes them."""
        alpha = self.alpha if alpha is None else alpha
        order = np.arange(self.beta.size)
        return RunSlopes(self.beta, self.gamma, alpha, self.se, self.gamma < 0, order, labels)

    def first(self, count: int, alpha: np.ndarray) -> RunSlopes:
        """The first runs, whose alpha is given."""
        cut = replace(self, beta=self.beta[:count], gamma=self.gamma[:count], se=self.se[:, :count])
        return cut.slopes(alpha[:, :count])


KINDS = ("published", "warped", "frictional", "3D-RFT", "nine terms", "as measured")
"""Kinds of media; `published`: the tables made symmetric, as a profile has them; `as measured`: as they are printed."""


def table_as_measured(medium: str) -> Alpha:
    """Alpha of a published table between its cells, with what its bed and its mount did to one side."""
    tables = np.stack(alpha_grid(medium), axis=-1)
    lines = np.radians(BETA_DEG), np.radians(GAMMA_DEG)
    between = RegularGridInterpolator(lines, tables, bounds_error=False, fill_value=None)
    return lambda beta, gamma: between((beta, gamma)).T


def make_medium(kind: str, random: Random) -> tuple[Alpha, tuple[str, ...], float]:
    """Draw a medium: alpha of directions in degrees, whom to leave out, and alpha_z(0, 90 deg)."""
    size = float(10 ** random.uniform(-1.2, 0.3))
    name = str(random.choice(MEDIA))
    without = (name,) if kind in ("published", "warped", "as measured") else ()
    measured_alpha = table_as_measured(name)
    profile = TableProfile.published(name)
    friction = random.uniform(0.6, 1.2) if kind == "frictional" else random.uniform(0.1, 0.9)
    generic = nine_terms(random, 0.15)
    warp, pulls, along_x = random.normal(0, (0.10, 0.15, 0.15))
    level, fourth = random.normal(0, 0.08, 2)

    def shape(beta_deg: np.ndarray, gamma_deg: np.ndarray) -> np.ndarray:
        beta, gamma = np.radians(beta_deg), np.radians(gamma_deg)
        if kind in ("frictional", "3D-RFT"):
            return np.stack(alpha_3drft(beta, gamma, friction))
        if kind == "nine terms":
            return np.asarray(generic(beta, gamma))
        if kind == "as measured":
            return np.asarray(measured_alpha(beta, gamma))
        z, x = profile.alpha(beta, gamma)
        if kind == "published":
            return np.stack([z, x])
        common = 1 + warp * np.cos(2 * beta) + level * np.cos(gamma) ** 2
        common = (common + fourth * np.cos(4 * beta) / 2) * np.where(gamma < 0, 1 + pulls, 1.0)
        return np.stack([z * common, x * common * (1 + along_x)])

    top = float(shape(np.zeros(1), np.full(1, 90.0))[0, 0])
    return lambda beta, gamma: size * shape(beta, gamma) / top, without, size


def draw_design(
    random: Random, directions: int, repeats: int, is_sorted: bool, on_grid: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Directions of all runs in their order, degrees; the level plate straight down is one of them."""
    if on_grid:
        pool = [(b, g) for b in range(-90, 90, 15) for g in range(-90, 91, 15)]
        chosen = random.choice(len(pool), min(directions, len(pool)), replace=False)
        beta, gamma = np.array(pool, dtype=float)[chosen].T
    else:
        beta = np.round(random.uniform(-90, 90, directions))
        down = random.random(directions) < 0.7
        gamma = np.round(
            np.where(down, random.uniform(0, 90, directions), random.uniform(-90, 0, directions))
        )
    beta[0], gamma[0] = 0, 90
    if is_sorted:
        order = np.lexsort((gamma, beta))
        return np.repeat(beta[order], repeats), np.repeat(gamma[order], repeats)
    order = random.permutation(np.tile(np.arange(beta.size), repeats))
    return beta[order], gamma[order]


def make_campaign(
    kind: str,
    random: Random,
    directions: int | None = None,
    repeats: int | None = None,
    beds: float | None = None,
) -> Campaign:
    """Draw a sound campaign."""
    alpha, without, size = make_medium(kind, random)
    is_any = directions is None
    directions = directions or int(random.integers(12, 77))
    repeats = repeats or int(random.choice([1, 3]))
    is_sorted = bool(is_any and random.random() < 0.5)
    on_grid = bool(not is_any or random.random() < 0.5)
    beta, gamma = draw_design(random, directions, repeats, is_sorted, on_grid)
    count = beta.size
    bed = beds or random.uniform(0.03, 0.08)
    off_beta, off_gamma = random.normal(0, 0.3, count), random.normal(0, 0.2, count)
    slopes = alpha(beta + off_beta, gamma + off_gamma) * random.normal(1, bed, count)
    slopes += random.normal(0, 0.03, (2, count)) * np.hypot(*slopes)
    se = 0.003 * size * random.uniform(0.5, 1.5, (2, count))
    slopes += random.standard_normal((2, count)) * se
    # the surface of each run and of all: 0.5 mm over some 5 cm
    slopes = slopes * random.normal(1, 0.012, count) * random.normal(1, 0.012)
    return Campaign(kind, beta, gamma, slopes, se, without)


# --- False alarms


def grade_sound(seed: int, number: int) -> list[Row]:
    """Whether a sound campaign has a false alarm."""
    campaign = make_campaign(KINDS[number % len(KINDS)], np.random.default_rng([seed, number]))
    started = time.process_time()
    runs = campaign.slopes()
    causes, _ = find_causes(JointModel(runs, without=campaign.without))
    evidence = axes_evidence(runs, campaign.without)
    names = [f"r{run}" for run in range(runs.size)]
    fits = tabulate_fits(names, runs.beta_deg, runs.gamma_deg, runs.alpha, runs.se)
    misplaced = find_misplaced(runs, names, _sheet_of(names, runs), "medium", campaign.without)
    return [
        {
            "kind": campaign.kind,
            "misplaced": misplaced["log_bayes_factor"].max() if len(misplaced) else 0.0,
            "shared cause": bool(causes),
            "run apart": bool(compare_runs(fits, "medium")["apart"].any()),
            "axes": max(evidence.values()) > CLEAR,
            "seconds": time.process_time() - started,
            "causes": " ".join(f"{cause.cause.kind}/{cause.cause.group}" for cause in causes),
        }
    ]


def tabulate_fits(
    names: list[str],
    beta_deg: np.ndarray,
    gamma_deg: np.ndarray,
    alpha: np.ndarray,
    se: np.ndarray | float,
) -> pd.DataFrame:
    """Table of fits as the stages make it; alpha and its error of shape (2, runs)."""
    fits = pd.DataFrame({"run_id": names, "beta_deg": beta_deg, "gamma_deg": gamma_deg})
    for component, of_runs, errors in zip(
        "zx", alpha, np.broadcast_to(se, alpha.shape), strict=True
    ):
        fits[column(component)] = of_runs
        fits[column(component, "_se")] = errors
    return fits.assign(depth_from_cm=np.nan)


def _sheet_of(names: list[str], runs: RunSlopes) -> dict[str, Run]:
    """Run sheet of slopes without logs, in their order; a path downward or upward is that of a push."""
    sheet = {}
    for row, name in enumerate(names, 2):
        sheet[name] = Run(
            run_id=name,
            kind="plate",
            medium="m",
            intruder="plate",
            direction="intrusion",
            beta_deg=float(runs.beta_deg[row - 2]),
            gamma_deg=float(runs.gamma_deg[row - 2]),
            depth_cm=math.nan,
            force_log="",
            motion_log="",
            tare_run="",
            tare_shared=False,
            surface_z_mm=None,
            excluded=False,
            reason="",
            note="",
            row=row,
        )
    return sheet


ALARMS = {"shared cause": 0.01, "run apart": 0.02, "axes": 0.0}
"""Share of the sound campaigns that may have each false alarm."""


def report_sound(rows: pd.DataFrame) -> Tables:
    """False alarms by kind of medium, and the largest evidence for runs in wrong rows."""
    alarms = rows.groupby("kind", sort=False)[[*ALARMS]].sum()
    alarms.loc["all"] = alarms.sum()
    largest = rows["misplaced"].nlargest(3).to_frame("largest log Bayes factors of misplaced runs")
    return [
        (f"False alarms in {len(rows)} sound campaigns", alarms.reset_index()),
        ("Rows", largest),
    ]


def is_quiet(rows: pd.DataFrame) -> bool:
    """Whether false alarms are as rare as they must be."""
    return all(rows[name].sum() <= share * len(rows) for name, share in ALARMS.items())


PUSHES = np.array([*product(range(-75, 91, 15), range(30, 91, 15))], dtype=float).T


def grade_own(medium: str, design: str) -> list[Row]:
    """Turn and crosstalk that a published table has of itself, as the model of the runs without it sees them."""
    beta, gamma = PUSHES if design == "pushes" else papers_grid()
    alpha = table_as_measured(medium)(np.radians(beta), np.radians(gamma))
    se = np.full_like(alpha, 0.003 * np.abs(alpha).max())
    campaign = Campaign("as measured", beta, gamma, alpha, se, (medium,))
    scan = JointModel(campaign.slopes(), without=campaign.without).fit().scan()
    sizes = {
        cause.kind: size
        for cause, size in zip(scan.causes, scan.size, strict=True)
        if cause.group == ALL
    }
    return [
        {"design": design, "medium": medium, "turn": sizes["turn"], "crosstalk": sizes["crosstalk"]}
    ]


def report_own(rows: pd.DataFrame) -> Tables:
    """Turn and crosstalk of each table, and their root mean squares."""
    sizes = rows[["turn", "crosstalk"]]
    squares = (sizes**2).groupby(rows["design"]).mean()
    mean = (squares**0.5).reset_index()
    return [
        ("Turn, deg, and crosstalk that published tables have of themselves", rows),
        ("Root mean squares", mean),
    ]


# --- Faults


FAULTS = {
    "gain-1.1": (("gain",), 0.1),
    "gain-1.2": (("gain",), 0.2),
    "gain-1.4": (("gain",), 0.4),
    "trend-0.4": (("gain",), 0.4),
    "plate-0.75": (("gain",), -0.25),
    "session-1.15": (("gain",), 0.15),
    "session-1.3": (("gain",), 0.3),
    "mount-5": (("turn",), 5.0),
    "crosstalk-0.08": (("crosstalk", "turn"), 0.08),
}
"""Kinds of the cause by which each fault is told, and its size: of a gain the runs after over those before, less 1."""


def turn_mount(campaign: Campaign, degrees: float) -> np.ndarray:
    """Forces by a mount that is turned."""
    angle = np.radians(degrees) * campaign.side
    z, x = campaign.alpha
    return np.stack([z * np.cos(angle) + x * np.sin(angle), x * np.cos(angle) - z * np.sin(angle)])


def put_late(campaign: Campaign, share: float, faulty: np.ndarray) -> np.ndarray:
    """Alpha that is faulty from a share of the campaign on."""
    progress = np.arange(campaign.beta.size) / campaign.beta.size
    return np.where(progress >= share, faulty, campaign.alpha)


def put_fault(campaign: Campaign, fault: str, random: Random) -> RunSlopes:
    """The runs with a fault."""
    size, alpha = FAULTS[fault][1], campaign.alpha
    count = campaign.beta.size
    name = fault.partition("-")[0]
    if name == "session":
        wet = random.random(count) < 0.35
        labels = np.where(wet, "wet", "dry")
        return campaign.slopes(alpha * np.where(wet, 1 + size, 1.0), session=labels)
    if name == "trend":
        return campaign.slopes(alpha * (1 + size * np.arange(count) / count))
    if name == "mount":
        return campaign.slopes(put_late(campaign, 0.5, turn_mount(campaign, size)))
    if name == "crosstalk":
        return campaign.slopes(np.stack([alpha[0], alpha[1] + size * campaign.side * alpha[0]]))
    share = 0.7 if name == "plate" else 0.5
    return campaign.slopes(put_late(campaign, share, (1 + size) * alpha))


def grade_fault(seed: int, number: int, fault: str) -> list[Row]:
    """Whether a fault in 20 directions three times is told, by its cause, and whether its size is inside the interval."""
    random = np.random.default_rng([seed, number, len(fault)])
    kind = ("published", "warped", "3D-RFT")[number % 3]
    campaign = make_campaign(kind, random, 20, 3, 0.05)
    causes, _ = find_causes(
        JointModel(put_fault(campaign, fault, random), without=campaign.without)
    )
    kinds, size = FAULTS[fault]
    by_cause = [cause for cause in causes if cause.cause.kind in kinds]
    inside: object = np.nan
    if by_cause and by_cause[0].cause.kind == kinds[0]:
        low, high = describe_change(by_cause[0])[1:]
        # of a label the other one may be named
        if by_cause[0].cause.place == "dry":
            low, high = 1 / (1 + high) - 1, 1 / (1 + low) - 1
        inside = float(low <= size <= high)
    return [
        {"fault": fault, "told": bool(causes), "by its cause": bool(by_cause), "inside": inside}
    ]


def report_faults(rows: pd.DataFrame) -> Tables:
    """Campaigns of each fault, and those in which it is told."""
    groups = rows.groupby("fault", sort=False)
    table = groups[["told", "by its cause", "inside"]].sum()
    table["sized"] = groups["inside"].count()
    return [(f"Faults told, of {groups.size().max()} each", table.reset_index())]


DESIGNS = {
    "12 directions once": (12, 1),
    "20 directions once": (20, 1),
    "40 directions once": (40, 1),
    "76 directions once": (76, 1),
    "12 directions 3 times": (12, 3),
    "20 directions 3 times": (20, 3),
}
SIZES = {"gain": (0.05, 0.1, 0.15, 0.2, 0.3, 0.4), "turn": (2.0, 3.0, 5.0, 7.0, 10.0)}
"""Of a change of all forces from half on, and of a mount that is turned from half on, degrees."""


def find_fault_of(runs: RunSlopes, without: tuple[str, ...], kind: str | None = None) -> bool:
    """Whether a cause, of a kind where one is named, is told of the runs."""
    causes, _ = find_causes(JointModel(runs, without=without))
    return any(kind in (None, cause.cause.kind) for cause in causes)


def grade_power(seed: int, number: int, design: str, fault: str, size: float) -> list[Row]:
    """Whether a fault of one size is told by a design, in random order."""
    random = np.random.default_rng([seed, number, len(design)])
    kind = ("published", "warped", "frictional", "3D-RFT")[number % 4]
    campaign = make_campaign(kind, random, *DESIGNS[design], 0.05)
    faulty = (1 + size) * campaign.alpha if fault == "gain" else turn_mount(campaign, size)
    runs = campaign.slopes(put_late(campaign, 0.5, faulty))
    told = find_fault_of(runs, campaign.without)
    return [{"fault": fault, "design": design, "size": size, "told": told}]


def report_power(rows: pd.DataFrame) -> Tables:
    """Campaigns in which a fault is told, by its size and the design."""
    keys = ["fault", "size"]
    counts = rows.pivot_table("told", keys, "design", "sum", sort=False).astype(int)
    return [("Told from half of the campaign on", counts.reset_index())]


SLIPS_AT, SLIP_RUNS = 12, 60


def grade_slip(seed: int, number: int, degrees: float) -> list[Row]:
    """After how many further pushes a mount that slips is told, if within the campaign."""
    random = np.random.default_rng([seed, number])
    kind = ("published", "warped", "frictional", "3D-RFT")[number % 4]
    campaign = make_campaign(kind, random, 20, 3, 0.05)
    alpha = put_late(campaign, SLIPS_AT / campaign.beta.size, turn_mount(campaign, degrees))
    further = (
        count - SLIPS_AT
        for count in range(SLIPS_AT + 1, SLIP_RUNS + 1)
        if find_fault_of(campaign.first(count, alpha), campaign.without)
    )
    return [{"degrees": degrees, "further": next(further, np.nan)}]


def report_slips(rows: pd.DataFrame) -> Tables:
    """Campaigns in which the slip is told, and after how many pushes."""
    table = rows.groupby("degrees")["further"].agg(["size", "count", "median", "max"])
    return [(f"Slip at push {SLIPS_AT} of {SLIP_RUNS}, told after", table.reset_index())]


# --- Axes


BED, NOISE = 0.05, 0.01
WRONG_SHARE = 0.1
REVERSED = {
    "z reversed": [[-1, 0], [0, 1]],
    "x reversed": [[1, 0], [0, -1]],
    "exchanged": [[0, 1], [1, 0]],
}
AXES_OF = {"z reversed": "z-reversed", "x reversed": "x-reversed", "exchanged": "exchanged"}


def papers_grid() -> np.ndarray:
    """Beta and gamma of the runs of the paper's campaign in one medium, deg, shape (2, 90)."""
    angles_up = GAMMA_DEG[GAMMA_DEG > 0]
    gamma = np.concatenate([-angles_up, angles_up, np.zeros(3)])
    return np.array([angles.ravel() for angles in np.meshgrid(np.arange(-60.0, 91.0, 30.0), gamma)])


def drawn_directions(count: int, random: Random) -> np.ndarray:
    """Random directions, deg, shape (2, count), two thirds of them pushed down; the first is straight down."""
    beta = np.round(random.uniform(-90, 90, count))
    gamma = np.round(random.uniform(0, 90, count)) * np.where(random.random(count) < 2 / 3, 1, -1)
    beta[0], gamma[0] = 0, 90
    return np.stack([beta, gamma])


def make_runs(row: str, number: int, seed: int) -> tuple[RunSlopes, tuple[str, ...]]:
    """Runs of one campaign, and the published media that the known shapes leave out."""
    random = np.random.default_rng([seed, number, zlib.crc32(row.encode())])
    design, kind, change = row.split(", ")
    if design == "paper's grid":
        directions_deg = papers_grid()
    elif design == "3 x 3 pushed down":
        directions_deg = np.array([*product((-30.0, 0.0, 30.0), (30.0, 60.0, 90.0))]).T
    else:
        directions_deg = drawn_directions(int(design.split()[0]), random)
    without: tuple[str, ...] = ()
    if kind == "published":
        without = (MEDIA[number % len(MEDIA)],)
        medium: Alpha = TableProfile.published(without[0]).alpha
    elif kind == "3D-RFT":
        medium = partial(alpha_3drft, friction=random.uniform(0.2, 0.9))
    else:
        medium = nine_terms(random, 0.1)
    beta_deg, gamma_deg = directions_deg
    alpha = np.stack(medium(*np.radians(directions_deg)))
    if change == "x free":
        alpha[1] *= np.exp(random.normal(0, 0.4))
    elif change not in {"as it is", "wrong runs"}:
        scaled, factor = change.split(" x ")
        is_scaled = np.array([[False], [True]]) if scaled == "x" else gamma_deg < 0
        alpha *= np.where(is_scaled, float(factor), 1.0)
    count = beta_deg.size
    alpha = alpha * random.normal(1, BED, count)
    noise = NOISE * np.abs(alpha).max()
    alpha = alpha + noise * random.standard_normal(alpha.shape)
    if change == "wrong runs":
        alpha[:, random.choice(count, round(WRONG_SHARE * count), replace=False)] *= -1
    se = np.full_like(alpha, noise)
    return RunSlopes(beta_deg, gamma_deg, alpha, se, gamma_deg < 0, np.arange(count)), without


def take_runs(runs: RunSlopes, is_taken: np.ndarray) -> RunSlopes:
    """Some of the runs."""
    names = ("beta_deg", "gamma_deg", "mirrored", "order")
    of_runs = {name: getattr(runs, name)[is_taken] for name in names}
    return RunSlopes(alpha=runs.alpha[:, is_taken], se=runs.se[:, is_taken], **of_runs)


def best_rival(evidence: dict[str, float]) -> float:
    """Largest logarithm of the Bayes factor of other axes against the given ones."""
    return max(value for name, value in evidence.items() if name not in ("as-given", PULLS))


def sign_of_pulls(runs: RunSlopes, without: tuple[str, ...]) -> str:
    """What is said of the sign of beta in pulls."""
    evidence = axes_evidence(runs, without).get(PULLS, 0.0)
    return "wrong" if evidence > CLEAR else "right" if evidence < -CLEAR else "open"


def grade_axes(row: str, number: int, seed: int) -> list[Row]:
    """Verdict on the right axes, whether others are told, and the evidence by all runs less that by the best third."""
    runs, without = make_runs(row, number, seed)
    rival = best_rival(axes_evidence(runs, without))
    verdict = "unusable" if rival > CLEAR else "open" if rival > -CLEAR else "passed"
    answer: Row = {"row": row, "verdict": verdict}
    for name, matrix in REVERSED.items():
        evidence = axes_evidence(replace(runs, alpha=np.array(matrix) @ runs.alpha), without)
        best = max(evidence, key=lambda axes: evidence[axes])
        answer[name] = best == AXES_OF[name] and evidence[best] > CLEAR
    beta_deg = np.where(runs.gamma_deg < 0, -runs.beta_deg, runs.beta_deg)
    answer["pulls"] = sign_of_pulls(runs, without)
    answer["pulls reversed"] = sign_of_pulls(replace(runs, beta_deg=beta_deg), without)
    third = np.arange(runs.beta_deg.size) % 3
    thirds = [take_runs(runs, third == number) for number in range(3)]
    best_third = min(best_rival(axes_evidence(part, without)) for part in thirds)
    return [answer | {"not below a third": rival <= best_third + 0.5}]


ROWS = (
    "paper's grid, nine terms, as it is",
    "25 directions, nine terms, as it is",
    "44 directions, nine terms, as it is",
    "3 x 3 pushed down, nine terms, as it is",
    "paper's grid, published, as it is",
    "25 directions, published, as it is",
    "paper's grid, 3D-RFT, as it is",
    "paper's grid, nine terms, x free",
    "25 directions, nine terms, x free",
    "44 directions, nine terms, x free",
    "paper's grid, nine terms, x x 0.5",
    "paper's grid, nine terms, x x 2",
    "paper's grid, nine terms, pulls x 0.5",
    "paper's grid, nine terms, pulls x 2",
    "paper's grid, nine terms, wrong runs",
    "25 directions, nine terms, wrong runs",
)


def report_axes(rows: pd.DataFrame) -> Tables:
    """Verdicts on right axes, wrong axes that are told, and what is said of the sign of beta in pulls."""
    names = pd.unique(rows["row"])
    verdicts = pd.crosstab(rows["row"], rows["verdict"]).reindex(names)
    verdicts = verdicts.reindex(columns=["passed", "open", "unusable"], fill_value=0)
    told = rows.groupby("row")[[*REVERSED, "not below a third"]].sum().reindex(names)
    table = pd.concat([verdicts, told], axis=1)
    pulls = [
        pd.crosstab(rows["row"], rows[name]).add_prefix(f"{name}: ")
        for name in ("pulls", "pulls reversed")
    ]
    return [
        (f"Axes, of {len(rows) // len(names)} campaigns", table.reset_index()),
        ("Sign of beta in pulls", pd.concat(pulls, axis=1).reindex(names).reset_index()),
    ]


# --- Two runs of a direction


DIRECTIONS, PAIR_NOISE, WET = 20, 0.003, 1.5
BEDS = ("3 % normal", "5 % normal", "8 % normal", "3 % t5", "5 % t5")
PAIR_FAULTS = (
    "none",
    "one filed elsewhere",
    "two exchanged",
    "wet in 4 of 40",
    "middle third x 1.3",
)
OFF = 0.2
"""Error of a cell, relative to its alpha, that must not pass in silence."""


def draw_beds(name: str, count: int, random: Random) -> np.ndarray:
    """Factors of beds, shape (count,), whose standard deviation is as named."""
    size, kind = float(name.split(maxsplit=1)[0]) / 100, name.split()[2]
    normals = random.standard_normal(count)
    return 1 + size * (random.standard_t(5, count) / np.sqrt(5 / 3) if kind == "t5" else normals)


def true_alpha(number: int, directions_deg: np.ndarray, random: Random) -> np.ndarray:
    """Alpha of the directions, z and x, of one of seven kinds of media."""
    angles = np.radians(directions_deg)
    kind = number % 7
    if kind < len(MEDIA):
        return np.stack(TableProfile.published(MEDIA[kind]).alpha(*angles))
    if kind == len(MEDIA):
        return np.stack(alpha_3drft(angles[0], angles[1], random.uniform(0.2, 0.9)))
    return np.stack(nine_terms(random, 0.1)(*angles))


def as_measured(fits: pd.DataFrame, peers: pd.DataFrame) -> MediumMeasurements:
    """What the check of repeats reads, of slopes without logs."""
    config = SimpleNamespace(grid=SimpleNamespace(angle_tolerance_deg=TOLERANCE_DEG))
    sheet = {
        run_id: SimpleNamespace(run_id=run_id, row=row, kind="plate")
        for row, run_id in enumerate(fits["run_id"])
    }
    tables = {"fits": fits, "peers": peers}
    return MediumMeasurements(config, SimpleNamespace(), sheet, tables, {})  # type: ignore[arg-type]


def put_pair_fault(
    fault: str, sizes: np.ndarray, random: Random
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direction whose alpha each run has, its factor, and the wrong runs; sizes of alpha by run."""
    count = sizes.size
    filed, factor = np.arange(count), np.ones(count)
    wrong = np.zeros(0, dtype=int)
    strong = np.flatnonzero(sizes > 0.3 * sizes.max())
    if fault == "one filed elsewhere":
        wrong = random.choice(strong, 1)
        filed[wrong] = random.choice(np.setdiff1d(strong % DIRECTIONS, wrong % DIRECTIONS))
    elif fault == "two exchanged":
        wrong = random.choice(strong[strong < DIRECTIONS], 2, replace=False)
        filed[wrong] = wrong[::-1]
    elif fault == "wet in 4 of 40":
        wrong = random.choice(count, 4, replace=False)
        factor[wrong] = WET
    elif fault == "middle third x 1.3":
        wrong = np.flatnonzero(np.abs(random.permutation(count) - count / 2) < count / 6)
        factor[wrong] = 1.3
    return filed, factor, wrong


def grade_pairs(fault: str, beds: str, number: int, seed: int) -> list[Row]:
    """Whether a campaign passes, its wrong runs are told and named first, and it is silent over a wrong cell."""
    random = np.random.default_rng([seed, number, zlib.crc32(f"{beds} {fault}".encode())])
    directions_deg = drawn_directions(DIRECTIONS, random)
    truth = np.tile(true_alpha(number, directions_deg, random), 2)
    sizes = np.hypot(*truth)
    filed, factor, wrong = put_pair_fault(fault, sizes, random)
    alpha = truth[:, filed] * factor * draw_beds(beds, sizes.size, random)
    noise = PAIR_NOISE * np.abs(alpha).max()
    alpha = alpha + noise * random.standard_normal(alpha.shape)
    names = [f"r{run}" for run in range(sizes.size)]
    beta_deg, gamma_deg = np.tile(directions_deg, 2)
    fits = tabulate_fits(names, beta_deg, gamma_deg, alpha, noise)
    peers = compare_runs(fits, "medium")
    apart = peers["apart"].to_numpy(bool)
    check = check_repeats(as_measured(fits, peers))
    means = alpha.reshape(2, 2, DIRECTIONS).mean(axis=1)
    off = np.hypot(*(means - truth[:, :DIRECTIONS])) / sizes[:DIRECTIONS]
    cells_off = (off > OFF) & (sizes[:DIRECTIONS] > 0.3 * sizes.max())
    is_told_cell = apart.reshape(2, DIRECTIONS).any(axis=0)
    failed = check.verdict == FAILED
    told = failed and (check.code == "repeats-wide" or bool(apart[wrong].any()))
    answer: Row = {
        "fault": fault,
        "beds": beds,
        "passed": float(check.verdict == PASSED),
        "failed": float(failed),
        "told": float(told) if wrong.size else np.nan,
        "silent over": float(cells_off.any() and not failed),
        "unnamed": float((cells_off & ~is_told_cell).any()),
        "named first": np.nan,
    }
    pairs = peers[(peers["beside"] == PAIR) & apart]
    if fault == "one filed elsewhere" and apart[wrong].any() and len(pairs):
        distance = np.hypot(pairs["off_z_ratio"].to_numpy(), pairs["off_x_ratio"].to_numpy())
        answer["named first"] = float(pairs.index[distance.argmax()] == wrong[0])
    return [answer]


def report_pairs(rows: pd.DataFrame) -> Tables:
    """Percent of the campaigns, by fault and beds."""
    columns = ["passed", "failed", "told", "silent over", "unnamed", "named first"]
    table = 100 * rows.groupby(["fault", "beds"], sort=False)[columns].mean()
    return [("Two runs of a direction, %", table.round(0).reset_index())]


def of_faults(count: int, seed: int) -> list[Unit]:
    """Campaigns of each fault."""
    return [(seed, number, fault) for fault in FAULTS for number in range(count)]


def of_sizes(count: int, seed: int) -> list[Unit]:
    """Campaigns of each design, fault and size."""
    faults = [(fault, size) for fault, sizes in SIZES.items() for size in sizes]
    designs = product(DESIGNS, faults, range(count))
    return [(seed, number, design, *fault) for design, fault, number in designs]


def of_slips(count: int, seed: int) -> list[Unit]:
    """Campaigns of each turn of the mount."""
    return [
        (seed, number, degrees) for degrees in (0.0, 5.0, 10.0, 20.0) for number in range(count)
    ]


PARTS = {
    "sound": Part(
        lambda count, seed: [(seed, number) for number in range(count)],
        grade_sound,
        report_sound,
        200,
        is_quiet,
    ),
    "own": Part([*product(MEDIA, ("pushes", "paper's grid"))], grade_own, report_own),
    "faults": Part(of_faults, grade_fault, report_faults, 30),
    "power": Part(of_sizes, grade_power, report_power, 20),
    "slips": Part(of_slips, grade_slip, report_slips, 20),
    "axes": Part(
        lambda count, seed: [(row, number, seed) for row in ROWS for number in range(count)],
        grade_axes,
        report_axes,
        40,
    ),
    "pairs": Part(
        lambda count, seed: [
            (fault, beds, number, seed)
            for fault, beds, number in product(PAIR_FAULTS, BEDS, range(count))
        ],
        grade_pairs,
        report_pairs,
        100,
    ),
}

if __name__ == "__main__":
    sys.exit(frame.run_study(__doc__, PARTS))
