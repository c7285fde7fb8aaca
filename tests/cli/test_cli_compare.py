"""`rftfit compare` compares the named media, folders or sessions and refuses unknown names."""

import numpy as np
import pandas as pd
import pytest
from compare_media import Beds, published, runs_of
from makers import row_of_push, write_rows
from result_tables import LABORATORY, make_campaign

from rftfit import compare_media, reference
from rftfit.outputs.dictionary import describe_file
from rftfit.store import write_csv

MEDIA = ("poppy_LP", "poppy_CP")


def write_fits(root, medium, seed, places):
    """Write fits of a medium in some directions, two runs each; returns their rows of the sheet, the second labelled friday."""
    truth = published(medium)[:, places]
    rng = np.random.default_rng(seed)
    runs = runs_of(truth, np.full(len(places), 6.0), 2, rng, Beds())
    runs["run_id"] = [f"{medium}_{place}" for place in range(len(runs))]
    output = describe_file(f"results/fits/{medium}.csv")
    assert output is not None
    kinds = {name: column.kind for column in output.columns for name in column.names}
    empty = {name: np.nan if kinds[name] == "number" else "" for name in kinds}
    empty |= {"n_points": 5, "mirrored": False, "medium": medium}
    table = pd.DataFrame(empty, index=runs.index).assign(**runs)
    write_csv(table, root / "results" / "fits" / f"{medium}.csv")
    return [
        row_of_push(
            abs(run["gamma_deg"]),
            run["run_id"],
            medium=medium,
            direction="intrusion" if run["gamma_deg"] > 0 else "extraction",
            beta_deg=run["beta_deg"],
            motion_log=f"{run['run_id']}_motion.csv",
            session="friday" if place % 2 else "monday",
        )
        for place, run in enumerate(runs.to_dict("records"))
    ]


def make(root, media, places=range(0, 70, 7)):
    """A campaign with fits; its run sheet has sessions."""
    alpha = {medium: reference.alpha_grid(medium) for medium in media}
    make_campaign(root, dict.fromkeys(media, LABORATORY), alpha)
    slanted = [place for place in places if published(media[0])[1, place] != 0]
    rows = [write_fits(root, medium, seed, slanted) for seed, medium in enumerate(media)]
    write_rows(
        root / "config" / "runs.csv", [row for rows_of_medium in rows for row in rows_of_medium]
    )
    return root


@pytest.fixture
def labs(work_folder):
    """Two campaigns; the second has one medium."""
    make(work_folder / "one lab", MEDIA)
    make(work_folder / "other", MEDIA[:1])
    return work_folder


def test_maps_where_no_direction_is_common(rftfit, refusal, labs):
    make(labs / "third", MEDIA[:1], range(3, 70, 7))
    text = rftfit("compare other third --figure c.svg").out
    assert [line for line in text.splitlines() if line.startswith("Note: other and third ")]
    assert (labs / "c.svg").is_file()
    comparison = compare_media(labs / "other", labs / "third")
    assert comparison.ratio_lo < comparison.ratio < comparison.ratio_hi
    assert comparison.ratio_lo * comparison.ratio_hi == pytest.approx(comparison.ratio**2)
    assert "other@monday" in refusal("compare other@monday third")
