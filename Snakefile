# The workflow, from transducer logs to coefficient tables, figures and the reproduction table: processes and rules.
# `rftfit run` starts this with sane defaults; by hand: snakemake --cores 2 --config campaign=config/config.yaml
#
# The rules (workflow/rules) name their files. A rule is carried out once for each value of its wildcard, such as a
# medium: each time is a job. What a result depends on besides files of other rules (code, settings, rows of the run
# sheet, logs) stands in a small file a job, its state, which is an input, too: see src/rftfit/workflow/stages.py.
import os
import sys
from pathlib import Path

from snakemake.utils import min_version

# A clone need not be installed: its package lies beside this file, for Snakemake and for its jobs.
SOURCE = Path(workflow.current_basedir) / "src"
if SOURCE.is_dir():
    sys.path.insert(0, str(SOURCE))
    sources = filter(None, [str(SOURCE), dict(os.environ).get("PYTHONPATH")])
    os.environ.update(PYTHONPATH=os.pathsep.join(sources))

from rftfit.store.environment import PACKAGE
from rftfit.workflow.processes import (
    SHELL_PREFIX,
    end_group,
    end_with_parent,
    hold_lock,
)

min_version("9.5")

# `--sdm conda` keeps PYTHONPATH from the jobs: workflow/envs/rftfit.post-deploy.sh links this folder into their environment.
os.environ.update(RFTFIT_PACKAGE=str(PACKAGE))


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


include: "workflow/rules/common.smk"


if workflow.remote_exec:
    # this Snakemake runs inside of a batch job of a cluster; several jobs in it start as they do on one machine
    from snakemake_executor_plugin_rftfit import fork_in_batch_jobs

    fork_in_batch_jobs(STATES)


if workflow.is_main_process:
    # refuses links where files are written; also where Snakemake is started by hand
    guard_written(CAMPAIGN)


# runs: a table of runs of the robot on one profile of its medium, as runs_map
wildcard_constraints:
    medium=one_of(MEDIA),
    figure=one_of(Path(path).name for path in FIGURES if path.startswith("figures/")),
    runs=one_of(f"runs_{name}" for name in PROFILES),


onstart:
    # so that the lock of a killed run can be removed by the next; jobs elsewhere may live on
    if workflow.local_exec:
        hold_lock(Path(".snakemake"))
        # the timer of this limit keeps Snakemake for a second after the last job
        workflow.scheduler.job_rate_limiter = None


rule all:
    # Everything but the robot's full sweep: the last job reads all results.
    default_target: True
    input:
        "results/provenance.json",


include: "workflow/rules/measure.smk"
include: "workflow/rules/model.smk"
include: "workflow/rules/robot.smk"
include: "workflow/rules/report.smk"
