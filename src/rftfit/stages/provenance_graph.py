"""Which step makes which result from what: the workflow's own rules, in a form that can be kept.

A rule has at most one wildcard (the medium).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

OWN = "own"
"""Stands for the value of the step's own wildcard."""

Values = str | tuple[str, ...]
Job = tuple[str, str]

WILDCARD = re.compile(r"\{(\w+)[^{}]*\}")
"""A wildcard in braces, with the constraint that Snakemake adds to it."""


@dataclass(frozen=True)
class Step:
    """One rule of the workflow.

    Attributes
    ----------
    name : str
        Of the rule.
    values : tuple of str
        Of its wildcard, for which it is run; an empty word where it has none.
    makes : tuple of str
        Files, with the wildcard in braces.
    reads : tuple of (str, str or tuple of str)
        Results that it reads, each with the values that stand for the wildcard in it: `OWN` or a
        list, empty where there is no wildcard.
    raw, rows : str or tuple of str
        The media whose logs and rows of the run sheet it reads: `OWN` or a list; an empty name
        stands for runs that belong to no medium.
    settings : tuple of str
        Sections of the configuration.
    modules : tuple of str
        Whose code, with all they import, it runs.
    code : str
        Digest of that code, as the workflow knew it.
    files : tuple of str
        What else it reads of the campaign: neither results nor logs of runs.
    """

    name: str
    values: tuple[str, ...] = ("",)
    makes: tuple[str, ...] = ()
    reads: tuple[tuple[str, Values], ...] = ()
    raw: Values = ()
    rows: Values = ()
    settings: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()
    code: str = ""
    files: tuple[str, ...] = ()

    def outputs(self, value: str) -> list[str]:
        """List the files of one job.

        Parameters
        ----------
        value : str
            Of the wildcard.

        Returns
        -------
        list of str
        """
        return [filled(pattern, value) for pattern in self.makes]

    def inputs(self, value: str) -> list[str]:
        """List the results that one job reads.

        Parameters
        ----------
        value : str
            Of the wildcard.

        Returns
        -------
        list of str
        """
        found = []
        for pattern, chosen in self.reads:
            values = (value,) if chosen == OWN else chosen or ("",)
            found += [filled(pattern, each) for each in values]
        return found

    def media(self, what: Values, value: str) -> tuple[str, ...]:
        """Name the media whose logs or rows one job reads.

        Parameters
        ----------
        what : str or tuple of str
            `raw` or `rows`.
        value : str
            Of the wildcard.

        Returns
        -------
        tuple of str
        """
        return (value,) if isinstance(what, str) else what


@dataclass(frozen=True)
class Graph:
    """All steps that lead to some results.

    Attributes
    ----------
    steps : dict of str to Step
        By name.
    makers : dict of str to (str, str)
        Step and wildcard that make a file.
    """

    steps: dict[str, Step]
    makers: dict[str, Job] = field(init=False)

    def __post_init__(self) -> None:
        makers = {
            file: (step.name, value)
            for step in self.steps.values()
            for value in step.values
            for file in step.outputs(value)
        }
        object.__setattr__(self, "makers", makers)

    def parents(self, job: Job) -> list[Job]:
        """Name the jobs whose results a job reads.

        Parameters
        ----------
        job : (str, str)

        Returns
        -------
        list of (str, str)
        """
        name, value = job
        files = self.steps[name].inputs(value)
        return list(dict.fromkeys(self.makers[file] for file in files if file in self.makers))

    def chain(self, file: str) -> list[Job]:
        """Name all jobs behind a result, the one that makes it last.

        Parameters
        ----------
        file : str

        Returns
        -------
        list of (str, str)
            Each after all jobs whose results it reads.
        """
        done: dict[Job, None] = {}
        waiting = [(self.makers[file], False)]
        while waiting:
            job, ready = waiting.pop()
            if ready:
                done.setdefault(job)
            elif job not in done:
                waiting.append((job, True))
                waiting += [(parent, False) for parent in self.parents(job) if parent not in done]
        return list(done)

    def packed(self) -> dict[str, Any]:
        """Return the graph as plain data; lists that occur often are given names.

        Returns
        -------
        dict
            ``lists`` and ``steps``; `unpacked` takes it back.
        """
        names: dict[tuple[str, ...], str] = {}

        def short(values: Values) -> str | list[str]:
            if isinstance(values, str) or len(values) < 2:
                return values if isinstance(values, str) else list(values)
            return names.setdefault(values, f"list {len(names) + 1}")

        steps = {
            step.name: {
                "for": short(step.values),
                "makes": list(step.makes),
                "reads": [[pattern, short(values)] for pattern, values in step.reads],
                "raw": short(step.raw),
                "rows": short(step.rows),
                "settings": list(step.settings),
                "modules": list(step.modules),
                "code": step.code,
                "files": list(step.files),
            }
            for step in self.steps.values()
        }
        return {"lists": {name: list(values) for values, name in names.items()}, "steps": steps}


def unpacked(data: Mapping[str, Any]) -> Graph:
    """Take back what `Graph.packed` gave.

    Parameters
    ----------
    data : mapping

    Returns
    -------
    Graph

    Raises
    ------
    KeyError, TypeError
        If it is something else.
    """
    lists = data["lists"]

    def whole(values: str | list[str]) -> Values:
        if values == OWN:
            return OWN
        return tuple(lists[values] if isinstance(values, str) else values)

    return Graph(
        {
            name: Step(
                name,
                tuple(whole(step["for"])),
                tuple(step["makes"]),
                tuple((pattern, whole(values)) for pattern, values in step["reads"]),
                whole(step["raw"]),
                whole(step["rows"]),
                tuple(step["settings"]),
                tuple(step["modules"]),
                str(step["code"]),
                tuple(step["files"]),
            )
            for name, step in data["steps"].items()
        }
    )


def filled(pattern: str, value: str) -> str:
    """Put a value in the place of the wildcard.

    Parameters
    ----------
    pattern, value : str

    Returns
    -------
    str
    """
    return WILDCARD.sub(lambda _: value, pattern)
