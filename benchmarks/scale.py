"""Twenty campaigns: 1,000, 5,000 and 20,000 logs from text to alpha tables and to the page.

Writes the logs of one medium as the re-enacted lab would, at twice its sampling rates, and copies
them under new names into media of a thousand logs each, with a run sheet that fits, in a temporary
folder. Takes some ten minutes, 7 GB of disk, and all of two cores: `make scale`.

`make scale ARGS="--table 2000000"` measures a table of stress of so many rows instead, beside the same one
thinned to 5,000, and compares its alphas with numpy: four minutes.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import yaml

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import pyarrow as pa

    from rftfit.campaign.load import Campaign

SIZES = (1_000, 5_000, 20_000)
FLOOR_AT = 5_000
PER_MEDIUM = 1_000
RATE = 2  # times that of the demonstration campaign: 3,500 rows a force log, 100 kB a log
CORES = 2
TURNS = 3
RESULT = Path(__file__).parent / "results" / "scale.md"
CONFIG = Path("config/config.yaml")


# the campaign ------------------------------------------------------------------------------------


def template(raw: Path) -> list[Any]:
    """Write the plate and rod runs of one published medium; their logs are copied later."""
    from rftfit.campaign.load import load_campaign
    from rftfit.lab import rig
    from rftfit.lab.enact import run_logs
    from rftfit.lab.plan import plan_runs
    from rftfit.store import write_bytes

    rig.FORCE_HZ, rig.MOTION_HZ = RATE * rig.FORCE_HZ, RATE * rig.MOTION_HZ
    config = load_campaign(CONFIG).config
    runs = [run for run in plan_runs(config, ["poppy_LP"]) if run.kind in ("plate", "rod")]
    for run in runs:
        for name, content in run_logs(run, config, 2013).items():
            write_bytes(raw / name, content or b"")
    return runs


def build(root: Path, logs: int, runs: Sequence[Any], source: Path, per_medium: int) -> int:
    """Copy logs under new names until there are enough of them; bytes in all."""
    from rftfit.lab.write import sheet_text

    media = [f"bed{n:02d}" for n in range(1, max(1, logs // per_medium) + 1)]
    (root / "config").mkdir(parents=True)
    config = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    config |= {"title": f"{logs} logs", "raw": "raw", "run_sheet": "raw/runs.csv"}
    config["media"] = {name: {"title": name, "compaction": "LP"} for name in media}
    config.pop("robot", None)
    (root / CONFIG).write_text(yaml.safe_dump(config), encoding="utf-8")
    rows, size = [], 0
    plates = [run for run in runs if run.kind == "plate"]
    rods = {run.run_id: run for run in runs}
    for medium in media:
        (root / "raw" / medium).mkdir(parents=True)
        for number in range(logs // len(media) // 4):
            plate = plates[number % len(plates)]
            turn = f"{medium}_{number // len(plates) + 1}"
            tare = rods[plate.tare_run]
            for run in (tare, plate):
                new = replace(
                    run,
                    run_id=f"{turn}_{run.run_id}",
                    medium=medium,
                    tare_run=f"{turn}_{run.tare_run}" if run.tare_run else "",
                )
                for old, name in ((run.force_log, new.force_log), (run.motion_log, new.motion_log)):
                    shutil.copyfile(source / old, root / "raw" / name)
                    size += (root / "raw" / name).stat().st_size
                rows.append(new)
    (root / "raw" / "runs.csv").write_text(sheet_text(rows, {}), encoding="utf-8")
    return size


# what is measured --------------------------------------------------------------------------------


def to_alpha(campaign: Campaign, medium: str) -> int:
    """Go from the logs of a medium to its alpha table; cells of it."""
    from rftfit.measure.alpha import alpha_table
    from rftfit.measure.fits import fit_medium
    from rftfit.measure.ingest import ingest_medium
    from rftfit.measure.tare import tare_medium

    samples, runs, _ = ingest_medium(campaign, medium)
    tared, tares, _ = tare_medium(campaign, medium, samples, runs)
    fits, _, _ = fit_medium(campaign, medium, runs, tared, tares)
    if not (runs["status"] == "read").all() or fits["reason"].astype(bool).any():
        sys.exit("a run of this campaign gave no alpha: nothing was measured")
    return len(alpha_table(fits, medium, campaign.config.fit.confidence, 3))


def media_of(config: Path) -> list[str]:
    return list(yaml.safe_load(config.read_text(encoding="utf-8"))["media"])


def chain(config: Path, cores: int) -> None:
    """All media of a campaign, one after the other or two at a time."""
    from rftfit.campaign.load import load_campaign

    measure, media = partial(to_alpha, load_campaign(config)), media_of(config)
    # each process measures some media, as the jobs of the workflow do
    list(map(measure, media) if cores == 1 else _pool(cores).map(measure, media))


@cache
def _pool(cores: int) -> ProcessPoolExecutor:
    """Return processes that stay for the second turn: starting them is nobody's reading speed."""
    return ProcessPoolExecutor(cores, mp_context=get_context("spawn"))


