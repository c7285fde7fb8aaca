"""Problems in short, to be compared as a whole: one line for each."""

from __future__ import annotations


def told(problems):
    """Code, row, column or key, what was found, and behind ~ what was meant."""
    return [" ".join(_parts(problem)) for problem in problems]


def _parts(problem):
    place = problem.place
    yield problem.code
    yield from (str(part) for part in (place.row, place.column, place.key) if part is not None)
    if problem.found is not None:
        yield repr(problem.found)
    if problem.nearest:
        yield f"~{problem.nearest}"
