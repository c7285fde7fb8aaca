"""Each command and code block of the documentation does what it says, or says why it is not run."""

import importlib
import re
import shutil
import tomllib
from typing import Any

import numpy as np
import pytest
import yaml
from pages import REASONS, ROOT, Reader, blocks_of, comparable, fate, pages

import rftfit
from rftfit.campaign.config import Config
from rftfit.conventions import direction, tangent
from rftfit.robot.config import Robot

BLOCKS = [block for page in pages() for block in blocks_of(page)]
RUN = sorted({block.page for block in BLOCKS if fate(block) == "run"})
NOT_RUN = {
    "README.md": ["takes minutes"],
    "docs/example-cmu-sand.md": ["network"],
    "docs/howto/cluster.md": ["needs root", "needs root"],
    "docs/install.md": ["takes minutes"],
    "docs/theory/comparison.md": ["takes minutes"],
}
"""Pages with blocks that no test runs, and why: not more than these."""


def commands_in(block):
    """Commands of rftfit that a block calls."""
    return set(re.findall(r"\brftfit(?:\.exe)? +([a-z]+)", block.text))


def check_values(block, base):
    """Let the models judge a block of configuration; `base` has the sections it leaves out."""
    if block.language == "toml":
        assert tomllib.loads(block.text), block.place
        return
    values = yaml.safe_load(block.text)
    if "body" in values:
        Robot.model_validate(values)
        return
    without_robot = {name: section for name, section in base.items() if name != "robot"}
    Config.model_validate(without_robot | values)


@pytest.fixture(scope="module")
def base() -> dict[str, Any]:
    return yaml.safe_load((ROOT / "config" / "config.yaml").read_text("utf-8"))


def test_few_blocks_are_not_run_and_say_why():
    assert len(BLOCKS) > 30
    assert [f"{block.place}: {block.language!r}" for block in BLOCKS if not fate(block)] == []
    reasons: dict[str, list[str]] = {}
    for block in BLOCKS:
        if fate(block) == "not run":
            assert block.marks["not run"] in REASONS, block.place
            reasons.setdefault(block.page, []).append(block.marks["not run"])
    assert reasons == NOT_RUN


@pytest.mark.parametrize(
    "block", [block for block in BLOCKS if fate(block) == "run by"], ids=lambda block: block.place
)
def test_what_another_test_runs_is_run_there(block):
    text = (ROOT / block.marks["run by"]).read_text("utf-8")
    commands = commands_in(block)
    for command in commands:
        assert f'"{command}"' in text or f"import {command}\n" in text, f"{block.place}: {command}"
    # what is no command is taken from the page itself
    assert commands or f'"{block.page.rsplit("/", 1)[1]}"' in text, block.place


@pytest.mark.parametrize(
    "block",
    [
        block
        for block in BLOCKS
        if block.language in ("yaml", "toml") and fate(block) in ("checked", "file")
    ],
    ids=lambda block: block.place,
)
def test_configuration_is_valid(block, base):
    check_values(block, base)


@pytest.mark.page
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
@pytest.mark.parametrize("page", RUN)
def test_a_page_runs_from_top_to_bottom(page, tmp_path):
    reader = Reader(tmp_path)
    for block in blocks_of(page):
        if fate(block) in ("run", "file"):
            reader.follow(block)
        elif "output" in block.marks:
            assert comparable(reader.printed) == comparable(block.text), (
                f"{block.place}: make gallery"
            )
    for command, words in SAYS.get(page, {}).items():
        assert words in reader.transcript, command


def test_examples_of_the_introduction_say_what_the_package_computes():
    names: dict[str, Any] = {}
    for block in blocks_of("docs/introduction.md"):
        if block.language == "python":
            exec(block.text, names)  # noqa: S102
    cells = rftfit.published_table("table_s5").set_index(["medium", "beta_deg", "gamma_deg"])
    alpha_z = cells.loc[("poppy_LP", 30, 45), "alpha_z_N_per_cm3"]
    assert names["alpha_z"] == pytest.approx(alpha_z)
    assert names["highest"]["theta_deg"] < 0 < names["highest"]["force_z_N"]
    zeta, zeta_lo, zeta_hi = names["sand"].zeta
    assert zeta_lo < zeta < zeta_hi


def test_every_page_has_a_picture_or_a_table():
    # the list of changes is text alone
    picture_or_table = re.compile(r"^\||!\[|^```\{(generated|notebook|include)", re.MULTILINE)
    bare = [
        page for page in pages() if not picture_or_table.search((ROOT / page).read_text("utf-8"))
    ]
    assert bare == []


def test_tests_that_a_page_names_are_there():
    files = [*(ROOT / "tests").rglob("*.py")]
    code = "".join(path.read_text("utf-8") for path in files)
    test_names = {*re.findall(r"def (test_\w+)", code), *(path.stem for path in files)}
    text = "".join((ROOT / page).read_text("utf-8") for page in pages())
    names_in_pages = {*re.findall(r"\btest_\w+", text)}
    assert names_in_pages
    assert names_in_pages <= test_names


@pytest.fixture
def extension(monkeypatch):
    """A module of the build of the documentation."""
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    return importlib.import_module


@pytest.fixture
def drawings(extension):
    return extension("drawings")


