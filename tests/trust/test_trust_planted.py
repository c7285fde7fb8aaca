"""No link in the place of a file that the program writes, symbolic or hard, leads to a byte of raw logs or config."""

from __future__ import annotations

import os
import random
import shutil
from pathlib import Path

import pytest
from campaigns import Folder, make_campaign, run_rules
from harm import OF_RUN, lab_files, places_of, plant, victims_of

from rftfit.bench.watch import Watch
from rftfit.lab.enact import prepare
from rftfit.store.files import open_growing, open_note, set_time
from rftfit.workflow.state import read_states

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name != "posix", reason="links need no rights on POSIX only"),
]


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """A small campaign before its first run and after it, and all places that a run writes."""
    root = tmp_path_factory.mktemp("planted")
    fresh = make_campaign(root / "fresh", ("yuma",), plates_only=True)
    done = Folder(root / "done")
    shutil.copytree(fresh.root, done.root)
    run_rules(done.config, drawn=())
    return {"fresh": fresh, "done": done, "places": places_of(done.config)}


def has_other_name(path):
    """Whether a file has a second name, by a hard link."""
    return path.is_file() and not path.is_symlink() and path.stat().st_nlink > 1


@pytest.mark.parametrize("time", ["fresh", "done"])
def test_a_hard_link_anywhere_is_cut(tiny, tmp_path, time):
    """In the place of every file at once, each to a file of the lab that is drawn; half of them before a second run."""
    campaign = Folder(tmp_path / "campaign")
    shutil.copytree(tiny[time].root, campaign.root)
    draws = random.Random(67)
    share = 1.0 if time == "fresh" else 0.5
    places = [place for place in tiny["places"] if draws.random() < share]
    victims = victims_of(campaign.root)
    for place in places:
        plant(campaign.root, place, "hard", draws.choice(victims))
    before = lab_files(campaign.root)
    assert campaign.rftfit("run", "--dry-run").returncode == 0
    assert run_rules(campaign.config, drawn=()) > 5
    assert lab_files(campaign.root) == before
    results = [place for place in places if place.startswith("results/") and "/logs/" not in place]
    assert len(results) > 30
    assert not any(has_other_name(campaign.root / place) for place in results)
    # what the lab has of these files alone
    inodes = {victim.stat().st_ino for victim in victims}
    left = [
        path for path in (campaign.root / ".snakemake").rglob("*") if path.lstat().st_ino in inodes
    ]
    assert left == []


@pytest.fixture
def victim(tmp_path):
    """A raw log, whose bytes and time stay as they are."""
    path = tmp_path / "raw.csv"
    path.write_bytes(b"1,2,3\n")
    os.utime(path, (1e9, 1e9))
    yield path
    assert (path.read_bytes(), path.stat().st_mtime) == (b"1,2,3\n", 1e9)


def link_of(victim, kind):
    link = victim.parent / ".snakemake" / "rftfit" / "holder"
    link.parent.mkdir(parents=True)
    link.symlink_to(victim) if kind == "symbolic" else os.link(victim, link)
    return link


@pytest.mark.parametrize("kind", ["symbolic", "hard"])
def test_what_is_written_in_place_is_a_new_file(victim, kind):
    """Also where a link has come after the look at the folder."""
    link = link_of(victim, kind)
    with open_growing(link) as log:
        log.write(b"a")
        log.write(b"b")
    assert link.read_bytes() == b"ab"
    link.unlink()
    link.symlink_to(victim) if kind == "symbolic" else os.link(victim, link)
    handle = open_note(link)
    os.write(handle, b"note")
    os.close(handle)
    assert link.read_bytes() == b"note"


def test_a_time_is_set_to_one_name_alone(victim):
    link = link_of(victim, "hard")
    set_time(link, 1.0)
    assert link.stat().st_mtime == 1.0
    assert link.read_bytes() == victim.read_bytes()


def test_an_unfinished_file_of_the_same_name_is_no_way_to_a_log(victim):
    """Its name can be guessed: it has the number of the process."""
    target = victim.parent / "table.csv"
    os.link(victim, victim.parent / f".table.{os.getpid()}.part.csv")
    with open_growing(target) as file:
        file.write(b"ours")
    assert target.read_bytes() == b"ours"


def test_a_copy_by_hard_links_shares_nothing_that_is_written(tiny, tmp_path):
    """As an honest lab makes its backups: both stay as they are, whichever is run."""
    root = tmp_path / "copy"
    shutil.copytree(tiny["done"].root, root, copy_function=os.link)
    for place in OF_RUN:
        path = root / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.write_text("{}", encoding="utf-8")
        original = tmp_path / place.replace("/", "_")
        os.link(path, original)
    campaign = Folder(root)
    assert campaign.rftfit("run", "--dry-run").returncode == 0
    in_place = [path for path in (root / ".snakemake").rglob("*") if has_other_name(path)]
    assert in_place == []
    assert all((root / place).read_text("utf-8") == "{}" for place in OF_RUN)
    assert has_other_name(campaign.config)


def test_environments_of_snakemake_keep_their_links(tiny, tmp_path):
    """Their links and second names are those of a package manager."""
    root = tmp_path / "campaign"
    shutil.copytree(tiny["fresh"].root, root)
    environment = root / ".snakemake" / "conda" / "0123_"
    (environment / "lib").mkdir(parents=True)
    package = tmp_path / "package.py"
    package.write_text("x = 1\n", encoding="utf-8")
    os.link(package, environment / "lib" / "package.py")
    (environment / "lib64").symlink_to("lib")
    (environment / "lib" / "rftfit").symlink_to(tmp_path)
    os.link(package, environment.with_suffix(".yaml"))
    campaign = Folder(root)
    assert campaign.rftfit("run", "--dry-run").returncode == 0
    assert has_other_name(environment / "lib" / "package.py")
    # what Snakemake writes there itself may be no file of the lab
    log = victims_of(root)[0]
    os.link(log, environment / "env_setup_done")
    assert campaign.rftfit("run", "--dry-run").returncode == 0
    assert not (environment / "env_setup_done").exists()
    assert not has_other_name(log)


def test_a_watch_and_a_re_enactment_lead_to_no_byte_either(tiny, tmp_path):
    """With a second name of the config in the place of a log, and of a log in the place of each result."""
    campaign = Folder(tmp_path / "campaign")
    shutil.copytree(tiny["done"].root, campaign.root)
    for number, place in enumerate(tiny["places"]):
        victims = victims_of(campaign.root)
        plant(campaign.root, place, "hard", victims[number % len(victims)])
    before = lab_files(campaign.root)
    watch = Watch(campaign.config, 0.0)
    for time_s in range(3):
        list(watch.step(float(time_s)))
    assert lab_files(campaign.root) == before
    log = victims_of(campaign.root)[0]
    log.unlink()
    os.link(campaign.config, log)
    states = read_states(tiny["done"].config)
    config, sheet = states.campaign.config, campaign.root / "raw" / "paper" / "runs.csv"
    prepare(config, legs=False).write(campaign.root / Path(config.raw), sheet)
    contents = {name: content for name, (content, _) in lab_files(campaign.root).items()}
    after = {name: content for name, (content, _) in before.items()}
    marker = {name for name in after if name.endswith("REENACTED.txt")}
    assert {n: c for n, c in contents.items() if n not in marker} == {
        n: c for n, c in after.items() if n not in marker
    }
