# The campaign, its media, and functions that name the input files of rules; memory of a stage.
import re
from functools import partial

from rftfit.robot import PROFILES
from rftfit.workflow.state import LEAST_MB, guard_written, read_states

CONFIG = config.get("campaign", "config/config.yaml")
STATES = read_states(Path(CONFIG))
CAMPAIGN = STATES.campaign
MEDIA = CAMPAIGN.media_with_runs
# media that were pushed in many directions, and those that were pushed straight down only
LABORATORY = CAMPAIGN.of_role("laboratory")
SANDS = CAMPAIGN.of_role("natural_sand")
ROBOT = bool(CAMPAIGN.robot_medium)
# True where the offset of the clocks of force and motion log is found from the logs
ESTIMATED = CAMPAIGN.config.clock.method == "estimate"
# figure and medium by path below results/ without ending, as figures/NAME
FIGURES = STATES.figures


def state_of(rule):
    """Return the input function for the state of a rule's jobs: it writes the file of a job's state and returns its path.

    The file changes when code, settings, rows of the run sheet or logs of the job change, and so makes Snakemake do it.
    """
    return partial(STATES.write_state, rule)


def memory_of(wildcards):
    """Return the memory, MB, that a stage of a medium needs, by the sizes of its logs."""
    return max(LEAST_MB, STATES.memory(wildcards.medium).megabytes)


def one_of(names):
    """Return the regular expression of a wildcard that stands for one of some names, of which there may be none."""
    # without names: an expression that nothing matches
    return "|".join(map(re.escape, names)) or "(?!)"


def names_in(folder):
    """List the names of the figures that a whole run draws into a folder below results/."""
    paths = [
        Path(path) for path, (figure, _) in FIGURES.items() if not figure.on_demand
    ]
    return [path.name for path in paths if path.parent.name == folder]


def of_figure(folder):
    """Return the input function for the figures of a folder: the files that each figure declares to read.

    These are patterns with {medium} (of the figure), {media} (all), {laboratory} or {sands}. Every figure also reads the
    checks of all media, as it marks those that fail.
    """

    def inputs(wildcards):
        figure, medium = FIGURES[f"{folder}/{wildcards[0]}"]
        patterns = [f"results/{name}" for name in ("checks/{media}.csv", *figure.reads)]
        names = {"media": MEDIA, "laboratory": LABORATORY, "sands": SANDS}
        return [
            file
            for pattern in patterns
            for file in expand(pattern, medium=medium, **names)
        ]

    return inputs


def made_by(*rules_of_a_run, endings=("",)):
    """List the files that some rules write in a whole run of this campaign; `endings`: only files that end so."""
    wildcards = {
        "medium": MEDIA,
        "figure": names_in("figures"),
        "runs": [f"runs_{name}" for name in PROFILES],
    }
    files = [
        file for rule in rules_of_a_run for file in expand(rule.output, **wildcards)
    ]
    return [file for file in files if file.endswith(tuple(endings))]
