"""Each flag, reason and outcome of a check has one code with its sentence."""

import re
from pathlib import Path

import pytest

import rftfit
from rftfit.checks.declared import CHECKS
from rftfit.measure.flags import remark
from rftfit.measure.sentences import FLAGS


def test_every_code_of_the_source_has_a_sentence():
    root = Path(rftfit.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in root.rglob("*.py"))
    used = re.findall(r'\b(?:remark|Refused)\(\s*"([^"]+)"', text)
    assert len(used) > 100
    for code in used:
        remark(code)
    with pytest.raises(KeyError):
        remark("no-such-code")


def test_every_outcome_of_a_check_has_its_words_and_no_words_are_left_over():
    folder = Path(rftfit.__file__).parent / "checks"
    source = "".join(path.read_text(encoding="utf-8") for path in folder.glob("*.py"))
    # a code whose only mention is its own declaration; that of the check itself is the default
    unused = [
        code
        for name, check in CHECKS.items()
        for code in check.outcomes
        if source.count(f'"{code}"') == 1 and code != name
    ]
    # the code of a shifted lag is built from the name of what shifted
    assert unused == ["lag-differs"]
    assert all(name in check.outcomes for name, check in CHECKS.items())


def test_the_severity_of_a_flag_is_a_rank_of_its_own_or_0():
    ranks = [flag.severity for flag in FLAGS.values() if flag.severity]
    assert len(ranks) == len({*ranks}) > 10
