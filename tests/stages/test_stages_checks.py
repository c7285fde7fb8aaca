"""A mistake of a real lab in files fails the check that names it and marks or flags its cells."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

import numpy as np
import pytest
from campaigns import FEW, Folder
from mistakes import POUND_N, copied, enacted, judged, late, of_logs, stated, swapped

from rftfit.checks.declared import CHECKS
from rftfit.measure.flags import remark

MEDIUM = "poppy_CP"
LUCK = np.random.default_rng(1)
"""Random numbers of the mistakes."""


@pytest.fixture(scope="module")
def good():
    """Plates of one medium in 20 directions, without a mistake."""
    return enacted(MEDIUM, 2013, stated(), FEW)


@pytest.fixture
def lab(good):
    return copied(good)


def put(lab, settings):
    """Change settings of the config, each by its dotted key."""
    for path, value in settings.items():
        *above, last = path.split(".")
        place = lab.config
        for name in above:
            place = place[name]
        place[last] = value


def axes(**channels):
    """Another assignment of channels to axes."""
    return {"transducer.axes": {"x": "-F2", "y": "+F1", "z": "-F3"} | channels}


def size(*expected):
    """An expected alpha of the medium."""
    return {f"media.{MEDIUM}.expected_alpha": [*expected]}


def all_in_pounds(lab, _):
    def convert(log):
        log[2:] /= POUND_N

    of_logs(lab, lab.rows, convert)


def test_a_campaign_without_a_mistake_fails_no_check(lab):
    table, alpha, *_ = judged(lab)
    assert set(table["verdict"]) == {"passed", "not checked"}
    unchecked = table[table["verdict"] == "not checked"]
    # what no log can tell is said
    assert list(unchecked["code"]) == ["size-unstated"]
    assert (alpha["checks"] == "").all()


@pytest.mark.parametrize(
    ("settings", "mistake", "check", "code", "named"),
    [
        (axes(x="-F3", z="-F2"), None, "work", "work-axes", f"{remark('axes-exchanged')} .*axes.$"),
        ({}, partial(swapped, count=None), "rods", "rods-stronger", "tare_run"),
        ({"transducer.turn_deg": -4.0}, None, "symmetry", "symmetry", r" \+(7\.\d+|8(\.\d+)?) deg"),
        (size(0.4, 0.8), all_in_pounds, "size", "size", r" 0\.12.* unit "),
        ({}, partial(late, seconds=0.3), "surface", "surface-late", r" late .* 0\.3 s "),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_what_mends_it(lab, settings, mistake, check, code, named):
    put(lab, settings)
    if mistake is not None:
        mistake(lab, LUCK)
    table, alpha, *_ = judged(lab)
    outcome: Any = table.set_index("check").loc[check]
    effect = "doubtful" if check == "surface" else "unusable"
    assert (outcome["verdict"], outcome["effect"], outcome["code"]) == ("failed", effect, code)
    assert re.search(named, outcome["sentence"]), outcome["sentence"]
    assert alpha["checks"].str.contains(CHECKS[check].fault_of(code)).all()
    assert alpha["checks"].str.startswith(effect).all()


def test_an_accepted_medium_is_used_and_says_why(lab):
    why = "the mount was re-seated; see the notebook"
    put(lab, {"transducer.turn_deg": 0.0, f"media.{MEDIUM}.accept": {"symmetry": why}})
    table, alpha, *_ = judged(lab)
    outcome = table.set_index("check").loc["symmetry"]
    assert (outcome["verdict"], outcome["effect"]) == ("accepted", "")
    mark = remark("accepted", fault=CHECKS["symmetry"].fault, why=why)
    assert set(alpha["checks"]) == {str(mark)}
    assert set(alpha["checks_code"]) == {mark.code}


def test_diagnose_reads_the_logs_and_writes_nothing(lab, tmp_path):
    for name, settings in (("good", {}), ("bad", axes(z="+F3"))):
        put(lab, settings)
        lab.write(tmp_path / name)
    good = Folder(tmp_path / "good").rftfit("check", "--diagnose")
    assert (good.returncode, " is sound" in good.stdout) == (0, True)
    assert good.stdout.endswith("0 failed checks.\n")
    completed = Folder(tmp_path / "bad").rftfit("check", "--diagnose", "--strict")
    assert completed.returncode == 2
    assert completed.stdout.endswith("0 errors, 1 warning, 1 failed check.\n")
    (told,) = re.findall(rf"^{MEDIUM}, unusable: (.*)", completed.stdout, re.MULTILINE)
    assert str(remark("axes-z-reversed")) in told
    assert not list(tmp_path.glob("*/results"))
