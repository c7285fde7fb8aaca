"""The dictionary of outputs describes every file and column that the program writes.

`tests/golden/test_golden.py` holds it against every file of the golden campaigns.
"""

import shutil
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from campaigns import planned_jobs

from rftfit.lab.plan import plan_runs
from rftfit.lab.write import sheet_text
from rftfit.outputs.dictionary import column_of, describe_file, outputs
from rftfit.store import write_csv
from rftfit.workflow.stages import RULES

ROOT = Path(__file__).parents[1]
TABLES = [output for output in outputs() if output.columns]


UNITS = {
    "N2_per_cm6": "N^2/cm^6",
    "N_per_cm3": "N/cm^3",
    "N_per_cm2": "N/cm^2",
    "N_per_cm": "N/cm",
    "per_cm": "1/cm",
    "N_cm": "N cm",
    "cm_per_s": "cm/s",
    "deg_per_s": "degrees/s",
    "percent": "%",
    "turns": "turns",
    "hours": "h",
    "deg": "degrees",
    "Hz": "Hz",
    "N2": "N^2",
    "N": "N",
    "cm": "cm",
    "mm": "mm",
    "s": "s",
}
"""What a name ends with, the longest first, and the unit it stands for."""


def unit_of(name):
    """Unit that a name carries; empty where it carries none."""
    return next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.file)
def test_units_in_names_are_those_of_the_dictionary(table):
    names = [name for column in table.columns for name in column.names]
    assert len(names) == len(set(names))
    for column in table.columns:
        assert column.kind in ("text", "yes or no", "count", "number", "list", "object")
        assert column.quantity
        assert column.meaning
        if column.unit.startswith("as "):
            # another column tells, and it is there; of the reproduction table a text does
            assert column.unit.removeprefix("as ") in names
            assert not any(unit_of(name) for name in column.names)
        elif table.file.endswith(".json"):
            assert not any(unit_of(name) for name in column.names)
        else:
            assert {unit_of(name) for name in column.names} == {column.unit}


def test_a_word_means_the_same_in_every_table():
    """One name, one kind, one unit.

    But `why` is a code beside samples and a text elsewhere, and strides of a track have fractions.
    """
    kinds_and_units: dict[str, set[tuple[str, str]]] = {}
    for table in (table for table in TABLES if not table.file.endswith(".json")):
        for column in table.columns:
            for name in column.names:
                if not column.unit.startswith("as ") and column.quantity != "as in the run sheet":
                    kinds_and_units.setdefault(name, set()).add((column.kind, column.unit))
    assert {name for name, kinds in kinds_and_units.items() if len(kinds) > 1} == {"why", "strides"}


def test_every_stage_and_result_is_described(tmp_path, paper_config):
    """Both ways, for a campaign that has everything: what the stages write, and who writes what."""
    raw = tmp_path / "raw" / "paper"
    (raw / "robot").mkdir(parents=True)
    shutil.copytree(ROOT / "config", tmp_path / "config")
    trial = (
        "run_id,condition,medium,curvature_times_R,frequency_Hz,track\na1,a,poppy_LP,1,2,a1.csv\n"
    )
    for name, text in {
        "runs.csv": sheet_text(plan_runs(paper_config), {}),
        "robot/runs.csv": trial,
        "robot/a1.csv": "t_s,x_cm,z_cm\n",
    }.items():
        (raw / name).write_text(text, "utf-8")
    config = tmp_path / "config" / "config.yaml"
    full = [f"results/robot_full/{name}.csv" for name in ("speed", "optimum", "errors")]
    jobs = [*planned_jobs(config), *planned_jobs(config, full)]
    for path, stage in {path: job.rule for job in jobs for path in job.writes}.items():
        output = describe_file(path)
        assert output is not None, path
        assert stage in output.stage.split(", "), path
    stages = {*RULES, "all"}
    for entry in outputs():
        if entry.file.startswith("results/"):
            assert set(entry.stage.split(", ")) <= stages, entry.file


def test_the_closest_entry_describes():
    assert describe_file("results/ledger/robot.csv") is not None
    assert describe_file("results/a/b/c/d.csv") is None
    motion: Any = describe_file("results/robot/motion.csv")
    column: Any = column_of(motion, "force_z_tripod_2_N")
    assert column.name.endswith("tripod_<number>_N")


def test_the_pages_are_made_from_it(monkeypatch):
    """Every file, column, command, option and key of a robot is on its generated page."""
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    import generated  # type: ignore[import-not-found]

    text = generated.outputs()
    for output in outputs():
        assert output.file in text
        for column in output.columns:
            assert f"`{column.names[0]}`" in text
    text = generated.commands()
    for words in (
        "## `rftfit run`",
        "| `--robot` | FILE |",
        "| `--frequency` | Hz | required |",
        "| 130 |",
    ):
        assert words in text
    assert "| `numerics.step_s` | `0.0001` | a number above 0" in generated.robot()
    assert "| `body.plates.<name>.width_cm` | required |" in generated.robot()


def test_numbers_beside_texts_have_six_digits_too(tmp_path):
    table = pd.DataFrame({"paper": [0.25642210000000004, "not stated", float("nan"), 3, True]})
    write_csv(table, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[1:] == [
        "0.256422",
        "not stated",
        '""',
        "3",
        "True",
    ]
