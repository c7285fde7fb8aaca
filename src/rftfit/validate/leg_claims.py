"""What the paper says of forces on legs, beside what its own measurements and this model give."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from rftfit.validate.comparison import DIFFERS, SAME, Item

if TYPE_CHECKING:
    import pandas as pd

C_LEG, FLAT, REVERSED = "c_leg", "flat_leg", "reversed_c_leg"


def leg_claims(
    errors: pd.DataFrame, measured: pd.DataFrame, chi_of: str = "this campaign's"
) -> list[Item]:
    """Compare the paper's statements on leg forces with this campaign.

    Parameters
    ----------
    errors : pandas.DataFrame
        Of the trials stage.
    measured : pandas.DataFrame
        Measured leg curves.
    chi_of : str, optional
        Whose chi the natural sands were scaled with.

    Returns
    -------
    list of Item
        Only the statements that the media of this campaign can meet.
    """
    lift = errors[(errors["component"] == "z") & errors["peak_error_percent"].notna()]
    by_profile = {str(name): part for name, part in lift.groupby("profile")}
    items: list[Item] = []
    if "table" in by_profile:
        items += _within(by_profile["table"])
        items += _order(by_profile["table"], "table")
    if "fourier" in by_profile:
        items += _order(by_profile["fourier"], "nine terms")
    if "depth_only" in by_profile:
        items += _depth_only(by_profile["depth_only"])
    items += _suction(measured)
    generic = by_profile.get("generic")
    if generic is not None:
        laboratory = set(by_profile["table"]["medium"]) if "table" in by_profile else set()
        items += _sands(generic[~generic["medium"].isin(laboratory)], chi_of)
    return items


def _item(
    item: str, where: str, paper: float | str, ours: float | str, same: bool, why: str
) -> Item:
    return Item(item, where, paper, ours, math.nan, math.nan, SAME if same else DIFFERS, why)


def _within(table: pd.DataFrame) -> list[Item]:
    c_leg = table[table["leg"] == C_LEG].set_index("medium")["peak_error_percent"]
    close = int((c_leg.abs() <= 10).sum())
    every = table["peak_error_percent"].to_numpy(float)
    worst = table.iloc[int(np.argmax(np.abs(every)))]
    listed = ", ".join(f"{medium} {value:+.0f} %" for medium, value in c_leg.items())
    within = int((np.abs(every) <= 33).sum())
    return [
        _item("c-leg: media with peak lift within 10 % (measured table)", "text, Fig. 3",
              4, close, close >= 4, listed),
        _item("all legs and media: peak lift within 33 % (measured table), % of cases", "text, Fig. 3",
              100, 100 * within / len(every), within == len(every),
              f"{within} of {len(every)}; worst {_named(worst)}"),
    ]  # fmt: skip


def _named(row: pd.Series[float]) -> str:
    return f"{row['medium']} {row['leg']} {row['peak_error_percent']:+.0f} %"


def _order(lift: pd.DataFrame, name: str) -> list[Item]:
    peaks = lift.pivot_table(index="medium", columns="leg", values="peak_predicted_N")
    if not {FLAT, REVERSED} <= set(peaks.columns):
        return []
    below = peaks[REVERSED] < peaks[FLAT]
    wrong = [f"{m}: {row[REVERSED]:.2f} N above {row[FLAT]:.2f} N"
             for m, row in peaks[~below].iterrows()]  # fmt: skip
    return [
        _item(f"media with the reversed c-leg's peak lift below the flat leg's ({name})",
              "Fig. 3, Fig. S5 (measured: all)", len(below), int(below.sum()), bool(below.all()),
              "; ".join(wrong) or "as in experiment")
    ]  # fmt: skip


def _depth_only(lift: pd.DataFrame) -> list[Item]:
    worst = lift.iloc[int(np.argmax(lift["peak_error_percent"].to_numpy(float)))]
    most = float(worst["peak_error_percent"])
    return [
        _item("depth-only: largest overprediction of peak lift, %", "text", 1400, most,
              abs(most - 1400) <= 140, _named(worst))
    ]  # fmt: skip


def _suction(measured: pd.DataFrame) -> list[Item]:
    part = measured[(measured["leg"] == REVERSED) & (measured["theta_deg"] > 0)]
    least = part.groupby("medium")["force_z_N"].min()
    if least.empty:
        return []
    # four standard deviations of a degree's mean
    down = int((least < -0.2).sum())
    listed = ", ".join(f"{medium} {value:+.2f} N" for medium, value in least.items())
    return [
        _item("reversed c-leg: media with downward force while it leaves", "text, Fig. 3",
              len(least), down, down == len(least), f"least measured lift: {listed}")
    ]  # fmt: skip


def _sands(generic: pd.DataFrame, chi_of: str) -> list[Item]:
    c_leg = generic[generic["leg"] == C_LEG].set_index("medium")
    items = [
        _item(f"{medium}: c-leg peak lift overpredicted by the scaled generic profile, %",
              "text, Fig. S12", 35, float(row["peak_error_percent"]),
              abs(float(row["peak_error_percent"]) - 35) <= 10,
              f"zeta by {chi_of} chi; the paper's figure used 0.87 alpha_z, its text 0.8")
        for medium, row in c_leg.iterrows()
    ]  # fmt: skip
    peaks = generic.pivot_table(index="medium", columns="leg", values="peak_measured_N")
    for medium in peaks.index:
        sieved = f"{medium}_sieved"
        if sieved in peaks.index and C_LEG in peaks.columns:
            drop = 100 * (1 - peaks.loc[sieved] / peaks.loc[medium])
            value = float(drop[C_LEG])
            listed = ", ".join(f"{leg} {part:.0f} %" for leg, part in drop.items())
            items.append(
                _item(f"{medium}: drop of measured c-leg peak lift by sieving, %", "text, Fig. S12",
                      14, value, bool(np.isclose(value, 14, atol=2)), listed)
            )  # fmt: skip
    return items