def read_dataset(config: Path, cores: int) -> None:
    """Floor: all logs with pyarrow.dataset and nothing else."""
    import pyarrow as pa
    import pyarrow.csv as pacsv
    import pyarrow.dataset as ds

    pa.set_cpu_count(cores)
    for files, names in _files(config):
        read = pacsv.ReadOptions(skip_rows=3, column_names=names)
        form = ds.CsvFileFormat(read_options=read)
        schema = pa.schema([(name, pa.float64()) for name in names])
        table: pa.Table = ds.dataset(files, schema=schema, format=form).to_table()
        assert table.num_rows > 0


def read_polars(config: Path, cores: int) -> None:  # noqa: ARG001  # told by the environment
    """Floor: all logs with polars and nothing else, where it is installed."""
    import polars as pl  # type: ignore[import-not-found,unused-ignore]

    for files, names in _files(config):
        schema = dict.fromkeys(names, pl.Float64)
        frame = pl.scan_csv(files, skip_rows=3, has_header=False, schema=schema).collect()
        assert frame.height > 0


def read_pandas(config: Path, cores: int) -> None:  # noqa: ARG001
    """All logs one by one with pandas."""
    import pandas as pd

    for files, _ in _files(config):
        for file in files:
            pd.read_csv(file, comment="#")


def sha256(config: Path, cores: int) -> None:  # noqa: ARG001
    """Digest of every log."""
    from rftfit.store.digests import sha256_of

    for files, _ in _files(config):
        for file in files:
            sha256_of(file)


