"""Reading speed of every dialect beside the bare library that does its parsing.

Each file is written once, then read in turns by the library alone and by the reader; the median of
the turns counts, of wall-clock and of processor time of all cores: the latter hardly feels what else
the machine does. The library does less: it is told the format, and damage would stop it.
`--gigabyte` instead surveys and loads a log of a gigabyte and prints the memory that took.
"""

from __future__ import annotations

import argparse
import gc
import resource
import statistics
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "helpers"))

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.csv as pacsv
import pyarrow.parquet as pq
from log_files import TEXTS, netft

from rftfit.campaign.config import TextFormat
from rftfit.logs.delimited import DelimitedReader
from rftfit.logs.inspect import survey
from rftfit.logs.registry import dialect

if TYPE_CHECKING:
    from collections.abc import Callable

    from rftfit.logs.base import Log, Reader

TURNS = 15
MEGABYTES = 20
RESULT = Path(__file__).parent / "results" / "logs.md"


def arrow(skip: int, delimiter: str = ",", decimal: str = ".") -> Callable[[Path], object]:
    def read(path: Path) -> object:
        return pacsv.read_csv(
            path,
            read_options=pacsv.ReadOptions(skip_rows=skip, autogenerate_column_names=True),
            parse_options=pacsv.ParseOptions(delimiter=delimiter),
            convert_options=pacsv.ConvertOptions(decimal_point=decimal),
        )

    return read


def pandas(skip: int, delimiter: str = ",", decimal: str = ".") -> Callable[[Path], object]:
    def read(path: Path) -> object:
        return pd.read_csv(path, skiprows=skip, sep=delimiter, decimal=decimal, header=None)

    return read


def read_xlsx(path: Path) -> object:
    openpyxl: Any = import_module("openpyxl")
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    rows = book.worksheets[0].iter_rows(values_only=True, min_row=2)
    return np.array(list(rows), dtype=float)


def read_parquet(path: Path) -> object:
    table = pq.read_table(path)
    return [column.to_numpy() for column in table.columns]


def read_npz(path: Path) -> object:
    with np.load(path) as file:
        return [file[name] for name in file.files]


def read_h5(path: Path) -> object:
    with h5py.File(path) as file:
        return [dataset[()] for dataset in file.values()]


TEXT = {
    "rig": (2, ",", "."),
    "ati-netft": (8, ",", "."),
    "ati-daq": (3, ",", "."),
    "rostopic": (1, ",", "."),
    "lvm": (23, "\t", ","),
    "instron": (2, ";", ","),
    "delimited": (2, r"\s+", "."),
}


def seconds(function: Callable[[Path], object], path: Path) -> tuple[float, float]:
    """Wall-clock and processor time."""
    gc.collect()
    start, used = time.perf_counter(), time.process_time()
    function(path)
    return time.perf_counter() - start, time.process_time() - used


def line(name: str, path: Path, reader: Reader, bare: dict[str, Callable[[Path], object]]) -> str:
    for function in (reader.load, *bare.values()):
        function(path)  # file cache and imports out of the way
    turns = [
        (seconds(reader.load, path), {k: seconds(f, path) for k, f in bare.items()})
        for _ in range(TURNS)
    ]
    size = path.stat().st_size / 1e6
    reader_s = statistics.median(turn[0][0] for turn in turns)
    cells = [name, f"{size:.0f}", f"{size / reader_s:.0f}"]
    for label in bare:
        library_s = statistics.median(turn[1][label][0] for turn in turns)
        ratios = [
            statistics.median(turn[0][which] / turn[1][label][which] for turn in turns)
            for which in (0, 1)
        ]
        cells += [f"{label} {size / library_s:.0f}", *(f"{ratio:.2f}" for ratio in ratios)]
    cells += ["", "", ""] * (2 - len(bare))
    return f"| {' | '.join(cells)} |"


