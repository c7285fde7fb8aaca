"""The methods section of the page, ready to paste, with its references, the constants and the digest of the settings.

`paragraphs` writes three paragraphs: measurement, model, predictions. Each function ``_describe_...`` writes one or
several sentences from config and tables, or nothing where the campaign has nothing to say; "ref. N" cites an entry of
`cited_references`. An outcome counts runs with and without a result (`rftfit.page.outcome`).

`Results` is a campaign with its tables: `results.table(name)` reads a table below ``results/``; `results[medium]` has
those of one medium: ``alpha`` (a row a direction), ``fits`` (a row a plate run), ``flags`` (doubts on runs).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from rftfit.campaign.config import Config, Disc, FlatOutline, Leg, Plate
from rftfit.directions import is_straight_down
from rftfit.figures import labels
from rftfit.figures.style import format_number, level
from rftfit.forces.limits import beyond_measured
from rftfit.forces.model_error import LEAST_LOAD, LENGTH_DEG
from rftfit.forces.motion import rotation
from rftfit.forces.outlines import ELEMENTS, leg_outline
from rftfit.measure.depths import curved_law, steep_pushes
from rftfit.measure.errors import (
    AS_PREPARED,
    ASSUMED,
    FEW_REPEATS,
    OF_CELL,
    STATED,
    USUAL_BED_SPREAD,
)
from rftfit.measure.slopes import FEWEST
from rftfit.model.maps import STEP_DEG
from rftfit.model.profiles import EPS
from rftfit.model.scaling import GENERIC, published
from rftfit.model.shapes import FRICTIONS, TILT_SHARE, published_shapes
from rftfit.page.cells import ALPHA_DIGITS
from rftfit.page.findings import list_in_words
from rftfit.page.live import has_scale_of_map, scaled_from_print
from rftfit.page.outcome import Outcome
from rftfit.results import Results
from rftfit.robot.sweep import RANGE_IN_VIEW
from rftfit.store.digests import digest_of
from rftfit.store.environment import versions
from rftfit.store.text import count
from rftfit.version import __version__


def settings_digest(config: Config) -> str:
    """Compute the digest of all values of the configuration; comments and the order of keys do not count.

    The methods state it, so that two campaigns with the same settings can be told from others.
    """
    return digest_of(config.model_dump(mode="json"))


def cited_references(paragraphs: Iterable[str]) -> list[tuple[int, str]]:
    """List the references that the paragraphs cite, with their numbers; numbers of others are left out, not closed up."""
    entries = f"""
