"""Numbers, names and intervals as the page prints them."""

from __future__ import annotations

import math

from rftfit.report.labels import number

PROFILES = {
    "table": "measured table",
    "fourier": "nine terms",
    "generic": "zeta \N{MULTIPLICATION SIGN} generic",
    "depth_only": "depth-only",
}
"""Names of the profiles for people."""

LEGS = {"c_leg": "c-leg", "flat_leg": "flat leg", "reversed_c_leg": "reversed c-leg"}


def leg_name(leg: str) -> str:
    """Name of a leg for people.

    Parameters
    ----------
    leg : str
        Key of the configuration.

    Returns
    -------
    str
    """
    return LEGS.get(leg, leg)


def profile_name(profile: str) -> str:
    """Name of a profile for people.

    Parameters
    ----------
    profile : str

    Returns
    -------
    str
    """
    return PROFILES.get(profile, profile)


def value(x: object, digits: int = 3) -> str:
    """Write a number, "no value" where it is missing.

    Parameters
    ----------
    x : object
        A number, or None.
    digits : int, optional
        After the point.

    Returns
    -------
    str
    """
    return number(as_float(x), digits)


def span(lo: object, hi: object, digits: int = 3) -> str:
    """Write an interval, nothing where either end is missing.

    Parameters
    ----------
    lo, hi : object
    digits : int, optional

    Returns
    -------
    str
    """
    ends = as_float(lo), as_float(hi)
    if not all(math.isfinite(end) for end in ends):
        return ""
    return f"{number(ends[0], digits)} to {number(ends[1], digits)}"


def percent(x: object) -> str:
    """Write a signed percentage.

    Parameters
    ----------
    x : object

    Returns
    -------
    str
    """
    found = as_float(x)
    if not math.isfinite(found):
        return "no value"
    text = number(found, 0 if abs(found) >= 10 else 1)
    return f"+{text} %" if found > 0 and float(f"{found:.1f}") > 0 else f"{text} %"


def as_float(x: object) -> float:
    """Turn a cell of a table into a number, NaN where it is none.

    Parameters
    ----------
    x : object

    Returns
    -------
    float
    """
    try:
        return float(x)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return math.nan


def text(x: object) -> str:
    """Turn a cell of a table into text, an empty one into nothing.

    Parameters
    ----------
    x : object

    Returns
    -------
    str
    """
    if x is None or (isinstance(x, float) and math.isnan(x)):
        return ""
    return str(x)
