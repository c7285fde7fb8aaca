"""Every conflict between rows of a run sheet, as between run and tare, is named by row and column.

Tare: the run of the rod alone, or of the leg in air, whose force is subtracted.
"""

import pytest

T, U = "tare_run", "tare_shared"
"""Columns of the run sheet."""
BARE = {"t1": None, "th": None, "a1": None, "p1": {T: ""}, "h1": {T: ""}, "c1": {T: ""}}
"""Changes that remove all tare runs (None) and leave plate runs and legs without a tare."""
UNUSED = ("tare-unused", 3, "run_id")
"""The warning that follows where no run uses tare t1 any more."""
WARNINGS = {"tare-unused", "tare-missing", "tare-excluded", "depth-unlisted", "no-plate"}
"""Codes that are warnings; all others are errors."""
OFF = {"excluded": "yes", "reason": "arm stopped"}
"""Cells of a run that is excluded."""
LEVEL, BACK = {"gamma_deg": "45"}, {"direction": "extraction", "gamma_deg": "-0.0", "depth_cm": ""}
"""Cells of a level push and of a level pull with the wrong gamma."""


@pytest.mark.parametrize(
    ("change", "config", "problems"),
    [
        ({"p1": {T: "t_1"}}, "", [("tare-unknown", 2, T), UNUSED]),
        ({"p1": {T: "h1"}}, "", [("tare-kind", 2, T), UNUSED]),
        ({"p1": {T: "p1"}}, "", [("tare-kind", 2, T), UNUSED]),
        ({"p1": {T: "a1"}}, "", [("tare-kind", 2, T), UNUSED]),
        ({"c1": {T: "t1"}}, "", [("tare-kind", 6, T), ("tare-unused", 7, "run_id")]),
        ({"t1": {"medium": "poppy_CP"}}, "", [("tare-medium", 2, T)]),
        ({"t1": {"beta_deg": "-30"}}, "", [("tare-beta", 2, T)]),
        ({"t1": {"gamma_deg": "45.1"}}, "", [("tare-gamma", 2, T)]),
        ({"t1": {"direction": "extraction"}}, "", [("tare-direction", 2, T)]),
        ({"t1": {"intruder": "disc"}}, "", [("tare-intruder", 2, T)]),
        ({"th": {"depth_cm": "5.08"}}, "", [("tare-depth", 4, T)]),
        ({"a1": {"intruder": "flat_leg"}}, "", [("tare-intruder", 6, T)]),
        (
            {"t1": {"medium": "poppy_CP", "beta_deg": "0", "gamma_deg": "90"}},
            "",
            [("tare-medium", 2, T), ("tare-beta", 2, T), ("tare-gamma", 2, T)],
        ),
        ({"p1": {"beta_deg": "-90"}, "t1": {"beta_deg": "90"}}, "", []),
        ({"p1": {"beta_deg": "90"}, "t1": {"beta_deg": "-90.0"}}, "", []),
        ({"p1": {"beta_deg": "18.43"}, "t1": {"beta_deg": "18.435"}}, "", []),
        ({"p1": {"beta_deg": "3e1"}, "t1": {"beta_deg": "30"}}, "", []),
        ({"p2<p1": {U: "yes"}}, "", [("tare-shared", 2, U)]),
        ({"p2<p1": {U: "yes"}, "p1": {U: "yes"}}, "", []),
        ({"p2<p1": OFF}, "", []),
        ({"p2<p1": OFF | {T: ""}}, "", []),
        ({"p1": {T: ""}}, "", [("tare-missing", 2, T), UNUSED]),
        ({"c1": {T: ""}}, "", [("tare-missing", 6, T), ("tare-unused", 7, "run_id")]),
        ({f"p{n}<p1": {T: ""} for n in range(2, 8)}, "", [("tare-missing", 8, T)]),
        (BARE, "", [("tare-missing", 2, T), ("tare-missing", 3, T), ("tare-missing", 4, T)]),
        (BARE, "fit: {missing_tare: flag}", [("tare-missing", 2, T)]),
        # without a rod, as in a simulation, there is nothing to warn of
        (BARE, "fit: {missing_tare: none}", []),
        ({"t1": {"excluded": "yes", "reason": "hit the wall"}}, "", [("tare-excluded", 2, T)]),
        ({"a2<a1": {}}, "", [("tare-unused", 8, "run_id")]),
        # what must hold in a row, and in the sheet
        (
            {"h1": LEVEL, "th": LEVEL},
            "",
            [("gamma-not-zero", 4, "gamma_deg"), ("gamma-not-zero", 5, "gamma_deg")],
        ),
        (
            {"h1": BACK, "th": BACK},
            "",
            [("gamma-zero", 4, "gamma_deg"), ("gamma-zero", 5, "gamma_deg")],
        ),
        # the depths of the paper count where a config lists them
        ({"h1": {"depth_cm": "3"}, "th": {"depth_cm": "3"}}, "", []),
        (
            {"h1": {"depth_cm": "3"}, "th": {"depth_cm": "3"}},
            "fit: {horizontal_depths_cm: [2.54, 5.08, 7.62]}\n",
            [("depth-unlisted", 4, "depth_cm"), ("depth-unlisted", 5, "depth_cm")],
        ),
        (
            {"p2<p1": {"run_id": "p1", T: ""}, "p3<p1": {"run_id": "P1", T: ""}},
            "",
            [
                ("duplicate-id", 8, "run_id"),
                ("tare-missing", 8, T),
                ("case-id", 9, "run_id"),
                ("tare-missing", 9, T),
            ],
        ),
        (
            {"c1": {"direction": "x"}, "p1": {"kind": "plat", "medium": "x", "beta_deg": "x"}},
            "",
            [
                ("unknown-word", 2, "kind"),
                ("unknown-word", 2, "medium"),
                ("not-a-number", 2, "beta_deg"),
                ("unknown-word", 6, "direction"),
            ],
        ),
        (dict.fromkeys(("p1", "t1", "h1", "th")), "", [("no-plate", None, None)]),
    ],
)
def test_rows_together(room, change, config, problems):
    room.put(change)
    room.config += config
    places, reported_problems = room.list_problems()
    assert places == [(f"sheet.{code}", *place) for code, *place in problems]
    for problem, (code, *_) in zip(reported_problems, problems, strict=True):
        assert problem.severity == ("warning" if code in WARNINGS else "error")
