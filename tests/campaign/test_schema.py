"""The schema, reference page and template of a campaign agree with the models that check it.

Models: `rftfit.campaign.config` and `rftfit.campaign.columns`; `rftfit init` writes the template.
"""

import json
from typing import Any

import pytest
import yaml
from campaigns import sheet_columns
from makers import answer_of, refused

from rftfit.campaign.load import check_campaign
from rftfit.campaign.schema import main


def test_the_written_files_are_in_step_with_the_models(pytestconfig, tmp_path):
    main(tmp_path)
    for name in ("config.schema.json", "README.md"):
        stored = (pytestconfig.rootpath / "config" / name).read_text("utf-8")
        generated = (tmp_path / name).read_text("utf-8")
        if name.endswith(".json"):  # as values: older versions of pydantic write 0.0 for 0
            stored, generated = json.loads(stored), json.loads(generated)
        assert stored == generated, "run python -m rftfit.campaign.schema and commit the result"


@pytest.fixture
def page(pytestconfig):
    """The page on all keys and columns."""
    return (pytestconfig.rootpath / "config" / "README.md").read_text("utf-8")


def rows_of(page):
    """Cells of each row of its tables, without those of the headers: key or column first, meaning last."""
    rows = [line for line in page.splitlines() if line.startswith("|")]
    # no cell breaks a table
    assert {line.count("|") for line in rows} == {7}
    return [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows if "`" in row]


def test_every_key_and_column_is_described(page, pytestconfig):
    rows = rows_of(page)
    assert all(row[-1] for row in rows)
    schema = pytestconfig.rootpath / "config" / "config.schema.json"
    names = [*sheet_columns(), *json.loads(schema.read_text("utf-8"))["properties"]]
    assert {f"`{name}`" for name in names} <= {row[0] for row in rows}


def test_the_schema_accepts_what_the_models_accept(pytestconfig):
    jsonschema: Any = pytest.importorskip("jsonschema")
    folder = pytestconfig.rootpath / "config"
    schema = json.loads((folder / "config.schema.json").read_text("utf-8"))
    check = jsonschema.Draft202012Validator(schema)
    problems = check_campaign(folder / "config.yaml")[1]
    # logs and sheet of the demonstration are made by `rftfit reenact`
    errors = {problem.code for problem in problems if problem.severity == "error"}
    assert errors <= {"config.raw-missing", "sheet.missing"}
    data = yaml.safe_load((folder / "config.yaml").read_text("utf-8"))
    assert check.is_valid(data)
    data["fit"]["min_pionts"] = 3
    data["container"]["width_cm"] = "22"
    assert len(list(check.iter_errors(data))) == 2


ANY_NUMBER = {"missing", "where", "options"}
"""Keys whose numbers are compared with those of a log, or handed to a dialect, as they are."""


def numbers_without_bounds(node, key=""):
    """Keys of a schema whose numbers are not bounded from both sides."""
    if isinstance(node, list):
        for part in node:
            yield from numbers_without_bounds(part, key)
    if not isinstance(node, dict) or key in ANY_NUMBER:
        return
    if node.get("type") in ("number", "integer"):
        lower, upper = {"minimum", "exclusiveMinimum"}, {"maximum", "exclusiveMaximum"}
        if not (lower & node.keys() and upper & node.keys()):
            yield key
        return
    for name, part in node.get("properties", {}).items():
        yield from numbers_without_bounds(part, name)
    for name in ("items", "prefixItems", "anyOf", "additionalProperties"):
        yield from numbers_without_bounds(node.get(name), key)


@pytest.mark.parametrize("name", ["config", "robot"])
def test_every_number_has_a_smallest_and_a_largest_value(pytestconfig, name):
    """What is stated to be 1e308 percent is a slip of the hand, and would be computed with."""
    schema = json.loads(
        (pytestconfig.rootpath / "config" / f"{name}.schema.json").read_text("utf-8")
    )
    sections = [schema, *schema["$defs"].values()]
    assert sum("properties" in section for section in sections) > 4
    unbounded = {key for section in sections for key in numbers_without_bounds(section)}
    assert unbounded == set()


def test_a_new_campaign_lacks_only_its_runs(tmp_path, page):
    folder = tmp_path / "Mai 2024, Körner"
    assert answer_of("init", folder)[0] == 0
    written = (path for path in folder.rglob("*") if path.is_file())
    assert sorted(path.relative_to(folder).as_posix() for path in written) == [
        "README.md",
        "config/README.md",
        "config/config.schema.json",
        "config/config.yaml",
        "config/runs.csv",
        "raw/README.md",
    ]
    config = folder / "config" / "config.yaml"
    assert [problem.code for problem in check_campaign(config)[1]] == ["sheet.empty"]
    needed = {row[0].strip("`").split("`")[0] for row in rows_of(page) if row[3] == "required"}
    assert len(needed) > 20
    for key in needed:
        # `table` is for campaigns without logs, which have a template of their own
        assert key.startswith("table.") or f"{key.split('.')[-1]}:" in config.read_text("utf-8")
    # the example rows lack only their logs
    rows = (folder / "README.md").read_text("utf-8").split("```csv\n")[1].split("```")[0]
    (folder / "config" / "runs.csv").write_text(rows, "utf-8")
    campaign, problems = check_campaign(config)
    assert {problem.code for problem in problems} == {"sheet.log-missing"}
    assert campaign is not None
    assert len(campaign.runs) == 8


def test_init_never_overwrites(tmp_path):
    (tmp_path / "config").mkdir()
    existing_sheet = tmp_path / "config" / "runs.csv"
    existing_sheet.write_text("mine", "utf-8")
    (tmp_path / "README.md").symlink_to(tmp_path / "nowhere")
    assert ": README.md, config/runs.csv " in refused("init", tmp_path)
    assert existing_sheet.read_text("utf-8") == "mine"
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["README.md", "config", "runs.csv"]


def test_init_into_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("", "utf-8")
    assert "this is not a folder" in refused("init", tmp_path / "file")
