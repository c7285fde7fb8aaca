"""Links in a folder that somebody else has filled: nothing outside is changed through any of them."""

from __future__ import annotations

import os
import shutil

import pooch
import pytest
from campaigns import Folder, make_campaign

from rftfit.bench.watch import Watch
from rftfit.errors import InputError
from rftfit.store import write_text
from rftfit.store.links import put_results_at, refuse_links_out, results_elsewhere

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


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setattr(pooch, "os_cache", lambda name: tmp_path / "cache" / name)


@pytest.fixture
def elsewhere(tmp_path):
    """A folder outside with a file that must stay as it is."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine", encoding="utf-8")
    return folder


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
    before = contents(elsewhere)
    for command in (("run",), ("run", "--dry-run"), ("run", "--unlock")):
        done = campaign.rftfit(*command)
        assert done.returncode == 2
        assert f"{link} -> " in done.stderr
        assert "--results-at DIR" in done.stderr
    assert contents(elsewhere) == before
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
def test_what_writes_logs_or_settings_follows_no_link(campaign, elsewhere, place, command):
    link = campaign.root / place
    if link.is_dir():
        # the same content outside, so that nothing but the link is to be refused
        shutil.copytree(link, elsewhere / "copy", dirs_exist_ok=True)
        shutil.rmtree(link)
    link.unlink(missing_ok=True)
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(elsewhere / "copy")
    before = contents(elsewhere)
    assert campaign.rftfit(*command).returncode != 0
    assert contents(elsewhere) == before


def test_links_inside_are_followed_once_and_loops_end(tmp_path):
    (tmp_path / "results" / "a").mkdir(parents=True)
    (tmp_path / "results" / "same").symlink_to("a")
    (tmp_path / "results" / "a" / "loop").symlink_to("..")
    refuse_links_out(tmp_path)


def test_results_on_another_disk_are_what_the_user_has_said(campaign, tmp_path, elsewhere):
    root = campaign.root
    with pytest.raises(InputError, match="allowed: a folder that is there"):
        put_results_at(root, tmp_path / "none")
    put_results_at(root, elsewhere)
    assert (root / "results").resolve() == elsewhere
    refuse_links_out(root, allowed=results_elsewhere(root))
    # what lies there may lead out no more than what lies here
    (elsewhere / "alpha").symlink_to(tmp_path)
    with pytest.raises(InputError, match="lead out of the campaign"):
        refuse_links_out(root, allowed=results_elsewhere(root))
    # nobody else's word counts: it is kept outside of the campaign
    shutil.rmtree(tmp_path / "cache")
    assert results_elsewhere(root) == []


def test_results_that_are_there_are_not_hidden_by_a_link(campaign, elsewhere):
    (campaign.root / "results").mkdir()
    with pytest.raises(InputError, match="there are results already"):
        put_results_at(campaign.root, elsewhere)


def test_an_unfinished_file_is_written_through_no_link(tmp_path, elsewhere):
    """Its name can be guessed: it has the number of the process."""
    (tmp_path / f".table.{os.getpid()}.part.csv").symlink_to(elsewhere / "mine.txt")
    before = contents(elsewhere)
    write_text(tmp_path / "table.csv", "theirs")
    assert contents(elsewhere) == before
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
    before = contents(elsewhere)
    done = stranger.rftfit(*WRITING[command], name, *(["--force"] if place == "file" else []))
    assert done.returncode == 2, done.stdout
    assert str(target.resolve()) in done.stderr
    assert contents(elsewhere) == before


PLANTED = (
    "rftfit-crash.txt",
    ".rftfit-crash.txt",
    "results",
    ".snakemake",
    "results/logs/snakemake.log",
    "config/runs.csv.part",
    ".cache",
)


@pytest.mark.parametrize("dangling", [False, True])
@pytest.mark.parametrize("place", PLANTED)
def test_what_only_reads_changes_nothing_through_any_link(campaign, elsewhere, place, dangling):
    link = campaign.root / place
    link.parent.mkdir(parents=True, exist_ok=True)
    link.symlink_to(elsewhere / ("none" if dangling else "mine.txt"))
    before = contents(elsewhere), campaign.raw_digests()
    log = next((campaign.root / "raw").rglob("*_force.csv")).relative_to(campaign.root)
    for command in (("check",), ("check", "--diagnose"), ("inspect", str(log))):
        assert campaign.rftfit(*command).returncode in (0, 2)
    watch = Watch(campaign.config, wait_s=0.0)
    for now in (0.0, 10.0):
        assert [*watch.step(now)] or now
    assert (contents(elsewhere), campaign.raw_digests()) == before