def compare(folder: Path) -> list[str]:
    library_heads = "library, MB/s | time, ratio | processor, ratio"
    lines = [
        f"| dialect | MB | rftfit, MB/s | {library_heads} | {library_heads} |",
        "|---" * 9 + "|",
    ]
    for name, (skip, delimiter, decimal) in TEXT.items():
        sample = TEXTS[name](2000)
        path = folder / f"{name}.txt"
        body = b"".join(sample.lines)
        path.write_bytes(sample.header + body * max(1, MEGABYTES * 1_000_000 // len(body)))
        if name == "lvm":
            sample = TEXTS[name](2000)
            body = body.replace(b"\tstart", b"")
            path.write_bytes(sample.header + body * max(1, MEGABYTES * 1_000_000 // len(body)))
        bare = {"pandas": pandas(skip, delimiter, decimal)}
        if len(delimiter) == 1:
            bare["pyarrow.csv"] = arrow(skip, delimiter, decimal)
        lines.append(line(name, path, sample.reader, bare))
        print(lines[-1], flush=True)
        path.unlink()
    values = np.random.default_rng(1).normal(size=(20_000, 6)).round(6)
    frame = pd.DataFrame(values, columns=[f"F{n} [N]" for n in range(1, 7)])
    path = folder / "log.xlsx"
    frame.to_excel(path, index=False, engine="xlsxwriter")
    lines.append(line("xlsx", path, dialect("xlsx"), {"openpyxl": read_xlsx}))
    path = folder / "log.parquet"
    pq.write_table(pa.Table.from_pandas(pd.concat([frame] * 20)), path)
    lines.append(line("parquet", path, dialect("parquet"), {"pyarrow.parquet": read_parquet}))
    arrays = {str(name): frame[name].to_numpy() for name in frame}
    path = folder / "log.npz"
    tables: dict[str, Any] = {name: np.tile(values, 20) for name, values in arrays.items()}
    np.savez(path, **tables)
    lines.append(line("arrays (.npz)", path, dialect("arrays"), {"numpy": read_npz}))
    path = folder / "log.h5"
    with h5py.File(path, "w") as file:
        for name, column in arrays.items():
            file[name] = np.tile(column, 20)
    lines.append(line("arrays (.h5)", path, dialect("arrays"), {"h5py": read_h5}))
    path = folder / "dates.csv"
    times = pd.Timestamp("2026-01-02T03:04:05Z") + pd.to_timedelta(np.arange(20_000) * 10, "ms")
    stamps = pd.concat([frame.assign(time=times.strftime("%Y-%m-%dT%H:%M:%S.%fZ"))] * 10)
    stamps.to_csv(path, index=False)
    reader = DelimitedReader(TextFormat())
    lines.append(line("delimited, dates", path, reader, {"pyarrow.csv": arrow(1)}))
    return lines


def gigabyte(folder: Path) -> list[str]:
    path = folder / "log.txt"
    sample = netft(20_000)
    body = b"".join(sample.lines)
    with path.open("wb") as handle:
        handle.write(sample.header)
        for _ in range(1_000_000_000 // len(body) + 1):
            handle.write(body)
    survey(netft_stream(folder))
    before = peak()
    start = time.perf_counter()
    overview = survey(sample.reader.stream(path))
    took = time.perf_counter() - start
    size = path.stat().st_size / 1e6
    return [
        (
            f"surveyed {size:.0f} MB, {overview.rows} rows, in {took:.1f} s ({size / took:.0f} MB/s); "
            f"peak memory of the process {before:.0f} MB before, {peak():.0f} MB after"
        )
    ]


def netft_stream(folder: Path) -> list[Log]:
    path = folder / "small.txt"
    path.write_bytes(netft(1000).content)
    return list(dialect("ati-netft").stream(path))


def peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gigabyte", action="store_true")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        lines = gigabyte(Path(folder)) if chosen.gigabyte else compare(Path(folder))
    if not chosen.gigabyte:
        RESULT.parent.mkdir(exist_ok=True)
        RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
