# What several rules need.

from rftfit.report.captions.run import Captions
from rftfit.workflow.figures import stress_runs

# Snakemake's own report (snakemake --report): the captions get the run's numbers from this object,
# which reads the results when asked. It stands in the config, since that never makes a job run
# again as params would.
config["captions"] = Captions(CONFIG, PLAN.media, stress_runs(PLAN.campaign))

OVERVIEW, MEASUREMENT, PROFILES, LEGS, SANDS = (
    "1 Overview",
    "2 Measurement",
    "3 Force profiles",
    "4 Legs",
    "5 Natural sands",
)


report: "../report/workflow.rst"


def shown(item, shows, medium="all"):
    """Labels of one item of the report."""
    return {"item": item, "medium": medium, "shows": shows}


def alpha_tables(media):
    """Alpha tables of these media."""
    return expand("results/alpha/{medium}.csv", medium=media)


def named(name):
    """Words name=path for each of a rule's input files of that name."""
    return lambda wildcards, input: [f"{name}={path}" for path in input.get(name, [])]


def recorded_results(wildcards):
    """All results that the workflow makes by default, but the record itself."""
    own = set(rules.provenance.output)
    return [path for path in rules.all.input if path not in own]


def robot_figure(sweep, figure):
    """A figure as the report shows it; of the full sweep plain, since captions tell of the reduced one."""
    return figure if sweep == "robot" else str(figure)
