"""Copies of a log filed as repeats are found, and true repeats are not taken for copies."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rftfit.measure.copies import near_copies, same_readings

SIZE = 600
"""Samples of a run."""


def force(seed, hum=0.0):
    """Force of a push, z and x, with noise of its own and a hum that all runs have in common, N."""
    random, time = np.random.default_rng(seed), np.arange(SIZE)
    wave = hum * np.sin(2 * np.pi * time / 20)
    return (
        np.stack([0.01 * time, 0.002 * time], axis=1)
        + random.normal(0, 0.05, (SIZE, 2))
        + wave[:, None]
    )


def tared(**logs):
    """Tared force of some runs of one direction; part of each is the tare, which copies may have of their own."""
    parts = [
        pd.DataFrame(
            {
                "run_id": name,
                "tare_z_N": 0.3,
                "tare_x_N": 0.0,
                "force_z_N": log[:, 0] - 0.3,
                "force_x_N": log[:, 1],
            }
        )
        for name, log in logs.items()
    ]
    return pd.concat(parts, ignore_index=True)


def last_digit(log):
    return np.asarray(log + np.random.default_rng(9).choice([-0.01, 0.0, 0.01], log.shape))


@pytest.mark.parametrize(
    ("second_log", "copy"),
    [
        (force(1), True),
        (force(1)[5:], True),
        (np.delete(force(1), np.s_[300:305], axis=0), True),
        (last_digit(force(1).round(2)), True),
        (force(2), False),
        (force(1)[:90], False),
    ],
    ids=["same", "cut at the start", "cut within", "last digit", "own noise", "too short to tell"],
)
def test_copies_have_the_noise_of_another_run(second_log, copy):
    copies = near_copies([["a", "b"]], tared(a=force(1), b=second_log))
    assert copies == ({"a": ("b",), "b": ("a",)} if copy else {})
    # of another direction they are not looked at
    assert near_copies([["a"], ["b"]], tared(a=force(1), b=second_log)) == {}


@pytest.mark.parametrize("hum", [0.05, 0.5, 5.0])
def test_a_hum_that_all_runs_have_in_common_makes_no_copy(hum):
    runs = tared(a=force(1, hum), b=force(2, hum), c=force(3, hum))
    assert near_copies([["a", "b", "c"]], runs) == {}


@pytest.mark.parametrize("digits", [2, 3, 4])
def test_a_hum_far_above_the_noise_makes_no_copy(digits):
    """Their noise correlates by 0.95, yet readings differ by far more than their last digits."""
    chirp = np.sin(np.cumsum(np.linspace(0.6, 2.0, 130)))[:, None]
    names = [f"{number:02}" for number in range(20)]
    runs = {
        name: (force(seed)[:130] + 0.5 * chirp).round(digits) for seed, name in enumerate(names)
    }
    assert near_copies([names], tared(**runs)) == {}
    copy = {"copy": last_digit(runs["03"].round(2))}
    assert near_copies([[*names, "copy"]], tared(**runs, **copy)) == {
        "03": ("copy",),
        "copy": ("03",),
    }


def test_a_jump_where_all_runs_begin_to_move_makes_no_copy():
    def jump(log):
        return log + np.where(np.arange(SIZE) < 50, 0.0, 3.0)[:, None]

    assert near_copies([["a", "b"]], tared(a=jump(force(1)), b=jump(force(2)))) == {}
    assert near_copies([["a", "b"]], tared(a=jump(force(1)), b=jump(force(1))[5:])) != {}


def test_copies_are_found_among_many_repeats_of_any_length():
    """With a hum all of them look alike at some shift."""
    logs = {f"{number:03}": force(number, 0.5)[: 110 + 4 * number] for number in range(75)}
    logs |= {"copy": logs["074"][5:], "other": logs["073"][:300] + 0.1}
    copies = near_copies([list(logs)], tared(**logs))
    assert copies == {"074": ("copy",), "copy": ("074",), "073": ("other",), "other": ("073",)}


def sheet(*names, kind="plate"):
    return {n: SimpleNamespace(run_id=n, kind=kind, intruder="", force_log=n) for n in names}


def test_copies_are_told_from_runs_of_one_file():
    by_id = sheet("a", "b", "c", "d") | sheet("rod1", "rod2", kind="rod")
    by_id["d"].force_log = "c"
    table = pd.DataFrame({"run_id": list(by_id), "readings": ["1", "1", "2", "2", "3", "3"]})
    # c and d are one file by the sheet, the rods may be copies
    assert same_readings(by_id, table) == {"a": ("b",), "b": ("a",), "c": (), "d": ()}
    # one channel is enough
    mixed = table.assign(readings=["1 8", "9 8", "2", "2", "3", "3"])
    assert same_readings(by_id, mixed)["a"] == ("b",)
    # of a log that says nothing there is no digest
    assert same_readings(by_id, table.assign(readings="")) == {}
    # legs are runs too
    assert same_readings(sheet("a", "b", kind="leg"), table[:2]) == {"a": ("b",), "b": ("a",)}
