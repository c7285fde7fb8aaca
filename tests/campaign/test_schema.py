"""The schema, reference page and template of a campaign agree with the models that check it.

Models: `rftfit.campaign.config` and `rftfit.campaign.columns`; `rftfit init` writes the template.
"""

import json
import re
from typing import Any

import pytest
import yaml
from campaigns import sheet_columns
from makers import answer_of, refused

from rftfit.campaign.config import Config
from rftfit.campaign.load import check_campaign
from rftfit.campaign.schema import all_keys, json_schema, main


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


def test_every_key_and_column_is_described(page):
    for key in all_keys():
        assert key.description, key.path
        assert f"| `{'.'.join(key.path)}`" in page
    for name in sheet_columns():
        rows = re.findall(rf"^\| `{name}` \|.*\|$", page, re.MULTILINE)
        assert rows
        assert all(row.split("|")[-2].strip() for row in rows)


def test_no_table_cell_breaks_the_table(page):
    rows = [line for line in page.splitlines() if line.startswith("|")]
    assert {line.count("|") for line in rows} == {7}


def test_the_schema_accepts_what_the_models_accept(pytestconfig):
    jsonschema: Any = pytest.importorskip("jsonschema")
    check = jsonschema.Draft202012Validator(json.loads(json_schema()))
    text = (pytestconfig.rootpath / "config" / "config.yaml").read_text("utf-8")
    data = yaml.safe_load(text)
    Config.model_validate(data)
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


def test_a_new_campaign_lacks_only_its_runs(tmp_path):
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
    problems = check_campaign(folder / "config" / "config.yaml")[1]
    assert [problem.code for problem in problems] == ["sheet.empty"]


def test_the_example_rows_lack_only_their_logs(tmp_path):
    assert answer_of("init", tmp_path)[0] == 0
    text = (tmp_path / "README.md").read_text("utf-8")
    rows = text.split("```csv\n")[1].split("```")[0]
    (tmp_path / "config" / "runs.csv").write_text(rows, "utf-8")
    campaign, problems = check_campaign(tmp_path / "config" / "config.yaml")
    assert {problem.code for problem in problems} == {"sheet.log-missing"}
    assert campaign is not None
    assert len(campaign.runs) == 8


def test_the_template_names_every_needed_key(tmp_path):
    assert answer_of("init", tmp_path)[0] == 0
    text = (tmp_path / "config" / "config.yaml").read_text("utf-8")
    for key in all_keys():
        # `table` is for campaigns without logs, which have a template of their own
        if key.default == "required" and key.path[0] != "table":
            assert f"{key.path[-1]}:" in text, key.path


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
