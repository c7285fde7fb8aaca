"""A log dialect from a lab's own package is used, and a broken package affects no other dialect.

Dialect: the log format of a program.
"""

import contextlib
import importlib
import re
import shutil
import sys
from pathlib import Path

import pytest
from campaigns import Room
from log_files import refused
from makers import json_of

import rftfit
from rftfit.logs import registry as plugins_module
from rftfit.logs.registry import dialect
from rftfit.store import digests
from rftfit.workflow.provenance import changes_between, present_provenance
from rftfit.workflow.state import States, read_states

PAGE = Path(__file__).parents[2] / "docs" / "dialects.md"


def blocks(language):
    """The examples of the documentation, as a reader would copy them."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Put a package where Python finds it, as an installer does."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    modules_before = set(sys.modules)

    def put_package(package, module, code, **points):
        (site / f"{module}.py").write_text(code, "utf-8")
        info = site / f"{package.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        metadata = f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n"
        (info / "METADATA").write_text(metadata, "utf-8")
        lines = [f"{name} = {target}\n" for name, target in points.items()]
        listed = f"[{plugins_module.GROUP}]\n" + "".join(lines)
        (info / "entry_points.txt").write_text(listed, "utf-8")
        importlib.invalidate_caches()
        plugins_module.plugins.cache_clear()

    fresh()
    yield put_package
    fresh()
    for name in set(sys.modules) - modules_before:
        if name.startswith("ourlab"):
            del sys.modules[name]


def test_the_example_of_the_documentation(install, tmp_path):
    (code,) = blocks("python")
    (project,) = (block for block in blocks("toml") if "entry-points" in block)
    point = re.compile(r'^([\w-]+) = "([\w:.]+)"$', re.MULTILINE)
    name, target = point.findall(project.split("entry-points")[1])[0]
    install("ourlab-dialect", target.split(":")[0], code, **{name: target})
    (log_text,) = blocks("text")
    path = tmp_path / "run1.olf"
    path.write_text(log_text, "utf-8")
    assert json_of("inspect", path)["dialect"] == name
    assert "package ourlab-dialect" in dialect(name).describe()
    log = rftfit.read_log(path)
    assert log.size == len(log_text.splitlines()) - 2
    assert log.units == {"time": "s", "Fx": "N", "Fy": "N", "Fz": "N"}
    # cut anywhere, it behaves as the program's own readers do
    content = log_text.encode()
    for stop in range(len(content)):
        path.write_bytes(content[:stop])
        with contextlib.suppress(rftfit.RftfitError):
            cut_log = rftfit.read_log(path, name)
            assert cut_log.size <= content[:stop].count(b"\n") - 2


GOOD = "class D:\n    def describe(self): return 'ours'\n    def detect(self, head): return head[:4] == b'OURS'\n"


def test_broken_ones_say_so_and_harm_nobody(install, tmp_path):
    failing = GOOD + "    def load(self, path): return 1 / 0\n"
    wrong = failing.replace("1 / 0", "[1]").replace("return head", "return 1 / len(head[:0]), head")
    for package, code, name in (
        ("broken", "import no_such_module\n", "a-broken"),
        ("partial", GOOD, "partial"),
        ("failing", failing, "failing"),
        ("wrong", wrong, "wrong"),
        ("thief", failing, "rig"),
        ("one", failing, "same"),
        ("two", failing, "same"),
    ):
        install(f"ourlab-{package}", f"ourlab_{package}", code, **{name: f"ourlab_{package}:D"})
    path = tmp_path / "log"
    path.write_bytes(b"words that no dialect reads")
    with pytest.raises(rftfit.RftfitError) as caught:
        rftfit.read_log(path)
    text = str(caught.value)
    for words in (
        "a-broken of package ourlab-broken (ourlab_broken:D) cannot be loaded",
        "No module named 'no_such_module'",
        "partial of package ourlab-partial",
        "it has no load",
        "rig of package ourlab-thief has the name of one of the program's own",
        "in package ourlab-one and in package ourlab-two",
    ):
        assert words in text
    assert "ourlab-one" in dialect("same").describe()
    assert "package" not in dialect("rig").describe()
    with pytest.raises(rftfit.RftfitError, match="a-broken of package ourlab-broken"):
        rftfit.read_log(path, "a-broken")
    path.write_bytes(b"OURS 1\n")
    with pytest.raises(rftfit.RftfitError, match="package ourlab-failing failed"):
        rftfit.read_log(path)
    assert not dialect("wrong").detect(b"OURS")
    for name, values in (
        ("failing", "package ourlab-failing failed: ZeroDivisionError"),
        ("wrong", " a list, not a rftfit.logs.base.Log"),
    ):
        refused(dialect(name), path, "plugin", values)


# --- the code of a plug-in is part of what made a result ------------------------------------------------


def fresh():
    """What a new process knows."""
    plugins_module.plugins.cache_clear()
    digests.plugin_digest.cache_clear()


def test_a_changed_plug_in_is_told(install, tmp_path):
    code = GOOD + "    def load(self, path): raise OSError\n"
    install("ourlab-dialect", "ourlab_dialect", code, ours="ourlab_dialect:D")
    (tmp_path / "campaign").mkdir()
    room = Room(tmp_path / "campaign")
    room.config += "dialect: ours\nclock: {method: estimate}\n"
    room.write()
    states = read_states(room.path)
    jobs = (("ingest", "poppy_LP"), ("figure", "clocks_poppy_LP"), ("fourier", ""))
    codes_before = [states.state_of(*job)["code"] for job in jobs]
    state = present_provenance(states)
    assert state.versions["ourlab-dialect"] == "1.0"
    assert "ourlab_dialect" in state.modules

    module = tmp_path / "site" / "ourlab_dialect.py"
    module.write_text(code.replace("OSError", "ValueError"), "utf-8")
    fresh()
    changed = States(states.campaign)
    codes_after = [changed.state_of(*job)["code"] for job in jobs]
    # a figure that reads logs is drawn again too
    assert [
        change != new_code for change, new_code in zip(codes_before, codes_after, strict=True)
    ] == [True, True, False]
    changes = changes_between(state, present_provenance(changed))
    assert [(change.sort, change.name) for change in changes] == [("code", "ourlab_dialect")]

    (tmp_path / "site" / "ourlab_dialect.py").unlink()
    shutil.rmtree(tmp_path / "site" / "ourlab_dialect-1.0.dist-info")
    sys.modules.pop("ourlab_dialect", None)
    importlib.invalidate_caches()
    fresh()
    removals = [
        change
        for change in changes_between(state, present_provenance(states))
        if change.now == "not there"
    ]
    assert ("code", "ourlab_dialect") in [(change.sort, change.name) for change in removals]
