"""Sentences of page, Methods and captions beside the records they rest on.

python tests/helpers/true_sentences.py FOLDER ...     prints what campaigns say of what they do not have
"""

import html
import re
import sys
from collections.abc import Callable

from rftfit.figures.labels import of_method, predicted_by, tared
from rftfit.figures.plates import stress_runs
from rftfit.figures.registry import figures
from rftfit.page.page import page
from rftfit.results import open_results


def texts(results):
    """Prose of the page, its Methods, and captions of all figures, by name."""
    has_page = results.has("report.html")
    whole = results.path("report.html").read_text(encoding="utf-8") if has_page else page(results)
    body = whole.partition("<main>")[2].partition('<script type="application/json"')[0]
    body, _, methods = body.partition('<section id="methods"')
    # tables and controls are no sentences; the calculator tells of what the user will type
    body = re.sub(
        r"<(table|figcaption|svg|form|noscript)\b.*?</\1>"
        r'|<section id="(calculator|reproduction)".*?</section>',
        "",
        body,
        flags=re.DOTALL,
    )
    parts = {"page": body, "methods": methods.partition("<ol>")[0]}
    prose = {name: html.unescape(re.sub(r"<[^>]+>", "", text)) for name, text in parts.items()}
    return prose | {
        figure.file(medium): figure.caption_of(results, medium)
        for figure in figures()
        if not figure.on_demand
        for medium in figure.media(results.campaign)
    }


class Records:
    """What a campaign has."""

    def __init__(self, results):
        campaign, self.results = results.campaign, results
        fits, legs = (results.joined(f"{name}/{{medium}}.csv") for name in ("fits", "legs"))
        self.fits = fits
        self.robot = bool(campaign.robot_medium)
        self.legs_stated = bool(results.config.legs)
        self.legs = len(legs) > 0
        self.leg_tare = tared(results, legs)
        self.tare = tared(results, self.fits)
        self.alpha = results.joined("alpha/{medium}.csv")["alpha_z_N_per_cm3"].notna().any()
        self.recorded = not campaign.reenacted
        self.container = results.config.table is None
        self.sands = bool(results.sands)
        self.scaled = self._zeta().isin(results.sands).any()
        fitted = of_method(results, "coefficients.csv")
        fitted = fitted[fitted["value_N_per_cm3"].notna()]
        self.nine = len(fitted) > 0
        self.dropped_terms = not fitted["kept"].all()
        self.several = fitted["medium"].nunique() > 2
        ends = [
            results.joined("alpha/{medium}.csv")["alpha_z_lo_N_per_cm3"],
            results.table("predicted.csv")["force_z_lo_N"],
        ]
        self.intervals = any(column.notna().any() for column in ends)
        speed = self.of_robot("speed")
        simulated = speed[speed["speed_cm_per_s"].notna()]["profile"] if len(speed) else ()
        self.profiles = {*predicted_by(results), *simulated}
        errors = results.table("leg_errors.csv")
        errors = errors[errors["peak_error_percent"].notna()]
        self.errors = set(errors["profile"])
        self.of_alpha = not errors["peak_errors"].str.contains("hip|arc").any()
        robot_errors = self.of_robot("errors")
        self.calibrated = len(robot_errors) > 0 and bool(
            (robot_errors["calibrated"] == "yes").any()
        )
        self.measured_robot = len(robot_errors) > 0 and bool(
            robot_errors["measured_cm_per_s"].notna().any()
        )
        self.tipped = len(speed) > 0 and bool((speed["outcome"] == "tipped").any())
        self.trials = len(self.of_robot("tracks")) > 0
        self.strides = self.recorded and len(self.of_robot("strides")) > 0

    def _zeta(self):
        table = self.results.table("penetration.csv")
        return table.loc[table["zeta"].notna(), "medium"]

    def of_robot(self, name):
        return self.results.table(f"robot/{name}.csv") if self.robot else self.fits.iloc[:0]

    def moved(self, direction, where):
        """Whether there are plate runs of a direction in what a text is about."""
        fits = self.fits
        if where == "figures/stress_of_runs":
            fits = fits[fits["run_id"].isin(stress_runs(self.results.campaign))]
        medium = [name for name in self.results.media if where.endswith(f"_{name}")]
        fits = fits[fits["medium"] == medium[0]] if medium else fits
        return bool((fits["direction"] == direction).any())


