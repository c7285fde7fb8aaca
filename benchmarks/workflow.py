"""What a user waits for: a whole run, one with nothing to do, one changed log, start-up.

    python benchmarks/workflow.py                             this checkout
    python benchmarks/workflow.py --beside FOLDER --turns 3   beside another one, in turns

Works on campaigns in a temporary folder, so that results of the project itself are left alone.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
RESULT = HERE / "benchmarks" / "results" / "workflow.md"
STEPS = {
    "reenact": "`rftfit reenact`: the demonstration campaign",
    "run": "`rftfit run --cores 2`: all, from logs to figures, page and the robot's reduced sweep",
    "again": "the same again, nothing to do",
    "changed": "one log of poppy_CP changed",
    "scale": "`rftfit scale --alpha 0.9`",
    "import": "`import rftfit` in a new Python",
    "nothing": "a new Python that does nothing",
}


def timed(checkout: Path, root: Path, *words: str) -> float:
    """Wall-clock seconds of a command of a checkout; stops at a failure."""
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    # its own environment where it has one: plug-ins of Snakemake are found among what is installed
    venv_python = checkout / ".venv" / "bin" / "python"
    python = str(venv_python) if venv_python.is_file() else sys.executable
    start = time.perf_counter()
    done = subprocess.run(
        [python, *words], cwd=root, capture_output=True, text=True, check=False, env=environment
    )
    took = time.perf_counter() - start
    if done.returncode:
        sys.exit(f"{' '.join(words)} failed:\n{done.stdout}\n{done.stderr}")
    return took


def turn(checkout: Path, root: Path) -> dict[str, float]:
    """Every step once, on the campaign in a folder."""

    def rftfit(*words: str) -> float:
        return timed(checkout, root, "-m", "rftfit", *words)

    seconds: dict[str, float] = {}
    if not (root / "config").exists():
        shutil.copytree(checkout / "config", root / "config")
        seconds["reenact"] = rftfit("reenact")
    for name in ("results", ".snakemake"):
        shutil.rmtree(root / name, ignore_errors=True)
    seconds["run"] = rftfit("run", "--cores", "2")
    seconds["again"] = rftfit("run", "--cores", "2")
    log = min((root / "raw" / "paper" / "poppy_CP").glob("*_in_force.csv"))
    log.write_text(log.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")
    seconds["changed"] = rftfit("run", "--cores", "2")
    seconds["scale"] = rftfit("scale", "--alpha", "0.9")
    seconds["import"] = timed(checkout, root, "-c", "import rftfit")
    seconds["nothing"] = timed(checkout, root, "-c", "pass")
    return seconds


def main() -> None:
    """Print a table, and keep it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--beside", type=Path, help="another checkout, such as the parent commit's")
    parser.add_argument("--turns", type=int, default=1)
    chosen = parser.parse_args()
    checkouts = [HERE, *([chosen.beside.resolve()] if chosen.beside else [])]
    seconds_of_turns: dict[Path, list[dict[str, float]]] = {checkout: [] for checkout in checkouts}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(chosen.turns):
            for number, checkout in enumerate(checkouts):
                root = Path(folder) / str(number)
                root.mkdir(exist_ok=True)
                seconds_of_turns[checkout].append(turn(checkout, root))
    lines = ["| what, median of turns | s |" + (" beside, s | ratio |" if chosen.beside else "")]
    lines.append("|---" * (4 if chosen.beside else 2) + "|")
    for step, what in STEPS.items():
        medians = [
            statistics.median(
                seconds[step] for seconds in seconds_of_turns[checkout] if step in seconds
            )
            for checkout in checkouts
        ]
        ratio = f" {medians[0] / medians[1]:.2f} |" if chosen.beside else ""
        lines.append(
            f"| {what} | " + " | ".join(f"{value:.2f}" for value in medians) + f" |{ratio}"
        )
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