def test_the_gallery_shows_every_figure(extension):
    gallery = extension("gallery")
    text = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    pictures = re.findall(r"(?m)^### `(.+)`\n\n!\[.*\]\((.+)\)", text)
    assert [name for name, _ in pictures] == [
        gallery.name_of(figure) for figure in gallery.declared()
    ]
    assert all((ROOT / "docs" / picture).is_file() for _, picture in pictures)
    stored_files = [
        *(ROOT / "docs" / "images").rglob("*.*"),
        ROOT / "docs" / "live" / "report.html",
    ]
    assert max(path.stat().st_size for path in stored_files) < 1e6
    assert sum(path.stat().st_size for path in stored_files) < 4e6


def test_the_sketch_of_the_readme_is_what_the_code_draws(drawings):
    stored = (ROOT / "docs" / "images" / "angles.svg").read_bytes().replace(b"\r\n", b"\n")
    drawn = drawings.svg(drawings.angles())
    assert drawn == drawings.svg(drawings.angles())
    assert drawn == stored, "make gallery draws it again"


@pytest.mark.page
def test_kept_drawings_are_what_the_code_draws(drawings, tmp_path):
    drawings.write(tmp_path)
    drawn = sorted(path.name for path in tmp_path.iterdir())
    kept = ROOT / "docs" / "images"
    old = [name for name in drawn if (tmp_path / name).read_bytes() != (kept / name).read_bytes()]
    assert len(drawn) > 7
    assert old == [], "make gallery draws them again"


def test_arrows_of_the_sketch_follow_the_conventions(drawings):
    axes = drawings.angles().axes[0]
    texts = [text for text in axes.texts if getattr(text, "arrow_patch", None) is not None]
    arrows = [np.subtract(text.xy, text.xyann) for text in texts]
    for way in (direction(np.radians(60)), drawings.force(*np.radians([30, 60]))):
        along = [arrow @ way / np.hypot(*arrow) / np.hypot(*way) for arrow in arrows]
        assert max(along) == pytest.approx(1)
    # beta is counted from +x downward, so the forward end of a plate at 30 degrees is the lower one
    (plate,) = (line.get_xydata() for line in axes.lines if line.get_linewidth() == 4)
    end = plate[1] - plate[0]
    assert end / np.hypot(*end) == pytest.approx(tangent(np.radians(30)))


SAYS = {
    "docs/howto/cyclic.md": {"check": "the log holds 3 strokes along this path, of 4.0 cm"},
    "docs/howto/wrong.md": {"check": "speed_cm_per_s"},
    "docs/howto/field.md": {
        "scale": "0.8001",
        "python": "0.514 0.255 N/cm^3",
        "check": "no tare in any of 3 runs",
        "run": "Of 3 runs, 3 used and 0 dropped",
    },
    "docs/howto/machine.md": {
        "inspect": "dialect: instron",
        "check": "0 errors, 0 warnings",
        "run": "Of 4 runs, 4 used and 0 dropped",
    },
    "docs/howto/robot-arm.md": {
        "inspect": "z: {column: actual_TCP_pose_2, unit: m}",
        "check": "0 errors, 0 warnings",
        "run": "Of 4 runs, 4 used and 0 dropped",
    },
    "docs/howto/simulation.md": {
        "check": "0 errors, 0 warnings",
        "run": "Of 18 runs, 18 used and 0 dropped",
    },
    "docs/howto/robot.md": {"simulate": "steady"},
}
"""What must be read on the way down a page."""


def test_a_block_that_is_wrong_is_seen(tmp_path, base):
    bad, unknown, broken, python = blocks_of(
        "page.md",
        "```yaml\nclock: {method: guess}\n```\n```shell\nls\n```\n```sh\nfalse\n```\n"
        "```python\nraise SystemExit(3)\n```\n",
    )
    with pytest.raises(ValueError, match="sync_line"):
        check_values(bad, base)
    assert fate(unknown) == ""
    reader = Reader(tmp_path)
    for block in (broken, python):
        with pytest.raises(AssertionError, match=r"page.md, line"):
            reader.follow(block)
    for text, match in (
        ("<!-- skip: because -->\n```sh\nls\n```\n", "no such mark"),
        ("- so:\n\n  ```sh\n  ls\n  ```\n", "indented"),
    ):
        with pytest.raises(AssertionError, match=match):
            blocks_of("page.md", text)


def test_what_needs_the_network_and_links_that_lead_nowhere_are_seen(tmp_path, extension):
    pytest.importorskip("sphinx")
    check, far_pages, near_pages = extension("offline_check"), tmp_path / "far", tmp_path / "near"
    page = '<a href="https://doi.org/1">paper</a><script src="own.js"></script>'
    for name, text, count in (
        ("good.html", page, 0),
        ("bad.html", '<script src="//far.example/x.js"></script>', 1),
        ("bad.css", "@import url(https://far.example/x.css);", 2),
    ):
        far_pages.mkdir(exist_ok=True)
        (far_pages / name).write_text(text, "utf-8")
        assert len(check.far_addresses(far_pages)) == count
    two = '<p id="there"><a href="#there">here</a><a href="one.html?x=1#top">1</a>'
    three = '<a href="one.html#gone">1</a><img alt="x" src="gone.png"><a href="#gone">here</a>'
    for name, text, count in (
        ("two.html", two + '<a href="https://x/y">far</a></p>', 1),
        ("one.html", '<h1 id="top">1</h1><a href="two.html#there">2</a>', 0),
        ("three.html", three, 3),
    ):
        near_pages.mkdir(exist_ok=True)
        (near_pages / name).write_text(text, "utf-8")
        assert len(check.dead_links(near_pages)) == count
