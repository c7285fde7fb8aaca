"""Six campaigns that page and figures are judged on: whole, one push, scattered, a table, unusable, own robot.

python tests/helpers/six_campaigns.py FOLDER      writes them and runs their workflows
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from campaigns import FEW, Folder, make_campaign
from other_labs import Case, make
from paper import PROJECT

from rftfit import reference
from rftfit.cli.main import main

DEPTHS_CM = (1.0, 2.0, 3.0, 4.0, 5.0)


def demonstration(root):
    """The paper's campaign, with a coarse robot."""
    make_campaign(root)


def one_push(root):
    """One plate pushed straight down."""
    make(root, Case("one-push", "paper"))


def scattered(root):
    """25 scattered directions without a tare."""
    make(root, Case("scattered", "stroke-only", tare=False))


def stress_table(root):
    """A table of stress against depth instead of logs, of two media on a grid of its own."""
    rows = []
    for medium in ("poppy_LP", "glass3mm_CP"):
        alpha = reference.alpha_grid(medium)
        for i, beta in enumerate(reference.BETA_DEG):
            for j, gamma in enumerate(reference.GAMMA_DEG[::2]):
                z, x = (float(part[i, 2 * j]) for part in alpha)
                rows += [
                    (medium, beta, gamma, d, z * d, x * d) for d in DEPTHS_CM if np.isfinite(z)
                ]
    names = ["medium", "beta_deg", "gamma_deg", "depth_cm"]
    names += [f"stress_{c}_N_per_cm2" for c in "zx"]
    source = root.with_name(f"{root.name}.csv")
    pd.DataFrame(rows, columns=names).to_csv(source, index=False)
    code = main(["init", str(root), "--stress-table", str(source)])
    assert code == 0, "rftfit init refused the table"


def unusable(root):
    """Two media and a sand; in one medium the vertical channel is wired the wrong way round."""
    made = make_campaign(root, ("poppy_LP", "poppy_CP", "yuma"), directions=FEW)
    sheet = pd.read_csv(made.root / "raw" / "paper" / "runs.csv", comment="#")
    for name in sheet.loc[sheet["medium"] == "poppy_CP", "force_log"]:
        path = made.root / "raw" / "paper" / name
        head = "".join(f"{line}\n" for line in path.read_text().splitlines() if line[:1] == "#")
        table = pd.read_csv(path, comment="#")
        table["F3_N"] = -table["F3_N"]
        path.write_text(head + table.to_csv(index=False, float_format="%.10g"))


def own_robot(root):
    """A robot of one's own, that of the documentation, on a medium measured in few directions."""
    make_campaign(root, ("poppy_LP",), directions=FEW, robot=False)
    page = (PROJECT / "docs" / "howto" / "robot.md").read_text(encoding="utf-8")
    text = page.partition("<!-- file: walker.yaml -->\n```yaml\n")[2].partition("```")[0]
    (root / "config" / "walker.yaml").write_text(text, encoding="utf-8")
    path = root / "config" / "config.yaml"
    values = yaml.safe_load(path.read_text(encoding="utf-8"))
    values["robot"] = {"medium": "poppy_LP", "file": "config/walker.yaml"}
    path.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")


CAMPAIGNS: dict[str, Callable[[Path], None]] = {
    "demonstration": demonstration,
    "one-push": one_push,
    "scattered": scattered,
    "stress-table": stress_table,
    "unusable": unusable,
    "own-robot": own_robot,
}


def make_and_run(name, root):
    """Write one of the campaigns and run its workflow as a user does."""
    CAMPAIGNS[name](root)
    folder = Folder(root)
    done = folder.rftfit("run")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


if __name__ == "__main__":
    for name in CAMPAIGNS:
        made = make_and_run(name, Path(sys.argv[1]).resolve() / name)
        print(made.root / "results" / "report.html", flush=True)
