"""What a user waits for: the whole workflow, a run with nothing to do, one changed log, start-up.

Works on a copy in a temporary folder, so that results of the project itself are left alone.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RESULT = Path(__file__).parent / "results" / "workflow.md"
CORES = "2"


def timed(*words: str, cwd: Path) -> tuple[float, str]:
    """Wall-clock seconds of a command, and what it printed; stops at a failure."""
    start = time.perf_counter()
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
    took = time.perf_counter() - start
    if done.returncode:
        sys.exit(f"{' '.join(words)} failed:\n{done.stdout}\n{done.stderr}")
    return took, done.stdout + done.stderr


def rerun_media(results: Path, since: float) -> list[str]:
    """Media whose traces are newer than a moment."""
    return sorted(
        p.stem for p in (results / "traces").glob("*.parquet") if p.stat().st_mtime > since
    )


def main() -> None:
    rftfit = str(Path(sys.executable).with_name("rftfit"))
    rows: list[tuple[str, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        shutil.copytree("config", root / "config")
        took, _ = timed(rftfit, "reenact", cwd=root)
        size = sum(p.stat().st_size for p in (root / "raw").rglob("*") if p.is_file())
        rows.append(
            ("`rftfit reenact`: the demonstration campaign", f"{took:.1f} s, {size / 1e6:.0f} MB")
        )
        took, _ = timed(rftfit, "run", "--cores", CORES, cwd=root)
        rows.append(
            (
                f"`rftfit run --cores {CORES}`: everything, from logs to figures, page and reduced robot sweep",
                f"{took:.1f} s",
            )
        )
        took, _ = timed(rftfit, "run", "--cores", CORES, cwd=root)
        rows.append(("the same again, nothing to do", f"{took:.2f} s"))
        log = min((root / "raw" / "paper" / "poppy_CP").glob("*_in_force.csv"))
        now = time.time()
        log.write_text(log.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")
        os.utime(log, (now, now))
        took, _ = timed(rftfit, "run", "--cores", CORES, cwd=root)
        media = ", ".join(rerun_media(root / "results", now))
        rows.append(("one log of poppy_CP changed", f"{took:.1f} s; logs read again: {media}"))
        took, _ = timed(rftfit, "scale", "--alpha", "0.9", cwd=root)
        rows.append(("`rftfit scale --alpha 0.9`", f"{took:.2f} s"))
        took, _ = timed(sys.executable, "-c", "import rftfit", cwd=root)
        rows.append(("`import rftfit` in a new Python", f"{took:.2f} s"))
        took, _ = timed(sys.executable, "-c", "pass", cwd=root)
        rows.append(("a new Python that does nothing", f"{took:.2f} s"))
    lines = [
        "| what | wall-clock |",
        "|---|---|",
        *(f"| {name} | {value} |" for name, value in rows),
    ]
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
