"""The results as a Research Object Crate: what is here, and which step made it from what.

RO-Crate Metadata Specification 1.1, https://w3id.org/ro/crate/1.1: one JSON-LD file beside the data,
a flat list of entities that name each other by ``@id``.
"""

from __future__ import annotations

import json
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import rftfit
from rftfit import reference

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rftfit.campaign.config import Config
    from rftfit.stages.provenance_graph import Graph

PROFILE = "https://w3id.org/ro/crate/1.1"
NAME = "ro-crate-metadata.json"
UNKNOWN_DATE = "1970-01-01"

_FOLDER = "results/"
_PAPER = "https://doi.org/10.1126/science.1229163"
_NO_LICENCE = "None is stated: ask those who measured before you use these results elsewhere."
_PROGRAM, _LOGS = "#rftfit", "#logs"
_FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".parquet": "application/vnd.apache.parquet",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".sha256": "text/plain",
    ".svg": "image/svg+xml",
    ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
}

Entity = dict[str, Any]


def crate(
    config: Config, graph: Graph, files: Mapping[str, tuple[int, str]], sums: str, logs: int
) -> str:
    """Describe the folder of results.

    Parameters
    ----------
    config : Config
        For the title, and the date, authors and licence where it gives them.
    graph : Graph
        Which step made which result.
    files : mapping of str to (int, str)
        Size in bytes and SHA-256 of each result, by path from the campaign's folder.
    sums : str
        The one of them that lists the logs and their SHA-256.
    logs : int
        How many logs there are.

    Returns
    -------
    str
        ``ro-crate-metadata.json``: the same for the same inputs. The date is the config's; where it
        has none a placeholder stands, since the specification demands a date, and says so.
    """
    told = config.publication
    description = (
        "Resistive-force model of granular media from transducer and motion logs. provenance.json "
        "says which logs, rows of the run sheet, settings and code each file was made from; "
        "`rftfit verify` checks whether they are still the same."
    )
    if not told.date:
        description += " The date is a placeholder: the campaign's configuration gives none."
    root: Entity = {
        "@id": "./",
        "@type": "Dataset",
        "name": config.title,
        "description": description,
        "datePublished": told.date or UNKNOWN_DATE,
        "hasPart": [_link(path) for path in sorted(files)],
        "mentions": [{"@id": _action(name)} for name in graph.steps],
        "citation": {"@id": _PAPER},
    }
    others: list[Entity] = []
    root["license"] = {"@id": told.license} if told.license else _NO_LICENCE
    if told.license:
        others.append(
            {
                "@id": told.license,
                "@type": "CreativeWork",
                "name": told.license,
                "description": "The licence that the campaign's configuration names.",
            }
        )
    if told.authors:
        ids = [f"#author-{place}" for place in range(1, len(told.authors) + 1)]
        root["author"] = _one_or_many([{"@id": one} for one in ids])
        others += [
            {"@id": one, "@type": "Person", "name": name}
            for one, name in zip(ids, told.authors, strict=True)
        ]
    entities = [
        {
            "@id": NAME,
            "@type": "CreativeWork",
            "conformsTo": {"@id": PROFILE},
            "about": {"@id": "./"},
        },
        root,
        *(_file(path, *files[path], about=path == sums) for path in sorted(files)),
        *(_create(name, graph, files) for name in graph.steps),
        {
            "@id": _PROGRAM,
            "@type": "SoftwareApplication",
            "name": "rftfit",
            "version": rftfit.__version__,
        },
        {
            "@id": _LOGS,
            "@type": "Collection",
            "name": f"{logs} logs as recorded",
            "description": f"In the folder {config.raw} beside this crate, and not part of it; "
            f"their names and SHA-256 are in {sums.removeprefix(_FOLDER)}.",
        },
        {"@id": _PAPER, "@type": "ScholarlyArticle", "name": reference.CITATION},
        *others,
    ]
    # the 1.1 context was made before schema.org had this term
    context = [f"{PROFILE}/context", {"sha256": "http://schema.org/sha256"}]
    data = {"@context": context, "@graph": entities}
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def _identifier(path: str) -> str:
    return quote(path.removeprefix(_FOLDER))


def _link(path: str) -> Entity:
    return {"@id": _identifier(path)}


def _action(step: str) -> str:
    return f"#step-{quote(step)}"


def _one_or_many(entities: list[Entity]) -> Entity | list[Entity]:
    """Return a single entity as itself, as the specification recommends."""
    return entities[0] if len(entities) == 1 else entities


def _file(path: str, size: int, digest: str, *, about: bool) -> Entity:
    kind = PurePosixPath(path).suffix
    entity: Entity = {
        "@id": _identifier(path),
        "@type": "File",
        "name": path.removeprefix(_FOLDER),
        "contentSize": str(size),
        "encodingFormat": _FORMATS.get(kind, "application/octet-stream"),
        "sha256": digest,
    }
    return entity | ({"about": {"@id": _LOGS}} if about else {})


def _create(name: str, graph: Graph, files: Mapping[str, object]) -> Entity:
    step = graph.steps[name]
    made = [path for value in step.values for path in step.outputs(value) if path in files]
    read = dict.fromkeys(path for value in step.values for path in step.inputs(value))
    objects = [_link(path) for path in sorted(read) if path in files]
    if step.raw:
        objects.append({"@id": _LOGS})
    return {
        "@id": _action(name),
        "@type": "CreateAction",
        "name": name,
        "instrument": {"@id": _PROGRAM},
        "object": _one_or_many(objects),
        "result": _one_or_many([_link(path) for path in sorted(made)]),
    }
