"""No command changes anything outside of its folder through a link that lies in the folder."""

from __future__ import annotations

import os
import re
import shutil

import pooch
import pytest
from campaigns import Folder, make_campaign

from rftfit.bench.watch import Watch
from rftfit.store import write_text

pytestmark = pytest.mark.skipif(os.name != "posix", reason="links need no rights on POSIX only")

PLACES = [
    "results",
    "results/logs",
    "results/logs/snakemake.log",
    "results/alpha",
    "results/alpha/sand.csv",
    "results/state/checks",
    "results/records/ingest/sand.json",
    ".snakemake",
    ".snakemake/rftfit",
    ".snakemake/rftfit/holder",
    ".snakemake/log",
]
"""What a run writes, where a link may lie in its way."""


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(pooch, "os_cache", lambda name: tmp_path / "cache" / name)


@pytest.fixture
def elsewhere(tmp_path):
    """A folder outside with a file; it must stay as it is."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    yield folder
    assert contents(folder) == {"mine.txt": b"mine"}


@pytest.fixture
def campaign(tmp_path):
    return make_campaign(tmp_path / "stranger's", ("yuma",), plates_only=True)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("dangling", [False, True])
@pytest.mark.parametrize("place", PLACES)
def test_a_link_at_any_place_that_a_run_writes_is_refused(campaign, elsewhere, place, dangling):
    link = campaign.root / place
    link.parent.mkdir(parents=True, exist_ok=True)
    is_file = "." in place.rpartition("/")[2].lstrip(".") or place.endswith("holder")
    target = elsewhere / ("none" if dangling else "mine.txt" if is_file else "")
    link.symlink_to(target)
    for command in (("run",), ("run", "--dry-run"), ("run", "--unlock")):
        process = campaign.rftfit(*command)
        assert process.returncode == 2
        assert f"{link} -> " in process.stderr
        assert "--results-at DIR" in process.stderr
    assert link.is_symlink()


@pytest.mark.parametrize(
    ("place", "command"),
    [
        ("raw", ("reenact",)),
        ("raw/paper", ("reenact",)),
        ("config", ("init", ".")),
        ("config/runs.csv", ("init", ".")),
    ],
)
def test_what_writes_logs_or_settings_follows_no_link(campaign, tmp_path, place, command):
    link, outside = campaign.root / place, tmp_path / "outside"
    if link.is_dir():
        # the same content outside, so that nothing but the link is to be refused
        shutil.copytree(link, outside)
        shutil.rmtree(link)
    link.unlink(missing_ok=True)
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(outside)
    contents_before = contents(outside)
    assert campaign.rftfit(*command).returncode != 0
    assert contents(outside) == contents_before


INIT_WRITES = [
    "README.md",
    "raw",
    "raw/README.md",
    "config",
    "config/README.md",
    "config/config.schema.json",
    "config/runs.csv",
    "config/config.yaml",
]


def plant(link, elsewhere, way):
    """Put a link that leads to a file of somebody else, to a folder, or nowhere, by an absolute or a relative path."""
    link.parent.mkdir(parents=True, exist_ok=True)
    target = {"file": elsewhere / "mine.txt", "folder": elsewhere, "nowhere": elsewhere / "none"}
    of_link = target[way.removeprefix("relative ")]
    link.symlink_to(
        os.path.relpath(of_link, link.parent) if way.startswith("relative") else of_link
    )


WAYS = ["file", "folder", "nowhere", "relative nowhere"]


TABLE_WRITES = ["raw", "raw/table.csv", "config", "config/config.yaml"]
"""Of a campaign that is made from a table."""


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(
    ("place", "words"),
    [
        *((place, ()) for place in INIT_WRITES),
        *((place, ("--alpha-table", "../table.csv")) for place in TABLE_WRITES),
    ],
)
def test_init_writes_through_no_link(tmp_path, elsewhere, place, words, way):
    folder = Folder(tmp_path / "new")
    plant(folder.root / place, elsewhere, way)
    table = "medium,beta_deg,gamma_deg,alpha_z,alpha_x\nsand,0,90,1.2,0\n"
    (tmp_path / "table.csv").write_text(table, encoding="utf-8")
    process = folder.rftfit("init", ".", *words)
    assert process.returncode == 2
    assert place in process.stderr
    assert [
        path for path in folder.root.rglob("*") if path.is_file() and not path.is_symlink()
    ] == []


@pytest.mark.parametrize(
    "words", [("init", "mylab"), ("example", "cmu-sand", "mylab"), ("reenact", "--live", "mylab")]
)
@pytest.mark.parametrize("dangling", [False, True])
def test_a_new_campaign_is_made_through_no_link_of_its_own_name(
    campaign, elsewhere, words, dangling
):
    (campaign.root / "mylab").symlink_to(elsewhere / ("none" if dangling else ""))
    process = campaign.rftfit(*words)
    assert process.returncode == 2
    assert str(elsewhere) in process.stderr
    assert not (elsewhere / "none").exists()


RAW_WRITES = [
    "raw",
    "raw/paper",
    "raw/paper/REENACTED.txt",
    "raw/paper/runs.csv",
    "raw/paper/yuma",
    "raw/paper/yuma/yuma_bp00_g90_in_force.csv",
    "raw/paper/.runs.@.part.csv",
]
"""Of a re-enactment; @: the number of the process, which can be guessed."""


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("place", RAW_WRITES)
@pytest.mark.parametrize("live", [False, True])
def test_a_re_enactment_writes_through_no_link(tmp_path, elsewhere, place, way, live):
    campaign = make_campaign(tmp_path / "campaign", ("yuma",), plates_only=True)
    shutil.rmtree(campaign.root / "raw")
    link = campaign.root / place.replace("@", str(os.getpid()))
    plant(link, elsewhere, way)
    words = ("--live", ".", "--pace", "0", "--bad", "0", "--grid", "0:90") if live else ()
    assert campaign.rftfit("reenact", *words).returncode == 2
    assert link.is_symlink()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("place", ["config", "config/config.yaml"])
def test_a_live_re_enactment_copies_its_config_through_no_link(tmp_path, elsewhere, place, way):
    campaign = make_campaign(tmp_path / "campaign", ("yuma",), plates_only=True)
    plant(campaign.root / "bench" / place, elsewhere, way)
    process = campaign.rftfit("reenact", "--live", "bench", "--pace", "0")
    assert process.returncode == 2
    assert f"bench/{place} -> " in process.stderr


def test_a_pipe_is_no_file_to_write_into(campaign):
    """To look whether it may be overwritten would wait for ever."""
    os.mkfifo(campaign.root / "profile.json")
    process = campaign.rftfit("export", "--medium", "poppy_LP")
    assert process.returncode == 3
    assert "profile.json: " in process.stderr
    assert " pipe " in process.stderr


PLANTED = (
    "rftfit-crash.txt",
    ".rftfit-crash.txt",
    "crash.txt",
    "results",
    ".snakemake",
    "config/runs.csv.part",
    ".cache",
)
"""What a command might write that only tells."""


@pytest.mark.parametrize("way", ["file", "nowhere"])
@pytest.mark.parametrize(
    "command",
    [("check",), ("check", "--diagnose"), ("inspect", "log.csv"), ("diff", ".", "."), ("verify",)],
)
def test_commands_that_only_tell_write_nothing_here(campaign, elsewhere, tmp_path, command, way):
    """Not even a report of a crash, whatever its name."""
    log = next((campaign.root / "raw").rglob("*_force.csv"))
    shutil.copyfile(log, campaign.root / "log.csv")
    for place in PLANTED:
        plant(campaign.root / place, elsewhere, way)
    contents_here = contents(campaign.root)
    campaign.rftfit(*command)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("rftfit.cli.main._invoke", fail)
        process = campaign.rftfit(*command)
    assert "Unexpected error" in process.stderr
    assert str(tmp_path / "cache") in process.stderr
    assert contents(campaign.root) == contents_here


def fail(*_, **__):
    raise RuntimeError("as a fault of the program would")


def test_a_watch_writes_nothing(campaign, elsewhere):
    """Neither a result nor a note, though links wait for them."""
    for place in ("results", ".snakemake", "rftfit-crash.txt"):
        plant(campaign.root / place, elsewhere, "folder")
    paths_here = sorted(campaign.root.rglob("*"))
    watch = Watch(campaign.config, 0.0)
    events = [event.kind for time_s in range(4) for event in watch.step(float(time_s))]
    assert "push" in events
    assert sorted(campaign.root.rglob("*")) == paths_here


@pytest.fixture
def told(campaign, monkeypatch):
    """What `rftfit run` says of links and of where the results lie before any job; empty: nothing."""
    monkeypatch.setattr("rftfit.workflow.run.run_snakemake", lambda *_, **__: 0)

    def call(*words):
        process = campaign.rftfit("run", "--dry-run", *words)
        assert process.returncode in (0, 2)
        return process.stderr if process.returncode else ""

    return call


def test_links_inside_are_refused_too_and_loops_end(campaign, told):
    results = campaign.root / "results"
    (results / "a").mkdir(parents=True)
    (results / "same").symlink_to("a")
    (results / "a" / "loop").symlink_to("..")
    text = told()
    assert "files.link-in-the-way" in text
    assert re.findall(r"(\S+) -> ", text) == [str(results / "a" / "loop"), str(results / "same")]


def test_results_on_another_disk_are_what_the_user_has_said(campaign, told, tmp_path):
    results, disk = campaign.root / "results", tmp_path / "disk"
    disk.mkdir()
    assert re.search("--results-at: found '.*none'", told("--results-at", tmp_path / "none"))
    assert told("--results-at", disk) == ""
    assert results.resolve() == disk
    assert told() == ""
    # what lies there may be a link no more than what lies here
    (disk / "alpha").symlink_to(tmp_path)
    assert f"{results / 'alpha'} -> " in told()
    # nobody else's word counts: it is kept outside of the campaign
    (disk / "alpha").unlink()
    shutil.rmtree(tmp_path / "cache")
    assert f"{results} -> " in told()


@pytest.mark.parametrize("place", ["raw", ".", ".."])
def test_results_lie_in_no_folder_of_the_lab(campaign, told, place):
    """They would stand among its logs, or over its files."""
    assert "--results-at: found " in told("--results-at", campaign.root / place)


def test_results_that_are_there_are_not_hidden_by_a_link(campaign, told, elsewhere):
    (campaign.root / "results").mkdir()
    assert f"{campaign.root / 'results'}: " in told("--results-at", elsewhere)


def test_an_unfinished_file_is_written_through_no_link(tmp_path, elsewhere):
    """Its name can be guessed: it has the number of the process."""
    (tmp_path / f".table.{os.getpid()}.part.csv").symlink_to(elsewhere / "mine.txt")
    write_text(tmp_path / "table.csv", "theirs")
    assert (tmp_path / "table.csv").read_text(encoding="utf-8") == "theirs"


WRITING = {
    "export": ("export", "--medium", "poppy_LP", "--output"),
    "predict": ("predict", "--medium", "poppy_LP", "--leg", "c_leg", "--output"),
    "scale": ("scale", "--alpha", "0.3", "--output"),
    "plan": ("plan", "--pushes", "2", "--output"),
    "inspect": ("inspect", "log.csv", "--plot"),
}


@pytest.mark.parametrize("dangling", [False, True])
@pytest.mark.parametrize("place", ["file", "folder"])
@pytest.mark.parametrize("command", sorted(WRITING))
def test_no_command_writes_its_output_through_a_link(tmp_path, elsewhere, command, place, dangling):
    stranger = Folder(tmp_path / "stranger's")
    stranger.root.mkdir()
    (stranger.root / "log.csv").write_text("time_s,force_N\n0,1\n1,2\n2,3\n", encoding="utf-8")
    ending = "png" if command.startswith("inspect") else "json" if command == "export" else "csv"
    name = f"out.{ending}" if place == "file" else f"out/new.{ending}"
    target = elsewhere / ("none" if dangling else "mine.txt" if place == "file" else "")
    (stranger.root / "out").with_suffix(f".{ending}" if place == "file" else "").symlink_to(target)
    process = stranger.rftfit(*WRITING[command], name, *(["--force"] if place == "file" else []))
    assert process.returncode == 2, process.stdout
    assert str(target.resolve()) in process.stderr
