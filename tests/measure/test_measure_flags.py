"""Each flag and reason has one code with its sentence."""

import re
from pathlib import Path

import pytest

import rftfit
from rftfit.measure.flags import remark


def test_every_code_of_the_source_has_a_sentence():
    root = Path(rftfit.__file__).parent
    text = "".join(path.read_text(encoding="utf-8") for path in root.rglob("*.py"))
    used = re.findall(r'\b(?:remark|Refused)\(\s*"([^"]+)"', text)
    assert len(used) > 100
    for code in used:
        remark(code)
    with pytest.raises(KeyError):
        remark("no-such-code")
