# From transducer logs to coefficient tables, figures and the reproduction table.
# `rftfit run` starts this with sane defaults; by hand: snakemake --cores 2 --config campaign=config/config.yaml
#
# What each stage reads, writes and depends on is declared in src/rftfit/workflow/stages.py (figures: beside
# what draws them). A job does those of its stage's tasks that are out of date: see docs/architecture.md.
import os
import sys
from pathlib import Path
from shlex import quote

from snakemake.utils import min_version

from rftfit.workflow.plan import Plan
from rftfit.workflow.processes import SHELL_PREFIX, end_group, end_with_parent, hold

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
STAGE = (
    f"python -P -m rftfit {{params.stage}} --config {quote(CONFIG)} --threads {{threads}}"
    " 2> {log:q}"
)


onstart:
    PLAN.save()
    # so that the lock of a killed run can be told from that of a living one; jobs elsewhere may live on
    if workflow.local_exec:
        hold(Path(".snakemake"))
        # jobs are few, and the timer of this limit keeps Snakemake for a second after the last one
        workflow.scheduler.job_rate_limiter = None


include: "workflow/rules/measure.smk"
include: "workflow/rules/model.smk"
include: "workflow/rules/robot.smk"
include: "workflow/rules/report.smk"


rule all:
    default_target: True
    input:
        [path for name in PLAN.default for path in PLAN.outputs(name)],