SENTENCES: dict[str, Callable[[Records, str], object]] = {
    r"\brobot\b": lambda a, _: a.robot,
    r"[Hh]ollow points|unknown lengths": lambda a, _: a.calibrated,
    r"upside down|turns? .{0,12}over": lambda a, _: a.tipped,
    r"trials of the robot|deviation of trials": lambda a, _: a.trials,
    r"marker track, of four": lambda a, _: a.strides,
    r"\d measured conditions|[Pp]oints: measured|within 35 %": lambda a, _: a.measured_robot,
    r"lines through the points": lambda a, where: a.measured_robot or "robot" not in where,
    r"\blegs?\b": lambda a, _: a.legs_stated or a.robot,
    r"turned through|turned at|in air at|leg turned in air": lambda a, _: a.legs,
    r"in air at the same angle was sub|leg turned in air": lambda a, _: a.leg_tare,
    r"[Ee]xtraction": lambda a, where: a.moved("extraction", where),
    r"[Hh]orizontal (run\b|motion)": lambda a, where: a.moved("horizontal", where),
    r"without a plate, was|rod and the mount alone|(?<!No )(?<!no )(?<!no plate run has a )\btares?\b": lambda a, _: (
        a.tare
    ),
    r"wholly submerged|walls and bottom|container": lambda a, _: a.container,
    r"(?<!No )(?<!no )[Nn]ine([- ]term| terms| Fourier)": lambda a, _: a.nine,
    r"Terms in brackets": lambda a, _: a.dropped_terms,
    r"generic coefficients are the mean|all media lie": lambda a, _: a.several,
    r"(?<!No )(?<!no )depth-only": lambda a, where: (
        "depth_only" in a.profiles or "depth_only" in where
    ),
    r"map of alpha|by the map|[Tt]he map (is|pre)|with the map": lambda a, _: "map" in a.profiles,
    r"[Pp]redicted with the measured": lambda a, _: "table" in a.errors,
    r"[Pp]redicted with the map": lambda a, _: "map" in a.errors,
    r"interpolated (measured )?table|the measured table": lambda a, _: "table" in a.profiles,
    r"natural sand|Natural sands": lambda a, _: a.sands,
    r"further medium was scaled|sands were scaled": lambda a, _: a.scaled,
    r"error of peak lift|peak lift predicted|Error of the pred": lambda a, _: a.errors,
    r"shapes? of the legs": lambda a, _: "table" in a.profiles,
    r"follow from (those|the intervals) of": lambda a, _: a.of_alpha,
    r"\d % intervals": lambda a, _: a.intervals,
    r"were measured in": lambda a, _: a.recorded,
}
"""Words, and whether a campaign has what they tell of, by its records and the text that they stand in."""

METHODS: dict[str, Callable[[Records], object]] = {
    r"A legged robot": lambda a: a.robot and "table" in a.profiles,
    r"The map is α": lambda a: "map" in a.profiles,
    r"known beforehand": lambda a: "map" in a.profiles,
    r"turned at": lambda a: a.legs,
    r"nine-term": lambda a: a.nine,
    r"without a plate, was": lambda a: a.tare and a.alpha,
    r"interpolated from the measured table": lambda a: "table" in a.profiles,
}
"""Words that Methods have wherever the records have what they tell of."""


def untrue(results):
    """Sentences on what a campaign does not have, and what its Methods lack."""
    records, written = Records(results), texts(results)
    faults = [
        f"{name}: {' '.join(text[max(0, match.start() - 60) : match.end() + 40].split())!r}"
        for name, text in written.items()
        for words, condition in SENTENCES.items()
        if (match := re.search(words, text)) and not condition(records, name)
    ]
    return faults + [
        f"methods: no word of {words!r}"
        for words, condition in METHODS.items()
        if condition(records) and not re.search(words, written["methods"])
    ]


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        print(folder, *untrue(open_results(folder)), sep="\n  ")
