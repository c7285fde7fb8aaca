"""Words, numbers and units as figures print them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

PER_CM3 = r"N/cm$^3$"
PER_CM2 = r"N/cm$^2$"


def title_of(medium: str, titles: Mapping[str, str] | None) -> str:
    """Name of a medium in figures, safe from being read as mathematics.

    Parameters
    ----------
    medium : str
    titles : mapping of str to str, optional
        Names by medium; a medium that is not in it goes by its own key.

    Returns
    -------
    str
    """
    return plain((titles or {}).get(medium, medium))


def plain(text: str) -> str:
    """Escape a user's text so that a dollar sign in it does not start mathematics.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
    """
    return text.replace("$", r"\$")


def alpha_label(component: str) -> str:
    """Return the label of alpha_z or alpha_x, with its unit.

    Parameters
    ----------
    component : {"z", "x"}

    Returns
    -------
    str
    """
    return rf"$\alpha_{component}$ ({PER_CM3})"


def number(value: float, digits: int = 3) -> str:
    """Write a number with a true minus sign; "no value" for NaN.

    Parameters
    ----------
    value : float
    digits : int
        Digits after the point.

    Returns
    -------
    str
    """
    if math.isnan(value):
        return "no value"
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.lstrip("-")
    return text.replace("-", "\N{MINUS SIGN}")


def degrees(value: float) -> str:
    """Write an angle as 18.4 deg, 90 deg, with the degree sign and a true minus.

    Parameters
    ----------
    value : float
        Degrees.

    Returns
    -------
    str
    """
    return number(value, 0 if abs(value - round(value)) < 0.005 else 1) + "\N{DEGREE SIGN}"
