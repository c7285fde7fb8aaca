# From transducer logs to coefficient tables, figures and the reproduction table.
# `rftfit run` starts this with sane defaults; by hand: snakemake --cores 2 --config campaign=config/config.yaml
import re
import sys

from snakemake.utils import min_version

from rftfit.workflow import Plan

min_version("9.5")

CONFIG = config.get("campaign", "config/config.yaml")
PLAN = Plan(CONFIG)
PYTHON = sys.executable
STAGE = f'"{PYTHON}" -m rftfit'


wildcard_constraints:
    medium="|".join(re.escape(medium) for medium in PLAN.media) or "none",


include: "workflow/rules/measure.smk"
include: "workflow/rules/profile.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        "results/ledger.csv",
        "results/reproduction.csv",
        "results/alpha_extended.csv",
        rules.workbooks.output,
        expand("results/legs/{medium}.csv", medium=PLAN.media),
        expand("results/quality/{medium}.png", medium=PLAN.media),
        expand("results/figures/tare_{medium}.png", medium=PLAN.laboratory[:1]),
        expand("results/figures/fig_2cd_maps_{medium}.png", medium=PLAN.laboratory[:1]),
        rules.figure_stress.output.png,
        rules.figure_maps.output.png,
        rules.figure_fit.output.png,
        rules.figure_generic.output.png,
