# The campaign, and lists of files.
import re

from rftfit.robot import PROFILES
from rftfit.workflow.state import LEAST_MB, guard_written, read_states

CONFIG = config.get("campaign", "config/config.yaml")
STATES = read_states(Path(CONFIG))
CAMPAIGN = STATES.campaign
MEDIA = CAMPAIGN.media_with_runs
LABORATORY = CAMPAIGN.of_role("laboratory")
SANDS = CAMPAIGN.of_role("natural_sand")
ROBOT = bool(CAMPAIGN.robot_medium)
ESTIMATED = CAMPAIGN.config.clock.method == "estimate"
FIGURES = STATES.figures

# A job's state: a file that is written anew only when code, settings, rows or logs change.
state_of = STATES.input_of


def memory_of(wildcards):
    """Memory that a stage of a medium needs, by the sizes of its logs."""
    return max(LEAST_MB, STATES.memory(wildcards.medium).megabytes)


def one_of(names):
    """A wildcard that stands for one of some names."""
    return "|".join(map(re.escape, names)) or "(?!)"


def names_in(folder):
    """Figures in a folder below results/ that a whole run draws."""
    places = [Path(path) for path, (one, _) in FIGURES.items() if not one.on_demand]
    return [place.name for place in places if place.parent.name == folder]


def of_figure(folder):
    """Files that a figure is made from, as declared beside what draws it."""

    def inputs(wildcards):
        figure, medium = FIGURES[f"{folder}/{wildcards[0]}"]
        paths = [f"results/{one}" for one in ("checks/{media}.csv", *figure.reads)]
        names = {"media": MEDIA, "laboratory": LABORATORY, "sands": SANDS}
        return [file for path in paths for file in expand(path, medium=medium, **names)]

    return inputs


def made_by(*rules_of_a_run, endings=("",)):
    """Files that rules write for this campaign, those with certain endings."""
    words = {
        "medium": MEDIA,
        "figure": names_in("figures"),
        "runs": [f"runs_{name}" for name in PROFILES],
    }
    files = [file for rule in rules_of_a_run for file in expand(rule.output, **words)]
    return [file for file in files if file.endswith(tuple(endings))]
