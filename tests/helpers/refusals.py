"""A log that is refused: its code, its file, and the values that its error names."""

import pytest

from rftfit.logs.base import LogError


def refused(reader, path, code, *values):
    """Return the error of a log that is refused: it has this code and names the file and these values."""
    with pytest.raises(LogError) as caught:
        reader.load(path)
    assert caught.value.code == code
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    for value in values:
        assert value in text.removeprefix(f"{path}: ")
    return caught.value
