"""The steps of the workflow, read off its own rules.

This is done while Snakemake holds them, so that no second list of dependencies has to be kept in step
with them by hand.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from rftfit.stages.provenance_graph import OWN, WILDCARD, Graph, Step, Values, filled

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

Meaning = Callable[[str, str], tuple[str, ...]]

_DIGESTS = ("raw", "rows", "settings", "code")


def graph_of(
    rules: Iterable[Any], targets: Sequence[str], values: Sequence[str], meaning: Meaning
) -> Graph:
    """Read the steps off the workflow's rules.

    Parameters
    ----------
    rules : iterable
        Snakemake's; of each ``name``, ``input``, ``output`` and ``params`` are looked at.
    targets : sequence of str
        Results; what they do not need is left out.
    values : sequence of str
        What the wildcard can be.
    meaning : callable
        Says what a digest among a rule's params is of: called with the param's name (``raw``,
        ``rows``, ``settings``, ``code``) and the digest.

    Returns
    -------
    Graph
    """
    by_name = {str(rule.name): rule for rule in rules}
    makers: dict[str, tuple[str, str, str]] = {}
    for name, rule in by_name.items():
        for pattern in map(_plain, rule.output):
            for value in values if WILDCARD.search(pattern) else ("",):
                makers.setdefault(filled(pattern, value), (name, value, pattern))
    needed: dict[str, dict[str, None]] = {}
    reads: dict[str, tuple[tuple[str, Values], ...]] = {}
    others: dict[str, tuple[str, ...]] = {}
    waiting = list(targets)
    while waiting:
        name, value, _ = makers.get(waiting.pop(), ("", "", ""))
        if not name or value in needed.setdefault(name, {}):
            continue
        needed[name][value] = None
        if name not in reads:
            reads[name], others[name] = _reads(by_name[name], value, makers)
        waiting += Step(name, reads=reads[name]).inputs(value)
    steps = {}
    for name, rule in by_name.items():
        if name in reads:
            own = tuple(value for value in (*values, "") if value in needed[name])
            given = {key: _given(rule, key, own[0]) for key in _DIGESTS}
            of = {key: meaning(key, digest) if digest else () for key, digest in given.items()}
            raw, rows = (
                OWN if own[0] and of[key] == own[:1] else of[key] for key in ("raw", "rows")
            )
            steps[name] = Step(
                name, own, tuple(map(_plain, rule.output)), reads[name],
                raw, rows, of["settings"], of["code"], given["code"],
                # logs of runs are told by the digest of their content
                () if raw else others[name],
            )  # fmt: skip
    return Graph(steps)


def _reads(
    rule: Any, value: str, makers: Mapping[str, tuple[str, str, str]]
) -> tuple[tuple[tuple[str, Values], ...], tuple[str, ...]]:
    """Results among a rule's input, and what no rule makes."""
    others: dict[str, None] = {}
    found: dict[str, dict[str, None]] = {}
    own: dict[str, None] = {}
    for item in rule.input:
        if callable(item):
            files = item(SimpleNamespace(medium=value))
        elif WILDCARD.search(_plain(item)):
            own.setdefault(_plain(item))
            continue
        else:
            files = [item]
        for file in [files] if isinstance(files, str) else files:
            if str(file) in makers:
                _, chosen, pattern = makers[str(file)]
                found.setdefault(pattern, {}).setdefault(chosen)
            else:
                others.setdefault(str(file))
    lists = [(pattern, tuple(filter(None, chosen))) for pattern, chosen in found.items()]
    return (*((pattern, OWN) for pattern in own), *lists), tuple(sorted(others))


def _given(rule: Any, key: str, value: str) -> str:
    given = dict(rule.params.items()).get(key, "")
    return str(given(SimpleNamespace(medium=value)) if callable(given) else given)


def _plain(pattern: object) -> str:
    """Return a file of a rule without the constraint that Snakemake adds to a wildcard."""
    return WILDCARD.sub(lambda found: f"{{{found[1]}}}", str(pattern))
