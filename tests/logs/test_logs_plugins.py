"""A lab's own dialect, from a package of its own; a broken one harms nobody else."""

import importlib
import re
import shutil
import sys
from pathlib import Path

import pytest

from rftfit.errors import InputError
from rftfit.logs import registry as plugins_module
from rftfit.logs.base import LogError
from rftfit.logs.registry import DIALECTS, claimants, dialect, dialects, faults, head_of
from rftfit.store import digests
from rftfit.workflow.provenance import changes_between, present_state
from rftfit.workflow.state import States, read_states

PAGE = Path(__file__).parents[2] / "docs" / "dialects.md"


def blocks(language):
    """The examples of the documentation, as a reader would copy them."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Put a package where Python finds it, as an installer does."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    before = set(sys.modules)

    def put(package, module, code, **points):
        (site / f"{module}.py").write_text(code, encoding="utf-8")
        info = site / f"{package.replace(chr(45), chr(95))}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", encoding="utf-8"
        )
        lines = [f"{name.replace('_', '-')} = {target}" for name, target in points.items()]
        (info / "entry_points.txt").write_text(
            "\n".join([f"[{plugins_module.GROUP}]", *lines]) + "\n", encoding="utf-8"
        )
        importlib.invalidate_caches()
        plugins_module.plugins.cache_clear()

    yield put
    plugins_module.plugins.cache_clear()
    for name in set(sys.modules) - before:
        if name.startswith("ourlab"):
            del sys.modules[name]


def test_the_example_of_the_documentation(install, tmp_path):
    (code,) = blocks("python")
    (project,) = (block for block in blocks("toml") if "entry-points" in block)
    name, target = re.findall(
        r'^([\w-]+) = "([\w:.]+)"$', project.split("entry-points")[1], re.MULTILINE
    )[0]
    module = target.split(":")[0]
    install("ourlab-dialect", module, code, **{name: target})
    (log_text,) = blocks("text")
    path = tmp_path / "run1.olf"
    path.write_text(log_text, encoding="utf-8")
    (reader,) = claimants(head_of(path))
    assert reader.name == name
    assert "package ourlab-dialect" in reader.describe()
    log = reader.load(path)
    assert log.size == len(log_text.splitlines()) - 2
    assert log.units == {"time": "s", "Fx": "N", "Fy": "N", "Fz": "N"}
    assert name in dialects()
    assert dialect(name).load_many([path])[0].rows == log.rows
    # cut anywhere, it behaves as the program's own readers do
    content = log_text.encode()
    for stop in range(len(content)):
        path.write_bytes(content[:stop])
        got = reader.load_many([path])[0]
        if not isinstance(got, LogError):
            assert got.size <= content[:stop].count(b"\n") - 2


GOOD = "class D:\n    def describe(self): return 'ours'\n    def detect(self, head): return head[:4] == b'OURS'\n"


def test_broken_ones_say_so_and_harm_nobody(install, tmp_path):
    install("ourlab-broken", "ourlab_broken", "import no_such_module\n", a_broken="ourlab_broken:D")
    install("ourlab-partial", "ourlab_partial", GOOD, partial="ourlab_partial:D")
    failing = GOOD + "    def load(self, path): return 1 / 0\n"
    install("ourlab-failing", "ourlab_failing", failing, failing="ourlab_failing:D")
    wrong = failing.replace("1 / 0", "[1]").replace("return head", "return 1 / len(head[:0]), head")
    install("ourlab-wrong", "ourlab_wrong", wrong, wrong="ourlab_wrong:D")
    install("ourlab-thief", "ourlab_thief", failing, rig="ourlab_thief:D")
    said = "\n".join(faults())
    assert (
        "the dialect a-broken of package ourlab-broken (ourlab_broken:D) cannot be loaded" in said
    )
    assert "No module named 'no_such_module'" in said
    assert "the dialect partial of package ourlab-partial" in said
    assert "it has no load" in said
    assert (
        "the dialect rig of package ourlab-thief has the name of one of the program's own" in said
    )
    assert dialect("rig") is DIALECTS["rig"]
    with pytest.raises(InputError, match="the dialect a-broken of package ourlab-broken"):
        dialect("a-broken")
    path = tmp_path / "log"
    path.write_bytes(b"OURS 1\n")
    reader = claimants(head_of(path))[0]
    assert reader.name == "failing"
    with pytest.raises(
        LogError, match="failing of package ourlab-failing failed: ZeroDivisionError"
    ):
        reader.load(path)
    assert not dialect("wrong").detect(b"OURS")
    with pytest.raises(LogError, match=r"load gave a list, not a rftfit\.logs\.base\.Log"):
        dialect("wrong").load(path)


def test_two_packages_with_one_name(install):
    code = GOOD + "    def load(self, path): raise OSError\n"
    install("ourlab-one", "ourlab_one", code, same="ourlab_one:D")
    install("ourlab-two", "ourlab_two", code, same="ourlab_two:D")
    assert "in package ourlab-one and in package ourlab-two" in "\n".join(faults())
    assert "ourlab-one" in dialects()["same"].describe()


# --- the code of a plug-in is part of what made a result ------------------------------------------------

CONFIG = PAGE.parents[1] / "config" / "config.yaml"
RUNS = (
    "run_id,kind,medium,intruder,direction,beta_deg,gamma_deg,force_log,motion_log\n"
    "p1,plate,poppy_LP,plate,intrusion,0,90,p1_f.csv,p1_m.csv\n"
)


@pytest.fixture
def campaign(tmp_path):
    """One run; its logs need not be there."""
    root = tmp_path / "campaign"
    (root / "raw" / "paper").mkdir(parents=True)
    (root / "config").mkdir()
    (root / "raw" / "paper" / "runs.csv").write_text(RUNS, encoding="utf-8")
    text = CONFIG.read_text(encoding="utf-8").split("\nrobot:")[0] + "\ndialect: ours\n"
    text = re.sub(r"^dialect: rig.*\n", "", text, flags=re.MULTILINE)
    (root / "config" / "config.yaml").write_text(text, encoding="utf-8")
    return root / "config" / "config.yaml"


def fresh():
    """What a new process knows."""
    plugins_module.plugins.cache_clear()
    digests.plugin_digest.cache_clear()


@pytest.fixture
def forgotten():
    fresh()
    yield
    fresh()


@pytest.mark.usefixtures("forgotten")
def test_a_changed_plug_in_is_told(install, campaign, tmp_path):
    code = GOOD + "    def load(self, path): raise OSError\n"
    install("ourlab-dialect", "ourlab_dialect", code, ours="ourlab_dialect:D")
    text = campaign.read_text(encoding="utf-8").replace("method: sync_line", "method: estimate")
    campaign.write_text(text, encoding="utf-8")
    states = read_states(campaign)[0]
    jobs = (("ingest", "poppy_LP"), ("figure", "clocks_poppy_LP"), ("fourier", ""))
    before = [states.of(*job)["code"] for job in jobs]
    state = present_state(states)
    assert state.versions["ourlab-dialect"] == "1.0"
    assert "ourlab_dialect" in state.modules

    site = tmp_path / "site"
    (site / "ourlab_dialect.py").write_text(code.replace("OSError", "ValueError"), encoding="utf-8")
    fresh()
    changed = States(states.campaign)
    after = [changed.of(*job)["code"] for job in jobs]
    # a figure that reads logs is drawn again too
    assert [one != other for one, other in zip(before, after, strict=True)] == [True, True, False]
    found = changes_between(state, present_state(changed))
    assert [(one.sort, one.name) for one in found] == [("code", "ourlab_dialect")]

    (site / "ourlab_dialect.py").unlink()
    shutil.rmtree(site / "ourlab_dialect-1.0.dist-info")
    sys.modules.pop("ourlab_dialect", None)
    importlib.invalidate_caches()
    fresh()
    found = changes_between(state, present_state(states))
    assert ("code", "ourlab_dialect", "not there") in [
        (one.sort, one.name, one.now) for one in found
    ]


def test_the_rig_needs_no_search_for_plug_ins(campaign, monkeypatch):
    text = campaign.read_text(encoding="utf-8").replace("dialect: ours", "dialect: rig")
    campaign.write_text(text, encoding="utf-8")
    monkeypatch.setattr(plugins_module, "plugins", lambda: pytest.fail("searched"))
    assert read_states(campaign)[0].dialects == []