C. Li, T. Zhang, D. I. Goldman, A terradynamics of legged locomotion on granular media, \
Science 339, 1408-1412 (2013), doi:10.1126/science.1229163
The rftfit developers, rftfit: force-transducer logs to resistive-force models of granular media, \
version {__version__}
E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, HAR inference: recommendations for practice, \
J. Bus. Econ. Stat. 36, 541-559 (2018), doi:10.1080/07350015.2018.1506926
F. M\N{LATIN SMALL LETTER O WITH DIAERESIS}lder et al., Sustainable data analysis with Snakemake, \
F1000Research 10, 33 (2021), doi:10.12688/f1000research.29032.2
C. R. Harris et al., Array programming with NumPy, Nature 585, 357-362 (2020), \
doi:10.1038/s41586-020-2649-2
P. Virtanen et al., SciPy 1.0: fundamental algorithms for scientific computing in Python, \
Nature Methods 17, 261-272 (2020), doi:10.1038/s41592-019-0686-2
S. Agarwal, D. I. Goldman, K. Kamrin, Mechanistic framework for reduced-order models in soft materials: application to \
three-dimensional granular intrusion, Proc. Natl. Acad. Sci. USA 120, e2214017120 (2023), \
doi:10.1073/pnas.2214017120
"""
    cited = {int(number) for number in re.findall(r"ref\. (\d+)", " ".join(paragraphs))}
    numbered_entries = enumerate(entries.strip().split("\n"), 1)
    return [(number, entry) for number, entry in numbered_entries if number in cited]


def paragraphs(results: Results, outcome: Outcome) -> list[str]:
    """Write the methods section from the configuration and the numbers of this campaign: three paragraphs.

    `outcome`: Runs with and without a result. The third paragraph is on forces on legs, the map, the robot and
    software.
    """
    robot = _describe_robot(results)
    predictions = (
        _describe_forces_on_legs(results),
        _describe_map(results, robot),
        robot,
        _describe_software(results),
    )
    return [
        _describe_measurement(results, outcome),
        _describe_model(results),
        " ".join(filter(None, predictions)),
    ]


def _describe_measurement(results: Results, outcome: Outcome) -> str:
    """Write the first paragraph of the methods: media, runs, tare, slopes and intervals of alpha.

    A campaign may have logs, a table of stress against depth, or a table of alpha: the last two have no plates to
    describe, and a table of alpha no slopes.
    """
    config, fits = results.config, results.joined("fits/{medium}.csv")
    fitted_runs = fits[fits["reason"] == ""] if "reason" in fits else fits
    media = count(len(results.media), "granular medium", "granular media")
    dropped, excluded = outcome.count_lost(excluded=False), outcome.count_lost(excluded=True)
    lost = [f"{excluded} excluded"] * (excluded > 0) + [f"{dropped} dropped"] * (dropped > 0)
    lost_text = f" and {' and '.join(lost)}" if lost else ""
    runs_sentence = (
        f"{count(outcome.runs_used, 'run was', 'runs were')} used"
        f"{labels.in_brackets(_count_runs_by_kind(outcome))}{lost_text}."
    )
    if config.table is not None and config.table.holds == "alpha":
        return (
            f"The stress per depth alpha(beta, gamma) (ref. 1) of {media} was taken from a table, "
            f"{config.run_sheet}: {outcome.runs_used} values. {_describe_intervals(results)}"
        )
    slope = (
        f"The stress per depth alpha(beta, gamma) (ref. 1) is {_LAWS[config.fit.law]}{_describe_window(results, fitted_runs)}."
        f"{_describe_curved_stress(results)}"
    )
    if config.table is not None:
        return (
            f"Stress on a plate against depth in {media} was taken from a table, {config.run_sheet}. "
            f"{runs_sentence} {slope} {_describe_intervals(results)}"
        )
    subtracted = "The force on rod and mount alone, recorded without a plate, was subtracted"
    nothing = "No force on rod and mount alone was recorded, so none was subtracted"
    tare = _choose_tare_sentence(results, "plate", fits, subtracted, nothing)
    box, arm = config.container, config.arm
    is_speed_stated = arm.drive == "steady" and "speed_cm_per_s" in arm.model_fields_set
    ground = (
        "in open ground"
        if box.is_open
        else f"in a container of {box.length_cm:g} x {box.width_cm:g} cm^2 and {box.depth_cm:g} cm depth"
    )
    table_of_gauges = config.force_log.calibration
    calibration = ""
    if table_of_gauges is not None:
        calibration = f" Loads were computed from the gauges of the transducer by {config.raw}/{table_of_gauges}."
    experiment = (
        f"Stresses on {_describe_plates(results)} were {_name_origin(results)} in {media} {ground}"
        f"{f', at {arm.speed_cm_per_s:g} cm/s' if is_speed_stated else ''}. {runs_sentence}{_describe_directions(results)}"
        f"{calibration}"
    )
    if results.joined("alpha/{medium}.csv")["alpha_z_N_per_cm3"].isna().all():
        return experiment  # no run gave a number, so tare, slopes and intervals are not described
    return f"{experiment} {tare} {slope} {_describe_intervals(results)}"


_KINDS = {
    "plate": "of a plate",
    "rod": "of rod and mount alone",
    "leg": "of a leg",
    "leg_air": "of a leg in air",
    "robot": "of the robot",
}
"""Words for kinds of runs, in the order of the sentence."""


def _count_runs_by_kind(outcome: Outcome) -> str:
    """Write how many used runs there are of each kind; empty where all are of one kind."""
    counts = [
        f"{number} {name}"
        for kind, name in _KINDS.items()
        if (number := outcome.used_by_kind[kind])
    ]
    return list_in_words(counts) if len(counts) > 1 else ""


def _describe_directions(results: Results) -> str:
    """Say in how many directions (beta, gamma) alpha was measured, and by how many runs each; ranges over all media."""
    tolerance_deg = results.config.grid.angle_tolerance_deg
    counts: set[int] = set()
    repeats: set[int] = set()
    repeats_down: set[int] = set()
    level_depths: set[int] = set()
    for medium in results:
        cells = medium.alpha.dropna(subset="alpha_z_N_per_cm3")
        is_down = is_straight_down(cells["beta_deg"], cells["gamma_deg"], tolerance_deg)
        counts.add(len(cells))
        # level runs at several depths are one line through zero, not repeats; runs of each depth may have a fraction
        runs_of_depth = cells["n_runs"] / cells["n_depths"].fillna(1).clip(lower=1)
        repeats |= {*np.floor(runs_of_depth).astype(int), *np.ceil(runs_of_depth).astype(int)}
        level_depths |= {*cells.loc[cells["n_depths"] > 1, "n_depths"].astype(int)}
        repeats_down |= {*cells["n_runs"][is_down].astype(int)}
    if not repeats:
        return ""
    how_many, how_often = _format_range(counts), _format_range(repeats)
    in_each_medium = " in each medium" if len(results.media) > 1 else ""
    in_each_direction = " in each direction" if counts != {1} else ""
    # alpha straight down is quoted most, so its repeats are stated where they are not those of all directions
    how_often_down = ""
    if repeats_down and repeats_down != repeats:
        how_often_down = f" ({_format_range(repeats_down)} straight down)"
    at_each_depth = ""
    if level_depths:
        at_each_depth = f", of level motion at each of {_format_range(level_depths)} depths"
    return (
        f" Alpha was {_name_origin(results)} in {how_many} direction{'s' * (counts != {1})} (beta, gamma){in_each_medium}, with "
        f"{how_often} run{'s' * (repeats != {1})}{in_each_direction}{how_often_down}{at_each_depth}."
    )


def _format_range(counts: set[int]) -> str:
    """Write the range of one number or more, such as "2 to 5", or one number where all are equal."""
    least, largest = min(counts), max(counts)
    return str(least) if least == largest else f"{least} to {largest}"


def _name_origin(results: Results) -> str:
    """Say whether forces were measured or simulated."""
    if results.campaign.reenacted:
        return "simulated from published results, not measured,"
    return "measured"


def _describe_plates(results: Results) -> str:
    """Write the sizes of the plates that were pushed, by the form of each: plate, disc, or flat outline."""
    used_plates = {run.intruder for run in results.campaign.runs if run.kind == "plate"}
    sizes = []
    for name, intruder in results.config.intruders.items():
        if name not in used_plates:
            continue
        size = name
        if isinstance(intruder, Plate):
            size = f"{intruder.length_cm:g} x {intruder.width_cm:g} cm^2, {intruder.thickness_cm:g} cm thick"
        elif isinstance(intruder, Disc):
            size = f"a disc of {intruder.diameter_cm:g} cm, {intruder.thickness_cm:g} cm thick"
        elif isinstance(intruder, FlatOutline):
            size = (
                f"{intruder.area_cm2:g} cm^2, {intruder.length_cm:g} cm in the plane of the motion, "
                f"{intruder.thickness_cm:g} cm thick"
            )
        sizes.append(size)
    return f"{'a flat plate' if len(sizes) == 1 else 'flat plates'} ({'; '.join(sizes)})"


def _describe_window(results: Results, fits: pd.DataFrame) -> str:
    """Say over which depths slopes were fitted, as the end of a sentence; empty where nothing is known.

    For slanted pushes, pushes into natural sands, and horizontal runs, as far as there are any. `fits`: Fitted runs.
    """
    config = results.config
    fit, parts = config.fit, []
    plates = [run for run in results.campaign.runs if run.kind == "plate"]
    if any(run.direction != "horizontal" and run.medium in results.laboratory for run in plates):
        lower_limit = f"from {fit.submergence_cm:g} cm" if fit.submergence_cm is not None else ""
        upper_limit = f"to {fit.max_depth_cm:g} cm" if fit.max_depth_cm is not None else ""
        stated = " ".join(filter(None, (lower_limit, upper_limit)))
        if config.table is not None:
            parts.append(stated and f"over depths {stated}")
        else:
            phrases = [f"over depths {stated}" if stated else "over the depths"]
            phrases += [] if lower_limit else ["at which the plate was wholly submerged"]
            limits = ["walls"] * (not config.container.is_open) + ["bottom"] * (not upper_limit)
            if limits:
                clear = f"further than {fit.wall_clearance_cm:g} cm from"
                phrases.append(f"and {clear} {' and '.join(limits)}")
            parts.append(" ".join(phrases))
    fitted = set(fits["medium"]) if len(fits) else ()
    sands = [
        f"{medium.title} down to {medium.linear_to_cm:g} cm"
        for name, medium in config.media.items()
        if medium.linear_to_cm is not None and name in fitted
    ]
    if sands:
        parts.append(f"of a push into {', '.join(sorted(sands))}")
    horizontal = fits[fits["direction"] == "horizontal"] if len(fits) else fits
    if len(horizontal):
        depths = sorted({f"{depth:.1f}" for depth in horizontal["depth_from_cm"]}, key=float)
        parts.append(
            f"for horizontal motion, of the steady mean stress over depth at {', '.join(depths)} cm"
        )
    joined = "; ".join(filter(None, parts))
    return f", {joined}" if joined else ""


_LAWS = {
    "through_zero": "the zero-intercept least-squares slope of stress over depth",
    "free_intercept": "the least-squares slope of stress over depth, with a free intercept",
}
"""Words for `fit.law` of the config."""


def _describe_curved_stress(results: Results) -> str:
    """Say in which media stress is not proportional to depth, and how far it departs from the line through zero.

    Forces are predicted by alpha times depth all the same, so they are off by this departure. With a space before;
    empty where there is no such medium.
    """
    curved = []
    for medium in results:
        steep = steep_pushes(medium.fits)
        law = curved_law(
            medium.fits,
            results.table(f"checks/{medium.name}.csv"),
            results.config.grid.angle_tolerance_deg,
        )
        if law is None:
            continue
        if law.law != "power":
            curved.append(f"in {medium.title} as {law} (median of {len(steep)} pushes)")
            continue
        power = law.power
        top, deep = float(steep["depth_from_cm"].median()), float(steep["depth_to_cm"].median())
        # slope of the line through zero that fits z^p by least squares over the window, of evenly spaced depths:
        # the integral of z^(p + 1) over that of z^2
        slope = (deep ** (power + 2) - top ** (power + 2)) / (power + 2) * 3 / (deep**3 - top**3)
        # z^(p - 1) over this slope is the stress over that of the line
        departures = [
            f"{100 * (depth ** (power - 1) / slope - 1):+.0f} % at {depth:.1f} cm"
            for depth in (max(top, 0.25 * deep), 0.5 * deep, deep)
        ]
        curved.append(
            f"in {medium.title} as depth to the power of {power:.2f} (median of {len(steep)} pushes), so that "
            f"forces by alpha times depth are off by what stress differs from the line: {', '.join(departures)}"
        )
    return f" Stress does not grow in proportion to depth: {'; '.join(curved)}." if curved else ""


def _describe_intervals(results: Results) -> str:
    """Say which errors the intervals of alpha hold, and which they do not hold, since the config states that they are 0."""
    zero_errors = labels.names_of_zero_errors(results)
    left_out = f" The config states as 0, so that no interval holds, the errors of: {zero_errors}."
    return _describe_held_errors(results) + left_out * bool(zero_errors)


def _describe_held_errors(results: Results) -> str:
    """Say which errors the intervals of alpha hold in this campaign: of readings, of the setup, and the spread of runs.

    The last one depends on where it is from, which column ``spread`` of the table of alpha names for each direction.
    """
    intervals = f"{level(results)} intervals of alpha"
    tables = results.joined("alpha/{medium}.csv")
    cells_with_error = tables[tables["alpha_z_se_N_per_cm3"].notna()]
    if cells_with_error.empty:
        return "No error of alpha is stated, so nothing here has an interval that holds it."
    if results.config.table is not None and results.config.table.holds == "alpha":
        opening = f"{intervals} are made from the standard errors that the table states"
    else:
        runs = results.joined("runs/{medium}.csv")
        has_clock_errors = (runs["clock_se_s"] > 0).any()
        errors = " and add the errors of the force zero" if not results.campaign.numbers else ""
        errors += " and of the clocks" if has_clock_errors and errors else ""
        treatment = "allow for the correlation of successive samples (ref. 3)"
        points = results.joined("fits/{medium}.csv")["n_points"]
        if results.config.table is not None and (points < FEWEST).all():
            treatment = f"take the depths of a direction, fewer than {FEWEST}, as independent"
        opening = f"{intervals} {treatment}{errors}{_describe_named_errors(cells_with_error, results.config.grid.angle_tolerance_deg)}"
    kinds = set(cells_with_error["spread"])
    assumed = f"{100 * USUAL_BED_SPREAD:g} %"
    if kinds == {AS_PREPARED}:
        return f"{opening}; they do not include the scatter between beds, as the config states."
    if OF_CELL in kinds:
        others_phrase = ""
        if ASSUMED in kinds:
            others_phrase = f"; the others hold an assumed spread of {assumed}"
        elif AS_PREPARED in kinds:
            others_phrase = "; the others do not include the scatter between beds"
        return f"{opening}, and hold the scatter of the runs of a direction that was repeated{others_phrase}."
    spreads = cells_with_error["run_to_run_z_N_per_cm3"]
    size = f"{format_number(spreads.median(), ALPHA_DIGITS)} N/cm^3" + " (median)" * (
        len(spreads) > 1
    )
    treatment = "pooled from repeats, where there are enough"
    if FEW_REPEATS in kinds:
        treatment = f"an assumed {assumed}, moderated by few repeats"
    if kinds <= {STATED, ASSUMED}:
        treatment = (
            "as stated" if kinds == {STATED} else f"assumed to be {assumed}, for want of repeats"
        )
    return f"{opening}, and the spread from run to run ({treatment}; its standard deviation in alpha_z is {size})."


_ERROR_PHRASES = {
    "surface": "of the free surface in each run",
    "session": "of the free surface and the clocks common to all runs",
    "angle": "of the angles",
    "turn": "of the turn of the mount",
    "curvature": "of a stress that is no straight line",
}
"""Words for errors of alpha by their name in the columns of the table of alpha."""


def _describe_named_errors(cells_with_error: pd.DataFrame, tolerance_deg: float) -> str:
    """Write the errors of alpha that no single log shows, each by its largest share of alpha_z(0, 90 deg) in any direction.

    `cells_with_error`: Rows of the tables of alpha of all media. `tolerance_deg`: By how much a push may be off
    straight down. Errors without a column, or too small to be written, are left out.
    """
    is_down = is_straight_down(
        cells_with_error["beta_deg"], cells_with_error["gamma_deg"], tolerance_deg
    )
    down = cells_with_error[is_down].groupby("medium")["alpha_z_N_per_cm3"].first()
    reference_alpha = cells_with_error["medium"].map(down)
    error_texts: list[str] = []
    for name, phrase in _ERROR_PHRASES.items():
        columns = [f"alpha_{c}_{name}_N_per_cm3" for c in "zx"]
        if not {*columns} <= {*cells_with_error}:
            continue
        share = float(cells_with_error[columns].div(reference_alpha, axis=0).abs().max().max())
        if share >= 0.0005:  # a smaller share would be written as 0.0 %
            of_alpha = "" if error_texts else " of alpha_z(0, 90 deg) in any direction"
            size = "" if error_texts else "standard error "
            error_texts.append(f"{phrase} ({size}at most {100 * share:.1f} %{of_alpha})")
    if not error_texts:
        return ""
    return f", and hold the error{'s' * (len(error_texts) > 1)} {list_in_words(error_texts)}"


def _choose_tare_sentence(
    results: Results, kind: str, table: pd.DataFrame, subtracted: str, nothing: str
) -> str:
    """Say whether tares were subtracted from the runs of a table that gave a number.

    `kind`: ``plate`` or ``leg``. `table`: A row a run, or a row a reading of a run. `subtracted`, `nothing`: Sentences
    for runs with and without a tare, without full stop.
    """
    if "reason" in table:
        table = table[table["reason"] == ""]
    run_ids = {*table["run_id"]}
    flagged = {run_id for medium in results for run_id in medium.flags.runs_with("no-tare")}
    with_tare = {run.run_id for run in results.campaign.runs if run.tare_run} - flagged
    if not run_ids & with_tare:
        if results.config.fit.missing_tare == "none":
            return f"The forces are those on the {kind} alone, so nothing was subtracted."
        return f"{nothing}."
    untared = len(run_ids & flagged)
    exception = f", save for {count(untared, 'run')} without such a recording" if untared else ""
    return f"{subtracted}{exception}."


def _describe_model(results: Results) -> str:
    """Write the second paragraph of the methods: the nine-term fit, its generic coefficients, and the scaling.

    Without a fit only the scaling, or that there was no fit.
    """
    fourier = results.config.fourier
    scaling = _describe_scaling(results)
    coefficients = labels.of_method(results, "coefficients.csv").dropna(subset="value_N_per_cm3")
    if coefficients.empty:
        return scaling or (
            "No medium was measured in the directions that it needs, so no Fourier series was fitted."
        )
    averaged_media = labels.usable_media(
        results, dict.fromkeys(coefficients.loc[coefficients["medium"] != GENERIC, "medium"])
    )
    generic = (
        f", and the generic coefficients are the mean over {len(averaged_media)} media of their coefficients over their zeta"
        if len(averaged_media) > 1
        else ""
    )
    intervals = (
        f" Intervals are percentiles of {fourier.draws} parametric bootstrap draws (seed {fourier.seed})."
        if coefficients["lo"].notna().any()
        else ""
    )
    media_of_maps = [
        results.titles[medium] for medium in results.laboratory if has_scale_of_map(results, medium)
    ]
    zeta_of_maps = (
        f" The pushes into {list_in_words(media_of_maps)} leave directions of the published grid out: there zeta is that of the map, "
        "whose nine terms are fitted in all directions."
        if media_of_maps
        else ""
    )
    fit_method = (
        "least squares at the true angles, one weight for each measured direction (repeats pooled, beta = "
        "-90 and 90 deg one direction, a mirror image only where it was measured too)"
        if fourier.method == "lsq"
        else "the discrete Fourier transform on the index grid that underlies Table S2 of ref. 1"
    )
    return (
        f"The measured alpha was fitted with the nine-term Fourier series of ref. 1 by {fit_method}; "
        f"terms above {fourier.threshold:g} A00 were kept. The scaling factor zeta of a "
        f"medium is its fitted alpha_z(0, 90 deg) in N/cm^3{generic}.{zeta_of_maps}{intervals}"
    ) + (f" {scaling}" if scaling else "")


def _describe_scaling(results: Results) -> str:
    """Say the ratio chi of several media, and from which media natural sands are scaled; empty for a single medium.

    Chi is measured over fitted alpha_z straight down: by it the single push into a sand gives zeta.
    """
    table = results.table("penetration.csv")
    sands = table.loc[table["medium"].isin(results.sands) & table["zeta"].notna(), "medium"]
    if sands.isin(scaled_from_print(results)).any():
        chi = published(results.config.fourier.method).chi
        return (
            "Natural sands were scaled from one vertical penetration test by zeta = "
            f"alpha_z(0, 90 deg) / chi, with the mean chi ({format_number(chi.mean(), 2)}) and the generic "
            f"coefficients of the {chi.size} media of ref. 1 by the method "
            f"{results.config.fourier.method}, and an interval from the scatter between these media."
        )
    penetration = labels.of_method(results, "penetration.csv")
    is_usable = penetration["medium"].isin(labels.usable_media(results, penetration["medium"]))
    chi = penetration.loc[is_usable, "chi"].dropna().to_numpy(float)
    if chi.size < 2:
        return ""
    further = (
        " Natural sands were scaled from one vertical penetration test by zeta = alpha_z(0, 90 deg) / chi, "
        "with an interval from the scatter between the media."
    )
    return (
        f"The ratio chi of measured to fitted alpha_z(0, 90 deg) was {format_number(chi.mean(), 2)} "
        f"+- {format_number(chi.std(ddof=1), 2)} (mean and standard deviation of {chi.size} media)."
        f"{further if len(sands) else ''}"
    )


def _describe_software(results: Results) -> str:
    """Name the programs and their versions, and the digest of the settings."""
    version = versions()
    return (
        f"All steps were run with rftfit {version['rftfit']} (ref. 2; digest of the settings "
        f"{settings_digest(results.config)}) under Snakemake {version['snakemake']} (ref. 4) with "
        f"NumPy {version['numpy']} (ref. 5) and SciPy {version['scipy']} (ref. 6)."
    )


_ALPHA_NAMES = {
    "table": "alpha interpolated from the measured table",
    "map": "the map of alpha",
    "fourier": "the nine-term fit",
    "generic": "zeta times the generic coefficients",
    "depth_only": "the depth-only model",
}
"""Words for the alpha of each profile, by which forces were predicted."""


def _name_alpha(results: Results, profile: str) -> str:
    """Name the alpha of a profile; with one medium alone the generic profile is just its nine-term fit."""
    if profile == "generic" and len(results.laboratory) == 1 and not results.sands:
        return "zeta times the coefficients of the only medium, which is its own nine-term fit"
    return _ALPHA_NAMES[profile]


def _describe_forces_on_legs(results: Results) -> str:
    """Describe how forces on legs were measured and predicted, and what intervals hold; empty where they were neither."""
    config, measured = results.config, results.joined("legs/{medium}.csv")
    predicted = results.table("predicted.csv")
    used_legs = {*measured["leg"], *predicted["leg"]}
    legs = {name: leg for name, leg in config.legs.items() if name in used_legs}
    sizes: dict[str, list[str]] = {}
    for name, leg in legs.items():
        size = (
            f"maximal length {leg.max_length_cm:g} cm, width {leg.width_cm:g} cm, axle "
            f"{leg.hip_height_cm:g} cm above the surface"
        )
        sizes.setdefault(size, []).append(labels.name_of(name))
    legs_text = f"model legs ({'; '.join(f'{list_in_words(names)}: {size}' for size, names in sizes.items())})"
    sentences = []
    if len(measured):
        subtracted = "The force in air at the same angle was subtracted"
        nothing = "No force in air was recorded, so none was subtracted"
        tare = _choose_tare_sentence(results, "leg", measured, subtracted, nothing)
        sentences.append(
            f"Forces on {legs_text}, turned at {config.arm.leg_speed_rad_per_s:g} rad/s, were {_name_origin(results)} in "
            f"{_name_media(results, measured['medium'])}. {tare}"
        )
        legs_text = "these legs"
    media_by_profile = labels.predicted_by(results)
    sources = {
        name: _name_media(results, media_by_profile[name])
        for name in labels.PROFILE_NAMES
        if name in media_by_profile
    }
    if sources:
        sentences.append(
            f"Forces on {legs_text} were predicted by summing alpha |z| dA over {ELEMENTS} elements a leg, as far as they "
            f"are below the surface, with {list_in_words(f'{_name_alpha(results, name)} ({media})' for name, media in sources.items())}."
        )
        if predicted["force_z_lo_N"].notna().any():
            sentences.append(
                "Intervals of alpha hold the errors of alpha, of the height of the axle and of the arc of the legs."
            )
        if predicted["force_z_model_lo_N"].notna().any():
            sentences.append(
                "Those with the model's own error hold also how far forces lie from such a sum on legs whose alpha is "
                f"known: {format_number(results.model_error, 2)} of the load without cancellation."
            )
        sentences.append(_describe_limits(results, legs))
    return " ".join(filter(None, sentences))


def _name_media(results: Results, names: Iterable[str]) -> str:
    """Write the title of one medium, or the number of several."""
    unique_names = list(dict.fromkeys(names))
    if len(unique_names) == 1:
        return results.campaign.titles[unique_names[0]]
    return f"{len(unique_names)} media"


def _describe_map(results: Results, robot: str) -> str:
    """Describe how the map was estimated; empty where neither a force nor a zeta is from it.

    `robot`: Text of `_describe_robot`, which may name the map.
    """
    is_used = "map" in labels.predicted_by(results) or _ALPHA_NAMES["map"] in robot
    if not is_used and not any(has_scale_of_map(results, name) for name in results.laboratory):
        return ""
    others_phrase = " and the others of this campaign" if results.config.maps.own_media else ""
    frictions = list_in_words(f"{friction:g}" for friction in FRICTIONS)
    return (
        "The map is alpha in all directions: the mean shape and the scatter of known media, the five of ref. 1"
        f"{others_phrase} without the medium itself, are taken as known beforehand, and the measured directions correct them. "
        f"It has nodes {STEP_DEG:g} degrees apart in beta. Between the lines of the published directions, 30 degrees apart, its "
        f"mean has the course of three-dimensional resistive force theory (ref. 7) with frictions of {frictions}. Its draws take "
        "energy in every direction that was not pushed (passivity), and on average as much as the known media do (tilt)."
    )


class Constant(NamedTuple):
    """A constant of the model, the data by which it was chosen, and the data of this page that test it; all in words."""

    name: str
    value: str
    chosen_on: str
    graded_on: str


LEGS_OF_PAPER, SANDS_OF_PAPER = "legs of ref. 1 in five media", "legs of ref. 1 in three sands"
"""Measured forces by which constants were chosen: Figs. S5 and S12."""

NO_GRADE = "the same numbers: no grade"
"""What tests a constant that was chosen by the numbers with which this page compares predictions: nothing."""


def constants(results: Results) -> list[Constant]:
    """List the constants behind the predictions of this campaign that were chosen by measured forces.

    A simulated campaign compares the same numbers by which a constant was chosen, which is no test: `NO_GRADE`.
    """
    profiles, predicted = labels.predicted_by(results), results.table("predicted.csv")
    legs = results.joined("legs/{medium}.csv")

    def graded_on(media: Iterable[str]) -> str:
        """Name what tests a constant in `media`: legs measured there, unless it was chosen by the same numbers."""
        if not legs["medium"].isin([*media]).any():
            return "nothing here"
        return NO_GRADE if results.campaign.reenacted else "legs of this campaign"

    graded_on_legs, graded_on_sands = graded_on(results.laboratory), graded_on(results.sands)
    listed = []
    if predicted["force_z_model_lo_N"].notna().any():
        is_estimated_here = results.model_error != EPS
        listed = [
            Constant(
                "the model's own error, of the load",
                format_number(results.model_error, 2),
                "legs of this campaign" if is_estimated_here else LEGS_OF_PAPER,
                NO_GRADE if is_estimated_here else graded_on_legs,
            ),
            Constant(
                "its floor, of the largest load", f"{LEAST_LOAD:g}", LEGS_OF_PAPER, graded_on_legs
            ),
            Constant(
                "its length, degrees of theta", f"{LENGTH_DEG:g}", LEGS_OF_PAPER, graded_on_legs
            ),
        ]
    if "map" in profiles:
        listed += [
            Constant(
                "nodes of the map in beta, degrees", f"{STEP_DEG:g}", LEGS_OF_PAPER, graded_on_legs
            ),
            Constant(
                "scatter of the course between the lines",
                f"{published_shapes().variation.course_share:g}",
                LEGS_OF_PAPER,
                graded_on_legs,
            ),
            Constant(
                "frictions of that course",
                ", ".join(f"{friction:g}" for friction in FRICTIONS),
                "none: range of ref. 7",
                graded_on_legs if graded_on_legs != NO_GRADE else "legs of ref. 1 in five media",
            ),
            Constant(
                "tilt, share of the full one",
                f"{TILT_SHARE:g}",
                f"{SANDS_OF_PAPER}, and exact laws",
                graded_on_sands,
            ),
        ]
    if results.campaign.robot_medium:
        measured = results.table("robot/measured.csv")
        fitted = int((measured["calibrated"] == "yes").sum())
        if fitted:
            others = int(measured["speed_cm_per_s"].notna().sum()) - fitted
            listed.append(
                Constant(
                    "lengths of the robot",
                    "see its table",
                    f"{fitted} speeds, by the measured table",
                    f"{others} other speeds, but {RANGE_IN_VIEW}",
                )
            )
    return listed


def _describe_robot(results: Results) -> str:
    """Describe how the robot was simulated, and where the measured speeds are from; empty where no speed was simulated."""
    if not (medium := results.campaign.robot_medium):
        return ""
    speed, measured = results.table("robot/speed.csv"), results.table("robot/measured.csv")
    speed = speed[speed["speed_cm_per_s"].notna()]
    if speed.empty:
        return ""
    runs = len(speed.drop_duplicates(["curvature_times_R", "frequency_Hz"]))
    simulation = (
        f"A legged robot in {results.campaign.titles[medium]} was simulated as a rigid body in the plane (ref. 1) in {runs} "
        f"combinations of leg curvature and stride frequency, with {list_in_words(_name_alpha(results, name) for name in speed['profile'].unique())}."
    )
    sentences = [simulation]
    conditions = measured[measured["speed_cm_per_s"].notna()]
    if len(conditions):
        source = "those of ref. 1"
        if set(conditions["source"]) == {"marker tracks"}:
            source = "from marker tracks"
            if results.campaign.reenacted:
                source += " that were simulated from published speeds"
        sentences.append(
            f"The speeds that it is compared with, in {len(conditions)} conditions, are {source}."
        )
    if fitted := int((conditions["calibrated"] == "yes").sum()):
        sentences.append(f"Its unknown lengths were found from {fitted} of them; {RANGE_IN_VIEW}.")
    return " ".join(sentences)


def _describe_limits(results: Results, legs: Mapping[str, Leg]) -> str:
    """Say in which media predicted forces on legs go beyond what was measured, or beyond what the model is for.

    For each medium the legs that do, with the limits of the first of them. `legs`: Legs with forces, by name.
    """
    speed = results.config.arm.leg_speed_rad_per_s
    limits_of_media = []
    for medium in results:
        profile = medium.profile("table", draws=False)
        limits_by_leg = {}
        for name, leg in legs.items():
            motion = rotation(None, leg.hip_height_cm, speed)
            if limits := beyond_measured(profile, leg_outline(leg), motion, results.config):
                limits_by_leg[labels.name_of(name)] = limits
        if limits_by_leg:
            first_leg, limits = next(iter(limits_by_leg.items()))
            limits_of_media.append(
                f"{', '.join(limits_by_leg)} in {medium.title} ({first_leg}: {'; '.join(limits)})"
            )
    return f"Beyond what was measured: {'; '.join(limits_of_media)}." if limits_of_media else ""
