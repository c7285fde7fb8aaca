"""The last stage: what every result was made from, so that `rftfit verify` can tell what has changed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rftfit.campaign.load import load_campaign
from rftfit.stages.provenance_crate import crate as describe
from rftfit.stages.provenance_graph import unpacked
from rftfit.stages.provenance_record import (
    RECORD,
    SHEET,
    SUMS,
    Record,
    as_json,
    check_still,
    digests_of_results,
    present_state,
    sheet_columns,
)
from rftfit.stages.provenance_state import logs_seen
from rftfit.store import write_csv, write_text
from rftfit.store.manifest import Seen, sha256_of, write_sums

if TYPE_CHECKING:
    from pathlib import Path


def provenance(
    config: Path, steps: str, raw: str, rows: str, settings: str, record: Path, sums: Path,
    sheet: Path, crate: Path,
) -> None:  # fmt: skip
    """Record what every result was made from.

    Parameters
    ----------
    config : Path
    steps : str
        The workflow's steps as JSON (`rftfit.stages.provenance_graph`).
    raw, rows, settings : str
        Digests of logs, run sheet and settings as the workflow knew them when it was planned.
    record : Path
        Written: ``provenance.json``.
    sums, sheet : Path
        Written: SHA-256 of every log as ``sha256sum --check`` reads it; the rows of the run sheet
        as they were understood.
    crate : Path
        Written: ``ro-crate-metadata.json``.

    Raises
    ------
    RftfitError
        If the campaign is not valid, if logs, run sheet, settings or code changed while the workflow
        ran, or if a result cannot be written.
    """
    import pandas as pd

    campaign = load_campaign(config)
    graph = unpacked(json.loads(steps))
    state = present_state(campaign, graph, logs_seen(campaign))
    check_still(campaign, graph, state, raw=raw, rows=rows, settings=settings)
    write_sums(state.logs, sums)
    write_csv(pd.DataFrame(sheet_columns(state.rows)), sheet)
    results = digests_of_results(campaign.root, graph, Seen(None))
    results |= {name: sha256_of(path) for name, path in ((SUMS, sums), (SHEET, sheet))}
    write_text(record, as_json(Record(state, graph, dict(sorted(results.items())))))
    files = {name: (campaign.root / name, digest) for name, digest in results.items()}
    files |= {SUMS: (sums, results[SUMS]), SHEET: (sheet, results[SHEET]), RECORD: (record, sha256_of(record))}  # fmt: skip
    sizes = {name: (path.stat().st_size, digest) for name, (path, digest) in files.items()}
    write_text(crate, describe(campaign.config, graph, sizes, SUMS, len(state.logs)))
