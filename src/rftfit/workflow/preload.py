"""Imports, once for all, what jobs need: the process that jobs are forked from imports this module.

To import pandas, scipy and the figures takes longer than most jobs. That process is the forkserver of `multiprocessing`,
which starts and ends with Snakemake (`snakemake_executor_plugin_rftfit`). All work of this module is done when it is imported:
modules, the campaign, the registry of figures, fonts. A forked job then finds all of it in its memory.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import gc
from importlib import import_module

from rftfit.store.digests import source_digests

# digests of the code before it is imported: a job refuses to work where they are not the planned ones
_digests_before = dict(source_digests())

from rftfit.workflow.stages import FOLDER_BY_RULE, RULES_TO_COME, STAGES
from rftfit.workflow.state import States, take_over

# inside of a batch job of a cluster the variable names the rules to come: only what they need is imported
_RULES = os.environ.get(RULES_TO_COME, " ".join([*STAGES, *FOLDER_BY_RULE])).split()
_DRAWS = any(rule in FOLDER_BY_RULE for rule in _RULES)
_FOR_MANY_RULES = ("pandas", "psutil", "scipy.special", "pyarrow.dataset", "pyarrow.parquet")
_FOR_FIGURES = ("scipy.optimize", "numba", "matplotlib.backends.backend_agg")
_MODULES = (
    *_FOR_MANY_RULES,
    *(_FOR_FIGURES if _DRAWS else ()),
    "rftfit.workflow.job",
    *dict.fromkeys(STAGES[rule].run.partition(":")[0] for rule in _RULES if rule in STAGES),
)


def campaign_states() -> States | None:
    """Return the campaign, with the states of its jobs, as `rftfit run` has read it and this process has taken it over.

    None where there was none to take over, or its config or run sheet has changed since: a job then reads it itself.
    """
    return _states if _states and _states.campaign.is_as_read else None


for _name in _MODULES:
    import_module(_name)
_states = take_over()
if _DRAWS:
    from rftfit.figures.registry import figures

    figures()
source_digests.cache_clear()
if source_digests() != _digests_before:
    # code was edited during the imports, so no digest tells which was imported: without digests every job refuses to work
    source_digests().clear()


def _draw_once() -> None:
    """Draw a small figure: it reads the fonts and builds the parser of formulas, which every job that draws needs."""
    from rftfit.figures import style

    with style.styled():
        page = style.new_figure(4, 3)
        axes = page.add_subplot(xlabel=style.alpha_label("z"), title="x")
        axes.set_title("y", fontweight="bold", loc="left")
        style.content(page, "png")


if _DRAWS:
    _draw_once()
# what was imported is never garbage: a forked job that searched it for garbage would also copy its memory pages
gc.freeze()
