"""What jobs need, imported once: the process that jobs are forked from imports this module.

It is the forkserver of `multiprocessing`, which starts and ends with Snakemake
(`snakemake_executor_plugin_rftfit`).
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"

import gc
from importlib import import_module

from rftfit.store.digests import source_digests

# digests of the code before it is imported: a job refuses to work where they are not the planned ones
_before = dict(source_digests())

from rftfit.figures import style
from rftfit.figures.registry import figures
from rftfit.workflow.state import States, handed_over

_MODULES = (
    "pandas",
    "psutil",
    "scipy.special",
    "scipy.optimize",
    "pyarrow.dataset",
    "pyarrow.parquet",
    "numba",
    "rftfit.workflow.job",
    "rftfit.page.page",
    "rftfit.page.workbooks",
    *(
        f"rftfit.workflow.{name}"
        for name in ("measure", "profiles", "validate", "robot", "provenance")
    ),
    "matplotlib.backends.backend_agg",
)


def campaign_states() -> States | None:
    """States of the campaign that was handed over, if its config and run sheet are still the same."""
    return _handed[0] if _handed and _handed[0].campaign.is_as_read else None


for _name in _MODULES:
    import_module(_name)
_handed = handed_over()
figures()
source_digests.cache_clear()
if source_digests() != _before:
    # edited meanwhile: no digest tells which code was imported, and that of no file is planned
    source_digests().clear()


def _draw_once() -> None:
    """Read the fonts and build the parser of formulas, which every job that draws needs."""
    with style.styled():
        page = style.new_figure(4, 3)
        axes = page.add_subplot(xlabel=style.alpha_label("z"), title="x")
        axes.set_title("y", fontweight="bold", loc="left")
        style.content(page, "png")


_draw_once()
# what was imported lives to the end: no job looks for garbage in it, or copies its pages by looking
gc.freeze()