def _files(config: Path) -> list[tuple[list[str], list[str]]]:
    raw = config.parent.parent / "raw"
    with (raw / "runs.csv").open(encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    kinds = (("force_log", "abcde"), ("motion_log", "abcd"))
    return [([str(raw / row[kind]) for row in rows], list(names)) for kind, names in kinds]


WAYS: dict[str, Callable[[Path, int], None]] = {
    "rftfit": chain,
    "pyarrow.dataset": read_dataset,
    "polars.scan_csv": read_polars,
    "pandas, one by one": read_pandas,
    "sha256": sha256,
}


def inside(way: str, config: Path, cores: int, turns: int) -> None:
    """In a process of its own: do it, and print the seconds of each turn and the peak memory."""
    seconds, processor = [], []
    for _ in range(turns):
        begun, used = time.perf_counter(), time.process_time()
        WAYS[way](config, cores)
        seconds.append(time.perf_counter() - begun)
        processor.append(time.process_time() - used)
    print(json.dumps({"seconds": seconds, "processor": processor}))


# running and telling -----------------------------------------------------------------------------


def measured(words: Sequence[str], cwd: Path) -> tuple[float, float, float, str]:
    """Wall-clock and processor seconds of a command, the peak of its largest process in MB, output."""
    with tempfile.TemporaryFile("w+") as out:
        begun = time.perf_counter()
        process = subprocess.Popen(words, cwd=cwd, stdout=out, stderr=subprocess.STDOUT, text=True)
        _, status, used = os.wait4(process.pid, 0)
        took = time.perf_counter() - begun
        out.seek(0)
        output = out.read()
    if os.waitstatus_to_exitcode(status):
        sys.exit(f"{' '.join(words)} failed:\n{output[-5000:]}")
    return took, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3, output


def timed(way: str, root: Path, cores: int, turns: int = 1) -> tuple[float, float, float]:
    """Wall-clock and processor seconds of the last turn, peak MB: in a process of its own."""
    words = [sys.executable, str(Path(__file__).resolve()), "--way", way, "--turns", str(turns)]
    words += ["--config", str(root / CONFIG), "--cores", str(cores)]
    os.environ["POLARS_MAX_THREADS"] = str(cores)
    *_, peak, output = measured(words, root)
    timing = json.loads(output.splitlines()[-1])
    return timing["seconds"][-1], timing["processor"][-1], peak


def page_opens(page: Path) -> str:
    """Seconds until a browser has opened the page."""
    from chromium import Chromium, find

    program = find()
    if program is None:
        return "no browser here"
    with tempfile.TemporaryDirectory() as profile, Chromium(program, Path(profile)) as browser:
        begun = time.perf_counter()
        browser.open(page.as_uri())
        height = browser.evaluate("document.body.scrollHeight")
        took = time.perf_counter() - begun
        faults = browser.complaints()
        if faults or not height:
            sys.exit(f"{page} does not open: {faults[:1]}")
    return f"{took:.1f} s"


def one_size(root: Path, logs: int, size: int) -> list[str]:
    """Measure one campaign; a row of the table."""
    rftfit = str(Path(sys.executable).with_name("rftfit"))
    # the second turn in one process: what starting takes is no time per log
    wall, alone, peak_alone = timed("rftfit", root, 1, 2)
    targets = [f"results/alpha/{medium}.csv" for medium in media_of(root / CONFIG)]
    run = [rftfit, "run", "--cores", str(CORES)]
    alpha, _, peak_alpha, _ = measured([*run, *targets], root)
    to_page, _, peak_rest, _ = measured(run, root)
    nothing, *_ = measured(run, root)
    page = root / "results" / "report.html"
    return [
        f"{logs:,}",
        f"{size / 1e9:.2f}",
        f"{1e3 * wall / logs:.2f}",
        f"{1e3 * alone / logs:.2f}",
        f"{peak_alone:.0f}",
        f"{alpha:.1f} ({1e3 * alpha / logs:.2f})",
        f"{peak_alpha:.0f}",
        f"{to_page:.1f}",
        f"{peak_rest:.0f}",
        f"{nothing:.1f}",
        f"{page.stat().st_size / 1e6:.1f}",
        page_opens(page),
    ]


HEADS = (
    "logs",
    "GB",
    "logs to alpha in one process, ms a log",
    "its processor time, ms a log",
    "its peak, MB",
    f"`rftfit run` to alpha, {CORES} cores: s (ms a log)",
    "largest process, MB",
    "all the rest to the page, s",
    "largest process, MB",
    "nothing to do, s",
    "page, MB",
    "page opens in",
)


def floor(root: Path, logs: int) -> list[str]:
    """Compare with merely reading the files, all in turns."""
    ways = [way for way in WAYS if way != "polars.scan_csv" or _has_polars()]
    floors = [way for way in ways if way in ("pyarrow.dataset", "polars.scan_csv")]
    head = f"{logs:,} logs to alpha, or merely read"
    lines = [
        f"| {head} | cores | s | processor, s | {' | '.join(f'to {way}' for way in floors)} |",
        "|---" * (4 + len(floors)) + "|",
    ]
    for cores in (1, CORES):
        timings: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
        for _ in range(TURNS):
            for way in ways:
                # the second of two turns in one process: libraries and files are there already
                timings[way].append(timed(way, root, cores, 2)[:2])
        for way in ways if cores == 1 else ["rftfit", *floors]:
            wall, used = (statistics.median(column) for column in zip(*timings[way], strict=True))
            # of processes beside this one only the wall-clock is known
            used_text = "" if way == "rftfit" and cores > 1 else f"{used:.2f}"
            pairs = [zip(timings[way], timings[floor_way], strict=True) for floor_way in floors]
            ratios = [statistics.median(a[0] / b[0] for a, b in pair) for pair in pairs]
            cells = [
                way,
                str(cores),
                f"{wall:.2f}",
                used_text,
                *(f"{ratio:.2f}" for ratio in ratios),
            ]
            lines.append(f"| {' | '.join(cells)} |")
    return lines


def _has_polars() -> bool:
    from importlib.util import find_spec

    return find_spec("polars") is not None


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    body = [f"| {' | '.join(row)} |" for row in rows]
    return [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads), *body]


THIN = 5_000


