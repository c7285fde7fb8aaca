"""The campaigns of `tests/golden`, made by commands."""

import json
import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path

import yaml
from campaign_maker import MadePushes, SimulatedLab, read_rows, run_command, write_campaign

GOLDEN = Path(__file__).parents[1] / "golden"
KNOWN_WRONG = GOLDEN / "known_wrong.toml"
SMALL = "poppy-and-sand"
"""Campaign that the fixture `small_made` makes for many tests, with its page."""

TARGETS = (
    "results/alpha_extended.csv",
    "results/ledger.csv",
    "results/reproduction.csv",
    "results/sand_correction.csv",
)
"""Results from which all tables of measurement and model follow, without figures."""
TABLES = "TABLES"
"""Word of a command that stands for `TARGETS`."""


@dataclass(frozen=True)
class GoldenCampaign:
    """A folder of `tests/golden`: config, run sheet, raw files, and what makes the rest."""

    name: str

    @property
    def folder(self):
        """Return the tracked folder."""
        return GOLDEN / self.name

    @property
    def expected(self):
        """Return the tracked folder of expected tables."""
        return self.folder / "expected"

    @property
    def settings(self):
        """Return what `campaign.toml` says."""
        return tomllib.loads((self.folder / "campaign.toml").read_text(encoding="utf-8"))

    def write(self, folder):
        """Write the campaign into a new folder."""
        files = self.folder / "files"
        if files.is_dir():
            shutil.copytree(files, folder, dirs_exist_ok=True)
        config = yaml.safe_load((self.folder / "config.yaml").read_text(encoding="utf-8"))
        sheet, raw, settings = self.folder / "runs.csv", self.folder / "raw", self.settings
        lab, pushes = settings.get("lab"), settings.get("pushes")
        write_campaign(
            folder,
            config,
            rows=read_rows(sheet) if sheet.is_file() else (),
            logs={path.relative_to(raw).as_posix(): path.read_bytes() for path in raw.rglob("*.*")},
            lab=SimulatedLab(**lab) if lab else None,
            pushes=MadePushes(**pushes) if pushes else None,
            edit_rows=self._without_pushes if "without" in settings else None,
        )

    def _without_pushes(self, rows):
        """Leave out the plates at (beta, gamma), or (beta, gamma, depth), that `campaign.toml` lists."""
        left_out = {tuple(push) for push in self.settings["without"]}
        return [row for row in rows if left_out.isdisjoint(_angles_and_depth(row))]

    def make(self, folder):
        """Write the campaign and run its commands; their exit codes and problems are a result, too."""
        self.write(folder)
        self.run_commands(folder)

    def run_commands(self, folder):
        """Run the commands that `campaign.toml` names, else ``rftfit run TABLES``, in a campaign's folder."""
        commands = self.settings.get("commands", [{"words": ["run", TABLES]}])
        (folder / "commands").mkdir()
        endings = []
        for command in commands:
            words = [*_with_targets(command["words"])]
            completed = run_command(folder, *words)
            problems = _problems(completed.stdout) if "--json" in words else []
            ending = {"command": " ".join(words), "exit_code": completed.returncode}
            endings.append(ending | {"problems": problems})
            unexpected = completed.returncode != command.get("exit_code", 0)
            assert not unexpected, completed.stdout + completed.stderr
        (folder / "commands" / "endings.json").write_text(json.dumps(endings), encoding="utf-8")


def golden_campaigns():
    """Return all campaigns of `tests/golden`, in the order of their names."""
    return [GoldenCampaign(path.parent.name) for path in sorted(GOLDEN.glob("*/campaign.toml"))]


def _with_targets(words):
    for word in words:
        yield from TARGETS if word == TABLES else (word,)


def _angles_and_depth(row):
    """Return (beta, gamma) of a plate, and (beta, gamma, depth) of one that moved level."""
    if row["kind"] != "plate":
        return ()
    angles = float(row["beta_deg"]), float(row["gamma_deg"])
    return (angles, (*angles, float(row["depth_cm"]))) if row["depth_cm"] else (angles,)


def _problems(printed):
    """Return code, severity and place of each problem that `check --json` printed, without its sentences."""
    names = ("code", "severity", "place")
    return [{name: problem[name] for name in names} for problem in json.loads(printed)["problems"]]
