"""Campaigns in folders of their own, and the real workflow run on them."""

import contextlib
import hashlib
import io
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from unittest.mock import patch

import pandas as pd
import yaml
from disturbances import NOTHING
from few_draws import few_draws
from figure_faults import figure_faults
from jobs import run_rules
from matplotlib.axis import Axis
from paper import PROJECT, enact, paper_values, write_yaml
from text_boxes import words
from true_sentences import untrue

from rftfit.cli.main import main
from rftfit.figures import style
from rftfit.results import open_results
from rftfit.store import write_bytes
from rftfit.workflow.records import Recorded
from rftfit.workflow.state import read_states

FEW = tuple((beta, gamma) for beta in (-30.0, 0.0, 30.0, 90.0) for gamma in (90.0, -90, 45, -45, 0))
"""Cells (beta, gamma) in degrees that tell the nine terms apart: 20 of the paper's 78."""


@dataclass(frozen=True)
class Folder:
    """A campaign's folder that the workflow runs in."""

    root: Path

    def snakemake(self, *words, cores=2):
        command = [
            sys.executable,
            "-m",
            "snakemake",
            "--snakefile",
            str(PROJECT / "Snakefile"),
            "--directory",
            str(self.root),
            "--cores",
            str(cores),
            *words,
        ]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def run(self, *words, cores=2):
        """Run the workflow by Snakemake alone, each stage in a process of its own."""
        completed = self.snakemake(*words, cores=cores)
        assert completed.returncode == 0, completed.stdout + completed.stderr
        return completed.stdout + completed.stderr

    def run_here(self, last="provenance", drawn=(), real_run=None):
        """Do the jobs up to a rule in this process: the same results, without starting Python for each.

        Only the figures of the names in `drawn` (None: all) are put together, and their words are looked at;
        the files of the others have no content. Of a figure that is put together the png holds its words, and
        the preview nothing; with `real_run`, they are those of `real_run`. What a whole campaign says must
        rest on its records.
        """
        # a campaign whose files are compared with those of a real run has all draws
        of_draws = few_draws() if real_run is None else contextlib.nullcontext()
        with of_draws, patch.object(style, "save", partial(_sketch, self, real_run)):
            run_rules(self.config, last=last, drawn=drawn)
        if last == "provenance":
            false_sentences = untrue(open_results(self.root))
            assert not false_sentences, "\n".join(false_sentences)

    def rftfit(self, *words):
        """Run a command in this process, from the campaign's folder."""
        out, error, before = io.StringIO(), io.StringIO(), Path.cwd()
        os.chdir(self.root)
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
                code = main([*words])
        finally:
            os.chdir(before)
        completed = subprocess.CompletedProcess(words, code, out.getvalue(), error.getvalue())
        assert "Traceback" not in completed.stdout + completed.stderr
        return completed

    @property
    def config(self):
        return self.root / "config" / "config.yaml"

    def stale(self):
        """Rules whose jobs are not as recorded by now, with the media or figures of these jobs."""
        keys_by_rule: dict[str, set[str]] = {}
        for finding in Recorded(read_states(self.config)[0]).findings_of():
            rule, _, key = finding.job.partition("/")
            keys_by_rule.setdefault(rule, set()).add(key)
        return keys_by_rule

    def table(self, name):
        """One result as a data frame; untyped, since cells may be of any kind."""
        return pd.read_csv(self.root / "results" / name)

    def digests(self):
        """Every result but logs, by path."""
        results = self.root / "results"
        return {
            path.relative_to(results).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(results.rglob("*"))
            if path.is_file() and "logs" not in path.relative_to(results).parts
        }

    def raw_digests(self):
        raw = self.root / "raw"
        return {
            path.relative_to(raw).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(raw.rglob("*"))
            if path.is_file()
        }


def _sketch(folder, real_run, figure, base, about, endings):
    if real_run is None:
        faults = figure_faults(figure)
        assert not faults, f"{base.name}: {'; '.join(faults)}"
        with patch.object(Axis, "get_children", lambda axis: [axis.label, axis.offsetText]):
            # without the numbers of ticks, which are made when they are asked for
            written = "\n".join([about, *words(figure)]).encode()
    for ending in endings:
        target = base.with_name(f"{base.name}.{ending}")
        if real_run is None:
            content = written if ending == "png" else b""
        else:
            content = (real_run.root / target.relative_to(folder.root)).read_bytes()
        write_bytes(target, content)


def make_campaign(
    root, media=(), faults=(), *, plates_only=False, robot=True, directions=None, sizes=NOTHING
):
    """Write the demonstration campaign, or a part of it, into a new folder.

    Parameters
    ----------
    root : Path
    media : tuple of str, optional
        Only these; the robot stays where its medium does, with coarse steps and elements.
    faults : tuple of str, optional
        As for `rftfit.lab.reenact`.
    plates_only : bool, optional
        Without legs and robot.
    robot : bool, optional
        With the robot.
    directions : sequence of (float, float), optional
        (beta, gamma) of the plates, deg; default: all of the paper.
    sizes : dict of float, optional
        Of disturbances, by name.
    """
    values = paper_values()
    values["media"] = {name: values["media"][name] for name in media or values["media"]}
    # a quarter of the draws: how well intervals hold is tested elsewhere
    values["fourier"]["draws"] = 500
    if plates_only or not robot or values["robot"]["medium"] not in values["media"]:
        del values["robot"]
    else:
        robot = yaml.safe_load((PROJECT / "config" / "robot.yaml").read_text(encoding="utf-8"))
        robot["numerics"] |= {"step_s": 0.002, "elements": 8}
        values["robot"]["file"] = "config/robot.yaml"
        write_yaml(root / "config" / "robot.yaml", robot)
    if plates_only:
        shapes = values["intruders"].items()
        values["intruders"] = {name: shape for name, shape in shapes if shape["shape"] == "plate"}
    enact(root, values, sizes, directions=directions, faults=faults)
    return Folder(root)