def long_table(path: Path, rows: int) -> dict[tuple[int, int], float]:
    """Write a table of stress; its slopes alpha_z by direction, by numpy."""
    import numpy as np
    import pandas as pd

    from rftfit.lab.truth import table_s5

    random, parts, slopes = np.random.default_rng(2013), [], {}
    cells = [(b, g) for b in range(-75, 91, 15) for g in (-90, -80, -50, -20, 20, 50, 80, 90)]
    for beta, gamma in cells:
        depth = np.linspace(0.5, 8, rows // len(cells)).round(5)[:: 1 if gamma > 0 else -1]
        force = [
            (a * depth + random.normal(0, 0.01, depth.size)).round(5)
            for a in table_s5("poppy_LP", beta, gamma)
        ]
        slopes[beta, gamma] = float(force[0] @ depth / (depth @ depth))
        columns = {
            "beta_deg": beta,
            "gamma_deg": gamma,
            "depth_cm": depth,
            "stress_z_N_per_cm2": force[0],
            "stress_x_N_per_cm2": force[1],
        }
        parts.append(pd.DataFrame(columns).assign(run_id=f"b{beta}_g{gamma}"))
    pd.concat(parts).to_csv(path, index=False)
    return slopes


def watched(
    words: Sequence[str], cwd: Path, output: int | IO[bytes] = subprocess.DEVNULL
) -> tuple[float, float, float]:
    """Seconds of a command, processor seconds and largest peak in MB of all processes that it starts, directly or not.

    `output`: Where what it prints goes.
    """
    begun, peak = time.perf_counter(), 0
    errors = None if output == subprocess.DEVNULL else subprocess.STDOUT
    process = subprocess.Popen(words, cwd=cwd, stdout=output, stderr=errors)
    used = {process.pid: 0}
    while process.poll() is None:
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                stat_fields = (
                    (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
                )
                if {int(folder.name), int(stat_fields[1])} & used.keys():
                    used[int(folder.name)] = int(stat_fields[11]) + int(stat_fields[12])
                    lines = (folder / "status").read_text(encoding="utf-8").splitlines()
                    peak = max([peak, *(int(line.split()[1]) for line in lines if "VmHWM" in line)])
            except OSError:
                continue
        time.sleep(0.02)
    if process.returncode:
        sys.exit(f"{' '.join(words)} failed")
    busy = sum(used.values()) / os.sysconf("SC_CLK_TCK")
    return time.perf_counter() - begun, busy, peak / 1e3


def of_table(folder: Path, rows: int) -> list[str]:
    """Measure a long table beside a thin one, all in turns; a table of lines, with the medians."""
    import pandas as pd

    rftfit = str(Path(sys.executable).with_name("rftfit"))
    slopes = {size: long_table(folder / f"t{size}.csv", size) for size in (rows, THIN)}
    timings: dict[tuple[str, int], list[tuple[float, float, float]]] = defaultdict(list)
    for _, size in product(range(TURNS), slopes):
        root, source = folder / f"c{size}", folder / f"t{size}.csv"
        shutil.rmtree(root, ignore_errors=True)
        reading = "import sys, pandas; pandas.read_csv(sys.argv[1])"
        alone = [sys.executable, "-c", reading, str(source)]
        timings["`pandas.read_csv`", size].append(watched(alone, folder))
        init = [rftfit, "init", str(root), "--stress-table", str(source)]
        timings["`init`", size].append(watched(init, folder))
        timings["`check`", size].append(watched([rftfit, "check"], root))
        timings["`run`", size].append(watched([rftfit, "run", "--cores", str(CORES)], root))
    table_rows, pandas = [], 0.0
    for name in dict.fromkeys(name for name, _ in timings):
        (long, busy, peak), (short, little, _) = (
            map(statistics.median, zip(*timings[name, size], strict=True)) for size in slopes
        )
        pandas = pandas or busy - little
        cells = [
            f"{number:.2f}" for number in (long, busy, short, little, (busy - little) / pandas)
        ]
        table_rows.append([name, *cells, f"{peak:.0f}"])
    alpha = pd.read_csv(folder / f"c{rows}" / "results" / "fits" / f"t{rows}.csv")
    apart = [
        abs(float(row["alpha_z_N_per_cm3"]) / slopes[rows][_cell(str(row["run_id"]))] - 1)
        for row in alpha.to_dict("records")
    ]
    heads = [
        "",
        f"{rows:,} rows, s",
        "processor, s",
        f"{THIN:,} rows, s",
        "processor, s",
        "difference of processor, times pandas",
        "largest process, MB",
    ]
    end = f"{len(apart)} of {len(slopes[rows])} runs, alpha_z within {max(apart):.1e} of numpy"
    return [*table(heads, table_rows), "", end]


def _cell(run: str) -> tuple[int, int]:
    beta, gamma = run[1:].split("_g")
    return int(beta), int(gamma)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, nargs="*", default=SIZES)
    parser.add_argument(
        "--floor", type=int, default=FLOOR_AT, help="logs of that comparison; 0: none"
    )
    parser.add_argument("--table", type=int, help="rows of a table of stress, measured alone")
    parser.add_argument("--way", choices=sorted(WAYS), help=argparse.SUPPRESS)
    parser.add_argument("--config", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--cores", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--turns", type=int, default=1, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.way:
        inside(chosen.way, chosen.config, chosen.cores, chosen.turns)
        return
    if chosen.table:
        with tempfile.TemporaryDirectory() as folder:
            print(*of_table(Path(folder), chosen.table), sep="\n")
        return
    rows: list[list[str]] = []
    floor_lines: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "template"
        runs = template(source)
        root = Path(folder) / "campaign"
        if chosen.floor:
            build(root, chosen.floor, runs, source, PER_MEDIUM // 2)  # an even number of media
            floor_lines = floor(root, chosen.floor)
            print(*floor_lines, "", sep="\n", flush=True)
            shutil.rmtree(root)
        for logs in chosen.logs:
            size = build(root, logs, runs, source, PER_MEDIUM)
            rows.append(one_size(root, logs, size))
            print(*table(HEADS, rows[-1:]), sep="\n", flush=True)
            shutil.rmtree(root)
    text = "\n".join([*table(HEADS, rows), "", *floor_lines]) + "\n"
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
