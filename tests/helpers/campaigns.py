"""Campaigns in folders of their own, and the real Snakefile run on them."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from rftfit.campaign.config import Config
from rftfit.lab import reenact
from rftfit.workflow.plan import Plan

PROJECT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Folder:
    """A campaign's folder that the workflow runs in."""

    root: Path

    def snakemake(self, *words: str, cores: int = 2) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "snakemake", "--snakefile", str(PROJECT / "Snakefile"),
                   "--directory", str(self.root), "--cores", str(cores), *words]  # fmt: skip
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def run(self, *words: str, cores: int = 2) -> str:
        done = self.snakemake(*words, cores=cores)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    @property
    def config(self) -> Path:
        return self.root / "config" / "config.yaml"

    def stale(self) -> dict[str, set[str]]:
        """Stages whose tasks are not as recorded by now, with the keys of these tasks."""
        found: dict[str, set[str]] = {}
        for one in Plan(self.config).all_findings():
            found.setdefault(one.stage, set()).add(one.key)
        return found

    def table(self, name: str) -> Any:
        """One result as a data frame; untyped, since cells may be of any kind."""
        return pd.read_csv(self.root / "results" / name)

    def digests(self) -> dict[str, str]:
        """Every result but logs, by path."""
        results = self.root / "results"
        return {
            path.relative_to(results).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(results.rglob("*"))
            if path.is_file() and "logs" not in path.relative_to(results).parts
        }

    def raw_digests(self) -> dict[str, str]:
        raw = self.root / "raw"
        return {
            path.relative_to(raw).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in sorted(raw.rglob("*"))
            if path.is_file()
        }


def make_campaign(
    root: Path,
    media: tuple[str, ...] = (),
    faults: tuple[str, ...] = (),
    *,
    plates_only: bool = False,
) -> Folder:
    """Write the demonstration campaign, or a part of it, into a new folder.

    Parameters
    ----------
    root : Path
    media : tuple of str, optional
        Only these; the robot stays where its medium does.
    faults : tuple of str, optional
        As for `rftfit.lab.reenact`.
    plates_only : bool, optional
        Without legs and robot.
    """
    (root / "config").mkdir(parents=True)
    values = yaml.safe_load((PROJECT / "config" / "config.yaml").read_text(encoding="utf-8"))
    if media or plates_only:
        values["media"] = {name: values["media"][name] for name in media or values["media"]}
        if plates_only or values["robot"]["medium"] not in values["media"]:
            del values["robot"]
        if plates_only:
            shapes = values["intruders"].items()
            values["intruders"] = {name: item for name, item in shapes if item["shape"] == "plate"}
        text = yaml.safe_dump(values, sort_keys=False)
        (root / "config" / "config.yaml").write_text(text, encoding="utf-8")
    else:
        shutil.copy(PROJECT / "config" / "config.yaml", root / "config" / "config.yaml")
    config = Config.model_validate(values)
    reenact(config, root / "raw" / "paper", root / "raw" / "paper" / "runs.csv", faults=faults)
    return Folder(root)
