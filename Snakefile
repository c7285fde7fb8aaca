# From transducer logs to coefficient tables, figures and the reproduction table.
# `rftfit run` starts this with sane defaults; by hand: snakemake --cores 2 --config campaign=config/config.yaml
import os
import re
import sys
from pathlib import Path

from snakemake.utils import min_version

from rftfit.workflow.processes import hold
from rftfit.workflow.processes import SHELL_PREFIX
from rftfit.workflow.processes import end_group
from rftfit.workflow.processes import end_with_parent
from rftfit.workflow.plan import Plan

min_version("9.5")


# No job, on whatever machine, imports Python modules from the campaign's folder, where it works.
os.environ["PYTHONSAFEPATH"] = "1"


envvars:
    "PATH",
    "PYTHONSAFEPATH",


# The jobs' `python` is the one that runs Snakemake, whether or not its environment is activated.
os.environ["PATH"] = os.pathsep.join(
    [str(Path(sys.executable).parent), os.environ["PATH"]]
)

# No orphan goes on writing: Snakemake ends with the `rftfit run` that started it, and each job with its
# Snakemake, also where these were killed and could not end it.
end_with_parent(end_group)
shell.prefix(SHELL_PREFIX)

CONFIG = config.get("campaign", "config/config.yaml")
PLAN = Plan(CONFIG)


onstart:
    # so that the lock of a killed run can be told from that of a living one; jobs elsewhere may live on
    if workflow.local_exec:
        hold(Path(".snakemake"))


wildcard_constraints:
    medium="|".join(re.escape(medium) for medium in PLAN.media) or "none",


include: "workflow/rules/common.smk"
include: "workflow/rules/measure.smk"
include: "workflow/rules/profile.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/legs.smk"
include: "workflow/rules/robot.smk"
include: "workflow/rules/page.smk"
include: "workflow/rules/provenance.smk"


rule all:
    default_target: True
    input:
        rules.provenance.output,
        # every file that is meant to be looked at, so that a deleted one is made again
        expand(
            "results/{table}/{medium}.csv",
            table=["alpha", "fits", "legs"],
            medium=PLAN.media,
        ),
        rules.symmetry.output,
        rules.fourier.output,
        rules.scaling.output,
        rules.trials.output,
        rules.sands.output,
        rules.correction.output,
        rules.reproduction.output,
        rules.ledger.output,
        rules.workbooks.output,
        rules.page.output,
        expand("results/quality/{medium}.png", medium=PLAN.media),
        expand("results/figures/tare_{medium}.png", medium=PLAN.laboratory[:1]),
        expand("results/figures/fig_2cd_maps_{medium}.png", medium=PLAN.laboratory[:1]),
        # legs need legs, sands need sands, maps and fits need a medium measured over the grid: a
        # campaign without has its tables, but not these figures
        expand("results/figures/fig_3_legs_{medium}.png", medium=PLAN.legged[:1]),
        [rules.figure_leg_media.output.png] * bool(PLAN.legged),
        [rules.figure_generic_forces.output.png] * bool(PLAN.legged),
        [rules.figure_peak_errors.output.png] * bool(PLAN.legged + PLAN.legged_sands),
        [rules.figure_sand_legs.output.png] * bool(PLAN.legged_sands),
        [rules.figure_penetration.output.png] * bool(PLAN.sands),
        expand(
            "results/figures/fig_s1_protocol_{medium}.png", medium=PLAN.laboratory[:1]
        ),
        [rules.figure_linearity.output.png] * bool(PLAN.laboratory),
        # two clocks without a sync line: how they were brought together has to be looked at
        expand(
            "results/figures/clocks_{medium}.png",
            medium=(
                PLAN.media if PLAN.campaign.config.clock.method == "estimate" else []
            ),
        ),
        [rules.robot_tables.output, rules.figures_robot.output]
        * bool(PLAN.robot_medium),
        [rules.figures_robot_motion.output] * bool(PLAN.robot_medium),
        [rules.figure_stress.output.png] * bool(PLAN.stress_media),
        [
            rules.figure_maps.output.png,
            rules.figure_fit.output.png,
            rules.figure_generic.output.png,
        ]
        * bool(PLAN.laboratory),
